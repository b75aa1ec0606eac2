// A ring buffer of images in preallocated arrays. File format, all little-endian: "SELDCINE", version, tool nodes, vessel nodes, images (4 bytes each); with
// several tools, which is version 3, the number of tools and the largest number of nodes of each of four; the images, field by field in the order of
// walk_frame(); FNV-1a
// of all preceding bytes (8 bytes).
#include "render/cine.h"

#include "render/message.h"
#include "render/movie_file.h"
#include "render/pulse_clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "files are little-endian");

enum { MOST_NODES = 100000, MOST_CONTRAST = 10000000, MOST_FRAMES = 1000000, ONE_TOOL = 1, SAME_TOOLS = 2, SEVERAL_TOOLS = 3 };
static const uint64_t MOST_BYTES = (uint64_t)8 << 30;
static const char magic[] = "SELDCINE";

struct Cine {
    CineShape shape;
    int node_count;          // of all tools
    int capacity;
    int first, count;        // ring buffer
    int64_t dropped;
    bool is_recording, is_locked;
    Pose *pose;              // (capacity) pointing into the arrays below
    uint32_t *pulse;         // (capacity)
    Vec3 *position;          // (capacity, node_count)
    Quat *quaternion;
    NodeReport *node;
    ToolNode *tool_node;     // (capacity, node_count) one tool after the other
    float *contrast;         // (capacity, shape.contrast_count)
};

CineShape cine_shape_for(const Pose *pose, int contrast_count)
{
    CineShape shape = {.tool_count = pose->tool_count, .contrast_count = contrast_count};
    for (int k = 0; k < pose->tool_count; k++)
        shape.tool_nodes[k] = pose->tool[k].node_capacity;
    return shape;
}

bool cine_shapes_same(const CineShape *a, const CineShape *b)
{
    bool same = a->tool_count == b->tool_count && a->contrast_count == b->contrast_count;
    for (int k = 0; same && k < a->tool_count; k++)
        same = a->tool_nodes[k] == b->tool_nodes[k];
    return same;
}

// 0 if a count is out of range.
static int nodes_of(const CineShape *shape)
{
    int sum = 0;
    if (shape->tool_count < 1 || shape->tool_count > STEP_TOOLS_MAX)
        return 0;
    for (int k = 0; k < shape->tool_count; k++) {
        if (shape->tool_nodes[k] < 1 || shape->tool_nodes[k] > MOST_NODES)
            return 0;
        sum += shape->tool_nodes[k];
    }
    return sum;
}

size_t cine_bytes(const CineShape *shape, int capacity)
{
    int nodes = nodes_of(shape);
    if (nodes == 0 || shape->contrast_count < 0 || shape->contrast_count > MOST_CONTRAST || capacity < 1 || capacity > MOST_FRAMES)
        return 0;
    uint64_t image = sizeof(Pose) + sizeof(uint32_t) + (uint64_t)nodes * (sizeof(Vec3) + sizeof(Quat) + sizeof(NodeReport) + sizeof(ToolNode)) +
                     (uint64_t)shape->contrast_count * sizeof(float);
    uint64_t bytes = image * (uint64_t)capacity;
    return bytes <= MOST_BYTES ? (size_t)bytes : 0;
}

Cine *cine_create(const CineShape *shape, int capacity)
{
    Cine *cine = cine_bytes(shape, capacity) > 0 ? calloc(1, sizeof *cine) : NULL;
    if (!cine)
        return NULL;
    int node_count = nodes_of(shape);
    size_t frames = (size_t)capacity, nodes = frames * (size_t)node_count;
    *cine = (Cine){.shape = *shape,
                   .node_count = node_count,
                   .capacity = capacity,
                   .pose = calloc(frames, sizeof *cine->pose),
                   .pulse = calloc(frames, sizeof *cine->pulse),
                   .position = calloc(nodes, sizeof *cine->position),
                   .quaternion = calloc(nodes, sizeof *cine->quaternion),
                   .node = calloc(nodes, sizeof *cine->node),
                   .tool_node = calloc(nodes, sizeof *cine->tool_node),
                   .contrast = calloc(frames * (size_t)shape->contrast_count + 1, sizeof *cine->contrast)};
    if (!cine->pose || !cine->pulse || !cine->position || !cine->quaternion || !cine->node || !cine->tool_node || !cine->contrast) {
        cine_free(cine);
        return NULL;
    }
    for (int i = 0; i < capacity; i++) {
        size_t at = (size_t)i * (size_t)node_count;
        Pose *pose = &cine->pose[i];
        *pose = (Pose){.tool_count = shape->tool_count,
                       .node_capacity = node_count,
                       .node_count = node_count,
                       .position = cine->position + at,
                       .quaternion = cine->quaternion + at,
                       .node = cine->node + at};
        for (int k = 0; k < shape->tool_count; k++) {
            pose->tool[k] = (PoseTool){.node_capacity = shape->tool_nodes[k], .node_count = shape->tool_nodes[k], .node = cine->tool_node + at};
            at += (size_t)shape->tool_nodes[k];
        }
    }
    return cine;
}

void cine_free(Cine *cine)
{
    if (!cine)
        return;
    free(cine->pose);
    free(cine->pulse);
    free(cine->position);
    free(cine->quaternion);
    free(cine->node);
    free(cine->tool_node);
    free(cine->contrast);
    free(cine);
}

static int slot(const Cine *cine, int index) { return (cine->first + index) % cine->capacity; }
static float *contrast_of(const Cine *cine, int place) { return cine->contrast + (size_t)place * (size_t)cine->shape.contrast_count; }

// --- recording ---

bool cine_record(Cine *cine)
{
    if (cine->is_locked)
        return false;
    cine->first = cine->count = 0;
    cine->dropped = 0;
    return cine->is_recording = true;
}

void cine_stop(Cine *cine) { cine->is_recording = false; }
bool cine_is_recording(const Cine *cine) { return cine->is_recording; }
void cine_lock(Cine *cine, bool locked) { cine->is_locked = locked; }

bool cine_add(Cine *cine, const CineFrame *frame)
{
    bool is_known = cine->count > 0 && cine->pulse[slot(cine, cine->count - 1)] == frame->pulse, is_full = cine->count == cine->capacity;
    CineShape shape = cine_shape_for(frame->pose, cine->shape.contrast_count);
    bool fits = cine_shapes_same(&shape, &cine->shape) && frame->pose->node_count <= cine->node_count;
    if (!cine->is_recording || is_known || !fits || (is_full && cine->is_locked))
        return false;
    if (is_full) {
        cine->first = slot(cine, 1);
        cine->count--;
        cine->dropped++;
    }
    int place = slot(cine, cine->count++);
    pose_copy(&cine->pose[place], frame->pose);
    cine->pulse[place] = frame->pulse;
    float *contrast = contrast_of(cine, place);
    for (int i = 0; i < cine->shape.contrast_count; i++)
        contrast[i] = frame->contrast ? frame->contrast[i] : 0;
    return true;
}

CineShape cine_shape(const Cine *cine) { return cine->shape; }
int cine_capacity(const Cine *cine) { return cine->capacity; }
int cine_count(const Cine *cine) { return cine->count; }
int64_t cine_dropped(const Cine *cine) { return cine->dropped; }

CineFrame cine_frame(const Cine *cine, int index)
{
    int place = slot(cine, index);
    return (CineFrame){&cine->pose[place], cine->shape.contrast_count > 0 ? contrast_of(cine, place) : NULL, cine->pulse[place]};
}

double cine_frame_s(const Cine *cine, int index)
{
    const Pose *pose = cine_frame(cine, index).pose;
    double between = 1 / pulse_clock_rate(&pose->xray);
    if (index + 1 >= cine->count)
        return between;
    double gap = cine_frame(cine, index + 1).pose->time_s - pose->time_s;
    return gap > 0 && gap < 1.5 * between ? gap : between;
}

double cine_duration_s(const Cine *cine)
{
    double sum = 0;
    for (int i = 0; i < cine->count; i++)
        sum += cine_frame_s(cine, i);
    return sum;
}

// --- replay ---

CinePlayer cine_player_start(const Cine *cine) { return (CinePlayer){.is_playing = true, .loops = true, .speed = 1, .frame = cine->count > 0 ? 0 : -1}; }

int cine_player_advance(CinePlayer *player, const Cine *cine, double dt_s)
{
    if (cine->count == 0)
        return player->frame = -1;
    player->frame = player->frame < 0 ? 0 : player->frame < cine->count ? player->frame : cine->count - 1;
    if (!player->is_playing || !(dt_s > 0))
        return player->frame;
    double speed = player->speed >= 0.1 ? fmin(player->speed, 4) : 0.1;
    player->shown_s += player->loops ? fmod(dt_s * speed, cine_duration_s(cine)) : dt_s * speed;
    for (double length; player->shown_s >= (length = cine_frame_s(cine, player->frame));) {
        if (player->frame + 1 == cine->count && !player->loops) {
            player->is_playing = false;
            player->shown_s = 0;
            break;
        }
        player->shown_s -= length;
        player->frame = (player->frame + 1) % cine->count;
    }
    return player->frame;
}

// --- files ---

// Reads or writes; `good` becomes false permanently if bytes are missing.
typedef struct Cursor {
    uint8_t *out;            // NULL: read
    const uint8_t *in;
    size_t at, length;
    bool good;
    uint32_t version;
} Cursor;

static void walk(Cursor *cursor, void *value, size_t size)
{
    if (!cursor->good || size > cursor->length - cursor->at) {
        cursor->good = false;
        return;
    }
    if (cursor->out)
        memcpy(cursor->out + cursor->at, value, size);
    else
        memcpy(value, cursor->in + cursor->at, size);
    cursor->at += size;
}

// WALK(cursor, variable): one field.
#define WALK(cursor, value) walk(cursor, &(value), sizeof(value))

static void walk_report(Cursor *cursor, StepReport *report)
{
    WALK(cursor, report->flags);
    WALK(cursor, report->candidates);
    WALK(cursor, report->active);
    WALK(cursor, report->iterations);
    WALK(cursor, report->residual);
    WALK(cursor, report->cone_violation);
    WALK(cursor, report->penetration);
    WALK(cursor, report->proximal_force);
    WALK(cursor, report->proximal_torque);
    WALK(cursor, report->wall_force_max);
    WALK(cursor, report->wall_force_sum);
    WALK(cursor, report->newton);
}

static void walk_tool(Cursor *cursor, PoseTool *tool)
{
    WALK(cursor, tool->command.push_mm_s);
    WALK(cursor, tool->command.twist_deg_s);
    WALK(cursor, tool->inserted_mm);
    WALK(cursor, tool->push_n);
    WALK(cursor, tool->torque_n_mm);
    if (cursor->version == SEVERAL_TOOLS) {
        WALK(cursor, tool->fitted);
        WALK(cursor, tool->node_count);
    }
    if (tool->node_count < 1 || tool->node_count > tool->node_capacity || tool->fitted < 0 || tool->fitted > EXCHANGES_MOST) {
        cursor->good = false;
        tool->node_count = tool->node_capacity;
        tool->fitted = 0;
    }
    for (int j = 0; j < tool->node_count; j++) {
        ToolNode *node = &tool->node[j];
        WALK(cursor, node->s);
        WALK(cursor, node->position);
        WALK(cursor, node->orientation);
        WALK(cursor, node->radius);
        WALK(cursor, node->carrier);
    }
}

// The controls that affect an image: all except the tool for contrast agent.
enum { XRAY_BYTES = XRAY_VALUES_BEFORE_TOOLS * (int)sizeof(float) };

static void walk_frame(Cursor *cursor, Cine *cine, int place)
{
    Pose *pose = &cine->pose[place];
    bool has_several = cine->shape.tool_count > 1;
    WALK(cursor, cine->pulse[place]);
    WALK(cursor, pose->step);
    WALK(cursor, pose->time_s);
    WALK(cursor, pose->command.push_mm_s);
    WALK(cursor, pose->command.twist_deg_s);
    walk(cursor, &pose->xray, XRAY_BYTES);
    WALK(cursor, pose->inserted_mm);
    if (has_several)
        WALK(cursor, pose->node_count);
    WALK(cursor, pose->first_free_node);
    walk_report(cursor, &pose->report);
    if (pose->node_count < 1 || pose->node_count > cine->node_count) {
        cursor->good = false;
        pose->node_count = cine->node_count;
    }
    walk(cursor, pose->position, (size_t)pose->node_count * sizeof *pose->position);
    walk(cursor, pose->quaternion, (size_t)pose->node_count * sizeof *pose->quaternion);
    for (int i = 0; i < pose->node_count; i++) {
        NodeReport *node = &pose->node[i];
        WALK(cursor, node->s);
        WALK(cursor, node->radius);
        WALK(cursor, node->force);
        WALK(cursor, node->gap);
        WALK(cursor, node->vessel_node);
    }
    for (int k = 0; has_several && k < pose->tool_count; k++)
        walk_tool(cursor, &pose->tool[k]);
    if (!has_several && !cursor->out)
        pose_fill_single_tool(pose);
    walk(cursor, contrast_of(cine, place), (size_t)cine->shape.contrast_count * sizeof *cine->contrast);
}

enum {
    HEAD_BYTES = 8 + 4 * 4,
    TOOLS_BYTES = 4 + STEP_TOOLS_MAX * 4,
    FRAME_BYTES = 4 + 8 + 8 + 2 * 8 + XRAY_BYTES + 8 + 4 + 4 * 4 + 7 * 8 + 4,
    NODE_BYTES = 3 * 8 + 4 * 8 + 6 * 8 + 4,
    TOOL_BYTES = 5 * 8,
    DEVICE_BYTES = 2 * 4,
    TOOL_NODE_BYTES = 9 * 8 + 4
};

// Size of a file with `count` images whose centrelines have `line_nodes` nodes in total and whose tools, if there are several, `tool_nodes`.
static uint64_t file_bytes(const CineShape *shape, uint32_t version, int count, uint64_t line_nodes, uint64_t tool_nodes)
{
    bool has_several = shape->tool_count > 1;
    uint64_t tools = has_several ? 4 + (uint64_t)shape->tool_count * (uint64_t)(TOOL_BYTES + (version == SEVERAL_TOOLS ? DEVICE_BYTES : 0)) : 0;
    uint64_t head = (uint64_t)HEAD_BYTES + (has_several ? TOOLS_BYTES : 0), image = FRAME_BYTES + tools + (uint64_t)shape->contrast_count * 4;
    return head + 8 + line_nodes * NODE_BYTES + (has_several ? tool_nodes * TOOL_NODE_BYTES : 0) + (uint64_t)count * image;
}

static uint64_t checksum(const uint8_t *bytes, size_t length)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < length; i++)
        hash = (hash ^ bytes[i]) * 0x100000001b3u;
    return hash;
}

static void walk_head(Cursor *cursor, CineShape *shape, int32_t *count)
{
    char mark[8];
    memcpy(mark, magic, 8);
    int32_t nodes[3] = {nodes_of(shape), shape->contrast_count, *count};
    cursor->version = shape->tool_count > 1 ? SEVERAL_TOOLS : ONE_TOOL;
    WALK(cursor, mark);
    WALK(cursor, cursor->version);
    WALK(cursor, nodes);
    if (memcmp(mark, magic, sizeof mark) != 0)
        cursor->version = 0;
    if (cursor->version == SAME_TOOLS || cursor->version == SEVERAL_TOOLS) {
        WALK(cursor, shape->tool_count);
        WALK(cursor, shape->tool_nodes);
    } else {
        shape->tool_count = 1;
        shape->tool_nodes[0] = nodes[0];
    }
    bool is_whole = cursor->good && (cursor->version == ONE_TOOL || nodes[0] == nodes_of(shape));
    shape->tool_count = is_whole ? shape->tool_count : 0;
    shape->contrast_count = nodes[1];
    *count = nodes[2];
}

uint8_t *cine_pack(const Cine *cine, size_t *length)
{
    uint64_t line_nodes = 0, tool_nodes = 0;
    for (int i = 0; i < cine->count; i++) {
        const Pose *pose = &cine->pose[slot(cine, i)];
        line_nodes += (uint64_t)pose->node_count;
        for (int k = 0; k < pose->tool_count; k++)
            tool_nodes += (uint64_t)pose->tool[k].node_count;
    }
    *length = (size_t)file_bytes(&cine->shape, SEVERAL_TOOLS, cine->count, line_nodes, tool_nodes);
    Cursor cursor = {.out = malloc(*length), .length = *length, .good = true};
    if (!cursor.out)
        return NULL;
    int32_t count = cine->count;
    Cine ring = *cine;   // walk_frame() writes to it only when it reads a file
    walk_head(&cursor, &ring.shape, &count);
    for (int i = 0; i < cine->count; i++)
        walk_frame(&cursor, &ring, slot(cine, i));
    uint64_t sum = checksum(cursor.out, cursor.at);
    WALK(&cursor, sum);
    return cursor.out;
}

static bool all_finite(const double *value, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(value[i]))
            return false;
    return true;
}

static bool is_unit(Quat q) { return fabs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) < 1e-6; }

static bool tool_is_sound(const PoseTool *tool, int tools)
{
    const double figures[] = {tool->command.push_mm_s, tool->command.twist_deg_s, tool->inserted_mm, tool->push_n, tool->torque_n_mm};
    bool good = all_finite(figures, sizeof figures / sizeof *figures);
    for (int j = 0; good && j < tool->node_count; j++) {
        const ToolNode *node = &tool->node[j];
        good = isfinite(node->s) && vec3_is_finite(node->position) && is_unit(node->orientation) && node->radius > 0 && isfinite(node->radius) &&
               node->carrier >= -1 && node->carrier < tools;
    }
    return good;
}

// Checks what drawing relies on. Returns NULL, or what was expected.
static const char *frame_fault(const Cine *cine, int index)
{
    const Pose *pose = &cine->pose[index];
    const float *xray = (const float *)&pose->xray, *contrast = contrast_of(cine, index);
    const double figures[] = {pose->time_s,
                              pose->command.push_mm_s,
                              pose->command.twist_deg_s,
                              pose->inserted_mm,
                              pose->report.residual,
                              pose->report.cone_violation,
                              pose->report.penetration,
                              pose->report.proximal_force,
                              pose->report.proximal_torque,
                              pose->report.wall_force_max,
                              pose->report.wall_force_sum};
    for (int i = 0; i < XRAY_VALUES; i++)
        if (!isfinite(xray[i]))
            return "expected X-ray settings that are finite numbers";
    if (!(pose->xray.field_mm > 0) || !all_finite(figures, sizeof figures / sizeof *figures))
        return "expected finite times, forces and lengths, and a field above 0";
    if (pose->first_free_node < 0 || pose->first_free_node >= pose->node_count)
        return "expected the first node outside the sheath to be a node of the tool";
    for (int k = 0; k < pose->tool_count; k++)
        if (!tool_is_sound(&pose->tool[k], pose->tool_count))
            return "expected tool nodes with finite positions, radii above 0 and unit quaternions, each in one of the tools or in none (-1)";
    for (int i = 0; i < pose->node_count; i++) {
        const NodeReport *node = &pose->node[i];
        if (!vec3_is_finite(pose->position[i]) || !vec3_is_finite(node->force) || !isfinite(node->s) || !(node->radius > 0) || !isfinite(node->radius) ||
            isnan(node->gap) || !is_unit(pose->quaternion[i]))
            return "expected tool nodes with finite positions and forces, radii above 0, and unit quaternions";
        if (node->vessel_node < -1 || (cine->shape.contrast_count > 0 && node->vessel_node >= cine->shape.contrast_count))
            return "expected each tool node at a node of the vessel, or at none (-1)";
    }
    for (int i = 0; i < cine->shape.contrast_count; i++)
        if (!(contrast[i] >= 0 && contrast[i] <= 1))
            return "expected concentrations from 0 to 1";
    return NULL;
}

Cine *cine_unpack(const uint8_t *bytes, size_t length, const char *name, Faults *faults)
{
    Cursor cursor = {.in = bytes, .length = length, .good = true};
    int32_t count = 0;
    CineShape shape = {0};
    walk_head(&cursor, &shape, &count);
    if (!cursor.good || cursor.version < ONE_TOOL || cursor.version > SEVERAL_TOOLS) {
        faults_add_at_byte(faults, name, 0, "is not a cine loop of version %d to %d; expected a file saved by the trainer", ONE_TOOL, SEVERAL_TOOLS);
        return NULL;
    }
    if (count < 0 || cine_bytes(&shape, count > 0 ? count : 1) == 0 || (cursor.version > ONE_TOOL && shape.tool_count < 2)) {
        faults_add_at_byte(faults, name, 12,
                           "says %d tools of %d nodes, %d vessel nodes and %d images; 1 to %d (2 or more from version 2 on), each of 1 to %d nodes, 0 to %d, "
                           "0 to %d, and 8 GB in total",
                           shape.tool_count, nodes_of(&shape), shape.contrast_count, (int)count, STEP_TOOLS_MAX, MOST_NODES, MOST_CONTRAST, MOST_FRAMES);
        return NULL;
    }
    // with several tools the number of centreline nodes is given by each image; since version 3 also the number of tool nodes
    uint64_t all = (uint64_t)count * (uint64_t)nodes_of(&shape);
    uint64_t expected = file_bytes(&shape, cursor.version, count, cursor.version == ONE_TOOL ? all : 0, cursor.version == SEVERAL_TOOLS ? 0 : all);
    if (cursor.version == ONE_TOOL ? expected != length : expected > length || file_bytes(&shape, cursor.version, count, all, all) < length) {
        faults_add_at_byte(faults, name, length, "has %zu bytes; its header requires %llu%s: the file is damaged", length, (unsigned long long)expected,
                           cursor.version == ONE_TOOL ? "" : " at least");
        return NULL;
    }
    Cine *cine = cine_create(&shape, count > 0 ? count : 1);
    if (!cine) {
        faults_add(faults, name, 0, 0, "out of memory for its %d images", (int)count);
        return NULL;
    }
    const char *fault = NULL;
    size_t at = 0;
    for (int i = 0; i < count && !fault; i++) {
        at = cursor.at;
        walk_frame(&cursor, cine, i);
        fault = cursor.good ? frame_fault(cine, i) : "expected no more nodes of centreline and tools than the file header says";
    }
    uint64_t sum = 0;
    WALK(&cursor, sum);
    if (fault)
        faults_add_at_byte(faults, name, at, "an image is invalid: %s; the file is damaged", fault);
    else if (cursor.at != length || sum != checksum(bytes, length - sizeof sum))
        faults_add_at_byte(faults, name, length - sizeof sum, "the checksum does not match; the file is damaged");
    else {
        cine->count = count;
        return cine;
    }
    cine_free(cine);
    return NULL;
}

bool cine_movie(const Cine *cine, const char *path, int width, int height, CineDraw draw, void *context, char *message, size_t capacity)
{
    if (cine->count == 0)
        return message_fail(message, capacity, "%s: the cine loop is empty: record some images first", path);
    double rate = 0;
    for (int i = 0; i < cine->count; i++)
        rate = fmax(rate, pulse_clock_rate(&cine_frame(cine, i).pose->xray));
    MovieFile *movie = movie_file_create(path, width, height, rate, message, capacity);
    if (!movie)
        return false;
    uint8_t *rgb = malloc((size_t)width * (size_t)height * 3);
    if (!rgb) {
        movie_file_abandon(movie);
        return message_fail(message, capacity, "%s: out of memory", path);
    }
    bool drawn = true, going = true;
    double shown = 0;   // the number of repeats is computed from the end of each image, to avoid drift
    for (int i = 0; i < cine->count && drawn && going; i++) {
        CineFrame frame = cine_frame(cine, i);
        drawn = draw(context, &frame, rgb, message, capacity);
        shown += cine_frame_s(cine, i);
        while (drawn && going && movie_file_count(movie) < (int)lround(shown * rate))
            going = movie_file_add(movie, rgb);
    }
    free(rgb);
    if (drawn)
        return movie_file_close(movie, message, capacity);
    movie_file_abandon(movie);
    return false;
}

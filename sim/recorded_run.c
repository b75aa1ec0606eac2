// Reads a recording (recon/hdf5_reader.h checks its contents). Rows that only some of the datasets have yet (in a file still being written) are ignored.
#include "sim/recording.h"
#include "base/base.h"

#include "recon/recon.h"

#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Reader {
    Hdf5Reader *file;
    const char *path;
    Faults *faults;
    bool is_finite;          // refuse NaN and infinity in datasets read from here on
    bool has_motion;         // frames are read from /motion
} Reader;

// Reads a dataset of `rank` dimensions whose trailing ones are shape[1 …] (0: any, filled in); shape[0] is filled in. NULL with a fault.
static void *read_dataset(const Reader *reader, const char *name, Hdf5Type type, int rank, uint64_t *shape)
{
    Hdf5Dataset dataset = {.path = name, .type = type, .rank = rank, .is_finite = reader->is_finite};
    memcpy(dataset.size + 1, shape + 1, (size_t)(rank - 1) * sizeof *shape);
    void *values = hdf5_read(reader->file, &dataset);
    memcpy(shape, dataset.size, (size_t)rank * sizeof *shape);
    return values;
}

#define MOST_TIME_S 1e7      // a hundred days

static int64_t least(int64_t a, uint64_t b) { return (uint64_t)a < b ? a : (int64_t)b; }

static bool has(const Reader *reader, const char *name) { return hdf5_has(reader->file, name); }

// --- motion: poses between a session's frames (sim/recording.h) ---

// The unit of a dataset's motion.
static double unit_of(const Reader *reader, const char *name)
{
    static const struct {
        const char *leaf, *unit;
    } known[] = {{"position", "motion_length_mm"}, {"gap_mm", "motion_length_mm"}, {"s_mm", "motion_length_mm"},
                 {"quaternion", "motion_turn"},    {"force_n", "motion_force_n"},  {"radius_mm", "motion_radius_mm"}};
    const char *leaf = strrchr(name, '/') + 1;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (!strcmp(leaf, known[i].leaf))
            return hdf5_number(reader->file, known[i].unit, 1);
    return 1;
}

static size_t bytes_of(Hdf5Type type) { return type == HDF5_DOUBLE ? sizeof(double) : type == HDF5_INT8 ? 1 : sizeof(float); }

static void put_units(Hdf5Type type, void *values, size_t i, int32_t units, double unit)
{
    double value = fabs((double)units) < MOTION_MOST ? units * unit : copysign(INFINITY, units);
    if (type == HDF5_DOUBLE)
        ((double *)values)[i] = value;
    else if (type == HDF5_FLOAT)
        ((float *)values)[i] = (float)value;
    else if (type == HDF5_INT32)
        ((int32_t *)values)[i] = units;
    else
        ((int8_t *)values)[i] = (int8_t)units;
}

// Sums up the changes. A frame's changes are stored as (parts, nodes), its values as (nodes, parts).
static void add_up(const uint32_t *change, uint64_t frames, uint64_t nodes, uint64_t parts, Hdf5Type type, double unit, uint32_t *now, void *values)
{
    for (uint64_t k = 0; k < frames; k++)
        for (uint64_t part = 0; part < parts; part++) {
            uint32_t moved = 0;      // change of the previous node
            for (uint64_t node = 0; node < nodes; node++) {
                uint32_t relative = *change++, *at = &now[part * nodes + node];
                moved += relative >> 1 ^ (relative & 1 ? UINT32_MAX : 0);
                *at += moved;
                put_units(type, values, (k * nodes + node) * parts + part, (int32_t)*at, unit);
            }
        }
}

// The frames' dataset `name`, reconstructed from /motion; `shape` as for read_dataset. NULL with a fault.
static void *read_motion(const Reader *reader, const char *name, Hdf5Type type, int rank, uint64_t *shape)
{
    char path[64];
    uint64_t changes[3] = {0};
    for (int i = 1; i < rank; i++)
        changes[i] = shape[rank - i];
    snprintf(path, sizeof path, "/motion%s", name);
    uint32_t *change = read_dataset(reader, path, HDF5_UINT32, rank, changes);
    if (!change)
        return NULL;
    shape[0] = changes[0];
    if (rank > 1)
        shape[1] = changes[rank - 1];
    uint64_t nodes = rank > 1 ? shape[1] : 1, parts = rank == 3 ? changes[1] : 1;
    if (changes[0] == 0)     // a shape without values needs no data
        nodes = 0;
    uint32_t *now = calloc(nodes * parts + 1, sizeof *now);
    void *values = calloc(changes[0] * nodes * parts + 1, bytes_of(type));
    if (now && values) {
        add_up(change, changes[0], nodes, parts, type, unit_of(reader, name), now, values);
    } else {
        faults_add(reader->faults, reader->path, 0, 0, "%s needs more memory than there is", path);
        free(values);
        values = NULL;
    }
    free(now);
    free(change);
    return values;
}

// Reads a dataset with one entry per frame.
static void *read_frames_of(const Reader *reader, const char *name, Hdf5Type type, int rank, uint64_t *shape)
{
    return reader->has_motion ? read_motion(reader, name, type, rank, shape) : read_dataset(reader, name, type, rank, shape);
}

// --- several tools ---

// As in a scene (sim/scene_tools.c): names safe for script headers, CSV and terminals.
static bool is_name(const char *text)
{
    bool good = *text && strlen(text) < TOOL_NAME_SIZE;
    for (const char *c = text; good && *c; c++)
        good = *c != '.' && *c != ',' && !isspace((unsigned char)*c) && !iscntrl((unsigned char)*c);
    return good;
}

static void copy_attribute(const Reader *reader, const char *group, const char *name, char text[TOOL_NAME_SIZE])
{
    char *read = hdf5_text_attribute(reader->file, group, name);
    if (read && is_name(read))
        strcpy(text, read);
    else
        faults_add(reader->faults, reader->path, 0, 0, "%s has no string attribute '%s' of at most %d letters", group, name, TOOL_NAME_SIZE - 1);
    free(read);
}

enum { GROUP_NAME = 24 };
static void tool_group(int tool, char group[GROUP_NAME]) { snprintf(group, GROUP_NAME, "/tools/%d", tool); }

static bool count_tools(const Reader *reader, RecordedRun *run)
{
    char group[GROUP_NAME] = "/tools/0";
    run->tool_count = 1;
    if (!has(reader, "/tools"))
        return true;
    for (run->tool_count = 0; run->tool_count <= STEP_TOOLS_MAX && has(reader, group);)
        tool_group(++run->tool_count, group);
    if (run->tool_count < 2 || run->tool_count > STEP_TOOLS_MAX) {
        faults_add(reader->faults, reader->path, 0, 0, "/tools does not hold the groups 0 to 1 and up to 3 of several tools");
        run->tool_count = 1;
        return false;
    }
    return true;
}

// The per-step values of a tool; the first tool's are also at the root, as for a single tool.
static int64_t read_tool_series(const Reader *reader, const char *group, RecordedTool *tool)
{
    uint64_t command[2] = {0, 2}, proximal[2] = {0, 2}, inserted[1] = {0}, released[1] = {0};
    char name[4][40];
    static const char *const what[] = {"command", "proximal", "inserted_mm", "released"};
    for (int i = 0; i < 4; i++)
        snprintf(name[i], sizeof name[i], "%s/%s", group, what[i]);
    tool->command = read_dataset(reader, name[0], HDF5_DOUBLE, 2, command);
    tool->proximal = read_dataset(reader, name[1], HDF5_DOUBLE, 2, proximal);
    tool->inserted = read_dataset(reader, name[2], HDF5_DOUBLE, 1, inserted);
    bool knows_release = *group || has(reader, name[3]);      // missing in recordings made before tools could be released
    tool->released = knows_release ? read_dataset(reader, name[3], HDF5_UINT8, 1, released) : NULL;
    int64_t count = least(least((int64_t)command[0], proximal[0]), inserted[0]);
    return knows_release ? least(count, released[0]) : count;
}

// The device requested and the device inserted in every step, if tools could be exchanged.
static int64_t read_exchanges(const Reader *reader, RecordedRun *run)
{
    uint64_t size[3] = {0, (uint64_t)run->tool_count, 2};
    run->exchange = read_dataset(reader, "/exchange", HDF5_UINT8, 3, size);
    for (uint64_t i = 0; run->exchange && i < 2 * size[0] * size[1]; i++)
        if (run->exchange[i] > EXCHANGES_MOST) {
            faults_add(reader->faults, reader->path, 0, 0, "/exchange names device %d in step %llu; expected 0 to %d", run->exchange[i],
                       (unsigned long long)(i / size[1] / 2), EXCHANGES_MOST);
            break;
        }
    return (int64_t)size[0];
}

// Node count of each device: the profile is NaN beyond it.
static void count_device_nodes(const Reader *reader, const char *group, RecordedTool *tool)
{
    for (int i = 0; i < tool->device_count; i++) {
        const double *s = tool->s + (size_t)i * (size_t)tool->node_count;
        int *count = &tool->device_nodes[i];
        while (*count < tool->node_count && !isnan(s[*count]))
            ++*count;
        if (*count < 2)
            faults_add(reader->faults, reader->path, 0, 0, "%s/s_mm holds %d nodes of device %d; expected at least 2", group, *count, i);
    }
}

// The per-frame values of a tool and its devices' profiles; for a tool that cannot be exchanged a single profile, as a plain list.
static int64_t read_tool_frames(const Reader *reader, const char *group, bool is_exchanged, RecordedTool *tool)
{
    int rank = is_exchanged ? 2 : 1;
    uint64_t s[2] = {0, 0}, radius[2] = {0, 0}, position[3] = {0, 0, 3}, quaternion[3] = {0, 0, 4}, carrier[2] = {0, 0};
    char name[5][40];
    static const char *const what[] = {"s_mm", "radius_mm", "position", "quaternion", "carrier"};
    for (int i = 0; i < 5; i++)
        snprintf(name[i], sizeof name[i], "%s/%s", group, what[i]);
    tool->s = read_dataset(reader, name[0], HDF5_DOUBLE, rank, s);
    tool->radius = read_dataset(reader, name[1], HDF5_DOUBLE, rank, radius);
    uint64_t nodes = s[rank - 1], devices = is_exchanged ? s[0] : 1;
    position[1] = quaternion[1] = carrier[1] = nodes;
    tool->position = read_frames_of(reader, name[2], HDF5_DOUBLE, 3, position);
    tool->quaternion = read_frames_of(reader, name[3], HDF5_DOUBLE, 3, quaternion);
    tool->carrier = read_frames_of(reader, name[4], HDF5_INT8, 2, carrier);
    if (nodes < 2 || nodes > 100000 || radius[rank - 1] != nodes || radius[0] != s[0]) {
        faults_add(reader->faults, reader->path, 0, 0, "%s holds %llu nodes and %llu radii; expected 2 to 100000 of each", group, (unsigned long long)nodes,
                   (unsigned long long)radius[rank - 1]);
    } else if (devices < 1 || devices > 1 + EXCHANGES_MOST) {
        faults_add(reader->faults, reader->path, 0, 0, "%s/s_mm has %llu devices; expected 1 to %d", group, (unsigned long long)devices, 1 + EXCHANGES_MOST);
    } else if (tool->s) {
        tool->node_count = (int)nodes;
        tool->device_count = (int)devices;
        count_device_nodes(reader, group, tool);
    }
    return least(least((int64_t)position[0], quaternion[0]), carrier[0]);
}

static int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }

// The controls of each step; older rows are shorter.
static XrayControl *read_xray(const Reader *reader, uint64_t *count)
{
    uint64_t shape[2] = {0, 0};
    float *value = read_dataset(reader, "/xray", HDF5_FLOAT, 2, shape);
    *count = shape[0];
    if (!value || shape[1] == XRAY_VALUES)
        return (XrayControl *)value;
    const bool is_older = shape[1] == XRAY_VALUES_BEFORE_SEEN || shape[1] == XRAY_VALUES_BEFORE_TOOLS;
    XrayControl *xray = is_older ? calloc((size_t)shape[0] + 1, sizeof *xray) : NULL;
    if (!xray)
        faults_add(reader->faults, reader->path, 0, 0, "/xray has rows of %llu values; expected %d, or %d or %d in older recordings",
                   (unsigned long long)shape[1], XRAY_VALUES, XRAY_VALUES_BEFORE_SEEN, XRAY_VALUES_BEFORE_TOOLS);
    for (uint64_t i = 0; xray && i < shape[0]; i++)
        memcpy(&xray[i], value + i * shape[1], (size_t)shape[1] * sizeof *value);
    free(value);
    return xray;
}

// Reads the per-step datasets.
static int64_t read_series(const Reader *reader, RecordedRun *run)
{
    uint64_t time[1] = {0}, hash[1] = {0}, flags[1] = {0}, wall[2] = {0, 2}, watched = 0;
    run->time_s = read_dataset(reader, "/time_s", HDF5_DOUBLE, 1, time);
    int64_t count = smaller((int64_t)time[0], read_tool_series(reader, "", &run->tool[0]));
    run->command = run->tool[0].command;
    run->proximal = run->tool[0].proximal;
    run->inserted = run->tool[0].inserted;
    run->state_hash = read_dataset(reader, "/state_hash", HDF5_UINT64, 1, hash);
    run->flags = read_dataset(reader, "/report/flags", HDF5_UINT32, 1, flags);
    run->wall_force = read_dataset(reader, "/report/wall_force_n", HDF5_DOUBLE, 2, wall);
    bool was_seen = has(reader, "/xray");   // missing in recordings made before the trainer existed
    run->xray = was_seen ? read_xray(reader, &watched) : NULL;
    count = least(least(least(count, hash[0]), flags[0]), wall[0]);
    bool several = count_tools(reader, run) && run->tool_count > 1;
    for (int k = 0; several && k < run->tool_count; k++) {
        char group[GROUP_NAME];
        tool_group(k, group);
        copy_attribute(reader, group, "name", run->tool[k].name);
        copy_attribute(reader, group, "kind", run->tool[k].kind);
        if (k > 0)
            count = smaller(count, read_tool_series(reader, group, &run->tool[k]));
    }
    if (several && has(reader, "/exchange"))
        count = smaller(count, read_exchanges(reader, run));
    return run->xray ? least(count, watched) : count;
}

static int64_t read_tools_frames(const Reader *reader, uint64_t nodes, RecordedRun *run)
{
    uint64_t count[1] = {0}, s[2] = {0, nodes}, radius[2] = {0, nodes};
    run->frame_nodes = read_frames_of(reader, "/wire/count", HDF5_INT32, 1, count);
    run->s = read_frames_of(reader, "/wire/s_mm", HDF5_DOUBLE, 2, s);
    run->radius = read_frames_of(reader, "/wire/radius_mm", HDF5_DOUBLE, 2, radius);
    int64_t frames = least(least((int64_t)count[0], s[0]), radius[0]);
    for (int k = 0; k < run->tool_count; k++) {
        char group[GROUP_NAME];
        tool_group(k, group);
        frames = smaller(frames, read_tool_frames(reader, group, run->exchange != NULL, &run->tool[k]));
    }
    return frames;
}

static int64_t read_nodes(const Reader *reader, uint64_t nodes, RecordedRun *run)
{
    uint64_t s[1] = {0}, radius[1] = {0};
    run->s = read_dataset(reader, "/wire/s_mm", HDF5_DOUBLE, 1, s);
    run->radius = read_dataset(reader, "/wire/radius_mm", HDF5_DOUBLE, 1, radius);
    if (run->s && run->radius && (radius[0] != nodes || s[0] != nodes))
        faults_add(reader->faults, reader->path, 0, 0, "holds %llu nodes and %llu radii; expected equal numbers", (unsigned long long)nodes,
                   (unsigned long long)radius[0]);
    return INT64_MAX;
}

static bool are_numbers(const double *value, int64_t count)
{
    bool good = true;
    for (int64_t i = 0; good && i < count; i++)
        good = isfinite(value[i]);
    return good;
}

// Checks the existing nodes; the rows beyond hold NaN.
static void check_numbers(const Reader *reader, const RecordedRun *run)
{
    for (int64_t i = 0; i < run->frame_count; i++) {
        RecordedFrame at = recorded_run_frame(run, i);
        bool good = are_numbers(&at.position->x, 3 * at.node_count) && are_numbers(&at.quaternion->w, 4 * at.node_count) && are_numbers(at.s, at.node_count) &&
                    are_numbers(at.radius, at.node_count);
        for (int k = 0; good && run->frame_nodes && k < run->tool_count; k++) {
            RecordedToolFrame own = recorded_run_tool_frame(run, k, i);
            good = are_numbers(&own.position->x, 3 * own.node_count) && are_numbers(&own.quaternion->w, 4 * own.node_count) &&
                   are_numbers(own.s, own.node_count) && are_numbers(own.radius, own.node_count);
        }
        if (!good) {
            faults_add(reader->faults, reader->path, 0, 0,
                       "frame %lld has a node that is not a number; expected finite positions, rotations, lengths and radii", (long long)i);
            return;
        }
    }
}

// Checks what users of a recording assume: rising steps, valid counts and carriers.
static void check_frames(const Reader *reader, const RecordedRun *run)
{
    for (int64_t i = 0; i < run->frame_count; i++) {
        if (i ? run->frame_step[i] <= run->frame_step[i - 1] : run->frame_step[i] < 0) {
            faults_add(reader->faults, reader->path, 0, 0, "frame %lld refers to step %lld; expected rising steps from 0", (long long)i,
                       (long long)run->frame_step[i]);
            return;
        }
        if (run->frame_nodes && (run->frame_nodes[i] < 2 || run->frame_nodes[i] > run->node_count)) {
            faults_add(reader->faults, reader->path, 0, 0, "frame %lld has %d nodes; expected 2 to %d", (long long)i, run->frame_nodes[i], run->node_count);
            return;
        }
    }
    for (int k = 0; run->exchange && k < run->tool_count; k++)
        for (int64_t i = 0; i < run->frame_count; i++)
            if (recorded_run_fitted(run, k, run->frame_step[i]) >= run->tool[k].device_count) {
                faults_add(reader->faults, reader->path, 0, 0, "/exchange has device %d of tool %d in step %lld; the file holds %d of them",
                           recorded_run_fitted(run, k, run->frame_step[i]), k, (long long)run->frame_step[i], run->tool[k].device_count);
                return;
            }
    for (int k = 0; run->frame_nodes && k < run->tool_count; k++)
        for (int64_t i = 0; i < run->frame_count * run->tool[k].node_count; i++)
            if (run->tool[k].carrier[i] < -1 || run->tool[k].carrier[i] >= run->tool_count) {
                faults_add(reader->faults, reader->path, 0, 0, "/tools/%d/carrier names tool %d; expected -1 to %d", k, run->tool[k].carrier[i],
                           run->tool_count - 1);
                return;
            }
}

// Motion repeats the last value for nodes that do not exist.
static void clear_beyond(RecordedRun *run)
{
    for (int64_t k = 0; run->frame_nodes && k < run->frame_count; k++)
        for (int64_t i = k * run->node_count + run->frame_nodes[k]; i < (k + 1) * run->node_count; i++) {
            run->position[i] = vec3(NAN, NAN, NAN);
            run->quaternion[i] = (Quat){NAN, NAN, NAN, NAN};
            run->force[3 * i] = run->force[3 * i + 1] = run->force[3 * i + 2] = run->gap[i] = NAN;
            run->vessel_node[i] = -1;
            run->s[i] = run->radius[i] = NAN;
        }
}

static void read_frames(Reader *reader, RecordedRun *run)
{
    reader->has_motion = has(reader, "/motion");
    int before = reader->faults->count;
    uint64_t step[1] = {0}, position[3] = {0, 0, 3}, quaternion[3] = {0, 0, 4}, force[3] = {0, 0, 3}, gap[2] = {0, 0}, node[2] = {0, 0};
    run->frame_step = read_dataset(reader, reader->has_motion ? "/motion/wire/step" : "/wire/step", HDF5_INT64, 1, step);
    run->position = read_frames_of(reader, "/wire/position", HDF5_DOUBLE, 3, position);
    quaternion[1] = force[1] = gap[1] = node[1] = position[1];
    run->quaternion = read_frames_of(reader, "/wire/quaternion", HDF5_DOUBLE, 3, quaternion);
    run->force = read_frames_of(reader, "/contact/force_n", HDF5_FLOAT, 3, force);
    run->gap = read_frames_of(reader, "/contact/gap_mm", HDF5_FLOAT, 2, gap);
    run->vessel_node = read_frames_of(reader, "/contact/vessel_node", HDF5_INT32, 2, node);
    if (reader->faults->count == before && (position[1] < 2 || position[1] > 100000))
        faults_add(reader->faults, reader->path, 0, 0, "holds %llu nodes; expected 2 to 100000", (unsigned long long)position[1]);
    if (reader->faults->count > before)
        return;
    int64_t others = run->tool_count > 1 ? read_tools_frames(reader, position[1], run) : read_nodes(reader, position[1], run);
    if (reader->faults->count > before)
        return;
    run->node_count = (int)position[1];
    run->frame_count = smaller(others, least(least(least(least(least((int64_t)step[0], position[0]), quaternion[0]), force[0]), gap[0]), node[0]));
    while (run->frame_count > 0 && run->frame_step[run->frame_count - 1] >= run->step_count)
        run->frame_count--;
    check_frames(reader, run);
    if (reader->faults->count == before && reader->has_motion)
        clear_beyond(run);
    if (reader->faults->count == before)
        check_numbers(reader, run);
}

// Checks for steps of equal length, as the simulator makes them: playback finds rows by time.
static void check_times(const Reader *reader, const RecordedRun *run)
{
    double dt = run->step_ms / 1000;
    for (int64_t i = 0; i < run->step_count; i++) {
        double due = (i > 0 ? run->time_s[0] : dt) + (double)i * dt;
        bool is_due = i > 0 ? fabs(run->time_s[i] - due) < 0.01 * dt : run->time_s[0] > 0 && run->time_s[0] < MOST_TIME_S;
        if (!is_due) {
            faults_add(reader->faults, reader->path, 0, 0, "/time_s holds %g s in row %lld; expected rows %g s apart, starting at %g s", run->time_s[i],
                       (long long)i, dt, i > 0 ? run->time_s[0] : dt);
            return;
        }
    }
}

// Checks the settings of X-ray system and injector against ranges wider than those of the controls, but safe to count and draw.
static void check_xray(const Reader *reader, const RecordedRun *run)
{
    static const struct {
        float least, most;
    } valid[XRAY_VALUES] = {{0, 1},        {0, 1000}, {-360, 360},     {-360, 360},    {0, 1e4F}, {-1e5F, 1e5F}, {-1e5F, 1e5F},
                            {-1e5F, 1e5F}, {0, 1},    {0, 1},          {0, 1},         {0, 1},    {0, 1000},     {XRAY_LIVE, XRAY_ROADMAP},
                            {0, 1e9F},     {0, 1e9F}, {0, TOOLS_MOST}, {0, SEEN_MOST}, {0, 1e9F}};
    for (int64_t i = 0; i < run->step_count; i++) {
        float value[XRAY_VALUES];
        memcpy(value, &run->xray[i], sizeof value);
        for (int k = 0; k < XRAY_VALUES; k++)
            if (!(value[k] >= valid[k].least && value[k] <= valid[k].most)) {
                faults_add(reader->faults, reader->path, 0, 0, "/xray holds %g in row %lld, column %d; expected %g to %g", (double)value[k], (long long)i, k,
                           (double)valid[k].least, (double)valid[k].most);
                return;
            }
    }
}

static double read_step_ms(const Reader *reader)
{
    double step_ms = hdf5_number(reader->file, "step_ms", 1);
    if (!(step_ms >= 0.001 && step_ms <= 100))
        faults_add(reader->faults, reader->path, 0, 0, "has steps of %g ms; expected 0.001 to 100", step_ms);
    return step_ms;
}

static void read_run(Reader *reader, RecordedRun *run, bool with_frames)
{
    int before = reader->faults->count;
    run->step_ms = read_step_ms(reader);
    reader->is_finite = true;
    int64_t step_count = read_series(reader, run);
    reader->is_finite = false;      // frames have NaN where they have no nodes
    if (reader->faults->count > before)
        return;
    run->step_count = step_count;
    check_times(reader, run);
    if (run->xray)
        check_xray(reader, run);
    if (with_frames)
        read_frames(reader, run);
}

// Takes ownership of `name`. CONTACT_COUNT if unknown: the scene's own is used.
static ContactKind contact_of(char *name)
{
    int kind = 0;
    while (kind < CONTACT_COUNT && (!name || strcmp(name, contact_name[kind])))
        kind++;
    free(name);
    return (ContactKind)kind;
}

static bool sum_turns(RecordedRun *run)
{
    bool good = true;
    for (int k = 0; k < run->tool_count; k++) {
        RecordedTool *tool = &run->tool[k];
        double turned = 0;
        tool->turned = malloc(((size_t)run->step_count + 1) * sizeof *tool->turned);
        for (int64_t i = 0; tool->turned && i < run->step_count; i++)
            tool->turned[i] = turned += tool->command[2 * i + 1] * run->step_ms / 1000;
        good &= tool->turned != NULL;
    }
    return good;
}

static void read_scene(const Reader *reader, RecordedRun *run)
{
    run->scene_text = hdf5_text(reader->file, "/scene");
    run->scene_path = hdf5_text_attribute(reader->file, "/scene", "path");
    run->files = hdf5_text_attribute(reader->file, "/scene", "files");
    run->sha256 = hdf5_text_attribute(reader->file, "/scene", "sha256");
    run->contact = contact_of(hdf5_text_attribute(reader->file, "/scene", "contact"));
    run->trainee = hdf5_text_attribute(reader->file, "/scene", "trainee");
    run->date = hdf5_text_attribute(reader->file, "/scene", "date");
}

static RecordedRun *load(const char *path, bool with_frames, Faults *faults)
{
    int before = faults->count;
    Reader reader = {.file = hdf5_reader_open(path, "a recording that `seldinger run --record` wrote is expected", faults), .path = path, .faults = faults};
    RecordedRun *run = reader.file ? calloc(1, sizeof *run) : NULL;
    if (run) {
        read_run(&reader, run, with_frames);
        read_scene(&reader, run);
        if (faults->count == before && !sum_turns(run))
            faults_add(faults, path, 0, 0, "out of memory");
    } else if (reader.file) {
        faults_add(faults, path, 0, 0, "out of memory");
    }
    hdf5_reader_close(reader.file);
    if (faults->count > before) {
        recorded_run_free(run);
        return NULL;
    }
    return run;
}

RecordedRun *recorded_run_load(const char *path, Faults *faults) { return load(path, true, faults); }
RecordedRun *recorded_run_load_series(const char *path, Faults *faults) { return load(path, false, faults); }

void recorded_run_free(RecordedRun *run)
{
    if (!run)
        return;
    for (int k = 0; k < STEP_TOOLS_MAX; k++) {
        RecordedTool *tool = &run->tool[k];
        free(tool->command);
        free(tool->proximal);
        free(tool->inserted);
        free(tool->released);
        free(tool->turned);
        free(tool->position);
        free(tool->quaternion);
        free(tool->carrier);
        free(tool->s);
        free(tool->radius);
    }
    free(run->exchange);
    free(run->time_s);
    free(run->state_hash);
    free(run->frame_step);
    free(run->frame_nodes);
    free(run->position);
    free(run->quaternion);
    free(run->radius);
    free(run->force);
    free(run->gap);
    free(run->vessel_node);
    free(run->xray);
    free(run->flags);
    free(run->wall_force);
    free(run->s);
    free(run->scene_path);
    free(run->trainee);
    free(run->date);
    free(run->files);
    free(run->sha256);
    free(run->scene_text);
    free(run);
}

bool recorded_run_was_watched(const RecordedRun *run)
{
    for (int64_t i = 0; run->xray && i < run->step_count; i++)
        if (run->xray[i].field_mm > 0)
            return true;
    return false;
}

ToolCommands recorded_run_commands(const RecordedRun *run, int64_t step)
{
    SEL_REQUIRE(step >= 0 && step < run->step_count, "the step is one of the run's");
    ToolCommands commands = {0};
    for (int k = 0; k < run->tool_count; k++) {
        const RecordedTool *tool = &run->tool[k];
        commands.tool[k] = (Command){tool->command[2 * step], tool->command[2 * step + 1]};
        commands.released |= tool->released && tool->released[step] ? 1u << k : 0;
        commands.fitted[k] = run->exchange ? run->exchange[2 * (step * run->tool_count + k)] : 0;
    }
    if (run->xray && run->xray[step].contrast_ml_s > 0 && run->xray[step].contrast_tool > 0) {
        commands.contrast_ml_s = (double)run->xray[step].contrast_ml_s;
        commands.contrast_tool = (int)fminf(run->xray[step].contrast_tool, TOOLS_MOST);
    }
    return commands;
}

RecordedFrame recorded_run_frame(const RecordedRun *run, int64_t frame)
{
    SEL_REQUIRE(frame >= 0 && frame < run->frame_count, "the frame is one of the run's");
    size_t nodes = (size_t)run->node_count, first = (size_t)frame * nodes;
    RecordedFrame at = {.node_count = run->frame_nodes ? run->frame_nodes[frame] : run->node_count,
                        .s = run->s,
                        .radius = run->radius,
                        .position = run->position + first,
                        .quaternion = run->quaternion + first,
                        .force = run->force + 3 * first,
                        .gap = run->gap + first,
                        .vessel_node = run->vessel_node + first};
    if (run->frame_nodes) {
        at.s += first;
        at.radius += first;
    }
    return at;
}

int recorded_run_fitted(const RecordedRun *run, int tool, int64_t step)
{
    SEL_ASSERT(tool >= 0 && tool < run->tool_count, "the tool is one of the run's");
    return run->exchange ? run->exchange[2 * (step * run->tool_count + tool) + 1] : 0;
}

RecordedToolFrame recorded_run_tool_frame(const RecordedRun *run, int tool, int64_t frame)
{
    SEL_REQUIRE(tool >= 0 && tool < run->tool_count && frame >= 0 && frame < run->frame_count, "tool and frame are the run's");
    const RecordedTool *t = &run->tool[tool];
    int device = recorded_run_fitted(run, tool, run->frame_step[frame]);
    size_t profile = (size_t)device * (size_t)t->node_count, first = (size_t)frame * (size_t)t->node_count;
    return (RecordedToolFrame){.node_count = t->device_nodes[device],
                               .s = t->s + profile,
                               .radius = t->radius + profile,
                               .position = t->position + first,
                               .quaternion = t->quaternion + first,
                               .carrier = t->carrier + first};
}

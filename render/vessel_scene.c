// A frame: the cached walls, then everything that moves as strokes over them.
#include "render/vessel_scene.h"

#include "render/message.h"
#include "render/tick_step.h"
#include "render/vessel_scene_layers.h"
#include "render/vessel_scene_model.h"
#include "render/vessel_scene_strokes.h"

#include <stdlib.h>
#include <string.h>

typedef struct LinePoint {     // a point of the line shared by all tools
    int node;                  // after this node …
    double part;               // … at this fraction of the distance to the next
    double at;                 // both together
    double length;             // [mm] arc length from the first point of the line
    double half;               // [pixel] of the tool added last …
    int inside;                // … and the number of tools inside it
} LinePoint;

struct VesselScene {
    VesselLayers *layers;
    Strokes strokes;
    ModelWires *models;
    const ToolLooks *tools;
    int target_count;
    const SceneTarget *target;
    bool has_entry;
    Vec3 entry, entry_direction;
    FreeCamera home;
    Vec3 center;               // of the ball around all objects …
    double reach;              // … and its radius
    // of the last draw
    FreeCamera shown;
    Camera projection;
    LayersKey key;
    bool has_drawn;
    int still_frames;
    bool is_following, is_gliding;
    Vec3 anchor;               // position of the followed focus
    bool has_tip;
    Vec3 tip;                  // the most distal tip
    int tip_count;
    Vec3 tool_tip[TOOLS_MOST];
    long layer_draws;
    // scratch memory for the smoothed line of the tools
    int capacity;
    LinePoint *line;
    Vec3 *point;
    double *half;
    Color *color;
};

static const Color TARGET_COLOR = {102, 190, 255, 255}, ARROW_COLOR = {120, 235, 200, 255}, SHEATH_COLOR = {150, 156, 166, 255},
                   TOOL_COLOR = {196, 203, 214, 255}, LUMEN_COLOR = {16, 18, 24, 255};
static const double sheath_shown_mm = 12;

Color vessel_scene_force_color(double force_n, double full_scale_n, Color without)
{
    const double least = 0.34;   // of the colour map: lower values are too dark on a dark background
    if (!(force_n > 0) || !(full_scale_n > 0))
        return without;
    return color_sequential(least + (1 - least) * fmin(force_n / full_scale_n, 1));
}

// --- create ---

static int gather_points(const VesselSceneOptions *options, Vec3 *point)
{
    int count = 0;
    for (int i = 0; options->vessel && i < options->vessel->vertex_count; i++)
        point[count++] = options->vessel->vertex[i];
    for (int i = 0; i < options->target_count; i++)
        for (int k = 0; k < 6; k++) {
            double r = (k & 1 ? -1 : 1) * options->target[i].radius;
            Vec3 p = vec3_add(options->target[i].point, vec3(k / 2 == 0 ? r : 0, k / 2 == 1 ? r : 0, k / 2 == 2 ? r : 0));
            if (vec3_is_finite(p))
                point[count++] = p;
        }
    if (options->has_entry && vec3_is_finite(options->entry))
        point[count++] = options->entry;
    for (int i = 0; i < options->frame_count; i++)
        if (vec3_is_finite(options->frame[i]))
            point[count++] = options->frame[i];
    return count;
}

static bool frame_everything(VesselScene *scene, const VesselSceneOptions *options)
{
    size_t most = (options->vessel ? (size_t)options->vessel->vertex_count : 0) + 6 * (size_t)options->target_count + (size_t)options->frame_count + 1;
    Vec3 *point = malloc(most * sizeof *point);
    if (!point)
        return false;
    int count = gather_points(options, point);
    scene->home = free_camera_framing(count, point);
    scene->center = scene->home.focus;
    scene->reach = hypot(scene->home.width_mm, scene->home.height_mm) / 2;
    for (int i = 0; i < count; i++)
        scene->reach = fmax(scene->reach, vec3_distance(point[i], scene->center));
    free(point);
    return true;
}

VesselScene *vessel_scene_create(const VesselSceneOptions *options, char *message, size_t capacity)
{
    VesselScene *scene = calloc(1, sizeof *scene);
    if (!scene) {
        message_fail(message, capacity, "out of memory for the 3D view");
        return NULL;
    }
    scene->tools = options->tools;
    scene->target_count = options->target_count;
    scene->target = options->target;
    scene->has_entry = options->has_entry && vec3_is_finite(options->entry) && vec3_is_finite(options->entry_direction);
    scene->entry = options->entry;
    scene->entry_direction = vec3_unit(options->entry_direction);
    scene->layers = vessel_layers_create(options->vessel, options->coarse, message, capacity);
    bool good = scene->layers && strokes_create(&scene->strokes, message, capacity);
    if (good && (!frame_everything(scene, options) || !(scene->models = model_wires_create(options->tree))))
        good = message_fail(message, capacity, "out of memory for the 3D view");
    if (!good) {
        vessel_scene_destroy(scene);
        return NULL;
    }
    return scene;
}

void vessel_scene_destroy(VesselScene *scene)
{
    if (!scene)
        return;
    vessel_layers_destroy(scene->layers);
    strokes_destroy(&scene->strokes);
    model_wires_free(scene->models);
    free(scene->line);
    free(scene->point);
    free(scene->half);
    free(scene->color);
    free(scene);
}

VesselSceneLook vessel_scene_default_look(const VesselScene *scene)
{
    return (VesselSceneLook){
        .camera = scene->home, .show_arrows = true, .show_targets = true, .force_full_scale_n = 0.5, .font_scale = 1, .section_through = {NAN, NAN, NAN}};
}

// --- camera ---

// The focus stays while the tip is in the middle third of the view, and glides to it when the tip leaves: walls are redrawn only then.
static void follow(VesselScene *scene, FreeCamera *camera, ViewPort port)
{
    if (!scene->is_following)
        scene->anchor = scene->tip;
    scene->is_following = true;
    Vec3 away = vec3_sub(scene->tip, scene->anchor);
    Camera view = free_camera_projection(camera, port.width, port.height, 1);
    double shorter = view.mm_per_pixel * (port.width < port.height ? port.width : port.height);
    double off = vec3_norm(vec3_add_scaled(away, -vec3_dot(away, view.back), view.back)) / shorter;
    scene->is_gliding = off > (scene->is_gliding ? 1 / 16.0 : 1 / 6.0);
    if (scene->is_gliding)
        scene->anchor = off > 1 ? scene->tip : vec3_add_scaled(scene->anchor, 0.25, away);
    camera->focus = scene->anchor;
}

static LayersKey key_for(VesselScene *scene, const VesselSceneLook *look, ViewPort port)
{
    FreeCamera camera = look->camera;
    if (look->follow_tip && scene->has_tip)
        follow(scene, &camera, port);
    else
        scene->is_following = scene->is_gliding = false;
    scene->shown = camera;
    double depth = 1.05 * scene->reach + vec3_distance(camera.focus, scene->center);
    LayersKey key = {.camera = free_camera_projection(&camera, port.width, port.height, depth), .has_section = look->section};
    key.section_normal = vec3_unit_or(look->section_normal, key.camera.back);
    Vec3 fixed = vec3_is_finite(look->section_through) ? look->section_through : scene->center;
    Vec3 through = look->section_at_tip && scene->has_tip ? scene->tip : fixed;
    key.section_offset = vec3_dot(key.section_normal, through) + look->section_offset_mm;
    return key;
}

// True if the layers change or have not been at rest long enough for an expensive frame to go unnoticed.
static bool is_moving(VesselScene *scene, const LayersKey *key)
{
    const int enough = 4;
    if (!scene->has_drawn)
        scene->still_frames = enough;
    else
        scene->still_frames = layers_key_same(&scene->key, key) ? scene->still_frames + (scene->still_frames < enough) : 0;
    scene->key = *key;
    scene->has_drawn = true;
    return scene->still_frames < enough;
}

// --- moving objects ---

static bool reserve(VesselScene *scene, int count)
{
    if (count <= scene->capacity)
        return true;
    LinePoint *line = realloc(scene->line, (size_t)count * sizeof *line);
    scene->line = line ? line : scene->line;
    Vec3 *point = realloc(scene->point, (size_t)count * sizeof *point);
    scene->point = point ? point : scene->point;
    double *half = realloc(scene->half, (size_t)count * sizeof *half);
    scene->half = half ? half : scene->half;
    Color *color = realloc(scene->color, (size_t)count * sizeof *color);
    scene->color = color ? color : scene->color;
    if (!line || !point || !half || !color)
        return false;
    scene->capacity = count;
    return true;
}

static Color mix_colors(Color a, Color b, double s)
{
    return color_rgb((int)(a.r + s * (b.r - a.r) + 0.5), (int)(a.g + s * (b.g - a.g) + 0.5), (int)(a.b + s * (b.b - a.b) + 0.5));
}

// Cubic through both nodes along their tangents.
static Vec3 between(const Pose *pose, int i, double t)
{
    Vec3 a = pose->position[i], b = pose->position[i + 1], chord = vec3_sub(b, a);
    double length = vec3_norm(chord);
    Vec3 u = quat_rotate(pose->quaternion[i], vec3(length, 0, 0)), v = quat_rotate(pose->quaternion[i + 1], vec3(length, 0, 0));
    // ignore tangents of frames that do not follow the line
    double least = 0.5 * length * length;
    if (!(vec3_dot(u, chord) > least && vec3_dot(v, chord) > least))
        u = v = chord;
    double s = 1 - t;
    Vec3 x = vec3_add_scaled(vec3_scale(a, s * s * (1 + 2 * t)), t * t * (1 + 2 * s), b);
    return vec3_add_scaled(vec3_add_scaled(x, t * s * s, u), -t * t * s, v);
}

// Number of pieces after a node: at most six points of the line to the next node; more points are added where tools end.
static int line_pieces(const VesselScene *scene, const Pose *pose, int i)
{
    enum { PIECES = 6 };
    double pixels = vec3_distance(pose->position[i], pose->position[i + 1]) / scene->projection.mm_per_pixel;
    int pieces = pixels < 3 ? 1 : pixels < 3 * PIECES ? (int)(pixels / 3) + 1 : PIECES;
    return pieces > PIECES ? PIECES : pieces;
}

static void add_line_point(VesselScene *scene, const Pose *pose, int i, double t, int *count)
{
    LinePoint *p = &scene->line[*count];
    Vec3 x = t > 0 ? between(pose, i, t) : pose->position[i];
    double step = *count > 0 ? vec3_distance(x, scene->point[*count - 1]) : 0;
    *p = (LinePoint){.node = i, .part = t, .at = i + t, .length = *count > 0 ? p[-1].length + (isfinite(step) ? step : 0) : 0};
    scene->point[(*count)++] = x;
}

// Fills the shared centreline, starting with a stub in the sheath, with a point where each tool ends. Returns the number of points.
static int lay_line(VesselScene *scene, const Pose *pose, const double *end)
{
    enum { MOST_PIECES = 6 };
    int first = pose->first_free_node, count = 0;
    double stub = 0;
    while (first > 0 && stub < sheath_shown_mm) {
        stub += vec3_distance(pose->position[first], pose->position[first - 1]);
        first--;
    }
    if (!reserve(scene, (pose->node_count - first) * MOST_PIECES + TOOLS_MOST))
        return 0;
    for (int i = first; i < pose->node_count; i++) {
        int pieces = i + 1 < pose->node_count ? line_pieces(scene, pose, i) : 1;
        for (int n = 0; n < pieces; n++) {
            double t = (double)n / pieces, next = (double)(n + 1) / pieces;
            add_line_point(scene, pose, i, t, &count);
            for (int k = 0; k < pose->tool_count; k++)
                if (end[k] > scene->line[count - 1].at && end[k] < i + next)
                    add_line_point(scene, pose, i, end[k] - i, &count);
        }
    }
    return count;
}

static const TubeStretch *stretch_at(const VesselScene *scene, const Pose *pose, int tool, double s)
{
    static const TubeStretch solid = {0};
    return scene->tools && tool < scene->tools->count ? tool_look_at(tool_looks_of(scene->tools, tool, pose->tool[tool].fitted), s) : &solid;
}

// Radius [mm] at s from the tool's own nodes; `from` stores the position for the next call.
static double radius_at(const PoseTool *tool, double s, int *from)
{
    while (*from + 2 < tool->node_count && tool->node[*from + 1].s < s)
        (*from)++;
    if (tool->node_count < 2)
        return tool->node_count > 0 ? tool->node[0].radius : 0;
    const ToolNode *a = &tool->node[*from], *b = a + 1;
    double t = fmin(fmax((s - a->s) / (b->s - a->s), 0), 1);
    return a->radius + t * (b->radius - a->radius);
}

static Color node_color(const Pose *pose, int i, bool touches_wall, Color own, double full_scale_n)
{
    return i < pose->first_free_node ? SHEATH_COLOR : touches_wall ? vessel_scene_force_color(vec3_norm(pose->node[i].force), full_scale_n, own) : own;
}

// Adds one tool along the line up to its end, coloured by wall force where it touches the wall. Where another tool lies inside, its near wall is cut away: its
// lumen is drawn over it, and the inner tool over that. Each tool leaves a rim of the one around it visible, however thin.
static void add_tool(VesselScene *scene, const Pose *pose, int k, const double *end, int count, const VesselSceneLook *look, double line)
{
    const PoseTool *tool = &pose->tool[k];
    double pixel = scene->projection.mm_per_pixel, rim = 1.5 * line, length = tool->node_count > 0 ? tool->node[tool->node_count - 1].s : 0;
    Color own = scene->tools && k < scene->tools->count ? scene->tools->tool[k].color : TOOL_COLOR;
    int first = 0, last = 0, node = 0;
    bool has_lumen = false;
    while (k > 0 && first < count && scene->line[first].at < pose->first_free_node)
        first++;
    while (last < count && scene->line[last].at <= end[k])
        last++;
    for (int i = first; i < last; i++) {
        LinePoint *p = &scene->line[i];
        bool carries = true;
        p->inside = 0;
        for (int other = 0; other < pose->tool_count; other++) {
            carries = carries && (other >= k || end[other] < p->at);
            p->inside += other > k && end[other] >= p->at;
        }
        double s = length - (scene->line[last - 1].length - p->length);
        p->half = fmax(radius_at(tool, s, &node) / pixel, (carries ? 1.25 : 0.9) * line + rim * p->inside);
        scene->half[i] = p->half;
        Color here = node_color(pose, p->node, carries, own, look->force_full_scale_n);
        scene->color[i] = p->part > 0 ? mix_colors(here, node_color(pose, p->node + 1, carries, own, look->force_full_scale_n), p->part) : here;
        has_lumen |= stretch_at(scene, pose, k, s)->lumen > 0;
    }
    strokes_polyline(&scene->strokes, last - first, scene->point + first, scene->half + first, scene->color + first, !has_lumen);
    for (int i = first; i < last && has_lumen; i++) {
        LinePoint *p = &scene->line[i];
        bool is_open = p->inside > 0 && p->at >= pose->first_free_node;
        double s = length - (scene->line[last - 1].length - p->length), least = 0.9 * line + rim * (p->inside - 0.6);
        scene->half[i] = is_open ? fmin(fmax(stretch_at(scene, pose, k, s)->lumen / pixel, least), p->half - 0.4 * rim) : NAN;
        scene->color[i] = color_with_alpha(LUMEN_COLOR, 0.8);
    }
    if (has_lumen)
        strokes_polyline(&scene->strokes, last - first, scene->point + first, scene->half + first, scene->color + first, false);
}

static void add_tools(VesselScene *scene, const Pose *pose, const VesselSceneLook *look, double line)
{
    double end[STEP_TOOLS_MAX];
    for (int k = 0; k < pose->tool_count; k++)
        end[k] = pose_tool_end(pose, k);
    int count = lay_line(scene, pose, end);
    for (int k = 0; k < pose->tool_count; k++)
        add_tool(scene, pose, k, end, count, look, line);
}

// One arrow for each piece of the tool of about 14 pixels, counted from the tip so that the pieces keep the same nodes: the sum of their forces, with its
// head at the tool where the wall pushes.
static void add_arrows(VesselScene *scene, const Pose *pose, const VesselSceneLook *look, double line)
{
    const double least = 0.01;   // of full scale: contacts that barely touch
    const Camera *view = &scene->projection;
    double pixel = view->mm_per_pixel, stretch = 14 * line * pixel;
    double longest = fmin(52 * line, 0.10 * (view->width < view->height ? view->width : view->height)) * pixel;
    int end = pose->node_count;
    while (end > pose->first_free_node) {
        Vec3 sum = {0, 0, 0}, place = {0, 0, 0};
        double weight = 0, radius = 0, length = 0;
        int i = end;
        while (i > pose->first_free_node && (i == end || length < stretch)) {
            i--;
            double size = vec3_norm(pose->node[i].force);
            if (size > 0 && isfinite(size) && vec3_is_finite(pose->position[i])) {
                sum = vec3_add(sum, pose->node[i].force);
                place = vec3_add_scaled(place, size, pose->position[i]);
                weight += size;
                radius = fmax(radius, pose->node[i].radius);
            }
            if (i > 0)
                length += vec3_distance(pose->position[i], pose->position[i - 1]);
        }
        end = i;
        double size = vec3_norm(sum);
        if (!(weight > 0) || !(size > least * look->force_full_scale_n))
            continue;
        Vec3 direction = vec3_scale(sum, 1 / size), tip = vec3_add_scaled(vec3_scale(place, 1 / weight), -radius, direction);
        // square root, so that a tenth of the force is still visible
        double long_as = longest * sqrt(fmin(size / look->force_full_scale_n, 1.5));
        strokes_arrow(&scene->strokes, vec3_add_scaled(tip, -long_as, direction), tip, 1.1 * line, ARROW_COLOR);
    }
}

static void add_targets(VesselScene *scene, double line)
{
    for (int i = 0; i < scene->target_count; i++) {
        const SceneTarget *target = &scene->target[i];
        if (!vec3_is_finite(target->point) || !isfinite(target->radius))
            continue;
        const Vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        for (int k = 0; k < 3; k++)
            strokes_circle(&scene->strokes, target->point, axis[k], target->radius, 0.55 * line, color_with_alpha(TARGET_COLOR, 0.75));
        strokes_circle(&scene->strokes, target->point, scene->projection.back, target->radius, 0.8 * line, TARGET_COLOR);
    }
}

static double tool_radius(const Pose *pose) { return pose ? pose->node[pose->node_count - 1].radius : 0.2; }

static void add_sheath(VesselScene *scene, const Pose *pose, double line)
{
    double pixel = scene->projection.mm_per_pixel, half = fmax(2.2 * tool_radius(pose) / pixel, 3.2 * line);
    const Vec3 point[2] = {vec3_add_scaled(scene->entry, -sheath_shown_mm, scene->entry_direction), scene->entry};
    strokes_line(&scene->strokes, point[0], point[1], half, color_with_alpha(SHEATH_COLOR, 0.5));
    strokes_circle(&scene->strokes, scene->entry, scene->entry_direction, half * pixel, 0.9 * line, color_rgb(226, 230, 236));
}

void vessel_scene_draw(VesselScene *scene, const Pose *pose, const VesselSceneLook *look, ViewPort port)
{
    if (port.width < 1 || port.height < 1)
        return;
    if (pose && pose->node_count < 2)
        pose = NULL;
    scene->has_tip = pose && vec3_is_finite(pose->position[pose->node_count - 1]);
    if (scene->has_tip)
        scene->tip = pose->position[pose->node_count - 1];
    scene->tip_count = pose ? pose->tool_count : 0;
    for (int k = 0; k < scene->tip_count; k++)
        scene->tool_tip[k] = pose->tool[k].node[pose->tool[k].node_count - 1].position;
    LayersKey key = key_for(scene, look, port);
    key.is_quick = is_moving(scene, &key) && !look->full_detail;
    scene->projection = key.camera;
    scene->layer_draws += vessel_layers_update(scene->layers, &key);
    vessel_layers_show(scene->layers, port);

    double line = look->font_scale > 0 ? look->font_scale : 1;
    strokes_begin(&scene->strokes, &scene->projection);
    if (look->show_targets)
        add_targets(scene, line);
    if (scene->has_entry)
        add_sheath(scene, pose, line);
    if (look->show_model && pose)
        model_wires_add(scene->models, pose->node[pose->node_count - 1].vessel_node, &scene->strokes, line);
    if (pose)
        add_tools(scene, pose, look, line);
    if (pose && look->show_arrows)
        add_arrows(scene, pose, look, line);
    strokes_draw(&scene->strokes, scene->layers, port);
}

// --- labels and legend ---

static VesselSceneLabel label_at(const VesselScene *scene, VesselSceneLabelKind kind, const char *name, Vec3 place, double radius)
{
    Vec3 p = camera_project(&scene->projection, place);
    return (VesselSceneLabel){.kind = kind,
                              .name = name,
                              .x = p.x,
                              .y = p.y,
                              .radius = radius,
                              .is_in_view = p.x >= 0 && p.y >= 0 && p.x <= scene->projection.width && p.y <= scene->projection.height};
}

int vessel_scene_labels(const VesselScene *scene, VesselSceneLabel *label, int capacity)
{
    int count = 0;
    double pixel = fmax(scene->projection.mm_per_pixel, 1e-300);
    for (int i = 0; i < scene->target_count && count < capacity; i++) {
        const SceneTarget *target = &scene->target[i];
        label[count] = label_at(scene, LABEL_TARGET, target->name, target->point, target->radius / pixel);
        label[count++].distance_mm = scene->has_tip ? vec3_distance(scene->tip, target->point) : NAN;
    }
    if (scene->has_entry && count < capacity)
        label[count++] = label_at(scene, LABEL_SHEATH, "sheath", scene->entry, 6);
    for (int k = 0; k < scene->tip_count && count < capacity; k++)
        if (vec3_is_finite(scene->tool_tip[k]))
            label[count++] = label_at(scene, LABEL_TIP, scene->tools && scene->tip_count > 1 ? scene->tools->tool[k].name : "tip", scene->tool_tip[k], 6);
    return count;
}

ScaleBar vessel_scene_scale_bar(const VesselScene *scene, double most_pixels)
{
    double most = most_pixels * scene->projection.mm_per_pixel;
    if (!(most > 0))
        return (ScaleBar){0};
    double length = round_length(most);
    return (ScaleBar){length, length / scene->projection.mm_per_pixel};
}

bool vessel_scene_tip(const VesselScene *scene, Vec3 *tip)
{
    *tip = scene->tip;
    return scene->has_tip;
}

const Camera *vessel_scene_projection(const VesselScene *scene) { return &scene->projection; }
FreeCamera vessel_scene_camera(const VesselScene *scene) { return scene->has_drawn ? scene->shown : scene->home; }
long vessel_scene_layer_draws(const VesselScene *scene) { return scene->layer_draws; }

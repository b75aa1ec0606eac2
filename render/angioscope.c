// The wall is drawn in patches of neighbouring triangles (Morton order of their centroids), each with a bounding ball. Patches outside the view or beyond the
// light are
// skipped; the others are drawn from near to far, so that the depth test hides what lies behind a wall before it is shaded. Outer faces are culled: the eye
// is inside. The normals of a patch are queried from the vessel when it is first seen.
//
// Light: with d the distance from lamp and eye, and c the cosine between wall normal and ray: (ambient + c) / (1 + (d / 3 R)^2), R the radius of the lumen at
// the tip,
// and a fog exp(-(d / 8 R)^1.5) that fades to dark. Texture of the wall and the light at mouths of branches are computed once, for each vertex: a pixel costs
// nothing more.
#include "render/angioscope.h"

#include "geom/geom.h"
#include "render/drawable_mesh.h"
#include "render/gl_canvas.h"
#include "render/message.h"
#include "render/primitives.h"

#include <epoxy/gl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { PATCH_TRIANGLES = 256, FINE_SAMPLES = 4 };

typedef struct WallVertex {
    float position[3];         // [mm] relative to origin
    float normal[3];           // into the lumen
    float look[2];             // brightness of the wall's texture around 1; glow of a branch's mouth, 0 to 1
} WallVertex;

// Of a branch that leaves its parent's vessel.
typedef struct Mouth {
    Vec3 center, direction;    // in the parent's wall; unit, into the branch
    double radius;             // of the branch
} Mouth;

typedef struct Patch {
    int first_index, index_count;
    int first_vertex, vertex_count;
    Vec3 center;
    double radius;
    bool has_field_normals;
} Patch;

typedef struct SeenPatch {
    double distance;           // [mm] from the eye to the near side of its ball
    int patch;
} SeenPatch;

struct Angioscope {
    const Vessel *vessel;
    const VesselTree *tree;
    Vec3 origin;
    double mean_radius;        // [mm] of the whole lumen: 2 volume / area
    int patch_count;
    Patch *patch;
    int *first_child, *next_child;     // (N of the tree) -1: none
    int mouth_count;
    Mouth *mouth;
    int vertex_count;
    WallVertex *vertex;        // as uploaded to the GPU
    int *node;                 // (vertex_count) node of the vessel, -1 if unknown
    SeenPatch *seen;           // (patch_count) scratch memory of a frame: patches to draw, from near to far
    GLsizei *draw_count;
    const void **draw_offset;
    const ToolLooks *tools;
    SheathLook sheath;
    Primitives primitives;             // the tools in the view
    unsigned program;
    unsigned wall_array, wall_vertices, wall_indices;
    unsigned tool_array, tool_vertices, tool_indices;
    GlCanvas canvas;
    int samples;               // of the canvas
    bool full_detail;
};

static const float dark[3] = {0.030f, 0.012f, 0.012f};
static const double half_angle = 50 * PI / 180;   // of the shorter side
static const double along_lumen = 0.75;           // how far the eye turns from the tool's direction to the centreline ahead
static const double lamp_reach = 3, fog_reach = 8, fog_end = 2.3;   // in radii of the lumen; in fog reaches, the distance at which it is black

static const char *const VERTEX =
    "#version 330 core\n"
    "layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal; layout(location = 2) in vec4 color;\n"
    "layout(location = 3) in vec2 look; uniform mat4 clip; uniform vec3 eye; uniform vec4 tint; out vec3 ray; out vec3 n; out vec3 k; out float glow;\n"
    "void main() { gl_Position = clip * vec4(position, 1.0); ray = eye - position; n = normal; k = look.x * mix(tint.rgb, color.rgb, tint.a); glow = look.y; "
    "}\n";

static const char *const FRAGMENT =
    "#version 330 core\n"
    "in vec3 ray; in vec3 n; in vec3 k; in float glow; out vec4 result;\n"
    "uniform vec4 lamp; uniform vec3 dark, shine; uniform float edge;\n"   // lamp: 1 / reach^2, 1 / fog reach, brightness, ambient; shine: amount, power, glow
    "void main() {\n"
    "  float d2 = dot(ray, ray), d = sqrt(d2); vec3 m = normalize(n); float c = max(dot(m, ray) / max(d, 1e-6), 0.0);\n"
    "  float light = lamp.z / (1.0 + d2 * lamp.x);\n"
    "  float s = c * c; s *= s; s *= s; s *= s; s *= s;\n"
    "  vec3 lit = k * (lamp.w + (1.0 - lamp.w) * c) * light;\n"
    // thin tissue glows where the lamp grazes it
    "  lit += shine.z * k * k * (1.0 - c) * (1.0 - c) * light + vec3(1.0, 0.93, 0.88) * (shine.x * s * light);\n"
    // a mouth is lit from within its branch, so that it is seen from farther away
    "  lit += glow * vec3(1.0, 0.72, 0.42) * (0.45 * lamp.z / (1.0 + 0.2 * d2 * lamp.x));\n"
    "  float f = d * lamp.y; lit = mix(dark * lamp.z, lit, exp(-f * sqrt(f)));\n"
    // the edge of the tool: c^2 falls linearly towards the outline, so this is the distance from the outline in pixels
    "  float e = c * c; result = vec4(1.0 - exp(-1.25 * lit), edge > 0.0 ? clamp(e / max(fwidth(e), 1e-9), 0.0, 1.0) : 1.0);\n"
    "}\n";

// --- the wall in patches ---

static void enclose(Angioscope *scope, Patch *patch)
{
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < patch->vertex_count; i++) {
        const float *p = scope->vertex[patch->first_vertex + i].position;
        sum = vec3_add(sum, vec3(p[0], p[1], p[2]));
    }
    patch->center = vec3_scale(sum, 1.0 / patch->vertex_count);
    for (int i = 0; i < patch->vertex_count; i++) {
        const float *p = scope->vertex[patch->first_vertex + i].position;
        patch->radius = fmax(patch->radius, vec3_distance(vec3(p[0], p[1], p[2]), patch->center));
    }
}

// --- texture and mouths ---

static bool is_tree_usable(const VesselTree *tree) { return tree && tree->node_count > 0; }

// A number from -1 to 1 for a corner of a lattice.
static double corner_noise(int x, int y, int z)
{
    uint32_t h = (uint32_t)x * 73856093u ^ (uint32_t)y * 19349663u ^ (uint32_t)z * 83492791u;
    h = (h ^ h >> 13) * 1274126177u;
    return (double)((h ^ h >> 16) & 0xffff) / 32767.5 - 1;
}

// Smooth between the corners of a lattice of unit cells.
static double smooth_noise(Vec3 p)
{
    const double cell[3] = {floor(p.x), floor(p.y), floor(p.z)};
    double t[3] = {p.x - cell[0], p.y - cell[1], p.z - cell[2]}, sum = 0;
    for (int k = 0; k < 3; k++)
        t[k] = t[k] * t[k] * (3 - 2 * t[k]);
    for (int corner = 0; corner < 8; corner++) {
        int at[3];
        double weight = 1;
        for (int k = 0; k < 3; k++) {
            at[k] = (int)cell[k] + (corner >> k & 1);
            weight *= corner >> k & 1 ? t[k] : 1 - t[k];
        }
        sum += weight * corner_noise(at[0], at[1], at[2]);
    }
    return sum;
}

// A wall without a tree is plain: the measure of a texture is the lumen.
static double texture_at(const Angioscope *scope, Vec3 p)
{
    if (!is_tree_usable(scope->tree))
        return 1;
    double coarse = 1 / (0.9 * scope->mean_radius), fine = 1 / (0.3 * scope->mean_radius);
    return 1 + 0.16 * smooth_noise(vec3_scale(p, coarse)) + 0.16 * smooth_noise(vec3_scale(p, fine));
}

// Brightest on the ring where the branch begins. `p`: in the model's frame.
static double glow_at(const Angioscope *scope, Vec3 p)
{
    double most = 0;
    for (int i = 0; i < scope->mouth_count; i++) {
        const Mouth *mouth = &scope->mouth[i];
        Vec3 d = vec3_sub(p, mouth->center);
        if (vec3_norm2(d) > 6.25 * mouth->radius * mouth->radius)
            continue;
        double along = vec3_dot(d, mouth->direction) / mouth->radius, off = vec3_norm(vec3_add_scaled(d, -along * mouth->radius, mouth->direction));
        double ring = off / mouth->radius - 1;
        most = fmax(most, exp(-along * along / 0.16 - ring * ring / 0.16));
    }
    return most;
}

// The straightest continuation of the vessel at a node whose parent is known; -1: none.
static int main_child(const Angioscope *scope, int node)
{
    const VesselTree *tree = scope->tree;
    int best = -1, parent = tree->parent[node];
    double most = -HUGE_VAL;
    for (int c = scope->first_child[node]; c >= 0; c = scope->next_child[c]) {
        Vec3 on = vec3_sub(tree->center[c], tree->center[node]);
        double value = parent < 0 ? tree->radius[c]
                                  : vec3_dot(vec3_unit_or(on, vec3(0, 0, 0)), vec3_unit_or(vec3_sub(tree->center[node], tree->center[parent]), vec3(0, 0, 0)));
        best = value > most ? c : best;
        most = fmax(most, value);
    }
    return best;
}

// The branch that begins with `child`: its mouth is where its centreline leaves the ball of its parent node.
static Mouth find_mouth(const Angioscope *scope, int node, int child)
{
    const VesselTree *tree = scope->tree;
    int at = child;
    while (vec3_distance(tree->center[at], tree->center[node]) < tree->radius[node] && scope->first_child[at] >= 0)
        at = main_child(scope, at);
    return (Mouth){tree->center[at], vec3_unit_or(vec3_sub(tree->center[at], tree->center[node]), vec3(0, 0, 1)), tree->radius[at]};
}

// Lists children and mouths. Returns false if out of memory.
static bool read_tree(Angioscope *scope)
{
    const VesselTree *tree = scope->tree;
    if (!is_tree_usable(tree))
        return true;
    scope->first_child = malloc((size_t)tree->node_count * sizeof *scope->first_child);
    scope->next_child = malloc((size_t)tree->node_count * sizeof *scope->next_child);
    scope->mouth = malloc((size_t)tree->node_count * sizeof *scope->mouth);
    if (!scope->first_child || !scope->next_child || !scope->mouth)
        return false;
    for (int i = 0; i < tree->node_count; i++)
        scope->first_child[i] = scope->next_child[i] = -1;
    for (int i = tree->node_count - 1; i >= 0; i--)
        if (tree->parent[i] >= 0) {
            scope->next_child[i] = scope->first_child[tree->parent[i]];
            scope->first_child[tree->parent[i]] = i;
        }
    for (int i = 0; i < tree->node_count; i++) {
        int on = main_child(scope, i);
        for (int c = scope->first_child[i]; c >= 0; c = scope->next_child[c])
            if (c != on)
                scope->mouth[scope->mouth_count++] = find_mouth(scope, i, c);
    }
    return true;
}

// Each patch has its own copy of its vertices.
static void fill_patches(Angioscope *scope, const TriangleMesh *mesh, const int *order, int *copy_of, uint32_t *index)
{
    for (int i = 0; i < mesh->vertex_count; i++)
        copy_of[i] = -1;
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (t % PATCH_TRIANGLES == 0)
            scope->patch[scope->patch_count++] = (Patch){.first_index = 3 * t, .first_vertex = scope->vertex_count};
        Patch *patch = &scope->patch[scope->patch_count - 1];
        for (int k = 0; k < 3; k++) {
            int v = mesh->triangle[order[t]][k];
            if (copy_of[v] < patch->first_vertex) {
                Vec3 p = vec3_sub(mesh->vertex[v], scope->origin), n = vec3_negate(mesh->normal[v]);
                copy_of[v] = scope->vertex_count;
                scope->node[scope->vertex_count] = mesh->node ? mesh->node[v] : -1;
                scope->vertex[scope->vertex_count++] = (WallVertex){{(float)p.x, (float)p.y, (float)p.z},
                                                                    {(float)n.x, (float)n.y, (float)n.z},
                                                                    {(float)texture_at(scope, p), (float)glow_at(scope, mesh->vertex[v])}};
                patch->vertex_count++;
            }
            index[patch->first_index + patch->index_count++] = (uint32_t)copy_of[v];
        }
    }
    for (int i = 0; i < scope->patch_count; i++)
        enclose(scope, &scope->patch[i]);
}

static void measure(Angioscope *scope, const TriangleMesh *mesh)
{
    double volume = 0, area = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangle[t];
        Vec3 a = vec3_sub(mesh->vertex[c[0]], scope->origin), b = vec3_sub(mesh->vertex[c[1]], scope->origin), d = vec3_sub(mesh->vertex[c[2]], scope->origin),
             across = vec3_cross(vec3_sub(b, a), vec3_sub(d, a));
        volume += vec3_dot(a, across) / 6;
        area += vec3_norm(across) / 2;
    }
    // for an open sheet: a fraction of its width
    scope->mean_radius = area > 0 ? fmax(2 * volume / area, 0.02 * sqrt(area)) : 1;
}

static const void *at_byte(size_t offset) { return (const void *)(uintptr_t)offset; }

static bool set_wall(Angioscope *scope, const TriangleMesh *mesh, char *message, size_t capacity)
{
    scope->mean_radius = 1;
    if (!mesh || mesh->triangle_count < 1)
        return true;
    if (!drawable_mesh_check(mesh, message, capacity))
        return false;
    scope->origin = mesh->vertex[mesh->triangle[0][0]];
    measure(scope, mesh);
    size_t triangles = (size_t)mesh->triangle_count, patches = triangles / PATCH_TRIANGLES + 1;
    int *order = morton_order(mesh);
    int *copy_of = malloc((size_t)mesh->vertex_count * sizeof *copy_of);
    uint32_t *index = malloc(3 * triangles * sizeof *index);
    scope->patch = calloc(patches, sizeof *scope->patch);
    scope->seen = calloc(patches, sizeof *scope->seen);
    scope->draw_count = calloc(patches, sizeof *scope->draw_count);
    scope->draw_offset = calloc(patches, sizeof *scope->draw_offset);
    scope->vertex = malloc(3 * triangles * sizeof *scope->vertex);
    scope->node = malloc(3 * triangles * sizeof *scope->node);
    bool good = order && copy_of && index && scope->patch && scope->seen && scope->draw_count && scope->draw_offset && scope->vertex && scope->node;
    if (good) {
        fill_patches(scope, mesh, order, copy_of, index);
        glBindVertexArray(scope->wall_array);
        glBindBuffer(GL_ARRAY_BUFFER, scope->wall_vertices);
        glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)scope->vertex_count * sizeof *scope->vertex), scope->vertex, GL_STATIC_DRAW);
        glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, scope->wall_indices);
        glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(3 * triangles * sizeof *index), index, GL_STATIC_DRAW);
        for (unsigned k = 0; k < 2; k++) {
            glEnableVertexAttribArray(k);
            glVertexAttribPointer(k, 3, GL_FLOAT, GL_FALSE, sizeof(WallVertex), at_byte(3 * k * sizeof(float)));
        }
        glEnableVertexAttribArray(3);
        glVertexAttribPointer(3, 2, GL_FLOAT, GL_FALSE, sizeof(WallVertex), at_byte(offsetof(WallVertex, look)));
        glBindVertexArray(0);
    }
    free(order);
    free(copy_of);
    free(index);
    return good || message_fail(message, capacity, "not enough memory for a surface of %d triangles", mesh->triangle_count);
}

Angioscope *angioscope_create(const TriangleMesh *mesh, const Vessel *vessel, const VesselTree *tree, char *message, size_t capacity)
{
    Angioscope *scope = calloc(1, sizeof *scope);
    if (!scope) {
        message_fail(message, capacity, "not enough memory for angioscopy");
        return NULL;
    }
    scope->vessel = vessel;
    scope->tree = tree;
    scope->program = gl_program_create(VERTEX, FRAGMENT, message, capacity);
    glGenVertexArrays(1, &scope->wall_array);
    glGenVertexArrays(1, &scope->tool_array);
    unsigned *const buffer[4] = {&scope->wall_vertices, &scope->wall_indices, &scope->tool_vertices, &scope->tool_indices};
    for (int k = 0; k < 4; k++)
        glGenBuffers(1, buffer[k]);
    if (scope->program && !read_tree(scope)) {
        message_fail(message, capacity, "not enough memory for angioscopy");
        angioscope_destroy(scope);
        return NULL;
    }
    if (!scope->program || !set_wall(scope, mesh, message, capacity)) {
        angioscope_destroy(scope);
        return NULL;
    }
    return scope;
}

void angioscope_destroy(Angioscope *scope)
{
    if (!scope)
        return;
    if (scope->program)
        glDeleteProgram(scope->program);
    const unsigned array[2] = {scope->wall_array, scope->tool_array};
    glDeleteVertexArrays(2, array);
    const unsigned buffer[4] = {scope->wall_vertices, scope->wall_indices, scope->tool_vertices, scope->tool_indices};
    glDeleteBuffers(4, buffer);
    gl_canvas_destroy(&scope->canvas);
    primitives_free(&scope->primitives);
    free(scope->first_child);
    free(scope->next_child);
    free(scope->mouth);
    free(scope->patch);
    free(scope->vertex);
    free(scope->node);
    free(scope->seen);
    free(scope->draw_count);
    free(scope->draw_offset);
    free(scope);
}

// --- the eye ---

// The axis of the tool `back` mm behind its tip.
static Vec3 axis_behind_tip(const PoseTool *tool, double back)
{
    int i = tool->node_count - 1;
    while (i > 0) {
        Vec3 here = tool->node[i].position, before = tool->node[i - 1].position;
        double length = vec3_distance(here, before);
        if (!(length < back))
            return length > 0 ? vec3_mix(here, before, back / length) : here;
        back -= length;
        i--;
    }
    return tool->node[0].position;
}

static double lumen_at(const Angioscope *scope, const Pose *pose, int tool, double s)
{
    return scope->tools && tool < scope->tools->count ? tool_look_at(tool_looks_of(scope->tools, tool, pose->tool[tool].fitted), s)->lumen : 0;
}

// The tool around the eye of `tool`, `back` mm behind its tip: the innermost tool whose lumen contains the eye, or -1. `ahead` [mm]: distance of the eye beyond
// the end of
// the last tool that does not contain it.
static int tool_around(const Angioscope *scope, const Pose *pose, int tool, double back, double *lumen, double *ahead)
{
    double eye = pose->tool[tool].node[pose->tool[tool].node_count - 1].s - back;
    *ahead = HUGE_VAL;
    *lumen = HUGE_VAL;
    for (int k = tool - 1; k >= 0; k--) {
        const PoseTool *outer = &pose->tool[k];
        double past = eye - pose_tool_passes(pose, tool, k), inner = lumen_at(scope, pose, k, outer->node[outer->node_count - 1].s + fmin(past, 0));
        if (past < *ahead && inner > 0) {
            *ahead = past;
            *lumen = inner;
        }
        if (past < 0 && inner > 0)
            return k;
    }
    return -1;
}

// Gap and inward normal at a point; false if no wall is near or known.
static bool wall_at(const Angioscope *scope, Vec3 x, int node, double reach, double *gap, Vec3 *normal)
{
    if (!scope->vessel)
        return false;
    VesselMemory memory = {.node = scope->vessel->locate(scope->vessel, x, node)};
    VesselHit hit;
    vessel_query(scope->vessel, 1, &x, reach, &memory, &hit);
    *gap = hit.gap;
    *normal = hit.normal;
    return !(hit.flags & (VESSEL_FAR | VESSEL_OPEN_END)) && isfinite(hit.gap) && vec3_is_finite(hit.normal) && vec3_norm2(hit.normal) > 0.25;
}

static Vec3 across(Vec3 v, Vec3 axis, Vec3 otherwise)
{
    Vec3 flat = vec3_add_scaled(v, -vec3_dot(v, axis), axis);
    return vec3_norm(flat) > 1e-6 ? vec3_unit(flat) : otherwise;
}

// The selected tool, or the one that reaches furthest; NULL if there is none.
static const PoseTool *looks_from(const Pose *pose, int *tool)
{
    if (!pose || pose->node_count < 2 || *tool >= pose->tool_count)
        return NULL;
    *tool = *tool < 0 ? pose_most_distal(pose) : *tool;
    return pose->tool[*tool].node_count > 1 ? &pose->tool[*tool] : NULL;
}

static int vessel_node_at_tip(const Pose *pose, int tool) { return pose->node[(int)lround(pose_tool_end(pose, tool))].vessel_node; }

static double lumen_radius(const Angioscope *scope, const Pose *pose, int tool)
{
    int node = vessel_node_at_tip(pose, tool);
    return scope->tree && node >= 0 && node < scope->tree->node_count ? scope->tree->radius[node] : scope->mean_radius;
}

// The neighbour of a node, except `before`, that lies most nearly in the direction `heading`; -1 if all lie backwards.
static int node_towards(const Angioscope *scope, int node, int before, Vec3 heading)
{
    const VesselTree *tree = scope->tree;
    int best = -1, parent = tree->parent[node];
    double most = -0.2;
    for (int i = parent >= 0 ? parent : scope->first_child[node]; i >= 0; i = i == parent ? scope->first_child[node] : scope->next_child[i]) {
        double along = vec3_dot(vec3_unit_or(vec3_sub(tree->center[i], tree->center[node]), vec3(0, 0, 0)), heading);
        if (i != before && along > most) {
            best = i;
            most = along;
        }
    }
    return best;
}

// The point of the centreline three radii ahead of a tip that lies at `node` and points to `heading`; false if the vessel ends before one radius.
static bool centreline_ahead(const Angioscope *scope, Vec3 tip, int node, Vec3 heading, double radius, Vec3 *point)
{
    const VesselTree *tree = scope->tree;
    *point = tip;
    if (!is_tree_usable(tree) || node < 0 || node >= tree->node_count)
        return false;
    const double wanted = 3 * radius;
    const Vec3 pointing = heading;       // of the tool, which chooses at a fork near its tip
    double walked = -vec3_dot(vec3_sub(tip, tree->center[node]), heading);
    for (int before = -1, next; walked < wanted && (next = node_towards(scope, node, before, heading)) >= 0; before = node, node = next) {
        Vec3 on = vec3_sub(tree->center[next], tree->center[node]);
        double length = vec3_norm(on);
        *point = vec3_add_scaled(tree->center[node], length > 0 ? fmin(fmax((wanted - walked) / length, 0), 1) : 0, on);
        walked += length;
        heading = walked < 1.5 * radius ? pointing : vec3_unit_or(on, heading);
        if (!(length > 0))
            return false;
    }
    return walked > radius;
}

bool angioscope_view(const Angioscope *scope, const Pose *pose, int tool, AngioscopeView *view)
{
    const PoseTool *own = looks_from(pose, &tool);
    if (!own)
        return false;
    const ToolNode *last = &own->node[own->node_count - 1];
    // in a vessel whose radius is known the eye is so far from the tool that its tip is small
    double wide = is_tree_usable(scope->tree) ? lumen_radius(scope, pose, tool) : 0;
    double radius = fmax(last->radius, 1e-3), back = fmax(7.5 * radius, 0.9 * wide), beside = fmax(2.8 * radius, 0.6 * wide), margin = 0.8 * radius;
    Vec3 tip = last->position, behind = axis_behind_tip(own, back), forward = quat_rotate(last->orientation, vec3(1, 0, 0));
    Vec3 upright = quat_rotate(last->orientation, vec3(0, 1, 0));
    if (!isfinite(radius) || !vec3_is_finite(tip) || !vec3_is_finite(behind) || !vec3_is_finite(forward) || !vec3_is_finite(upright))
        return false;
    forward = vec3_unit(forward);
    Vec3 up = across(upright, forward, vec3_normal_to(forward)), normal;
    double gap, room = beside + margin, lumen, ahead;
    int node = vessel_node_at_tip(pose, tool), around = tool_around(scope, pose, tool, back, &lumen, &ahead);
    // inside another tool the eye is midway between the two; it rises to its normal place after leaving it
    double out = fmin(fmax(ahead / (4 * radius), 0), 1), near_axis = fmin((radius + lumen) / 2, beside);
    beside = near_axis + (beside - near_axis) * out * out * (3 - 2 * out);
    // near a wall the eye moves away from it; away from walls it stays above the tool in the tool's own frame; in between both are blended
    if (around < 0 && wall_at(scope, behind, node, 2 * room, &gap, &normal)) {
        double t = fmin(fmax(2 - gap / room, 0), 1), weight = 2 * t * t * (3 - 2 * t) * out;
        up = across(vec3_add_scaled(up, weight, normal), forward, up);
    }
    Vec3 eye = vec3_add_scaled(behind, beside, up);
    // a tool inside the vessel puts the eye outside by less than `room`; the eye of a tool that has left the vessel is not moved back
    for (int k = 0; k < 4 && around < 0 && wall_at(scope, eye, node, 2 * room, &gap, &normal) && gap < margin && gap > -room; k++)
        eye = vec3_add_scaled(eye, out * (margin - gap), normal);
    Vec3 point;
    if (around < 0 && centreline_ahead(scope, tip, node, forward, wide, &point)) {
        forward = vec3_unit(vec3_mix(forward, vec3_unit_or(vec3_sub(point, eye), forward), along_lumen * out));
        up = across(up, forward, vec3_normal_to(forward));
    }
    *view = (AngioscopeView){.eye = eye, .right = vec3_cross(forward, up), .up = up, .forward = forward, .half_angle_tan = tan(half_angle)};
    return vec3_is_finite(eye);
}

void angioscope_set_tools(Angioscope *scope, const ToolLooks *tools) { scope->tools = tools; }
void angioscope_set_sheath(Angioscope *scope, SheathLook sheath) { scope->sheath = sheath; }
void angioscope_set_full_detail(Angioscope *scope, bool on) { scope->full_detail = on; }

// --- drawing ---

// Perspective from space relative to `origin` to clip space, column-major.
static void view_matrix(const AngioscopeView *view, Vec3 origin, double aspect, double near, double far, float matrix[16])
{
    double tx = view->half_angle_tan * (aspect > 1 ? aspect : 1), ty = view->half_angle_tan / (aspect < 1 ? aspect : 1);
    Vec3 offset = vec3_sub(origin, view->eye);
    double a = (far + near) / (far - near), b = -2 * far * near / (far - near);
    const Vec3 row[4] = {vec3_scale(view->right, 1 / tx), vec3_scale(view->up, 1 / ty), vec3_scale(view->forward, a), view->forward};
    for (int i = 0; i < 4; i++) {
        matrix[i] = (float)row[i].x;
        matrix[4 + i] = (float)row[i].y;
        matrix[8 + i] = (float)row[i].z;
        matrix[12 + i] = (float)(vec3_dot(row[i], offset) + (i == 2 ? b : 0));
    }
}

static void find_normals(Angioscope *scope, Patch *patch)
{
    patch->has_field_normals = true;
    if (!scope->vessel)
        return;
    for (int i = patch->first_vertex; i < patch->first_vertex + patch->vertex_count; i++) {
        WallVertex *v = &scope->vertex[i];
        Vec3 p = vec3_add(scope->origin, vec3(v->position[0], v->position[1], v->position[2])), n = vec3(v->normal[0], v->normal[1], v->normal[2]);
        VesselMemory memory = {.node = scope->node[i]};
        VesselHit hit;
        vessel_query(scope->vessel, 1, &p, 0.1 * scope->mean_radius, &memory, &hit);
        // if a different wall is found here, or none, keep the normal of the mesh
        if (!hit.flags && vec3_is_finite(hit.normal) && vec3_dot(hit.normal, n) > 0.5)
            v->normal[0] = (float)hit.normal.x, v->normal[1] = (float)hit.normal.y, v->normal[2] = (float)hit.normal.z;
    }
    glBindBuffer(GL_ARRAY_BUFFER, scope->wall_vertices);
    glBufferSubData(GL_ARRAY_BUFFER, (GLintptr)((size_t)patch->first_vertex * sizeof(WallVertex)),
                    (GLsizeiptr)((size_t)patch->vertex_count * sizeof(WallVertex)), scope->vertex + patch->first_vertex);
}

static int nearer_first(const void *a, const void *b)
{
    const SeenPatch *x = a, *y = b;
    if (x->distance != y->distance)
        return x->distance < y->distance ? -1 : 1;
    return (x->patch > y->patch) - (x->patch < y->patch);
}

// Chooses the patches in the view and before the dark, from near to far. Returns their number.
static int choose_patches(Angioscope *scope, const AngioscopeView *view, double aspect, double reach)
{
    double tx = view->half_angle_tan * (aspect > 1 ? aspect : 1), ty = view->half_angle_tan / (aspect < 1 ? aspect : 1);
    const Vec3 side[4] = {vec3_unit(vec3_add_scaled(view->right, tx, view->forward)), vec3_unit(vec3_add_scaled(vec3_negate(view->right), tx, view->forward)),
                          vec3_unit(vec3_add_scaled(view->up, ty, view->forward)), vec3_unit(vec3_add_scaled(vec3_negate(view->up), ty, view->forward))};
    Vec3 eye = vec3_sub(view->eye, scope->origin);
    int count = 0;
    for (int i = 0; i < scope->patch_count; i++) {
        const Patch *patch = &scope->patch[i];
        Vec3 d = vec3_sub(patch->center, eye);
        double distance = vec3_norm(d) - patch->radius;
        bool seen = distance < reach && vec3_dot(d, view->forward) > -patch->radius;
        for (int k = 0; k < 4 && seen; k++)
            seen = vec3_dot(d, side[k]) > -patch->radius;
        if (!seen)
            continue;
        scope->seen[count++] = (SeenPatch){distance, i};
    }
    if (count > 1)
        qsort(scope->seen, (size_t)count, sizeof *scope->seen, nearer_first);
    return count;
}

static void draw_wall(Angioscope *scope, const AngioscopeView *view, double aspect, double reach)
{
    int count = choose_patches(scope, view, aspect, reach);
    if (count == 0)
        return;
    for (int i = 0; i < count; i++) {
        Patch *patch = &scope->patch[scope->seen[i].patch];
        if (!patch->has_field_normals)
            find_normals(scope, patch);
        scope->draw_count[i] = patch->index_count;
        scope->draw_offset[i] = at_byte((size_t)patch->first_index * sizeof(uint32_t));
    }
    glUniform4f(glGetUniformLocation(scope->program, "tint"), 0.84f, 0.33f, 0.26f, 0);
    glUniform3f(glGetUniformLocation(scope->program, "shine"), 0.30f, 1, 0.5f);
    glUniform1f(glGetUniformLocation(scope->program, "edge"), 0);
    glCullFace(GL_FRONT);
    glBindVertexArray(scope->wall_array);
    glVertexAttrib4f(2, 1, 1, 1, 1);
    glMultiDrawElements(GL_TRIANGLES, scope->draw_count, GL_UNSIGNED_INT, scope->draw_offset, count);
}

// Adds the part of a tool that is near enough to be visible.
static void add_tool(Angioscope *scope, const Pose *pose, int k, bool is_own, Vec3 eye, double reach)
{
    enum { NODES = 160 };
    const PoseTool *tool = &pose->tool[k];
    Vec3 point[NODES];
    double radius[NODES], lumen[NODES], nearest = HUGE_VAL;
    Color color[NODES];
    int last = tool->node_count - 1, middle = last, count = 0;
    // the end of the own tool; for another tool the part around the eye
    for (int i = last; i >= 0 && !is_own; i--) {
        double distance = vec3_distance(tool->node[i].position, eye);
        middle = distance < nearest ? i : middle;
        nearest = fmin(nearest, distance);
    }
    int first = middle, end = middle;
    for (double distance = 0;
         first > 0 && middle - first < NODES / 2 - 1 + is_own * NODES / 2 && distance < reach && vec3_is_finite(tool->node[first - 1].position); first--)
        distance += vec3_distance(tool->node[first].position, tool->node[first - 1].position);
    for (double distance = 0; end < last && end - middle < NODES / 2 && distance < reach && vec3_is_finite(tool->node[end + 1].position); end++)
        distance += vec3_distance(tool->node[end].position, tool->node[end + 1].position);
    bool is_hollow = false;
    for (int i = first; i <= end; i++, count++) {
        point[count] = tool->node[i].position;
        radius[count] = tool->node[i].radius;
        lumen[count] = lumen_at(scope, pose, k, tool->node[i].s);
        color[count] = color_rgb(206, 212, 220);
        is_hollow |= lumen[count] > 0;
    }
    scope->primitives.sides = is_own ? 48 : 32;
    if (is_hollow)
        primitives_pipe(&scope->primitives, count, point, radius, lumen, color, color_rgb(58, 62, 70), NULL);
    else
        primitives_tube(&scope->primitives, count, point, radius, color);
}

// The sheath, if it is near enough to be visible.
static void add_sheath(Angioscope *scope, Vec3 eye, double reach)
{
    const SheathLook *sheath = &scope->sheath;
    if (!sheath->is_there || vec3_distance(eye, sheath->mouth) > reach)
        return;
    const Vec3 point[2] = {vec3_add_scaled(sheath->mouth, -SHEATH_SHOWN_MM, sheath->direction), sheath->mouth};
    const double radius[2] = {sheath->radius, sheath->radius}, lumen[2] = {sheath->lumen, sheath->lumen};
    const Color color[2] = {color_rgb(150, 156, 166), color_rgb(150, 156, 166)};
    scope->primitives.sides = 32;
    primitives_pipe(&scope->primitives, 2, point, radius, lumen, color, color_rgb(44, 48, 56), NULL);
}

static void draw_tools(Angioscope *scope, const Pose *pose, int own, Vec3 eye, double reach)
{
    primitives_clear(&scope->primitives);
    scope->primitives.origin = scope->origin;
    for (int k = 0; k < pose->tool_count; k++)
        add_tool(scope, pose, k, k == own, eye, reach);
    add_sheath(scope, eye, reach);
    const Primitives *tool = &scope->primitives;
    if (tool->index_count == 0)
        return;
    glBindVertexArray(scope->tool_array);
    glBindBuffer(GL_ARRAY_BUFFER, scope->tool_vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)tool->vertex_count * sizeof *tool->vertex), tool->vertex, GL_STREAM_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, scope->tool_indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)((size_t)tool->index_count * sizeof *tool->index), tool->index, GL_STREAM_DRAW);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(PrimitiveVertex), at_byte(offsetof(PrimitiveVertex, position)));
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(PrimitiveVertex), at_byte(offsetof(PrimitiveVertex, normal)));
    glEnableVertexAttribArray(2);
    glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(PrimitiveVertex), at_byte(offsetof(PrimitiveVertex, color)));
    glUniform4f(glGetUniformLocation(scope->program, "tint"), 0, 0, 0, 1);
    glUniform3f(glGetUniformLocation(scope->program, "shine"), 0.5f, 1, 0);
    glUniform1f(glGetUniformLocation(scope->program, "edge"), 1);
    glVertexAttrib2f(3, 1, 0);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glCullFace(GL_BACK);
    glDrawElements(GL_TRIANGLES, tool->index_count, GL_UNSIGNED_INT, at_byte(0));
}

static void draw_inside(Angioscope *scope, const Pose *pose, int tool, ViewPort port)
{
    AngioscopeView view;
    const PoseTool *own = looks_from(pose, &tool);
    if (!own || !angioscope_view(scope, pose, tool, &view))
        return;
    double radius = lumen_radius(scope, pose, tool), fog = fog_reach * radius, reach = fog_end * fog;
    double aspect = (double)port.width / port.height, near = 0.04 * fmax(own->node[own->node_count - 1].radius, 1e-3);
    // the light fades in while the tip leaves the sheath
    double t = pose->first_free_node > 0 ? fmin(fmax(own->inserted_mm, 0), 1) : 1;
    float clip[16];
    view_matrix(&view, scope->origin, aspect, near, reach + near, clip);
    Vec3 eye = vec3_sub(view.eye, scope->origin);
    glUseProgram(scope->program);
    glUniformMatrix4fv(glGetUniformLocation(scope->program, "clip"), 1, GL_FALSE, clip);
    glUniform3f(glGetUniformLocation(scope->program, "eye"), (float)eye.x, (float)eye.y, (float)eye.z);
    glUniform4f(glGetUniformLocation(scope->program, "lamp"), (float)(1 / (lamp_reach * lamp_reach * radius * radius)), (float)(1 / fog), (float)(1.35 * t),
                0.12f);
    glUniform3fv(glGetUniformLocation(scope->program, "dark"), 1, dark);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDisable(GL_BLEND);
    glEnable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
    draw_wall(scope, &view, aspect, reach);
    draw_tools(scope, pose, tool, view.eye, reach);
    glBindVertexArray(0);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glDisable(GL_DEPTH_TEST);
}

void angioscope_draw(Angioscope *scope, const Pose *pose, int tool, ViewPort port)
{
    if (port.width < 1 || port.height < 1)
        return;
    GlCanvas *canvas = &scope->canvas;
    int samples = scope->full_detail ? FINE_SAMPLES : 1;
    if (canvas->width != port.width || canvas->height != port.height || scope->samples != samples) {
        gl_canvas_destroy(canvas);
        if (!gl_canvas_create(canvas, port.width, port.height, samples, NULL, 0))
            return;
        scope->samples = samples;
    }
    gl_canvas_begin(canvas, dark);
    draw_inside(scope, pose, tool, port);
    gl_canvas_resolve(canvas);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, canvas->resolved);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, port.framebuffer);
    glBlitFramebuffer(0, 0, port.width, port.height, port.x, port.y, port.x + port.width, port.y + port.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, port.framebuffer);
}

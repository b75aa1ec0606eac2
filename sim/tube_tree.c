// The axis is traced by queries to the tube: at a probe beside the axis, gap and normal give the point x + (r - gap) normal of the axis. So lines, arcs and
// polylines need no special code here.
#include "sim/tube_tree.h"

#include "base/base.h"

#include <stdlib.h>

enum { SAMPLES = 48, MOST_NODES = 200000 };

typedef struct Axis {
    int count, capacity;
    Vec3 *point;
} Axis;

static bool axis_add(Axis *axis, Vec3 x)
{
    if (axis->count == axis->capacity) {
        int wanted = axis->capacity * 2 + 256;
        Vec3 *point = wanted <= 2 * MOST_NODES ? realloc(axis->point, (size_t)wanted * sizeof *point) : NULL;
        if (!point)
            return false;
        axis->point = point;
        axis->capacity = wanted;
    }
    axis->point[axis->count++] = x;
    return true;
}

static VesselHit ask(const Vessel *tube, Vec3 x, double reach, VesselMemory *memory)
{
    VesselHit hit;
    vessel_query(tube, 1, &x, reach, memory, &hit);
    return hit;
}

// A step from x along d: sets the axis' point there; returns false beyond the end.
static bool follow(const Vessel *tube, double r, double step, Vec3 x, Vec3 d, VesselMemory *memory, Vec3 *next)
{
    Vec3 probe = vec3_add_scaled(vec3_add_scaled(x, step, d), 0.4 * r, vec3_normal_to(d));
    VesselHit hit = ask(tube, probe, 4 * r, memory);
    if (hit.flags & (VESSEL_OPEN_END | VESSEL_BEYOND | VESSEL_FAR | VESSEL_UNSURE))
        return false;
    *next = vec3_add_scaled(probe, r - hit.gap, hit.normal);
    return vec3_dot(vec3_sub(*next, x), d) > 0.5 * step;
}

static bool trace_axis(const Vessel *tube, const TubeOptions *options, Axis *axis)
{
    Vec3 x, d, next;
    if (!tube->inlet(tube, &x, &d) || !axis_add(axis, x))
        return false;
    VesselMemory memory = {.node = tube->locate(tube, x, -1)};
    double step = options->radius / 2;
    while (follow(tube, options->radius, step, x, d, &memory, &next)) {
        if (!axis_add(axis, next) || axis->count > MOST_NODES)
            return false;
        d = vec3_unit(vec3_sub(next, x));
        x = next;
    }
    return axis->count >= 3;
}

// The point of the surface from x in direction `out`; returns false if there is no wall there.
static bool sample(const Vessel *tube, Vec3 x, Vec3 out, double r, VesselMemory *memory, Vec3 *surface)
{
    Vec3 probe = vec3_add_scaled(x, 0.9 * r, out);
    VesselHit hit = ask(tube, probe, 4 * r, memory);
    if (hit.flags & (VESSEL_OPEN_END | VESSEL_BEYOND | VESSEL_FAR | VESSEL_UNSURE))
        return false;
    *surface = vec3_add_scaled(probe, -hit.gap, hit.normal);
    return true;
}

static void sample_node(VesselTree *tree, const Vessel *tube, const TubeOptions *options, int i)
{
    double r = options->radius, golden = PI * (3 - sqrt(5)), end = i == 0 ? -1 : i == tree->node_count - 1 ? 1 : 0;
    Vec3 d = tree->direction[i], e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1);
    VesselMemory memory = {.node = tube->locate(tube, tree->center[i], -1)};
    for (int k = 0; k < SAMPLES; k++) {
        double angle = (k + i * SAMPLES) * golden;
        Vec3 across = vec3_add(vec3_scale(e1, same_cos(angle)), vec3_scale(e2, same_sin(angle)));
        Vec3 at = vec3_add_scaled(tree->center[i], tree->height[i] * ((k + 0.5) / SAMPLES - 0.5), d);
        tree->point_count += sample(tube, at, across, r, &memory, &tree->point[tree->point_count]);
        if (end == 0 || !options->closed_ends)
            continue;
        double z = (k + 0.5) / SAMPLES;
        Vec3 cap = vec3_add_scaled(vec3_scale(across, sqrt(1 - z * z)), end * z, d);
        tree->point_count += sample(tube, tree->center[i], cap, r, &memory, &tree->point[tree->point_count]);
    }
    tree->point_offset[i + 1] = tree->point_count;
}

VesselTree *tube_tree(const Vessel *tube, const TubeOptions *options, const char *file, Faults *faults)
{
    Axis axis = {0};
    VesselTree *tree = trace_axis(tube, options, &axis) ? vessel_tree_create(axis.count, (int64_t)axis.count * SAMPLES * 2, 0) : NULL;
    if (!tree) {
        faults_add(faults, file, 0, 0, "the tube cannot be fitted: its axis has %d points; make it longer, or use contact 'tube'", axis.count);
        free(axis.point);
        return NULL;
    }
    tree->point_count = 0;   // counts up as samples come
    for (int i = 0; i < axis.count; i++) {
        int before = i > 0 ? i - 1 : 0, after = i + 1 < axis.count ? i + 1 : i;
        tree->center[i] = axis.point[i];
        tree->direction[i] = vec3_unit(vec3_sub(axis.point[after], axis.point[before]));
        tree->radius[i] = options->radius;
        tree->height[i] = options->radius / 2;
        tree->parent[i] = i - 1;
    }
    for (int i = 0; i < axis.count; i++)
        sample_node(tree, tube, options, i);
    free(axis.point);
    bool good = vessel_tree_validate(tree, file, faults);
    if (good && !vessel_tree_link(tree)) {
        faults_add(faults, file, 0, 0, "not enough memory for the tube's tree");
        good = false;
    }
    if (!good) {
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

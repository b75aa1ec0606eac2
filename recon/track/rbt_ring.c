// Implements rbt_ring.h. The edge level is halfway between the background beside the vessel and the brightness at the ring's middle, so that a dim place has
// an edge too.
#include "recon/track/rbt_ring.h"

#include "base/base.h"
#include "recon/track/cast_rays.h"

enum { SAMPLES_MOST = 160, SCALE_NODES = 8, ROUNDS = 2 };
static const double MOST_MOVED = 0.8;     // largest shift of a node placed on voxels, in its radii; also at most a voxel
static const double NARROW = 2;           // [voxel] largest radius of a node that is measured by a ring

static double reach_of(const Tracker *t, double radius) { return 1.2 * RING_WIDEST * radius + 2 * t->voxel; }

void rbt_ring_cast(const Tracker *t, Vec3 x, Vec3 axis, const LinkLight *light, double radius, Vec3 *direction, double *distance)
{
    double reach = reach_of(t, radius);
    Vec3 u = vec3_normal_to(axis), v = vec3_cross(axis, u);
    int samples = (int)fmin(SAMPLES_MOST, fmax(24, ceil(reach / (0.15 * t->voxel))));
    RayOptions rays = {reach, samples, t->parameters->ray_smoothing_voxels * t->voxel, 0};
    double inside = fmin(tracker_brightness(t, x), light->inside);
    for (int k = 0; k < RING; k++) {
        double angle = 2 * PI * (k + 0.5) / RING;
        direction[k] = vec3_add(vec3_scale(u, same_cos(angle)), vec3_scale(v, same_sin(angle)));
    }
    cast_rays_level_edge(t->volume, x, direction, RING, &rays, light->outside + 0.5 * (inside - light->outside), distance);
}

double rbt_ring_median(const double *distance, double most)
{
    double sorted[RING];
    int count = 0;
    for (int k = 0; k < RING; k++)
        if (distance[k] > 0 && distance[k] < most)
            sorted[count++] = distance[k];
    sort_doubles(sorted, (size_t)count);
    return 2 * count >= RING ? 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]) : 0;
}

double rbt_ring_scale(const Tracker *t, int node, const LinkLight *light)
{
    const Track *tree = &t->tree;
    double ratio[SCALE_NODES], distance[RING];
    Vec3 direction[RING];
    int count = 0;
    for (int i = node; i < tree->count && i < node + SCALE_NODES && tree->node[i].branch == tree->node[node].branch; i++) {
        const Cylinder *c = &tree->node[i].cylinder;
        rbt_ring_cast(t, c->center, c->axis, light, c->radius, direction, distance);
        double edge = rbt_ring_median(distance, reach_of(t, c->radius));
        if (edge > 0 && tree->node[i].kind == NODE_VESSEL && !tree->node[i].is_junction)
            ratio[count++] = c->radius / edge;
    }
    sort_doubles(ratio, (size_t)count);
    return count > 0 ? fmax(0.6, fmin(1.5, ratio[count / 2])) : 1;
}

bool rbt_ring_center(const Vec3 *direction, const double *distance, double most, Vec3 axis, Vec3 *offset)
{
    Vec3 u = direction[0], v = vec3_cross(axis, u);
    double a[3][3] = {{0}}, b[3] = {0};
    int count = 0;
    for (int k = 0; k < RING; k++) {
        if (!(distance[k] > 0 && distance[k] < most))
            continue;
        double row[3] = {distance[k] * vec3_dot(direction[k], u), distance[k] * vec3_dot(direction[k], v), 1};
        for (int i = 0; i < 3; i++) {
            b[i] += row[i] * distance[k] * distance[k];
            for (int j = 0; j < 3; j++)
                a[i][j] += row[i] * row[j];
        }
        count++;
    }
    double det = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                 a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
    if (4 * count < 3 * RING || !(fabs(det) > 1e-300))
        return false;
    double p = b[0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (b[1] * a[2][2] - a[1][2] * b[2]) + a[0][2] * (b[1] * a[2][1] - a[1][1] * b[2]);
    double q = a[0][0] * (b[1] * a[2][2] - a[1][2] * b[2]) - b[0] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) + a[0][2] * (a[1][0] * b[2] - b[1] * a[2][0]);
    *offset = vec3_add(vec3_scale(u, 0.5 * p / det), vec3_scale(v, 0.5 * q / det));
    return true;
}

// --- nodes placed on the image's voxels ---

// Returns true if a node was placed on voxels and is narrow. In wide openings half a voxel does not matter, and rays in all directions are better.
static bool is_set(const Track *tree, int i, double voxel)
{
    return i > 0 && i < tree->count && tree->node[i].is_on_voxels && tree->node[i].cylinder.radius < NARROW * voxel;
}

static bool follows(const Track *tree, int i) { return i < tree->count && tree->node[i].parent == i - 1 && tree->node[i].branch == tree->node[i - 1].branch; }

// Moves a node halfway to the mean of its neighbours, by half a voxel at most, because a path from voxel to voxel is a staircase.
static void straighten(Track *tree, double voxel)
{
    Vec3 before = tree->count > 0 ? tree->node[0].cylinder.center : vec3(0, 0, 0);
    for (int i = 1; i < tree->count; i++) {
        Vec3 here = tree->node[i].cylinder.center;
        if (is_set(tree, i, voxel) && follows(tree, i + 1)) {
            Vec3 up = tree->node[i].parent == i - 1 ? before : tree->node[tree->node[i].parent].cylinder.center;
            Vec3 move = vec3_add_scaled(vec3_scale(vec3_add(up, tree->node[i + 1].cylinder.center), 0.25), -0.5, here);
            tree->node[i].cylinder.center = vec3_add_scaled(here, fmin(1, 0.5 * voxel / fmax(vec3_norm(move), 1e-12)), move);
        }
        before = here;
    }
}

static void set_axes(Track *tree, double voxel)
{
    for (int i = 1; i < tree->count; i++)
        if (is_set(tree, i, voxel) && follows(tree, i + 1)) {
            Vec3 along = vec3_sub(tree->node[i + 1].cylinder.center, tree->node[tree->node[i].parent].cylinder.center);
            tree->node[i].cylinder.axis = vec3_unit_or(along, tree->node[i].cylinder.axis);
        }
}

// Returns the first measured node after `from`; `from` itself if there is none.
static int measured_behind(const Track *tree, int from, double voxel)
{
    int i = from;
    while (is_set(tree, i, voxel) && follows(tree, i + 1))
        i++;
    return is_set(tree, i, voxel) ? from : i;
}

// Measures centre, radius and points by rays perpendicular to the vessel. This removes the spurious walls across the vessel that rays in all directions found
// in dim places. Nodes whose ring is open to the side are unchanged.
static void measure_set_node(const Tracker *t, TrackNode *n, Vec3 *point, double scale)
{
    Cylinder *c = &n->cylinder;
    LinkLight light = {tracker_brightness(t, c->center), tracker_brightness(t, c->center) - fmax(n->contrast, 0)};
    Vec3 direction[RING], offset, from = c->center;
    double distance[RING], most = RING_WIDEST * c->radius / scale;
    for (int round = 0; round < ROUNDS; round++) {
        rbt_ring_cast(t, c->center, c->axis, &light, c->radius, direction, distance);
        Vec3 middle = rbt_ring_center(direction, distance, most, c->axis, &offset) ? vec3_add(c->center, offset) : from;
        if (vec3_distance(middle, from) > fmin(MOST_MOVED * c->radius, t->voxel) || tracker_is_forbidden(t, middle))
            break;
        c->center = middle;
    }
    rbt_ring_cast(t, c->center, c->axis, &light, c->radius, direction, distance);
    double edge = rbt_ring_median(distance, most);
    int kept = 0, met = 0;
    for (int k = 0; k < RING; k++)
        met += distance[k] > 0 && distance[k] < most;
    if (!(edge > 0) || 4 * met < 3 * RING)
        return;
    c->radius = fmax(0.6 * c->radius, fmin(1.6 * c->radius, scale * edge));
    for (int k = 0; k < RING && kept < n->point_count; k++)
        if (distance[k] > 0 && distance[k] < most && scale * distance[k] < 1.6 * c->radius)
            point[kept++] = vec3_add_scaled(c->center, scale * distance[k], direction[k]);
    n->point_count = kept;   // the space after them stays unused
}

void rbt_measure_set_nodes(Tracker *t)
{
    Track *tree = &t->tree;
    straighten(tree, t->voxel);
    set_axes(tree, t->voxel);
    for (int i = 1; i < tree->count; i++) {
        if (!is_set(tree, i, t->voxel) || !follows(tree, i + 1))
            continue;
        int behind = measured_behind(tree, i, t->voxel);
        LinkLight light = rbt_link_light(tree, t, behind);
        measure_set_node(t, &tree->node[i], tree->point + tree->node[i].point_start, rbt_ring_scale(t, behind, &light));
    }
    set_axes(tree, t->voxel);
}

// The centre starts at the widest place of the limb and moves to the centre of the sphere fitted by least squares to the first wall points. The limb is a sac
// if even the nearest walls (10th percentile) are clearly further away than the vessel's radius, and if few rays reach no wall within reach. Bone and open
// background extend further, and a vessel that merely continues is no wider than before.
// An aneurysm that is not spherical gets further centres (section 3.4 has several in a giant one). The next centre is the point between the first centre and
// its walls whose inscribed ball protrudes furthest from the other centres' balls, until none protrudes much. A spherical aneurysm keeps a single centre.
#include "recon/track/rbt_sacs.h"
#include "base/base.h"
#include "recon/track/cast_rays.h"
#include "recon/volume/bspline.h"

#include <stdlib.h>

static const double wider = 1.3;          // least ratio of its radius to the radius of the vessel beside it
static const double least_closed = 0.7;   // least fraction of the rays that reach a wall
// For a further centre's inscribed ball, as fractions of the first one's radius: its least radius, and how far it must protrude from the other balls.
static const double least_lobe = 0.35;

// The vessel's radius around its node, without its widening in front of the neck.
static double radius_beside(const Track *tree, int node)
{
    enum { HALF = 24 };
    double radius[2 * HALF + 1];
    int n = 0;
    for (int i = node - HALF; i <= node + HALF; i++)
        if (i >= 0 && i < tree->count && tree->node[i].branch == tree->node[node].branch)
            radius[n++] = tree->node[i].cylinder.radius;
    sort_doubles(radius, (size_t)n);
    return radius[n / 2];
}

// Finds the distances of the first walls from x: distance[0 … rays-1], 0 if there is none; `sorted` receives the same in ascending order without the zeros.
// Returns their number.
static int see_walls(const Tracker *t, Vec3 x, const Vec3 *ray, int rays, double reach, double *distance, double *sorted)
{
    int samples = (int)(reach / (0.5 * t->voxel)), met = 0;
    RayOptions options = {reach, samples < 32 ? 32 : samples > MAX_RAY_SAMPLES ? MAX_RAY_SAMPLES : samples, t->parameters->ray_smoothing_voxels * t->voxel, 0};
    cast_rays_first_edge(t->volume, x, ray, rays, &options, distance);
    for (int i = 0; i < rays; i++)
        if (distance[i] > 0)
            sorted[met++] = distance[i];
    sort_doubles(sorted, (size_t)met);
    return met;
}

// Keeps walls within 1.5 times the median distance, because rays along the vessels reach far. Writes the points to `point` and returns their number.
static int near_walls(Vec3 x, const Vec3 *ray, int rays, const double *distance, double median, Vec3 *point)
{
    int kept = 0;
    for (int i = 0; i < rays; i++)
        if (distance[i] > 0 && distance[i] < 1.5 * median)
            point[kept++] = vec3_add_scaled(x, distance[i], ray[i]);
    return kept;
}

// Removes wall points that lie in the vessels' tubes: they belong to the vessels.
static int drop_painted(const RbtPaint *paint, Vec3 *point, int count)
{
    int kept = 0;
    for (int i = 0; i < count; i++)
        if (rbt_paint_node(paint, point[i]) < 0)
            point[kept++] = point[i];
    return kept;
}

static bool is_lumen(const Tracker *t, const RbtLimb *limb, Vec3 x)
{
    double value = tracker_is_inside(t->volume, x) ? tracker_brightness(t, x) : -HUGE_VAL;
    return value >= fmax(limb->level, t->floor) && value <= limb->ceiling;
}

bool rbt_is_sac(Tracker *t, const RbtPaint *paint, const RbtLimb *limb)
{
    enum { ROUNDS = 8 };
    double beside = radius_beside(&t->tree, limb->contact), widest = 0;
    Vec3 center = limb->place[0];
    for (int i = 0; i < limb->count; i++)
        if (limb->radius[i] > widest) {
            widest = limb->radius[i];
            center = limb->place[i];
        }
    if (t->parameters->find_aneurysms <= 0 || t->tree.node[limb->contact].kind == NODE_ANEURYSM || widest < wider * beside || widest < 2.5 * t->voxel)
        return false;
    Vec3 *ray = HEAP_ZEROED(MAX_RAYS, sizeof *ray);
    double *distance = HEAP_ZEROED(2 * MAX_RAYS, sizeof *distance), radius = 0;
    Estimate *e = &t->estimate;
    bool good = true;
    int rays = (int)t->parameters->aneurysm_rays, met = 0;
    sphere_directions(sphere_level_of(rays), ray);
    for (int round = 0; good && round <= ROUNDS; round++) {
        double reach = fmax(4 * widest, 2.5 * radius), *sorted = distance + MAX_RAYS;
        good = is_lumen(t, limb, center);
        if (!good)
            break;
        met = see_walls(t, center, ray, rays, reach, distance, sorted);
        good = met >= least_closed * rays && sorted[met / 10] > wider * beside;
        int kept = good ? near_walls(center, ray, rays, distance, sorted[met / 2], e->point) : 0;
        Vec3 middle;
        good = good && kept >= least_closed * rays && sphere_fit(e->point, kept, &middle, &radius) && radius > wider * beside;
        if (good && round < ROUNDS && vec3_distance(middle, center) > 0.05 * radius) {
            center = middle;
            continue;
        }
        if (good) {
            met = kept;
            break;
        }
    }
    double middle = 0;
    for (int i = 0; good && i < rays; i += rays / 16)
        middle += tracker_brightness(t, vec3_add_scaled(center, 0.4 * radius, ray[i])) / ((rays + rays / 16 - 1) / (rays / 16));
    good = good && rbt_paint_node(paint, center) < 0 && middle <= fmin(limb->ceiling, t->ceiling) - RBT_NOISE_SHARE * t->noise;
    if (good) {
        int kept = drop_painted(paint, e->point, met);
        const TrackNode *n = &t->tree.node[limb->contact];
        e->node = (TrackNode){.cylinder = {center, radius, vec3_unit_or(vec3_sub(center, n->cylinder.center), n->cylinder.axis), 2 * radius},
                              .inlier_rate = (double)kept / rays,
                              .contrast = n->contrast,
                              .kind = NODE_ANEURYSM,
                              .parent = -1,
                              .point_count = kept};
        good = kept >= rays / 4;
    }
    free(ray);
    free(distance);
    return good;
}

typedef struct Lobe {        // a candidate centre inside a sac
    Vec3 center;
    double inscribed;        // [mm] distance to its walls, 10th percentile
} Lobe;

bool rbt_fill_sac(Tracker *t, const RbtPaint *paint, const RbtLimb *limb, Track *sac)
{
    enum { MOST = 8, RAYS = 162, STEPS = 3 };
    int rays = (int)t->parameters->aneurysm_rays, count = 0, used = 0, parent[MOST] = {0};
    Vec3 *ray = HEAP_ZEROED(MAX_RAYS, sizeof *ray), center = sac->node[0].cylinder.center, *coarse = HEAP_ZEROED(RAYS, sizeof *coarse);
    double *distance = HEAP_ZEROED(2 * MAX_RAYS, sizeof *distance), *sorted = distance + MAX_RAYS, reach = 2.5 * sac->node[0].cylinder.radius;
    Lobe *lobe = HEAP_ZEROED(RAYS * STEPS, sizeof *lobe), chosen[MOST];
    double *far = HEAP_ZEROED(RAYS, sizeof *far);
    sphere_directions(sphere_level_of(rays), ray);
    sphere_directions(sphere_level_of(RAYS), coarse);
    int met = see_walls(t, center, coarse, RAYS, reach, far, sorted);
    double median = met > 0 ? sorted[met / 2] : 0;
    chosen[used++] = (Lobe){center, met > 0 ? sorted[met / 10] : 0};
    for (int i = 0; i < RAYS * STEPS; i++) {
        Lobe l = {.center = vec3_add_scaled(center, (0.8 - 0.2 * (i % STEPS)) * far[i / STEPS], coarse[i / STEPS])};
        if (!(far[i / STEPS] > 0 && far[i / STEPS] < 2 * median) || tracker_node_around(t, l.center, 1) >= 0 || tracker_is_forbidden(t, l.center) ||
            !is_lumen(t, limb, l.center))
            continue;
        met = see_walls(t, l.center, coarse, RAYS, reach, distance, sorted);
        if (met >= least_closed * RAYS && sorted[met / 10] >= fmax(least_lobe * chosen[0].inscribed, 2.5 * t->voxel)) {
            l.inscribed = sorted[met / 10];
            lobe[count++] = l;
        }
    }
    while (!t->out_of_memory && used < MOST) {
        int best = -1;
        double furthest = least_lobe * chosen[0].inscribed;
        for (int i = 0; i < count; i++) {
            double out = HUGE_VAL;   // how far its ball protrudes from the others
            for (int k = 0; k < used; k++)
                out = fmin(out, vec3_distance(lobe[i].center, chosen[k].center) + lobe[i].inscribed - chosen[k].inscribed);
            if (out > furthest) {
                furthest = out;
                best = i;
            }
        }
        if (best < 0)
            break;
        chosen[used] = lobe[best];
        for (int k = 1; k < used; k++)
            if (vec3_distance(chosen[k].center, chosen[used].center) < vec3_distance(chosen[parent[used]].center, chosen[used].center))
                parent[used] = k;
        Vec3 *point = t->estimate.point, middle;
        double radius;
        met = see_walls(t, chosen[used].center, ray, rays, reach, distance, sorted);
        int kept = near_walls(chosen[used].center, ray, rays, distance, met > 0 ? sorted[met / 2] : 0, point);
        bool good = kept > 3 && sphere_fit(point, kept, &middle, &radius);
        kept = drop_painted(paint, point, kept);
        lobe[best] = lobe[--count];
        if (!good || kept < rays / 4)
            continue;
        TrackNode node = sac->node[0];
        Vec3 link = vec3_sub(chosen[used].center, chosen[parent[used]].center);
        node.cylinder = (Cylinder){chosen[used].center, radius, vec3_unit_or(link, node.cylinder.axis), 2 * radius};
        node.inlier_rate = (double)kept / rays;
        node.point_count = kept;
        node.parent = parent[used++];
        t->out_of_memory = !track_append(sac, &node, point);
    }
    free(ray);
    free(coarse);
    free(distance);
    free(lobe);
    free(far);
    return !t->out_of_memory;
}

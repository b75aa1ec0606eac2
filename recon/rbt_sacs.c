// From the widest place of the limb the centre climbs to that of the sphere of least squares through the first walls. It is a sac where even the nearest
// walls (10th percentile) are further away than the vessel's radius by a good part, and rays that meet none within reach are few: bone and open background
// go on, and a tube that is merely continued is no wider than itself.
#include "recon/rbt_sacs.h"
#include "recon/bspline.h"
#include "recon/cast_rays.h"

#include <stdlib.h>

static const double wider = 1.3;          // than the vessel beside it
static const double least_closed = 0.7;   // share of the rays that meet a wall

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// What the vessel is like around its node, not what it swells to in front of the neck.
static double radius_beside(const Track *tree, int node)
{
    enum { HALF = 24 };
    double radius[2 * HALF + 1];
    int n = 0;
    for (int i = node - HALF; i <= node + HALF; i++)
        if (i >= 0 && i < tree->count && tree->node[i].branch == tree->node[node].branch)
            radius[n++] = tree->node[i].cylinder.radius;
    qsort(radius, (size_t)n, sizeof *radius, compare_doubles);
    return radius[n / 2];
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
    Vec3 *ray = malloc(MAX_RAYS * sizeof *ray);
    double *distance = malloc(2 * MAX_RAYS * sizeof *distance), radius = 0;
    Estimate *e = &t->estimate;
    bool good = ray && distance;
    int rays = (int)t->parameters->aneurysm_rays, met = 0;
    t->out_of_memory = !good;
    if (good)
        sphere_directions(sphere_level_of(rays), ray);
    for (int round = 0; good && round <= ROUNDS; round++) {
        double reach = fmax(4 * widest, 2.5 * radius), *sorted = distance + MAX_RAYS;
        int samples = (int)(reach / (0.5 * t->voxel));
        RayOptions options = {reach, samples < 32 ? 32 : samples > MAX_RAY_SAMPLES ? MAX_RAY_SAMPLES : samples, t->parameters->ray_smoothing_voxels * t->voxel, 0};
        good = tracker_is_inside(t->volume, center) && tracker_brightness(t, center) >= fmax(limb->level, t->floor) && tracker_brightness(t, center) <= limb->ceiling;
        if (!good)
            break;
        cast_rays_first_edge(t->volume, center, ray, rays, &options, distance);
        met = 0;
        for (int i = 0; i < rays; i++)
            if (distance[i] > 0)
                sorted[met++] = distance[i];
        qsort(sorted, (size_t)met, sizeof *sorted, compare_doubles);
        good = met >= least_closed * rays && sorted[met / 10] > wider * beside;
        // rays down the vessels go far: what is within one and a half of the median is the sac's
        int kept = 0;
        double far = good ? 1.5 * sorted[met / 2] : 0;
        for (int i = 0; good && i < rays; i++)
            if (distance[i] > 0 && distance[i] < far)
                e->point[kept++] = vec3_add_scaled(center, distance[i], ray[i]);
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
        // walls that the vessels see are theirs
        int kept = 0;
        for (int i = 0; i < met; i++)
            if (rbt_paint_node(paint, e->point[i]) < 0)
                e->point[kept++] = e->point[i];
        const TrackNode *n = &t->tree.node[limb->contact];
        e->node = (TrackNode){.cylinder = {center, radius, vec3_unit_or(vec3_sub(center, n->cylinder.center), n->cylinder.axis), 2 * radius}, .inlier_rate = (double)kept / rays,
                              .contrast = n->contrast, .kind = NODE_ANEURYSM, .parent = -1, .point_count = kept};
        good = kept >= rays / 4;
    }
    free(ray);
    free(distance);
    return good;
}

// The template is a cylinder of radius r and length 2 r in a ring whose inner radius is 1.4 r. Relative to the noise of single voxels its score is contrast
// r^(3/2); the best score is sought over radii, axes and positions. At the face of a bright band half of the ring is as bright as the inside; at a band as
// wide as the tube, a third of it. The search therefore takes the ring's third and fourth brightest twelfth as the brightness of the ring, so that a
// neighbour may touch the vessel and a band scores zero.
#include "recon/track/rbt_scan.h"

#include "base/base.h"
#include "recon/volume/volume_noise.h"

#include <stdlib.h>
#include <string.h>

const double rbt_level_voxels[RBT_LEVELS] = {0, 0.7, 1.4, 2, 2.8};
enum { SECTORS = 12, DROPPED = 2, STATIONS = 5, CERTAIN = 6 };
static const double least_evenness = 0.35;
static const double clear_contrast = 8;   // contrast over the noise of a level above which the steepest point of a ray is its wall

RbtLevels rbt_levels_of(const Volume *volume, int threads) { return (RbtLevels){.volume = volume, .noise = {-1, -1, -1, -1, -1}, .threads = threads}; }

const Volume *rbt_level(RbtLevels *levels, int level)
{
    if (level == 0)
        return levels->volume;
    for (int i = 1; i < RBT_LEVELS; i++)
        if (i != level) {
            volume_free(levels->smooth[i]);
            levels->smooth[i] = NULL;
        }
    if (!levels->smooth[level])
        levels->smooth[level] = volume_smoothed(levels->volume, rbt_level_voxels[level] * volume_voxel_size(levels->volume), levels->threads);
    return levels->smooth[level];
}

static void free_near(RbtLevels *levels)
{
    for (int i = 0; i < RBT_LEVELS; i++) {
        volume_free(levels->near[i]);
        levels->near[i] = NULL;
    }
}

// Copies the voxels around x to levels->near[0]. Returns false if out of memory.
static bool crop_near(RbtLevels *levels, Vec3 x)
{
    enum { REACH = 84 };     // [voxel] the widest template with its ring, plus the reach of the smoothing
    const Volume *v = levels->volume;
    if (levels->near[0] && vec3_distance(x, levels->center) == 0)
        return true;
    free_near(levels);
    Vec3 c = volume_voxel_of(v, x);
    double at[3] = {c.x, c.y, c.z};
    int low[3], size[3];
    for (int i = 0; i < 3; i++) {
        low[i] = (int)fmax(0, floor(at[i]) - REACH);
        size[i] = (int)fmin(v->size[i] - 1, floor(at[i]) + REACH) - low[i] + 1;
    }
    Volume *near = volume_create(size, volume_point_of(v, vec3(low[0], low[1], low[2])), v->axis);
    if (!near)
        return false;
    for (int k = 0; k < size[2]; k++)
        for (int j = 0; j < size[1]; j++)
            memcpy(near->value + ((size_t)k * (size_t)size[1] + (size_t)j) * (size_t)size[0],
                   v->value + ((size_t)(low[2] + k) * (size_t)v->size[1] + (size_t)(low[1] + j)) * (size_t)v->size[0] + low[0],
                   (size_t)size[0] * sizeof *near->value);
    near->minimum = v->minimum;
    near->maximum = v->maximum;
    levels->near[0] = near;
    levels->center = x;
    return true;
}

static const Volume *near_level(RbtLevels *levels, int level)
{
    if (!levels->near[level])
        levels->near[level] = volume_smoothed(levels->near[0], rbt_level_voxels[level] * volume_voxel_size(levels->volume), levels->threads);
    return levels->near[level];
}

double rbt_level_noise(RbtLevels *levels, int level)
{
    // smoothed copies of the neighbourhood, if it was copied
    const Volume *volume = level == 0 ? levels->volume : levels->near[0] ? near_level(levels, level) : rbt_level(levels, level);
    if (volume && levels->noise[level] < 0) {
        double noise = volume_noise(volume, (int)ceil(4 * rbt_level_voxels[level]) + 1);
        // a smaller value comes from rounding or from the tail of a blur
        levels->noise[level] = noise > 1e-4 * ((double)levels->volume->maximum - (double)levels->volume->minimum) ? noise : 0;
    }
    return volume ? levels->noise[level] : 0;
}

void rbt_levels_free(RbtLevels *levels)
{
    for (int i = 0; i < RBT_LEVELS; i++)
        volume_free(levels->smooth[i]);
    free_near(levels);
    *levels = (RbtLevels){0};
}

static void sort_falling(double value[SECTORS])
{
    for (int i = 1; i < SECTORS; i++)
        for (int k = i; k > 0 && value[k] > value[k - 1]; k--) {
            double swap = value[k];
            value[k] = value[k - 1];
            value[k - 1] = swap;
        }
}

static int sector_of(double u, double v) { return (int)fmin(SECTORS - 1, floor((same_atan2(v, u) + PI) * SECTORS / (2 * PI))); }

RbtSight rbt_sight_of(const Volume *volume, double noise, const Cylinder *tube)
{
    double voxel = volume_voxel_size(volume), r = tube->radius, half = fmax(r, 2 * voxel), within = 0.85 * r, from = 1.25 * r + 0.5 * voxel,
           to = 1.8 * r + voxel;
    double sum = 0, ring[SECTORS] = {0}, reach = sqrt(to * to + half * half);
    Vec3 e1 = vec3_normal_to(tube->axis), e2 = vec3_cross(tube->axis, e1), c = volume_voxel_of(volume, tube->center);
    double at[3] = {c.x, c.y, c.z};
    long inside = 0, count[SECTORS] = {0}, around = 0;
    int low[3], high[3];
    for (int i = 0; i < 3; i++) {
        double extent = reach * vec3_norm(vec3(volume->to_voxel.m[i][0], volume->to_voxel.m[i][1], volume->to_voxel.m[i][2]));
        low[i] = (int)fmax(0, ceil(at[i] - extent));
        high[i] = (int)fmin(volume->size[i] - 1, floor(at[i] + extent));
    }
    for (int k = low[2]; k <= high[2]; k++)
        for (int j = low[1]; j <= high[1]; j++)
            for (int i = low[0]; i <= high[0]; i++) {
                Vec3 q = vec3_sub(volume_point_of(volume, vec3(i, j, k)), tube->center);
                double along = vec3_dot(q, tube->axis), u = vec3_dot(q, e1), v = vec3_dot(q, e2), rho = sqrt(u * u + v * v);
                if (fabs(along) > half || rho > to || (rho > within && rho < from))
                    continue;
                double value = (double)volume->value[((size_t)k * (size_t)volume->size[1] + (size_t)j) * (size_t)volume->size[0] + (size_t)i];
                if (rho <= within) {
                    sum += value;
                    inside++;
                } else {
                    int s = sector_of(u, v);
                    ring[s] += value;
                    count[s]++;
                }
            }
    if (inside == 0)
        return (RbtSight){0, 0, 0};
    int used = 0;
    for (int s = 0; s < SECTORS; s++) {
        ring[s] = count[s] > 0 ? ring[s] / (double)count[s] : -HUGE_VAL;   // outside the volume: sorted last
        used += count[s] > 0;
        around += count[s];
    }
    sort_falling(ring);
    if (used < SECTORS / 2)
        return (RbtSight){0, 0, 0};
    double beside = 0, in = sum / (double)inside;
    for (int s = DROPPED; s < used; s++)
        beside += ring[s] / (used - DROPPED);
    double contrast = in - beside, error = noise * sqrt(1.0 / (double)inside + 1.0 / (double)around);
    return (RbtSight){contrast, contrast <= 0 ? 0 : error > 0 ? contrast / error : HUGE_VAL, contrast > 0 ? (in - 0.5 * (ring[2] + ring[3])) / contrast : 0};
}

bool rbt_is_tube(const RbtSight *sight) { return sight->evenness >= least_evenness; }

bool rbt_node_stands_out(const Tracker *t, const RbtLevels *levels, const Cylinder *tube)
{
    return rbt_sight_of(levels->volume, t->check.noise, tube).certainty >= RBT_NODE_CERTAINTY;
}

// --- the search ---

// Trilinear interpolation: on a smoothed copy it is as accurate as the spline and several times faster. Outside the grid the border voxel repeats.
static double smooth_value(const Volume *v, Vec3 x)
{
    Vec3 c = volume_voxel_of(v, x);
    double at[3] = {c.x, c.y, c.z}, share[3], value = 0;
    size_t low[3], step[3] = {1, (size_t)v->size[0], (size_t)v->size[0] * (size_t)v->size[1]}, first = 0;
    for (int i = 0; i < 3; i++) {
        at[i] = fmin(fmax(at[i], 0), v->size[i] - 1);
        low[i] = (size_t)fmax(0, fmin(floor(at[i]), v->size[i] - 2));
        share[i] = at[i] - (double)low[i];
        step[i] = v->size[i] > 1 ? step[i] : 0;
        first += low[i] * step[i];
    }
    for (int k = 0; k < 8; k++) {
        size_t place = first + (k & 1 ? step[0] : 0) + (k & 2 ? step[1] : 0) + (k & 4 ? step[2] : 0);
        value += (k & 1 ? share[0] : 1 - share[0]) * (k & 2 ? share[1] : 1 - share[1]) * (k & 4 ? share[2] : 1 - share[2]) * (double)v->value[place];
    }
    return value;
}

static double template_contrast(const Volume *volume, Vec3 center, Vec3 axis, double r, double voxel)
{
    enum { INNER = 6, OUTER = 2 * SECTORS };
    Vec3 e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
    double inside = 0, ring[SECTORS] = {0};
    for (int s = 0; s < STATIONS; s++) {
        Vec3 x = vec3_add_scaled(center, (s - STATIONS / 2) * 0.5 * r, axis);
        inside += smooth_value(volume, x);
        for (int k = 0; k < 2 * INNER; k++) {
            double a = PI * k / INNER, rho = (k % 2 ? 0.85 : 0.5) * r;
            inside += smooth_value(volume, vec3_add_scaled(vec3_add_scaled(x, rho * same_cos(a), e1), rho * same_sin(a), e2));
        }
        for (int k = 0; k < OUTER; k++) {
            double a = 2 * PI * (k + 0.5) / OUTER, rho = (k % 2 ? 1.35 : 1.7) * r + 0.5 * voxel;
            ring[k * SECTORS / OUTER] += smooth_value(volume, vec3_add_scaled(vec3_add_scaled(x, rho * same_cos(a), e1), rho * same_sin(a), e2));
        }
    }
    sort_falling(ring);
    return inside / (STATIONS * (1 + 2 * INNER)) - 0.5 * (ring[2] + ring[3]) * SECTORS / OUTER / STATIONS;
}

typedef struct Scan {
    const Tracker *t;
    RbtLevels *levels;
    Vec3 x;
    const Vec3 *axis;        // NULL: all axes are tried
    double radius[RBT_SCANS];
    Cylinder best[RBT_SCANS];    // best tube of each radius
    double score[RBT_SCANS];
} Scan;

static void scan_radius(void *context, long index)
{
    Scan *scan = context;
    const Tracker *t = scan->t;
    double r = scan->radius[index];
    int level = 0;
    while (level + 1 < RBT_LEVELS && rbt_level_voxels[level + 1] * t->voxel <= 0.4 * r)
        level++;
    const Volume *volume = scan->levels->near[level];
    for (int a = 0; a < (scan->axis ? 1 : t->axis_count); a++) {
        Vec3 axis = scan->axis ? *scan->axis : t->axis[a], e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
        for (int i = -2; i <= 2; i++)
            for (int k = -2; k <= 2; k++) {
                Vec3 x = vec3_add_scaled(vec3_add_scaled(scan->x, 0.375 * i * r, e1), 0.375 * k * r, e2);
                if (i * i + k * k > 4 || !tracker_is_inside(t->volume, x))
                    continue;
                double score = template_contrast(volume, x, axis, r, t->voxel) * r * sqrt(r);
                if (score > scan->score[index]) {
                    scan->score[index] = score;
                    scan->best[index] = (Cylinder){x, r, axis, 2 * r};
                }
            }
    }
}

int rbt_scan(Tracker *t, RbtLevels *levels, Vec3 x, double radius, const Vec3 *axis, Cylinder *out)
{
    Scan scan = {.t = t, .levels = levels, .x = x, .axis = axis};
    double widest = HUGE_VAL, merit[RBT_SCANS];
    int count = 0, found = 0;
    for (int i = 0; i < 3; i++)
        widest = fmin(widest, vec3_norm(t->volume->axis[i]) * t->volume->size[i] / 6);
    for (double r = radius > 0 ? radius : t->voxel; count == 0 || (!(radius > 0) && r < widest && count < RBT_SCANS); r *= 1.35)
        scan.radius[count++] = r;
    t->out_of_memory = !crop_near(levels, x);
    for (int level = 1; level < RBT_LEVELS && !t->out_of_memory; level++)
        t->out_of_memory = rbt_level_voxels[level] * t->voxel <= 0.4 * scan.radius[count - 1] && !near_level(levels, level);
    if (t->out_of_memory)
        return 0;
    parallel_for(levels->threads, count, scan_radius, &scan, NULL);
    double noise = fmax(rbt_level_noise(levels, 0), 1e-9);
    for (int i = 0; i < count; i++) {   // measured over all voxels, not the template's samples
        RbtSight sight = scan.score[i] > 0 ? rbt_sight_of(levels->volume, noise, &scan.best[i]) : (RbtSight){0, 0, 0};
        // a ball around many vessels is more significant than one of them, but has less contrast
        double own = rbt_is_tube(&sight) ? fmin(sight.certainty, CERTAIN) * same_square(sight.evenness * sight.contrast) * scan.radius[i] : 0;
        int k = found;
        if (!(own > 0))
            continue;
        for (found++; k > 0 && merit[k - 1] < own; k--) {
            merit[k] = merit[k - 1];
            out[k] = out[k - 1];
        }
        merit[k] = own;
        out[k] = scan.best[i];
    }
    return found;
}

int rbt_level_for(RbtLevels *levels, const Cylinder *tube)
{
    double voxel = volume_voxel_size(levels->volume), contrast = rbt_sight_of(levels->volume, 0, tube).contrast;
    int level = 0;
    while (level + 1 < RBT_LEVELS && rbt_level_voxels[level + 1] * voxel <= 0.62 * tube->radius && contrast < clear_contrast * rbt_level_noise(levels, level))
        level++;
    return level;
}

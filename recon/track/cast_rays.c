// Along a ray x(t) = C + t u the image is sampled by cubic B-spline approximation at t_i = i L / (N - 1), smoothed by a moving average if the image
// is noisy, and differentiated by central differences; a parabola through the smallest difference and its neighbours places the edge.
//
// A ray along the lumen has no edge: its result is noise, and each such point lowers the inlier rate of the true cylinder. Rays whose steepest fall
// is below `edge` times the brightness range around the centre are discarded.
#include "recon/track/cast_rays.h"
#include "base/base.h"
#include "recon/volume/bspline.h"

#include <string.h>

// --- directions ---

int sphere_direction_count(int level) { return 10 * (1 << (2 * level)) + 2; }

int sphere_level_of(int count)
{
    for (int level = 0; level <= 4; level++)
        if (sphere_direction_count(level) == count)
            return level;
    return -1;
}

enum { MAX_DIRECTIONS = 2562 };

// Each midpoint once: an edge belongs to two faces, and the other one was mostly added shortly before.
static int add_direction(Vec3 *out, int *count, Vec3 v)
{
    for (int i = *count - 1; i >= 0; i--)
        if (vec3_norm2(vec3_sub(out[i], v)) < 1e-12)
            return i;
    out[*count] = v;
    return (*count)++;
}

static void subdivide(Vec3 *out, int *count, Vec3 a, Vec3 b, Vec3 c, int level)
{
    if (level == 0) {
        add_direction(out, count, a);
        add_direction(out, count, b);
        add_direction(out, count, c);
        return;
    }
    Vec3 ab = vec3_unit(vec3_add(a, b)), bc = vec3_unit(vec3_add(b, c)), ca = vec3_unit(vec3_add(c, a));
    subdivide(out, count, a, ab, ca, level - 1);
    subdivide(out, count, ab, b, bc, level - 1);
    subdivide(out, count, ca, bc, c, level - 1);
    subdivide(out, count, ab, bc, ca, level - 1);
}

void sphere_directions(int level, Vec3 *out)
{
    static const unsigned char face[20][3] = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                              {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                              {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    double t = (1 + sqrt(5.0)) / 2;
    Vec3 corner[12] = {{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                       {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
    int count = 0;
    for (int i = 0; i < 12; i++)
        corner[i] = vec3_unit(corner[i]);
    for (int i = 0; i < 20; i++)
        subdivide(out, &count, corner[face[i][0]], corner[face[i][1]], corner[face[i][2]], level);
}

// --- rays ---

enum { RAY_LANES = 8 };      // rays in a bundle, one in each lane

typedef struct Bundle {
    float value[MAX_RAY_SAMPLES][RAY_LANES];   // lanes without a ray repeat the last one
    int samples;
    double step;             // [mm]
} Bundle;

#define KERNEL_TEXT "recon/track/cast_rays_kernel.inc"
#include "base/each_simd.inc"
static void (*const smooth_on[SIMD_COUNT])(float (*)[RAY_LANES], int, int, float (*)[RAY_LANES]) = SIMD_FORMS(smooth);
static void (*const brightness_on[SIMD_COUNT])(float (*)[RAY_LANES], int, float *, float *) = SIMD_FORMS(brightness);
static void (*const find_steepest_on[SIMD_COUNT])(float (*)[RAY_LANES], int, int *) = SIMD_FORMS(find_steepest);

static int bundle_size(int count, int first) { return count - first < RAY_LANES ? count - first : RAY_LANES; }

static void sample_bundle(const Volume *volume, Vec3 voxel, const Vec3 *direction, int count, const RayOptions *options, Bundle *rays)
{
    float line[RAY_LANES * MAX_RAY_SAMPLES];
    const int n = options->samples;
    rays->samples = n;
    rays->step = options->length / (n - 1);
    for (int r = 0; r < RAY_LANES; r++)
        if (r < count)
            bspline_sample_line(volume, voxel, vec3_scale(mat3_mul_vec(&volume->to_voxel, direction[r]), rays->step), n, line + r * n);
        else
            memcpy(line + r * n, line + (count - 1) * n, (size_t)n * sizeof *line);
    for (int k = 0; k < n; k++)
        for (int r = 0; r < RAY_LANES; r++)
            rays->value[k][r] = line[r * n + k];
}

// Moving average over an odd number of samples; the ends repeat.
static void smooth_bundle(Bundle *rays, double width)
{
    int half = (int)(width / rays->step / 2 + 0.5), n = rays->samples;
    if (half < 1)
        return;
    if (half > n / 4)
        half = n / 4;
    float raw[MAX_RAY_SAMPLES][RAY_LANES];
    memcpy(raw, rays->value, (size_t)n * sizeof *raw);
    smooth_on[simd_level()](raw, n, half, rays->value);
}

static double fall(const Bundle *rays, int r, int i) { return (double)rays->value[i + 1][r] - (double)rays->value[i - 1][r]; }

// The place of ray r's steepest fall at sample `best`, refined; *slope is its (negative) gradient per mm.
static double refine(const Bundle *rays, int r, int best, double *slope)
{
    double shift = 0, b = fall(rays, r, best);
    if (best > 1 && best < rays->samples - 2) {
        double a = fall(rays, r, best - 1), c = fall(rays, r, best + 1), bend = a - 2 * b + c;
        if (bend > 0)
            shift = 0.5 * (a - c) / bend;
        shift = fmax(-0.5, fmin(0.5, shift));
    }
    *slope = b / (2 * rays->step);
    return (best + shift) * rays->step;
}

int cast_rays(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, Vec3 *point)
{
    double distance[MAX_DIRECTIONS], slope[MAX_DIRECTIONS];
    float least = INFINITY, most = -INFINITY;
    Vec3 voxel = volume_voxel_of(volume, center);
    Bundle rays;
    const SimdLevel level = simd_level();
    for (int first = 0; first < count; first += RAY_LANES) {
        int used = bundle_size(count, first), best[RAY_LANES];
        sample_bundle(volume, voxel, direction + first, used, options, &rays);
        brightness_on[level](rays.value, rays.samples, &least, &most);
        smooth_bundle(&rays, options->smoothing);
        find_steepest_on[level](rays.value, rays.samples, best);
        for (int r = 0; r < used; r++)
            distance[first + r] = refine(&rays, r, best[r], &slope[first + r]);
    }
    double needed = options->edge * ((double)most - (double)least) / volume_voxel_size(volume);
    int found = 0;
    for (int i = 0; i < count; i++)
        if (-slope[i] >= needed && slope[i] < 0)
            point[found++] = vec3_add_scaled(center, distance[i], direction[i]);
    return found;
}

// Distance of the steepest fall within a voxel of where ray r falls below `level`; 0 if it does not.
static double edge_at_level(const Bundle *rays, int r, double level, double voxel_size)
{
    const int window = (int)(voxel_size / rays->step + 0.5);
    int crossing = 1;
    double slope;
    while (crossing < rays->samples && (double)rays->value[crossing][r] >= level)
        crossing++;
    if (crossing + 1 >= rays->samples)
        return 0;
    int best = crossing - window < 1 ? 1 : crossing - window, last = crossing + window > rays->samples - 2 ? rays->samples - 2 : crossing + window;
    for (int i = best + 1; i <= last; i++)
        best = fall(rays, r, i) < fall(rays, r, best) ? i : best;
    return refine(rays, r, best, &slope);
}

void cast_rays_level_edge(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, double level, double *distance)
{
    Vec3 voxel = volume_voxel_of(volume, center);
    Bundle rays;
    for (int first = 0; first < count; first += RAY_LANES) {
        int used = bundle_size(count, first);
        sample_bundle(volume, voxel, direction + first, used, options, &rays);
        smooth_bundle(&rays, options->smoothing);
        for (int r = 0; r < used; r++)
            distance[first + r] = edge_at_level(&rays, r, level, volume_voxel_size(volume));
    }
}

void cast_rays_first_edge(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, double *distance)
{
    double inside = (double)bspline_sample(volume, volume_voxel_of(volume, center));
    cast_rays_level_edge(volume, center, direction, count, options, 0.5 * (inside + (double)volume->minimum), distance);
}

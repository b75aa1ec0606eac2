// Along a ray x(t) = C + t u the image is sampled by cubic B-spline approximation at t_i = i L / (N - 1), smoothed by a moving average if the image
// is noisy, and differentiated by central differences; a parabola through the smallest difference and its neighbours places the edge.
//
// A ray along the lumen has no edge: its result is noise, and each such point lowers the inlier rate of the true cylinder. Rays whose steepest fall
// is below `edge` times the brightness range around the centre are discarded.
#include "recon/track/cast_rays.h"
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

// Each midpoint once: an edge belongs to two faces.
static int add_direction(Vec3 *out, int *count, Vec3 v)
{
    for (int i = 0; i < *count; i++)
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

typedef struct RayProfile {
    float value[MAX_RAY_SAMPLES];
    int samples;
    double step;             // [mm]
} RayProfile;

static void sample_ray(const Volume *volume, Vec3 voxel, Vec3 direction, const RayOptions *options, RayProfile *ray)
{
    ray->samples = options->samples;
    ray->step = options->length / (options->samples - 1);
    bspline_sample_line(volume, voxel, vec3_scale(mat3_mul_vec(&volume->to_voxel, direction), ray->step), ray->samples, ray->value);
}

// Moving average over an odd number of samples; the ends repeat.
static void smooth_ray(RayProfile *ray, double width)
{
    int half = (int)(width / ray->step / 2 + 0.5), n = ray->samples;
    if (half < 1)
        return;
    if (half > n / 4)
        half = n / 4;
    float smooth[MAX_RAY_SAMPLES];
    double sum = 0;
    for (int i = -half; i <= half; i++)
        sum += (double)ray->value[i < 0 ? 0 : i];
    for (int i = 0; i < n; i++) {
        smooth[i] = (float)(sum / (2 * half + 1));
        int in = i + half + 1, out = i - half;
        sum += (double)ray->value[in < n ? in : n - 1] - (double)ray->value[out > 0 ? out : 0];
    }
    memcpy(ray->value, smooth, (size_t)n * sizeof *smooth);
}

static double fall(const RayProfile *ray, int i) { return (double)ray->value[i + 1] - (double)ray->value[i - 1]; }

// The steepest place among samples [first, last], refined; *slope is its (negative) gradient per mm.
static double steepest(const RayProfile *ray, int first, int last, double *slope)
{
    double shift = 0, b = fall(ray, first);
    int best = first;
    for (int i = first + 1; i <= last; i++) {
        double f = fall(ray, i);
        best = f < b ? i : best;
        b = f < b ? f : b;
    }
    if (best > 1 && best < ray->samples - 2) {
        double a = fall(ray, best - 1), c = fall(ray, best + 1), bend = a - 2 * b + c;
        if (bend > 0)
            shift = 0.5 * (a - c) / bend;
        shift = fmax(-0.5, fmin(0.5, shift));
    }
    *slope = b / (2 * ray->step);
    return (best + shift) * ray->step;
}

int cast_rays(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, Vec3 *point)
{
    double distance[MAX_DIRECTIONS], slope[MAX_DIRECTIONS];
    float least = INFINITY, most = -INFINITY;
    Vec3 voxel = volume_voxel_of(volume, center);
    RayProfile ray;
    for (int i = 0; i < count; i++) {
        sample_ray(volume, voxel, direction[i], options, &ray);
        // brightness range: the lumen is bright in the first third of the rays, the background is the darkest of all
        for (int k = 0; k < ray.samples; k++)
            least = ray.value[k] < least ? ray.value[k] : least;
        for (int k = 0; k <= ray.samples / 3; k++)
            most = ray.value[k] > most ? ray.value[k] : most;
        smooth_ray(&ray, options->smoothing);
        distance[i] = steepest(&ray, 1, ray.samples - 2, &slope[i]);
    }
    double needed = options->edge * ((double)most - (double)least) / volume_voxel_size(volume);
    int found = 0;
    for (int i = 0; i < count; i++)
        if (-slope[i] >= needed && slope[i] < 0)
            point[found++] = vec3_add_scaled(center, distance[i], direction[i]);
    return found;
}

void cast_rays_level_edge(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, double level, double *distance)
{
    Vec3 voxel = volume_voxel_of(volume, center);
    double slope;
    RayProfile ray;
    for (int i = 0; i < count; i++) {
        sample_ray(volume, voxel, direction[i], options, &ray);
        smooth_ray(&ray, options->smoothing);
        int window = (int)(volume_voxel_size(volume) / ray.step + 0.5), crossing = 1;
        while (crossing < ray.samples && (double)ray.value[crossing] >= level)
            crossing++;
        int first = crossing - window, last = crossing + window;
        distance[i] = crossing + 1 >= ray.samples ? 0 : steepest(&ray, first < 1 ? 1 : first, last > ray.samples - 2 ? ray.samples - 2 : last, &slope);
    }
}

void cast_rays_first_edge(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, double *distance)
{
    double inside = (double)bspline_sample(volume, volume_voxel_of(volume, center));
    cast_rays_level_edge(volume, center, direction, count, options, 0.5 * (inside + (double)volume->minimum), distance);
}

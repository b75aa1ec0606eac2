// See lim_trial.h. The bounds: with J_ik the derivative of point i's signed distance by parameter k, least squares moves the surface at the
// points by H e, H = J (J'J)^-1 J', e the noise along the normals.
#include "bench/lim_trial.h"

#include "base/same_math.h"
#include "base/sort_doubles.h"
#include "geom/blobby.h"
#include "geom/random.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { POOL = 6000, MOST_BLOBS = 24, MOST_PARAMETERS = 4 * MOST_BLOBS, STARTS = 5, SIZES = 4 };

const char *const lim_trial_name[LIM_TRIAL_SHAPES] = {"capsule", "open-capsule", "arc", "bifurcation"};

struct LimTrialShape {
    int which, blob_count;
    Vec3 center[MOST_BLOBS];
    double width[MOST_BLOBS];
    int pool_count;
    Vec3 *pool;              // on the surface
    int start_count;
    Vec3 start[STARTS];
    double start_radius[STARTS];
    Vec3 middle, direction;
};

static const double ISO_LEVEL = 0.1;

// Skeleton at s in [0, 1]; `size`: the width of all primitives, then the dimensions of the skeleton.
static Vec3 skeleton(int which, int branch, double s, const double *size)
{
    if (which < 2)
        return vec3(size[1] * (s - 0.5), 0, 0);
    if (which == 2)
        return vec3(size[1] * same_cos(size[2] * (s - 0.5)), size[1] * same_sin(size[2] * (s - 0.5)), 0);
    double angle = 0.5 * PI * s, r = size[1 + branch];
    return vec3(r * same_sin(angle), (branch ? -1 : 1) * r * (1 - same_cos(angle)), 0);
}

// Primitives along the skeleton; returns their number.
static int build(int which, const double *size, Vec3 *center, double *width)
{
    int steps = which < 2 ? 4 : which == 2 ? 13 : 6, count = 0;
    for (int branch = 0; branch < (which == 3 ? 2 : 1); branch++)
        for (int i = branch; i <= steps; i++) {   // the bifurcation's first primitive only once
            center[count] = skeleton(which, branch, (double)i / steps, size);
            width[count++] = size[0];
        }
    return count;
}

static Blobby truth_of(const LimTrialShape *shape)
{
    return (Blobby){.count = shape->blob_count, .center = shape->center, .width = shape->width, .iso_level = ISO_LEVEL};
}

static void sizes_of(int which, double *size)
{
    size[1] = 4;
    size[2] = which == 2 ? PI : 4;
    size[3] = 0;
    double low = 0.05, high = 1;   // radius 1 mm at the midpoint (of the first branch)
    for (int i = 0; i < 60; i++) {
        Vec3 center[MOST_BLOBS];
        double width[MOST_BLOBS];
        size[0] = 0.5 * (low + high);
        Blobby model = {.count = build(which, size, center, width), .center = center, .width = width, .iso_level = ISO_LEVEL};
        Vec3 at = skeleton(which, 0, 0.5, size);
        if (blobby_field(&model, vec3(at.x, at.y, 1)) < 0)
            low = size[0];
        else
            high = size[0];
    }
}

LimTrialShape *lim_trial_create(int which)
{
    LimTrialShape *shape = calloc(1, sizeof *shape);
    if (!shape)
        return NULL;
    double size[SIZES];
    sizes_of(which, size);
    shape->which = which;
    shape->blob_count = build(which, size, shape->center, shape->width);
    shape->pool = calloc(POOL, sizeof *shape->pool);
    if (!shape->pool) {
        lim_trial_free(shape);
        return NULL;
    }
    Blobby truth = truth_of(shape);
    Random random = {77 + (uint64_t)which};
    while (shape->pool_count < POOL) {
        int j = (int)(random_open(&random) * shape->blob_count);
        double z = 2 * random_open(&random) - 1, angle = 2 * PI * random_open(&random), ring = sqrt(1 - z * z);
        Vec3 x = vec3_add(shape->center[j], vec3(ring * same_cos(angle), ring * same_sin(angle), z));
        SurfacePoint foot = blobby_project(&truth, x, x);
        if (foot.converged && (which != 1 || fabs(foot.foot.x) <= 0.5 * size[1]))
            shape->pool[shape->pool_count++] = foot.foot;
    }
    if (which < 2) {
        shape->direction = vec3(1, 0, 0);
        return shape;
    }
    shape->direction = which == 2 ? vec3(0, 1, 0) : vec3(1, 0, 0);
    shape->middle = which == 2 ? vec3(size[1], 0, 0) : vec3(0.5 * size[1], 0, 0);
    for (int k = 0; k < STARTS; k++) {
        shape->start[k] = which == 2 ? skeleton(2, 0, k / 4.0, size) : skeleton(3, k > 2, k > 2 ? 0.5 * (k - 2) : 0.5 * k, size);
        shape->start_radius[k] = 1;
    }
    shape->start_count = STARTS;
    return shape;
}

void lim_trial_free(LimTrialShape *shape)
{
    if (shape)
        free(shape->pool);
    free(shape);
}

// Farthest point sampling from a random point of the pool, in a random half of it.
static bool spread_points(const LimTrialShape *shape, Random *random, Vec3 *point)
{
    double *far = malloc(POOL * sizeof *far);
    if (!far)
        return false;
    for (int i = 0; i < POOL; i++)
        far[i] = random_open(random) < 0.5 ? 1e9 : -1;
    int next = (int)(random_open(random) * POOL);
    for (int k = 0; k < LIM_TRIAL_POINTS; k++) {
        Vec3 p = point[k] = shape->pool[next];
        int best = 0;
        for (int i = 0; i < POOL; i++) {
            double d2 = vec3_norm2(vec3_sub(shape->pool[i], p));
            far[i] = d2 < far[i] ? d2 : far[i];
            best = far[i] > far[best] ? i : best;
        }
        next = best;
    }
    free(far);
    return true;
}

static double p90(double *value, int count)
{
    sort_doubles(value, (size_t)count);
    return value[(int)(0.9 * (count - 1) + 0.5)];
}

// p90 |H e|; `column` is (parameters, LIM_TRIAL_POINTS), orthogonalised here (modified Gram-Schmidt); linearly dependent columns are left out.
static double projected_noise(double (*column)[LIM_TRIAL_POINTS], int parameters, const double *noise)
{
    double moved[LIM_TRIAL_POINTS] = {0};
    for (int k = 0; k < parameters; k++) {
        double before = 0, after = 0, along = 0;
        for (int i = 0; i < LIM_TRIAL_POINTS; i++)
            before += column[k][i] * column[k][i];
        for (int pass = 0; pass < 2; pass++)
            for (int m = 0; m < k; m++) {
                double dot = 0;
                for (int i = 0; i < LIM_TRIAL_POINTS; i++)
                    dot += column[k][i] * column[m][i];
                for (int i = 0; i < LIM_TRIAL_POINTS; i++)
                    column[k][i] -= dot * column[m][i];
            }
        for (int i = 0; i < LIM_TRIAL_POINTS; i++)
            after += column[k][i] * column[k][i];
        bool something_new = after > 1e-8 * before;
        for (int i = 0; i < LIM_TRIAL_POINTS; i++) {
            column[k][i] = something_new ? column[k][i] / sqrt(after) : 0;
            along += column[k][i] * noise[i];
        }
        for (int i = 0; i < LIM_TRIAL_POINTS; i++)
            moved[i] += along * column[k][i];
    }
    for (int i = 0; i < LIM_TRIAL_POINTS; i++)
        moved[i] = fabs(moved[i]);
    return p90(moved, LIM_TRIAL_POINTS);
}

// Signed distance (first order) of the points to a surface near the truth.
static void distances(const Blobby *model, const Vec3 *point, double *out)
{
    for (int i = 0; i < LIM_TRIAL_POINTS; i++) {
        Vec3 g;
        double f = blobby_gradient(model, point[i], &g);
        out[i] = f / vec3_norm(g);
    }
}

static bool bounds(const LimTrialShape *shape, const Vec3 *point, const double *noise, LimTrial *out)
{
    double(*column)[LIM_TRIAL_POINTS] = calloc(MOST_PARAMETERS, sizeof *column), low[LIM_TRIAL_POINTS], size[SIZES];
    if (!column)
        return false;
    const double step = 1e-5;
    Vec3 center[MOST_BLOBS];
    double width[MOST_BLOBS];
    int parameters = 0;
    sizes_of(shape->which, size);
    // size, then rotations and translations of the whole
    for (int k = 0; k < SIZES - 1 + 6; k++) {
        for (int side = 0; side < 2; side++) {
            double changed[SIZES], by = side ? step : -step;
            memcpy(changed, size, sizeof changed);
            if (k < 3)
                changed[k] += by;
            int count = build(shape->which, changed, center, width);
            for (int j = 0; j < count && k >= 3; j++) {
                Vec3 c = center[j];
                Vec3 axis = vec3(k % 3 == 0, k % 3 == 1, k % 3 == 2);
                center[j] = k < 6 ? vec3_add_scaled(c, by, vec3_cross(axis, c)) : vec3_add_scaled(c, by, axis);
            }
            Blobby model = {.count = count, .center = center, .width = width, .iso_level = ISO_LEVEL};
            distances(&model, point, side ? column[parameters] : low);
        }
        for (int i = 0; i < LIM_TRIAL_POINTS; i++)
            column[parameters][i] = (column[parameters][i] - low[i]) / (2 * step);
        parameters++;
    }
    out->d_shape = projected_noise(column, parameters, noise);
    parameters = 0;
    memcpy(center, shape->center, sizeof center);
    memcpy(width, shape->width, sizeof width);
    Blobby model = {.count = shape->blob_count, .center = center, .width = width, .iso_level = ISO_LEVEL};
    for (int j = 0; j < shape->blob_count; j++)
        for (int k = 0; k < 4; k++) {
            double *p = k == 0 ? &center[j].x : k == 1 ? &center[j].y : k == 2 ? &center[j].z : &width[j], kept = *p;
            *p = kept - step;
            distances(&model, point, low);
            *p = kept + step;
            distances(&model, point, column[parameters]);
            *p = kept;
            for (int i = 0; i < LIM_TRIAL_POINTS; i++)
                column[parameters][i] = (column[parameters][i] - low[i]) / (2 * step);
            parameters++;
        }
    out->d_blobs = projected_noise(column, parameters, noise);
    free(column);
    return true;
}

static double cpu_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool lim_trial_run(const LimTrialShape *shape, double sigma, uint64_t seed, const LimFitOptions *given, LimTrial *out)
{
    enum { N = LIM_TRIAL_POINTS };
    *out = (LimTrial){0};
    LimFitOptions options = *given;
    options.target_mm = 3 * sigma;
    Random random = {seed};
    Vec3 exact[N], noisy[N], *center = calloc((size_t)options.max_blobs + 1, sizeof *center);
    double noise[N], distance[N], approximate[N], *width = calloc((size_t)options.max_blobs + 1, sizeof *width);
    bool good = center && width && spread_points(shape, &random, exact);
    Blobby truth = truth_of(shape);
    for (int i = 0; i < N && good; i++) {
        Vec3 g;
        blobby_gradient(&truth, exact[i], &g);
        noise[i] = sigma * random_normal(&random);
        noisy[i] = vec3_add_scaled(exact[i], -noise[i], vec3_unit(g));
    }
    if (good) {
        LimFitTask task = {.point_count = N,
                           .point = noisy,
                           .center = shape->middle,
                           .direction = shape->direction,
                           .radius = 1,
                           .start_count = shape->start_count,
                           .start = shape->start,
                           .start_radius = shape->start_radius};
        double begin = cpu_s();
        out->blobs = lim_fit_model(&task, &options, center, width);
        out->cpu_s = cpu_s() - begin;
        good = out->blobs > 0 && bounds(shape, exact, noise, out);
    }
    if (good) {
        Blobby model = {.count = out->blobs, .center = center, .width = width, .iso_level = options.iso_level};
        for (int i = 0; i < N; i++) {
            double far = blobby_project(&model, exact[i], exact[i]).distance;
            Vec3 g;
            double f = blobby_gradient(&model, exact[i], &g);
            out->bias += far / N;
            distance[i] = fabs(far);
            approximate[i] = fabs(f) / fmax(vec3_norm(g), 1e-12);
            out->worst = fmax(out->worst, fabs(blobby_project(&model, noisy[i], noisy[i]).distance));
        }
        out->met = out->worst <= options.target_mm * (1 + 1e-6);
        out->d = p90(distance, N);
        out->d_approximate = p90(approximate, N);
    }
    free(center);
    free(width);
    return good;
}

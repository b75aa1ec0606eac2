// With q = x - c in units of r, (p1, p2, pa) its parts along e1, e2 and the axis v, s = p1^2 + p2^2 = (d/r)^2:
//   T = 1 / (1 + s^4),  dT/ds = -4 s^3 T^2 = -h/2,  and from ds: dT = h (s dlog r + p1 dc1 + p2 dc2 + pa p1 da1 + pa p2 da2).
// Least squares needs only the weighted moments of (1, T, h s, h p1, h p2, h pa p1, h pa p2, I). The weights w multiply the residuals, so that sums contain
// w^2. Lanes are voxels; floats are summed over 64 voxels of a lane, then in double.
//
// Friman alternates between the five parameters of the shape, with k and m fixed, and k and m. Here a step changes all seven at once, and k and m are solved
// for at every trial: the same minimum in a third of the iterations.
#include "bench/mht_template.h"

#include "base/same_math.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 4, CHUNK = 64 * LANES, MAX_VOXELS = 12000, LEAST_VOXELS = 32, BASIS = 8, MOMENTS = BASIS * (BASIS + 1) / 2, SHAPE = 7 };

static const double CUT = 0.1;   // smallest weight
static const double ALONG = 0.5; // ratio of the window's length to its width

typedef float Lanes __attribute__((vector_size(4 * LANES)));

struct MhtWindow {
    int count, capacity;     // count is padded to whole lanes with voxels of weight 0
    float *x, *y, *z, *intensity, *weight;   // positions relative to `middle` [mm]; intensities relative to `level`
    Vec3 middle;
    double level;
};

MhtWindow *mht_window_create(void) { return calloc(1, sizeof(MhtWindow)); }

void mht_window_free(MhtWindow *window)
{
    if (window)
        free(window->x);
    free(window);
}

// One block for the five arrays.
static bool reserve(MhtWindow *window, int capacity)
{
    if (capacity <= window->capacity)
        return true;
    capacity = (capacity + CHUNK - 1) / CHUNK * CHUNK;
    float *block = aligned_alloc(64, 5 * (size_t)capacity * sizeof *block);
    if (!block)
        return false;
    free(window->x);
    window->x = block;
    window->y = block + capacity;
    window->z = block + 2 * (size_t)capacity;
    window->intensity = block + 3 * (size_t)capacity;
    window->weight = block + 4 * (size_t)capacity;
    window->capacity = capacity;
    return true;
}

int mht_window_open(MhtWindow *window, const Volume *volume, const MhtTemplate *about, double size)
{
    double across = size * about->radius, along = ALONG * across, reach2 = -same_log(CUT), reach = sqrt(reach2);
    double spacing = same_cbrt(4.0 / 3 * PI * reach * reach * reach * across * across * along / MAX_VOXELS);
    Vec3 at = volume_voxel_of(volume, about->center), v = about->axis;
    double middle[3] = {at.x, at.y, at.z};
    int low[3], high[3], stride[3];
    size_t room = 1;
    window->count = 0;
    for (int i = 0; i < 3; i++) {
        Vec3 row = {volume->to_voxel.m[i][0], volume->to_voxel.m[i][1], volume->to_voxel.m[i][2]};
        double dot = vec3_dot(row, v), half = reach * sqrt(across * across * (vec3_norm2(row) - dot * dot) + along * along * dot * dot);
        if (!(middle[i] > -1e6 && middle[i] < 1e6 && half < 1e6))
            return 0;
        stride[i] = (int)fmin(1e6, fmax(1, ceil(spacing / vec3_norm(volume->axis[i]) - 1e-9)));
        // the subsampled lattice contains the voxel in the middle
        int here = (int)floor(middle[i] + 0.5), before = (int)floor(half / stride[i]) + 1, after = before;
        while (before > 0 && here - before * stride[i] < 0)
            before--;
        while (after > 0 && here + after * stride[i] > volume->size[i] - 1)
            after--;
        low[i] = here - before * stride[i];
        high[i] = here + after * stride[i];
        if (low[i] < 0 || high[i] > volume->size[i] - 1)
            return 0;
        room *= (size_t)((high[i] - low[i]) / stride[i] + 1);
    }
    if (room > 40 * (size_t)MAX_VOXELS || !reserve(window, (int)room + LANES))
        return 0;
    window->middle = about->center;
    double sum = 0, total = 0;
    int n = 0;
    for (int k = low[2]; k <= high[2]; k += stride[2])
        for (int j = low[1]; j <= high[1]; j += stride[1]) {
            Vec3 from = vec3_sub(volume_point_of(volume, vec3(0, j, k)), about->center);
            const float *row = volume->value + ((size_t)k * (size_t)volume->size[1] + (size_t)j) * (size_t)volume->size[0];
            for (int i = low[0]; i <= high[0]; i += stride[0]) {
                Vec3 q = vec3_add_scaled(from, i, volume->axis[0]);
                double a = vec3_dot(q, v) / along, d2 = (vec3_norm2(q) - vec3_dot(q, v) * vec3_dot(q, v)) / (across * across), exponent = a * a + d2;
                if (exponent > reach2)
                    continue;
                float w = (float)same_exp(-exponent);
                window->x[n] = (float)q.x;
                window->y[n] = (float)q.y;
                window->z[n] = (float)q.z;
                window->intensity[n] = row[i];
                window->weight[n++] = w;
                sum += (double)(w * row[i]);
                total += (double)w;
            }
        }
    // with a mean of zero the sums of floats lose no digits by cancellation
    window->level = total > 0 ? sum / total : 0;
    for (int i = 0; i < n; i++)
        window->intensity[i] -= (float)window->level;
    int used = n;
    for (; n % LANES; n++)
        window->x[n] = window->y[n] = window->z[n] = window->intensity[n] = window->weight[n] = 0;
    window->count = n;
    return used;
}

// --- sums over the window ---

typedef struct Frame {       // of a template, in single precision
    float e1[3], e2[3], v[3], c1, c2, cv;   // in units of the radius
} Frame;

static Frame frame_of(const MhtWindow *window, const MhtTemplate *t)
{
    Vec3 e1 = vec3_normal_to(t->axis), e2 = vec3_cross(t->axis, e1), c = vec3_scale(vec3_sub(t->center, window->middle), 1 / t->radius);
    double s = 1 / t->radius;
    return (Frame){{(float)(s * e1.x), (float)(s * e1.y), (float)(s * e1.z)},
                   {(float)(s * e2.x), (float)(s * e2.y), (float)(s * e2.z)},
                   {(float)(s * t->axis.x), (float)(s * t->axis.y), (float)(s * t->axis.z)},
                   (float)vec3_dot(c, e1),
                   (float)vec3_dot(c, e2),
                   (float)vec3_dot(c, t->axis)};
}

static inline Lanes load(const float *from)
{
    Lanes lanes;
    memcpy(&lanes, from, sizeof lanes);
    return lanes;
}

static inline double total_of(Lanes l) { return ((double)l[0] + (double)l[1]) + ((double)l[2] + (double)l[3]); }

// The upper triangle, by rows, of sum w^2 b_i b_j over the basis of the file's head.
static void moments(const MhtWindow *window, const MhtTemplate *template, double out[MOMENTS])
{
    Frame f = frame_of(window, template);
    memset(out, 0, MOMENTS * sizeof *out);
    for (int first = 0; first < window->count; first += CHUNK) {
        Lanes sum[MOMENTS] = {{0}};
        for (int n = first; n < window->count && n < first + CHUNK; n += LANES) {
            Lanes x = load(window->x + n), y = load(window->y + n), z = load(window->z + n), w = load(window->weight + n);
            Lanes p1 = x * f.e1[0] + y * f.e1[1] + z * f.e1[2] - f.c1, p2 = x * f.e2[0] + y * f.e2[1] + z * f.e2[2] - f.c2;
            Lanes pa = x * f.v[0] + y * f.v[1] + z * f.v[2] - f.cv, s = p1 * p1 + p2 * p2, s2 = s * s, t = 1 / (1 + s2 * s2), h = 8 * (s2 * t) * (s * t);
            Lanes h1 = h * p1, h2 = h * p2;
            Lanes b[BASIS] = {w, w * t, w * h * s, w * h1, w * h2, w * pa * h1, w * pa * h2, w * load(window->intensity + n)};
            int k = 0;
#pragma GCC unroll 8
            for (int i = 0; i < BASIS; i++)
#pragma GCC unroll 8
                for (int j = i; j < BASIS; j++)
                    sum[k++] += b[i] * b[j];
        }
        for (int k = 0; k < MOMENTS; k++)
            out[k] += total_of(sum[k]);
    }
}

static double moment(const double m[MOMENTS], int i, int j)
{
    int a = i < j ? i : j, b = i < j ? j : i;
    return m[a * BASIS - a * (a - 1) / 2 + b - a];
}

// Contrast and background by least squares, and the weighted sum of squared residuals. False if they are not defined.
static bool solve_linear(double ww, double wt, double wtt, double wi, double wti, double wii, double *contrast, double *background, double *cost)
{
    double det = ww * wtt - wt * wt;
    if (!(det > 1e-9 * ww * ww))
        return false;
    *contrast = (ww * wti - wt * wi) / det;
    *background = (wtt * wi - wt * wti) / det;
    *cost = fmax(0, wii - *contrast * wti - *background * wi);
    return true;
}

// The same for a trial template.
static bool linear_fit(const MhtWindow *window, MhtTemplate *template, double *cost)
{
    Frame f = frame_of(window, template);
    double total[6] = {0};
    for (int first = 0; first < window->count; first += CHUNK) {
        Lanes sum[6] = {{0}};
        for (int n = first; n < window->count && n < first + CHUNK; n += LANES) {
            Lanes x = load(window->x + n), y = load(window->y + n), z = load(window->z + n), w = load(window->weight + n), wi = w * load(window->intensity + n);
            Lanes p1 = x * f.e1[0] + y * f.e1[1] + z * f.e1[2] - f.c1, p2 = x * f.e2[0] + y * f.e2[1] + z * f.e2[2] - f.c2;
            Lanes s = p1 * p1 + p2 * p2, s2 = s * s, wt = w / (1 + s2 * s2);
            sum[0] += w * w;
            sum[1] += w * wt;
            sum[2] += wt * wt;
            sum[3] += w * wi;
            sum[4] += wt * wi;
            sum[5] += wi * wi;
        }
        for (int k = 0; k < 6; k++)
            total[k] += total_of(sum[k]);
    }
    return solve_linear(total[0], total[1], total[2], total[3], total[4], total[5], &template->contrast, &template->background, cost);
}

// With X = (1, T), the variance of k is sigma^2 a' X'W^4X a, a = (X'W^2X)^-1 (0, 1), sigma^2 = sum w e^2 / sum w.
static void finish_score(const MhtWindow *window, MhtTemplate *template)
{
    Frame f = frame_of(window, template);
    float k = (float)template->contrast, m = (float)template->background;
    double total[8] = {0};
    for (int first = 0; first < window->count; first += CHUNK) {
        Lanes sum[8] = {{0}};
        for (int n = first; n < window->count && n < first + CHUNK; n += LANES) {
            Lanes x = load(window->x + n), y = load(window->y + n), z = load(window->z + n), w = load(window->weight + n), w2 = w * w, w4 = w2 * w2;
            Lanes p1 = x * f.e1[0] + y * f.e1[1] + z * f.e1[2] - f.c1, p2 = x * f.e2[0] + y * f.e2[1] + z * f.e2[2] - f.c2;
            Lanes s = p1 * p1 + p2 * p2, s2 = s * s, t = 1 / (1 + s2 * s2), e = load(window->intensity + n) - k * t - m;
            sum[0] += w;
            sum[1] += w * e * e;
            sum[2] += w2;
            sum[3] += w2 * t;
            sum[4] += w2 * t * t;
            sum[5] += w4;
            sum[6] += w4 * t;
            sum[7] += w4 * t * t;
        }
        for (int i = 0; i < 8; i++)
            total[i] += total_of(sum[i]);
    }
    double det = total[2] * total[4] - total[3] * total[3], variance = total[1] / total[0];
    double spread = (total[3] * total[3] * total[5] - 2 * total[2] * total[3] * total[6] + total[2] * total[2] * total[7]) / (det * det);
    // without noise the score would be unbounded
    variance = fmax(variance, 1e-8 * template->contrast * template->contrast);
    double score = template->contrast / sqrt(variance * spread);
    template->score = isfinite(score) ? score : 0;
    template->background += window->level;
}

void mht_template_score(const MhtWindow *window, MhtTemplate *template)
{
    double cost;
    template->score = 0;
    if (window->count >= LEAST_VOXELS && linear_fit(window, template, &cost))
        finish_score(window, template);
}

// --- the fit ---

// Normal equations of (k, m, log r, c1, c2, a1, a2) at the template's own k and m.
static void normal_equations(const double m[MOMENTS], const MhtTemplate *t, double matrix[SHAPE][SHAPE], double right[SHAPE])
{
    static const int basis[SHAPE] = {1, 0, 2, 3, 4, 5, 6};
    for (int i = 0; i < SHAPE; i++) {
        double scale = i < 2 ? 1 : t->contrast;
        for (int j = 0; j < SHAPE; j++)
            matrix[i][j] = scale * (j < 2 ? 1 : t->contrast) * moment(m, basis[i], basis[j]);
        right[i] = scale * (moment(m, basis[i], 7) - t->contrast * moment(m, basis[i], 1) - t->background * moment(m, basis[i], 0));
    }
}

// (A + damping diag A) step = right by Cholesky; false if that is not positive.
static bool solve_damped(double a[SHAPE][SHAPE], const double right[SHAPE], double damping, double step[SHAPE])
{
    double l[SHAPE][SHAPE], y[SHAPE];
    for (int i = 0; i < SHAPE; i++)
        for (int j = 0; j <= i; j++) {
            double sum = a[i][j] * (i == j ? 1 + damping : 1);
            for (int k = 0; k < j; k++)
                sum -= l[i][k] * l[j][k];
            if (i == j && !(sum > 1e-12 * a[i][i]))
                return false;
            l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
        }
    for (int i = 0; i < SHAPE; i++) {
        y[i] = right[i];
        for (int k = 0; k < i; k++)
            y[i] -= l[i][k] * y[k];
        y[i] /= l[i][i];
    }
    for (int i = SHAPE - 1; i >= 0; i--) {
        step[i] = y[i];
        for (int k = i + 1; k < SHAPE; k++)
            step[i] -= l[k][i] * step[k];
        step[i] /= l[i][i];
    }
    return true;
}

static MhtTemplate moved(const MhtTemplate *t, const double step[SHAPE], const MhtLimits *limits)
{
    MhtTemplate out = *t;
    Vec3 e1 = vec3_normal_to(t->axis), e2 = vec3_cross(t->axis, e1);
    out.radius = fmax(limits->radius_min, fmin(limits->radius_max, t->radius * same_exp(step[2])));
    out.center = vec3_add_scaled(vec3_add_scaled(t->center, step[3] * t->radius, e1), step[4] * t->radius, e2);
    out.axis = vec3_unit(vec3_add_scaled(vec3_add_scaled(t->axis, step[5], e1), step[6], e2));
    if (limits->previous) {
        const MhtTemplate *p = limits->previous;
        double length = vec3_distance(t->center, p->center);
        out.center = vec3_add_scaled(p->center, length, vec3_unit(vec3_sub(out.center, p->center)));
        if (vec3_dot(out.axis, p->axis) < same_cos(limits->max_angle))
            out.axis = t->axis;
    }
    return out;
}

void mht_template_fit(const MhtWindow *window, MhtTemplate *template, const MhtLimits *limits)
{
    enum { MAX_STEPS = 20, MAX_TRIALS = 8 };
    double cost, m[MOMENTS], a[SHAPE][SHAPE], right[SHAPE], step[SHAPE], damping = 1e-2;
    template->radius = fmax(limits->radius_min, fmin(limits->radius_max, template->radius));
    template->score = 0;
    if (window->count < LEAST_VOXELS || !linear_fit(window, template, &cost))
        return;
    bool going = true;
    for (int i = 0; going && i < MAX_STEPS; i++) {
        moments(window, template, m);
        normal_equations(m, template, a, right);
        going = false;
        for (int trial = 0; !going && trial < MAX_TRIALS; trial++, damping *= 5) {
            double largest = 0, t_cost;
            if (!solve_damped(a, right, damping, step))
                continue;
            for (int k = 2; k < SHAPE; k++)
                largest = fmax(largest, fabs(step[k]));
            if (largest > 0.5)   // for larger steps the derivatives are not valid
                continue;
            MhtTemplate tried = moved(template, step, limits);
            if (linear_fit(window, &tried, &t_cost) && t_cost < cost) {
                going = cost - t_cost > 1e-5 * cost || largest > 1e-2;
                *template = tried;
                cost = t_cost;
                damping /= 25;
                if (!going)
                    break;
            } else if (largest < 1e-3)
                break;
        }
    }
    finish_score(window, template);
}

double mht_template_cost(const MhtWindow *window, const MhtTemplate *template, double gradient[5])
{
    double m[MOMENTS], a[SHAPE][SHAPE], right[SHAPE], k = template->contrast;
    MhtTemplate own = *template;
    own.background -= window->level;
    moments(window, &own, m);
    normal_equations(m, &own, a, right);
    for (int i = 0; i < 5; i++)
        gradient[i] = -2 * right[2 + i];
    double b = own.background;
    return moment(m, 7, 7) - 2 * k * moment(m, 1, 7) - 2 * b * moment(m, 0, 7) + k * k * moment(m, 1, 1) + 2 * k * b * moment(m, 0, 1) +
           b * b * moment(m, 0, 0);
}

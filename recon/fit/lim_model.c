// Fits one local model of LIM: select, split, optimise. Kerrien et al. 2017, 4.3 to 4.5.
//
//   worst point    i* = argmax |f(P_i)| / |grad f(P_i)|                                                           (eq. 8)
//   its blob       j* = argmin |f_j(P_i*) - T| / |grad f_j(P_i*)|, f_j = rho_j phi(|P - C_j| / rho_j)        (eq. 9, 10 corrected)
//   split          rho'^2 (sqrt(2 rho'/c) - 1) = rho^2 (sqrt(rho/c) - 1): the level set of value c = f_j(P_i*) is unchanged
// The paper matches the level T; in a model of many blobs a blob contributes less than T at the surface, and for rho <= T that equation has no
// solution. The new blob is optimised by Polak-Ribiere descent, centre before width (in the other order the new blob vanishes and never recovers).
// Then a short pass over all blobs near the split follows, which is not in the paper: descent blob by blob converges badly because neighbouring blobs are
// strongly coupled, so the pass is a damped Gauss-Newton step (Levenberg, Marquardt) in all their parameters.
#include "recon/fit/lim_model.h"

#include "base/base.h"
#include "geom/geom.h"
#include "recon/fit/lim_energy.h"

#include <stdlib.h>
#include <string.h>

enum { NOISE_PAIRS = 128, ROUNDS = 4, SWEEP_BLOBS = 16, SWEEP_SIZE = 4 * SWEEP_BLOBS, LINE_EVALUATIONS = 8 };

// Weight of E_a, in units of the variance of the noise times r^2 [mm^4]: exact points are not smoothed, noisy ones are. The noise is estimated from the
// differences between the distances of neighbouring points; the distances themselves include the misfit, which smoothing would preserve.
static const double BEND_OF_NOISE = 1;

// A model within t_g is accepted when its mean square distance exceeds that of the noise by at most the square of this fraction of t_g.
static const double MISFIT = 0.17;

// Gauss-Newton stops when an iteration reduces the energy by less than this fraction; the second value applies while the model is still far (2 t_g) from its
// data.
static const double LEAST_GAIN = 1.5e-3, ROUGH_GAIN = 1e-2;

typedef struct Model {
    LimBlob *blob;           // (capacity)
    int count;
} Model;

typedef struct Fit {
    const LimFitOptions *options;
    const LimFitTask *task;
    LimPoints points;        // data first, then guards
    Model model, best;
    int capacity;
    bool uses_feet;          // E_d and E_a are evaluated at the feet of the data on the surface, not at the data
    double beta, target;     // present weight of E_a; t_g [mm]
    int pair_count, pair[NOISE_PAIRS][2];   // pairs of neighbouring data: the difference of their distances is noise, not misfit
    double noise2;           // [mm^2] variance of the noise, from these pairs
    double alpha;            // present weight of E_c
    double reach;            // largest distance of a blob's centre from the node [mm]
    float *distance;         // (padded) distances of the data
    float *offset;           // (padded) [mm] signed distance of a point from its foot, > 0 inside
    float *column;           // (SWEEP_SIZE, 2 padded) columns of the Gauss-Newton pass
    float *residual;         // (2 padded)
    double *normal;          // (SWEEP_SIZE, SWEEP_SIZE)
    double *factor;
} Fit;

static double fit_target(const LimFitOptions *options, double radius)
{
    if (options->target_mm > 0)
        return options->target_mm;
    return fmax(0.5 * options->voxel_mm, fmin(0.2 * radius, 1.5 * options->voxel_mm));
}

static bool fit_create(Fit *fit, const LimFitTask *task, const LimFitOptions *options)
{
    *fit = (Fit){.options = options, .task = task, .target = fit_target(options, task->radius)};
    int guards = options->guard_shape ? task->guard_count : 0;
    fit->capacity = options->max_blobs + 1;
    // E_a is about 1 / (4 r^2): for radii below 1 mm its effect is kept in proportion to the vessel
    fit->beta = options->beta * (options->weigh_distance ? fmin(1, same_square(same_square(task->radius))) : 1);
    fit->uses_feet = options->weigh_distance && options->project_points;
    if (!lim_points_create(&fit->points, task->point_count + guards))
        return false;
    size_t n = (size_t)fit->points.padded, c = (size_t)fit->capacity;
    fit->model.blob = calloc(c, sizeof(LimBlob));
    fit->best.blob = calloc(c, sizeof(LimBlob));
    fit->distance = calloc(n + 1, sizeof(float));
    fit->offset = calloc(n + 1, sizeof(float));
    fit->column = aligned_alloc(64, 2 * n * SWEEP_SIZE * sizeof(float));
    fit->residual = aligned_alloc(64, 2 * n * sizeof(float));
    fit->normal = calloc(2 * (size_t)SWEEP_SIZE * SWEEP_SIZE, sizeof(double));
    fit->factor = fit->normal ? fit->normal + (size_t)SWEEP_SIZE * SWEEP_SIZE : NULL;
    return fit->model.blob && fit->best.blob && fit->distance && fit->offset && fit->column && fit->residual && fit->normal;
}

static void fit_free(Fit *fit)
{
    lim_points_free(&fit->points);
    free(fit->model.blob);
    free(fit->best.blob);
    free(fit->distance);
    free(fit->offset);
    free(fit->column);
    free(fit->residual);
    free(fit->normal);
}

// Pairs a sample of the data with their nearest neighbours.
static void find_pairs(Fit *fit)
{
    const float *restrict x = fit->points.given[0], *restrict y = fit->points.given[1], *restrict z = fit->points.given[2];
    int data = fit->task->point_count;
    for (int k = 0; k < NOISE_PAIRS && k < data; k++) {
        int i = (int)((int64_t)k * data / (data < NOISE_PAIRS ? data : NOISE_PAIRS)), nearest = -1;
        float *restrict d2 = fit->residual, least[LIM_LANES], shortest = 1e30f;
        int where[LIM_LANES];
        for (int j = 0; j < data; j++) {
            float dx = x[j] - x[i], dy = y[j] - y[i], dz = z[j] - z[i];
            d2[j] = dx * dx + dy * dy + dz * dz;
        }
        d2[i] = 1e30f;
        for (int l = 0; l < LIM_LANES; l++)
            least[l] = 1e30f, where[l] = -1;
        int whole = data / LIM_LANES * LIM_LANES;
        for (int base = 0; base < whole; base += LIM_LANES)
            for (int l = 0; l < LIM_LANES; l++) {
                bool nearer = d2[base + l] < least[l];
                least[l] = nearer ? d2[base + l] : least[l];
                where[l] = nearer ? base + l : where[l];
            }
        for (int l = 0; l < LIM_LANES; l++)
            if (least[l] < shortest)
                shortest = least[l], nearest = where[l];
        for (int j = whole; j < data; j++)
            if (d2[j] < shortest)
                shortest = d2[j], nearest = j;
        if (nearest >= 0) {
            fit->pair[fit->pair_count][0] = i;
            fit->pair[fit->pair_count++][1] = nearest;
        }
    }
}

static void fit_set_points(Fit *fit)
{
    const LimFitTask *task = fit->task;
    LimPoints *points = &fit->points;
    int data = task->point_count;
    for (int i = 0; i < points->count; i++) {
        Vec3 p = vec3_sub(i < data ? task->point[i] : task->guard[i - data], task->center);
        // further out than the points a blob only bends the field from afar (seen once: a chain of blobs up to 9 r out, without which the model was invalid)
        if (i < data)
            fit->reach = fmax(fit->reach, 1.2 * vec3_norm(p));
        points->x[i] = (float)p.x;
        points->y[i] = (float)p.y;
        points->z[i] = (float)p.z;
        points->given[0][i] = points->x[i];
        points->given[1][i] = points->y[i];
        points->given[2][i] = points->z[i];
        points->weight[i] = i < data ? 1.0f / (float)data : 0;
        points->bend[i] = points->weight[i];
    }
    if (fit->uses_feet)
        find_pairs(fit);
}

static void fit_refresh_sums(Fit *fit) { lim_points_sum(&fit->points, fit->model.blob, fit->model.count, fit->options->iso_level); }

// Mean slope between a data point and the surface, |g| - d/2 f_nn with d = f / |g|. The slope at the point itself is smaller outside, where it would weight
// noise more than inside; that made vessels 0.03 mm too wide at 0.1 mm of noise.
static double between_slope(const LimPoints *points, int i)
{
    double gx = (double)points->g[0][i], gy = (double)points->g[1][i], gz = (double)points->g[2][i], g2 = gx * gx + gy * gy + gz * gz + 1e-12;
    double bend = (double)points->h[0][i] * gx * gx + (double)points->h[3][i] * gy * gy + (double)points->h[5][i] * gz * gz +
                  2 * ((double)points->h[1][i] * gx * gy + (double)points->h[2][i] * gx * gz + (double)points->h[4][i] * gy * gz);
    double slope = sqrt(g2), between = slope - 0.5 * (double)points->f[i] / slope * bend / g2;
    return fmin(fmax(between, 0.4 * slope), 2.5 * slope);
}

// Moves the data to their feet on the present surface, and sets each bound so that its residual is its distance times the slope there: the least squares are
// then those of true distances, and noise along the normal causes no bias. A point whose foot is not found stays where it was measured. Starts from the
// previous feet and the sums there, so two steps suffice; `afresh`: starts from the measured points.
static void find_feet(Fit *fit, bool afresh)
{
    const int steps = afresh ? 3 : 2;
    LimPoints *points = &fit->points;
    int data = fit->task->point_count;
    double radius = fit->task->radius;
    bool any_lost = false;
    float *const at[3] = {points->x, points->y, points->z};
    for (int k = 0; k < 3 && afresh; k++)
        memcpy(at[k], points->given[k], (size_t)points->padded * sizeof(float));
    for (int step = 0; step < steps; step++) {
        if (afresh || step > 0)
            fit_refresh_sums(fit);
        lim_points_approach(points, 0.4 * radius, step < steps - 1 ? 0.7 : 0);
        for (int k = 0; k < 3; k++)   // guards do not move
            memcpy(at[k] + data, points->given[k] + data, (size_t)(points->padded - data) * sizeof(float));
    }
    fit_refresh_sums(fit);
    lim_points_feet(points, radius, fit->offset, fit->residual);
    for (int i = 0; i < data; i++)
        if (fit->residual[i] < 0) {
            points->x[i] = points->given[0][i];
            points->y[i] = points->given[1][i];
            points->z[i] = points->given[2][i];
            any_lost = true;
        }
    if (any_lost)
        fit_refresh_sums(fit);
}

// Distance of data point i from its foot, which lies near the surface, or Taubin's distance. Signed, > 0 inside.
static double data_distance(const Fit *fit, int i)
{
    const LimPoints *points = &fit->points;
    double gx = (double)points->g[0][i], gy = (double)points->g[1][i], gz = (double)points->g[2][i];
    return (double)fit->offset[i] + (double)points->f[i] / sqrt(gx * gx + gy * gy + gz * gz + 1e-8);
}

// Updates the feet of the data, the weights of E_d and E_a and the bounds of the guards from the present model. The sums hold all blobs, before and after.
static void fit_refresh_weights(Fit *fit, bool afresh)
{
    LimPoints *points = &fit->points;
    int data = fit->task->point_count;
    double mean2 = 0, mean = 0, square = 0;
    if (fit->uses_feet)
        find_feet(fit, afresh);
    for (int i = 0; i < data; i++) {   // `residual` holds the slopes here
        if (!fit->uses_feet || fit->residual[i] < 0)
            fit->residual[i] = (float)between_slope(points, i);
        mean2 += (double)fit->residual[i] * (double)fit->residual[i];
        mean += (double)fit->residual[i];
    }
    mean2 /= data;
    mean /= data;
    if (fit->options->weigh_distance) {
        float usual = (float)mean2, least = 1e-3f * usual + 1e-30f, share = 1 / (float)data;
        for (int i = 0; i < data; i++) {
            float slope2 = fit->residual[i] * fit->residual[i], ratio = usual / (slope2 > least ? slope2 : least);
            ratio = ratio > 0.2f ? ratio : 0.2f;
            points->weight[i] = (ratio < 5 ? ratio : 5) * share * (fit->task->weight ? fit->task->weight[i] : 1);
        }
    }
    if (fit->uses_feet) {
        for (int k = 0; k < fit->pair_count; k++) {
            double differ = data_distance(fit, fit->pair[k][0]) - data_distance(fit, fit->pair[k][1]);
            square += fmin(0.5 * differ * differ, fit->target * fit->target / 4) / fit->pair_count;
        }
        fit->noise2 = square;
        fit->beta = BEND_OF_NOISE * (fit->options->beta / 1e-4) * square * fit->task->radius * fit->task->radius * mean2;
    }
    double iso_level = fit->options->iso_level;
    for (int i = data; i < points->count; i++) {
        double clearance = fit->task->clearance[i - data];
        // inside, f grows by about the slope per mm and flattens towards the axis; outside, it cannot fall below -T
        points->weight[i] = 1.0f / (float)data;
        points->low[i] = clearance > 0 ? (float)(0.5 * clearance * mean) : -1e30f;
        points->high[i] = clearance > 0 ? 1e30f : (float)fmax(0.35 * clearance * mean, -0.6 * iso_level);
    }
}

// --- Polak-Ribiere descent of one blob ---

typedef struct Trial {
    double energy, slope[4];
} Trial;

// Energy of the model with blob j at `blob`; the sums hold all the others.
static Trial evaluate(Fit *fit, int j, LimBlob blob)
{
    LimBlob kept = fit->model.blob[j];
    LimEnergy part = lim_energy(&fit->points, &blob);
    double cohesion[4] = {0};
    fit->model.blob[j] = blob;
    Trial trial = {.energy = part.distance + fit->beta * part.bend};
    if (fit->alpha > 0)
        trial.energy += fit->alpha * lim_cohesion(fit->model.blob, fit->model.count, j, fit->options->s, cohesion);
    fit->model.blob[j] = kept;
    for (int k = 0; k < 4; k++)
        trial.slope[k] = part.distance_slope[k] + fit->beta * part.bend_slope[k] + fit->alpha * cohesion[k];
    if (!isfinite(trial.energy))
        trial.energy = HUGE_VAL;
    return trial;
}

// Moves a blob's centre that is outside all tubes back into the nearest one, because a blob is a part of the lumen. Without that, noisy points grow lobes:
// blobs outside the wall that fit one outlier each and narrow the lumen in between.
static void keep_in_tubes(const LimFitTask *task, LimBlob *blob)
{
    Vec3 x = vec3_add(task->center, vec3(blob->center[0], blob->center[1], blob->center[2])), foot = x;
    double least = HUGE_VAL, allowed = 0;
    for (int k = 0; k < task->tube_count; k++) {
        const LimTube *tube = &task->tube[k];
        Vec3 along = vec3_sub(tube->b, tube->a);
        double length2 = vec3_norm2(along), t = length2 > 0 ? vec3_dot(vec3_sub(x, tube->a), along) / length2 : 0;
        t = fmin(fmax(t, 0), 1);
        Vec3 p = vec3_mix(tube->a, tube->b, t);
        double radius = tube->radius_a + t * (tube->radius_b - tube->radius_a), excess = vec3_distance(x, p) - radius;
        if (excess < least)
            least = excess, foot = p, allowed = radius;
        if (excess <= 0)
            return;
    }
    Vec3 back = vec3_sub(vec3_add_scaled(foot, allowed / (allowed + least), vec3_sub(x, foot)), task->center);
    blob->center[0] = back.x;
    blob->center[1] = back.y;
    blob->center[2] = back.z;
}

static LimBlob moved(const Fit *fit, const LimBlob *blob, const double *direction, double step)
{
    LimBlob out = *blob;
    double far2 = 0;
    for (int k = 0; k < 3; k++) {
        out.center[k] += step * direction[k];
        far2 += out.center[k] * out.center[k];
    }
    if (far2 > fit->reach * fit->reach)
        for (int k = 0; k < 3; k++)
            out.center[k] *= fit->reach / sqrt(far2);
    if (fit->options->guard_shape && fit->task->tube_count > 0)
        keep_in_tubes(fit->task, &out);
    out.width += step * direction[3];
    return out;
}

static double slope_along(const Trial *trial, const double *direction)
{
    double sum = 0;
    for (int k = 0; k < 4; k++)
        sum += trial->slope[k] * direction[k];
    return sum;
}

// Finds the least energy along `direction` (downhill at `at`), with the first step `step` and no step longer than `longest`: the Lennard-Jones term is 1e9 at
// a tenth of the width, so an unlimited first step would throw the new blob out of the vessel. Returns the step taken.
static double line_search(Fit *fit, int j, LimBlob *blob, Trial *at, const double *direction, double step, double longest)
{
    double a = 0, ea = at->energy, sa = slope_along(at, direction), s0 = sa, b = 0, eb = 0, sb = 0, taken = 0;
    bool bracketed = false;
    LimBlob start = *blob;
    for (int i = 0; i < LINE_EVALUATIONS; i++) {
        double t = step;
        if (bracketed) {   // minimum of the cubic through both ends, kept inside the bracket
            double d1 = sa + sb - 3 * (ea - eb) / (a - b), root = d1 * d1 - sa * sb, d2 = root > 0 ? sqrt(root) : 0;
            t = b - (b - a) * (sb + d2 - d1) / (sb - sa + 2 * d2);
            if (!(t > a + 0.1 * (b - a) && t < b - 0.1 * (b - a)))
                t = 0.5 * (a + b);
        }
        LimBlob next = moved(fit, &start, direction, t);
        Trial trial = evaluate(fit, j, next);
        double s = slope_along(&trial, direction);
        bool lower = trial.energy < at->energy;
        if (lower) {
            *at = trial;
            *blob = next;
            taken = t;
        }
        if (trial.energy > ea || s >= 0 || !isfinite(s))
            b = t, eb = trial.energy, sb = s, bracketed = true;
        else
            a = t, ea = trial.energy, sa = s;
        if (lower && fabs(s) < 0.2 * fabs(s0))
            break;
        if (bracketed && (!isfinite(eb) || !isfinite(sb)))
            step = 0.5 * (a + b), bracketed = false;
        else if (!bracketed && t >= longest)
            break;
        else if (!bracketed)
            step = fmin(2.5 * t, longest);
    }
    return taken;
}

// Optimises the centre (first = 0, three variables) or width (first = 3, one variable) of blob j; the sums hold all the others.
static void descend(Fit *fit, int j, int first, int searches)
{
    LimBlob *blob = &fit->model.blob[j];
    int last = first == 3 ? 4 : 3;
    Trial at = evaluate(fit, j, *blob);
    double direction[4] = {0}, previous[4] = {0}, norm2 = 0, step = 0;
    if (!isfinite(at.energy))
        return;
    for (int i = 0; i < searches; i++) {
        double g2 = 0, mixed = 0;
        for (int k = first; k < last; k++) {
            g2 += at.slope[k] * at.slope[k];
            mixed += at.slope[k] * (at.slope[k] - previous[k]);
        }
        double turn = norm2 > 0 ? fmax(0, mixed / norm2) : 0;   // Polak-Ribiere, restarted if negative
        double length2 = 0, down = 0;
        for (int k = first; k < last; k++) {
            direction[k] = -at.slope[k] + turn * direction[k];
            previous[k] = at.slope[k];
            length2 += direction[k] * direction[k];
            down += direction[k] * at.slope[k];
        }
        if (down >= 0)
            for (int k = first; k < last; k++)
                direction[k] = -at.slope[k], length2 = g2;
        if (!(length2 > 1e-30))
            break;
        norm2 = g2;
        double length = sqrt(length2), longest = 0.3 * blob->width / length;
        step = line_search(fit, j, blob, &at, direction, step > 0 ? fmin(step, longest) : 0.3 * longest, longest);
        if (step * length < 1e-4 * blob->width)
            break;
    }
}

static void optimise_blob(Fit *fit, int j)
{
    lim_points_add(&fit->points, &fit->model.blob[j], -1);
    for (int loop = 0; loop < fit->options->max_loops; loop++) {
        fit->alpha = fit->options->alpha;
        descend(fit, j, 0, fit->options->line_searches);
        // the repulsion of the twin would shrink the width to nothing, so E_c moves centres only
        if (fit->options->sweep_all_blobs)
            fit->alpha = 0;
        descend(fit, j, 3, fit->options->line_searches);
    }
    lim_points_add(&fit->points, &fit->model.blob[j], 1);
}

// --- The pass over all blobs: damped Gauss-Newton ---

static double total_energy(Fit *fit)
{
    double distance, bend;
    lim_energy_total(&fit->points, &distance, &bend);
    double energy = distance + fit->beta * bend;
    if (fit->alpha > 0)
        energy += fit->alpha * lim_cohesion_total(fit->model.blob, fit->model.count, fit->options->s);
    return isfinite(energy) ? energy : HUGE_VAL;
}

// Builds the normal matrix (J'J + ...) and the negative gradient `side` of the blobs `which`: E_d and E_a by Gauss-Newton, E_c by its slope and a stiffness
// that limits its motion of a blob to a third of its width.
static void build_normal(Fit *fit, const int *which, int count, double *side)
{
    int length = fit->points.padded * (fit->beta > 0 ? 2 : 1), size = 4 * count;
    lim_energy_residuals(&fit->points, fit->beta, fit->residual);
    for (int m = 0; m < count; m++)
        lim_energy_columns(&fit->points, &fit->model.blob[which[m]], fit->beta, fit->column + (size_t)(4 * m) * (size_t)length);
    for (int a = 0; a < size; a += 4)
        for (int b = 0; b <= a; b += 4)
            lim_energy_gram(fit->column + (size_t)a * (size_t)length, fit->column + (size_t)b * (size_t)length, (size_t)length, length,
                            &fit->normal[a * SWEEP_SIZE + b], SWEEP_SIZE);
    for (int a = 0; a < size; a++)
        side[a] = -lim_energy_dot(fit->column + (size_t)a * (size_t)length, fit->residual, length);
    for (int m = 0; m < count && fit->alpha > 0; m++) {
        double cohesion[4];
        lim_cohesion(fit->model.blob, fit->model.count, which[m], fit->options->s, cohesion);
        for (int k = 0; k < 4; k++) {
            double slope = 0.5 * fit->alpha * cohesion[k];
            side[4 * m + k] -= slope;
            fit->normal[(4 * m + k) * SWEEP_SIZE + 4 * m + k] += fabs(slope) / (0.33 * fit->model.blob[which[m]].width);
        }
    }
}

// Solves (normal + lambda diag) by Cholesky decomposition. Returns false if the matrix is not positive definite.
static bool solve_damped(Fit *fit, int size, double lambda, const double *side, double *step)
{
    double *u = fit->factor, floor = 0;   // upper triangle, updated row by row: the innermost loop has no dependent sum
    for (int a = 0; a < size; a++)
        floor = fmax(floor, fit->normal[a * SWEEP_SIZE + a]);
    for (int a = 0; a < size; a++) {
        for (int b = a; b < size; b++)
            u[a * SWEEP_SIZE + b] = fit->normal[b * SWEEP_SIZE + a];
        u[a * SWEEP_SIZE + a] += lambda * (u[a * SWEEP_SIZE + a] + 1e-6 * floor);
        step[a] = side[a];
    }
    return lim_solve(u, size, SWEEP_SIZE, step);
}

// Improves the blobs `which` jointly; the sums hold all blobs before and after.
static void sweep(Fit *fit, const int *which, int count, int iterations, double least_gain)
{
    LimBlob kept[SWEEP_BLOBS];
    double side[SWEEP_SIZE], step[SWEEP_SIZE], lambda = 1e-3, energy = total_energy(fit);
    for (int i = 0; i < iterations; i++) {
        build_normal(fit, which, count, side);
        bool improved = false;
        double gain = 0;
        for (int attempt = 0; attempt < 5 && !improved; attempt++) {
            if (!solve_damped(fit, 4 * count, lambda, side, step)) {
                lambda *= 10;
                continue;
            }
            double shrink = 1;   // scales the step so that no centre moves further than half a width and no width changes by more than 40 %
            for (int m = 0; m < count; m++) {
                double width = fit->model.blob[which[m]].width;
                for (int k = 0; k < 4; k++)
                    shrink = fmin(shrink, (k < 3 ? 0.5 : 0.4) * width / fmax(fabs(step[4 * m + k]), 1e-300));
            }
            for (int m = 0; m < count; m++) {
                kept[m] = fit->model.blob[which[m]];
                fit->model.blob[which[m]] = moved(fit, &kept[m], &step[4 * m], shrink);
            }
            fit_refresh_sums(fit);
            double next = total_energy(fit);
            improved = next < energy;
            if (improved) {
                gain = (energy - next) / energy;
                energy = next;
                lambda = fmax(lambda / 8, 1e-9);
            } else {
                for (int m = 0; m < count; m++)
                    fit->model.blob[which[m]] = kept[m];
                lambda = fmax(lambda * 10, 1e-4);
            }
        }
        if (!improved)
            fit_refresh_sums(fit);
        if (!improved || fabs(gain) < least_gain)
            break;
    }
}

// Lists the blobs nearest to blob j (itself first), in units of their widths, at most SWEEP_BLOBS. Returns their number.
static int near_blobs(const Fit *fit, int j, int *which)
{
    double far[SWEEP_BLOBS];
    int count = 0;
    for (int k = 0; k < fit->model.count; k++) {
        double d2 = 0;
        for (int m = 0; m < 3; m++)
            d2 += same_square(fit->model.blob[k].center[m] - fit->model.blob[j].center[m]);
        double key = k == j ? -1 : d2 / (fit->model.blob[k].width * fit->model.blob[k].width);
        int place = count;
        while (place > 0 && far[place - 1] > key)
            place--;
        if (place >= SWEEP_BLOBS)
            continue;
        count = count < SWEEP_BLOBS ? count + 1 : count;
        for (int m = count - 1; m > place; m--)
            far[m] = far[m - 1], which[m] = which[m - 1];
        far[place] = key;
        which[place] = k;
    }
    return count;
}

// --- Selection and subdivision ---

// Returns the worst point (eq. 8) and its distance. One Taubin step overestimates by up to 2.3 times outside; the distance from the foot is exact.
static int worst_point(Fit *fit, double *worst_distance, double *mean_square)
{
    int data = fit->task->point_count, worst = 0;
    double sum = 0;
    if (!fit->uses_feet)
        lim_points_taubin(&fit->points, fit->distance);
    for (int i = 0; i < data; i++) {
        double d = fabs(fit->uses_feet ? data_distance(fit, i) : (double)fit->distance[i]);
        d = isfinite(d) ? d : 1e30;
        fit->distance[i] = (float)d;
        sum += fmin(d, fit->task->radius) * fmin(d, fit->task->radius);
        if (d > (double)fit->distance[worst])
            worst = i;
    }
    *mean_square = sum / data;
    *worst_distance = (double)fit->distance[worst];
    return worst;
}

static Vec3 point_of(const Fit *fit, int i) { return vec3((double)fit->points.given[0][i], (double)fit->points.given[1][i], (double)fit->points.given[2][i]); }

// Eq. (9): the blob whose own surface is nearest to the point by Taubin's distance.
static int select_blob(const Fit *fit, Vec3 p)
{
    double least = HUGE_VAL;
    int selected = 0;
    for (int j = 0; j < fit->model.count; j++) {
        const LimBlob *blob = &fit->model.blob[j];
        double d2 = 0;
        d2 += same_square(p.x - blob->center[0]) + same_square(p.y - blob->center[1]) + same_square(p.z - blob->center[2]);
        double rho = blob->width, u = 1 / (1 + d2 / (5 * rho * rho)), slope = 0.8 / rho * u * u * u * sqrt(d2);
        double far = fabs(rho * u * u - fit->options->iso_level) / fmax(slope, 1e-12);
        if (far < least)
            least = far, selected = j;
    }
    return selected;
}

// rho' of two concentric blobs that together keep the level set of value c of one blob of width rho >= c.
static double split_width(double rho, double c)
{
    double right = rho * rho * (sqrt(rho / c) - 1), low = 0.5 * c, high = rho;
    low = fmax(low, 0.25 * rho);
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        if (middle * middle * (sqrt(2 * middle / c) - 1) < right)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

double lim_split_width(double width, double level) { return level < width ? split_width(width, level) : 0.5 * width; }

// Replaces blob j by two. The new one is appended, shifted by a tenth of the width towards p.
static void split_blob(Fit *fit, int j, Vec3 p)
{
    LimBlob *old = &fit->model.blob[j], *new = &fit->model.blob[fit->model.count++];
    Vec3 away = vec3_sub(p, vec3(old->center[0], old->center[1], old->center[2]));
    double rho = old->width, u = 1 / (1 + vec3_norm2(away) / (5 * rho * rho));
    Vec3 shift = vec3_scale(vec3_unit_or(away, fit->task->direction), 0.1 * rho);
    // the paper preserves the level T if possible
    double level = !fit->options->weigh_distance && rho > fit->options->iso_level ? fit->options->iso_level : rho * u * u;
    old->width = lim_split_width(rho, level);
    *new = *old;
    new->center[0] += shift.x;
    new->center[1] += shift.y;
    new->center[2] += shift.z;
}

// Keeps blob j and adds a new one at three quarters of the distance to p, just wide enough to bring the surface there. For points far outside (a branch not
// modelled yet) a split alone does not help: the field is flat there and does not attract blobs.
static void reach_out(Fit *fit, int j, Vec3 p, double deficit)
{
    const LimBlob *old = &fit->model.blob[j];
    LimBlob *new = &fit->model.blob[fit->model.count++];
    Vec3 from = vec3(old->center[0], old->center[1], old->center[2]), c = vec3_mix(from, p, 0.75);
    double d2 = vec3_norm2(vec3_sub(p, c)), low = deficit, high = fmax(old->width, 2 * deficit);
    for (int i = 0; i < 40; i++) {   // solve rho phi(d / rho) = deficit
        double rho = 0.5 * (low + high), u = 1 / (1 + d2 / (5 * rho * rho));
        if (rho * u * u < deficit)
            low = rho;
        else
            high = rho;
    }
    *new = (LimBlob){{c.x, c.y, c.z}, 0.5 * (low + high)};
    if (fit->options->guard_shape && fit->task->tube_count > 0)
        keep_in_tubes(fit->task, new);
}

// Adds one blob for the worst point: tries the paper's split and, if the point is far outside, also a blob of its own; keeps the better one.
static void add_blob(Fit *fit, int worst, double worst_distance)
{
    Vec3 p = point_of(fit, worst);
    double deficit = (double)(fit->points.low[worst] - fit->points.f[worst]);
    int j = select_blob(fit, p), count = fit->model.count;
    LimBlob before = fit->model.blob[j], split_old, split_new;
    split_blob(fit, j, p);
    fit_refresh_sums(fit);
    optimise_blob(fit, count);
    if (!fit->options->sweep_all_blobs || deficit <= 0 || worst_distance < 3 * fit->target)
        return;
    double energy = total_energy(fit);
    split_old = fit->model.blob[j];
    split_new = fit->model.blob[count];
    fit->model.blob[j] = before;
    fit->model.count = count;
    reach_out(fit, j, p, deficit);
    fit_refresh_sums(fit);
    optimise_blob(fit, count);
    if (total_energy(fit) > energy) {
        fit->model.blob[j] = split_old;
        fit->model.blob[count] = split_new;
    }
}

// --- The fit ---

static void start_model(Fit *fit, bool retry)
{
    const LimFitTask *task = fit->task;
    double iso_level = fit->options->iso_level;
    int given = retry ? task->retry_count : task->start_count;
    const Vec3 *start = retry ? task->retry : task->start;
    const double *start_radius = retry ? task->retry_radius : task->start_radius;
    fit->model.count = 0;
    if (given > 0) {
        for (int k = 0; k < given && k < fit->options->max_blobs; k++) {
            Vec3 c = vec3_sub(start[k], task->center);
            fit->model.blob[fit->model.count++] = (LimBlob){{c.x, c.y, c.z}, blob_width_for_radius(start_radius[k], iso_level)};
        }
        return;
    }
    double width = blob_width_for_radius(task->radius, iso_level);
    for (int side = -1; side <= 1 && fit->model.count < fit->options->max_blobs; side += 2) {
        Vec3 c = vec3_scale(task->direction, 0.5 * side * task->radius);
        fit->model.blob[fit->model.count++] = (LimBlob){{c.x, c.y, c.z}, width};
    }
}

static void copy_model(Model *to, const Model *from)
{
    memcpy(to->blob, from->blob, (size_t)from->count * sizeof(LimBlob));
    to->count = from->count;
}

static void optimise_all(Fit *fit, int newest, int iterations, double least_gain)
{
    int which[SWEEP_BLOBS];
    if (!fit->options->sweep_all_blobs)
        return;
    fit_refresh_sums(fit);
    double before = HUGE_VAL;
    for (int round = 0; round < ROUNDS; round++) {   // repeated, because the feet move with the surface
        sweep(fit, which, near_blobs(fit, newest, which), iterations, least_gain);
        if (!fit->uses_feet)
            break;
        fit_refresh_weights(fit, false);
        double worst, square;
        worst_point(fit, &worst, &square);
        if (square > 0.99 * before)
            break;
        before = square;
    }
}

// Removes vanished blobs: those that contribute less than a thousandth of T at every point. (No blob can drift away: see `reach`.)
static void clean_up(Fit *fit)
{
    Model *model = &fit->model;
    int kept = 0;
    for (int j = 0; j < model->count; j++) {
        const LimBlob *blob = &model->blob[j];
        double most = 0;
        for (int i = 0; i < fit->task->point_count; i++) {
            Vec3 d = vec3_sub(point_of(fit, i), vec3(blob->center[0], blob->center[1], blob->center[2]));
            double u = 1 / (1 + vec3_norm2(d) / (5 * blob->width * blob->width));
            most = fmax(most, blob->width * u * u);
        }
        if (most > 1e-3 * fit->options->iso_level || model->count == 1)
            model->blob[kept++] = *blob;
    }
    if (kept > 0 && kept < model->count) {
        model->count = kept;
        fit_refresh_sums(fit);
        fit_refresh_weights(fit, true);
        optimise_all(fit, 0, 4, LEAST_GAIN);
    }
}

// Makes one attempt; the model found is in fit->best. Returns its mean square distance, where no point counts for more than one radius.
static double attempt_fit(Fit *fit, bool retry, double *worst_of_best)
{
    const LimFitOptions *options = fit->options;
    start_model(fit, retry);
    fit_refresh_sums(fit);
    fit_refresh_weights(fit, true);
    for (int j = 0; j < fit->model.count; j++)
        optimise_blob(fit, j);
    optimise_all(fit, 0, 8, LEAST_GAIN);
    double best_square = HUGE_VAL, best_worst = HUGE_VAL, square_of_best = HUGE_VAL;
    for (int idle = 0;;) {
        double worst_distance, mean_square;
        fit_refresh_sums(fit);
        fit_refresh_weights(fit, true);
        int worst = worst_point(fit, &worst_distance, &mean_square);
        // models can be within a loose target although their error exceeds the noise
        bool within = worst_distance <= fit->target, reached = within;
        if (fit->uses_feet && options->give_up_splits > 0)
            reached = within && mean_square <= fit->noise2 + same_square(MISFIT * fit->target);
        bool better = mean_square < 0.96 * best_square || (worst_distance < 0.93 * best_worst && worst_distance > 4.5 * sqrt(mean_square));
        if ((within && (better || best_worst > fit->target)) || (better && best_worst > fit->target) || options->give_up_splits == 0) {
            best_square = fmin(best_square, mean_square);
            best_worst = fmin(best_worst, worst_distance);
            *worst_of_best = worst_distance;
            square_of_best = mean_square;
            copy_model(&fit->best, &fit->model);
            idle = 0;
        } else {
            idle++;
        }
        // the worst of some hundred noisy points may need blobs of its own, which hardly change the mean
        int patience = options->give_up_splits * (best_worst > fit->target ? 2 : 1);
        if (reached || fit->model.count >= options->max_blobs || (options->give_up_splits > 0 && idle >= patience))
            break;
        add_blob(fit, worst, worst_distance);
        optimise_all(fit, fit->model.count - 1, 4, worst_distance > 2 * fit->target ? ROUGH_GAIN : LEAST_GAIN);
    }
    return square_of_best;
}

static void fit_run(Fit *fit)
{
    double worst, square = attempt_fit(fit, false, &worst);
    // try again if it is far from the target and not because of noise, whose maximum over some hundred points is 3 to 4 times its standard deviation
    if (fit->task->retry_count > 0 && worst > 1.4 * fit->target && (worst > 4.5 * sqrt(square) || sqrt(square) > fit->target)) {
        Model kept = {malloc((size_t)fit->capacity * sizeof(LimBlob)), 0};
        if (kept.blob) {
            copy_model(&kept, &fit->best);
            if (attempt_fit(fit, true, &worst) > square)
                copy_model(&fit->best, &kept);
        }
        free(kept.blob);
    }
    copy_model(&fit->model, &fit->best);
    fit_refresh_sums(fit);
    clean_up(fit);
}

int lim_fit_model(const LimFitTask *task, const LimFitOptions *options, Vec3 *center, double *width)
{
    Fit fit;
    int count = 0;
    if (fit_create(&fit, task, options)) {
        fit_set_points(&fit);
        fit_run(&fit);
        count = fit.model.count;
        for (int j = 0; j < count; j++) {
            const LimBlob *blob = &fit.model.blob[j];
            center[j] = vec3_add(task->center, vec3(blob->center[0], blob->center[1], blob->center[2]));
            width[j] = blob->width;
        }
    }
    fit_free(&fit);
    return count;
}

// Systems of the swept model's fit. See sweep_rows.h.
//
// A branch's unknowns are ordered row by row; a point touches four rows, so a branch's matrix is a band of width 4 SWEEP_TERMS - 1. Points at forks couple
// branches: that part is applied point by point, in conjugate gradients with the branches' factors as preconditioner.
#include "recon/fit/sweep_rows.h"

#include "recon/fit/band_matrix.h"
#include "recon/fit/sweep_spline.h"

#include <stdlib.h>
#include <string.h>

enum { T = SWEEP_TERMS, WIDTH = 4 * SWEEP_TERMS - 1, GRADIENTS = 60 };
static const double HELD = 1e30;             // stiffness of coefficients that are held at 0
// [1/r^2] of the mean radius, towards the tree's: decides only where there are no points; of all terms of rows in the parent's lumen
static const double PRIOR = 4, PRIOR_HIDDEN = 100;
// [points] of the joint steps: what hardly any point sees must not go far in one step, because there the linear form holds least
static const double DAMPING = 0.06;
static const double LONGEST = 0.25;          // [radii] step of a harmonic
static const double LEAST_STRENGTH[PENALTIES] = {1e-2, 1e-2, 1}, MOST_STRENGTH = 1e10;
static const double CLOSE = 1e-4;            // of the gradients' residual

static int harmonic_of(int term) { return (term + 1) / 2; }
static const SweepBranch *branch_of(const SweepSystem *s, int branch) { return &s->draft->model->branch[branch]; }
static int rows_of(const SweepSystem *s, int branch) { return branch_of(s, branch)->break_count + 2; }
static double *row_of(const SweepSystem *s, int branch) { return s->draft->model->row + (size_t)branch_of(s, branch)->first_row * T; }

bool sweep_system_create(SweepSystem *s, const SweepDraft *draft)
{
    size_t points = (size_t)(draft->point_count + draft->guard_count) + 1, branches = (size_t)draft->count + 1;
    *s = (SweepSystem){.draft = draft,
                       .count = draft->point_count + draft->guard_count,
                       .distance = calloc(points, sizeof *s->distance),
                       .trust = calloc(points, sizeof *s->trust),
                       .first = calloc(points, sizeof *s->first),
                       .order_first = calloc(branches, sizeof *s->order_first),
                       .matrix = calloc(branches, sizeof *s->matrix),
                       .slope = calloc(branches, sizeof *s->slope)};
    for (int k = 0; k <= SWEEP_HARMONICS; k++)
        s->strength[ROUGH_TUBE][k] = 100, s->strength[SIZE][k] = 100;
    sweep_system_soften_forks(s);
    bool good = s->distance && s->trust && s->first && s->order_first && s->matrix && s->slope;
    for (int i = 0; good && i < draft->count; i++) {
        size_t n = (size_t)rows_of(s, i) * T;
        s->matrix[i] = malloc(n * (WIDTH + 1) * sizeof *s->matrix[i]);
        s->slope[i] = malloc(n * sizeof *s->slope[i]);
        good = s->matrix[i] && s->slope[i];
    }
    return good && sweep_system_reserve(s, s->count);
}

void sweep_system_soften_forks(SweepSystem *s)
{
    for (int k = 0; k <= SWEEP_HARMONICS; k++)
        s->strength[ROUGH_FORK][k] = 10;
}

void sweep_system_free(SweepSystem *s)
{
    for (int i = 0; s->draft && i < s->draft->count; i++) {
        if (s->matrix)
            free(s->matrix[i]);
        if (s->slope)
            free(s->slope[i]);
    }
    free(s->matrix);
    free(s->slope);
    free(s->distance);
    free(s->trust);
    free(s->first);
    free(s->sight);
    free(s->order);
    free(s->order_point);
    free(s->order_first);
    *s = (SweepSystem){0};
}

bool sweep_system_reserve(SweepSystem *s, int64_t sights)
{
    size_t room = (size_t)sights + 1;
    free(s->sight);
    free(s->order);
    free(s->order_point);
    s->sight = malloc(room * sizeof *s->sight);
    s->order = malloc(room * sizeof *s->order);
    s->order_point = malloc(room * sizeof *s->order_point);
    return s->sight && s->order && s->order_point;
}

static void expand_terms(const SweepSight *sight, double term[T])
{
    double re = 1, im = 0;
    term[0] = 1;
    for (int k = 1; k <= SWEEP_HARMONICS; k++) {
        double next = re * sight->zeta[0] - im * sight->zeta[1];
        im = re * sight->zeta[1] + im * sight->zeta[0];
        re = next;
        term[2 * k - 1] = re, term[2 * k] = im;
    }
}

// --- Sums ---

// Sorts sights by their first row.
static bool order_sights(SweepSystem *s)
{
    int rows = s->draft->model->row_count;
    int64_t *start = calloc((size_t)rows + 1, sizeof *start);
    if (!start)
        return false;
    for (int64_t i = 0; i < s->first[s->count]; i++)
        start[branch_of(s, s->sight[i].branch)->first_row + s->sight[i].first + 1]++;
    for (int i = 0; i < rows; i++)
        start[i + 1] += start[i];
    for (int i = 0; i < s->draft->count; i++)
        s->order_first[i] = start[branch_of(s, i)->first_row];
    s->order_first[s->draft->count] = start[rows];
    for (int64_t p = 0; p < s->count; p++)
        for (int64_t i = s->first[p]; i < s->first[p + 1]; i++) {
            int64_t at = start[branch_of(s, s->sight[i].branch)->first_row + s->sight[i].first]++;
            s->order[at] = i;
            s->order_point[at] = p;
        }
    free(start);
    return true;
}

enum { PAIRS = 10, PACKED = SWEEP_TERMS * (SWEEP_TERMS + 1) / 2 };

typedef struct Sums {        // of the points whose first row is the same
    double product[PAIRS][PACKED];   // pairs of rows, and of terms: both upper triangles
    double slope[4][T];
} Sums;

// Adds the sums to the band and clears them.
static void flush_sums(Sums *sums, int first, double *matrix, double *slope)
{
    for (int j = 0, pair = 0; j < 4; j++)
        for (int k = j; k < 4; k++, pair++) {
            const double *product = sums->product[pair];
            for (int a = 0; a < T; a++)
                for (int b = a; b < T; b++, product++) {
                    matrix[(size_t)((first + j) * T + a) * (WIDTH + 1) + (size_t)((k - j) * T + b - a)] += *product;
                    if (k > j && b > a)
                        matrix[(size_t)((first + j) * T + b) * (WIDTH + 1) + (size_t)((k - j) * T + a - b)] += *product;
                }
        }
    for (int j = 0; j < 4; j++)
        for (int a = 0; a < T; a++)
            slope[(first + j) * T + a] += sums->slope[j][a];
    memset(sums, 0, sizeof *sums);
}

static void add_sight(Sums *sums, const SweepSight *sight, double trust, double e)
{
    double term[T], product[PACKED];
    expand_terms(sight, term);
    for (int a = 0, at = 0; a < T; at += T - a, a++)
        for (int b = a; b < T; b++)
            product[at + b - a] = term[a] * term[b];
    for (int j = 0, pair = 0; j < 4; j++) {
        double wj = trust * sight->share * sight->weight[j];
        for (int k = j; k < 4; k++, pair++) {
            double factor = wj * sight->share * sight->weight[k], *to = sums->product[pair];
            for (int i = 0; i < PACKED; i++)
                to[i] += factor * product[i];
        }
        for (int a = 0; a < T; a++)
            sums->slope[j][a] += wj * e * term[a];
    }
}

static void sum_branch(void *context, long index)
{
    SweepSystem *s = context;
    int branch = (int)index, first = 0;
    size_t n = (size_t)rows_of(s, branch) * T;
    double *matrix = s->matrix[branch], *slope = s->slope[branch];
    Sums sums = {0};
    memset(matrix, 0, n * (WIDTH + 1) * sizeof *matrix);
    memset(slope, 0, n * sizeof *slope);
    for (int64_t i = s->order_first[branch]; i < s->order_first[branch + 1]; i++) {
        const SweepSight *sight = &s->sight[s->order[i]];
        double trust = s->trust[s->order_point[i]];
        SEL_ASSERT(sight->first >= 0 && sight->first + 4 <= rows_of(s, branch), "a sight sees four rows of its branch");
        SEL_ASSERT(trust >= 0 && trust <= 1, "a trust is a share");
        if (sight->first != first)
            flush_sums(&sums, first, matrix, slope);
        first = sight->first;
        if (trust * sight->share * sight->share > 1e-9)
            add_sight(&sums, sight, trust, s->distance[s->order_point[i]]);
    }
    flush_sums(&sums, first, matrix, slope);
}

bool sweep_system_sum(SweepSystem *s)
{
    SEL_ASSERT(s->first[0] == 0 && s->first[s->count] >= 0, "points have ranges of sights");
    if (!order_sights(s))
        return false;
    parallel_for(s->draft->options->threads, s->draft->count, sum_branch, s, NULL);
    return true;
}

// --- Penalties ---

enum { NARROW = 3 };         // width of the penalties' bands, in rows

// Adds the penalty's matrix of one harmonic, over the rows of a branch: a band of width NARROW.
static void add_penalty(const SweepSystem *s, int branch, int penalty, double factor, double *band)
{
    const SweepBranch *b = branch_of(s, branch);
    const double *at = s->draft->model->break_t + b->first_break;
    for (int q = 0; q < b->break_count - 1; q++) {
        double rough[4][4], size[4][4], r = s->draft->scale[b->first_break + q];
        bool fork = s->draft->is_fork[b->first_break + q];
        if (penalty != SIZE && fork != (penalty == ROUGH_FORK))
            continue;
        sweep_spline_integrals(at, b->break_count, q, rough, size);
        for (int j = 0; j < 4; j++)
            for (int k = j; k < 4; k++)
                band[(q + j) * (NARROW + 1) + k - j] += factor * (penalty == SIZE ? size[j][k] / (r * r * r) : rough[j][k] * r);
    }
}

typedef struct BranchPenalties {     // bands of a branch: one penalty each, without strengths
    double *band[PENALTIES];
    double *all;             // their sum for one harmonic
} BranchPenalties;

static bool make_penalties(const SweepSystem *s, int branch, BranchPenalties *p)
{
    size_t size = (size_t)rows_of(s, branch) * (NARROW + 1);
    double *memory = calloc((PENALTIES + 1) * size, sizeof *memory);
    for (int g = 0; g < PENALTIES && memory; g++) {
        p->band[g] = memory + (size_t)g * size;
        add_penalty(s, branch, g, 1, p->band[g]);
    }
    p->all = memory ? memory + PENALTIES * size : NULL;
    return memory != NULL;
}

static bool is_held(const SweepSystem *s, int branch, int row, int harmonic) { return harmonic > s->draft->harmonics[branch_of(s, branch)->first_row + row]; }

static double prior_of(const SweepSystem *s, int branch, int row, int term)
{
    const SweepBranch *b = branch_of(s, branch);
    int q = row - 1 < 0 ? 0 : row - 1 > b->break_count - 2 ? b->break_count - 2 : row - 1;
    double prior = s->draft->is_hidden[b->first_row + row] ? PRIOR_HIDDEN : term == 0 ? PRIOR : 0;
    return prior / same_square(s->draft->scale[b->first_break + q]);
}

// All penalties of a harmonic, with their strengths.
static void sum_penalties(const SweepSystem *s, int branch, const BranchPenalties *p, int harmonic)
{
    int rows = rows_of(s, branch);
    for (int i = 0; i < rows * (NARROW + 1); i++) {
        p->all[i] = 0;
        for (int g = 0; g < PENALTIES; g++)
            p->all[i] += g == SIZE && harmonic == 0 ? 0 : s->strength[g][harmonic] * p->band[g][i];
    }
    for (int row = 0; row < rows; row++)
        if (is_held(s, branch, row, harmonic))
            p->all[row * (NARROW + 1)] += HELD;
}

// V of a branch, into `v`.
static void fill_stiffness(const SweepSystem *s, int branch, const BranchPenalties *p, double *v)
{
    int rows = rows_of(s, branch);
    size_t n = (size_t)rows * T * (WIDTH + 1);
    double precision = 1 / (s->noise * s->noise);
    for (size_t i = 0; i < n; i++)
        v[i] = precision * s->matrix[branch][i];
    for (int term = 0; term < T; term++) {
        sum_penalties(s, branch, p, harmonic_of(term));
        for (int row = 0; row < rows; row++)
            for (int d = 0; d <= NARROW && row + d < rows; d++)
                v[(size_t)(row * T + term) * (WIDTH + 1) + (size_t)(d * T)] += p->all[row * (NARROW + 1) + d];
    }
    for (int i = 0; i < rows * T; i++)
        v[(size_t)i * (WIDTH + 1)] += prior_of(s, branch, i / T, i % T);
}

// --- Noise and strengths ---

typedef struct Tuning {
    SweepSystem *system;
    double (*kept)[PENALTIES][SWEEP_HARMONICS + 1];      // (branches) l tr(S^- S_g) - l tr(V^-1 S_g)
    double (*size)[PENALTIES][SWEEP_HARMONICS + 1];      // (branches) c' S_g c
    double *freedom;         // (branches)
    bool *failed;            // (branches)
} Tuning;

static double band_product(const double *a, const double *b, int rows, int stride_b, int step_b)
{
    double sum = 0;
    for (int row = 0; row < rows; row++)
        for (int d = 0; d <= NARROW && row + d < rows; d++)
            sum += (d > 0 ? 2 : 1) * a[row * (NARROW + 1) + d] * b[(size_t)row * (size_t)stride_b + (size_t)(d * step_b)];
    return sum;
}

static double penalty_of(const double *band, const double *row, int rows, int term)
{
    double sum = 0;
    for (int j = 0; j < rows; j++)
        for (int d = 0; d <= NARROW && j + d < rows; d++)
            sum += (d > 0 ? 2 : 1) * band[j * (NARROW + 1) + d] * row[j * T + term] * row[(j + d) * T + term];
    return sum;
}

// tr(S^- S_g) of one harmonic: of the penalties alone. What no penalty sees is a null space of all of them; a little stiffness makes S regular.
static bool trace_penalties(const SweepSystem *s, int branch, const BranchPenalties *p, int harmonic, double *scratch, double trace[PENALTIES])
{
    int rows = rows_of(s, branch);
    sum_penalties(s, branch, p, harmonic);
    double most = 0;
    for (int row = 0; row < rows; row++)
        if (!is_held(s, branch, row, harmonic))
            most = fmax(most, p->all[row * (NARROW + 1)]);
    for (int row = 0; row < rows; row++)
        p->all[row * (NARROW + 1)] += 1e-10 * most + 1e-30;
    if (!band_factor(p->all, rows, NARROW))
        return false;
    band_inverse(p->all, rows, NARROW, scratch);
    for (int g = 0; g < PENALTIES; g++)
        trace[g] = band_product(p->band[g], scratch, rows, NARROW + 1, 1);
    return true;
}

static void tune_branch(void *context, long index)
{
    Tuning *tuning = context;
    const SweepSystem *s = tuning->system;
    int branch = (int)index, rows = rows_of(s, branch);
    size_t n = (size_t)rows * T * (WIDTH + 1);
    double *v = malloc(2 * n * sizeof *v), trace[PENALTIES];
    BranchPenalties p = {0};
    bool good = v && make_penalties(s, branch, &p);
    if (good)
        fill_stiffness(s, branch, &p, v);
    good = good && band_factor(v, rows * T, WIDTH);
    if (good) {
        double *inverse = v + n, free_terms = 0;
        band_inverse(v, rows * T, WIDTH, inverse);
        for (int term = 0; term < T && good; term++) {
            int k = harmonic_of(term);
            good = trace_penalties(s, branch, &p, k, v, trace);
            for (int row = 0; row < rows; row++)
                free_terms += !is_held(s, branch, row, k);
            for (int g = 0; g < PENALTIES && good; g++) {
                if (g == SIZE && k == 0)
                    continue;
                double bound = s->strength[g][k] * band_product(p.band[g], inverse + (size_t)term * (WIDTH + 1), rows, T * (WIDTH + 1), T);
                tuning->kept[branch][g][k] += fmax(0, s->strength[g][k] * trace[g] - bound);
                tuning->size[branch][g][k] += penalty_of(p.band[g], row_of(s, branch), rows, term);
                free_terms -= bound;
            }
        }
        tuning->freedom[branch] = free_terms;
    }
    tuning->failed[branch] = !good;
    free(p.band[0]);
    free(v);
}

// Standard deviation of the distances: from their median, so that misfit at a few places does not count as noise.
static double measure_noise(const SweepSystem *s, double freedom)
{
    int64_t count = 0;
    double *value = malloc(((size_t)s->draft->point_count + 1) * sizeof *value), noise = s->noise;
    for (int64_t p = 0; value && p < s->draft->point_count; p++)
        if (s->trust[p] > 0.01)
            value[count++] = fabs(s->distance[p]);
    if (count > 0) {
        sort_doubles(value, (size_t)count);
        noise = 1.4826 * value[count / 2] / sqrt(fmax(0.2, 1 - freedom / (double)count));
    }
    free(value);
    return noise;
}

bool sweep_system_tune(SweepSystem *s)
{
    SEL_ASSERT(s->noise > 0, "points have noise: precisions are its inverse");
    size_t count = (size_t)s->draft->count;
    Tuning tuning = {s, calloc(count, sizeof *tuning.kept), calloc(count, sizeof *tuning.size), calloc(count, sizeof *tuning.freedom),
                     calloc(count, sizeof *tuning.failed)};
    bool good = tuning.kept && tuning.size && tuning.freedom && tuning.failed;
    if (good) {
        parallel_for(s->draft->options->threads, s->draft->count, tune_branch, &tuning, NULL);
        s->freedom = 0;
        double kept[PENALTIES][SWEEP_HARMONICS + 1] = {{0}}, size[PENALTIES][SWEEP_HARMONICS + 1] = {{0}};
        for (int i = 0; i < s->draft->count; i++) {
            good = good && !tuning.failed[i];
            s->freedom += tuning.freedom[i];
            for (int g = 0; g < PENALTIES; g++)
                for (int k = 0; k <= SWEEP_HARMONICS; k++)
                    kept[g][k] += tuning.kept[i][g][k], size[g][k] += tuning.size[i][g][k];
        }
        for (int g = 0; g < PENALTIES; g++)
            for (int k = 0; k <= SWEEP_HARMONICS; k++)
                if (kept[g][k] > 0) {
                    double ratio = kept[g][k] / fmax(size[g][k], 1e-30) / s->strength[g][k];
                    s->strength[g][k] = fmax(LEAST_STRENGTH[g], fmin(MOST_STRENGTH, s->strength[g][k] * ratio * sqrt(fmax(0.1, fmin(10, ratio)))));
                }
        double least = 1e-4 * s->draft->branches->branch[0].radius_mean;
        s->noise = fmax(least, measure_noise(s, s->freedom));
    }
    free(tuning.kept);
    free(tuning.size);
    free(tuning.freedom);
    free(tuning.failed);
    return good;
}

// --- Steps ---

typedef struct Stepper {
    SweepSystem *system;
    bool coupled;
    double **stiffness, **factor;    // (branches) V and its factor
    double *x, *residual, *way, *image, *preconditioned;     // (rows, T)
    bool *failed;            // (branches)
    int64_t blended_count;
    int64_t *blended;        // points that several branches see
} Stepper;

static double *part_of(const Stepper *t, double *vector, int branch) { return vector + (size_t)branch_of(t->system, branch)->first_row * T; }

// V, its factor, and the right-hand side -(J' w e / s^2 + S c + prior (c_0 - r)).
static void prepare_branch(void *context, long index)
{
    Stepper *t = context;
    const SweepSystem *s = t->system;
    int branch = (int)index, rows = rows_of(s, branch);
    size_t n = (size_t)rows * T * (WIDTH + 1);
    BranchPenalties p = {0};
    double *v = t->stiffness[branch] = malloc(n * sizeof *v), *f = t->factor[branch] = malloc(n * sizeof *f), *right = part_of(t, t->residual, branch);
    const double *row = row_of(s, branch);
    bool good = v && f && make_penalties(s, branch, &p);
    if (good) {
        fill_stiffness(s, branch, &p, v);
        for (int i = 0; t->coupled && i < rows * T; i++)
            v[(size_t)i * (WIDTH + 1)] += DAMPING / (s->noise * s->noise);
        memcpy(f, v, n * sizeof *f);
        good = band_factor(f, rows * T, WIDTH);
        for (int i = 0; i < rows * T; i++)
            right[i] = -s->slope[branch][i] / (s->noise * s->noise);
        for (int term = 0; term < T; term++) {
            sum_penalties(s, branch, &p, harmonic_of(term));
            for (int j = 0; j < rows; j++)
                for (int d = 0; d <= NARROW && j + d < rows; d++) {
                    double a = p.all[j * (NARROW + 1) + d];
                    right[j * T + term] -= a * row[(j + d) * T + term];
                    if (d > 0)
                        right[(j + d) * T + term] -= a * row[j * T + term];
                }
        }
        for (int j = 0; j < rows; j++) {
            for (int term = 0; term < T; term++) {
                double target = term == 0 ? s->draft->prior_radius[branch_of(s, branch)->first_row + j] : 0;
                right[j * T + term] -= prior_of(s, branch, j, term) * (row[j * T + term] - target);
                if (is_held(s, branch, j, harmonic_of(term)))
                    right[j * T + term] = 0;
            }
        }
    }
    free(p.band[0]);
    t->failed[branch] = !good;
}

// out += the part of V that couples branches, times x.
static void add_coupling(const Stepper *t, double *x, double *out)
{
    const SweepSystem *s = t->system;
    double precision = 1 / (s->noise * s->noise), term[SWEEP_CANDIDATES + 1][T], sum[SWEEP_CANDIDATES + 1];
    for (int64_t k = 0; k < t->blended_count; k++) {
        int64_t p = t->blended[k];
        int count = (int)(s->first[p + 1] - s->first[p]);
        const SweepSight *sight = &s->sight[s->first[p]];
        double total = 0;
        for (int i = 0; i < count; i++) {
            expand_terms(&sight[i], term[i]);
            const double *from = part_of(t, x, sight[i].branch) + sight[i].first * T;
            sum[i] = 0;
            for (int j = 0; j < 4; j++)
                for (int a = 0; a < T; a++)
                    sum[i] += sight[i].weight[j] * term[i][a] * from[j * T + a];
            total += sum[i] *= sight[i].share;
        }
        for (int i = 0; i < count; i++) {
            double f = precision * s->trust[p] * sight[i].share * (total - sum[i]);
            double *to = part_of(t, out, sight[i].branch) + sight[i].first * T;
            for (int j = 0; j < 4; j++)
                for (int a = 0; a < T; a++)
                    to[j * T + a] += f * sight[i].weight[j] * term[i][a];
        }
    }
}

static double dot(const double *a, const double *b, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static void find_blended(Stepper *t)
{
    const SweepSystem *s = t->system;
    for (int64_t p = 0; p < s->draft->point_count; p++)
        if (s->first[p + 1] - s->first[p] > 1 && !(s->trust[p] < 1e-6))
            t->blended[t->blended_count++] = p;
}

static void solve_branch(void *context, long branch)
{
    Stepper *t = context;
    band_solve(t->factor[branch], rows_of(t->system, (int)branch) * T, WIDTH, part_of(t, t->preconditioned, (int)branch));
}

static void precondition(Stepper *t, size_t n)
{
    memcpy(t->preconditioned, t->residual, n * sizeof *t->preconditioned);
    parallel_for(t->system->draft->options->threads, t->system->draft->count, solve_branch, t, NULL);
}

static void multiply_branch(void *context, long branch)
{
    Stepper *t = context;
    band_multiply(t->stiffness[branch], rows_of(t->system, (int)branch) * T, WIDTH, part_of(t, t->way, (int)branch), part_of(t, t->image, (int)branch));
}

// Conjugate gradients; without coupling the preconditioner is the solution.
static void solve(Stepper *t, size_t n, bool coupled)
{
    precondition(t, n);
    if (!coupled) {
        memcpy(t->x, t->preconditioned, n * sizeof *t->x);
        return;
    }
    memcpy(t->way, t->preconditioned, n * sizeof *t->way);
    double now = dot(t->residual, t->preconditioned, n), start = now;
    for (int k = 0; k < GRADIENTS && now > CLOSE * CLOSE * start && now > 0; k++) {
        parallel_for(t->system->draft->options->threads, t->system->draft->count, multiply_branch, t, NULL);
        add_coupling(t, t->way, t->image);
        double step = now / dot(t->way, t->image, n);
        for (size_t i = 0; i < n; i++) {
            t->x[i] += step * t->way[i];
            t->residual[i] -= step * t->image[i];
        }
        precondition(t, n);
        double next = dot(t->residual, t->preconditioned, n), share = next / now;
        now = next;
        for (size_t i = 0; i < n; i++)
            t->way[i] = t->preconditioned[i] + share * t->way[i];
    }
}

// Adds the step, as far as it is allowed, and leaves what was added in x.
static void take_step(const SweepSystem *s, double *x)
{
    const SweepDraft *d = s->draft;
    for (int i = 0; i < d->count; i++)
        for (int j = 0; j < rows_of(s, i); j++) {
            double *row = row_of(s, i) + j * T;
            double *step = x + (size_t)(branch_of(s, i)->first_row + j) * T;
            double radius = d->prior_radius[branch_of(s, i)->first_row + j], most = LONGEST * radius, added[T];
            for (int a = 0; a < T; a++) {
                double before = row[a], length = a == 0 ? fabs(step[0]) : same_hypot(step[a - (a + 1) % 2], step[a + a % 2]);
                double share = is_held(s, i, j, harmonic_of(a)) ? 0 : length > most ? most / length : 1;
                row[a] = a == 0 ? fmax(row[a] + share * step[a], 0.05 * radius) : row[a] + share * step[a];
                added[a] = row[a] - before;
            }
            memcpy(step, added, sizeof added);
        }
}

bool sweep_system_step(SweepSystem *s, bool coupled)
{
    SEL_ASSERT(s->noise > 0, "points have noise: precisions are its inverse");
    size_t branches = (size_t)s->draft->count, n = (size_t)s->draft->model->row_count * T;
    double *memory = calloc(5 * n, sizeof *memory);
    Stepper t = {.system = s,
                 .coupled = coupled,
                 .stiffness = calloc(branches, sizeof *t.stiffness),
                 .factor = calloc(branches, sizeof *t.factor),
                 .failed = calloc(branches, sizeof *t.failed)};
    t.blended = coupled ? malloc(((size_t)s->draft->point_count + 1) * sizeof *t.blended) : NULL;
    bool good = memory && t.stiffness && t.factor && t.failed && (t.blended || !coupled);
    if (good) {
        if (coupled)
            find_blended(&t);
        t.x = memory, t.residual = memory + n, t.way = memory + 2 * n, t.image = memory + 3 * n, t.preconditioned = memory + 4 * n;
        parallel_for(s->draft->options->threads, s->draft->count, prepare_branch, &t, NULL);
        for (int i = 0; i < s->draft->count; i++)
            good = good && !t.failed[i];
        if (good) {
            solve(&t, n, coupled);
            take_step(s, t.x);
            for (int i = 0; i < s->draft->count && !coupled; i++) {
                int unknowns = rows_of(s, i) * T;
                band_multiply(s->matrix[i], unknowns, WIDTH, part_of(&t, t.x, i), part_of(&t, t.image, i));
                for (int k = 0; k < unknowns; k++)
                    s->slope[i][k] += part_of(&t, t.image, i)[k];
            }
        }
    }
    for (int i = 0; i < s->draft->count; i++) {
        if (t.stiffness)
            free(t.stiffness[i]);
        if (t.factor)
            free(t.factor[i]);
    }
    free(memory);
    free(t.blended);
    free(t.stiffness);
    free(t.factor);
    free(t.failed);
    return good;
}

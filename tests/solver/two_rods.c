#include "tests/solver/two_rods.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A node's gradient depends on the two nodes on either side of it.
enum { BAND = 5, COLORS = 10, ITERATIONS = 1000 };

bool two_rods_make(TwoRods *rods, double before, double radius, double angle, double after, double h)
{
    int first = (int)lround(before / h), bend = (int)lround(radius * angle / h), last = (int)lround(after / h), links = first + bend + last;
    size_t nodes = (size_t)links + 1;
    *rods = (TwoRods){.links = links,
                      .h = h,
                      .catheter = 60,
                      .wire = 20,
                      .reach = links,
                      .rest = calloc(nodes, sizeof *rods->rest),
                      .x = calloc(2 * nodes, sizeof *rods->x),
                      .gradient = calloc(2 * nodes, sizeof *rods->gradient)};
    if (!rods->rest || !rods->x || !rods->gradient)
        return false;
    // at a node on the border of the arc, half of the angle
    for (int i = first; i <= first + bend; i++)
        rods->rest[i] = angle / bend * (i == first || i == first + bend ? 0.5 : 1);
    for (int i = 0; i <= links; i++)
        rods->x[2 * i + 1] = rods->rest[i];
    return true;
}

void two_rods_free(TwoRods *rods)
{
    free(rods->rest);
    free(rods->x);
    free(rods->gradient);
}

// --- energy ---

typedef struct Link {
    double x, y, length, angle;
    double by_length, by_angle;      // the energy's derivatives
} Link;

static Link link_at(const TwoRods *rods, int i)
{
    const double *x = rods->x + 2 * i;
    Link link = {.x = rods->h - x[0] * sin(x[1] / 2) - x[2] * sin(x[3] / 2), .y = x[2] * cos(x[3] / 2) - x[0] * cos(x[1] / 2)};
    link.length = hypot(link.x, link.y);
    link.angle = atan2(link.y, link.x);
    return link;
}

// Adds a link's derivatives to those of its two nodes.
static void spread(TwoRods *rods, int i, const Link *link)
{
    const double *x = rods->x + 2 * i;
    double *g = rods->gradient + 2 * i, l2 = link->length * link->length;
    double vx = link->by_length * link->x / link->length - link->by_angle * link->y / l2,
           vy = link->by_length * link->y / link->length + link->by_angle * link->x / l2;
    double s = sin(x[1] / 2), c = cos(x[1] / 2), s1 = sin(x[3] / 2), c1 = cos(x[3] / 2);
    g[0] += -vx * s - vy * c;
    g[1] += -vx * x[0] * c / 2 + vy * x[0] * s / 2;
    g[2] += -vx * s1 + vy * c1;
    g[3] += -vx * x[2] * c1 / 2 - vy * x[2] * s1 / 2;
}

double two_rods_energy(TwoRods *rods)
{
    double energy = 0;
    memset(rods->gradient, 0, 2 * ((size_t)rods->links + 1) * sizeof *rods->gradient);
    for (int i = 1; i < rods->links; i++) {
        double bent = rods->x[2 * i + 1] - rods->rest[i];
        energy += rods->catheter * bent * bent / (2 * rods->h);
        rods->gradient[2 * i + 1] += rods->catheter * bent / rods->h;
    }
    Link before = {0};
    for (int i = 0; i < rods->reach; i++) {
        Link link = link_at(rods, i);
        energy -= rods->pressed * link.length;
        link.by_length = -rods->pressed;
        if (i > 0) {
            double turn = rods->x[2 * i + 1] + link.angle - before.angle, length = (before.length + link.length) / 2, moment = rods->wire * turn / length;
            energy += moment * turn / 2;
            rods->gradient[2 * i + 1] += moment;
            before.by_angle -= moment;
            link.by_angle += moment;
            before.by_length -= moment * turn / length / 4;
            link.by_length -= moment * turn / length / 4;
            spread(rods, i - 1, &before);
        }
        before = link;
    }
    if (rods->reach > 0)
        spread(rods, rods->reach - 1, &before);
    return energy;
}

// --- Newton's method with a barrier at the bounds: energy - mu sum log((c - w) (c + w)), mu -> 0 ---

static int value_count(const TwoRods *rods) { return 2 * (rods->links + 1); }

// The hub is clamped, and there is no node beyond the end. If the catheter is held, all angles are fixed. Nodes without a wire have no w.
static bool is_fixed(const TwoRods *rods, int k)
{
    int node = k / 2;
    if (k % 2)
        return rods->is_held || node == 0 || node == rods->links;
    return node > rods->reach || rods->clearance <= 0;
}

static double barrier_energy(TwoRods *rods, double mu)
{
    double c = rods->clearance, energy = two_rods_energy(rods);
    for (int k = 0; k < value_count(rods); k += 2) {
        double w = rods->x[k];
        if (is_fixed(rods, k))
            continue;
        if (fabs(w) >= c)
            return HUGE_VAL;
        energy -= mu * log((c - w) * (c + w));
        rods->gradient[k] += mu * (1 / (c - w) - 1 / (c + w));
    }
    return energy;
}

typedef struct Work {
    double *hessian, *bending;       // (values, 2 BAND + 1)
    double *factor;                  // (values, BAND + 1)
    double *d, *from, *scratch;      // (values)
    double shift;                    // larger after a step that had to be shortened, smaller after a good step
    bool *fixed;
} Work;

// Second derivatives by differences of the gradient, for all independent values at once: (count, 2 BAND + 1).
static void find_hessian(TwoRods *rods, double mu, double *hessian, double *scratch)
{
    const double step = 1e-6;
    int count = value_count(rods);
    for (int color = 0; color < COLORS; color++) {
        for (int sign = 1; sign >= -1; sign -= 2) {
            for (int k = color; k < count; k += COLORS)
                rods->x[k] += sign * step;
            two_rods_energy(rods);
            for (int k = color; k < count; k += COLORS)
                rods->x[k] -= sign * step;
            if (sign > 0)
                memcpy(scratch, rods->gradient, (size_t)count * sizeof *scratch);
        }
        for (int k = color; k < count; k += COLORS)
            for (int row = k - BAND < 0 ? 0 : k - BAND; row <= k + BAND && row < count; row++)
                hessian[row * (2 * BAND + 1) + k - row + BAND] = (scratch[row] - rods->gradient[row]) / (2 * step);
    }
    for (int k = 0; k < count; k += 2)
        if (!is_fixed(rods, k)) {
            double c = rods->clearance, w = rods->x[k];
            hessian[k * (2 * BAND + 1) + BAND] += mu * (1 / ((c - w) * (c - w)) + 1 / ((c + w) * (c + w)));
        }
}

// How a link's angle changes with w_i, beta_i, w_i+1, beta_i+1.
static void angle_slope(const TwoRods *rods, int i, double slope[4])
{
    const double *x = rods->x + 2 * i;
    Link link = link_at(rods, i);
    double l2 = link.length * link.length, vx = -link.y / l2, vy = link.x / l2, s = sin(x[1] / 2), c = cos(x[1] / 2), s1 = sin(x[3] / 2), c1 = cos(x[3] / 2);
    slope[0] = -vx * s - vy * c;
    slope[1] = (-vx * c + vy * s) * x[0] / 2;
    slope[2] = -vx * s1 + vy * c1;
    slope[3] = (-vx * c1 - vy * s1) * x[2] / 2;
}

// Gauss-Newton part of the second derivatives of the bending energy.
static void find_bending(const TwoRods *rods, double *bending)
{
    memset(bending, 0, (size_t)value_count(rods) * (2 * BAND + 1) * sizeof *bending);
    for (int i = 1; i < rods->links; i++) {
        bending[(2 * i + 1) * (2 * BAND + 1) + BAND] += rods->catheter / rods->h;
        if (i >= rods->reach)
            continue;
        double slope[6] = {0}, before[4], after[4];
        angle_slope(rods, i - 1, before);
        angle_slope(rods, i, after);
        slope[3] = 1;
        for (int k = 0; k < 4; k++) {
            slope[k] -= before[k];
            slope[k + 2] += after[k];
        }
        for (int a = 0; a < 6; a++)
            for (int b = 0; b < 6; b++)
                bending[(2 * i - 2 + a) * (2 * BAND + 1) + b - a + BAND] += rods->wire / rods->h * slope[a] * slope[b];
    }
}

// (H + shift B) at (i, j), symmetric. B, the bending part, is positive semi-definite: it stabilises buckling modes and leaves soft modes soft.
static double entry(const Work *work, double shift, int i, int j)
{
    const double floor = 1e-11;
    int ij = i * (2 * BAND + 1) + j - i + BAND, ji = j * (2 * BAND + 1) + i - j + BAND;
    return 0.5 * (work->hessian[ij] + work->hessian[ji]) + shift * 0.5 * (work->bending[ij] + work->bending[ji]) * (i == j ? 1 + floor : 1);
}

// Solves (H + shift B) d = -g for the free values by banded Cholesky. False if the matrix is not positive definite.
static bool find_direction(const TwoRods *rods, const Work *work, double shift)
{
    int count = value_count(rods);
    const bool *fixed = work->fixed;
    double *factor = work->factor, *d = work->d;
    for (int i = 0; i < count; i++) {
        double *row = factor + i * (BAND + 1);       // row[BAND] is the diagonal
        for (int j = i - BAND < 0 ? 0 : i - BAND; j <= i; j++) {
            double a = fixed[i] || fixed[j] ? (i == j ? 1 : 0) : entry(work, shift, i, j);
            for (int k = i - BAND < 0 ? 0 : i - BAND; k < j; k++)
                a -= j - k <= BAND ? row[k - i + BAND] * factor[j * (BAND + 1) + k - j + BAND] : 0;
            if (i == j && !(a > 0))
                return false;
            row[j - i + BAND] = i == j ? sqrt(a) : a / factor[j * (BAND + 1) + BAND];
        }
    }
    for (int i = 0; i < count; i++) {
        d[i] = fixed[i] ? 0 : -rods->gradient[i];
        for (int k = i - BAND < 0 ? 0 : i - BAND; k < i; k++)
            d[i] -= factor[i * (BAND + 1) + k - i + BAND] * d[k];
        d[i] /= factor[i * (BAND + 1) + BAND];
    }
    for (int i = count - 1; i >= 0; i--) {
        for (int k = i + 1; k <= i + BAND && k < count; k++)
            d[i] -= factor[k * (BAND + 1) + i - k + BAND] * d[k];
        d[i] /= factor[i * (BAND + 1) + BAND];
    }
    return true;
}

// The largest unbalanced force, or moment over a radius [N].
static double imbalance(const TwoRods *rods, const bool *fixed)
{
    double worst = 0;
    for (int k = 0; k < value_count(rods); k++)
        worst = fmax(worst, fixed[k] ? 0 : fabs(rods->gradient[k]));
    return worst;
}

// The largest fraction of d that stays within the bounds.
static double free_way(const TwoRods *rods, const double *d)
{
    double part = 1;
    for (int k = 0; k < value_count(rods); k += 2)
        if (!is_fixed(rods, k) && d[k] != 0)
            part = fmin(part, 0.99 * (d[k] > 0 ? rods->clearance - rods->x[k] : rods->clearance + rods->x[k]) / fabs(d[k]));
    return part;
}

// One step; false if no step reduces the energy.
static bool descend(TwoRods *rods, double mu, Work *work)
{
    size_t count = (size_t)value_count(rods);
    double slope = 0;
    find_bending(rods, work->bending);
    find_hessian(rods, mu, work->hessian, work->scratch);
    double energy = barrier_energy(rods, mu);
    while (!find_direction(rods, work, work->shift) && work->shift < 1e6)
        work->shift = fmax(8 * work->shift, 1e-6);
    for (size_t k = 0; k < count; k++)
        slope += work->d[k] * rods->gradient[k];
    memcpy(work->from, rods->x, count * sizeof *work->from);
    double whole = free_way(rods, work->d);
    for (double part = whole; part > 1e-10; part /= 2) {
        for (size_t k = 0; k < count; k++)
            rods->x[k] = work->from[k] + part * work->d[k];
        if (barrier_energy(rods, mu) <= energy + 1e-6 * part * slope + 1e-15 * fabs(energy)) {
            work->shift = part < 0.3 * whole ? fmax(8 * work->shift, 1e-3) : work->shift > 1e-6 ? work->shift / 8 : 0;
            return true;
        }
    }
    memcpy(rods->x, work->from, count * sizeof *work->from);
    barrier_energy(rods, mu);
    return false;
}

// mu [mJ] ends at a value at which a node pressed with 0.1 mN is 1e-6 mm from its wall.
static int find_least(TwoRods *rods, Work *work)
{
    const double first = 1e-4, last = 1e-10, balanced = 1e-6;    // links of 0.25 mm, EI / h^3 of 1,000 N/mm: rounding leaves 1e-7 N
    int steps = 0;
    for (double mu = first;; mu = fmax(mu / 10, last)) {
        bool continues = true;
        barrier_energy(rods, mu);
        for (; imbalance(rods, work->fixed) > fmax(balanced, mu) && continues && steps < ITERATIONS; steps++)
            continues = descend(rods, mu, work);
        if (!(mu > last) || steps >= ITERATIONS)
            return imbalance(rods, work->fixed) <= balanced ? steps : -1;
    }
}

int two_rods_solve(TwoRods *rods)
{
    size_t count = (size_t)value_count(rods);
    double *memory = calloc(count * (2 * (2 * BAND + 1) + BAND + 1 + 3), sizeof *memory);
    Work work = {.hessian = memory, .fixed = calloc(count, sizeof *work.fixed)};
    int steps = -1;
    if (memory && work.fixed) {
        work.bending = memory + count * (2 * BAND + 1);
        work.factor = work.bending + count * (2 * BAND + 1);
        work.d = work.factor + count * (BAND + 1);
        work.from = work.d + count;
        work.scratch = work.from + count;
        for (int k = 0; k < (int)count; k++) {
            work.fixed[k] = is_fixed(rods, k);
            if (k % 2 == 0)      // away from the wall of the last solution
                rods->x[k] = fmax(-0.9 * rods->clearance, fmin(0.9 * rods->clearance, rods->x[k]));
        }
        steps = find_least(rods, &work);
        two_rods_energy(rods);
    }
    free(memory);
    free(work.fixed);
    return steps;
}

double two_rods_length(const TwoRods *rods)
{
    double length = 0;
    for (int i = 0; i < rods->reach; i++)
        length += link_at(rods, i).length;
    return length;
}

void two_rods_tip(const TwoRods *rods, double *x, double *y, double *angle, double *exit)
{
    *x = *y = *angle = 0;
    for (int i = 0; i < rods->links; i++) {
        *angle += rods->x[2 * i + 1];
        *x += rods->h * cos(*angle);
        *y += rods->h * sin(*angle);
    }
    *exit = rods->reach > 0 ? link_at(rods, rods->reach - 1).angle : 0;
}

#include "sim/first_order.h"

#include "base/base.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { GROUPS = 20, FEWEST = 8 };
static const double student_95 = 2.093;          // quantile of 97.5 % with GROUPS - 1 degrees of freedom

typedef struct Run {
    double x, y;
    int order, group;
} Run;

static int by_input(const void *a, const void *b)
{
    const Run *p = a, *q = b;
    return p->x != q->x ? (p->x < q->x ? -1 : 1) : p->order - q->order;
}

// Groups of a fixed random order (SplitMix64), so that the structure of a grid does not become that of a group.
static int group_of(int run)
{
    uint64_t z = (uint64_t)run * 0x9E3779B97F4A7C15U + 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return (int)((z ^ (z >> 31)) % GROUPS);
}

// Epsilon squared of the runs outside a group (-1: of all), which are sorted by x. NAN where it is not defined.
static double estimate(int count, const Run *run, int without, bool is_name, int *classes)
{
    int used = 0, filled = 0, in_class = 0;
    double mean = 0, total = 0, within = 0, sum = 0, squares = 0;
    for (int i = 0; i < count; i++)
        if (run[i].group != without) {
            used++;
            mean += run[i].y;
        }
    mean /= used;
    double least = is_name ? 1 : sqrt(used);
    int left = used;
    for (int i = 0, last = -1; i < count; i++) {
        if (run[i].group == without)
            continue;
        // a class ends when it is full and the input changes, unless the rest is too small for another
        if (last >= 0 && run[i].x != run[last].x && in_class >= least && left >= least) {
            within += squares - sum * sum / in_class;
            filled++;
            sum = squares = in_class = 0;
        }
        double y = run[i].y - mean;
        sum += y;
        squares += y * y;
        total += y * y;
        in_class++;
        left--;
        last = i;
    }
    within += squares - sum * sum / in_class;
    filled++;
    *classes = filled;
    if (!(total > 0) || filled < 2 || used < 2 * filled)
        return NAN;
    double noise = within / (used - filled);
    return (total - within - (filled - 1) * noise) / total;
}

bool first_order(int count, const double *x, const double *y, bool is_name, FirstOrder *out)
{
    int ignored;
    *out = (FirstOrder){.runs = count};
    if (count < FEWEST)
        return false;
    Run *run = HEAP_ZEROED((size_t)count, sizeof *run);
    for (int i = 0; i < count; i++)
        run[i] = (Run){x[i], y[i], i, group_of(i)};
    qsort(run, (size_t)count, sizeof *run, by_input);
    double mean = 0, squares = 0, part[GROUPS];
    out->index = estimate(count, run, -1, is_name, &out->classes);
    int held = 0;
    for (int g = 0; g < GROUPS; g++) {
        double one = estimate(count, run, g, is_name, &ignored);
        if (!isnan(one))
            part[held++] = one;
    }
    for (int g = 0; g < held; g++)
        mean += part[g] / held;
    for (int g = 0; g < held; g++)
        squares += (part[g] - mean) * (part[g] - mean);
    double error = held > 1 ? student_95 * sqrt(squares * (held - 1) / held) : HUGE_VAL;
    out->low = out->index - error;
    out->high = out->index + error;
    free(run);
    return isfinite(out->index) && isfinite(error);
}

#include "study/distribution.h"

#include "base/base.h"

#include <math.h>
#include <stdio.h>

const char *const vary_name[VARY_VALUES + 2] = {"uniform", "loguniform", "normal", "integer", "values", NULL};

// Bisection of P(x) = (1 + erf(x / sqrt 2)) / 2 in the lower half, where 1 + erf loses the fewest digits; the error is below 1e-9 for u > 1e-8.
double normal_quantile(double u)
{
    SEL_ASSERT(u > 0 && u < 1, "a share lies within the distribution");
    double below = u < 0.5 ? u : 1 - u, least = -9, most = 0;
    for (int i = 0; i < 60; i++) {
        double x = 0.5 * (least + most);
        if (0.5 * (1 + same_erf(x * sqrt(0.5))) < below)
            least = x;
        else
            most = x;
    }
    return u < 0.5 ? most : -most;
}

// The share u from 0 to 1, both allowed, of an interval.
static double between(const Distribution *d, double u)
{
    if (d->kind == VARY_LOGUNIFORM)
        return u <= 0 ? d->a : u >= 1 ? d->b : same_exp(same_log(d->a) + u * (same_log(d->b) - same_log(d->a)));
    return d->a + u * (d->b - d->a);
}

// Twelve digits: the number in the table is the number in the scene.
static const char *number(double value, char text[VARY_TEXT])
{
    snprintf(text, VARY_TEXT, "%.12g", value);
    return text;
}

long distribution_levels(const Distribution *d)
{
    return d->kind == VARY_VALUES ? d->value_count : d->levels > 0 ? d->levels : d->kind == VARY_INTEGER ? (long)(d->b - d->a) + 1 : 0;
}

const char *distribution_at(const Distribution *d, double u, char text[VARY_TEXT])
{
    SEL_ASSERT(u > 0 && u < 1, "a share lies within the distribution");
    if (d->kind == VARY_VALUES)
        return d->value[(int)(u * d->value_count)];
    if (d->kind == VARY_INTEGER)
        return number(d->a + floor(u * (d->b - d->a + 1)), text);
    return number(d->kind == VARY_NORMAL ? d->a + d->b * normal_quantile(u) : between(d, u), text);
}

const char *distribution_end(const Distribution *d, bool is_greatest, char text[VARY_TEXT])
{
    if (d->kind == VARY_NORMAL)
        return distribution_at(d, is_greatest ? 1 - 0x1p-32 : 0x1p-32, text);
    return number(is_greatest ? d->b : d->a, text);
}

const char *distribution_level(const Distribution *d, long level, char text[VARY_TEXT])
{
    long levels = distribution_levels(d);
    SEL_ASSERT(level >= 0 && level < levels, "the level exists");
    if (d->kind == VARY_VALUES)
        return d->value[level];
    if (d->kind == VARY_NORMAL)
        return distribution_at(d, ((double)level + 0.5) / (double)levels, text);
    double value = between(d, levels > 1 ? (double)level / (double)(levels - 1) : 0.5);
    return number(d->kind == VARY_INTEGER ? floor(value + 0.5) : value, text);
}

#include "render/tick_step.h"

#include <math.h>
#include <stdio.h>

double tick_step(double range, int most)
{
    if (!(range > 0) || !isfinite(range))
        return 1;
    double least = range / most, power = pow(10, floor(log10(least)));
    static const double part[3] = {1, 2, 5};
    for (int i = 0; i < 3; i++)
        if (least <= part[i] * power * (1 + 1e-9))
            return part[i] * power;
    return 10 * power;
}

double round_length(double most)
{
    if (!(most > 0) || !isfinite(most))
        return most;
    double power = pow(10, floor(log10(most) + 1e-9)), part = most / power * (1 + 1e-9);
    return (part >= 5 ? 5 : part >= 2 ? 2 : 1) * power;
}

void tick_format(char *text, size_t capacity, double value, double step)
{
    if (fabs(value) < 1e-9 * step)
        value = 0;
    int digits = step >= 1 ? 0 : (int)ceil(-log10(step) - 1e-9);
    if (digits > 6 || fabs(value) >= 1e6)
        snprintf(text, capacity, "%.3g", value);
    else
        snprintf(text, capacity, "%.*f", digits, value);
}

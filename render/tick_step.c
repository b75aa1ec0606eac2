#include "render/tick_step.h"

#include <math.h>

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

// de Boor's recursion; derivatives from the functions of degree 1 and 2.
#include "recon/fit/sweep_spline.h"

#include "base/base.h"

#include <math.h>
#include <string.h>

static double knot(const double *at, int breaks, int i) { return at[i < 3 ? 0 : i - 3 >= breaks ? breaks - 1 : i - 3]; }

int sweep_spline(const double *at, int breaks, double t, double value[4], double slope[4], double bend[4])
{
    SEL_ASSERT(breaks >= 2 && !isnan(t), "two breaks bound an interval, and t is a number");
    int low = 0, high = breaks - 1;
    t = fmax(at[0], fmin(at[breaks - 1], t));
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (at[middle] <= t)
            low = middle;
        else
            high = middle;
    }
    double k[8], one[2], two[3];     // the knots around interval q: k[3] <= t <= k[4]
    for (int i = 0; i < 8; i++)
        k[i] = knot(at, breaks, low + i);
    one[1] = (t - k[3]) / (k[4] - k[3]), one[0] = 1 - one[1];
    double a = (t - k[2]) / (k[4] - k[2]), b = (t - k[3]) / (k[5] - k[3]);
    two[0] = (1 - a) * one[0], two[1] = a * one[0] + (1 - b) * one[1], two[2] = b * one[1];
    double c[3] = {(t - k[1]) / (k[4] - k[1]), (t - k[2]) / (k[5] - k[2]), (t - k[3]) / (k[6] - k[3])};
    double half[3] = {-one[0] / (k[4] - k[2]), one[0] / (k[4] - k[2]) - one[1] / (k[5] - k[3]), one[1] / (k[5] - k[3])};
    for (int i = 0; i < 4; i++) {
        double before = i > 0 ? 1 / (k[i + 3] - k[i]) : 0, behind = i < 3 ? 1 / (k[i + 4] - k[i + 1]) : 0;
        value[i] = (i > 0 ? c[i - 1] * two[i - 1] : 0) + (i < 3 ? (1 - c[i]) * two[i] : 0);
        slope[i] = 3 * ((i > 0 ? two[i - 1] * before : 0) - (i < 3 ? two[i] * behind : 0));
        bend[i] = 6 * ((i > 0 ? half[i - 1] * before : 0) - (i < 3 ? half[i] * behind : 0));
    }
    return low;
}

void sweep_spline_integrals(const double *at, int breaks, int q, double rough[4][4], double size[4][4])
{
    SEL_ASSERT(q >= 0 && q < breaks - 1 && at[q + 1] > at[q], "the interval lies between two breaks");
    // three Gauss points: exact for products of second derivatives, and near enough for products of values
    static const double place[3] = {-0.7745966692414834, 0, 0.7745966692414834}, weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    double value[4], slope[4], bend[4], length = at[q + 1] - at[q];
    memset(rough, 0, 16 * sizeof(double));
    memset(size, 0, 16 * sizeof(double));
    for (int g = 0; g < 3; g++) {
        sweep_spline(at, breaks, at[q] + 0.5 * (1 + place[g]) * length, value, slope, bend);
        for (int a = 0; a < 4; a++)
            for (int b = 0; b < 4; b++) {
                rough[a][b] += weight[g] * length * bend[a] * bend[b];
                size[a][b] += weight[g] * length * value[a] * value[b];
            }
    }
}

#include "recon/fit/band_matrix.h"

#include "base/base.h"

#include <math.h>
#include <stddef.h>

static double *column_of(double *a, int j, int width) { return a + (size_t)j * (size_t)(width + 1); }
static const double *factor_column(const double *a, int j, int width) { return a + (size_t)j * (size_t)(width + 1); }
static int height_of(int n, int j, int width) { return n - 1 - j < width ? n - 1 - j : width; }

bool band_factor(double *a, int n, int width)
{
    SEL_ASSERT(n > 0 && width >= 0, "a matrix has rows");
    for (int j = 0; j < n; j++) {
        double *c = column_of(a, j, width);
        int height = height_of(n, j, width);
        if (!(c[0] > 0) || !isfinite(c[0]))
            return false;
        c[0] = sqrt(c[0]);
        for (int d = 1; d <= height; d++)
            c[d] /= c[0];
        for (int d = 1; d <= height; d++) {
            double f = c[d], *to = column_of(a, j + d, width);
            if (f == 0)
                continue;
            for (int e = d; e <= height; e++)
                to[e - d] -= f * c[e];
        }
    }
    return true;
}

void band_solve(const double *factor, int n, int width, double *x)
{
    for (int j = 0; j < n; j++) {
        const double *c = factor_column(factor, j, width);
        double f = x[j] /= c[0];
        for (int d = 1, height = height_of(n, j, width); d <= height; d++)
            x[j + d] -= f * c[d];
    }
    for (int j = n - 1; j >= 0; j--) {
        const double *c = factor_column(factor, j, width);
        double sum = x[j];
        for (int d = 1, height = height_of(n, j, width); d <= height; d++)
            sum -= c[d] * x[j + d];
        x[j] = sum / c[0];
    }
}

void band_inverse(const double *factor, int n, int width, double *inverse)
{
    SEL_ASSERT(factor != inverse, "the factor is read while the inverse is written");
    for (int j = n - 1; j >= 0; j--) {
        const double *c = factor_column(factor, j, width);
        double *z = column_of(inverse, j, width), pivot = 1 / c[0];
        int height = height_of(n, j, width);
        for (int d = 0; d <= width; d++)
            z[d] = 0;
        for (int d = 1; d <= height; d++) {
            const double *from = factor_column(inverse, j + d, width);
            double f = c[d] * pivot, sum = f * from[0];
            for (int e = d + 1; e <= height; e++) {
                z[e] -= f * from[e - d];
                sum += c[e] * pivot * from[e - d];
            }
            z[d] -= sum;
        }
        double sum = pivot * pivot;
        for (int d = 1; d <= height; d++)
            sum -= c[d] * pivot * z[d];
        z[0] = sum;
    }
}

void band_multiply(const double *a, int n, int width, const double *x, double *y)
{
    for (int j = 0; j < n; j++)
        y[j] = 0;
    for (int j = 0; j < n; j++) {
        const double *c = factor_column(a, j, width);
        double sum = c[0] * x[j];
        for (int d = 1, height = height_of(n, j, width); d <= height; d++) {
            sum += c[d] * x[j + d];
            y[j + d] += c[d] * x[j];
        }
        y[j] += sum;
    }
}

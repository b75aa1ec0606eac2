#include "geom/section_kinds.h"

#include <stdlib.h>

Section *section_allocate(SectionKind kind, size_t values, double radius)
{
    Section *section = calloc(1, sizeof *section + values * sizeof section->values[0]);
    if (section) {
        section->kind = kind;
        section->radius = radius;
    }
    return section;
}

void section_free(Section *section) { free(section); }

SectionJet section_evaluate(const Section *section, double n, double b) { return section->evaluate(section, n, b); }

int section_numbers(const Section *section) { return section->numbers; }

// The place between `in` (C > 0) and `out` (C <= 0) on a ray where C changes its sign.
static double crossing(const Section *section, double n0, double b0, double c, double s, double in, double out)
{
    double f_in = section_evaluate(section, n0 + in * c, b0 + in * s).value, f_out = section_evaluate(section, n0 + out * c, b0 + out * s).value;
    for (int i = 0; i < 60 && out - in > 1e-13 * section->radius; i++) {
        // the secant, halved at the side that stays (Illinois); every fourth time the middle
        double at = i % 4 == 3 ? 0.5 * (in + out) : in + (out - in) * f_in / (f_in - f_out);
        double f = section_evaluate(section, n0 + at * c, b0 + at * s).value;
        if (fabs(f) < 1e-14 * section->radius)
            return at;
        if (f > 0)
            in = at, f_in = f, f_out *= 0.5;
        else
            out = at, f_out = f, f_in *= 0.5;
    }
    return 0.5 * (in + out);
}

int section_radii(const Section *section, double n0, double b0, int count, double *radius)
{
    enum { STEPS = 64 };
    double first = section_evaluate(section, n0, b0).value;
    if (!(first > 0))
        return -1;
    int more = 0;
    double longest = 3 * section->radius + same_hypot(n0, b0);
    for (int i = 0; i < count; i++) {
        double c = same_cos(2 * PI * i / count), s = same_sin(2 * PI * i / count), found = longest;
        bool inside = true;
        int met = 0;
        double at = 0, value = first;
        while (at < longest) {
            // mended sections are near to distances: no wall is nearer than a part of C
            double next = at + fmax(longest / STEPS, section->is_distance ? 0.5 * fabs(value) : 0);
            value = section_evaluate(section, n0 + next * c, b0 + next * s).value;
            bool now = value > 0;
            if (inside && !now)
                met++, found = crossing(section, n0, b0, c, s, at, next);
            inside = now, at = next;
        }
        radius[i] = found;
        more += met > 1;
    }
    return more;
}

void section_step(double x, double h[4])
{
    double a = fabs(x), left = 3 - a, sign = x < 0 ? -1 : 1, part;
    if (a >= 3)
        part = h[1] = h[2] = h[3] = 0;
    else if (a >= 1)
        part = left * left * left / 48, h[1] = left * left / 16, h[2] = -sign * left / 8, h[3] = 0.125;
    else
        part = 0.5 - a * (9 - a * a) / 24, h[1] = (3 - a * a) / 8, h[2] = -0.25 * x, h[3] = -0.25;
    h[0] = x < 0 ? part : 1 - part;
}

bool cholesky_factor(int size, double *a)
{
    for (int j = 0; j < size; j++) {
        double *row = a + (size_t)j * (size_t)size, square = row[j];
        for (int k = 0; k < j; k++)
            square -= row[k] * row[k];
        if (!(square > 0))
            return false;
        row[j] = sqrt(square);
        for (int i = j + 1; i < size; i++) {
            double *lower = a + (size_t)i * (size_t)size, sum = lower[j];
            for (int k = 0; k < j; k++)
                sum -= lower[k] * row[k];
            lower[j] = sum / row[j];
        }
    }
    return true;
}

void cholesky_solve(int size, const double *a, double *x)
{
    for (int i = 0; i < size; i++) {
        const double *row = a + (size_t)i * (size_t)size;
        for (int k = 0; k < i; k++)
            x[i] -= row[k] * x[k];
        x[i] /= row[i];
    }
    for (int i = size - 1; i >= 0; i--) {
        for (int k = i + 1; k < size; k++)
            x[i] -= a[(size_t)k * (size_t)size + (size_t)i] * x[k];
        x[i] /= a[(size_t)i * (size_t)size + (size_t)i];
    }
}

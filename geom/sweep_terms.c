#include "geom/sweep_terms.h"

double sweep_terms_radius(const double term[SWEEP_TERMS], double theta)
{
    double sum = term[0];
    for (int k = 1; k <= SWEEP_HARMONICS; k++)
        sum += term[2 * k - 1] * same_cos(k * theta) + term[2 * k] * same_sin(k * theta);
    return sum;
}

double sweep_terms_area(const double term[SWEEP_TERMS])
{
    double sum = term[0] * term[0];
    for (int k = 1; k < SWEEP_TERMS; k++)
        sum += 0.5 * term[k] * term[k];
    return PI * sum;
}

void sweep_terms_contour(const double term[SWEEP_TERMS], int count, SectionPoint *contour)
{
    for (int i = 0; i < count; i++) {
        double theta = 2 * PI * i / count, r = sweep_terms_radius(term, theta);
        contour[i] = (SectionPoint){r * same_cos(theta), r * same_sin(theta)};
    }
}

void sweep_terms_of_radii(int count, const double *radius, double term[SWEEP_TERMS])
{
    SEL_ASSERT(count > 2 * SWEEP_HARMONICS, "there are more radii than terms");
    for (int k = 0; k < SWEEP_TERMS; k++) {
        double sum = 0;
        for (int i = 0; i < count; i++) {
            double theta = 2 * PI * i / count * ((k + 1) / 2);
            sum += radius[i] * (k % 2 ? same_cos(theta) : k > 0 ? same_sin(theta) : 1);
        }
        term[k] = sum * (k > 0 ? 2.0 : 1.0) / count;
    }
}

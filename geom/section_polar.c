// Polar sections. Least squares for the Fourier terms at the contour's points, with k^4 as a slight penalty, so that few points determine many terms.
#include "geom/section_kinds.h"

static void fill_terms(int harmonics, double theta, double *term)
{
    term[0] = 1;
    for (int k = 1; k <= harmonics; k++)
        term[2 * k - 1] = same_cos(k * theta), term[2 * k] = same_sin(k * theta);
}

static SectionJet evaluate_polar(const Section *section, double n, double b)
{
    // rho keeps its distance from 0, where theta has no value: far inside, no curve is there
    int harmonics = (section->numbers - 1) / 2;
    double rho = fmax(same_hypot(n, b), 1e-6 * section->radius), c = n / rho, s = b / rho, radius = section->values[0], first = 0, second = 0, ck = 1, sk = 0;
    for (int k = 1; k <= harmonics; k++) {
        double next = ck * c - sk * s, x = section->values[2 * k - 1], y = section->values[2 * k];
        sk = sk * c + ck * s, ck = next;
        radius += x * ck + y * sk;
        first += k * (y * ck - x * sk);
        second -= k * k * (x * ck + y * sk);
    }
    // grad theta = (-s, c)/rho, grad rho = (c, s)
    double across = 1 / rho, bend = across * across;
    SectionJet jet = {.value = radius - rho, .n = -first * s * across - c, .b = first * c * across - s};
    jet.nn = second * s * s * bend + 2 * first * c * s * bend - s * s * across;
    jet.bb = second * c * c * bend - 2 * first * c * s * bend - c * c * across;
    jet.nb = -second * c * s * bend - first * (c * c - s * s) * bend + c * s * across;
    return jet;
}

Section *section_polar_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius)
{
    enum { TERMS = 33 };
    int harmonics = options->harmonics, terms = 2 * harmonics + 1;
    double matrix[TERMS * TERMS] = {0}, term[TERMS];
    Section *section = section_allocate(SECTION_POLAR, (size_t)terms, radius);
    if (!section)
        return NULL;
    section->numbers = terms;
    section->evaluate = evaluate_polar;
    section->is_distance = true;
    for (int i = 0; i < count; i++) {
        fill_terms(harmonics, same_atan2(contour[i].b, contour[i].n), term);
        double rho = same_hypot(contour[i].n, contour[i].b);
        for (int j = 0; j < terms; j++) {
            section->values[j] += term[j] * rho;
            for (int k = 0; k < terms; k++)
                matrix[j * terms + k] += term[j] * term[k];
        }
    }
    for (int k = 1; k <= harmonics; k++) {
        double penalty = 1e-9 * count * same_square(k * k);
        matrix[(2 * k - 1) * terms + 2 * k - 1] += penalty, matrix[2 * k * terms + 2 * k] += penalty;
    }
    if (!cholesky_factor(terms, matrix)) {
        section_free(section);
        return NULL;
    }
    cholesky_solve(terms, matrix, section->values);
    return section;
}

#include "geom/section_kinds.h"

#include <stdlib.h>

const char *const section_kind_name[SECTION_KINDS + 1] = {"polar", "raster", "rbf", "pas", NULL};

enum { CONTOUR_MOST = 4096 };

SectionOptions section_default_options(SectionKind kind, SectionForm form)
{
    return (SectionOptions){.kind = kind, .form = form, .harmonics = 8, .stiffness = form == SECTION_AS_PRINTED ? 0 : 1e-3, .voxel_mm = 1};
}

// --- Polygons ---

double polygon_area(int count, const SectionPoint *contour)
{
    double twice = 0;
    for (int i = 0, k = count - 1; i < count; k = i++)
        twice += (contour[k].n - contour[0].n) * (contour[i].b - contour[0].b) - (contour[i].n - contour[0].n) * (contour[k].b - contour[0].b);
    return 0.5 * twice;
}

SectionPoint polygon_centre(int count, const SectionPoint *contour)
{
    SectionPoint sum = {0, 0}, from = contour[0];
    double twice = 0;
    for (int i = 0, k = count - 1; i < count; k = i++) {
        double n0 = contour[k].n - from.n, b0 = contour[k].b - from.b, n1 = contour[i].n - from.n, b1 = contour[i].b - from.b, part = n0 * b1 - n1 * b0;
        twice += part;
        sum.n += part * (n0 + n1) / 3, sum.b += part * (b0 + b1) / 3;
    }
    return twice != 0 ? (SectionPoint){from.n + sum.n / twice, from.b + sum.b / twice} : from;
}

bool polygon_contains(int count, const SectionPoint *contour, double n, double b)
{
    bool inside = false;
    for (int i = 0, k = count - 1; i < count; k = i++) {
        const SectionPoint *p = &contour[k], *q = &contour[i];
        if ((p->b > b) != (q->b > b) && n < p->n + (b - p->b) / (q->b - p->b) * (q->n - p->n))
            inside = !inside;
    }
    return inside;
}

void polygon_smooth(int count, const SectionPoint *contour, double tension, int steps, SectionPoint *curve)
{
    SEL_ASSERT(count >= 3 && steps >= 1, "a closed contour has three points");
    for (int i = 0; i < count; i++) {
        const SectionPoint *p0 = &contour[(i + count - 1) % count], *p1 = &contour[i], *p2 = &contour[(i + 1) % count], *p3 = &contour[(i + 2) % count];
        for (int s = 0; s < steps; s++) {
            double u = (double)s / steps, u2 = u * u, u3 = u2 * u, t = tension;
            double w0 = -t * u + 2 * t * u2 - t * u3, w1 = 1 + (t - 3) * u2 + (2 - t) * u3, w2 = t * u + (3 - 2 * t) * u2 + (t - 2) * u3, w3 = -t * u2 + t * u3;
            curve[i * steps + s] = (SectionPoint){w0 * p0->n + w1 * p1->n + w2 * p2->n + w3 * p3->n, w0 * p0->b + w1 * p1->b + w2 * p2->b + w3 * p3->b};
        }
    }
}

// --- Small systems of equations ---

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

// --- Sections ---

Section *section_allocate(SectionKind kind, size_t values, double radius)
{
    Section *section = calloc(1, sizeof *section + values * sizeof section->values[0]);
    if (section) {
        section->kind = kind;
        section->radius = radius;
    }
    return section;
}

static double mean_radius(int count, const SectionPoint *contour)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += same_hypot(contour[i].n, contour[i].b);
    return sum / count;
}

static bool options_are_valid(const SectionOptions *o)
{
    return o->harmonics >= 0 && o->harmonics <= 16 && o->stiffness >= 0 && o->stiffness < 1e6 && o->delta_mm >= 0 && o->delta_mm < 1e3 && o->voxel_mm > 0 &&
           o->voxel_mm < 1e3;
}

Section *section_create(const SectionOptions *options, int count, const SectionPoint *contour)
{
    static Section *(*const create[SECTION_KINDS])(const SectionOptions *, int, const SectionPoint *, double) = {section_polar_create, section_raster_create,
                                                                                                                 section_rbf_create, section_pas_create};
    if ((unsigned)options->kind >= SECTION_KINDS || !options_are_valid(options) || count < 3 || count > CONTOUR_MOST)
        return NULL;
    for (int i = 0; i < count; i++)
        if (!(fabs(contour[i].n) < 1e6 && fabs(contour[i].b) < 1e6))
            return NULL;
    double area = polygon_area(count, contour), radius = mean_radius(count, contour);
    if (!(fabs(area) > 1e-9 * radius * radius))
        return NULL;
    SectionPoint *turned = malloc((size_t)count * sizeof *turned);
    if (!turned)
        return NULL;
    for (int i = 0; i < count; i++)
        turned[i] = contour[area > 0 ? i : count - 1 - i];
    Section *section = create[options->kind](options, count, turned, radius);
    free(turned);
    return section;
}

void section_free(Section *section) { free(section); }

SectionJet section_evaluate(const Section *section, double n, double b) { return section->evaluate(section, n, b); }

int section_numbers(const Section *section) { return section->numbers; }

// The place between `in` (C > 0) and `out` (C <= 0) on a ray where C changes its sign.
static double crossing(const Section *section, double n0, double b0, double c, double s, double in, double out)
{
    for (int i = 0; i < 60 && out - in > 1e-13 * section->radius; i++) {
        double middle = 0.5 * (in + out);
        if (section_evaluate(section, n0 + middle * c, b0 + middle * s).value > 0)
            in = middle;
        else
            out = middle;
    }
    return 0.5 * (in + out);
}

int section_radii(const Section *section, double n0, double b0, int count, double *radius)
{
    enum { STEPS = 64 };
    if (!(section_evaluate(section, n0, b0).value > 0))
        return -1;
    int more = 0;
    double longest = 3 * section->radius + same_hypot(n0, b0);
    for (int i = 0; i < count; i++) {
        double c = same_cos(2 * PI * i / count), s = same_sin(2 * PI * i / count), found = longest;
        bool inside = true;
        int met = 0;
        for (int k = 1; k <= STEPS; k++) {
            double r = longest * k / STEPS;
            bool now = section_evaluate(section, n0 + r * c, b0 + r * s).value > 0;
            if (inside && !now)
                met++, found = crossing(section, n0, b0, c, s, longest * (k - 1) / STEPS, r);
            inside = now;
        }
        radius[i] = found;
        more += met > 1;
    }
    return more;
}

// --- Polar ---
// Least squares for the Fourier terms at the contour's points, with k^4 as a slight penalty, so that few points determine many terms.

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

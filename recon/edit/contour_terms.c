// See contour_terms.h and sweep_edit.h. Moments of the star R(theta): area A = int R^2/2, centre = int R^3/3 (cos, sin) / A, second moments M about it from
// int R^4/4 (cos, sin)(cos, sin)'. The ellipse (x - centre)' M^-1 (x - centre) <= 4 has the same centre and moments; it is scaled to the area.
#include "recon/edit/contour_terms.h"

#include "recon/fit/band_matrix.h"

#include <stdlib.h>
#include <string.h>

enum { ANGLES = 128, FINE = 16 };

static void fill_factors(double theta, double factor[SWEEP_TERMS])
{
    factor[0] = 1;
    for (int k = 1; k <= SWEEP_HARMONICS; k++)
        factor[2 * k - 1] = same_cos(k * theta), factor[2 * k] = same_sin(k * theta);
}

bool terms_are_open(const double term[SWEEP_TERMS])
{
    for (int i = 0; i < ANGLES; i++)
        if (!(sweep_terms_radius(term, 2 * PI * i / ANGLES) > 0.05 * term[0]))
            return false;
    return term[0] > 0;
}

// Angles and radii of a counter-clockwise polygon, in order. False if the angles do not increase once around.
static bool unwind(int count, const SectionPoint *p, double *theta, double *rho)
{
    double turn = 0;
    for (int i = 0; i < count; i++) {
        const SectionPoint *a = &p[i], *b = &p[(i + 1) % count];
        double step = same_atan2(a->n * b->b - a->b * b->n, a->n * b->n + a->b * b->b);
        theta[i] = same_atan2(a->b, a->n), rho[i] = same_hypot(a->n, a->b);
        if (!(step > 0))
            return false;
        turn += step;
    }
    return fabs(turn - 2 * PI) < 1e-6;
}

static double around(double angle) { return angle - 2 * PI * floor(angle / (2 * PI)); }

// Weighted normal equations; band_matrix holds their lower half.
static bool solve_terms(int count, const double *theta, const double *rho, double term[SWEEP_TERMS])
{
    double a[SWEEP_TERMS * SWEEP_TERMS] = {0}, factor[SWEEP_TERMS];
    memset(term, 0, SWEEP_TERMS * sizeof *term);
    for (int i = 0; i < count; i++) {
        double gap = around(theta[(i + 1) % count] - theta[(i + count - 1) % count]);
        fill_factors(theta[i], factor);
        for (int j = 0; j < SWEEP_TERMS; j++) {
            term[j] += gap * factor[j] * rho[i];
            for (int k = j; k < SWEEP_TERMS; k++)
                a[j * SWEEP_TERMS + k - j] += gap * factor[j] * factor[k];
        }
    }
    if (!band_factor(a, SWEEP_TERMS, SWEEP_TERMS - 1))
        return false;
    band_solve(a, SWEEP_TERMS, SWEEP_TERMS - 1, term);
    return true;
}

static bool is_dense(int count, const SectionPoint *p)
{
    for (int i = 0; i < count; i++) {
        const SectionPoint *a = &p[i], *b = &p[(i + 1) % count];
        if (fabs(same_atan2(a->n * b->b - a->b * b->n, a->n * b->n + a->b * b->b)) > 2 * PI / 24 * (1 + 1e-6))
            return false;
    }
    return true;
}

// The contour, counter-clockwise. NULL if out of memory.
static SectionPoint *turn_left(int count, const Vec3 *point)
{
    SectionPoint *p = calloc((size_t)count, sizeof *p);
    for (int i = 0; p && i < count; i++)
        p[i] = (SectionPoint){point[i].x, point[i].y};
    if (p && polygon_area(count, p) < 0)
        for (int i = 0; i < count / 2; i++) {
            SectionPoint kept = p[i];
            p[i] = p[count - 1 - i], p[count - 1 - i] = kept;
        }
    return p;
}

// FINE points for each, on the cubic Hermite curve rho(theta) whose slopes are those of the parabolas through three neighbours.
static void refine(int count, const double *theta, const double *rho, double *fine_theta, double *fine_rho)
{
    for (int i = 0; i < count; i++) {
        int at[4] = {(i + count - 1) % count, i, (i + 1) % count, (i + 2) % count};
        double h[3], rise[3];
        for (int k = 0; k < 3; k++)
            h[k] = around(theta[at[k + 1]] - theta[at[k]]), rise[k] = (rho[at[k + 1]] - rho[at[k]]) / h[k];
        double from = (h[1] * rise[0] + h[0] * rise[1]) / (h[0] + h[1]), to = (h[2] * rise[1] + h[1] * rise[2]) / (h[1] + h[2]);
        for (int k = 0; k < FINE; k++) {
            double x = (double)k / FINE, y = 1 - x;
            fine_theta[i * FINE + k] = theta[i] + x * h[1];
            fine_rho[i * FINE + k] = y * y * (1 + 2 * x) * rho[i] + x * x * (1 + 2 * y) * rho[at[2]] + h[1] * x * y * (y * from - x * to);
        }
    }
}

const char *contour_terms(int count, const Vec3 *point, double term[SWEEP_TERMS], double *misfit)
{
    SEL_ASSERT(count >= 3, "a contour has three points or more");
    size_t n = (size_t)count;
    SectionPoint *p = turn_left(count, point);
    double *memory = p ? calloc(n * 2 * (1 + FINE), sizeof *memory) : NULL, *theta = memory, *rho = memory + n;
    const char *wrong = NULL;
    if (!memory)
        wrong = "the contour needs more memory than is available";
    else if (!polygon_contains(count, p, 0, 0))
        wrong = "the contour does not go around the branch's curve; expected a closed curve around n = 0, b = 0";
    else if (!unwind(count, p, theta, rho))
        wrong = "the contour is not star-shaped about the branch's curve: a ray from the curve meets it more than once; expected one point in each direction";
    else if (!is_dense(count, p)) {
        refine(count, theta, rho, memory + 2 * n, memory + 2 * n + n * FINE);
        theta = memory + 2 * n, rho = theta + n * FINE, count *= FINE;
    }
    if (!wrong && (!solve_terms(count, theta, rho, term) || !terms_are_open(term)))
        wrong = "the contour has a notch or a spike too sharp for 8 harmonics, or comes too close to the branch's curve; expected a smoother one";
    *misfit = 0;
    for (int i = 0; !wrong && i < count; i++)
        *misfit = fmax(*misfit, fabs(sweep_terms_radius(term, theta[i]) - rho[i]));
    free(p);
    free(memory);
    return wrong;
}

// --- smoothing ---

// Terms of the ellipse with the area and moments of the section. False: there is none around the curve.
static bool ellipse_terms(const double term[SWEEP_TERMS], double ellipse[SWEEP_TERMS])
{
    double area = 0, cx = 0, cy = 0, xx = 0, xy = 0, yy = 0, radius[ANGLES];
    for (int i = 0; i < ANGLES; i++) {
        double theta = 2 * PI * i / ANGLES, r = sweep_terms_radius(term, theta), c = same_cos(theta), s = same_sin(theta);
        double r2 = r * r, r3 = r2 * r / 3, r4 = r2 * r2 / 4;
        area += r2 / 2, cx += r3 * c, cy += r3 * s, xx += r4 * c * c, xy += r4 * c * s, yy += r4 * s * s;
    }
    cx /= area, cy /= area;
    xx = xx / area - cx * cx, xy = xy / area - cx * cy, yy = yy / area - cy * cy;
    area *= 2 * PI / ANGLES;
    double det = xx * yy - xy * xy;
    if (!(det > 0))
        return false;
    // x' Q x <= 1 of the same area: Q = q M^-1, pi / sqrt(det Q) = area
    double q = PI / area * sqrt(det), a = q * yy / det, b = -q * xy / det, d = q * xx / det, centre = a * cx * cx + 2 * b * cx * cy + d * cy * cy;
    if (!(centre < 0.8))
        return false;
    for (int i = 0; i < ANGLES; i++) {
        double theta = 2 * PI * i / ANGLES, c = same_cos(theta), s = same_sin(theta), two = a * c * c + 2 * b * c * s + d * s * s,
               one = c * (a * cx + b * cy) + s * (b * cx + d * cy);
        radius[i] = (one + sqrt(one * one + two * (1 - centre))) / two;
    }
    sweep_terms_of_radii(ANGLES, radius, ellipse);
    return true;
}

void terms_smooth(double term[SWEEP_TERMS], bool ellipse, double strength)
{
    double target[SWEEP_TERMS] = {term[0]}, area = sweep_terms_area(term), waves = 0;
    SEL_ASSERT(strength >= 0 && strength <= 1, "smoothing goes from none to all");
    if (strength == 0 || (ellipse && !ellipse_terms(term, target)))
        return;
    for (int k = 1; k < SWEEP_TERMS; k++) {
        term[k] = (1 - strength) * term[k] + strength * target[k];
        waves += 0.5 * term[k] * term[k];
    }
    term[0] = sqrt(fmax(area / PI - waves, 0.25 * term[0] * term[0]));
}

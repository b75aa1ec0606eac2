// Piecewise algebraic sections, Hong et al. 2012, section 3: the inside of the contour, convolved with a kernel of piecewise polynomials,
//   P(X, Y) = integral over the inside of k((X - x)/delta) k((Y - y)/delta) / delta^2 dx dy,   k = H_3',   C = P - level.
// H_m (Hong et al., eq. 4): H_m(x) = ((1 + x/m) H_{m-1}(x + 1) + (1 - x/m) H_{m-1}(x - 1))/2, H_0 the step; H_3 is 0 below -3, 1 above 3, C2, and its
// derivative is the quadratic B-spline with knots -3, -1, 1, 3. By Green's theorem, counter-clockwise,
//   P = sum over the sides of integral H((x - X)/delta) k((Y - y)/delta) dy / delta.
// The sides are divided at the knots; on each part the integrand is a polynomial of degree 5 at most, for which three points of Gauss are exact.
//
// As printed the level is 0.5, which lies inside the contour by delta^2/(2 r) on a circle (m delta^2/(6 r)), and C is flat further than 3 delta from the contour:
// nothing says where the wall is. Mended: C = delta (H^-1(P) - H^-1(level)), the distance that a straight side would have, with the level for which the curve
// keeps the contour's area; where P leaves 0.02 ... 0.98, C changes to the contour's polar distance.
#include "geom/section_kinds.h"

enum { KNOTS = 4 };
static const double KNOT[KNOTS] = {-3, -1, 1, 3};
static const double FLAT = 0.02;     // P between FLAT and 1 - FLAT gives the distance
// values: [0] count, [1] delta, [2] level, [3] shift H^-1(level), [4] 1 as printed, [5], [6] centre; then the contour
enum { COUNT, DELTA, LEVEL, SHIFT, PRINTED, CENTRE_N, CENTRE_B, CONTOUR };

static double step(double x)
{
    double h[4];
    section_step(x, h);
    return h[0];
}

static double inverse_step(double p)
{
    double low = -3, high = 3;
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        if (step(middle) < p)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

// Adds a part of a side, from u to v of it, on which both arguments stay between knots.
static void add_part(const double from[2], const double along[2], double u, double v, double delta, SectionJet *jet)
{
    static const double PLACE[3] = {-0.77459666924148338, 0, 0.77459666924148338}, WEIGHT[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    double dy = along[1] * (v - u), f = 1 / delta;
    for (int g = 0; g < 3; g++) {
        double at = 0.5 * (u + v) + 0.5 * (v - u) * PLACE[g], x[4], y[4], w = WEIGHT[g] * dy;
        section_step(from[0] + at * along[0], x);
        section_step(-(from[1] + at * along[1]), y);         // (Y - y)/delta
        jet->value += w * x[0] * y[1];
        jet->n -= w * x[1] * y[1] * f, jet->b += w * x[0] * y[2] * f;
        jet->nn += w * x[2] * y[1] * f * f, jet->nb -= w * x[1] * y[2] * f * f, jet->bb += w * x[0] * y[3] * f * f;
    }
}

// P and its derivatives.
static SectionJet smoothed_inside(const double *v, double n, double b)
{
    SectionJet jet = {0};
    int count = (int)v[COUNT];
    double f = 1 / v[DELTA];
    for (int i = 0, k = count - 1; i < count; k = i++) {
        const double *p = v + CONTOUR + 2 * k, *q = v + CONTOUR + 2 * i;
        double from[2] = {(p[0] - n) * f, (p[1] - b) * f}, along[2] = {(q[0] - p[0]) * f, (q[1] - p[1]) * f};
        if (fmin(from[1], from[1] + along[1]) >= 3 || fmax(from[1], from[1] + along[1]) <= -3 || fmax(from[0], from[0] + along[0]) <= -3)
            continue;
        double cut[2 * KNOTS + 2] = {0};
        int cuts = 1;
        for (int axis = 0; axis < 2; axis++)
            for (int j = 0; j < KNOTS; j++) {
                double at = along[axis] != 0 ? (KNOT[j] - from[axis]) / along[axis] : -1;
                if (at > 0 && at < 1)
                    cut[cuts++] = at;
            }
        cut[cuts++] = 1;
        for (int j = 1; j < cuts - 1; j++)   // few: insertion
            for (int l = j; l > 1 && cut[l] < cut[l - 1]; l--) {
                double swap = cut[l];
                cut[l] = cut[l - 1], cut[l - 1] = swap;
            }
        for (int j = 0; j + 1 < cuts; j++)
            if (cut[j + 1] > cut[j])
                add_part(from, along, cut[j], cut[j + 1], v[DELTA], &jet);
    }
    return jet;
}

// The distance along the ray from the centre to the contour's outermost side, minus that to the point.
static SectionJet polar_distance(const double *v, double n, double b)
{
    int count = (int)v[COUNT];
    double x = n - v[CENTRE_N], y = b - v[CENTRE_B], rho = same_hypot(x, y), wall = 0;
    if (!(rho > 1e-9 * v[DELTA]))        // the centre itself: any ray
        x = rho = 1e-9 * v[DELTA], y = 0;
    double c = x / rho, s = y / rho;
    for (int i = 0, k = count - 1; i < count; k = i++) {
        const double *p = v + CONTOUR + 2 * k, *q = v + CONTOUR + 2 * i;
        double px = p[0] - v[CENTRE_N], py = p[1] - v[CENTRE_B], qx = q[0] - v[CENTRE_N], qy = q[1] - v[CENTRE_B];
        double before = c * py - s * px, after = c * qy - s * qx;
        if (before <= 0 && after > 0) {
            double u = before / (before - after);
            wall = fmax(wall, c * (px + u * (qx - px)) + s * (py + u * (qy - py)));
        }
    }
    return (SectionJet){.value = wall - rho, .n = -c, .b = -s, .nn = -s * s / rho, .nb = c * s / rho, .bb = -c * c / rho};
}

static SectionJet evaluate_pas(const Section *section, double n, double b)
{
    const double *v = section->values;
    SectionJet jet = smoothed_inside(v, n, b);
    if (v[PRINTED] > 0) {
        jet.value -= v[LEVEL];
        return jet;
    }
    if (!(jet.value > FLAT && jet.value < 1 - FLAT))
        return polar_distance(v, n, b);
    // d = delta H^-1(P): grad d = delta grad P / k, Hess d = delta (Hess P / k - k' grad P grad P' / k^3)
    double d = inverse_step(jet.value), h[4];
    section_step(d, h);
    double per = v[DELTA] / h[1], bend = v[DELTA] * h[2] / (h[1] * h[1] * h[1]);
    return (SectionJet){.value = v[DELTA] * (d - v[SHIFT]),
                        .n = per * jet.n,
                        .b = per * jet.b,
                        .nn = per * jet.nn - bend * jet.n * jet.n,
                        .nb = per * jet.nb - bend * jet.n * jet.b,
                        .bb = per * jet.bb - bend * jet.b * jet.b};
}

// The shift (in deltas) for which the curve keeps the contour's area: its area at the shift 0 and the length of the contour give it in three steps.
static void keep_area(Section *section, int count, const SectionPoint *contour)
{
    enum { RAYS = 96 };
    double *v = section->values, radius[RAYS], length = 0, area = polygon_area(count, contour);
    SectionPoint curve[RAYS];
    for (int i = 0, k = count - 1; i < count; k = i++)
        length += same_hypot(contour[i].n - contour[k].n, contour[i].b - contour[k].b);
    for (int round = 0; round < 3; round++) {
        if (section_radii(section, v[CENTRE_N], v[CENTRE_B], RAYS, radius) != 0)
            return;      // the curve has no polar form; it keeps the shift found so far
        for (int i = 0; i < RAYS; i++)
            curve[i] = (SectionPoint){radius[i] * same_cos(2 * PI * i / RAYS), radius[i] * same_sin(2 * PI * i / RAYS)};
        // the polygon of rays lies inside the curve, by the same share as a circle's does
        double found = polygon_area(RAYS, curve) * PI / (0.5 * RAYS * same_sin(2 * PI / RAYS));
        v[SHIFT] += (found - area) / (length * v[DELTA]);
        v[SHIFT] = fmin(fmax(v[SHIFT], -1), 1);
    }
    v[LEVEL] = step(v[SHIFT]);
}

Section *section_pas_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius)
{
    Section *section = section_allocate(SECTION_PAS, CONTOUR + 2 * (size_t)count, radius);
    if (!section)
        return NULL;
    double *v = section->values, share = options->form == SECTION_AS_PRINTED ? 0.8 * options->voxel_mm : 0.08 * radius;
    SectionPoint centre = polygon_centre(count, contour);
    v[COUNT] = count, v[LEVEL] = 0.5, v[PRINTED] = options->form == SECTION_AS_PRINTED;
    v[DELTA] = options->delta_mm > 0 ? options->delta_mm : share;
    v[CENTRE_N] = centre.n, v[CENTRE_B] = centre.b;
    for (int i = 0; i < count; i++)
        v[CONTOUR + 2 * i] = contour[i].n, v[CONTOUR + 2 * i + 1] = contour[i].b;
    section->numbers = 2 * count + 2;
    section->evaluate = evaluate_pas;
    if (options->form == SECTION_MENDED)
        keep_area(section, count, contour);
    return section;
}

// Piecewise algebraic sections, Hong et al. 2012, section 3: the inside of the contour, convolved with a kernel of piecewise polynomials,
//   P(X, Y) = integral over the inside of k((X - x)/delta) k((Y - y)/delta) / delta^2 dx dy,   k = H_3',   C = P - level.
// H_m (Hong et al., eq. 4): H_m(x) = ((1 + x/m) H_{m-1}(x + 1) + (1 - x/m) H_{m-1}(x - 1))/2, H_0 the step; H_3 is 0 below -3, 1 above 3, C2, and its
// derivative is the quadratic B-spline with knots -3, -1, 1, 3. By Green's theorem, counter-clockwise,
//   P = sum over the sides of integral H((x - X)/delta) k((Y - y)/delta) dy / delta.
// The sides are divided at the knots; on each part the integrand is a polynomial of degree 5 at most, for which three points of Gauss are exact.
//
// As printed the level is 0.5, which lies inside the contour by delta^2/(2 r) on a circle (m delta^2/(6 r)), and C is flat further than 3 delta from the contour:
// nothing says where the wall is. Mended: C = delta (H^-1(P) - H^-1(level)), the distance that a straight side would have, with the level for which the curve
// keeps the area of the smooth curve through the contour (Catmull-Rom, of which two chords a side are taken); where P leaves 0.02 ... 0.98, C changes to the distance from the contour.
#include "geom/section_kinds.h"

#include <string.h>

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
    // by symmetry about (0, 1/2) the lower half, which is convex: exact below -1, else Newton from the right of the root
    bool upper = p > 0.5;
    double share = upper ? 1 - p : p, x = share < 1.0 / 6 ? -3 + same_cbrt(48 * share) : -(0.5 - share) * 8 / 3, h[4];
    for (int i = 0; i < 8 && share >= 1.0 / 6; i++) {
        section_step(x, h);
        double change = h[1] > 0 ? (h[0] - share) / h[1] : 0;
        x -= change;
        if (fabs(change) < 1e-15)
            break;
    }
    return upper ? -x : x;
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

// The distance from the contour's nearest side [mm] > 0 inside, and its derivatives: around a corner, the lines of equal distance are arcs.
static SectionJet side_distance(const double *v, double n, double b)
{
    int count = (int)v[COUNT];
    double least2 = HUGE_VAL, x = 1, y = 0;
    bool at_corner = false, inside = polygon_contains(count, (const SectionPoint *)(v + CONTOUR), n, b);
    for (int i = 0, k = count - 1; i < count; k = i++) {
        const double *p = v + CONTOUR + 2 * k, *q = v + CONTOUR + 2 * i;
        double dn = q[0] - p[0], db = q[1] - p[1], square = dn * dn + db * db, u = square > 0 ? ((n - p[0]) * dn + (b - p[1]) * db) / square : 0;
        double share = u < 0 ? 0 : u > 1 ? 1 : u, en = n - p[0] - share * dn, eb = b - p[1] - share * db, far2 = en * en + eb * eb;
        if (far2 < least2)
            least2 = far2, x = en, y = eb, at_corner = share != u;
    }
    double d = sqrt(least2), side = inside ? 1 : -1, per = d > 0 ? 1 / d : 0, c = x * per, s = y * per, bend = at_corner ? side * per : 0;
    return (SectionJet){.value = side * d, .n = side * c, .b = side * s, .nn = bend * s * s, .nb = -bend * c * s, .bb = bend * c * c};
}

static SectionJet evaluate_pas(const Section *section, double n, double b)
{
    static const double REACH = 4.25;        // [delta] further from the contour than the corner of the kernel's square, P is 0 or 1
    const double *v = section->values;
    SectionJet jet, far;
    if (v[PRINTED] > 0) {
        jet = smoothed_inside(v, n, b);
        jet.value -= v[LEVEL];
        return jet;
    }
    far = side_distance(v, n, b);
    bool is_far = fabs(far.value) > REACH * v[DELTA];
    jet = is_far ? (SectionJet){.value = far.value > 0} : smoothed_inside(v, n, b);
    if (!(jet.value > FLAT && jet.value < 1 - FLAT)) {
        far.value -= v[DELTA] * v[SHIFT];
        return far;
    }
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

// Area of the Catmull-Rom curve through the contour, of which the contour is an inscribed polygon.
static double smooth_area(int count, const SectionPoint *contour)
{
    enum { STEPS = 8, AT_ONCE = 4 };
    double twice = 0;
    SectionPoint part[AT_ONCE], curve[AT_ONCE * STEPS], from = contour[0];
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < AT_ONCE; k++)
            part[k] = contour[(i + count - 1 + k) % count];
        polygon_smooth(AT_ONCE, part, 0.5, STEPS, curve);
        for (int k = STEPS; k < 2 * STEPS; k++)      // from point i to the next
            twice += (curve[k].n - from.n) * (curve[k + 1].b - from.b) - (curve[k + 1].n - from.n) * (curve[k].b - from.b);
    }
    return 0.5 * twice;
}

// The shift (in deltas) for which the curve keeps that area: its area at the shift 0 and the length of the contour give it in three steps.
static void keep_area(Section *section, int count, const SectionPoint *contour)
{
    enum { RAYS = 96, ROUNDS = 3, NEWTONS = 2 };
    double *v = section->values, radius[RAYS], length = 0, area = smooth_area(count, contour);
    SectionPoint curve[RAYS];
    for (int i = 0, k = count - 1; i < count; k = i++)
        length += same_hypot(contour[i].n - contour[k].n, contour[i].b - contour[k].b);
    if (section_radii(section, v[CENTRE_N], v[CENTRE_B], RAYS, radius) != 0)
        return;      // the curve has no polar form: the shift stays 0
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < RAYS; i++) {
            double c = same_cos(2 * PI * i / RAYS), s = same_sin(2 * PI * i / RAYS);
            for (int k = 0; k < NEWTONS && round > 0; k++) {
                SectionJet jet = section_evaluate(section, v[CENTRE_N] + radius[i] * c, v[CENTRE_B] + radius[i] * s);
                radius[i] -= jet.value / fmin(c * jet.n + s * jet.b, -0.1);
            }
            curve[i] = (SectionPoint){radius[i] * c, radius[i] * s};
        }
        // the polygon of rays lies inside the curve, by the same share as a circle's does
        double found = polygon_area(RAYS, curve) * PI / (0.5 * RAYS * same_sin(2 * PI / RAYS));
        v[SHIFT] += (found - area) / (length * v[DELTA]);
        v[SHIFT] = fmin(fmax(v[SHIFT], -1), 1);
    }
    v[LEVEL] = step(v[SHIFT]);
}

Section *section_pas_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius)
{
    enum { STEPS = 2 };
    bool printed = options->form == SECTION_AS_PRINTED;
    int sides = printed ? count : STEPS * count;
    Section *section = section_allocate(SECTION_PAS, CONTOUR + 2 * (size_t)sides, radius);
    if (!section)
        return NULL;
    double *v = section->values, share = printed ? 0.8 * options->voxel_mm : 0.05 * radius;
    SectionPoint centre = polygon_centre(count, contour);
    v[COUNT] = sides, v[LEVEL] = 0.5, v[PRINTED] = printed;
    v[DELTA] = options->delta_mm > 0 ? options->delta_mm : share;
    v[CENTRE_N] = centre.n, v[CENTRE_B] = centre.b;
    if (printed)
        memcpy(v + CONTOUR, contour, (size_t)count * sizeof *contour);
    else
        polygon_smooth(count, contour, 0.5, STEPS, (SectionPoint *)(v + CONTOUR));
    section->numbers = 2 * count + 2;
    section->evaluate = evaluate_pas;
    section->is_distance = !printed;
    if (!printed)
        keep_area(section, count, contour);
    return section;
}

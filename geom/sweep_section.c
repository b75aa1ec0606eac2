// Integrals around the contour: between two of its points it is the cubic over the chord with the contour's tangents. With the chord's length L and the angles a
// and b by which the curve turns from its first tangent to the chord and from the chord to its second tangent,
//   length L (1 + (2 a^2 + a b + 2 b^2)/30),   area beside the chord L^2 (a + b)/12,
// exact to the fourth order. N and B are taken as perpendicular unit vectors, which they are except for terms of fourth order in the interval between knots.
//   mean = 1/(2 pi) integral of rho d(angle): each part of a ray counts by the sense in which the contour crosses it, so that parts outside the lumen cancel.
#include "geom/sweep_section.h"

enum { WAYS = 180 };         // directions of diameters

// The extreme value of a parabola through three neighbouring values at equal distances.
static double extreme(double before, double at, double after)
{
    double bend = before - 2 * at + after, slope = 0.5 * (after - before);
    return bend != 0 ? at - 0.5 * slope * slope / bend : at;
}

static double angle_between(double an, double ab, double bn, double bb)
{
    double angle = same_atan2(an * bb - ab * bn, an * bn + ab * bb);
    return fmax(-1, fmin(1, angle));     // at a corner the cubic is none
}

static void add_span(const SweepContour *c, int i, SweepSection *out)
{
    int k = (i + 1) % c->count;
    SectionPoint p = c->point[i], q = c->point[k];
    double n = q.n - p.n, b = q.b - p.b, length = same_hypot(n, b);
    double first = angle_between(c->way[i].n, c->way[i].b, n, b), second = angle_between(n, b, c->way[k].n, c->way[k].b), bulge = (first + second) / 12;
    out->perimeter += length * (1 + (2 * first * first + first * second + 2 * second * second) / 30);
    out->area += 0.5 * (p.n * q.b - p.b * q.n) + length * length * bulge;
    // Simpson; the middle of the cubic lies L (a + b)/8 beside that of the chord, to the right of the lumen
    double angle = same_atan2(p.n * q.b - p.b * q.n, p.n * q.n + p.b * q.b);
    SectionPoint m = {0.5 * (p.n + q.n) + 1.5 * bulge * b, 0.5 * (p.b + q.b) - 1.5 * bulge * n};
    out->mean += angle / (2 * PI) * (same_hypot(p.n, p.b) + 4 * same_hypot(m.n, m.b) + same_hypot(q.n, q.b)) / 6;
}

static void find_radii(const SweepContour *c, SweepSection *out)
{
    out->least = HUGE_VAL;
    for (int i = 0; i < c->count; i++) {
        const SectionPoint *p = &c->point[(i + c->count - 1) % c->count], *q = &c->point[i], *r = &c->point[(i + 1) % c->count];
        double before = same_hypot(p->n, p->b), at = same_hypot(q->n, q->b), after = same_hypot(r->n, r->b);
        if (at <= before && at <= after)
            out->least = fmin(out->least, extreme(before, at, after));
        if (at >= before && at >= after)
            out->largest = fmax(out->largest, extreme(before, at, after));
    }
}

// The furthest that the contour reaches in a direction.
static double support(const SweepContour *c, double n, double b)
{
    int best = 0;
    double most = -HUGE_VAL;
    for (int i = 0; i < c->count; i++) {
        double s = n * c->point[i].n + b * c->point[i].b;
        if (s > most)
            most = s, best = i;
    }
    const SectionPoint *p = &c->point[(best + c->count - 1) % c->count], *q = &c->point[(best + 1) % c->count];
    return extreme(n * p->n + b * p->b, most, n * q->n + b * q->b);
}

static void find_diameters(const SweepContour *c, SweepSection *out)
{
    double width[WAYS];
    for (int i = 0; i < WAYS; i++) {
        double n = same_cos(PI * i / WAYS), b = same_sin(PI * i / WAYS);
        width[i] = support(c, n, b) + support(c, -n, -b);
    }
    out->least_diameter = HUGE_VAL;
    for (int i = 0; i < WAYS; i++) {
        double before = width[(i + WAYS - 1) % WAYS], at = width[i], after = width[(i + 1) % WAYS];
        if (at <= before && at <= after)
            out->least_diameter = fmin(out->least_diameter, extreme(before, at, after));
        if (at >= before && at >= after)
            out->largest_diameter = fmax(out->largest_diameter, extreme(before, at, after));
    }
}

bool sweep_section_of(const SweepContour *contour, SweepSection *out)
{
    *out = (SweepSection){.kind = contour->kind};
    if (contour->count == 0)
        return false;
    for (int i = 0; i < contour->count; i++)
        add_span(contour, i, out);
    find_radii(contour, out);
    find_diameters(contour, out);
    out->circularity = 4 * PI * out->area / (out->perimeter * out->perimeter);
    return true;
}

bool sweep_section_at(const SweepField *field, int branch, double t, SweepSection *out)
{
    SweepContour contour;
    SweepPlane plane = sweep_plane(field, branch, t);
    bool good = sweep_contour_create(field, branch, t, SWEEP_CONTOUR, &contour) && sweep_section_of(&contour, out);
    if (!good)
        *out = (SweepSection){0};
    out->branch = branch, out->t = t, out->centre = plane.s, out->normal = plane.normal;
    sweep_contour_free(&contour);
    return good;
}

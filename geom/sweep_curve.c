// The curve of a branch, see sweep_curve.h.
//
// Natural spline: with M_i = S''(t_i), h_i = t_(i+1) - t_i and M_0 = M_last = 0,
//   h_(i-1) M_(i-1) + 2 (h_(i-1) + h_i) M_i + h_i M_(i+1) = 6 ((S_(i+1) - S_i) / h_i - (S_i - S_(i-1)) / h_(i-1)).
// Frames: Wang, Jüttler, Zheng, Liu 2008, Computation of rotation minimizing frames: double reflection, an error of fourth order in the step.
#include "geom/sweep_curve.h"

#include <stdlib.h>

enum { FRAME_STEPS = 8 };    // reflections between two knots

static Vec3 polynomial(const Vec3 c[4], double x) { return vec3_add_scaled(c[0], x, vec3_add_scaled(c[1], x, vec3_add_scaled(c[2], x, c[3]))); }
static Vec3 slope(const Vec3 c[4], double x) { return vec3_add_scaled(c[1], x, vec3_add_scaled(vec3_scale(c[2], 2), 3 * x, c[3])); }
static Vec3 bend(const Vec3 c[4], double x) { return vec3_add_scaled(vec3_scale(c[2], 2), 6 * x, c[3]); }

// Solves for M_i (in s[2] of the interval that begins at knot i, interval i + 1), and fills S.
static void fill_spline(SweepCurve *c, const Vec3 *knot)
{
    int last = c->knot_count - 1;
    SweepInterval *at = c->interval + 1;     // at[i] begins at knot i; at[last] lies beyond the curve
    const double *t = c->knot_t;
    at[0].s[2] = at[last].s[2] = vec3(0, 0, 0);
    at[0].origin = 0;                        // the factor of M_(i+1) after elimination, until the intervals are filled
    for (int i = 1; i < last; i++) {
        double before = t[i] - t[i - 1], after = t[i + 1] - t[i];
        Vec3 turn = vec3_sub(vec3_scale(vec3_sub(knot[i + 1], knot[i]), 1 / after), vec3_scale(vec3_sub(knot[i], knot[i - 1]), 1 / before));
        double pivot = 2 * (before + after) - before * at[i - 1].origin;
        at[i].origin = after / pivot;
        at[i].s[2] = vec3_scale(vec3_add_scaled(vec3_scale(turn, 6), -before, at[i - 1].s[2]), 1 / pivot);
    }
    for (int i = last - 1; i > 0; i--)
        at[i].s[2] = vec3_add_scaled(at[i].s[2], -at[i].origin, at[i + 1].s[2]);
    for (int i = 0; i < last; i++) {
        double h = t[i + 1] - t[i];
        Vec3 m0 = at[i].s[2], m1 = at[i + 1].s[2], chord = vec3_scale(vec3_sub(knot[i + 1], knot[i]), 1 / h);
        at[i].s[0] = knot[i];
        at[i].s[1] = vec3_add_scaled(chord, -h / 6, vec3_add_scaled(m1, 2, m0));
        at[i].s[2] = vec3_scale(m0, 0.5);
        at[i].s[3] = vec3_scale(vec3_sub(m1, m0), 1 / (6 * h));
        at[i].origin = at[i].from = t[i];
        at[i].to = t[i + 1];
    }
}

// The next frame's N: reflected in the plane between the two points, then in the plane between the reflected and the new tangent.
static Vec3 carry_normal(Vec3 n, Vec3 from, Vec3 tangent_from, Vec3 to, Vec3 tangent_to)
{
    Vec3 chord = vec3_sub(to, from);
    double c = vec3_norm2(chord);
    if (!(c > 0))
        return n;
    Vec3 n1 = vec3_add_scaled(n, -2 * vec3_dot(chord, n) / c, chord), t1 = vec3_add_scaled(tangent_from, -2 * vec3_dot(chord, tangent_from) / c, chord);
    Vec3 turn = vec3_sub(tangent_to, t1);
    double c2 = vec3_norm2(turn);
    return c2 > 0 ? vec3_add_scaled(n1, -2 * vec3_dot(turn, n1) / c2, turn) : n1;
}

// N' or B' of a frame that does not rotate about the curve.
static Vec3 frame_slope(Vec3 n, Vec3 s1, Vec3 s2) { return vec3_scale(s1, -vec3_dot(s2, n) / vec3_norm2(s1)); }

static void fill_hermite(Vec3 c[4], Vec3 from, Vec3 slope_from, Vec3 to, Vec3 slope_to, double h)
{
    Vec3 chord = vec3_scale(vec3_sub(to, from), 1 / h);
    c[0] = from;
    c[1] = slope_from;
    c[2] = vec3_scale(vec3_sub(vec3_sub(vec3_scale(chord, 3), vec3_scale(slope_from, 2)), slope_to), 1 / h);
    c[3] = vec3_scale(vec3_add_scaled(vec3_add(slope_from, slope_to), -2, chord), 1 / (h * h));
}

static void fill_frames(SweepCurve *c)
{
    int last = c->knot_count - 1;
    SweepInterval *at = c->interval + 1;
    Vec3 tangent = vec3_unit(at[0].s[1]), n = vec3_normal_to(tangent), b = vec3_cross(tangent, n);
    for (int i = 0; i < last; i++) {
        double h = at[i].to - at[i].from;
        Vec3 n0 = n, b0 = b, here = at[i].s[0];
        for (int k = 1; k <= FRAME_STEPS; k++) {
            double x = h * k / FRAME_STEPS;
            Vec3 next = polynomial(at[i].s, x), next_tangent = vec3_unit_or(slope(at[i].s, x), tangent);
            n = carry_normal(n, here, tangent, next, next_tangent);
            here = next, tangent = next_tangent;
            // reflections keep length and angles except for rounding
            n = vec3_unit(vec3_add_scaled(n, -vec3_dot(n, tangent), tangent));
        }
        b = vec3_cross(tangent, n);
        Vec3 s1 = at[i].s[1], s2 = vec3_scale(at[i].s[2], 2), end1 = slope(at[i].s, h), end2 = bend(at[i].s, h);
        fill_hermite(at[i].n, n0, frame_slope(n0, s1, s2), n, frame_slope(n, end1, end2), h);
        fill_hermite(at[i].b, b0, frame_slope(b0, s1, s2), b, frame_slope(b, end1, end2), h);
    }
}

// The straight lines before and beyond the curve.
static void fill_ends(SweepCurve *c)
{
    int last = c->knot_count - 1;
    const SweepInterval *first = &c->interval[1], *end = &c->interval[last];
    Vec3 none = {0, 0, 0};
    double h = end->to - end->from;
    c->interval[0] = (SweepInterval){0, -HUGE_VAL, 0, {first->s[0], first->s[1], none, none}, {first->n[0], none, none, none}, {first->b[0], none, none, none}};
    c->interval[last + 1] = (SweepInterval){c->length,
                                            c->length,
                                            HUGE_VAL,
                                            {polynomial(end->s, h), slope(end->s, h), none, none},
                                            {polynomial(end->n, h), none, none, none},
                                            {polynomial(end->b, h), none, none, none}};
}

SweepCurve *sweep_curve_create(int knot_count, const Vec3 *knot)
{
    SEL_ASSERT(knot_count >= 2 && knot_count < (1 << 28), "a curve has two knots or more");
    SweepCurve *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->knot_count = knot_count;
    c->knot_t = calloc((size_t)knot_count, sizeof *c->knot_t);
    c->interval = calloc((size_t)knot_count + 1, sizeof *c->interval);
    if (!c->knot_t || !c->interval) {
        sweep_curve_free(c);
        return NULL;
    }
    for (int i = 1; i < knot_count; i++) {
        c->knot_t[i] = c->knot_t[i - 1] + vec3_distance(knot[i], knot[i - 1]);
        SEL_ASSERT(c->knot_t[i] > c->knot_t[i - 1], "consecutive knots are apart");
    }
    c->length = c->knot_t[knot_count - 1];
    fill_spline(c, knot);
    fill_frames(c);
    fill_ends(c);
    return c;
}

void sweep_curve_free(SweepCurve *curve)
{
    if (!curve)
        return;
    free(curve->knot_t);
    free(curve->interval);
    free(curve);
}

int sweep_curve_interval(const SweepCurve *c, double t)
{
    int low = 0, high = c->knot_count;       // the interval is one of low … high
    while (low < high) {
        int middle = (low + high) / 2;
        if (t < c->interval[middle].to)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

SweepJet sweep_interval_at(const SweepInterval *i, double t)
{
    double x = t - i->origin;
    return (SweepJet){.s = polynomial(i->s, x),
                      .s1 = slope(i->s, x),
                      .s2 = bend(i->s, x),
                      .s3 = vec3_scale(i->s[3], 6),
                      .n = polynomial(i->n, x),
                      .n1 = slope(i->n, x),
                      .n2 = bend(i->n, x),
                      .b = polynomial(i->b, x),
                      .b1 = slope(i->b, x),
                      .b2 = bend(i->b, x)};
}

SweepJet sweep_curve_at(const SweepCurve *curve, double t) { return sweep_interval_at(&curve->interval[sweep_curve_interval(curve, t)], t); }

double sweep_curve_project(const SweepCurve *c, Vec3 x, double from, double longest)
{
    enum { ROUNDS = 60 };
    SEL_ASSERT(longest > 0 && !isnan(from), "a step has a bound, and the start is a number");
    // Newton converges by squares: after a step this small, only rounding is left
    double t = from, far2 = HUGE_VAL, least = 1e-9 * longest, step = 0;
    for (int round = 0; round < ROUNDS; round++) {
        const SweepInterval *i = &c->interval[sweep_curve_interval(c, t)];
        double at = t - i->origin;
        Vec3 u = vec3_sub(x, polynomial(i->s, at));
        double now2 = vec3_norm2(u);
        // close to the foot, rounding hides whether the distance decreases
        if (now2 > far2 * (1 + SWEEP_ROUNDING) && fabs(step) > 1e-6 * longest) {
            step *= 0.5;
            t -= step;
            continue;
        }
        Vec3 s1 = slope(i->s, at);
        double speed2 = vec3_norm2(s1), d = speed2 - vec3_dot(u, bend(i->s, at));
        far2 = now2;
        step = vec3_dot(u, s1) / fmax(d, SWEEP_LEAST_D * speed2);
        step = fmax(-longest, fmin(longest, step));
        t += step;
        if (fabs(step) <= least)
            break;
    }
    return t;
}

double sweep_curve_nearest(const SweepCurve *c, Vec3 x, double longest)
{
    double best = HUGE_VAL, start = 0;
    for (int k = 1; k < c->knot_count; k++) {
        Vec3 from = c->interval[k].s[0], chord = vec3_sub(c->interval[k + 1].s[0], from);
        double part = fmax(0, fmin(1, vec3_dot(vec3_sub(x, from), chord) / vec3_norm2(chord)));
        double far2 = vec3_norm2(vec3_sub(x, vec3_add_scaled(from, part, chord)));
        if (far2 < best)
            best = far2, start = c->interval[k].from + part * (c->interval[k].to - c->interval[k].from);
    }
    return sweep_curve_project(c, x, start, longest);
}

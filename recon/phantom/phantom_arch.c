// Aortic arches with the anatomical variants of their branches: the shape `arch`.
//
// Types and figures are those of the arches of stEVE (L. Karstensen et al., github.com/lkarstensen/stEVE, MIT; eve/intervention/vesseltree/aorticarch.py and
// aorticarcharteries, read in 2026): I the usual three branches; II the left carotid artery from the brachiocephalic trunk; IV the right subclavian artery by
// itself, both carotid arteries from a common trunk; V the right subclavian artery behind the left one (lusoria), with or without a trunk of the carotid
// arteries; VI one trunk for the carotid and one for the subclavian arteries; VII four separate branches.
//
// An artery is a cubic Hermite curve through two or more points, over the length of its chords. Each figure of a point is normally distributed: place, direction
// (then made as long as `speed`), diameter and its slope. Then the whole is stretched: across and along the body by 0.7 to 1.3, evenly distributed, and all
// diameters by one factor. The random numbers are ours, so a seed gives another arch than in stEVE. x to the patient's left, y to the back, z to the head.
#include "recon/phantom/phantom_parts.h"

#include <string.h>

enum { SPANS = 3, STEPS = 16, FINE = 64, LEFT_RIGHT = 1, HEAD = 2 };

typedef struct Knot {            // mean and standard deviation of a point of a curve
    double at[3], at_sd[3];      // [mm] from the artery's start
    double toward[3], toward_sd[3];
    double speed[2];             // length of the curve's derivative, mean and standard deviation
    double width[2];             // diameter [mm]; after the first point: its change
    double taper[2];             // slope of the diameter
} Knot;

typedef struct Artery {
    int fixed;                   // LEFT_RIGHT: the end's x is a place in the body, not a distance from the start; HEAD: so is its z
    bool goes_on, as_wide;       // it starts in the direction in which its parent ends, about which it varies; with its parent's width and taper
    int count;
    Knot knot[SPANS + 1];
} Artery;

typedef struct Curve {           // x, y, z and diameter at the points, and their derivatives
    int count;
    double at[SPANS + 1], value[SPANS + 1][4], slope[SPANS + 1][4];
} Curve;

#define NONE                                                                                                                                                   \
    {                                                                                                                                                          \
        0, 0, 0                                                                                                                                                \
    }
#define NO_TAPER                                                                                                                                               \
    {                                                                                                                                                          \
        0, 0                                                                                                                                                   \
    }
static const Artery aorta = {.count = 4,
                             .knot = {{NONE, NONE, {0, 0, 1}, {0.1, 0, 0.3}, {1, 0.1}, {17, 1}, {0.02, 0.005}},
                                      {{30, 0, 90}, {2, 1, 3}, {1, 0, 2}, {0.4, 0.3, 0.2}, {1.2, 0.15}, {3, 0.7}, {0.02, 0.005}},
                                      {{20, -40, 160}, {1.5, 3, 2}, {-4, -6, -0.5}, {0.8, 1, 0.7}, {1.4, 0.15}, {4, 0.7}, {0.07, 0.008}},
                                      {{-5, -60, 100}, {1, 2, 1}, {3, 4, -8}, {0.3, 0.3, 0.5}, {1.6, 0.15}, {5, 0.7}, NO_TAPER}}};
static const Artery brachiocephalic = {.count = 2,
                                       .knot = {{NONE, NONE, {0, 0.1, 1}, {0.1, 0.1, 0}, {2, 0.1}, {17, 1}, NO_TAPER},
                                                {{-20, 5, 45}, {3, 2, 3}, {-0.3, 0.3, 0.7}, {0.1, 0.1, 0.3}, {0.8, 0.1}, {-7, 0.7}, {-0.1, 0.033}}}};
static const Artery common_trunk = {.count = 2,
                                    .knot = {{NONE, NONE, {0, 0.6, 1}, {0.2, 0.2, 0.3}, {1, 0.1}, {22, 1}, NO_TAPER},
                                             {{5, 5, 25}, {1.5, 1.5, 3}, {-0.3, 0.3, 0.7}, {0.3, 0.2, 0.3}, {0.8, 0.1}, {-10, 0.7}, {-0.1, 0.033}}}};
static const Artery left_carotid = {.count = 2,
                                    .fixed = HEAD,
                                    .knot = {{NONE, NONE, {0.3, 0, 1}, {0.2, 0.2, 0}, {1.5, 0.2}, {10, 0.33}, NO_TAPER},
                                             {{2, 8, 230}, {1, 3, 0}, {0, 0, 1}, {0.2, 0.3, 0}, {1.5, 0.2}, {-0.5, 0.2}, NO_TAPER}}};
static const Artery left_carotid_of_trunk = {.count = 2,
                                             .fixed = HEAD,
                                             .knot = {{NONE, NONE, {0.6, 0, 1}, {0.2, 0.3, 0.3}, {1.5, 0.2}, {10, 0.33}, NO_TAPER},
                                                      {{25, 8, 230}, {1, 3, 0}, {0, 0, 1}, {0.2, 0.3, 0}, {1.5, 0.2}, {-0.5, 0.2}, NO_TAPER}}};
static const Artery right_carotid = {.count = 2,
                                     .fixed = HEAD,
                                     .knot = {{NONE, NONE, {0.2, 0, 1}, {0.2, 0.2, 0.3}, {1.5, 0.2}, {10, 0.33}, NO_TAPER},
                                              {{0, 0, 230}, {2, 2, 0}, {0, 0, 1}, {0.1, 0.1, 0}, {1.5, 0.2}, {-1, 0.33}, NO_TAPER}}};
static const Artery right_carotid_going_on = {.count = 2,
                                              .fixed = HEAD,
                                              .goes_on = true,
                                              .knot = {{NONE, NONE, NONE, {0.1, 0.2, 0.3}, {1.5, 0.2}, {10, 0.33}, NO_TAPER},
                                                       {{0, 0, 230}, {2, 2, 0}, {0, 0, 1}, {0.1, 0.1, 0}, {1.5, 0.2}, {-1, 0.33}, NO_TAPER}}};
static const Artery right_carotid_of_aorta = {.count = 2,
                                              .fixed = HEAD,
                                              .knot = {{NONE, NONE, {0.2, 0, 1}, {0.2, 0.2, 0}, {1.5, 0.2}, {10, 0.33}, NO_TAPER},
                                                       {{-10, 0, 230}, {2, 2, 0}, {-0.2, 0, 1}, {0.1, 0.1, 0}, {1.5, 0.2}, {-1, 0.33}, NO_TAPER}}};
// a subclavian artery from the aorta, and one that goes on from a trunk
#define FROM_AORTA                                                                                                                                             \
    {                                                                                                                                                          \
        NONE, NONE, {0.1, 0.1, 2}, {0.1, 0.1, 0.3}, {2, 0.4}, {10, 0.33}, NO_TAPER                                                                             \
    }
#define FROM_TRUNK                                                                                                                                             \
    {                                                                                                                                                          \
        NONE, NONE, NONE, NONE, {1.5, 0.2}, {0, 0}, NO_TAPER                                                                                                   \
    }
static const Artery right_subclavian = {.count = 2,
                                        .fixed = LEFT_RIGHT,
                                        .goes_on = true,
                                        .as_wide = true,
                                        .knot = {FROM_TRUNK, {{-57, 35, 25}, {0, 2, 1}, {-1.2, 0, 0}, {0.3, 0.2, 0.1}, {1.5, 0.2}, {0, 0}, NO_TAPER}}};
static const Artery right_subclavian_of_trunk = {
    .count = 2,
    .fixed = LEFT_RIGHT,
    .goes_on = true,
    .as_wide = true,
    .knot = {FROM_TRUNK, {{-57, 15, 20}, {0, 2, 1}, {-0.6, 0, -0.1}, {0.1, 0.2, 0.1}, {1.5, 0.2}, {0, 0}, NO_TAPER}}};
static const Artery right_subclavian_of_aorta = {
    .count = 2, .fixed = LEFT_RIGHT, .knot = {FROM_AORTA, {{-57, 2, 50}, {0, 2, 1}, {-1.2, 0, 0}, {0.3, 0.2, 0.1}, {1.5, 0.2}, {0, 0}, NO_TAPER}}};
static const Artery right_subclavian_behind = {
    .count = 2, .fixed = LEFT_RIGHT, .knot = {FROM_AORTA, {{-57, 2, 42}, {0, 2, 1}, {-1.2, -2.5, 0}, {0.3, 0.2, 0.1}, {1.5, 0.2}, {0, 0}, NO_TAPER}}};
static const Artery left_subclavian = {
    .count = 2, .fixed = LEFT_RIGHT, .knot = {FROM_AORTA, {{59, 5, 50}, {0, 2, 2}, {1, 0.3, 0}, {0.2, 0.07, 0.15}, {1.7, 0.4}, {-1, 0.33}, {-0.1, 0.03}}}};
static const Artery left_subclavian_low = {
    .count = 2, .fixed = LEFT_RIGHT, .knot = {FROM_AORTA, {{59, 5, 40}, {0, 2, 2}, {1, 0.3, 0}, {0.2, 0.07, 0.15}, {1.7, 0.4}, {-1, 0.33}, {-0.1, 0.03}}}};
static const Artery left_subclavian_of_trunk = {
    .count = 2, .fixed = LEFT_RIGHT, .knot = {FROM_AORTA, {{59, 15, 20}, {0, 2, 2}, {1, 0.3, -0.1}, {0.2, 0.07, 0.15}, {1.7, 0.4}, {-1, 0.33}, {-0.1, 0.03}}}};

typedef struct Growth {
    Shape *shape;
    const ArchOptions *options;
    Random random;
    double stretch[3];           // of x, y, z
    double back_mm;              // distance of the last branch's origin from the heart's end of the aorta
    Curve trunk;                 // the aorta
} Growth;

static double drawn(Growth *g, double mean, double sd)
{
    double normal = random_normal(&g->random);   // also where sd is 0: then all later numbers are the same
    return mean + g->options->spread * sd * normal;
}

static void curve_at(const Curve *c, double t, double value[4], double slope[4])
{
    int i = 0;
    while (i + 2 < c->count && t > c->at[i + 1])
        i++;
    double h = c->at[i + 1] - c->at[i], u = (t - c->at[i]) / h, v = 1 - u;
    for (int k = 0; k < 4; k++) {
        double a = c->value[i][k], b = c->value[i + 1][k], p = h * c->slope[i][k], q = h * c->slope[i + 1][k];
        value[k] = a * v * v * (1 + 2 * u) + b * u * u * (1 + 2 * v) + p * u * v * v - q * u * u * v;
        slope[k] = (6 * u * v * (b - a) + p * v * (1 - 3 * u) + q * u * (u * 3 - 2)) / h;
    }
}

static double distance(const double a[4], const double b[4]) { return vec3_distance(vec3(a[0], a[1], a[2]), vec3(b[0], b[1], b[2])); }

static double curve_length(const Curve *c)
{
    double length = 0, here[4], before[4], slope[4];
    for (int i = 0; i <= SPANS * FINE; i++, memcpy(before, here, sizeof here)) {
        curve_at(c, c->at[c->count - 1] * i / (SPANS * FINE), here, slope);
        length += i ? distance(here, before) : 0;
    }
    return length;
}

// The point of the curve at this distance from its start, or from its end if that is negative.
static void curve_point(const Curve *c, double way_mm, double point[4])
{
    double whole = curve_length(c), left = fmin(fmax(way_mm < 0 ? whole + way_mm : way_mm, 0), whole), before[4], slope[4];
    curve_at(c, 0, before, slope);
    memcpy(point, before, sizeof before);
    for (int i = 1; i <= SPANS * FINE && left > 0; i++, memcpy(before, point, sizeof before)) {
        curve_at(c, c->at[c->count - 1] * i / (SPANS * FINE), point, slope);
        left -= distance(point, before);
    }
}

// Draws the curve of an artery from `start`; `parent`: the curve at whose end it may go on.
static Curve draw(Growth *g, const Artery *artery, const double start[4], const Curve *parent)
{
    Curve c = {.count = artery->count};
    double direction[3] = {0, 0, 0}, width = 0, taper = 0;
    if (artery->goes_on)
        memcpy(direction, parent->slope[parent->count - 1], sizeof direction);
    if (artery->as_wide)
        width = parent->value[parent->count - 1][3], taper = parent->slope[parent->count - 1][3];
    for (int i = 0; i < c.count; i++) {
        const Knot *knot = &artery->knot[i];
        double norm = 0;
        for (int k = 0; k < 3; k++) {
            bool is_fixed = i > 0 && artery->fixed & (k == 0 ? LEFT_RIGHT : k == 2 ? HEAD : 0);
            c.value[i][k] = drawn(g, knot->at[k], knot->at_sd[k]) + (is_fixed ? 0 : start[k]);
        }
        for (int k = 0; k < 3; k++) {
            c.slope[i][k] = drawn(g, direction[k] + knot->toward[k], knot->toward_sd[k]);
            norm += same_square(c.slope[i][k]);
            direction[k] = 0;
        }
        double speed = drawn(g, knot->speed[0], knot->speed[1]);
        for (int k = 0; k < 3; k++)
            c.slope[i][k] *= speed / sqrt(norm);
        c.value[i][3] = width = width + drawn(g, knot->width[0], knot->width[1]);
        c.slope[i][3] = taper + drawn(g, knot->taper[0], knot->taper[1]);
        taper = 0;
        c.at[i] = i ? c.at[i - 1] + distance(c.value[i], c.value[i - 1]) : 0;
    }
    return c;
}

// Adds the curve to the shape as a part, stretched.
static bool add(Growth *g, const Curve *c, bool is_open, int parent)
{
    double knot[SPANS * STEPS + 1][4], end[2][4], value[4], slope[4];
    int count = (c->count - 1) * STEPS + 1;
    for (int i = 0; i < count; i++) {
        int span = i / STEPS < c->count - 1 ? i / STEPS : c->count - 2;
        curve_at(c, c->at[span] + (c->at[span + 1] - c->at[span]) * (i - span * STEPS) / STEPS, value, slope);
        double norm = 0;
        for (int k = 0; k < 3; k++) {
            knot[i][k] = g->stretch[k] * value[k];
            norm += same_square(g->stretch[k] * slope[k]);
        }
        double width = 0.5 * g->options->diameter_scale;
        knot[i][3] = width * value[3];
        if (i == 0 || i == count - 1)
            for (int k = 0; k < 4; k++)
                end[i > 0][k] = (k < 3 ? g->stretch[k] : width) * slope[k] / sqrt(norm);
    }
    return shape_add(g->shape, (const double(*)[4])knot, count, is_open, false, parent, NODE_VESSEL, (const double(*)[4])end);
}

// Draws and adds an artery. Its part is the shape's last.
static bool grow(Growth *g, const Artery *artery, const double start[4], const Curve *parent, int parent_part, Curve *drawn_curve)
{
    *drawn_curve = draw(g, artery, start, parent);
    return add(g, drawn_curve, parent_part < 0, parent_part);
}

// The same for a branch of the aorta, this much further from the heart than the branch before.
static bool branch(Growth *g, const Artery *artery, double mean_mm, double sd_mm, Curve *curve)
{
    double start[4];
    g->back_mm += drawn(g, mean_mm, sd_mm);
    curve_point(&g->trunk, -g->back_mm, start);
    return grow(g, artery, start, NULL, 0, curve);
}

// The same for an artery from the end of the last branch of the aorta.
static bool fork(Growth *g, const Artery *artery, const Curve *parent, int parent_part)
{
    Curve c;
    return grow(g, artery, parent->value[parent->count - 1], parent, parent_part, &c);
}

// Type V without a trunk of the carotid arteries, and type VII, have no trunk at all.
static bool grow_type(Growth *g)
{
    Curve c, trunk, other;
    bool has_trunk = random_unit(&g->random) < 0.5;
    switch (g->options->type) {
    case 1:
        return branch(g, &brachiocephalic, 36, 5, &trunk) && fork(g, &right_subclavian, &trunk, 1) && fork(g, &right_carotid, &trunk, 1) &&
               branch(g, &left_carotid, 16, 4, &c) && branch(g, &left_subclavian, 28, 3, &c);
    case 2: {
        if (!branch(g, &brachiocephalic, 36, 3, &trunk) || !fork(g, &right_subclavian, &trunk, 1) || !fork(g, &right_carotid, &trunk, 1))
            return false;
        double start[4], length = curve_length(&trunk);
        curve_point(&trunk, fabs(drawn(g, 2 * length / 3, length / 10)), start);
        return grow(g, &left_carotid_of_trunk, start, NULL, 1, &c) && branch(g, &left_subclavian, 41, 2.5, &c);
    }
    case 4:
        return branch(g, &right_subclavian_of_aorta, 42, 5, &c) && branch(g, &common_trunk, 20, 4, &trunk) && fork(g, &right_carotid, &trunk, 2) &&
               fork(g, &left_carotid_of_trunk, &trunk, 2) && branch(g, &left_subclavian_low, 38, 3, &c);
    case 5:
        if (has_trunk)
            return branch(g, &brachiocephalic, 36, 3, &trunk) && fork(g, &right_carotid_going_on, &trunk, 1) && fork(g, &left_carotid_of_trunk, &trunk, 1) &&
                   branch(g, &left_subclavian, 41, 2.5, &c) && branch(g, &right_subclavian_behind, 20, 1, &c);
        return branch(g, &right_carotid_of_aorta, 50, 2.5, &c) && branch(g, &left_carotid, 22, 3, &c) && branch(g, &left_subclavian, 26, 2.5, &c) &&
               branch(g, &right_subclavian_behind, 20, 1, &c);
    case 6:
        return branch(g, &brachiocephalic, 36, 3, &trunk) && fork(g, &right_carotid_going_on, &trunk, 1) && fork(g, &left_carotid_of_trunk, &trunk, 1) &&
               branch(g, &common_trunk, 50, 1.5, &other) && fork(g, &right_subclavian_of_trunk, &other, 4) && fork(g, &left_subclavian_of_trunk, &other, 4);
    default:
        return branch(g, &right_subclavian_of_aorta, 38, 3.5, &c) && branch(g, &right_carotid_of_aorta, 20, 3, &c) && branch(g, &left_carotid, 20, 3, &c) &&
               branch(g, &left_subclavian, 27, 3, &c);
    }
}

bool arch_grow(Shape *shape, const ArchOptions *options)
{
    Growth g = {.shape = shape, .options = options, .random = {options->seed}};
    double across = random_unit(&g.random), along = random_unit(&g.random);
    g.stretch[0] = g.stretch[1] = 1 + 0.3 * options->spread * (2 * across - 1);
    g.stretch[2] = 1 + 0.3 * options->spread * (2 * along - 1);
    return grow(&g, &aorta, (const double[4]){0, 0, 0, 0}, NULL, -1, &g.trunk) && grow_type(&g);
}

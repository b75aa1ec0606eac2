// Synthetic vessels. A part is the union of spheres of radius r(t) along a curve C(t), both cubic splines of arc length (chord length at the
// knots), straight beyond open ends:
//   f_part(X) = max_t r(t) - |X - C(t)|      exact signed distance of the swept surface (outside everywhere, inside up to the medial axis)
// A part and the part it grows from are joined by the cubic smooth maximum of width k (C2):
//   smax(a, b) = max(a, b) + (k/6) h^3, h = max(0, 1 - |a - b| / k)
// and the shape is the plain maximum over parts and joints: kissing parts do not blend. Union and blend keep |grad f| <= 1, so that f may
// be marched along (it never oversteps the surface).
#include "recon/phantom.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KNOTS = 64, PARTS = 8, BLOCK = 8 };

typedef struct Spline {      // one coordinate: value and second derivative at each knot
    double value[KNOTS], bend[KNOTS];
} Spline;

typedef struct Part {
    int knot_count;
    double at[KNOTS];        // knot parameter [mm of chord]
    Spline coordinate[4];    // x, y, z, r
    bool open_start, open_end;   // straight on beyond, instead of a cap
    double low, high;        // parameter range with the straight pieces
    int parent;              // part it grows from, or -1
    uint8_t kind;            // of its nodes
    int sample_count;        // coarse samples to start the search from …
    Vec3 *sample;
    double *sample_radius, *sample_at;
    int block_count;         // … and spheres around each BLOCK of them
    Vec3 *block_center;
    int *block_sample;       // the middle one, its radius and parameter
    double *block_radius, *block_at;
    double *block_reach;     // largest |C - center| + r in the block: f <= reach - |X - center|
} Part;

struct Shape {
    char name[32];
    int part_count;
    Part part[PARTS];
    double widest_joint;
    double blend;            // 0: 0.6 times the child's first radius
    int points, sac_points;
    double noise, spacing;
    uint64_t seed;
};

// --- Splines ---

// Cubic spline: tridiagonal system for the second derivatives; natural where an end's slope is NAN, else clamped to it.
static void spline_solve(Spline *s, const double *at, int n, double first_slope, double last_slope)
{
    double diagonal[KNOTS], upper[KNOTS], right[KNOTS];
    for (int i = 0; i < n; i++) {
        double h0 = i > 0 ? at[i] - at[i - 1] : 0, h1 = i < n - 1 ? at[i + 1] - at[i] : 0, lower = h0 / 6;
        double before = i > 0 ? (s->value[i] - s->value[i - 1]) / h0 : first_slope, after = i < n - 1 ? (s->value[i + 1] - s->value[i]) / h1 : last_slope;
        diagonal[i] = (h0 + h1) / 3;
        upper[i] = h1 / 6;
        right[i] = after - before;
        if ((i == 0 && isnan(first_slope)) || (i == n - 1 && isnan(last_slope)))
            diagonal[i] = 1, upper[i] = lower = right[i] = 0;
        if (i > 0) {
            double factor = lower / diagonal[i - 1];
            diagonal[i] -= factor * upper[i - 1];
            right[i] -= factor * right[i - 1];
        }
    }
    for (int i = n - 1; i >= 0; i--)
        s->bend[i] = (right[i] - (i < n - 1 ? upper[i] * s->bend[i + 1] : 0)) / diagonal[i];
}

// Value and first derivative; linear beyond the ends.
static double spline_at(const Spline *s, const double *at, int n, int i, double t, double *slope)
{
    double h = at[i + 1] - at[i], u = t < at[0] ? at[0] : t > at[n - 1] ? at[n - 1] : t;
    double a = (at[i + 1] - u) / h, b = (u - at[i]) / h;
    double d = (s->value[i + 1] - s->value[i]) / h - (3 * a * a - 1) / 6 * h * s->bend[i] + (3 * b * b - 1) / 6 * h * s->bend[i + 1];
    *slope = d;
    return a * s->value[i] + b * s->value[i + 1] + ((a * a * a - a) * s->bend[i] + (b * b * b - b) * s->bend[i + 1]) * h * h / 6 + (t - u) * d;
}

typedef struct Station {     // of a part at parameter t
    Vec3 center, tangent;    // tangent is dC/dt, nearly unit
    double radius, taper;    // taper is dr/dt; radius is constant beyond open ends
} Station;

static Station part_at(const Part *part, double t)
{
    int n = part->knot_count, i = 0;
    while (i < n - 2 && t > part->at[i + 1])
        i++;
    double v[4], d[4];
    for (int k = 0; k < 4; k++)
        v[k] = spline_at(&part->coordinate[k], part->at, n, i, t, &d[k]);
    if (t < part->at[0])
        v[3] = part->coordinate[3].value[0], d[3] = 0;
    else if (t > part->at[n - 1])
        v[3] = part->coordinate[3].value[n - 1], d[3] = 0;
    return (Station){{v[0], v[1], v[2]}, {d[0], d[1], d[2]}, v[3], d[3]};
}

// --- Parts ---

// `end_slope`: tangents (dx, dy, dz, dr per mm) at both ends, or NULL: natural.
static bool part_build(Part *part, const double (*knot)[4], int count, bool open_start, bool open_end, int parent, uint8_t kind,
                       const double (*end_slope)[4])
{
    *part = (Part){.knot_count = count, .open_start = open_start, .open_end = open_end, .parent = parent, .kind = kind};
    double least = HUGE_VAL;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < 4; k++)
            part->coordinate[k].value[i] = knot[i][k];
        Vec3 step = i > 0 ? vec3(knot[i][0] - knot[i - 1][0], knot[i][1] - knot[i - 1][1], knot[i][2] - knot[i - 1][2]) : vec3(0, 0, 0);
        part->at[i] = i > 0 ? part->at[i - 1] + vec3_norm(step) : 0;
        least = fmin(least, knot[i][3]);
    }
    for (int k = 0; k < 4; k++)
        spline_solve(&part->coordinate[k], part->at, count, end_slope ? end_slope[0][k] : NAN, end_slope ? end_slope[1][k] : NAN);
    part->low = open_start ? -6 * knot[0][3] : 0;
    part->high = part->at[count - 1] + (open_end ? 6 * knot[count - 1][3] : 0);
    double step = 0.2 * least;
    part->sample_count = (int)ceil((part->high - part->low) / step) + 1;
    part->block_count = (part->sample_count + BLOCK - 1) / BLOCK;
    size_t n = (size_t)part->sample_count, b = (size_t)part->block_count;
    part->sample = calloc(n, sizeof(Vec3));
    part->sample_radius = calloc(n, sizeof(double));
    part->sample_at = calloc(n, sizeof(double));
    part->block_center = calloc(b, sizeof(Vec3));
    part->block_reach = calloc(b, sizeof(double));
    part->block_sample = calloc(b, sizeof(int));
    part->block_radius = calloc(b, sizeof(double));
    part->block_at = calloc(b, sizeof(double));
    if (!part->block_sample || !part->block_radius || !part->block_at || !part->sample || !part->sample_radius || !part->sample_at || !part->block_center || !part->block_reach)
        return false;
    for (int i = 0; i < part->sample_count; i++) {
        double t = part->low + (part->high - part->low) * i / (part->sample_count - 1);
        Station s = part_at(part, t);
        part->sample_at[i] = t;
        part->sample[i] = s.center;
        part->sample_radius[i] = s.radius;
    }
    for (int k = 0; k < part->block_count; k++) {
        int first = k * BLOCK, last = first + BLOCK < part->sample_count ? first + BLOCK : part->sample_count;
        int middle = part->block_sample[k] = (first + last) / 2;
        part->block_center[k] = part->sample[middle];
        part->block_radius[k] = part->sample_radius[middle];
        part->block_at[k] = part->sample_at[middle];
        for (int i = first; i < last; i++)
            part->block_reach[k] = fmax(part->block_reach[k], vec3_distance(part->sample[i], part->block_center[k]) + part->sample_radius[i]);
    }
    return true;
}

static void part_free(Part *part)
{
    free(part->sample);
    free(part->sample_radius);
    free(part->sample_at);
    free(part->block_center);
    free(part->block_reach);
    free(part->block_sample);
    free(part->block_radius);
    free(part->block_at);
}

// d/dt of r(t) - |X - C(t)|
static double climb(const Part *part, Vec3 x, double t, double *value, Vec3 *away)
{
    Station s = part_at(part, t);
    Vec3 d = vec3_sub(x, s.center);
    double length = vec3_norm(d);
    *value = s.radius - length;
    *away = d;
    return length > 1e-12 ? s.taper + vec3_dot(d, s.tangent) / length : 0;
}

// f_part, its gradient and the parameter of the sphere that makes it. `enough`: parts whose f is below it may answer any lower bound.
// `cut`: without the straight pieces beyond open ends.
static double part_field(const Part *part, Vec3 x, double enough, bool cut, Vec3 *gradient, double *at)
{
    double lowest = cut ? 0 : part->low, highest = cut ? part->at[part->knot_count - 1] : part->high, best = -HUGE_VAL, step = part->sample_count > 1 ? part->sample_at[1] - part->sample_at[0] : 1;
    int nearest = 0;
    // the blocks' middle samples give a first best that rules out most blocks
    for (int k = 0; k < part->block_count; k++) {
        double f = part->block_radius[k] - vec3_distance(x, part->block_center[k]);
        if (f > best && part->block_at[k] >= lowest && part->block_at[k] <= highest)
            best = f, nearest = part->block_sample[k];
    }
    for (int k = 0; k < part->block_count; k++) {
        double ball = part->block_reach[k] - fmax(best, enough - step);
        if (ball <= 0 || vec3_norm2(vec3_sub(x, part->block_center[k])) >= ball * ball)
            continue;
        int last = (k + 1) * BLOCK < part->sample_count ? (k + 1) * BLOCK : part->sample_count;
        for (int i = k * BLOCK; i < last; i++) {
            if (part->sample_at[i] < lowest || part->sample_at[i] > highest)
                continue;
            double closer = part->sample_radius[i] - best;
            if (closer > 0 && vec3_norm2(vec3_sub(x, part->sample[i])) < closer * closer)
                best = part->sample_radius[i] - vec3_distance(x, part->sample[i]), nearest = i;
        }
    }
    if (best + step < enough) {
        *gradient = vec3(0, 0, 0);
        *at = 0;
        return enough - step;
    }
    // the maximum lies between the samples beside the best one: bisection with secant steps on the slope
    double low = part->sample_at[nearest > 0 ? nearest - 1 : 0];
    double high = part->sample_at[nearest < part->sample_count - 1 ? nearest + 1 : nearest], value, t = part->sample_at[nearest];
    Vec3 away;
    low = fmax(low, lowest);
    high = fmin(high, highest);
    double s_low = climb(part, x, low, &value, &away), s_high = climb(part, x, high, &value, &away);
    if (s_low <= 0)
        t = low;
    else if (s_high >= 0)
        t = high;
    else
        for (int i = 0; i < 80 && high - low > 1e-13 * (1 + fabs(high)); i++) {
            t = i % 3 == 2 ? 0.5 * (low + high) : low + (high - low) * s_low / (s_low - s_high);
            double s = climb(part, x, t, &value, &away);
            if (fabs(s) < 1e-9)   // the value's error is of second order
                break;
            if (s > 0)
                low = t, s_low = s;
            else
                high = t, s_high = s;
        }
    climb(part, x, t, &value, &away);
    *gradient = vec3_scale(vec3_unit_or(away, vec3(0, 0, 0)), -1);
    *at = t;
    return value;
}

// --- The field ---

static double joint_width(const Shape *shape, int child)
{
    return shape->blend > 0 ? shape->blend : 0.6 * shape->part[child].coordinate[3].value[0];
}

static double joined_field(const Shape *shape, Vec3 x, bool cut, Vec3 *gradient)
{
    double f[PARTS], best = -HUGE_VAL, at;
    Vec3 g[PARTS], best_gradient = {0, 0, 0};
    for (int p = 0; p < shape->part_count; p++) {
        // a part further below the best than the joints are wide cannot matter
        f[p] = part_field(&shape->part[p], x, best - shape->widest_joint, cut, &g[p], &at);
        if (f[p] > best)
            best = f[p], best_gradient = g[p];
    }
    for (int p = 0; p < shape->part_count; p++) {
        int parent = shape->part[p].parent;
        if (parent < 0)
            continue;
        double k = joint_width(shape, p), a = f[p], b = f[parent], h = 1 - fabs(a - b) / k;
        if (h <= 0)
            continue;
        double joined = fmax(a, b) + k / 6 * h * h * h, share = 0.5 * h * h;
        if (joined > best) {
            best = joined;
            best_gradient = a > b ? vec3_mix(g[p], g[parent], share) : vec3_mix(g[parent], g[p], share);
        }
    }
    if (gradient)
        *gradient = best_gradient;
    return best;
}

double shape_field(const Shape *shape, Vec3 x, Vec3 *gradient) { return joined_field(shape, x, false, gradient); }

double shape_field_cut(const Shape *shape, Vec3 x)
{
    double f = joined_field(shape, x, true, NULL);
    for (int p = 0; p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        for (int end = 0; end < 2; end++) {
            if (!(end ? part->open_end : part->open_start))
                continue;
            // the half sphere beyond the end, and nothing else, lies in this ball
            Station s = part_at(part, end ? part->at[part->knot_count - 1] : 0);
            Vec3 away = vec3_sub(x, s.center);
            if (vec3_norm(away) < 3 * s.radius)
                f = fmin(f, (end ? -1 : 1) * vec3_dot(away, vec3_unit(s.tangent)));
        }
    }
    return f;
}

double shape_distance(const Shape *shape, Vec3 x, Vec3 *foot)
{
    Vec3 p = x, g;
    double f = shape_field(shape, x, &g), sign = f < 0 ? -1 : 1, nearest = HUGE_VAL;
    Vec3 best = x;
    // alternate: fall onto the surface along the gradient, then slide towards the point nearest to x, by less once that overshoots
    double slide = 1;
    for (int round = 0; round < 200; round++) {
        for (int i = 0; i < 60; i++) {
            f = shape_field(shape, p, &g);
            double g2 = vec3_norm2(g);
            if (fabs(f) < 1e-12 || !(g2 > 1e-6))
                break;
            p = vec3_add_scaled(p, -f / g2, g);
        }
        double far = vec3_distance(p, x);
        if (far < nearest) {
            nearest = far;
            best = p;
        } else {
            slide *= 0.5;
            p = best;
            shape_field(shape, p, &g);
        }
        Vec3 n = vec3_unit_or(g, vec3(0, 0, 0)), away = vec3_sub(x, p), side = vec3_add_scaled(away, -vec3_dot(away, n), n);
        if (vec3_norm(side) < 1e-11 || slide < 1e-3)
            break;
        p = vec3_add_scaled(p, slide, side);
    }
    if (foot)
        *foot = best;
    return sign * nearest;
}

bool shape_beyond_open_end(const Shape *shape, Vec3 x)
{
    double best = -HUGE_VAL, at = 0;
    int which = 0;
    for (int p = 0; p < shape->part_count; p++) {
        Vec3 g;
        double t, f = part_field(&shape->part[p], x, -HUGE_VAL, false, &g, &t);
        if (f > best)
            best = f, which = p, at = t;
    }
    const Part *part = &shape->part[which];
    return (part->open_start && at < 0) || (part->open_end && at > part->at[part->knot_count - 1]);
}

void shape_bounds(const Shape *shape, Vec3 *low, Vec3 *high)
{
    *low = vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL);
    *high = vec3(-HUGE_VAL, -HUGE_VAL, -HUGE_VAL);
    for (int p = 0; p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        for (int i = 0; i < part->sample_count; i++) {
            if (part->sample_at[i] < 0 || part->sample_at[i] > part->at[part->knot_count - 1])
                continue;
            Vec3 c = part->sample[i];
            double r = 1.1 * part->sample_radius[i];
            *low = vec3(fmin(low->x, c.x - r), fmin(low->y, c.y - r), fmin(low->z, c.z - r));
            *high = vec3(fmax(high->x, c.x + r), fmax(high->y, c.y + r), fmax(high->z, c.z + r));
        }
    }
}

// --- The shapes ---

typedef struct ShapeOptions {
    double points, sac_points, noise_mm, seed, spacing, blend_mm, length_mm, radius_mm, bend_radius_mm, rise_mm, scale;
} ShapeOptions;

static bool build_capsule(Shape *shape, const ShapeOptions *o, bool open)
{
    double knot[5][4];
    for (int i = 0; i < 5; i++)
        memcpy(knot[i], (double[4]){o->length_mm * i / 4, 0, 0, o->radius_mm}, sizeof knot[i]);
    shape->part_count = 1;
    return part_build(&shape->part[0], (const double (*)[4])knot, 5, open, open, -1, NODE_VESSEL, NULL);
}

static bool build_arc(Shape *shape, const ShapeOptions *o)
{
    double knot[KNOTS][4];
    for (int i = 0; i < KNOTS; i++) {
        double angle = PI * i / (KNOTS - 1);
        memcpy(knot[i], (double[4]){o->bend_radius_mm * sin(angle), o->bend_radius_mm * (1 - cos(angle)), 0, o->radius_mm}, sizeof knot[i]);
    }
    shape->part_count = 1;
    const double tangent[2][4] = {{1, 0, 0, 0}, {-1, 0, 0, 0}};
    return part_build(&shape->part[0], (const double (*)[4])knot, KNOTS, true, true, -1, NODE_VESSEL, tangent);
}

// Two quarter arcs that leave the same point the same way and part to either side.
static bool build_bifurcation(Shape *shape, const ShapeOptions *o)
{
    enum { N = 33 };
    for (int side = 0; side < 2; side++) {
        double knot[N][4];
        for (int i = 0; i < N; i++) {
            double angle = PI / 2 * i / (N - 1), across = o->bend_radius_mm * (1 - cos(angle));
            memcpy(knot[i], (double[4]){o->bend_radius_mm * sin(angle), side ? -across : across, 0, o->radius_mm}, sizeof knot[i]);
        }
        const double tangent[2][4] = {{1, 0, 0, 0}, {0, side ? -1 : 1, 0, 0}};
        if (!part_build(&shape->part[side], (const double (*)[4])knot, N, true, true, side - 1, NODE_VESSEL, tangent))
            return false;
    }
    shape->part_count = 2;
    return true;
}

// Flat, or rising out of its plane at a nearly even slope: u grows with the length of the way but for 1 to 5 %.
static bool build_spiral(Shape *shape, const ShapeOptions *o)
{
    double knot[KNOTS][4], tangent[2][4];
    for (int i = 0; i < KNOTS; i++) {
        // knots crowd where the spiral winds tightly
        double u = (double)i / (KNOTS - 1), theta = PI * pow(4, u), polar = 15.75 / theta;
        double radius = 0.5 + (0.15 - 0.5) * (theta - PI) / (3 * PI);
        memcpy(knot[i], (double[4]){polar * cos(theta), polar * sin(theta), u * o->rise_mm, radius}, sizeof knot[i]);
    }
    for (int end = 0; end < 2; end++) {
        double theta = end ? 4 * PI : PI, polar = 15.75 / theta, z = o->rise_mm / (theta * log(4));
        double along = sqrt(polar * polar * (1 + 1 / (theta * theta)) + z * z);   // ds / dtheta
        double x = -polar / theta * cos(theta) - polar * sin(theta), y = -polar / theta * sin(theta) + polar * cos(theta);
        memcpy(tangent[end], (double[4]){x / along, y / along, z / along, (0.15 - 0.5) / (3 * PI) / along}, sizeof tangent[end]);
    }
    shape->part_count = 1;
    return part_build(&shape->part[0], (const double (*)[4])knot, KNOTS, true, false, -1, NODE_VESSEL, (const double (*)[4])tangent);
}

// An internal carotid with its siphon, going on as the middle cerebral artery; anterior cerebral artery; two branches each, of which the anterior
// ones kiss; a saccular aneurysm on the outer side of the siphon's anterior knee. x lateral, y anterior, z up [mm].
static bool build_phantom(Shape *shape)
{
    static const double carotid[][4] = {{0, 0, 0, 2.5},       {0, 0, 8, 2.45},      {0.4, 1.2, 15, 2.4},   {1.4, 6.2, 20.4, 2.3},
                                        {2.4, 12.6, 22.2, 2.3}, {3, 17.8, 25.4, 2.25}, {3.2, 18.6, 31, 2.2}, {3.8, 14.4, 35.2, 2.1},
                                        {5, 8.9, 36.6, 2.05}, {7, 5.9, 40.4, 1.9},  {10.4, 5.6, 44.6, 1.75}, {15.4, 6.6, 46.6, 1.5},
                                        {21, 7.6, 46.4, 1.4}, {26.6, 7, 48.2, 1.3}, {31.4, 5, 52, 1.15}};
    static const double anterior[][4] = {{9.3, 5.6, 43.4, 1.2}, {6.6, 6.4, 47.2, 1.2}, {3.2, 9.2, 50.4, 1.1}, {0.6, 12.2, 54, 1},
                                         {-0.8, 12.4, 59.4, 0.9}, {-0.6, 10, 64.4, 0.8}};
    static const double middle_1[][4] = {{21, 7.6, 46.4, 0.9}, {21.8, 9.4, 49.6, 0.85}, {21.6, 10.2, 54, 0.8}};
    static const double middle_2[][4] = {{26.6, 7, 48.2, 0.85}, {29.4, 8.2, 45.8, 0.8}, {33, 9, 45, 0.75}};
    static const double anterior_1[][4] = {{3.2, 9.2, 50.4, 0.8}, {4.9, 12, 52.2, 0.75}, {4.2, 15.6, 54.8, 0.75}, {1.5, 17.4, 57.8, 0.7}, {-0.4, 18.2, 60.2, 0.65}};
    static const double anterior_2[][4] = {{0.6, 12.2, 54, 0.72}, {-0.6, 14.6, 54.8, 0.69}, {-0.9, 16.4, 57.2, 0.66}, {0.6, 16.2, 60.6, 0.63},
                                           {1.6, 14.2, 63.8, 0.6}};
    static const double sac[][4] = {{3.1, 18.6, 28.2, 1.85}, {3.2, 20.6, 27.9, 1.9}, {3.3, 22.4, 27.7, 2.6}, {3.4, 24.2, 27.5, 3.35},
                                    {3.45, 25.2, 27.4, 3.5}};
#define PART(i, knots, open, parent, kind) part_build(&shape->part[i], knots, (int)(sizeof knots / sizeof knots[0]), open, false, parent, kind, NULL)
    shape->part_count = 7;
    return PART(0, carotid, true, -1, NODE_VESSEL) && PART(1, anterior, false, 0, NODE_VESSEL) && PART(2, middle_1, false, 0, NODE_VESSEL) &&
           PART(3, middle_2, false, 0, NODE_VESSEL) && PART(4, anterior_1, false, 1, NODE_VESSEL) &&
           PART(5, anterior_2, false, 1, NODE_VESSEL) && PART(6, sac, false, 0, NODE_ANEURYSM);
#undef PART
}

static const char *const names[] = {"capsule", "open-capsule", "arc", "bifurcation", "spiral", "phantom"};

const char *shape_names(void) { return "capsule, open-capsule, arc, bifurcation, spiral, phantom"; }

static bool parse_options(int count, const char (*option)[2][64], const char *file, ShapeOptions *out, Faults *faults)
{
    const struct {
        const char *key;
        double *value, least, most;
    } known[] = {{"points", &out->points, 8, 100000},         {"sac_points", &out->sac_points, 8, 100000}, {"noise_mm", &out->noise_mm, 0, 10},
                 {"seed", &out->seed, 0, 9007199254740992.0}, {"spacing", &out->spacing, 0.05, 4},          {"blend_mm", &out->blend_mm, 0, 3},
                 {"length_mm", &out->length_mm, 0.1, 1000},   {"radius_mm", &out->radius_mm, 0.05, 50},
                 {"bend_radius_mm", &out->bend_radius_mm, 0.1, 1000}, {"rise_mm", &out->rise_mm, 0, 100}, {"scale", &out->scale, 0.01, 100}};
    int before = faults->count;
    for (int i = 0; i < count; i++) {
        size_t k = 0, n = sizeof known / sizeof known[0];
        while (k < n && strcmp(option[i][0], known[k].key))
            k++;
        if (k == n) {
            faults_add(faults, file, 0, 0,
                       "a shape has no option '%s'; valid: points, sac_points, noise_mm, seed, spacing, blend_mm, length_mm, radius_mm, "
                       "bend_radius_mm, rise_mm, scale",
                       option[i][0]);
            continue;
        }
        char *end;
        double value = strtod(option[i][1], &end);
        if (end == option[i][1] || *end || !(value >= known[k].least && value <= known[k].most))
            faults_add(faults, file, 0, 0, "shape option %s is '%s'; valid: a number from %g to %g", known[k].key, option[i][1], known[k].least,
                       known[k].most);
        else
            *known[k].value = value;
    }
    if (out->bend_radius_mm <= 1.05 * out->radius_mm)
        faults_add(faults, file, 0, 0, "bend_radius_mm %g is not larger than the tube's radius_mm %g", out->bend_radius_mm, out->radius_mm);
    return faults->count == before;
}

Shape *shape_create(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults)
{
    ShapeOptions o = {.points = 108, .sac_points = 1500, .seed = 1, .spacing = 0.5, .length_mm = 4, .radius_mm = 1, .bend_radius_mm = 4, .scale = 1};
    size_t which = 0;
    while (which < sizeof names / sizeof names[0] && strcmp(name, names[which]))
        which++;
    if (which == sizeof names / sizeof names[0])
        faults_add(faults, file, 0, 0, "there is no shape '%s'; valid: %s", name, shape_names());
    if (!parse_options(option_count, option, file, &o, faults) || which == sizeof names / sizeof names[0])
        return NULL;
    Shape *shape = calloc(1, sizeof *shape);
    if (!shape) {
        faults_add(faults, file, 0, 0, "not enough memory for a shape");
        return NULL;
    }
    snprintf(shape->name, sizeof shape->name, "%s", name);
    shape->points = (int)o.points;
    shape->sac_points = (int)o.sac_points;
    shape->noise = o.noise_mm;
    shape->spacing = o.spacing;
    shape->seed = (uint64_t)o.seed;
    shape->blend = o.blend_mm;
    bool built = which == 0   ? build_capsule(shape, &o, false)
                 : which == 1 ? build_capsule(shape, &o, true)
                 : which == 2 ? build_arc(shape, &o)
                 : which == 3 ? build_bifurcation(shape, &o)
                 : which == 4 ? build_spiral(shape, &o)
                              : build_phantom(shape);
    for (int p = 0; built && o.scale != 1 && p < shape->part_count; p++) {
        Part old = shape->part[p];
        double knot[KNOTS][4], tangent[2][4];
        for (int i = 0; i < old.knot_count; i++)
            for (int k = 0; k < 4; k++)
                knot[i][k] = o.scale * old.coordinate[k].value[i];
        for (int k = 0; k < 4; k++) {   // slopes at the ends do not change
            spline_at(&old.coordinate[k], old.at, old.knot_count, 0, old.at[0], &tangent[0][k]);
            spline_at(&old.coordinate[k], old.at, old.knot_count, old.knot_count - 2, old.at[old.knot_count - 1], &tangent[1][k]);
        }
        part_free(&old);
        built = part_build(&shape->part[p], (const double (*)[4])knot, old.knot_count, old.open_start, old.open_end, old.parent, old.kind,
                           (const double (*)[4])tangent);
    }
    for (int p = 0; built && p < shape->part_count; p++)
        if (shape->part[p].parent >= 0)
            shape->widest_joint = fmax(shape->widest_joint, 1.01 * joint_width(shape, p));
    if (built)
        return shape;
    faults_add(faults, file, 0, 0, "not enough memory for shape %s", name);
    shape_free(shape);
    return NULL;
}

double shape_voxel_mm(const Shape *shape) { return fmax(0.05, 2 * shape->noise); }

double shape_options_voxel_mm(int option_count, const char (*option)[2][64])
{
    double noise = 0;
    for (int i = 0; i < option_count; i++)
        if (!strcmp(option[i][0], "noise_mm"))
            noise = strtod(option[i][1], NULL);
    return fmax(0.05, noise > 0 && noise <= 10 ? 2 * noise : 0);
}

void shape_free(Shape *shape)
{
    for (int p = 0; shape && p < PARTS; p++)
        part_free(&shape->part[p]);
    free(shape);
}

// --- Samples ---

// splitmix64
static uint64_t next_random(uint64_t *state)
{
    uint64_t z = *state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}
static double next_uniform(uint64_t *state) { return ((double)(next_random(state) >> 11) + 0.5) / 9007199254740992.0; }
static double next_normal(uint64_t *state)   // Box-Muller, one of the pair
{
    double a = next_uniform(state), b = next_uniform(state);
    return sqrt(-2 * log(a)) * cos(2 * PI * b);
}

// From a point inside out along unit d to the surface; false where it is further than `most`.
static bool march_out(const Shape *shape, Vec3 x, Vec3 d, double most, Vec3 *hit)
{
    double t = 0;
    for (int i = 0; i < 400 && t <= most; i++) {
        Vec3 p = vec3_add_scaled(x, t, d);
        double f = shape_field(shape, p, NULL);
        if (f < 1e-12) {
            *hit = p;
            return true;
        }
        t += f;
    }
    return false;
}

typedef struct Sampler {
    const Shape *shape;
    VesselTree *tree;        // points grow behind the nodes
    int64_t capacity;
    uint64_t state;
    bool failed;
} Sampler;

static void add_sample(Sampler *s, Vec3 p)
{
    VesselTree *tree = s->tree;
    if (s->shape->noise > 0) {
        Vec3 g;
        shape_field(s->shape, p, &g);
        p = vec3_add_scaled(p, s->shape->noise * next_normal(&s->state), vec3_unit_or(g, vec3(0, 0, 0)));
    }
    if (tree->point_count == s->capacity) {
        int64_t capacity = 2 * s->capacity + 1024;
        Vec3 *more = realloc(tree->point, (size_t)capacity * sizeof *more);
        if (!more) {
            s->failed = true;
            return;
        }
        tree->point = more;
        s->capacity = capacity;
    }
    tree->point[tree->point_count++] = p;
}

// Across the vessel, evenly over the cylinder's side; rays that leave into a branch or sac find the wall too late and are dropped.
static void sample_side(Sampler *s, const Part *part, double at, double height)
{
    double phase = 2 * PI * next_uniform(&s->state), last = part->at[part->knot_count - 1];
    int n = s->shape->points;
    for (int k = 0; k < n; k++) {
        double t = at + height * ((k + 0.5) / n - 0.5), angle = phase + k * PI * (3 - sqrt(5));
        if ((t < 0 && !part->open_start) || (t > last && !part->open_end))
            continue;
        Station station = part_at(part, t);
        Vec3 d = vec3_unit(station.tangent), e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1), hit;
        Vec3 out = vec3_add(vec3_scale(e1, cos(angle)), vec3_scale(e2, sin(angle)));
        if (march_out(s->shape, station.center, out, 1.4 * station.radius, &hit))
            add_sample(s, hit);
    }
}

static void sample_cap(Sampler *s, const Part *part, double at, double side)
{
    Station station = part_at(part, at);
    Vec3 d = vec3_scale(vec3_unit(station.tangent), side), e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1), hit;
    double phase = 2 * PI * next_uniform(&s->state);
    int n = s->shape->points / 2;
    for (int k = 0; k < n; k++) {
        double z = (k + 0.5) / n, ring = sqrt(1 - z * z), angle = phase + k * PI * (3 - sqrt(5));
        Vec3 out = vec3_add_scaled(vec3_add(vec3_scale(e1, ring * cos(angle)), vec3_scale(e2, ring * sin(angle))), z, d);
        if (march_out(s->shape, station.center, out, 1.4 * station.radius, &hit))
            add_sample(s, hit);
    }
}

// All round a sac's centre; what belongs to the parent's wall is left to the parent.
static void sample_sac(Sampler *s, const Part *part, double at)
{
    Station station = part_at(part, at);
    double phase = 2 * PI * next_uniform(&s->state);
    int n = s->shape->sac_points;
    for (int k = 0; k < n; k++) {
        double z = 1 - (2 * k + 1.0) / n, ring = sqrt(1 - z * z), angle = phase + k * PI * (3 - sqrt(5)), t;
        Vec3 hit, g;
        if (!march_out(s->shape, station.center, vec3(ring * cos(angle), ring * sin(angle), z), 4 * station.radius, &hit))
            continue;
        double own = part_field(part, hit, -HUGE_VAL, false, &g, &t), parent = part_field(&s->shape->part[part->parent], hit, -HUGE_VAL, false, &g, &t);
        if (own >= parent)
            add_sample(s, hit);
    }
}

// Parameters of a part's nodes: about `spacing` local radii apart; a branch starts at its mouth, a sac has one node at its widest.
static int place_nodes(const Shape *shape, int p, double *at, int capacity)
{
    const Part *part = &shape->part[p];
    double last = part->at[part->knot_count - 1], t = 0, total = 0;
    if (part->kind == NODE_ANEURYSM) {
        at[0] = last;
        return 1;
    }
    if (part->parent >= 0) {
        const Part *parent = &shape->part[part->parent];
        for (; t < last; t += 0.01 * part_at(part, t).radius) {
            Vec3 g;
            double u, inside = part_field(parent, part_at(part, t).center, -HUGE_VAL, false, &g, &u);
            if (inside < 0.1 * part_at(parent, u).radius)
                break;
        }
    }
    double first = t;
    for (double u = first; u < last; u += 0.001 * (last - first))
        total += 0.001 * (last - first) / part_at(part, u).radius;
    int count = (int)floor(total / shape->spacing + 0.5) + 1;
    count = count < 2 ? 2 : count > capacity ? capacity : count;
    double done = 0;
    int placed = 0;
    at[placed++] = first;
    for (double u = first; u < last && placed < count - 1; u += 0.001 * (last - first)) {
        done += 0.001 * (last - first) / part_at(part, u).radius;
        if (done >= total * placed / (count - 1))
            at[placed++] = u;
    }
    at[placed++] = last;
    return placed;
}

enum { NODES_PER_PART = 4000 };

VesselTree *shape_sample(const Shape *shape, Faults *faults)
{
    double (*at)[NODES_PER_PART] = calloc(PARTS, sizeof *at);
    int count[PARTS] = {0}, first[PARTS] = {0}, nodes = 0;
    for (int p = 0; at && p < shape->part_count; p++) {
        first[p] = nodes;
        nodes += count[p] = place_nodes(shape, p, at[p], NODES_PER_PART);
    }
    Sampler s = {.shape = shape, .tree = at ? vessel_tree_create(nodes, 0, 0) : NULL, .state = shape->seed};
    VesselTree *tree = s.tree;
    for (int p = 0; tree && p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        for (int k = 0; k < count[p]; k++) {
            int node = first[p] + k;
            Station station = part_at(part, at[p][k]);
            tree->center[node] = station.center;
            tree->radius[node] = station.radius;
            tree->direction[node] = vec3_unit(station.tangent);
            tree->height[node] = 2 * station.radius;
            tree->kind[node] = part->kind;
            tree->parent[node] = node - 1;
            if (k == 0 && part->parent >= 0) {   // the nearest node of the parent part
                int nearest = first[part->parent];
                for (int m = nearest; m < first[part->parent] + count[part->parent]; m++)
                    if (vec3_distance(tree->center[m], station.center) < vec3_distance(tree->center[nearest], station.center))
                        nearest = m;
                tree->parent[node] = nearest;
            }
            if (part->kind == NODE_ANEURYSM) {
                sample_sac(&s, part, at[p][k]);
            } else {
                sample_side(&s, part, at[p][k], 2 * station.radius);
                if (k == 0 && !part->open_start && part->parent < 0)
                    sample_cap(&s, part, at[p][k], -1);
                if (k == count[p] - 1 && !part->open_end)
                    sample_cap(&s, part, at[p][k], 1);
            }
            tree->point_offset[node + 1] = tree->point_count;
        }
    }
    free(at);
    if (!tree || s.failed || !vessel_tree_link(tree)) {
        faults_add(faults, shape->name, 0, 0, "not enough memory for %d nodes", nodes);
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

VesselTree *shape_tree(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults)
{
    Shape *shape = shape_create(name, option_count, option, file, faults);
    VesselTree *tree = shape ? shape_sample(shape, faults) : NULL;
    shape_free(shape);
    return tree;
}

// --- Volume ---

// Gaussian blur along one axis of stride `stride` and `n` voxels; beyond the border is background.
static void blur_line(float *value, int n, ptrdiff_t stride, const double *kernel, int reach, double *line)
{
    for (int i = 0; i < n; i++)
        line[i] = (double)value[i * stride];
    for (int i = 0; i < n; i++) {
        double sum = 0;
        for (int k = -reach; k <= reach; k++)
            if (i + k >= 0 && i + k < n)
                sum += kernel[abs(k)] * line[i + k];
        value[i * stride] = (float)sum;
    }
}

static bool blur_volume(Volume *volume, double sigma)
{
    int reach = (int)ceil(4 * sigma), longest = volume->size[0];
    for (int a = 1; a < 3; a++)
        longest = volume->size[a] > longest ? volume->size[a] : longest;
    double *kernel = calloc((size_t)reach + 1, sizeof *kernel), *line = calloc((size_t)longest, sizeof *line), sum = 0;
    if (kernel && line) {
        for (int k = 0; k <= reach; k++)   // integrated over the voxel
            sum += (k ? 2 : 1) * (kernel[k] = 0.5 * (erf((k + 0.5) / (sigma * sqrt(2))) - erf((k - 0.5) / (sigma * sqrt(2)))));
        for (int k = 0; k <= reach; k++)
            kernel[k] /= sum;
        ptrdiff_t stride[3] = {1, volume->size[0], (ptrdiff_t)volume->size[0] * volume->size[1]};
        for (int a = 0; a < 3; a++) {
            int b = (a + 1) % 3, c = (a + 2) % 3;
            for (int j = 0; j < volume->size[c]; j++)
                for (int i = 0; i < volume->size[b]; i++)
                    blur_line(volume->value + i * stride[b] + j * stride[c], volume->size[a], stride[a], kernel, reach, line);
        }
    }
    bool good = kernel && line;
    free(kernel);
    free(line);
    return good;
}

Volume *shape_volume(const Shape *shape, double voxel_mm, double psf_mm, double noise, uint64_t seed, Faults *faults)
{
    Vec3 low, high;
    shape_bounds(shape, &low, &high);
    double margin = 8 * voxel_mm + 3 * psf_mm;
    const double extent[3] = {high.x - low.x + 2 * margin, high.y - low.y + 2 * margin, high.z - low.z + 2 * margin};
    int size[3];
    double total = 1;
    for (int k = 0; k < 3; k++) {
        double n = ceil(extent[k] / voxel_mm) + 1;
        total *= n;
        size[k] = n < 1e6 ? (int)n : 0;
    }
    const Vec3 axis[3] = {{voxel_mm, 0, 0}, {0, voxel_mm, 0}, {0, 0, voxel_mm}};
    Volume *volume = total < 1e9 ? volume_create(size, vec3_sub(low, vec3(margin, margin, margin)), axis) : NULL;
    if (!volume) {
        faults_add(faults, shape->name, 0, 0, "a volume of %.3g voxels does not fit; use a larger voxel than %g mm", total, voxel_mm);
        return NULL;
    }
    enum { CELL = 8 };       // blocks that lie wholly in or out need one look: |grad f| <= 1
    for (int k0 = 0; k0 < size[2]; k0 += CELL)
        for (int j0 = 0; j0 < size[1]; j0 += CELL)
            for (int i0 = 0; i0 < size[0]; i0 += CELL) {
                double half = 0.5 * (CELL - 1);
                double f = shape_field(shape, volume_point_of(volume, vec3(i0 + half, j0 + half, k0 + half)), NULL);
                bool uniform = fabs(f) > (half + 1) * sqrt(3) * voxel_mm;
                for (int k = k0; k < k0 + CELL && k < size[2]; k++)
                    for (int j = j0; j < j0 + CELL && j < size[1]; j++)
                        for (int i = i0; i < i0 + CELL && i < size[0]; i++) {
                            double g = uniform ? f : shape_field(shape, volume_point_of(volume, vec3(i, j, k)), NULL);
                            volume->value[(size_t)i + (size_t)size[0] * ((size_t)j + (size_t)size[1] * (size_t)k)] =
                                (float)fmin(1, fmax(0, 0.5 + g / voxel_mm));
                        }
            }
    bool good = psf_mm <= 0 || blur_volume(volume, psf_mm / voxel_mm);
    size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    if (noise > 0)
        for (size_t i = 0; i < count; i++)
            volume->value[i] += (float)(noise * next_normal(&seed));
    volume->minimum = HUGE_VALF, volume->maximum = -HUGE_VALF;
    for (size_t i = 0; i < count; i++) {
        volume->minimum = fminf(volume->minimum, volume->value[i]);
        volume->maximum = fmaxf(volume->maximum, volume->value[i]);
    }
    if (good)
        return volume;
    faults_add(faults, shape->name, 0, 0, "not enough memory to blur the volume");
    volume_free(volume);
    return NULL;
}

// Computes the field and the distance of a synthetic shape. A part and its parent part are joined by the cubic smooth maximum of width k (C2):
//   smax(a, b) = max(a, b) + (k/6) h^3, h = max(0, 1 - |a - b| / k)
// and the shape is the plain maximum over parts and joints: parts that only touch do not blend. Union and blend keep |grad f| <= 1, so f
// is a safe step length along a ray (it never oversteps the surface).
#include "recon/phantom/phantom_field.h"

#include "recon/phantom/phantom_parts.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCK = 8, MOST_PARTS = 1024, FEW_PARTS = 8 };

// --- Splines ---

// Solves the tridiagonal system for the second derivatives of a cubic spline. An end is natural if its slope is NAN, else clamped to it.
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

// Returns the value and, in `slope`, the first derivative; linear beyond the ends.
static double spline_at(const Spline *s, const double *at, int n, int i, double t, double *slope)
{
    double h = at[i + 1] - at[i], u = t < at[0] ? at[0] : t > at[n - 1] ? at[n - 1] : t;
    double a = (at[i + 1] - u) / h, b = (u - at[i]) / h;
    double d = (s->value[i + 1] - s->value[i]) / h - (3 * a * a - 1) / 6 * h * s->bend[i] + (3 * b * b - 1) / 6 * h * s->bend[i + 1];
    *slope = d;
    return a * s->value[i] + b * s->value[i + 1] + ((a * a * a - a) * s->bend[i] + (b * b * b - b) * s->bend[i + 1]) * h * h / 6 + (t - u) * d;
}

Station part_at(const Part *part, double t)
{
    int n = part->knot_count, i = 0;
    for (int last = n - 2; i < last;) {   // the first piece that does not end before t
        int middle = (i + last) / 2;
        if (t > part->at[middle + 1])
            i = middle + 1;
        else
            last = middle;
    }
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

// Builds a part through `count` <= KNOTS knots (x, y, z, r). `end_slope`: tangents (dx, dy, dz, dr per mm) at both ends; NULL: natural. Returns false if out
// of memory.
static bool part_build(Part *part, const double (*knot)[4], int count, bool open_start, bool open_end, int parent, uint8_t kind, const double (*end_slope)[4])
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
    if (!part->block_sample || !part->block_radius || !part->block_at || !part->sample || !part->sample_radius || !part->sample_at || !part->block_center ||
        !part->block_reach)
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

void part_free(Part *part)
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

// Returns d/dt of r(t) - |X - C(t)|.
static double climb(const Part *part, Vec3 x, double t, double *value, Vec3 *away)
{
    Station s = part_at(part, t);
    Vec3 d = vec3_sub(x, s.center);
    double length = vec3_norm(d);
    *value = s.radius - length;
    *away = d;
    return length > 1e-12 ? s.taper + vec3_dot(d, s.tangent) / length : 0;
}

double part_field(const Part *part, Vec3 x, double enough, bool cut, Vec3 *gradient, double *at)
{
    double lowest = cut ? 0 : part->low, highest = cut ? part->at[part->knot_count - 1] : part->high, best = -HUGE_VAL,
           step = part->sample_count > 1 ? part->sample_at[1] - part->sample_at[0] : 1;
    int nearest = 0;
    // the blocks' middle samples give a first value that excludes most blocks
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
    // the maximum lies between the neighbours of the best sample: find it by bisection with secant steps on the slope
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

static double joint_width(const Shape *shape, int child) { return shape->blend > 0 ? shape->blend : 0.6 * shape->part[child].coordinate[3].value[0]; }

// Lists the parts of the octree cell that contains x, in order, and returns their number. Without a cell `list` is NULL: all parts.
static int parts_near(const Shape *shape, Vec3 x, const int **list)
{
    Vec3 at = vec3_scale(vec3_sub(x, shape->cell_low), 1 / shape->cell_edge);
    *list = NULL;
    if (shape->cell_count == 0 || !(at.x >= 0 && at.x < 1 && at.y >= 0 && at.y < 1 && at.z >= 0 && at.z < 1))
        return shape->part_count;
    const Cell *cell = shape->cell;
    while (cell->child >= 0) {
        at = vec3_scale(at, 2);
        int i = at.x >= 1, j = at.y >= 1, k = at.z >= 1;
        at = vec3_sub(at, vec3(i, j, k));
        cell = shape->cell + cell->child + i + 2 * j + 4 * k;
    }
    *list = shape->cell_part + cell->first;
    return cell->count;
}

// Joins the listed parts. `f`, `g`: space for `count` values and gradients, in the order of the list.
static double join(const Shape *shape, Vec3 x, bool cut, const int *list, int count, double *f, Vec3 *g, Vec3 *gradient, int *which, double *at)
{
    double best = -HUGE_VAL, highest, t;
    Vec3 best_gradient = {0, 0, 0};
    for (int i = 0; i < count; i++) {
        // a part whose value is below the best by more than the width of the joints has no effect
        int p = list ? list[i] : i;
        f[i] = part_field(&shape->part[p], x, best - shape->widest_joint, cut, &g[i], &t);
        if (f[i] > best)
            best = f[i], best_gradient = g[i], *which = p, *at = t;
    }
    highest = best;
    for (int i = 0; i < count; i++) {
        int p = list ? list[i] : i, parent = shape->part[p].parent, k = list ? 0 : parent;
        while (list && k < count && list[k] != parent)
            k++;
        if (parent < 0 || k == count)   // a parent that is not in the list is too small here to join
            continue;
        double width = joint_width(shape, p), h = 1 - fabs(f[i] - f[k]) / width;
        if (!(h > 0))
            continue;
        double joined = fmax(f[i], f[k]) + width / 6 * h * h * h, share = 0.5 * h * h;
        if (joined > highest) {
            highest = joined;
            best_gradient = f[i] > f[k] ? vec3_mix(g[i], g[k], share) : vec3_mix(g[k], g[i], share);
        }
    }
    if (gradient)
        *gradient = best_gradient;
    return highest;
}

// A separate function, so that the usual case of few parts does not need a large stack frame.
__attribute__((noinline)) static double join_many(const Shape *shape, Vec3 x, bool cut, const int *list, int count, Vec3 *gradient, int *which, double *at)
{
    double f[MOST_PARTS];
    Vec3 g[MOST_PARTS];
    return join(shape, x, cut, list, count, f, g, gradient, which, at);
}

static double joined_field(const Shape *shape, Vec3 x, bool cut, Vec3 *gradient, int *which, double *at)
{
    enum { USUAL = 12 };
    double f[USUAL];
    Vec3 g[USUAL];
    const int *list;
    int count = parts_near(shape, x, &list);
    return count > USUAL ? join_many(shape, x, cut, list, count, gradient, which, at) : join(shape, x, cut, list, count, f, g, gradient, which, at);
}

double shape_field(const Shape *shape, Vec3 x, Vec3 *gradient)
{
    int part;
    double at;
    return joined_field(shape, x, false, gradient, &part, &at);
}

double shape_field_of_part(const Shape *shape, Vec3 x, int *part, double *at) { return joined_field(shape, x, false, NULL, part, at); }

double shape_field_cut(const Shape *shape, Vec3 x)
{
    int which;
    double at, f = joined_field(shape, x, true, NULL, &which, &at);
    for (int p = 0; p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        for (int end = 0; end < 2; end++) {
            if (!(end ? part->open_end : part->open_start))
                continue;
            // this ball contains the half sphere beyond the end and nothing else
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
    // alternate: move onto the surface along the gradient, then slide towards the point nearest to x, by less after an overshoot
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
    int which;
    double at;
    shape_field_of_part(shape, x, &which, &at);
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

// --- Construction ---

bool shape_add(Shape *shape, const double (*knot)[4], int count, bool open_start, bool open_end, int parent, uint8_t kind, const double (*end_slope)[4])
{
    if (shape->part_count == shape->part_capacity) {
        int capacity = 2 * shape->part_capacity + FEW_PARTS;
        Part *more = capacity <= MOST_PARTS ? realloc(shape->part, (size_t)capacity * sizeof *more) : NULL;
        if (!more)
            return false;
        shape->part = more;
        shape->part_capacity = capacity;
    }
    return part_build(&shape->part[shape->part_count++], knot, count, open_start, open_end, parent, kind, end_slope);
}

bool part_scale(Part *part, double scale)
{
    Part old = *part;
    double knot[KNOTS][4], tangent[2][4];
    for (int i = 0; i < old.knot_count; i++)
        for (int k = 0; k < 4; k++)
            knot[i][k] = scale * old.coordinate[k].value[i];
    for (int k = 0; k < 4; k++) {   // slopes at the ends do not change
        spline_at(&old.coordinate[k], old.at, old.knot_count, 0, old.at[0], &tangent[0][k]);
        spline_at(&old.coordinate[k], old.at, old.knot_count, old.knot_count - 2, old.at[old.knot_count - 1], &tangent[1][k]);
    }
    part_free(&old);
    return part_build(part, (const double(*)[4])knot, old.knot_count, old.open_start, old.open_end, old.parent, old.kind, (const double(*)[4])tangent);
}

// Lists in `kept`, in order, the parts of `list` whose value can be within a joint's width of the largest somewhere in the ball around c. Returns their
// number.
static int parts_that_matter(const Shape *shape, const int *list, int count, Vec3 c, double reach, int *kept)
{
    double upper[MOST_PARTS], lower = -HUGE_VAL;
    for (int i = 0; i < count; i++) {
        const Part *part = &shape->part[list[i]];
        upper[i] = -HUGE_VAL;
        for (int k = 0; k < part->block_count; k++) {
            double away = vec3_distance(c, part->block_center[k]);
            upper[i] = fmax(upper[i], part->block_reach[k] - away);
            if (part->block_at[k] >= 0 && part->block_at[k] <= part->at[part->knot_count - 1])
                lower = fmax(lower, part->block_radius[k] - away);
        }
        upper[i] += 2 * (part->sample_at[1] - part->sample_at[0]);   // the maximum may lie between the samples
    }
    int n = 0;
    for (int i = 0; i < count; i++)
        if (upper[i] + reach >= lower - reach - 1.01 * shape->widest_joint)
            kept[n++] = list[i];
    return n;
}

static bool keep_parts(Shape *shape, Cell *cell, const int *list, int count)
{
    if (shape->cell_part_count + count > shape->cell_part_capacity) {
        int capacity = 2 * shape->cell_part_capacity + MOST_PARTS;
        int *more = realloc(shape->cell_part, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        shape->cell_part = more;
        shape->cell_part_capacity = capacity;
    }
    memcpy(shape->cell_part + shape->cell_part_count, list, (size_t)count * sizeof *list);
    cell->first = shape->cell_part_count;
    cell->count = count;
    shape->cell_part_count += count;
    return true;
}

static bool divide(Shape *shape, int index, const int *list, int count, Vec3 low, double edge, int depth)
{
    enum { DEEPEST = 6, ENOUGH = 2 };
    double half = 0.5 * edge;
    int kept[MOST_PARTS];
    int n = parts_that_matter(shape, list, count, vec3_add(low, vec3(half, half, half)), sqrt(3) * half, kept);
    shape->cell[index].child = -1;
    if (n <= ENOUGH || depth == DEEPEST || edge < 2 * shape->widest_joint)
        return keep_parts(shape, &shape->cell[index], kept, n);
    if (shape->cell_count + 8 > shape->cell_capacity) {
        int capacity = 2 * shape->cell_capacity + 64;
        Cell *more = realloc(shape->cell, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        shape->cell = more;
        shape->cell_capacity = capacity;
    }
    int child = shape->cell[index].child = shape->cell_count;
    shape->cell_count += 8;
    for (int i = 0; i < 8; i++)
        if (!divide(shape, child + i, kept, n, vec3_add(low, vec3((i & 1) * half, (i >> 1 & 1) * half, (i >> 2) * half)), half, depth + 1))
            return false;
    return true;
}

bool shape_finish(Shape *shape)
{
    shape->widest_joint = 0;
    for (int p = 0; p < shape->part_count; p++)
        if (shape->part[p].parent >= 0)
            shape->widest_joint = fmax(shape->widest_joint, 1.01 * joint_width(shape, p));
    if (shape->part_count <= FEW_PARTS)
        return true;
    Vec3 low, high;
    shape_bounds(shape, &low, &high);
    double extent = fmax(high.x - low.x, fmax(high.y - low.y, high.z - low.z)), margin = 0.1 * extent;
    shape->cell_low = vec3_sub(vec3_scale(vec3_add(low, high), 0.5), vec3(0.5 * extent + margin, 0.5 * extent + margin, 0.5 * extent + margin));
    shape->cell_edge = extent + 2 * margin;
    int all[MOST_PARTS];
    for (int p = 0; p < shape->part_count; p++)
        all[p] = p;
    shape->cell = malloc(sizeof *shape->cell);
    shape->cell_count = shape->cell_capacity = shape->cell != NULL;
    return shape->cell && divide(shape, 0, all, shape->part_count, shape->cell_low, shape->cell_edge, 0);
}

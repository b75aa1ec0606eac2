// Raster sections, the templates of Kretschmer et al. 2013: the signed distance T to the contour on 64 x 64 points. The contour is closed by a Catmull-Rom curve
// of tension 0.7, as printed.
//
// As printed, T is a chamfer distance and C its bilinear interpolation. Its gradient jumps at the raster's lines: a wire that slides over it feels 0.17 of the
// curvature 0.53, and Newton's method does not find all feet (shared/rivals.md). Mended: T holds exact distances, and C is the cubic B-spline through them, C2
// and exact for distances to a straight line.
//   C(n, b) = sum_ij c_ij B(x - i) B(y - j),  (x, y) = (n, b)/h + 31.5,  with h the raster's step;  T_ij = sum of c over the neighbours with 1/6, 4/6, 1/6.
// Beyond the raster C falls with the distance from it.
#include "geom/section_kinds.h"

#include <stdlib.h>

enum { SIDE = 64, STEPS = 4 };
static const double MARGIN = 1.6;    // half width of the raster, in largest radii of the contour
static const double TENSION = 0.7;

// values: [0] step h [mm], [1] 1 for bilinear; then T or c, row by row of b
enum { STEP, BILINEAR, RASTER, VALUES = RASTER + SIDE * SIDE };

// --- Distances ---

// Squared distances of a row's points from all sides of the curve; the least of each.
static void row_distances(int count, const SectionPoint *curve, double n0, double b, double h, double *restrict least)
{
    for (int i = 0; i < SIDE; i++)
        least[i] = HUGE_VAL;
    for (int k = 0; k < count; k++) {
        SectionPoint p = curve[k], q = curve[(k + 1) % count];
        double dn = q.n - p.n, db = q.b - p.b, square = dn * dn + db * db, inverse = square > 0 ? 1 / square : 0;
        for (int i = 0; i < SIDE; i++) {
            double x = n0 + i * h - p.n, y = b - p.b, u = (x * dn + y * db) * inverse;
            u = u < 0 ? 0 : u > 1 ? 1 : u;
            double ex = x - u * dn, ey = y - u * db, d = ex * ex + ey * ey;
            least[i] = d < least[i] ? d : least[i];
        }
    }
}

static void exact_distances(int count, const SectionPoint *curve, double h, double *t)
{
    double from = -0.5 * (SIDE - 1) * h;
    for (int j = 0; j < SIDE; j++) {
        double *row = t + (size_t)j * SIDE;
        row_distances(count, curve, from, from + j * h, h, row);
        for (int i = 0; i < SIDE; i++)
            row[i] = sqrt(row[i]);
    }
}

// The chamfer distance (5, 7)/5 from the points beside which the curve passes, in units of the step; two sweeps (Borgefors 1986).
static void chamfer_distances(const bool *inside, double h, double *t)
{
    static const double FAR = 1e6, SIDEWAYS = 1, DIAGONAL = 1.4;
    for (int at = 0; at < SIDE * SIDE; at++) {
        int i = at % SIDE, j = at / SIDE;
        bool beside = (i > 0 && inside[at] != inside[at - 1]) || (i < SIDE - 1 && inside[at] != inside[at + 1]) || (j > 0 && inside[at] != inside[at - SIDE]) ||
                      (j < SIDE - 1 && inside[at] != inside[at + SIDE]);
        t[at] = beside ? 0.5 : FAR;
    }
    for (int sweep = 0; sweep < 2; sweep++)
        for (int k = 0; k < SIDE * SIDE; k++) {
            int at = sweep ? SIDE * SIDE - 1 - k : k, step = sweep ? 1 : -1, i = at % SIDE, j = at / SIDE;
            bool across = i + step >= 0 && i + step < SIDE, along = j + step >= 0 && j + step < SIDE, back = i - step >= 0 && i - step < SIDE;
            if (across)
                t[at] = fmin(t[at], t[at + step] + SIDEWAYS);
            if (along)
                t[at] = fmin(t[at], t[at + step * SIDE] + SIDEWAYS);
            if (across && along)
                t[at] = fmin(t[at], t[at + step * SIDE + step] + DIAGONAL);
            if (back && along)
                t[at] = fmin(t[at], t[at + step * SIDE - step] + DIAGONAL);
        }
    for (int at = 0; at < SIDE * SIDE; at++)
        t[at] *= h;
}

// Which points are inside, row by row: the curve's crossings of the row, from left to right, change the side.
static void mark_inside(int count, const SectionPoint *curve, double h, bool *inside)
{
    double from = -0.5 * (SIDE - 1) * h;
    for (int j = 0; j < SIDE; j++) {
        double b = from + j * h;
        bool *row = inside + (size_t)j * SIDE;
        for (int i = 0; i < SIDE; i++)
            row[i] = false;
        for (int k = 0; k < count; k++) {
            SectionPoint p = curve[k], q = curve[(k + 1) % count];
            if ((p.b > b) == (q.b > b))
                continue;
            double x = (p.n + (b - p.b) / (q.b - p.b) * (q.n - p.n) - from) / h;
            for (int i = 0; i < SIDE && i < x; i++)
                row[i] = !row[i];
        }
    }
}

// --- The cubic B-spline through a raster ---

// Coefficients c of the B-spline through a line of values, in place, by the two recursions of Unser 1999 with pole sqrt(3) - 2; mirrored at its ends.
static void prefilter(double *line, int stride)
{
    const double pole = sqrt(3.0) - 2;
    double sum = 0, power = 1;
    for (int i = 0; i < SIDE; i++, power *= pole)
        sum += power * line[i * stride];
    line[0] = sum;
    for (int i = 1; i < SIDE; i++)
        line[i * stride] += pole * line[(i - 1) * stride];
    int last = (SIDE - 1) * stride;
    line[last] = pole / (pole * pole - 1) * (line[last] + pole * line[last - stride]);
    for (int i = SIDE - 2; i >= 0; i--)
        line[i * stride] = pole * (line[(i + 1) * stride] - line[i * stride]);
    for (int i = 0; i < SIDE; i++)
        line[i * stride] *= 6;
}

// Weights of the four coefficients around u in [0, 1), with first and second derivatives.
static void spline_weights(double u, double w[3][4])
{
    double v = 1 - u;
    w[0][0] = v * v * v / 6, w[0][1] = 2.0 / 3 - u * u * (1 - 0.5 * u), w[0][2] = 2.0 / 3 - v * v * (1 - 0.5 * v), w[0][3] = u * u * u / 6;
    w[1][0] = -0.5 * v * v, w[1][1] = u * (1.5 * u - 2), w[1][2] = -v * (1.5 * v - 2), w[1][3] = 0.5 * u * u;
    w[2][0] = v, w[2][1] = 3 * u - 2, w[2][2] = 3 * v - 2, w[2][3] = u;
}

static SectionJet jet_spline(const double *c, double x, double y, double h)
{
    int i = (int)x, j = (int)y;
    double wx[3][4], wy[3][4];
    spline_weights(x - i, wx);
    spline_weights(y - j, wy);
    double sum[3][3] = {{0}};     // [derivative in y][derivative in x]
    for (int r = 0; r < 4; r++) {
        const double *row = c + (size_t)(j - 1 + r) * SIDE + (size_t)(i - 1);
        for (int d = 0; d < 3; d++) {
            double line = wx[d][0] * row[0] + wx[d][1] * row[1] + wx[d][2] * row[2] + wx[d][3] * row[3];
            for (int e = 0; e + d < 3; e++)
                sum[e][d] += wy[e][r] * line;
        }
    }
    double f = 1 / h;
    return (SectionJet){sum[0][0], sum[0][1] * f, sum[1][0] * f, sum[0][2] * f * f, sum[1][1] * f * f, sum[2][0] * f * f};
}

static SectionJet jet_bilinear(const double *t, double x, double y, double h)
{
    int i = (int)x, j = (int)y;
    const double *row = t + (size_t)j * SIDE + (size_t)i;
    double u = x - i, v = y - j, low = row[0] + u * (row[1] - row[0]), high = row[SIDE] + u * (row[SIDE + 1] - row[SIDE]);
    double f = 1 / h, twist = row[0] - row[1] - row[SIDE] + row[SIDE + 1];
    return (SectionJet){.value = low + v * (high - low), .n = (row[1] - row[0] + v * twist) * f, .b = (high - low) * f, .nb = twist * f * f};
}

static SectionJet evaluate_raster(const Section *section, double n, double b)
{
    double h = section->values[STEP], least = 1, most = SIDE - 2 - 1e-9;
    double x = n / h + 0.5 * (SIDE - 1), y = b / h + 0.5 * (SIDE - 1), cx = fmin(fmax(x, least), most), cy = fmin(fmax(y, least), most);
    const double *raster = section->values + RASTER;
    SectionJet jet = section->values[BILINEAR] > 0 ? jet_bilinear(raster, cx, cy, h) : jet_spline(raster, cx, cy, h);
    if (cx == x && cy == y)
        return jet;
    double dx = (x - cx) * h, dy = (y - cy) * h, away = same_hypot(dx, dy);
    return (SectionJet){.value = jet.value - away, .n = -dx / away, .b = -dy / away};
}

Section *section_raster_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius)
{
    Section *section = section_allocate(SECTION_RASTER, VALUES, radius);
    SectionPoint *curve = malloc((size_t)count * STEPS * sizeof *curve);
    bool *inside = malloc((size_t)SIDE * SIDE * sizeof *inside);
    if (!section || !curve || !inside) {
        free(section);
        free(curve);
        free(inside);
        return NULL;
    }
    section->numbers = SIDE * SIDE;
    section->evaluate = evaluate_raster;
    section->is_distance = true;
    polygon_smooth(count, contour, TENSION, STEPS, curve);
    double most = 0;
    for (int i = 0; i < count * STEPS; i++)
        most = fmax(most, fmax(fabs(curve[i].n), fabs(curve[i].b)));
    double h = section->values[STEP] = 2 * MARGIN * most / (SIDE - 1), *raster = section->values + RASTER;
    section->values[BILINEAR] = options->form == SECTION_AS_PRINTED;
    mark_inside(count * STEPS, curve, h, inside);
    if (options->form == SECTION_AS_PRINTED)
        chamfer_distances(inside, h, raster);
    else
        exact_distances(count * STEPS, curve, h, raster);
    for (int at = 0; at < SIDE * SIDE; at++)
        raster[at] = inside[at] ? raster[at] : -raster[at];
    for (int i = 0; i < SIDE && options->form == SECTION_MENDED; i++)
        prefilter(raster + (size_t)i * SIDE, 1);
    for (int i = 0; i < SIDE && options->form == SECTION_MENDED; i++)
        prefilter(raster + i, SIDE);
    free(curve);
    free(inside);
    return section;
}

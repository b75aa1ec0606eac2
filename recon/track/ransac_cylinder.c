// A point P at q = P - C has the distance rho = |q - (q.d) d| from the axis (C, d); its residual is e = rho - r. With n the unit radial vector and
// e1, e2 across d, moving C by a e1 + b e2 and tilting d by p e1 + t e2 changes it by
//   de = -(n.e1) a - (n.e2) b - (q.d) ((n.e1) p + (n.e2) t) - dr,
// which is all that Gauss-Newton needs. It reaches the minimum of Powell's method (a test compares them) in a tenth of the time and, unlike NLopt's
// PRAXIS, keeps no state between calls.
#include "recon/track/ransac_cylinder.h"

#include "base/base.h"

#include <math.h>
#include <string.h>
#ifdef SELDINGER_NLOPT
#include <nlopt.h>
#endif

// --- random numbers ---

Random random_from_seed(uint64_t seed, uint64_t stream)
{
    Random random = {seed ^ (stream * 0xd1342543de82ef95u)};
    random.state = random_next(&random);
    return random;
}

// --- circles ---

// Trials are drawn and computed in batches; surplus draws of the last batch are discarded.
enum { BATCH = 16, COUNTED_TOGETHER = 8 };
typedef struct Circles {
    double u0[BATCH], v0[BATCH], ax[BATCH], ay[BATCH], bx[BATCH], by[BATCH];   // first point, and the two others relative to it
    double cu[BATCH], cv[BATCH], r[BATCH];
    int fits[BATCH];         // trials whose points are not collinear and whose circle is roughly within the limits
} Circles;

// Points of a least-squares fit; residuals and derivatives of a block of them; the sums of the normal equations.
enum { FIT_BLOCK = 64 };
typedef struct FitPoints {
    double x[MAX_RANSAC_POINTS], y[MAX_RANSAC_POINTS], z[MAX_RANSAC_POINTS];
    int count;
} FitPoints;
typedef struct Residuals {
    double j[4][FIT_BLOCK], e[FIT_BLOCK], rho[FIT_BLOCK];
} Residuals;
typedef double Four __attribute__((vector_size(32)));
typedef struct Normal {      // for the unknowns 0 … 3: a[n][m], b[m]; for the last: a[4][m], a44, b4
    Four a[5], b;
    double a44, b4;
} Normal;

#define KERNEL_TEXT "recon/track/ransac_kernel.inc"
#include "base/each_simd.inc"
static void (*const draw_points_on[SIMD_COUNT])(uint64_t, int, int *) = SIMD_FORMS(draw_points);
static int (*const count_ring_on[SIMD_COUNT])(const float *, const float *, int, float, float, float, float) = SIMD_FORMS(count_ring);
static void (*const circles_of_three_on[SIMD_COUNT])(Circles *, double, double, double) = SIMD_FORMS(circles_of_three);

static void (*const residuals_on[SIMD_COUNT])(const FitPoints *, int, int, const Cylinder *, double *) = SIMD_FORMS(residuals);
static void (*const derivatives_on[SIMD_COUNT])(const FitPoints *, int, int, const Cylinder *, Vec3, Vec3, Residuals *) = SIMD_FORMS(derivatives);
static void (*const add_normal_on[SIMD_COUNT])(const Residuals *, int, double, Normal *) = SIMD_FORMS(add_normal);

// Each trial consumes three random numbers, whatever its result.
static void draw_triples(Circles *c, const double *u, const double *v, int count, Random random, SimdLevel level)
{
    int index[3 * BATCH];
    draw_points_on[level](random.state, count, index);
    for (int k = 0; k < BATCH; k++) {
        int i = index[3 * k], j = index[3 * k + 1], l = index[3 * k + 2];
        c->u0[k] = u[i];
        c->v0[k] = v[i];
        c->ax[k] = u[j] - u[i];
        c->ay[k] = v[j] - v[i];
        c->bx[k] = u[l] - u[i];
        c->by[k] = v[l] - v[i];
        c->fits[k] = (i != j) & (i != l) & (j != l);
    }
}

double ransac_circle(const Vec3 *point, int count, Vec3 origin, Vec3 axis, const RansacOptions *options, Random *random, Cylinder *out)
{
    float u[MAX_RANSAC_POINTS + COUNTED_TOGETHER], v[MAX_RANSAC_POINTS + COUNTED_TOGETHER];
    double wide_u[MAX_RANSAC_POINTS], wide_v[MAX_RANSAC_POINTS];   // the same numbers
    Vec3 e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
    if (count < 3 || count > MAX_RANSAC_POINTS)
        return 0;
    for (int i = 0; i < count; i++) {
        Vec3 q = vec3_sub(point[i], origin);
        u[i] = (float)vec3_dot(q, e1);
        v[i] = (float)vec3_dot(q, e2);
        wide_u[i] = (double)u[i];
        wide_v[i] = (double)v[i];
    }
    int padded = count;
    for (; padded % COUNTED_TOGETHER; padded++)
        u[padded] = v[padded] = INFINITY;   // lies on no circle
    int best = 0, trial = 0;
    const double rounding = 1e-9;   // tolerance; the exact test follows
    double least2 = options->radius_min * options->radius_min * (1 - rounding), most2 = options->radius_max * options->radius_max * (1 + rounding);
    const SimdLevel level = simd_level();
    for (bool more = true; more;) {
        Circles c;
        draw_triples(&c, wide_u, wide_v, count, *random, level);
        circles_of_three_on[level](&c, least2, most2, options->offset_max * options->offset_max);
        int k = 0;
        for (; k < BATCH; k++, trial++) {
            more = trial < options->trials_max && (trial < options->trials_min || best <= options->inlier_rate * count);
            if (!more)
                break;
            if (!c.fits[k])
                continue;
            double r = c.r[k];
            if (!(r >= options->radius_min && r <= options->radius_max))
                continue;
            double low = fmax(r - options->threshold, 0), high = r + options->threshold;
            int inside = count_ring_on[level](u, v, padded, (float)c.cu[k], (float)c.cv[k], (float)(low * low), (float)(high * high));
            if (inside > best) {
                best = inside;
                *out = (Cylinder){vec3_add_scaled(vec3_add_scaled(origin, c.cu[k], e1), c.cv[k], e2), r, axis, 0};
            }
        }
        random_skip(random, 3 * k);
    }
    return (double)best / count;
}

// --- least squares ---

static double axis_distance(Vec3 q, Vec3 axis)
{
    double along = vec3_dot(q, axis);
    return sqrt(fmax(vec3_norm2(q) - along * along, 0));
}

int cylinder_inliers(const Cylinder *c, const Vec3 *point, int count, double threshold, int *inlier)
{
    int found = 0;
    for (int i = 0; i < count; i++)
        if (fabs(axis_distance(vec3_sub(point[i], c->center), c->axis) - c->radius) <= threshold)
            inlier[found++] = i;
    return found;
}

static void take_points(const Vec3 *point, const int *inlier, int count, FitPoints *out)
{
    SEL_REQUIRE(count <= MAX_RANSAC_POINTS, "a cylinder is fitted to at most MAX_RANSAC_POINTS points");
    out->count = count;
    for (int i = 0; i < count; i++) {
        out->x[i] = point[inlier[i]].x;
        out->y[i] = point[inlier[i]].y;
        out->z[i] = point[inlier[i]].z;
    }
}

static int block_size(const FitPoints *points, int first) { return points->count - first < FIT_BLOCK ? points->count - first : FIT_BLOCK; }

static double sum_of_squares(const Cylinder *c, const FitPoints *points)
{
    double sum = 0, e[FIT_BLOCK];
    for (int first = 0; first < points->count; first += FIT_BLOCK) {
        int used = block_size(points, first);
        residuals_on[simd_level()](points, first, used, c, e);
        for (int i = 0; i < used; i++)
            sum += e[i] * e[i];
    }
    return sum;
}

// Normal equations of the step from cylinder c; only the lower half of `a` is filled in.
static void normal_equations(const Cylinder *c, Vec3 e1, Vec3 e2, const FitPoints *points, double a[5][5], double b[5])
{
    const SimdLevel level = simd_level();
    Normal n = {0};
    Residuals residuals;
    for (int first = 0; first < points->count; first += FIT_BLOCK) {
        int used = block_size(points, first);
        derivatives_on[level](points, first, used, c, e1, e2, &residuals);
        add_normal_on[level](&residuals, used, c->radius, &n);
    }
    for (int m = 0; m < 4; m++) {
        for (int k = 0; k <= m; k++)
            a[m][k] = n.a[k][m];
        a[4][m] = n.a[4][m];
        b[m] = n.b[m];
    }
    a[4][4] = n.a44;
    b[4] = n.b4;
}

// x = (a, b, p, t, dr), all in units of the first radius
static Cylinder moved(const Cylinder *c, Vec3 e1, Vec3 e2, const double x[5])
{
    double r = c->radius;
    return (Cylinder){vec3_add_scaled(vec3_add_scaled(c->center, x[0] * r, e1), x[1] * r, e2), r * (1 + x[4]),
                      vec3_unit(vec3_add_scaled(vec3_add_scaled(c->axis, x[2], e1), x[3], e2)), c->height};
}

// Solves A x = b for a symmetric positive definite 5 x 5 matrix by Cholesky decomposition. Returns false if A is not positive definite.
static bool solve5(double a[5][5], double b[5])
{
    for (int j = 0; j < 5; j++) {
        for (int k = 0; k < j; k++)
            for (int i = j; i < 5; i++)
                a[i][j] -= a[i][k] * a[j][k];
        if (!(a[j][j] > 1e-300))
            return false;
        double root = sqrt(a[j][j]);
        for (int i = j; i < 5; i++)
            a[i][j] /= root;
    }
    for (int i = 0; i < 5; i++) {
        for (int k = 0; k < i; k++)
            b[i] -= a[i][k] * b[k];
        b[i] /= a[i][i];
    }
    for (int i = 4; i >= 0; i--) {
        for (int k = i + 1; k < 5; k++)
            b[i] -= a[k][i] * b[k];
        b[i] /= a[i][i];
    }
    return true;
}

static Cylinder refine_gauss_newton(const Cylinder *start, const FitPoints *points)
{
    Cylinder best = *start;
    double least = sum_of_squares(&best, points), damping = 1e-3;
    for (int iteration = 0; iteration < 20 && damping < 1e6; iteration++) {
        Vec3 e1 = vec3_normal_to(best.axis), e2 = vec3_cross(best.axis, e1);
        double a[5][5] = {{0}}, b[5], r = best.radius;
        normal_equations(&best, e1, e2, points, a, b);
        for (int m = 0; m < 5; m++)
            a[m][m] += damping * a[m][m] + 1e-12 * r * r * points->count;
        if (!solve5(a, b))
            break;
        Cylinder next = moved(&best, e1, e2, b);
        double sum = sum_of_squares(&next, points);
        if (next.radius > 0 && sum < least) {
            bool done = least - sum < 1e-9 * least;
            best = next;
            least = sum;
            damping *= 0.1;
            if (done)
                break;
        } else {
            damping *= 10;
        }
    }
    return best;
}

#ifdef SELDINGER_NLOPT
bool cylinder_refine_has_powell(void) { return true; }

typedef struct PowellProblem {
    const Cylinder *start;
    Vec3 e1, e2;
    const FitPoints *points;
} PowellProblem;

static double powell_energy(unsigned n, const double *x, double *gradient, void *context)
{
    const PowellProblem *p = context;
    (void)n;
    (void)gradient;
    Cylinder c = moved(p->start, p->e1, p->e2, x);
    return sum_of_squares(&c, p->points) / (p->start->radius * p->start->radius);
}

static Cylinder refine_powell(const Cylinder *start, const FitPoints *points)
{
    Vec3 e1 = vec3_normal_to(start->axis);
    PowellProblem problem = {start, e1, vec3_cross(start->axis, e1), points};
    double x[5] = {0}, energy;
    nlopt_opt powell = nlopt_create(NLOPT_LN_PRAXIS, 5);
    if (!powell)
        return *start;
    nlopt_srand(1);   // PRAXIS draws random numbers from a state that outlives the call
    nlopt_set_min_objective(powell, powell_energy, &problem);
    nlopt_set_initial_step1(powell, 0.05);
    nlopt_set_xtol_rel(powell, 1e-7);
    nlopt_set_xtol_abs1(powell, 1e-8);
    nlopt_set_maxeval(powell, 4000);
    nlopt_optimize(powell, x, &energy);   // whatever it returns, x is the best point found
    nlopt_destroy(powell);
    return moved(start, e1, problem.e2, x);
}
#else
bool cylinder_refine_has_powell(void) { return false; }

static Cylinder refine_powell(const Cylinder *start, const FitPoints *points) { return refine_gauss_newton(start, points); }
#endif

double cylinder_refine(Cylinder *cylinder, const Vec3 *point, const int *inlier, int count, bool by_powell, bool *good)
{
    Cylinder c = *cylinder;
    FitPoints points;
    take_points(point, inlier, count, &points);
    *good = count >= 6;
    if (*good) {
        c = by_powell ? refine_powell(cylinder, &points) : refine_gauss_newton(cylinder, &points);
        *good = vec3_is_finite(c.center) && vec3_is_finite(c.axis) && c.radius > 0 && isfinite(c.radius);
    }
    if (*good) {
        // a tilt moves the centre along the axis: project it back next to the old one
        c.center = vec3_add_scaled(c.center, vec3_dot(vec3_sub(cylinder->center, c.center), c.axis), c.axis);
        *cylinder = c;
    }
    return sqrt(sum_of_squares(cylinder, &points) / (count > 0 ? count : 1));
}

// |P|^2 = 2 P.C + (r^2 - |C|^2) is linear in C and the last term; Gauss-Newton on the true distance follows.
bool sphere_fit(const Vec3 *point, int count, Vec3 *center, double *radius)
{
    if (count < 4)
        return false;
    Vec3 c = {0, 0, 0};
    double r = 0;
    for (int i = 0; i < count; i++)
        c = vec3_add_scaled(c, 1.0 / count, point[i]);
    for (int i = 0; i < count; i++)
        r += vec3_distance(point[i], c) / count;
    for (int iteration = 0; iteration < 50; iteration++) {
        // the minimum satisfies C = mean(P) - r mean(n), r = mean |P - C|, n = (P - C) / |P - C|, here as a Newton step on the 4 unknowns
        double a[5][5] = {{0}}, b[5] = {0};
        for (int i = 0; i < count; i++) {
            Vec3 q = vec3_sub(point[i], c);
            double rho = vec3_norm(q);
            if (rho < 1e-12)
                continue;
            double j[5] = {-q.x / rho, -q.y / rho, -q.z / rho, -1, 0}, e = rho - r;
            for (int m = 0; m < 4; m++) {
                b[m] -= j[m] * e;
                for (int n = 0; n <= m; n++)
                    a[m][n] += j[m] * j[n];
            }
        }
        for (int m = 0; m < 5; m++)
            a[m][m] += m < 4 ? 1e-9 * count : 1;
        if (!solve5(a, b))
            return false;
        c = vec3_add(c, vec3(b[0], b[1], b[2]));
        r += b[3];
        if (b[0] * b[0] + b[1] * b[1] + b[2] * b[2] + b[3] * b[3] < 1e-20 * r * r)
            break;
    }
    *center = c;
    *radius = r;
    return vec3_is_finite(c) && isfinite(r) && r > 0;
}

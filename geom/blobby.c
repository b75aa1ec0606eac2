// Field, gradient and Hessian of a blobby model in closed form (Kerrien et al. 2017, eq. (3) and (5)), and its closest surface point.
//
// With d = X - C, q = |d|^2 / (5 rho^2), u = 1 / (1 + q):
//   f = sum rho u^2 - T,  grad f = sum A u^3 d,  H = sum A u^3 I + B u^4 d d',  A = -4/(5 rho),  B = 24/(25 rho^3)
// and for compact blobs with u = max(0, 1 - |d|^2 / R^2):
//   f = sum a u^3 - T,  grad f = sum A u^2 d,  H = sum A u^2 I + B u d d',  A = -6 a / R^2,  B = 24 a / R^4
//
// The closest point minimises |p - X|^2 / 2 on f = 0, by a Newton method on the surface. At p with unit normal n and shape operator S = P H P / |g|, the
// gradient of the half squared distance along the surface is P (p - X) and its Hessian is I + gap S, gap = (X - p).n. Each step moves by -(I + gap S)^-1 P (p -
// X) in the tangent plane and returns to the surface along the gradient; a step that does not bring p closer to X is halved. Alternating Taubin steps and
// tangential projections was tried first and rejected: it diverges beyond the focal points, and one Taubin step is up to 2.3 times too long.
#include "geom/blobby.h"

#include "base/base.h"

// The contribution of a blob: field f, gradient slope * d and Hessian slope * I + bend * d d', with d = x - centre.
typedef struct BlobTerm {
    Vec3 d;
    double f, slope, bend;
} BlobTerm;

static inline BlobTerm blob_term(const Blobby *model, int j, Vec3 x)
{
    int k = blobby_row(model, j);
    Vec3 d = vec3_sub(x, model->center[k]);
    double width = model->width[k], width2 = width * width;
    if (model->amplitude) {
        double u = 1 - vec3_norm2(d) / width2;
        u = u > 0 ? u : 0;
        double a = model->amplitude[k], v = a * u / width2;
        return (BlobTerm){d, a * u * (u * u), -6 * u * v, 24 * v / width2};
    }
    double u = 1 / (1 + vec3_norm2(d) / (5 * width2)), u2 = u * u;
    return (BlobTerm){d, width * u2, -0.8 / width * (u2 * u), 0.96 / (width2 * width) * (u2 * u2)};
}

double blobby_field(const Blobby *model, Vec3 x)
{
    double f = 0;
    for (int j = 0; j < model->count; j++)
        f += blob_term(model, j, x).f;
    return f - model->iso_level;
}

double blobby_gradient(const Blobby *model, Vec3 x, Vec3 *gradient)
{
    double f = 0;
    Vec3 g = {0, 0, 0};
    for (int j = 0; j < model->count; j++) {
        BlobTerm t = blob_term(model, j, x);
        f += t.f;
        g = vec3_add_scaled(g, t.slope, t.d);
    }
    *gradient = g;
    return f - model->iso_level;
}

double blobby_hessian(const Blobby *model, Vec3 x, Vec3 *gradient, Sym3 *hessian)
{
    double f = 0, trace = 0;
    Vec3 g = {0, 0, 0};
    Sym3 h = {0, 0, 0, 0, 0, 0};
    for (int j = 0; j < model->count; j++) {
        BlobTerm t = blob_term(model, j, x);
        Vec3 d = t.d, bd = vec3_scale(d, t.bend);
        f += t.f;
        g = vec3_add_scaled(g, t.slope, d);
        trace += t.slope;
        h.xx += bd.x * d.x, h.xy += bd.x * d.y, h.xz += bd.x * d.z;
        h.yy += bd.y * d.y, h.yz += bd.y * d.z, h.zz += bd.z * d.z;
    }
    h.xx += trace, h.yy += trace, h.zz += trace;
    *gradient = g;
    *hessian = h;
    return f - model->iso_level;
}

double blob_radius(double width, double iso_level) { return width > iso_level ? width * sqrt(5 * (sqrt(width / iso_level) - 1)) : 0; }

// With s = sqrt(rho / T): s^5 - s^4 = r^2 / (5 T^2) = c. The function is convex for s > 1, and both 1 + c and 1 + c^(1/5) lie above the root, so Newton
// descends from there monotonically.
double blob_width_for_radius(double radius, double iso_level)
{
    double c = radius * radius / (5 * iso_level * iso_level), fifth = same_pow(c, 0.2);
    double s = 1 + (c < fifth ? c : fifth);
    for (int i = 0; i < 100; i++) {
        double s2 = s * s, next = s - (s2 * s2 * (s - 1) - c) / (s2 * s * (5 * s - 4));
        if (!(next < s))
            break;
        s = next;
    }
    return iso_level * s * s;
}

// --- Closest surface point ---

static double local_scale(const Blobby *model)
{
    double least = HUGE_VAL;
    for (int j = 0; j < model->count; j++)
        least = fmin(least, model->width[blobby_row(model, j)]);
    return model->amplitude ? 0.5 * least : least;
}

// A zero of f between `in` (f > 0) and `out` (f < 0): false position with the Illinois rule and bisection every third time.
static Vec3 cross_between(const Blobby *model, Vec3 in, double f_in, Vec3 out, double f_out)
{
    double a = 0, b = 1, fa = f_in, fb = f_out, length = vec3_distance(in, out);
    for (int i = 0; i < 100 && (b - a) * length > 1e-10; i++) {
        double t = i % 3 == 2 ? 0.5 * (a + b) : a + (b - a) * (fa / (fa - fb));
        if (!(t > a && t < b))
            t = 0.5 * (a + b);
        double f = blobby_field(model, vec3_mix(in, out, t));
        if (f > 0) {
            a = t, fa = f;
            fb *= 0.5;
        } else {
            b = t, fb = f;
            fa *= 0.5;
        }
    }
    return vec3_mix(in, out, 0.5 * (a + b));
}

// From x inside, marches outwards along unit d with growing strides to the first crossing (the field falls to -T at infinity). Returns false if there is none
// within `reach`.
static bool march_out(const Blobby *model, Vec3 x, double f, Vec3 d, double scale, double reach, Vec3 *start)
{
    double t = 0, stride = 0.5 * scale, ft = f;
    for (int i = 0; i < 200 && t < reach; i++) {
        double to = fmin(t + stride, reach);
        Vec3 next = vec3_add_scaled(x, to, d);
        double fn = blobby_field(model, next);
        if (!(fn > 0)) {
            *start = cross_between(model, vec3_add_scaled(x, t, d), ft, next, fn);
            return true;
        }
        t = to, ft = fn;
        stride *= 1.25;
    }
    return false;
}

// From x outside, finds the nearest crossing on the lines to blobs whose centre is inside. Returns false if no centre is inside.
static bool cross_towards_blobs(const Blobby *model, Vec3 x, double f, Vec3 *start)
{
    double best = HUGE_VAL;
    for (int j = 0; j < model->count; j++) {
        Vec3 c = model->center[blobby_row(model, j)];
        double fc = blobby_field(model, c);
        if (!(fc > 0))
            continue;
        Vec3 p = cross_between(model, c, fc, x, f);
        double d = vec3_norm2(vec3_sub(p, x));
        if (d < best) {
            best = d;
            *start = p;
        }
    }
    return best < HUGE_VAL;
}

// Moves p onto f = 0 along the gradient, in steps f/|g| no longer than `longest`. Returns false if it does not converge.
static bool fall_onto_surface(const Blobby *model, Vec3 *p, double longest)
{
    double before = HUGE_VAL;
    for (int i = 0; i < 30; i++) {
        Vec3 g;
        double f = blobby_gradient(model, *p, &g), g2 = vec3_norm2(g);
        if (!(g2 > 1e-200) || !isfinite(f))
            return false;
        double taubin = f / sqrt(g2), size = fabs(taubin);
        // converged if the step is of the size of rounding, or no longer shrinks (another step would only jitter)
        if (size < 1e-14 || (size < 1e-10 && size >= before))
            return true;
        before = size;
        double step = size > longest ? copysign(longest, taubin) : taubin;
        *p = vec3_add_scaled(*p, -step / sqrt(g2), g);
    }
    return before < 1e-9;
}

typedef struct SurfaceFrame {
    Vec3 foot, normal, tangent;  // tangent: P (foot - x)
    Sym3 shape;
    double field, slope, gap;    // slope = |grad f|
} SurfaceFrame;

static Sym3 shape_operator(Vec3 n, double slope, const Sym3 *h)
{
    Vec3 hn = sym3_mul_vec(h, n);
    double nhn = vec3_dot(n, hn), s = 1 / slope;
    // P H P = H - n (Hn)' - (Hn) n' + (n'Hn) n n'
    return (Sym3){s * (h->xx - 2 * n.x * hn.x + nhn * n.x * n.x),          s * (h->xy - n.x * hn.y - n.y * hn.x + nhn * n.x * n.y),
                  s * (h->xz - n.x * hn.z - n.z * hn.x + nhn * n.x * n.z), s * (h->yy - 2 * n.y * hn.y + nhn * n.y * n.y),
                  s * (h->yz - n.y * hn.z - n.z * hn.y + nhn * n.y * n.z), s * (h->zz - 2 * n.z * hn.z + nhn * n.z * n.z)};
}

static bool surface_frame(const Blobby *model, Vec3 x, Vec3 foot, SurfaceFrame *frame)
{
    Vec3 g;
    Sym3 h;
    frame->foot = foot;
    frame->field = blobby_hessian(model, foot, &g, &h);
    frame->slope = vec3_norm(g);
    if (!(frame->slope > 1e-100) || !isfinite(frame->field))
        return false;
    Vec3 n = frame->normal = vec3_scale(g, 1 / frame->slope), away = vec3_sub(foot, x);
    frame->gap = -vec3_dot(away, n);
    frame->tangent = vec3_add_scaled(away, frame->gap, n);
    frame->shape = shape_operator(n, frame->slope, &h);
    return true;
}

// Beyond the focal point the distance is concave along the surface; the absolute eigenvalue still scales a descent step (saddle-free Newton). Near the centre
// of a sphere both eigenvalues are tiny: a fixed lower bound made convergence too slow.
static double descent_divisor(double eigenvalue) { return fmax(fabs(eigenvalue), 1e-6); }

// The tangential Newton step -(I + gap S)^-1 P (foot - x). Sets `least` to the smallest eigenvalue of I + gap S and `weak` to its direction.
static Vec3 tangential_step(const SurfaceFrame *frame, double *least, Vec3 *weak)
{
    Vec3 t1 = vec3_normal_to(frame->normal), t2 = vec3_cross(frame->normal, t1), s1 = sym3_mul_vec(&frame->shape, t1);
    double a = 1 + frame->gap * vec3_dot(t1, s1), b = frame->gap * vec3_dot(t2, s1), c = 1 + frame->gap * sym3_quadratic(&frame->shape, t2);
    double mean = 0.5 * (a + c), spread = sqrt(0.25 * (a - c) * (a - c) + b * b), low = mean - spread, high = mean + spread;
    double angle = 0.5 * same_atan2(2 * b, a - c), cs = same_cos(angle), sn = same_sin(angle);   // direction of the larger eigenvalue
    Vec3 e_high = vec3_add_scaled(vec3_scale(t1, cs), sn, t2), e_low = vec3_add_scaled(vec3_scale(t1, -sn), cs, t2);
    *least = low;
    *weak = e_low;
    double y_high = -vec3_dot(e_high, frame->tangent) / descent_divisor(high);
    double y_low = -vec3_dot(e_low, frame->tangent) / descent_divisor(low);
    return vec3_add_scaled(vec3_scale(e_high, y_high), y_low, e_low);
}

// Slides a foot on the surface to the locally closest point. Returns false if the first step does not return to the surface.
static bool slide_to_closest(const Blobby *model, Vec3 x, Vec3 foot, double scale, SurfaceFrame *best, double *least)
{
    enum { STEPS = 60, KICKS = 2 };
    double trust = 4 * scale + vec3_distance(x, foot);
    int kicks = 0;
    if (!surface_frame(model, x, foot, best))
        return false;
    for (int i = 0; i < STEPS; i++) {
        Vec3 weak;
        Vec3 step = tangential_step(best, least, &weak);
        double length = vec3_norm(step), size = vec3_distance(x, best->foot);
        if (vec3_norm(best->tangent) <= 1e-13 * (1 + size)) {
            // the distance has a maximum along the surface here (x beyond its focal point): leave it sideways, always in the same direction
            if (*least > -1e-3 || kicks == KICKS)
                break;
            kicks++;
            step = vec3_scale(weak, 0.1 * size), length = 0.1 * size;
        }
        bool taken = false;
        SurfaceFrame next;
        double shrink = length > trust ? trust / length : 1;
        for (int half = 0; half < 12 && !taken; half++, shrink *= 0.5) {
            Vec3 p = vec3_add_scaled(best->foot, shrink, step);
            if (!fall_onto_surface(model, &p, scale) || !surface_frame(model, x, p, &next))
                continue;
            // if the distances are equal to within rounding, the smaller tangential residual decides
            double there = vec3_distance(x, p);
            taken = there < size - 1e-13 * (1 + size) || (there <= size + 1e-13 * (1 + size) && vec3_norm(next.tangent) < 0.9 * vec3_norm(best->tangent));
        }
        if (!taken)
            break;
        trust = 2 * vec3_distance(next.foot, best->foot) + 0.1 * scale;
        *best = next;
    }
    return true;
}

static bool start_on_surface(const Blobby *model, Vec3 x, double f, Vec3 g, double scale, Vec3 *start)
{
    if (f > 0) {
        // The closest wall lies roughly where the field falls fastest. Where the gradient vanishes any direction will do, but always the same one.
        return march_out(model, x, f, vec3_unit_or(vec3_negate(g), vec3(1, 0, 0)), scale, HUGE_VAL, start);
    }
    // Near the surface, project onto it; far away the field is no distance, and the crossings towards the blobs are better starts.
    Vec3 near = x;
    double slope = vec3_norm(g);
    if (slope > 1e-100 && -f / slope < scale && fall_onto_surface(model, &near, scale)) {
        *start = near;
        return true;
    }
    return cross_towards_blobs(model, x, f, start);
}

static void keep_closer(const Blobby *model, Vec3 x, Vec3 start, double scale, SurfaceFrame *best, double *least)
{
    SurfaceFrame other;
    double other_least = 1;
    if (slide_to_closest(model, x, start, scale, &other, &other_least) && fabs(other.gap) < fabs(best->gap) - 1e-9) {
        *best = other;
        *least = other_least;
    }
}

// If the normal of a foot puts x on the other side than f does, the foot lies behind a nearer wall (reached from a distant start): moves the foot to that wall.
static void pull_to_own_side(const Blobby *model, Vec3 x, double f, double scale, SurfaceFrame *best, double *least)
{
    static const double fraction[] = {1e-3, 1e-2, 0.1, 0.3};
    enum { FRACTIONS = sizeof fraction / sizeof fraction[0], WALLS = 4 };
    for (int wall = 0; wall < WALLS && (best->gap > 0) != (f > 0) && fabs(best->gap) > 1e-9; wall++) {
        for (int k = 0; k < FRACTIONS; k++) {
            Vec3 beyond = vec3_mix(best->foot, x, fraction[k]);
            double there = blobby_field(model, beyond);
            if ((there > 0) == (f > 0))
                continue;
            keep_closer(model, x, f > 0 ? cross_between(model, x, f, beyond, there) : cross_between(model, beyond, there, x, f), scale, best, least);
            break;
        }
    }
}

SurfacePoint blobby_project(const Blobby *model, Vec3 x, Vec3 start)
{
    SurfacePoint lost = {.foot = vec3(0, 0, 0), .normal = vec3(1, 0, 0)};
    if (model->count < 1 || !vec3_is_finite(x) || !(vec3_norm2(x) < 1e200))
        return lost;
    double scale = local_scale(model), least = 1;
    Vec3 g, foot = start;
    double f = blobby_gradient(model, x, &g);
    bool warm = vec3_is_finite(start) && vec3_norm2(vec3_sub(start, x)) > 0 && fall_onto_surface(model, &foot, scale);
    SurfaceFrame best;
    if ((!warm && !start_on_surface(model, x, f, g, scale, &foot)) || !slide_to_closest(model, x, foot, scale, &best, &least)) {
        // no surface was found: the distance to the first blob's centre is the only information
        Vec3 c = model->center[blobby_row(model, 0)];
        for (int j = 1; j < model->count; j++) {
            Vec3 other = model->center[blobby_row(model, j)];
            if (vec3_norm2(vec3_sub(other, x)) < vec3_norm2(vec3_sub(c, x)))
                c = other;
        }
        lost.foot = c;
        lost.normal = vec3_unit(vec3_sub(c, x));
        lost.distance = -vec3_distance(x, c);
        return lost;
    }
    // Without a last contact, check for closer walls: from inside, along a few rays; from outside, near a focal point, at the blobs' lobes. (On a vessel's axis
    // the field may fall fastest along it, and the first foot would be at the far end.)
    Vec3 other;
    // Rays may also be longer than the distance of the foot, by as much as a flat wall between two rays seems further away. Rays that would only find the same
    // foot again are skipped.
    Vec3 to_foot = vec3_unit_or(vec3_sub(best.foot, x), vec3(0, 0, 0));
    double reach = 1.25 * fabs(best.gap);
    for (int k = 0; k < 14 && !warm && f > 0; k++) {
        static const Vec3 ray[14] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},   {0, -1, 0}, {0, 0, 1},   {0, 0, -1},  {1, 1, 1},
                                     {1, 1, -1}, {1, -1, 1}, {1, -1, -1}, {-1, 1, 1}, {-1, 1, -1}, {-1, -1, 1}, {-1, -1, -1}};
        Vec3 d = vec3_unit(ray[k]);
        if (vec3_dot(d, to_foot) < 0.8 && march_out(model, x, f, d, scale, reach, &other))
            keep_closer(model, x, other, scale, &best, &least);
    }
    if (!warm && f <= 0 && least < 0.5 && cross_towards_blobs(model, x, f, &other))
        keep_closer(model, x, other, scale, &best, &least);
    pull_to_own_side(model, x, f, scale, &best, &least);
    double away = vec3_distance(x, best.foot), rest = vec3_norm(best.tangent);
    return (SurfacePoint){.foot = best.foot,
                          .normal = best.normal,
                          .shape = best.shape,
                          .distance = best.gap,
                          .converged = fabs(best.field) < 1e-9 * best.slope && (away < 1e-6 || rest <= 1e-4 * away)};
}

// Small vectors, matrices and unit quaternions, all double, all inline.
//
// Conventions: Mat3 is row-major, m[row][col]. Sym3 holds the six distinct entries of a symmetric matrix. Quat is (w, x, y, z), |q| = 1, and rotates a body
// vector into space: v_space = q v_body q*. A rotation vector is the angle [rad] times the unit axis. Nothing here allocates.
#ifndef SELDINGER_GEOM_LINEAR_H
#define SELDINGER_GEOM_LINEAR_H

#include "base/base.h"

#include <math.h>
#include <stdbool.h>

#define PI 3.14159265358979323846

typedef struct Vec3 {
    double x, y, z;
} Vec3;

typedef struct Mat3 {
    double m[3][3];
} Mat3;

typedef struct Sym3 {
    double xx, xy, xz, yy, yz, zz;
} Sym3;

typedef struct Quat {
    double w, x, y, z;
} Quat;

static inline Vec3 vec3(double x, double y, double z) { return (Vec3){x, y, z}; }
static inline Vec3 vec3_add(Vec3 a, Vec3 b) { return (Vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline Vec3 vec3_sub(Vec3 a, Vec3 b) { return (Vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline Vec3 vec3_scale(Vec3 a, double s) { return (Vec3){a.x * s, a.y * s, a.z * s}; }
static inline Vec3 vec3_negate(Vec3 a) { return (Vec3){-a.x, -a.y, -a.z}; }
// a + s b
static inline Vec3 vec3_add_scaled(Vec3 a, double s, Vec3 b) { return (Vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }
// a + s (b - a)
static inline Vec3 vec3_mix(Vec3 a, Vec3 b, double s) { return vec3_add_scaled(a, s, vec3_sub(b, a)); }
static inline double vec3_dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vec3 vec3_cross(Vec3 a, Vec3 b) { return (Vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static inline double vec3_norm2(Vec3 a) { return vec3_dot(a, a); }
static inline double vec3_norm(Vec3 a) { return sqrt(vec3_dot(a, a)); }
static inline double vec3_distance(Vec3 a, Vec3 b) { return vec3_norm(vec3_sub(a, b)); }
// Angle [rad] between a and b, which may have any length; 0 to pi.
static inline double vec3_angle(Vec3 a, Vec3 b) { return same_atan2(vec3_norm(vec3_cross(a, b)), vec3_dot(a, b)); }
static inline bool vec3_is_finite(Vec3 a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }
// The unit vector along a; `otherwise` if a is too short to have a direction.
static inline Vec3 vec3_unit_or(Vec3 a, Vec3 otherwise)
{
    double n = vec3_norm(a);
    return n > 1e-300 ? vec3_scale(a, 1 / n) : otherwise;
}
static inline Vec3 vec3_unit(Vec3 a) { return vec3_unit_or(a, (Vec3){1, 0, 0}); }
// A unit vector perpendicular to unit d: the projection of the coordinate axis that follows d's dominant axis cyclically (x -> y -> z -> x), with the sign of
// d's component along it. So it commutes with mirroring in a coordinate plane wherever d is not in that plane: a mirrored scene gets the mirrored frame.
static inline Vec3 vec3_normal_to(Vec3 d)
{
    double ax = fabs(d.x), ay = fabs(d.y), az = fabs(d.z);
    Vec3 axis;
    if (ax >= ay && ax >= az)
        axis = vec3(0, d.y < 0 ? -1 : 1, 0);
    else if (ay >= az)
        axis = vec3(0, 0, d.z < 0 ? -1 : 1);
    else
        axis = vec3(d.x < 0 ? -1 : 1, 0, 0);
    return vec3_unit(vec3_add_scaled(axis, -vec3_dot(axis, d), d));
}

static inline Mat3 mat3_identity(void) { return (Mat3){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }
static inline Mat3 mat3_from_columns(Vec3 a, Vec3 b, Vec3 c) { return (Mat3){{{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}}}; }
static inline Vec3 mat3_column(const Mat3 *a, int j) { return (Vec3){a->m[0][j], a->m[1][j], a->m[2][j]}; }
static inline Vec3 mat3_mul_vec(const Mat3 *a, Vec3 v)
{
    return (Vec3){a->m[0][0] * v.x + a->m[0][1] * v.y + a->m[0][2] * v.z, a->m[1][0] * v.x + a->m[1][1] * v.y + a->m[1][2] * v.z,
                  a->m[2][0] * v.x + a->m[2][1] * v.y + a->m[2][2] * v.z};
}
static inline Mat3 mat3_mul(const Mat3 *a, const Mat3 *b)
{
    Mat3 c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] + a->m[i][2] * b->m[2][j];
    return c;
}
static inline Mat3 mat3_transpose(const Mat3 *a)
{
    return (Mat3){{{a->m[0][0], a->m[1][0], a->m[2][0]}, {a->m[0][1], a->m[1][1], a->m[2][1]}, {a->m[0][2], a->m[1][2], a->m[2][2]}}};
}
// [v]x, so that [v]x w = v x w
static inline Mat3 mat3_skew(Vec3 v) { return (Mat3){{{0, -v.z, v.y}, {v.z, 0, -v.x}, {-v.y, v.x, 0}}}; }

static inline Vec3 sym3_mul_vec(const Sym3 *s, Vec3 v)
{
    return (Vec3){s->xx * v.x + s->xy * v.y + s->xz * v.z, s->xy * v.x + s->yy * v.y + s->yz * v.z, s->xz * v.x + s->yz * v.y + s->zz * v.z};
}
static inline double sym3_quadratic(const Sym3 *s, Vec3 v) { return vec3_dot(v, sym3_mul_vec(s, v)); }
// *s += factor v v'
static inline void sym3_add_outer(Sym3 *s, double factor, Vec3 v)
{
    s->xx += factor * v.x * v.x, s->xy += factor * v.x * v.y, s->xz += factor * v.x * v.z;
    s->yy += factor * v.y * v.y, s->yz += factor * v.y * v.z, s->zz += factor * v.z * v.z;
}
static inline void sym3_add(Sym3 *s, double factor, const Sym3 *a)
{
    s->xx += factor * a->xx, s->xy += factor * a->xy, s->xz += factor * a->xz;
    s->yy += factor * a->yy, s->yz += factor * a->yz, s->zz += factor * a->zz;
}
// *s += factor (a b' + b a')
static inline void sym3_add_pair(Sym3 *s, double factor, Vec3 a, Vec3 b)
{
    s->xx += 2 * factor * a.x * b.x, s->xy += factor * (a.x * b.y + a.y * b.x), s->xz += factor * (a.x * b.z + a.z * b.x);
    s->yy += 2 * factor * a.y * b.y, s->yz += factor * (a.y * b.z + a.z * b.y), s->zz += 2 * factor * a.z * b.z;
}
static inline double sym3_trace(const Sym3 *s) { return s->xx + s->yy + s->zz; }

// Sum of the squares of all nine entries.
static inline double sym3_norm2(const Sym3 *s) { return s->xx * s->xx + s->yy * s->yy + s->zz * s->zz + 2 * (s->xy * s->xy + s->xz * s->xz + s->yz * s->yz); }

static inline Quat quat_identity(void) { return (Quat){1, 0, 0, 0}; }
static inline bool quat_is_unit(Quat q) { return fabs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) < 1e-9; }
static inline Quat quat_conjugate(Quat q) { return (Quat){q.w, -q.x, -q.y, -q.z}; }
static inline Quat quat_mul(Quat a, Quat b)
{
    return (Quat){a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                  a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
static inline Quat quat_unit(Quat q)
{
    double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return n > 0 ? (Quat){q.w / n, q.x / n, q.y / n, q.z / n} : quat_identity();
}
static inline Vec3 quat_rotate(Quat q, Vec3 v)
{
    Vec3 u = {q.x, q.y, q.z}, t = vec3_scale(vec3_cross(u, v), 2);
    return vec3_add(vec3_add_scaled(v, q.w, t), vec3_cross(u, t));
}
static inline Mat3 quat_to_mat3(Quat q)
{
    double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z, xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z, wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
    return (Mat3){{{1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)},
                   {2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)},
                   {2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)}}};
}
// From a right-handed orthonormal matrix (Shepperd's choice of the largest component).
static inline Quat quat_from_mat3(const Mat3 *r)
{
    double t = r->m[0][0] + r->m[1][1] + r->m[2][2];
    Quat q;
    if (t > 0) {
        double s = sqrt(t + 1) * 2;
        q = (Quat){s / 4, (r->m[2][1] - r->m[1][2]) / s, (r->m[0][2] - r->m[2][0]) / s, (r->m[1][0] - r->m[0][1]) / s};
    } else if (r->m[0][0] > r->m[1][1] && r->m[0][0] > r->m[2][2]) {
        double s = sqrt(1 + r->m[0][0] - r->m[1][1] - r->m[2][2]) * 2;
        q = (Quat){(r->m[2][1] - r->m[1][2]) / s, s / 4, (r->m[0][1] + r->m[1][0]) / s, (r->m[0][2] + r->m[2][0]) / s};
    } else if (r->m[1][1] > r->m[2][2]) {
        double s = sqrt(1 + r->m[1][1] - r->m[0][0] - r->m[2][2]) * 2;
        q = (Quat){(r->m[0][2] - r->m[2][0]) / s, (r->m[0][1] + r->m[1][0]) / s, s / 4, (r->m[1][2] + r->m[2][1]) / s};
    } else {
        double s = sqrt(1 + r->m[2][2] - r->m[0][0] - r->m[1][1]) * 2;
        q = (Quat){(r->m[1][0] - r->m[0][1]) / s, (r->m[0][2] + r->m[2][0]) / s, (r->m[1][2] + r->m[2][1]) / s, s / 4};
    }
    return quat_unit(q);
}
static inline Quat quat_from_rotation_vector(Vec3 w)
{
    double a = vec3_norm(w);
    // sin(a/2)/a by its series where a^4 is below rounding
    double s = a > 1e-4 ? same_sin(a / 2) / a : 0.5 - a * a / 48;
    return (Quat){same_cos(a / 2), s * w.x, s * w.y, s * w.z};
}
// The rotation vector of the shorter rotation, |w| <= pi.
static inline Vec3 quat_to_rotation_vector(Quat q)
{
    if (q.w < 0)
        q = (Quat){-q.w, -q.x, -q.y, -q.z};
    double n = sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
    double s = n > 1e-8 ? 2 * same_atan2(n, q.w) / n : 2 / q.w;
    return (Vec3){s * q.x, s * q.y, s * q.z};
}

#endif

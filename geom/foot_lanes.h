// Newton iteration for feet (closest wall points), in lanes of points: the arithmetic between two evaluations of blob_lanes.h, one batch at a time.
//
// The foot p of X minimises |p - X| on f = 0. With n = g/|g|, P = I - n n', S = P H P/|g|, gap = (X - p).n, r = P (p - X), one step is
//   p += t + nu n,  t = -(I + gap S)^-1 r,  nu = -(f/|g| + t'S t / 2);
// the quadratic term makes one step from a predicted foot nearly always enough. S has two eigenvalues across n, so that with T = tr S, D = k1 k2
//   (I + gap S)^-1 = ((1 + gap T) P - gap S) / (1 + gap T + gap^2 D),   S (I + gap S)^-1 = (S + gap D P) / (1 + gap T + gap^2 D)
// and neither step nor result needs a tangent frame or a square root (and a mirrored or rotated scene gets the mirrored or rotated result).
//
// The wall of another model, the partner, is evaluated at the point's own foot p (or a better point q), not at a foot of its own. With u = g_k/|g_k| there, d =
// X - q, e = d - (d.u) u and A the Hessian of the own gap, the distance of X from the partner's wall and the gradient of that distance are, to second order in
// e,
//   gap_k = s + d.u + e'A e / 2,   n_k = u + A e,   s = t / (1 - t n'H n / (2 |g|)),   t = f_k/|g_k|.
// Where the walls differ much, f_k is evaluated a second time, at q = X - gap_k n_k.
//
// Layout: one array of FOOT_BATCH doubles per quantity, one lane per point. Lanes are independent. Compiled for each instruction set, with IEEE operations
// only, so that all give the same bits.
#ifndef SELDINGER_GEOM_FOOT_LANES_H
#define SELDINGER_GEOM_FOOT_LANES_H

#include "geom/blob_lanes.h"

#include <stdbool.h>

enum { FOOT_BATCH = 80, FOOT_BLOCK = 8 };   // lanes per batch, and lanes computed together
// A partner is evaluated twice where its wall is further from the own wall than this fraction of the radius, or its normal differs by more than this, squared.
#define FOOT_LOOK_WALL 0.05
#define FOOT_LOOK_TURN 0.02
// Walls that differ by more than this fraction of the radius, or by this [mm], are not blended.
#define FOOT_AGREE_RADII 0.5
#define FOOT_AGREE 0.8

// An exact step leaves about sqrt(FOOT_THIRD) times its length cubed, in units of the curvature, of the gap: see test_field_vessel.c.
#define FOOT_THIRD 25.0

// State of a lane; a double, so that it is kept in the same vectors.
#define FOOT_PENDING 0.0
#define FOOT_DONE 1.0
#define FOOT_DEEP 2.0        // X is near or beyond a focal point of this foot; careful steps continue to a local minimum of the distance, or to the other side
#define FOOT_LOST 3.0

typedef double FootLane[FOOT_BATCH];

// Value and derivatives of the field at the lanes' points, each lane with its own model.
typedef struct FootSample {
    const BlobGroup *group[FOOT_BATCH];
    int groups[FOOT_BATCH];
    bool carried[FOOT_BATCH], any_carried;   // near the inlet, see lim_vessel.c
    FootLane x, y, z;                // [mm]
    FootLane f, gx, gy, gz, hxx, hxy, hxz, hyy, hyz, hzz;
} FootSample;

typedef struct FootBatch {
    // input
    FootLane xx, xy, xz;             // X [mm]
    FootLane radius, bend;           // of the node [mm], the length scale of the problem; and its inverse
    FootLane unique;                 // [mm] a foot closer than this, in the node's cell, is the closest
    FootLane longest;                // [mm] upper bound of a step; unless careful, a longer step makes the lane FOOT_LOST
    FootLane allowed;                // [mm] |f|/|g| at which a foot is accepted; its position may be off by a hundred times that
    FootSample at;                   // the current foot
    // Remembered, for foot_predict: at.x.. holds the foot, at.gx.. the X that it belongs to, nx.. the normal, axx.. the Hessian of the gap.
    FootLane inside;                 // 1 or 0; after foot_predict: the start is near, and closer than `unique`
    FootLane estimate;               // see foot_estimate
    // output
    FootLane state;
    FootLane nx, ny, nz, gap;        // unit normal, signed distance
    FootLane half;                   // n'H n / (2 |g|) [1/mm]
    FootLane sxx, sxy, sxz, syy, syz, szz;   // S …
    FootLane axx, axy, axz, ayy, ayz, azz;   // … and the gap's Hessian at X
} FootBatch;

// Results of a partner for the lanes of a batch.
typedef struct FootPartner {
    FootSample at;                   // at the own feet, or at points moved from there
    FootLane weight;                 // 0: none
    FootLane gap, nx, ny, nz;        // at X
    FootLane move;                   // > 0 where a second evaluation at a better point is due; the weight of that evaluation …
    FootLane tox, toy, toz;          // … and its point
} FootPartner;

// Weighted sums of the differences between the partners' results and the own result, then the blended wall.
typedef struct FootMixture {
    FootLane total, gap, nx, ny, nz;
} FootMixture;

// Predicts where a block's feet are now, as the start of Newton: t = (I + gap S)^-1 P dx = P dx - gap A dx along the wall, A the earlier Hessian of the gap,
// and down by t'S t / 2 = t'A dx / 2.
static inline __attribute__((always_inline)) void foot_predict(FootBatch *restrict b, int block, double allowed)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double nx = b->nx[i], ny = b->ny[i], nz = b->nz[i], px = b->at.x[i], py = b->at.y[i], pz = b->at.z[i], radius = b->radius[i];
        double gap = (b->at.gx[i] - px) * nx + (b->at.gy[i] - py) * ny + (b->at.gz[i] - pz) * nz;
        double dx = b->xx[i] - b->at.gx[i], dy = b->xy[i] - b->at.gy[i], dz = b->xz[i] - b->at.gz[i];
        double bx = b->axx[i] * dx + b->axy[i] * dy + b->axz[i] * dz, by = b->axy[i] * dx + b->ayy[i] * dy + b->ayz[i] * dz,
               bz = b->axz[i] * dx + b->ayz[i] * dy + b->azz[i] * dz;
        double closer = dx * nx + dy * ny + dz * nz, tx = dx - closer * nx - gap * bx, ty = dy - closer * ny - gap * by, tz = dz - closer * nz - gap * bz;
        double down = 0.5 * (tx * bx + ty * by + tz * bz), near = tx * tx + ty * ty + tz * tz < 0.04 * radius * radius ? 1.0 : 0.0;
        px = near > 0 ? px + tx - down * nx : px, py = near > 0 ? py + ty - down * ny : py, pz = near > 0 ? pz + tz - down * nz : pz;
        b->at.x[i] = px, b->at.y[i] = py, b->at.z[i] = pz;
        near = gap + closer < b->unique[i] ? near : 0.0;
        b->inside[i] = gap + closer > -0.05 * radius ? near : 0.0;
        b->longest[i] = 0.5 * radius;
        b->allowed[i] = allowed;
        b->state[i] = FOOT_PENDING;
    }
}

// One step of a block's pending lanes from their samples. `careful`: continues near focal points, with bounded steps. `exact`: also accounts for the rotation
// of the normal by the step down to the wall, w = P H n / |g| per millimetre, and for the bend of the field on that step:
//   t = -(I + g S)^-1 (r + g nu w), g = gap - nu, nu = -f/|g|;   nu = -q / (1 + w.t - n'H n q / (2 |g|)), q = f/|g| + t'S t / 2.
// The remaining error of the gap is of third order in the step.
static inline __attribute__((always_inline)) void foot_newton(FootBatch *restrict b, int block, const bool careful, const bool exact)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double gx = b->at.gx[i], gy = b->at.gy[i], gz = b->at.gz[i], slope2 = gx * gx + gy * gy + gz * gz;
        double flat = 1 / sqrt(slope2 > 1e-200 ? slope2 : 1.0);
        double nx = gx * flat, ny = gy * flat, nz = gz * flat;
        double px = b->at.x[i], py = b->at.y[i], pz = b->at.z[i], dx = px - b->xx[i], dy = py - b->xy[i], dz = pz - b->xz[i];
        double gap = -(dx * nx + dy * ny + dz * nz), rx = dx + gap * nx, ry = dy + gap * ny, rz = dz + gap * nz;
        // S = (H - n v' - v n' + (n.v) n n') / |g|, v = H n
        double xx = b->at.hxx[i] * flat, xy = b->at.hxy[i] * flat, xz = b->at.hxz[i] * flat, yy = b->at.hyy[i] * flat, yz = b->at.hyz[i] * flat,
               zz = b->at.hzz[i] * flat;
        double vx = xx * nx + xy * ny + xz * nz, vy = xy * nx + yy * ny + yz * nz, vz = xz * nx + yz * ny + zz * nz;
        double half = 0.5 * (nx * vx + ny * vy + nz * vz);
        vx -= half * nx, vy -= half * ny, vz -= half * nz;
        xx -= 2 * nx * vx, xy -= nx * vy + ny * vx, xz -= nx * vz + nz * vx;
        yy -= 2 * ny * vy, yz -= ny * vz + nz * vy, zz -= 2 * nz * vz;
        double trace = xx + yy + zz, size2 = xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz);   // k1^2 + k2^2
        double product = 0.5 * (trace * trace - size2);
        double taubin = b->at.f[i] * flat, longest = b->longest[i], wx = 0, wy = 0, wz = 0;
        if (exact) {
            double down = taubin < longest ? taubin : longest;
            down = down > -longest ? down : -longest;
            wx = vx - half * nx, wy = vy - half * ny, wz = vz - half * nz;   // by now v is H n / |g| minus half of its component along n
            gap += down;
            rx -= gap * down * wx, ry -= gap * down * wy, rz -= gap * down * wz;
        }
        // both 1 + gap k > 0.1: the product and the sum of (0.9 + gap k) are positive
        double deep = 0.81 + gap * (0.9 * trace + gap * product) > 0 && 1.8 + gap * trace > 0 ? 0.0 : 1.0;
        double c0, c1;
        if (careful) {
            // phi = 1 / (1 + gap k); beyond focal points, by absolute value
            double spread = sqrt(0.5 * size2 - 0.25 * trace * trace > 0 ? 0.5 * size2 - 0.25 * trace * trace : 0.0);
            double k1 = 0.5 * trace + spread, k2 = 0.5 * trace - spread, a1 = fabs(1 + gap * k1), a2 = fabs(1 + gap * k2);
            double phi1 = 1 / (a1 > 1e-3 ? a1 : 1e-3), phi2 = 1 / (a2 > 1e-3 ? a2 : 1e-3);
            c1 = spread > 1e-9 * fabs(trace) ? (phi1 - phi2) / (2 * (spread > 1e-300 ? spread : 1.0)) : 0.0, c0 = phi1 - c1 * k1;
        } else {
            // where that step is not allowed the foot keeps its tangential position, and careful steps continue from there
            double all = deep > 0 ? 0.0 : 1 / (deep > 0 ? 1.0 : 1 + gap * (trace + gap * product));
            c0 = all * (1 + gap * trace), c1 = -all * gap;
        }
        double tx = -(c0 * rx + c1 * (xx * rx + xy * ry + xz * rz)), ty = -(c0 * ry + c1 * (xy * rx + yy * ry + yz * rz)),
               tz = -(c0 * rz + c1 * (xz * rx + yz * ry + zz * rz));
        double along2 = tx * tx + ty * ty + tz * tz;
        double far = fabs(taubin) > longest || along2 > longest * longest ? 1.0 : 0.0;
        if (careful) {
            double shrink = along2 > longest * longest ? longest / sqrt(along2) : 1.0;
            taubin = taubin > longest ? longest : taubin;
            taubin = taubin < -longest ? -longest : taubin;
            tx *= shrink, ty *= shrink, tz *= shrink, along2 *= shrink * shrink;
        }
        double sx = xx * tx + xy * ty + xz * tz, sy = xy * tx + yy * ty + yz * tz, sz = xz * tx + yz * ty + zz * tz;   // S t
        double nu = -(taubin + 0.5 * (tx * sx + ty * sy + tz * sz));
        if (exact) {
            double rate = 1 + (wx * tx + wy * ty + wz * tz) + half * nu;
            nu /= rate > 0.5 ? rate : 0.5;
            sx += nu * wx, sy += nu * wy, sz += nu * wz;
        }
        double step2 = nu * nu;
        px += tx + nu * nx, py += ty + nu * ny, pz += tz + nu * nz;
        // What the step leaves, squared: in the foot's position (hence the normal) second order, in f/|g| third order, in units of the curvature.
        double allowed = b->allowed[i] * b->allowed[i], curl = 2 * (size2 + b->bend[i] * b->bend[i]), left = curl * along2 * along2;
        double done;
        if (exact) {
            double all2 = along2 + step2, whole = curl * all2 * all2, tilt = gap * curl * whole;   // tilt: error of X's distance due to the normal's error
            done = whole < 1e4 * allowed && FOOT_THIRD * curl * all2 * whole < allowed && tilt * tilt < allowed ? 1.0 : 0.0;
        } else {
            done = left < 1e4 * allowed && 4 * curl * (along2 + step2) * (left + step2) < allowed ? 1.0 : 0.0;
        }
        // The normal rotates by S t along the step; the change of its length is small if this is the last step.
        double turn2 = sx * sx + sy * sy + sz * sz, unit = 1 - turn2 * (0.5 - 0.375 * turn2);
        nx = (nx + sx) * unit, ny = (ny + sy) * unit, nz = (nz + sz) * unit;
        double state = done > 0 ? FOOT_DONE : FOOT_PENDING;
        if (!careful) {
            state = far > 0 ? FOOT_LOST : state;
            state = deep > 0 ? FOOT_DEEP : state;
        }
        state = slope2 > 1e-200 ? state : FOOT_LOST;
        double held = b->state[i];
        b->state[i] = held == FOOT_PENDING ? state : held;
        b->at.x[i] = held == FOOT_PENDING ? px : b->at.x[i], b->at.y[i] = held == FOOT_PENDING ? py : b->at.y[i];
        b->at.z[i] = held == FOOT_PENDING ? pz : b->at.z[i];
        b->nx[i] = held == FOOT_PENDING ? nx : b->nx[i], b->ny[i] = held == FOOT_PENDING ? ny : b->ny[i], b->nz[i] = held == FOOT_PENDING ? nz : b->nz[i];
        b->half[i] = held == FOOT_PENDING ? half : b->half[i];
        b->sxx[i] = held == FOOT_PENDING ? xx : b->sxx[i], b->sxy[i] = held == FOOT_PENDING ? xy : b->sxy[i], b->sxz[i] = held == FOOT_PENDING ? xz : b->sxz[i];
        b->syy[i] = held == FOOT_PENDING ? yy : b->syy[i], b->syz[i] = held == FOOT_PENDING ? yz : b->syz[i], b->szz[i] = held == FOOT_PENDING ? zz : b->szz[i];
    }
}

// Gap and Hessian at X of a block from foot, normal and S. Near focal points the gap in the Hessian is limited so that both 1 + gap k are at least 0.1.
static inline __attribute__((always_inline)) void foot_finish(FootBatch *restrict b, int block)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double nx = b->nx[i], ny = b->ny[i], nz = b->nz[i];
        double gap = (b->xx[i] - b->at.x[i]) * nx + (b->xy[i] - b->at.y[i]) * ny + (b->xz[i] - b->at.z[i]) * nz;
        b->gap[i] = gap;
        // S is that of the last evaluation, and the normal has rotated slightly since: project S across the new normal.
        double xx = b->sxx[i], xy = b->sxy[i], xz = b->sxz[i], yy = b->syy[i], yz = b->syz[i], zz = b->szz[i];
        double vx = xx * nx + xy * ny + xz * nz, vy = xy * nx + yy * ny + yz * nz, vz = xz * nx + yz * ny + zz * nz;
        double half = 0.5 * (nx * vx + ny * vy + nz * vz);
        vx -= half * nx, vy -= half * ny, vz -= half * nz;
        xx -= 2 * nx * vx, xy -= nx * vy + ny * vx, xz -= nx * vz + nz * vx;
        yy -= 2 * ny * vy, yz -= ny * vz + nz * vy, zz -= 2 * nz * vz;
        double trace = xx + yy + zz, size2 = xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz), product = 0.5 * (trace * trace - size2);
        double spread2 = 0.5 * size2 - 0.25 * trace * trace, spread = sqrt(spread2 > 0 ? spread2 : 0.0);
        double least = 0.5 * trace + (gap > 0 ? -spread : spread), held = 1 + gap * least < 0.1 ? -0.9 / (1 + gap * least < 0.1 ? least : 1.0) : gap;
        double c1 = 1 / (1 + held * (trace + held * product)), c0 = c1 * held * product;
        b->axx[i] = c0 * (1 - nx * nx) + c1 * xx, b->axy[i] = c1 * xy - c0 * nx * ny, b->axz[i] = c1 * xz - c0 * nx * nz;
        b->ayy[i] = c0 * (1 - ny * ny) + c1 * yy, b->ayz[i] = c1 * yz - c0 * ny * nz, b->azz[i] = c0 * (1 - nz * nz) + c1 * zz;
    }
}

// A block's Newton steps on W, see lim_vessel.c: inside a single blob, never below the distance.
static inline __attribute__((always_inline)) void foot_estimate(const FootSample *restrict s, double *restrict estimate, int block, double iso_level)
{
    double level = 1 / sqrt(iso_level);
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double gx = s->gx[i], gy = s->gy[i], gz = s->gz[i], slope2 = gx * gx + gy * gy + gz * gz, f = s->f[i];
        double sum = f + iso_level, root = sqrt(sum), part = sum * fabs(1 - level * root);   // |W| / w^3
        estimate[i] = slope2 > 1e-280 ? 2 * part / sqrt(slope2 > 1e-280 ? slope2 : 1.0) : 1e300;
    }
}

// A partner's results in a block, from its samples at `s->at`. With `second`, they replace the first ones in proportion to `move`.
static inline __attribute__((always_inline)) void foot_partner(const FootBatch *restrict b, FootPartner *restrict s, int block, const bool second)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double gx = s->at.gx[i], gy = s->at.gy[i], gz = s->at.gz[i], slope2 = gx * gx + gy * gy + gz * gz;
        double flat = 1 / sqrt(slope2 > 1e-200 ? slope2 : 1.0), ux = gx * flat, uy = gy * flat, uz = gz * flat;
        double taubin = s->at.f[i] * flat, bent = b->half[i] * taubin;
        bent = bent > 0.4 ? 0.4 : bent;
        bent = bent < -0.4 ? -0.4 : bent;
        double away = taubin / (1 - bent);
        double dx = b->xx[i] - s->at.x[i], dy = b->xy[i] - s->at.y[i], dz = b->xz[i] - s->at.z[i], along = dx * ux + dy * uy + dz * uz;
        dx -= along * ux, dy -= along * uy, dz -= along * uz;
        double cx = b->axx[i] * dx + b->axy[i] * dy + b->axz[i] * dz, cy = b->axy[i] * dx + b->ayy[i] * dy + b->ayz[i] * dz,
               cz = b->axz[i] * dx + b->ayz[i] * dy + b->azz[i] * dz;
        double gap = away + along + 0.5 * (dx * cx + dy * cy + dz * cz), nx = ux + cx, ny = uy + cy, nz = uz + cz;
        if (second) {
            double part = s->move[i];
            s->gap[i] += part * (gap - s->gap[i]);
            s->nx[i] += part * (nx - s->nx[i]), s->ny[i] += part * (ny - s->ny[i]), s->nz[i] += part * (nz - s->nz[i]);
        } else {
            double ax = nx - b->nx[i], ay = ny - b->ny[i], az = nz - b->nz[i], turn = (ax * ax + ay * ay + az * az) / FOOT_LOOK_TURN;
            double far = away * b->bend[i] / FOOT_LOOK_WALL, most = far * far > turn ? far * far : turn, part = most - 1;
            part = part > 0 ? part : 0.0, part = part < 1 ? part : 1.0;
            s->gap[i] = gap, s->nx[i] = nx, s->ny[i] = ny, s->nz[i] = nz;
            // best available estimate of X's foot on the partner's wall
            s->tox[i] = b->xx[i] - gap * nx, s->toy[i] = b->xy[i] - gap * ny, s->toz[i] = b->xz[i] - gap * nz;
            s->move[i] = slope2 > 1e-200 ? part * part * (3 - 2 * part) : 0.0;
        }
        s->weight[i] = slope2 > 1e-200 ? s->weight[i] : 0.0;
    }
}

// Adds a partner's results to the mixture, with a weight that falls with their difference from the own result and is 0 where they disagree altogether.
static inline __attribute__((always_inline)) void foot_mix(const FootBatch *restrict b, const FootPartner *restrict s, FootMixture *restrict m, int block)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double agree = FOOT_AGREE_RADII * b->radius[i], differs = s->gap[i] - b->gap[i];
        double q = differs / (agree < FOOT_AGREE ? agree : FOOT_AGREE), near = 1 - q * q;
        double cosine = s->nx[i] * b->nx[i] + s->ny[i] * b->ny[i] + s->nz[i] * b->nz[i], turned = 4 * cosine - 2;   // 1 up to 41 degrees, 0 at 60
        turned = turned < 1 ? turned : 1.0;
        near = near > 0 ? near : 0.0, turned = turned > 0 ? turned : 0.0;
        double w = s->weight[i] * near * near * turned * turned * (3 - 2 * turned);
        m->total[i] += w;
        m->gap[i] += w * differs;
        m->nx[i] += w * (s->nx[i] - b->nx[i]), m->ny[i] += w * (s->ny[i] - b->ny[i]), m->nz[i] += w * (s->nz[i] - b->nz[i]);
    }
}

// The blended walls of a block from the sums.
static inline __attribute__((always_inline)) void foot_settle(const FootBatch *restrict b, FootMixture *restrict m, int block)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double share = 1 / (1 + m->total[i]), nx = b->nx[i] + share * m->nx[i], ny = b->ny[i] + share * m->ny[i], nz = b->nz[i] + share * m->nz[i];
        double length2 = nx * nx + ny * ny + nz * nz, unit = 1 / sqrt(length2 > 1e-200 ? length2 : 1.0);
        m->gap[i] = b->gap[i] + share * m->gap[i];
        m->nx[i] = nx * unit, m->ny[i] = ny * unit, m->nz[i] = nz * unit;
    }
}

// Nodes near a node, eight at a time, as planes: with y = X - C_i and e = C_j - C_i, the power distance of node j exceeds that of i by |e|^2 + r_i^2 - r_j^2 -
// 2 e.y. In single precision, which changes a weight by 1e-6.
enum { NEAR_GROUP = 8 };
typedef struct NearGroup {
    float base[NEAR_GROUP] __attribute__((aligned(32)));
    float ex[NEAR_GROUP], ey[NEAR_GROUP], ez[NEAR_GROUP];    // 2 e
    float band[NEAR_GROUP];          // 1 / width of the blending zone [1/mm^2]
    int node[NEAR_GROUP];            // -1: none
} NearGroup;

// The kernels of foot_lanes.h and blob_lanes.h for one instruction set.
typedef struct LaneKernels {
    const char *isa;
    // Field and gradient (and Hessian) of `count` lanes. Many at a time: a single evaluation waits 35 ns for its own division and sums, and others fit into
    // that gap.
    void (*gradient)(FootSample *sample, const int *lane, int count, double iso_level);
    void (*hessian)(FootSample *sample, const int *lane, int count, double iso_level);
    // The following work on the first `count` lanes, in whole blocks: the rest of the last block must hold numbers. `newton` skips blocks whose lanes are all
    // done, and returns whether some lane is not done.
    void (*predict)(FootBatch *batch, int count, double allowed);   // leaves the lanes pending, and the rest of the last block done
    bool (*newton)(FootBatch *batch, int count, bool careful);
    void (*finish)(FootBatch *batch, int count);
    void (*estimate)(const FootSample *at_x, double *estimate, int count, double iso_level);
    void (*partner)(const FootBatch *batch, FootPartner *partner, int count, bool second);
    void (*mix)(const FootBatch *batch, const FootPartner *partner, FootMixture *mixture, int count);
    void (*settle)(const FootBatch *batch, FootMixture *mixture, int count);
    // Returns the bits of the group's nodes in whose blending zone y lies (see NearGroup), their weights, and sets bits in `better` where y lies in that node's
    // own cell.
    unsigned (*near)(const NearGroup *group, const float y[3], float weight[NEAR_GROUP], unsigned *better);
} LaneKernels;
// isa: 0: the widest that simd_level() allows, 1 SSE2, 2 AVX2, 3 AVX-512; if absent, the next narrower one.
const LaneKernels *lane_kernels(int isa);

#endif

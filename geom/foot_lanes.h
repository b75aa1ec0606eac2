// Newton on feet, in lanes of points: the arithmetic between two evaluations of blob_lanes.h, for a batch at a time.
//
// The foot p of X minimises |p - X| on f = 0. With n = g/|g|, P = I - n n', S = P H P/|g|, gap = (X - p).n, r = P (p - X), one step is
//   p += t + nu n,  t = -(I + gap S)^-1 r,  nu = -(f/|g| + t'S t / 2);
// the quadratic term makes one step from a predicted foot nearly always enough. S has two eigenvalues k across n; functions of S are linear in it,
//   phi(S) = c0 P + c1 S,  c1 = (phi(k1) - phi(k2)) / (k1 - k2),  c0 = phi(k1) - c1 k1,
// so that neither step nor answer needs a tangent frame (and a mirrored or turned scene gets the mirrored or turned answer).
//
// Layout: one array of BATCH doubles for each quantity, a lane for each point. Lanes do not see each other. Compiled for each instruction set; only
// IEEE operations, so that all give the same bits.
#ifndef SELDINGER_GEOM_FOOT_LANES_H
#define SELDINGER_GEOM_FOOT_LANES_H

#include "geom/blob_lanes.h"

enum { FOOT_BATCH = 32, FOOT_BLOCK = 8 };   // lanes a batch, and lanes that are computed together

// State of a lane, as a double so that it lives in the same vectors.
#define FOOT_PENDING 0.0
#define FOOT_DONE 1.0
#define FOOT_DEEP 2.0        // X is near or beyond a focal point of this foot: another side may be closer
#define FOOT_LOST 3.0

typedef double FootLane[FOOT_BATCH];

typedef struct FootBatch {
    // in
    const BlobGroup *group[FOOT_BATCH];      // the lane's model
    int groups[FOOT_BATCH];
    FootLane xx, xy, xz;             // X [mm]
    FootLane radius;                 // of the node [mm], the scale of the problem
    FootLane longest;                // [mm] bound of a step; where not careful a longer one makes the lane FOOT_LOST
    FootLane careful;                // 1: go on near focal points, with bounded steps
    FootLane allowed;                // [mm] rest of |f|/|g| with which a foot is good enough; its place may be off by a hundred times that
    // the running foot and the sample there
    FootLane px, py, pz;
    FootLane f, gx, gy, gz, hxx, hxy, hxz, hyy, hyz, hzz;
    // the field at X
    FootLane inside;                 // 1 or 0
    FootLane estimate;               // Newton's step on W, see lim_vessel.c: inside one blob never below the distance
    // out
    FootLane state;
    FootLane nx, ny, nz, gap;        // unit normal, signed distance
    FootLane k1, k2;                 // principal curvatures of the distance, k1 >= k2 [1/mm]
    FootLane sxx, sxy, sxz, syy, syz, szz;   // S …
    FootLane axx, axy, axz, ayy, ayz, azz;   // … and the gap's Hessian at X, S (I + gap S)^-1
} FootBatch;

// One step of a block's pending lanes from their samples.
static inline __attribute__((always_inline)) void foot_newton(FootBatch *restrict b, int block)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double gx = b->gx[i], gy = b->gy[i], gz = b->gz[i], slope2 = gx * gx + gy * gy + gz * gz;
        double flat = 1 / sqrt(slope2 > 1e-200 ? slope2 : 1.0);
        double nx = gx * flat, ny = gy * flat, nz = gz * flat;
        double px = b->px[i], py = b->py[i], pz = b->pz[i], dx = px - b->xx[i], dy = py - b->xy[i], dz = pz - b->xz[i];
        double gap = -(dx * nx + dy * ny + dz * nz), rx = dx + gap * nx, ry = dy + gap * ny, rz = dz + gap * nz;
        // S = (H - n v' - v n' + (n.v) n n') / |g|, v = H n
        double xx = b->hxx[i] * flat, xy = b->hxy[i] * flat, xz = b->hxz[i] * flat, yy = b->hyy[i] * flat, yz = b->hyz[i] * flat,
               zz = b->hzz[i] * flat;
        double vx = xx * nx + xy * ny + xz * nz, vy = xy * nx + yy * ny + yz * nz, vz = xz * nx + yz * ny + zz * nz;
        double half = 0.5 * (nx * vx + ny * vy + nz * vz);
        vx -= half * nx, vy -= half * ny, vz -= half * nz;
        xx -= 2 * nx * vx, xy -= nx * vy + ny * vx, xz -= nx * vz + nz * vx;
        yy -= 2 * ny * vy, yz -= ny * vz + nz * vy, zz -= 2 * nz * vz;
        double mean = 0.5 * (xx + yy + zz);
        double spread2 = 0.5 * (xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz)) - mean * mean;
        double spread = sqrt(spread2 > 0 ? spread2 : 0.0), k1 = mean + spread, k2 = mean - spread;
        // phi = 1 / (1 + gap k), beyond focal points by its size
        double m1 = 1 + gap * k1, m2 = 1 + gap * k2, a1 = fabs(m1), a2 = fabs(m2);
        double deep = (m1 < 0.1 ? 1.0 : 0.0) + (m2 < 0.1 ? 1.0 : 0.0);
        double phi1 = 1 / (a1 > 0.05 ? a1 : 0.05), phi2 = 1 / (a2 > 0.05 ? a2 : 0.05);
        double c1 = spread > 1e-9 * fabs(mean) ? (phi1 - phi2) / (2 * (spread > 1e-300 ? spread : 1.0)) : 0.0, c0 = phi1 - c1 * k1;
        double tx = -(c0 * rx + c1 * (xx * rx + xy * ry + xz * rz)), ty = -(c0 * ry + c1 * (xy * rx + yy * ry + yz * rz)),
               tz = -(c0 * rz + c1 * (xz * rx + yz * ry + zz * rz));
        double taubin = b->f[i] * flat, longest = b->longest[i], along = sqrt(tx * tx + ty * ty + tz * tz);
        double far = (fabs(taubin) > longest ? 1.0 : 0.0) + (along > longest ? 1.0 : 0.0);
        double shrink = along > longest ? longest / along : 1.0;
        taubin = taubin > longest ? longest : taubin;
        taubin = taubin < -longest ? -longest : taubin;
        tx *= shrink, ty *= shrink, tz *= shrink, along *= shrink;
        double sx = xx * tx + xy * ty + xz * tz, sy = xy * tx + yy * ty + yz * tz, sz = xz * tx + yz * ty + zz * tz;   // S t
        double nu = -(taubin + 0.5 * (tx * sx + ty * sy + tz * sz)), size = fabs(nu);
        px += tx + nu * nx, py += ty + nu * ny, pz += tz + nu * nz;
        // what the step leaves: of the foot's place (hence the normal) second order, of f/|g| third order, in units of the curvature
        double allowed = b->allowed[i], curl = fabs(mean) + spread + 1 / b->radius[i], left = curl * along * along;
        double done = left < 100 * allowed && curl * (along + size) * (left + size) < allowed ? 1.0 : 0.0;
        // the normal turns by S t along the step
        nx += sx, ny += sy, nz += sz;
        double unit = 1 / sqrt(nx * nx + ny * ny + nz * nz);
        nx *= unit, ny *= unit, nz *= unit;
        double careful = b->careful[i], state = done > 0 ? FOOT_DONE : FOOT_PENDING;
        state = far > careful * 2 ? FOOT_LOST : state;
        state = deep > careful * 2 ? FOOT_DEEP : state;
        state = slope2 > 1e-200 ? state : FOOT_LOST;
        double held = b->state[i];
        b->state[i] = held == FOOT_PENDING ? state : held;
        b->px[i] = held == FOOT_PENDING ? px : b->px[i], b->py[i] = held == FOOT_PENDING ? py : b->py[i], b->pz[i] = held == FOOT_PENDING ? pz : b->pz[i];
        b->nx[i] = held == FOOT_PENDING ? nx : b->nx[i], b->ny[i] = held == FOOT_PENDING ? ny : b->ny[i], b->nz[i] = held == FOOT_PENDING ? nz : b->nz[i];
        b->k1[i] = held == FOOT_PENDING ? k1 : b->k1[i], b->k2[i] = held == FOOT_PENDING ? k2 : b->k2[i];
        b->sxx[i] = held == FOOT_PENDING ? xx : b->sxx[i], b->sxy[i] = held == FOOT_PENDING ? xy : b->sxy[i], b->sxz[i] = held == FOOT_PENDING ? xz : b->sxz[i];
        b->syy[i] = held == FOOT_PENDING ? yy : b->syy[i], b->syz[i] = held == FOOT_PENDING ? yz : b->syz[i], b->szz[i] = held == FOOT_PENDING ? zz : b->szz[i];
    }
}

// Gap and Hessian at X of a block from foot, normal and S: phi(k) = k / (1 + gap k), the divisor held at 0.1 near focal points.
static inline __attribute__((always_inline)) void foot_finish(FootBatch *restrict b, int block)
{
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double nx = b->nx[i], ny = b->ny[i], nz = b->nz[i];
        double gap = (b->xx[i] - b->px[i]) * nx + (b->xy[i] - b->py[i]) * ny + (b->xz[i] - b->pz[i]) * nz;
        double k1 = b->k1[i], k2 = b->k2[i], m1 = 1 + gap * k1, m2 = 1 + gap * k2, spread = k1 - k2;
        m1 = m1 > 0.1 ? m1 : 0.1, m2 = m2 > 0.1 ? m2 : 0.1;
        double phi1 = k1 / m1, phi2 = k2 / m2;
        double c1 = spread > 1e-6 * (fabs(k1) + fabs(k2)) ? (phi1 - phi2) / (spread > 1e-300 ? spread : 1.0) : 1 / (m1 * m2);
        double c0 = phi1 - c1 * k1;
        b->gap[i] = gap;
        // S is that of the last evaluation, the normal has turned a little since: c0 P + c1 S across the new one
        double xx = b->sxx[i], xy = b->sxy[i], xz = b->sxz[i], yy = b->syy[i], yz = b->syz[i], zz = b->szz[i];
        double vx = xx * nx + xy * ny + xz * nz, vy = xy * nx + yy * ny + yz * nz, vz = xz * nx + yz * ny + zz * nz;
        double half = 0.5 * (nx * vx + ny * vy + nz * vz);
        vx -= half * nx, vy -= half * ny, vz -= half * nz;
        b->axx[i] = c0 * (1 - nx * nx) + c1 * (xx - 2 * nx * vx), b->axy[i] = -c0 * nx * ny + c1 * (xy - nx * vy - ny * vx);
        b->axz[i] = -c0 * nx * nz + c1 * (xz - nx * vz - nz * vx), b->ayy[i] = c0 * (1 - ny * ny) + c1 * (yy - 2 * ny * vy);
        b->ayz[i] = -c0 * ny * nz + c1 * (yz - ny * vz - nz * vy), b->azz[i] = c0 * (1 - nz * nz) + c1 * (zz - 2 * nz * vz);
    }
}

// `inside` and `estimate` of a block from the samples at X.
static inline __attribute__((always_inline)) void foot_estimate(FootBatch *restrict b, int block, double iso_level)
{
    double level = 1 / sqrt(iso_level);
    for (int i = block; i < block + FOOT_BLOCK; i++) {
        double gx = b->gx[i], gy = b->gy[i], gz = b->gz[i], slope2 = gx * gx + gy * gy + gz * gz, f = b->f[i];
        double sum = f + iso_level, w = 1 / sqrt(sum), part = sum * sqrt(sum) * fabs(w - level);   // |W| / w^3
        b->estimate[i] = slope2 > 1e-280 ? 2 * part / sqrt(slope2 > 1e-280 ? slope2 : 1.0) : 1e300;
        b->inside[i] = f > 0 ? 1.0 : 0.0;
    }
}

// The kernels of foot_lanes.h and blob_lanes.h for one instruction set.
typedef struct LaneKernels {
    const char *isa;
    // Field and gradient (and Hessian) at the running feet of `count` lanes, with the lanes' models. Many at a time: one evaluation alone waits 35 ns
    // for its own division and sums, others fit into that gap.
    void (*gradient)(FootBatch *batch, const int *lane, int count, double iso_level);
    void (*hessian)(FootBatch *batch, const int *lane, int count, double iso_level);
    // Of the first `count` lanes, in whole blocks: the rest of the last block must hold numbers. newton leaves blocks alone where nothing is pending.
    void (*newton)(FootBatch *batch, int count);
    void (*finish)(FootBatch *batch, int count);
    void (*estimate)(FootBatch *batch, int count, double iso_level);
} LaneKernels;
// isa: 0 what simd_level() says, 1 SSE2, 2 AVX2, 3 AVX-512; the next narrower one where it is absent.
const LaneKernels *lane_kernels(int isa);

#endif

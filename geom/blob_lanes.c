// One kernel text, three compilations. See blob_lanes.h for the layout and why the bits agree, blobby.c for the equations.
#include "geom/blob_lanes.h"

#include <string.h>

void blob_groups_fill(BlobGroup *group, const Blobby *model)
{
    int groups = blob_groups_needed(model->count);
    memset(group, 0, (size_t)groups * sizeof *group);
    for (int j = 0; j < model->count; j++) {
        BlobGroup *to = &group[j / 8];
        int lane = j % 8;
        double rho = model->width[j];
        to->cx[lane] = model->center[j].x;
        to->cy[lane] = model->center[j].y;
        to->cz[lane] = model->center[j].z;
        to->inverse[lane] = 1 / (5 * rho * rho);
        to->rho[lane] = rho;
        to->a[lane] = -0.8 / rho;
        to->b[lane] = 0.96 / (rho * rho * rho);
    }
}

// Macros instead of functions: a vector passed by value would change its calling convention with the instruction set.
#define SUM8(v) ((((v)[0] + (v)[4]) + ((v)[2] + (v)[6])) + (((v)[1] + (v)[5]) + ((v)[3] + (v)[7])))

#define GRADIENT_KERNEL(NAME, TARGET)                                                                                                       \
    TARGET static void NAME(const BlobGroup *group, int count, double iso_level, Vec3 x, FieldSample *out)                                  \
    {                                                                                                                                       \
        Lanes f = {0}, gx = {0}, gy = {0}, gz = {0};                                                                                        \
        for (int k = 0; k < count; k++) {                                                                                                   \
            const BlobGroup *s = &group[k];                                                                                                 \
            Lanes dx = x.x - s->cx, dy = x.y - s->cy, dz = x.z - s->cz;                                                                     \
            Lanes u = 1.0 / (1.0 + (dx * dx + dy * dy + dz * dz) * s->inverse), u2 = u * u, w = s->a * (u2 * u);                            \
            f += s->rho * u2;                                                                                                               \
            gx += w * dx, gy += w * dy, gz += w * dz;                                                                                       \
        }                                                                                                                                   \
        out->f = SUM8(f) - iso_level;                                                                                                       \
        out->g = vec3(SUM8(gx), SUM8(gy), SUM8(gz));                                                                                        \
    }

#define HESSIAN_KERNEL(NAME, TARGET)                                                                                                        \
    TARGET static void NAME(const BlobGroup *group, int count, double iso_level, Vec3 x, FieldSample *out)                                  \
    {                                                                                                                                       \
        Lanes f = {0}, gx = {0}, gy = {0}, gz = {0}, xx = {0}, xy = {0}, xz = {0}, yy = {0}, yz = {0}, zz = {0};                            \
        for (int k = 0; k < count; k++) {                                                                                                   \
            const BlobGroup *s = &group[k];                                                                                                 \
            Lanes dx = x.x - s->cx, dy = x.y - s->cy, dz = x.z - s->cz;                                                                     \
            Lanes u = 1.0 / (1.0 + (dx * dx + dy * dy + dz * dz) * s->inverse), u2 = u * u, w = s->a * (u2 * u);                            \
            Lanes v = s->b * (u2 * u2), vx = v * dx, vy = v * dy;                                                                           \
            f += s->rho * u2;                                                                                                               \
            gx += w * dx, gy += w * dy, gz += w * dz;                                                                                       \
            xx += w + vx * dx, xy += vx * dy, xz += vx * dz;                                                                                \
            yy += w + vy * dy, yz += vy * dz, zz += w + v * dz * dz;                                                                        \
        }                                                                                                                                   \
        out->f = SUM8(f) - iso_level;                                                                                                       \
        out->g = vec3(SUM8(gx), SUM8(gy), SUM8(gz));                                                                                        \
        out->h = (Sym3){SUM8(xx), SUM8(xy), SUM8(xz), SUM8(yy), SUM8(yz), SUM8(zz)};                                                        \
    }

GRADIENT_KERNEL(gradient_baseline, )
HESSIAN_KERNEL(hessian_baseline, )
static const BlobKernels baseline = {"baseline", gradient_baseline, hessian_baseline};

#if defined(__x86_64__) && defined(__GNUC__)
GRADIENT_KERNEL(gradient_avx2, __attribute__((target("avx2"))))
HESSIAN_KERNEL(hessian_avx2, __attribute__((target("avx2"))))
GRADIENT_KERNEL(gradient_avx512, __attribute__((target("avx512f,avx512dq,prefer-vector-width=512"))))
HESSIAN_KERNEL(hessian_avx512, __attribute__((target("avx512f,avx512dq,prefer-vector-width=512"))))
static const BlobKernels avx2 = {"avx2", gradient_avx2, hessian_avx2};
static const BlobKernels avx512 = {"avx512", gradient_avx512, hessian_avx512};

const BlobKernels *blob_kernels(int isa)
{
    if ((isa == 0 || isa >= 3) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return &avx512;
    if ((isa == 0 || isa >= 2) && __builtin_cpu_supports("avx2"))
        return &avx2;
    return &baseline;
}
#else
const BlobKernels *blob_kernels(int isa)
{
    (void)isa;
    return &baseline;
}
#endif

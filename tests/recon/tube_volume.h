// Creates volumes of tubes for the tests of tracking. Include after cmocka's headers.
#ifndef SELDINGER_TESTS_RECON_TUBE_VOLUME_H
#define SELDINGER_TESTS_RECON_TUBE_VOLUME_H

#include "recon/volume/volume.h"

// A union of tubes of brightness 1 on background 0, with a plain blurred edge, and noise that depends on the voxels' numbers.
static inline Volume *dark_volume(int nx, int ny, int nz, double voxel)
{
    Volume *v = volume_create((int[3]){nx, ny, nz}, vec3(0, 0, 0), (Vec3[3]){{voxel, 0, 0}, {0, voxel, 0}, {0, 0, voxel}});
    assert_non_null(v);
    return v;
}

static inline void add_ball(Volume *v, Vec3 c, double radius, double brightness)
{
    double voxel = v->axis[0].x, reach = radius + 3 * voxel;
    int low[3], high[3];
    double at[3] = {c.x, c.y, c.z};
    for (int i = 0; i < 3; i++) {
        low[i] = (int)fmax(0, ceil((at[i] - reach) / voxel));
        high[i] = (int)fmin(v->size[i] - 1, floor((at[i] + reach) / voxel));
    }
    for (int k = low[2]; k <= high[2]; k++)
        for (int j = low[1]; j <= high[1]; j++)
            for (int i = low[0]; i <= high[0]; i++) {
                double depth = radius - vec3_distance(vec3(i * voxel, j * voxel, k * voxel), c);
                float value = (float)(brightness / (1 + exp(-1.7 * depth / voxel))), *old = &v->value[(k * v->size[1] + j) * v->size[0] + i];
                *old = value > *old ? value : *old;
            }
}

static inline void add_tube(Volume *v, Vec3 a, Vec3 b, double radius)
{
    int n = (int)(vec3_distance(a, b) / 0.05) + 1;
    for (int i = 0; i <= n; i++)
        add_ball(v, vec3_mix(a, b, (double)i / n), radius, 1);
}

static inline void add_noise_of(Volume *v, double sigma, uint64_t seed)
{
    uint64_t state = 88172645463325252u ^ (seed * 0x9E3779B97F4A7C15u);
    v->minimum = 1e30f;
    v->maximum = -1e30f;
    for (int i = 0; i < v->size[0] * v->size[1] * v->size[2]; i++) {
        double sum = 0;
        for (int k = 0; k < 12; k++) {   // twelve uniform numbers have variance 1
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            sum += (double)(state >> 11) / 9007199254740992.0 - 0.5;
        }
        v->value[i] += (float)(sigma * sum);
        v->minimum = fminf(v->minimum, v->value[i]);
        v->maximum = fmaxf(v->maximum, v->value[i]);
    }
}

static inline void add_noise(Volume *v, double sigma) { add_noise_of(v, sigma, 0); }

#endif

// s(x) = sum_ijk v_ijk b(x - i) b(y - j) b(z - k), b the cubic B-spline: with t = x - floor(x) the four weights are
// (1-t)^3 / 6, (4 - 6 t^2 + 3 t^3) / 6, (4 - 6 u^2 + 3 u^3) / 6 with u = 1 - t, t^3 / 6.
// Floats: 64 products of values known to a few digits. The four lanes of a row are summed apart and joined at the end, always in the same order.
#include "recon/bspline.h"

#include <string.h>

typedef float Lanes __attribute__((vector_size(16)));

static inline void weights(float t, float w[4])
{
    const float sixth = 1.0f / 6;
    float u = 1 - t, t2 = t * t, u2 = u * u;
    w[0] = u2 * u * sixth;
    w[1] = (4 - 6 * t2 + 3 * (t2 * t)) * sixth;
    w[2] = (4 - 6 * u2 + 3 * (u2 * u)) * sixth;
    w[3] = t2 * t * sixth;
}

// Taps that lie beyond the grid.
static float sample_at_border(const Volume *volume, const int base[3], const float wx[4], const float wy[4], const float wz[4])
{
    float sum = 0;
    for (int k = 0; k < 4; k++)
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++) {
                int x = base[0] + i, y = base[1] + j, z = base[2] + k;
                bool inside = x >= 0 && y >= 0 && z >= 0 && x < volume->size[0] && y < volume->size[1] && z < volume->size[2];
                float value = inside ? volume->value[((size_t)z * (size_t)volume->size[1] + (size_t)y) * (size_t)volume->size[0] + (size_t)x] : volume->minimum;
                sum += wz[k] * wy[j] * wx[i] * value;
            }
    return sum;
}

static inline float sample(const Volume *volume, double x, double y, double z)
{
    const int *size = volume->size;
    // far outside (or not a number) no tap is inside
    if (!(x > -3 && y > -3 && z > -3 && x < size[0] + 2 && y < size[1] + 2 && z < size[2] + 2))
        return volume->minimum;
    // all are > -3: truncation of the shifted number is floor(), which is a call without SSE4
    int base[3] = {(int)(x + 4) - 5, (int)(y + 4) - 5, (int)(z + 4) - 5};
    float wx[4], wy[4], wz[4];
    weights((float)(x - (base[0] + 1)), wx);
    weights((float)(y - (base[1] + 1)), wy);
    weights((float)(z - (base[2] + 1)), wz);
    if (base[0] < 0 || base[1] < 0 || base[2] < 0 || base[0] + 3 >= size[0] || base[1] + 3 >= size[1] || base[2] + 3 >= size[2])
        return sample_at_border(volume, base, wx, wy, wz);
    size_t row = (size_t)size[0], slice = row * (size_t)size[1];
    const float *first = volume->value + (size_t)base[2] * slice + (size_t)base[1] * row + (size_t)base[0];
    Lanes lane = {0, 0, 0, 0};
    for (int k = 0; k < 4; k++) {
        Lanes layer = {0, 0, 0, 0};
        for (int j = 0; j < 4; j++) {
            Lanes tap;
            memcpy(&tap, first + (size_t)k * slice + (size_t)j * row, sizeof tap);
            layer += wy[j] * tap;
        }
        lane += wz[k] * layer;
    }
    return (lane[0] * wx[0] + lane[1] * wx[1]) + (lane[2] * wx[2] + lane[3] * wx[3]);
}

float bspline_sample(const Volume *volume, Vec3 voxel) { return sample(volume, voxel.x, voxel.y, voxel.z); }

void bspline_sample_line(const Volume *volume, Vec3 start, Vec3 step, int count, float *out)
{
    for (int i = 0; i < count; i++)
        out[i] = sample(volume, start.x + i * step.x, start.y + i * step.y, start.z + i * step.z);
}

#include "recon/volume/volume_reduce.h"

#include <math.h>
#include <stdlib.h>

static float brightest(const Volume *v, const int from[3], const int to[3])
{
    float most = v->minimum;
    for (int k = from[2]; k < to[2]; k++)
        for (int j = from[1]; j < to[1]; j++) {
            const float *row = v->value + ((size_t)k * (size_t)v->size[1] + (size_t)j) * (size_t)v->size[0];
            for (int i = from[0]; i < to[0]; i++)
                most = row[i] > most ? row[i] : most;
        }
    return most;
}

Volume *volume_reduced(const Volume *v, int most)
{
    int block[3], size[3];
    Vec3 axis[3], origin = v->origin;
    for (int k = 0; k < 3; k++) {
        block[k] = (v->size[k] + most - 1) / most;
        size[k] = (v->size[k] + block[k] - 1) / block[k];
        axis[k] = vec3_scale(v->axis[k], block[k]);
        origin = vec3_add_scaled(origin, 0.5 * (block[k] - 1), v->axis[k]);
    }
    Volume *out = volume_create(size, origin, axis);
    if (!out)
        return NULL;
    float *value = out->value;
    for (int k = 0; k < size[2]; k++)
        for (int j = 0; j < size[1]; j++)
            for (int i = 0; i < size[0]; i++) {
                int from[3] = {i * block[0], j * block[1], k * block[2]}, to[3];
                for (int a = 0; a < 3; a++)
                    to[a] = from[a] + block[a] < v->size[a] ? from[a] + block[a] : v->size[a];
                *value++ = brightest(v, from, to);
            }
    out->minimum = v->minimum;
    out->maximum = v->maximum;
    return out;
}

void volume_brightness(const Volume *v, float *low, float *high)
{
    enum { BINS = 1 << 12 };
    long count[BINS] = {0}, total = 0, sum = 0;
    size_t voxels = (size_t)v->size[0] * (size_t)v->size[1] * (size_t)v->size[2], stride = voxels / 1000003 + 1;
    double least = (double)v->minimum, width = ((double)v->maximum - least) / BINS;
    for (size_t i = 0; i < voxels && width > 0; i += stride, total++)
        count[(int)fmin(((double)v->value[i] - least) / width, BINS - 1)]++;
    *low = *high = v->minimum;
    for (int bin = 0; bin < BINS; bin++) {
        sum += count[bin];
        if (2 * sum < total)
            *low = (float)(least + (bin + 1) * width);
        if (2000 * sum < 1999 * total)
            *high = (float)(least + (bin + 1) * width);
    }
    if (!(*high > *low))
        *low = v->minimum, *high = v->maximum;
}

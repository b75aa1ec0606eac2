// sigma = 1.4826 MAD / sqrt(2) for differences of independent values; the Gaussian is applied axis by axis.
#include "recon/volume/volume_noise.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

double volume_noise(const Volume *volume, int lag)
{
    enum { SAMPLES = 30000 };
    const int *size = volume->size;
    size_t voxels = (size_t)size[0] * (size_t)size[1] * (size_t)size[2], step[3] = {1, (size_t)size[0], (size_t)size[0] * (size_t)size[1]};
    double *value = HEAP_ZEROED(SAMPLES, sizeof *value), sum = 0;
    int axes = 0;
    for (int axis = 0; axis < 3; axis++) {
        int n = 0;
        for (size_t i = (size_t)axis, stride = voxels / SAMPLES + 1; i < voxels && n < SAMPLES; i += stride)
            if ((int)(i / step[axis] % (size_t)size[axis]) + lag < size[axis])
                value[n++] = (double)volume->value[i + (size_t)lag * step[axis]] - (double)volume->value[i];
        if (n == 0)
            continue;
        sort_doubles(value, (size_t)n);
        double middle = value[n / 2];
        for (int i = 0; i < n; i++)
            value[i] = fabs(value[i] - middle);
        sort_doubles(value, (size_t)n);
        sum += 1.4826 * value[n / 2] / sqrt(2);
        axes++;
    }
    free(value);
    return axes > 0 ? sum / axes : 0;
}

typedef struct Smoothing {
    Volume *volume;
    int axis, reach;
    const double *kernel;    // (reach + 1)
    bool *failed;            // (jobs)
} Smoothing;

// Smooths one line along x, or a plane of lines along the axis that lie side by side in x: a plane of constant z (axis 1) or y (axis 2).
static void smooth_slab(void *context, long index)
{
    const Smoothing *s = context;
    const Volume *v = s->volume;
    size_t nx = (size_t)v->size[0], plane = nx * (size_t)v->size[1], wide = s->axis == 0 ? 1 : nx;
    int n = v->size[s->axis];
    float *first = v->value + (size_t)index * (s->axis == 1 ? plane : nx), *copy = malloc((size_t)n * wide * sizeof *copy);
    float *line = malloc(wide * sizeof *line);
    size_t stride = s->axis == 0 ? 1 : s->axis == 1 ? nx : plane;
    s->failed[index] = !copy || !line;
    for (int i = 0; !s->failed[index] && i < n; i++)
        memcpy(copy + (size_t)i * wide, first + (size_t)i * stride, wide * sizeof *copy);
    for (int i = 0; !s->failed[index] && i < n; i++) {
        memset(line, 0, wide * sizeof *line);
        for (int k = -s->reach; k <= s->reach; k++) {
            int at = i + k < 0 ? 0 : i + k >= n ? n - 1 : i + k;
            const float *from = copy + (size_t)at * wide;
            float weight = (float)s->kernel[abs(k)];
            for (size_t x = 0; x < wide; x++)
                line[x] += weight * from[x];
        }
        for (size_t x = 0; x < wide; x++)
            first[(size_t)i * stride + x] = line[x];
    }
    free(copy);
    free(line);
}

static bool smooth_axis(Volume *volume, int axis, double sigma, int threads)
{
    int reach = (int)ceil(3.5 * sigma);
    size_t jobs = axis == 0 ? (size_t)volume->size[1] * (size_t)volume->size[2] : axis == 1 ? (size_t)volume->size[2] : (size_t)volume->size[1];
    double *kernel = malloc(((size_t)reach + 1) * sizeof *kernel), sum = 0;
    Smoothing s = {volume, axis, reach, kernel, calloc(jobs, sizeof *s.failed)};
    bool good = kernel && s.failed;
    for (int k = 0; good && k <= reach; k++)
        sum += (k ? 2 : 1) * (kernel[k] = same_exp(-0.5 * (k / sigma) * (k / sigma)));
    for (int k = 0; good && k <= reach; k++)
        kernel[k] /= sum;
    if (good)
        parallel_for(threads, (long)jobs, smooth_slab, &s, NULL);
    for (size_t i = 0; good && i < jobs; i++)
        good = !s.failed[i];
    free(kernel);
    free(s.failed);
    return good;
}

Volume *volume_smoothed(const Volume *volume, double sigma_mm, int threads)
{
    Volume *out = volume_create(volume->size, volume->origin, volume->axis);
    size_t voxels = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    if (!out)
        return NULL;
    memcpy(out->value, volume->value, voxels * sizeof *out->value);
    memcpy(out->frame, volume->frame, sizeof out->frame);
    memcpy(out->format, volume->format, sizeof out->format);
    bool good = true;
    for (int axis = 0; good && axis < 3; axis++)
        good = smooth_axis(out, axis, sigma_mm / vec3_norm(volume->axis[axis]), threads);
    if (!good) {
        volume_free(out);
        return NULL;
    }
    out->minimum = out->maximum = out->value[0];
    for (size_t i = 1; i < voxels; i++) {
        out->minimum = fminf(out->minimum, out->value[i]);
        out->maximum = fmaxf(out->maximum, out->value[i]);
    }
    return out;
}

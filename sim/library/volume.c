#include "sim/library/recon.h"

#include "base/base.h"
#include "recon/recon.h"

#include <stdlib.h>
#include <string.h>

typedef struct Loading {
    const char *path;
    SelVolume *volume;
} Loading;

// Takes ownership of the volume.
static SelVolume *handle_of(Volume *volume, const char *path)
{
    SelVolume *handle = HEAP_ZEROED(1, sizeof *handle);
    *handle = (SelVolume){.volume = volume, .path = HEAP_TEXT(path)};
    return handle;
}

static bool load(SelContext *context, void *what)
{
    Loading *loading = what;
    Volume *volume = volume_load(loading->path, &context->faults);
    if (volume)
        loading->volume = handle_of(volume, loading->path);
    return volume != NULL;
}

SelStatus sel_volume_open(SelContext *context, const char *path, SelVolume **volume)
{
    Loading loading = {.path = path};
    if (!context || !path || !volume)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, path or volume is NULL");
    SelStatus status = context_call(context, load, &loading, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *volume = loading.volume;
    return status;
}

void sel_volume_destroy(SelVolume *volume)
{
    if (!volume)
        return;
    volume_free(volume->volume);
    free(volume->path);
    free(volume);
}

// --- from memory ---

typedef struct Filling {
    const int *size;
    Vec3 origin, axis[3];
    const float *value;
    size_t count;
    SelVolume *volume;
} Filling;

static Vec3 vector_of(const double v[3]) { return vec3(v[0], v[1], v[2]); }

// Index of the first value that is not finite; `count` if there is none.
static size_t find_trouble(const float *value, size_t count)
{
    size_t i = 0;
    while (i < count && isfinite(value[i]))
        i++;
    return i;
}

static void take_values(Volume *volume, const float *value, size_t count)
{
    memcpy(volume->value, value, count * sizeof *value);
    volume->minimum = volume->maximum = value[0];
    for (size_t i = 1; i < count; i++) {
        volume->minimum = fminf(volume->minimum, value[i]);
        volume->maximum = fmaxf(volume->maximum, value[i]);
    }
}

static bool fill(SelContext *context, void *what)
{
    Filling *filling = what;
    size_t bad = find_trouble(filling->value, filling->count);
    if (bad < filling->count) {
        faults_add(&context->faults, "sel_volume_create", 0, 0, "value %zu is not finite", bad);
        return false;
    }
    Volume *volume = volume_create(filling->size, filling->origin, filling->axis);
    if (!volume)
        heap_is_empty(filling->count * sizeof *filling->value, __FILE__);
    take_values(volume, filling->value, filling->count);
    filling->volume = handle_of(volume, "memory");
    return true;
}

static bool is_a_frame(const Filling *filling)
{
    bool is_finite = vec3_is_finite(filling->origin);
    double least = 1;
    for (int i = 0; i < 3; i++) {
        is_finite = is_finite && vec3_is_finite(filling->axis[i]);
        least *= vec3_norm(filling->axis[i]);
    }
    double volume = vec3_dot(vec3_cross(filling->axis[0], filling->axis[1]), filling->axis[2]);
    return is_finite && least > 0 && fabs(volume) > 1e-6 * least;
}

static bool count_voxels(const int size[3], size_t *count)
{
    *count = 1;
    for (int i = 0; i < 3; i++) {
        if (size[i] < 1 || (size_t)size[i] > VOLUME_VOXELS_MOST / *count)
            return false;
        *count *= (size_t)size[i];
    }
    return true;
}

SelStatus sel_volume_create(SelContext *context, const int size[3], const double origin_mm[3], const double axis_mm[3][3], const float *value,
                            SelVolume **volume)
{
    if (!context || !size || !origin_mm || !axis_mm || !value || !volume)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "a pointer is NULL");
    Filling filling = {
        .size = size, .origin = vector_of(origin_mm), .axis = {vector_of(axis_mm[0]), vector_of(axis_mm[1]), vector_of(axis_mm[2])}, .value = value};
    if (!count_voxels(size, &filling.count) || !is_a_frame(&filling))
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "sizes are not 1 to 2^31 voxels in all, or the axes do not span space");
    SelStatus status = context_call(context, fill, &filling, SEL_ERROR_ARGUMENT);
    if (status == SEL_OK)
        *volume = filling.volume;
    return status;
}

SelStatus sel_volume_size(const SelVolume *volume, int size[3])
{
    if (!volume || !size)
        return SEL_ERROR_ARGUMENT;
    memcpy(size, volume->volume->size, 3 * sizeof *size);
    return SEL_OK;
}

double sel_volume_voxel_mm(const SelVolume *volume) { return volume ? volume_voxel_size(volume->volume) : 0; }

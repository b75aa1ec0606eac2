#include "recon/volume/volume.h"

#include <stdlib.h>
#include <string.h>

Volume *volume_create(const int size[3], Vec3 origin, const Vec3 axis[3])
{
    size_t count = 1;
    for (int i = 0; i < 3; i++) {
        if (size[i] < 1 || (size_t)size[i] > VOLUME_VOXELS_MOST / count)
            return NULL;
        count *= (size_t)size[i];
    }
    Volume *volume = calloc(1, sizeof *volume);
    if (!volume || !(volume->value = calloc(count, sizeof *volume->value))) {
        free(volume);
        return NULL;
    }
    memcpy(volume->size, size, sizeof volume->size);
    volume->origin = origin;
    memcpy(volume->axis, axis, sizeof volume->axis);
    // the inverse of (a b c) by columns has rows b x c, c x a, a x b over the determinant
    Vec3 bc = vec3_cross(axis[1], axis[2]), ca = vec3_cross(axis[2], axis[0]), ab = vec3_cross(axis[0], axis[1]);
    double s = 1 / vec3_dot(axis[0], bc);
    volume->to_voxel = (Mat3){{{bc.x * s, bc.y * s, bc.z * s}, {ca.x * s, ca.y * s, ca.z * s}, {ab.x * s, ab.y * s, ab.z * s}}};
    return volume;
}

void volume_free(Volume *volume)
{
    if (volume)
        free(volume->value);
    free(volume);
}

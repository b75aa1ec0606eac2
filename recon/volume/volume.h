// Volumes: scalar voxel grids in patient coordinates (volume_file.h reads and writes files).
//
// Voxel (i, j, k), i fastest, has its centre at origin + i axis[0] + j axis[1] + k axis[2] [mm]; axes may be oblique and anisotropic. The frame in
// the header is kept, never converted. Values are finite floats: a NaN would pass silently through every interpolation, and only the user knows which
// background value it represents.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_H
#define SELDINGER_RECON_VOLUME_VOLUME_H

#include "base/base.h"
#include "geom/geom.h"

#include <stddef.h>

typedef struct Volume {
    int size[3];
    Vec3 origin;             // [mm] centre of voxel (0,0,0)
    Vec3 axis[3];            // [mm] step from voxel to voxel
    Mat3 to_voxel;           // inverse of the axes: voxel = to_voxel (x - origin)
    float *value;            // (size[2], size[1], size[0])
    float minimum, maximum;
    char frame[32];          // "RAS", "LPS", …; "" if the header does not give it
    char format[16];         // "nrrd", "metaimage", "nifti", "dicom"
} Volume;

// largest number of voxels of a volume
#define VOLUME_VOXELS_MOST ((size_t)1 << 31)
// Creates a volume of the given grid with all values zero. Returns NULL if a size is not positive or if out of memory.
Volume *volume_create(const int size[3], Vec3 origin, const Vec3 axis[3]);
void volume_free(Volume *volume);
static inline double volume_voxel_size(const Volume *v)   // [mm] mean edge of a voxel
{
    return (vec3_norm(v->axis[0]) + vec3_norm(v->axis[1]) + vec3_norm(v->axis[2])) / 3;
}
// Converts a point [mm] to continuous voxel coordinates, and back.
static inline Vec3 volume_voxel_of(const Volume *v, Vec3 x) { return mat3_mul_vec(&v->to_voxel, vec3_sub(x, v->origin)); }
static inline Vec3 volume_point_of(const Volume *v, Vec3 voxel)
{
    return vec3_add_scaled(vec3_add_scaled(vec3_add_scaled(v->origin, voxel.x, v->axis[0]), voxel.y, v->axis[1]), voxel.z, v->axis[2]);
}

// Whether the values are CT numbers [HU]: air is -1000, and no other image reaches far below 0.
static inline bool volume_has_ct_numbers(const Volume *v) { return v->minimum < -200; }
// CT numbers between which lie soft tissue and vessels with contrast agent; below lies air, above bone.
#define CT_NUMBER_TISSUE (-200.0F)
#define CT_NUMBER_BONE 600.0F

#endif

// Creates the volume of a synthetic shape with cubic voxels. Include after cmocka's headers.
#ifndef SELDINGER_TESTS_RECON_CUBIC_VOLUME_H
#define SELDINGER_TESTS_RECON_CUBIC_VOLUME_H

#include "recon/phantom/phantom.h"

static inline Volume *cubic_volume(const Shape *shape, double voxel_mm, double psf_mm, double noise, uint64_t seed, Faults *faults)
{
    VolumeOptions options = volume_default_options();
    for (int k = 0; k < 3; k++)
        options.voxel_mm[k] = voxel_mm;
    options.psf_mm = psf_mm;
    options.noise = noise;
    options.seed = seed;
    return shape_volume(shape, &options, faults);
}

#endif

// By default the HDF5 library prints its own messages to standard error. Its error handler belongs to the host program, so we restore it after each of our
// calls.
#ifndef SELDINGER_RECON_HDF5_SILENCE_H
#define SELDINGER_RECON_HDF5_SILENCE_H

#include <hdf5.h>

typedef struct Hdf5Silence {
    H5E_auto2_t handler;     // the host program's handler
    void *data;
} Hdf5Silence;

static inline Hdf5Silence hdf5_silence_begin(void)
{
    Hdf5Silence kept = {0};
    H5Eget_auto2(H5E_DEFAULT, &kept.handler, &kept.data);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return kept;
}

static inline void hdf5_silence_end(Hdf5Silence kept) { H5Eset_auto2(H5E_DEFAULT, kept.handler, kept.data); }

#endif

// What the guarded reader lets the HDF5 library see of a file: bytes at an address, from a file or from memory, never written, never beyond the end. A driver of our
// own, because the library's keep a buffer of metadata (H5F__accum_read) that damaged sizes lead to a null pointer.
#ifndef SELDINGER_RECON_HDF5_SOURCE_H
#define SELDINGER_RECON_HDF5_SOURCE_H

#include <hdf5.h>
#include <stddef.h>

typedef struct Hdf5Source {
    H5FD_t driver;           // the library's part; first
    haddr_t end;             // that the library knows of
    int file;                // an open descriptor, -1: memory
    const void *bytes;
    size_t length;           // of either
    int reason;              // errno of a read that failed; 0: none has
} Hdf5Source;

// Opens it for reading; the source must stay, where it is, until the file is closed. Negative where the library refuses it.
hid_t hdf5_source_open(Hdf5Source *source);

#endif

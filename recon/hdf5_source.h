// The HDF5 library's access to a file in the guarded reader: bytes at an address, from a file or memory, read only, never beyond the end. It is our
// own driver, because the library's drivers keep a metadata buffer (H5F__accum_read) in which damaged sizes lead to a null pointer.
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
    int reason;              // errno of a failed read; 0: none
} Hdf5Source;

// Opens the source for reading; it must neither move nor end before the file is closed. Negative if the library refuses it.
hid_t hdf5_source_open(Hdf5Source *source);

#endif

// The file driver that gives the HDF5 library access to a file in the guarded reader: it reads bytes from a file or from memory, read only, never beyond the
// end. We use our own driver because the library's drivers keep a metadata buffer (H5F__accum_read) in which damaged sizes lead to a null pointer.
#ifndef SELDINGER_RECON_HDF5_SOURCE_H
#define SELDINGER_RECON_HDF5_SOURCE_H

#include <hdf5.h>
#include <stddef.h>

typedef struct Hdf5Source {
    H5FD_t driver;           // the library's part; must be the first member
    haddr_t end;             // end of the allocated addresses, as set by the library
    int file;                // an open descriptor; -1: bytes in memory
    const void *bytes;
    size_t length;           // [bytes] of the file or the memory
    int reason;              // errno of a failed read; 0: no read failed
} Hdf5Source;

// Opens the source for reading. `source` must stay valid, at the same address, until the file is closed. Returns a negative value if the library refuses it.
hid_t hdf5_source_open(Hdf5Source *source);

#endif

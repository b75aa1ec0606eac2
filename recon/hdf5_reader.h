// The only reader of HDF5 files: trees, models and recordings. Files are untrusted, so only what our own files contain is accepted:
//   - datasets and groups behind hard links only: no other file is opened, by a link, external storage or a virtual dataset;
//   - plain bytes, or chunks compressed by deflate, or by shuffle followed by deflate; no other filter, and no plug-in is loaded. The library (1.10)
//     reads beyond chunks that decompress to less than they should, so it only delivers the compressed bytes; zlib inflates them into exactly the
//     chunk's size (one byte more or less is a fault), and we unshuffle;
//   - little- or big-endian integers, IEEE floats, and strings; no type conversion defined by the file;
//   - each byte that a shape implies is in the file, and all datasets together take no more bytes than the file has, nor than
//     HDF5_READER_MOST_BYTES. N bytes of file take at most 8 N of memory (a byte becomes a word), HDF5_READER_MOST_RATIO N if compressed (an
//     idle recording has about 100);
//   - no more than HDF5_READER_MOST_CHUNKS chunks a dataset, because the library looks them up one by one;
//   - the library can read it without crashing: a child process first reads the whole structure (a fork and some milliseconds), because damaged sizes
//     in old headers make the library (1.10) overrun its memory.
// Messages give the file, the dataset, what is wrong and what was expected. The library prints nothing between opening and closing. Not thread-safe,
// because the library is not.
#ifndef SELDINGER_RECON_HDF5_READER_H
#define SELDINGER_RECON_HDF5_READER_H

#include "base/base.h"

#include <stdint.h>

enum { HDF5_READER_MOST_CHUNKS = 1 << 18, HDF5_READER_MOST_RATIO = 256, HDF5_READER_MOST_TEXT = 1 << 27 };     // [bytes] of one string
#define HDF5_READER_MOST_BYTES ((uint64_t)1 << 34)      // [bytes] four hours of a recording

typedef struct Hdf5Reader Hdf5Reader;

typedef enum { HDF5_INT8, HDF5_UINT8, HDF5_INT32, HDF5_UINT32, HDF5_INT64, HDF5_UINT64, HDF5_FLOAT, HDF5_DOUBLE, HDF5_TYPES } Hdf5Type;

typedef struct Hdf5Dataset {
    const char *path;        // "/nodes/center"
    Hdf5Type type;           // type in memory; the file's integers or floats of any size are converted and clamped to the type's range
    int rank;                // 1 to 3
    uint64_t size[3];        // expected shape, 0: any; hdf5_inspect() fills in the actual one
    bool is_finite;          // refuse NaN and infinity
} Hdf5Dataset;

// Opens a file. Returns NULL with a fault; errno is then set if the system could not read the file, else 0. `needs` ends the message about a missing dataset,
// for example "a recording has it". `path` and `needs` are borrowed, not copied.
Hdf5Reader *hdf5_reader_open(const char *path, const char *needs, Faults *faults);
// The same from `length` bytes in memory, which must stay valid until the reader is closed; `name` is used in messages. `has_rehearsal`: first read the
// structure in a child process, which a fuzzer skips because it is fifty times faster without.
Hdf5Reader *hdf5_reader_parse(const void *bytes, size_t length, bool has_rehearsal, const char *name, const char *needs, Faults *faults);
// Closes the file. `reader` may be NULL. If part of the file could not be read from disk, that becomes the only fault.
void hdf5_reader_close(Hdf5Reader *reader);

// Returns true if a link of this name, of any kind, is reachable through hard links. A missing link is not a fault.
bool hdf5_has(const Hdf5Reader *reader, const char *path);
// Checks everything except the values. Call it once per dataset: each call counts the dataset's bytes towards the file's total. Returns false with a fault.
bool hdf5_inspect(Hdf5Reader *reader, Hdf5Dataset *dataset);
// Reads the values of a dataset that hdf5_inspect() accepted. Returns false with a fault.
bool hdf5_read_into(Hdf5Reader *reader, const Hdf5Dataset *dataset, void *out);
// Inspects and reads a dataset into new memory (at least one value; zeros after the data). Returns NULL with a fault. The caller frees the result.
void *hdf5_read(Hdf5Reader *reader, Hdf5Dataset *dataset);

// Reads a string dataset. Returns NULL without a fault if it is absent, and NULL with a fault if it is not a string. The caller frees the result.
char *hdf5_text(Hdf5Reader *reader, const char *path);
// Reads a string attribute of an object ("/" for the file itself). Returns as above. A string of variable length is read in a child process.
char *hdf5_text_attribute(Hdf5Reader *reader, const char *object, const char *name);
// Reads a numeric attribute of the file. Returns `otherwise` if it is absent, and `otherwise` with a fault if it is not a number.
double hdf5_number(Hdf5Reader *reader, const char *name, double otherwise);

#endif

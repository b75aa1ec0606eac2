// The one way in which an HDF5 file is read: trees, models and recordings. A file is data from anywhere, so that it is held to what our own files are:
//   - datasets and groups behind hard links only: no other file is opened, by a link, external storage or a virtual dataset;
//   - plain bytes, or chunks packed by deflate, or by shuffle and then deflate; no other filter, and no plug-in is loaded. The library, 1.10, reads beyond chunks that
//     unpack to less than they should: it hands out the packed bytes, zlib inflates them into exactly the chunk's bytes (one more or less is a fault), and we unshuffle;
//   - plain numbers, little- or big-endian integers and IEEE floats, and texts: no conversion by code of the file's own making;
//   - each byte that a shape promises is in the file, and all datasets together take no more of it than it has, nor than HDF5_READER_MOST_BYTES: N bytes of file
//     take at most 8 N of memory (a byte read into a word), and packed ones HDF5_READER_MOST_RATIO N: a recording of idle hands has about 100;
//   - no more than HDF5_READER_MOST_CHUNKS chunks a dataset, which the library looks up one by one;
//   - the library survives it: a child process looks at the whole structure first (a fork and some milliseconds), as the library (1.10) overruns its memory where
//     sizes in old headers are damaged.
// Messages name the file, the dataset, what is wrong and what is valid. The library prints nothing between opening and closing.
// Not thread-safe, as the library is not.
#ifndef SELDINGER_RECON_HDF5_READER_H
#define SELDINGER_RECON_HDF5_READER_H

#include "base/faults.h"

#include <stdint.h>

enum { HDF5_READER_MOST_CHUNKS = 1 << 18, HDF5_READER_MOST_RATIO = 256, HDF5_READER_MOST_TEXT = 1 << 27 };     // [bytes] of one text
#define HDF5_READER_MOST_BYTES ((uint64_t)1 << 34)      // four hours of a recording

typedef struct Hdf5Reader Hdf5Reader;

typedef enum { HDF5_INT8, HDF5_UINT8, HDF5_INT32, HDF5_UINT32, HDF5_INT64, HDF5_UINT64, HDF5_FLOAT, HDF5_DOUBLE, HDF5_TYPES } Hdf5Type;

typedef struct Hdf5Dataset {
    const char *path;        // "/nodes/center"
    Hdf5Type type;           // in memory; the file holds any integers, or any floats, which are converted and cut off at the type's ends
    int rank;                // 1 to 3
    uint64_t size[3];        // what is valid, 0: any; hdf5_inspect() fills in what was found
    bool is_finite;          // NaN and infinity are refused
} Hdf5Dataset;

// NULL with a fault, and errno where the system could not read it, 0 where it is what it is. `needs` ends the message on a dataset that lacks: "a recording has it". Both it and `path` are kept, not copied.
Hdf5Reader *hdf5_reader_open(const char *path, const char *needs, Faults *faults);
// The same from memory, which must stay until the reader is closed; `name` stands in the messages. Without the rehearsal a fuzzer is fifty times as fast.
Hdf5Reader *hdf5_reader_parse(const void *bytes, size_t length, bool has_rehearsal, const char *name, const char *needs, Faults *faults);
// Also where it is NULL. Where a part of the file could not be read from the disk, that is the one fault then, also where what lacks is not needed.
void hdf5_reader_close(Hdf5Reader *reader);

// Whether there is a link of this name behind hard links, of whatever kind; no fault where there is none.
bool hdf5_has(const Hdf5Reader *reader, const char *path);
// Checks all but the values, once a dataset (its bytes count towards the file's): false with a fault.
bool hdf5_inspect(Hdf5Reader *reader, Hdf5Dataset *dataset);
// The values of a dataset that was inspected. False with a fault.
bool hdf5_read_into(Hdf5Reader *reader, const Hdf5Dataset *dataset, void *out);
// Both, into memory of its own (at least a value's, zero beyond the data). NULL with a fault; the caller frees.
void *hdf5_read(Hdf5Reader *reader, Hdf5Dataset *dataset);

// A text that is a dataset. NULL without a fault where there is none, with one where it is no text.
char *hdf5_text(Hdf5Reader *reader, const char *path);
// A text attribute of an object ("/": the file). NULL as above. One of variable length is read in a child process, for as long as a damaged file takes the library.
char *hdf5_text_attribute(Hdf5Reader *reader, const char *object, const char *name);
// A number of the file's own; `otherwise` where there is none, and with a fault where it is no number.
double hdf5_number(Hdf5Reader *reader, const char *name, double otherwise);

#endif

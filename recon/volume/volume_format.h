// Internal to the volume readers: the contents of a header, and the conversion of samples to voxels. A reader fills a VolumeHeader from text or bytes
// and hands the samples to volume_decode; every size is checked there once.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_FORMAT_H
#define SELDINGER_RECON_VOLUME_VOLUME_FORMAT_H

#include "recon/volume/volume.h"

#include <stdint.h>

typedef enum VoxelType {
    VOXEL_NONE,
    VOXEL_INT8,
    VOXEL_UINT8,
    VOXEL_INT16,
    VOXEL_UINT16,
    VOXEL_INT32,
    VOXEL_UINT32,
    VOXEL_INT64,
    VOXEL_UINT64,
    VOXEL_FLOAT,
    VOXEL_DOUBLE
} VoxelType;

enum { VOLUME_HEADER_MOST = 1 << 20 };  // bytes

typedef enum VoxelEncoding { ENCODING_RAW, ENCODING_DEFLATE, ENCODING_TEXT } VoxelEncoding;

typedef struct VolumeHeader {
    int size[3];
    Vec3 origin, axis[3];    // [mm]
    char frame[32];
    const char *format;
    VoxelType type;
    bool big_endian;
    double slope, intercept; // value = slope * sample + intercept
    VoxelEncoding encoding;
    long line_skip;          // lines of the data file before the samples
    long byte_skip;          // then bytes of the inflated data before the samples; -1: the samples are the last bytes of the file
} VolumeHeader;

typedef struct FileBytes {   // a file, or a part of one
    const uint8_t *byte;
    size_t length;
    size_t offset;           // position of byte[0] in the file, for messages
    const char *path;
    size_t whole;            // [bytes] length of the file if only a part of it was read
    size_t *needed;          // if not NULL, nothing is decoded; receives the number of file bytes that the header implies
} FileBytes;

// Advances to the next line of a text header, without its end. Returns false at the end of the bytes.
typedef struct LineCursor {
    const uint8_t *byte;
    size_t length, position;
    int line;                // 1-based number of the last line read
} LineCursor;
bool line_cursor_next(LineCursor *cursor, const char **text, size_t *length);

// Parses exactly `count` numbers, separated by blanks, from a header's text [text, text + length). Returns false if they are not there.
bool header_numbers(const char *text, size_t length, int count, double *out);
bool header_integer(const char *text, size_t length, long least, long most, long *out);
bool header_text_is(const char *text, size_t length, const char *wanted);   // compares without case and without blanks at both ends

size_t voxel_type_size(VoxelType type);
// Checks that the sizes are positive and within the limit, and that the axes are finite and independent. Returns false with a fault at `line` (0: none).
bool volume_header_check(const VolumeHeader *header, const char *path, int line, Faults *faults);
// Skips as the header says and converts samples to voxels. Allocates nothing before it is certain that `data` can hold what the header implies. Returns NULL
// with faults.
Volume *volume_decode(const VolumeHeader *header, const FileBytes *data, Faults *faults);
// Creates a volume of the header's grid with all values zero. Returns NULL with a fault if out of memory.
Volume *volume_of_header(const VolumeHeader *header, const char *path, Faults *faults);
// Sets minimum and maximum. Returns false with a fault at the first voxel that is not finite. Samples of `sample_size` bytes begin at byte `start` of the
// file; `sample_size` 0: the fault gives no byte.
bool volume_finish_values(Volume *volume, const FileBytes *data, size_t start, size_t sample_size, Faults *faults);
// Where the loader is, for volume_load_with(): `part` 0 to 1 of the file or series. Returns false, with a fault, if the load is to stop.
bool volume_goes_on(double part, const char *path, Faults *faults);
void volume_watch(const Progress *progress);   // of this thread's next load; NULL: none
// Decompresses the first `wanted` bytes of a gzip or zlib stream. Returns false if there are fewer.
bool volume_inflate_head(const FileBytes *data, uint8_t *out, size_t wanted, Faults *faults);
// Reads the first bytes of a regular file, at most `most`. The caller frees them (file_bytes_free).
bool file_bytes_read(const char *path, size_t most, FileBytes *out, Faults *faults);
void file_bytes_free(FileBytes *file);
// Reads the part of a data file that its detached header implies. The data file must lie in the header's folder or below, so that a header cannot silently
// refer to other places.
bool file_bytes_read_beside(const char *header_path, int line, const char *name, size_t name_length, const VolumeHeader *header, FileBytes *out,
                            char path[4096], Faults *faults);

// Raw samples in several files of equal size, one after the other: either numbered, if `text` is `NAME%03d.raw FIRST LAST [STEP [N]]`, or listed, if `text`
// is `LIST [N]` and `names` (of the file `header_path`) holds one name per line. `line` is the line of `text`.
bool data_names_several(const char *text, size_t length);
// Calls `call` for each of their names that can be parsed, whether the file exists or not.
void data_names_each(const char *text, size_t length, LineCursor names, void (*call)(void *context, const char *name, size_t length), void *context);
Volume *volume_decode_several(const VolumeHeader *header, const char *header_path, int line, const char *text, size_t length, LineCursor names, Faults *faults);

#endif

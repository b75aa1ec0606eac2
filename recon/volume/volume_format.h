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
    long byte_skip;          // then bytes, of the inflated data; -1: the samples are the last bytes of the file
} VolumeHeader;

typedef struct FileBytes {   // a file, or a part of one
    const uint8_t *byte;
    size_t length;
    size_t offset;           // of byte[0] in the file, for messages
    const char *path;
    size_t whole;            // the file's length where less of it was read
    size_t *needed;          // not NULL: nothing is decoded; receives the number of file bytes that the header promises
} FileBytes;

// A line of a text header, without its end. False at the end of the bytes.
typedef struct LineCursor {
    const uint8_t *byte;
    size_t length, position;
    int line;                // 1-based number of the line that was read last
} LineCursor;
bool line_cursor_next(LineCursor *cursor, const char **text, size_t *length);

// Numbers out of a header's text [text, text + length): exactly `count` of them, separated by blanks; false if not.
bool header_numbers(const char *text, size_t length, int count, double *out);
bool header_integer(const char *text, size_t length, long least, long most, long *out);
bool header_text_is(const char *text, size_t length, const char *wanted);   // case-insensitive, blanks at both ends ignored

size_t voxel_type_size(VoxelType type);
// Sizes positive and within the limit, axes finite and independent; else a fault at `line` (0: none).
bool volume_header_check(const VolumeHeader *header, const char *path, int line, Faults *faults);
// Samples to voxels, after the skips. Allocates nothing before it is certain that `data` can hold what the header promises.
Volume *volume_decode(const VolumeHeader *header, const FileBytes *data, Faults *faults);
// The header's grid with values zero; NULL with a fault if memory runs out.
Volume *volume_of_header(const VolumeHeader *header, const char *path, Faults *faults);
// Sets minimum and maximum; a fault at the first voxel that is not finite. Samples of `sample_size` bytes begin at `start` of the file; 0: no byte to tell.
bool volume_finish_values(Volume *volume, const FileBytes *data, size_t start, size_t sample_size, Faults *faults);
// The first `wanted` bytes of a gzip or zlib stream.
bool volume_inflate_head(const FileBytes *data, uint8_t *out, size_t wanted, Faults *faults);
// The first bytes of a regular file, at most `most`; the caller frees it (file_bytes_free).
bool file_bytes_read(const char *path, size_t most, FileBytes *out, Faults *faults);
void file_bytes_free(FileBytes *file);
// Reads the promised part of the data file that a detached header refers to. It must lie in the header's folder or below, so that a header cannot
// point elsewhere unnoticed.
bool file_bytes_read_beside(const char *header_path, int line, const char *name, size_t name_length, const VolumeHeader *header, FileBytes *out,
                            char path[4096], Faults *faults);

// Raw samples in several files of equal share, one after the other: either numbered, where `text` is `NAME%03d.raw FIRST LAST [STEP [N]]`, or `LIST [N]`, where
// `names` holds a name a line (of the file `header_path`). `line` is that of `text`.
bool data_names_several(const char *text, size_t length);
// Calls for each name of them, there or not, as far as they can be read.
void data_names_each(const char *text, size_t length, LineCursor names, void (*call)(void *context, const char *name, size_t length), void *context);
Volume *volume_decode_several(const VolumeHeader *header, const char *header_path, int line, const char *text, size_t length, LineCursor names, Faults *faults);

#endif

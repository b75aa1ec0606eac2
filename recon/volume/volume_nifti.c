// Reads NIfTI-1: a header of 348 bytes at fixed offsets, in either byte order, then the samples (.nii), or the samples in a .img beside the .hdr. libnifti
// is not used, because it trusts the sizes of a header and prints its own messages.
//
// Grid: sform if its code is > 0 (rows srow_x, srow_y, srow_z), else qform (quaternion and qfac), else pixdim alone. NIfTI prescribes the frame RAS.
#include "recon/volume/volume_nifti.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    AT_DIM = 40,
    AT_DATATYPE = 70,
    AT_BITPIX = 72,
    AT_PIXDIM = 76,
    AT_VOX_OFFSET = 108,
    AT_SLOPE = 112,
    AT_INTERCEPT = 116,
    AT_UNITS = 123,
    AT_QFORM = 252,
    AT_SFORM = 254,
    AT_QUATERN = 256,
    AT_QOFFSET = 268,
    AT_SROW = 280,
    AT_MAGIC = 344,
    HEADER_BYTES = 348,
    DATA_START = 352,
    NIFTI2_BYTES = 540
};

static const struct {
    int code;
    VoxelType type;
} data_types[] = {{2, VOXEL_UINT8},  {4, VOXEL_INT16},    {8, VOXEL_INT32},    {16, VOXEL_FLOAT},   {64, VOXEL_DOUBLE},
                  {256, VOXEL_INT8}, {512, VOXEL_UINT16}, {768, VOXEL_UINT32}, {1024, VOXEL_INT64}, {1280, VOXEL_UINT64}};

typedef struct NiftiBytes {
    const uint8_t *byte;
    bool big_endian;
} NiftiBytes;

static uint32_t bits_at(const NiftiBytes *h, int at, int size)
{
    uint32_t bits = 0;
    for (int i = 0; i < size; i++)
        bits |= (uint32_t)h->byte[at + (h->big_endian ? size - 1 - i : i)] << (8 * i);
    return bits;
}

static int short_at(const NiftiBytes *h, int at) { return (int16_t)bits_at(h, at, 2); }

static double float_at(const NiftiBytes *h, int at)
{
    uint32_t bits = bits_at(h, at, 4);
    float x;
    memcpy(&x, &bits, 4);
    return (double)x;
}

static bool is_gzip(const FileBytes *file) { return file->length > 18 && file->byte[0] == 0x1f && file->byte[1] == 0x8b; }

bool volume_is_nifti(const FileBytes *file)
{
    if (is_gzip(file))
        return true;
    if (file->length < 4)
        return false;
    NiftiBytes little = {file->byte, false}, big = {file->byte, true};
    uint32_t a = bits_at(&little, 0, 4), b = bits_at(&big, 0, 4);
    return a == HEADER_BYTES || b == HEADER_BYTES || a == NIFTI2_BYTES || b == NIFTI2_BYTES;
}

static bool read_grid(const NiftiBytes *h, const char *path, VolumeHeader *out, Faults *faults)
{
    int dimension = short_at(h, AT_DIM);
    if (dimension < 3 || dimension > 7) {
        faults_add_at_byte(faults, path, AT_DIM, "the volume has %d dimensions; expected 3 (further ones must have one sample)", dimension);
        return false;
    }
    for (int i = 1; i <= dimension; i++) {
        int size = short_at(h, AT_DIM + 2 * i);
        if (size < 1 || (i > 3 && size > 1)) {
            faults_add_at_byte(faults, path, (size_t)(AT_DIM + 2 * i),
                               "size %d of axis %d is not valid; expected 1 or more (1 beyond the third axis: one value per voxel)", size, i - 1);
            return false;
        }
        if (i <= 3)
            out->size[i - 1] = size;
    }
    static const double unit_mm[8] = {1, 1000, 1, 1e-3, 0, 0, 0, 0};
    double mm = unit_mm[h->byte[AT_UNITS] & 7];
    if (mm <= 0) {
        faults_add_at_byte(faults, path, AT_UNITS, "the unit of length %d is unknown; expected 1 (m), 2 (mm) or 3 (um)", h->byte[AT_UNITS] & 7);
        return false;
    }
    double p[3] = {float_at(h, AT_PIXDIM + 4), float_at(h, AT_PIXDIM + 8), float_at(h, AT_PIXDIM + 12)};
    size_t place = AT_PIXDIM;
    if (short_at(h, AT_SFORM) > 0) {
        double row[3][4];
        for (int i = 0; i < 12; i++)
            row[i / 4][i % 4] = float_at(h, AT_SROW + 4 * i);
        for (int i = 0; i < 3; i++)
            out->axis[i] = vec3(row[0][i], row[1][i], row[2][i]);
        out->origin = vec3(row[0][3], row[1][3], row[2][3]);
        place = AT_SROW;
    } else if (short_at(h, AT_QFORM) > 0) {
        double b = float_at(h, AT_QUATERN), c = float_at(h, AT_QUATERN + 4), d = float_at(h, AT_QUATERN + 8), a2 = 1 - (b * b + c * c + d * d);
        // only b, c, d are stored; 1 - b^2 - c^2 - d^2 may be slightly negative by rounding
        Mat3 rotation = quat_to_mat3(quat_unit((Quat){a2 > 0 ? sqrt(a2) : 0, b, c, d}));
        double qfac = float_at(h, AT_PIXDIM) < 0 ? -1 : 1;
        for (int i = 0; i < 3; i++)
            out->axis[i] = vec3_scale(mat3_column(&rotation, i), i == 2 ? qfac * p[i] : p[i]);
        out->origin = vec3(float_at(h, AT_QOFFSET), float_at(h, AT_QOFFSET + 4), float_at(h, AT_QOFFSET + 8));
        place = AT_QUATERN;
    } else {
        for (int i = 0; i < 3; i++)
            out->axis[i] = vec3(i == 0 ? p[0] : 0, i == 1 ? p[1] : 0, i == 2 ? p[2] : 0);
    }
    if (place != AT_PIXDIM)
        memcpy(out->frame, "RAS", 4);
    for (int i = 0; i < 3; i++)
        out->axis[i] = vec3_scale(out->axis[i], mm);
    out->origin = vec3_scale(out->origin, mm);
    Faults inner;
    faults_clear(&inner);
    if (volume_header_check(out, path, 0, &inner))
        return true;
    faults_add_at_byte(faults, path, place,
                       "the grid is not valid; expected independent axes that are finite and not 0, finite origin and scale, at most 2^31 voxels");
    return false;
}

static bool read_header(const FileBytes *file, NiftiBytes *h, VolumeHeader *out, size_t *start, bool *is_pair, Faults *faults)
{
    const char *path = file->path;
    *h = (NiftiBytes){file->byte, false};
    if (bits_at(h, 0, 4) != HEADER_BYTES)
        h->big_endian = true;
    if (bits_at(h, 0, 4) != HEADER_BYTES) {
        h->big_endian = bits_at(h, 0, 4) == NIFTI2_BYTES;
        if (bits_at(h, 0, 4) == NIFTI2_BYTES)
            faults_add_at_byte(faults, path, 0, "is NIfTI-2; expected NIfTI-1, NRRD or MetaImage");
        else
            faults_add_at_byte(faults, path, 0, "the compressed file holds no NIfTI volume; expected .nii.gz, or NRRD with its own gzip encoding");
        return false;
    }
    if (file->length < HEADER_BYTES) {
        faults_add_at_byte(faults, path, file->length, "the header ends after %zu bytes; expected %d", file->length, HEADER_BYTES);
        return false;
    }
    *is_pair = !memcmp(file->byte + AT_MAGIC, "ni1", 4);
    if (!*is_pair && memcmp(file->byte + AT_MAGIC, "n+1", 4)) {
        faults_add_at_byte(faults, path, AT_MAGIC, "the magic is neither 'n+1' nor 'ni1' (an ANALYZE file has no orientation); expected NIfTI-1");
        return false;
    }
    int code = short_at(h, AT_DATATYPE), bits = short_at(h, AT_BITPIX);
    for (size_t i = 0; i < sizeof data_types / sizeof data_types[0]; i++)
        if (data_types[i].code == code)
            out->type = data_types[i].type;
    if (out->type == VOXEL_NONE) {
        faults_add_at_byte(faults, path, AT_DATATYPE, "the data type %d is not supported; expected whole numbers of 8 to 64 bits, float32 or float64", code);
        return false;
    }
    if (bits != 8 * (int)voxel_type_size(out->type)) {
        faults_add_at_byte(faults, path, AT_BITPIX, "%d bits per voxel do not match data type %d; expected %d", bits, code,
                           8 * (int)voxel_type_size(out->type));
        return false;
    }
    double offset = float_at(h, AT_VOX_OFFSET), least = *is_pair ? 0 : DATA_START;
    if (offset == 0)
        offset = least;   // a smaller offset is common in pairs and tolerated in single files
    if (!(offset >= least && offset < 1e9) || floor(offset) != offset) {
        faults_add_at_byte(faults, path, AT_VOX_OFFSET, "the data offset %g is not valid; expected a whole number from %g", offset, least);
        return false;
    }
    *start = (size_t)offset;
    out->big_endian = h->big_endian;
    out->slope = float_at(h, AT_SLOPE);
    out->intercept = float_at(h, AT_INTERCEPT);
    if (out->slope == 0) {   // NIfTI's value for "no scaling"
        out->slope = 1;
        out->intercept = 0;
    }
    return read_grid(h, path, out, faults);
}

// Reads the samples of a .hdr from the file of the same name that ends in .img or .img.gz.
static Volume *read_pair(const FileBytes *file, VolumeHeader *header, size_t start, Faults *faults)
{
    const char *slash = strrchr(file->path, '/'), *base = slash ? slash + 1 : file->path;
    size_t stem = strlen(base);
    if (stem > 3 && !strcmp(base + stem - 3, ".gz"))
        stem -= 3;
    if (stem > 4 && base[stem - 4] == '.')
        stem -= 4;
    char name[1024], path[4096];
    FileBytes data;
    Faults first;
    faults_clear(&first);
    snprintf(name, sizeof name, "%.*s.img", (int)(stem < 900 ? stem : 900), base);
    // allow the longest file of either encoding
    header->encoding = ENCODING_DEFLATE;
    header->byte_skip = (long)start;
    bool found = file_bytes_read_beside(file->path, 0, name, strlen(name), header, &data, path, &first);
    if (!found) {
        size_t n = strlen(name);
        memcpy(name + n, ".gz", 4);
        found = file_bytes_read_beside(file->path, 0, name, n + 3, header, &data, path, &first);
        if (!found) {
            faults_add(faults, file->path, 0, 0, "the data file '%.*s' does not exist; it must be next to the header", (int)n, name);
            return NULL;
        }
    }
    data.path = path;
    header->encoding = is_gzip(&data) ? ENCODING_DEFLATE : ENCODING_RAW;
    Volume *volume = volume_decode(header, &data, faults);
    file_bytes_free(&data);
    return volume;
}

Volume *volume_parse_nifti(const FileBytes *file, Faults *faults)
{
    VolumeHeader header = {.format = "nifti", .slope = 1};
    NiftiBytes h;
    size_t start = 0;
    bool is_pair = false, gzip = is_gzip(file);
    uint8_t inflated[HEADER_BYTES];
    FileBytes head = *file;
    if (gzip) {
        if (!volume_inflate_head(file, inflated, HEADER_BYTES, faults))
            return NULL;
        head = (FileBytes){.byte = inflated, .length = HEADER_BYTES, .path = file->path};
    }
    bool good = read_header(&head, &h, &header, &start, &is_pair, faults);
    if (!good)
        return NULL;
    if (is_pair && file->needed)
        return NULL;
    if (is_pair)
        return read_pair(file, &header, start, faults);
    header.encoding = gzip ? ENCODING_DEFLATE : ENCODING_RAW;
    header.byte_skip = (long)start;
    return volume_decode(&header, file, faults);
}

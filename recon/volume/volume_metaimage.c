// Reads MetaImage (itk.org/Wiki/ITK/MetaIO): lines `Key = Value`, the last one ElementDataFile: LOCAL (the samples follow), a file, LIST (names follow, one
// per line) or numbered names.
//
// Voxel (i, j, k) lies at Offset + sum_a index_a ElementSpacing_a D_a, where D_a is the a-th triple of TransformMatrix.
#include "recon/volume/volume_metaimage.h"

#include <stdio.h>
#include <string.h>

enum Key {
    OBJECT_TYPE,
    NDIMS,
    DIM_SIZE,
    ELEMENT_TYPE,
    SPACING,
    ELEMENT_SIZE,
    OFFSET,
    MATRIX,
    ORIENTATION,
    BINARY,
    BIG_ENDIAN_KEY,
    COMPRESSED,
    COMPRESSED_SIZE,
    CHANNELS,
    HEADER_SIZE,
    SLOPE,
    INTERCEPT,
    DATA_FILE,
    KEY_COUNT
};

static const struct KeyName {
    const char *name;
    enum Key key;
} key_names[] = {
    {"ObjectType", OBJECT_TYPE},
    {"NDims", NDIMS},
    {"DimSize", DIM_SIZE},
    {"ElementType", ELEMENT_TYPE},
    {"ElementSpacing", SPACING},
    {"ElementSize", ELEMENT_SIZE},
    {"Offset", OFFSET},
    {"Origin", OFFSET},
    {"Position", OFFSET},
    {"TransformMatrix", MATRIX},
    {"Rotation", MATRIX},
    {"Orientation", MATRIX},
    {"AnatomicalOrientation", ORIENTATION},
    {"BinaryData", BINARY},
    {"BinaryDataByteOrderMSB", BIG_ENDIAN_KEY},
    {"ElementByteOrderMSB", BIG_ENDIAN_KEY},
    {"CompressedData", COMPRESSED},
    {"CompressedDataSize", COMPRESSED_SIZE},
    {"ElementNumberOfChannels", CHANNELS},
    {"HeaderSize", HEADER_SIZE},
    {"ElementToIntensityFunctionSlope", SLOPE},
    {"ElementToIntensityFunctionOffset", INTERCEPT},
    {"ElementDataFile", DATA_FILE},
};

static const struct {
    const char *name;
    VoxelType type;
} type_names[] = {
    {"MET_CHAR", VOXEL_INT8},         {"MET_ASCII_CHAR", VOXEL_INT8}, {"MET_UCHAR", VOXEL_UINT8},   {"MET_SHORT", VOXEL_INT16},  {"MET_USHORT", VOXEL_UINT16},
    {"MET_INT", VOXEL_INT32},         {"MET_UINT", VOXEL_UINT32},     {"MET_LONG", VOXEL_INT32},    {"MET_ULONG", VOXEL_UINT32}, {"MET_LONG_LONG", VOXEL_INT64},
    {"MET_ULONG_LONG", VOXEL_UINT64}, {"MET_FLOAT", VOXEL_FLOAT},     {"MET_DOUBLE", VOXEL_DOUBLE},
};
#define COUNT(TABLE) (sizeof(TABLE) / sizeof(TABLE)[0])

typedef struct KeyValue {
    const char *text;
    size_t length;
    int line;                // 0: absent
} KeyValue;

bool volume_is_metaimage(const FileBytes *file)
{
    LineCursor cursor = {file->byte, file->length, 0, 0};
    const char *text;
    size_t length;
    if (!line_cursor_next(&cursor, &text, &length) || length > 4096)
        return false;
    const char *equals = memchr(text, '=', length);
    if (!equals)
        return false;
    // ObjectType comes first in conforming files; old ones start with NDims or a comment
    size_t n = (size_t)(equals - text);
    return header_text_is(text, n, "ObjectType") || header_text_is(text, n, "NDims") || header_text_is(text, n, "Comment");
}

static bool gather(const FileBytes *file, KeyValue value[KEY_COUNT], size_t *end, Faults *faults)
{
    LineCursor cursor = {file->byte, file->length, 0, 0};
    const char *text;
    size_t length;
    int before = faults->count;
    while (!value[DATA_FILE].line) {
        if (!line_cursor_next(&cursor, &text, &length)) {
            faults_add_at_byte(faults, file->path, file->length,
                               "the header ends without ElementDataFile; expected `ElementDataFile = LOCAL` or a file name as its last "
                               "line");
            return false;
        }
        const char *equals = length ? memchr(text, '=', length) : NULL;
        if (!equals && length == 0)
            continue;
        if (!equals) {
            faults_add(faults, file->path, cursor.line, 1, "not a header line; expected `Key = Value`");
            return false;
        }
        size_t named = (size_t)(equals - text);
        // unknown keys are the user's own fields in this format
        for (size_t i = 0; i < COUNT(key_names); i++) {
            if (!header_text_is(text, named, key_names[i].name))
                continue;
            KeyValue *v = &value[key_names[i].key];
            if (v->line && key_names[i].key != BIG_ENDIAN_KEY)
                faults_add(faults, file->path, cursor.line, 1, "duplicate key '%s'; the first is on line %d", key_names[i].name, v->line);
            *v = (KeyValue){equals + 1, length - named - 1, cursor.line};
        }
    }
    *end = cursor.position;
    return faults->count == before;
}

static bool read_flag(const KeyValue *v, bool otherwise, const char *path, Faults *faults)
{
    if (!v->line)
        return otherwise;
    bool is_true = header_text_is(v->text, v->length, "True") || header_text_is(v->text, v->length, "1");
    if (!is_true && !header_text_is(v->text, v->length, "False") && !header_text_is(v->text, v->length, "0"))
        faults_add(faults, path, v->line, 0, "not a boolean; expected True or False");
    return is_true;
}

static void read_numbers(const KeyValue *v, int count, double *out, const char *path, Faults *faults)
{
    if (v->line && !header_numbers(v->text, v->length, count, out))
        faults_add(faults, path, v->line, 0, "not valid; expected %d numbers", count);
}

static bool read_grid(const KeyValue *value, const char *path, VolumeHeader *out, Faults *faults)
{
    int before = faults->count;
    double n[3], size[4] = {0, 0, 0, 1}, spacing[4] = {1, 1, 1, 1}, offset[4] = {0}, matrix[16] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (!value[NDIMS].line || !header_numbers(value[NDIMS].text, value[NDIMS].length, 1, n) || (n[0] != 3 && n[0] != 4)) {
        faults_add(faults, path, value[NDIMS].line, 0, "NDims is missing or not valid; expected 3");
        return false;
    }
    int d = (int)n[0];
    if (!value[DIM_SIZE].line)
        faults_add(faults, path, 0, 0, "the header has no DimSize; expected three sizes");
    read_numbers(&value[DIM_SIZE], d, size, path, faults);
    read_numbers(value[SPACING].line ? &value[SPACING] : &value[ELEMENT_SIZE], d, spacing, path, faults);
    read_numbers(&value[OFFSET], d, offset, path, faults);
    if (d == 4)   // identity matrix of four dimensions, if none is given
        memcpy(matrix, (double[16]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, sizeof matrix);
    read_numbers(&value[MATRIX], d * d, matrix, path, faults);
    if (faults->count > before)
        return false;
    for (int i = 0; i < d; i++)
        if (!(size[i] >= 1 && size[i] <= INT32_MAX) || floor(size[i]) != size[i] || (i == 3 && size[i] > 1)) {
            faults_add(faults, path, value[DIM_SIZE].line, 0, "size %g of axis %d is not valid; expected a whole number from 1 (1 for a fourth axis)", size[i],
                       i);
            return false;
        }
    for (int i = 0; i < 3; i++) {
        out->size[i] = (int)size[i];
        out->axis[i] = vec3_scale(vec3(matrix[i * d], matrix[i * d + 1], matrix[i * d + 2]), spacing[i]);
    }
    out->origin = vec3(offset[0], offset[1], offset[2]);
    return volume_header_check(out, path, value[MATRIX].line ? value[MATRIX].line : value[DIM_SIZE].line, faults);
}

static bool read_encoding(const KeyValue *value, const char *path, VolumeHeader *out, Faults *faults)
{
    int before = faults->count;
    const KeyValue *type = &value[ELEMENT_TYPE];
    for (size_t i = 0; i < COUNT(type_names); i++)
        if (type->line && header_text_is(type->text, type->length, type_names[i].name))
            out->type = type_names[i].type;
    if (out->type == VOXEL_NONE)
        faults_add(faults, path, type->line, 0, "ElementType is missing or not valid; expected MET_CHAR, MET_UCHAR, MET_SHORT … MET_DOUBLE");
    if (value[OBJECT_TYPE].line && !header_text_is(value[OBJECT_TYPE].text, value[OBJECT_TYPE].length, "Image"))
        faults_add(faults, path, value[OBJECT_TYPE].line, 0, "the object is not an image; expected ObjectType = Image");
    double one[1] = {1};
    read_numbers(&value[CHANNELS], 1, one, path, faults);
    if (one[0] != 1)
        faults_add(faults, path, value[CHANNELS].line, 0, "%g values per voxel; expected one", one[0]);
    read_numbers(&value[SLOPE], 1, &out->slope, path, faults);
    read_numbers(&value[INTERCEPT], 1, &out->intercept, path, faults);
    out->big_endian = read_flag(&value[BIG_ENDIAN_KEY], false, path, faults);
    bool compressed = read_flag(&value[COMPRESSED], false, path, faults);
    out->encoding = compressed ? ENCODING_DEFLATE : read_flag(&value[BINARY], true, path, faults) ? ENCODING_RAW : ENCODING_TEXT;
    if (value[HEADER_SIZE].line && !header_integer(value[HEADER_SIZE].text, value[HEADER_SIZE].length, -1, 1L << 52, &out->byte_skip))
        faults_add(faults, path, value[HEADER_SIZE].line, 0, "HeaderSize is not valid; expected a whole number from 0, or -1");
    if (out->byte_skip < 0 && out->encoding != ENCODING_RAW)
        faults_add(faults, path, value[HEADER_SIZE].line, 0, "HeaderSize -1 with compressed or text data; -1 is for raw data only");
    return faults->count == before;
}

// Writers that know the patient's sides name those of the voxels' axes, and give places in LPS, as ITK does. Without such a name, or with "???", the frame is not
// known.
static bool names_the_sides(const KeyValue *value)
{
    static const char sides[3][2] = {{'R', 'L'}, {'A', 'P'}, {'I', 'S'}};
    int seen = 0, letters = 0;
    for (size_t i = 0; value->line && i < value->length; i++) {
        letters += value->text[i] > ' ';
        for (int k = 0; k < 3; k++)
            seen |= value->text[i] == sides[k][0] || value->text[i] == sides[k][1] ? 1 << k : 0;
    }
    return letters == 3 && seen == 7;
}

Volume *volume_parse_metaimage(const FileBytes *file, Faults *faults)
{
    KeyValue value[KEY_COUNT] = {{0}};
    VolumeHeader header = {.format = "metaimage", .slope = 1};
    size_t end = 0;
    if (!gather(file, value, &end, faults))
        return NULL;
    bool good = read_encoding(value, file->path, &header, faults);
    if (names_the_sides(&value[ORIENTATION]))
        snprintf(header.frame, sizeof header.frame, "LPS");
    good = read_grid(value, file->path, &header, faults) && good;
    if (!good)
        return NULL;
    const KeyValue *name = &value[DATA_FILE];
    if (header_text_is(name->text, name->length, "LOCAL")) {
        FileBytes data = {.byte = file->byte + end,
                          .length = file->length - end,
                          .offset = end,
                          .path = file->path,
                          .whole = file->whole > file->length ? file->whole - end : 0,
                          .needed = file->needed};
        return volume_decode(&header, &data, faults);
    }
    if (file->needed)
        return NULL;
    if (data_names_several(name->text, name->length))
        return volume_decode_several(&header, file->path, name->line, name->text, name->length, (LineCursor){file->byte, file->length, end, name->line},
                                     faults);
    char path[4096];
    FileBytes data;
    if (!file_bytes_read_beside(file->path, name->line, name->text, name->length, &header, &data, path, faults))
        return NULL;
    data.path = path;
    Volume *volume = volume_decode(&header, &data, faults);
    file_bytes_free(&data);
    return volume;
}

// Reads NRRD, versions 1 to 5 (teem.sourceforge.net/nrrd/format.html): lines `field: value`, `key:=value` and `# comment` up to an empty line, then
// the samples, or the samples in detached files. Raw, gzip and text encodings.
//
// Fields are collected first and parsed afterwards, so their order does not matter. An unknown or repeated field is a fault, as the format demands.
#include "recon/volume/volume_nrrd.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum Field {
    TYPE,
    DIMENSION,
    SIZES,
    ENCODING,
    ENDIAN,
    DATA_FILE,
    LINE_SKIP,
    BYTE_SKIP,
    SPACE,
    SPACE_DIMENSION,
    SPACE_ORIGIN,
    SPACE_DIRECTIONS,
    SPACE_UNITS,
    SPACINGS,
    AXIS_MINS,
    AXIS_MAXS,
    CENTERS,
    UNITS,
    IGNORED,
    FIELD_COUNT
};

static const struct FieldName {
    const char *name;
    enum Field field;
} field_names[] = {
    {"type", TYPE},
    {"dimension", DIMENSION},
    {"sizes", SIZES},
    {"encoding", ENCODING},
    {"endian", ENDIAN},
    {"data file", DATA_FILE},
    {"datafile", DATA_FILE},
    {"line skip", LINE_SKIP},
    {"lineskip", LINE_SKIP},
    {"byte skip", BYTE_SKIP},
    {"byteskip", BYTE_SKIP},
    {"space", SPACE},
    {"space dimension", SPACE_DIMENSION},
    {"space origin", SPACE_ORIGIN},
    {"space directions", SPACE_DIRECTIONS},
    {"space units", SPACE_UNITS},
    {"spacings", SPACINGS},
    {"axis mins", AXIS_MINS},
    {"axismins", AXIS_MINS},
    {"axis maxs", AXIS_MAXS},
    {"axismaxs", AXIS_MAXS},
    {"centers", CENTERS},
    {"centerings", CENTERS},
    {"units", UNITS},
    // fields that do not affect the grid
    {"content", IGNORED},
    {"kinds", IGNORED},
    {"labels", IGNORED},
    {"thicknesses", IGNORED},
    {"number", IGNORED},
    {"min", IGNORED},
    {"max", IGNORED},
    {"old min", IGNORED},
    {"oldmin", IGNORED},
    {"old max", IGNORED},
    {"oldmax", IGNORED},
    {"block size", IGNORED},
    {"blocksize", IGNORED},
    {"sample units", IGNORED},
    {"sampleunits", IGNORED},
    {"measurement frame", IGNORED},
};

static const struct TypeName {
    const char *name;
    VoxelType type;
} type_names[] = {
    {"signed char", VOXEL_INT8},
    {"int8", VOXEL_INT8},
    {"int8_t", VOXEL_INT8},
    {"uchar", VOXEL_UINT8},
    {"unsigned char", VOXEL_UINT8},
    {"uint8", VOXEL_UINT8},
    {"uint8_t", VOXEL_UINT8},
    {"short", VOXEL_INT16},
    {"short int", VOXEL_INT16},
    {"signed short", VOXEL_INT16},
    {"signed short int", VOXEL_INT16},
    {"int16", VOXEL_INT16},
    {"int16_t", VOXEL_INT16},
    {"ushort", VOXEL_UINT16},
    {"unsigned short", VOXEL_UINT16},
    {"unsigned short int", VOXEL_UINT16},
    {"uint16", VOXEL_UINT16},
    {"uint16_t", VOXEL_UINT16},
    {"int", VOXEL_INT32},
    {"signed int", VOXEL_INT32},
    {"int32", VOXEL_INT32},
    {"int32_t", VOXEL_INT32},
    {"uint", VOXEL_UINT32},
    {"unsigned int", VOXEL_UINT32},
    {"uint32", VOXEL_UINT32},
    {"uint32_t", VOXEL_UINT32},
    {"longlong", VOXEL_INT64},
    {"long long", VOXEL_INT64},
    {"long long int", VOXEL_INT64},
    {"signed long long", VOXEL_INT64},
    {"signed long long int", VOXEL_INT64},
    {"int64", VOXEL_INT64},
    {"int64_t", VOXEL_INT64},
    {"ulonglong", VOXEL_UINT64},
    {"unsigned long long", VOXEL_UINT64},
    {"unsigned long long int", VOXEL_UINT64},
    {"uint64", VOXEL_UINT64},
    {"uint64_t", VOXEL_UINT64},
    {"float", VOXEL_FLOAT},
    {"double", VOXEL_DOUBLE},
};

static const struct SpaceName {
    const char *name, *frame;
} space_names[] = {
    {"right-anterior-superior", "RAS"},   {"RAS", "RAS"}, {"left-anterior-superior", "LAS"}, {"LAS", "LAS"},
    {"left-posterior-superior", "LPS"},   {"LPS", "LPS"}, {"scanner-xyz", "scanner-xyz"},    {"3D-right-handed", "3D-right-handed"},
    {"3D-left-handed", "3D-left-handed"},
};

enum { MAX_DIMENSION = 16 };
#define COUNT(TABLE) (sizeof(TABLE) / sizeof(TABLE)[0])

typedef struct FieldValue {
    const char *text;
    size_t length;
    int line;                // 0: absent
} FieldValue;

typedef struct NrrdHeader {
    FieldValue field[FIELD_COUNT];
    size_t end;              // first byte after the header
    bool has_end;            // the header ended with an empty line
} NrrdHeader;

bool volume_is_nrrd(const FileBytes *file) { return file->length >= 8 && !memcmp(file->byte, "NRRD000", 7); }

static bool gather(const FileBytes *file, NrrdHeader *header, Faults *faults)
{
    LineCursor cursor = {file->byte, file->length, 0, 0};
    const char *text;
    size_t length;
    int before = faults->count;
    line_cursor_next(&cursor, &text, &length);
    if (length < 8 || text[7] < '1' || text[7] > '5')
        faults_add(faults, file->path, 1, 8, "unknown version of the format; expected NRRD0001 to NRRD0005");
    while (line_cursor_next(&cursor, &text, &length) && length > 0) {
        const char *colon = memchr(text, ':', length);
        if (text[0] == '#')
            continue;
        if (!colon || (size_t)(colon - text) + 1 >= length || (colon[1] != ' ' && colon[1] != '=')) {
            faults_add(faults, file->path, cursor.line, 1,
                       "neither a field, a key nor a comment; expected `field: value`, `key:=value`, or an empty line before the data");
            return false;   // most likely the data: continuing would only repeat this fault
        }
        if (colon[1] == '=')
            continue;
        size_t named = (size_t)(colon - text);
        const struct FieldName *name = NULL;
        for (size_t i = 0; i < COUNT(field_names) && !name; i++)
            if (header_text_is(text, named, field_names[i].name))
                name = &field_names[i];
        FieldValue *value = name ? &header->field[name->field] : NULL;
        if (!name)
            faults_add(faults, file->path, cursor.line, 1, "unknown field '%.*s'; expected a field of NRRD, or `key:=value` for notes of your own",
                       named < 60 ? (int)named : 60, text);
        else if (value->line && name->field != IGNORED)
            faults_add(faults, file->path, cursor.line, 1, "duplicate field '%s'; the first is on line %d", name->name, value->line);
        else
            *value = (FieldValue){colon + 2, length - named - 2, cursor.line};
        if (name && name->field == DATA_FILE && data_names_several(colon + 1, length - named - 1) && !memchr(colon, '%', length - named))
            break;   // the names of a LIST occupy the rest of the header
    }
    header->has_end = cursor.position < file->length || length == 0;
    header->end = cursor.position;
    return faults->count == before;
}

// Parses the next "(a,b,c)" or "none" of a list of vectors.
static bool take_vector(FieldValue *value, double out[3], bool *is_none)
{
    while (value->length > 0 && isspace((unsigned char)*value->text))
        value->text++, value->length--;
    if (value->length >= 4 && !memcmp(value->text, "none", 4)) {
        *is_none = true;
        value->text += 4;
        value->length -= 4;
        return true;
    }
    const char *close = value->length ? memchr(value->text, ')', value->length) : NULL;
    if (!close || *value->text != '(')
        return false;
    char inner[256];
    size_t n = (size_t)(close - value->text) - 1;
    if (n >= sizeof inner)
        return false;
    for (size_t i = 0, commas = 0; i < n; i++) {
        inner[i] = value->text[i + 1];
        if (inner[i] == ',' && commas++ < 2)
            inner[i] = ' ';
    }
    *is_none = false;
    value->text = close + 1;
    value->length -= n + 2;
    return header_numbers(inner, n, 3, out);
}

// Millimetres per unit, from a field's quoted units, which must be the same for all axes. Returns 0 with a fault if they differ or are unknown.
static double unit_scale(const FieldValue *value, const char *path, Faults *faults)
{
    static const struct {
        const char *name;
        double mm;
    } units[] = {{"mm", 1},    {"millimeter", 1},    {"millimeters", 1}, {"millimetre", 1}, {"cm", 10}, {"m", 1000}, {"meter", 1000},
                 {"um", 1e-3}, {"micrometer", 1e-3}, {"micron", 1e-3},   {"nm", 1e-6},      {"", 1},    {"???", 1},  {"none", 1}};
    double scale = 0;
    const char *text = value->text, *end = text + value->length;
    for (const char *open; text < end && (open = memchr(text, '"', (size_t)(end - text)));) {
        const char *close = memchr(open + 1, '"', (size_t)(end - open - 1));
        if (!close)
            break;
        double mm = 0;
        for (size_t i = 0; i < COUNT(units); i++)
            if (header_text_is(open + 1, (size_t)(close - open - 1), units[i].name))
                mm = units[i].mm;
        if (mm <= 0 || (scale > 0 && mm != scale)) {   // exact comparison is safe: both are table entries
            faults_add(faults, path, value->line, 0, "the units are unknown or differ between axes; expected \"mm\" (or \"m\", \"cm\", \"um\") for each");
            return 0;
        }
        scale = mm;
        text = close + 1;
    }
    return scale > 0 ? scale : 1;
}

// Chooses the three spatial axes of `dimension` axes. Axes with one sample and without a direction are omitted.
static bool choose_axes(const NrrdHeader *h, int dimension, const double *size, const double (*direction)[3], const bool *is_none, int chosen[3],
                        const char *path, Faults *faults)
{
    bool has_directions = h->field[SPACE_DIRECTIONS].line > 0;
    int spare = dimension - 3, n = 0;
    for (int i = 0; i < dimension; i++) {
        bool drop = has_directions ? is_none[i] : spare > 0 && size[i] < 2;   // sizes are whole numbers >= 1 here
        if (drop && size[i] >= 2) {
            faults_add(faults, path, h->field[SIZES].line, 0,
                       "axis %d has no direction in space but %.0f samples: %.0f values per voxel; expected one value per voxel, axes of "
                       "space only",
                       i, size[i], size[i]);
            return false;
        }
        if (drop)
            spare--;
        else if (n < 3)
            chosen[n++] = i;
        else
            n++;
    }
    (void)direction;
    if (n != 3)
        faults_add(faults, path, h->field[DIMENSION].line, 0, "%d spatial axes; expected three", n);
    return n == 3;
}

static bool read_grid(const NrrdHeader *h, const char *path, VolumeHeader *out, Faults *faults)
{
    const FieldValue *f = h->field;
    long dimension = 0;
    double size[MAX_DIMENSION], spacing[MAX_DIMENSION], direction[MAX_DIMENSION][3] = {{0}}, least[MAX_DIMENSION];
    bool is_none[MAX_DIMENSION] = {false};
    if (!header_integer(f[DIMENSION].text, f[DIMENSION].length, 3, MAX_DIMENSION, &dimension)) {
        faults_add(faults, path, f[DIMENSION].line, 0, "the dimension is not valid; expected 3 (further axes must have one sample)");
        return false;
    }
    int n = (int)dimension, chosen[3];
    if (!header_numbers(f[SIZES].text, f[SIZES].length, n, size)) {
        faults_add(faults, path, f[SIZES].line, 0, "the sizes are not valid; expected %d whole numbers", n);
        return false;
    }
    for (int i = 0; i < n; i++)
        if (!(size[i] >= 1 && size[i] <= INT32_MAX) || floor(size[i]) != size[i]) {
            faults_add(faults, path, f[SIZES].line, 0, "size %g of axis %d is not valid; expected a whole number from 1", size[i], i);
            return false;
        }
    if (f[SPACE_DIRECTIONS].line) {
        FieldValue list = f[SPACE_DIRECTIONS];
        for (int i = 0; i < n; i++)
            if (!take_vector(&list, direction[i], &is_none[i])) {
                faults_add(faults, path, list.line, 0,
                           "direction %d of %d is missing or not valid; expected `(x,y,z)` for each spatial axis, `none` for others", i + 1, n);
                return false;
            }
    }
    if (f[SPACINGS].line && !header_numbers(f[SPACINGS].text, f[SPACINGS].length, n, spacing)) {
        faults_add(faults, path, f[SPACINGS].line, 0, "the spacings are not valid; expected %d numbers, nan for axes that have none", n);
        return false;
    }
    if (f[AXIS_MINS].line && !header_numbers(f[AXIS_MINS].text, f[AXIS_MINS].length, n, least)) {
        faults_add(faults, path, f[AXIS_MINS].line, 0, "the axis mins are not valid; expected %d numbers", n);
        return false;
    }
    if (!choose_axes(h, n, size, (const double(*)[3])direction, is_none, chosen, path, faults))
        return false;
    bool by_direction = f[SPACE_DIRECTIONS].line > 0;
    if (!by_direction && !f[SPACINGS].line && f[AXIS_MAXS].line) {
        faults_add(faults, path, f[AXIS_MAXS].line, 0, "axis maxs without spacings; expected `spacings` or `space directions`");
        return false;
    }
    const FieldValue *units = by_direction ? &f[SPACE_UNITS] : &f[UNITS];
    double scale = units->line ? unit_scale(units, path, faults) : 1, start[3] = {0, 0, 0};
    bool none = false;
    if (scale <= 0)
        return false;
    for (int i = 0; i < 3; i++) {
        int a = chosen[i];
        out->size[i] = (int)size[a];
        double step = f[SPACINGS].line ? spacing[a] : 1;
        out->axis[i] = by_direction ? vec3(direction[a][0], direction[a][1], direction[a][2]) : vec3(i == 0 ? step : 0, i == 1 ? step : 0, i == 2 ? step : 0);
        out->axis[i] = vec3_scale(out->axis[i], scale);
        if (!by_direction && f[AXIS_MINS].line && isfinite(least[a]))
            start[i] = least[a];
    }
    if (f[SPACE_ORIGIN].line) {
        FieldValue origin = f[SPACE_ORIGIN];
        if (!take_vector(&origin, start, &none) || none) {
            faults_add(faults, path, origin.line, 0, "the space origin is not valid; expected `(x,y,z)`");
            return false;
        }
    }
    out->origin = vec3_scale(vec3(start[0], start[1], start[2]), scale);
    return volume_header_check(out, path, by_direction ? f[SPACE_DIRECTIONS].line : f[SPACINGS].line ? f[SPACINGS].line : f[SIZES].line, faults);
}

static bool read_space(const NrrdHeader *h, const char *path, VolumeHeader *out, Faults *faults)
{
    const FieldValue *space = &h->field[SPACE], *dimension = &h->field[SPACE_DIMENSION];
    long n = 3;
    if (dimension->line && !header_integer(dimension->text, dimension->length, 3, 3, &n)) {
        faults_add(faults, path, dimension->line, 0, "the space dimension is not valid; expected 3");
        return false;
    }
    if (!space->line)
        return true;
    for (size_t i = 0; i < COUNT(space_names); i++)
        if (header_text_is(space->text, space->length, space_names[i].name)) {
            snprintf(out->frame, sizeof out->frame, "%s", space_names[i].frame);
            return true;
        }
    faults_add(faults, path, space->line, 0,
               "the space '%.*s' is unknown; expected right-anterior-superior, left-posterior-superior, left-anterior-superior, scanner-xyz or "
               "3D-right-handed",
               space->length < 60 ? (int)space->length : 60, space->text);
    return false;
}

static bool read_encoding(const NrrdHeader *h, const char *path, VolumeHeader *out, Faults *faults)
{
    const FieldValue *f = h->field, *type = &f[TYPE], *encoding = &f[ENCODING], *endian = &f[ENDIAN];
    int before = faults->count;
    for (size_t i = 0; i < COUNT(type_names); i++)
        if (header_text_is(type->text, type->length, type_names[i].name))
            out->type = type_names[i].type;
    if (out->type == VOXEL_NONE)
        faults_add(faults, path, type->line, 0, "the type '%.*s' is not valid; expected int8 to uint64, float or double",
                   type->length < 60 ? (int)type->length : 60, type->text);
    if (header_text_is(encoding->text, encoding->length, "raw"))
        out->encoding = ENCODING_RAW;
    else if (header_text_is(encoding->text, encoding->length, "gzip") || header_text_is(encoding->text, encoding->length, "gz"))
        out->encoding = ENCODING_DEFLATE;
    else if (header_text_is(encoding->text, encoding->length, "text") || header_text_is(encoding->text, encoding->length, "txt") ||
             header_text_is(encoding->text, encoding->length, "ascii"))
        out->encoding = ENCODING_TEXT;
    else
        faults_add(faults, path, encoding->line, 0,
                   "the encoding '%.*s' is not supported; expected raw, gzip or text (convert with `unu save -f nrrd -e gzip`)",
                   encoding->length < 60 ? (int)encoding->length : 60, encoding->text);
    if (endian->line) {
        out->big_endian = header_text_is(endian->text, endian->length, "big");
        if (!out->big_endian && !header_text_is(endian->text, endian->length, "little"))
            faults_add(faults, path, endian->line, 0, "the endian '%.*s' is not valid; expected little or big", endian->length < 60 ? (int)endian->length : 60,
                       endian->text);
    } else if (voxel_type_size(out->type) > 1 && out->encoding != ENCODING_TEXT) {
        faults_add(faults, path, type->line, 0, "samples of several bytes have no byte order; expected a line `endian: little` or `endian: big`");
    }
    if (f[LINE_SKIP].line && !header_integer(f[LINE_SKIP].text, f[LINE_SKIP].length, 0, 1L << 30, &out->line_skip))
        faults_add(faults, path, f[LINE_SKIP].line, 0, "the line skip is not valid; expected a whole number from 0");
    if (f[BYTE_SKIP].line && !header_integer(f[BYTE_SKIP].text, f[BYTE_SKIP].length, -1, 1L << 52, &out->byte_skip))
        faults_add(faults, path, f[BYTE_SKIP].line, 0, "the byte skip is not valid; expected a whole number from 0, or -1 for raw data at the end of the file");
    else if (out->byte_skip < 0 && out->encoding != ENCODING_RAW)
        faults_add(faults, path, f[BYTE_SKIP].line, 0, "byte skip -1 with this encoding; -1 is for raw data only");
    return faults->count == before;
}

Volume *volume_parse_nrrd(const FileBytes *file, Faults *faults)
{
    static const struct {
        enum Field field;
        const char *name;
    } required[] = {{TYPE, "type"}, {DIMENSION, "dimension"}, {SIZES, "sizes"}, {ENCODING, "encoding"}};
    NrrdHeader h = {0};
    VolumeHeader header = {.format = "nrrd", .slope = 1};
    int before = faults->count;
    if (!gather(file, &h, faults))
        return NULL;
    for (size_t i = 0; i < COUNT(required); i++)
        if (!h.field[required[i].field].line)
            faults_add(faults, file->path, 1, 0, "the header has no field '%s'; expected type, dimension, sizes and encoding", required[i].name);
    if (faults->count > before)
        return NULL;
    bool good = read_space(&h, file->path, &header, faults);
    good = read_encoding(&h, file->path, &header, faults) && good;
    good = read_grid(&h, file->path, &header, faults) && good;
    if (!good)
        return NULL;
    const FieldValue *detached = &h.field[DATA_FILE];
    if (!detached->line) {
        if (!h.has_end) {
            faults_add_at_byte(faults, file->path, file->length,
                               "the file ends within the header; expected an empty line and the data after it, or `data file: NAME`");
            return NULL;
        }
        FileBytes data = {.byte = file->byte + h.end,
                          .length = file->length - h.end,
                          .offset = h.end,
                          .path = file->path,
                          .whole = file->whole > file->length ? file->whole - h.end : 0,
                          .needed = file->needed};
        return volume_decode(&header, &data, faults);
    }
    if (file->needed)
        return NULL;
    if (data_names_several(detached->text, detached->length))
        return volume_decode_several(&header, file->path, detached->line, detached->text, detached->length,
                                     (LineCursor){file->byte, file->length, h.end, detached->line}, faults);
    char path[4096];
    FileBytes data;
    if (!file_bytes_read_beside(file->path, detached->line, detached->text, detached->length, &header, &data, path, faults))
        return NULL;
    data.path = path;
    Volume *volume = volume_decode(&header, &data, faults);
    file_bytes_free(&data);
    return volume;
}

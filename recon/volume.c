// Volumes: memory, samples to voxels, choice of the reader by content, NRRD output. The readers are volume_nrrd.c, volume_metaimage.c,
// volume_nifti.c and volume_dicom.c; what they share is volume_format.h.
//
// A header can lie. Before memory is taken the promised samples are held against the bytes that are there: raw data must be there in full,
// a deflate stream cannot grow by more than 1032 times, a number written as text takes two bytes.
#include "base/regular_file.h"
#include "geom/stops.h"
#include "recon/volume_format.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#define VOXEL_LIMIT ((size_t)1 << 31)
enum { DEFLATE_GROWTH = 1032, HEADER_MOST = 1 << 20, MOST_FILES_NAMED = 100000 };

// --- text ---

bool line_cursor_next(LineCursor *cursor, const char **text, size_t *length)
{
    if (cursor->position >= cursor->length)
        return false;
    const uint8_t *start = cursor->byte + cursor->position;
    size_t left = cursor->length - cursor->position;
    const uint8_t *end = memchr(start, '\n', left);
    *text = (const char *)start;
    *length = end ? (size_t)(end - start) : left;
    cursor->position += *length + (end ? 1 : 0);
    cursor->line++;
    if (*length > 0 && start[*length - 1] == '\r')
        --*length;
    return true;
}

// One number at the head of the text; advances past it. The text need not end in NUL.
static bool take_number(const char **text, size_t *length, double *value)
{
    char word[64];
    size_t n = 0, i = 0;
    while (i < *length && isspace((unsigned char)(*text)[i]))
        i++;
    while (i < *length && !isspace((unsigned char)(*text)[i])) {
        if (n + 1 >= sizeof word)
            return false;
        word[n++] = (*text)[i++];
    }
    word[n] = 0;
    char *end;
    *value = strtod(word, &end);
    *text += i;
    *length -= i;
    return n > 0 && *end == 0;
}

bool header_numbers(const char *text, size_t length, int count, double *out)
{
    for (int i = 0; i < count; i++)
        if (!take_number(&text, &length, &out[i]))
            return false;
    for (size_t i = 0; i < length; i++)
        if (!isspace((unsigned char)text[i]))
            return false;
    return true;
}

bool header_integer(const char *text, size_t length, long least, long most, long *out)
{
    double value;
    if (!header_numbers(text, length, 1, &value) || !(value >= (double)least && value <= (double)most) || floor(value) != value)
        return false;
    *out = (long)value;
    return true;
}

bool header_text_is(const char *text, size_t length, const char *wanted)
{
    while (length > 0 && isspace((unsigned char)*text))
        text++, length--;
    while (length > 0 && isspace((unsigned char)text[length - 1]))
        length--;
    if (length != strlen(wanted))
        return false;
    for (size_t i = 0; i < length; i++)
        if (tolower((unsigned char)text[i]) != tolower((unsigned char)wanted[i]))
            return false;
    return true;
}

// --- files ---

bool file_bytes_read(const char *path, FileBytes *out, Faults *faults)
{
    struct stat status;
    FILE *file = fopen(path, "rb");
    if (!file || fstat(fileno(file), &status)) {
        faults_add(faults, path, 0, 0, "cannot be opened; a readable file");
    } else if (!S_ISREG(status.st_mode)) {
        faults_add(faults, path, 0, 0, "is not a regular file; a volume is a file on disk");
    } else {
        size_t length = (size_t)status.st_size;
        uint8_t *byte = malloc(length + 1);
        size_t got = byte ? fread(byte, 1, length, file) : 0;
        if (byte && got == length) {
            fclose(file);
            *out = (FileBytes){byte, length, 0, path};
            return true;
        }
        faults_add(faults, path, 0, 0, byte ? "cannot be read to its end" : "is larger than the memory that is free");
        free(byte);
    }
    if (file)
        fclose(file);
    return false;
}

void file_bytes_free(FileBytes *file)
{
    free((void *)(uintptr_t)file->byte);
    *file = (FileBytes){0};
}

bool file_bytes_read_beside(const char *header_path, int line, const char *name, size_t length, FileBytes *out, char path[4096], Faults *faults)
{
    while (length > 0 && isspace((unsigned char)*name))
        name++, length--;
    while (length > 0 && isspace((unsigned char)name[length - 1]))
        length--;
    if (length == 0 || length > 1024 || memchr(name, 0, length)) {
        faults_add(faults, header_path, line, 0, "no name of a data file; the name of a file in the header's folder");
        return false;
    }
    if (length > 2 && name[0] == '.' && name[1] == '/')
        name += 2, length -= 2;
    bool leaves = name[0] == '/';
    for (size_t i = 0; i + 1 < length; i++)
        leaves = leaves || (name[i] == '.' && name[i + 1] == '.' && (i == 0 || name[i - 1] == '/') && (i + 2 == length || name[i + 2] == '/'));
    if (leaves) {
        faults_add(faults, header_path, line, 0, "the data file '%.*s' lies outside the header's folder; move it beside the header and give its name alone",
                   (int)length, name);
        return false;
    }
    const char *slash = strrchr(header_path, '/');
    int folder = slash ? (int)(slash - header_path) + 1 : 0;
    int wrote = snprintf(path, 4096, "%.*s%.*s", folder, header_path, (int)length, name);
    if (wrote < 0 || wrote >= 4096 || access(path, R_OK)) {
        faults_add(faults, header_path, line, 0, "the data file '%.*s' is not there; it must stand in the header's folder", (int)length, name);
        return false;
    }
    return file_bytes_read(path, out, faults);
}

// --- checks ---

size_t voxel_type_size(VoxelType type)
{
    static const size_t size[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return size[type];
}

bool volume_header_check(const VolumeHeader *header, const char *path, int line, Faults *faults)
{
    size_t count = 1;
    for (int i = 0; i < 3; i++) {
        if (header->size[i] < 1 || (size_t)header->size[i] > VOXEL_LIMIT / count) {
            faults_add(faults, path, line, 0, "size %d x %d x %d is not valid; each at least 1, at most 2^31 voxels in all", header->size[0],
                       header->size[1], header->size[2]);
            return false;
        }
        count *= (size_t)header->size[i];
    }
    Vec3 a = header->axis[0], b = header->axis[1], c = header->axis[2];
    double volume = fabs(vec3_dot(a, vec3_cross(b, c))), box = vec3_norm(a) * vec3_norm(b) * vec3_norm(c);
    if (!vec3_is_finite(header->origin) || !isfinite(volume) || !isfinite(box) || !(volume > 1e-6 * box) || !(box > 1e-24) || !(box < 1e24)) {
        faults_add(faults, path, line, 0, "the axes (%g,%g,%g) (%g,%g,%g) (%g,%g,%g) span no grid; three independent directions, finite and not 0, and a "
                   "finite origin", a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z);
        return false;
    }
    if (!isfinite(header->slope) || !isfinite(header->intercept)) {
        faults_add(faults, path, line, 0, "the scale of the values (slope %g, intercept %g) is not finite; slope 1 and intercept 0 for none",
                   header->slope, header->intercept);
        return false;
    }
    return true;
}

// --- samples ---

uint8_t *volume_inflate(const FileBytes *data, size_t wanted, Faults *faults)
{
    if (wanted / DEFLATE_GROWTH > data->length) {
        faults_add_at_byte(faults, data->path, data->offset, "%zu compressed bytes cannot hold the %zu bytes that the header promises; a header and data "
                           "that belong together", data->length, wanted);
        return NULL;
    }
    uint8_t *out = malloc(wanted ? wanted : 1);
    z_stream stream = {0};
    if (!out || inflateInit2(&stream, 15 + 32) != Z_OK) {
        faults_add(faults, data->path, 0, 0, "needs %zu bytes of memory, more than is free", wanted);
        free(out);
        return NULL;
    }
    size_t in = 0, made = 0;
    int state = Z_OK;
    const size_t chunk = (size_t)1 << 30;
    while (made < wanted && (state == Z_OK || state == Z_STREAM_END)) {
        if (state == Z_STREAM_END && inflateReset(&stream) != Z_OK)   // a gzip file may be several members on end
            break;
        uInt give = (uInt)(data->length - in < chunk ? data->length - in : chunk), take = (uInt)(wanted - made < chunk ? wanted - made : chunk);
        if (give == 0)
            break;
        stream.next_in = (Bytef *)(uintptr_t)(data->byte + in);
        stream.avail_in = give;
        stream.next_out = out + made;
        stream.avail_out = take;
        state = inflate(&stream, Z_NO_FLUSH);
        in += give - stream.avail_in;
        made += take - stream.avail_out;
    }
    inflateEnd(&stream);
    if (made == wanted)
        return out;
    if (state == Z_DATA_ERROR || state == Z_NEED_DICT)
        faults_add_at_byte(faults, data->path, data->offset + in, "the compressed data is damaged; an intact gzip or zlib stream");
    else
        faults_add_at_byte(faults, data->path, data->offset + in, "the data ends after %zu of %zu bytes; the whole file, or a header with the true sizes", made,
                           wanted);
    free(out);
    return NULL;
}

static uint64_t load_bits(const uint8_t *p, size_t size, bool big_endian)
{
    uint64_t bits = 0;
    for (size_t i = 0; i < size; i++)
        bits |= (uint64_t)p[big_endian ? size - 1 - i : i] << (8 * i);
    return bits;
}

#define CONVERT(TYPE, BITS)                                                            \
    for (size_t i = 0; i < count; i++) {                                               \
        BITS bits = (BITS)load_bits(sample + i * sizeof(TYPE), sizeof(TYPE), big);     \
        TYPE x;                                                                        \
        memcpy(&x, &bits, sizeof x);                                                   \
        value[i] = (float)(scaled ? header->slope * (double)x + header->intercept : (double)x); \
    }                                                                                  \
    break

static void convert(const VolumeHeader *header, const uint8_t *sample, size_t count, float *value)
{
    bool big = header->big_endian, scaled = header->slope != 1 || header->intercept != 0;
    switch (header->type) {
    case VOXEL_INT8: CONVERT(int8_t, uint8_t);
    case VOXEL_UINT8: CONVERT(uint8_t, uint8_t);
    case VOXEL_INT16: CONVERT(int16_t, uint16_t);
    case VOXEL_UINT16: CONVERT(uint16_t, uint16_t);
    case VOXEL_INT32: CONVERT(int32_t, uint32_t);
    case VOXEL_UINT32: CONVERT(uint32_t, uint32_t);
    case VOXEL_INT64: CONVERT(int64_t, uint64_t);
    case VOXEL_UINT64: CONVERT(uint64_t, uint64_t);
    case VOXEL_FLOAT: CONVERT(float, uint32_t);
    case VOXEL_DOUBLE: CONVERT(double, uint64_t);
    case VOXEL_NONE: break;
    }
}

bool volume_finish_values(Volume *volume, const FileBytes *data, size_t start, size_t sample_size, Faults *faults)
{
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2], bad = 0, first = 0;
    float least = volume->value[0], most = least;
    for (size_t i = 0; i < count; i++) {
        float x = volume->value[i];
        if (!isfinite(x) && bad++ == 0)
            first = i;
        least = x < least ? x : least;
        most = x > most ? x : most;
    }
    volume->minimum = least;
    volume->maximum = most;
    if (bad == 0)
        return true;
    size_t nx = (size_t)volume->size[0], ny = (size_t)volume->size[1];
    faults_add_at_byte(faults, data->path, start + first * sample_size, "%zu voxels are not finite numbers (NaN or too large), the first at (%zu, %zu, %zu); "
                       "finite values: set the unknown ones to the background's", bad, first % nx, first / nx % ny, first / (nx * ny));
    return false;
}

Volume *volume_of_header(const VolumeHeader *header, const char *path, Faults *faults)
{
    Volume *volume = volume_create(header->size, header->origin, header->axis);
    if (!volume) {
        faults_add(faults, path, 0, 0, "%d x %d x %d voxels need more memory than is free", header->size[0], header->size[1], header->size[2]);
        return NULL;
    }
    memcpy(volume->frame, header->frame, sizeof volume->frame);
    snprintf(volume->format, sizeof volume->format, "%s", header->format);
    return volume;
}

static Volume *decode_text(const VolumeHeader *header, const FileBytes *data, size_t count, Faults *faults)
{
    if (count / 2 > data->length) {
        faults_add_at_byte(faults, data->path, data->offset, "%zu bytes of text cannot hold %zu numbers; all numbers, or the true sizes", data->length, count);
        return NULL;
    }
    Volume *volume = volume_of_header(header, data->path, faults);
    const char *text = (const char *)data->byte;
    size_t left = data->length;
    for (size_t i = 0; volume && i < count; i++) {
        double x;
        if (!take_number(&text, &left, &x)) {
            faults_add_at_byte(faults, data->path, data->offset + data->length - left, "value %zu of %zu is missing or no number; numbers separated by blanks",
                               i + 1, count);
            volume_free(volume);
            return NULL;
        }
        volume->value[i] = (float)(header->slope * x + header->intercept);
    }
    if (volume && !volume_finish_values(volume, data, data->offset, 0, faults)) {
        volume_free(volume);
        return NULL;
    }
    return volume;
}

Volume *volume_decode(const VolumeHeader *header, const FileBytes *file, Faults *faults)
{
    FileBytes data = *file;
    size_t count = (size_t)header->size[0] * (size_t)header->size[1] * (size_t)header->size[2], sample = voxel_type_size(header->type);
    size_t bytes = count * sample;
    LineCursor cursor = {data.byte, data.length, 0, 0};
    for (long i = 0; i < header->line_skip; i++) {
        const char *text;
        size_t length;
        if (!line_cursor_next(&cursor, &text, &length)) {
            faults_add(faults, data.path, 0, 0, "has %ld lines, fewer than the header's line skip of %ld; a skip within the file", i, header->line_skip);
            return NULL;
        }
    }
    data = (FileBytes){data.byte + cursor.position, data.length - cursor.position, data.offset + cursor.position, data.path};
    uint8_t *inflated = NULL;
    size_t skip = header->byte_skip > 0 ? (size_t)header->byte_skip : 0;
    if (header->encoding == ENCODING_DEFLATE) {
        if (skip > SIZE_MAX - bytes || !(inflated = volume_inflate(&data, skip + bytes, faults))) {
            if (skip > SIZE_MAX - bytes)
                faults_add(faults, data.path, 0, 0, "the byte skip %zu is not valid; a skip within the file", skip);
            return NULL;
        }
    } else {
        if (header->byte_skip < 0)
            skip = data.length > bytes ? data.length - bytes : 0;
        if (skip > data.length) {
            faults_add_at_byte(faults, data.path, data.offset, "the byte skip %zu goes past the end; at most %zu", skip, data.length);
            return NULL;
        }
        data = (FileBytes){data.byte + skip, data.length - skip, data.offset + skip, data.path};
        if (header->encoding == ENCODING_TEXT)
            return decode_text(header, &data, count, faults);
        if (data.length < bytes) {
            faults_add_at_byte(faults, data.path, data.offset + data.length, "the data ends after %zu of %zu bytes (%d x %d x %d voxels of %zu); the "
                               "whole file, "
                               "or a header with the true sizes", data.length, bytes, header->size[0], header->size[1], header->size[2], sample);
            return NULL;
        }
    }
    Volume *volume = volume_of_header(header, data.path, faults);
    if (volume) {
        convert(header, inflated ? inflated + skip : data.byte, count, volume->value);
        // bytes inside a compressed stream have no place in the file: tell where it starts
        if (!volume_finish_values(volume, &data, data.offset, inflated ? 0 : sample, faults)) {
            volume_free(volume);
            volume = NULL;
        }
    }
    free(inflated);
    return volume;
}

// --- samples in several files ---

static bool is_list(const char *text, size_t length)
{
    while (length > 0 && isspace((unsigned char)*text))
        text++, length--;
    return length >= 4 && !memcmp(text, "LIST", 4) && (length == 4 || isspace((unsigned char)text[4]));
}

bool data_names_several(const char *text, size_t length) { return is_list(text, length) || (length > 0 && memchr(text, '%', length)); }

typedef struct NumberedName {   // before, number, after
    const char *text;
    int before, width, after_at, after;
    bool zeros;
    long first, last, step;
} NumberedName;

static bool read_numbered(const char *text, size_t length, NumberedName *out)
{
    double number[4];
    while (length > 0 && isspace((unsigned char)*text))
        text++, length--;
    size_t named = 0, i;
    while (named < length && !isspace((unsigned char)text[named]))
        named++;
    const char *percent = memchr(text, '%', named);
    int given = 0;
    for (int n = 4; n >= 2 && !given; n--)
        given = header_numbers(text + named, length - named, n, number) ? n : 0;
    if (!percent || !given || named > 1000)
        return false;
    *out = (NumberedName){.text = text, .before = (int)(percent - text)};
    i = (size_t)out->before + 1;
    out->zeros = i < named && text[i] == '0';
    for (; i < named && isdigit((unsigned char)text[i]); i++)
        out->width = out->width * 10 + (text[i] - '0') > 20 ? 21 : out->width * 10 + (text[i] - '0');
    if (i >= named || text[i] != 'd' || out->width > 20 || memchr(text + i, '%', named - i))
        return false;
    out->after_at = (int)i + 1;
    out->after = (int)(named - i) - 1;
    for (int k = 0; k < 2 + (given > 2); k++)
        if (!(fabs(number[k]) < 1e9) || floor(number[k]) != number[k])
            return false;
    out->first = (long)number[0];
    out->last = (long)number[1];
    out->step = given > 2 ? (long)number[2] : 1;
    return out->step != 0 && (out->step > 0 ? out->first <= out->last : out->first >= out->last);
}

// The name of file `index`, 0 …; false after the last. Blank lines of a list are passed over.
static bool next_name(const NumberedName *numbered, LineCursor *names, long index, char name[1200], int *line)
{
    if (!numbered) {
        const char *text;
        size_t length = 0;
        while (line_cursor_next(names, &text, &length)) {
            while (length > 0 && isspace((unsigned char)text[length - 1]))
                length--;
            if (length > 0 && length < 1100) {
                memcpy(name, text, length);
                name[length] = 0;
                *line = names->line;
                return true;
            }
        }
        return false;
    }
    long number = numbered->first + index * numbered->step;
    if (numbered->step > 0 ? number > numbered->last : number < numbered->last)
        return false;
    snprintf(name, 1200, numbered->zeros ? "%.*s%0*ld%.*s" : "%.*s%*ld%.*s", numbered->before, numbered->text, numbered->width, number, numbered->after,
             numbered->text + numbered->after_at);
    return true;
}

Volume *volume_decode_several(const VolumeHeader *header, const char *header_path, int line, const char *text, size_t length, LineCursor names, Faults *faults)
{
    NumberedName numbered;
    bool by_list = is_list(text, length);
    char name[1200], path[4096];
    if (!by_list && !read_numbered(text, length, &numbered)) {
        faults_add(faults, header_path, line, 0, "not a numbered name; `NAME%%03d.raw FIRST LAST STEP`, or LIST and a name a line");
        return NULL;
    }
    const NumberedName *how = by_list ? NULL : &numbered;
    if (header->encoding != ENCODING_RAW || header->line_skip > 0) {
        faults_add(faults, header_path, line, 0, "several data files that are compressed, text or begin with lines are not read; raw data, or one data file");
        return NULL;
    }
    size_t bytes = (size_t)header->size[0] * (size_t)header->size[1] * (size_t)header->size[2] * voxel_type_size(header->type), files = 0, done = 0;
    LineCursor counting = names;
    int at = line;
    while (files <= (size_t)header->size[2] && next_name(how, &counting, (long)files, name, &at))
        files++;
    if (files == 0 || files > (size_t)header->size[2] || (size_t)header->size[2] % files != 0) {
        faults_add(faults, header_path, line, 0, "%zu%s data files for %d slices; as many, or a divisor of that", files,
                   files > (size_t)header->size[2] ? " or more" : "",
                   header->size[2]);
        return NULL;
    }
    size_t share = bytes / files;
    uint8_t *joined = NULL;
    bool good = true;
    at = line;
    for (size_t i = 0; good && i < files; i++) {
        FileBytes data;
        next_name(how, &names, (long)i, name, &at);
        good = file_bytes_read_beside(header_path, at, name, strlen(name), &data, path, faults);
        if (!good)
            break;
        size_t skip = header->byte_skip >= 0 ? (size_t)header->byte_skip : data.length > share ? data.length - share : 0;
        good = skip <= data.length && data.length - skip >= share;
        if (!good)
            faults_add_at_byte(faults, path, data.length, "the data ends after %zu of %zu bytes", data.length, skip + share);
        else if (!joined && !(joined = malloc(bytes)))   // one file has shown that the sizes are not mere words
            faults_add(faults, header_path, line, 0, "needs %zu bytes of memory, more than is free", bytes);
        good = good && joined;
        if (good)
            memcpy(joined + done, data.byte + skip, share);
        done += share;
        file_bytes_free(&data);
    }
    VolumeHeader plain = *header;
    plain.byte_skip = 0;
    FileBytes all = {joined, bytes, 0, header_path};
    Volume *volume = good ? volume_decode(&plain, &all, faults) : NULL;
    free(joined);
    return volume;
}

// --- which files a volume is made of ---

typedef void FileCall(void *context, const char *path);

// The name that an option like `data file: NAME` gives, in the header's folder.
static void call_beside(const char *header_path, const char *name, size_t length, FileCall *call, void *context)
{
    char path[4096];
    const char *slash = strrchr(header_path, '/');
    while (length > 0 && isspace((unsigned char)*name))
        name++, length--;
    while (length > 0 && isspace((unsigned char)name[length - 1]))
        length--;
    int wrote = snprintf(path, sizeof path, "%.*s%.*s", slash ? (int)(slash - header_path) + 1 : 0, header_path, length < 1024 ? (int)length : 1024, name);
    if (length > 0 && wrote > 0 && wrote < (int)sizeof path)
        call(context, path);
}

static void call_named(const char *header_path, const char *text, size_t length, LineCursor names, FileCall *call, void *context)
{
    NumberedName numbered;
    char name[1200];
    int line;
    bool by_list = is_list(text, length);
    if (!data_names_several(text, length))
        call_beside(header_path, text, length, call, context);
    else if (by_list || read_numbered(text, length, &numbered))
        for (long i = 0; i < MOST_FILES_NAMED && next_name(by_list ? NULL : &numbered, &names, i, name, &line); i++)
            call_beside(header_path, name, strlen(name), call, context);
}

static void call_folder(const char *folder, FileCall *call, void *context)
{
    DIR *directory = opendir(folder);
    char path[4096];
    for (struct dirent *entry; directory && (entry = readdir(directory));)
        if (entry->d_name[0] != '.' && snprintf(path, sizeof path, "%s/%s", folder, entry->d_name) < (int)sizeof path)
            call(context, path);
    if (directory)
        closedir(directory);
}

// Header and samples of a NIfTI pair, whichever was named.
static void call_pair(const char *path, FileCall *call, void *context)
{
    static const char *const endings[] = {".hdr", ".img", ".hdr.gz", ".img.gz"};
    size_t n = strlen(path), stem = n > 3 && !strcmp(path + n - 3, ".gz") ? n - 3 : n;
    char other[4096];
    if (stem < 5 || (memcmp(path + stem - 4, ".hdr", 4) && memcmp(path + stem - 4, ".img", 4)))
        return;
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
        if (snprintf(other, sizeof other, "%.*s%s", (int)(stem - 4), path, endings[i]) < (int)sizeof other)
            call(context, other);
}

static void call_header(const FileBytes *file, FileCall *call, void *context)
{
    bool is_nrrd = volume_is_nrrd(file);
    LineCursor cursor = {file->byte, file->length, 0, 0};
    const char *text;
    size_t length;
    while (line_cursor_next(&cursor, &text, &length) && length > 0) {
        const char *sign = memchr(text, is_nrrd ? ':' : '=', length);
        size_t named = sign ? (size_t)(sign - text) : 0;
        bool is_key = is_nrrd ? header_text_is(text, named, "data file") || header_text_is(text, named, "datafile") : header_text_is(text, named, "ElementDataFile");
        if (sign && is_key) {
            call_named(file->path, sign + 1, length - named - 1, cursor, call, context);
            return;
        }
    }
}

void volume_each_data_file(const char *path, FileCall *call, void *context)
{
    struct stat status;
    const char *why;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
        call_folder(path, call, context);
        return;
    }
    call_pair(path, call, context);
    int descriptor = regular_file_open(path, &status, &why);
    uint8_t *byte = descriptor >= 0 ? malloc(HEADER_MOST) : NULL;
    size_t length = byte ? regular_file_read(descriptor, byte, HEADER_MOST) : 0;
    if (descriptor >= 0)
        close(descriptor);
    const FileBytes file = {byte, length, 0, path};
    if (byte && (volume_is_nrrd(&file) || volume_is_metaimage(&file))) {
        call_header(&file, call, context);
    } else if (byte && volume_is_dicom(&file)) {
        char folder[4096];
        const char *slash = strrchr(path, '/');
        snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) : 1, slash ? path : ".");
        call_folder(folder[0] ? folder : "/", call, context);
    }
    free(byte);
}

// --- the public face ---

Volume *volume_create(const int size[3], Vec3 origin, const Vec3 axis[3])
{
    size_t count = 1;
    for (int i = 0; i < 3; i++) {
        if (size[i] < 1 || (size_t)size[i] > VOXEL_LIMIT / count)
            return NULL;
        count *= (size_t)size[i];
    }
    Volume *volume = calloc(1, sizeof *volume);
    if (!volume || !(volume->value = calloc(count, sizeof *volume->value))) {
        free(volume);
        return NULL;
    }
    memcpy(volume->size, size, sizeof volume->size);
    volume->origin = origin;
    memcpy(volume->axis, axis, sizeof volume->axis);
    // the inverse of (a b c) by columns has rows b x c, c x a, a x b over the determinant
    Vec3 bc = vec3_cross(axis[1], axis[2]), ca = vec3_cross(axis[2], axis[0]), ab = vec3_cross(axis[0], axis[1]);
    double s = 1 / vec3_dot(axis[0], bc);
    volume->to_voxel = (Mat3){{{bc.x * s, bc.y * s, bc.z * s}, {ca.x * s, ca.y * s, ca.z * s}, {ab.x * s, ab.y * s, ab.z * s}}};
    return volume;
}

void volume_free(Volume *volume)
{
    if (volume)
        free(volume->value);
    free(volume);
}

static bool names_samples_of_pair(const char *path)
{
    size_t n = strlen(path);
    return n > 4 && !strcmp(path + n - 4, ".img");
}

bool volume_is_known(const void *bytes, size_t length, const char *path)
{
    FileBytes file = {bytes, length, 0, path};
    return volume_is_nrrd(&file) || volume_is_nifti(&file) || volume_is_metaimage(&file) || volume_is_dicom(&file) || names_samples_of_pair(path);
}

Volume *volume_parse(const void *bytes, size_t length, const char *path, Faults *faults)
{
    FileBytes file = {bytes, length, 0, path};
    if (volume_is_nrrd(&file))
        return volume_parse_nrrd(&file, faults);
    if (volume_is_nifti(&file))
        return volume_parse_nifti(&file, faults);
    if (volume_is_metaimage(&file))
        return volume_parse_metaimage(&file, faults);
    if (volume_is_dicom(&file))
        return volume_parse_dicom(&file, faults);
    faults_add_at_byte(faults, path, 0, "is no volume that can be read; NRRD (.nrrd .nhdr), MetaImage (.mha .mhd), NIfTI (.nii .nii.gz .hdr) or DICOM");
    return NULL;
}

Volume *volume_load(const char *path, Faults *faults)
{
    FileBytes file;
    struct stat status;
    if (!stat(path, &status) && S_ISDIR(status.st_mode))
        return volume_load_dicom_folder(path, faults);
    if (!file_bytes_read(path, &file, faults))
        return NULL;
    size_t n = strlen(path);
    char header[4096];
    // the samples of a NIfTI pair were named: their header tells
    bool pair = names_samples_of_pair(path) && n < sizeof header && !volume_is_nrrd(&file) && !volume_is_nifti(&file);
    if (pair) {
        memcpy(header, path, n - 3);
        memcpy(header + n - 3, "hdr", 4);
        FileBytes other;
        if (!access(header, R_OK) && file_bytes_read(header, &other, faults)) {
            file_bytes_free(&file);
            file = other;
            path = header;
        }
    }
    Volume *volume = volume_parse(file.byte, file.length, path, faults);
    file_bytes_free(&file);
    return volume;
}

// --- NRRD output ---

static const struct SaveType {
    const char *name;
    size_t size;
    double least, most;
} save_types[] = {{"float", 4, 0, 0}, {"uint8", 1, 0, 255}, {"int16", 2, -32768, 32767}};

// Little-endian samples of the voxels; NULL with a fault where a value does not fit the type.
static uint8_t *encode_samples(const Volume *volume, size_t count, const struct SaveType *type, const char *path, Faults *faults)
{
    uint8_t *out = malloc(count * type->size);
    if (!out) {
        faults_add(faults, path, 0, 0, "needs %zu bytes of memory, more than is free", count * type->size);
        return NULL;
    }
    for (size_t i = 0; i < count; i++) {
        float x = volume->value[i];
        uint32_t bits;
        if (type->size == 4) {
            memcpy(&bits, &x, 4);
        } else {
            double whole = nearbyint(x);
            if (!(whole >= type->least && whole <= type->most)) {
                faults_add(faults, path, 0, 0, "voxel %zu has the value %g, which %s cannot hold; save as float", i, (double)x, type->name);
                free(out);
                return NULL;
            }
            bits = (uint32_t)(int32_t)whole;
        }
        for (size_t b = 0; b < type->size; b++)
            out[i * type->size + b] = (uint8_t)(bits >> (8 * b));
    }
    return out;
}

static bool write_gzip(FILE *file, const uint8_t *byte, size_t length)
{
    z_stream stream = {0};
    uint8_t buffer[1 << 15];
    const size_t chunk = (size_t)1 << 28;
    if (deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        return false;
    bool good = true;
    for (size_t done = 0; good && done < length;) {
        size_t give = length - done < chunk ? length - done : chunk;
        stream.next_in = (Bytef *)(uintptr_t)(byte + done);
        stream.avail_in = (uInt)give;
        done += give;
        int flush = done == length ? Z_FINISH : Z_NO_FLUSH;
        do {
            stream.next_out = buffer;
            stream.avail_out = sizeof buffer;
            deflate(&stream, flush);
            size_t made = sizeof buffer - stream.avail_out;
            good = fwrite(buffer, 1, made, file) == made;
        } while (good && stream.avail_out == 0);
    }
    deflateEnd(&stream);
    return good;
}

bool volume_save_nrrd(const Volume *volume, const char *path, const char *type_name, Faults *faults)
{
    const struct SaveType *type = NULL;
    for (size_t i = 0; i < sizeof save_types / sizeof save_types[0]; i++)
        if (!strcmp(save_types[i].name, type_name))
            type = &save_types[i];
    char part[4096];
    int named = snprintf(part, sizeof part, "%s.part-%ld", path, (long)getpid());
    if (!type || named < 0 || named >= (int)sizeof part) {
        faults_add(faults, path, 0, 0, type ? "the path is too long; at most 4000 bytes" : "'%s' is no sample type; float, uint8 or int16", type_name);
        return false;
    }
    struct stat status;
    if (!stat(path, &status) && !S_ISREG(status.st_mode)) {   // renaming over a device would replace it
        faults_add(faults, path, 0, 0, "is there and no regular file; another name");
        return false;
    }
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    uint8_t *sample = encode_samples(volume, count, type, path, faults);
    if (!sample)
        return false;
    sigset_t before;
    stops_hold(&before);
    FILE *file = fopen(part, "wb");
    bool good = file != NULL;
    int reason = errno;
    if (good) {
        const Vec3 *a = volume->axis, o = volume->origin;
        fprintf(file, "NRRD0004\ntype: %s\ndimension: 3\n", type->name);
        if (volume->frame[0])
            fprintf(file, "space: %s\n", volume->frame);
        else
            fprintf(file, "space dimension: 3\n");
        fprintf(file, "sizes: %d %d %d\nspace directions:", volume->size[0], volume->size[1], volume->size[2]);
        for (int i = 0; i < 3; i++)
            fprintf(file, " (%.17g,%.17g,%.17g)", a[i].x, a[i].y, a[i].z);
        fprintf(file, "\nkinds: domain domain domain\nendian: little\nencoding: gzip\nspace origin: (%.17g,%.17g,%.17g)\n\n", o.x, o.y, o.z);
        good = write_gzip(file, sample, count * type->size);
        good = fclose(file) == 0 && good;
        good = good && rename(part, path) == 0;
        reason = errno;
        if (!good)
            remove(part);
    }
    stops_release(&before);
    free(sample);
    if (!good)
        faults_add(faults, path, 0, 0, "cannot be written: %s; a folder that exists, may be written to, and has room", strerror(reason));
    return good;
}

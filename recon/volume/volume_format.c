// Code that the readers share: parsing a header's text, finding the files that it gives, and converting samples to voxels.
//
// A header may be wrong. Before memory is allocated, the number of samples is compared with the available bytes: raw data must be complete, a deflate
// stream expands by 1032 times at most, a number written as text takes two bytes. No more of a file is read than its header implies.
#include "recon/volume/volume_format.h"

#include "base/base.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum { DEFLATE_GROWTH = 1032, MOST_FILES_NAMED = 100000, TEXT_NUMBER_MOST = 64, SLACK = 1 << 24, PIECE = 1 << 20 };

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

// Parses one number at the start of the text and advances past it. The text need not end in NUL.
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

bool file_bytes_read(const char *path, size_t most, FileBytes *out, Faults *faults)
{
    struct stat status;
    const char *why;
    int file = regular_file_open(path, &status, &why);
    if (file < 0) {
        faults_add(faults, path, 0, 0, "cannot be opened: %s; expected a readable file on disk", why);
        return false;
    }
    size_t whole = (size_t)status.st_size, length = whole < most ? whole : most;
    uint8_t *byte = malloc(length + 1);
    size_t got = byte ? regular_file_read(file, byte, length) : 0;
    int reason = errno;
    close(file);
    if (!byte || got < length) {
        if (byte)
            faults_add(faults, path, 0, 0, "cannot be read completely: %s", reason ? strerror(reason) : "the file became shorter");
        else
            faults_add(faults, path, 0, 0, "is larger than the available memory");
        free(byte);
        return false;
    }
    *out = (FileBytes){.byte = byte, .length = length, .path = path, .whole = whole};
    return true;
}

void file_bytes_free(FileBytes *file)
{
    free((void *)(uintptr_t)file->byte);
    *file = (FileBytes){0};
}

// Most bytes of a data file that are read: what the header implies, and the tolerance for a longer file.
static size_t data_most(const VolumeHeader *header)
{
    size_t count = (size_t)header->size[0] * (size_t)header->size[1] * (size_t)header->size[2], bytes = count * voxel_type_size(header->type);
    size_t skip = header->byte_skip > 0 ? (size_t)header->byte_skip : 0;
    bytes = header->encoding == ENCODING_TEXT ? TEXT_NUMBER_MOST * count : bytes;
    if (bytes > SIZE_MAX / 2 - skip)
        return SIZE_MAX / 2;
    bytes += skip;
    // deflate may also lengthen the data: by 5 bytes per block of 16 KB, and a header
    return header->encoding == ENCODING_RAW && header->line_skip == 0 && header->byte_skip >= 0 ? bytes : bytes + bytes / 1000 + SLACK;
}

// If the samples are at the end of a file or follow skipped lines, their offset is unknown: a file much longer than expected is then probably the wrong file.
static bool is_not_too_long(const VolumeHeader *header, const FileBytes *file, Faults *faults)
{
    if (file->whole <= file->length || (header->byte_skip >= 0 && header->line_skip == 0))
        return true;
    faults_add(faults, file->path, 0, 0, "is %zu bytes long, but its header promises %zu; at most %d extra bytes are ignored", file->whole,
               data_most(header) - SLACK, SLACK);
    return false;
}

bool file_bytes_read_beside(const char *header_path, int line, const char *name, size_t length, const VolumeHeader *header, FileBytes *out, char path[4096],
                            Faults *faults)
{
    while (length > 0 && isspace((unsigned char)*name))
        name++, length--;
    while (length > 0 && isspace((unsigned char)name[length - 1]))
        length--;
    if (length == 0 || length > 1024 || memchr(name, 0, length)) {
        faults_add(faults, header_path, line, 0, "the name of the data file is missing; expected the name of a file in the header's folder");
        return false;
    }
    if (length > 2 && name[0] == '.' && name[1] == '/')
        name += 2, length -= 2;
    bool leaves = name[0] == '/';
    for (size_t i = 0; i + 1 < length; i++)
        leaves = leaves || (name[i] == '.' && name[i + 1] == '.' && (i == 0 || name[i - 1] == '/') && (i + 2 == length || name[i + 2] == '/'));
    if (leaves) {
        faults_add(faults, header_path, line, 0, "the data file '%.*s' lies outside the header's folder; move it next to the header and give its name alone",
                   (int)length, name);
        return false;
    }
    const char *slash = strrchr(header_path, '/');
    int folder = slash ? (int)(slash - header_path) + 1 : 0;
    int wrote = snprintf(path, 4096, "%.*s%.*s", folder, header_path, (int)length, name);
    if (wrote < 0 || wrote >= 4096 || access(path, R_OK)) {
        faults_add(faults, header_path, line, 0, "the data file '%.*s' does not exist; it must be in the header's folder", (int)length, name);
        return false;
    }
    return file_bytes_read(path, data_most(header), out, faults);
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
        if (header->size[i] < 1 || (size_t)header->size[i] > VOLUME_VOXELS_MOST / count) {
            faults_add(faults, path, line, 0, "size %d x %d x %d is not valid; expected at least 1 each and at most 2^31 voxels in all", header->size[0],
                       header->size[1], header->size[2]);
            return false;
        }
        count *= (size_t)header->size[i];
    }
    Vec3 a = header->axis[0], b = header->axis[1], c = header->axis[2];
    double volume = fabs(vec3_dot(a, vec3_cross(b, c))), box = vec3_norm(a) * vec3_norm(b) * vec3_norm(c);
    if (!vec3_is_finite(header->origin) || !isfinite(volume) || !isfinite(box) || !(volume > 1e-6 * box) || !(box > 1e-24) || !(box < 1e24)) {
        faults_add(faults, path, line, 0,
                   "the axes (%g,%g,%g) (%g,%g,%g) (%g,%g,%g) span no grid; expected three independent directions, finite and not 0, and a "
                   "finite origin",
                   a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z);
        return false;
    }
    if (!isfinite(header->slope) || !isfinite(header->intercept)) {
        faults_add(faults, path, line, 0, "the scale of the values (slope %g, intercept %g) is not finite; expected slope 1 and intercept 0 for none",
                   header->slope, header->intercept);
        return false;
    }
    return true;
}

// --- samples ---

// A gzip or zlib stream; a gzip file may be several members end to end.
typedef struct Inflater {
    z_stream stream;
    const FileBytes *data;
    size_t in;               // compressed bytes consumed
    int state;
} Inflater;

static bool inflater_open(Inflater *inflater, const FileBytes *data)
{
    *inflater = (Inflater){.data = data, .state = Z_OK};
    return inflateInit2(&inflater->stream, 15 + 32) == Z_OK;
}

// Reads the next `wanted` bytes, or fewer if the stream ends or is damaged.
static size_t inflater_read(Inflater *inflater, uint8_t *out, size_t wanted)
{
    const size_t chunk = (size_t)1 << 30;
    const FileBytes *data = inflater->data;
    z_stream *stream = &inflater->stream;
    size_t made = 0;
    while (made < wanted && (inflater->state == Z_OK || inflater->state == Z_STREAM_END)) {
        size_t left = data->length - inflater->in;
        if (left == 0 || (inflater->state == Z_STREAM_END && inflateReset(stream) != Z_OK))
            break;
        uInt give = (uInt)(left < chunk ? left : chunk), take = (uInt)(wanted - made < chunk ? wanted - made : chunk);
        stream->next_in = (Bytef *)(uintptr_t)(data->byte + inflater->in);
        stream->avail_in = give;
        stream->next_out = out + made;
        stream->avail_out = take;
        inflater->state = inflate(stream, Z_NO_FLUSH);
        inflater->in += give - stream->avail_in;
        made += take - stream->avail_out;
    }
    return made;
}

static void report_short(const Inflater *inflater, size_t made, size_t wanted, Faults *faults)
{
    const FileBytes *data = inflater->data;
    if (inflater->state == Z_DATA_ERROR || inflater->state == Z_NEED_DICT)
        faults_add_at_byte(faults, data->path, data->offset + inflater->in, "the compressed data is damaged; expected an intact gzip or zlib stream");
    else
        faults_add_at_byte(faults, data->path, data->offset + inflater->in,
                           "the data ends after %zu of %zu bytes; expected the whole file, or a header with the true sizes", made, wanted);
}

static bool can_hold(const FileBytes *data, size_t wanted, Faults *faults)
{
    if (wanted / DEFLATE_GROWTH <= data->length)
        return true;
    faults_add_at_byte(faults, data->path, data->offset,
                       "%zu compressed bytes cannot hold the %zu bytes that the header promises; expected a header and data "
                       "that belong together",
                       data->length, wanted);
    return false;
}

bool volume_inflate_head(const FileBytes *data, uint8_t *out, size_t wanted, Faults *faults)
{
    Inflater inflater;
    if (!can_hold(data, wanted, faults))
        return false;
    if (!inflater_open(&inflater, data)) {
        faults_add(faults, data->path, 0, 0, "needs more memory than is available");
        return false;
    }
    size_t made = inflater_read(&inflater, out, wanted);
    inflateEnd(&inflater.stream);
    if (made < wanted)
        report_short(&inflater, made, wanted, faults);
    return made == wanted;
}

static uint64_t load_bits(const uint8_t *p, size_t size, bool big_endian)
{
    uint64_t bits = 0;
    for (size_t i = 0; i < size; i++)
        bits |= (uint64_t)p[big_endian ? size - 1 - i : i] << (8 * i);
    return bits;
}

#define CONVERT(TYPE, BITS)                                                                                                                                    \
    for (size_t i = 0; i < count; i++) {                                                                                                                       \
        BITS bits = (BITS)load_bits(sample + i * sizeof(TYPE), sizeof(TYPE), big);                                                                             \
        TYPE x;                                                                                                                                                \
        memcpy(&x, &bits, sizeof x);                                                                                                                           \
        value[i] = (float)(scaled ? header->slope * (double)x + header->intercept : (double)x);                                                                \
    }                                                                                                                                                          \
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
    faults_add_at_byte(faults, data->path, start + first * sample_size,
                       "%zu voxels are not finite numbers (NaN or too large), the first at (%zu, %zu, %zu); "
                       "finite values: set the unknown ones to the background's",
                       bad, first % nx, first / nx % ny, first / (nx * ny));
    return false;
}

Volume *volume_of_header(const VolumeHeader *header, const char *path, Faults *faults)
{
    Volume *volume = volume_create(header->size, header->origin, header->axis);
    if (!volume) {
        faults_add(faults, path, 0, 0, "%d x %d x %d voxels need more memory than is available", header->size[0], header->size[1], header->size[2]);
        return NULL;
    }
    memcpy(volume->frame, header->frame, sizeof volume->frame);
    snprintf(volume->format, sizeof volume->format, "%s", header->format);
    return volume;
}

static Volume *decode_text(const VolumeHeader *header, const FileBytes *data, size_t count, Faults *faults)
{
    if (count / 2 > data->length) {
        faults_add_at_byte(faults, data->path, data->offset, "%zu bytes of text cannot hold %zu numbers; expected all numbers, or the true sizes", data->length,
                           count);
        return NULL;
    }
    Volume *volume = volume_of_header(header, data->path, faults);
    const char *text = (const char *)data->byte;
    size_t left = data->length;
    for (size_t i = 0; volume && i < count; i++) {
        double x;
        if (!take_number(&text, &left, &x)) {
            faults_add_at_byte(faults, data->path, data->offset + data->length - left,
                               "value %zu of %zu is missing or not a number; expected numbers separated by blanks", i + 1, count);
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

// The readers share no state but their arguments; only the caller's view of the progress would have to pass through all of them.
static _Thread_local const Progress *watching;

void volume_watch(const Progress *progress) { watching = progress; }

bool volume_goes_on(double part, const char *path, Faults *faults)
{
    if (watching && watching->call)
        watching->call(watching->context, (long)(1000 * part), 1000);
    if (!progress_is_stopped(watching))
        return true;
    faults_add(faults, path, 0, 0, "stopped");
    return false;
}

// Skips, then converts piecewise, so a stream needs no memory except the voxels. One byte more than the header implies shows that header and data do not
// belong together.
static bool inflate_values(const VolumeHeader *header, const FileBytes *data, size_t skip, size_t count, Volume *volume, Faults *faults)
{
    Inflater inflater;
    size_t sample = voxel_type_size(header->type), wanted = skip + count * sample, made = 0, got = 0;
    uint8_t *piece = malloc(PIECE), excess;
    if (!piece || !inflater_open(&inflater, data)) {
        faults_add(faults, data->path, 0, 0, "needs more memory than is available");
        free(piece);
        return false;
    }
    bool goes_on = true;
    while (made < wanted && (goes_on = volume_goes_on((double)made / (double)wanted, data->path, faults))) {
        size_t left = made < skip ? skip - made : wanted - made, next = left < PIECE ? left : PIECE;
        got = inflater_read(&inflater, piece, next);
        if (got < next)
            break;
        if (made >= skip)
            convert(header, piece, next / sample, volume->value + (made - skip) / sample);
        made += got;
        got = 0;
    }
    bool good = made == wanted;
    if (!good && goes_on) {
        report_short(&inflater, made + got, wanted, faults);
    } else if (good && inflater_read(&inflater, &excess, 1) > 0) {
        faults_add_at_byte(faults, data->path, data->offset,
                           "the compressed data holds more than the %zu bytes that the header promises; expected a header and data "
                           "that belong together",
                           wanted);
        good = false;
    }
    inflateEnd(&inflater.stream);
    free(piece);
    return good;
}

static Volume *finished(Volume *volume, bool good, const FileBytes *data, size_t start, size_t sample, Faults *faults)
{
    if (volume && (!good || !volume_finish_values(volume, data, start, sample, faults))) {
        volume_free(volume);
        return NULL;
    }
    return volume;
}

static Volume *decode_deflate(const VolumeHeader *header, const FileBytes *data, size_t count, Faults *faults)
{
    size_t skip = (size_t)header->byte_skip, bytes = count * voxel_type_size(header->type);
    if (skip > SIZE_MAX - bytes) {
        faults_add(faults, data->path, 0, 0, "the byte skip %zu is not valid; expected a skip within the file", skip);
        return NULL;
    }
    if (!can_hold(data, skip + bytes, faults))
        return NULL;
    Volume *volume = volume_of_header(header, data->path, faults);
    // bytes inside a compressed stream have no file offset: report its start
    return finished(volume, volume && inflate_values(header, data, skip, count, volume, faults), data, data->offset, 0, faults);
}

static bool skip_lines(FileBytes *data, long lines, Faults *faults)
{
    LineCursor cursor = {data->byte, data->length, 0, 0};
    for (long i = 0; i < lines; i++) {
        const char *text;
        size_t length;
        if (!line_cursor_next(&cursor, &text, &length)) {
            faults_add(faults, data->path, 0, 0, "has %ld lines, fewer than the header's line skip of %ld; expected a skip within the file", i, lines);
            return false;
        }
    }
    *data = (FileBytes){
        .byte = data->byte + cursor.position, .length = data->length - cursor.position, .offset = data->offset + cursor.position, .path = data->path};
    return true;
}

Volume *volume_decode(const VolumeHeader *header, const FileBytes *file, Faults *faults)
{
    FileBytes data = *file;
    size_t count = (size_t)header->size[0] * (size_t)header->size[1] * (size_t)header->size[2], sample = voxel_type_size(header->type);
    size_t bytes = count * sample;
    if (file->needed) {
        *file->needed = file->offset + data_most(header);
        return NULL;
    }
    if (!is_not_too_long(header, file, faults) || !skip_lines(&data, header->line_skip, faults))
        return NULL;
    if (header->encoding == ENCODING_DEFLATE)
        return decode_deflate(header, &data, count, faults);
    size_t skip = header->byte_skip > 0 ? (size_t)header->byte_skip : 0;
    if (header->byte_skip < 0)
        skip = data.length > bytes ? data.length - bytes : 0;
    if (skip > data.length) {
        faults_add_at_byte(faults, data.path, data.offset, "the byte skip %zu goes past the end; expected at most %zu", skip, data.length);
        return NULL;
    }
    data = (FileBytes){.byte = data.byte + skip, .length = data.length - skip, .offset = data.offset + skip, .path = data.path};
    if (header->encoding == ENCODING_TEXT)
        return decode_text(header, &data, count, faults);
    if (data.length < bytes) {
        faults_add_at_byte(faults, data.path, data.offset + data.length,
                           "the data ends after %zu of %zu bytes (%d x %d x %d voxels of %zu); expected the "
                           "whole file, "
                           "or a header with the true sizes",
                           data.length, bytes, header->size[0], header->size[1], header->size[2], sample);
        return NULL;
    }
    Volume *volume = volume_of_header(header, data.path, faults);
    if (volume)
        convert(header, data.byte, count, volume->value);
    return finished(volume, true, &data, data.offset, sample, faults);
}

// --- samples in several files ---

static bool is_list(const char *text, size_t length)
{
    while (length > 0 && isspace((unsigned char)*text))
        text++, length--;
    return length >= 4 && !memcmp(text, "LIST", 4) && (length == 4 || isspace((unsigned char)text[4]));
}

bool data_names_several(const char *text, size_t length) { return is_list(text, length) || (length > 0 && memchr(text, '%', length)); }

typedef struct NumberedName {   // text before the number, the number, text after it
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

// Writes the name of file `index` (from 0). Returns false after the last. Blank lines of a list are skipped.
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
        faults_add(faults, header_path, line, 0, "not a file name pattern; expected `NAME%%03d.raw FIRST LAST STEP`, or LIST followed by one name per line");
        return NULL;
    }
    const NumberedName *how = by_list ? NULL : &numbered;
    if (header->encoding != ENCODING_RAW || header->line_skip > 0) {
        faults_add(faults, header_path, line, 0, "several data files are supported only for raw data without a line skip; expected raw data, or one data file");
        return NULL;
    }
    size_t bytes = (size_t)header->size[0] * (size_t)header->size[1] * (size_t)header->size[2] * voxel_type_size(header->type), files = 0, done = 0;
    LineCursor counting = names;
    int at = line;
    while (files <= (size_t)header->size[2] && next_name(how, &counting, (long)files, name, &at))
        files++;
    if (files == 0 || files > (size_t)header->size[2] || (size_t)header->size[2] % files != 0) {
        faults_add(faults, header_path, line, 0, "%zu%s data files for %d slices; expected as many, or a divisor of that number", files,
                   files > (size_t)header->size[2] ? " or more" : "", header->size[2]);
        return NULL;
    }
    size_t share = bytes / files;
    uint8_t *joined = NULL;
    bool good = true;
    at = line;
    for (size_t i = 0; good && i < files; i++) {
        FileBytes data;
        next_name(how, &names, (long)i, name, &at);
        good = file_bytes_read_beside(header_path, at, name, strlen(name), header, &data, path, faults);
        if (!good)
            break;
        size_t skip = header->byte_skip >= 0 ? (size_t)header->byte_skip : data.length > share ? data.length - share : 0;
        good = skip <= data.length && data.length - skip >= share;
        if (!good)
            faults_add_at_byte(faults, path, data.length, "the data ends after %zu of %zu bytes", data.length, skip + share);
        else if (!joined && !(joined = malloc(bytes)))   // allocate after the first file, which shows that the sizes are plausible
            faults_add(faults, header_path, line, 0, "needs %zu bytes of memory, more than is available", bytes);
        good = good && joined;
        if (good)
            memcpy(joined + done, data.byte + skip, share);
        done += share;
        file_bytes_free(&data);
    }
    VolumeHeader plain = *header;
    plain.byte_skip = 0;
    FileBytes all = {.byte = joined, .length = bytes, .path = header_path};
    Volume *volume = good ? volume_decode(&plain, &all, faults) : NULL;
    free(joined);
    return volume;
}

void data_names_each(const char *text, size_t length, LineCursor names, void (*call)(void *context, const char *name, size_t length), void *context)
{
    NumberedName numbered;
    char name[1200];
    int line;
    bool by_list = is_list(text, length);
    if (by_list || read_numbered(text, length, &numbered))
        for (long i = 0; i < MOST_FILES_NAMED && next_name(by_list ? NULL : &numbered, &names, i, name, &line); i++)
            call(context, name, strlen(name));
}

// Implements vtp_file.h. Appended data may be raw bytes, which are not XML: expat gets only the text up to its `_`. Array bodies:
//   plain       [bytes] data                              one base64 string
//   compressed  [blocks, block size, last size, sizes …]  one base64 string, then the blocks as another
// with header words of header_type (UInt32 by default).
#include "recon/surface/vtp_file.h"

#include <expat.h>
#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { SECTION_NONE, SECTION_POINT_DATA, SECTION_POINTS, SECTION_LINES, SECTION_POLYS, SECTION_STRIPS };
enum { ROLE_NONE, ROLE_POINTS, ROLE_RADIUS, ROLE_CONNECTIVITY, ROLE_OFFSETS };
enum { FORMAT_ASCII, FORMAT_BASE64, FORMAT_APPENDED };
enum { VALUES_MOST = 1 << 26 };    // most values of all arrays of a file

typedef struct Number {      // type of an array's entries
    int size;
    bool is_float, is_signed;
} Number;

typedef struct Array {       // a requested array
    int section, role, piece, format;
    Number number;
    long line;
    size_t offset;           // offset of appended arrays
    char *text;              // text of the other arrays
    size_t length, capacity;
    double *value;           // decoded values
    size_t count;
    size_t promised;         // most values according to the header
} Array;

typedef struct Reader {
    XML_Parser parser;
    const char *name;
    Faults *faults;
    int section, depth, piece;
    Array *array;
    int array_count, array_capacity, open_array, array_depth;
    bool is_big_endian, is_polydata, is_compressed, appended_base64, has_appended, stopped;
    int header_size;
    size_t promised[SECTION_STRIPS + 1];     // points or cells of each section of the piece, according to its header
    size_t values_left;      // number of values still allowed of VALUES_MOST
} Reader;

static void stop(Reader *reader)
{
    reader->stopped = true;
    XML_StopParser(reader->parser, XML_FALSE);
}

static int line_of(Reader *reader) { return (int)XML_GetCurrentLineNumber(reader->parser); }

static const char *attribute(const char **list, const char *key)
{
    for (int i = 0; list[i]; i += 2)
        if (!strcmp(list[i], key))
            return list[i + 1];
    return "";
}

static bool number_type(const char *text, Number *out)
{
    static const struct {
        const char *name;
        Number number;
    } types[] = {{"Float64", {8, true, true}}, {"Float32", {4, true, true}},  {"Int64", {8, false, true}}, {"UInt64", {8, false, false}},
                 {"Int32", {4, false, true}},  {"UInt32", {4, false, false}}, {"Int16", {2, false, true}}, {"UInt16", {2, false, false}},
                 {"Int8", {1, false, true}},   {"UInt8", {1, false, false}}};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (!strcmp(types[i].name, text)) {
            *out = types[i].number;
            return true;
        }
    return false;
}

static void start_file(Reader *reader, const char **list)
{
    const char *type = attribute(list, "type"), *compressor = attribute(list, "compressor"), *header = attribute(list, "header_type");
    reader->is_polydata = !strcmp(type, "PolyData");
    reader->is_big_endian = !strcmp(attribute(list, "byte_order"), "BigEndian");
    reader->is_compressed = *compressor != '\0';
    reader->header_size = !strcmp(header, "UInt64") ? 8 : 4;
    if (!reader->is_polydata)
        faults_add(reader->faults, reader->name, line_of(reader), 0, "VTKFile type is '%s'; expected PolyData", type);
    if (reader->is_compressed && strcmp(compressor, "vtkZLibDataCompressor"))
        faults_add(reader->faults, reader->name, line_of(reader), 0, "is compressed by %s; expected vtkZLibDataCompressor or no compression", compressor);
    if (!reader->is_polydata || (reader->is_compressed && strcmp(compressor, "vtkZLibDataCompressor")))
        stop(reader);
}

static void start_piece(Reader *reader, const char **list)
{
    static const char *const keys[] = {NULL, "NumberOfPoints", "NumberOfPoints", "NumberOfLines", "NumberOfPolys", "NumberOfStrips"};
    reader->piece++;
    for (int i = 1; i <= SECTION_STRIPS; i++) {
        unsigned long long count = strtoull(attribute(list, keys[i]), NULL, 10);
        reader->promised[i] = count < VALUES_MOST ? (size_t)count : VALUES_MOST;
    }
}

// Most values that an array may hold. The number of cell indices is not declared.
static size_t promised_values(const Reader *reader, int role)
{
    size_t count = reader->promised[reader->section], most = role == ROLE_CONNECTIVITY ? VALUES_MOST : role == ROLE_POINTS ? 3 * count : count;
    return most < VALUES_MOST ? most : VALUES_MOST;
}

static void start_array(Reader *reader, const char **list)
{
    const char *name = attribute(list, "Name"), *format = attribute(list, "format");
    int role = ROLE_NONE;
    if (reader->section == SECTION_POINTS)
        role = ROLE_POINTS;
    else if (reader->section == SECTION_POINT_DATA && (!strcmp(name, "MaximumInscribedSphereRadius") || !strcmp(name, "Radius") || !strcmp(name, "radius")))
        role = ROLE_RADIUS;
    else if (reader->section >= SECTION_LINES)
        role = !strcmp(name, "connectivity") ? ROLE_CONNECTIVITY : !strcmp(name, "offsets") ? ROLE_OFFSETS : ROLE_NONE;
    if (role == ROLE_NONE)
        return;
    Array array = {.section = reader->section, .role = role, .piece = reader->piece, .line = line_of(reader)};
    array.format = !strcmp(format, "binary") ? FORMAT_BASE64 : !strcmp(format, "appended") ? FORMAT_APPENDED : FORMAT_ASCII;
    if (!number_type(attribute(list, "type"), &array.number)) {
        faults_add(reader->faults, reader->name, line_of(reader), 0, "array '%s' has type '%s'; expected Float32, Float64, Int8 … UInt64", name,
                   attribute(list, "type"));
        stop(reader);
        return;
    }
    array.offset = (size_t)strtoull(attribute(list, "offset"), NULL, 10);
    array.promised = promised_values(reader, role);
    if (reader->array_count == reader->array_capacity) {
        int capacity = 2 * reader->array_capacity + 8;
        Array *grown = realloc(reader->array, (size_t)capacity * sizeof *grown);
        if (!grown) {
            faults_add(reader->faults, reader->name, 0, 0, "not enough memory");
            stop(reader);
            return;
        }
        reader->array = grown;
        reader->array_capacity = capacity;
    }
    reader->open_array = reader->array_count;
    reader->array_depth = reader->depth;
    reader->array[reader->array_count++] = array;
}

static void start_element(void *context, const char *element, const char **list)
{
    Reader *reader = context;
    static const char *const sections[] = {"", "PointData", "Points", "Lines", "Polys", "Strips"};
    if (reader->stopped)
        return;
    if (reader->depth++ == 0 && strcmp(element, "VTKFile")) {
        faults_add(reader->faults, reader->name, line_of(reader), 0, "the outermost element is '%s'; expected VTKFile", element);
        stop(reader);
        return;
    }
    if (!strcmp(element, "VTKFile"))
        start_file(reader, list);
    else if (!strcmp(element, "Piece"))
        start_piece(reader, list);
    else if (!strcmp(element, "DataArray"))
        start_array(reader, list);
    else if (!strcmp(element, "AppendedData")) {
        reader->has_appended = true;
        reader->appended_base64 = !strcmp(attribute(list, "encoding"), "base64");
    }
    for (int i = 1; i <= SECTION_STRIPS; i++)
        if (!strcmp(element, sections[i]))
            reader->section = i;
}

static void end_element(void *context, const char *element)
{
    Reader *reader = context;
    reader->depth--;
    if (!strcmp(element, "DataArray"))
        reader->open_array = -1;
    else if (!strcmp(element, "Points") || !strcmp(element, "PointData") || !strcmp(element, "Lines") || !strcmp(element, "Polys") ||
             !strcmp(element, "Strips"))
        reader->section = SECTION_NONE;
}

static void take_text(void *context, const char *text, int length)
{
    Reader *reader = context;
    // VTK writes an InformationKey with its own values (ranges) after the array's values
    if (reader->stopped || reader->open_array < 0 || reader->depth != reader->array_depth)
        return;
    Array *array = &reader->array[reader->open_array];
    if (array->length + (size_t)length + 1 > array->capacity) {
        size_t capacity = 2 * array->capacity + (size_t)length + 256;
        char *grown = realloc(array->text, capacity);
        if (!grown) {
            faults_add(reader->faults, reader->name, 0, 0, "not enough memory");
            stop(reader);
            return;
        }
        array->text = grown;
        array->capacity = capacity;
    }
    memcpy(array->text + array->length, text, (size_t)length);
    array->length += (size_t)length;
    array->text[array->length] = '\0';
}

// --- array bodies ---

// Decodes up to `expected` bytes. White space is skipped; decoding stops at padding or at any other character. *used: number of characters read, including
// padding.
static size_t base64_decode(const char *text, size_t length, size_t expected, unsigned char *out, size_t *used)
{
    static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    uint32_t bits = 0;
    int have = 0, quad = 0;
    size_t done = 0, at = 0;
    for (; at < length && (done < expected || quad); at++) {
        char c = text[at];
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t')
            continue;
        const char *place = c == '=' || c == '\0' ? NULL : strchr(alphabet, c);
        if (!place && c != '=')
            break;
        quad = (quad + 1) % 4;
        if (!place)
            continue;
        bits = bits << 6 | (uint32_t)(place - alphabet);
        have += 6;
        if (have >= 8) {
            have -= 8;
            if (done < expected)
                out[done++] = (unsigned char)(bits >> have);
        }
    }
    *used = at;
    return done;
}

static uint64_t word_at(const unsigned char *bytes, int size, bool big)
{
    uint64_t value = 0;
    for (int i = 0; i < size; i++)
        value = value << 8 | bytes[big ? i : size - 1 - i];
    return value;
}

static double number_at(const unsigned char *bytes, Number number, bool big)
{
    uint64_t word = word_at(bytes, number.size, big);
    if (number.is_float && number.size == 8) {
        double value;
        memcpy(&value, &word, 8);
        return value;
    }
    if (number.is_float) {
        uint32_t half = (uint32_t)word;
        float value;
        memcpy(&value, &half, 4);
        return (double)value;
    }
    int shift = 64 - 8 * number.size;
    return number.is_signed ? (double)((int64_t)(word << shift) >> shift) : (double)word;
}

// A part of the file or of an array's text that is read in order, raw or base64.
typedef struct Body {
    const char *text;
    size_t length;
    bool base64;
} Body;

static bool body_take(Body *body, size_t count, unsigned char *out)
{
    if (count > body->length)
        return false;
    size_t used = count;
    if (body->base64) {
        if (base64_decode(body->text, body->length, count, out, &used) < count)
            return false;
    } else
        memcpy(out, body->text, count);
    body->text += used;
    body->length -= used;
    return true;
}

static const char *const cut_short = "the array data are truncated or damaged";
static const char *const too_many = "the array data hold more values than the piece's header promises, or more than 67 million in all";

static const char *decode_compressed(const Reader *reader, Body body, size_t most, unsigned char **bytes, size_t *length)
{
    unsigned char head[24];
    size_t w = (size_t)reader->header_size;
    // a base64 header is one string of 3 + blocks words: read the first three words, then read all of it again
    Body peek = body;
    if (!body_take(&peek, 3 * w, head))
        return cut_short;
    bool big = reader->is_big_endian;
    uint64_t blocks = word_at(head, (int)w, big), block = word_at(head + w, (int)w, big), last = word_at(head + 2 * w, (int)w, big);
    // zlib compresses at most 1032 to 1; a last size of 0 means a whole block; an array without blocks still gives a block size
    uint64_t grown = 1032 * (uint64_t)body.length + 1024, whole = blocks - (blocks && last);
    if (blocks > body.length / w || last > block || (blocks && (last > grown || (whole && block > (grown - last) / whole))))
        return cut_short;
    size_t header = (3 + (size_t)blocks) * w, total = blocks ? (size_t)(whole * block + last) : 0;
    if (total > most)
        return too_many;
    unsigned char *sizes = malloc(header), *packed = malloc(body.length + 1), *out = malloc(total + 1);
    const char *fault = !sizes || !packed || !out ? "not enough memory" : !body_take(&body, header, sizes) ? cut_short : NULL;
    size_t done = 0, packed_total = 0;
    for (uint64_t b = 0; b < blocks && !fault; b++) {
        uint64_t size = word_at(sizes + (3 + (size_t)b) * w, (int)w, big);
        fault = size > body.length - packed_total ? cut_short : NULL;
        packed_total += fault ? 0 : (size_t)size;
    }
    if (!fault && !body_take(&body, packed_total, packed))
        fault = cut_short;
    size_t from = 0;
    for (uint64_t b = 0; b < blocks && !fault; b++) {
        size_t size = (size_t)word_at(sizes + (3 + (size_t)b) * w, (int)w, big);
        uLongf room = b + 1 == blocks && last ? (uLongf)last : (uLongf)block, expected = room;
        if (uncompress(out + done, &room, packed + from, (uLong)size) != Z_OK || room != expected)
            fault = "the compressed array data are damaged";
        from += size;
        done += expected;
    }
    free(sizes);
    free(packed);
    if (fault)
        free(out);
    else {
        *bytes = out;
        *length = done;
    }
    return fault;
}

static const char *decode_plain(const Reader *reader, Body body, size_t most, unsigned char **bytes, size_t *length)
{
    unsigned char head[8];
    size_t w = (size_t)reader->header_size;
    Body peek = body;
    if (!body_take(&peek, w, head))
        return cut_short;
    uint64_t count = word_at(head, (int)w, reader->is_big_endian);
    if (count > body.length)
        return cut_short;
    if (count > most)
        return too_many;
    unsigned char *all = malloc((size_t)count + w);
    if (!all)
        return "not enough memory";
    if (!body_take(&body, (size_t)count + w, all)) {
        free(all);
        return cut_short;
    }
    memmove(all, all + w, (size_t)count);
    *bytes = all;
    *length = (size_t)count;
    return NULL;
}

static const char *decode_ascii(Array *array)
{
    size_t capacity = array->length / 2 + 1;
    array->value = calloc(capacity, sizeof *array->value);
    if (!array->value)
        return "not enough memory";
    for (char *at = array->text, *end; at; at = end) {
        while (*at && strchr(" \t\r\n", *at))
            at++;
        if (!*at)
            break;
        double value = strtod(at, &end);
        if (end == at || array->count == capacity)
            return "the array text holds something that is not a number";
        array->value[array->count++] = value;
    }
    return NULL;
}

static const char *decode_array(Reader *reader, Array *array, const char *appended, size_t appended_length)
{
    if (array->format == FORMAT_ASCII)
        return decode_ascii(array);
    Body body = {array->text, array->length, true};
    if (array->format == FORMAT_APPENDED) {
        if (!appended || array->offset >= appended_length)
            return "the array data extend beyond the end of the file";
        body = (Body){appended + array->offset, appended_length - array->offset, reader->appended_base64};
    } else if (array->text) {
        while (body.length && strchr(" \t\r\n", *body.text))
            body.text++, body.length--;
    }
    unsigned char *bytes = NULL;
    size_t length = 0;
    size_t most = (array->promised < reader->values_left ? array->promised : reader->values_left) * (size_t)array->number.size;
    const char *fault = reader->is_compressed ? decode_compressed(reader, body, most, &bytes, &length) : decode_plain(reader, body, most, &bytes, &length);
    if (fault)
        return fault;
    array->count = length / (size_t)array->number.size;
    reader->values_left -= array->count;
    array->value = calloc(array->count + 1, sizeof *array->value);
    for (size_t i = 0; array->value && i < array->count; i++)
        array->value[i] = number_at(bytes + i * (size_t)array->number.size, array->number, reader->is_big_endian);
    free(bytes);
    return array->value ? NULL : "not enough memory";
}

// --- joining the pieces ---

static const Array *find(const Reader *reader, int piece, int section, int role)
{
    for (int i = 0; i < reader->array_count; i++)
        if (reader->array[i].piece == piece && reader->array[i].section == section && reader->array[i].role == role)
            return &reader->array[i];
    return NULL;
}

// Appends a piece's cells; `first_point` is the index of the piece's first point.
static const char *take_cells(const Reader *reader, int piece, int section, int first_point, int piece_points, VtpCells *cells)
{
    const Array *index = find(reader, piece, section, ROLE_CONNECTIVITY), *offset = find(reader, piece, section, ROLE_OFFSETS);
    if (!index || !offset || offset->count == 0)
        return NULL;
    int before = cells->count ? cells->offset[cells->count] : 0;
    if (offset->count > INT_MAX / 2 - (size_t)cells->count || index->count > INT_MAX / 2 - (size_t)before)
        return "has too many cells";
    int *grown = realloc(cells->offset, ((size_t)cells->count + offset->count + 1) * sizeof *grown);
    if (!grown)
        return "not enough memory";
    grown[cells->count] = before;
    cells->offset = grown;
    grown = realloc(cells->index, ((size_t)before + index->count + 1) * sizeof *grown);
    if (!grown)
        return "not enough memory";
    cells->index = grown;
    for (size_t i = 0; i < index->count; i++) {
        double v = index->value[i];
        if (!(v >= 0 && v < piece_points) || floor(v) != v)
            return "the connectivity refers to a point that does not exist";
        cells->index[(size_t)before + i] = first_point + (int)v;
    }
    double last = 0;
    for (size_t i = 0; i < offset->count; i++) {
        double v = offset->value[i];
        if (!(v >= last && v <= (double)index->count) || floor(v) != v)
            return "the offsets must rise and end within the connectivity";
        last = v;
        cells->offset[++cells->count] = before + (int)v;
    }
    return NULL;
}

static const char *take_piece(const Reader *reader, int piece, VtpData *data)
{
    const Array *points = find(reader, piece, SECTION_POINTS, ROLE_POINTS), *radius = find(reader, piece, SECTION_POINT_DATA, ROLE_RADIUS);
    if (!points || points->count == 0)
        return NULL;
    size_t count = points->count / 3;
    if (points->count % 3 || count > INT_MAX / 4 - (size_t)data->point_count)
        return "the points must be triples";
    Vec3 *grown = realloc(data->point, ((size_t)data->point_count + count) * sizeof *grown);
    if (!grown)
        return "not enough memory";
    data->point = grown;
    for (size_t i = 0; i < count; i++) {
        Vec3 p = vec3(points->value[3 * i], points->value[3 * i + 1], points->value[3 * i + 2]);
        if (!vec3_is_finite(p) || vec3_norm(p) > 1e9)
            return "a coordinate is not finite or beyond 1e9";
        data->point[(size_t)data->point_count + i] = p;
    }
    if (radius && radius->count == count && (data->radius || data->point_count == 0)) {
        double *all = realloc(data->radius, ((size_t)data->point_count + count) * sizeof *all);
        if (!all)
            return "not enough memory";
        data->radius = all;
        memcpy(all + data->point_count, radius->value, count * sizeof *all);
    } else {
        free(data->radius);
        data->radius = NULL;
    }
    int first = data->point_count;
    data->point_count += (int)count;
    const char *fault = take_cells(reader, piece, SECTION_LINES, first, (int)count, &data->line);
    fault = fault ? fault : take_cells(reader, piece, SECTION_POLYS, first, (int)count, &data->polygon);
    return fault ? fault : take_cells(reader, piece, SECTION_STRIPS, first, (int)count, &data->strip);
}

static void build(Reader *reader, const char *appended, size_t appended_length, VtpData *data)
{
    for (int i = 0; i < reader->array_count; i++) {
        const char *fault = decode_array(reader, &reader->array[i], appended, appended_length);
        if (fault) {
            faults_add(reader->faults, reader->name, (int)reader->array[i].line, 0, "%s", fault);
            return;
        }
    }
    for (int piece = 1; piece <= reader->piece; piece++) {
        const char *fault = take_piece(reader, piece, data);
        if (fault) {
            faults_add(reader->faults, reader->name, 0, 0, "%s (piece %d)", fault, piece);
            return;
        }
    }
    if (data->point_count == 0)
        faults_add(reader->faults, reader->name, 0, 0, "holds no points; expected a PolyData with Points");
}

// Offset of the byte after the `_` of appended data; `length` if there is none.
static size_t appended_start(const char *bytes, size_t length)
{
    static const char tag[] = "<AppendedData";
    for (size_t i = 0; i + sizeof tag < length; i++)
        if (bytes[i] == '<' && !memcmp(bytes + i, tag, sizeof tag - 1)) {
            for (; i < length && bytes[i] != '>'; i++)
                ;
            for (; i < length; i++)
                if (bytes[i] == '_')
                    return i + 1;
        }
    return length;
}

VtpData *vtp_parse(const void *bytes, size_t length, const char *name, Faults *faults)
{
    int before = faults->count;
    VtpData *data = calloc(1, sizeof *data);
    Reader reader = {.name = name, .faults = faults, .open_array = -1, .values_left = VALUES_MOST, .parser = XML_ParserCreate(NULL)};
    if (!data || !reader.parser || length > INT_MAX) {
        faults_add(faults, name, 0, 0, length > INT_MAX ? "is larger than 2 GB" : "not enough memory");
        if (reader.parser)
            XML_ParserFree(reader.parser);
        vtp_free(data);
        return NULL;
    }
    size_t start = appended_start(bytes, length);
    bool whole = start == length;
    XML_SetUserData(reader.parser, &reader);
    XML_SetElementHandler(reader.parser, start_element, end_element);
    XML_SetCharacterDataHandler(reader.parser, take_text);
    if (XML_Parse(reader.parser, bytes, (int)start, whole) != XML_STATUS_OK && !reader.stopped)
        faults_add(faults, name, line_of(&reader), (int)XML_GetCurrentColumnNumber(reader.parser) + 1, "is not complete XML: %s",
                   XML_ErrorString(XML_GetErrorCode(reader.parser)));
    XML_ParserFree(reader.parser);
    if (faults->count == before)
        build(&reader, whole ? NULL : (const char *)bytes + start, length - start, data);
    for (int i = 0; i < reader.array_count; i++) {
        free(reader.array[i].text);
        free(reader.array[i].value);
    }
    free(reader.array);
    if (faults->count == before)
        return data;
    vtp_free(data);
    return NULL;
}

void vtp_free(VtpData *data)
{
    if (!data)
        return;
    VtpCells *cells[3] = {&data->line, &data->polygon, &data->strip};
    for (int i = 0; i < 3; i++) {
        free(cells[i]->offset);
        free(cells[i]->index);
    }
    free(data->point);
    free(data->radius);
    free(data);
}

// Volume readers and the writer: every sample type in both byte orders, every grid geometry, every kind of skip and of detached data; truncated files and
// wrong headers. The expected values come from the file that the test builds itself, byte by byte.
#include "recon/volume/volume_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>
#include <zlib.h>

typedef struct Bytes {
    uint8_t byte[1 << 16];
    size_t length;
} Bytes;

static Faults faults;
static char folder[64];

static void put(Bytes *b, const void *data, size_t length)
{
    memcpy(b->byte + b->length, data, length);
    b->length += length;
}

static void put_text(Bytes *b, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    b->length += (size_t)vsnprintf((char *)b->byte + b->length, sizeof b->byte - b->length, format, arguments);
    va_end(arguments);
}

static void put_sample(Bytes *b, uint64_t bits, size_t size, bool big)
{
    for (size_t i = 0; i < size; i++)
        b->byte[b->length++] = (uint8_t)(bits >> (8 * (big ? size - 1 - i : i)));
}

static Volume *parse(const Bytes *b)
{
    faults_clear(&faults);
    return volume_parse(b->byte, b->length, "test", &faults);
}

static bool has_fault(const char *words)
{
    for (int i = 0; i < faults.count && i < FAULTS_CAPACITY; i++)
        if (strstr(faults.text[i], words))
            return true;
    return false;
}

// Checks that no volume is read and that a fault contains these words.
static void refused(const Bytes *b, const char *words)
{
    Volume *volume = parse(b);
    if (volume || !has_fault(words))
        print_message("wanted '%s', got '%s'\n", words, faults.count ? faults.text[0] : volume ? "a volume" : "nothing");
    assert_null(volume);
    assert_true(has_fault(words));
}

static void write_file(const char *name, const Bytes *b)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(b->byte, 1, b->length, file), b->length);
    fclose(file);
}

static Volume *load(const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    faults_clear(&faults);
    return volume_load(path, &faults);
}

static void compress_to(Bytes *b, const Bytes *data, int window)
{
    z_stream stream = {.next_in = (Bytef *)(uintptr_t)data->byte,
                       .avail_in = (uInt)data->length,
                       .next_out = b->byte + b->length,
                       .avail_out = (uInt)(sizeof b->byte - b->length)};
    assert_int_equal(deflateInit2(&stream, 9, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY), Z_OK);
    assert_int_equal(deflate(&stream, Z_FINISH), Z_STREAM_END);
    b->length += stream.total_out;
    deflateEnd(&stream);
}

static void header(Bytes *b, const char *type, const char *more)
{
    b->length = 0;
    put_text(b, "NRRD0004\ntype: %s\ndimension: 3\nsizes: 2 3 4\n%s", type, more);
}

// 24 samples of two bytes, 0, 1, 2 …
static void shorts(Bytes *b, bool big)
{
    for (unsigned i = 0; i < 24; i++)
        put_sample(b, i, 2, big);
}

static void assert_counting(const Volume *v)
{
    assert_non_null(v);
    for (int i = 0; i < 24; i++)
        assert_true(v->value[i] == (float)i);
    assert_true(v->size[0] == 2 && v->size[1] == 3 && v->size[2] == 4 && v->minimum == 0 && v->maximum == 23);
}

static void assert_near(Vec3 a, Vec3 b) { assert_true(vec3_distance(a, b) < 1e-6); }

static void every_type_in_both_orders(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        size_t size;
        double low, high;    // values within the type's range, alternating
        int kind;            // 0: integer, 1: float, 2: double
    } types[] = {{"signed char", 1, -128, 127, 0},         {"uchar", 1, 0, 255, 0},
                 {"int16", 2, -32768, 32767, 0},           {"unsigned short", 2, 0, 65535, 0},
                 {"int", 4, -2147483648.0, 16777216, 0},   {"uint32_t", 4, 0, 4294967040.0, 0},
                 {"long long", 8, -4398046511104.0, 7, 0}, {"uint64", 8, 0, 9223372036854775808.0, 0},
                 {"float", 4, -1.5e30, 0.375, 1},          {"double", 8, -2.25, 1e30, 2}};
    static Bytes b;
    for (size_t t = 0; t < sizeof types / sizeof types[0]; t++)
        for (int big = 0; big < 2; big++) {
            header(&b, types[t].name, big ? "endian: big\nencoding: raw\n\n" : "encoding: raw\nendian: little\n\n");
            for (int i = 0; i < 24; i++) {
                double x = i % 2 ? types[t].high : types[t].low;
                float f = (float)x;
                uint64_t bits = types[t].kind != 0 ? 0 : x < 0 ? (uint64_t)(int64_t)x : (uint64_t)x;
                if (types[t].kind == 2)
                    memcpy(&bits, &x, 8);
                if (types[t].kind == 1) {
                    uint32_t narrow;
                    memcpy(&narrow, &f, 4);
                    bits = narrow;
                }
                put_sample(&b, bits, types[t].size, big);
            }
            Volume *v = parse(&b);
            assert_non_null(v);
            for (int i = 0; i < 24; i++)
                assert_true(v->value[i] == (float)(i % 2 ? types[t].high : types[t].low));
            volume_free(v);
        }
}

static void nrrd_grids(void **state)
{
    (void)state;
    static Bytes b;
    header(&b, "short", "space: RAS\nspace directions: (0,0.4,0) (-0.5,0,0) (0,0.1,0.6)\nspace origin: (1,-2,3.5)\nendian: little\nencoding: raw\n\n");
    shorts(&b, false);
    Volume *v = parse(&b);
    assert_counting(v);
    assert_string_equal(v->frame, "RAS");
    assert_near(volume_point_of(v, vec3(0, 0, 0)), vec3(1, -2, 3.5));
    assert_near(volume_point_of(v, vec3(1, 2, 3)), vec3(1 - 1, -2 + 0.4 + 0.3, 3.5 + 1.8));
    assert_near(volume_voxel_of(v, volume_point_of(v, vec3(0.3, 1.7, 2.2))), vec3(0.3, 1.7, 2.2));
    volume_free(v);
    header(&b, "short", "spacings: 0.4 0.5 0.6\naxis mins: 1 2 3\nendian: big\nencoding: raw\n\n");
    shorts(&b, true);
    v = parse(&b);
    assert_counting(v);
    assert_string_equal(v->frame, "");
    assert_near(volume_point_of(v, vec3(1, 1, 1)), vec3(1.4, 2.5, 3.6));
    volume_free(v);
    // metres become millimetres
    header(&b, "short",
           "space: left-posterior-superior\nspace units: \"m\" \"m\" \"m\"\nspace directions: (4e-4,0,0) (0,5e-4,0) (0,0,6e-4)\nspace origin: (0,0,1e-3)\n"
           "endian: little\nencoding: raw\n\n");
    shorts(&b, false);
    v = parse(&b);
    assert_counting(v);
    assert_string_equal(v->frame, "LPS");
    assert_near(volume_point_of(v, vec3(1, 1, 1)), vec3(0.4, 0.5, 1.6));
    volume_free(v);
    // a non-spatial axis of one sample; lines end with CR LF
    b.length = 0;
    put_text(&b,
             "NRRD0005\r\ntype: uint8\r\ndimension: 4\r\nsizes: 1 2 3 4\r\nspace dimension: 3\r\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\r\nkey:=any\r\n"
             "encoding: raw\r\n\r\n");
    for (int i = 0; i < 24; i++)
        put_sample(&b, (uint64_t)i, 1, false);
    v = parse(&b);
    assert_counting(v);
    volume_free(v);
}

static void encodings_and_skips(void **state)
{
    (void)state;
    static Bytes b, data, with;
    data.length = 0;
    shorts(&data, false);
    header(&b, "short", "endian: little\nencoding: gzip\n\n");
    compress_to(&b, &data, 15 + 16);
    Volume *v = parse(&b);
    assert_counting(v);
    volume_free(v);
    // the byte skip applies to the decompressed data
    with.length = 0;
    put(&with, "headerless", 10);
    put(&with, data.byte, data.length);
    header(&b, "short", "endian: little\nencoding: gz\nbyte skip: 10\n\n");
    compress_to(&b, &with, 15 + 16);
    v = parse(&b);
    assert_counting(v);
    volume_free(v);
    header(&b, "short", "endian: little\nencoding: raw\nline skip: 2\nbyte skip: 3\n\n");
    put_text(&b, "a line\nanother\nabc");
    put(&b, data.byte, data.length);
    v = parse(&b);
    assert_counting(v);
    volume_free(v);
    header(&b, "short", "endian: little\nencoding: raw\nbyte skip: -1\n\n");
    put_text(&b, "whatever stands before");
    put(&b, data.byte, data.length);
    v = parse(&b);
    assert_counting(v);
    volume_free(v);
    header(&b, "short", "encoding: text\n\n");
    for (int i = 0; i < 24; i++)
        put_text(&b, i % 5 ? "%d " : "%d.0e0\n", i);
    v = parse(&b);
    assert_counting(v);
    volume_free(v);
}

static void detached(void **state)
{
    (void)state;
    static Bytes b, data, packed;
    data.length = packed.length = 0;
    shorts(&data, false);
    compress_to(&packed, &data, 15 + 16);
    write_file("a.raw", &data);
    write_file("a.raw.gz", &packed);
    header(&b, "short", "endian: little\nencoding: raw\ndata file: a.raw\n");
    write_file("a.nhdr", &b);
    Volume *v = load("a.nhdr");
    assert_counting(v);
    volume_free(v);
    header(&b, "short", "endian: little\nencoding: gzip\ndata file: ./a.raw.gz\n\n");
    write_file("z.nhdr", &b);
    v = load("z.nhdr");
    assert_counting(v);
    volume_free(v);
    header(&b, "short", "endian: little\nencoding: raw\ndata file: b.raw\n");
    write_file("missing.nhdr", &b);
    assert_null(load("missing.nhdr"));
    assert_true(has_fault("'b.raw' does not exist"));
    assert_true(has_fault("missing.nhdr:7"));
    header(&b, "short", "endian: little\nencoding: raw\ndata file: ../a.raw\n");
    write_file("above.nhdr", &b);
    assert_null(load("above.nhdr"));
    assert_true(has_fault("outside the header's folder"));
    b.length = 0;
    put_text(&b, "ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementType = MET_SHORT\nElementSize = 0.4 0.5 0.6\nElementDataFile = a.raw\n");
    write_file("a.mhd", &b);
    v = load("a.mhd");
    assert_counting(v);
    assert_near(volume_point_of(v, vec3(1, 1, 1)), vec3(0.4, 0.5, 0.6));
    volume_free(v);
}

static void metaimage(void **state)
{
    (void)state;
    static Bytes b, data;
    static const char start[] =
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = %s\nCompressedData = %s\n"
        "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 1 2 3\nElementSpacing = 0.4 0.5 0.6\nDimSize = 2 3 4\nElementType = %s\nMyOwn = key\n"
        "ElementDataFile = LOCAL\n";
    b.length = data.length = 0;
    put_text(&b, start, "True", "False", "MET_USHORT");
    shorts(&b, true);
    Volume *v = parse(&b);
    assert_counting(v);
    // voxel i runs along +y, j along -x
    assert_near(volume_point_of(v, vec3(1, 1, 1)), vec3(1 - 0.5, 2 + 0.4, 3.6));
    assert_string_equal(v->frame, "");
    volume_free(v);
    // a name of the axes' sides means that places are in LPS
    static const struct {
        const char *name, *frame;
    } sides[] = {{"RAI", "LPS"}, {"PSR", "LPS"}, {"???", ""}, {"RAR", ""}, {"RAIS", ""}, {"RA", ""}};
    for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
        b.length = 0;
        put_text(&b, "ObjectType = Image\nNDims = 3\nAnatomicalOrientation = %s\nDimSize = 2 3 4\nElementType = MET_USHORT\nElementDataFile = LOCAL\n",
                 sides[i].name);
        shorts(&b, false);
        v = parse(&b);
        assert_non_null(v);
        assert_string_equal(v->frame, sides[i].frame);
        volume_free(v);
    }
    b.length = 0;
    shorts(&data, false);
    put_text(&b, start, "False", "True", "MET_SHORT");
    compress_to(&b, &data, 15);
    v = parse(&b);
    assert_counting(v);
    volume_free(v);
    b.length = 0;
    put_text(&b, start, "False", "False", "MET_FLOAT");
    put(&b, data.byte, data.length);   // half of the bytes that floats need
    refused(&b, "ends after 48 of 96 bytes");
    b.length = 0;
    put_text(&b, start, "False", "False", "MET_OTHER");
    refused(&b, "ElementType is missing or not valid");
}

// Writes a NIfTI-1 header with the relevant fields.
static void nifti_header(Bytes *b, bool big, int code, int bits, int sform, int qform, const char *magic, float offset)
{
    static const float srow[12] = {0, -0.5f, 0, 1, 0.4f, 0, 0, 2, 0, 0, 0.6f, 3}, pixdim[4] = {-1, 0.4f, 0.5f, 0.6f};
    static const float quaternion[6] = {0, 0, 0.70710678f, 1, 2, 3}, scale[3] = {0, 2, -1};
    uint32_t word;
    b->length = 348;
    memset(b->byte, 0, 352);
    Bytes at = {.length = 0};
#define PUT_AT(PLACE, BITS, SIZE) (at.length = 0, put_sample(&at, (BITS), (SIZE), big), memcpy(b->byte + (PLACE), at.byte, (SIZE)))
    PUT_AT(0, 348, 4);
    static const uint64_t dim[8] = {3, 2, 3, 4, 1, 1, 1, 1};
    for (size_t i = 0; i < 8; i++)
        PUT_AT(40 + 2 * i, dim[i], 2);
    PUT_AT(70, (uint64_t)code, 2);
    PUT_AT(72, (uint64_t)bits, 2);
    for (size_t i = 0; i < 4; i++)
        PUT_AT(76 + 4 * i, (memcpy(&word, &pixdim[i], 4), word), 4);
    PUT_AT(108, (memcpy(&word, &offset, 4), word), 4);
    for (size_t i = 1; i < 3; i++)
        PUT_AT(108 + 4 * i, (memcpy(&word, &scale[i], 4), word), 4);
    b->byte[123] = 2;
    PUT_AT(252, (uint64_t)qform, 2);
    PUT_AT(254, (uint64_t)sform, 2);
    for (size_t i = 0; i < 6; i++)
        PUT_AT(256 + 4 * i, (memcpy(&word, &quaternion[i], 4), word), 4);
    for (size_t i = 0; i < 12; i++)
        PUT_AT(280 + 4 * i, (memcpy(&word, &srow[i], 4), word), 4);
    memcpy(b->byte + 344, magic, 4);
}

// Checks that a stored x is read as 2 x - 1.
static void assert_scaled(const Volume *v)
{
    assert_non_null(v);
    for (int i = 0; i < 24; i++)
        assert_true(v->value[i] == (float)(2 * i - 1));
}

static void nifti(void **state)
{
    (void)state;
    static Bytes b, packed, data;
    for (int big = 0; big < 2; big++) {
        nifti_header(&b, big, 4, 16, 1, 0, "n+1", 352);
        b.length = 352;
        shorts(&b, big);
        Volume *v = parse(&b);
        assert_scaled(v);
        assert_string_equal(v->frame, "RAS");
        assert_near(volume_point_of(v, vec3(1, 2, 3)), vec3(1 - 1, 2 + 0.4, 3 + 1.8));
        volume_free(v);
    }
    packed.length = 0;
    compress_to(&packed, &b, 15 + 16);
    Volume *v = parse(&packed);
    assert_scaled(v);
    volume_free(v);
    // qform: a quarter turn about z; qfac -1 reverses the third axis
    nifti_header(&b, false, 512, 16, 0, 1, "n+1", 352);
    b.length = 352;
    shorts(&b, false);
    v = parse(&b);
    assert_scaled(v);
    assert_near(volume_point_of(v, vec3(1, 2, 3)), vec3(1 - 1, 2 + 0.4, 3 - 1.8));
    volume_free(v);
    // a pair, opened by the name of either file
    nifti_header(&b, false, 4, 16, 1, 0, "ni1", 0);
    data.length = 0;
    shorts(&data, false);
    write_file("p.hdr", &b);
    write_file("p.img", &data);
    v = load("p.hdr");
    assert_scaled(v);
    volume_free(v);
    v = load("p.img");
    assert_scaled(v);
    volume_free(v);
    b.byte[344] = 0;   // ANALYZE
    refused(&b, "magic");
    nifti_header(&b, false, 128, 24, 1, 0, "n+1", 352);
    refused(&b, "data type 128 is not supported");
    nifti_header(&b, false, 4, 8, 1, 0, "n+1", 352);
    refused(&b, "8 bits per voxel");
    nifti_header(&b, false, 4, 16, 1, 0, "n+1", 3e9f);
    refused(&b, "offset");
}

static void lies(void **state)
{
    (void)state;
    static Bytes b;
    static const struct {
        const char *more, *words;
    } cases[] = {
        {"endian: little\nencoding: raw\n\n", "ends after 0 of 48 bytes"},
        {"encoding: raw\n\n", "have no byte order"},
        {"endian: middle\nencoding: raw\n\n", "endian"},
        {"endian: little\nencoding: hex\n\n", "the encoding 'hex' is not supported"},
        {"endian: little\nencoding: raw\nsizes: 2 2 2\n\n", "the first is on line 4"},
        {"endian: little\nencoding: raw\nsise: 2\n\n", "unknown field"},
        {"endian: little\nencoding: raw\nspace: mars\n\n", "the space"},
        {"endian: little\nencoding: raw\nspace directions: (1,0,0) (0,1,0) (1,1,0)\n\n", "span no grid"},
        {"endian: little\nencoding: raw\nspace directions: (1,0,0) (0,1,0) (0,0,nan)\n\n", "span no grid"},
        {"endian: little\nencoding: raw\nspace directions: (1,0,0) (0,1,0)\n\n", "direction 3 of 3"},
        {"endian: little\nencoding: raw\nspacings: 1 0 1\n\n", "span no grid"},
        {"endian: little\nencoding: raw\nspace origin: (1,2)\n\n", "space origin"},
        {"endian: little\nencoding: gzip\nbyte skip: -1\n\n", "byte skip -1"},
        {"endian: little\nencoding: raw\nbyte skip: 100\n\n", "goes past the end"},
        {"endian: little\nencoding: raw\nline skip: 5\n\n", "line skip"},
        {"endian: little\nencoding: raw\ndata file: LIST\nnot-there.raw\n", "the data file 'not-there.raw' does not exist"},
        {"endian: little\nencoding: raw\ndata file: LIST\n", "0 data files for 4 slices"},
        {"endian: little\nencoding: gzip\ndata file: LIST\na\nb\n", "several data files are supported only"},
        {"endian: little\nencoding: raw\ndata file: a%03d.raw 1 3\n", "3 data files for 4 slices"},
        {"endian: little\nencoding: raw\ndata file: a%s.raw 1 4 1\n", "not a file name pattern"},
        {"endian: little\nencoding: raw\ndata file: a%d%d.raw 1 4 1\n", "not a file name pattern"},
        {"endian: little\nencoding: raw\ndata file: a%99999999999d.raw 1 4 1\n", "not a file name pattern"},
        {"endian: little\nencoding: raw\ndata file: a%d.raw 1 1e300 1\n", "not a file name pattern"},
        {"endian: little\nencoding: raw\ndata file: a%03d.raw 1 4 1\n", "the data file 'a001.raw' does not exist"},
        {"encoding: text\n\n1 2 3", "cannot hold 24 numbers"},
        {"encoding: text\n\n1 2 3 x 5 6 7 8 9 10 11 12 13", "value 4 of 24"},
        {"endian: little\nencoding: raw\n", "ends within the header"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        header(&b, "short", cases[i].more);
        refused(&b, cases[i].words);
    }
    // sizes that would need far too much memory
    static const char *sizes[] = {"100000 100000 100000", "2147483647 1 1", "0 3 4", "-1 3 4", "2.5 3 4", "1e30 1 1", "99999999999999999999 1 1"};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        b.length = 0;
        put_text(&b, "NRRD0004\ntype: double\ndimension: 3\nsizes: %s\nendian: little\nencoding: gzip\n\nxx", sizes[i]);
        assert_null(parse(&b));
        assert_int_equal(faults.count, 1);
    }
    header(&b, "float", "endian: little\nencoding: raw\n\n");
    for (unsigned i = 0; i < 24; i++)
        put_sample(&b, i == 7 ? 0x7fc00000u : 0, 4, false);
    refused(&b, "1 voxels are not finite numbers (NaN or too large), the first at (1, 0, 1)");
    b.length = 0;
    refused(&b, "not a supported volume format");
    put_text(&b, "NRRD0009\ntype: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\nx");
    refused(&b, "unknown version");
    b.length = 0;
    put_text(&b,
             "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 1 1 1\nspace dimension: 3\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\n\nxyz");
    refused(&b, "3 values per voxel");
    b.length = 0;
    put_text(&b, "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 1 1\nencoding: raw\n\nx");
    refused(&b, "dimension is not valid");
    faults_clear(&faults);
    assert_null(volume_load("/dev/zero", &faults));
    assert_true(has_fault("not a regular file"));
    faults_clear(&faults);
    assert_null(volume_load("/nowhere/volume.nrrd", &faults));
    assert_true(has_fault("cannot be opened"));
}

static void saved_volumes_load_equal(void **state)
{
    (void)state;
    char path[256];
    Vec3 axis[3] = {{0.4, 0.01, 0}, {0, 0.5, 0.1}, {0.02, 0, 1.0 / 3}};
    Volume *v = volume_create((int[3]){5, 4, 3}, vec3(-1, 2e-3, 1.0 / 7), axis);
    assert_non_null(v);
    memcpy(v->frame, "LPS", 4);
    snprintf(path, sizeof path, "%s/saved.nrrd", folder);
    for (int pass = 0; pass < 3; pass++) {
        for (int i = 0; i < 60; i++)
            v->value[i] = pass == 0 ? (float)sin(i) * 1e3f : pass == 1 ? (float)(4 * i) : (float)(500 * i - 15000);
        faults_clear(&faults);
        assert_true(volume_save_nrrd(v, path, pass == 0 ? "float" : pass == 1 ? "uint8" : "int16", &faults));
        Volume *w = volume_load(path, &faults);
        assert_non_null(w);
        assert_memory_equal(w->value, v->value, 60 * sizeof *v->value);
        assert_memory_equal(w->axis, v->axis, sizeof v->axis);
        assert_memory_equal(&w->origin, &v->origin, sizeof v->origin);
        assert_string_equal(w->frame, "LPS");
        volume_free(w);
    }
    // values that do not fit are refused, and the old file stays
    assert_false(volume_save_nrrd(v, path, "uint8", &faults));
    assert_true(has_fault("uint8 cannot hold"));
    faults_clear(&faults);
    Volume *w = volume_load(path, &faults);
    assert_non_null(w);
    volume_free(w);
    assert_false(volume_save_nrrd(v, "/nowhere/saved.nrrd", "float", &faults));
    // a disk that is full after 200 bytes: a fault, the old file is unchanged, no partial file remains
    struct rlimit kept, tight = {200, RLIM_INFINITY};
    getrlimit(RLIMIT_FSIZE, &kept);
    tight.rlim_max = kept.rlim_max;
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &tight);
    faults_clear(&faults);
    bool saved = volume_save_nrrd(v, path, "float", &faults);
    setrlimit(RLIMIT_FSIZE, &kept);
    assert_false(saved);
    assert_int_equal(faults.count, 1);
    w = volume_load(path, &faults);
    assert_non_null(w);
    volume_free(w);
    snprintf(path, sizeof path, "%s/saved.nrrd.part", folder);
    assert_int_not_equal(access(path, F_OK), 0);
    volume_free(v);
}

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/test_volume_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *names[] = {"a.raw", "a.raw.gz", "a.nhdr", "z.nhdr", "missing.nhdr", "above.nhdr", "a.mhd", "p.hdr", "p.img", "saved.nrrd"};
    char path[256];
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        remove(path);
    }
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_in_both_orders),
        cmocka_unit_test(nrrd_grids),
        cmocka_unit_test(encodings_and_skips),
        cmocka_unit_test(detached),
        cmocka_unit_test(metaimage),
        cmocka_unit_test(nifti),
        cmocka_unit_test(lies),
        cmocka_unit_test(saved_volumes_load_equal),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

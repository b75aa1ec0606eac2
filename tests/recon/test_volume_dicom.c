// DICOM series, from files that the test builds byte by byte: encodings, sample layouts, positions, refused files. The expected value is a function of the
// point in space, so order, orientation and spacing are checked at once.
#include "base/process.h"
#include "recon/volume/volume_file.h"
#include "tests/recon/dicom_file.h"
#include "tests/short_run.h"

#include <glob.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <dirent.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NX = 33, NY = 32, NZ = 6 };     // JPEG 2000 as written by gdcmconv does not allow smaller images

typedef struct Setting {
    DicomEncoding encoding;
    bool no_preamble;
    unsigned allocated, stored, high_bit, is_signed;
    const char *photometric, *series, *syntax, *sop;
    double gap;              // [mm] extra distance before slice 3
    double shear;            // [mm] shift along x per slice
    int copies_of;           // number of the slice whose position this one has, or -1
    bool no_position, in_sequence, per_slice_scale;
} Setting;

static const Setting plain = {
    .encoding = EXPLICIT_LITTLE, .allocated = 16, .stored = 12, .high_bit = 11, .photometric = "MONOCHROME2", .series = "1.2.3", .copies_of = -1};
static Faults faults;
static char folder[64];
static const double dx = 0.5, dy = 0.4, dz = 0.75;
static Vec3 u, v, w;         // axes of the oblique frame

static void set_axes(void)
{
    u = vec3_unit(vec3(0.8, 0.5, -0.3));
    v = vec3_unit(vec3_cross(vec3(0.1, -0.4, 0.9), u));
    w = vec3_cross(u, v);
}

static Vec3 place_of(const Setting *s, int i, int j, int k)
{
    Vec3 p = vec3_add_scaled(vec3_add_scaled(vec3(-10, 20, 30), i * dx, u), j * dy, v);
    return vec3_add_scaled(vec3_add_scaled(p, k * dz + (k >= 3 ? s->gap : 0), w), k * s->shear, u);
}

// An integer from 0 to 230 that differs from those of all neighbours.
static int truth(int i, int j, int k) { return 10 + i + 3 * j + 17 * k; }

static void decimals(DicomBytes *d, uint32_t tag, int count, const double *x)
{
    char text[256] = "";
    for (int i = 0; i < count; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s%.10g", i ? "\\" : "", x[i]);
    dicom_text(d, tag, "DS", text);
}

static void put_position(DicomBytes *d, const Setting *s, int k)
{
    Vec3 p = place_of(s, 0, 0, k);
    decimals(d, 0x00200032, 3, (double[]){p.x, p.y, p.z});
}

static void put_orientation(DicomBytes *d) { decimals(d, 0x00200037, 6, (double[]){u.x, u.y, u.z, v.x, v.y, v.z}); }

static void put_layout(DicomBytes *d, const Setting *s, int frames)
{
    char count[16];
    snprintf(count, sizeof count, "%d", frames);
    dicom_short(d, 0x00280002, 1);
    dicom_text(d, 0x00280004, "CS", s->photometric);
    if (frames > 1)
        dicom_text(d, 0x00280008, "IS", count);
    dicom_short(d, 0x00280010, NY);
    dicom_short(d, 0x00280011, NX);
    if (frames == 1)
        decimals(d, 0x00280030, 2, (double[]){dy, dx});
    dicom_short(d, 0x00280100, s->allocated);
    dicom_short(d, 0x00280101, s->stored);
    dicom_short(d, 0x00280102, s->high_bit);
    dicom_short(d, 0x00280103, s->is_signed);
}

// Writes samples with slope * sample + intercept equal to the expected value, and random bits where none are stored.
static void put_samples(DicomBytes *d, const Setting *s, int k, double slope, double intercept)
{
    bool big = d->encoding == EXPLICIT_BIG;
    unsigned range = 1u << s->stored, shift = s->high_bit + 1 - s->stored;
    for (int j = 0; j < NY; j++)
        for (int i = 0; i < NX; i++) {
            int x = (int)lround((truth(i, j, k) - intercept) / slope);
            if (!strcmp(s->photometric, "MONOCHROME1"))
                x = (s->is_signed ? -1 : (int)range - 1) - x;
            unsigned bits = ((unsigned)x & (range - 1)) << shift;
            bits |= ~((range - 1) << shift) & 0xa5a5u;
            dicom_bits(d, bits, (int)s->allocated / 8, big);
        }
    if (big && s->allocated == 8)   // stored in words
        for (size_t i = d->length - NX * NY; i < d->length; i += 2) {
            uint8_t kept = d->byte[i];
            d->byte[i] = d->byte[i + 1];
            d->byte[i + 1] = kept;
        }
}

static void build_slice(DicomBytes *d, const Setting *s, int k)
{
    char sop[64];
    snprintf(sop, sizeof sop, "1.2.9.%d", k);
    dicom_begin(d, s->encoding, !s->no_preamble, s->syntax);
    dicom_text(d, 0x00080018, "UI", s->sop ? s->sop : sop);
    dicom_text(d, 0x00080060, "CS", "CT");
    if (s->in_sequence) {   // an icon with its own pixels and sizes, which do not belong to the image
        dicom_head(d, 0x00081140, "SQ", 0xffffffffu);
        dicom_head(d, 0xfffee000u, "", 0xffffffffu);
        dicom_short(d, 0x00280010, 999);
        dicom_text(d, 0x00200032, "DS", "9\\9\\9");
        dicom_head(d, 0x7fe00010u, "OB", 0xffffffffu);
        dicom_head(d, 0xfffee000u, "", 4);
        dicom_bits(d, 0xfeffdde0u, 4, false);
        dicom_head(d, 0xfffee0ddu, "", 0);
        dicom_head(d, 0xfffee00du, "", 0);
        dicom_head(d, 0xfffee0ddu, "", 0);
    }
    dicom_text(d, 0x00180050, "DS", "9");   // a wrong slice thickness
    dicom_text(d, 0x0020000e, "UI", s->series);
    if (!s->no_position)
        put_position(d, s, s->copies_of >= 0 ? s->copies_of : k);
    put_orientation(d);
    put_layout(d, s, 1);
    double slope = s->per_slice_scale ? 0.5 * (k + 1) : 1, intercept = s->per_slice_scale ? -3 * k : 0;
    if (s->per_slice_scale) {
        slope = k % 2 ? 0.5 : 1;
        decimals(d, 0x00281052, 1, &intercept);
        decimals(d, 0x00281053, 1, &slope);
    }
    dicom_head(d, 0x7fe00010u, "OW", NX * NY * s->allocated / 8);
    put_samples(d, s, k, slope, intercept);
}

static const char *in_folder(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_file(const char *name, const DicomBytes *d, size_t length)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(d->byte, 1, length, file), length);
    fclose(file);
}

static void write_slice(const char *name, const Setting *s, int k)
{
    static DicomBytes d;
    build_slice(&d, s, k);
    write_file(name, &d, d.length);
}

static void empty_folder(void)
{
    DIR *directory = opendir(folder);
    char path[512];
    for (struct dirent *entry; (entry = readdir(directory));) {
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (entry->d_name[0] != '.')
            remove(path);
    }
    closedir(directory);
}

// Writes a series with file names in another order than the positions.
static void write_series(const Setting *s, const char *prefix)
{
    for (int k = 0; k < NZ; k++) {
        char name[32];
        snprintf(name, sizeof name, "%s%d", prefix, (k * 5 + 2) % NZ);
        write_slice(name, s, k);
    }
}

static Volume *load(const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s%s%s", folder, name[0] ? "/" : "", name);
    faults_clear(&faults);
    return volume_load(path, &faults);
}

static bool has_fault(const char *words)
{
    for (int i = 0; i < faults.count && i < FAULTS_CAPACITY; i++)
        if (strstr(faults.text[i], words))
            return true;
    print_message("wanted '%s', got '%s'\n", words, faults.count ? faults.text[0] : "nothing");
    return false;
}

static void assert_true_volume(const Volume *volume, const Setting *s)
{
    if (!volume)
        print_message("%s\n", faults.text[0]);
    assert_non_null(volume);
    assert_true(volume->size[0] == NX && volume->size[1] == NY && volume->size[2] == NZ);
    assert_string_equal(volume->frame, "LPS");
    assert_string_equal(volume->format, "dicom");
    for (int k = 0; k < NZ; k++)
        for (int j = 0; j < NY; j++)
            for (int i = 0; i < NX; i++) {
                Vec3 at = volume_voxel_of(volume, place_of(s, i, j, k));
                assert_true(vec3_distance(at, vec3(i, j, k)) < 1e-6);
                assert_true(volume->value[(k * NY + j) * NX + i] == (float)truth(i, j, k));
            }
    assert_true(volume->minimum == (float)truth(0, 0, 0) && volume->maximum == (float)truth(NX - 1, NY - 1, NZ - 1));
}

static void encodings_and_layouts(void **state)
{
    (void)state;
    for (int encoding = 0; encoding < 3; encoding++)
        for (int form = 0; form < 8; form++) {
            Setting s = plain;
            s.encoding = (DicomEncoding)encoding;
            s.no_preamble = form == 1;
            s.in_sequence = form == 2;
            s.per_slice_scale = form == 3;
            if (form == 4)
                s.allocated = s.stored = 8, s.high_bit = 7;
            if (form == 5)
                s.stored = 10, s.high_bit = 13, s.is_signed = 1;
            if (form == 6)
                s.photometric = "MONOCHROME1";
            if (form == 7)
                s.allocated = s.stored = 16, s.high_bit = 15, s.is_signed = 1, s.shear = 0.1;   // a tilted gantry
            empty_folder();
            write_series(&s, "im");
            Volume *whole = load(""), *named = load("im3");
            assert_true_volume(whole, &s);
            assert_true_volume(named, &s);
            volume_free(whole);
            volume_free(named);
        }
}

// Enhanced objects: positions in functional groups, for all frames and for each, in sequences of defined and undefined length.
static void build_multi_frame(DicomBytes *d, const Setting *s, bool open, int places)
{
    size_t length_at, item_at;
    dicom_begin(d, s->encoding, true, NULL);
    dicom_text(d, 0x00080060, "CS", "XA");
    dicom_text(d, 0x0020000e, "UI", "1.2.77");
    put_layout(d, s, NZ);
#define OPEN(TAG) (dicom_head(d, (TAG), "SQ", 0xffffffffu), dicom_head(d, 0xfffee000u, "", 0xffffffffu))
#define CLOSE() (dicom_head(d, 0xfffee00du, "", 0), dicom_head(d, 0xfffee0ddu, "", 0))
    OPEN(0x52009229);
    OPEN(0x00209116);
    put_orientation(d);
    CLOSE();
    OPEN(0x00289110);
    decimals(d, 0x00280030, 2, (double[]){dy, dx});
    CLOSE();
    CLOSE();
    dicom_head(d, 0x52009230, "SQ", open ? 0xffffffffu : 0);
    length_at = d->length;
    for (int k = 0; k < places; k++) {
        dicom_head(d, 0xfffee000u, "", open ? 0xffffffffu : 0);
        item_at = d->length;
        OPEN(0x00209113);
        put_position(d, s, NZ - 1 - k);   // the last slice first
        CLOSE();
        OPEN(0x00289145);
        decimals(d, 0x00281052, 1, (double[]){k});
        decimals(d, 0x00281053, 1, (double[]){1});
        CLOSE();
        if (open) {
            dicom_head(d, 0xfffee00du, "", 0);
        } else {
            size_t end = d->length;
            d->length = item_at - 4;
            dicom_bits(d, (uint32_t)(end - item_at), 4, d->encoding == EXPLICIT_BIG);
            d->length = end;
        }
    }
    if (open) {
        dicom_head(d, 0xfffee0ddu, "", 0);
    } else {
        size_t end = d->length;
        d->length = length_at - 4;
        dicom_bits(d, (uint32_t)(end - length_at), 4, d->encoding == EXPLICIT_BIG);
        d->length = end;
    }
    dicom_head(d, 0x7fe00010u, "OW", NX * NY * NZ * 2);
    for (int k = 0; k < NZ; k++)
        put_samples(d, s, NZ - 1 - k, 1, k);
}

static void multi_frame(void **state)
{
    (void)state;
    static DicomBytes d;
    for (int encoding = 0; encoding < 3; encoding++)
        for (int open = 0; open < 2; open++) {
            Setting s = plain;
            s.encoding = (DicomEncoding)encoding;
            build_multi_frame(&d, &s, open, NZ);
            faults_clear(&faults);
            Volume *volume = volume_parse(d.byte, d.length, "/nowhere/multi.dcm", &faults);
            assert_true_volume(volume, &s);
            volume_free(volume);
            empty_folder();
            write_file("multi.dcm", &d, d.length);
            volume = load("");
            assert_true_volume(volume, &s);
            volume_free(volume);
        }
    build_multi_frame(&d, &plain, true, NZ - 1);
    faults_clear(&faults);
    assert_null(volume_parse(d.byte, d.length, "/nowhere/multi.dcm", &faults));
    assert_true(has_fault("5 positions"));
}

static void what_is_refused(void **state)
{
    (void)state;
    static DicomBytes d;
    Setting s = plain;
    // a gap
    s.gap = 0.75;
    empty_folder();
    write_series(&s, "im");
    assert_null(load(""));
    assert_true(has_fault("frame 1 lies 1.5 mm behind frame 1"));
    // a duplicate of an image counts once; another image at the same position is a fault
    s = plain;
    empty_folder();
    write_series(&s, "im");
    write_slice("again", &s, 2);
    Volume *volume = load("");
    assert_true_volume(volume, &s);
    volume_free(volume);
    s.sop = "1.2.9.88";
    write_slice("again", &s, 2);
    assert_null(load("im1"));
    assert_true(has_fault("has the same position as frame 1 of"));
    // two series: the folder is refused with a list, a file selects its series; other files are ignored
    s = plain;
    empty_folder();
    write_series(&s, "im");
    s.series = "1.2.4";
    write_series(&s, "other");
    assert_null(load(""));
    assert_true(has_fault("several series") && has_fault("im0: a series of 6 files, 33 x 32 pixels, CT") && has_fault("other0: a series of 6 files"));
    volume = load("other4");
    assert_true_volume(volume, &s);
    volume_free(volume);
    // a damaged file of the series is reported, that of another series is not
    build_slice(&d, &s, 3);
    write_file("other1", &d, d.length - 1);
    assert_null(load("other0"));
    assert_true(has_fault("other1:byte") && has_fault("the pixels end after 2111 of 2112 bytes"));
    volume = load("im0");
    assert_true_volume(volume, &plain);
    volume_free(volume);
    // a single slice, a projection, a folder without images
    s = plain;
    empty_folder();
    write_slice("im0", &s, 0);
    assert_null(load("im0"));
    assert_true(has_fault("only one slice"));
    s.no_position = true;
    write_slice("im0", &s, 0);
    assert_null(load("im0"));
    assert_true(has_fault("has no position"));
    empty_folder();
    assert_null(load(""));
    assert_true(has_fault("has no DICOM images"));
    // compressed, deflated, colour, unsupported layouts
    s = plain;
    build_slice(&d, &s, 0);
    d.length -= NX * NY * 2 + 12;
    dicom_head(&d, 0x7fe00010u, "OB", 0xffffffffu);
    dicom_head(&d, 0xfffee000u, "", 0);
    write_file("im0", &d, d.length);
    write_slice("im1", &s, 1);
    assert_null(load("im0"));
    assert_true(has_fault("the compressed pixels") || has_fault("the pixels are compressed"));
    empty_folder();
    s.syntax = "1.2.840.10008.1.2.1.99";
    write_slice("im0", &s, 0);
    assert_null(load("im0"));
    assert_true(has_fault("deflated") && has_fault("gdcmconv --raw"));
    s = plain;
    s.photometric = "PALETTE COLOR";
    write_slice("im0", &s, 0);
    assert_null(load("im0"));
    assert_true(has_fault("PALETTE COLOR"));
    build_slice(&d, &plain, 0);
    for (size_t cut = 0; cut < d.length; cut++) {   // every prefix: a fault, no crash
        faults_clear(&faults);
        assert_null(volume_parse(d.byte, cut, "/nowhere/cut", &faults));
        assert_true(faults.count > 0);
    }
}

// --- compressed pixels ---

static int convert(const char *how, const char *from, const char *to)
{
    char command[600];
    snprintf(command, sizeof command, "gdcmconv %s '%s/%s' '%s/%s' >/dev/null 2>&1", how, folder, from, folder, to);
    return system(command);
}

static bool can_unpack(void)
{
    char program[4096];
    return process_beside("seldinger-dicom", program, sizeof program) && access(program, X_OK) == 0 && system("command -v gdcmconv >/dev/null 2>&1") == 0;
}

static const char *const compressed[] = {"--jpeg", "--jpegls", "--j2k", "--rle"};

// Lossless compression: the same values, of 8 to 16 bits, signed too, as a series and as frames.
static void what_is_compressed_is_the_same(void **state)
{
    (void)state;
    if (!can_unpack()) {
        print_message("skipped: there is no seldinger-dicom (built with libgdcm-dev), or no gdcmconv (libgdcm-tools)\n");
        skip();
    }
    for (int i = 0; i < 4; i++)
        for (int form = 0; form < (i == 0 ? 4 : 1); form++) {
            Setting s = plain;
            if (form == 1)
                s.allocated = s.stored = 8, s.high_bit = 7;
            if (form == 2)
                s.allocated = s.stored = 16, s.high_bit = 15, s.is_signed = 1;
            if (form == 3)
                s.photometric = "MONOCHROME1";
            empty_folder();
            for (int k = 0; k < NZ; k++) {
                char name[32];
                write_slice("plain", &s, k);
                snprintf(name, sizeof name, "im%d", (k * 5 + 2) % NZ);
                assert_int_equal(convert(compressed[i], "plain", name), 0);
            }
            remove(in_folder("plain"));
            Volume *volume = load("im3");
            assert_true_volume(volume, &s);
            volume_free(volume);
        }
}

// Frames of one file, with positions in functional groups.
static void compressed_frames(void **state)
{
    (void)state;
    if (!can_unpack())
        skip();
    static DicomBytes d;
    empty_folder();
    build_multi_frame(&d, &plain, true, NZ);
    write_file("plain", &d, d.length);
    assert_int_equal(convert("--jpegls", "plain", "many"), 0);
    remove(in_folder("plain"));
    Volume *volume = load("many");
    assert_true_volume(volume, &plain);
    volume_free(volume);
}

// A file damaged in any byte gives a fault or a volume, and no crash.
static void what_is_damaged_is_refused(void **state)
{
    (void)state;
    if (!can_unpack())
        skip();
    static uint8_t byte[1 << 16];
    int read = 0, refused = 0;
    glob_t left;
    setenv("TMPDIR", folder, 1);
    for (int i = 0; i < 4; i++) {
        empty_folder();
        write_slice("plain", &plain, 0);
        assert_int_equal(convert(compressed[i], "plain", "im0"), 0);
        write_slice("im1", &plain, 1);
        remove(in_folder("plain"));
        FILE *file = fopen(in_folder("im0"), "rb");
        assert_non_null(file);
        size_t length = fread(byte, 1, sizeof byte, file);
        fclose(file);
        for (int change = 0; change < WHOLE_OR_SHORT(20, 5); change++) {
            size_t at = length - 1 - (size_t)change * 7 % (length / 2);
            byte[at] ^= 0x55;
            file = fopen(in_folder("im0"), "wb");
            assert_int_equal(fwrite(byte, 1, change % 5 == 4 ? at : length, file), change % 5 == 4 ? at : length);
            fclose(file);
            byte[at] ^= 0x55;
            Volume *volume = load("im1");
            assert_true(volume || faults.count > 0);
            read += volume != NULL, refused += !volume;
            volume_free(volume);
        }
        assert_int_equal(glob(in_folder("gdcm*"), 0, NULL, &left), GLOB_NOMATCH);       // no temporary files of GDCM remain
        globfree(&left);
    }
    unsetenv("TMPDIR");
    print_message("%d read, %d refused\n", read, refused);
    assert_true(refused > 0);
}

static int make_folder(void **state)
{
    (void)state;
    set_axes();
    snprintf(folder, sizeof folder, "/tmp/test_dicom_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    empty_folder();
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(encodings_and_layouts), cmocka_unit_test(multi_frame),
                                       cmocka_unit_test(what_is_refused),       cmocka_unit_test(what_is_compressed_is_the_same),
                                       cmocka_unit_test(compressed_frames),     cmocka_unit_test(what_is_damaged_is_refused)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

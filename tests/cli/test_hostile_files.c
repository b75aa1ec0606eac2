// Hostile files that would make a reader wait, or allocate memory that no header states: they are refused soon, with a message.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

static char folder[] = "/tmp/seldinger-hostile-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"
#include "tests/short_run.h"

enum { MB = 1 << 20 };

static int make_socket(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int end = socket(AF_UNIX, SOCK_STREAM, 0);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", in_folder("socket"));
    return end < 0 || bind(end, (struct sockaddr *)&address, sizeof address);
}

static int make_files(void **state)
{
    if (make_folder_with_cache(state) != 0 || mkfifo(in_folder("pipe"), 0600) || mkdir(in_folder("sub"), 0700) || make_socket() ||
        symlink("/dev/zero", in_folder("device")) || mkfifo(in_folder("pair.img"), 0600))
        return -1;
    if (run_in("", "synth arc --points 200 -o tree.h5 --quiet") || run_in("", "fit tree.h5 -o model.h5 --preset local --quiet") ||
        run_in("", "synth capsule -o surface.stl --quiet"))
        return -1;
    put("points.csv", "x_mm,y_mm,z_mm\n0,0,0\n");
    put("trace.yaml", "branches: [{start_mm: [1, 1, 1], toward_mm: [2, 2, 2], radius_mm: 1}]\n");
    put("pipe.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: pipe\n");
    put("device.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: device\n");
    put("socket.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: socket\n");
    put("pipe.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = pipe\n");
    put("list.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LIST\npipe\npipe\n");
    put("tube.yaml", "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}}\n"
                     "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n"
                     "wire: {elements: 10, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n");
    put("pipes.yaml", "seldinger: 1\nvessel: {model: pipe}\nsheath: {inlet: root}\n"
                      "wire: {elements: 10, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n");
    return 0;
}

// Ends by itself with exit code 2 and names the file.
static void refused(const char *arguments, const char *name)
{
    int code = run_in("timeout -k 1 20", arguments);
    if (code == 124 || code == 137)
        fail_msg("`%s` hangs", arguments);
    if (code != 2 || !strstr(output, name))
        fail_msg("`%s` ended with %d and printed: %s(expected 2 and '%s')", arguments, code, output, name);
}

static void what_is_no_file_is_refused(void **state)
{
    (void)state;
    static const char *const what[] = {"pipe", "device", "socket", "sub"};
    static const char *const verbs[] = {"fit %s -o out.h5",
                                        "fit tree.h5 -o out.h5 --junctions j.png --volume %s",
                                        "import --surface %s -o out.h5",
                                        "import --surface surface.stl --centreline %s -o out.h5",
                                        "query %s --points points.csv -o out.csv",
                                        "query model.h5 --points %s -o out.csv",
                                        "segment %s --trace trace.yaml -o out.h5",
                                        "segment %s --start 1,1,1 -o out.h5",
                                        "segment model.h5 --trace %s -o out.h5",
                                        "export %s -o out.vtp",
                                        "info %s",
                                        "run %s --duration-s 0.01",
                                        "run tube.yaml --script %s",
                                        "run tube.yaml --duration-s 0.01 --device %s",
                                        "check %s",
                                        "synth arc --measure %s",
                                        "report %s --html out.html",
                                        "devices --map %s"};
    for (size_t i = 0; i < sizeof verbs / sizeof *verbs; i++)
        for (size_t k = 0; k < sizeof what / sizeof *what; k++) {
            char arguments[200];
            // under the sanitizers a pipe, which could wait for ever, and one of the others for each verb
            if (!WHOLE_RUN && k > 0 && k != 1 + i % 3)
                continue;
            // a folder may contain scenes, sessions or the slices of a series
            if (!strcmp(what[k], "sub") && (strstr(verbs[i], "check") || strstr(verbs[i], "report") || strstr(verbs[i], "--volume")))
                continue;
#ifndef SELDINGER_RENDER
            if (strstr(verbs[i], "--junctions"))
                continue;
#endif
            snprintf(arguments, sizeof arguments, verbs[i], what[k]);
            refused(arguments, what[k]);
        }
}

static void what_a_file_names_is_refused(void **state)
{
    (void)state;
    unsigned char pair[352] = {0};
    int32_t size = 348;
    int16_t dim[8] = {3, 2, 2, 2, 1, 1, 1, 1}, type[2] = {2, 8};
    float pixdim[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    memcpy(pair, &size, 4);
    memcpy(pair + 40, dim, 16);
    memcpy(pair + 70, type, 4);
    memcpy(pair + 76, pixdim, 32);
    memcpy(pair + 344, "ni1", 4);
    put_bytes("pair.hdr", pair, 348);
    static const char *const volumes[] = {"pipe.nhdr", "device.nhdr", "socket.nhdr", "pipe.mhd", "list.mhd", "pair.hdr", "pair.img"};
    for (size_t i = 0; i < sizeof volumes / sizeof *volumes; i++) {
        char arguments[200];
        snprintf(arguments, sizeof arguments, "info %s", volumes[i]);
        refused(arguments, i < 5 ? "not a regular file" : "pair");
        snprintf(arguments, sizeof arguments, "segment %s --trace trace.yaml -o out.h5", volumes[i]);
        refused(arguments, i < 5 ? "not a regular file" : "pair");
    }
    refused("run pipes.yaml --duration-s 0.01", "pipe");
}

// --- memory ---

// `plain`, then a gzip stream: `head` and the given number of MB of zeros.
static void put_zeros(const char *name, const char *plain, const void *head, size_t head_length, int megabytes)
{
    static const char zeros[MB];
    put(name, plain);
    gzFile file = gzopen(in_folder(name), "ab1");
    assert_non_null(file);
    if (head_length)
        assert_int_equal(gzwrite(file, head, (unsigned)head_length), head_length);
    for (int i = 0; i < megabytes; i++)
        assert_int_equal(gzwrite(file, zeros, MB), MB);
    gzclose(file);
}

// Limits the address space to 400 MB, a third of which the libraries use.
static void ends_in_little_memory(const char *arguments, int expected, const char *words)
{
    // the shadow memory of a sanitizer is larger
    int code = run_in(WHOLE_RUN ? "ulimit -v 400000 && timeout -k 1 60" : "timeout -k 1 60", arguments);
    if (code != expected || !strstr(output, words))
        fail_msg("`%s` ended with %d and printed: %s(expected %d and '%s')", arguments, code, output, expected, words);
}

static void a_stream_is_read_as_far_as_its_header_says(void **state)
{
    (void)state;
    static const char head[] = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 128 128 64\nencoding: gzip\n\n";
    enum { MANY = WHOLE_OR_SHORT(512, 32) };     // MB, more than there is memory in the whole run
    unsigned char nifti[352] = {0};
    int32_t size = 348;
    int16_t dim[8] = {3, 128, 128, 64, 1, 1, 1, 1}, type[2] = {2, 8};
    float pixdim[8] = {1, 1, 1, 1, 1, 1, 1, 1}, offset = MANY * MB;
    put_zeros("fits.nrrd", head, NULL, 0, 1);
    put_zeros("bomb.nrrd", head, NULL, 0, MANY);
    memcpy(nifti, &size, 4);
    memcpy(nifti + 40, dim, 16);
    memcpy(nifti + 70, type, 4);
    memcpy(nifti + 76, pixdim, 32);
    memcpy(nifti + 108, &offset, 4);
    memcpy(nifti + 344, "n+1", 4);
    put_zeros("skip.nii.gz", "", nifti, sizeof nifti, MANY);
    ends_in_little_memory("info fits.nrrd", 0, "128");
    ends_in_little_memory("info bomb.nrrd", 2, "holds more than the 1048576 bytes that the header promises");
    // 352 bytes of header are skipped too, so the last voxels are missing
    ends_in_little_memory("info skip.nii.gz", 2, "the data ends after");
}

static void make_long(const char *name, const char *head)
{
    put(name, head);
    assert_int_equal(truncate(in_folder(name), (off_t)8 << 30), 0);
}

static void long_files_are_not_read_whole(void **state)
{
    (void)state;
    static unsigned char dicom[132];
    memcpy(dicom + 128, "DICM", 4);
    make_long("long.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n\n");
    make_long("tail.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\nbyte skip: -1\n\n");
    make_long("long.raw", "");
    put("long.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\ndata file: long.raw\n");
    put("long.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementType = MET_UCHAR\nElementDataFile = long.raw\n");
    make_long("long.yaml", "branches: [{start_mm: [1, 1, 1], toward_mm: [2, 2, 2], radius_mm: 1}]\n");
    make_long("long.csv", "x_mm,y_mm,z_mm\n0,0,0\n");
    make_long("long.swc", "1 1 0 0 0 1 -1\n2 1 1 0 0 1 1\n");
    make_long("long.obj", "v 0 0 0\n");
    put_bytes("long.dcm", dicom, sizeof dicom);
    assert_int_equal(truncate(in_folder("long.dcm"), (off_t)8 << 30), 0);
    ends_in_little_memory("info long.nrrd", 0, "");
    ends_in_little_memory("info long.nhdr", 0, "");
    ends_in_little_memory("info long.mhd", 0, "");
    ends_in_little_memory("info long.dcm", 2, "the limit for a DICOM file");
    ends_in_little_memory("info tail.nrrd", 2, "but its header promises");
    ends_in_little_memory("segment fits.nrrd --trace long.yaml -o out.h5", 2, "expected at most 1048576");
    ends_in_little_memory("query model.h5 --points long.csv -o out.csv", 2, "expected at most 1073741824");
    ends_in_little_memory("import --surface surface.stl --centreline long.swc -o out.h5", 2, "expected at most 268435456");
    ends_in_little_memory("import --surface long.obj -o out.h5", 2, "expected at most 2147483647");
    ends_in_little_memory("run long.yaml", 2, "expected at most 67108864");
}

static const char vtp_head[] =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n"
    "<PolyData><Piece NumberOfPoints=\"%s\" NumberOfPolys=\"1\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"appended\" "
    "offset=\"0\"/></Points><Polys><DataArray type=\"Int8\" Name=\"connectivity\" format=\"appended\" offset=\"0\"/>"
    "<DataArray type=\"Int8\" Name=\"offsets\" format=\"appended\" offset=\"0\"/></Polys></Piece></PolyData>"
    "<AppendedData encoding=\"raw\">_";

// An array of 512 MB of zeros in half a megabyte.
static void put_vtp(const char *name, const char *points)
{
    static unsigned char zeros[MB];
    uLongf packed = 4096;
    unsigned char block[4096];
    enum { BLOCKS = 512 };
    uint64_t word[3 + BLOCKS] = {BLOCKS, MB, 0};
    FILE *file = fopen(in_folder(name), "wb");
    assert_non_null(file);
    assert_int_equal(compress2(block, &packed, zeros, MB, 9), Z_OK);
    for (int i = 0; i < BLOCKS; i++)
        word[3 + i] = packed;
    fprintf(file, vtp_head, points);
    fwrite(word, sizeof word, 1, file);
    for (int i = 0; i < BLOCKS; i++)
        fwrite(block, packed, 1, file);
    fprintf(file, "</AppendedData></VTKFile>\n");
    assert_int_equal(fclose(file), 0);
}

static void packed_arrays_hold_what_their_piece_promises(void **state)
{
    (void)state;
    put_vtp("few.vtp", "3");
    put_vtp("many.vtp", "44739242");    // as many points as stated
    ends_in_little_memory("import --surface few.vtp -o out.h5", 2, "more values than the piece's header promises");
    ends_in_little_memory("import --surface many.vtp -o out.h5", 2, "more than 67 million in all");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_no_file_is_refused),
        cmocka_unit_test(what_a_file_names_is_refused),
        cmocka_unit_test(a_stream_is_read_as_far_as_its_header_says),
        cmocka_unit_test(long_files_are_not_read_whole),
        cmocka_unit_test(packed_arrays_hold_what_their_piece_promises),
    };
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}

// Bad input to all verbs except `run` (see test_run.c): exit code 2, one message with the file, the position and the valid values, and no output file, not even
// a temporary one.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <glob.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-bad-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"

// Outputs of these tests have names that begin with `out`.
static void nothing_is_left(const char *arguments)
{
    char pattern[300];
    glob_t found;
    snprintf(pattern, sizeof pattern, "%s/*out*", folder);
    if (glob(pattern, 0, NULL, &found) == 0)
        fail_msg("`%s` left %s", arguments, found.gl_pathv[0]);
    globfree(&found);
}

static void refused(const char *arguments, const char *words)
{
    int code = run_in("", arguments);
    if (code != 2 || !strstr(output, words))
        fail_msg("`%s` ended with %d and printed: %s(expected 2 and '%s')", arguments, code, output, words);
    nothing_is_left(arguments);
}

static void volumes_cut_off_or_lying(void **state)
{
    (void)state;
    unsigned char nifti[400] = {0};
    int32_t size = 348;
    int16_t dim[8] = {3, 10, 10, 10, 1, 1, 1, 1}, type[2] = {4, 16};
    float pixdim[8] = {1, 1, 1, 1, 1, 1, 1, 1}, offset = 352;
    memcpy(nifti, &size, 4);
    memcpy(nifti + 40, dim, 16);
    memcpy(nifti + 70, type, 4);
    memcpy(nifti + 76, pixdim, 32);
    memcpy(nifti + 108, &offset, 4);
    memcpy(nifti + 344, "n+1", 4);
    put_bytes("short.nii", nifti, sizeof nifti);
    put_bytes("cut.nii", nifti, 200);
    dim[1] = -5;
    memcpy(nifti + 40, dim, 16);
    put_bytes("lie.nii", nifti, sizeof nifti);
    size = 540;
    memcpy(nifti, &size, 4);
    put_bytes("two.nii", nifti, sizeof nifti);
    size = 348;
    memcpy(nifti, &size, 4);
    memset(nifti + 344, 0, 4);
    put_bytes("analyze.hdr", nifti, sizeof nifti);
    put("beside.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = a\033[2Jb.raw\n");
    put("short.mha", "ObjectType = Image\nNDims = 3\nDimSize = 10 10 10\nElementSpacing = 1 1 1\nElementType = MET_SHORT\nElementDataFile = LOCAL\nabc");
    put("lie.mha", "ObjectType = Image\nNDims = 3\nDimSize = 10 10 1000000000\nElementSpacing = 1 1 1\nElementType = MET_SHORT\nElementDataFile = LOCAL\nabc");
    put("short.nrrd", "NRRD0004\ntype: short\ndimension: 3\nsizes: 10 10 10\nendian: little\nencoding: raw\n\nabc");
    put("lie.nrrd", "NRRD0004\ntype: short\ndimension: 3\nsizes: 10 -10 10\nendian: little\nencoding: raw\n\nabc");
    put("head.nrrd", "NRRD0004\ntype: short\ndimension: 3\n");
    put("trace.yaml", "branches: [{start_mm: [1, 1, 1], toward_mm: [2, 2, 2], radius_mm: 1}]\n");
    static const char *const files[][2] = {{"short.nii", "short.nii:byte "},
                                           {"cut.nii", "cut.nii:byte 200"},
                                           {"lie.nii", "lie.nii:byte 42"},
                                           {"two.nii", "two.nii:byte 0: is NIfTI-2"},
                                           {"analyze.hdr", "analyze.hdr:byte 344: "},
                                           {"beside.mhd", "beside.mhd:5: the data file 'a?[2Jb.raw' does not exist"},
                                           {"short.mha", "short.mha:byte "},
                                           {"lie.mha", "lie.mha:3"},
                                           {"short.nrrd", "short.nrrd:byte "},
                                           {"lie.nrrd", "lie.nrrd:4"},
                                           {"head.nrrd", "head.nrrd:"},
                                           {"nowhere.nrrd", "nowhere.nrrd: cannot be opened"},
                                           {".", "the folder has no DICOM images"},
                                           {"tree.h5", "tree.h5:byte 0"}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        char arguments[200];
        snprintf(arguments, sizeof arguments, "segment %s --trace trace.yaml -o out.h5 --json out.json", files[i][0]);
        refused(arguments, files[i][1]);
        if (strcmp(files[i][0], ".") && strcmp(files[i][0], "tree.h5")) {   // info recognises a volume by the same rules
            snprintf(arguments, sizeof arguments, "info %s", files[i][0]);
            refused(arguments, files[i][0]);
            assert_null(strstr(output, "is of no kind that `info` can describe"));
        }
    }
}

static void traces(void **state)
{
    (void)state;
    static const char *const texts[][2] = {
        {"branches: [{start_mm: [90, 0, 0], toward_mm: [2, 0, 0], radius_mm: 1}]\n", "t.yaml:1:12: the start of branch 1 (90, 0, 0) mm"},
        {"branches: [{start_mm: [90, 0, 0], toward_mm: [2, 0, 0], radius_mm: 1}]\n", "lies outside the volume; expected voxel (0, 0, 0) to"},
        {"branches: [{start_mm: [0, 3, 3], toward_mm: [2, 0, 0], radius_mm: 1}]\n", "lies on background"},
        {"branches: [{start_cm: [0, 0, 0], toward_mm: [2, 0, 0], radius_mm: 1}]\n", "t.yaml:1:23: unknown key 'start_cm'"},
        {"branches: [{start_mm: [0, 0, 0], toward_mm: [2, 0, 0], radius_mm: 0}]\n", "t.yaml:1:67: radius_mm '0'"},
        {"branches: [{start_mm: [0, 0, 0], toward_mm: [2, 0, 0], radius_mm: 1}]\nbanana: 1\n", "t.yaml:2:9: unknown key 'banana'"},
        {"branches: [{start_mm: [0, 0, 0]}]\nforbid: [{center_mm: [0, 0, 0], radius_mm: 2}]\n",
         "t.yaml:1:12: the start of branch 1 lies in a region of `forbid`"},
        {"branches: []\n", "t.yaml:1:1: there is no branch"},
        {"", "t.yaml:1:1: the file is empty"}};
    assert_int_equal(run_in("", "synth capsule -o capsule.nrrd --voxel-mm 0.3 --quiet"), 0);
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        put("t.yaml", texts[i][0]);
        refused("segment capsule.nrrd --trace t.yaml -o out.h5", texts[i][1]);
    }
    put("one.nrrd", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 3 3\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace dimension: 3\nencoding: text\n\n"
                    "5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5 5\n");
    put("t.yaml", "branches: [{start_mm: [1, 1, 1]}]\n");
    refused("segment one.nrrd --trace t.yaml -o out.h5", "lies on background (5 in a volume of 5 to 5)");
    assert_int_equal(run_in("", "info one.nrrd"), 0);   // a header without a frame gives no empty line
    assert_true(strstr(output, "voxel_mm") && !strstr(output, "frame"));
}

static void the_wrong_kind_of_file(void **state)
{
    (void)state;
    put("ok.csv", "x_mm,y_mm,z_mm\n0,0,2\n");
    put("nan.csv", "x_mm,y_mm,z_mm\n0,0,2\n0,nan,2\n");
    put("cell.csv", "x_mm,y_mm,z_mm\n0,2\n");
    put("unit.csv", "x_cm,y_mm,z_mm\n0,0,2\n");
    put("noise.bin", "no file of any kind");
    refused("query tree.h5 --points ok.csv -o out.csv", "tree.h5: is a tree without a model; make one with `seldinger fit`");
    refused("query noise.bin --points ok.csv -o out.csv", "noise.bin:byte 0: is not a readable HDF5 file");
    refused("query model.h5 --points nan.csv -o out.csv", "nan.csv:3:3: 'nan' is not a coordinate; expected a finite number of mm");
    refused("query model.h5 --points cell.csv -o out.csv", "cell.csv:2: has 2 cells; expected 3");
    refused("query model.h5 --points unit.csv -o out.csv", "unit.csv:1: the header has no column x_mm");
    refused("query model.h5 --points model.h5 -o out.csv", "model.h5:byte");
    refused("fit noise.bin -o out.h5", "noise.bin:byte 0: is not a readable HDF5 file");
    refused("fit cut.h5 -o out.h5", "cut.h5:byte 0: is not a readable HDF5 file");
    refused("export tree.h5 -o out.stl", "tree.h5: is a tree without a model");
    refused("export noise.bin -o out.stl", "noise.bin: cannot be exported; expected a tree, model or recording");
    refused("export model.h5 -o out.xyz", "unknown extension '.xyz'");
    refused("info noise.bin", "noise.bin");
    refused("info cut.h5", "cut.h5:byte 0: is not a readable HDF5 file");
    refused("export cut.h5 -o out.swc", "cut.h5:byte 0: is not a readable HDF5 file");
    put("s.yaml", "seldinger: 1\nvessel: {model: tree.h5}\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                  "sheath: {inlet: root}\nscript: [[0, 10, 0], [0.1, 0, 0]]\n");
    refused("run s.yaml --summary out.json --final out.csv --record out.h5", "tree.h5: is a tree without a model; make one with `seldinger fit`");
}

static void words_of_the_command_line(void **state)
{
    (void)state;
    static const char *const lines[][2] = {
        {"", "Usage: seldinger"},
        {"banana", "no verb 'banana'; valid: run"},
        {"segment", "missing the volume"},
        {"segment capsule.nrrd", "missing -o TREE.h5"},
        {"segment capsule.nrrd -o out.h5", "--trace F.yaml"},
        {"segment capsule.nrrd --trace trace.yaml --start 0,0,0 -o out.h5", "--start"},
        {"segment capsule.nrrd --start 0,0 -o out.h5", "--start"},
        {"segment capsule.nrrd --start 90,0,0 -o out.h5", "lies outside the volume"},
        {"segment capsule.nrrd --start 0,0,1 --until 0,0 -o out.h5", "--until takes a point"},
        {"segment capsule.nrrd --start 0,0,1 --until 90,0,0 -o out.h5", "the point of `until` (90, 0, 0) mm lies outside the volume"},
        {"segment capsule.nrrd --start 0,0,1 --not a -o out.h5", "--not takes a point"},
        {"segment capsule.nrrd --start 0,0,1 --not 0,0,1 -o out.h5", "from the first start"},
        {"segment capsule.nrrd --banana", "--banana"},
        {"fit", "missing the tree"},
        {"fit tree.h5", "missing -o MODEL.h5"},
        {"fit tree.h5 -o out.h5 --max-blobs 0", "--max-blobs: '0' is not valid; a number from 2"},
        {"fit tree.h5 -o out.h5 --target-mm nan", "--target-mm: 'nan' is not valid"},
        {"fit tree.h5 -o out.h5 --max-blobs 7.5", "--max-blobs: '7.5' is not valid; a whole number"},
        {"fit tree.h5 -o out.h5 --threads 1.5", "--threads: '1.5' is not valid; a whole number from 0 to 256"},
        {"fit tree.h5 -o out.h5 --threads -1", "--threads: '-1' is not valid"},
        {"fit tree.h5 -o out.h5 --banana", "see `seldinger fit --help`"},
        {"fit nowhere.h5 -o out.h5", "nowhere.h5: cannot be opened"},
        {"query", "missing the model"},
        {"query model.h5", "missing --points F.csv"},
        {"query model.h5 --points nowhere.csv -o out.csv --threads 1.5", "--threads: '1.5' is not valid; a whole number"},
        {"query model.h5 --points nowhere.csv -o out.csv", "nowhere.csv: cannot be opened"},
        {"synth", "missing a shape"},
        {"synth banana -o out.h5", "unknown shape 'banana'; expected capsule"},
        {"synth capsule --radius-mm 0 -o out.h5", "radius_mm is '0'; expected a number from"},
        {"synth capsule --noise-grey 11 -o out.nrrd", "need --contrast-grey"},
        {"synth capsule --contrast-grey 0 -o out.nrrd", "--contrast-grey: '0' is not valid"},
        {"synth capsule -o out.xyz", "expected .h5, .stl, .ply or .nrrd"},
        {"export", "expected one file"},
        {"info", "one file is needed"}};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        refused(lines[i][0], lines[i][1]);
    // an input is never overwritten, whatever its path looks like
    static const char *const same[] = {"query model.h5 --points ok.csv -o ok.csv",
                                       "query model.h5 --points ok.csv -o ./model.h5",
                                       "export model.h5 -o alias.stl",
                                       "info model.h5 --report model.h5",
                                       "segment capsule.nrrd --trace trace.yaml -o capsule.nrrd",
                                       "segment capsule.nrrd --trace trace.yaml -o out.h5 --json trace.yaml",
                                       "import --surface tube.stl -o tube.stl"};
    assert_int_equal(run_in("ln -s model.h5 alias.stl &&", "synth open-capsule -o tube.stl --quiet"), 0);
    for (size_t i = 0; i < sizeof same / sizeof same[0]; i++)
        refused(same[i], " would overwrite ");
    static const char *const nowhere[] = {"fit tree.h5 -o nowhere/x",         "synth capsule -o nowhere/x.h5",
                                          "synth capsule -o nowhere/x.nrrd",  "query model.h5 --points ok.csv -o nowhere/x.csv",
                                          "export model.h5 -o nowhere/x.stl", "segment capsule.nrrd --trace trace.yaml -o nowhere/x.h5"};
    for (size_t i = 0; i < sizeof nowhere / sizeof nowhere[0]; i++)
        refused(nowhere[i], "cannot be written: No such file or directory");
}

static void verbs_of_the_trainer(void **state)
{
    (void)state;
    put("free.yaml", "seldinger: 1\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                     "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\nscript: [[0, 10, 0], [0.05, 0, 0]]\n");
    put("other.yaml", "seldinger: 1\nwire: {sections: [{length_mm: 50, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                      "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n");
    put("noise.bin", "no file of any kind");
    put("open.yaml", "x: [1\n");
    put("empty.json", "{\"seldinger_session\": 1}");
    put("guide.yaml",
        "seldinger_device: 1\ndevice: {usage: joystick}\npush: {source: Y, mm_s: 9}\ntwist: {source: X, deg_s: 9, optional: true, tool: guide}\n");
    assert_int_equal(run_in("", "run free.yaml --record free.h5 --quiet"), 0);
    static const char *const lines[][2] = {
        {"replay free.h5 --verify --banana", "see `seldinger replay --help`"},
        {"replay free.yaml --verify", "free.yaml:byte 0: is not a readable HDF5 file"},
        {"replay tree.h5 --verify", "tree.h5: has no dataset"},
        {"replay cut.h5 --scene out", "cut.h5:byte 0: is not a readable HDF5 file"},
        {"replay free.h5 --scene nowhere/out", "nowhere/out: cannot be created: No such file or directory"},
        {"replay free.h5 --at -1 --picture out.png", "--at: '-1' is not valid"},
        {"report", "expected one session file"},
        {"report empty.json empty.json", "expected one session file"},
        {"report nowhere.json", "nowhere.json: cannot be opened"},
        {"report noise.bin --html out.html", "noise.bin:byte 0: is not JSON"},
        {"report empty.json --html out.html", "empty.json: 'score' is missing or not an object"},
        {"report empty.json --banana", "see `seldinger report --help`"},
        {"devices noise.bin", "takes files only with --map"},
        {"devices --banana", "see `seldinger devices --help`"},
        {"devices --map nowhere.yaml", "nowhere.yaml: cannot be opened"},
        {"devices --map open.yaml --json out.json", "open.yaml:2:1: is not YAML"},
        {"devices --map free.yaml", "free.yaml:"},
        {"devices --watch --duration-s 0", "--duration-s: '0' is not valid"},
        {"devices --json nowhere/out.json", "nowhere/out.json: cannot be written"},
#ifdef SELDINGER_RENDER
        {"nav", "missing the scene to steer in"},
        {"nav free.yaml other.yaml", "one scene at a time, not also other.yaml"},
        {"nav nowhere.yaml", "nowhere.yaml: cannot be opened"},
        {"nav open.yaml", "open.yaml:2:1: is not YAML"},
        {"nav free.h5", "free.h5: is a recording; show it: seldinger replay free.h5"},
        {"nav free.yaml --banana", "see `seldinger nav --help`"},
        {"nav free.yaml --at x", "--at: 'x' is not valid"},
        {"nav free.yaml --size 64x64", "--size: '64x64' is not valid"},
        {"nav free.yaml --view banana", "--view: 'banana' is not valid"},
        {"nav free.yaml --duration-s -1", "--duration-s: '-1' is not valid"},
        {"nav free.yaml --threads 1.5", "--threads: '1.5' is not valid"},
        {"nav free.yaml --no-record --device nowhere.yaml", "nowhere.yaml: cannot be opened"},
        {"nav free.yaml --no-record --device open.yaml", "open.yaml:2:1: is not YAML"},
        {"nav free.yaml --no-record --device guide.yaml",
         "guide.yaml:4:52: 'tool' is 'guide', but the scene has no such tool; write wire, outermost, innermost"},
        {"nav free.yaml --no-record --figures nowhere/out.json", "nowhere/out.json: cannot be written"},
        {"nav free.yaml --no-record --resume nowhere.h5", "nowhere.h5: cannot be opened"},
        {"nav free.yaml --no-record --resume tree.h5", "tree.h5: has no dataset"},
        {"nav other.yaml --no-record --resume free.h5", "free.h5: is a recording of another scene than other.yaml"},
        {"nav free.yaml --sessions noise.bin", "noise.bin: cannot store sessions: Not a directory"},
        {"nav free.yaml --sessions noise.bin/out", "noise.bin/out: cannot store sessions: Not a directory"},
#endif
    };
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        refused(lines[i][0], lines[i][1]);
}

// Runs every verb that writes, with a file size limit of 4 kB: existing files stay unchanged.
static void a_full_disk(void **state)
{
    (void)state;
    static const char *const lines[] = {"synth phantom -o out.h5 --quiet",
                                        "synth capsule -o out.nrrd --quiet",
                                        "synth capsule -o out.stl --quiet",
                                        "fit tree.h5 -o out.h5 --quiet",
                                        "export model.h5 -o out.stl",
                                        "query model.h5 --points many.csv -o out.csv",
                                        "segment capsule.nrrd --trace one.yaml -o out.h5 --quiet",
                                        "import --surface capsule.stl -o out.h5 --quiet"};
    char many[60000] = "x_mm,y_mm,z_mm\n";
    size_t length = strlen(many);
    for (int i = 0; i < 200; i++)
        length += (size_t)snprintf(many + length, sizeof many - length, "0.1,0.2,%d\n", i);
    put("many.csv", many);
    put("one.yaml", "branches: [{start_mm: [0, 0, 0]}]\n");
    assert_int_equal(run_in("", "synth open-capsule -o capsule.stl --quiet"), 0);
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        int code = run_in("ulimit -f 8;", lines[i]);
        if (code != 2 || !strstr(output, ": cannot be written: File too large"))
            fail_msg("`%s` on a full disk ended with %d and printed: %s", lines[i], code, output);
        nothing_is_left(lines[i]);
    }
    // /dev/full also fails printed output
    assert_int_equal(run_in("", "info tree.h5 --json > /dev/full"), 2);
    assert_int_equal(run_in("", "fit tree.h5 -o fitted.h5 > /dev/full"), 2);
    put("kept.h5", "before");
    assert_int_equal(run_in("ulimit -f 8;", "synth phantom -o kept.h5"), 2);
    assert_int_equal(run_in("grep -q '^before$' kept.h5 &&", "--version"), 0);
}

// Runs `seldinger ARGUMENTS` with its output in stop.txt until `is_time` or its end, then sends SIGINT. Returns the wait status.
static int stopped(const char *arguments, bool (*is_time)(double seconds), double seconds)
{
    char command[600];
    snprintf(command, sizeof command, "cd '%s' && exec %s %s > stop.txt 2>&1", folder, SELDINGER_PROGRAM, arguments);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        signal(SIGINT, SIG_DFL);   // a shell ignores SIGINT in background jobs
        execl("/bin/sh", "sh", "-c", command, (char *)NULL);
        _exit(127);
    }
    int status;
    struct timespec start, now;
    clock_gettime(CLOCK_MONOTONIC, &start);
    for (;;) {
        if (waitpid(child, &status, WNOHANG) == child)
            return status;
        clock_gettime(CLOCK_MONOTONIC, &now);
        if (is_time((double)(now.tv_sec - start.tv_sec) + 1e-9 * (double)(now.tv_nsec - start.tv_nsec) - seconds))
            break;
    }
    kill(child, SIGINT);
    waitpid(child, &status, 0);
    return status;
}

static bool is_past(double seconds) { return seconds >= 0; }

// True if a temporary file exists beside the output, or the time is over.
static bool is_writing(double seconds)
{
    char pattern[300];
    glob_t found;
    snprintf(pattern, sizeof pattern, "%s/*.part-*", folder);
    bool there = glob(pattern, 0, NULL, &found) == 0;
    globfree(&found);
    return there || seconds >= 0;
}

static void a_stop_by_the_user(void **state)
{
    (void)state;
    // while a file is written: the file is complete and no temporary file remains
    for (int trial = 0; trial < 4; trial++) {
        int status = stopped("export model.h5 -o out.stl --cell-mm 0.1 --quiet", is_writing, 20);
        assert_true((WIFEXITED(status) && WEXITSTATUS(status) == 0) || (WIFSIGNALED(status) && WTERMSIG(status) == SIGINT));
        assert_int_equal(run_in("test ! -e out.stl ||", "info out.stl"), 0);
        assert_int_equal(run_in("rm -f out.stl;", "--version"), 0);
        nothing_is_left("export, stopped");
    }
    // while it computes: the signal ends it with a message; the delay is doubled until the program has started, also on a busy machine
    bool is_reported = false;
    for (double wait = 0.2; !is_reported && wait < 30; wait *= 2) {
        int status = stopped("bench fit --table3 --threads 2", is_past, wait);
        assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT);
        is_reported = run_in("grep -q '^stopped; no unfinished file is left$' stop.txt &&", "--version") == 0;
    }
    assert_true(is_reported);
}

// Renaming would replace a device or pipe: text is written directly into it; HDF5 files and volumes are refused.
static void pipes_and_devices_stay_what_they_are(void **state)
{
    (void)state;
    char path[300];
    snprintf(path, sizeof path, "%s/pipe.nrrd", folder);
    assert_int_equal(mkfifo(path, 0600), 0);
    static const char *const lines[] = {"synth capsule -o pipe.nrrd", "fit tree.h5 -o pipe.nrrd", "segment capsule.nrrd --trace trace.yaml -o pipe.nrrd",
                                        "fit tree.h5 -o out.h5 --picture pipe.nrrd"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        refused(lines[i], "pipe.nrrd: is not a regular file");
    assert_int_equal(
        run_in("{ timeout 10 cat pipe.nrrd > heard.csv & } ;", "query model.h5 --points ok.csv -o pipe.nrrd --quiet; wait; grep -q '^0,0,2,' heard.csv"), 0);
    struct stat status;
    assert_true(stat(path, &status) == 0 && S_ISFIFO(status.st_mode));
}

static int set_up(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    return run_in("", "synth capsule -o tree.h5") || run_in("", "fit tree.h5 -o model.h5 --quiet") || run_in("head -c 3000 tree.h5 > cut.h5 &&", "--version");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(volumes_cut_off_or_lying), cmocka_unit_test(traces),
        cmocka_unit_test(the_wrong_kind_of_file),   cmocka_unit_test(words_of_the_command_line),
        cmocka_unit_test(verbs_of_the_trainer),     cmocka_unit_test(a_full_disk),
        cmocka_unit_test(a_stop_by_the_user),       cmocka_unit_test(pipes_and_devices_stay_what_they_are),
    };
    return cmocka_run_group_tests_name("bad_input", tests, set_up, remove_folder);
}

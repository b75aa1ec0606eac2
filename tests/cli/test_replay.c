// `seldinger replay`: a run is recorded, simulated again, converted to a scene and drawn; recordings that were changed, cut off or are of another kind.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#ifdef SELDINGER_RENDER
#include "render/gl_context.h"
#endif

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-replay-XXXXXX", message_text[1 << 14];
#include "tests/folder.h"
#include "tests/short_run.h"

static const char tube_scene[] = "seldinger: 1\n"
                                 "vessel: {tube: {radius_mm: 1.2, normal: [0, 1, 0], path: [{line_mm: 15}, {arc: {radius_mm: 20, angle_deg: 60}}, "
                                 "{line_mm: 10}]}, contact: tube, friction: 0.05}\n"
                                 "wire: {elements: 20, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
                                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n"
                                 "script: [[0, 100, 0], [0.2, 100, 200], [0.3, 0, 0]]\n";
static const char model_scene[] = "seldinger: 1\n"
                                  "vessel: {model: ../models/capsule.h5, friction: 0.05}\n"
                                  "wire: {elements: 12, sections: [{length_mm: 12, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
                                  "sheath: {entry_mm: [0, 0, 0], direction: [0, 0, 1], inserted_mm: 1}\n"
                                  "script: [[0, 10, 0], [0.2, 0, 90], [0.25, 0, 0]]\n";

// The output goes to `message_text`; $S in a command is the program.
static int run(const char *format, ...)
{
    char command[2000], text[1500];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    snprintf(command, sizeof command, "cd '%s' && S='%s' && { %s ; } 2>&1", folder, SELDINGER_PROGRAM, text);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    message_text[fread(message_text, 1, sizeof message_text - 1, pipe)] = 0;
    int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void ends(int code, const char *words, const char *command)
{
    int ended = run("%s", command);
    if (ended != code || !strstr(message_text, words))
        fail_msg("`%s` ended with %d and printed: %s(expected %d and '%s')", command, ended, message_text, code, words);
}

static int set_up(void **state)
{
    assert_int_equal(make_folder_with_cache(state), 0);
    assert_int_equal(run("mkdir scenes models && $S synth capsule -o models/tree.h5 --quiet && $S fit models/tree.h5 -o models/capsule.h5 --quiet"), 0);
    put("scenes/bend.yaml", tube_scene);
    put("scenes/capsule.yaml", model_scene);
    return run("$S run scenes/bend.yaml --record bend.h5 --quiet && cd scenes && $S run capsule.yaml --record ../capsule.h5 --quiet");
}

// Makes a copy of a recording with a changed row of a dataset or a changed text.
static hid_t open_copy(const char *from, const char *to)
{
    assert_int_equal(run("cp %s %s", from, to), 0);
    hid_t file = H5Fopen(in_folder(to), H5F_ACC_RDWR, H5P_DEFAULT);
    assert_true(file >= 0);
    return file;
}

static void change_row(const char *from, const char *to, const char *dataset, hsize_t row, hsize_t columns, hid_t type, const void *value)
{
    hid_t file = open_copy(from, to), set = H5Dopen2(file, dataset, H5P_DEFAULT), space = H5Dget_space(set);
    hsize_t start[2] = {row, 0}, count[2] = {1, columns};
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL);
    hid_t memory = H5Screate_simple(columns > 1 ? 2 : 1, count, NULL);
    assert_true(H5Dwrite(set, type, memory, space, H5P_DEFAULT, value) >= 0);
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
    assert_true(H5Fclose(file) >= 0);
}

static void change_scene(const char *from, const char *to, const char *words, const char *by)
{
    hid_t file = open_copy(from, to), set = H5Dopen2(file, "/scene", H5P_DEFAULT), type = H5Dget_type(set);
    char text[2000] = "";
    assert_true(strlen(words) == strlen(by) && H5Tget_size(type) < sizeof text);
    assert_true(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text) >= 0);
    char *at = strstr(text, words);
    assert_non_null(at);
    memcpy(at, by, strlen(by));
    assert_true(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text) >= 0);
    H5Tclose(type);
    H5Dclose(set);
    assert_true(H5Fclose(file) >= 0);
}

static void a_run_is_simulated_again(void **state)
{
    (void)state;
    ends(0, "300 steps (0.300 s) simulated again, the same state at each", "$S replay bend.h5 --verify");
    ends(0, "", "$S replay bend.h5 --verify --quiet");
    assert_string_equal(message_text, "");
    // from any folder, even if the scene's own file was changed since
    ends(0, "250 steps", "mkdir -p elsewhere/deep && cd elsewhere/deep && $S replay ../../capsule.h5 --verify");
    ends(0, "250 steps", "cd / && $S replay \"$OLDPWD/capsule.h5\" --verify");
}

static void what_was_changed_is_found(void **state)
{
    (void)state;
    double command[2] = {31, 0};
    change_row("bend.h5", "pushed.h5", "/command", 40, 2, H5T_NATIVE_DOUBLE, command);
    ends(1, "pushed.h5: differs from step 40 (0.041 s) on: recorded ", "$S replay pushed.h5 --verify");
    ends(1, "differs from step 40", "$S replay pushed.h5 --verify --quiet");
    uint64_t hash = 1;
    change_row("bend.h5", "hash.h5", "/state_hash", 299, 1, H5T_NATIVE_UINT64, &hash);
    ends(1, "differs from step 299 (0.300 s) on: recorded 0000000000000001", "$S replay hash.h5 --verify");
    change_scene("bend.h5", "slippery.h5", "friction: 0.05", "friction: 0.01");
    ends(1, "differs from step", "$S replay slippery.h5 --verify");
    change_scene("bend.h5", "longer.h5", "elements: 20", "elements: 40");
    ends(2, "gives a tool of 41 nodes, the recording holds one of 21", "$S replay longer.h5 --verify");
    change_scene("bend.h5", "broken.h5", "friction: 0.05", "friction: cold");
    ends(2, "friction", "$S replay broken.h5 --verify");
}

static void a_model_that_is_no_longer_the_same_is_named(void **state)
{
    (void)state;
    ends(1, "models/capsule.h5: is not what the recording was made with; its sha256 was ",
         "cp models/capsule.h5 kept.h5 && $S synth capsule --radius-mm 0.8 -o models/tree.h5 --quiet && $S fit models/tree.h5 -o models/capsule.h5 --quiet && "
         "$S replay capsule.h5 --verify");
    assert_non_null(strstr(message_text, "differs from step"));
    assert_null(strstr(message_text, "capsule.yaml"));
    ends(2, "models/capsule.h5: cannot be opened", "rm models/capsule.h5 && $S replay capsule.h5 --verify");
    ends(0, "250 steps", "mv kept.h5 models/capsule.h5 && $S replay capsule.h5 --verify");
}

static void a_recording_becomes_a_scene(void **state)
{
    (void)state;
    ends(0, "`seldinger check again` compares", "$S replay bend.h5 --scene again");
    ends(0, "same", "$S check again");
    ends(0, "", "$S run again/scene.yaml --record again.h5 --quiet && $S replay again.h5 --verify --quiet");
    ends(0, "same", "sed -i 's/,100,/,101,/' again/hand.csv && ! $S check again; sed -i 's/,101,/,100,/' again/hand.csv && $S check again");
    // the model by its path relative to that folder
    ends(0, "scene.yaml, hand.csv", "mkdir -p far/away && cd scenes && $S replay ../capsule.h5 --scene ../far/away/made");
    ends(0, "model: \"../../../models/capsule.h5\"", "cat far/away/made/scene.yaml");
    ends(0, "same", "$S check far/away/made");
    ends(0, "same", "cd far && $S check away/made");
    ends(0, "same", "$S replay capsule.h5 --scene . --quiet && $S check . && rm scene.yaml hand.csv scene.golden.csv");
    // a path that cannot be written, and a folder that is a file
    ends(2, "nowhere/made", "$S replay bend.h5 --scene nowhere/made");
    ends(2, "bend.h5", "$S replay capsule.h5 --scene bend.h5");
    // a recording that differs is converted too, with a message
    ends(1, "differs from step 40", "$S replay pushed.h5 --scene pushed");
    ends(0, "same", "$S check pushed");
}

static void the_kind_of_contact_is_kept(void **state)
{
    (void)state;
    // --scene simulates again and ends with 1 if a state differs
    ends(0, "", "$S run scenes/bend.yaml --contact grid --record grid.h5 --quiet");
    ends(0, "contact: \"grid\"", "$S replay grid.h5 --scene grid --quiet && cat grid/scene.yaml");
    ends(0, "same", "$S check grid");
    // it is not a run with another contact
    ends(1, "", "cmp -s again/scene.golden.csv grid/scene.golden.csv");
    if (WHOLE_RUN)     // of a model, whose grid takes seconds to sample
        ends(0, "", "$S run scenes/capsule.yaml --contact grid --record grid-model.h5 --quiet && $S replay grid-model.h5 --verify --quiet");
}

static void what_is_no_recording_is_refused(void **state)
{
    (void)state;
    put("noise.h5", "no file of any kind");
    ends(2, "nowhere.h5: cannot be opened", "$S replay nowhere.h5 --verify");
    ends(2, "noise.h5:byte 0: is not a readable HDF5 file", "$S replay noise.h5 --verify");
    ends(2, "models/tree.h5: has no dataset", "$S replay models/tree.h5 --verify");
    ends(2, "scenes: cannot be opened", "$S replay scenes --verify");
    ends(2, "", "head -c 20000 bend.h5 > cut.h5 && $S replay cut.h5 --verify");
    hid_t file = open_copy("bend.h5", "bare.h5");
    H5Ldelete(file, "/scene", H5P_DEFAULT);
    H5Fclose(file);
    ends(2, "bare.h5: has no scene text", "$S replay bare.h5 --verify");
    int64_t step = INT64_MAX;
    change_row("bend.h5", "frame.h5", "/wire/step", 3, 1, H5T_NATIVE_INT64, &step);
    ends(2, "expected rising steps from 0", "$S replay frame.h5 --verify");
    // the window counts rows by time
    static const double bad_time[] = {(double)NAN, (double)INFINITY, 1e300};
    for (int i = 0; i < 3; i++) {
        change_row("bend.h5", "time.h5", "/time_s", 0, 1, H5T_NATIVE_DOUBLE, &bad_time[i]);
        ends(2, "time.h5: /time_s holds ", "$S replay time.h5");
        ends(2, "time.h5: /time_s holds ", "$S replay time.h5 --verify");
    }
    static const double bad_step[] = {0, -1, 1e300, (double)NAN};
    for (int i = 0; i < 4; i++) {
        file = open_copy("bend.h5", "step.h5");
        hid_t attribute = H5Aopen(file, "step_ms", H5P_DEFAULT);
        assert_true(H5Awrite(attribute, H5T_NATIVE_DOUBLE, &bad_step[i]) >= 0);
        H5Aclose(attribute);
        H5Fclose(file);
        ends(2, "step.h5: has steps of ", "$S replay step.h5 --verify");
    }
}

static void wrong_options_are_refused(void **state)
{
    (void)state;
    static const char *const lines[][2] = {{"", "missing the recording"},
                                           {"bend.h5 capsule.h5 --verify", "one recording at a time, not also capsule.h5"},
                                           {"bend.h5 --banana", "replay --help"},
                                           {"bend.h5 --picture", "replay --help"},
                                           {"bend.h5 --picture out.png --size 10x10", "--size"},
                                           {"bend.h5 --picture out.png --size 640", "--size"},
                                           {"bend.h5 --picture out.png --view banana", "--view"},
                                           {"bend.h5 --picture out.png --at nan", "--at: 'nan' is not valid"},
                                           {"bend.h5 --picture out.png --at -1", "--at: '-1' is not valid"},
                                           {"bend.h5 --picture out.png --lao 91", "--lao: '91' is not valid"},
                                           {"bend.h5 --picture out.png --cra -46", "--cra: '-46' is not valid"},
                                           {"bend.h5 --movie out.mp4 --fps 0", "--fps: '0' is not valid"},
                                           {"bend.h5 --movie out.mp4 --speed 0", "--speed: '0' is not valid"},
                                           {"bend.h5 --movie out.mp4 --to x", "--to: 'x' is not valid"},
                                           {"bend.h5 --verify --threads 1.5", "--threads: '1.5' is not valid"},
                                           {"bend.h5 --picture nowhere/out.png", "nowhere/out.png"},
                                           {"bend.h5 --movie nowhere/out.mp4", "nowhere/out.mp4"}};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        char command[300];
        snprintf(command, sizeof command, "$S replay %s", lines[i][0]);
        ends(2, lines[i][1], command);
        ends(1, "", "ls | grep -q '^out'");
    }
}

#ifdef SELDINGER_RENDER
static void need_egl(void)
{
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        print_message("skipped: %s\n", message);
        skip();
    }
    gl_context_destroy(context);
}

static void pictures_are_of_the_moment_and_size_requested(void **state)
{
    (void)state;
    need_egl();
    ends(0, "", "$S replay bend.h5 --picture end.png --size 320x240 --no-panels --quiet");
    unsigned char *png = (unsigned char *)text_of(in_folder("end.png"));
    assert_memory_equal(png + 1, "PNG", 3);
    assert_int_equal(png[18] << 8 | png[19], 320);
    assert_int_equal(png[22] << 8 | png[23], 240);
    free(png);
    // without --at the end; a time beyond the end is the end, too
    ends(0, "", "$S replay bend.h5 --picture last.png --at 0.3 --size 320x240 --no-panels && cmp end.png last.png");
    ends(0, "", "$S replay bend.h5 --picture past.png --at 1000 --size 320x240 --no-panels && cmp end.png past.png");
    ends(1, "", "$S replay bend.h5 --picture first.png --at 0 --size 320x240 --no-panels && cmp -s end.png first.png");
    ends(1, "", "$S replay bend.h5 --picture turned.png --lao 40 --size 320x240 --no-panels && cmp -s end.png turned.png");
    ends(2, "gives a tool of 41 nodes, the recording holds one of 21", "$S replay longer.h5 --picture none.png --size 320x240");
    ends(1, "", "test -e none.png");
}

static void a_film_has_its_frames(void **state)
{
    (void)state;
    need_egl();
    if (system("ffmpeg -hide_banner -loglevel error -encoders 2>/dev/null | grep -q libx264 && command -v ffprobe >/dev/null") != 0) {
        print_message("skipped: no ffmpeg with libx264, or no ffprobe\n");
        skip();
    }
    ends(0, "", "$S replay bend.h5 --movie out.mp4 --from 0.1 --to 0.25 --fps 20 --size 320x240 --no-panels --quiet");
    ends(0, "320,240,4\n", "ffprobe -v error -count_frames -select_streams v -show_entries stream=width,height,nb_read_frames -of csv=p=0 out.mp4");
    ends(0, "", "rm out.mp4");
    ends(2, "gives a tool of 41 nodes", "$S replay longer.h5 --movie out.mp4 --size 320x240");
    ends(1, "", "ls | grep -q '^out'");
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_run_is_simulated_again),
        cmocka_unit_test(what_was_changed_is_found),
        cmocka_unit_test(a_model_that_is_no_longer_the_same_is_named),
        cmocka_unit_test(a_recording_becomes_a_scene),
        cmocka_unit_test(the_kind_of_contact_is_kept),
        cmocka_unit_test(what_is_no_recording_is_refused),
        cmocka_unit_test(wrong_options_are_refused),
#ifdef SELDINGER_RENDER
        cmocka_unit_test(pictures_are_of_the_moment_and_size_requested),
        cmocka_unit_test(a_film_has_its_frames),
#endif
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}

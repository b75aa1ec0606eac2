// A recording as a video, end to end: `run --record`, X-ray settings of a session, `replay --movie`, and the frames that ffmpeg reads back. Contrast agent is
// injected into a straight vessel, appears in the middle of the picture and is washed out; the last image holds once the pedal is up.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/gl_context.h"
#include "sim/xray.h"

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 320, HEIGHT = 240, FPS = 20, STEPS = 2000, FRAMES = 41 };
static char folder[] = "/tmp/seldinger-film-XXXXXX";
#include "tests/folder.h"

static const char scene_text[] = "seldinger: 1\n"
                                 "vessel:\n"
                                 "  tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}\n"
                                 "  contact: lim\n"
                                 "wire: {elements: 20, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n"
                                 "script: [[0, 5, 0], [1, 0, 0], [2, 0, 0]]\n";

static void need_everything(void)
{
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        print_message("skipped: %s\n", message);
        skip();
    }
    gl_context_destroy(context);
    if (system("ffmpeg -hide_banner -loglevel error -encoders 2>/dev/null | grep -q libx264") != 0) {
        print_message("skipped: no ffmpeg with libx264\n");
        skip();
    }
}

__attribute__((format(printf, 1, 2))) static int command(const char *format, ...)
{
    char text[1200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return system(text);
}

// The controls of an operator: fluoroscopy from the start to 1.6 s, 3 ml/s of contrast agent from 0.5 to 1 s.
static void set_xray(const char *path)
{
    static XrayControl xray[STEPS];
    for (int i = 0; i < STEPS; i++) {
        xray[i] = xray_default_control();
        xray[i].pedal = i < 1600;
        xray[i].field_mm = 40;
        xray[i].table_mm[0] = 30;
        xray[i].contrast_ml_s = i >= 500 && i < 1000 ? 3 : 0;
    }
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT), set = H5Dopen2(file, "/xray", H5P_DEFAULT);
    assert_true(set >= 0);
    hid_t space = H5Dget_space(set);
    hsize_t extent[2] = {0};
    assert_int_equal(H5Sget_simple_extent_dims(space, extent, NULL), 2);
    assert_true(extent[0] == STEPS && extent[1] == XRAY_VALUES);
    assert_true(H5Dwrite(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, xray) >= 0);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(file);
}

// Mean grey of a part of a frame, in pixels.
static double mean_of(const uint8_t *frame, int x, int y, int width, int height)
{
    double sum = 0;
    for (int j = y; j < y + height; j++)
        for (int i = x; i < x + width; i++)
            sum += frame[j * WIDTH + i];
    return sum / (width * height);
}

static double mean_change(const uint8_t *a, const uint8_t *b)
{
    double sum = 0;
    for (int j = HEIGHT / 2; j < HEIGHT - 20; j++)
        for (int i = 60; i < WIDTH - 60; i++)
            sum += abs(a[j * WIDTH + i] - b[j * WIDTH + i]);
    return sum / ((HEIGHT / 2 - 20) * (WIDTH - 120));
}

static void record(char *recording, size_t room)
{
    char scene[200];
    snprintf(scene, sizeof scene, "%s/tube.yaml", folder);
    snprintf(recording, room, "%s/tube.h5", folder);
    FILE *file = fopen(scene, "w");
    assert_non_null(file);
    fputs(scene_text, file);
    fclose(file);
    assert_int_equal(command("'%s' run '%s' --record '%s' --quiet >/dev/null", SELDINGER_PROGRAM, scene, recording), 0);
    set_xray(recording);
}

static void contrast_comes_and_goes_in_a_film(void **state)
{
    (void)state;
    need_everything();
    char recording[200], text[600];
    record(recording, sizeof recording);
    for (int i = 0; i < 2; i++)
        assert_int_equal(command("'%s' replay '%s' --movie '%s/%d.mp4' --quiet --no-panels --size %dx%d --fps %d", SELDINGER_PROGRAM, recording, folder, i,
                                 WIDTH, HEIGHT, FPS),
                         0);
    // the same recording gives the same video
    assert_int_equal(command("cmp -s '%s/0.mp4' '%s/1.mp4'", folder, folder), 0);

    snprintf(text, sizeof text, "ffmpeg -nostdin -loglevel error -i '%s/0.mp4' -f rawvideo -pix_fmt gray -", folder);
    FILE *decode = popen(text, "r");
    assert_non_null(decode);
    static uint8_t frame[FRAMES][WIDTH * HEIGHT];
    for (int i = 0; i < FRAMES; i++)
        assert_int_equal(fread(frame[i], 1, WIDTH * HEIGHT, decode), WIDTH * HEIGHT);
    assert_int_equal(fread(text, 1, 1, decode), 0);
    pclose(decode);

    // the vessel is in the middle, 21 pixels wide; above it there is none
    double before = 0, during = 0, after = 0, beside = 0;
    for (int i = 0; i < 9; i++)
        before += mean_of(frame[i], 150, 115, 20, 10) / 9;
    for (int i = 15; i < 20; i++) {
        during += mean_of(frame[i], 150, 115, 20, 10) / 5;
        beside += mean_of(frame[i], 150, 60, 20, 10) / 5;
    }
    for (int i = 28; i < 33; i++)
        after += mean_of(frame[i], 150, 115, 20, 10) / 5;
    print_message("mean grey of the vessel before, with and after contrast: %.1f %.1f %.1f, beside it %.1f\n", before, during, after, beside);
    assert_true(during < 0.9 * before);
    assert_true(during < 0.9 * beside);
    assert_true(fabs(after - before) < 0.03 * before);

    // noise is new with each pulse, at 15 a second within two pictures of 20; then it holds
    for (int i = 2; i < 32; i++)
        assert_true(mean_change(frame[i - 2], frame[i]) > 2);
    for (int i = 34; i < FRAMES; i++)
        assert_true(mean_change(frame[i - 1], frame[i]) < 1);
}

static void a_film_that_cannot_be_is_reported(void **state)
{
    (void)state;
    need_everything();
    char recording[200];
    record(recording, sizeof recording);
    assert_int_equal(command("'%s' replay '%s' --movie /nowhere/x.mp4 --quiet 2>'%s/said'; test $? = 2", SELDINGER_PROGRAM, recording, folder), 0);
    assert_int_equal(command("grep -q 'nowhere/x.mp4: ' '%s/said'", folder), 0);
    // the program by its path, with a PATH that does not contain ffmpeg
    assert_int_equal(
        command("PATH=/nowhere '%s' replay '%s' --movie '%s/x.mp4' --quiet 2>'%s/said'; test $? = 2", SELDINGER_PROGRAM, recording, folder, folder), 0);
    assert_int_equal(command("grep -q 'install ffmpeg' '%s/said'", folder), 0);
    assert_int_equal(command("test -z \"$(find '%s' -name 'x.mp4*')\"", folder), 0);
}

// The middle of a close-up is the tool's tip: the picture of 60 mm differs from that of the whole scene, and a close-up of nothing is refused.
static void a_close_up_is_of_the_tips(void **state)
{
    (void)state;
    need_everything();
    char recording[200];
    record(recording, sizeof recording);
    const char *const options[2] = {"", "--close-up 12"};
    for (int i = 0; i < 2; i++)
        assert_int_equal(command("'%s' replay '%s' --picture '%s/close%d.png' --quiet --no-panels --view 3d --size 320x240 %s", SELDINGER_PROGRAM, recording,
                                 folder, i, options[i]),
                         0);
    assert_int_equal(command("cmp -s '%s/close0.png' '%s/close1.png'; test $? = 1", folder, folder), 0);
    assert_int_equal(command("'%s' replay '%s' --picture '%s/x.png' --close-up 1 2>'%s/said'; test $? = 2 && grep -q -e '--close-up' '%s/said'",
                             SELDINGER_PROGRAM, recording, folder, folder, folder),
                     0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(contrast_comes_and_goes_in_a_film),
        cmocka_unit_test(a_film_that_cannot_be_is_reported),
        cmocka_unit_test(a_close_up_is_of_the_tips),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

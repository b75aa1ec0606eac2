// When the views of the trainer are drawn: the first picture has no insets, later ones draw them in turn, and a repeated picture copies them.
#include "render/views.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/scene_views.h"
#include "tests/sim/trainer_scene.h"

enum { WIDTH = 1000, HEIGHT = 640 };

typedef struct Screen {
    TrainerScene trainer;
    GlContext *context;
    GlCanvas canvas;
    Views *views;
    Simulator *simulator;
    Pose *pose;
    OperatorControls controls;
    PanelLayout layout;
    uint32_t pulse;
    uint8_t rgb[HEIGHT][WIDTH][3];
} Screen;

static int open_screen(void **state)
{
    char message[512];
    Screen *screen = *state = calloc(1, sizeof *screen);
    screen->context = gl_context_create(message, sizeof message);
    if (!screen->context) {
        print_message("no EGL: %s\n", message);
        return 0;
    }
    screen->trainer = trainer_scene_open(true);
    screen->simulator = simulator_create(screen->trainer.scene, screen->trainer.open.vessel, &faults);
    screen->pose = pose_create_for(screen->simulator);
    const XrayControl xray = xray_default_control();
    pose_take(screen->pose, screen->simulator, &(ToolCommands){0}, &xray);
    assert_true(gl_canvas_create(&screen->canvas, WIDTH, HEIGHT, 1, message, sizeof message));
    screen->views = scene_views_create(screen->trainer.scene, &screen->trainer.open, &screen->controls, message, sizeof message, &faults);
    assert_non_null(screen->views);
    screen->layout = panel_layout(WIDTH, HEIGHT, 1, VIEW_FLUOROSCOPY, true);
    return 0;
}

static int close_screen(void **state)
{
    Screen *screen = *state;
    if (screen->context) {
        views_destroy(screen->views);
        gl_canvas_destroy(&screen->canvas);
        pose_free(screen->pose);
        simulator_destroy(screen->simulator);
        trainer_scene_close(&screen->trainer);
        gl_context_destroy(screen->context);
    }
    free(screen);
    return 0;
}

static void draw(Screen *screen, bool is_still, bool is_repeat)
{
    ViewsFrame frame = {.pose = screen->pose,
                        .xray = &screen->controls.xray,
                        .look = &screen->controls.look,
                        .pulse = ++screen->pulse,
                        .is_still = is_still,
                        .is_repeat = is_repeat};
    views_draw(screen->views, &frame, &screen->layout, WIDTH, HEIGHT, screen->canvas.framebuffer);
    gl_canvas_read(&screen->canvas, screen->rgb[0][0]);
}

// Whether a view shows more than one colour. Rows of the picture go downwards, those of a port upwards.
static bool shows_something(const Screen *screen, PanelView view)
{
    const ViewPort *at = &screen->layout.view[view];
    assert_true(at->width > 20 && at->height > 20);
    const uint8_t *first = screen->rgb[HEIGHT - 1 - at->y][at->x];
    for (int y = at->y; y < at->y + at->height; y++)
        for (int x = at->x; x < at->x + at->width; x++)
            if (memcmp(screen->rgb[HEIGHT - 1 - y][x], first, 3) != 0)
                return true;
    return false;
}

static int views_shown(const Screen *screen)
{
    int shown = 0;
    for (int i = 0; i < VIEW_COUNT; i++)
        shown |= shows_something(screen, (PanelView)i) << i;
    return shown;
}

enum { XRAY_ALONE = 1 << VIEW_FLUOROSCOPY, EVERYTHING = (1 << VIEW_COUNT) - 1 };

static Screen *screen_or_skip(void **state)
{
    Screen *screen = *state;
    if (!screen->context)
        skip();
    return screen;
}

static void insets_come_after_the_first_picture(void **state)
{
    Screen *screen = screen_or_skip(state);
    draw(screen, false, false);
    assert_int_equal(views_shown(screen), XRAY_ALONE);
    draw(screen, false, true);        // also if nothing changes
    draw(screen, false, true);
    assert_int_equal(views_shown(screen), EVERYTHING);
}

static void an_independent_picture_has_them_at_once(void **state)
{
    Screen *screen = screen_or_skip(state);
    draw(screen, true, false);
    assert_int_equal(views_shown(screen), EVERYTHING);
}

static void a_repeated_picture_copies_them(void **state)
{
    Screen *screen = screen_or_skip(state);
    const ViewPort *at = &screen->layout.view[VIEW_3D];
    for (int i = 0; i < 3; i++)
        draw(screen, false, false);
    uint8_t *before = malloc(sizeof screen->rgb);
    memcpy(before, screen->rgb, sizeof screen->rgb);
    free_camera_orbit(&screen->controls.look.camera, 200, 50);
    for (int change = 0; change < 2; change++) {
        bool differs = false;
        for (int i = 0; i < 2; i++)
            draw(screen, false, change == 0);
        for (int y = at->y; y < at->y + at->height; y++)
            differs |= memcmp(screen->rgb[HEIGHT - 1 - y][at->x], before + ((size_t)(HEIGHT - 1 - y) * WIDTH + (size_t)at->x) * 3, (size_t)at->width * 3) != 0;
        assert_int_equal(differs, change);
    }
    free(before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test_setup_teardown(insets_come_after_the_first_picture, open_screen, close_screen),
                                       cmocka_unit_test_setup_teardown(an_independent_picture_has_them_at_once, open_screen, close_screen),
                                       cmocka_unit_test_setup_teardown(a_repeated_picture_copies_them, open_screen, close_screen)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// A second recording beside a replayed one: in step from the first action in each, by its own time, and drawn into its own part of the picture only.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/replay_side.h"
#include "tests/geom/near.h"
#include "tests/sim/trainer_scene.h"

#include <stdlib.h>

static char folder[] = "/tmp/seldinger-side-XXXXXX";
#include "tests/folder.h"

enum { STEPS = 2500, MAIN_FIRST = 300, SIDE_FIRST = 800, WIDTH = 640, HEIGHT = 360 };

static TrainerScene trainer;
static RecordedRun *main_run, *side_run;

// Rests for `first` steps, then pushes.
static RecordedRun *record(int first, double push_mm_s, const char *name)
{
    Simulator *simulator = simulator_create(trainer.scene, trainer.open.vessel, &faults);
    RecordingOptions options = recording_default_options();
    Recording *recording = simulator ? recording_create(in_folder(name), simulator, &options, &faults) : NULL;
    assert_non_null(recording);
    for (int i = 0; i < STEPS; i++) {
        ToolCommands commands = {.tool = {{i < first ? 0 : push_mm_s, 0}}};
        simulator_step(simulator, &commands);
        assert_true(recording_step(recording, simulator, &commands, NULL));
    }
    assert_true(recording_close(recording, simulator, &faults));
    simulator_destroy(simulator);
    RecordedRun *run = recorded_run_load(in_folder(name), &faults);
    assert_non_null(run);
    return run;
}

static int set_up(void **state)
{
    if (make_folder(state) != 0)
        return -1;
    trainer = trainer_scene_open(false);
    main_run = record(MAIN_FIRST, 8, "main.h5");
    side_run = record(SIDE_FIRST, 4, "side.h5");
    return 0;
}

static int tear_down(void **state)
{
    recorded_run_free(main_run);
    recorded_run_free(side_run);
    trainer_scene_close(&trainer);
    return remove_folder(state);
}

static void assert_times(ReplaySide *side, double main_s)
{
    const double later = (SIDE_FIRST - MAIN_FIRST) * 0.001;
    replay_side_follow(side, main_s);
    assert_near(replay_side_state(side)->time_s, fmin(fmax(main_s + later, 0.001), STEPS * 0.001), 1e-9);
}

static void check_times(ReplaySide *side)
{
    const double later = (SIDE_FIRST - MAIN_FIRST) * 0.001;
    assert_true(replay_side_state(side)->is_in_step);
    for (int i = 0; i <= 20; i++)
        assert_times(side, 0.1 * i);
    assert_times(side, 0.7);                     // back
    assert_times(side, STEPS * 0.001);           // beyond its end: there
    // its own time: it goes along with the same speed
    replay_side_seek(side, 0.9, 0.2);
    assert_false(replay_side_state(side)->is_in_step);
    assert_near(replay_side_state(side)->time_s, 0.9, 1e-9);
    assert_near(replay_side_state(side)->behind_s, later - 0.7, 1e-9);
    replay_side_follow(side, 0.5);
    assert_near(replay_side_state(side)->time_s, 1.2, 1e-9);
    replay_side_toggle_step(side, 0.5);
    assert_true(replay_side_state(side)->is_in_step && fabs(replay_side_state(side)->behind_s) < 1e-12);
    assert_near(replay_side_state(side)->time_s, 0.5 + later, 1e-9);
    // both at the same time since their first actions: the slower hand has pushed half as far
    const double main_pushed = main_run->inserted[1299] - main_run->inserted[0];
    replay_side_follow(side, 1.3);
    const double pushed = side_run->inserted[(int)lround(replay_side_state(side)->time_s * 1000) - 1] - side_run->inserted[0];
    assert_near(pushed, main_pushed / 2, 0.02);
}

// `side` fills the right half and leaves the left one as it was.
static void check_picture(ReplaySide *side)
{
    static uint8_t rgb[3 * WIDTH * HEIGHT];
    static const float red[3] = {1, 0, 0};
    GlCanvas canvas;
    VesselSceneLook look = {0};
    ViewPort right;
    PanelLayout layout = panel_layout(WIDTH, HEIGHT, 1, VIEW_FLUOROSCOPY, false), left;
    assert_true(gl_canvas_create(&canvas, WIDTH, HEIGHT, 1, NULL, 0));
    replay_side_split(&layout, &left, &right);
    assert_true(left.view[VIEW_FLUOROSCOPY].width + right.width <= WIDTH && right.x >= left.view[VIEW_FLUOROSCOPY].width);
    assert_true(abs(left.view[VIEW_FLUOROSCOPY].width - right.width) <= 1);
    gl_canvas_begin(&canvas, red);
    replay_side_draw(side, VIEW_FLUOROSCOPY, right, &look, WIDTH, HEIGHT, canvas.framebuffer);
    gl_canvas_read(&canvas, rgb);
    int kept = 0, drawn = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const uint8_t *p = &rgb[3 * (y * WIDTH + x)];
            const bool is_red = p[0] == 255 && p[1] == 0 && p[2] == 0;
            kept += x < right.x && is_red;
            drawn += x >= right.x && x < right.x + right.width && !is_red;
        }
    assert_int_equal(kept, right.x * HEIGHT);
    assert_true(drawn > right.width * right.width / 2);
    gl_canvas_destroy(&canvas);
}

static void the_second_goes_in_step_or_by_its_own_time(void **state)
{
    (void)state;
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        print_message("skipped: no EGL: %s\n", message);
        skip();
    }
    ReplayRecording recording = {"side.h5", side_run, trainer.scene, &trainer.open};
    ReplaySide *side = replay_side_create(&recording, main_run, &faults);
    if (!side)
        fail_msg("%s", faults.text[0]);
    check_times(side);
    check_picture(side);
    // its score is computed to the end, whatever is shown
    while (!replay_side_compute(side, 0.01))
        ;
    replay_side_follow(side, 1.5);
    assert_near(replay_side_state(side)->figures->start_s, SIDE_FIRST * 0.001, 1e-9);
    assert_true(replay_side_state(side)->figures->time_s > 1);
    replay_side_free(side);
    gl_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_second_goes_in_step_or_by_its_own_time)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

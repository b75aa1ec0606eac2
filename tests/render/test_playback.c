// Playback of a recording: a moment and its picture are the same however they are reached; and the score of the repeated simulation is the session's.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/playback.h"
#include "render/scene_views.h"
#include "sim/rescore.h"
#include "sim/run_marks.h"
#include "tests/geom/near.h"
#include "tests/geom/random_numbers.h"
#include "tests/short_run.h"
#include "tests/sim/trainer_scene.h"

#include <stdlib.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-playback-XXXXXX";
#include "tests/folder.h"

// Longer than two of the moments that a playback stores.
enum { STEPS = 10430, EACH_S = 100 };

static TrainerScene trainer;
static RecordedRun *run;                     // of a session in the blobby model
static ScoreFigures live[STEPS / EACH_S + 1];
static double live_injected_ml[STEPS / EACH_S + 1];

static Command hand_at(int64_t step) { return (Command){step < 1200 ? 12 : step < 5000 ? 0.5 : -2 + (double)(step % 700) / 100, step % 900 < 300 ? 90 : 0}; }

static XrayControl controls_at(int64_t step)
{
    XrayControl xray = xray_default_control();
    xray.pedal = step % 1730 > 200 && step % 1730 < 1311;
    xray.pulses_s = step < 4000 ? 15 : step < 4700 ? 7.5F : 30;
    xray.contrast_ml_s = step % 3000 > 700 && step % 3000 < 1403 ? 2.5F : 0;
    xray.lao_deg = (float)(step / 100);
    // live, roadmap and subtraction, each with a mask of its own and while contrast agent flows and the C-arm turns; then live again
    xray.mode = step < 2900 ? XRAY_LIVE : step < 5200 ? XRAY_ROADMAP : step < 9000 ? XRAY_DSA : XRAY_LIVE;
    xray.mask = (float)((step >= 2900) + (step >= 4300) + (step >= 5200) + (step >= 7300));
    xray.bookmark = (float)((step >= 1234) + (step >= 7007));
    return xray;
}

static RecordedRun *record(TrainerScene *it, int64_t steps, bool is_watched, const char *name)
{
    Simulator *simulator = simulator_create(it->scene, it->open.vessel, &faults);
    assert_non_null(simulator);
    SessionTracker *tracker = session_tracker_create(simulator, it->open.tree);
    RecordingOptions options = recording_default_options();
    options.frame_ms = 33;
    Recording *recording = recording_create(in_folder(name), simulator, &options, &faults);
    assert_true(tracker && recording);
    TrackerView *view = malloc(session_tracker_view_bytes(tracker));
    for (int64_t i = 0; i <= steps; i++) {
        if (is_watched && i % EACH_S == 0) {
            session_tracker_publish(tracker, view);
            live[i / EACH_S] = view->score;
            live_injected_ml[i / EACH_S] = view->injected_ml;
        }
        if (i == steps)
            break;
        XrayControl xray = controls_at(i);
        simulator_step_one_tool(simulator, hand_at(i));
        session_tracker_step(tracker, simulator, &(ToolCommands){.tool = {hand_at(i)}}, is_watched ? &xray : NULL);
        assert_true(recording_step(recording, simulator, &(ToolCommands){.tool = {hand_at(i)}}, is_watched ? &xray : NULL));
    }
    free(view);
    assert_true(recording_close(recording, simulator, &faults));
    session_tracker_free(tracker);
    simulator_destroy(simulator);
    RecordedRun *made = recorded_run_load(in_folder(name), &faults);
    if (!made)
        fail_msg("%s", faults.text[0]);
    assert_int_equal(made->step_count, steps);
    return made;
}

static int set_up(void **state)
{
    assert_int_equal(make_folder(state), 0);
    trainer = trainer_scene_open(true);
    run = record(&trainer, STEPS, true, "session.h5");
    return 0;
}

static int tear_down(void **state)
{
    recorded_run_free(run);
    trainer_scene_close(&trainer);
    return remove_folder(state);
}

// --- moments ---

typedef struct Seen {
    int64_t step, pulses;
    double time_s, pedal_s, injected_ml, inserted_mm;
    XrayControl xray;
    Command command;
    double proximal_force;
    Vec3 tip;
    float *concentration;
} Seen;

static Seen see(const Playback *playback)
{
    const Pose *pose = playback_pose(playback);
    const float *contrast = playback_contrast(playback);
    size_t bytes = (size_t)trainer.open.tree->node_count * sizeof *contrast;
    Seen seen = {.step = pose->step,
                 .pulses = playback_pulses(playback)->count,
                 .time_s = playback_time_s(playback),
                 .pedal_s = playback_pulses(playback)->pedal_s,
                 .injected_ml = playback_injected_ml(playback),
                 .inserted_mm = pose->inserted_mm,
                 .xray = pose->xray,
                 .command = pose->command,
                 .proximal_force = pose->report.proximal_force,
                 .tip = pose->position[pose->node_count - 1],
                 .concentration = contrast ? malloc(bytes) : NULL};
    if (contrast)
        memcpy(seen.concentration, contrast, bytes);
    return seen;
}

static void assert_same_moment(const Seen *a, const Seen *b)
{
    assert_int_equal(a->step, b->step);
    assert_int_equal(a->pulses, b->pulses);
    assert_true(a->time_s == b->time_s && a->pedal_s == b->pedal_s && a->inserted_mm == b->inserted_mm && a->proximal_force == b->proximal_force);
    assert_memory_equal(&a->xray, &b->xray, sizeof a->xray);
    assert_memory_equal(&a->command, &b->command, sizeof a->command);
    assert_memory_equal(&a->tip, &b->tip, sizeof a->tip);
    assert_near(a->injected_ml, b->injected_ml, 1e-9);
    for (int i = 0; i < trainer.open.tree->node_count; i++)
        assert_near((double)a->concentration[i], (double)b->concentration[i], 1e-6);
}

static double step_s(int64_t step) { return run->time_s[step - 1]; }

enum { MOMENTS = 60 };

static void a_moment_is_the_same_whichever_way_it_is_come_to(void **state)
{
    (void)state;
    XrayControl none = {0};
    Playback *playback = playback_open(run, trainer.scene, trainer.open.tree, &none);
    assert_non_null(playback);
    assert_near(playback_end_s(playback), STEPS * 0.001, 1e-9);
    // played step by step, compared with a separate clock
    Seen through[MOMENTS];
    int64_t at[MOMENTS];
    uint64_t seed = 3;
    for (int i = 0; i < MOMENTS; i++)
        at[i] = i * (STEPS / MOMENTS) + 1 + (int64_t)random_in(&seed, 0, STEPS / MOMENTS - 1);
    PulseClock clock = pulse_clock_start(0);
    float strongest = 0;
    for (int64_t step = 1, next = 0; step <= STEPS; step++) {
        pulse_clock_advance(&clock, step_s(step), &run->xray[step - 1]);
        bool jumped = playback_seek(playback, step_s(step));
        assert_false(jumped);
        if (next == MOMENTS || step != at[next])
            continue;
        Seen *seen = &through[next++];
        *seen = see(playback);
        assert_int_equal(seen->step, step);
        assert_int_equal(seen->pulses, clock.count);
        assert_true(seen->pedal_s == clock.pedal_s);
        XrayControl xray = controls_at(step - 1);
        assert_memory_equal(&seen->xray, &xray, sizeof xray);
        assert_true(seen->command.push_mm_s == hand_at(step - 1).push_mm_s && seen->proximal_force == run->proximal[2 * (step - 1)]);
        for (int i = 0; i < trainer.open.tree->node_count; i++)
            strongest = fmaxf(strongest, seen->concentration[i]);
    }
    assert_true(clock.count > 100 && clock.pedal_s > 5 && strongest > 0.2F);   // the run has something to compare
    // forwards, backwards, at random; in a playback that has seen everything, and in new ones
    for (int pass = 0; pass < 4; pass++) {
        if (pass % 2) {
            playback_close(playback);
            playback = playback_open(run, trainer.scene, trainer.open.tree, &none);
        }
        for (int i = 0; i < MOMENTS; i++) {
            int k = pass == 0 ? MOMENTS - 1 - i : pass == 1 ? i : (int)random_in(&seed, 0, MOMENTS);
            playback_seek(playback, step_s(at[k]));
            Seen seen = see(playback);
            assert_same_moment(&seen, &through[k]);
            free(seen.concentration);
        }
    }
    playback_close(playback);
    for (int i = 0; i < MOMENTS; i++)
        free(through[i].concentration);
}

// --- pictures ---

enum { SIDE = 96, PICTURES = WHOLE_OR_SHORT(40, 14), BETWEEN = WHOLE_OR_SHORT(41, 123) };

typedef struct Screen {
    GlContext *context;
    GlCanvas canvas;
    Views *views;
    FluoroscopeState state;
    uint8_t rgb[PICTURES][SIDE * SIDE * 3], one[SIDE * SIDE * 3];
} Screen;

static void make_views(Screen *screen)
{
    OperatorControls controls;
    char note[512];
    views_destroy(screen->views);
    screen->views = scene_views_create(trainer.scene, &trainer.open, &controls, note, sizeof note, &faults);
    assert_non_null(screen->views);
}

static void draw(Screen *screen, Playback *playback, double time_s, uint8_t *rgb)
{
    playback_seek(playback, time_s);
    fluoroscope_recall(views_fluoroscope(screen->views), playback_past(playback), (ViewPort){screen->canvas.framebuffer, 0, 0, SIDE, SIDE}, false);
    screen->state = fluoroscope_state(views_fluoroscope(screen->views));
    gl_canvas_read(&screen->canvas, rgb);
}

static void a_picture_is_the_same_whichever_way_its_moment_is_come_to(void **state)
{
    (void)state;
    char message[256];
    Screen *screen = calloc(1, sizeof *screen);
    screen->context = gl_context_create(message, sizeof message);
    if (!screen->context) {
        print_message("no EGL: %s\n", message);
        free(screen);
        skip();
    }
    assert_true(gl_canvas_create(&screen->canvas, SIDE, SIDE, 1, message, sizeof message));
    make_views(screen);
    XrayControl none = {0};
    Playback *playback = playback_open(run, trainer.scene, trainer.open.tree, &none);
    // played from the beginning, with a frame rate that misses pulses
    int64_t at[PICTURES];
    int held = 0, masked = 0, roadmaps = 0, different = 0;
    for (int i = 0, step = 1; i < PICTURES; i++) {
        at[i] = (i + 1) * (int64_t)(STEPS / PICTURES);
        for (; step < at[i]; step += BETWEEN)
            draw(screen, playback, step_s(step), screen->one);
        draw(screen, playback, step_s(at[i]), screen->rgb[i]);
        held += screen->state.is_held;
        masked += screen->state.has_mask;
        roadmaps += screen->state.has_roadmap;
        different += i > 0 && memcmp(screen->rgb[i], screen->rgb[i - 1], sizeof screen->one) != 0;
    }
    assert_true(held > PICTURES / 8 && masked > PICTURES / 8 && roadmaps > PICTURES / 20 && different > PICTURES / 2);   // there is something to compare
    // backwards, at random, and each in a fluoroscope and a playback that have seen nothing
    uint64_t seed = 5;
    for (int i = 0; i < 3 * PICTURES; i++) {
        int k = i < PICTURES ? PICTURES - 1 - i : i < 2 * PICTURES ? (int)random_in(&seed, 0, PICTURES) : i - 2 * PICTURES;
        if (i >= 2 * PICTURES) {
            make_views(screen);
            playback_close(playback);
            playback = playback_open(run, trainer.scene, trainer.open.tree, &none);
        }
        draw(screen, playback, step_s(at[k]), screen->one);
        if (memcmp(screen->one, screen->rgb[k], sizeof screen->one) != 0)
            fail_msg("the picture at %.3f s is another one (attempt %d)", step_s(at[k]), i);
    }
    playback_close(playback);
    views_destroy(screen->views);
    gl_canvas_destroy(&screen->canvas);
    gl_context_destroy(screen->context);
    free(screen);
}

static void what_was_injected_is_what_the_session_says(void **state)
{
    (void)state;
    XrayControl none = {0};
    Playback *playback = playback_open(run, trainer.scene, trainer.open.tree, &none);
    for (int i = STEPS / EACH_S; i > 0; i -= 7) {
        playback_seek(playback, i * EACH_S * 0.001);
        assert_near(playback_injected_ml(playback), live_injected_ml[i], 1e-9);
        if (live[i].state != SCORE_REACHED)   // one counts steps, the other the intervals between them
            assert_near(playback_pulses(playback)->pedal_s, live[i].fluoroscopy_s, 0.01);
    }
    playback_close(playback);
}

static void times_outside_are_cut_and_jumps_reported(void **state)
{
    (void)state;
    XrayControl none = {0};
    Playback *playback = playback_open(run, trainer.scene, NULL, &none);
    assert_null(playback_contrast(playback));
    assert_int_equal(playback_pose(playback)->step, 1);
    assert_true(playback_seek(playback, 1e300));
    assert_int_equal(playback_pose(playback)->step, STEPS);
    assert_false(playback_seek(playback, 1e9));   // there already
    assert_true(playback_seek(playback, -5));
    assert_int_equal(playback_pose(playback)->step, 1);
    assert_true(playback_seek(playback, HUGE_VAL));
    assert_int_equal(playback_pose(playback)->step, STEPS);
    assert_true(playback_seek(playback, -HUGE_VAL));
    assert_int_equal(playback_pose(playback)->step, 1);
    playback_seek(playback, NAN);
    assert_true(playback_pose(playback)->step >= 1 && playback_pose(playback)->step <= STEPS);
    playback_seek(playback, 0);
    assert_false(playback_seek(playback, 0.9));
    assert_true(playback_seek(playback, 2.5));
    assert_true(playback_seek(playback, 2.499));
    playback_close(playback);
}

static void bookmarks_are_where_they_were_set(void **state)
{
    (void)state;
    RunMarks marks;
    int count = 0;
    double at[8] = {0};
    assert_true(run_marks_make(&marks, run, NULL, 0, 0));
    for (int i = 0; i < marks.count; i++)
        if (marks.mark[i].kind == RUN_MARK_BOOKMARK)
            at[count++ % 8] = marks.mark[i].time_s;
    assert_int_equal(count, 2);
    assert_true(at[0] == run->time_s[1234] && at[1] == run->time_s[7007]);
    assert_int_equal(marks.count, 2 + 4);        // and four injections
    // the moment of a mark is shown in the step at it
    XrayControl none = {0};
    Playback *playback = playback_open(run, trainer.scene, NULL, &none);
    playback_seek(playback, at[0]);
    assert_int_equal(playback_pose(playback)->step, 1235);
    assert_true(playback_time_s(playback) == at[0]);
    playback_close(playback);
    run_marks_free(&marks);
}

static void a_recording_cut_by_a_kill_is_shown_as_far_as_it_goes(void **state)
{
    (void)state;
    XrayControl none = {0};
    int64_t steps = run->step_count, frames = run->frame_count;
    static const int64_t cut[][2] = {{3333, 40}, {3333, 1}, {1, 1}, {57, 2}};
    for (size_t i = 0; i < sizeof cut / sizeof cut[0]; i++) {
        run->step_count = cut[i][0];
        run->frame_count = cut[i][1];
        Playback *playback = playback_open(run, trainer.scene, trainer.open.tree, &none);
        assert_non_null(playback);
        playback_seek(playback, 1e6);
        assert_int_equal(playback_pose(playback)->step, cut[i][0]);
        size_t tip = (size_t)((cut[i][1] - 1) * run->node_count) + (size_t)run->node_count - 1;   // of the last existing frame
        assert_memory_equal(&playback_pose(playback)->position[run->node_count - 1], &run->position[tip], sizeof(Vec3));
        playback_close(playback);
    }
    run->frame_count = 0;
    assert_null(playback_open(run, trainer.scene, trainer.open.tree, &none));
    run->step_count = steps;
    run->frame_count = frames;
}

static void what_nobody_watched_is_shown_with_the_controls_given(void **state)
{
    (void)state;
    TrainerScene tube = trainer_scene_open(false);
    RecordedRun *unseen = record(&tube, 700, false, "unseen.h5");
    XrayControl given = xray_default_control();
    given.pedal = 1;
    given.pulses_s = 10;
    given.lao_deg = 40;
    for (int without = 0; without < 2; without++) {
        Playback *playback = playback_open(unseen, tube.scene, NULL, &given);
        assert_non_null(playback);
        playback_seek(playback, 0.65);
        assert_memory_equal(&playback_pose(playback)->xray, &given, sizeof given);
        assert_int_equal(playback_pulses(playback)->count, 7);   // at 0.001, 0.101 … 0.601 s
        playback_seek(playback, 0.05);
        assert_memory_equal(&playback_pose(playback)->xray, &given, sizeof given);
        assert_int_equal(playback_pulses(playback)->count, 1);
        playback_close(playback);
        free(unseen->xray);   // as from versions without controls
        unseen->xray = NULL;
    }
    recorded_run_free(unseen);
    trainer_scene_close(&tube);
}

// --- the score simulated again ---

static void the_score_is_the_sessions_at_each_tenth_of_a_second(void **state)
{
    (void)state;
    faults_clear(&faults);
    Rescore *rescore = rescore_create(run, trainer.scene, &trainer.open, &faults);
    assert_non_null(rescore);
    assert_same_figures(rescore_at(rescore, 0), &live[0]);
    rescore_advance(rescore, 250, HUGE_VAL);
    assert_same_figures(rescore_at(rescore, 0.25), &live[2]);
    assert_same_figures(rescore_at(rescore, 99), &live[2]);   // up to the time reached
    rescore_advance(rescore, 5000, 0);                        // no time: no step
    assert_same_figures(rescore_at(rescore, 99), &live[2]);
    for (int i = 0; i < 5; i++)
        rescore_advance(rescore, 3000, 0.002);
    rescore_advance(rescore, 1, HUGE_VAL);                    // never back
    rescore_advance(rescore, INT64_MAX, HUGE_VAL);
    assert_int_equal(rescore_first_different(rescore), -1);
    for (int i = STEPS / EACH_S; i >= 0; i--)
        assert_same_figures(rescore_at(rescore, i * EACH_S * 0.001 + (i % 3) * 0.03), &live[i]);
    assert_same_figures(rescore_at(rescore, -1), &live[0]);
    assert_true(live[STEPS / EACH_S].fluoroscopy_s > 1 && live[STEPS / EACH_S].path_mm > 10);
    rescore_free(rescore);
}

static void the_score_stops_where_the_recording_is_not_what_was_simulated(void **state)
{
    (void)state;
    faults_clear(&faults);
    double kept = run->command[2 * 450];
    run->command[2 * 450] += 1;
    Rescore *rescore = rescore_create(run, trainer.scene, &trainer.open, &faults);
    rescore_advance(rescore, 450, HUGE_VAL);
    assert_int_equal(rescore_first_different(rescore), -1);
    rescore_advance(rescore, 2000, HUGE_VAL);
    assert_int_equal(rescore_first_different(rescore), 450);
    assert_same_figures(rescore_at(rescore, 2), &live[4]);
    rescore_advance(rescore, 4000, HUGE_VAL);
    assert_int_equal(rescore_first_different(rescore), 450);
    assert_same_figures(rescore_at(rescore, 4), &live[4]);
    rescore_free(rescore);
    run->command[2 * 450] = kept;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_moment_is_the_same_whichever_way_it_is_come_to),
                                       cmocka_unit_test(a_picture_is_the_same_whichever_way_its_moment_is_come_to),
                                       cmocka_unit_test(what_was_injected_is_what_the_session_says),
                                       cmocka_unit_test(times_outside_are_cut_and_jumps_reported),
                                       cmocka_unit_test(bookmarks_are_where_they_were_set),
                                       cmocka_unit_test(a_recording_cut_by_a_kill_is_shown_as_far_as_it_goes),
                                       cmocka_unit_test(what_nobody_watched_is_shown_with_the_controls_given),
                                       cmocka_unit_test(the_score_is_the_sessions_at_each_tenth_of_a_second),
                                       cmocka_unit_test(the_score_stops_where_the_recording_is_not_what_was_simulated)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

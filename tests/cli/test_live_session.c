// A session recorded, gone on from at a moment of it and recorded again: the common part is the same, bit for bit, and what is not the session's own
// is refused.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "cli/live_session.h"
#include "sim/replay.h"
#include "tests/cli/trainer_scene.h"
#include "tests/geom/near.h"

#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-live-XXXXXX";
#include "tests/cli/folder.h"

static TrainerScene trainer;
static HandPort port;
static HandPort *const hands[] = {&port};

static LiveSessionOptions options_for(const char *path)
{
    return (LiveSessionOptions){.record_path = path, .hand_count = 1, .hand = hands, .xray = xray_default_control()};
}

static void wait_for(LiveSession *session, double time_s)
{
    const Moment *moment;
    while (!(moment = realtime_moment(session->realtime)) || moment->pose->time_s < time_s)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
}

static LiveSession open_session(const LiveSessionOptions *options)
{
    LiveSession session;
    if (!live_session_open(&session, trainer.scene, &trainer.open, options, &faults))
        fail_msg("%s", faults.text[0]);
    return session;
}

static ScoreFigures stop(LiveSession *session)
{
    RealtimeFigures figures;
    if (!live_session_stop(session, &figures, &faults))
        fail_msg("%s", faults.text[0]);
    ScoreFigures score = score_figures(lesson_score(session->lesson));
    live_session_free(session);
    return score;
}

static RecordedRun *load(const char *name)
{
    faults_clear(&faults);
    RecordedRun *run = recorded_run_load(in_folder(name), &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    return run;
}

static bool score_again(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    lesson_step(context, simulator, commands, xray);
    return true;
}

// Simulated again, the recording gives its states and the session's score.
static void assert_replays(const RecordedRun *run, const ScoreFigures *score)
{
    Simulator *simulator = simulator_create(trainer.scene, trainer.open.vessel, &faults);
    Lesson *lesson = lesson_create(simulator, trainer.open.tree);
    ReplayVerdict verdict = replay_verify(simulator, run, -1, false, score_again, lesson);
    assert_int_equal(verdict.first_different, -1);
    assert_int_equal(verdict.steps, run->step_count);
    ScoreFigures again = score_figures(lesson_score(lesson));
    assert_same_figures(&again, score);
    lesson_free(lesson);
    simulator_destroy(simulator);
}

static int set_up(void **state)
{
    (void)state;
    assert_non_null(mkdtemp(folder));
    trainer = trainer_scene_open(true);
    return 0;
}

static int tear_down(void **state)
{
    trainer_scene_close(&trainer);
    return remove_folder(state);
}

static void let_go(void)
{
    atomic_store(&port.push_mm_s, 0);
    atomic_store(&port.twist_deg_s, 0);
}

static void a_session_goes_on_from_a_moment_of_it(void **state)
{
    (void)state;
    char path[200], again[200];
    snprintf(path, sizeof path, "%s", in_folder("first.h5"));
    snprintf(again, sizeof again, "%s", in_folder("second.h5"));
    LiveSessionOptions options = options_for(path);
    atomic_store(&port.push_mm_s, 20);
    LiveSession session = open_session(&options);
    assert_string_equal(session.record_path, path);
    wait_for(&session, 0.15);
    XrayControl xray = xray_default_control();
    xray.pedal = 1;
    xray.contrast_ml_s = 3;
    realtime_set_xray(session.realtime, &xray);
    atomic_store(&port.twist_deg_s, 90);
    atomic_store(&port.advanced_mm, 2.5);
    wait_for(&session, 0.45);
    let_go();
    ScoreFigures score = stop(&session);
    assert_true(score.fluoroscopy_s > 0.1 && score.contrast_ml > 0.3 && score.inserted_mm > 8);
    RecordedRun *first = load("first.h5");
    assert_replays(first, &score);

    // from 0.3 s on another hand, with the X-ray off
    options = options_for(again);
    options.resume = first;
    options.resume_s = 0.3;
    options.paused = true;
    atomic_store(&port.push_mm_s, -15);
    session = open_session(&options);
    assert_near(session.resumed_s, 0.3, 1e-9);
    const Moment *moment;
    while (!(moment = realtime_moment(session.realtime)) || moment->figures.state != REALTIME_PAUSED)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    assert_int_equal(moment->pose->step, 300);
    realtime_pause(session.realtime, false);
    wait_for(&session, 0.5);
    let_go();
    score = stop(&session);
    assert_true(score.withdrawn_mm > 1 && score.contrast_ml > 0.1);
    RecordedRun *second = load("second.h5");
    assert_true(second->step_count >= 500);
    assert_memory_equal(first->state_hash, second->state_hash, 300 * sizeof *first->state_hash);
    assert_memory_equal(first->command, second->command, 600 * sizeof *first->command);
    assert_memory_equal(first->xray, second->xray, 300 * sizeof *first->xray);
    assert_true(second->command[2 * 300] == -15 && second->xray[300].pedal == 0 && first->xray[299].pedal == 1);
    assert_true(first->state_hash[310] != second->state_hash[310]);
    assert_replays(second, &score);

    // beyond its end, and from before its beginning
    options = options_for(NULL);
    options.resume = first;
    options.resume_s = 1e9;
    options.paused = true;
    session = open_session(&options);
    assert_near(session.resumed_s, first->time_s[first->step_count - 1], 1e-9);
    assert_true(simulator_hash(session.simulator) == first->state_hash[first->step_count - 1]);
    stop(&session);
    options.resume_s = 0;
    session = open_session(&options);
    assert_near(session.resumed_s, 0, 0);
    stop(&session);
    recorded_run_free(first);
    recorded_run_free(second);
}

// Nothing is left open: what is left would be a leak, or a thread that steps.
static void assert_refused(const LiveSessionOptions *options, const char *reason)
{
    LiveSession session;
    memset(&session, 7, sizeof session);
    faults_clear(&faults);
    assert_false(live_session_open(&session, trainer.scene, &trainer.open, options, &faults));
    assert_int_equal(faults.count, 1);
    if (!strstr(faults.text[0], reason))
        fail_msg("said: %s", faults.text[0]);
    assert_true(!session.simulator && !session.lesson && !session.recording && !session.realtime);
}

static void what_is_not_the_recording_of_a_session_is_refused(void **state)
{
    (void)state;
    char path[200];
    snprintf(path, sizeof path, "%s", in_folder("tampered.h5"));
    RecordedRun *run = load("first.h5");
    LiveSessionOptions options = options_for(path);
    options.resume = run;
    options.resume_s = 0.3;
    run->command[2 * 100] += 1;
    assert_refused(&options, "step 100 gives another state");
    assert_int_equal(access(path, F_OK), -1);   // no recording of a session that never was
    options.record_path = NULL;
    assert_refused(&options, "step 100 gives another state");
    options.resume_s = 0.1;                     // up to there it is the recording's
    LiveSession session = open_session(&options);
    assert_near(session.resumed_s, 0.1, 1e-9);
    stop(&session);
    run->command[2 * 100] -= 1;
    run->state_hash[299] ^= 1;
    options.resume_s = 0.3;
    assert_refused(&options, "step 299 gives another state");
    recorded_run_free(run);
}

static void a_place_where_nothing_can_be_written_is_told(void **state)
{
    (void)state;
    char path[250];
    snprintf(path, sizeof path, "%s/nowhere/session.h5", folder);
    LiveSessionOptions options = options_for(path);
    assert_refused(&options, "nowhere/session.h5");
    // more hands than a session takes
    HandPort *many[HANDS_SAMPLED + 1];
    for (int i = 0; i <= HANDS_SAMPLED; i++)
        many[i] = &port;
    snprintf(path, sizeof path, "%s", in_folder("many.h5"));
    options.record_path = path;
    options.hand = many;
    options.hand_count = HANDS_SAMPLED + 1;
    assert_refused(&options, "session");
    assert_int_equal(access(path, F_OK), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_session_goes_on_from_a_moment_of_it),
                                       cmocka_unit_test(what_is_not_the_recording_of_a_session_is_refused),
                                       cmocka_unit_test(a_place_where_nothing_can_be_written_is_told)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

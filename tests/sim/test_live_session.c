// A session is recorded, continued from a moment and recorded again: the common part is bit-identical, and recordings of other sessions are refused.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/live_session.h"
#include "sim/replay.h"
#include "tests/geom/near.h"
#include "tests/sim/trainer_scene.h"

#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-live-XXXXXX";
#include "tests/folder.h"

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

static const Moment *wait_for_pause(Realtime *realtime)
{
    const Moment *moment;
    while (!(moment = realtime_moment(realtime)) || moment->figures.state != REALTIME_PAUSED)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    return moment;
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
    ScoreFigures score = score_figures(session_tracker_score(session->tracker));
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
    session_tracker_step(context, simulator, commands, xray);
    return true;
}

// Simulating the recording again gives its states and the session's score.
static void assert_replays(const RecordedRun *run, const ScoreFigures *score)
{
    Simulator *simulator = simulator_create(trainer.scene, trainer.open.vessel, &faults);
    SessionTracker *tracker = session_tracker_create(simulator, trainer.open.tree);
    ReplayVerdict verdict = replay_verify(simulator, run, -1, false, score_again, tracker);
    assert_int_equal(verdict.first_different, -1);
    assert_int_equal(verdict.steps, run->step_count);
    ScoreFigures again = score_figures(session_tracker_score(tracker));
    assert_same_figures(&again, score);
    session_tracker_free(tracker);
    simulator_destroy(simulator);
}

static int set_up(void **state)
{
    assert_int_equal(make_folder(state), 0);
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

// What is injected at a steady flow has reached the vessel, except that of the last few steps, and is seen there.
static void agent_reaches_the_vessel(void **state)
{
    (void)state;
    enum { STEPS = 405 };
    static const ToolCommands still = {0};
    Simulator *simulator = simulator_create(trainer.scene, trainer.open.vessel, &faults);
    SessionTracker *tracker = session_tracker_create(simulator, trainer.open.tree);
    TrackerView *view = malloc(session_tracker_view_bytes(tracker));
    assert_non_null(view);
    XrayControl xray = xray_default_control();
    xray.contrast_ml_s = 4;
    for (int i = 0; i < STEPS; i++) {
        simulator_step_one_tool(simulator, still.tool[0]);
        session_tracker_step(tracker, simulator, &still, &xray);
    }
    session_tracker_publish(tracker, view);
    double injected = 4 * STEPS * simulator_scene(simulator)->dt / 1000, each = 4 * simulator_scene(simulator)->dt / 1000;
    float most = 0;
    for (int i = 0; i < view->node_count; i++)
        most = fmaxf(most, view->concentration[i]);
    assert_near(view->flow_ml_s, 4, 1e-9);
    assert_true(view->injected_ml <= injected + 1e-9 && view->injected_ml > injected - 10 * each);
    assert_true(most > 0.1f && most <= 1);
    free(view);
    session_tracker_free(tracker);
    simulator_destroy(simulator);
}

static int progress_calls;

static void take_note(void *context, double part)
{
    double *before = context;
    assert_true(part > *before && part <= 1);
    *before = part;
    progress_calls++;
}

static void a_session_continues_from_a_moment_of_it(void **state)
{
    (void)state;
    char path[200], again[200];
    snprintf(path, sizeof path, "%s", in_folder("first.h5"));
    snprintf(again, sizeof again, "%s", in_folder("second.h5"));
    LiveSessionOptions options = options_for(path);
    options.trainee = "Ada", options.date = "2026-01-02T03:04:05Z";
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
    assert_string_equal(first->trainee, "Ada");
    assert_string_equal(first->date, "2026-01-02T03:04:05Z");
    assert_replays(first, &score);

    // from 0.3 s on with another hand, X-rays off
    options = options_for(again);
    options.resume = first;
    options.resume_s = 0.3;
    options.paused = true;
    double part = 0;
    options.progress = take_note;
    options.progress_context = &part;
    atomic_store(&port.push_mm_s, -15);
    session = open_session(&options);
    assert_true(progress_calls == 300 / 64 && part > 0.8);
    assert_near(session.resumed_s, 0.3, 1e-9);
    assert_int_equal(wait_for_pause(session.realtime)->pose->step, 300);
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

// Everything is closed: otherwise there is a leak, or a thread that still steps.
static void assert_refused(const LiveSessionOptions *options, const char *reason)
{
    LiveSession session;
    memset(&session, 7, sizeof session);
    faults_clear(&faults);
    assert_false(live_session_open(&session, trainer.scene, &trainer.open, options, &faults));
    assert_int_equal(faults.count, 1);
    if (!strstr(faults.text[0], reason))
        fail_msg("said: %s", faults.text[0]);
    assert_true(!session.simulator && !session.tracker && !session.recording && !session.realtime);
}

static const char coaxial_text[] =
    "seldinger: 1\n"
    "tools:\n"
    "  - {name: tube, kind: microcatheter, elements: 14, sections: [{length_mm: 60, diameter_mm: 0.8, inner_diameter_mm: 0.5, young_modulus_gpa: 1}]}\n"
    "  - {name: thread, kind: wire, elements: 16, sections: [{length_mm: 90, diameter_mm: 0.36, young_modulus_gpa: 20}],\n"
    "     exchange: [{elements: 24, sections: [{length_mm: 100, diameter_mm: 0.4, young_modulus_gpa: 80}]}]}\n"
    "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], radius_mm: 1.5, path: [{line_mm: 3}, {arc: {radius_mm: 20, angle_deg: 50}}, {line_mm: 30}]}, "
    "contact: tube, friction: 0.05}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 4}\n";

static bool goes_alike(const RecordedRun *run, int64_t step)
{
    const double *outer = run->tool[0].command + 2 * step, *inner = run->tool[1].command + 2 * step;
    return outer[0] == inner[0] && outer[1] == inner[1];
}

static void open_coaxial(void)
{
    faults_clear(&faults);
    trainer = (TrainerScene){.scene = scene_parse(coaxial_text, strlen(coaxial_text), "coaxial.yaml", &faults)};
    if (!trainer.scene)
        fail_msg("%s", faults.text[0]);
    trainer.open.vessel = tube_vessel_create(&trainer.scene->tube, "coaxial.yaml", &faults);
    assert_non_null(trainer.open.vessel);
}

// Two hands push two tools, lock them and release one. Simulating the recorded session again gives its states, and another session continues from it.
static void two_tools_are_moved_locked_let_go_and_replayed(void **state)
{
    (void)state;
    TrainerScene former = trainer;
    open_coaxial();
    static HandPort pair[2];
    static HandPort *const both[] = {&pair[0], &pair[1]};
    atomic_store(&pair[0].drives, DRIVES_OUTER);
    atomic_store(&pair[1].drives, DRIVES_TOOL + 1);
    char path[200];
    snprintf(path, sizeof path, "%s", in_folder("coaxial.h5"));
    LiveSessionOptions options = {.record_path = path, .hand_count = 2, .hand = both, .xray = xray_default_control()};
    LiveSession session = open_session(&options);
    HandGrip grip = {0};
    atomic_store(&pair[0].push_mm_s, 5);
    atomic_store(&pair[1].push_mm_s, 30);
    atomic_store(&pair[1].twist_deg_s, 90);
    wait_for(&session, 0.3);
    hand_grip_lock(&grip, 2);
    realtime_set_grip(session.realtime, &grip);
    wait_for(&session, 0.4);
    // both tools touch the bend; the force at a hand is the sum for both locked tools
    realtime_pause(session.realtime, true);
    const StepReport report = wait_for_pause(session.realtime)->pose->report;
    assert_true(report.push[0] > 1e-6 && report.push[1] > 1e-6);
    assert_near(atomic_load(&pair[0].force_n), report.push[0] + report.push[1], 1e-15);
    realtime_pause(session.realtime, false);
    wait_for(&session, 0.5);
    hand_grip_lock(&grip, 2);
    grip.chosen = 1;
    hand_grip_release(&grip);
    realtime_set_grip(session.realtime, &grip);
    atomic_store(&pair[1].twist_deg_s, 0);
    wait_for(&session, 0.8);
    atomic_store(&pair[0].buttons, HAND_STOP);
    wait_for(&session, 0.9);
    ScoreFigures score = stop(&session);
    RecordedRun *run = load("coaxial.h5");
    assert_int_equal(run->tool_count, 2);
    assert_replays(run, &score);

    assert_true(run->tool[0].command[2 * 100] == 5 && run->tool[1].command[2 * 100] == 30 && run->tool[1].command[2 * 100 + 1] == 90);
    assert_true(goes_alike(run, 450));
    assert_near(run->tool[0].command[2 * 450], 35, 1e-9);
    assert_near(run->tool[0].command[2 * 450 + 1], 90, 1e-9);
    assert_true(run->tool[1].released[700] == 1 && run->tool[1].command[2 * 700] == 0 && run->tool[0].released[700] == 0);
    assert_true(run->tool[0].command[2 * 700] == 5 && run->tool[1].proximal[2 * 700] == 0);
    assert_true(run->tool[0].command[2 * 880] == 0 && run->tool[1].released[880] == 1);
    assert_true(run->tool[0].inserted[700] > 4 + 0.3 * 5 + 0.2 * 35 && run->tool[1].inserted[499] > 4 + 0.3 * 30 + 0.1 * 35);

    // from 0.7 s on: the released tool stays released until it is held again
    char again[200];
    snprintf(again, sizeof again, "%s", in_folder("coaxial-again.h5"));
    options.record_path = again;
    options.resume = run;
    options.resume_s = 0.7;
    atomic_store(&pair[0].buttons, 0);
    session = open_session(&options);
    assert_int_equal(session.resumed_released, 2);
    wait_for(&session, 0.8);
    grip = (HandGrip){0};
    realtime_set_grip(session.realtime, &grip);
    wait_for(&session, 0.95);
    score = stop(&session);
    RecordedRun *second = load("coaxial-again.h5");
    assert_memory_equal(run->state_hash, second->state_hash, 700 * sizeof *run->state_hash);
    assert_true(second->tool[1].released[750] == 1 && second->tool[1].released[940] == 0 && second->tool[1].command[2 * 940] == 30);
    assert_replays(second, &score);
    recorded_run_free(run);
    recorded_run_free(second);
    trainer_scene_close(&trainer);
    trainer = former;
}

// The operator requests another wire, first too early. Simulating the recorded session again gives its states, and another session continues from it.
static void a_tool_is_exchanged_and_replayed(void **state)
{
    (void)state;
    TrainerScene former = trainer;
    open_coaxial();
    static HandPort hand;
    static HandPort *const one[] = {&hand};
    atomic_store(&hand.drives, DRIVES_TOOL + 1);
    char path[200];
    snprintf(path, sizeof path, "%s", in_folder("exchanged.h5"));
    LiveSessionOptions options = {.record_path = path, .hand_count = 1, .hand = one, .xray = xray_default_control()};
    LiveSession session = open_session(&options);
    HandGrip grip = {0};
    atomic_store(&hand.push_mm_s, -200);
    hand_grip_fit(&grip, 2, 1, 1);
    realtime_set_grip(session.realtime, &grip);
    wait_for(&session, 0.1);
    const Pose *pose = realtime_moment(session.realtime)->pose;
    assert_true(pose->refused_exchanges == 1 && pose->refusal == EXCHANGE_INSERTED && pose->tool[1].fitted == 0 && pose->tool[1].node_count == 17);
    hand_grip_fit(&grip, 2, 1, pose->tool[1].fitted);
    realtime_set_grip(session.realtime, &grip);
    wait_for(&session, 0.4);
    hand_grip_fit(&grip, 2, 1, 1);
    realtime_set_grip(session.realtime, &grip);
    atomic_store(&hand.push_mm_s, 100);
    wait_for(&session, 0.6);
    pose = realtime_moment(session.realtime)->pose;
    assert_true(pose->refused_exchanges == 1 && pose->tool[1].fitted == 1 && pose->tool[1].node_count == 25 && pose->tool[1].node[24].s == 100);
    wait_for(&session, 0.8);
    ScoreFigures score = stop(&session);
    RecordedRun *run = load("exchanged.h5");
    assert_true(recorded_run_fitted(run, 1, 90) == 0 && recorded_run_commands(run, 90).fitted[1] == 1 && recorded_run_fitted(run, 1, 700) == 1);
    assert_replays(run, &score);

    // from 0.6 s on the new wire is still in, and continues
    char again[200];
    snprintf(again, sizeof again, "%s", in_folder("exchanged-again.h5"));
    options.record_path = again;
    options.resume = run;
    options.resume_s = 0.6;
    session = open_session(&options);
    assert_int_equal(session.resumed_fitted[1], 1);
    wait_for(&session, 0.75);
    score = stop(&session);
    RecordedRun *second = load("exchanged-again.h5");
    assert_memory_equal(run->state_hash, second->state_hash, 600 * sizeof *run->state_hash);
    assert_true(recorded_run_fitted(second, 1, 740) == 1 && second->tool[1].inserted[740] > second->tool[1].inserted[600]);
    assert_replays(second, &score);
    recorded_run_free(run);
    recorded_run_free(second);
    trainer_scene_close(&trainer);
    trainer = former;
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
    assert_int_equal(access(path, F_OK), -1);   // no recording of a session that did not start
    options.record_path = NULL;
    assert_refused(&options, "step 100 gives another state");
    options.resume_s = 0.1;                     // up to this time the states are those of the recording
    LiveSession session = open_session(&options);
    assert_near(session.resumed_s, 0.1, 1e-9);
    stop(&session);
    run->command[2 * 100] -= 1;
    run->state_hash[299] ^= 1;
    options.resume_s = 0.3;
    assert_refused(&options, "step 299 gives another state");
    recorded_run_free(run);
}

static void a_place_where_nothing_can_be_written_is_reported(void **state)
{
    (void)state;
    char path[250];
    snprintf(path, sizeof path, "%s/nowhere/session.h5", folder);
    LiveSessionOptions options = options_for(path);
    assert_refused(&options, "nowhere/session.h5");
    // more hands than a session accepts
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(agent_reaches_the_vessel),
                                       cmocka_unit_test(a_session_continues_from_a_moment_of_it),
                                       cmocka_unit_test(two_tools_are_moved_locked_let_go_and_replayed),
                                       cmocka_unit_test(a_tool_is_exchanged_and_replayed),
                                       cmocka_unit_test(what_is_not_the_recording_of_a_session_is_refused),
                                       cmocka_unit_test(a_place_where_nothing_can_be_written_is_reported)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

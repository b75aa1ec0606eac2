// The 1 kHz thread and replay: output of the thread is complete and in order, a pause is not a missed deadline, and a session simulated again from its
// recording gives the same state at each step.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/replay.h"
#include "sim/sim.h"
#include "sim/triple_buffer.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const char text[] = "seldinger: 1\n"
                           "wire: {elements: 20, sections: [{length_mm: 80, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
                           "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], radius_mm: 1, path: [{line_mm: 10}, {arc: {radius_mm: 20, "
                           "angle_deg: 60}}, {line_mm: 40}]}, contact: tube, friction: 0.05}\n"
                           "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n";

static Faults faults;

typedef struct Rig {
    Scene *scene;
    Vessel *vessel;
    Simulator *simulator;
} Rig;

static Rig rig_open(void)
{
    Rig rig;
    faults_clear(&faults);
    rig.scene = scene_parse(text, strlen(text), "t.yaml", &faults);
    assert_non_null(rig.scene);
    rig.vessel = tube_vessel_create(&rig.scene->tube, "t.yaml", &faults);
    rig.simulator = simulator_create(rig.scene, rig.vessel, &faults);
    assert_non_null(rig.simulator);
    return rig;
}

static void rig_close(Rig *rig)
{
    simulator_destroy(rig->simulator);
    rig->vessel->destroy(rig->vessel);
    scene_free(rig->scene);
}

static void nap_ms(long ms) { nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL); }

// --- the triple buffer ---

typedef struct Relay {
    TripleBuffer buffer;
    int64_t slot[3][64];
    _Atomic int done;
} Relay;

enum { RELAYED = 200000 };

static void *relay_writer(void *argument)
{
    Relay *relay = argument;
    for (int64_t i = 1; i <= RELAYED; i++) {
        for (int k = 0; k < 64; k++)
            relay->slot[relay->buffer.writing][k] = i;
        triple_buffer_publish(&relay->buffer);
    }
    atomic_store(&relay->done, 1);
    return NULL;
}

static void what_is_fetched_is_whole_and_never_older(void **state)
{
    (void)state;
    static Relay relay;
    pthread_t writer;
    int64_t last = 0, fetched = 0;
    triple_buffer_init(&relay.buffer);
    assert_false(triple_buffer_fetch(&relay.buffer));
    pthread_create(&writer, NULL, relay_writer, &relay);
    for (bool ended = false; last < RELAYED;) {
        ended = atomic_load(&relay.done);
        if (!triple_buffer_fetch(&relay.buffer)) {
            assert_false(ended);   // the last one must arrive
            continue;
        }
        const int64_t *slot = relay.slot[relay.buffer.reading];
        fetched++;
        assert_true(slot[0] > last);
        for (int k = 1; k < 64; k++)
            assert_true(slot[k] == slot[0]);
        last = slot[0];
    }
    pthread_join(writer, NULL);
    assert_true(fetched > 0);
}

// --- a session ---

typedef struct Extra {
    int64_t steps;
} Extra;

static void count_step(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    (void)simulator;
    (void)commands;
    (void)xray;
    ((Extra *)context)->steps++;
}

static void give_extra(void *context, void *extra) { *(Extra *)extra = *(const Extra *)context; }

static void wait_for_time(Realtime *session, double time_s)
{
    const Moment *moment;
    while (!(moment = realtime_moment(session)) || moment->pose->time_s < time_s)
        nap_ms(1);
}

static void a_session_replays_bit_for_bit(void **state)
{
    (void)state;
    char path[] = "/tmp/seldinger-session-XXXXXX";
    assert_true(close(mkstemp(path)) == 0);
    Rig rig = rig_open();
    RecordingOptions record = recording_default_options();
    Recording *recording = recording_create(path, rig.simulator, &record, &faults);
    assert_non_null(recording);
    Extra counted = {0};
    RealtimeOptions options = realtime_default_options();
    static HandPort hands[2];
    HandPort *key = &hands[0], *encoder = &hands[1], *const both[] = {key, encoder};
    options.hand_count = 2;
    options.hand = both;
    options.simulator = rig.simulator;
    options.recording = recording;
    options.after_step = count_step;
    options.publish = give_extra;
    options.context = &counted;
    options.extra_bytes = sizeof counted;
    Realtime *session = realtime_start(&options, &faults);
    assert_non_null(session);
    XrayControl xray = xray_default_control();
    key->push_mm_s = 30;
    wait_for_time(session, 0.15);
    xray.pedal = 1;
    xray.lao_deg = 30;
    realtime_set_xray(session, &xray);
    key->twist_deg_s = 180;
    encoder->advanced_mm = 4;
    wait_for_time(session, 0.3);
    key->push_mm_s = 0;
    wait_for_time(session, 0.35);
    const Moment *moment = realtime_moment(session);
    assert_true(moment->pose->xray.lao_deg == 30 && moment->pose->xray.pedal == 1);
    assert_true(((const Extra *)moment->extra)->steps == moment->pose->step);
    assert_true(atomic_load(&key->step) >= moment->pose->step);
    assert_true(fabs(atomic_load(&key->force_n)) > 0);

    // a pause: time stops, and no deadline is missed
    realtime_pause(session, true);
    while (realtime_moment(session)->figures.state != REALTIME_PAUSED)
        nap_ms(1);
    double stood = realtime_moment(session)->pose->time_s;
    double slowed = realtime_moment(session)->figures.slowed_s;
    nap_ms(120);
    assert_true(realtime_moment(session)->pose->time_s == stood);
    realtime_pause(session, false);
    wait_for_time(session, stood + 0.05);
    RealtimeFigures figures = realtime_stop(session);
    print_message("late by %.0f us at the median, %.0f p99, %.0f at worst; %lld misses; SCHED_FIFO %s\n", figures.late_us[0], figures.late_us[1],
                  figures.late_us[2], (long long)figures.deadline_misses, figures.real_time_priority ? "yes" : "not permitted");
    assert_true(figures.deadline_misses > 0 || figures.slowed_s == slowed);
    // some 400 steps: half of them take less time than the longest (values are told apart if they differ by 1 %)
    assert_true(figures.step_us[0] > 0 && figures.step_us[0] < 0.99 * figures.step_us[2] && figures.step_us[0] <= figures.step_us[1]);
    assert_true(figures.late_us[0] <= figures.late_us[1]);
    uint64_t hash = simulator_hash(rig.simulator);
    double inserted = simulator_state(rig.simulator)->inserted;
    assert_true(inserted > 5 + 4 + 30 * 0.28 && inserted < 5 + 4 + 30 * 0.6);
    assert_true(recording_close(recording, rig.simulator, &faults));
    rig_close(&rig);

    RecordedRun *run = recorded_run_load(path, &faults);
    assert_non_null(run);
    assert_true(run->xray[run->step_count - 1].lao_deg == 30 && run->xray[0].pedal == 0);
    Scene *scene = replay_scene(run, path, &faults);
    assert_non_null(scene);
    rig = rig_open();
    ReplayVerdict verdict = replay_verify(rig.simulator, run, -1, false, NULL, NULL);
    assert_true(verdict.first_different == -1 && verdict.steps == run->step_count && verdict.simulated == hash);
    // also from its own scene as a script; its pose equals the state
    size_t length;
    char *script = replay_script(run, &length);
    Script *parsed = script_parse(script, length, "hand.csv", NULL, &faults);
    assert_non_null(parsed);
    Simulator *scripted = simulator_create(scene, rig.vessel, &faults);
    DriveOptions drive = drive_default_options();
    drive.script = parsed;
    simulator_drive(scripted, &drive);
    assert_true(simulator_hash(scripted) == hash);
    Pose *pose = pose_create(run->node_count, 1, &run->node_count);
    pose_from_run(pose, scene, run, run->frame_count - 1);
    const WireState *last = simulator_state(scripted);
    assert_memory_equal(pose->position, last->position, sizeof(Vec3) * (size_t)run->node_count);
    assert_true(pose->inserted_mm == last->inserted && pose->step == run->step_count);
    // a changed command is found at its step
    run->command[2 * 40] += 1;
    rig_close(&rig);
    rig = rig_open();
    verdict = replay_verify(rig.simulator, run, -1, false, NULL, NULL);
    assert_int_equal(verdict.first_different, 40);
    pose_free(pose);
    script_free(parsed);
    free(script);
    simulator_destroy(scripted);
    scene_free(scene);
    recorded_run_free(run);
    rig_close(&rig);
    unlink(path);
}

// Steps before the start of the thread are not counted as real time.
static void a_factor_is_not_known_before_a_second(void **state)
{
    (void)state;
    Rig rig = rig_open();
    for (int i = 0; i < 100; i++)
        simulator_step_one_tool(rig.simulator, (Command){0});
    RealtimeOptions options = realtime_default_options();
    options.simulator = rig.simulator;
    Realtime *session = realtime_start(&options, &faults);
    assert_non_null(session);
    wait_for_time(session, 0.3);
    assert_true(realtime_moment(session)->figures.real_time_factor == 0);
    realtime_stop(session);
    rig_close(&rig);
}

// The command of the newest pose.
static double pushed_mm_s(Realtime *session)
{
    const Moment *moment = realtime_moment(session);
    return moment->pose->command.push_mm_s;
}

static void a_silent_window_lets_go(void **state)
{
    (void)state;
    Rig rig = rig_open();
    RealtimeOptions options = realtime_default_options();
    HandPort key = {0}, *const one[] = {&key};
    options.hand_count = 1;
    options.hand = one;
    options.simulator = rig.simulator;
    options.patience_s = 0.15;
    Realtime *session = realtime_start(&options, &faults);
    assert_non_null(session);
    XrayControl xray = xray_default_control();
    xray.pedal = 1;
    key.push_mm_s = 5;
    for (int i = 0; i < 10; i++) {       // a window that answers
        realtime_set_xray(session, &xray);
        nap_ms(30);
    }
    assert_true(pushed_mm_s(session) == 5);
    assert_true(realtime_moment(session)->pose->xray.pedal == 1);
    nap_ms(400);
    assert_true(pushed_mm_s(session) == 0);
    assert_true(realtime_moment(session)->pose->xray.pedal == 0);
    realtime_set_xray(session, &xray);
    nap_ms(60);
    assert_true(pushed_mm_s(session) == 5);
    assert_true(realtime_moment(session)->pose->xray.pedal == 1);
    realtime_stop(session);
    rig_close(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_fetched_is_whole_and_never_older), cmocka_unit_test(a_session_replays_bit_for_bit),
                                       cmocka_unit_test(a_factor_is_not_known_before_a_second), cmocka_unit_test(a_silent_window_lets_go)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// Pacing: under overload simulated time falls behind by the lost time, and later steps do not catch up.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/drive.h"

#include <string.h>
#include <time.h>

static const char text[] = "seldinger: 1\n"
                           "wire: {elements: 10, sections: [{length_mm: 50, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                           "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 10}\n"
                           "script: [{t_s: 0, push_mm_s: 10, twist_deg_s: 0}, {t_s: 0.3, push_mm_s: 0, twist_deg_s: 0}]\n";

enum { STEPS = 300, STALL_AT = 100, STALL_MS = 50, RESTED = 800, PUSH_AT = 300, PUSHED = 40, SURE = 100 /* at rest */ };

typedef struct Clock {
    int steps;
    bool stalls;
    double end_s[STEPS];     // real time at the end of each step
} Clock;

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static bool note_time(void *context, Simulator *simulator, const ToolCommands *commands)
{
    (void)simulator;
    (void)commands;
    Clock *clock = context;
    if (clock->stalls && clock->steps == STALL_AT)
        nanosleep(&(struct timespec){.tv_nsec = STALL_MS * 1000000}, NULL);
    clock->end_s[clock->steps++] = now_s();
    return clock->steps < STEPS;
}

static DriveReport drive(Clock *clock, bool paced, uint64_t *hash)
{
    Faults faults = {0};
    Scene *scene = scene_parse(text, strlen(text), "test", &faults);
    assert_non_null(scene);
    Simulator *simulator = simulator_create(scene, NULL, &faults);
    assert_non_null(simulator);
    DriveOptions options = drive_default_options();
    options.script = scene->script;
    options.paced = paced;
    options.after_step = note_time;
    options.context = clock;
    DriveReport report = simulator_drive(simulator, &options);
    assert_int_equal(clock->steps, STEPS);
    *hash = simulator_hash(simulator);
    simulator_destroy(simulator);
    scene_free(scene);
    return report;
}

// The lost time is exactly the lead of real time, whatever other load the machine has.
static void a_stall_slows_simulated_time(void **state)
{
    (void)state;
    static Clock calm, stalled;
    uint64_t free_hash, calm_hash, stalled_hash;
    stalled.stalls = true;
    Clock unpaced = {0};
    drive(&unpaced, false, &free_hash);
    DriveReport quiet = drive(&calm, true, &calm_hash), late = drive(&stalled, true, &stalled_hash);
    print_message("calm: %lld misses, slowed %.4f s; stalled: %lld misses, slowed %.4f s, worst %.4f s; SCHED_FIFO %s\n", (long long)quiet.deadline_misses,
                  quiet.slowed_s, (long long)late.deadline_misses, late.slowed_s, late.latest_s, late.real_time_priority ? "yes" : "not permitted");
    assert_true(late.deadline_misses >= 1);
    assert_true(late.slowed_s >= (STALL_MS - 1) * 1e-3);
    assert_true(late.latest_s >= (STALL_MS - 1) * 1e-3 && late.latest_s <= late.slowed_s + 1e-12);
    // the last step ends within its millisecond, or late, and then it is counted
    const DriveReport *both[] = {&quiet, &late};
    for (int i = 0; i < 2; i++) {
        assert_true(both[i]->wall_s - both[i]->slowed_s <= STEPS * 1e-3 + 1e-4);
        assert_true(both[i]->wall_s - both[i]->slowed_s >= (STEPS - 1) * 1e-3);
    }
    assert_true(quiet.deadline_misses > 0 || quiet.slowed_s == 0);
    assert_true(free_hash == calm_hash && calm_hash == stalled_hash);   // pacing does not change the results
}

// A run that catches up would make the 50 steps after the stall in a few milliseconds.
static void nothing_is_hurried_after_a_stall(void **state)
{
    (void)state;
    static Clock clock = {.stalls = true};
    uint64_t hash;
    drive(&clock, true, &hash);
    for (int i = STALL_AT + 1; i + 20 < STEPS; i++)
        assert_true(clock.end_s[i + 20] - clock.end_s[i] > 19e-3 - 1e-3);   // 20 deadlines between; the first step may have ended late in its millisecond
}

// --- rest ---

typedef struct Rest {
    bool may_rest;
    int step;                        // of the simulation
    TimeHistogram late;
} Rest;

// A push of 40 steps in the middle of a rest.
static ToolCommands push_briefly(void *context)
{
    Rest *rest = context;
    ToolCommands commands = {0};
    commands.tool[0].push_mm_s = rest->step >= PUSH_AT && rest->step < PUSH_AT + PUSHED ? 5 : 0;
    rest->step++;
    return commands;
}

static bool says(const void *context) { return ((const Rest *)context)->may_rest; }

static DriveReport drive_at_rest(Rest *rest, bool paced, uint64_t *hash)
{
    Faults faults = {0};
    Scene *scene = scene_parse(text, strlen(text), "test", &faults);
    Simulator *simulator = simulator_create(scene, NULL, &faults);
    assert_non_null(simulator);
    DriveOptions options = drive_default_options();
    options.hand = push_briefly;
    options.hand_context = rest;
    options.may_rest = says;
    options.duration_s = RESTED * 1e-3;
    options.paced = paced;
    options.late_ns = &rest->late;
    DriveReport report = simulator_drive(simulator, &options);
    assert_int_equal(rest->step, RESTED);
    *hash = simulator_hash(simulator);
    simulator_destroy(simulator);
    scene_free(scene);
    return report;
}

// At rest there are fewer wake-ups than steps, in motion and with a device one for each; results and time are the same.
static void at_rest_steps_share_a_wake_up(void **state)
{
    (void)state;
    static Rest unpaced, rested = {.may_rest = true}, awake;
    uint64_t hash[3];
    drive_at_rest(&unpaced, false, &hash[0]);
    DriveReport report = drive_at_rest(&rested, true, &hash[1]);
    drive_at_rest(&awake, true, &hash[2]);
    print_message("%d steps: %lld wake-ups at rest, %lld awake\n", RESTED, (long long)rested.late.total, (long long)awake.late.total);
    assert_true(hash[0] == hash[1] && hash[1] == hash[2]);
    assert_int_equal(awake.late.total, RESTED);
    // each step of the push and until rest is sure has its own; before the push at least two steps share one
    assert_in_range(rested.late.total, PUSHED + 2 * SURE - 8, RESTED - (PUSH_AT - SURE) / 2);
    // in real time, up to the steps of the last wake-up
    assert_true(report.wall_s - report.slowed_s >= (RESTED - 1) * 1e-3);
    assert_true(report.wall_s - report.slowed_s <= (RESTED + 8) * 1e-3 + 1e-4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_stall_slows_simulated_time), cmocka_unit_test(nothing_is_hurried_after_a_stall),
                                       cmocka_unit_test(at_rest_steps_share_a_wake_up)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

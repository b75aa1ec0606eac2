// Force at the hand when a device fails: no force that is not requested now, and none that remains.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/input/hid_recordings.h"
#include "tests/input/lying_device.h"

#include <math.h>
#include <stdio.h>

static const char map_text[] = "seldinger_device: 1\ndevice: {usage: joystick}\npush: {source: Y, mm_s: 40, invert: true}\ntwist: {source: X, deg_s: 90}\n"
                               "force: {full_scale_n: 8, max_n: 4, slew_n_s: 200, full_scale_n_mm: 40, stall_ms: 50, quiet_ms: 200}\n";
enum { COUNTS_PER_N = 32, SLEW_COUNTS = 8 };    // 255 counts for 8 N; 200 N/s in one millisecond, rounded up

typedef struct Bench {
    Faults faults;
    HidDescriptor *stick;
    DeviceMap *map;
    HidTransport transport;
    LyingDevice device;
    ForceFeedback force;
    HandPort port;
} Bench;

static HidDescriptor *descriptor_with(Bench *bench, const char *hex)
{
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    HidDescriptor *descriptor = hid_descriptor_parse(bytes, hid_bytes(hex, bytes), "stick", &bench->faults);
    if (!descriptor)
        fail_msg("%s", bench->faults.text[0]);
    return descriptor;
}

static int set_up(void **state)
{
    Bench *bench = calloc(1, sizeof *bench);
    if (!bench)
        return -1;
    faults_clear(&bench->faults);
    bench->stick = descriptor_with(bench, sidewinder_2);
    bench->map = device_map_parse(map_text, strlen(map_text), "m.yaml", &bench->faults);
    bench->transport = lying_transport();
    bench->device.now_us = 1000000;
    *state = bench;
    return bench->map ? 0 : -1;
}

static int tear_down(void **state)
{
    Bench *bench = *state;
    free(bench->stick);
    free(bench->map);
    free(bench);
    return 0;
}

static bool start(Bench *bench) { return force_start(&bench->force, bench->map, bench->stick, &bench->transport, &bench->device, bench->device.now_us); }

// Updates the force one millisecond later; by default the simulation advances.
static void tick(Bench *bench, double force_n, bool steps)
{
    bench->device.now_us += 1000;
    atomic_store(&bench->port.force_n, force_n);
    atomic_fetch_add(&bench->port.step, steps);
    force_tick(&bench->force, &bench->port, bench->device.now_us, bench->device.now_us, false, &bench->transport, &bench->device);
}

static void hold(Bench *bench, double force_n, int ms)
{
    for (int i = 0; i < ms; i++)
        tick(bench, force_n, true);
}

static int felt(const Bench *bench) { return abs(lying_felt(&bench->device, 1)); }

static bool is_start(const LyingReport *report) { return report->bytes[0] == REPORT_OPERATION && report->bytes[2] == OPERATION_START; }
static bool is_stop(const LyingReport *report) { return report->bytes[0] == REPORT_OPERATION && report->bytes[2] == OPERATION_STOP; }
static bool is_force(const LyingReport *report, int block) { return report->bytes[0] == REPORT_FORCE && report->bytes[1] == block; }
static int magnitude(const LyingReport *report) { return (int16_t)(report->bytes[2] | report->bytes[3] << 8); }

static void a_force_is_held_as_long_as_it_is_wanted(void **state)
{
    Bench *bench = *state;
    assert_true(start(bench));
    hold(bench, 3, 100);
    for (int i = 0; i < 3000; i++) {
        tick(bench, 3, true);
        assert_int_equal(felt(bench), 96);    // 3 of 8 N of 255 counts
    }
    // each effect is restarted at least once within its half second
    int starts = 0;
    for (int i = 0; i < bench->device.log_count; i++)
        starts += is_start(&bench->device.log[i]) && bench->device.log[i].bytes[1] == 1;
    assert_in_range(starts, 7, 20);
}

// The process was paused and the effect ended by itself; the simulation is paused too.
static void after_a_pause_no_stale_force_is_played(void **state)
{
    Bench *bench = *state;
    assert_true(start(bench));
    hold(bench, 3, 100);
    assert_int_equal(felt(bench), 96);
    int first = bench->device.log_count;
    bench->device.now_us += 3000000;
    assert_int_equal(felt(bench), 0);
    tick(bench, 3, false);
    assert_true(bench->force.guard.sent[0] == 0);
    for (int i = first; i < bench->device.log_count; i++)
        assert_false(is_start(&bench->device.log[i]));
    assert_int_equal(felt(bench), 0);
}

// The same, but the simulation made a step first: the force starts from zero at the slew rate, because the hand felt no force.
static void after_a_pause_force_grows_from_zero(void **state)
{
    Bench *bench = *state;
    assert_true(start(bench));
    hold(bench, 3, 100);
    int first = bench->device.log_count, known = 96;
    bench->device.now_us += 3000000;
    for (int i = 0, before = 0; i < 100; i++) {
        tick(bench, 3, true);
        // the time between two updates counts as 50 ms at most, but nothing was felt during it
        assert_in_range(felt(bench), 0, before + SLEW_COUNTS);
        before = felt(bench);
    }
    for (int i = first; i < bench->device.log_count && !is_start(&bench->device.log[i]); i++)
        if (is_force(&bench->device.log[i], 1))
            known = magnitude(&bench->device.log[i]);
    assert_int_equal(known, 0);    // before the first start
    assert_int_equal(felt(bench), 96);
}

static void a_paused_session_stops_the_effects(void **state)
{
    Bench *bench = *state;
    assert_true(start(bench));
    hold(bench, 3, 100);
    bench->device.now_us += 1000;
    force_tick(&bench->force, &bench->port, bench->device.now_us, bench->device.now_us, true, &bench->transport, &bench->device);
    assert_true(!bench->device.plays[1] && !bench->device.plays[2] && bench->device.magnitude[1] == 0);
    int before = bench->device.log_count;
    for (int i = 0; i < 2000; i++) {    // and stays so, without reports
        bench->device.now_us += 1000;
        force_tick(&bench->force, &bench->port, bench->device.now_us, bench->device.now_us, true, &bench->transport, &bench->device);
    }
    assert_int_equal(bench->device.log_count, before);
}

typedef struct Failing {
    long count, each;    // each `each`th report fails
    DeviceAnswer how;
} Failing;

static DeviceAnswer fails_each(void *context)
{
    Failing *failing = context;
    return ++failing->count % failing->each == 0 ? failing->how : ANSWER_TAKES;
}

static void a_failed_write_leaves_no_force(void **state)
{
    Bench *bench = *state;
    static const DeviceAnswer how[] = {ANSWER_REFUSES, ANSWER_TAKES_AND_DENIES, ANSWER_SHORT};
    for (int k = 0; k < 3; k++) {
        memset(&bench->device, 0, sizeof bench->device);
        bench->device.now_us = 1000000;
        assert_true(start(bench));
        hold(bench, 3, 100);
        Failing failing = {.each = 1, .how = how[k]};
        bench->device.answer = fails_each;
        bench->device.answer_context = &failing;
        int first = bench->device.log_count;
        tick(bench, 2, true);
        // the new force failed; zero and stop are sent in the same tick
        bool zero = false, stop = false;
        for (int i = first; i < bench->device.log_count; i++) {
            const LyingReport *report = &bench->device.log[i];
            zero = zero || (is_force(report, 1) && magnitude(report) == 0);
            stop = stop || (is_stop(report) && report->bytes[1] == 1);
            assert_false(is_start(report));
        }
        assert_true(zero && stop);
        assert_true(bench->force.guard.sent[0] == 0);
        // it accepts reports again: the force returns at the slew rate
        bench->device.answer = NULL;
        tick(bench, 2, true);
        assert_int_equal(felt(bench), 0);
        for (int i = 0, before = 0; i < 60; i++, before = felt(bench)) {
            tick(bench, 2, true);
            assert_in_range(felt(bench), 0, before + SLEW_COUNTS);
        }
        assert_int_equal(felt(bench), 64);
    }
}

// Each 2nd to 9th report fails in one of three ways, for half a second: the force that is felt never jumps, and ends soon after it should.
static void a_device_that_fails_now_and_then_never_jumps(void **state)
{
    Bench *bench = *state;
    static const DeviceAnswer how[] = {ANSWER_REFUSES, ANSWER_TAKES_AND_DENIES, ANSWER_SHORT};
    for (int k = 0; k < 3 * 8; k++) {
        memset(&bench->device, 0, sizeof bench->device);
        bench->device.now_us = 1000000;
        assert_true(start(bench));
        Failing failing = {.each = 2 + k % 8, .how = how[k / 8]};
        bench->device.answer = fails_each;
        bench->device.answer_context = &failing;
        for (int i = 0, before = 0; i < 500; i++, before = felt(bench)) {
            tick(bench, 2 + sin(0.1 * i), true);
            if (felt(bench) > before + SLEW_COUNTS)
                fail_msg("each %ldth report fails: from %d to %d counts", failing.each, before, felt(bench));
        }
        int left = 0;
        for (int i = 0; i < 60; i++) {    // the simulation stops
            tick(bench, 3, false);
            left = i >= 54 ? left + felt(bench) : 0;
        }
        assert_int_equal(left, 0);
        force_stop(&bench->force, &bench->transport, &bench->device);
        assert_int_equal(felt(bench), 0);
    }
}

static void a_device_that_is_given_up_is_stopped_first(void **state)
{
    Bench *bench = *state;
    assert_true(start(bench));
    hold(bench, 3, 100);
    Failing failing = {.each = 1, .how = ANSWER_REFUSES};
    bench->device.answer = fails_each;
    bench->device.answer_context = &failing;
    for (int i = 0; i < 100 && bench->force.block[0]; i++)
        tick(bench, 2, true);
    assert_int_equal(bench->force.block[0], 0);
    assert_non_null(strstr(bench->force.text, "accepts no forces"));
    // its last reports: zero and stop of each effect, then stop all
    const LyingReport *last = &bench->device.log[bench->device.log_count - 1];
    assert_true(last->bytes[0] == REPORT_CONTROL && last->bytes[1] == CONTROL_STOP_ALL);
    bool stopped[3] = {false};
    for (int i = bench->device.log_count - 10; i < bench->device.log_count; i++)
        if (is_stop(&bench->device.log[i]))
            stopped[bench->device.log[i].bytes[1] % 3] = true;
    assert_true(stopped[1] && stopped[2]);
    int tried = bench->device.log_count;
    hold(bench, 3, 100);
    assert_int_equal(bench->device.log_count, tried);
}

static void what_is_no_number_is_no_force(void **state)
{
    Bench *bench = *state;
    PidLayout layout;
    PidMessage message;
    char why[160];
    static const double odd[] = {NAN, INFINITY, -INFINITY};
    assert_true(pid_find(bench->stick, &layout, why, sizeof why));
    for (int i = 0; i < 3; i++) {
        int64_t value = 1;
        assert_true(pid_encode_force(&layout, 1, odd[i], &message, &value));
        assert_int_equal(value, 0);
        assert_true(message.bytes[2] == 0 && message.bytes[3] == 0);
    }
}

// The stick's descriptor with some bytes replaced by the same number of others.
static const char *with(const char *from, const char *to)
{
    static char hex[sizeof sidewinder_2];
    memcpy(hex, sidewinder_2, sizeof hex);
    char *at = strstr(hex, from);
    if (!at || strlen(from) != strlen(to))
        fail_msg("the descriptor has no %s of this length", from);
    memcpy(at, to, strlen(to));
    return hex;
}

static void an_effect_that_would_not_end_is_refused(void **state)
{
    Bench *bench = *state;
    static const struct {
        const char *what, *from, *to, *words;
    } cases[] = {
        {"no duration", "0950095409511500", "0955095409511500", "no duration"},
        {"ten seconds at least",
         "0950095409511500"
         "26ff7f350046ff7f57fdffffff",
         "0950095409511500"
         "26ff7f350046ff7f5701000000",
         "limited to a duration"},
        {"a millisecond at most",
         "0950095409511500"
         "26ff7f350046ff7f57fdffffff",
         "0950095409511500"
         "26ffff350046ff7f57f8ffffff",
         "limited to a duration"},
        {"forces from 1 on", "09701601ff26ff00", "097016010026ff00", "no zero"},
        {"forces to 32767 in 8 bits", "09701601ff26ff0036f0d84610277510", "097016018026ff7f36f0d84610277508", "does not fit"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        free(bench->stick);
        bench->stick = descriptor_with(bench, with(cases[i].from, cases[i].to));
        memset(&bench->device, 0, sizeof bench->device);
        if (start(bench))
            fail_msg("%s: taken", cases[i].what);
        if (!strstr(bench->force.text, cases[i].words))
            fail_msg("%s: '%s'", cases[i].what, bench->force.text);
        for (int k = 0; k < bench->device.log_count; k++)
            assert_false(is_start(&bench->device.log[k]));
    }
}

// All ones in the field of the duration mean an endless effect.
static void the_longest_duration_is_not_endless(void **state)
{
    Bench *bench = *state;
    int effects = 0;
    free(bench->stick);
    bench->stick = descriptor_with(bench, with("0950095409511500"
                                               "26ff7f350046ff7f57fdffffff",
                                               "0950095409511500"
                                               "26ffff350046ff7f57faffffff"));
    assert_true(start(bench));
    for (int i = 0; i < bench->device.log_count; i++) {
        const uint8_t *bytes = bench->device.log[i].bytes;
        if (bytes[0] != REPORT_EFFECT)
            continue;
        assert_int_equal(bytes[3] | bytes[4] << 8, 0xfffe);
        effects++;
    }
    assert_int_equal(effects, 2);
    assert_int_equal(pid_duration_ms(&bench->force.layout), 65);    // microseconds
}

int main(void)
{
#define EACH(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        EACH(a_force_is_held_as_long_as_it_is_wanted),    EACH(after_a_pause_no_stale_force_is_played), EACH(after_a_pause_force_grows_from_zero),
        EACH(a_paused_session_stops_the_effects),         EACH(a_failed_write_leaves_no_force),         EACH(a_device_that_fails_now_and_then_never_jumps),
        EACH(a_device_that_is_given_up_is_stopped_first), EACH(what_is_no_number_is_no_force),          EACH(an_effect_that_would_not_end_is_refused),
        EACH(the_longest_duration_is_not_endless),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

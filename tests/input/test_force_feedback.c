// Force feedback: the controls found in descriptors, the bytes sent, and what the guard lets through; with a simulated clock.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "input/force_feedback.h"
#include "input/hand.h"
#include "tests/input/fake_hid.h"
#include "tests/input/hid_recordings.h"

#include <math.h>
#include <stdlib.h>

static Faults faults;

static bool near(double a, double b) { return fabs(a - b) <= 1e-9; }

static HidDescriptor *descriptor_of(const char *hex)
{
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    faults_clear(&faults);
    HidDescriptor *descriptor = hid_descriptor_parse(bytes, hid_bytes(hex, bytes), "device", &faults);
    if (!descriptor)
        fail_msg("%s", faults.text[0]);
    return descriptor;
}

static DeviceMap *map_of(const char *text)
{
    faults_clear(&faults);
    DeviceMap *map = device_map_parse(text, strlen(text), "m.yaml", &faults);
    if (!map)
        fail_msg("%s", faults.text[0]);
    return map;
}

static void expect_bytes(const PidMessage *message, HidReportKind kind, const char *hex)
{
    uint8_t bytes[64];
    size_t length = hid_bytes(hex, bytes);
    char got[200] = "";
    for (int i = 0; i < message->length; i++)
        snprintf(got + 2 * i, 3, "%02x", message->bytes[i]);
    if (message->kind != kind || (size_t)message->length != length || memcmp(bytes, message->bytes, length) != 0)
        fail_msg("sent %s, expected %s", got, hex);
}

static void a_real_joystick_gets_the_reports_that_it_describes(void **state)
{
    (void)state;
    HidDescriptor *stick = descriptor_of(sidewinder_2);
    PidLayout layout;
    PidMessage message;
    char why[128];
    int64_t value;
    assert_true(pid_find(stick, &layout, why, sizeof why));
    assert_true(pid_encode_reset(&layout, &message));
    expect_bytes(&message, HID_OUTPUT, "0c04");      // the 4th of six device controls
    assert_true(pid_encode_enable(&layout, &message));
    expect_bytes(&message, HID_OUTPUT, "0c01");
    assert_true(pid_encode_gain(&layout, &message));
    expect_bytes(&message, HID_OUTPUT, "0dff");
    assert_true(pid_encode_create(&layout, &message));
    expect_bytes(&message, HID_FEATURE, "01010000");
    assert_int_equal(pid_decode_block_load(&layout, (const uint8_t[]){2, 7, 1, 0, 1}, 5), 7);
    assert_int_equal(pid_decode_block_load(&layout, (const uint8_t[]){2, 7, 2, 0, 1}, 5), 0);    // full
    assert_int_equal(pid_decode_block_load(&layout, (const uint8_t[]){3, 7, 1, 0, 1}, 5), 0);    // another report
    assert_int_equal(pid_decode_block_load(&layout, (const uint8_t[]){2, 7}, 2), 0);
    // PID Pool: 16 bits of size, 8 of effects at once, device managed, shared blocks
    assert_false(pid_needs_host(&layout, (const uint8_t[]){3, 0, 1, 10, 1}, 5));
    assert_true(pid_needs_host(&layout, (const uint8_t[]){3, 0, 1, 10, 2}, 5));
    assert_false(pid_needs_host(&layout, (const uint8_t[]){3, 0, 1}, 3));
    // index, constant, half a second, two intervals, gain, no trigger, axes and direction enable, directions, delay
    assert_true(pid_encode_effect(&layout, 7, 90, &message));
    expect_bytes(&message, HID_OUTPUT,
                 "010701"
                 "f401"
                 "0000"
                 "0000"
                 "ff"
                 "ff"
                 "04"
                 "4000"
                 "0000");
    assert_int_equal(pid_duration_ms(&layout), 500);
    assert_true(pid_encode_force(&layout, 7, -1, &message, &value));
    expect_bytes(&message, HID_OUTPUT, "050701ff");
    assert_int_equal(value, -255);
    assert_true(pid_encode_force(&layout, 7, 0.5, &message, &value));
    expect_bytes(&message, HID_OUTPUT, "05078000");
    assert_true(pid_encode_force(&layout, 7, 9, &message, &value) && value == 255);
    assert_true(pid_encode_start(&layout, 7, &message));
    expect_bytes(&message, HID_OUTPUT, "0a070101");
    assert_true(pid_encode_stop(&layout, 7, &message));
    expect_bytes(&message, HID_OUTPUT, "0a070300");
    free(stick);
}

static void what_has_no_constant_force_is_reported(void **state)
{
    (void)state;
    static const struct {
        const char *hex, *words;
    } cases[] = {{xbox_one_s, "no constant force effect"}, {dualshock_4, "no force feedback"}, {boot_mouse, "no force feedback"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        HidDescriptor *device = descriptor_of(cases[i].hex);
        PidLayout layout;
        char why[128] = "";
        assert_false(pid_find(device, &layout, why, sizeof why));
        assert_non_null(strstr(why, cases[i].words));
        free(device);
    }
}

static void the_reaction_comes_from_where_the_stick_goes(void **state)
{
    (void)state;
    static const struct {
        const char *push;
        double deg;
    } cases[] = {
        {"{source: X, mm_s: 1}", 90}, {"{source: X, mm_s: 1, invert: true}", 270}, {"{source: Y, mm_s: 1}", 180}, {"{source: Y, mm_s: 1, invert: true}", 0}};
    char text[200];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        snprintf(text, sizeof text, "seldinger_device: 1\ndevice: {usage: joystick}\npush: %s\n", cases[i].push);
        DeviceMap *map = map_of(text);
        map->force.direction_deg = NAN;
        assert_true(force_direction_deg(map, false) == cases[i].deg);
        free(map);
    }
    DeviceMap *map = map_of("seldinger_device: 1\ndevice: {usage: joystick}\npush: {source: slider, mm_s: 1}\nforce: {full_scale_n: 1}\n");
    assert_true(isnan(force_direction_deg(map, false)));
    free(map);
}

static const MapForce limits = {.is_wanted = true, .full_scale_n = 8, .max_n = 4, .slew_n_s = 200, .full_scale_n_mm = 40, .stall_ms = 50, .quiet_ms = 200};

// Advances by one millisecond; by default simulation and device are alive.
typedef struct Clock {
    ForceGuard guard;
    int64_t now, step, report;
} Clock;

static double tick(Clock *clock, double wanted, bool steps, bool reports, bool paused)
{
    clock->now += 1000;
    clock->step += steps;
    clock->report = reports ? clock->now : clock->report;
    force_guard(&clock->guard, &limits, (const double[]){wanted, 0}, clock->step, clock->now, clock->report, paused);
    return clock->guard.sent[0];
}

static void forces_are_clamped_and_grow_no_faster_than_the_slew(void **state)
{
    (void)state;
    Clock clock = {.now = 5000000};
    double before = 0;
    assert_true(tick(&clock, 1, true, true, false) == 0);    // at first it is unknown whether the simulation runs
    for (int i = 0; i < 100; i++) {
        double sent = tick(&clock, 100, true, true, false);
        assert_true(fabs(sent - before) <= 0.2 + 1e-12 && sent <= 4);
        before = sent;
    }
    assert_true(near(before, 4));
    for (int i = 0; i < 100; i++) {
        double sent = tick(&clock, -100, true, true, false);
        assert_true(fabs(sent - before) <= 0.2 + 1e-12 && sent >= -4);
        before = sent;
    }
    assert_true(near(before, -4));
    for (int i = 0; i < 100; i++)
        before = tick(&clock, 1.25, true, true, false);
    assert_true(near(before, 1.25));
}

static void the_watchdog_takes_the_force_away_at_once(void **state)
{
    (void)state;
    Clock clock = {.now = 1000000};
    for (int i = 0; i < 50; i++)
        tick(&clock, 3, true, true, false);
    assert_true(near(clock.guard.sent[0], 3));
    // the simulation stops: full force for less than 50 ms, then none
    for (int i = 1; i < 50; i++)
        assert_true(near(tick(&clock, 3, false, true, false), 3));
    assert_true(tick(&clock, 3, false, true, false) == 0);
    assert_non_null(strstr(clock.guard.why_zero, "simulation stalls"));
    assert_true(near(tick(&clock, 3, true, true, false), 0.2));    // and increases again at the slew rate
    for (int i = 0; i < 50; i++)
        tick(&clock, 3, true, true, false);
    // the device is silent
    for (int i = 1; i < 200; i++)
        assert_true(near(tick(&clock, 3, true, false, false), 3));
    assert_true(tick(&clock, 3, true, false, false) == 0);
    assert_non_null(strstr(clock.guard.why_zero, "silent"));
    for (int i = 0; i < 50; i++)
        tick(&clock, 3, true, true, false);
    assert_true(tick(&clock, 3, true, true, true) == 0);           // paused
    for (int i = 0; i < 50; i++)
        tick(&clock, 3, true, true, false);
    assert_true(tick(&clock, NAN, true, true, false) == 0);
    assert_true(tick(&clock, INFINITY, true, true, false) == 0);
}

static void a_late_tick_does_not_jump(void **state)
{
    (void)state;
    Clock clock = {.now = 1000000};
    tick(&clock, 4, true, true, false);
    tick(&clock, 4, true, true, false);
    clock.now += 3000000;
    double before = clock.guard.sent[0], sent = tick(&clock, -4, true, true, false);
    // a gap counts as 50 ms at most
    assert_true(before - sent <= 200 * 0.05 + 1e-9);
}

// --- with the threads and a simulated device (fake_hid.h) ---

#define wait_for(condition)                                                                                                                                    \
    do {                                                                                                                                                       \
        int64_t until_ = fake_now_us() + 10000000;                                                                                                             \
        while (!(condition) && fake_now_us() < until_)                                                                                                         \
            fake_sleep_us(200);                                                                                                                                \
        if (!(condition))                                                                                                                                      \
            fail_msg("never: %s", #condition);                                                                                                                 \
    } while (0)

// The magnitude in the last Set Constant Force report; 0 if none was sent. *when: its time.
static int magnitude_of(FakeHid *hid, int index, int *writes)
{
    int magnitude = 0, count = 0;
    pthread_mutex_lock(&hid->lock);
    for (int i = 0; i < hid->device[index].written_count; i++)
        if (hid->device[index].written[i].bytes[0] == 5) {
            magnitude = (int16_t)(hid->device[index].written[i].bytes[2] | hid->device[index].written[i].bytes[3] << 8);
            count++;
        }
    pthread_mutex_unlock(&hid->lock);
    if (writes)
        *writes = count;
    return magnitude;
}

static int last_magnitude(FakeHid *hid, int *writes) { return magnitude_of(hid, 0, writes); }

static void a_stick_feels_the_sheath_until_the_simulation_stands(void **state)
{
    (void)state;
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    size_t length = hid_bytes(sidewinder_2, bytes);
    FakeHid *hid = calloc(1, sizeof *hid);
    assert_non_null(hid);
    HidTransport transport = fake_transport(hid);
    HandsOptions options = hands_default_options();
    // a watchdog that is slow enough for a busy machine
    DeviceMap *map = map_of("seldinger_device: 1\ndevice: {usage: joystick}\npush: {source: Y, mm_s: 40, invert: true}\n"
                            "force: {full_scale_n: 8, max_n: 4, stall_ms: 1000, quiet_ms: 10000}\n");
    options.map = (const DeviceMap *const *)&map;
    options.map_count = 1;
    options.rescan_ms = 10;
    options.transport = &transport;
    hid->device[0].feature_answer = (FakeReport){.length = 5, .bytes = {2, 3, 1, 0, 1}};
    fake_plug(hid, 0, 0x045e, 0x001b, "", HID_USAGE(1, 4), bytes, (int)length);
    faults_clear(&faults);
    Hands *hands = hands_open(&options, &faults);
    assert_non_null(hands);
    HandPort *port = hands_port(hands, 0);
    wait_for(atomic_load(&port->state) == HAND_READY);
    HandInfo info;
    wait_for((hands_info(hands, 0, &info), strstr(info.force, "255 steps for 8 N")));
    const uint8_t rest[] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    // 2 N of 8 N: 64 of 255 steps, reached at the slew rate; steps and reports continue
    atomic_store(&port->force_n, 2);
    int64_t until = fake_now_us() + 10000000;
    while (last_magnitude(hid, NULL) != 64 && fake_now_us() < until) {
        atomic_fetch_add(&port->step, 1);
        fake_report(hid, 0, rest, sizeof rest);
        fake_sleep_us(500);
    }
    int writes;
    assert_int_equal(last_magnitude(hid, &writes), 64);
    // each magnitude once, in order, about a millisecond after the one before
    pthread_mutex_lock(&hid->lock);
    int before = -1;
    int64_t before_us = 0;
    for (int i = 0; i < hid->device[0].written_count; i++) {
        const FakeReport *report = &hid->device[0].written[i];
        if (report->bytes[0] != 5)
            continue;
        int magnitude = (int16_t)(report->bytes[2] | report->bytes[3] << 8);
        if (magnitude <= before)
            fail_msg("%d follows %d", magnitude, before);
        if (before > 0)
            assert_true(hid->device[0].written_us[i] - before_us >= 700);
        before = magnitude;
        before_us = hid->device[0].written_us[i];
    }
    pthread_mutex_unlock(&hid->lock);
    // the simulation stops
    for (int i = 0; i < 2000 && last_magnitude(hid, NULL) != 0; i++) {
        fake_report(hid, 0, rest, sizeof rest);
        fake_sleep_us(1000);
    }
    assert_int_equal(last_magnitude(hid, NULL), 0);
    // it continues, and the session ends: zero force, stop, and no report afterwards
    until = fake_now_us() + 10000000;
    while (last_magnitude(hid, NULL) != 64 && fake_now_us() < until) {
        atomic_fetch_add(&port->step, 1);
        fake_report(hid, 0, rest, sizeof rest);
        fake_sleep_us(500);
    }
    assert_int_equal(last_magnitude(hid, NULL), 64);
    hands_close(hands);
    assert_int_equal(last_magnitude(hid, NULL), 0);
    const FakeReport *last = &hid->device[0].written[hid->device[0].written_count - 1];
    assert_true(last->bytes[0] == 0x0c && last->bytes[1] == 3);    // stop all effects
    free(hid);
    free(map);
}

// Two tools, each with its stick: the stick has the force of its first port, whichever tool that is, not the force of another tool that it also moves.
static void two_sticks_feel_a_tool_each(void **state)
{
    (void)state;
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    size_t length = hid_bytes(sidewinder_2, bytes);
    const ToolNames tools = {.count = 2, .name = {"guide", "wire"}, .kind = {"guide_catheter", "wire"}};
    FakeHid *hid = calloc(1, sizeof *hid);
    assert_non_null(hid);
    HidTransport transport = fake_transport(hid);
    HandsOptions options = hands_default_options();
    static const char force[] = "force: {full_scale_n: 8, max_n: 4, stall_ms: 1000, quiet_ms: 10000}\n";
    char text[2][400];
    snprintf(text[0], sizeof text[0], "seldinger_device: 1\ndevice: {usage: joystick, serial: A}\ntool: wire\npush: {source: Y, mm_s: 40, invert: true}\n%s",
             force);
    snprintf(text[1], sizeof text[1],
             "seldinger_device: 1\ndevice: {usage: joystick, serial: B}\npush: {source: Y, mm_s: 40, invert: true, tool: guide}\n"
             "twist: {source: X, deg_s: 90, tool: wire}\n%s",
             force);
    DeviceMap *map[2] = {map_of(text[0]), map_of(text[1])};
    faults_clear(&faults);
    for (int i = 0; i < 2; i++)
        assert_true(device_map_find_tools(map[i], &tools, &faults));
    options.map = (const DeviceMap *const *)map;
    options.map_count = 2;
    options.rescan_ms = 10;
    options.transport = &transport;
    Hands *hands = hands_open(&options, &faults);
    assert_non_null(hands);
    for (int i = 0; i < 2; i++) {
        hid->device[i].feature_answer = (FakeReport){.length = 5, .bytes = {2, 3, 1, 0, 1}};
        fake_plug(hid, i, 0x045e, 0x001b, i == 0 ? "A" : "B", HID_USAGE(1, 4), bytes, (int)length);
        wait_for(atomic_load(&hands_port(hands, i)->state) == HAND_READY);
    }
    assert_true(atomic_load(&hands_port(hands, 0)->drives) == DRIVES_TOOL + 1 && atomic_load(&hands_port(hands, 1)->drives) == DRIVES_TOOL);
    // as hand_set_answer gives it: 1 N on the guide, 2 N on the wire
    static const double push[] = {1, 2};
    const uint8_t rest[] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    int64_t until = fake_now_us() + 10000000;
    while ((magnitude_of(hid, 0, NULL) != 64 || magnitude_of(hid, 1, NULL) != 32) && fake_now_us() < until) {
        for (int i = 0; i < 2 * MAP_HANDS; i++) {
            HandPort *port = hands_port(hands, i / MAP_HANDS) + i % MAP_HANDS;
            int drives = atomic_load(&port->drives);
            atomic_store(&port->force_n, push[drives >= DRIVES_TOOL ? drives - DRIVES_TOOL : 0]);
            atomic_fetch_add(&port->step, 1);
        }
        fake_report(hid, 0, rest, sizeof rest);
        fake_report(hid, 1, rest, sizeof rest);
        fake_sleep_us(500);
    }
    assert_int_equal(magnitude_of(hid, 0, NULL), 64);
    assert_int_equal(magnitude_of(hid, 1, NULL), 32);
    hands_close(hands);
    assert_true(magnitude_of(hid, 0, NULL) == 0 && magnitude_of(hid, 1, NULL) == 0);
    free(hid);
    free(map[0]);
    free(map[1]);
}

static void a_haptic_joystick_needs_no_map_and_a_refused_effect_is_reported(void **state)
{
    (void)state;
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    size_t length = hid_bytes(sidewinder_2, bytes);
    FakeHid *hid = calloc(1, sizeof *hid);
    assert_non_null(hid);
    HidTransport transport = fake_transport(hid);
    HandsOptions options = hands_default_options();
    options.transport = &transport;
    hid->device[0].feature_answer = (FakeReport){.length = 5, .bytes = {2, 0, 2, 0, 0}};    // its memory is full
    fake_plug(hid, 0, 0x045e, 0x001b, "", HID_USAGE(1, 4), bytes, (int)length);
    faults_clear(&faults);
    Hands *hands = hands_open(&options, &faults);
    assert_non_null(hands);
    HandInfo info;
    wait_for((hands_info(hands, 0, &info), info.state == HAND_READY));
    assert_string_equal(info.map, "haptic joystick");
    assert_non_null(strstr(info.force, "did not accept"));
    hands_close(hands);
    free(hid);
}

// Two effects, force along Y and torque along X, each with its own full scale; no thread.
static void torque_is_a_second_effect(void **state)
{
    (void)state;
    HidDescriptor *stick = descriptor_of(sidewinder_2);
    DeviceMap *map = map_of("seldinger_device: 1\ndevice: {usage: joystick}\npush: {source: Y, mm_s: 40, invert: true}\ntwist: {source: X, deg_s: 90}\n"
                            "force: {full_scale_n: 8, max_n: 8, slew_n_s: 100000, full_scale_n_mm: 40}\n");
    FakeHid *hid = calloc(1, sizeof *hid);
    assert_non_null(hid);
    HidTransport transport = fake_transport(hid);
    FakeDevice *device = fake_plug(hid, 0, 1, 2, "", HID_USAGE(1, 4), NULL, 0);
    device->feature_answer = (FakeReport){.length = 5, .bytes = {2, 0, 1, 0, 1}};
    device->feature_grows = 1;
    ForceFeedback force;
    HandPort port = {0};
    int64_t now = 1000000;
    assert_true(force_start(&force, map, stick, &transport, device, now));
    assert_true(force.block[0] == 1 && force.block[1] == 2);
    assert_non_null(strstr(force.text, "and torque"));
    uint8_t direction[2];
    int found = 0;
    for (int i = 0; i < device->written_count; i++)
        if (device->written[i].bytes[0] == 1)
            direction[found++] = device->written[i].bytes[12];
    assert_true(found == 2 && direction[0] == 0 && direction[1] == 64);    // from north, from east
    atomic_store(&port.force_n, -4);
    atomic_store(&port.torque_n_mm, 10);
    for (int i = 0; i < 5; i++) {
        now += 1000;
        atomic_fetch_add(&port.step, 1);
        force_tick(&force, &port, now, now, false, &transport, device);
    }
    assert_true(force.value[0] == -128 && force.value[1] == 64);    // half and a quarter of 255, rounded
    int before = device->written_count;
    for (int i = 0; i < 5; i++) {    // nothing new to send, so nothing is sent
        now += 1000;
        atomic_fetch_add(&port.step, 1);
        force_tick(&force, &port, now, now, false, &transport, device);
    }
    assert_int_equal(device->written_count, before);
    now += 1000;
    force_tick(&force, &port, now, now, true, &transport, device);
    assert_true(force.value[0] == 0 && force.value[1] == 0);        // paused
    device->takes_no_writes = true;
    for (int i = 0; i < 40; i++) {
        now += 1000;
        atomic_fetch_add(&port.step, 1);
        force_tick(&force, &port, now, now, false, &transport, device);
    }
    assert_int_equal(force.block[0], 0);    // abandoned
    assert_non_null(strstr(force.text, "accepts no forces"));
    free(stick);
    free(map);
    free(hid);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_real_joystick_gets_the_reports_that_it_describes),
        cmocka_unit_test(what_has_no_constant_force_is_reported),
        cmocka_unit_test(the_reaction_comes_from_where_the_stick_goes),
        cmocka_unit_test(forces_are_clamped_and_grow_no_faster_than_the_slew),
        cmocka_unit_test(the_watchdog_takes_the_force_away_at_once),
        cmocka_unit_test(a_late_tick_does_not_jump),
        cmocka_unit_test(torque_is_a_second_effect),
        cmocka_unit_test(a_stick_feels_the_sheath_until_the_simulation_stands),
        cmocka_unit_test(two_sticks_feel_a_tool_each),
        cmocka_unit_test(a_haptic_joystick_needs_no_map_and_a_refused_effect_is_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

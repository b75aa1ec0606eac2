// Hands with their real threads and simulated devices (fake_hid.h): detected, read, unplugged, plugged in again, two at once, flooded, refused, and with force
// feedback.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "input/hand.h"
#include "input/hid_report.h"
#include "tests/input/fake_hid.h"

#include <math.h>
#include <stdlib.h>

// X and Y from 0 to 255, four buttons
static const uint8_t stick[] = {0x05, 1,    0x09, 4,    0xa1, 1,    0x15, 0,    0x26, 0xff, 0, 0x75, 8, 0x95, 2, 0x09, 0x30, 0x09, 0x31, 0x81,
                                2,    0x05, 9,    0x19, 1,    0x29, 4,    0x25, 1,    0x75, 1, 0x95, 4, 0x81, 2, 0x95, 4,    0x81, 1,    0xc0};
// relative X and Y of 16 bits and an absolute counter of 16 bits (dial)
static const uint8_t roller[] = {0x05, 1,    0x09, 2, 0xa1, 1, 0x16, 0x01, 0x80, 0x26, 0xff, 0x7f, 0x75, 16,   0x95, 2,    0x09, 0x30,
                                 0x09, 0x31, 0x81, 6, 0x15, 0, 0x27, 0xff, 0xff, 0,    0,    0x95, 1,    0x09, 0x37, 0x81, 2,    0xc0};
static const uint8_t lying[] = {0x05, 1, 0x09, 4, 0xa1, 1, 0x15, 10, 0x25, 5, 0x75, 8, 0x95, 2, 0x09, 0x30, 0x09, 0x31, 0x81, 2, 0xc0};

typedef struct Session {
    FakeHid *hid;
    Hands *hands;
    HidTransport transport;
    DeviceMap *map;
    char message[4000];
} Session;

static void open_session(Session *session, const char *map_text)
{
    static Faults faults;
    faults_clear(&faults);
    *session = (Session){.hid = calloc(1, sizeof(FakeHid))};
    assert_non_null(session->hid);
    session->transport = fake_transport(session->hid);
    HandsOptions options = hands_default_options();
    if (map_text) {
        session->map = device_map_parse(map_text, strlen(map_text), "map.yaml", &faults);
        if (!session->map)
            fail_msg("%s", faults.text[0]);
        options.map = (const DeviceMap *const *)&session->map;
        options.map_count = 1;
    }
    options.rescan_ms = 10;
    options.use_usb = false;
    options.transport = &session->transport;
    session->hands = hands_open(&options, &faults);
    assert_non_null(session->hands);
}

static void close_session(Session *session)
{
    hands_close(session->hands);
    for (int i = 0; i < FAKE_DEVICES; i++)
        assert_false(session->hid->device[i].is_open);
    free(session->hid);
    free(session->map);
}

static bool heard(Session *session, const char *words)
{
    char text[400];
    while (hands_message(session->hands, text, sizeof text))
        if (strlen(session->message) + strlen(text) + 2 < sizeof session->message)
            strcat(strcat(session->message, text), "\n");
    return strstr(session->message, words) != NULL;
}

// Waits until the condition holds, at most 10 s.
#define wait_for(condition)                                                                                                                                    \
    do {                                                                                                                                                       \
        int64_t until_ = fake_now_us() + 10000000;                                                                                                             \
        while (!(condition) && fake_now_us() < until_)                                                                                                         \
            fake_sleep_us(1000);                                                                                                                               \
        if (!(condition))                                                                                                                                      \
            fail_msg("never: %s", #condition);                                                                                                                 \
    } while (0)

static bool near(double a, double b) { return fabs(a - b) < 1e-9; }

static void put_stick(Session *session, int index, int x, int y, int buttons)
{
    const uint8_t report[] = {(uint8_t)x, (uint8_t)y, (uint8_t)buttons};
    fake_report(session->hid, index, report, sizeof report);
}

static void a_joystick_without_a_map_drives_the_tool(void **state)
{
    (void)state;
    Session session;
    open_session(&session, NULL);
    HandPort *port = hands_port(session.hands, 0);
    assert_int_equal(atomic_load(&port->state), HAND_ABSENT);
    fake_plug(session.hid, 0, 0x46d, 0xc215, "", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&port->state) == HAND_READY);
    put_stick(&session, 0, 255, 0, 1 | 4);
    wait_for(atomic_load(&port->reports) == 1);
    assert_true(near(atomic_load(&port->push_mm_s), 40));      // away from the user
    assert_true(near(atomic_load(&port->twist_deg_s), 240));
    assert_int_equal(atomic_load(&port->buttons), HAND_PEDAL | HAND_STOP);
    put_stick(&session, 0, 128, 127, 0);
    wait_for(atomic_load(&port->reports) == 2);
    assert_true(atomic_load(&port->push_mm_s) == 0 && atomic_load(&port->twist_deg_s) == 0);
    assert_int_equal(atomic_load(&port->buttons), 0);
    close_session(&session);
}

static void unplugged_it_stops_and_replugged_it_continues(void **state)
{
    (void)state;
    Session session;
    open_session(&session, "seldinger_device: 1\ndevice: {vendor_id: 0x1209}\npush: [{source: Y, mm_per_count: 0.5}, {source: dial, mm_per_count: 0.01}]\n");
    HandPort *port = hands_port(session.hands, 0);
    fake_plug(session.hid, 0, 0x1209, 1, "A", HID_USAGE(1, 2), roller, sizeof roller);
    wait_for(atomic_load(&port->state) == HAND_READY);
    fake_report(session.hid, 0, (const uint8_t[]){0, 0, 10, 0, 0xf0, 0xff}, 6);    // 10 counts; the dial's first value counts as zero
    fake_report(session.hid, 0, (const uint8_t[]){0, 0, 0xfe, 0xff, 0x10, 0}, 6);  // -2 counts; the dial continues by 32 over its end
    wait_for(atomic_load(&port->reports) == 2);
    assert_true(near(atomic_load(&port->advanced_mm), 0.5 * 8 + 0.01 * 32));
    for (int round = 0; round < 3; round++) {
        fake_unplug(session.hid, 0);
        wait_for(atomic_load(&port->state) == HAND_LOST);
        assert_true(near(atomic_load(&port->advanced_mm), 0.5 * 8 + 0.01 * (32 + 5 * round)));
        // it returns at another path, and its counter starts again
        fake_plug(session.hid, 0, 0x1209, 1, "A", HID_USAGE(1, 2), roller, sizeof roller);
        wait_for(atomic_load(&port->state) == HAND_READY);
        fake_report(session.hid, 0, (const uint8_t[]){0, 0, 0, 0, 0x00, 0x40}, 6);
        fake_report(session.hid, 0, (const uint8_t[]){0, 0, 0, 0, 0x05, 0x40}, 6);
        wait_for(atomic_load(&port->reports) == 4 + 2 * round);
        assert_true(near(atomic_load(&port->advanced_mm), 0.5 * 8 + 0.01 * (32 + 5 * (round + 1))));
    }
    assert_true(heard(&session, "was unplugged: the tool stops"));
    assert_true(heard(&session, "is back"));
    assert_int_equal(atomic_load(&hands_port(session.hands, 1)->state), HAND_ABSENT);
    close_session(&session);
}

static void a_held_stick_stops_when_it_is_unplugged(void **state)
{
    (void)state;
    Session session;
    open_session(&session, NULL);
    HandPort *port = hands_port(session.hands, 0);
    fake_plug(session.hid, 0, 1, 2, "", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&port->state) == HAND_READY);
    put_stick(&session, 0, 0, 0, 15);
    wait_for(atomic_load(&port->push_mm_s) > 0);
    fake_unplug(session.hid, 0);
    wait_for(atomic_load(&port->state) == HAND_LOST);
    assert_true(atomic_load(&port->push_mm_s) == 0 && atomic_load(&port->twist_deg_s) == 0);
    assert_int_equal(atomic_load(&port->buttons), 0);
    close_session(&session);
}

static void two_devices_have_two_ports(void **state)
{
    (void)state;
    Session session;
    open_session(&session, NULL);
    fake_plug(session.hid, 0, 1, 2, "left", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&hands_port(session.hands, 0)->state) == HAND_READY);
    fake_plug(session.hid, 1, 1, 2, "right", HID_USAGE(1, 4), stick, sizeof stick);
    HandPort *left = hands_port(session.hands, 0), *right = hands_port(session.hands, 1);
    wait_for(atomic_load(&right->state) == HAND_READY);
    put_stick(&session, 0, 127, 0, 0);
    put_stick(&session, 1, 255, 127, 0);
    wait_for(atomic_load(&left->reports) == 1 && atomic_load(&right->reports) == 1);
    assert_true(near(atomic_load(&left->push_mm_s), 40) && atomic_load(&left->twist_deg_s) == 0);
    assert_true(near(atomic_load(&right->twist_deg_s), 240) && atomic_load(&right->push_mm_s) == 0);
    fake_unplug(session.hid, 0);
    wait_for(atomic_load(&left->state) == HAND_LOST);
    put_stick(&session, 1, 0, 127, 0);
    wait_for(near(atomic_load(&right->twist_deg_s), -240));    // the other one continues
    fake_plug(session.hid, 0, 1, 2, "left", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&left->state) == HAND_READY);
    assert_int_equal(atomic_load(&right->state), HAND_READY);
    close_session(&session);
}

static void no_count_of_a_flood_is_lost(void **state)
{
    (void)state;
    Session session;
    open_session(&session, "seldinger_device: 1\ndevice: {usage: mouse}\npush: {source: Y, mm_per_count: 0.25}\ntwist: {source: X, deg_per_count: 1}\n");
    HandPort *port = hands_port(session.hands, 0);
    fake_plug(session.hid, 0, 1, 2, "", HID_USAGE(1, 2), roller, sizeof roller);
    wait_for(atomic_load(&port->state) == HAND_READY);
    long x = 0, y = 0;
    enum { REPORTS = 50000 };
    for (int i = 0; i < REPORTS; i++) {
        int dx = i % 7 - 2, dy = i % 11 - 4;
        const uint8_t report[] = {(uint8_t)dx, (uint8_t)(dx >> 8), (uint8_t)dy, (uint8_t)(dy >> 8), 0, 0};
        fake_report(session.hid, 0, report, sizeof report);
        x += dx;
        y += dy;
    }
    wait_for(atomic_load(&port->reports) == REPORTS);
    assert_true(near(atomic_load(&port->advanced_mm), 0.25 * (double)y));
    assert_true(near(atomic_load(&port->turned_deg), (double)x));
    close_session(&session);
}

static void an_endless_flood_keeps_neither_rates_nor_the_end_waiting(void **state)
{
    (void)state;
    Session session;
    open_session(&session, NULL);
    HandPort *port = hands_port(session.hands, 0);
    FakeDevice *device = fake_plug(session.hid, 0, 1, 2, "", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&port->state) == HAND_READY);
    pthread_mutex_lock(&session.hid->lock);
    device->flood = (FakeReport){.length = 3, .bytes = {128, 0, 0}};
    device->flood_hz = 1;
    pthread_mutex_unlock(&session.hid->lock);
    wait_for(atomic_load(&port->reports) > 2000 && near(atomic_load(&port->push_mm_s), 40));
    pthread_mutex_lock(&session.hid->lock);
    device->flood.bytes[1] = 255;
    pthread_mutex_unlock(&session.hid->lock);
    wait_for(near(atomic_load(&port->push_mm_s), -40));
    int64_t before = fake_now_us();
    close_session(&session);
    assert_true(fake_now_us() - before < 2000000);
}

static void what_cannot_be_used_is_reported_once(void **state)
{
    (void)state;
    Session session;
    open_session(&session, NULL);
    fake_plug(session.hid, 0, 1, 2, "", HID_USAGE(1, 4), lying, sizeof lying);
    FakeDevice *shut = &session.hid->device[1];
    pthread_mutex_lock(&session.hid->lock);
    shut->may_not_open = true;
    pthread_mutex_unlock(&session.hid->lock);
    fake_plug(session.hid, 1, 1, 3, "", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(heard(&session, "logical range from 10 to 5") && heard(&session, "no permission"));
    fake_sleep_us(100000);
    heard(&session, "");
    const char *first = strstr(session.message, "logical range");
    assert_null(strstr(first + 1, "logical range"));
    pthread_mutex_lock(&session.hid->lock);
    shut->may_not_open = false;
    pthread_mutex_unlock(&session.hid->lock);
    wait_for(atomic_load(&hands_port(session.hands, 0)->state) == HAND_READY);    // as soon as it can be opened
    close_session(&session);
}

static void short_reports_are_counted_and_change_nothing(void **state)
{
    (void)state;
    Session session;
    open_session(&session, NULL);
    HandPort *port = hands_port(session.hands, 0);
    fake_plug(session.hid, 0, 1, 2, "", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&port->state) == HAND_READY);
    put_stick(&session, 0, 128, 0, 1);
    fake_report(session.hid, 0, (const uint8_t[]){0, 255}, 2);
    wait_for(heard(&session, "its descriptor does not describe"));
    HandInfo info;
    wait_for((hands_info(session.hands, 0, &info), info.bad_reports == 1));
    assert_true(near(atomic_load(&port->push_mm_s), 40));
    assert_int_equal(atomic_load(&port->reports), 1);
    close_session(&session);
}

// Two sticks, each with its own tool, which is known before the first report.
static void each_device_has_its_tool(void **state)
{
    (void)state;
    static Faults faults;
    static const char *const text[] = {"seldinger_device: 1\ndevice: {usage: joystick, serial: A}\ntool: wire\npush: {source: Y, mm_s: 40, dead_zone: 0}\n",
                                       "seldinger_device: 1\ndevice: {usage: joystick, serial: B}\npush: {source: Y, mm_s: 20, dead_zone: 0, tool: guide}\n"
                                       "twist: {source: X, deg_s: 90, dead_zone: 0, tool: innermost}\n"};
    const ToolNames tools = {.count = 2, .name = {"guide", "wire"}, .kind = {"guide_catheter", "wire"}};
    FakeHid *hid = calloc(1, sizeof *hid);
    DeviceMap *map[2];
    assert_non_null(hid);
    faults_clear(&faults);
    for (int i = 0; i < 2; i++) {
        map[i] = device_map_parse(text[i], strlen(text[i]), "map.yaml", &faults);
        assert_true(map[i] && device_map_find_tools(map[i], &tools, &faults));
    }
    HidTransport transport = fake_transport(hid);
    HandsOptions options = hands_default_options();
    options.map = (const DeviceMap *const *)map;
    options.map_count = 2;
    options.rescan_ms = 10;
    options.use_usb = false;
    options.transport = &transport;
    Hands *hands = hands_open(&options, &faults);
    assert_non_null(hands);
    HandPort *first = hands_port(hands, 0), *second = hands_port(hands, 1);
    fake_plug(hid, 0, 1, 1, "A", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&first->state) == HAND_READY);
    fake_plug(hid, 1, 1, 1, "B", HID_USAGE(1, 4), stick, sizeof stick);
    wait_for(atomic_load(&second->state) == HAND_READY);
    assert_int_equal(atomic_load(&first->drives), DRIVES_TOOL + 1);
    assert_true(atomic_load(&second[0].drives) == DRIVES_TOOL && atomic_load(&second[1].drives) == DRIVES_TOOL + 1);
    fake_report(hid, 1, (const uint8_t[]){0, 255, 0}, 3);
    wait_for(atomic_load(&second->reports) == 1);
    assert_true(near(atomic_load(&second[0].push_mm_s), 20) && near(atomic_load(&second[1].twist_deg_s), -90));
    assert_true(atomic_load(&second[0].twist_deg_s) == 0 && atomic_load(&second[1].push_mm_s) == 0 && atomic_load(&first->push_mm_s) == 0);
    fake_unplug(hid, 1);
    wait_for(atomic_load(&second->state) == HAND_LOST);
    assert_true(atomic_load(&second[0].push_mm_s) == 0 && atomic_load(&second[1].twist_deg_s) == 0);
    hands_close(hands);
    free(hid);
    free(map[0]);
    free(map[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_device_has_its_tool),
        cmocka_unit_test(a_joystick_without_a_map_drives_the_tool),
        cmocka_unit_test(unplugged_it_stops_and_replugged_it_continues),
        cmocka_unit_test(a_held_stick_stops_when_it_is_unplugged),
        cmocka_unit_test(two_devices_have_two_ports),
        cmocka_unit_test(no_count_of_a_flood_is_lost),
        cmocka_unit_test(an_endless_flood_keeps_neither_rates_nor_the_end_waiting),
        cmocka_unit_test(what_cannot_be_used_is_reported_once),
        cmocka_unit_test(short_reports_are_counted_and_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

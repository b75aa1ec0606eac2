// Device maps: valid maps, all faults in one pass with their positions, and the laws of axes and counters.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "input/gamepad.h"
#include "input/map_state.h"
#include "tests/input/hid_recordings.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Faults faults;

static bool near(double a, double b) { return fabs(a - b) <= 1e-9 * (1 + fabs(b)); }

static DeviceMap *parse(const char *text)
{
    faults_clear(&faults);
    DeviceMap *map = device_map_parse(text, strlen(text), "m.yaml", &faults);
    assert_int_equal(map == NULL, faults.count > 0);
    return map;
}

static DeviceMap *must_parse(const char *text)
{
    DeviceMap *map = parse(text);
    if (!map)
        fail_msg("%s", faults.text[0]);
    return map;
}

static HidDescriptor *descriptor_of(const char *hex)
{
    uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    faults_clear(&faults);
    HidDescriptor *descriptor = hid_descriptor_parse(bytes, hid_bytes(hex, bytes), "device", &faults);
    assert_non_null(descriptor);
    return descriptor;
}

#define TOP "seldinger_device: 1\n"
#define HID TOP "device: {usage: joystick}\n"

static void every_fault_comes_in_one_pass(void **state)
{
    (void)state;
    assert_null(parse("seldinger_device: 2\n"
                      "device: {vendor_id: 70000, usage: jostick}\n"
                      "push: {source: Q, mm_s: -3, mm_per_count: 1}\n"
                      "twist: {source: X, mm_s: 3}\n"
                      "pedal: {source: button_0}\n"
                      "force: {max_n: 3}\n"));
    const char *const places[] = {"m.yaml:1:", "m.yaml:2:", "m.yaml:2:", "m.yaml:3:", "m.yaml:4:", "m.yaml:5:", "m.yaml:6:"};
    assert_true(faults.count >= 8);
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        bool found = false;
        for (int k = 0; k < faults.count; k++)
            found |= !strncmp(faults.text[k], places[i], strlen(places[i]));
        if (!found)
            fail_msg("no fault at %s", places[i]);
    }
}

static void expect_fault(const char *text, const char *words)
{
    assert_null(parse(text));
    for (int i = 0; i < faults.count && i < FAULTS_CAPACITY; i++)
        if (strstr(faults.text[i], words))
            return;
    fail_msg("<<%s>> gave '%s'; expected %s", text, faults.text[0], words);
}

static void what_does_not_fit_together_is_reported(void **state)
{
    (void)state;
    expect_fault("", "empty");
    expect_fault("[1, 2]", "not a device map");
    expect_fault(TOP "device: {}\npush: {source: X, mm_s: 1}\n", "selects nothing");
    expect_fault(HID, "at least one of these");
    expect_fault(HID "push: {source: X}\n", "one of mm_s and mm_per_count");
    expect_fault(HID "push: {source: X, mm_s: 1, mm_per_count: 1}\n", "one of mm_s and mm_per_count");
    expect_fault(HID "push: {source: X, mm_per_count: 1, dead_zone: 0.1}\n", "is only valid with a deflection");
    expect_fault(HID "push: {source: X, mm_s: 1, counts_per_wrap: 16}\n", "is only valid with counts");
    expect_fault(HID "push: {source: X, mm_s: 1, kind: counter}\n", "kind: deflection");
    expect_fault(HID "push: {source: X, mm_s: 1, kind: circular}\n", "one of");
    expect_fault(HID "push: {source: X, mm_s: 1, logical_min: 5, logical_max: 5}\n", "do not increase");
    expect_fault(HID "push: {source: X, mm_s: 1, logical_min: 0, logical_centre: 9, logical_max: 5}\n", "do not increase");
    expect_fault(HID "push: {source: X, mm_s: 2000}\n", "out of range");
    expect_fault(HID "push: {source: X, cm_s: 2}\n", "mm_s");
    expect_fault(HID "push: {source: X, mm_s: 2}\nforce: {full_scale_n: 2, max_n: 3}\n", "above");
    expect_fault(TOP "device: {gamepad: true}\npush: {source: left_y, mm_per_count: 2}\n", "deflections");
    expect_fault(TOP "device: {gamepad: true}\npush: {source: X, mm_s: 2}\n", "left_x");
    expect_fault(TOP "device: {gamepad: true, joystick: \"*\"}\npush: {source: axis_0, mm_s: 2}\n", "has several of");
    expect_fault(TOP "device: {gamepad: true}\npush: {source: left_y, mm_s: 2}\nforce: {full_scale_n: 1}\n", "needs a HID device");
    expect_fault(TOP "device: {usb: ftdi}\npush: {source: B, mm_per_count: 2}\n", "not among");
    expect_fault(TOP "device: {usb: ftdi}\npush: {source: A, mm_s: 2}\n", "gives counts");
    expect_fault(TOP "device: {usb: ftdi}\nserial: {counts: [A1, A1]}\npush: {source: A1, mm_per_count: 2}\n", "a name without digits");
    expect_fault(TOP "device: {usb: ftdi}\nserial: {counts: [A, A]}\npush: {source: A, mm_per_count: 2}\n", "twice");
    expect_fault(TOP "device: {usb: ftdi}\npedal: {source: A}\n", "no buttons");
    expect_fault(TOP "device: {vendor_id: 046d}\npush: {source: X, mm_s: 2}\n", "0x");
    expect_fault(HID "push: {source: X, mm_s: 2}\npush: {source: Y, mm_s: 2}\n", "duplicate");
    expect_fault(HID "tool: 0\npush: {source: X, mm_s: 2}\n", "1 to 4");
    expect_fault(HID "tool: 5\npush: {source: X, mm_s: 2}\n", "1 to 4");
    expect_fault(HID "tool: -1\npush: {source: X, mm_s: 2}\n", "1 to 4");
    expect_fault(HID "tool: the wire\npush: {source: X, mm_s: 2}\n", "innermost");
    expect_fault(HID "tool: 1.5\npush: {source: X, mm_s: 2}\n", "innermost");
    expect_fault(HID "tool: a_name_that_is_far_too_long_for_any_tool\npush: {source: X, mm_s: 2}\n", "innermost");
    expect_fault(HID "tool: [wire]\npush: {source: X, mm_s: 2}\n", "tool");
    expect_fault(HID "pedal: {source: button_1, tool: wire}\n", "tool");
    expect_fault(HID "push: [{source: X, mm_s: 2, tool: 1}, {source: Y, mm_s: 2, tool: 2}, {source: Z, mm_s: 2, tool: 3}, {source: Rx, mm_s: 2, tool: 4},"
                     " {source: Ry, mm_s: 2, tool: wire}]\n",
                 "one tool more than the limit");
}

static const ToolNames three = {.count = 3, .name = {"guide", "micro", "thread"}, .kind = {"catheter", "catheter", "wire"}};

// The tool that each way of naming it selects.
static void tools_are_found_in_the_scene(void **state)
{
    (void)state;
    static const struct {
        const char *tool;
        int drives;
    } good[] = {{"chosen", DRIVES_CHOSEN},      {"outer", DRIVES_OUTER},     {"inner", DRIVES_INNER},  {"outermost", DRIVES_TOOL},
                {"innermost", DRIVES_TOOL + 2}, {"1", DRIVES_TOOL},          {"3", DRIVES_TOOL + 2},   {"guide", DRIVES_TOOL},
                {"micro", DRIVES_TOOL + 1},     {"thread", DRIVES_TOOL + 2}, {"wire", DRIVES_TOOL + 2}};
    char text[300];
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        snprintf(text, sizeof text, HID "tool: %s\npush: {source: X, mm_s: 2}\n", good[i].tool);
        DeviceMap *map = must_parse(text);
        faults_clear(&faults);
        assert_true(device_map_find_tools(map, &three, &faults));
        assert_true(map->hand_count == 1 && map->hand[0].drives == good[i].drives);
        free(map);
    }
    static const struct {
        const char *tool, *message;
    } bad[] = {{"4", "the scene has no such tool; write guide, micro, thread, outermost"},
               {"microcatheter", "no such tool"},
               {"catheter", "2 of that kind; choose one: guide, micro, thread"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        snprintf(text, sizeof text, HID "twist: {source: X, deg_s: 2, tool: %s}\n", bad[i].tool);
        DeviceMap *map = must_parse(text);
        faults_clear(&faults);
        assert_false(device_map_find_tools(map, &three, &faults));
        assert_int_equal(faults.count, 1);
        if (!strstr(faults.text[0], bad[i].message) || strncmp(faults.text[0], "m.yaml:3:", 9))
            fail_msg("first fault: %s", faults.text[0]);
        free(map);
    }
    // with one tool, both ends and outer and inner are that tool
    const ToolNames one = {.count = 1, .name = {"wire"}, .kind = {"wire"}};
    DeviceMap *map = must_parse(HID "tool: innermost\npush: {source: X, mm_s: 2}\n");
    faults_clear(&faults);
    assert_true(device_map_find_tools(map, &one, &faults) && map->hand[0].drives == DRIVES_TOOL);
    free(map);
}

// One device, several tools: each has its own rates and travel; the buttons belong to the first.
static void a_device_moves_several_tools(void **state)
{
    (void)state;
    DeviceMap *map = must_parse(TOP "device: {usb: ftdi}\ntool: micro\npush: [{source: A, mm_per_count: 0.5}, {source: R, mm_per_count: 0.1, tool: 3}]\n"
                                    "twist: {source: R, deg_per_count: 2, tool: micro}\n");
    HandPort port[MAP_HANDS] = {0};
    MapState device;
    faults_clear(&faults);
    assert_true(device_map_find_tools(map, &three, &faults));
    assert_int_equal(map->hand_count, 2);
    assert_true(map_bind_plain(map, 2, 0, "encoder", &device, &faults));
    map_take_counts(map, (const int64_t[]){0, 0}, (const bool[]){true, true}, 2, &device);
    map_take_counts(map, (const int64_t[]){6, -10}, (const bool[]){true, true}, 2, &device);
    map_publish(map, &device, port);
    assert_true(port[0].drives == DRIVES_TOOL + 1 && near(port[0].advanced_mm, 3) && near(port[0].turned_deg, -20));
    assert_true(port[1].drives == DRIVES_TOOL + 2 && near(port[1].advanced_mm, -1) && port[1].turned_deg == 0);
    assert_true(port[2].drives == DRIVES_CHOSEN && port[2].advanced_mm == 0);

    // two maps that name the same tool are reported, one map that names it twice is not
    char text[400] = "";
    DeviceMap *other = must_parse(HID "tool: innermost\npush: {source: X, mm_s: 2}\ntwist: {source: Y, deg_s: 2, tool: thread}\n");
    assert_true(device_map_find_tools(other, &three, &faults));
    const DeviceMap *maps[] = {other, map}, *alone[] = {other, NULL};
    assert_true(device_maps_share(maps, 2, &three, 2, text, sizeof text));
    assert_string_equal(text, "m.yaml and m.yaml both move 'thread': their rates add up");
    assert_false(device_maps_share(maps, 2, &three, 1, text, sizeof text));
    assert_false(device_maps_share(alone, 2, &three, 2, text, sizeof text));
    free(map);
    free(other);
}

static void a_gamepad_has_a_tool_in_each_stick(void **state)
{
    (void)state;
    DeviceMap *map = device_map_built_in(BUILT_IN_GAMEPAD_PAIR);
    Gamepad pad = {0};
    HandPort port[MAP_HANDS] = {0};
    faults_clear(&faults);
    assert_true(gamepad_bind(&pad, map, 6, 15, "pad", &faults));
    const float axes[6] = {1, -1, -1, 1, -1, -1};      // left stick forwards and to the right, right stick backwards and to the left
    const unsigned char buttons[15] = {[1] = 1, [11] = 1};     // B, and up on the hat
    gamepad_update(&pad, axes, 6, buttons, 15, port);
    for (int h = 0; h < map->hand_count; h++) {
        int drives = port[h].drives;
        double push = drives == DRIVES_OUTER ? 40 : drives == DRIVES_INNER ? -40 : 2, twist = drives == DRIVES_OUTER ? 240 : drives == DRIVES_INNER ? -240 : 0;
        assert_true(drives <= DRIVES_INNER && near(port[h].push_mm_s, push) && near(port[h].twist_deg_s, twist));
    }
    assert_int_equal(map->hand_count, 3);
    assert_int_equal(port[0].buttons, HAND_STOP);
    static const unsigned bits[][2] = {{4, HAND_CHOOSE_OUTER}, {5, HAND_CHOOSE_INNER}, {6, HAND_RELEASE}, {7, HAND_LOCK}, {9, HAND_EXCHANGE}};
    for (size_t i = 0; i < sizeof bits / sizeof *bits; i++) {
        unsigned char held[15] = {0};
        held[bits[i][0]] = 1;
        gamepad_update(&pad, axes, 6, held, 15, port);
        assert_int_equal(port[0].buttons, bits[i][1]);
    }
    gamepad_lost(&pad, port);
    for (int h = 0; h < MAP_HANDS; h++)
        assert_true(port[h].push_mm_s == 0 && port[h].twist_deg_s == 0);
    free(map);
}

static void built_in_and_example_maps_are_good(void **state)
{
    (void)state;
    for (int i = 0; i < BUILT_IN_COUNT; i++) {
        DeviceMap *map = must_parse(device_map_built_in_text((BuiltInMap)i));
        assert_true(map->axis_count >= 2);
        free(map);
    }
    DIR *folder = opendir(SOURCE_DIR "/scenes/devices");
    int count = 0;
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder));) {
        char path[512];
        if (entry->d_name[0] == '.')
            continue;
        snprintf(path, sizeof path, SOURCE_DIR "/scenes/devices/%s", entry->d_name);
        faults_clear(&faults);
        DeviceMap *map = device_map_load(path, &faults);
        if (!map)
            fail_msg("%s", faults.text[0]);
        free(map);
        count++;
    }
    closedir(folder);
    assert_true(count >= 5);
}

static void deflections_are_odd_monotone_and_continuous(void **state)
{
    (void)state;
    for (double dead = 0; dead < 0.9; dead += 0.11)
        for (double exponent = 0.5; exponent <= 4; exponent += 0.5) {
            double before = -1;
            assert_true(map_shape(0, dead, exponent) == 0 && near(map_shape(1, dead, exponent), 1) && near(map_shape(-1, dead, exponent), -1));
            for (int i = -1000; i <= 1000; i++) {
                double d = i / 1000.0, shaped = map_shape(d, dead, exponent);
                assert_true(shaped == -map_shape(-d, dead, exponent));
                assert_true(shaped >= before && fabs(shaped) <= 1);
                if (fabs(d) <= dead)
                    assert_true(shaped == 0);
                before = shaped;
            }
            // just beyond the dead zone there is no step: |shape| <= (step / (1 - dead))^exponent
            double step = 1e-6;
            assert_true(map_shape(dead + step, dead, exponent) <= pow(1.01 * step / (1 - dead), exponent));
        }
}

static void calibration_puts_ends_and_centre_where_it_says(void **state)
{
    (void)state;
    // a centre outside the middle: both sides reach full deflection
    assert_true(near(map_deflection(100, 100, 300, 1000), -1) && map_deflection(300, 100, 300, 1000) == 0 && near(map_deflection(1000, 100, 300, 1000), 1));
    assert_true(near(map_deflection(650, 100, 300, 1000), 0.5) && near(map_deflection(200, 100, 300, 1000), -0.5));
    assert_true(near(map_deflection(5000, 100, 300, 1000), 1) && near(map_deflection(-5000, 100, 300, 1000), -1));
    assert_true(map_deflection(-3, 0, 0, 10) == 0 && near(map_deflection(5, 0, 0, 10), 0.5));    // one-sided, a trigger
    for (int raw = 0; raw < 256; raw++)    // mirrored about the middle of a range of even length
        assert_true(near(map_deflection(raw, 0, 127.5, 255), -map_deflection(255 - raw, 0, 127.5, 255)));
}

static void counters_go_on_over_their_wrap(void **state)
{
    (void)state;
    assert_true(map_counter_step(65530, 4, 65536) == 10 && map_counter_step(4, 65530, 65536) == -10);
    assert_true(map_counter_step(-32760, 32760, 65536) == -16 && map_counter_step(1000, 1000, 65536) == 0);
    assert_true(map_counter_step(10, 250, 0) == 240);
    // a rotation at any step below half a turn adds up, wherever the counter wraps
    uint64_t random = 7;
    int64_t position = 0, counted = 0;
    for (int i = 0; i < 20000; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        int64_t step = (int64_t)(random >> 40) % 1000 - 500, next = position + step;
        double a = (double)(((position % 1024) + 1024) % 1024), b = (double)(((next % 1024) + 1024) % 1024);
        counted += (int64_t)map_counter_step(a, b, 1024);
        position = next;
    }
    assert_int_equal(counted, position);
}

// The same rotation of a roller, reported at once, count by count, or in between: the port is the same.
static void ways_do_not_depend_on_how_often_is_reported(void **state)
{
    (void)state;
    HidDescriptor *mouse = descriptor_of(boot_mouse);
    DeviceMap *map = must_parse(TOP "device: {usage: mouse}\npush: {source: Y, mm_per_count: 0.1}\ntwist: {source: X, deg_per_count: 0.7, invert: true}\n");
    double advanced[3], turned[3];
    const int chunk[3] = {1, 7, 126};
    for (int k = 0; k < 3; k++) {
        MapState device;
        HandPort port = {0};
        assert_true(map_bind_hid(map, mouse, "mouse", &device, &faults));
        for (int left = 126 * 21; left > 0; left -= chunk[k]) {
            const uint8_t report[] = {0, (uint8_t)-chunk[k], (uint8_t)chunk[k]};
            assert_true(map_take_report(map, mouse, report, sizeof report, &device));
        }
        map_publish(map, &device, &port);
        advanced[k] = port.advanced_mm;
        turned[k] = port.turned_deg;
        assert_true(port.push_mm_s == 0 && port.twist_deg_s == 0);
    }
    assert_true(near(advanced[0], 0.1 * 126 * 21) && near(turned[0], 0.7 * 126 * 21));
    assert_true(advanced[0] == advanced[1] && advanced[1] == advanced[2] && turned[0] == turned[1] && turned[1] == turned[2]);
    free(mouse);
    free(map);
}

static void real_reports_become_rates(void **state)
{
    (void)state;
    HidDescriptor *wheel = descriptor_of(driving_force_pro);
    DeviceMap *map = device_map_built_in(BUILT_IN_HID_JOYSTICK);
    MapState device;
    HandPort port = {0};
    assert_true(map_bind_hid(map, wheel, "wheel", &device, &faults));
    // X full left, button 2, hat north-east (1), Y far away
    assert_true(map_take_report(map, wheel, (const uint8_t[]){0, 0x80, 0, 0x10, 0, 0, 0, 0}, 8, &device));
    map_publish(map, &device, &port);
    assert_true(near(port.push_mm_s, 40 + 2) && near(port.twist_deg_s, -240 + 20));
    assert_int_equal(port.buttons, HAND_CONTRAST);
    // hat released (8, outside its range), X and Y as near to the middle as possible
    assert_true(map_take_report(map, wheel, (const uint8_t[]){0xff, 0x1f, 0, 0x80, 127, 0, 0, 0}, 8, &device));
    map_publish(map, &device, &port);
    assert_true(port.push_mm_s == 0 && port.twist_deg_s == 0 && port.buttons == 0);
    assert_false(map_take_report(map, wheel, (const uint8_t[]){0, 0, 0, 0, 0, 0, 0}, 7, &device));
    assert_int_equal(device.bad_reports, 1);
    map_take_report(map, wheel, (const uint8_t[]){0, 0x80, 0, 0x10, 0, 0, 0, 0}, 8, &device);
    map_release(map, &device);
    map_publish(map, &device, &port);
    assert_true(port.push_mm_s == 0 && port.twist_deg_s == 0 && port.buttons == 0);
    free(map);
    // buttons that push, an axis as a pedal, a pedal that is open at rest
    map = must_parse(TOP "device: {usage: joystick}\npush: [{source: button_5, mm_s: 3}, {source: button_6, mm_s: 3, invert: true}]\n"
                         "pedal: {source: Y, above: 0.5}\ncontrast: {source: button_1, invert: true}\n");
    assert_true(map_bind_hid(map, wheel, "wheel", &device, &faults));
    map_publish(map, &device, &port);
    assert_int_equal(port.buttons, 0);    // before the first report nothing is pressed, inverted or not
    assert_true(map_take_report(map, wheel, (const uint8_t[]){0, 0, 0x04, 0x80, 192, 0, 0, 0}, 8, &device));
    map_publish(map, &device, &port);
    assert_true(near(port.push_mm_s, 3) && port.buttons == (HAND_PEDAL | HAND_CONTRAST));
    assert_true(map_take_report(map, wheel, (const uint8_t[]){0, 0x40, 0x08, 0x80, 190, 0, 0, 0}, 8, &device));
    map_publish(map, &device, &port);
    assert_true(near(port.push_mm_s, -3) && port.buttons == 0);
    free(wheel);
    free(map);
}

static void a_map_that_a_device_cannot_fill_is_refused(void **state)
{
    (void)state;
    HidDescriptor *mouse = descriptor_of(boot_mouse), *space = descriptor_of(space_mouse);
    MapState device;
    DeviceMap *map = must_parse(TOP "device: {usage: mouse}\npush: {source: Rz, mm_s: 1}\ntwist: {source: X, deg_s: 5}\npedal: {source: button_9}\n");
    assert_false(map_bind_hid(map, mouse, "mouse", &device, &faults));
    assert_int_equal(faults.count, 3);    // no Rz, X is relative, no button 9: all faults at once, each with its position
    assert_non_null(strstr(faults.text[0], "m.yaml:3:"));
    assert_non_null(strstr(faults.text[1], "deg_per_count"));
    free(map);
    // a SpaceMouse describes its deflections as relative; the map corrects that
    map = must_parse(TOP "device: {usage: multi_axis}\npush: {source: Y, mm_s: 35, dead_zone: 0, kind: deflection}\n");
    HandPort port = {0};
    assert_true(map_bind_hid(map, space, "space mouse", &device, &faults));
    assert_true(map_take_report(map, space, (const uint8_t[]){1, 0, 0, 175, 0, 0, 0}, 7, &device));
    map_publish(map, &device, &port);
    assert_true(near(port.push_mm_s, 17.5));
    free(map);
    free(mouse);
    free(space);
}

static void gamepads_are_plain_arrays(void **state)
{
    (void)state;
    DeviceMap *map = device_map_built_in(BUILT_IN_GAMEPAD);
    Gamepad pad = {0};
    HandPort port = {0};
    faults_clear(&faults);
    assert_true(gamepad_bind(&pad, map, 6, 15, "pad", &faults));
    float axes[6] = {0, -1, 0, 0, -1, -1};
    unsigned char buttons[15] = {0};
    gamepad_update(&pad, axes, 6, buttons, 15, &port);
    assert_true(near(port.push_mm_s, 40) && port.twist_deg_s == 0 && port.buttons == 0 && port.state == HAND_READY);
    axes[1] = 0.14f;      // within the dead zone
    axes[2] = -1;
    axes[5] = 0.2f;       // trigger more than half way
    buttons[1] = 1;
    gamepad_update(&pad, axes, 6, buttons, 15, &port);
    assert_true(port.push_mm_s == 0 && near(port.twist_deg_s, -240));
    assert_int_equal(port.buttons, HAND_PEDAL | HAND_STOP);
    axes[2] = NAN;        // invalid values of a driver change nothing
    gamepad_update(&pad, axes, 6, buttons, 15, &port);
    assert_true(near(port.twist_deg_s, -240));
    gamepad_lost(&pad, &port);
    assert_true(port.push_mm_s == 0 && port.twist_deg_s == 0 && port.buttons == 0 && port.state == HAND_LOST);
    assert_false(gamepad_bind(&pad, map, 2, 15, "pad", &faults));
    int vendor, product;
    assert_true(gamepad_ids_of_guid("030000004c050000cc09000011010000", &vendor, &product));
    assert_true(vendor == 0x054c && product == 0x09cc);
    assert_false(gamepad_ids_of_guid("05000000536f6d65206e616d65000000", &vendor, &product));
    assert_false(gamepad_ids_of_guid("03000000", &vendor, &product));
    const DeviceMap *maps[] = {map};
    assert_ptr_equal(gamepad_choose_map(maps, 1, true, "x"), map);
    assert_null(gamepad_choose_map(maps, 1, false, "x"));
    free(map);
}

// The user's speeds: factors of push and twist apart; a negative one inverts, and twice inverted is as before.
static void built_in_maps_are_scaled(void **state)
{
    (void)state;
    DeviceMap *map = device_map_built_in(BUILT_IN_GAMEPAD), *usual = device_map_built_in(BUILT_IN_GAMEPAD);
    assert_true(map && usual && map->axis_count > 2);
    device_map_scale(map, 0.5, -2);
    for (int i = 0; i < map->axis_count; i++) {
        const bool is_twist = map->axis[i].is_twist;
        assert_true(map->axis[i].scale == usual->axis[i].scale * (is_twist ? 2 : 0.5));
        assert_int_equal(map->axis[i].invert, usual->axis[i].invert != is_twist);
    }
    device_map_scale(map, 2, -0.5);
    for (int i = 0; i < map->axis_count; i++)
        assert_true(map->axis[i].scale == usual->axis[i].scale && map->axis[i].invert == usual->axis[i].invert);
    free(map);
    free(usual);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_fault_comes_in_one_pass),
        cmocka_unit_test(what_does_not_fit_together_is_reported),
        cmocka_unit_test(tools_are_found_in_the_scene),
        cmocka_unit_test(a_device_moves_several_tools),
        cmocka_unit_test(a_gamepad_has_a_tool_in_each_stick),
        cmocka_unit_test(built_in_and_example_maps_are_good),
        cmocka_unit_test(deflections_are_odd_monotone_and_continuous),
        cmocka_unit_test(calibration_puts_ends_and_centre_where_it_says),
        cmocka_unit_test(counters_go_on_over_their_wrap),
        cmocka_unit_test(ways_do_not_depend_on_how_often_is_reported),
        cmocka_unit_test(real_reports_become_rates),
        cmocka_unit_test(a_map_that_a_device_cannot_fill_is_refused),
        cmocka_unit_test(gamepads_are_plain_arrays),
        cmocka_unit_test(built_in_maps_are_scaled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

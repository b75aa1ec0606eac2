// Report descriptors of real and broken devices; values read and written at every bit offset.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "input/hid_report.h"
#include "tests/input/hid_recordings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Faults faults;

static HidDescriptor *parse(const uint8_t *bytes, size_t length)
{
    faults_clear(&faults);
    // an exact copy, so that a read past the end is detected
    uint8_t *copy = malloc(length ? length : 1);
    assert_non_null(copy);
    if (length)
        memcpy(copy, bytes, length);
    HidDescriptor *descriptor = hid_descriptor_parse(copy, length, "device", &faults);
    free(copy);
    assert_int_equal(descriptor == NULL, faults.count > 0);
    return descriptor;
}

static HidDescriptor *parse_hex(const char *hex)
{
    uint8_t bytes[HID_DESCRIPTOR_LIMIT + 8];
    return parse(bytes, hid_bytes(hex, bytes));
}

static void expect_field(const HidDescriptor *descriptor, const char *usage, int index, int id, int bit, int size, int64_t min, int64_t max)
{
    int slot;
    const HidField *field = hid_find_usage(descriptor, HID_INPUT, hid_usage_of_name(usage), index, -1, &slot);
    if (!field)
        fail_msg("no field %s", usage);
    if (field->report_id != id || field->bit + slot * field->size != bit || field->size != size || field->logical_min != min || field->logical_max != max)
        fail_msg("%s: id %d, bit %d, size %d, %lld to %lld", usage, field->report_id, field->bit, field->size, (long long)field->logical_min,
                 (long long)field->logical_max);
}

static int64_t value_of(const HidDescriptor *descriptor, const char *usage, const uint8_t *report, size_t length)
{
    const HidReport *which;
    const uint8_t *payload;
    size_t payload_length;
    int slot;
    int64_t value = INT64_MIN;
    assert_int_equal(hid_report_open(descriptor, HID_INPUT, report, length, &which, &payload, &payload_length), HID_REPORT_GOOD);
    const HidField *field = hid_find_usage(descriptor, HID_INPUT, hid_usage_of_name(usage), 0, -1, &slot);
    assert_non_null(field);
    assert_int_equal(field->report_id, which->id);
    assert_true(hid_field_read(field, slot, payload, payload_length, &value));
    return value;
}

static void real_devices_are_read_as_their_makers_say(void **state)
{
    (void)state;
    HidDescriptor *mouse = parse_hex(boot_mouse), *tablet = parse_hex(qemu_tablet), *wheel = parse_hex(driving_force_pro), *pad = parse_hex(dualshock_4),
                  *xbox = parse_hex(xbox_one_s), *space = parse_hex(space_mouse), *stick = parse_hex(sidewinder_2);
    assert_true(mouse && tablet && wheel && pad && xbox && space && stick);
    expect_field(mouse, "Y", 0, 0, 16, 8, -127, 127);
    assert_int_equal(value_of(mouse, "Y", (const uint8_t[]){0, 5, 0xfb}, 3), -5);
    expect_field(tablet, "X", 0, 0, 8, 16, 0, 32767);
    assert_int_equal(value_of(tablet, "Y", (const uint8_t[]){1, 0x34, 0x12, 0xff, 0x7f, 0xff}, 6), 32767);
    assert_int_equal(value_of(tablet, "wheel", (const uint8_t[]){1, 0x34, 0x12, 0xff, 0x7f, 0xff}, 6), -1);
    // 14 bits of steering, then 14 buttons, then the hat, from bit 0 on
    expect_field(wheel, "X", 0, 0, 0, 14, 0, 16383);
    expect_field(wheel, "hat_switch", 0, 0, 28, 4, 0, 7);
    assert_int_equal(value_of(wheel, "X", (const uint8_t[]){0xff, 0x5f, 0, 0x80, 0, 0, 0, 0}, 8), 0x1fff);
    assert_int_equal(value_of(wheel, "button_1", (const uint8_t[]){0xff, 0x5f, 0, 0x80, 0, 0, 0, 0}, 8), 1);
    assert_int_equal(value_of(wheel, "button_2", (const uint8_t[]){0xff, 0x5f, 0, 0x80, 0, 0, 0, 0}, 8), 0);
    assert_int_equal(value_of(wheel, "hat_switch", (const uint8_t[]){0xff, 0x5f, 0, 0x80, 0, 0, 0, 0}, 8), 8);
    assert_int_equal(pad->input_bytes, 64);
    assert_int_equal(pad->output_bytes, 32);
    expect_field(pad, "Rz", 0, 1, 24, 8, 0, 255);
    expect_field(pad, "button_14", 0, 1, 49, 1, 0, 1);
    expect_field(xbox, "Rx", 0, 1, 32, 16, 0, 65535);
    expect_field(xbox, "Rz", 0, 1, 80, 10, 0, 1023);
    expect_field(space, "Rz", 0, 2, 32, 16, -350, 350);
    expect_field(stick, "X", 0, 1, 0, 10, -512, 511);
    assert_int_equal(value_of(stick, "Y", (const uint8_t[]){1, 0, 0, 0x00, 0x02, 0, 0, 0, 0, 0, 0, 0, 0}, 13), -512);
    free(mouse), free(tablet), free(wheel), free(pad), free(xbox), free(space), free(stick);
}

static void arrays_say_which_keys_are_down(void **state)
{
    (void)state;
    HidDescriptor *keyboard = parse_hex(qemu_keyboard);
    assert_non_null(keyboard);
    const HidField *array = NULL;
    for (int i = 0; i < keyboard->field_count; i++)
        if (keyboard->field[i].range_count > 0)
            array = &keyboard->field[i];
    assert_non_null(array);
    const uint8_t report[] = {0x02, 0, 0x04, 0x1d, 0, 0, 0, 0};    // shift, a, z
    assert_true(hid_array_has(keyboard, array, HID_USAGE(7, 4), report, sizeof report));
    assert_true(hid_array_has(keyboard, array, HID_USAGE(7, 0x1d), report, sizeof report));
    assert_false(hid_array_has(keyboard, array, HID_USAGE(7, 5), report, sizeof report));
    assert_false(hid_array_has(keyboard, array, HID_USAGE(8, 4), report, sizeof report));
    assert_int_equal(array->logical_max, 255);    // written as one byte, FF
    free(keyboard);
}

static void globals_are_pushed_and_popped(void **state)
{
    (void)state;
    // X of 8 bits; push; Y of 16 bits; pop; Z of 8 bits again
    HidDescriptor *d = parse_hex("05010904a101150025647508950109308102"
                                 "a4"
                                 "26e803751009318102"
                                 "b4"
                                 "09328102c0");
    assert_non_null(d);
    expect_field(d, "X", 0, 0, 0, 8, 0, 100);
    expect_field(d, "Y", 0, 0, 8, 16, 0, 1000);
    expect_field(d, "Z", 0, 0, 24, 8, 0, 100);
    free(d);
}

static void usages_are_given_out_in_order_and_the_last_stays(void **state)
{
    (void)state;
    // X, then the range Y to Rx, for 6 controls: X Y Z Rx Rx Rx; a full usage overrides the page
    HidDescriptor *d = parse_hex("05010904a10115002501750895060930"
                                 "19312933"
                                 "81029501"
                                 "0b34000100"
                                 "8102c0");
    assert_non_null(d);
    expect_field(d, "Z", 0, 0, 16, 8, 0, 1);
    expect_field(d, "Rx", 0, 0, 24, 8, 0, 1);
    expect_field(d, "Rx", 2, 0, 40, 8, 0, 1);
    expect_field(d, "Ry", 0, 0, 48, 8, 0, 1);
    int slot;
    assert_null(hid_find_usage(d, HID_INPUT, HID_USAGE(1, 0x33), 3, -1, &slot));
    free(d);
}

static void delimiters_long_items_and_padding_are_passed(void **state)
{
    (void)state;
    HidDescriptor *d = parse_hex("05010904a101"
                                 "fe02f0aabb"
                                 "1500257f75089501"
                                 "a9010930093ba900"
                                 "8102c0"
                                 "0000");
    assert_non_null(d);
    expect_field(d, "X", 0, 0, 0, 8, 0, 127);    // the first of the set
    assert_int_equal(d->field_count, 1);
    free(d);
}

static void ends_of_ranges_have_the_sign_of_the_minimum(void **state)
{
    (void)state;
    HidDescriptor *d = parse_hex("05010904a101150025ff750895010930810215802500093181021500"
                                 "27ffffffff7520"
                                 "09328102c0");
    assert_non_null(d);
    expect_field(d, "X", 0, 0, 0, 8, 0, 255);
    expect_field(d, "Y", 0, 0, 8, 8, -128, 0);
    expect_field(d, "Z", 0, 0, 16, 32, 0, 4294967295);
    assert_int_equal(value_of(d, "Z", (const uint8_t[]){0, 0, 0xff, 0xff, 0xff, 0xff}, 6), 4294967295);
    free(d);
}

static void lies_are_refused_with_the_reason(void **state)
{
    (void)state;
    static const struct {
        const char *hex, *words;
    } cases[] = {
        {"", "0 bytes"},
        {"0501", "no field"},
        {"05010904a1", "truncated"},
        {"05010904a10115002501750095010930810 2c0", "0 bits"},
        {"05010904a101150025017521950109308102c0", "at most 32"},
        {"05010904a101150a2505750895010930810 2c0", "range from 10 to 5"},
        {"05010904a10115ff25fe750895010930810 2c0", "range from -1 to -2"},
        {"05010904a10115002501750895010930810 2", "not closed"},
        {"05010904a10115002501750895010930810 2c0c0", "without its beginning"},
        {"05010904a101b4c0", "a pop without a push"},
        {"05010904a101a415002501750895010930810 2c0", "not popped"},
        {"05010904a1011500250175089501093081028501093181 02c0", "after fields without one"},
        {"05010904a1018500150025017508950109308102c0", "report id 0"},
        {"05010904a101860001150025017508950109308102c0", "report id 256"},
        {"05010904a10115002501750896ffff09308102c0", "at most 65536 bits"},
        {"05010904a10115002501750897ffffffff09308102c0", "at most 65536 bits"},
        {"05010904a101150025017520960004093081029600040931810296000409328102c0", "grows to"},
        {"05010904a1012933c0", "maximum without a minimum"},
        {"05010904a101193329308102c0", "expected a rising range"},
        {"05010904a101a90109308102c0", "not closed"},
        {"05000904a101c0", "usage page 0x0"},
        {"05010904a1010dc0", "reserved type"},
        {"05010904a101f400c0", "unknown global item"},
        {"05010904a101f000c0", "unknown main item"},
        {"fe10f00000", "long item"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char hex[256];
        size_t used = 0;
        for (const char *at = cases[i].hex; *at; at++)
            if (*at != ' ')
                hex[used++] = *at;
        hex[used] = 0;
        HidDescriptor *d = parse_hex(hex);
        if (d || faults.count != 1 || !strstr(faults.text[0], cases[i].words))
            fail_msg("%s gave '%s'; expected %s", hex, faults.count ? faults.text[0] : "no fault", cases[i].words);
    }
}

static void limits_hold(void **state)
{
    (void)state;
    uint8_t bytes[HID_DESCRIPTOR_LIMIT + 1];
    memset(bytes, 0xa4, sizeof bytes);
    assert_null(parse(bytes, HID_DESCRIPTOR_LIMIT));
    assert_non_null(strstr(faults.text[0], "pushed more than"));
    assert_null(parse(bytes, sizeof bytes));
    assert_non_null(strstr(faults.text[0], "4097 bytes"));
    for (size_t i = 0; i < HID_DESCRIPTOR_LIMIT; i += 2)
        bytes[i] = 0xa1, bytes[i + 1] = 1;
    assert_null(parse(bytes, HID_DESCRIPTOR_LIMIT));
    assert_non_null(strstr(faults.text[0], "nested more than"));
    // 65,535 usages for as many one-bit fields: more fields than the limit are reported and not stored
    assert_null(parse_hex("05010904a10115002501750196ff7f1a01002affff8102c0"));
    assert_non_null(strstr(faults.text[0], "more than 1024 fields"));
}

static void every_bit_offset_and_size_makes_the_round_trip(void **state)
{
    (void)state;
    uint64_t random = 1;
    for (int size = 1; size <= 32; size++)
        for (int bit = 0; bit < 40; bit++)
            for (int is_signed = 0; is_signed < 2; is_signed++) {
                int64_t min = is_signed ? -((int64_t)1 << (size - 1)) : 0, max = is_signed ? ((int64_t)1 << (size - 1)) - 1 : ((int64_t)1 << size) - 1;
                HidField field = {.bit = bit, .size = size, .count = 2, .logical_min = min, .logical_max = max};
                size_t length = ((size_t)bit + 2 * (size_t)size + 7) / 8;
                uint8_t *payload = malloc(length), *before = malloc(length);
                for (int trial = 0; trial < 6; trial++) {
                    random = random * 6364136223846793005u + 1442695040888963407u;
                    int64_t span = max - min + 1, value = trial == 0 ? min : trial == 1 ? max : min + (int64_t)((random >> 16) % (uint64_t)span), read;
                    for (size_t i = 0; i < length; i++)
                        before[i] = payload[i] = (uint8_t)(random >> i % 7);
                    int index = trial % 2;
                    assert_true(hid_field_write(&field, index, payload, length, value));
                    assert_true(hid_field_read(&field, index, payload, length, &read));
                    assert_int_equal(read, value);
                    for (int b = 0; b < (int)length * 8; b++)    // no other bit has changed
                        if (b < bit + index * size || b >= bit + (index + 1) * size)
                            assert_int_equal(payload[b / 8] >> b % 8 & 1, before[b / 8] >> b % 8 & 1);
                }
                int64_t none;
                assert_false(hid_field_read(&field, 1, payload, ((size_t)bit + 2 * (size_t)size - 1) / 8, &none));
                assert_false(hid_field_write(&field, 2, payload, length, 0));
                assert_false(hid_field_read(&field, -1, payload, length, &none));
                free(payload);
                free(before);
            }
}

static void short_reports_and_unknown_ones_are_distinguished(void **state)
{
    (void)state;
    HidDescriptor *d = parse_hex(xbox_one_s);
    assert_non_null(d);
    uint8_t report[17] = {1};
    const HidReport *which;
    const uint8_t *payload;
    size_t length;
    for (size_t n = 0; n < 16; n++)
        assert_int_equal(hid_report_open(d, HID_INPUT, report, n, &which, &payload, &length), HID_REPORT_SHORT);
    assert_int_equal(hid_report_open(d, HID_INPUT, report, 16, &which, &payload, &length), HID_REPORT_GOOD);
    assert_int_equal(hid_report_open(d, HID_INPUT, report, 17, &which, &payload, &length), HID_REPORT_GOOD);
    report[0] = 77;
    assert_int_equal(hid_report_open(d, HID_INPUT, report, 16, &which, &payload, &length), HID_REPORT_UNKNOWN_ID);
    free(d);
}

static void every_prefix_of_a_real_descriptor_is_whole_or_refused(void **state)
{
    (void)state;
    uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    for (int i = 0; i < HID_RECORDING_COUNT; i++) {
        size_t length = hid_bytes(hid_recordings[i].hex, bytes);
        HidDescriptor *whole = parse(bytes, length);
        if (!whole)
            fail_msg("%s: %s", hid_recordings[i].name, faults.text[0]);
        free(whole);
        int good = 0;
        for (size_t n = 0; n < length; n++) {
            HidDescriptor *part = parse(bytes, n);
            good += part != NULL;
            free(part);
        }
        // the outermost collection ends with the last item; only padding, which some devices add, may be cut off
        if (good > 1)
            fail_msg("%s: %d prefixes were taken for whole", hid_recordings[i].name, good);
    }
}

static void usages_have_names_both_ways(void **state)
{
    (void)state;
    static const char *const names[] = {"X", "Rz", "wheel", "hat_switch", "button_12", "joystick", "multi_axis", "0xff00:0x0020", "0x0009:0x0000"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char name[32];
        hid_usage_name(hid_usage_of_name(names[i]), name, sizeof name);
        assert_string_equal(name, names[i]);
    }
    assert_int_equal(hid_usage_of_name("1:49"), HID_USAGE(1, 49));
    static const char *const none[] = {"", "x", "button_", "button_0", "button_70000", "1:", ":1", "1:2:3", "0x10000:1", "button_1x", "-1:2"};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++)
        assert_int_equal(hid_usage_of_name(none[i]), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(real_devices_are_read_as_their_makers_say),
        cmocka_unit_test(arrays_say_which_keys_are_down),
        cmocka_unit_test(globals_are_pushed_and_popped),
        cmocka_unit_test(usages_are_given_out_in_order_and_the_last_stays),
        cmocka_unit_test(delimiters_long_items_and_padding_are_passed),
        cmocka_unit_test(ends_of_ranges_have_the_sign_of_the_minimum),
        cmocka_unit_test(lies_are_refused_with_the_reason),
        cmocka_unit_test(limits_hold),
        cmocka_unit_test(every_bit_offset_and_size_makes_the_round_trip),
        cmocka_unit_test(short_reports_and_unknown_ones_are_distinguished),
        cmocka_unit_test(every_prefix_of_a_real_descriptor_is_whole_or_refused),
        cmocka_unit_test(usages_have_names_both_ways),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

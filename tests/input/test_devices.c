// The verb `devices` on any machine: exit code 0, output, and faults of wrong use and wrong maps.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "input/devices_watch.h"
#include "input/hand.h"
#include "tests/input/fake_hid.h"
#include "tests/input/hid_recordings.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

// Puts both outputs of the program into the buffer; returns its exit code.
static int run(const char *arguments, char *message, size_t capacity)
{
    char command[1024];
    snprintf(command, sizeof command, "'%s' devices %s 2>&1", SELDINGER_PROGRAM, arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t used = fread(message, 1, capacity - 1, pipe);
    message[used] = 0;
    int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static char message[1 << 18];

static void the_list_names_all_kinds(void **state)
{
    (void)state;
    assert_int_equal(run("", message, sizeof message), 0);
    assert_true(strstr(message, "HID devices") && strstr(message, "USB serial encoders"));
    assert_int_equal(run("--map scenes/devices/roller.yaml --map scenes/devices/serial_encoder.yaml --quiet", message, sizeof message), 0);
    assert_string_equal(message, "");
    assert_int_equal(run("--map scenes/devices/roller.yaml", message, sizeof message), 0);
    assert_non_null(strstr(message, "scenes/devices/roller.yaml: '"));
    assert_int_equal(run("--watch --duration-s 0.05", message, sizeof message), 0);
}

static void the_json_is_whole(void **state)
{
    (void)state;
    assert_int_equal(run("--map scenes/devices/roller.yaml --json -", message, sizeof message), 0);
    cJSON *object = cJSON_Parse(message);
    assert_non_null(object);
    const cJSON *map = cJSON_GetArrayItem(cJSON_GetObjectItem(object, "maps"), 0);
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(map, "file")), "scenes/devices/roller.yaml");
    static const char *const arrays[] = {"maps", "hid", "usb", "joysticks", "events"};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        assert_true(cJSON_IsArray(cJSON_GetObjectItem(object, arrays[i])));
    assert_true(cJSON_IsBool(cJSON_GetObjectItem(object, "has_hidraw")));
    cJSON_Delete(object);
}

static void wrong_use_and_wrong_maps_are_reported(void **state)
{
    (void)state;
    char path[] = "/tmp/seldinger-map-XXXXXX", arguments[64];
    int file = mkstemp(path);
    assert_true(file >= 0);
    static const char text[] = "seldinger_device: 1\ndevice: {usage: joystick}\npush: {source: Y, mm: 3}\n";
    assert_int_equal(write(file, text, sizeof text - 1), (long)sizeof text - 1);
    close(file);
    snprintf(arguments, sizeof arguments, "--map %s", path);
    assert_int_equal(run(arguments, message, sizeof message), 2);
    assert_non_null(strstr(message, ":3:"));
    assert_null(strstr(message, "HID devices"));
    unlink(path);
    static const char *const wrong[] = {
        "--nothing", "file.yaml", "--map", "--map /nowhere.yaml", "--duration-s 3", "--watch --duration-s -1", "--json /nowhere/f.json"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        if (run(wrong[i], message, sizeof message) != 2 || !message[0])
            fail_msg("devices %s printed '%s'", wrong[i], message);
    assert_int_equal(run("--help", message, sizeof message), 0);
    assert_non_null(strstr(message, "--watch"));
}

// The list and the output of --watch for a simulated device (fake_hid.h).
static void watching_shows_raw_values_and_what_the_map_makes_of_them(void **state)
{
    (void)state;
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    static Faults faults;
    FakeHid *hid = calloc(1, sizeof *hid);
    assert_non_null(hid);
    HidTransport transport = fake_transport(hid);
    size_t length = hid_bytes(sidewinder_2, bytes);
    fake_plug(hid, 0, 0x045e, 0x001b, "", HID_USAGE(1, 4), bytes, (int)length);
    HidListing listing = {
        .info = hid->device[0].info, .descriptor = hid_descriptor_parse(bytes, length, "stick", &faults), .map = device_map_built_in(BUILT_IN_HID_HAPTIC)};
    fake_report(hid, 0, (const uint8_t[]){1, 0, 0, 0xf0, 1, 0, 0, 0x8f, 0}, 9);      // Y at 496, hat released
    fake_report(hid, 0, (const uint8_t[]){1, 0, 0}, 3);                              // short
    fake_report(hid, 0, (const uint8_t[]){1, 0xff, 1, 0, 0xfe, 0, 0, 0x8f, 1}, 9);   // X at 511, Y at -512, button 1
    char path[] = "/tmp/seldinger-watch-XXXXXX";
    int file = mkstemp(path), kept = dup(STDOUT_FILENO);
    assert_true(file >= 0 && kept >= 0);
    fflush(stdout);
    dup2(file, STDOUT_FILENO);
    bool watched = devices_watch(&transport, &listing, 1, 0.2), none = devices_watch(&transport, NULL, 0, 0.2);
    fflush(stdout);
    dup2(kept, STDOUT_FILENO);
    message[pread(file, message, sizeof message - 1, 0)] = 0;
    close(file);
    close(kept);
    unlink(path);
    assert_true(watched && !none);
    static const char *const words[] = {"2 reports, 1 not described by the descriptor", "logical_min -512, logical_max 496 so far", "twist 240.0 deg/s",
                                        "push 40.00 mm/s", ", pedal"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (!strstr(message, words[i]))
            fail_msg("'%s' is not in <<%s>>", words[i], message);
    free(listing.descriptor);
    free((void *)(uintptr_t)listing.map);
    free(hid);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_list_names_all_kinds),
        cmocka_unit_test(the_json_is_whole),
        cmocka_unit_test(watching_shows_raw_values_and_what_the_map_makes_of_them),
        cmocka_unit_test(wrong_use_and_wrong_maps_are_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

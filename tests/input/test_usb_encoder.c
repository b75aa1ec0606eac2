// Requests and data stream of the FTDI chip: baud rates by the table of the application note, status bytes removed wherever the data are split, invalid lines.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "input/usb_encoder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const MapSerial serial = {.baud = 115200, .count = {"A", "R"}, .count_count = 2, .bits = 32};

static void baud_rates_are_coded_as_ftdi_says(void **state)
{
    (void)state;
    // AN232B-05: divisors 10000, 5000, 2500, 1250, 625, 312.5, 156, 78, 52, 26, 13, 6.5 of 3 MHz, and the special cases 3 M, 2 M, 1 M
    static const struct {
        int baud;
        uint32_t divisor;
    } cases[] = {{300, 10000}, {600, 5000},  {1200, 2500},     {2400, 1250}, {4800, 625},  {9600, 0x4138},
                 {115200, 26}, {230400, 13}, {460800, 0x4006}, {3000000, 0}, {2000000, 1}, {1000000, 3}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double actual;
        uint32_t divisor = ftdi_baud_divisor(cases[i].baud, &actual);
        if (divisor != cases[i].divisor)
            fail_msg("%d baud gives 0x%x", cases[i].baud, (unsigned)divisor);
        assert_true(fabs(actual / cases[i].baud - 1) < 0.03);
    }
    // an encoded rate decodes to the same rate, for any rate; the seven fractions by their codes
    static const double fraction[] = {0, 0.5, 0.25, 0.125, 0.375, 0.625, 0.75, 0.875};
    for (int baud = 300; baud <= 1500000; baud += 37) {
        double actual;
        uint32_t divisor = ftdi_baud_divisor(baud, &actual);
        double decoded = (double)(divisor & 0x3fff) + fraction[divisor >> 14 & 7];
        assert_true(fabs(3e6 / decoded - actual) < 1e-6 * actual);
        assert_true(fabs(3e6 / decoded - baud) <= baud * (1.0 / 16) / (3e6 / baud) * 1.07 + 1e-6);    // to the nearest eighth
    }
}

static void a_chip_is_set_up_by_seven_requests(void **state)
{
    (void)state;
    FtdiRequest request[FTDI_SET_UP];
    ftdi_set_up(9600, 0, request);
    static const FtdiRequest expected[FTDI_SET_UP] = {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, {3, 0x4138, 0}, {4, 8, 0}, {2, 0, 0}, {9, 1, 0}};
    for (int i = 0; i < FTDI_SET_UP; i++)
        assert_true(request[i].request == expected[i].request && request[i].value == expected[i].value && request[i].index == expected[i].index);
    // 57,692 baud has a divisor of 52; the high bit of the code of 0.375 is in the index, beside the port if there are several
    ftdi_set_up(57277, 1, request);
    assert_int_equal(request[3].value, 52);
    assert_int_equal(request[3].index, 0x101);
    assert_int_equal(request[0].index, 1);
    ftdi_set_up(57277, 0, request);
    assert_int_equal(request[3].index, 1);
}

static bool line(const char *text, int64_t a, int64_t r)
{
    EncoderLine out = {.count = {-1, -1}};
    bool good = encoder_parse_line(&serial, text, strlen(text), &out);
    return good && (!out.fresh[0] || out.count[0] == a) && (!out.fresh[1] || out.count[1] == r) && out.fresh[0] == (a != INT64_MIN) &&
           out.fresh[1] == (r != INT64_MIN);
}

static void lines_are_counts_or_left_out(void **state)
{
    (void)state;
    assert_true(line("A12 R-3", 12, -3) && line("R-3 A12", 12, -3) && line("A=12,R:-3", 12, -3) && line("  A 12\tR +3 ", 12, 3) && line("A7", 7, INT64_MIN));
    assert_true(line("A4294967296", 4294967296, INT64_MIN) && line("R-2147483648", INT64_MIN, -2147483648));
    const char *bad[] = {"", " ", "A", "12", "A12R3", "A1 A2", "A-", "A1.5", "B1", "A4294967297", "A99999999999999999999", "A1 x", "a1", "A--1", "A0x10"};
    EncoderLine out;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (encoder_parse_line(&serial, bad[i], strlen(bad[i]), &out))
            fail_msg("'%s' was taken", bad[i]);
    const MapSerial longer = {.count = {"AX", "A"}, .count_count = 2};
    assert_true(encoder_parse_line(&longer, "A1 AX2", 6, &out) && out.count[0] == 2 && out.count[1] == 1);    // the longest name that fits
}

typedef struct Taken {
    int count;
    int64_t last[2], sum;
} Taken;

static void take(void *context, const EncoderLine *one)
{
    Taken *taken = context;
    taken->count++;
    for (int i = 0; i < 2; i++)
        if (one->fresh[i]) {
            taken->last[i] = one->count[i];
            taken->sum += one->count[i] * (i + 1);
        }
}

// `text` as a chip sends it: packets of 64 bytes with two status bytes, split into transfers of `chunk` characters.
static Taken stream_of(const char *text, size_t chunk, int64_t *bad_lines)
{
    FtdiStream stream = {0};
    Taken taken = {0};
    ftdi_stream_start(&stream);
    for (size_t at = 0, length = strlen(text); at < length; at += chunk) {
        size_t n = at + chunk < length ? chunk : length - at, packets = (n + 61) / 62;
        uint8_t *bytes = malloc(n + 2 * packets);
        size_t used = 0;
        for (size_t i = 0; i < n; i++) {
            if (i % 62 == 0)
                bytes[used++] = 0x01, bytes[used++] = 0x60;
            bytes[used++] = (uint8_t)text[at + i];
        }
        ftdi_stream_take(&stream, &serial, bytes, used, 64, take, &taken);
        free(bytes);
    }
    *bad_lines = stream.bad_lines;
    return taken;
}

static void a_stream_is_the_same_however_it_is_cut(void **state)
{
    (void)state;
    static char text[20000];
    size_t used = (size_t)sprintf(text, "34 R7\n");    // half a line first: its beginning was sent before the port was opened
    int64_t sum = 0, bad;
    for (int i = 0; i < 500; i++) {
        used += (size_t)sprintf(text + used, "A%d R%d\r\n", i * 7 - 1000, -i);
        sum += i * 7 - 1000 - 2 * i;
    }
    for (size_t chunk = 1; chunk < 300; chunk++) {
        Taken taken = stream_of(text, chunk, &bad);
        assert_int_equal(taken.count, 500);
        assert_int_equal(taken.sum, sum);
        assert_int_equal(bad, 0);
        assert_true(taken.last[0] == 499 * 7 - 1000 && taken.last[1] == -499);
    }
}

static void noise_overlong_lines_and_errors_lose_only_themselves(void **state)
{
    (void)state;
    char text[400] = "\nA1\n";
    int64_t bad;
    memset(text + strlen(text), 'A', 200);
    strcat(text, "\nA2\nhello\nA3 R4\n");
    Taken taken = stream_of(text, 50, &bad);
    assert_int_equal(taken.count, 3);
    assert_int_equal(bad, 2);
    assert_true(taken.last[0] == 3 && taken.last[1] == 4);
    // an overrun within a line: the rest of the line is not a count
    FtdiStream stream = {0};
    taken = (Taken){0};
    ftdi_stream_take(&stream, &serial,
                     (const uint8_t *)"\x01\x60"
                                      "A12",
                     5, 64, take, &taken);
    ftdi_stream_take(&stream, &serial,
                     (const uint8_t *)"\x01\x62"
                                      "34\nA5\n",
                     8, 64, take, &taken);
    assert_int_equal(taken.count, 1);
    assert_int_equal(taken.last[0], 5);
    assert_int_equal(stream.errors, 1);
    // status bytes alone, a packet of one byte, an empty packet
    ftdi_stream_take(&stream, &serial, (const uint8_t *)"\x01\x60", 2, 64, take, &taken);
    ftdi_stream_take(&stream, &serial, (const uint8_t *)"\x01", 1, 64, take, &taken);
    ftdi_stream_take(&stream, &serial, NULL, 0, 64, take, &taken);
    assert_int_equal(taken.count, 1);
}

static void only_serial_chips_that_the_map_means_are_taken(void **state)
{
    (void)state;
    DeviceMap map = {.device = {.kind = MAP_FTDI, .vendor_id = -1, .product_id = -1}};
    UsbDeviceInfo chip = {.vendor_id = 0x0403, .product_id = 0x6001, .serial = "A1"}, other = {.vendor_id = 0x0403, .product_id = 0xbca0, .serial = "B2"};
    assert_true(usb_encoder_fits(&map, &chip));
    assert_false(usb_encoder_fits(&map, &other));
    map.device.product_id = 0xbca0;
    assert_true(usb_encoder_fits(&map, &other) && !usb_encoder_fits(&map, &chip));
    map.device.product_id = -1;
    strcpy(map.device.serial, "B2");
    assert_true(usb_encoder_fits(&map, &other) && !usb_encoder_fits(&map, &chip));
    map.device.kind = MAP_HID;
    assert_false(usb_encoder_fits(&map, &other));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(baud_rates_are_coded_as_ftdi_says),
        cmocka_unit_test(a_chip_is_set_up_by_seven_requests),
        cmocka_unit_test(lines_are_counts_or_left_out),
        cmocka_unit_test(a_stream_is_the_same_however_it_is_cut),
        cmocka_unit_test(noise_overlong_lines_and_errors_lose_only_themselves),
        cmocka_unit_test(only_serial_chips_that_the_map_means_are_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

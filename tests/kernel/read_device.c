// Reads a HID device with the program's input layer (hidapi, descriptor, fields) and prints the content of each report in one line: `USAGE VALUE USAGE VALUE
// ...`, without constants. usage: read_device PRODUCT REPORTS. Prints `ready` once it listens; gives up after 30 s of silence.
#include "input/hid_device.h"
#include "input/hid_report.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEVICES = 32, SILENCE_MS = 30000 };

static void print_report(const HidDescriptor *descriptor, const uint8_t *bytes, size_t length)
{
    const HidReport *report;
    const uint8_t *payload;
    size_t payload_length;
    if (hid_report_open(descriptor, HID_INPUT, bytes, length, &report, &payload, &payload_length) != HID_REPORT_GOOD) {
        printf("bad report of %zu bytes\n", length);
        return;
    }
    for (int i = 0; i < descriptor->field_count; i++) {
        const HidField *field = &descriptor->field[i];
        char name[32];
        if (field->kind != HID_INPUT || field->report_id != report->id || field->flags & HID_CONSTANT)
            continue;
        hid_usage_name(field->usage, name, sizeof name);
        for (int slot = 0; slot < field->count; slot++) {
            int64_t value;
            if (hid_field_read(field, slot, payload, payload_length, &value))
                printf("%s %" PRId64 " ", name, value);
        }
    }
    printf("\n");
}

// Reads `reports` reports of the device at `path`; the exit status.
static int read_reports(HidTransport *hid, const HidDeviceInfo *info, long reports)
{
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT], report[HID_REPORT_BYTES];
    char why[512] = "", refused[4096] = "";
    static Faults faults;
    int length = hid->descriptor(hid->context, info->path, bytes, sizeof bytes);
    HidDescriptor *descriptor = length > 0 ? hid_descriptor_parse(bytes, (size_t)length, info->product, &faults) : NULL;
    void *device = descriptor ? hid->open(hid->context, info->path, why, sizeof why) : NULL;
    if (!device) {
        faults_print(&faults, refused, sizeof refused);
        fprintf(stderr, "read_device: %s: descriptor of %d bytes: %s%s\n", info->path, length, refused, why);
        free(descriptor);
        return 1;
    }
    printf("ready %04x:%04x %s\n", info->vendor_id, info->product_id, info->product);
    fflush(stdout);
    int got = 1;
    for (long i = 0; i < reports && got > 0; i++) {
        got = hid->read(hid->context, device, report, sizeof report, SILENCE_MS);
        if (got > 0)
            print_report(descriptor, report, (size_t)got);
        fflush(stdout);
    }
    hid->close(hid->context, device);
    free(descriptor);
    return got > 0 ? 0 : 1;
}

int main(int argc, char **argv)
{
    if (argc != 3 || atol(argv[2]) < 1) {
        fprintf(stderr, "usage: read_device PRODUCT REPORTS\n");
        return 2;
    }
    static HidDeviceInfo found[DEVICES];
    HidTransport *hid = hid_transport_hidapi();
    int count = hid ? hid->list(hid->context, found, DEVICES) : 0, status = 1, at = 0;
    while (at < count && at < DEVICES && strcmp(found[at].product, argv[1]) != 0)
        at++;
    if (at < count && at < DEVICES)
        status = read_reports(hid, &found[at], atol(argv[2]));
    else
        fprintf(stderr, "read_device: hidapi lists %d devices, none is called %s\n", count, argv[1]);
    hid_transport_hidapi_free(hid);
    return status;
}

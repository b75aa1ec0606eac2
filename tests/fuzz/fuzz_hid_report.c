// Any bytes as a report descriptor and reports: length of the descriptor (2 bytes), the descriptor, then reports, each after a length byte. For accepted
// descriptors, fields are within their reports, values within their bits, forces encoded completely, ports finite.
// Covers: input/hid_report.c input/force_feedback.c input/map_state.c
#include "input/force_feedback.h"
#include "input/map_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check_fields(const HidDescriptor *descriptor)
{
    for (int i = 0; i < descriptor->field_count; i++) {
        const HidField *field = &descriptor->field[i];
        const HidReport *report = hid_report_find(descriptor, field->kind, field->report_id);
        if (!report || field->bit < 0 || field->size < 1 || field->count < 1 || (int64_t)field->bit + (int64_t)field->size * field->count > report->bits ||
            report->bits > HID_REPORT_BITS || (!(field->flags & HID_CONSTANT) && (field->logical_min > field->logical_max || field->size > 32)) ||
            field->collection >= descriptor->collection_count || field->first_range + field->range_count > descriptor->range_count)
            abort();
    }
    for (int i = 0; i < descriptor->collection_count; i++)
        if (descriptor->collection[i].parent >= i)
            abort();
}

// `answer`: the reply of the device about a block and its memory.
static void try_force(const HidDescriptor *descriptor, const uint8_t *answer, size_t length)
{
    PidLayout layout;
    PidMessage message;
    char why[160];
    int64_t value;
    if (!pid_find(descriptor, &layout, why, sizeof why))
        return;
    bool (*const encode[])(const PidLayout *, PidMessage *) = {pid_encode_reset, pid_encode_enable, pid_encode_gain, pid_encode_create};
    for (size_t i = 0; i < sizeof encode / sizeof *encode; i++)
        if (encode[i](&layout, &message) && (message.length < 2 || message.length > PID_MESSAGE_BYTES))
            abort();
    for (double m = -1; m <= 1; m += 0.25)
        if (pid_encode_force(&layout, 1, m, &message, &value) && !hid_field_in_range(&layout.magnitude.field, value))
            abort();
    pid_encode_effect(&layout, 1, 123, &message);
    pid_encode_start(&layout, 1, &message);
    pid_encode_stop(&layout, 1, &message);
    int block = pid_decode_block_load(&layout, answer, length);
    pid_needs_host(&layout, answer, length);
    if (pid_duration_ms(&layout) < 0 || block < 0 || block > 255)
        abort();
}

static void read_all(const HidDescriptor *descriptor, const uint8_t *report, size_t length)
{
    const HidReport *which;
    const uint8_t *payload;
    size_t payload_length;
    if (hid_report_open(descriptor, HID_INPUT, report, length, &which, &payload, &payload_length) != HID_REPORT_GOOD)
        return;
    for (int i = 0; i < descriptor->field_count; i++) {
        const HidField *field = &descriptor->field[i];
        int64_t value;
        if (field->kind != HID_INPUT || field->report_id != which->id || field->size > 32)
            continue;
        if (!hid_field_read(field, field->count - 1, payload, payload_length, &value) || value < -((int64_t)1 << 32) || value > (int64_t)1 << 32)
            abort();
        if (field->range_count > 0)
            hid_array_has(descriptor, field, field->usage, payload, payload_length);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char counting[] = "seldinger_device: 1\ndevice: {usage: mouse}\npush: [{source: Y, mm_per_count: 1, optional: true}, "
                                   "{source: wheel, mm_per_count: 1, "
                                   "kind: counter, optional: true}]\ntwist: {source: X, deg_per_count: 1, optional: true}\n";
    static DeviceMap *maps[3];
    Faults faults;
    faults_clear(&faults);
    if (!maps[0]) {
        maps[0] = device_map_built_in(BUILT_IN_HID_JOYSTICK);
        maps[1] = device_map_built_in(BUILT_IN_HID_MULTI_AXIS);
        maps[2] = device_map_parse(counting, sizeof counting - 1, "counting", &faults);
    }
    if (size < 2 || !maps[0] || !maps[1] || !maps[2])
        return 0;
    size_t length = data[0] | (size_t)data[1] << 8;
    length = length < size - 2 ? length : size - 2;
    HidDescriptor *descriptor = hid_descriptor_parse(data + 2, length, "fuzz", &faults);
    if (!descriptor != (faults.count > 0))
        abort();
    if (!descriptor)
        return 0;
    check_fields(descriptor);
    try_force(descriptor, data + 2 + length, size - 2 - length);
    for (int i = 0; i < 3; i++) {
        MapState state;
        HandPort port = {0};
        faults_clear(&faults);
        if (!map_bind_hid(maps[i], descriptor, "fuzz", &state, &faults))
            continue;
        for (size_t at = 2 + length; at < size;) {
            size_t n = data[at] < size - at - 1 ? data[at] : size - at - 1;
            read_all(descriptor, data + at + 1, n);
            map_take_report(maps[i], descriptor, data + at + 1, n, &state);
            map_publish(maps[i], &state, &port);
            if (!isfinite(port.push_mm_s) || !isfinite(port.twist_deg_s) || !isfinite(port.advanced_mm) || fabs(port.push_mm_s) > 1000)
                abort();
            at += n + 1;
        }
    }
    free(descriptor);
    return 0;
}

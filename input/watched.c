#include "input/watched.h"

bool watched_open(const HidTransport *transport, const HidListing *listing, Watched *watched)
{
    char why[320];
    Faults faults;
    *watched = (Watched){.listing = listing};
    if (!listing->descriptor || !(watched->device = transport->open(transport->context, listing->info.path, why, sizeof why)))
        return false;
    for (int i = 0; i < listing->descriptor->field_count && watched->control_count < WATCHED_CONTROLS; i++) {
        const HidField *field = &listing->descriptor->field[i];
        if (field->kind != HID_INPUT || !(field->flags & HID_VARIABLE) || field->flags & HID_CONSTANT || !field->usage || field->usage >> 16 >= 0xff00)
            continue;
        WatchedControl *control = &watched->control[watched->control_count];
        control->field = *field;
        for (int k = 0; k < watched->control_count; k++)
            control->index += watched->control[k].field.usage == field->usage;
        watched->control_count++;
    }
    faults_clear(&faults);
    watched->is_mapped = listing->map && map_bind_hid(listing->map, listing->descriptor, "", &watched->state, &faults);
    return true;
}

static void take(Watched *watched, const uint8_t *bytes, size_t length)
{
    const HidReport *report;
    const uint8_t *payload;
    size_t payload_length;
    const HidDescriptor *descriptor = watched->listing->descriptor;
    if (hid_report_open(descriptor, HID_INPUT, bytes, length, &report, &payload, &payload_length) != HID_REPORT_GOOD) {
        watched->bad_reports++;
        return;
    }
    watched->reports++;
    for (int i = 0; i < watched->control_count; i++) {
        WatchedControl *control = &watched->control[i];
        int64_t value;
        if (control->field.report_id != report->id || !hid_field_read(&control->field, 0, payload, payload_length, &value))
            continue;
        control->least = !control->has_value || value < control->least ? value : control->least;
        control->most = !control->has_value || value > control->most ? value : control->most;
        control->value = value;
        control->sum += value;
        control->has_value = true;
    }
    if (watched->is_mapped)
        map_take_report(watched->listing->map, descriptor, bytes, length, &watched->state);
}

void watched_read(const HidTransport *transport, Watched *watched, int wait_ms, uint8_t *bytes)
{
    enum { AT_ONCE = 64 };
    int length = 0;
    for (int k = 0; watched->device && k < AT_ONCE; k++) {
        length = transport->read(transport->context, watched->device, bytes, HID_REPORT_BYTES, k == 0 ? wait_ms : 0);
        if (length <= 0)
            break;
        take(watched, bytes, (size_t)length);
    }
    if (length < 0)
        watched_close(transport, watched);
}

void watched_forget(Watched *watched)
{
    for (int i = 0; i < watched->control_count; i++) {
        WatchedControl *control = &watched->control[i];
        control->least = control->most = control->value;
        control->sum = 0;
    }
}

void watched_publish(Watched *watched)
{
    if (watched->is_mapped)
        map_publish(watched->listing->map, &watched->state, watched->port);
}

void watched_close(const HidTransport *transport, Watched *watched)
{
    if (watched->device)
        transport->close(transport->context, watched->device);
    watched->device = NULL;
}

#include "input/force_feedback.h"

#include "base/base.h"
#include "input/map_state.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PID(id) HID_USAGE(0x0f, id)

// HID Usage Tables 1.4, section 18
enum {
    SET_EFFECT = 0x21,
    BLOCK_INDEX = 0x22,
    EFFECT_TYPE = 0x25,
    CONSTANT_FORCE = 0x26,
    DURATION = 0x50,
    GAIN = 0x52,
    TRIGGER_BUTTON = 0x53,
    AXES_ENABLE = 0x55,
    DIRECTION_ENABLE = 0x56,
    DIRECTION = 0x57,
    MAGNITUDE = 0x70,
    SET_CONSTANT_FORCE = 0x73,
    EFFECT_OPERATION_REPORT = 0x77,
    OP_START = 0x79,
    OP_STOP = 0x7b,
    LOOP_COUNT = 0x7c,
    DEVICE_GAIN = 0x7e,
    POOL = 0x7f,
    BLOCK_LOAD = 0x89,
    LOAD_SUCCESS = 0x8c,
    ENABLE_ACTUATORS = 0x97,
    STOP_ALL = 0x99,
    DEVICE_RESET = 0x9a,
    MANAGED = 0xa9,
    CREATE_NEW_EFFECT = 0xab
};
// once a millisecond; a tick slightly early after a late one is accepted, otherwise every other report would be dropped
enum { EFFECT_MS = 500, SHORTEST_MS = 10, LONGEST_MS = 1000, PERIOD_US = 1000, LEAST_GAP_US = 750, LOAD_ATTEMPTS = 3, STOP_ATTEMPTS = 2, MOST_FAILURES = 20 };

// --- finding ---

// The data field with `usage` within a collection, of any kind except input.
static PidControl find_number(const HidDescriptor *descriptor, uint32_t usage, int collection)
{
    PidControl control = {0};
    for (int kind = HID_OUTPUT; kind <= HID_FEATURE && !control.is_there; kind++) {
        const HidField *field = hid_find_usage(descriptor, (HidReportKind)kind, usage, 0, collection, &control.slot);
        if (field) {
            control.is_there = true;
            control.field = *field;
        }
    }
    return control;
}

// A choice: the value that selects it in an array or, if each choice has a bit of its own, that bit.
static PidControl find_choice(const HidDescriptor *descriptor, uint32_t usage, int collection)
{
    PidControl control = find_number(descriptor, usage, collection);
    control.value = 1;
    for (int i = 0; i < descriptor->field_count && !control.is_there; i++) {
        const HidField *field = &descriptor->field[i];
        if (field->kind == HID_INPUT || field->range_count == 0 || !hid_is_within(descriptor, field->collection, collection) ||
            !hid_array_value(descriptor, field, usage, &control.value))
            continue;
        control.is_there = true;
        control.field = *field;
    }
    return control;
}

// The first data field within a collection, whatever its usage (directions are numbered on the Ordinal page).
static PidControl find_first(const HidDescriptor *descriptor, int collection)
{
    for (int i = 0; i < descriptor->field_count; i++) {
        const HidField *field = &descriptor->field[i];
        if (field->kind != HID_INPUT && !(field->flags & HID_CONSTANT) && hid_is_within(descriptor, field->collection, collection))
            return (PidControl){.is_there = true, .field = *field};
    }
    return (PidControl){0};
}

bool pid_is_haptic(const HidDescriptor *descriptor)
{
    for (int i = 0; i < descriptor->collection_count; i++)
        if (descriptor->collection[i].usage >> 16 == 0x0f)
            return true;
    return false;
}

static bool same_report(const PidControl *a, const PidControl *b)
{
    return a->is_there && b->is_there && a->field.kind == b->field.kind && a->field.report_id == b->field.report_id;
}

static void find_set_effect(const HidDescriptor *descriptor, PidLayout *layout)
{
    int effect = hid_find_collection(descriptor, PID(SET_EFFECT), 0);
    if (effect < 0)
        return;
    layout->effect_index = find_number(descriptor, PID(BLOCK_INDEX), effect);
    layout->effect_type = find_choice(descriptor, PID(CONSTANT_FORCE), effect);
    layout->duration = find_number(descriptor, PID(DURATION), effect);
    layout->trigger_button = find_number(descriptor, PID(TRIGGER_BUTTON), effect);
    layout->gain = find_number(descriptor, PID(GAIN), effect);
    layout->direction_enable = find_number(descriptor, PID(DIRECTION_ENABLE), effect);
    int axes = hid_find_collection(descriptor, PID(AXES_ENABLE), effect), direction = hid_find_collection(descriptor, PID(DIRECTION), effect);
    if (axes >= 0 && hid_is_within(descriptor, axes, effect)) {
        layout->axis_x = find_number(descriptor, HID_USAGE(1, 0x30), axes);
        layout->axis_y = find_number(descriptor, HID_USAGE(1, 0x31), axes);
    }
    if (direction >= 0 && hid_is_within(descriptor, direction, effect))
        layout->direction = find_first(descriptor, direction);
}

// Finds a field or choice within the collection of a report, if the device has that report.
static PidControl in_report(const HidDescriptor *descriptor, int report, int usage, bool is_choice)
{
    int collection = hid_find_collection(descriptor, PID(report), 0);
    if (collection < 0)
        return (PidControl){0};
    return is_choice ? find_choice(descriptor, PID(usage), collection) : find_number(descriptor, PID(usage), collection);
}

static int64_t all_ones(const HidField *field) { return ((int64_t)1 << field->size) - 1; }

// A value beyond the bits of the field would be truncated to a different value.
static bool range_fits(const HidField *field)
{
    int64_t half = (all_ones(field) + 1) / 2;
    return field->logical_min < 0 ? field->logical_min >= -half && field->logical_max < half : field->logical_max <= all_ones(field);
}

// Time [ms] of one count of the duration; 0x1001 and 0x1003 are seconds; without a unit, milliseconds are meant.
static double duration_unit_ms(const HidField *field)
{
    return 1000 * same_pow(10, field->unit == 0x1001 || field->unit == 0x1003 ? field->unit_exponent : -3);
}

// An effect ends by itself and is restarted before that, so that the force ends if the program dies or hangs.
static int64_t duration_value(const HidField *field)
{
    // all ones would mean an infinite duration
    int64_t most = field->logical_max < all_ones(field) ? field->logical_max : all_ones(field) - 1;
    double value = ceil(EFFECT_MS / duration_unit_ms(field));
    return (int64_t)fmax(fmax(1, (double)field->logical_min), fmin(value, (double)most));
}

int pid_duration_ms(const PidLayout *layout)
{
    const HidField *field = &layout->duration.field;
    if (!layout->duration.is_there)
        return 0;
    double ms = (double)duration_value(field) * duration_unit_ms(field);
    return ms >= 1 && ms < 1e9 ? (int)ms : 0;
}

// Returns why an effect would not end soon after the program does; NULL: it would end.
static const char *why_endless(const PidLayout *layout)
{
    if (!same_report(&layout->duration, &layout->effect_type))
        return "no duration of effects in the descriptor: a force would continue after the program has ended";
    if (!range_fits(&layout->duration.field))
        return "the range of the duration does not fit its bits in the descriptor";
    int ms = pid_duration_ms(layout);
    return ms < SHORTEST_MS || ms > LONGEST_MS ? "its effects cannot be limited to a duration of 0.01 to 1 s" : NULL;
}

static const char *what_is_missing(const PidLayout *layout)
{
    const HidField *magnitude = &layout->magnitude.field;
    if (!layout->create_type.is_there || !layout->effect_type.is_there || !layout->magnitude.is_there)
        return "no constant force effect in the descriptor";
    if (!layout->load_index.is_there)
        return "no PID Block Load report in the descriptor (the index of an effect cannot be queried)";
    if (!same_report(&layout->effect_index, &layout->effect_type) || !same_report(&layout->force_index, &layout->magnitude))
        return "its effect reports have no effect block index in the descriptor";
    if (!layout->start.is_there || !same_report(&layout->operation_index, &layout->start))
        return "no effect operation (start) in the descriptor";
    if (magnitude->logical_max <= 0)
        return "the magnitude of constant forces has no positive range in the descriptor";
    if (magnitude->logical_min > 0)
        return "the magnitude of constant forces has no zero in the descriptor";
    if (!range_fits(magnitude))
        return "the range of the magnitude does not fit its bits in the descriptor";
    return why_endless(layout);
}

bool pid_find(const HidDescriptor *descriptor, PidLayout *layout, char *why, size_t capacity)
{
    *layout = (PidLayout){0};
    if (!pid_is_haptic(descriptor)) {
        snprintf(why, capacity, "no force feedback (PID page) in the descriptor");
        return false;
    }
    layout->pool_managed = in_report(descriptor, POOL, MANAGED, false);
    layout->create_type = in_report(descriptor, CREATE_NEW_EFFECT, CONSTANT_FORCE, true);
    layout->load_index = in_report(descriptor, BLOCK_LOAD, BLOCK_INDEX, false);
    layout->load_success = in_report(descriptor, BLOCK_LOAD, LOAD_SUCCESS, true);
    find_set_effect(descriptor, layout);
    layout->force_index = in_report(descriptor, SET_CONSTANT_FORCE, BLOCK_INDEX, false);
    layout->magnitude = in_report(descriptor, SET_CONSTANT_FORCE, MAGNITUDE, false);
    layout->operation_index = in_report(descriptor, EFFECT_OPERATION_REPORT, BLOCK_INDEX, false);
    layout->start = in_report(descriptor, EFFECT_OPERATION_REPORT, OP_START, true);
    layout->stop = in_report(descriptor, EFFECT_OPERATION_REPORT, OP_STOP, true);
    layout->loop_count = in_report(descriptor, EFFECT_OPERATION_REPORT, LOOP_COUNT, false);
    // the control collection may be inside that of a report or separate, so search everywhere
    layout->reset = find_choice(descriptor, PID(DEVICE_RESET), 0);
    layout->enable = find_choice(descriptor, PID(ENABLE_ACTUATORS), 0);
    layout->stop_all = find_choice(descriptor, PID(STOP_ALL), 0);
    layout->device_gain = find_number(descriptor, PID(DEVICE_GAIN), 0);
    for (int i = 0; i < descriptor->report_count; i++)
        layout->report_bytes[descriptor->report[i].kind][descriptor->report[i].id] = (descriptor->report[i].bits + 7) / 8 + 1;
    const char *missing = what_is_missing(layout);
    if (missing)
        snprintf(why, capacity, "%s", missing);
    return !missing;
}

// --- encoding ---

// Begins an empty message for the report that contains `control`; false if there is none or it is longer than PidMessage allows.
static bool begin(const PidLayout *layout, const PidControl *control, PidMessage *out)
{
    int id = control->field.report_id, length = control->is_there ? layout->report_bytes[control->field.kind][id] : 0;
    if (length < 2 || length > PID_MESSAGE_BYTES)
        return false;
    *out = (PidMessage){.kind = control->field.kind, .length = length};
    out->bytes[0] = (uint8_t)id;
    return true;
}

static void put(PidMessage *out, const PidControl *control, int64_t value)
{
    if (control->is_there && control->field.kind == out->kind && control->field.report_id == out->bytes[0])
        hid_field_write(&control->field, control->slot, out->bytes + 1, (size_t)out->length - 1, value);
}

static bool encode_choice(const PidLayout *layout, const PidControl *control, PidMessage *out)
{
    if (!begin(layout, control, out))
        return false;
    put(out, control, control->value);
    return true;
}

bool pid_encode_reset(const PidLayout *layout, PidMessage *out) { return encode_choice(layout, &layout->reset, out); }
bool pid_encode_enable(const PidLayout *layout, PidMessage *out) { return encode_choice(layout, &layout->enable, out); }
bool pid_encode_create(const PidLayout *layout, PidMessage *out) { return encode_choice(layout, &layout->create_type, out); }

bool pid_encode_gain(const PidLayout *layout, PidMessage *out)
{
    if (!begin(layout, &layout->device_gain, out))
        return false;
    put(out, &layout->device_gain, layout->device_gain.field.logical_max);
    return true;
}

int pid_decode_block_load(const PidLayout *layout, const uint8_t *bytes, size_t length)
{
    int64_t index, status;
    const PidControl *success = &layout->load_success;
    if (length < 2 || bytes[0] != layout->load_index.field.report_id ||
        !hid_field_read(&layout->load_index.field, layout->load_index.slot, bytes + 1, length - 1, &index))
        return 0;
    if (same_report(success, &layout->load_index) &&
        (!hid_field_read(&success->field, success->slot, bytes + 1, length - 1, &status) || status != success->value))
        return 0;
    return index > 0 && index <= 255 ? (int)index : 0;
}

bool pid_needs_host(const PidLayout *layout, const uint8_t *bytes, size_t length)
{
    const PidControl *managed = &layout->pool_managed;
    int64_t value;
    return managed->is_there && length > 1 && bytes[0] == managed->field.report_id &&
           hid_field_read(&managed->field, managed->slot, bytes + 1, length - 1, &value) && value == 0;
}

// A value outside the range means "no value"; for a trigger: no trigger.
static bool has_null(const PidControl *control) { return control->field.logical_min >= 0 && all_ones(&control->field) > control->field.logical_max; }

bool pid_encode_effect(const PidLayout *layout, int block, double direction_deg, PidMessage *out)
{
    if (!begin(layout, &layout->effect_type, out))
        return false;
    const PidControl *direction = &layout->direction, *trigger = &layout->trigger_button;
    put(out, &layout->effect_index, block);
    put(out, &layout->effect_type, layout->effect_type.value);
    put(out, &layout->duration, duration_value(&layout->duration.field));
    put(out, trigger, has_null(trigger) ? all_ones(&trigger->field) : trigger->field.logical_min > 0 ? 0 : trigger->field.logical_max);
    put(out, &layout->gain, layout->gain.field.logical_max);
    double turn = fmod(fmod(direction_deg, 360) + 360, 360) / 360;
    bool is_x = fabs(fabs(turn - 0.5) - 0.25) < 0.125;
    if (direction->is_there) {
        put(out, &layout->direction_enable, 1);
        put(out, direction, direction->field.logical_min + llround(turn * (double)(direction->field.logical_max - direction->field.logical_min)));
    } else {
        put(out, is_x ? &layout->axis_x : &layout->axis_y, 1);
    }
    return true;
}

// Without a direction field, a force > 0 comes from the positive end of its axis (east, south). Returns -1 for forces that come from north or west.
static double pid_axis_sign(const PidLayout *layout, double direction_deg)
{
    return !layout->direction.is_there && (direction_deg < 45 || direction_deg > 225) ? -1 : 1;
}

bool pid_encode_force(const PidLayout *layout, int block, double magnitude, PidMessage *out, int64_t *value)
{
    if (!begin(layout, &layout->magnitude, out))
        return false;
    const HidField *field = &layout->magnitude.field;
    double most = (double)field->logical_max;
    if (field->logical_min < 0 && (double)-field->logical_min < most)
        most = (double)-field->logical_min;
    *value = isfinite(magnitude) ? llround(fmax(-1, fmin(1, magnitude)) * most) : 0;
    if (*value < field->logical_min)
        *value = field->logical_min;
    put(out, &layout->force_index, block);
    put(out, &layout->magnitude, *value);
    return true;
}

bool pid_encode_start(const PidLayout *layout, int block, PidMessage *out)
{
    if (!encode_choice(layout, &layout->start, out))
        return false;
    put(out, &layout->operation_index, block);
    put(out, &layout->loop_count, 1);
    return true;
}

bool pid_encode_stop(const PidLayout *layout, int block, PidMessage *out)
{
    if (!encode_choice(layout, &layout->stop, out))
        return false;
    put(out, &layout->operation_index, block);
    return true;
}

double force_direction_deg(const DeviceMap *map, bool is_twist)
{
    if (!is_twist && !isnan(map->force.direction_deg))
        return map->force.direction_deg;
    for (int i = 0; i < map->axis_count; i++) {
        const MapAxis *axis = &map->axis[i];
        if (axis->is_twist != is_twist || axis->source.kind != SOURCE_HID_USAGE)
            continue;
        if (axis->source.usage == HID_USAGE(1, 0x30))
            return axis->invert ? 270 : 90;
        if (axis->source.usage == HID_USAGE(1, 0x31))
            return axis->invert ? 0 : 180;
    }
    return NAN;
}

// --- a device ---

static bool send(const PidMessage *message, const HidTransport *transport, void *device)
{
    int sent = message->kind == HID_FEATURE ? transport->send_feature(transport->context, device, message->bytes, message->length)
                                            : transport->write(transport->context, device, message->bytes, message->length);
    // a short transfer is a failure; some buses do not count the id byte of a report without id
    return sent >= message->length - (message->bytes[0] == 0);
}

// Allocates an effect block; 0 if the device refuses.
static int create_effect(const PidLayout *layout, const HidTransport *transport, void *device)
{
    PidMessage message;
    if (!pid_encode_create(layout, &message) || !send(&message, transport, device))
        return 0;
    for (int i = 0; i < LOAD_ATTEMPTS; i++) {
        uint8_t answer[PID_MESSAGE_BYTES] = {(uint8_t)layout->load_index.field.report_id};
        int length = transport->get_feature(transport->context, device, answer, (int)sizeof answer);
        if (length > (int)sizeof answer)
            return 0;
        int block = length > 0 ? pid_decode_block_load(layout, answer, (size_t)length) : 0;
        if (block > 0)
            return block;
    }
    return 0;
}

static bool needs_host(const PidLayout *layout, const HidTransport *transport, void *device)
{
    uint8_t answer[PID_MESSAGE_BYTES] = {(uint8_t)layout->pool_managed.field.report_id};
    int length = layout->pool_managed.is_there ? transport->get_feature(transport->context, device, answer, (int)sizeof answer) : 0;
    return length > 0 && length <= (int)sizeof answer && pid_needs_host(layout, answer, (size_t)length);
}

// Uploads effect `which` at zero force; the first force_tick() that may send forces starts it.
static bool upload(ForceFeedback *force, int which, const HidTransport *transport, void *device)
{
    const PidLayout *layout = &force->layout;
    PidMessage message;
    int block = create_effect(layout, transport, device);
    if (block == 0 || block == force->block[1 - which])
        return false;
    force->block[which] = block;
    return pid_encode_effect(layout, block, force->direction_deg[which], &message) && send(&message, transport, device) &&
           pid_encode_force(layout, block, 0, &message, &force->value[which]) && (force->is_known[which] = send(&message, transport, device));
}

bool force_start(ForceFeedback *force, const DeviceMap *map, const HidDescriptor *descriptor, const HidTransport *transport, void *device, int64_t now_us)
{
    PidMessage message;
    *force = (ForceFeedback){.map = map->force, .due_us = now_us};
    if (!map->force.is_wanted) {
        snprintf(force->text, sizeof force->text, "%s", pid_is_haptic(descriptor) ? "none: its map has no 'force'" : "");
        return false;
    }
    char why[sizeof force->text - 16];
    if (!pid_find(descriptor, &force->layout, why, sizeof why)) {
        snprintf(force->text, sizeof force->text, "none: %s", why);
        return false;
    }
    for (int i = 0; i < 2; i++)
        force->direction_deg[i] = force_direction_deg(map, i == 1);
    if (isnan(force->direction_deg[0])) {
        snprintf(force->text, sizeof force->text, "none: push is neither on X nor on Y; give force.direction_deg");
        return false;
    }
    if (needs_host(&force->layout, transport, device)) {
        snprintf(force->text, sizeof force->text, "none: the device needs the host to manage its effect memory, which is not supported");
        return false;
    }
    if (pid_encode_reset(&force->layout, &message))
        send(&message, transport, device);
    if (pid_encode_enable(&force->layout, &message))
        send(&message, transport, device);
    if (pid_encode_gain(&force->layout, &message))
        send(&message, transport, device);
    if (!upload(force, 0, transport, device)) {
        force->block[0] = 0;
        snprintf(force->text, sizeof force->text, "none: the device did not accept a constant force effect");
        return false;
    }
    bool has_torque = map->force.full_scale_n_mm > 0 && !isnan(force->direction_deg[1]) && force->layout.direction.is_there;
    if (has_torque && !upload(force, 1, transport, device))
        force->block[1] = 0, has_torque = false;
    force->effect_us = 1000 * (int64_t)pid_duration_ms(&force->layout);
    const HidField *field = &force->layout.magnitude.field;
    snprintf(force->text, sizeof force->text, "constant force, %lld steps for %g N, at most %g N%s%s", (long long)field->logical_max, map->force.full_scale_n,
             map->force.max_n,
             has_torque                       ? ", and torque"
             : map->force.full_scale_n_mm > 0 ? "; no torque: no second effect or axis"
                                              : "",
             field->logical_min < 0 ? "" : "; one direction only: no sign");
    return true;
}

// Counts consecutive failures so that a device that accepts nothing is abandoned: each failure may block the thread for a whole transfer.
static bool try_send(ForceFeedback *force, const PidMessage *message, const HidTransport *transport, void *device)
{
    bool is_sent = send(message, transport, device);
    force->writes++;
    force->failures = is_sent ? 0 : force->failures + 1;
    return is_sent;
}

// Sends the magnitude of an effect as a fraction of full scale, unless the device already has it.
static bool write_force(ForceFeedback *force, int which, double part, const HidTransport *transport, void *device)
{
    PidMessage message;
    int64_t value;
    if (!pid_encode_force(&force->layout, force->block[which], part, &message, &value))
        return false;
    if (force->is_known[which] && value == force->value[which])
        return true;
    force->value[which] = value;
    force->is_known[which] = try_send(force, &message, transport, device);
    return force->is_known[which];
}

static bool start_effects(ForceFeedback *force, int64_t now_us, const HidTransport *transport, void *device)
{
    PidMessage message;
    // assume that it plays, even if the device reports otherwise
    force->may_play = true;
    force->started_us = now_us;
    for (int i = 0; i < 2 && force->block[i]; i++)
        if (!pid_encode_start(&force->layout, force->block[i], &message) || !try_send(force, &message, transport, device))
            return false;
    return true;
}

// Sends zero and stop for each effect; a failure does not prevent the others.
static bool rest(ForceFeedback *force, const HidTransport *transport, void *device)
{
    PidMessage message;
    bool good = true;
    for (int i = 0; i < 2 && force->block[i]; i++)
        good &= write_force(force, i, 0, transport, device);
    for (int i = 0; i < 2 && force->block[i] && force->may_play; i++)
        if (pid_encode_stop(&force->layout, force->block[i], &message))
            good &= try_send(force, &message, transport, device);
    force->may_play = force->may_play && !good;
    return good;
}

// An effect is started only at a known zero, because the last magnitude in the device is outdated.
static bool play(ForceFeedback *force, int64_t now_us, const HidTransport *transport, void *device)
{
    if (!force->may_play) {
        for (int i = 0; i < 2 && force->block[i]; i++)
            if (!write_force(force, i, 0, transport, device))
                return false;
        if (!start_effects(force, now_us, transport, device))
            return false;
    }
    for (int i = 0; i < 2 && force->block[i]; i++) {
        double full = pid_axis_sign(&force->layout, force->direction_deg[i]) * (i == 0 ? force->map.full_scale_n : force->map.full_scale_n_mm);
        if (!write_force(force, i, force->guard.sent[i] / full, transport, device))
            return false;
    }
    return 2 * (now_us - force->started_us) < force->effect_us || start_effects(force, now_us, transport, device);
}

static void stop_forces(ForceFeedback *force, const char *why)
{
    force->guard.sent[0] = force->guard.sent[1] = 0;
    force->guard.why_zero = why;
}

static void give_up(ForceFeedback *force, const HidTransport *transport, void *device)
{
    force_stop(force, transport, device);
    stop_forces(force, "the device accepts no forces");
    snprintf(force->text, sizeof force->text, "none: the device accepts no forces (%d consecutive writes failed)", MOST_FAILURES);
}

void force_tick(ForceFeedback *force, const HandPort *port, int64_t now_us, int64_t report_us, bool paused, const HidTransport *transport, void *device)
{
    if (force->block[0] == 0 || now_us < force->due_us)
        return;
    double sign = force->map.invert ? -1 : 1;
    const double wanted[2] = {sign * atomic_load(&port->force_n), sign * atomic_load(&port->torque_n_mm)};
    int64_t writes = force->writes;
    // an effect that has ended exerts no force: the force grows again from zero
    bool has_ended = force->may_play && now_us - force->started_us >= force->effect_us;
    force_guard(&force->guard, &force->map, wanted, atomic_load(&port->step), now_us, report_us, paused);
    if (has_ended && !force->guard.why_zero[0])
        stop_forces(force, "the effect ended before it was restarted");
    else if (force->must_rest && !force->guard.why_zero[0])
        stop_forces(force, "the device did not accept a report");
    bool is_played = !force->guard.why_zero[0] && play(force, now_us, transport, device);
    if (!is_played) {
        if (!force->guard.why_zero[0])
            stop_forces(force, "the device did not accept a report");
        force->must_rest = !rest(force, transport, device);
    }
    if (force->failures >= MOST_FAILURES)
        give_up(force, transport, device);
    if (force->writes > writes)
        force->due_us = force->due_us + PERIOD_US > now_us + LEAST_GAP_US ? force->due_us + PERIOD_US : now_us + LEAST_GAP_US;
}

// Retries once on failure, because no later message follows.
static void insist(const PidMessage *message, const HidTransport *transport, void *device)
{
    for (int i = 0; i < STOP_ATTEMPTS && !send(message, transport, device); i++)
        continue;
}

void force_stop(ForceFeedback *force, const HidTransport *transport, void *device)
{
    PidMessage message;
    int64_t value;
    for (int i = 0; i < 2; i++) {
        if (force->block[i] && pid_encode_force(&force->layout, force->block[i], 0, &message, &value))
            insist(&message, transport, device);
        if (force->block[i] && pid_encode_stop(&force->layout, force->block[i], &message))
            insist(&message, transport, device);
    }
    if (force->block[0] && encode_choice(&force->layout, &force->layout.stop_all, &message))
        insist(&message, transport, device);
    force->block[0] = force->block[1] = 0;
}

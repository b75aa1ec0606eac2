#include "input/map_state.h"

#include "base/base.h"
#include "input/command.h"

#include <math.h>
#include <stdio.h>

double map_shape(double deflection, double dead_zone, double exponent)
{
    double beyond = (fabs(deflection) - dead_zone) / (1 - dead_zone);
    return beyond > 0 ? copysign(same_pow(fmin(beyond, 1), exponent), deflection) : 0;
}

double map_deflection(double raw, double min, double centre, double max)
{
    double side = raw >= centre ? max - centre : centre - min;
    return side > 0 ? fmax(-1, fmin(1, (raw - centre) / side)) : 0;
}

double map_counter_step(double previous, double now, double wrap)
{
    double step = now - previous;
    if (wrap > 0) {
        step = fmod(step, wrap);
        if (step >= wrap / 2)
            step -= wrap;
        else if (step < -wrap / 2)
            step += wrap;
    }
    return step;
}

// --- binding ---

static void bind_fault(const DeviceMap *map, const MapSource *source, const char *device, const char *what, Faults *faults)
{
    faults_add(faults, map->file, source->line, source->column, "%s: %s", device, what);
}

// The HID field of a source: a variable of that usage, else an array that contains it.
static bool find_field(const HidDescriptor *descriptor, const MapSource *source, BoundControl *bound)
{
    uint32_t usage = source->kind == SOURCE_HID_USAGE ? source->usage : HID_USAGE(1, 0x39);
    const HidField *field = hid_find_usage(descriptor, HID_INPUT, usage, source->index, -1, &bound->slot);
    int64_t value;
    if (field) {
        bound->field = *field;
        return true;
    }
    for (int i = 0; i < descriptor->field_count && source->index == 0; i++) {
        field = &descriptor->field[i];
        if (field->kind == HID_INPUT && field->range_count > 0 && hid_array_value(descriptor, field, usage, &value)) {
            bound->field = *field;
            return true;
        }
    }
    return false;
}

static double given_or(double value, double otherwise) { return isnan(value) ? otherwise : value; }

// Values missing in the map come from the range of the device.
static void calibrate(const MapAxis *axis, double least, double most, BoundControl *bound)
{
    bound->min = given_or(axis->logical_min, least);
    bound->max = given_or(axis->logical_max, most);
    bound->centre = given_or(axis->logical_centre, (bound->min + bound->max) / 2);
}

static bool check_calibration(const DeviceMap *map, const MapSource *source, const char *device, const BoundControl *bound, Faults *faults)
{
    if (bound->min <= bound->centre && bound->centre <= bound->max && bound->min < bound->max)
        return true;
    faults_add(faults, map->file, source->line, source->column, "%s: logical minimum %g, centre %g, maximum %g are not in increasing order", device, bound->min,
               bound->centre, bound->max);
    return false;
}

static bool bind_hid_axis(const DeviceMap *map, const MapAxis *axis, const HidDescriptor *descriptor, const char *device, BoundControl *bound, Faults *faults)
{
    char name[32], what[200];
    hid_usage_name(axis->source.kind == SOURCE_HID_USAGE ? axis->source.usage : HID_USAGE(1, 0x39), name, sizeof name);
    if (!find_field(descriptor, &axis->source, bound)) {
        if (axis->source.optional)
            return true;
        snprintf(what, sizeof what, "has no input '%s' number %d; `seldinger devices` lists its inputs", name, axis->source.index);
        bind_fault(map, &axis->source, device, what, faults);
        return false;
    }
    const HidField *field = &bound->field;
    bool is_relative = field->flags & HID_RELATIVE, is_bit = field->range_count > 0 || field->usage >> 16 == 9;
    bound->is_there = true;
    bound->kind = axis->kind != AXIS_BY_DESCRIPTOR ? axis->kind : axis->is_rate ? AXIS_DEFLECTION : is_relative ? AXIS_RELATIVE : AXIS_COUNTER;
    if (axis->is_rate && is_relative && axis->kind == AXIS_BY_DESCRIPTOR) {
        snprintf(what, sizeof what, "'%s' is relative and gives counts: use mm_per_count or deg_per_count (or kind: deflection if it springs back)", name);
        bind_fault(map, &axis->source, device, what, faults);
        return false;
    }
    if (axis->source.kind != SOURCE_HID_USAGE || field->range_count > 0) {
        calibrate(axis, axis->source.kind == SOURCE_HID_USAGE ? 0 : -1, 1, bound);
        if (axis->source.kind == SOURCE_HID_USAGE)
            bound->centre = given_or(axis->logical_centre, 0);
    } else {
        calibrate(axis, (double)field->logical_min, (double)field->logical_max, bound);
        if (is_bit)
            bound->centre = given_or(axis->logical_centre, bound->min);
    }
    bound->wrap = given_or(axis->counts_per_wrap, (double)(field->logical_max - field->logical_min) + 1);
    return bound->kind != AXIS_DEFLECTION || check_calibration(map, &axis->source, device, bound, faults);
}

static bool bind_hid_button(const DeviceMap *map, const MapButton *button, const HidDescriptor *descriptor, const char *device, BoundControl *bound,
                            Faults *faults)
{
    // as an axis without a scale; on in the upper half of its range
    MapAxis axis = {.source = button->source,
                    .kind = AXIS_DEFLECTION,
                    .is_rate = true,
                    .logical_min = NAN,
                    .logical_centre = NAN,
                    .logical_max = NAN,
                    .counts_per_wrap = NAN};
    return bind_hid_axis(map, &axis, descriptor, device, bound, faults);
}

bool map_bind_hid(const DeviceMap *map, const HidDescriptor *descriptor, const char *device_name, MapState *state, Faults *faults)
{
    bool good = true;
    *state = (MapState){0};
    for (int i = 0; i < map->axis_count; i++)
        good &= bind_hid_axis(map, &map->axis[i], descriptor, device_name, &state->axis[i], faults);
    for (int i = 0; i < map->button_count; i++)
        good &= bind_hid_button(map, &map->button[i], descriptor, device_name, &state->button[i], faults);
    map_release(map, state);
    return good;
}

static bool plain_source(const DeviceMap *map, const MapSource *source, int axis_count, int button_count, const char *device, BoundControl *bound,
                         Faults *faults)
{
    char what[120];
    int count = source->kind == SOURCE_BUTTON ? button_count : axis_count;
    bound->is_there = source->index < count;
    if (bound->is_there || source->optional)
        return true;
    snprintf(what, sizeof what, "has %d %s, none of number %d", count, source->kind == SOURCE_BUTTON ? "buttons" : "axes", source->index);
    bind_fault(map, source, device, what, faults);
    return false;
}

bool map_bind_plain(const DeviceMap *map, int axis_count, int button_count, const char *device_name, MapState *state, Faults *faults)
{
    bool good = true;
    *state = (MapState){0};
    for (int i = 0; i < map->axis_count; i++) {
        const MapAxis *axis = &map->axis[i];
        BoundControl *bound = &state->axis[i];
        bool is_button = axis->source.kind == SOURCE_BUTTON;
        good &= plain_source(map, &axis->source, axis_count, button_count, device_name, bound, faults);
        bound->kind = axis->kind != AXIS_BY_DESCRIPTOR ? axis->kind : axis->is_rate ? AXIS_DEFLECTION : AXIS_COUNTER;
        calibrate(axis, is_button ? 0 : -1, 1, bound);
        if (is_button)
            bound->centre = given_or(axis->logical_centre, 0);
        bound->wrap = given_or(axis->counts_per_wrap, map->device.kind == MAP_FTDI && map->serial.bits > 0 ? ldexp(1, map->serial.bits) : 0);
        if (bound->is_there && bound->kind == AXIS_DEFLECTION)
            good &= check_calibration(map, &axis->source, device_name, bound, faults);
    }
    for (int i = 0; i < map->button_count; i++) {
        BoundControl *bound = &state->button[i];
        bool is_button = map->button[i].source.kind == SOURCE_BUTTON;
        good &= plain_source(map, &map->button[i].source, axis_count, button_count, device_name, bound, faults);
        *bound = (BoundControl){.is_there = bound->is_there, .kind = AXIS_DEFLECTION, .min = is_button ? 0 : -1, .centre = 0, .max = 1};
    }
    map_release(map, state);
    return good;
}

// --- values ---

static void take_axis(const BoundControl *bound, double raw, AxisState *state)
{
    switch (bound->kind) {
    case AXIS_RELATIVE: state->counts += (int64_t)raw; break;
    case AXIS_COUNTER:
        if (state->has_previous)
            state->counts += (int64_t)map_counter_step(state->previous, raw, bound->wrap);
        state->previous = raw;
        state->has_previous = true;
        break;
    default: state->deflection = map_deflection(raw, bound->min, bound->centre, bound->max);
    }
}

// A hat gives one of 8 (or 4, or 360) directions clockwise from north, or none; right and forward are positive.
static double hat_value(MapSourceKind kind, const HidField *field, int64_t value)
{
    static const double east[] = {0, 1, 1, 1, 0, -1, -1, -1};
    if (!hid_field_in_range(field, value))
        return 0;
    int64_t directions = field->logical_max - field->logical_min + 1;
    int eighth = (int)(((value - field->logical_min) * 8 + directions / 2) / directions & 7);
    return kind == SOURCE_HID_HAT_X ? east[eighth] : east[(eighth + 2) & 7];
}

// Reads the raw value of a bound control from a report; false if it has none (null state of an axis).
static bool raw_value(const HidDescriptor *descriptor, const MapSource *source, const BoundControl *bound, const uint8_t *payload, size_t length, double *raw)
{
    int64_t value;
    if (bound->field.range_count > 0) {
        *raw = hid_array_has(descriptor, &bound->field, source->usage, payload, length);
        return true;
    }
    if (!hid_field_read(&bound->field, bound->slot, payload, length, &value))
        return false;
    if (source->kind != SOURCE_HID_USAGE) {
        *raw = hat_value(source->kind, &bound->field, value);
        return true;
    }
    if (bound->field.flags & HID_NULL_STATE && !hid_field_in_range(&bound->field, value))
        return false;
    *raw = (double)value;
    return true;
}

bool map_take_report(const DeviceMap *map, const HidDescriptor *descriptor, const uint8_t *bytes, size_t length, MapState *state)
{
    const HidReport *report;
    const uint8_t *payload;
    size_t payload_length;
    double raw;
    if (hid_report_open(descriptor, HID_INPUT, bytes, length, &report, &payload, &payload_length) != HID_REPORT_GOOD) {
        state->bad_reports++;
        return false;
    }
    state->reports++;
    for (int i = 0; i < map->axis_count; i++) {
        const BoundControl *bound = &state->axis[i];
        if (bound->is_there && bound->field.report_id == report->id && raw_value(descriptor, &map->axis[i].source, bound, payload, payload_length, &raw))
            take_axis(bound, raw, &state->axis_state[i]);
    }
    for (int i = 0; i < map->button_count; i++) {
        const BoundControl *bound = &state->button[i];
        if (bound->is_there && bound->field.report_id == report->id && raw_value(descriptor, &map->button[i].source, bound, payload, payload_length, &raw))
            state->held[i] = map_deflection(raw, bound->min, bound->centre, bound->max) > map->button[i].above;
    }
    return true;
}

void map_take_plain(const DeviceMap *map, const float *axes, int axis_count, const unsigned char *buttons, int button_count, MapState *state)
{
    state->reports++;
    for (int i = 0; i < map->axis_count + map->button_count; i++) {
        bool is_axis = i < map->axis_count;
        int k = is_axis ? i : i - map->axis_count;
        const MapSource *source = is_axis ? &map->axis[k].source : &map->button[k].source;
        const BoundControl *bound = is_axis ? &state->axis[k] : &state->button[k];
        bool from_button = source->kind == SOURCE_BUTTON;
        if (!bound->is_there || source->index >= (from_button ? button_count : axis_count))
            continue;
        double raw = from_button ? buttons[source->index] != 0 : (double)axes[source->index];
        if (isnan(raw))
            continue;
        if (is_axis)
            take_axis(bound, raw, &state->axis_state[k]);
        else
            state->held[k] = map_deflection(raw, bound->min, bound->centre, bound->max) > map->button[k].above;
    }
}

void map_take_counts(const DeviceMap *map, const int64_t *counts, const bool *fresh, int count, MapState *state)
{
    state->reports++;
    for (int i = 0; i < map->axis_count; i++) {
        int index = map->axis[i].source.index;
        if (state->axis[i].is_there && index < count && fresh[index])
            take_axis(&state->axis[i], (double)counts[index], &state->axis_state[i]);
    }
}

// --- to the port ---

static double clamp(double value, double most) { return fmax(-most, fmin(most, value)); }

void map_publish(const DeviceMap *map, const MapState *state, HandPort *port)
{
    double rate[MAP_HANDS][2] = {{0}}, displacement[MAP_HANDS][2] = {{0}};
    unsigned buttons = 0;
    for (int i = 0; i < map->axis_count; i++) {
        const MapAxis *axis = &map->axis[i];
        double sign = axis->invert ? -1 : 1;
        if (axis->is_rate)
            rate[axis->hand][axis->is_twist] += sign * axis->scale * map_shape(state->axis_state[i].deflection, axis->dead_zone, axis->exponent);
        else
            displacement[axis->hand][axis->is_twist] += sign * axis->scale * (double)state->axis_state[i].counts;
    }
    for (int i = 0; i < map->button_count; i++)
        if (state->held[i] != map->button[i].invert && state->button[i].is_there)
            buttons |= map->button[i].bit;
    for (int h = 0; h < map->hand_count; h++) {
        atomic_store(&port[h].drives, map->hand[h].drives);
        atomic_store(&port[h].push_mm_s, clamp(rate[h][0], SCRIPT_FASTEST_MM_S));
        atomic_store(&port[h].twist_deg_s, clamp(rate[h][1], SCRIPT_FASTEST_DEG_S));
        atomic_store(&port[h].advanced_mm, displacement[h][0]);
        atomic_store(&port[h].turned_deg, displacement[h][1]);
    }
    atomic_store(&port->buttons, buttons);
    atomic_store(&port->reports, state->reports);
}

void map_release(const DeviceMap *map, MapState *state)
{
    for (int i = 0; i < MAP_AXES; i++) {
        state->axis_state[i].deflection = 0;
        state->axis_state[i].has_previous = false;
    }
    for (int i = 0; i < map->button_count; i++)
        state->held[i] = map->button[i].invert;
}

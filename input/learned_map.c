#include "input/learned_map.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double enough_of_range = 0.4, enough_counts = 40;
enum { PAGE_BUTTONS = 9 };

// How far a control has moved, 1: far enough.
static double movement(const WatchedControl *control)
{
    double range = (double)(control->field.logical_max - control->field.logical_min);
    if (!control->has_value || control->field.usage >> 16 == PAGE_BUTTONS || range <= 1)
        return 0;
    return control->field.flags & HID_RELATIVE ? fabs((double)control->sum) / enough_counts
                                               : (double)(control->most - control->least) / (enough_of_range * range);
}

bool learned_axis_find(const Watched *watched, LearnedAxis *axis)
{
    const WatchedControl *moved = NULL;
    for (int i = 0; i < watched->control_count; i++)
        if (movement(&watched->control[i]) >= 1 && (!moved || movement(&watched->control[i]) > movement(moved)))
            moved = &watched->control[i];
    if (!moved)
        return false;
    bool is_relative = moved->field.flags & HID_RELATIVE;
    // a stick that was let go has come back: the farther end from where it is now is where it was moved to
    bool falls = is_relative ? moved->sum < 0 : moved->value - moved->least < moved->most - moved->value;
    *axis = (LearnedAxis){true, moved->field.usage, moved->index, is_relative, falls};
    return true;
}

LearnedAxis learned_axis_of(const DeviceMap *map, bool is_twist)
{
    for (int i = 0; map && i < map->axis_count; i++) {
        const MapAxis *axis = &map->axis[i];
        if (axis->is_twist == is_twist && axis->source.kind == SOURCE_HID_USAGE)
            return (LearnedAxis){true, axis->source.usage, axis->source.index, !axis->is_rate, axis->invert};
    }
    return (LearnedAxis){0};
}

static void print_axis(FILE *out, const char *name, const LearnedAxis *axis, const char *rate, const char *per_count)
{
    if (!axis->is_learned)
        return;
    fprintf(out, "%s: {source: 0x%04x:0x%04x, index: %d, ", name, (unsigned)(axis->usage >> 16), (unsigned)(axis->usage & 0xffff), axis->index);
    fprintf(out, "%s, invert: %s}\n", axis->is_relative ? per_count : rate, axis->is_inverted ? "true" : "false");
}

char *learned_map_text(const HidDeviceInfo *device, const LearnedAxis *push, const LearnedAxis *twist)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = push->is_learned || twist->is_learned ? open_memstream(&text, &length) : NULL;
    if (!out)
        return NULL;
    fprintf(out, "# Made on the page of devices; input/device_map.h explains every key.\nseldinger_device: 1\nname: my map of %04x-%04x\n",
            (unsigned)device->vendor_id & 0xffff, (unsigned)device->product_id & 0xffff);
    fprintf(out, "device: {vendor_id: 0x%04x, product_id: 0x%04x}\n", (unsigned)device->vendor_id & 0xffff, (unsigned)device->product_id & 0xffff);
    print_axis(out, "push", push, "mm_s: 40, dead_zone: 0.1, exponent: 2", "mm_per_count: 0.03");
    print_axis(out, "twist", twist, "deg_s: 240, dead_zone: 0.1, exponent: 2", "deg_per_count: 0.9");
    static const char *const button[] = {"pedal", "contrast", "stop", "mark"};
    for (int i = 0; i < 4; i++)
        fprintf(out, "%s: {source: button_%d, optional: true}\n", button[i], i + 1);
    bool good = !ferror(out);
    if (fclose(out) == 0 && good)
        return text;
    free(text);
    return NULL;
}

#include "input/device_map.h"

#include "base/base.h"
#include "input/hand_port.h"
#include "input/hid_report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// GLFW's order of a gamepad's axes and buttons.
static const char *const gamepad_axis[] = {"left_x", "left_y", "right_x", "right_y", "left_trigger", "right_trigger", NULL};
static const char *const gamepad_button[] = {"a",     "b",          "x",           "y",       "left_bumper", "right_bumper", "back",      "start",
                                             "guide", "left_thumb", "right_thumb", "dpad_up", "dpad_right",  "dpad_down",    "dpad_left", NULL};

static int index_of(const char *const *names, const char *name)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(names[i], name))
            return i;
    return -1;
}

static void copy_name(YamlValue value, char *out, size_t capacity)
{
    const char *text;
    if (!yaml_text(value, &text))
        return;
    if (strlen(text) >= capacity)
        yaml_fault(value, "'%s' has more than %zu letters", value.name, capacity - 1);
    else
        snprintf(out, capacity, "%s", text);
}

// --- which device ---

// Vendor and product ids may be hexadecimal as in lsusb, 0x046d, or decimal.
static void read_id(YamlValue value, int least, int most, int *id)
{
    const char *text;
    if (!yaml_text(value, &text))
        return;
    bool is_hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
    char *end;
    unsigned long number = strtoul(text, &end, is_hex ? 16 : 10);
    if (text[0] < '0' || text[0] > '9' || *end || end == text || number < (unsigned long)least || number > (unsigned long)most)
        yaml_fault(value, "'%s' is '%.20s'; expected a number from %d to 0x%x (0x%s for hexadecimal)", value.name, text, least, (unsigned)most, "…");
    else
        *id = (int)number;
}

static void read_device(YamlValue value, DeviceMap *map)
{
    static const char *const keys[] = {"vendor_id", "product_id", "serial", "usage", "usage_page", "gamepad", "joystick", "usb", NULL};
    static const char *const buses[] = {"ftdi", NULL};
    YamlMap device = yaml_map(value, keys);
    MapDevice *out = &map->device;
    const char *text;
    bool gamepad = false;
    int page = -1, usage = -1;
    if (!device.value.node)
        return;
    read_id(yaml_get(&device, "vendor_id", false), 0, 0xffff, &out->vendor_id);
    read_id(yaml_get(&device, "product_id", false), 0, 0xffff, &out->product_id);
    copy_name(yaml_get(&device, "serial", false), out->serial, sizeof out->serial);
    YamlValue usage_value = yaml_get(&device, "usage", false);
    if (yaml_has(&device, "usage_page")) {
        read_id(yaml_get(&device, "usage_page", false), 1, 0xffff, &page);
        read_id(yaml_get(&device, "usage", true), 1, 0xffff, &usage);
        if (page > 0 && usage > 0)
            out->usage = HID_USAGE(page, usage);
    } else if (yaml_text(usage_value, &text) && !(out->usage = hid_usage_of_name(text)))
        yaml_fault(usage_value, "'%s' is '%.40s', an unknown usage; expected joystick, gamepad, multi_axis, mouse … or 0x0001:0x0004", usage_value.name, text);
    if (yaml_has(&device, "gamepad") && yaml_boolean(yaml_get(&device, "gamepad", false), &gamepad) && gamepad)
        out->kind = MAP_GAMEPAD;
    if (yaml_has(&device, "joystick")) {
        copy_name(yaml_get(&device, "joystick", false), out->joystick, sizeof out->joystick);
        out->kind = MAP_JOYSTICK;
        if (!strcmp(out->joystick, "*"))
            out->joystick[0] = 0;
    }
    if (yaml_has(&device, "usb") && yaml_choice(yaml_get(&device, "usb", false), buses) == 0)
        out->kind = MAP_FTDI;
    if (gamepad + yaml_has(&device, "joystick") + yaml_has(&device, "usb") > 1)
        yaml_fault(value, "'device' has several of gamepad, joystick and usb; expected one");
    bool has_ids = yaml_has(&device, "vendor_id") || yaml_has(&device, "product_id") || yaml_has(&device, "serial");
    if (out->kind == MAP_HID && !has_ids && !yaml_has(&device, "usage"))
        yaml_fault(value, "'device' selects nothing; expected vendor_id and product_id, or usage, or gamepad: true, joystick: \"name\", usb: ftdi");
    if ((out->kind == MAP_GAMEPAD || out->kind == MAP_JOYSTICK) && (has_ids || yaml_has(&device, "usage")))
        yaml_fault(value, "gamepads and joysticks read through GLFW have no ids or usages; select one by joystick: \"part of its name\"");
    if (out->kind == MAP_FTDI && yaml_has(&device, "usage"))
        yaml_fault(usage_value, "'%s' is only valid for HID devices", usage_value.name);
}

// --- which tool ---

static void read_tool(YamlValue value, MapHand *hand)
{
    const char *text;
    char *end;
    if (!yaml_text(value, &text))
        return;
    yaml_place(value, &hand->line, &hand->column);
    long number = strtol(text, &end, 10);
    if (!*end && (number < 1 || number > TOOLS_MOST))
        yaml_fault(value, "'%s' is %.20s; expected 1 to %d, outermost first, or a tool's name", value.name, text, TOOLS_MOST);
    else if (strpbrk(text, "., \t") || strlen(text) >= sizeof hand->tool)
        yaml_fault(value, "'%s' is '%.40s'; expected chosen, outer, inner, outermost, innermost, 1 to %d, a tool's name or its kind", value.name, text,
                   TOOLS_MOST);
    else
        snprintf(hand->tool, sizeof hand->tool, "%s", text);
    hand->drives = !strcmp(text, "outer") ? DRIVES_OUTER : !strcmp(text, "inner") ? DRIVES_INNER : DRIVES_CHOSEN;
}

// Index of the map's hand that moves this tool; adds one if there is none.
static int hand_for(const YamlMap *control, DeviceMap *map, const MapHand *usual)
{
    MapHand hand = *usual;
    if (yaml_has(control, "tool"))
        read_tool(yaml_get(control, "tool", false), &hand);
    for (int i = 0; i < map->hand_count; i++)
        if (!strcmp(map->hand[i].tool, hand.tool))
            return i;
    if (map->hand_count == MAP_HANDS) {
        yaml_fault(control->value, "'%s' moves one tool more than the limit; expected at most %d per device", control->value.name, MAP_HANDS);
        return 0;
    }
    map->hand[map->hand_count] = hand;
    return map->hand_count++;
}

// --- sources ---

// "axis_3" -> 3
static int number_after(const char *text, const char *prefix)
{
    size_t n = strlen(prefix);
    char *end;
    if (strncmp(text, prefix, n) || text[n] < '0' || text[n] > '9')
        return -1;
    long number = strtol(text + n, &end, 10);
    return *end || number > 255 ? -1 : (int)number;
}

static bool plain_source(const DeviceMap *map, const char *text, MapSource *source)
{
    int axis = number_after(text, "axis_"), button = number_after(text, "button_");
    if (map->device.kind == MAP_GAMEPAD && axis < 0)
        axis = index_of(gamepad_axis, text);
    if (map->device.kind == MAP_GAMEPAD && button < 0)
        button = index_of(gamepad_button, text);
    source->kind = axis >= 0 ? SOURCE_AXIS : SOURCE_BUTTON;
    source->index = axis >= 0 ? axis : button;
    return source->index >= 0;
}

static void read_source(const DeviceMap *map, const YamlMap *control, MapSource *source)
{
    YamlValue value = yaml_get(control, "source", true);
    const char *text;
    if (!yaml_text(value, &text))
        return;
    yaml_place(value, &source->line, &source->column);
    if (map->device.kind == MAP_GAMEPAD || map->device.kind == MAP_JOYSTICK) {
        if (!plain_source(map, text, source))
            yaml_fault(value, "'%s' is '%.40s'; expected axis_0, button_0 …%s", value.name, text,
                       map->device.kind == MAP_GAMEPAD ? " or left_x, left_y, right_x, right_y, left_trigger, right_trigger, a, b, x, y, dpad_up …" : "");
    } else if (map->device.kind == MAP_FTDI) {
        source->kind = SOURCE_COUNT;
        for (source->index = 0; source->index < map->serial.count_count; source->index++)
            if (!strcmp(text, map->serial.count[source->index]))
                return;
        yaml_fault(value, "'%s' is '%.40s', not among serial.counts", value.name, text);
    } else if (!strcmp(text, "hat_x") || !strcmp(text, "hat_y")) {
        source->kind = text[4] == 'x' ? SOURCE_HID_HAT_X : SOURCE_HID_HAT_Y;
    } else if (!(source->usage = hid_usage_of_name(text))) {
        yaml_fault(value, "'%s' is '%.40s', an unknown usage; expected X, Y, Z, Rx, Ry, Rz, slider, dial, wheel, button_1, hat_x, hat_y … or 0x0001:0x0031",
                   value.name, text);
    }
    if (map->device.kind == MAP_HID && yaml_has(control, "index"))
        yaml_integer(yaml_get(control, "index", false), 0, HID_FIELD_LIMIT, &source->index);
    else if (yaml_has(control, "index"))
        yaml_fault(yaml_get(control, "index", false), "'index' is only valid with HID usages");
}

// Reads an optional flag.
static void read_flag(const YamlMap *map, const char *key, bool *flag)
{
    if (yaml_has(map, key))
        yaml_boolean(yaml_get(map, key, false), flag);
}

static const NumberRange raw_range = {-4294967296.0, 4294967296.0, false};

static void read_calibration(const YamlMap *control, MapAxis *axis)
{
    yaml_map_number(control, "logical_min", false, raw_range, &axis->logical_min);
    yaml_map_number(control, "logical_centre", false, raw_range, &axis->logical_centre);
    yaml_map_number(control, "logical_max", false, raw_range, &axis->logical_max);
    if (axis->logical_min >= axis->logical_max || axis->logical_min > axis->logical_centre || axis->logical_centre > axis->logical_max)
        yaml_fault(control->value, "logical_min, logical_centre and logical_max of '%s' do not increase; use invert: true to reverse an axis",
                   control->value.name);
}

// Checks keys that are valid only with a rate or only with counts.
static void check_kind(const YamlMap *control, const DeviceMap *map, const MapAxis *axis)
{
    static const char *const of_rates[] = {"logical_min", "logical_centre", "logical_max", "dead_zone", "exponent", NULL};
    for (int i = 0; !axis->is_rate && of_rates[i]; i++)
        if (yaml_has(control, of_rates[i]))
            yaml_fault(yaml_get(control, of_rates[i], false), "'%s' is only valid with a deflection (mm_s, deg_s), not with counts", of_rates[i]);
    if (axis->is_rate && (axis->kind == AXIS_RELATIVE || axis->kind == AXIS_COUNTER))
        yaml_fault(yaml_get(control, "kind", false), "a rate needs 'kind: deflection'; counts need mm_per_count or deg_per_count");
    if (!axis->is_rate && axis->kind == AXIS_DEFLECTION)
        yaml_fault(yaml_get(control, "kind", false), "counts need 'kind: relative' or 'kind: counter'; a deflection needs mm_s or deg_s");
    if (axis->is_rate && yaml_has(control, "counts_per_wrap"))
        yaml_fault(yaml_get(control, "counts_per_wrap", false), "'counts_per_wrap' is only valid with counts");
    if (axis->is_rate && map->device.kind == MAP_FTDI)
        yaml_fault(control->value, "an encoder gives counts; expected mm_per_count or deg_per_count");
    if (!axis->is_rate && (map->device.kind == MAP_GAMEPAD || map->device.kind == MAP_JOYSTICK))
        yaml_fault(control->value, "GLFW's axes are deflections; expected mm_s or deg_s");
}

static void read_axis(YamlValue value, DeviceMap *map, const MapHand *usual, bool is_twist)
{
    static const char *const push_keys[] = {"source",      "index",           "mm_s",      "mm_per_count", "kind",   "logical_min", "logical_centre",
                                            "logical_max", "counts_per_wrap", "dead_zone", "exponent",     "invert", "optional",    "tool",
                                            NULL};
    static const char *const twist_keys[] = {"source",      "index",           "deg_s",     "deg_per_count", "kind",   "logical_min", "logical_centre",
                                             "logical_max", "counts_per_wrap", "dead_zone", "exponent",      "invert", "optional",    "tool",
                                             NULL};
    static const char *const kinds[] = {"deflection", "relative", "counter", NULL};
    YamlMap control = yaml_map(value, is_twist ? twist_keys : push_keys);
    if (!control.value.node)
        return;
    if (map->axis_count == MAP_AXES) {
        yaml_fault(value, "more than %d axes", MAP_AXES);
        return;
    }
    const char *rate = is_twist ? "deg_s" : "mm_s", *count = is_twist ? "deg_per_count" : "mm_per_count";
    MapAxis *axis = &map->axis[map->axis_count++];
    *axis = (MapAxis){.is_twist = is_twist,
                      .hand = hand_for(&control, map, usual),
                      .is_rate = yaml_has(&control, rate),
                      .logical_min = NAN,
                      .logical_centre = NAN,
                      .logical_max = NAN,
                      .counts_per_wrap = NAN,
                      .dead_zone = 0.05,
                      .exponent = 1};
    read_source(map, &control, &axis->source);
    if (axis->is_rate == yaml_has(&control, count))
        yaml_fault(value, "'%s' needs exactly one of %s and %s", value.name, rate, count);
    yaml_map_number(&control, rate, false, (NumberRange){0, is_twist ? SCRIPT_FASTEST_DEG_S : SCRIPT_FASTEST_MM_S, true}, &axis->scale);
    yaml_map_number(&control, count, false, (NumberRange){0, is_twist ? 360 : 100, true}, &axis->scale);
    if (yaml_has(&control, "kind"))
        axis->kind = (AxisKind)(1 + yaml_choice(yaml_get(&control, "kind", false), kinds));
    read_calibration(&control, axis);
    yaml_map_number(&control, "counts_per_wrap", false, (NumberRange){0, 4294967296.0, false}, &axis->counts_per_wrap);
    if (axis->counts_per_wrap != floor(axis->counts_per_wrap) && !isnan(axis->counts_per_wrap))
        yaml_fault(yaml_get(&control, "counts_per_wrap", false), "'counts_per_wrap' is not a whole number");
    yaml_map_number(&control, "dead_zone", false, (NumberRange){0, 0.9, false}, &axis->dead_zone);
    yaml_map_number(&control, "exponent", false, (NumberRange){0.2, 5, false}, &axis->exponent);
    read_flag(&control, "invert", &axis->invert);
    read_flag(&control, "optional", &axis->source.optional);
    check_kind(&control, map, axis);
}

static void read_button(YamlValue value, DeviceMap *map, unsigned bit)
{
    static const char *const keys[] = {"source", "index", "above", "invert", "optional", NULL};
    YamlMap control = yaml_map(value, keys);
    if (!control.value.node)
        return;
    if (map->button_count == MAP_BUTTONS) {
        yaml_fault(value, "more than %d buttons", MAP_BUTTONS);
        return;
    }
    MapButton *button = &map->button[map->button_count++];
    *button = (MapButton){.bit = bit, .above = 0.5};
    if (map->device.kind == MAP_FTDI)
        yaml_fault(value, "an encoder has counts but no buttons");
    else
        read_source(map, &control, &button->source);
    yaml_map_number(&control, "above", false, (NumberRange){-1, 1, false}, &button->above);
    read_flag(&control, "invert", &button->invert);
    read_flag(&control, "optional", &button->source.optional);
}

// Reads one control or a list of them; `bit` 0: an axis.
static void read_controls(YamlValue value, DeviceMap *map, const MapHand *usual, bool is_twist, unsigned bit)
{
    int count = !value.node ? 0 : yaml_is_list(value) ? yaml_count(value, 1, MAP_BUTTONS) : 1;
    for (int i = 0; i < count; i++) {
        YamlValue item = yaml_is_list(value) ? yaml_item(value, i) : value;
        if (bit)
            read_button(item, map, bit);
        else
            read_axis(item, map, usual, is_twist);
    }
}

// --- force and serial line ---

static void read_force(YamlValue value, DeviceMap *map)
{
    static const char *const keys[] = {"full_scale_n", "max_n", "slew_n_s", "full_scale_n_mm", "direction_deg", "stall_ms", "quiet_ms", "invert", NULL};
    YamlMap force = yaml_map(value, keys);
    MapForce *out = &map->force;
    if (!force.value.node)
        return;
    if (map->device.kind != MAP_HID)
        yaml_fault(value, "'force' needs a HID device (PID effects); GLFW and serial devices have none");
    *out = (MapForce){.is_wanted = true, .slew_n_s = 200, .direction_deg = NAN, .stall_ms = 50, .quiet_ms = 200};
    yaml_map_number(&force, "full_scale_n", true, (NumberRange){0, 100, true}, &out->full_scale_n);
    out->max_n = out->full_scale_n;
    yaml_map_number(&force, "max_n", false, (NumberRange){0, 100, true}, &out->max_n);
    yaml_map_number(&force, "slew_n_s", false, (NumberRange){0, 1e5, true}, &out->slew_n_s);
    yaml_map_number(&force, "full_scale_n_mm", false, (NumberRange){0, 1e4, true}, &out->full_scale_n_mm);
    yaml_map_number(&force, "direction_deg", false, (NumberRange){0, 360, false}, &out->direction_deg);
    if (yaml_has(&force, "stall_ms"))
        yaml_integer(yaml_get(&force, "stall_ms", false), 5, 1000, &out->stall_ms);
    if (yaml_has(&force, "quiet_ms"))
        yaml_integer(yaml_get(&force, "quiet_ms", false), 0, 10000, &out->quiet_ms);
    read_flag(&force, "invert", &out->invert);
    if (out->full_scale_n > 0 && out->max_n > out->full_scale_n)
        yaml_fault(value, "'max_n' %g is above 'full_scale_n' %g, the device's largest", out->max_n, out->full_scale_n);
}

static void read_serial(YamlValue value, DeviceMap *map)
{
    static const char *const keys[] = {"baud", "counts", "bits", NULL};
    YamlMap serial = yaml_map(value, keys);
    MapSerial *out = &map->serial;
    *out = (MapSerial){.baud = 115200, .count = {"A", "R"}, .count_count = 2, .bits = 32};
    if (!serial.value.node)
        return;
    if (map->device.kind != MAP_FTDI)
        yaml_fault(value, "'serial' is only valid with device: {usb: ftdi}");
    if (yaml_has(&serial, "baud"))
        yaml_integer(yaml_get(&serial, "baud", false), 300, 3000000, &out->baud);
    if (yaml_has(&serial, "bits"))
        yaml_integer(yaml_get(&serial, "bits", false), 0, 32, &out->bits);
    YamlValue counts = yaml_get(&serial, "counts", false);
    int count = counts.node ? yaml_count(counts, 1, 2) : -1;
    for (int i = 0; i < count; i++) {
        YamlValue name = yaml_item(counts, i);
        copy_name(name, out->count[i], sizeof out->count[i]);
        if (strpbrk(out->count[i], "+-0123456789 \t"))
            yaml_fault(name, "'%s' comes before a number in each line; expected a name without digits, signs and spaces", out->count[i]);
        if (i && !strcmp(out->count[0], out->count[1]))
            yaml_fault(name, "'%s' appears twice", out->count[1]);
    }
    if (count > 0)
        out->count_count = count;
}

static void read_map(YamlReader *reader, DeviceMap *map)
{
    static const char *const keys[] = {"seldinger_device", "name",         "device", "tool",   "push",     "twist", "pedal",  "contrast", "stop", "mark",
                                       "choose_outer",     "choose_inner", "lock",   "let_go", "exchange", "force", "serial", NULL};
    static const struct ButtonKey {
        const char *key;
        unsigned bit;
    } buttons[] = {{"pedal", HAND_PEDAL},
                   {"contrast", HAND_CONTRAST},
                   {"stop", HAND_STOP},
                   {"mark", HAND_MARK},
                   {"choose_outer", HAND_CHOOSE_OUTER},
                   {"choose_inner", HAND_CHOOSE_INNER},
                   {"lock", HAND_LOCK},
                   {"let_go", HAND_RELEASE},
                   {"exchange", HAND_EXCHANGE}};
    YamlValue root = yaml_root(reader);
    if (!yaml_is_map(root))
        yaml_fault(root, "is not a device map; expected 'seldinger_device: 1' on the first line");
    YamlMap top = yaml_map(root, keys);
    MapHand usual = {.tool = "chosen", .drives = DRIVES_CHOSEN};
    int version;
    if (!top.value.node)
        return;
    YamlValue version_value = yaml_get(&top, "seldinger_device", true);
    if (version_value.node)
        yaml_integer(version_value, 1, 1, &version);
    snprintf(map->name, sizeof map->name, "device");
    if (yaml_has(&top, "name"))
        copy_name(yaml_get(&top, "name", false), map->name, sizeof map->name);
    map->device = (MapDevice){.kind = MAP_HID, .vendor_id = -1, .product_id = -1};
    read_device(yaml_get(&top, "device", true), map);
    read_serial(yaml_get(&top, "serial", false), map);
    if (yaml_has(&top, "tool"))
        read_tool(yaml_get(&top, "tool", false), &usual);
    read_controls(yaml_get(&top, "push", false), map, &usual, false, 0);
    read_controls(yaml_get(&top, "twist", false), map, &usual, true, 0);
    if (map->hand_count == 0)
        map->hand[map->hand_count++] = usual;
    for (size_t i = 0; i < sizeof buttons / sizeof *buttons; i++)
        read_controls(yaml_get(&top, buttons[i].key, false), map, &usual, false, buttons[i].bit);
    read_force(yaml_get(&top, "force", false), map);
    if (!yaml_has(&top, "push") && !yaml_has(&top, "twist") && map->button_count == 0)
        yaml_fault(root,
                   "has none of push, twist, pedal, contrast, stop, mark, choose_outer, choose_inner, lock, let_go, exchange; expected at least one of these");
}

DeviceMap *device_map_parse(const char *text, size_t length, const char *file, Faults *faults)
{
    int before = faults->count;
    YamlReader *reader = yaml_reader_open(text, length, file, faults);
    if (!reader)
        return NULL;
    DeviceMap *map = calloc(1, sizeof *map);
    if (map) {
        snprintf(map->file, sizeof map->file, "%s", file);
        read_map(reader, map);
    } else {
        faults_add(faults, file, 0, 0, "out of memory for the device map");
    }
    yaml_reader_close(reader);
    if (faults->count > before) {
        free(map);
        return NULL;
    }
    return map;
}

DeviceMap *device_map_load(const char *path, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    DeviceMap *map = text ? device_map_parse(text, length, path, faults) : NULL;
    free(text);
    return map;
}

void device_map_scale(DeviceMap *map, double push, double twist)
{
    for (int i = 0; i < map->axis_count; i++) {
        double factor = map->axis[i].is_twist ? twist : push;
        map->axis[i].scale *= fabs(factor);
        map->axis[i].invert ^= factor < 0;
    }
}

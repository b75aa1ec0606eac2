// Items of a descriptor are read one by one (USB HID 1.11, section 6.2.2): global items apply until changed and can be pushed and popped, local items
// apply until the next main item, and main items make fields from both.
#include "input/hid_report.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEEPEST = 64, DEEPEST_PUSH = 16, LOCAL_USAGES = 512 };
enum { TYPE_MAIN, TYPE_GLOBAL, TYPE_LOCAL };
enum { MAIN_INPUT = 8, MAIN_OUTPUT = 9, MAIN_COLLECTION = 10, MAIN_FEATURE = 11, MAIN_END = 12 };
enum {
    GLOBAL_PAGE,
    GLOBAL_LOGICAL_MIN,
    GLOBAL_LOGICAL_MAX,
    GLOBAL_PHYSICAL_MIN,
    GLOBAL_PHYSICAL_MAX,
    GLOBAL_EXPONENT,
    GLOBAL_UNIT,
    GLOBAL_SIZE,
    GLOBAL_ID,
    GLOBAL_COUNT,
    GLOBAL_PUSH,
    GLOBAL_POP
};
enum { LOCAL_USAGE, LOCAL_USAGE_MIN, LOCAL_USAGE_MAX, LOCAL_DELIMITER = 10 };

// A value that may be signed or unsigned. Which one is known only from the other end of the range (a maximum of 255 is often one byte, FF).
typedef struct Either {
    int64_t as_signed, as_unsigned;
} Either;

typedef struct Globals {
    uint32_t page;
    Either logical_min, logical_max, physical_min, physical_max;
    int unit_exponent;
    uint32_t unit;
    int64_t size, count;
    int report_id;           // 0: none yet
} Globals;

typedef struct LocalUsage {
    uint32_t first, last;
    bool has_page;           // otherwise the page that applies at the main item is used
} LocalUsage;

typedef struct Reading {
    const char *name;
    Faults *faults;
    HidDescriptor *out;
    size_t at;               // byte offset of the current item
    bool good;
    Globals global, pushed[DEEPEST_PUSH];
    int push_count;
    LocalUsage usage[LOCAL_USAGES];
    int usage_count;
    bool has_usage_min, usage_min_has_page;
    uint32_t usage_min;
    int delimiter;           // 0 none; 1 inside a delimiter set, its first usage not yet read; 2 inside a set, further usages are ignored
    int open[DEEPEST], open_count;
    bool has_field_without_id;
} Reading;

static void refuse(Reading *reading, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void refuse(Reading *reading, const char *format, ...)
{
    char text[FAULT_LENGTH];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    faults_add_at_byte(reading->faults, reading->name, reading->at, "%s", text);
    reading->good = false;
}

// --- local items ---

static void add_usages(Reading *reading, uint32_t first, uint32_t last, bool has_page)
{
    if (reading->delimiter == 2)
        return;
    if (reading->delimiter == 1)
        reading->delimiter = 2;
    if (reading->usage_count == LOCAL_USAGES)
        refuse(reading, "more than %d usages for one item", LOCAL_USAGES);
    else
        reading->usage[reading->usage_count++] = (LocalUsage){first, last, has_page};
}

static void read_local(Reading *reading, int tag, uint32_t value, int size)
{
    bool has_page = size == 4;
    switch (tag) {
    case LOCAL_USAGE: add_usages(reading, value, value, has_page); break;
    case LOCAL_USAGE_MIN:
        reading->usage_min = value;
        reading->usage_min_has_page = has_page;
        reading->has_usage_min = true;
        break;
    case LOCAL_USAGE_MAX:
        if (!reading->has_usage_min) {
            refuse(reading, "a usage maximum without a minimum before it");
            break;
        }
        reading->has_usage_min = false;
        if ((value & 0xffff) < (reading->usage_min & 0xffff) || (has_page && reading->usage_min_has_page && value >> 16 != reading->usage_min >> 16))
            refuse(reading, "usages from 0x%x to 0x%x; expected a rising range on one page", (unsigned)reading->usage_min, (unsigned)value);
        else if (has_page || reading->usage_min_has_page) {
            uint32_t page = has_page ? value & 0xffff0000u : reading->usage_min & 0xffff0000u;
            add_usages(reading, page | (reading->usage_min & 0xffff), page | (value & 0xffff), true);
        } else
            add_usages(reading, reading->usage_min, value, false);
        break;
    case LOCAL_DELIMITER:
        if (value > 1 || (value == 1) == (reading->delimiter > 0))
            refuse(reading, "delimiters that do not open and close alternately");
        else
            reading->delimiter = (int)value;
        break;
    case 3:
    case 4:
    case 5:
    case 7:
    case 8:
    case 9: break; // designators and strings do not affect the bits
    default: refuse(reading, "an unknown local item, tag %d", tag);
    }
}

static void end_locals(Reading *reading)
{
    if (reading->delimiter)
        refuse(reading, "a delimiter set that is not closed");
    if (reading->has_usage_min)
        refuse(reading, "a usage minimum without its maximum");
    reading->usage_count = 0;
    reading->has_usage_min = false;
    reading->delimiter = 0;
}

static LocalUsage full_usage(const Reading *reading, int index)
{
    LocalUsage usage = reading->usage[index];
    if (!usage.has_page) {
        usage.first = reading->global.page << 16 | usage.first;
        usage.last = reading->global.page << 16 | usage.last;
    }
    return usage;
}

// --- global items ---

static void read_global(Reading *reading, int tag, uint32_t value, int64_t as_signed)
{
    Globals *global = &reading->global;
    Either either = {as_signed, value};
    switch (tag) {
    case GLOBAL_PAGE:
        if (value == 0 || value > 0xffff)
            refuse(reading, "usage page 0x%x; expected 1 to 0xffff", (unsigned)value);
        else
            global->page = value;
        break;
    case GLOBAL_LOGICAL_MIN: global->logical_min = either; break;
    case GLOBAL_LOGICAL_MAX: global->logical_max = either; break;
    case GLOBAL_PHYSICAL_MIN: global->physical_min = either; break;
    case GLOBAL_PHYSICAL_MAX: global->physical_max = either; break;
    // a nibble in two's complement; some devices write the whole byte (FD for -3)
    case GLOBAL_EXPONENT: global->unit_exponent = (int)((value & 15) ^ 8) - 8; break;
    case GLOBAL_UNIT: global->unit = value; break;
    case GLOBAL_SIZE: global->size = value; break;
    case GLOBAL_ID:
        if (value == 0 || value > 255)
            refuse(reading, "report id %u; expected 1 to 255", (unsigned)value);
        else if (reading->has_field_without_id)
            refuse(reading, "report id %u after fields without one; expected ids for all reports or for none", (unsigned)value);
        else
            global->report_id = (int)value, reading->out->uses_ids = true;
        break;
    case GLOBAL_COUNT: global->count = value; break;
    case GLOBAL_PUSH:
        if (reading->push_count == DEEPEST_PUSH)
            refuse(reading, "pushed more than %d deep", DEEPEST_PUSH);
        else
            reading->pushed[reading->push_count++] = *global;
        break;
    case GLOBAL_POP:
        if (reading->push_count == 0)
            refuse(reading, "a pop without a push before it");
        else
            *global = reading->pushed[--reading->push_count];
        break;
    default: refuse(reading, "an unknown global item, tag %d", tag);
    }
}

// --- main items ---

static HidReport *find_report(HidDescriptor *out, HidReportKind kind, int id)
{
    for (int i = 0; i < out->report_count; i++)
        if (out->report[i].kind == kind && out->report[i].id == id)
            return &out->report[i];
    if (out->report_count == HID_REPORT_LIMIT)
        return NULL;
    out->report[out->report_count] = (HidReport){.kind = kind, .id = id};
    return &out->report[out->report_count++];
}

// Signed if the minimum is negative; otherwise the maximum is unsigned, and FF in one byte is 255.
static void choose_sign(Either low, Either high, int64_t *min, int64_t *max)
{
    *min = low.as_signed;
    *max = low.as_signed < 0 ? high.as_signed : high.as_unsigned;
}

static bool add_field(Reading *reading, HidField field)
{
    if (reading->out->field_count == HID_FIELD_LIMIT) {
        refuse(reading, "more than %d fields", HID_FIELD_LIMIT);
        return false;
    }
    reading->out->field[reading->out->field_count++] = field;
    return true;
}

static void add_array(Reading *reading, HidField field)
{
    HidDescriptor *out = reading->out;
    field.first_range = out->range_count;
    for (int i = 0; i < reading->usage_count; i++) {
        LocalUsage usage = full_usage(reading, i);
        if (out->range_count == HID_RANGE_LIMIT) {
            refuse(reading, "more than %d usages in arrays", HID_RANGE_LIMIT);
            return;
        }
        out->range[out->range_count++] = (HidUsageRange){usage.first, usage.last};
    }
    field.range_count = out->range_count - field.first_range;
    field.usage = field.range_count ? out->range[field.first_range].first : 0;
    add_field(reading, field);
}

// Control i has usage i; all remaining controls have the last usage and become one field.
static void add_variables(Reading *reading, HidField field)
{
    int left = field.count, which = 0;
    uint32_t offset = 0;
    while (left > 0) {
        HidField one = field;
        one.count = left;
        bool is_last = true;
        if (which < reading->usage_count) {
            LocalUsage usage = full_usage(reading, which);
            one.usage = usage.first + offset;
            if (usage.first + offset < usage.last)
                offset++, is_last = false;
            else if (which + 1 < reading->usage_count)
                which++, offset = 0, is_last = false;
        }
        if (!is_last)
            one.count = 1;
        if (!add_field(reading, one))
            return;
        field.bit += one.count * field.size;
        left -= one.count;
    }
}

static void read_fields(Reading *reading, HidReportKind kind, uint32_t flags)
{
    const Globals *global = &reading->global;
    bool is_constant = flags & HID_CONSTANT;
    if (global->count == 0)
        return;
    if (global->size == 0) {
        refuse(reading, "fields of 0 bits; expected a report size before them");
        return;
    }
    if (global->size > 32 && !is_constant) {
        refuse(reading, "fields of %lld bits; expected at most 32", (long long)global->size);
        return;
    }
    if (global->size > HID_REPORT_BITS || global->count > HID_REPORT_BITS || global->size * global->count > HID_REPORT_BITS) {
        refuse(reading, "%lld fields of %lld bits; expected at most %d bits in a report", (long long)global->count, (long long)global->size, HID_REPORT_BITS);
        return;
    }
    HidReport *report = find_report(reading->out, kind, global->report_id);
    int bits = (int)(global->size * global->count);
    if (!report) {
        refuse(reading, "more than %d reports", HID_REPORT_LIMIT);
        return;
    }
    if (report->bits + bits > HID_REPORT_BITS) {
        refuse(reading, "report %d grows to %d bits; expected at most %d", report->id, report->bits + bits, HID_REPORT_BITS);
        return;
    }
    HidField field = {.kind = kind,
                      .report_id = global->report_id,
                      .bit = report->bits,
                      .size = (int)global->size,
                      .count = (int)global->count,
                      .unit = global->unit,
                      .unit_exponent = global->unit_exponent,
                      .flags = flags & 0x1ff,
                      .collection = reading->open_count ? reading->open[reading->open_count - 1] : -1};
    reading->has_field_without_id |= global->report_id == 0;
    report->bits += bits;
    choose_sign(global->logical_min, global->logical_max, &field.logical_min, &field.logical_max);
    choose_sign(global->physical_min, global->physical_max, &field.physical_min, &field.physical_max);
    if (field.logical_min > field.logical_max && !is_constant) {
        refuse(reading, "a logical range from %lld to %lld; expected a minimum no greater than the maximum", (long long)field.logical_min,
               (long long)field.logical_max);
        return;
    }
    // 0 to 0, the initial state, means that the physical range equals the logical one (section 6.2.2.7)
    if (field.physical_min >= field.physical_max)
        field.physical_min = field.logical_min, field.physical_max = field.logical_max;
    if (is_constant)
        add_field(reading, field);
    else if (flags & HID_VARIABLE)
        add_variables(reading, field);
    else
        add_array(reading, field);
}

static void open_collection(Reading *reading, uint32_t type)
{
    HidDescriptor *out = reading->out;
    if (reading->open_count == DEEPEST || out->collection_count == HID_COLLECTION_LIMIT) {
        refuse(reading, reading->open_count == DEEPEST ? "collections are nested more than %d deep" : "more than %d collections",
               reading->open_count == DEEPEST ? (int)DEEPEST : (int)HID_COLLECTION_LIMIT);
        return;
    }
    out->collection[out->collection_count] = (HidCollection){.type = (int)(type & 0xff),
                                                             .usage = reading->usage_count ? full_usage(reading, 0).first : 0,
                                                             .parent = reading->open_count ? reading->open[reading->open_count - 1] : -1};
    reading->open[reading->open_count++] = out->collection_count++;
}

static void read_main(Reading *reading, int tag, uint32_t value, size_t size)
{
    // zero bytes after the end, which some devices use as padding
    if (tag == 0 && size == 0 && reading->open_count == 0)
        return;
    switch (tag) {
    case MAIN_INPUT: read_fields(reading, HID_INPUT, value); break;
    case MAIN_OUTPUT: read_fields(reading, HID_OUTPUT, value); break;
    case MAIN_FEATURE: read_fields(reading, HID_FEATURE, value); break;
    case MAIN_COLLECTION: open_collection(reading, value); break;
    case MAIN_END:
        if (reading->open_count == 0)
            refuse(reading, "an end of a collection without its beginning");
        else
            reading->open_count--;
        break;
    default: refuse(reading, "an unknown main item, tag %d", tag);
    }
    if (reading->good)
        end_locals(reading);
}

// --- the descriptor ---

// Reads one item at reading->at. Returns its length in bytes, or 0 if it is truncated or refused.
static size_t read_item(Reading *reading, const uint8_t *bytes, size_t length)
{
    const uint8_t *item = bytes + reading->at;
    size_t left = length - reading->at;
    if (item[0] == 0xfe) {    // a long item: none is defined, so it is skipped (section 6.2.2.3)
        if (left < 3 || left < 3 + (size_t)item[1]) {
            refuse(reading, "a long item is truncated");
            return 0;
        }
        return 3 + (size_t)item[1];
    }
    size_t size = (item[0] & 3) == 3 ? 4 : (size_t)(item[0] & 3);
    if (left < 1 + size) {
        refuse(reading, "an item of %zu bytes is truncated; %zu bytes are left", 1 + size, left);
        return 0;
    }
    uint32_t value = 0;
    for (size_t i = 0; i < size; i++)
        value |= (uint32_t)item[1 + i] << 8 * i;
    int64_t as_signed = value;
    if (size > 0 && value >> (8 * size - 1))
        as_signed -= (int64_t)1 << 8 * size;
    int type = item[0] >> 2 & 3, tag = item[0] >> 4;
    if (type == TYPE_MAIN)
        read_main(reading, tag, value, size);
    else if (type == TYPE_GLOBAL)
        read_global(reading, tag, value, as_signed);
    else if (type == TYPE_LOCAL)
        read_local(reading, tag, value, (int)size);
    else
        refuse(reading, "an item of the reserved type");
    return reading->good ? 1 + size : 0;
}

static void measure_reports(HidDescriptor *out)
{
    int *longest[] = {&out->input_bytes, &out->output_bytes, &out->feature_bytes};
    for (int i = 0; i < out->report_count; i++) {
        int bytes = (out->report[i].bits + 7) / 8 + out->uses_ids;
        if (bytes > *longest[out->report[i].kind])
            *longest[out->report[i].kind] = bytes;
    }
}

HidDescriptor *hid_descriptor_parse(const uint8_t *bytes, size_t length, const char *name, Faults *faults)
{
    Reading *reading = calloc(1, sizeof *reading);
    HidDescriptor *out = calloc(1, sizeof *out);
    if (!reading || !out) {
        faults_add(faults, name, 0, 0, "out of memory for the report descriptor");
        free(reading);
        free(out);
        return NULL;
    }
    *reading = (Reading){.name = name, .faults = faults, .out = out, .good = true};
    if (length == 0 || length > HID_DESCRIPTOR_LIMIT)
        refuse(reading, "a report descriptor of %zu bytes; expected 1 to %d", length, HID_DESCRIPTOR_LIMIT);
    while (reading->good && reading->at < length)
        reading->at += read_item(reading, bytes, length);
    if (reading->good && reading->open_count > 0)
        refuse(reading, "%d collections are not closed", reading->open_count);
    if (reading->good && reading->push_count > 0)
        refuse(reading, "%d pushes are not popped", reading->push_count);
    if (reading->good && out->field_count == 0)
        refuse(reading, "no field; expected at least one input, output or feature");
    bool good = reading->good;
    free(reading);
    if (!good) {
        free(out);
        return NULL;
    }
    measure_reports(out);
    return out;
}

const HidReport *hid_report_find(const HidDescriptor *descriptor, HidReportKind kind, int id)
{
    for (int i = 0; i < descriptor->report_count; i++)
        if (descriptor->report[i].kind == kind && descriptor->report[i].id == id)
            return &descriptor->report[i];
    return NULL;
}

HidReportCheck hid_report_open(const HidDescriptor *descriptor, HidReportKind kind, const uint8_t *bytes, size_t length, const HidReport **report,
                               const uint8_t **payload, size_t *payload_length)
{
    size_t header = descriptor->uses_ids;
    if (length < header || length == 0)
        return HID_REPORT_SHORT;
    const HidReport *found = hid_report_find(descriptor, kind, header ? bytes[0] : 0);
    if (!found)
        return HID_REPORT_UNKNOWN_ID;
    if (length - header < (size_t)(found->bits + 7) / 8)
        return HID_REPORT_SHORT;
    *report = found;
    *payload = bytes + header;
    *payload_length = length - header;
    return HID_REPORT_GOOD;
}

// --- values ---

static bool field_lies_within(const HidField *field, int index, size_t length)
{
    return index >= 0 && index < field->count && field->size <= 32 && (size_t)field->bit + ((size_t)index + 1) * (size_t)field->size <= 8 * length;
}

bool hid_field_read(const HidField *field, int index, const uint8_t *payload, size_t length, int64_t *value)
{
    if (!field_lies_within(field, index, length))
        return false;
    size_t bit = (size_t)field->bit + (size_t)index * (size_t)field->size, end = bit + (size_t)field->size;
    uint64_t bits = 0;
    for (size_t byte = bit / 8, shift = 0; byte <= (end - 1) / 8; byte++, shift += 8)
        bits |= (uint64_t)payload[byte] << shift;
    bits = bits >> bit % 8 & (((uint64_t)1 << field->size) - 1);
    *value = (int64_t)bits;
    if (field->logical_min < 0 && bits >> (field->size - 1))
        *value -= (int64_t)1 << field->size;
    return true;
}

bool hid_field_write(const HidField *field, int index, uint8_t *payload, size_t length, int64_t value)
{
    if (!field_lies_within(field, index, length))
        return false;
    size_t bit = (size_t)field->bit + (size_t)index * (size_t)field->size, end = bit + (size_t)field->size;
    uint64_t mask = (((uint64_t)1 << field->size) - 1) << bit % 8, bits = (uint64_t)value << bit % 8 & mask;
    for (size_t byte = bit / 8, shift = 0; byte <= (end - 1) / 8; byte++, shift += 8)
        payload[byte] = (uint8_t)((payload[byte] & ~(mask >> shift)) | bits >> shift);
    return true;
}

bool hid_field_in_range(const HidField *field, int64_t value) { return value >= field->logical_min && value <= field->logical_max; }

const HidField *hid_find_usage(const HidDescriptor *descriptor, HidReportKind kind, uint32_t usage, int index, int collection, int *slot)
{
    for (int i = 0; i < descriptor->field_count; i++) {
        const HidField *field = &descriptor->field[i];
        if (field->kind != kind || !(field->flags & HID_VARIABLE) || field->flags & HID_CONSTANT || field->usage != usage ||
            (collection >= 0 && !hid_is_within(descriptor, field->collection, collection)))
            continue;
        if (index < field->count) {
            *slot = index;
            return field;
        }
        index -= field->count;
    }
    return NULL;
}

bool hid_array_value(const HidDescriptor *descriptor, const HidField *array, uint32_t usage, int64_t *value)
{
    int64_t before = 0;
    for (int i = 0; i < array->range_count; i++) {
        const HidUsageRange *range = &descriptor->range[array->first_range + i];
        if (usage >= range->first && usage <= range->last) {
            *value = array->logical_min + before + (int64_t)(usage - range->first);
            return *value <= array->logical_max;
        }
        before += (int64_t)(range->last - range->first) + 1;
    }
    return false;
}

bool hid_array_has(const HidDescriptor *descriptor, const HidField *array, uint32_t usage, const uint8_t *payload, size_t length)
{
    int64_t wanted, value;
    if (!hid_array_value(descriptor, array, usage, &wanted))
        return false;
    for (int i = 0; i < array->count; i++)
        if (hid_field_read(array, i, payload, length, &value) && value == wanted)
            return true;
    return false;
}

int hid_find_collection(const HidDescriptor *descriptor, uint32_t usage, int from)
{
    for (int i = from < 0 ? 0 : from; i < descriptor->collection_count; i++)
        if (descriptor->collection[i].usage == usage)
            return i;
    return -1;
}

bool hid_is_within(const HidDescriptor *descriptor, int collection, int ancestor)
{
    for (int i = collection; i >= 0; i = descriptor->collection[i].parent)
        if (i == ancestor)
            return true;
    return false;
}

// --- names ---

static const struct UsageName {
    uint32_t usage;
    const char *name;
} usage_names[] = {
    {HID_USAGE(1, 0x01), "pointer"},    {HID_USAGE(1, 0x02), "mouse"},    {HID_USAGE(1, 0x04), "joystick"},    {HID_USAGE(1, 0x05), "gamepad"},
    {HID_USAGE(1, 0x06), "keyboard"},   {HID_USAGE(1, 0x07), "keypad"},   {HID_USAGE(1, 0x08), "multi_axis"},  {HID_USAGE(1, 0x30), "X"},
    {HID_USAGE(1, 0x31), "Y"},          {HID_USAGE(1, 0x32), "Z"},        {HID_USAGE(1, 0x33), "Rx"},          {HID_USAGE(1, 0x34), "Ry"},
    {HID_USAGE(1, 0x35), "Rz"},         {HID_USAGE(1, 0x36), "slider"},   {HID_USAGE(1, 0x37), "dial"},        {HID_USAGE(1, 0x38), "wheel"},
    {HID_USAGE(1, 0x39), "hat_switch"}, {HID_USAGE(1, 0x40), "Vx"},       {HID_USAGE(1, 0x41), "Vy"},          {HID_USAGE(1, 0x42), "Vz"},
    {HID_USAGE(2, 0xba), "rudder"},     {HID_USAGE(2, 0xbb), "throttle"}, {HID_USAGE(2, 0xc4), "accelerator"}, {HID_USAGE(2, 0xc5), "brake"},
    {HID_USAGE(2, 0xc6), "clutch"},     {HID_USAGE(2, 0xc8), "steering"}, {HID_USAGE(0x0c, 0x238), "ac_pan"},  {HID_USAGE(0x0f, 0x01), "force_feedback"},
};
enum { NAME_COUNT = sizeof usage_names / sizeof usage_names[0] };

// Parses a whole number, decimal or 0x…, up to `most`; sets `end` to its end.
static bool small_number(const char *text, unsigned long most, unsigned long *number, char **end)
{
    if (text[0] < '0' || text[0] > '9')
        return false;
    *number = strtoul(text, end, text[0] == '0' && (text[1] == 'x' || text[1] == 'X') ? 16 : 10);
    return *number <= most;
}

uint32_t hid_usage_of_name(const char *name)
{
    unsigned long page, usage;
    char *end;
    for (int i = 0; i < NAME_COUNT; i++)
        if (!strcmp(name, usage_names[i].name))
            return usage_names[i].usage;
    if (!strncmp(name, "button_", 7) && small_number(name + 7, 0xffff, &usage, &end) && !*end && usage > 0)
        return HID_USAGE(9, usage);
    if (small_number(name, 0xffff, &page, &end) && *end == ':' && page > 0 && small_number(end + 1, 0xffff, &usage, &end) && !*end)
        return HID_USAGE(page, usage);
    return 0;
}

void hid_usage_name(uint32_t usage, char *out, size_t capacity)
{
    for (int i = 0; i < NAME_COUNT; i++)
        if (usage_names[i].usage == usage) {
            snprintf(out, capacity, "%s", usage_names[i].name);
            return;
        }
    if (usage >> 16 == 9 && (usage & 0xffff) > 0)
        snprintf(out, capacity, "button_%u", (unsigned)(usage & 0xffff));
    else
        snprintf(out, capacity, "0x%04x:0x%04x", (unsigned)(usage >> 16), (unsigned)(usage & 0xffff));
}

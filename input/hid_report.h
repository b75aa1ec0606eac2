// HID report descriptors and reports (USB HID 1.11, sections 5 and 6.2.2; usages: HID Usage Tables 1.4). A descriptor becomes a list of fields that
// give the position of each control in its report; the value of a field is then read from a report's bytes or written into them.
//
// The parser trusts nothing: an inconsistent descriptor is refused with byte offset and reason, and never used in part. Limits: 4096 bytes, 1024 fields,
// 65,536 bits per report, 64 collections, 16 levels of push. Pure functions; they allocate only the descriptor itself.
#ifndef SELDINGER_INPUT_HID_REPORT_H
#define SELDINGER_INPUT_HID_REPORT_H

#include "base/base.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// A usage with its page: page << 16 | usage, "0001:0030" in messages.
#define HID_USAGE(page, id) ((uint32_t)(page) << 16 | (uint32_t)(id))

enum { HID_DESCRIPTOR_LIMIT = 4096, HID_FIELD_LIMIT = 1024, HID_REPORT_BITS = 65536, HID_REPORT_LIMIT = 192 };
enum { HID_COLLECTION_LIMIT = 256, HID_RANGE_LIMIT = 1024 };
enum { HID_REPORT_BYTES = HID_REPORT_BITS / 8 + 1 };   // including its id

typedef enum { HID_INPUT, HID_OUTPUT, HID_FEATURE } HidReportKind;

// Bits of a main item (section 6.2.2.5).
enum {
    HID_CONSTANT = 1,
    HID_VARIABLE = 2,
    HID_RELATIVE = 4,
    HID_WRAP = 8,
    HID_NONLINEAR = 16,
    HID_NO_PREFERRED = 32,
    HID_NULL_STATE = 64,
    HID_VOLATILE = 128,
    HID_BUFFERED = 256
};

typedef struct HidUsageRange {
    uint32_t first, last;    // both included, on one page
} HidUsageRange;

// One control, or `count` consecutive controls with the same usage, or an array of `count` slots that each hold an active usage.
typedef struct HidField {
    HidReportKind kind;
    int report_id;           // 0 if the descriptor has no ids
    int bit;                 // from the first bit after the id byte
    int size, count;         // bits of each control; number of consecutive controls
    uint32_t usage;          // of a variable; 0 for a constant or if none was given; for an array its first usage
    int first_range, range_count;    // for an array: the meaning of its values, in HidDescriptor.range
    int64_t logical_min, logical_max, physical_min, physical_max;
    uint32_t unit;           // as in the descriptor (nibbles: system, length, mass, time, …)
    int unit_exponent;       // -8 to 7
    unsigned flags;          // HID_ bits
    int collection;          // index of the innermost one in HidDescriptor.collection; -1: none
} HidField;

typedef struct HidCollection {
    int type;                // 0 physical, 1 application, 2 logical, 3 report, 4 named array, 5 usage switch, 6 usage modifier
    uint32_t usage;
    int parent;              // -1 at the top
} HidCollection;

typedef struct HidReport {
    HidReportKind kind;
    int id;
    int bits;                // without the id byte
} HidReport;

typedef struct HidDescriptor {
    bool uses_ids;           // if true, each report begins with its id
    int field_count, report_count, collection_count, range_count;
    int input_bytes, output_bytes, feature_bytes;    // of the longest report of each kind, including the id byte if ids are used
    HidField field[HID_FIELD_LIMIT];                 // in the order of the descriptor
    HidReport report[HID_REPORT_LIMIT];
    HidCollection collection[HID_COLLECTION_LIMIT];
    HidUsageRange range[HID_RANGE_LIMIT];
} HidDescriptor;

// Returns NULL with a fault (`name`:byte offset: reason) if the descriptor is refused: truncated items, an unknown item, an impossible count, size or range
// (size 0, over 32 bits, minimum > maximum), a report over HID_REPORT_BITS, reports both with and without id, id 0, unbalanced pops or collections, or a limit
// exceeded. Devices that write a maximum of 255 as one signed byte (-1) are understood. Free with free().
HidDescriptor *hid_descriptor_parse(const uint8_t *bytes, size_t length, const char *name, Faults *faults);

// Classifies a report: `bytes` as read from the device, beginning with the id if the descriptor has ids.
typedef enum { HID_REPORT_GOOD, HID_REPORT_SHORT, HID_REPORT_UNKNOWN_ID } HidReportCheck;
// For a good report, `payload` and `payload_length` are the input of hid_field_read(). A report longer than described is good; the rest is ignored.
HidReportCheck hid_report_open(const HidDescriptor *descriptor, HidReportKind kind, const uint8_t *bytes, size_t length, const HidReport **report,
                               const uint8_t **payload, size_t *payload_length);
const HidReport *hid_report_find(const HidDescriptor *descriptor, HidReportKind kind, int id);

// Reads control `index` of a field (0 to count - 1), signed if logical_min < 0. Returns false if it lies beyond `length` or `index` is beyond the field.
bool hid_field_read(const HidField *field, int index, const uint8_t *payload, size_t length, int64_t *value);
// Writes the low `size` bits of `value`; other bits are unchanged. False as above.
bool hid_field_write(const HidField *field, int index, uint8_t *payload, size_t length, int64_t value);
// False if a value means "no value" (null state) or lies outside the declared range.
bool hid_field_in_range(const HidField *field, int64_t value);

// Finds number `index` (from 0) of the variable controls with `usage`, in the descriptor's order; `slot` is the position of the control in its field.
// `collection`: search only within that one (-1: all). Returns NULL if there is none.
const HidField *hid_find_usage(const HidDescriptor *descriptor, HidReportKind kind, uint32_t usage, int index, int collection, int *slot);
// The value that an array uses for a usage; false if the array does not contain that usage.
bool hid_array_value(const HidDescriptor *descriptor, const HidField *array, uint32_t usage, int64_t *value);
// True if any slot of an array field selects `usage` in this report.
bool hid_array_has(const HidDescriptor *descriptor, const HidField *array, uint32_t usage, const uint8_t *payload, size_t length);
// Index of the next outermost collection of this usage, starting at `from`; -1: none. A field or collection lies within a collection that it or any of its
// parents is.
int hid_find_collection(const HidDescriptor *descriptor, uint32_t usage, int from);
bool hid_is_within(const HidDescriptor *descriptor, int collection, int ancestor);

// Names of usages: "X", "Y", "Rz", "wheel", "hat_switch", "button_3", "slider"; else "0xPPPP:0xUUUU". 0 if the text is not a usage.
uint32_t hid_usage_of_name(const char *name);
void hid_usage_name(uint32_t usage, char *out, size_t capacity);

#endif

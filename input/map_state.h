// Maps the values of a device to its HandPorts. Pure functions without device access: the input is a report, the state of a gamepad or a line of counts; the
// output is rates
// and displacements. Displacements are whole counts times a scale, so none is lost or counted twice, however the counts are split into reports.
#ifndef SELDINGER_INPUT_MAP_STATE_H
#define SELDINGER_INPUT_MAP_STATE_H

#include "input/device_map.h"
#include "input/hand_port.h"
#include "input/hid_report.h"

// A control of the map, completed from the device's descriptor.
typedef struct BoundControl {
    bool is_there;           // false: optional and not on this device
    AxisKind kind;           // of an axis: never AXIS_BY_DESCRIPTOR
    double min, centre, max; // of a deflection
    double wrap;             // for a counter: counts after which it wraps, 0: never
    HidField field;          // of a HID source
    int slot;                // index among the controls of the field; unused for an array
} BoundControl;

typedef struct AxisState {
    double deflection;       // -1 to 1, before scale
    int64_t counts;          // since the state was reset
    double previous;         // raw value of a counter
    bool has_previous;
} AxisState;

typedef struct MapState {
    BoundControl axis[MAP_AXES], button[MAP_BUTTONS];
    AxisState axis_state[MAP_AXES];
    bool held[MAP_BUTTONS];
    int64_t reports, bad_reports;
} MapState;

// Applies dead zone and exponent to a deflection; odd, monotone, continuous; within +-1.
double map_shape(double deflection, double dead_zone, double exponent);
// Converts a raw value to a deflection: 0 at the centre, 1 at max, -1 at min, linear between; a centre at one end makes that side 0.
double map_deflection(double raw, double min, double centre, double max);
// The difference between two values of a counter; if it wraps, the smaller of the two possible differences.
double map_counter_step(double previous, double now, double wrap);

// Finds the controls of the map on a device. Returns false with all faults if a control that is not optional is missing or does not fit. Resets the state.
bool map_bind_hid(const DeviceMap *map, const HidDescriptor *descriptor, const char *device_name, MapState *state, Faults *faults);
// As map_bind_hid(), for gamepads and joysticks, and for lines of counts.
bool map_bind_plain(const DeviceMap *map, int axis_count, int button_count, const char *device_name, MapState *state, Faults *faults);

// Takes one input report. Returns false (and increments bad_reports) if it is too short or of unknown id; nothing else changes then.
bool map_take_report(const DeviceMap *map, const HidDescriptor *descriptor, const uint8_t *bytes, size_t length, MapState *state);
// Takes axes in the range given by the map, or -1 to 1, and buttons, 0 or not 0.
void map_take_plain(const DeviceMap *map, const float *axes, int axis_count, const unsigned char *buttons, int button_count, MapState *state);
// Takes counts sent by an encoder; `fresh[i]`: counts[i] was in this line.
void map_take_counts(const DeviceMap *map, const int64_t *counts, const bool *fresh, int count, MapState *state);

// Writes rates, displacements and the moved tool to the ports of the map (`port`: hand_count of them); buttons and the number of reports go to the first.
void map_publish(const DeviceMap *map, const MapState *state, HandPort *port);
// To be called when the device is gone: rates and buttons become zero, displacements are unchanged; a counter restarts at its next value without a step.
void map_release(const DeviceMap *map, MapState *state);

#endif

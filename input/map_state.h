// Maps a device's values to its HandPorts. Pure functions, no device: input is a report, a gamepad's state or a line of counts; output are rates and
// displacements. Displacements are whole counts times a scale, so none is lost or counted twice, however the reports are divided.
#ifndef SELDINGER_INPUT_MAP_STATE_H
#define SELDINGER_INPUT_MAP_STATE_H

#include "input/device_map.h"
#include "input/hand_port.h"
#include "input/hid_report.h"

// A control of the map, completed from the device's descriptor.
typedef struct BoundControl {
    bool is_there;           // false: optional and missing
    AxisKind kind;           // of an axis: never AXIS_BY_DESCRIPTOR
    double min, centre, max; // of a deflection
    double wrap;             // of a counter: counts after which it starts again, 0: never
    HidField field;          // of a HID source
    int slot;                // which of the field's controls; for an array: unused
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

// deflection -> deflection after dead zone and exponent; odd, monotone, continuous; within +-1
double map_shape(double deflection, double dead_zone, double exponent);
// raw -> deflection: 0 at the centre, 1 at max, -1 at min, straight between; a centre at one end leaves that side 0
double map_deflection(double raw, double min, double centre, double max);
// The difference between two values of a counter, the shorter way round if it wraps.
double map_counter_step(double previous, double now, double wrap);

// Finds the map's controls in a device; false with faults (all) where one that is not optional is missing or fits badly. The state starts again.
bool map_bind_hid(const DeviceMap *map, const HidDescriptor *descriptor, const char *device_name, MapState *state, Faults *faults);
// The same for gamepads and joysticks, and for lines of counts.
bool map_bind_plain(const DeviceMap *map, int axis_count, int button_count, const char *device_name, MapState *state, Faults *faults);

// One input report. False (and bad_reports + 1) if it is too short or of unknown id; nothing else changes then.
bool map_take_report(const DeviceMap *map, const HidDescriptor *descriptor, const uint8_t *bytes, size_t length, MapState *state);
// Axes in the range that the map says, or -1 to 1; buttons 0 or not.
void map_take_plain(const DeviceMap *map, const float *axes, int axis_count, const unsigned char *buttons, int button_count, MapState *state);
// Counts as an encoder sends them; `fresh[i]`: counts[i] was in this line.
void map_take_counts(const DeviceMap *map, const int64_t *counts, const bool *fresh, int count, MapState *state);

// Writes rates and displacements to the map's ports, [hand_count] of them, with the tool that each moves; buttons and the number of reports to the
// first.
void map_publish(const DeviceMap *map, const MapState *state, HandPort *port);
// The device is gone: rates and buttons zero, displacements unchanged; a counter restarts from its next value without a step.
void map_release(const DeviceMap *map, MapState *state);

#endif

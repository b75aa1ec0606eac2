// Device maps: how the controls of a device move the tools. Written in YAML, or built in for gamepads, joysticks and haptic devices.
//
//   seldinger_device: 1
//   name: roller
//   device: {vendor_id: 0x1209, product_id: 0x0001, serial: A1}   # any of these; or {usage: joystick}, {usage_page: 1, usage: 4},
//                                                                 # {gamepad: true}, {joystick: "part of its name, or *"} (GLFW), {usb: ftdi, serial: A1}
//   tool: innermost             # the tool it moves: the selected one (chosen, default), outer or inner (of the selected pair), outermost, innermost,
//                               # 1 to 4 as for the keys, a tool's name or its kind. Each control of push and twist may have its own tool
//   push:                       # one control, or a list whose values are added: > 0 into the patient
//     source: Y                 # usage by name or as 0x0001:0x0031; GLFW: left_y, axis_1, button_2; hat_x, hat_y; ftdi: the name of a count
//     index: 0                  # 1 is the second control of the same usage
//     mm_s: 40                  # at full deflection; or mm_per_count: 0.05 (a relative field, or a counter that wraps around)
//     kind: deflection          # deflection, relative or counter; default: by scale and descriptor
//     logical_min: 0            # calibration; default: the range of the descriptor and its middle
//     logical_centre: 128
//     logical_max: 255
//     counts_per_wrap: 65536    # of a counter; default: the logical range; 0: it never wraps
//     dead_zone: 0.1            # fraction of the deflection, 0 to 0.9; default 0.05
//     exponent: 2               # 0.2 to 5; default 1
//     invert: true
//     optional: true            # ignored if the device does not have it
//   twist: {source: X, deg_s: 180}                                 # or deg_per_count; right-handed about the direction of advance
//   pedal: {source: button_1}   # also contrast, stop, mark, choose_outer, choose_inner, lock, let_go, exchange (input/hand_port.h); one control or a list; an
//                               # axis with `above: 0.5` (fraction of full deflection)
//   force:                      # HID PID (input/force_feedback.h): the force of the tool that the first control of push or twist moves
//     full_scale_n: 8           # force at the device's largest magnitude
//     max_n: 4
//     slew_n_s: 200
//     full_scale_n_mm: 100      # torque on the second axis, which needs this key
//     stall_ms: 50              # zero force when the simulation stalls for this long
//     quiet_ms: 200             # … or the device sends nothing for this long; 0: no such limit
//     invert: true              # reverses the force
//   serial: {baud: 115200, counts: [A, R], bits: 32}               # usb: ftdi (input/usb_encoder.h); width of its counters, 0: they never wrap
//
// A rate is full scale x deflection, where deflection = sign(d) ((|d| - dead_zone) / (1 - dead_zone))^exponent, d = (raw - centre) / (max - centre) above
// the centre and (raw - centre) / (centre - min) below, within +-1.
#ifndef SELDINGER_INPUT_DEVICE_MAP_H
#define SELDINGER_INPUT_DEVICE_MAP_H

#include "input/script.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MAP_AXES = 12, MAP_BUTTONS = 16, MAP_NAME = 64, MAP_HANDS = TOOLS_MOST };

// A tool that a device moves. Each has its own HandPort.
typedef struct MapHand {
    char tool[TOOL_NAME_SIZE];       // as written in the map
    int drives;                      // HandDrives; for a name, a number or an end DRIVES_CHOSEN until device_map_find_tools()
    int line, column;                // position in the file, 0 if not given
} MapHand;

typedef enum { MAP_HID, MAP_GAMEPAD, MAP_JOYSTICK, MAP_FTDI } MapDeviceKind;

typedef struct MapDevice {
    MapDeviceKind kind;
    int vendor_id, product_id;       // -1: any
    uint32_t usage;                  // page << 16 | usage of an application collection; 0: any
    char serial[MAP_NAME];           // "": any
    char joystick[MAP_NAME];         // part of the name given by GLFW; "": any
} MapDevice;

typedef enum { SOURCE_HID_USAGE, SOURCE_HID_HAT_X, SOURCE_HID_HAT_Y, SOURCE_AXIS, SOURCE_BUTTON, SOURCE_COUNT } MapSourceKind;

typedef struct MapSource {
    MapSourceKind kind;
    uint32_t usage;                  // SOURCE_HID_USAGE
    int index;                       // counted among controls of that usage; number of the axis, button or count
    bool optional;
    int line, column;                // position in the file, 0 in built-in maps
} MapSource;

typedef enum { AXIS_BY_DESCRIPTOR, AXIS_DEFLECTION, AXIS_RELATIVE, AXIS_COUNTER } AxisKind;

typedef struct MapAxis {
    bool is_twist;                   // else push
    int hand;                        // index of the MapHand it moves
    MapSource source;
    AxisKind kind;
    bool is_rate;                    // the scale is mm_s or deg_s at full deflection; otherwise mm or deg per count
    double scale;
    double logical_min, logical_centre, logical_max;     // NaN: not given
    double counts_per_wrap;          // NaN: not given
    double dead_zone, exponent;
    bool invert;
} MapAxis;

typedef struct MapButton {
    unsigned bit;                    // HAND_PEDAL …
    MapSource source;
    double above;                    // for an axis: on if its deflection is larger
    bool invert;
} MapButton;

typedef struct MapForce {
    bool is_wanted;
    double full_scale_n, max_n, slew_n_s, full_scale_n_mm;
    double direction_deg;            // NaN: derived from the source of push (input/force_feedback.h)
    int stall_ms, quiet_ms;
    bool invert;
} MapForce;

typedef struct MapSerial {
    int baud;
    char count[2][16];               // names before the counts in a line; index 0, 1
    int count_count;
    int bits;                        // width of its counters, 0: they never wrap
} MapSerial;

typedef struct DeviceMap {
    char name[MAP_NAME], file[256];
    MapDevice device;
    int hand_count;                  // at least 1; the first one has the buttons and the force
    MapHand hand[MAP_HANDS];
    int axis_count, button_count;
    MapAxis axis[MAP_AXES];
    MapButton button[MAP_BUTTONS];
    MapForce force;
    MapSerial serial;
} DeviceMap;

// Returns NULL with all faults (FILE:LINE:COL). Free with free().
DeviceMap *device_map_parse(const char *text, size_t length, const char *file, Faults *faults);
DeviceMap *device_map_load(const char *path, Faults *faults);
// Multiplies the scales of push and twist by factors that are not 0; a negative one inverts the axes, also for the force.
void device_map_scale(DeviceMap *map, double push, double twist);
// Finds the tools of a map in a scene. Returns false with faults if a name is missing or a kind is ambiguous.
bool device_map_find_tools(DeviceMap *map, const ToolNames *tools, Faults *faults);
// Returns true and "roller.yaml and stick.yaml both move wire …" if several of these maps move one tool. Call after device_map_find_tools().
bool device_maps_share(const DeviceMap *const *map, int count, const ToolNames *tools, int tool, char *text, size_t capacity);

// The built-in maps: any GLFW gamepad (for one tool, or one tool per stick), any GLFW joystick, HID joystick, HID gamepad, HID multi-axis controller, and
// haptic
// joystick (with force).
typedef enum {
    BUILT_IN_GAMEPAD,
    BUILT_IN_GAMEPAD_PAIR,
    BUILT_IN_JOYSTICK,
    BUILT_IN_HID_JOYSTICK,
    BUILT_IN_HID_GAMEPAD,
    BUILT_IN_HID_MULTI_AXIS,
    BUILT_IN_HID_HAPTIC,
    BUILT_IN_COUNT
} BuiltInMap;
const char *device_map_built_in_text(BuiltInMap which);
DeviceMap *device_map_built_in(BuiltInMap which);     // NULL if out of memory

#endif

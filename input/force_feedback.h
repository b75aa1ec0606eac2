// Force feedback by HID PID (USB Device Class Definition for Physical Interface Devices 1.0, usage page 0x0F). Uses two constant-force effects, one along push
// and, if
// the device has a second axis, one along twist. They play for half a second and are restarted before they end, so that the force ends if the program
// dies; only their magnitudes change, up to once a millisecond. A device whose effects cannot be limited in time is refused. An effect always starts
// at zero force; after a failed report, or after the effect has ended by itself, the force restarts at zero and grows with its slew limit.
//
// force_guard(), a pure function, limits the force: scale, clamp, slew limit, and zero at once if the simulation stalls, the device is silent, the
// session is paused or a number is not finite. The pid_ functions, also pure, encode reports. The force_ functions access a device.
#ifndef SELDINGER_INPUT_FORCE_FEEDBACK_H
#define SELDINGER_INPUT_FORCE_FEEDBACK_H

#include "input/device_map.h"
#include "input/force_guard.h"
#include "input/hand_port.h"
#include "input/hid_device.h"
#include "input/hid_report.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { PID_MESSAGE_BYTES = 64 };

// A report to send: byte 0 is its id (0: none).
typedef struct PidMessage {
    HidReportKind kind;              // HID_OUTPUT or HID_FEATURE
    int length;
    uint8_t bytes[PID_MESSAGE_BYTES];
} PidMessage;

// A numeric field or, for selectors, the value of one choice.
typedef struct PidControl {
    bool is_there;
    HidField field;
    int slot;
    int64_t value;
} PidControl;

typedef struct PidLayout {
    PidControl pool_managed;                                         // PID Pool, a feature report that is read: the device manages its own memory
    PidControl create_type;                                          // Create New Effect: constant force
    PidControl load_index, load_success;                             // Block Load, a feature report that is read; its fields
    PidControl effect_index, effect_type, duration, trigger_button, gain, direction_enable, axis_x, axis_y, direction;   // Set Effect
    PidControl force_index, magnitude;                               // Set Constant Force
    PidControl operation_index, start, stop, loop_count;             // Effect Operation
    PidControl reset, enable, stop_all;                              // Device Control
    PidControl device_gain;
    int report_bytes[3][256];        // report lengths by kind and id, including the id byte, as the device's buffers require
} PidLayout;

// Returns false with the reason in `why` if constant forces cannot be played: "no constant force effect in the descriptor".
bool pid_find(const HidDescriptor *descriptor, PidLayout *layout, char *why, size_t capacity);
bool pid_is_haptic(const HidDescriptor *descriptor);     // true if any usage is on the PID page

// The messages of an upload, in this order. All except the last write whole reports with other fields zero. Returns false if the layout has no such report,
// which is then
// omitted.
bool pid_encode_reset(const PidLayout *layout, PidMessage *out);
bool pid_encode_enable(const PidLayout *layout, PidMessage *out);
bool pid_encode_gain(const PidLayout *layout, PidMessage *out);              // sets the device gain to its maximum
bool pid_encode_create(const PidLayout *layout, PidMessage *out);
// The effect block index in a Block Load report from the device (`bytes` with id); 0: refused or full.
int pid_decode_block_load(const PidLayout *layout, const uint8_t *bytes, size_t length);
// True if a PID Pool report from the device says that the host must manage the device's memory, which this module does not support.
bool pid_needs_host(const PidLayout *layout, const uint8_t *bytes, size_t length);
// `direction_deg`: where the force comes from, clockwise from north (away from the user). Duration half a second or the nearest possible, maximum gain, no
// trigger
// button.
bool pid_encode_effect(const PidLayout *layout, int block, double direction_deg, PidMessage *out);
// `magnitude`: -1 to 1 of the device's maximum; zero if not finite. `value`: the value written.
bool pid_encode_force(const PidLayout *layout, int block, double magnitude, PidMessage *out, int64_t *value);
bool pid_encode_start(const PidLayout *layout, int block, PidMessage *out);
bool pid_encode_stop(const PidLayout *layout, int block, PidMessage *out);
// Time [ms] after which a started effect ends by itself; 0: never, or the field does not exist.
int pid_duration_ms(const PidLayout *layout);

// Direction of the reaction to a push along a stick's axis: the force comes from the side to which the stick moves when the tool is pushed.
// X: 90 (270 inverted), Y: 180 (0 inverted: moving the stick away from the user pushes, and the force comes from north); NaN for other axes.
double force_direction_deg(const DeviceMap *map, bool is_twist);

typedef struct ForceFeedback {
    PidLayout layout;
    MapForce map;
    double direction_deg[2];
    int block[2];                    // blocks of force and torque; 0: none
    int64_t value[2];                // magnitudes last written
    bool is_known[2];                // the device accepted them
    bool may_play;                   // started, and not known to be stopped
    bool must_rest;                  // the device has not yet accepted zero and stop
    int64_t started_us, due_us;      // when the effects were started, and when the next magnitude may be sent
    int64_t effect_us;               // duration of the effects
    int64_t writes;                  // reports attempted
    int failures;                    // consecutive failed writes; after 20 the effects are stopped for good
    ForceGuard guard;
    char text[160];                  // its state, or why it is not used
} ForceFeedback;

// Finds the effects and uploads them at zero force. Returns false with the reason in `text`; the inputs of the device can still be used.
bool force_start(ForceFeedback *force, const DeviceMap *map, const HidDescriptor *descriptor, const HidTransport *transport, void *device, int64_t now_us);
// Sends the force of the port, limited by the guard, if it has changed, at most about once a millisecond. Does nothing before force_start() has succeeded. If
// the
// guard demands zero, or a report failed, sends zero and stop until they are accepted.
void force_tick(ForceFeedback *force, const HandPort *port, int64_t now_us, int64_t report_us, bool paused, const HidTransport *transport, void *device);
// Sends zero and stop, each retried once on failure; for the end of a session.
void force_stop(ForceFeedback *force, const HidTransport *transport, void *device);

#endif

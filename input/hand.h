// All HID and USB input devices ("hands") of a session: finds the devices that match a map (the user's, else a built-in one), opens them, and writes
// their HandPorts, up to MAP_HANDS each: one for each tool that the map moves.
//
// One thread scans for devices every half second; one thread per device reads its reports and sends its forces. Ports exist from start to end and are
// HAND_ABSENT until a device is found, so the 1 kHz thread samples all of them and never waits. When a device is unplugged, its (first) port becomes HAND_LOST,
// its rates and buttons zero, its displacements unchanged; when it returns (same vendor, product, serial, interface) it gets the same port and continues.
// GLFW's
// gamepads and joysticks are handled in input/gamepad.h, because GLFW must be called from the window's thread.
#ifndef SELDINGER_INPUT_HAND_H
#define SELDINGER_INPUT_HAND_H

#include "base/base.h"
#include "input/device_map.h"
#include "input/hand_info.h"
#include "input/hand_port.h"
#include "input/hid_device.h"

#include <stdbool.h>
#include <stddef.h>

enum { HANDS_MOST = 8 };

typedef struct Hands Hands;

typedef struct HandsOptions {
    const DeviceMap *const *map;     // the user's maps, copied; the first match is used, before the built-in ones
    int map_count;
    bool use_built_in;               // default true: joysticks, gamepads, multi-axis controllers and haptic devices without a user map
    double push, twist;              // default 1: factors of the scales of the built-in maps; negative: inverted
    bool use_usb;                    // default true: look for USB serial encoders if a map selects one
    int rescan_ms;                   // interval between scans, default 500
    const HidTransport *transport;   // NULL: hidapi; otherwise the caller's, which must outlive the Hands
} HandsOptions;
HandsOptions hands_default_options(void);

// Starts the threads. Returns NULL with faults on failure. No connected device is not a fault.
Hands *hands_open(const HandsOptions *options, Faults *faults);
// Sets forces to zero, releases devices, ends threads (within about 0.3 s).
void hands_close(Hands *hands);

HandPort *hands_port(Hands *hands, int index);           // the first of a device's MAP_HANDS ports, 0 to HANDS_MOST - 1; the same address for the whole session
// Sets forces to zero while paused (rates and displacements are still read); any thread.
void hands_pause(Hands *hands, bool paused);

void hands_info(Hands *hands, int index, HandInfo *info);    // any thread except the 1 kHz one (takes a lock)

// True if a port belongs to this device. GLFW's joystick with the same ids must then be ignored, or it would count twice (gamepad_ids_of_guid).
bool hands_drives(Hands *hands, int vendor_id, int product_id);

// The first of `map` (NULL entries are skipped) that matches a HID device.
const DeviceMap *hands_choose_map(const DeviceMap *const *map, int count, const HidDeviceInfo *device);

// Returns the next message for the user ("roller unplugged: the tool stops; plug it in again to continue"), oldest first; false if there is none. At most 32
// are kept, none longer than HAND_MESSAGE_LENGTH including its NUL. Any thread except the 1 kHz one.
bool hands_message(Hands *hands, char *text, size_t capacity);

#endif

// All HID and USB input devices ("hands") of a session: finds the devices that match a map (the user's, else a built-in one), opens them, and writes
// their HandPorts, up to MAP_HANDS each: one for each tool that the map moves.
//
// One thread scans for devices every half second; one thread per device reads its reports and writes its forces. Ports exist from start to end,
// HAND_ABSENT until a device is found, so the 1 kHz thread samples all of them and never waits. An unplugged device's (first) port turns HAND_LOST,
// its rates and buttons zero, its displacements unchanged; when it comes back (same vendor, product, serial, interface) it has the same port and
// continues. GLFW's gamepads and joysticks are not here (input/gamepad.h): GLFW wants the window's thread.
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
    const DeviceMap *const *map;     // the user's, copied; the first match is used, before the built-in ones
    int map_count;
    bool use_built_in;               // default true: joysticks, gamepads, multi-axis controllers and haptic devices without a user map
    bool use_usb;                    // default true: look for USB serial encoders if a map names one
    int rescan_ms;                   // 500
    const HidTransport *transport;   // NULL: hidapi; else the caller's, kept until hands_close
} HandsOptions;
HandsOptions hands_default_options(void);

// Starts the threads; NULL with faults on failure. The absence of devices is not a fault.
Hands *hands_open(const HandsOptions *options, Faults *faults);
// Sets forces to zero, releases devices, ends threads (within about 0.3 s).
void hands_close(Hands *hands);

HandPort *hands_port(Hands *hands, int index);           // the first of a device's MAP_HANDS ports, 0 to HANDS_MOST - 1; the same address for the whole session
// Sets forces to zero while paused (rates and displacements are still read); any thread.
void hands_pause(Hands *hands, bool paused);

void hands_info(Hands *hands, int index, HandInfo *info);    // any thread but the 1 kHz one (takes a lock)

// Whether a port here belongs to this device: then GLFW's joystick of the same ids is left alone, or it would count twice (gamepad_ids_of_guid).
bool hands_drives(Hands *hands, int vendor_id, int product_id);

// The first of `map` (NULL entries are skipped) that matches a HID device.
const DeviceMap *hands_choose_map(const DeviceMap *const *map, int count, const HidDeviceInfo *device);

// The next message for the user ("roller unplugged: the tool stops; plug it in again to continue"), oldest first; false if there is none. At most 32
// are kept, none longer than HAND_MESSAGE_LENGTH with its NUL. Any thread but the 1 kHz one.
bool hands_message(Hands *hands, char *text, size_t capacity);

#endif

// Lists the connected devices (HID devices, USB serial encoders, joysticks), which of them can drive the tool, and why the others cannot.
#ifndef SELDINGER_INPUT_DEVICE_LIST_H
#define SELDINGER_INPUT_DEVICE_LIST_H

#include "input/device_map.h"
#include "input/hid_device.h"
#include "input/hid_report.h"
#include "input/usb_encoder.h"

enum { LIST_DEVICES = 64, LIST_MAPS = 16, LIST_NODES = 64 };

typedef struct HidListing {
    HidDeviceInfo info;
    HidDescriptor *descriptor;       // NULL: see `why`
    const DeviceMap *map;            // NULL: no map fits
    bool is_usable;
    char why[1024], force[160];
} HidListing;

typedef struct InputNode {
    char node[32], name[96];
} InputNode;

typedef struct DeviceList {
    HidListing hid[LIST_DEVICES];
    UsbDeviceInfo usb[LIST_DEVICES];
    const DeviceMap *usb_map[LIST_DEVICES];
    InputNode joystick[LIST_NODES], event[LIST_NODES];
    int hid_count, usb_count, joystick_count, event_count;
    bool has_hidraw, has_libusb;
    DeviceMap *map[LIST_MAPS + BUILT_IN_COUNT];
    int map_count, own_map_count;
} DeviceList;

// Loads the user's maps (at most LIST_MAPS files), then those made in the start window (input/own_maps.h), and adds the built-in ones after them: the first map that fits a device is used. False with faults.
bool device_list_load_maps(DeviceList *list, int map_count, const char *const *path, Faults *faults);
// Fills the rest of a list that was zero except for its maps. `transport` NULL: no HID devices. Each device that has a map is opened once.
void device_list_look(DeviceList *list, const HidTransport *transport);
// Frees the contents of the list and the list itself.
void device_list_free(DeviceList *list);

#endif

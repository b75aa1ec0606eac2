// What is plugged in: HID devices, USB serial encoders, joysticks; what of it can drive the tool, and why the rest cannot.
#ifndef SELDINGER_INPUT_DEVICE_LIST_H
#define SELDINGER_INPUT_DEVICE_LIST_H

#include "input/device_map.h"
#include "input/hid_device.h"
#include "input/hid_report.h"
#include "input/usb_encoder.h"

enum { LIST_DEVICES = 64, LIST_MAPS = 16, LIST_NODES = 64 };

typedef struct HidListing {
    HidDeviceInfo info;
    HidDescriptor *descriptor;       // NULL: `why` says why
    const DeviceMap *map;            // NULL: none fits
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

// Maps of one's own (at most LIST_MAPS files), then the built-in ones: the first that fits a device is taken. False with faults.
bool device_list_load_maps(DeviceList *list, int map_count, const char *const *path, Faults *faults);
// Fills the rest of a list that was zero but for its maps. `transport` NULL: no HID devices. Each device that has a map is opened once.
void device_list_look(DeviceList *list, const HidTransport *transport);
// Frees what it holds, and the list itself.
void device_list_free(DeviceList *list);

#endif

// What `seldinger devices` knows of each HID device: shared by the list and --watch.
#ifndef SELDINGER_CLI_DEVICES_WATCH_H
#define SELDINGER_CLI_DEVICES_WATCH_H

#include "input/device_map.h"
#include "input/hid_device.h"
#include "input/hid_report.h"

typedef struct HidListing {
    HidDeviceInfo info;
    HidDescriptor *descriptor;       // NULL: `why` says why
    const DeviceMap *map;            // NULL: none fits
    bool is_usable;
    char why[1024], force[160];
} HidListing;

// Prints values of all readable devices until the user stops it or `duration_s` has passed (0: no end). False with a message where there is none.
bool devices_watch(const HidTransport *transport, const HidListing *listing, int count, double duration_s);

#endif

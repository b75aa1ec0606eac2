// Access to HID devices by a table of functions, so that tests can replace hidapi.
#ifndef SELDINGER_INPUT_HID_DEVICE_H
#define SELDINGER_INPUT_HID_DEVICE_H

#include <stddef.h>
#include <stdint.h>

enum { HID_USAGES_LISTED = 16 };

typedef struct HidDeviceInfo {
    char path[128];                  // "/dev/hidraw0"
    uint16_t vendor_id, product_id;
    char serial[64], product[96];    // UTF-8, "" if the device has none
    int interface_number;            // -1: none
    int usage_count;                 // number of its application collections, page << 16 | usage
    uint32_t usage[HID_USAGES_LISTED];
} HidDeviceInfo;

// All functions may be called from any thread, but each device from one thread at a time. Lengths are in bytes; -1: the device is gone or refused.
typedef struct HidTransport {
    void *context;
    int (*list)(void *context, HidDeviceInfo *out, int capacity);        // returns the number of devices; each path once
    void *(*open)(void *context, const char *path, char *why, size_t capacity);     // NULL with a reason and a remedy
    int (*descriptor)(void *context, const char *path, uint8_t *bytes, int capacity);    // the device need not be open
    int (*read)(void *context, void *device, uint8_t *bytes, int capacity, int timeout_ms);   // reads one input report; 0: none in time
    int (*write)(void *context, void *device, const uint8_t *bytes, int length);         // sends an output report; byte 0 is its id, 0 for none
    int (*send_feature)(void *context, void *device, const uint8_t *bytes, int length);  // sends a feature report, with the id as for write
    int (*get_feature)(void *context, void *device, uint8_t *bytes, int capacity);       // byte 0: the requested id
    void (*close)(void *context, void *device);
} HidTransport;

// hidapi with its hidraw backend. Returns NULL if out of memory. Descriptors come from sysfs, which needs no permission, or from the device.
HidTransport *hid_transport_hidapi(void);
void hid_transport_hidapi_free(HidTransport *transport);

#endif

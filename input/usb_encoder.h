// Encoders that are not HID devices: an FTDI FT232-type USB serial chip whose microcontroller writes lines of counts, "A1234 R-56\n". Protocol according to
// FTDI's public application notes (AN232B-04 data throughput and latency, AN232B-05 baud rates): vendor control requests, and bulk packets whose
// first two bytes are modem and line status. Needs no vendor driver or firmware. ftdi_stream.h decodes the bytes; this module accesses libusb.
#ifndef SELDINGER_INPUT_USB_ENCODER_H
#define SELDINGER_INPUT_USB_ENCODER_H

#include "input/device_map.h"
#include "input/ftdi_stream.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct UsbContext UsbContext;
typedef struct UsbEncoder UsbEncoder;

typedef struct UsbDeviceInfo {
    char path[32];                   // "usb 1-4.2"
    uint16_t vendor_id, product_id;
    char serial[64], product[96];
    bool may_open;
    char why[160];                   // if it may not be opened
} UsbDeviceInfo;

UsbContext *usb_context_open(void);                                    // NULL if libusb cannot be started
void usb_context_close(UsbContext *context);
int usb_encoder_list(UsbContext *context, UsbDeviceInfo *out, int capacity);     // devices of vendor 0403
bool usb_encoder_fits(const DeviceMap *map, const UsbDeviceInfo *device);
// Detaches ftdi_sio (reattached on close), claims the interface and sets the chip up. Returns NULL with a reason.
UsbEncoder *usb_encoder_open(UsbContext *context, const char *path, const MapSerial *serial, char *why, size_t capacity);
// Reads for the given time and passes lines to `take`. Returns the number of bytes; 0: none, -1: the device is gone.
int usb_encoder_read(UsbEncoder *encoder, const MapSerial *serial, int timeout_ms, EncoderTake *take, void *context);
const FtdiStream *usb_encoder_stream(const UsbEncoder *encoder);
void usb_encoder_close(UsbEncoder *encoder);

#endif

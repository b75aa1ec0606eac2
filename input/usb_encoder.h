// Encoders that are no HID: an FTDI FT232-type USB serial chip whose microcontroller writes lines of counts, "A1234 R-56\n". Protocol by FTDI's public
// application notes (AN232B-04 data throughput and latency, AN232B-05 baud rates): vendor control requests, and bulk packets whose first two bytes are
// modem and line status. No vendor driver, no firmware. The stream's functions are pure; the rest talks to libusb.
#ifndef SELDINGER_INPUT_USB_ENCODER_H
#define SELDINGER_INPUT_USB_ENCODER_H

#include "input/device_map.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { ENCODER_LINE = 64, ENCODER_COUNTS = 2 };

// --- the stream ---

// A control request, bmRequestType 0x40 (vendor, to the device), no data.
typedef struct FtdiRequest {
    uint8_t request;
    uint16_t value, index;
} FtdiRequest;

enum { FTDI_SET_UP = 7 };
// What sets a chip up: reset, both buffers emptied, `baud`, 8 data bits no parity one stop bit, no flow control, latency 1 ms. `index` low byte: the
// port, 0 for chips with one, 1 for the first of several.
void ftdi_set_up(int baud, int port, FtdiRequest request[FTDI_SET_UP]);
// Value (low 16 bits) and index (bits 16 and up) of a baud rate: 3 MHz over a divisor in eighths; *actual: what comes out [baud].
uint32_t ftdi_baud_divisor(int baud, double *actual);

typedef struct FtdiStream {
    char line[ENCODER_LINE];
    int length;
    bool is_skipped;                 // the rest of this line is left out
    int64_t lines, bad_lines, errors;    // overruns, parity, framing, breaks
} FtdiStream;

// One line read: fresh[i] where count i stood in it.
typedef struct EncoderLine {
    int64_t count[ENCODER_COUNTS];
    bool fresh[ENCODER_COUNTS];
} EncoderLine;

// Names and whole numbers in any order, "A12 R-3" or "R=7,A=-2": false where something else stands in it, a name twice, a number beyond +-2^32, or none.
bool encoder_parse_line(const MapSerial *serial, const char *line, size_t length, EncoderLine *out);

// Takes what one bulk transfer gave: packets of `packet_size` bytes (64, or 512 of high-speed chips), the first two of each status. Each whole line goes
// to `take`. A line may be cut anywhere; what comes before the first line end is left out, it may be half a line.
typedef void EncoderTake(void *context, const EncoderLine *line);
void ftdi_stream_take(FtdiStream *stream, const MapSerial *serial, const uint8_t *bytes, size_t length, size_t packet_size, EncoderTake *take, void *context);
// As after opening: the first line may be a half one.
void ftdi_stream_start(FtdiStream *stream);

// --- the device ---

typedef struct UsbContext UsbContext;
typedef struct UsbEncoder UsbEncoder;

typedef struct UsbDeviceInfo {
    char path[32];                   // "usb 1-4.2"
    uint16_t vendor_id, product_id;
    char serial[64], product[96];
    bool may_open;
    char why[160];                   // where it may not
} UsbDeviceInfo;

UsbContext *usb_context_open(void);                                    // NULL: libusb cannot be started
void usb_context_close(UsbContext *context);
int usb_encoder_list(UsbContext *context, UsbDeviceInfo *out, int capacity);     // devices of vendor 0403
bool usb_encoder_fits(const DeviceMap *map, const UsbDeviceInfo *device);
// Detaches ftdi_sio (given back on close), claims the interface, sets the chip up. NULL with a reason.
UsbEncoder *usb_encoder_open(UsbContext *context, const char *path, const MapSerial *serial, char *why, size_t capacity);
// What came within the time, lines to `take`; number of bytes, 0: none, -1: the device is gone.
int usb_encoder_read(UsbEncoder *encoder, const MapSerial *serial, int timeout_ms, EncoderTake *take, void *context);
const FtdiStream *usb_encoder_stream(const UsbEncoder *encoder);
void usb_encoder_close(UsbEncoder *encoder);

#endif

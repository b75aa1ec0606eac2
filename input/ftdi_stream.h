// Protocol of FTDI FT232-type USB serial chips: requests, and decoding of the bytes received, which are lines of counts, "A1234 R-56\n". Pure functions;
// usb_encoder.h accesses the device and cites the sources.
#ifndef SELDINGER_INPUT_FTDI_STREAM_H
#define SELDINGER_INPUT_FTDI_STREAM_H

#include "input/device_map.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { ENCODER_LINE = 64, ENCODER_COUNTS = 2 };

// A control request, bmRequestType 0x40 (vendor, to the device), without data.
typedef struct FtdiRequest {
    uint8_t request;
    uint16_t value, index;
} FtdiRequest;

enum { FTDI_SET_UP = 7 };
// The requests that set up a chip: reset, flush both buffers, `baud`, 8 data bits, no parity, one stop bit, no flow control, latency 1 ms. The low byte of
// `index` is the
// port: 0 for chips with one port, 1 for the first of several.
void ftdi_set_up(int baud, int port, FtdiRequest request[FTDI_SET_UP]);
// Value (low 16 bits) and index (bits 16 and above) of a baud rate: 3 MHz divided in steps of one eighth; *actual: the resulting rate [baud].
uint32_t ftdi_baud_divisor(int baud, double *actual);

typedef struct FtdiStream {
    char line[ENCODER_LINE];
    int length;
    bool is_skipped;                 // skip the rest of this line
    int64_t lines, bad_lines, errors;    // overruns, parity, framing, breaks
} FtdiStream;

// One line: fresh[i] is true if it contained count i.
typedef struct EncoderLine {
    int64_t count[ENCODER_COUNTS];
    bool fresh[ENCODER_COUNTS];
} EncoderLine;

// Parses names and whole numbers in any order, "A12 R-3" or "R=7,A=-2". Returns false if the line contains anything else, a name twice, a number beyond +-2^32,
// or none.
bool encoder_parse_line(const MapSerial *serial, const char *line, size_t length, EncoderLine *out);

// Decodes one bulk transfer: packets of `packet_size` bytes (64, or 512 for high-speed chips), whose first two bytes are status. Each complete line is passed
// to `take`.
// Lines may be split anywhere; bytes before the first line end are dropped, since they may be a partial line.
typedef void EncoderTake(void *context, const EncoderLine *line);
void ftdi_stream_take(FtdiStream *stream, const MapSerial *serial, const uint8_t *bytes, size_t length, size_t packet_size, EncoderTake *take, void *context);
// Resets the state as after opening: the first line may be partial.
void ftdi_stream_start(FtdiStream *stream);

#endif

#include "input/ftdi_stream.h"

#include <string.h>

// Vendor requests
enum { RESET = 0, SET_FLOW_CONTROL = 2, SET_BAUD_RATE = 3, SET_DATA = 4, SET_LATENCY = 9 };
enum { RESET_CHIP = 0, EMPTY_RECEIVED = 1, EMPTY_TO_SEND = 2, EIGHT_BITS_NO_PARITY_ONE_STOP = 8, LATENCY_MS = 1 };
enum { BASE_CLOCK = 3000000, STATUS_BYTES = 2 };
static const int64_t largest_count = (int64_t)1 << 32;

uint32_t ftdi_baud_divisor(int baud, double *actual)
{
    // the chip's codes for eighths of the divisor: 0, 1/8, 1/4, 3/8, 1/2, 5/8, 3/4, 7/8
    static const uint32_t code[] = {0, 3, 2, 4, 1, 5, 6, 7};
    long eighths = ((long)BASE_CLOCK * 16 / baud + 1) / 2;
    // divisors 1 and 1.5 are written 0 and 1; nothing else exists between 1 and 2
    eighths = eighths < 8 ? 8 : eighths > 8 * 0x3fff + 7 ? 8 * 0x3fff + 7 : eighths;
    if (eighths < 16)
        eighths = eighths < 10 ? 8 : eighths < 14 ? 12 : 16;
    *actual = 8.0 * BASE_CLOCK / (double)eighths;
    if (eighths == 8)
        return 0;
    if (eighths == 12)
        return 1;
    return (uint32_t)(eighths / 8) | code[eighths % 8] << 14;
}

void ftdi_set_up(int baud, int port, FtdiRequest request[FTDI_SET_UP])
{
    double actual;
    uint32_t divisor = ftdi_baud_divisor(baud, &actual);
    uint16_t index = (uint16_t)port;
    // chips with one port have the highest bit of the divisor in the low byte of the index, others in the high byte, with the port in the low byte
    uint16_t baud_index = port ? (uint16_t)(divisor >> 16 << 8 | index) : (uint16_t)(divisor >> 16);
    const FtdiRequest all[FTDI_SET_UP] = {{RESET, RESET_CHIP, index},
                                          {RESET, EMPTY_RECEIVED, index},
                                          {RESET, EMPTY_TO_SEND, index},
                                          {SET_BAUD_RATE, (uint16_t)divisor, baud_index},
                                          {SET_DATA, EIGHT_BITS_NO_PARITY_ONE_STOP, index},
                                          {SET_FLOW_CONTROL, 0, index},
                                          {SET_LATENCY, LATENCY_MS, index}};
    memcpy(request, all, sizeof all);
}

// --- lines ---

static bool is_separator(char c) { return c == ' ' || c == '\t' || c == ',' || c == ';'; }

// Finds the longest name at `at`, with its length in *used; -1: none.
static int name_at(const MapSerial *serial, const char *at, size_t left, size_t *used)
{
    int found = -1;
    *used = 0;
    for (int i = 0; i < serial->count_count; i++) {
        size_t n = strlen(serial->count[i]);
        if (n > *used && n <= left && !memcmp(at, serial->count[i], n))
            found = i, *used = n;
    }
    return found;
}

// Parses a whole number with an optional sign; returns its length in characters, 0 if there is none or it is too large.
static size_t whole_number(const char *at, size_t left, int64_t *number)
{
    size_t i = 0, first;
    bool is_negative = left > 0 && at[0] == '-';
    i += left > 0 && (at[0] == '-' || at[0] == '+');
    *number = 0;
    for (first = i; i < left && at[i] >= '0' && at[i] <= '9'; i++)
        if ((*number = 10 * *number + (at[i] - '0')) > largest_count)
            return 0;
    if (is_negative)
        *number = -*number;
    return i > first ? i : 0;
}

bool encoder_parse_line(const MapSerial *serial, const char *line, size_t length, EncoderLine *out)
{
    EncoderLine read = {0};
    bool any = false;
    for (size_t at = 0; at < length;) {
        size_t used;
        if (is_separator(line[at])) {
            at++;
            continue;
        }
        int which = name_at(serial, line + at, length - at, &used);
        if (which < 0 || read.fresh[which])
            return false;
        at += used;
        at += at < length && (line[at] == '=' || line[at] == ':');
        while (at < length && line[at] == ' ')
            at++;
        used = whole_number(line + at, length - at, &read.count[which]);
        at += used;
        if (used == 0 || (at < length && !is_separator(line[at])))
            return false;
        read.fresh[which] = any = true;
    }
    if (any)
        *out = read;
    return any;
}

void ftdi_stream_start(FtdiStream *stream)
{
    stream->length = 0;
    stream->is_skipped = true;
}

static void take_letter(FtdiStream *stream, const MapSerial *serial, char c, EncoderTake *take, void *context)
{
    EncoderLine line;
    if (c != '\n' && c != '\r') {
        if (stream->length == ENCODER_LINE)
            stream->is_skipped = true;
        if (!stream->is_skipped)
            stream->line[stream->length++] = c;
        return;
    }
    if (stream->length == ENCODER_LINE && stream->is_skipped)
        stream->bad_lines++;
    else if (!stream->is_skipped && stream->length > 0) {
        if (encoder_parse_line(serial, stream->line, (size_t)stream->length, &line)) {
            stream->lines++;
            take(context, &line);
        } else {
            stream->bad_lines++;
        }
    }
    stream->length = 0;
    stream->is_skipped = false;
}

void ftdi_stream_take(FtdiStream *stream, const MapSerial *serial, const uint8_t *bytes, size_t length, size_t packet_size, EncoderTake *take, void *context)
{
    for (size_t packet = 0; packet < length; packet += packet_size) {
        size_t end = packet + packet_size < length ? packet + packet_size : length;
        if (end - packet < STATUS_BYTES)
            break;
        // line status: overrun, parity, framing, break
        if (bytes[packet + 1] & 0x1e) {
            stream->errors++;
            stream->is_skipped = true;    // a character is missing or wrong: the line cannot be trusted
            stream->length = 0;
        }
        for (size_t i = packet + STATUS_BYTES; i < end; i++)
            take_letter(stream, serial, (char)bytes[i], take, context);
    }
}

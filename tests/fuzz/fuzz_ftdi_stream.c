// Any bytes as the data of an FTDI chip: the first two bytes give the packet size and the division of the rest into transfers.
// Covers: input/ftdi_stream.c input/usb_encoder.c
#include "input/usb_encoder.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void take(void *context, const EncoderLine *line)
{
    for (int i = 0; i < ENCODER_COUNTS; i++)
        if (line->fresh[i] && (line->count[i] > (int64_t)1 << 32 || line->count[i] < -((int64_t)1 << 32)))
            abort();
    ++*(int64_t *)context;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const MapSerial serial = {.baud = 115200, .count = {"A", "R"}, .count_count = 2};
    FtdiStream stream = {0};
    int64_t lines = 0;
    if (size < 2)
        return 0;
    size_t packet = data[0] & 1 ? 512 : 64, transfer = (size_t)data[1] + 1;
    ftdi_stream_start(&stream);
    for (size_t at = 2; at < size; at += transfer) {
        size_t n = transfer < size - at ? transfer : size - at;
        uint8_t *copy = malloc(n);
        if (!copy)
            return 0;
        memcpy(copy, data + at, n);
        ftdi_stream_take(&stream, &serial, copy, n, packet, take, &lines);
        free(copy);
    }
    if (lines != stream.lines || stream.length < 0 || stream.length > ENCODER_LINE)
        abort();
    return 0;
}

// An accepted cine file can be played and is written again as the same bytes; one of version 2 is written as version 3, and that again as the same bytes. The
// target replaces the last eight bytes of the input by the checksum, which a fuzzer could not find.
// Covers: render/cine.c
#include "render/cine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void play(const Cine *cine)
{
    CinePlayer player = cine_player_start(cine);
    double sum = cine_duration_s(cine);
    for (int i = 0; i < 20; i++) {
        int frame = cine_player_advance(&player, cine, 0.04 * i * i);
        if (frame >= cine_count(cine) || (frame < 0) != (cine_count(cine) == 0))
            abort();
        player.is_playing = true;
        player.loops = i % 3 > 0;
        sum += frame >= 0 ? cine_frame(cine, frame).pose->time_s + cine_frame_s(cine, frame) : 0;
    }
    if (isnan(sum) || (cine_count(cine) > 0 && !(cine_duration_s(cine) > 0)))
        abort();
}

static uint8_t *written_again(const uint8_t *data, size_t size, size_t *length)
{
    static Faults faults;
    faults_clear(&faults);
    Cine *cine = cine_unpack(data, size, "fuzz", &faults);
    if (!cine == (faults.count == 0))
        abort();
    if (!cine)
        return NULL;
    play(cine);
    uint8_t *bytes = cine_pack(cine, length);
    cine_free(cine);
    if (!bytes)
        abort();
    return bytes;
}

static void try_cine(const uint8_t *data, size_t size)
{
    enum { VERSION_AT = 8 };
    size_t length, again_length;
    uint8_t *bytes = written_again(data, size, &length);
    if (!bytes)
        return;
    uint8_t *again = data[VERSION_AT] == 2 ? written_again(bytes, length, &again_length) : NULL;
    const uint8_t *expected = again ? again : data;
    if (length != (again ? again_length : size) || memcmp(bytes, expected, length) != 0 || (data[VERSION_AT] == 2 && !again))
        abort();
    free(bytes);
    free(again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint8_t *copy = malloc(size + 1);
    uint64_t sum = 0xcbf29ce484222325u;     // FNV-1a
    memcpy(copy, data, size);
    for (size_t i = 0; i + sizeof sum < size; i++)
        sum = (sum ^ data[i]) * 0x100000001b3u;
    if (size > sizeof sum)
        memcpy(copy + size - sizeof sum, &sum, sizeof sum);
    try_cine(copy, size);
    free(copy);
    return 0;
}

// A cine file that is taken is written again as the same bytes; one of version 2 as version 3, and that as the same bytes.
// Covers: render/cine.c
#include "render/cine.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static uint8_t *written_again(const uint8_t *data, size_t size, size_t *length)
{
    static Faults faults;
    faults_clear(&faults);
    Cine *cine = cine_unpack(data, size, "fuzz", &faults);
    if (!cine == (faults.count == 0))
        abort();
    if (!cine)
        return NULL;
    uint8_t *bytes = cine_pack(cine, length);
    cine_free(cine);
    if (!bytes)
        abort();
    return bytes;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    enum { VERSION_AT = 8 };
    size_t length, again_length;
    uint8_t *bytes = written_again(data, size, &length);
    if (!bytes)
        return 0;
    uint8_t *again = data[VERSION_AT] == 2 ? written_again(bytes, length, &again_length) : NULL;
    const uint8_t *expected = again ? again : data;
    if (length != (again ? again_length : size) || memcmp(bytes, expected, length) != 0 || (data[VERSION_AT] == 2 && !again))
        abort();
    free(bytes);
    free(again);
    return 0;
}

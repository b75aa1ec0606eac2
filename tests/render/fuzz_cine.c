// A cine file that is taken is written again as the same bytes.
#include "render/cine.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Cine *cine = cine_unpack(data, size, "fuzz", &faults);
    if (!cine == (faults.count == 0))
        abort();
    if (!cine)
        return 0;
    size_t length;
    uint8_t *bytes = cine_pack(cine, &length);
    if (!bytes || length != size || memcmp(bytes, data, size) != 0)
        abort();
    free(bytes);
    cine_free(cine);
    return 0;
}

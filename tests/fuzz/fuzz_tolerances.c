// Any bytes as a file of tolerances, and as a scene with the key `check:`: what is given and accepted lies within its range, and what is not has its default.
// Covers: sim/tolerances.c
#include "sim/tolerances.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void verify(const Tolerances *tolerances)
{
    for (int i = 0; i < TOLERANCE_COUNT; i++) {
        double value = tolerance_of(tolerances, (ToleranceQuantity)i);
        if (!(value >= 0 && value <= tolerance_info[i].most) || (!tolerances->given[i] && value != tolerance_info[i].usual))
            abort();
    }
}

static void read_scene(const uint8_t *data, size_t size)
{
    char *text = calloc(size + 1, 1);
    if (!text)
        exit(2);
    memcpy(text, data, size);
    Tolerances of_scene = tolerances_of_scene(text), file = {.given = {true}}, both = tolerances_over(&of_scene, &file);
    for (int i = 0; i < TOLERANCE_COUNT; i++)
        if (both.given[i] != (of_scene.given[i] || file.given[i]))
            abort();
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    Tolerances tolerances = {0};
    faults_clear(&faults);
    YamlReader *reader = yaml_reader_open((const char *)data, size, "tolerances.yaml", &faults);
    if (!reader != (faults.count > 0))
        abort();
    if (!reader)
        return 0;
    tolerances_read(yaml_root(reader), &tolerances);
    yaml_reader_close(reader);
    if (faults.count == 0)
        verify(&tolerances);
    if (size > 0)
        read_scene(data, size);
    return 0;
}

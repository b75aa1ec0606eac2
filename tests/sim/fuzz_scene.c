// Any bytes as a scene: a scene within its ranges, or faults.
#include "sim/scene.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Scene *scene = scene_parse((const char *)data, size, "/nowhere/scene.yaml", &faults);
    if (!scene != (faults.count > 0))
        abort();
    if (scene) {
        if (scene->wire.section_count < 1 || scene->wire.elements < 1 || scene->wire.elements > 10000 || !(scene->dt > 0) ||
            !(fabs(vec3_norm(scene->wire.direction) - 1) < 1e-6))
            abort();
        for (int i = 0; i < scene->wire.section_count; i++)
            if (!(scene->wire.section[i].length > 0 && scene->wire.section[i].young_modulus > 0))
                abort();
        scene_free(scene);
    }
    return 0;
}

// Any bytes as a scene: a scene within its ranges, or faults.
// Covers: sim/scene.c sim/scene_tools.c sim/exercise.c sim/verify_read.c base/yaml_reader.c
#include "sim/scene.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// A tool within its ranges that fits into the one around it.
static void check_tool(const Scene *scene, int k)
{
    WireOptions wire = scene_tool_wire(scene, k);
    if (wire.section_count < 1 || !scene->tool[k].name[0] || wire.inserted < 0 || wire.inserted > wire_length(&wire) * (1 + 1e-9))
        abort();
    for (int i = 0; i < wire.section_count; i++) {
        if (!(wire.section[i].length > 0 && wire.section[i].young_modulus > 0))
            abort();
        if (k > 0 && !(wire.section[i].diameter < scene_tool_wire(scene, k - 1).section[0].inner_diameter))
            abort();
    }
}

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
        if (scene->tool_count < 1 || scene->tool_count > TOOLS_MOST)
            abort();
        for (int k = 0; k < scene->tool_count; k++)
            check_tool(scene, k);
        scene_free(scene);
    }
    return 0;
}

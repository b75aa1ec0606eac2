// A scene and the files to which it refers: a device file, a polyline, a script for several tools.
// Covers: sim/scene.c sim/scene_tools.c sim/rest_shape.c sim/tip_shaping.c
#include "sim/scene.h"
#include "tests/fuzz/given_files.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"scene.yaml", "d.yaml", "p.csv", "s.csv", NULL};
    static Faults faults;
    faults_clear(&faults);
    given_files(data, size, names);
    Scene *scene = scene_load(given_path(names[0]), &faults);
    if (!scene != (faults.count > 0))
        abort();
    if (!scene)
        return 0;
    for (int k = 0; k < scene->tool_count; k++)
        for (int i = 0; i < scene_device_count(scene, k); i++) {
            WireOptions wire = scene_device_wire(scene, k, i);
            if (wire.section_count < 1 || wire.elements < 1 || !(wire_length(&wire) > 0) || !(wire.inserted >= 0))
                abort();
        }
    for (int i = 0; i < scene->tube.point_count; i++)
        if (!vec3_is_finite(scene->tube.point[i]))
            abort();
    int cursor = 0;
    for (int i = 0; scene->script && i < scene->script->count; i++)
        if (script_tools_at(scene->script, scene->script->row[i].t_s, &cursor).released >> scene->tool_count)
            abort();
    scene_free(scene);
    return 0;
}

// An accepted scene can be run: the exact vessels of a scene and ten steps of its tools. Each node stays finite, or the step reports that it diverged.
// Covers: geom/tube_vessel.c geom/plane_vessel.c sim/simulator.c solver/wire.c
#include "sim/simulator.h"

#include <stdint.h>
#include <stdlib.h>

enum { MOST_ELEMENTS = 60 };     // total of all tools, limited for the speed of the fuzzer

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static int count_elements(const Scene *scene)
{
    int elements = 0;
    for (int k = 0; k < scene->tool_count; k++)
        for (int i = 0; i < scene_device_count(scene, k); i++)
            elements += scene_device_wire(scene, k, i).elements;
    return elements;
}

static void run(const Scene *scene, const Vessel *vessel, Faults *faults)
{
    Simulator *simulator = simulator_create(scene, vessel, faults);
    if (!simulator != (faults->count > 0))
        abort();
    int cursor = 0;
    for (int i = 0; simulator && i < 10; i++) {
        ToolCommands commands = {.tool[0] = {20, 90}};
        if (scene->script)
            commands = script_tools_at(scene->script, simulator_time_s(simulator), &cursor);
        simulator_step(simulator, &commands);
        const WireState *state = simulator_state(simulator);
        for (int n = 0; n < state->node_count; n++)
            if (!vec3_is_finite(state->position[n]))
                abort();     // a step that diverges keeps the last good state
    }
    simulator_destroy(simulator);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Scene *scene = scene_parse((const char *)data, size, "/nowhere/scene.yaml", &faults);
    bool is_exact = scene && (scene->source == SOURCE_TUBE || scene->source == SOURCE_PLANE || scene->source == SOURCE_NONE);
    if (is_exact && count_elements(scene) <= MOST_ELEMENTS) {
        Vessel *vessel = scene->source == SOURCE_TUBE    ? tube_vessel_create(&scene->tube, scene->path, &faults)
                         : scene->source == SOURCE_PLANE ? plane_vessel_create(scene->plane_point, scene->plane_normal)
                                                         : NULL;
        if (faults.count == 0)
            run(scene, vessel, &faults);
        if (vessel)
            vessel->destroy(vessel);
    }
    scene_free(scene);
    return 0;
}

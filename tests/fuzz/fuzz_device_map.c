// Any bytes as a device map: a map within its ranges, or faults.
// Covers: input/device_map.c input/device_map_tools.c input/map_state.c base/yaml_reader.c
#include "input/map_state.h"

#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    DeviceMap *map = device_map_parse((const char *)data, size, "fuzz.yaml", &faults);
    if (!map != (faults.count > 0))
        abort();
    if (!map)
        return 0;
    if (map->axis_count + map->button_count < 1 || map->axis_count > MAP_AXES || map->button_count > MAP_BUTTONS)
        abort();
    for (int i = 0; i < map->axis_count; i++)
        if (!(map->axis[i].scale > 0 && map->axis[i].dead_zone >= 0 && map->axis[i].dead_zone <= 0.9 && map->axis[i].exponent > 0))
            abort();
    const ToolNames tools = {.count = 3, .name = {"guide", "micro", "wire"}, .kind = {"catheter", "microcatheter", "wire"}};
    bool found = device_map_find_tools(map, &tools, &faults);
    if (map->hand_count < 1 || map->hand_count > MAP_HANDS || found != (faults.count == 0))
        abort();
    for (int h = 0; h < map->hand_count; h++)
        if (map->hand[h].drives < DRIVES_CHOSEN || map->hand[h].drives >= DRIVES_TOOL + tools.count)
            abort();
    for (int i = 0; i < map->axis_count; i++)
        if (map->axis[i].hand < 0 || map->axis[i].hand >= map->hand_count)
            abort();
    if (map->force.is_wanted && !(map->force.max_n > 0 && map->force.max_n <= map->force.full_scale_n && map->force.stall_ms >= 5))
        abort();
    MapState state;
    HandPort port[MAP_HANDS] = {0};
    const float axes[6] = {-1, 0.3f, 0, 1, 2, -5};
    const unsigned char buttons[15] = {1, 0, 1};
    if (map->device.kind != MAP_HID && map_bind_plain(map, 6, 15, "fuzz", &state, &faults)) {
        map_take_plain(map, axes, 6, buttons, 15, &state);
        map_take_counts(map, (const int64_t[]){1, -1}, (const bool[]){true, true}, 2, &state);
        map_publish(map, &state, port);
        for (int h = 0; h < map->hand_count; h++)
            if (!isfinite(port[h].push_mm_s) || !isfinite(port[h].advanced_mm))
                abort();
    }
    free(map);
    return 0;
}

#include "sim/scene_reading.h"

#include "base/base.h"

#include <stdlib.h>

void *scene_zeroed(Reading *reading, int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    if (!memory)
        faults_add(reading->faults, reading->path, 0, 0, "out of memory");
    return memory;
}

char *scene_resolved(Reading *reading, const char *name)
{
    char *path = text_file_beside(reading->path, name);
    if (!path)
        faults_add(reading->faults, reading->path, 0, 0, "out of memory");
    return path;
}

bool scene_read_piece(YamlValue value, TubePiece *piece)
{
    static const char *const kinds[] = {"line_mm", "arc", NULL};
    static const char *const arc_keys[] = {"radius_mm", "angle_deg", "plane_deg", NULL};
    YamlMap map = yaml_map(value, kinds);
    if (!map.value.node)
        return false;
    bool line = yaml_has(&map, "line_mm"), arc = yaml_has(&map, "arc");
    if (line == arc) {
        yaml_fault(value, "'%s' is one piece: either {line_mm: 10} or {arc: {radius_mm: 15, angle_deg: 90}}", value.name);
        return false;
    }
    if (line)
        return yaml_map_number(&map, "line_mm", true, length_range, &piece->length);
    YamlMap bend = yaml_map(yaml_get(&map, "arc", true), arc_keys);
    double angle = 0, plane = 0;
    bool good = yaml_map_number(&bend, "radius_mm", true, length_range, &piece->arc_radius);
    good &= yaml_map_number(&bend, "angle_deg", true, (NumberRange){0, 36000, true}, &angle);
    yaml_map_number(&bend, "plane_deg", false, (NumberRange){-36000, 36000, false}, &plane);
    piece->angle = angle * per_deg;
    piece->plane = plane * per_deg;
    return good;
}

#include "sim/yaml_vector.h"

static bool read_vector(YamlValue value, double largest, Vec3 *vector)
{
    double component[3];
    if (!value.node)
        return false;
    if (yaml_is_list(value) && yaml_count(value, 3, 3) < 0)
        return false;
    if (!yaml_is_list(value)) {
        yaml_fault(value, "'%s' is not a list of three numbers; expected [x, y, z]", value.name);
        return false;
    }
    bool good = true;
    for (int i = 0; i < 3; i++)
        good &= yaml_number(yaml_item(value, i), (NumberRange){-largest, largest, false}, &component[i]);
    if (good)
        *vector = vec3(component[0], component[1], component[2]);
    return good;
}

static bool read_unit_vector(YamlValue value, Vec3 *vector)
{
    Vec3 read;
    if (!read_vector(value, 1e6, &read))
        return false;
    double length = vec3_norm(read);
    if (length < 1e-9) {
        yaml_fault(value, "'%s' has no length; expected a direction such as [1, 0, 0]", value.name);
        return false;
    }
    *vector = vec3_scale(read, 1 / length);
    return true;
}

bool yaml_map_vector(const YamlMap *map, const char *key, bool required, double largest, Vec3 *vector)
{
    return read_vector(yaml_get(map, key, required), largest, vector);
}

bool yaml_map_unit_vector(const YamlMap *map, const char *key, bool required, Vec3 *vector) { return read_unit_vector(yaml_get(map, key, required), vector); }

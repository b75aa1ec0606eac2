// Points and directions of a YAML document, as base/yaml_reader.h reads numbers.
#ifndef SELDINGER_SIM_YAML_VECTOR_H
#define SELDINGER_SIM_YAML_VECTOR_H

#include "base/base.h"
#include "geom/geom.h"

// [x, y, z], each within +-largest. False if the key is absent (a fault with `required`) or wrong; the output then keeps its value.
bool yaml_map_vector(const YamlMap *map, const char *key, bool required, double largest, Vec3 *vector);
bool yaml_map_unit_vector(const YamlMap *map, const char *key, bool required, Vec3 *vector);     // the same, made unit; zero is a fault

#endif

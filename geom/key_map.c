#include "geom/key_map.h"

#include <stdlib.h>
#include <string.h>

static bool resize(KeyMap *map, size_t capacity)
{
    KeyMap bigger = {capacity, map->count, malloc(capacity * sizeof *bigger.key), malloc(capacity * sizeof *bigger.value)};
    if (!bigger.key || !bigger.value) {
        key_map_free(&bigger);
        return false;
    }
    memset(bigger.value, 0xff, capacity * sizeof *bigger.value);
    for (size_t i = 0; i < map->capacity; i++) {
        if (map->value[i] < 0)
            continue;
        size_t at = key_map_slot(&bigger, map->key[i]);
        while (bigger.value[at] >= 0)
            at = (at + 1) & (capacity - 1);
        bigger.key[at] = map->key[i];
        bigger.value[at] = map->value[i];
    }
    key_map_free(map);
    *map = bigger;
    return true;
}

bool key_map_reserve(KeyMap *map, size_t count)
{
    size_t capacity = 1024;
    while (capacity / 2 < count)
        capacity *= 2;
    return capacity <= map->capacity || resize(map, capacity);
}

int *key_map_find_or_add(KeyMap *map, uint64_t key, int fresh, bool *is_new)
{
    if (2 * (map->count + 1) > map->capacity && !key_map_reserve(map, map->count + 1))
        return NULL;
    size_t at = key_map_slot(map, key);
    while (map->value[at] >= 0 && map->key[at] != key)
        at = (at + 1) & (map->capacity - 1);
    *is_new = map->value[at] < 0;
    if (*is_new) {
        map->key[at] = key;
        map->value[at] = fresh;
        map->count++;
    }
    return &map->value[at];
}

void key_map_free(KeyMap *map)
{
    free(map->key);
    free(map->value);
}

// A hash map from 64-bit keys to indices >= 0: open addressing, at most half full. A zero-initialised map is empty. Not thread-safe while keys are added.
#ifndef SELDINGER_GEOM_KEY_MAP_H
#define SELDINGER_GEOM_KEY_MAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct KeyMap {
    size_t capacity, count;          // capacity: a power of two
    uint64_t *key;
    int *value;                      // -1: free
} KeyMap;

// Makes room for `count` keys without growing. Returns false, with the map unchanged, if out of memory.
bool key_map_reserve(KeyMap *map, size_t count);
// Returns a pointer to the key's value; a new key gets `fresh` and sets *is_new. Returns NULL if out of memory.
int *key_map_find_or_add(KeyMap *map, uint64_t key, int fresh, bool *is_new);
void key_map_free(KeyMap *map);

// Slot where the search for a key begins.
static inline size_t key_map_slot(const KeyMap *map, uint64_t key) { return (key * 0x9e3779b97f4a7c15u) >> 20 & (map->capacity - 1); }

// The value of a key; -1 if the map does not hold it.
static inline int key_map_find(const KeyMap *map, uint64_t key)
{
    if (map->count == 0)
        return -1;
    size_t at = key_map_slot(map, key);
    while (map->value[at] >= 0 && map->key[at] != key)
        at = (at + 1) & (map->capacity - 1);
    return map->value[at];
}

#endif

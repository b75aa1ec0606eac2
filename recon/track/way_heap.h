// A priority queue of voxels by path length, shortest first; ties are broken by voxel index, so results are reproducible.
#ifndef SELDINGER_RECON_TRACK_WAY_HEAP_H
#define SELDINGER_RECON_TRACK_WAY_HEAP_H

#include <stdbool.h>

typedef struct WayEntry {
    float way;
    int place;
} WayEntry;

typedef struct WayHeap {     // {0} is empty; free(entry) at the end
    WayEntry *entry;
    int count, capacity;
} WayHeap;

bool way_heap_push(WayHeap *heap, WayEntry entry);   // false: out of memory
WayEntry way_heap_pop(WayHeap *heap);                // the heap must not be empty

#endif

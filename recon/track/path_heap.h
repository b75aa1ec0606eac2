// A priority queue of voxels by path length, shortest first; ties are broken by voxel index, so results are reproducible.
#ifndef SELDINGER_RECON_TRACK_PATH_HEAP_H
#define SELDINGER_RECON_TRACK_PATH_HEAP_H

#include <stdbool.h>

typedef struct PathEntry {
    float cost;              // path length or cost from the start
    int place;
} PathEntry;

typedef struct PathHeap {     // {0} is empty; the caller frees `entry` at the end
    PathEntry *entry;
    int count, capacity;
} PathHeap;

bool path_heap_push(PathHeap *heap, PathEntry entry);   // returns false if out of memory
PathEntry path_heap_pop(PathHeap *heap);                // the heap must not be empty

#endif

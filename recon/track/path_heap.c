#include "recon/track/path_heap.h"

#include <stdlib.h>

static bool is_before(PathEntry a, PathEntry b) { return a.cost < b.cost || (a.cost == b.cost && a.place < b.place); }

bool path_heap_push(PathHeap *heap, PathEntry entry)
{
    if (heap->count == heap->capacity) {
        int capacity = heap->capacity ? 2 * heap->capacity : 1024;
        PathEntry *grown = realloc(heap->entry, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        heap->entry = grown;
        heap->capacity = capacity;
    }
    int i = heap->count++;
    for (; i > 0 && is_before(entry, heap->entry[(i - 1) / 2]); i = (i - 1) / 2)
        heap->entry[i] = heap->entry[(i - 1) / 2];
    heap->entry[i] = entry;
    return true;
}

PathEntry path_heap_pop(PathHeap *heap)
{
    PathEntry top = heap->entry[0], last = heap->entry[--heap->count];
    int i = 0;
    for (int child; (child = 2 * i + 1) < heap->count; i = child) {
        if (child + 1 < heap->count && is_before(heap->entry[child + 1], heap->entry[child]))
            child++;
        if (!is_before(heap->entry[child], last))
            break;
        heap->entry[i] = heap->entry[child];
    }
    heap->entry[i] = last;
    return top;
}

#include "recon/track/way_heap.h"

#include <stdlib.h>

static bool is_before(WayEntry a, WayEntry b) { return a.way < b.way || (a.way == b.way && a.place < b.place); }

bool way_heap_push(WayHeap *heap, WayEntry entry)
{
    if (heap->count == heap->capacity) {
        int capacity = heap->capacity ? 2 * heap->capacity : 1024;
        WayEntry *grown = realloc(heap->entry, (size_t)capacity * sizeof *grown);
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

WayEntry way_heap_pop(WayHeap *heap)
{
    WayEntry top = heap->entry[0], last = heap->entry[--heap->count];
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

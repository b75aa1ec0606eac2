#include "render/pulse_memory.h"

#include "base/base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool pulse_memory_make(PulseMemory *memory, int node_count)
{
    *memory = (PulseMemory){.node_count = node_count, .mask_count = -1};
    memory->bolus = HEAP_ZEROED((size_t)node_count + 1, sizeof *memory->bolus);
    memory->roadmap = HEAP_ZEROED((size_t)node_count + 1, sizeof *memory->roadmap);
    return memory->bolus && memory->roadmap;
}

void pulse_memory_free(PulseMemory *memory)
{
    free(memory->bolus);
    free(memory->roadmap);
    *memory = (PulseMemory){0};
}

void pulse_memory_clear(PulseMemory *memory)
{
    size_t bytes = (size_t)memory->node_count * sizeof *memory->bolus;
    memset(memory->bolus, 0, bytes);
    memset(memory->roadmap, 0, bytes);
    memory->was_opacified = memory->has_mask = false;
    memory->mask_count = -1;
}

void pulse_memory_copy(PulseMemory *to, const PulseMemory *from)
{
    int both = to->node_count < from->node_count ? to->node_count : from->node_count;
    memcpy(to->bolus, from->bolus, (size_t)both * sizeof *to->bolus);
    memcpy(to->roadmap, from->roadmap, (size_t)both * sizeof *to->roadmap);
    to->was_opacified = from->was_opacified;
    to->has_mask = from->has_mask;
    to->mask_count = from->mask_count;
}

bool contrast_is_seen(const float *contrast, int count)
{
    for (int n = 0; n < count; n++)
        if (contrast[n] > least_contrast)
            return true;
    return false;
}

bool pulse_memory_take(PulseMemory *memory, const XrayControl *xray, const float *contrast)
{
    long mode = lroundf(xray->mode);
    bool is_opacified = contrast && contrast_is_seen(contrast, memory->node_count);
    bool is_new = isfinite(xray->mask) && (xray->mask < memory->mask_count || xray->mask > memory->mask_count), is_first = memory->mask_count < 0;
    if (is_opacified && !memory->was_opacified)
        memset(memory->bolus, 0, (size_t)memory->node_count * sizeof *memory->bolus);
    memory->was_opacified = is_opacified;
    for (int n = 0; n < memory->node_count; n++) {
        float c = contrast && contrast[n] > 0 ? fminf(contrast[n], 1) : 0;   // NaN counts as none
        memory->bolus[n] = fmaxf(memory->bolus[n], c);
        // a new mask starts with the last visible bolus and accumulates
        if (is_new && !is_first)
            memory->roadmap[n] = memory->bolus[n];
        else if (mode == XRAY_ROADMAP)
            memory->roadmap[n] = fmaxf(memory->roadmap[n], c);
    }
    if (is_new)
        memory->mask_count = xray->mask;
    bool is_mask = (is_new && !is_first) || (mode == XRAY_DSA && !memory->has_mask);
    memory->has_mask |= is_mask;
    return is_mask;
}

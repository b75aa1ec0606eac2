// What X-ray pulses leave behind for later pictures: the vessels that contrast agent has shown, and which pulse was the mask. It depends on the pulses alone,
// drawn or not. No OpenGL.
#ifndef SELDINGER_RENDER_PULSE_MEMORY_H
#define SELDINGER_RENDER_PULSE_MEMORY_H

#include "sim/sim.h"

#include <stdbool.h>

typedef struct PulseMemory {
    int node_count;              // N of the tree
    float *bolus, *roadmap;      // (N) maximum during the last bolus; maximum in the roadmap
    bool was_opacified;          // the last pulse showed contrast agent
    bool has_mask;               // a pulse was the mask of DSA
    float mask_count;            // xray.mask of the last pulse, -1: no pulse yet
} PulseMemory;

// Returns false if out of memory; free it even then.
bool pulse_memory_make(PulseMemory *memory, int node_count);
void pulse_memory_free(PulseMemory *memory);
void pulse_memory_clear(PulseMemory *memory);
// Of different numbers of nodes: those that both have.
void pulse_memory_copy(PulseMemory *to, const PulseMemory *from);
// Takes a pulse with these controls and concentrations (N), NULL: none. Returns true if it is the mask.
bool pulse_memory_take(PulseMemory *memory, const XrayControl *xray, const float *contrast);

// True if any concentration is visible.
bool contrast_is_seen(const float *contrast, int count);
static const float least_contrast = 0.002F;      // lowest visible concentration

#endif

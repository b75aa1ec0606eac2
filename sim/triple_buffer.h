// Passes the newest value from one thread to another without a lock: three slots, of which the writer fills one, the reader holds one, and the third
// is in between. Neither side ever waits; values not fetched in time are overwritten.
#ifndef SELDINGER_SIM_TRIPLE_BUFFER_H
#define SELDINGER_SIM_TRIPLE_BUFFER_H

#include "base/base.h"

#include <stdbool.h>

typedef struct TripleBuffer {
    ATOMIC(unsigned) between;        // index of the waiting slot, with TRIPLE_FRESH if the reader has not yet fetched it
    unsigned writing, reading;       // each side's own
} TripleBuffer;

enum { TRIPLE_FRESH = 4 };

static inline void triple_buffer_init(TripleBuffer *buffer) { *buffer = (TripleBuffer){.between = 0, .writing = 1, .reading = 2}; }

// The writer has filled slot `writing`: publishes it and returns the next slot to fill.
static inline unsigned triple_buffer_publish(TripleBuffer *buffer)
{
    buffer->writing = atomic_exchange_explicit(&buffer->between, buffer->writing | TRIPLE_FRESH, memory_order_acq_rel) & 3;
    return buffer->writing;
}

// The reader fetches the newest value: true if slot `reading` has a new one.
static inline bool triple_buffer_fetch(TripleBuffer *buffer)
{
    if (!(atomic_load_explicit(&buffer->between, memory_order_relaxed) & TRIPLE_FRESH))
        return false;
    buffer->reading = atomic_exchange_explicit(&buffer->between, buffer->reading, memory_order_acq_rel) & 3;
    return true;
}

#endif

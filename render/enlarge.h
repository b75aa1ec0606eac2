// Enlarges a picture by bilinear interpolation. On a software renderer this takes a quarter of the time of a pass of its own shaders.
#ifndef SELDINGER_RENDER_ENLARGE_H
#define SELDINGER_RENDER_ENLARGE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct Enlarger {      // memory for a size; initialise with zeros
    int from[2], to[2];        // width and height
    uint32_t *picture;         // (from) to be filled by the caller
    uint32_t *enlarged;        // (to)
    uint64_t *row;             // (from[0] + 1) one row between two rows of the picture: 16 bits a channel
    int *column;               // (to[0]) left pixel of each column …
    int *weight;               // … and the weight of the right one, of 256
} Enlarger;

// Returns false if out of memory. Neither side may shrink.
bool enlarger_fit(Enlarger *enlarger, int from_width, int from_height, int to_width, int to_height);
void enlarger_free(Enlarger *enlarger);
// From `picture` to `enlarged`. `turned`: with the rows in the opposite order, and the first and third channel exchanged, as the buffer of a window has them.
void enlarger_run(Enlarger *enlarger, bool turned);

#endif

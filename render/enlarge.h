// Enlarges a picture by bilinear interpolation, some rows at a time, so that the caller passes them on while they are in the cache. On a software renderer this
// takes a small part of the time of a pass of its own shaders.
#ifndef SELDINGER_RENDER_ENLARGE_H
#define SELDINGER_RENDER_ENLARGE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct Enlarger {      // memory for a size; initialise with zeros
    int from[2], to[2];        // width and height
    uint32_t *picture;         // (from) to be filled by the caller
    uint64_t *spread;          // (from[0] + 1) one row of the picture: 16 bits a channel
    uint64_t *row[2];          // (to[0]) two rows of the picture, enlarged in width …
    int row_of[2];             // … and which they are; -1: none
    int *column;               // (to[0]) left pixel of each column …
    int *weight;               // … and the weight of the right one, of 256
} Enlarger;

// Returns false if out of memory. Neither side may shrink.
bool enlarger_fit(Enlarger *enlarger, int from_width, int from_height, int to_width, int to_height);
void enlarger_free(Enlarger *enlarger);
void enlarger_begin(Enlarger *enlarger);     // `picture` is new
// Rows `first` to first + count - 1 of the enlarged picture, (count, to[0]). `turned`: in the opposite order, and with the first and third channel exchanged, as
// the buffer of a window has them; in all calls after enlarger_begin() or in none.
void enlarger_rows(Enlarger *enlarger, int first, int count, bool turned, uint32_t *out);

#endif

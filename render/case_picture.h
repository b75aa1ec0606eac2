// The small picture of a case for the start window: its vessel and tool in 3D, kept in the user's cache.
#ifndef SELDINGER_RENDER_CASE_PICTURE_H
#define SELDINGER_RENDER_CASE_PICTURE_H

#include "sim/sim.h"

#include <stdint.h>

enum { CASE_PICTURE_WIDTH = 320, CASE_PICTURE_HEIGHT = 200 };

// The file of the picture of the scene or case at `path`, which changes with the scene's text; the caller frees it. NULL: no cache, or the scene cannot be
// read.
char *case_picture_file(const char *path);
// Draws the picture off screen; needs no window, and no current GL context. False with faults.
bool case_picture_draw(const char *file, Scene *scene, OpenVessel *open, Faults *faults);
// Reads a picture: (height, width, 3), rows from the top; the caller frees it. NULL: it is not there yet.
uint8_t *case_picture_read(const char *file, int *width, int *height);

#endif

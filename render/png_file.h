// Writes RGB pixels to a PNG file through a temporary file, so an older file is preserved until the new one is complete.
#ifndef SELDINGER_RENDER_PNG_FILE_H
#define SELDINGER_RENDER_PNG_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// `rgb` (height, width, 3), rows from the top. Returns false with a reason in `message` (may be NULL).
bool png_file_write(const char *path, int width, int height, const uint8_t *rgb, char *message, size_t capacity);

#endif

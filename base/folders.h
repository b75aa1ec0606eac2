// Folders: creation with all parents, and the user's cache.
#ifndef SELDINGER_BASE_FOLDERS_H
#define SELDINGER_BASE_FOLDERS_H

#include <stdbool.h>
#include <stddef.h>

// Creates each folder of the path that does not exist. Writes to `path` while it works and restores it. Returns false with errno.
bool folders_create(char *path);
// The folder of the user's cache: $SELDINGER_CACHE, else $XDG_CACHE_HOME/seldinger, else ~/.cache/seldinger. Returns false if none is known or it does not fit.
bool folders_cache(char *out, size_t capacity);

#endif

// Folders: creation with all parents, the user's cache, settings and data.
#ifndef SELDINGER_BASE_FOLDERS_H
#define SELDINGER_BASE_FOLDERS_H

#include <stdbool.h>
#include <stddef.h>

// Creates each folder of the path that does not exist. Writes to `path` while it works and restores it. Returns false with errno.
bool folders_create(char *path);
// The folder of the user's cache: $SELDINGER_CACHE, else $XDG_CACHE_HOME/seldinger, else ~/.cache/seldinger. Returns false if none is known or it does not fit.
bool folders_cache(char *out, size_t capacity);
// The folder of the user's settings: $XDG_CONFIG_HOME/seldinger, else ~/.config/seldinger. Returns false as above.
bool folders_config(char *out, size_t capacity);
// The folder of what the user made and wants to keep, sessions and cases: $XDG_DATA_HOME/seldinger, else ~/.local/share/seldinger. Returns false as above.
bool folders_data(char *out, size_t capacity);

#endif

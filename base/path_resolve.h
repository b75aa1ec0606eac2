// Resolves a path, even if the file does not exist yet.
#ifndef SELDINGER_BASE_PATH_RESOLVE_H
#define SELDINGER_BASE_PATH_RESOLVE_H

#include <limits.h>
#include <stdbool.h>

// Writes the absolute path without symbolic links. If the file does not exist, its folder is resolved; a dangling link resolves to the file it points to. False
// if the folder
// does not exist or the path is too long.
bool path_resolve(const char *path, char whole[PATH_MAX]);

#endif

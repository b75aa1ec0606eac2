// What a path means, also of a file that is not there yet.
#ifndef SELDINGER_BASE_PATH_RESOLVE_H
#define SELDINGER_BASE_PATH_RESOLVE_H

#include <limits.h>
#include <stdbool.h>

// Absolute and without links. Of a file that is not there its folder is; a link that leads nowhere yet is the file at its end. False where there is no such folder.
bool path_resolve(const char *path, char whole[PATH_MAX]);

#endif

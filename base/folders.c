#include "base/folders.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

bool folders_create(char *path)
{
    for (char *at = path + 1; *at; at++) {
        if (*at != '/')
            continue;
        *at = 0;
        bool made = mkdir(path, 0777) == 0 || errno == EEXIST;
        *at = '/';
        if (!made)
            return false;
    }
    struct stat status;
    if (mkdir(path, 0777) == 0 || (errno == EEXIST && stat(path, &status) == 0 && S_ISDIR(status.st_mode)))
        return true;
    errno = errno == EEXIST ? ENOTDIR : errno;
    return false;
}

bool folders_cache(char *out, size_t capacity)
{
    const char *own = getenv("SELDINGER_CACHE"), *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    int length = own && *own     ? snprintf(out, capacity, "%s", own)
                 : xdg && *xdg   ? snprintf(out, capacity, "%s/seldinger", xdg)
                 : home && *home ? snprintf(out, capacity, "%s/.cache/seldinger", home)
                                 : -1;
    return length > 0 && (size_t)length < capacity;
}

bool folders_config(char *out, size_t capacity)
{
    const char *xdg = getenv("XDG_CONFIG_HOME"), *home = getenv("HOME");
    int length = xdg && *xdg ? snprintf(out, capacity, "%s/seldinger", xdg) : home && *home ? snprintf(out, capacity, "%s/.config/seldinger", home) : -1;
    return length > 0 && (size_t)length < capacity;
}

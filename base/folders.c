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

// Where the XDG Base Directory Specification puts a program's folder.
static bool xdg_folder(const char *variable, const char *below_home, char *out, size_t capacity)
{
    const char *xdg = getenv(variable), *home = getenv("HOME");
    int length = xdg && *xdg ? snprintf(out, capacity, "%s/seldinger", xdg) : home && *home ? snprintf(out, capacity, "%s/%s/seldinger", home, below_home) : -1;
    return length > 0 && (size_t)length < capacity;
}

bool folders_cache(char *out, size_t capacity)
{
    const char *own = getenv("SELDINGER_CACHE");
    if (!own || !*own)
        return xdg_folder("XDG_CACHE_HOME", ".cache", out, capacity);
    return snprintf(out, capacity, "%s", own) < (int)capacity;
}

bool folders_config(char *out, size_t capacity) { return xdg_folder("XDG_CONFIG_HOME", ".config", out, capacity); }
bool folders_data(char *out, size_t capacity) { return xdg_folder("XDG_DATA_HOME", ".local/share", out, capacity); }

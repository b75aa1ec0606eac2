#define _XOPEN_SOURCE 700   // realpath
#include "base/path_resolve.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_LINKS = 40 };

// The folder is resolved, the name in it stays: `path` is not there.
static bool resolve_folder(const char *path, char whole[PATH_MAX])
{
    char folder[PATH_MAX], resolved[PATH_MAX];
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    int length = slash == path ? 1 : (int)(name - path) - (slash != NULL);
    if ((size_t)length >= sizeof folder)
        return false;
    snprintf(folder, sizeof folder, "%.*s", slash ? length : 1, slash ? path : ".");
    if (!realpath(folder, resolved))
        return false;
    return snprintf(whole, PATH_MAX, "%s%s%s", resolved, resolved[1] ? "/" : "", name) < PATH_MAX;
}

bool path_resolve(const char *path, char whole[PATH_MAX])
{
    char at[PATH_MAX], target[PATH_MAX];
    if (realpath(path, whole))
        return true;
    if (strlen(path) >= sizeof at)
        return false;
    strcpy(at, path);
    for (int i = 0; i < MOST_LINKS; i++) {
        ssize_t length = readlink(at, target, sizeof target - 1);
        if (length <= 0)
            return resolve_folder(at, whole);
        target[length] = 0;
        char *slash = strrchr(at, '/');
        size_t folder = target[0] == '/' || !slash ? 0 : (size_t)(slash - at) + 1;
        if (folder + (size_t)length >= sizeof at)
            return false;
        memcpy(at + folder, target, (size_t)length + 1);
    }
    return false;
}

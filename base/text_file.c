#include "base/text_file.h"

#include "base/whole_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *text_file_read(const char *path, size_t *length, Faults *faults) { return whole_file_read_most(path, TEXT_FILE_LIMIT, length, faults); }

char *text_file_beside(const char *base, const char *name)
{
    const char *slash = strrchr(base, '/');
    size_t folder = name[0] == '/' || !slash ? 0 : (size_t)(slash - base) + 1;
    size_t length = strlen(name);
    char *path = malloc(folder + length + 1);
    if (path) {
        memcpy(path, base, folder);
        memcpy(path + folder, name, length + 1);
    }
    return path;
}

char *text_file_in(const char *folder, const char *name)
{
    size_t length = strlen(folder) + strlen(name) + 2;
    char *path = malloc(length);
    if (path)
        snprintf(path, length, "%s/%s", folder, name);
    return path;
}

// The part of process.h that the library uses too. Nothing here changes the streams, signals or end of the calling process, except in its own child.
#define _XOPEN_SOURCE 700   // realpath
#include "base/process.h"

#include <fcntl.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

void process_be_expendable(unsigned processor_s, unsigned wall_s)
{
    int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nowhere, STDERR_FILENO);     // silences glibc's messages about a corrupted heap
    setrlimit(RLIMIT_CORE, &(struct rlimit){0, 0});
    setrlimit(RLIMIT_FSIZE, &(struct rlimit){0, 0});
    setrlimit(RLIMIT_CPU, &(struct rlimit){processor_s, processor_s});
    alarm(wall_s);
}

// A line of /proc/self/maps: "BEGIN-END rights offset device inode   PATH".
static bool is_loaded_from(const char *line, uintptr_t address, char *path, size_t capacity)
{
    char *at;
    uintptr_t begin = strtoul(line, &at, 16), end = *at == '-' ? strtoul(at + 1, &at, 16) : 0;
    const char *file = strchr(line, '/');
    size_t length = file ? strcspn(file, "\n") : 0;
    if (address < begin || address >= end || length == 0 || length >= capacity)
        return false;
    memcpy(path, file, length);
    path[length] = 0;
    return true;
}

bool process_code_file(char *path, size_t capacity)
{
    char line[4300];
    bool is_found = false;
    FILE *maps = fopen("/proc/self/maps", "re");
    while (maps && !is_found && fgets(line, sizeof line, maps))
        is_found = is_loaded_from(line, (uintptr_t)process_code_file, path, capacity);
    if (maps)
        fclose(maps);
    return is_found;
}

static bool program_file(char *path, size_t capacity)
{
    ssize_t length = readlink("/proc/self/exe", path, capacity - 1);
    path[length > 0 ? length : 0] = 0;
    return length > 0 && (size_t)length < capacity - 1;
}

static bool name_beside(const char *file, const char *below, const char *name, char *path, size_t capacity)
{
    int folder = (int)(strrchr(file, '/') + 1 - file);
    return snprintf(path, capacity, "%.*s%s%s", folder, file, below, name) < (int)capacity;
}

bool process_beside(const char *name, char *path, size_t capacity)
{
    static const char *const below[] = {"../bin/", "../../bin/"};
    char program[4096], library[4096], other[4096];
    if (!program_file(program, sizeof program) || !name_beside(program, "", name, path, capacity))
        return false;
    bool is_library = process_code_file(library, sizeof library) && strcmp(library, program) != 0;
    for (int i = 0; is_library && access(path, X_OK) != 0 && i < 2; i++)
        if (name_beside(library, below[i], name, other, sizeof other) && access(other, X_OK) == 0)
            return snprintf(path, capacity, "%s", other) < (int)capacity;
    return true;
}

bool process_scenes(const char *name, char *path)
{
    static const char *const above[] = {"../../scenes/", "../share/seldinger/scenes/"};
    char beside[PATH_MAX], below[64];
    for (int i = 0; i < 2; i++)
        if (snprintf(below, sizeof below, "%s%s", above[i], name) < (int)sizeof below && process_beside(below, beside, sizeof beside) && realpath(beside, path))
            return true;
    return false;
}

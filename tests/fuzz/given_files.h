// Files for fuzz targets that read by path: writes the bytes of the input as files of a folder in memory, or in /tmp, which is removed at the end of the
// program.
#ifndef SELDINGER_TESTS_GIVEN_FILES_H
#define SELDINGER_TESTS_GIVEN_FILES_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Separator of two files of an input; it is in the dictionaries of the targets.
#define GIVEN_CUT "\n%%%%\n"

static char given_folder[64];
static const char *const *given_names;

static inline const char *given_path(const char *name)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", given_folder, name);
    return path;
}

static inline void given_remove(void)
{
    for (const char *const *name = given_names; name && *name; name++)
        unlink(given_path(*name));
    rmdir(given_folder);
}

static inline void given_begin(const char *const *names)
{
    strcpy(given_folder, "/dev/shm/seldinger-fuzz-XXXXXX");
    if (!mkdtemp(given_folder)) {
        strcpy(given_folder, "/tmp/seldinger-fuzz-XXXXXX");
        if (!mkdtemp(given_folder))
            exit(2);
    }
    given_names = names;
    atexit(given_remove);
}

// Writes a file for each of `names` (NULL-terminated, the same in each call) for which the input has a part, and removes the other files of the previous call.
// An input without GIVEN_CUT is the first file.
static inline void given_files(const uint8_t *data, size_t size, const char *const *names)
{
    const size_t cut = strlen(GIVEN_CUT);
    const uint8_t *at = data, *end = data + size;
    if (!given_names)
        given_begin(names);
    for (; *names; names++) {
        const char *path = given_path(*names);
        if (!at) {
            unlink(path);
            continue;
        }
        const uint8_t *next = names[1] && at < end ? memmem(at, (size_t)(end - at), GIVEN_CUT, cut) : NULL;
        size_t length = (size_t)((next ? next : end) - at);
        FILE *file = fopen(path, "wb");
        if (!file || (length > 0 && fwrite(at, 1, length, file) != length) || fclose(file) != 0)
            exit(2);
        at = next ? next + cut : NULL;
    }
}

#endif

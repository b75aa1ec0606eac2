#include "base/text_file.h"

#include "base/regular_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

char *text_file_read(const char *path, size_t *length, Faults *faults)
{
    struct stat status;
    const char *why;
    int file = regular_file_open(path, &status, &why);
    if (file < 0) {
        faults_add(faults, path, 0, 0, "cannot be opened: %s; expected a readable text file", why);
        return NULL;
    }
    size_t size = (size_t)status.st_size;
    char *text = NULL;
    if (size > TEXT_FILE_LIMIT)
        faults_add(faults, path, 0, 0, "is %zu bytes long; expected at most %d", size, TEXT_FILE_LIMIT);
    else if (!(text = malloc(size + 1)))
        faults_add(faults, path, 0, 0, "needs %zu bytes of memory, more than is available", size);
    if (text) {
        *length = regular_file_read(file, text, size);
        text[*length] = 0;
    }
    // a partial text must not be used
    if (text && *length < size) {
        faults_add(faults, path, 0, 0, "cannot be read completely: %s", errno ? strerror(errno) : "the file became shorter");
        free(text);
        text = NULL;
    }
    close(file);
    return text;
}

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

#include "input/text_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char *read_open_file(int descriptor, const char *path, size_t *length, Faults *faults)
{
    struct stat status;
    if (fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
        faults_add(faults, path, 0, 0, "is not a regular file; give a text file");
        return NULL;
    }
    if (status.st_size > TEXT_FILE_LIMIT) {
        faults_add(faults, path, 0, 0, "is %lld bytes long; at most %d are read", (long long)status.st_size, TEXT_FILE_LIMIT);
        return NULL;
    }
    size_t size = (size_t)status.st_size, used = 0;
    char *text = malloc(size + 1);
    if (!text) {
        faults_add(faults, path, 0, 0, "needs %zu bytes of memory; there are not so many", size);
        return NULL;
    }
    while (used < size) {
        ssize_t got = read(descriptor, text + used, size - used);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            faults_add(faults, path, 0, 0, "cannot be read: %s", strerror(errno));
            free(text);
            return NULL;
        }
        if (got == 0)
            break;
        used += (size_t)got;
    }
    text[used] = 0;
    *length = used;
    return text;
}

char *text_file_read(const char *path, size_t *length, Faults *faults)
{
    // non-blocking, so that opening a named pipe does not wait for its other end
    int descriptor = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) {
        faults_add(faults, path, 0, 0, "cannot be opened: %s; give a file that can be read", strerror(errno));
        return NULL;
    }
    char *text = read_open_file(descriptor, path, length, faults);
    close(descriptor);
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

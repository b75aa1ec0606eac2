#include "base/regular_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

static const char irregular[] = "it is not a regular file but a folder, a pipe or a device";

int regular_file_open(const char *path, struct stat *status, const char **why)
{
    // opening some devices has side effects, so a device is not opened at all
    if (stat(path, status) == 0 && !S_ISREG(status->st_mode)) {
        *why = irregular;
        return -1;
    }
    int descriptor = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (descriptor >= 0 && fstat(descriptor, status) == 0 && S_ISREG(status->st_mode))
        return descriptor;
    // the path may have changed since stat()
    *why = descriptor < 0 ? strerror(errno) : irregular;
    if (descriptor >= 0)
        close(descriptor);
    return -1;
}

size_t regular_file_read(int descriptor, void *bytes, size_t capacity)
{
    size_t got = 0;
    while (got < capacity) {
        ssize_t n = read(descriptor, (char *)bytes + got, capacity - got);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return got;
        if (n == 0)
            break;
        got += (size_t)n;
    }
    errno = 0;
    return got;
}

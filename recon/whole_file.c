// Writing goes to `path.part-PID`, is synced, then renamed over `path`; whatever fails removes the part. A device or pipe is written straight
// through: renaming over it would replace it.
#include "recon/whole_file.h"

#include "base/regular_file.h"
#include "geom/stops.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

char *whole_file_read_most(const char *path, size_t most, size_t *length, Faults *faults)
{
    struct stat status;
    const char *why;
    int file = regular_file_open(path, &status, &why);
    if (file < 0) {
        faults_add(faults, path, 0, 0, "cannot be opened: %s; an existing readable file is needed", why);
        return NULL;
    }
    size_t size = (size_t)status.st_size;
    if (size > most) {
        faults_add(faults, path, 0, 0, "is %zu bytes long; at most %zu are read of a file of this kind", size, most);
        close(file);
        return NULL;
    }
    char *bytes = malloc(size + 1);
    size_t got = bytes ? regular_file_read(file, bytes, size) : 0;
    close(file);
    if (!bytes || got < size) {
        faults_add(faults, path, 0, 0, "cannot be read: %s", bytes ? "it ends early" : "not enough memory");
        free(bytes);
        return NULL;
    }
    bytes[size] = '\0';
    *length = size;
    return bytes;
}

char *whole_file_read(const char *path, size_t *length, Faults *faults) { return whole_file_read_most(path, SIZE_MAX - 1, length, faults); }

static bool write_all(int file, const char *bytes, size_t length)
{
    while (length > 0) {
        ssize_t n = write(file, bytes, length);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        bytes += n;
        length -= (size_t)n;
    }
    return true;
}

static bool write_through(const char *path, const void *bytes, size_t length, Faults *faults)
{
    int file = open(path, O_WRONLY | O_CLOEXEC | O_NOCTTY);
    bool written = file >= 0 && write_all(file, bytes, length);
    int reason = errno;
    if (file >= 0 && close(file) && written)
        written = false, reason = errno;
    if (!written)
        faults_add(faults, path, 0, 0, "cannot be written: %s; a regular file in a folder with free space is valid", strerror(reason));
    return written;
}

bool whole_file_write(const char *path, const void *bytes, size_t length, Faults *faults)
{
    struct stat status;
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode))
        return write_through(path, bytes, length, faults);
    size_t room = strlen(path) + 32;
    char *part = malloc(room);
    if (!part) {
        faults_add(faults, path, 0, 0, "cannot be written: not enough memory");
        return false;
    }
    snprintf(part, room, "%s.part-%ld", path, (long)getpid());
    sigset_t before;
    stops_hold(&before);
    int file = open(part, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    bool written = file >= 0 && write_all(file, bytes, length) && (fsync(file) == 0 || errno == EINVAL);
    int reason = errno;
    if (file >= 0 && close(file) && written)
        written = false, reason = errno;
    if (written && rename(part, path))
        written = false, reason = errno;
    if (!written) {
        if (file >= 0)
            unlink(part);
        faults_add(faults, path, 0, 0, "cannot be written: %s; a folder with write permission and free space is needed", strerror(reason));
    }
    stops_release(&before);
    free(part);
    return written;
}

#include "base/whole_file.h"

#include "base/part_file.h"
#include "base/regular_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
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
        faults_add(faults, path, 0, 0, "cannot be opened: %s; expected a readable file", why);
        return NULL;
    }
    size_t size = (size_t)status.st_size;
    if (size > most) {
        faults_add(faults, path, 0, 0, "is %zu bytes long; expected at most %zu for a file of this kind", size, most);
        close(file);
        return NULL;
    }
    char *bytes = malloc(size + 1);
    size_t got = bytes ? regular_file_read(file, bytes, size) : 0;
    int reason = errno;
    close(file);
    if (!bytes || got < size) {
        faults_add(faults, path, 0, 0, "cannot be read: %s", !bytes ? "out of memory" : reason ? strerror(reason) : "it ends early");
        free(bytes);
        return NULL;
    }
    bytes[size] = '\0';
    *length = size;
    return bytes;
}

char *whole_file_read(const char *path, size_t *length, Faults *faults) { return whole_file_read_most(path, SIZE_MAX - 1, length, faults); }

static bool write_through(const char *path, const void *bytes, size_t length)
{
    PartFile device = {.descriptor = open(path, O_WRONLY | O_APPEND | O_CLOEXEC | O_NOCTTY)};
    if (device.descriptor < 0)
        return false;
    bool written = part_file_write(&device, bytes, length);
    int reason = errno;
    if (close(device.descriptor) && written)
        return false;
    errno = reason;
    return written;
}

bool whole_file_write(const char *path, const void *bytes, size_t length, Faults *faults)
{
    bool is_through = part_file_is_through(path), written;
    PartFile part;
    if (is_through) {
        written = write_through(path, bytes, length);
    } else if ((written = part_file_begin(&part, path))) {
        written = part_file_write(&part, bytes, length) && part_file_finish_synced(&part);
        part_file_drop(&part);
    }
    if (!written)
        faults_add(faults, path, 0, 0, "cannot be written: %s; expected a %s", strerror(errno),
                   is_through ? "device with free space, or a regular file" : "writable folder with free space");
    return written;
}

#define _GNU_SOURCE   // fopencookie
#include "base/part_file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SLOTS = 16, NAME_TRIES = 100 };
enum { SLOT_FREE, SLOT_TAKEN, SLOT_LIVE };

static struct Slot {
    atomic_int state;        // the name may be read while it is SLOT_LIVE
    char name[PATH_MAX];
} slots[SLOTS];

void part_files_remove(void)
{
    for (int i = 0; i < SLOTS; i++)
        if (atomic_load(&slots[i].state) == SLOT_LIVE)
            unlink(slots[i].name);
}

// Registered before the file is created: a stop in between then removes nothing.
static int take_slot(const char *name)
{
    if (strlen(name) >= PATH_MAX)
        return -1;
    for (int i = 0; i < SLOTS; i++) {
        int free_now = SLOT_FREE;
        if (!atomic_compare_exchange_strong(&slots[i].state, &free_now, SLOT_TAKEN))
            continue;
        strcpy(slots[i].name, name);
        atomic_store(&slots[i].state, SLOT_LIVE);
        return i;
    }
    return -1;
}

static void leave_slot(PartFile *part)
{
    if (part->slot >= 0)
        atomic_store(&slots[part->slot].state, SLOT_FREE);
    part->slot = -1;
}

// PATH.part-XXXXXXXXXXXX, 60 random bits; names of at most 255 bytes are cut.
static bool make_name(const char *path, char *name, size_t capacity)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdef";
    uint8_t random[12];
    char tail[13];
    if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random)
        return false;
    for (int i = 0; i < 12; i++)
        tail[i] = letters[random[i] % 32];
    tail[12] = 0;
    const char *slash = strrchr(path, '/');
    int folder = slash ? (int)(slash - path) + 1 : 0, most = NAME_MAX - 18;
    snprintf(name, capacity, "%.*s%.*s.part-%s", folder, path, most, path + folder, tail);
    return true;
}

static int open_new(PartFile *part, const char *path, mode_t mode, size_t capacity)
{
    for (int i = 0; i < NAME_TRIES && make_name(path, part->name, capacity); i++) {
        part->slot = take_slot(part->name);
        int file = open(part->name, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
        if (file >= 0)
            return file;
        leave_slot(part);
        if (errno != EEXIST)
            break;
    }
    return -1;
}

static void forget(PartFile *part)
{
    int reason = errno;
    free(part->path);
    free(part->name);
    *part = (PartFile){.descriptor = -1, .slot = -1};
    errno = reason;
}

bool part_file_is_through(const char *path)
{
    struct stat status;
    if (stat(path, &status) != 0 || S_ISDIR(status.st_mode))
        return false;
    // these may lead to a regular file
    static const char *const descriptors[] = {"/dev/std", "/dev/fd/", "/proc/"};
    for (int i = 0; i < 3; i++)
        if (!strncmp(path, descriptors[i], strlen(descriptors[i])))
            return true;
    return !S_ISREG(status.st_mode);
}

bool part_file_begin(PartFile *part, const char *path)
{
    struct stat there;
    bool replaces = stat(path, &there) == 0 && S_ISREG(there.st_mode);
    size_t capacity = strlen(path) + 32;
    *part = (PartFile){.descriptor = -1, .slot = -1, .path = strdup(path), .name = malloc(capacity)};
    if (part->path && part->name)
        part->descriptor = open_new(part, path, replaces ? 0600 : 0666, capacity);
    if (part->descriptor < 0) {
        forget(part);
        return false;
    }
    // if the owner cannot be kept, the group's permissions would apply to another group
    if (replaces) {
        bool is_kept = fchown(part->descriptor, there.st_uid, there.st_gid) == 0;
        struct stat own;
        is_kept = is_kept || (fstat(part->descriptor, &own) == 0 && own.st_gid == there.st_gid);
        mode_t mode = there.st_mode & (is_kept ? 0777 : 0707);
        if (fchmod(part->descriptor, mode) != 0) {
            part_file_drop(part);
            return false;
        }
    }
    return true;
}

bool part_file_write(PartFile *part, const void *bytes, size_t length)
{
    for (const char *at = bytes; length > 0;) {
        ssize_t n = write(part->descriptor, at, length);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        at += n;
        length -= (size_t)n;
    }
    return true;
}

static ssize_t write_stream(void *descriptor, const char *bytes, size_t length)
{
    PartFile part = {.descriptor = (int)(intptr_t)descriptor};
    return part_file_write(&part, bytes, length) ? (ssize_t)length : 0;
}

static int close_stream(void *descriptor) { return close((int)(intptr_t)descriptor); }

// stdio treats a write interrupted by a signal as failed.
FILE *part_file_stream(PartFile *part)
{
    if (!part->stream)
        part->stream = fopencookie((void *)(intptr_t)part->descriptor, "wb", (cookie_io_functions_t){.write = write_stream, .close = close_stream});
    return part->stream;
}

static bool close_part(PartFile *part)
{
    bool good = part->stream ? fclose(part->stream) == 0 : close(part->descriptor) == 0;
    part->stream = NULL;
    part->descriptor = -1;
    return good;
}

void part_file_drop(PartFile *part)
{
    int reason = errno;
    if (!part->name)
        return;
    close_part(part);
    unlink(part->name);
    leave_slot(part);
    forget(part);
    errno = reason;
}

static bool finish(PartFile *part, bool is_synced)
{
    bool good = !part->stream || (!ferror(part->stream) && fflush(part->stream) == 0);
    // EINVAL: not supported by the file system
    good = good && (!is_synced || fsync(part->descriptor) == 0 || errno == EINVAL);
    if (good && close_part(part) && rename(part->name, part->path) == 0) {
        leave_slot(part);
        forget(part);
        return true;
    }
    int reason = errno;
    if (part->descriptor >= 0)
        close_part(part);
    unlink(part->name);
    leave_slot(part);
    errno = reason ? reason : EIO;
    forget(part);
    return false;
}

bool part_file_finish_synced(PartFile *part) { return finish(part, true); }
bool part_file_finish(PartFile *part) { return finish(part, false); }

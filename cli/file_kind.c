#include "cli/file_kind.h"

#include "base/base.h"
#include "recon/recon.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static FileKind kind_of_hdf5(const char *path)
{
    Faults unread = {0};
    Hdf5Reader *reader = hdf5_reader_open(path, "", &unread);
    if (!reader)
        return errno ? FILE_MISSING : FILE_TREE;   // truncated or damaged: the tree reader reports what is wrong
    FileKind kind = hdf5_has(reader, "/nodes") ? FILE_TREE : hdf5_has(reader, "/wire") ? FILE_RECORDING : FILE_UNKNOWN;
    hdf5_reader_close(reader);
    return unread.count == 0 ? kind : FILE_MISSING;
}

FileKind file_kind(const char *path)
{
    unsigned char head[4096] = {0};
    struct stat status;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode))
        return FILE_VOLUME;
    const char *why;
    int file = regular_file_open(path, &status, &why);
    if (file < 0)
        return FILE_MISSING;
    size_t length = regular_file_read(file, head, sizeof head - 1);
    bool is_unread = errno != 0;
    close(file);
    if (is_unread)
        return FILE_MISSING;
    const char *text = (const char *)head;
    if (length >= 8 && !memcmp(head, "\x89HDF\r\n\x1a\n", 8))
        return kind_of_hdf5(path);
    if (volume_is_known(head, length, path))
        return FILE_VOLUME;
    if (strstr(text, "t_s,push_mm_s,twist_deg_s"))
        return FILE_SCRIPT;
    const char *name = strrchr(path, '.');
    if (strstr(text, "seldinger:") || (name && (!strcmp(name, ".yaml") || !strcmp(name, ".yml"))))
        return FILE_SCENE;
    if (strstr(text, "t_s,") && (strstr(text, ".push_mm_s") || strstr(text, ".released") || strstr(text, ".exchange")))
        return FILE_SCRIPT;  // script of several tools
    return surface_is_known(head, length, path) ? FILE_SURFACE : FILE_UNKNOWN;
}

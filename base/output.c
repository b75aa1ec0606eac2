#include "base/output.h"

#include "base/part_file.h"
#include "base/whole_file.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool is_special(const char *path) { return !strcmp(path, "-") || part_file_is_through(path); }

static bool can_create_beside(const char *path)
{
    PartFile part;
    if (!part_file_begin(&part, path))
        return false;
    part_file_drop(&part);
    return true;
}

bool output_check(const char *path, Faults *faults)
{
    struct stat status;
    if (!path || !strcmp(path, "-"))
        return true;
    bool there = stat(path, &status) == 0;
    if (there && S_ISDIR(status.st_mode)) {
        faults_add(faults, path, 0, 0, "is a folder; give the name of a file to write");
        return false;
    }
    if (is_special(path) ? access(path, W_OK) == 0 : path[0] && can_create_beside(path))
        return true;
    faults_add(faults, path, 0, 0, "cannot be written: %s; give a file in a folder with write permission", path[0] ? strerror(errno) : "it has no name");
    return false;
}

bool output_check_file(const char *path, Faults *faults)
{
    if (path && is_special(path)) {
        faults_add(faults, path, 0, 0, "is not a regular file; this format needs one");
        return false;
    }
    return output_check(path, faults);
}

bool output_write(const char *path, const void *bytes, size_t length, Faults *faults)
{
    if (!is_special(path))
        return whole_file_write(path, bytes, length, faults);
    FILE *file = strcmp(path, "-") ? fopen(path, "w") : stdout;
    bool good = file && fwrite(bytes, 1, length, file) == length && fflush(file) == 0;
    int reason = errno;
    if (file && file != stdout && fclose(file) != 0 && good)
        good = false, reason = errno;
    if (!good)
        faults_add(faults, path, 0, 0, "cannot be written: %s; choose a folder with free space", strerror(reason));
    return good;
}

bool output_write_line(const char *path, char *text, Faults *faults)
{
    size_t length = text ? strlen(text) : 0;
    char *line = text ? realloc(text, length + 2) : NULL;
    if (!line) {
        free(text);
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
        return false;
    }
    memcpy(line + length, "\n", 2);
    bool good = output_write(path, line, length + 1, faults);
    free(line);
    return good;
}

void output_extension(const char *path, char extension[16])
{
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    size_t length = dot ? strlen(dot) : 0;
    if (length >= 16)
        length = 0;
    for (size_t i = 0; i < length; i++)
        extension[i] = (char)tolower((unsigned char)dot[i]);
    extension[length] = 0;
}

bool output_text_open(OutputText *text)
{
    *text = (OutputText){0};
    text->stream = open_memstream(&text->bytes, &text->length);
    return text->stream != NULL;
}

bool output_text_write(OutputText *text, const char *path, Faults *faults)
{
    bool whole = !ferror(text->stream) && fclose(text->stream) == 0;
    if (!whole)
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
    whole = whole && output_write(path, text->bytes, text->length, faults);
    free(text->bytes);
    return whole;
}

bool output_text_forget(OutputText *text)
{
    fclose(text->stream);
    free(text->bytes);
    return false;
}

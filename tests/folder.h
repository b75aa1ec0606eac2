// A separate folder for the files of a test: the test defines `folder`, a template for mkdtemp, before it includes this header. If the folder needs files from
// the start, the set-up of the test calls make_folder().
#ifndef SELDINGER_TESTS_FOLDER_H
#define SELDINGER_TESTS_FOLDER_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static inline int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

// The program's cache of models is in this folder too, so that models of other runs are not found.
static inline int make_folder_with_cache(void **state) { return make_folder(state) == 0 ? setenv("SELDINGER_CACHE", folder, 1) : -1; }

static inline const char *in_folder(const char *name)
{
    static char path[8][200];
    static int turn;
    turn = (turn + 1) % 8;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static inline int remove_folder(void **state)
{
    (void)state;
    char command[100];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

static inline void put_bytes(const char *name, const void *bytes, size_t length)
{
    FILE *file = fopen(in_folder(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, length, file), length);
    assert_int_equal(fclose(file), 0);
}

static inline void put(const char *name, const char *text) { put_bytes(name, text, strlen(text)); }

static inline char *text_of(const char *path)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    size_t size = (size_t)ftell(file);
    rewind(file);
    char *text = malloc(size + 1);
    assert_int_equal(fread(text, 1, size, file), size);
    text[size] = '\0';
    fclose(file);
    return text;
}

#endif

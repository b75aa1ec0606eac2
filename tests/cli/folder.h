// Files of a test in a folder of its own: the test defines `folder`, a template for mkdtemp, before it includes this.
#ifndef SELDINGER_TESTS_CLI_FOLDER_H
#define SELDINGER_TESTS_CLI_FOLDER_H

#include <stdio.h>
#include <stdlib.h>

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
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return system(command);
}

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

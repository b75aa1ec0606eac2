#include "base/heap.h"

#include "base/part_file.h"

#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct Trial {
    struct Trial *around;
    jmp_buf back;
    size_t lacking;
} Trial;

static _Thread_local Trial *trial;

// Local variables of this function are indeterminate after longjmp() unless they are in memory; `own` is.
bool heap_try(void (*call)(void *context), void *context, size_t *lacking)
{
    Trial own = {.around = trial};
    trial = &own;
    bool is_whole = setjmp(own.back) == 0;
    if (is_whole)
        call(context);
    else
        *lacking = own.lacking;
    trial = own.around;
    return is_whole;
}

bool heap_is_tried(void) { return trial != NULL; }

// Other threads may be running: resources that they use are not released.
void heap_is_empty(size_t bytes, const char *file)
{
    if (trial) {
        trial->lacking = bytes > 0 ? bytes : 1;      // 0 means that no allocation failed
        longjmp(trial->back, 1);
    }
    const char *folder = strrchr(file, '/'), *from = folder;
    while (from && from > file && from[-1] != '/')      // keep the last folder: "fit/field_fit.c"
        from--;
    char message[200];
    int length =
        snprintf(message, sizeof message, "seldinger: out of memory (could not allocate %zu bytes in %.60s); close other programs or use a smaller input\n",
                 bytes, from ? from : file);
    ssize_t written = write(STDERR_FILENO, message, (size_t)length);
    (void)written;
    part_files_remove();
    _exit(2);
}

bool heap_can_allocate(size_t bytes)
{
    void *volatile block = malloc(bytes);     // volatile prevents the compiler from removing it
    bool has = block != NULL;
    free(block);
    return has;
}

static size_t bytes_of(size_t count, size_t size) { return size > 0 && count > SIZE_MAX / size ? SIZE_MAX : count * size; }

void *heap_zeroed(size_t count, size_t size, const char *file)
{
    void *memory = calloc(count > 0 ? count : 1, size > 0 ? size : 1);
    if (!memory)
        heap_is_empty(bytes_of(count, size), file);
    return memory;
}

void *heap_grown(void *old, size_t count, size_t size, const char *file)
{
    size_t bytes = bytes_of(count, size);
    void *memory = bytes < SIZE_MAX ? realloc(old, bytes > 0 ? bytes : 1) : NULL;
    if (!memory)
        heap_is_empty(bytes, file);
    return memory;
}

char *heap_text(const char *text, const char *file)
{
    size_t bytes = strlen(text) + 1;
    return memcpy(heap_zeroed(bytes, 1, file), text, bytes);
}

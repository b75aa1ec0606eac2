#define _GNU_SOURCE   // fopencookie, madvise
#include "sim/library/allocator.h"

#include "seldinger/base.h"

#include <cJSON.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

// The linker's names of the original functions, and of the replacements.
void *__real_malloc(size_t bytes);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t bytes);
void *__real_aligned_alloc(size_t alignment, size_t bytes);
void __real_free(void *memory);
char *__real_cJSON_Print(const cJSON *item);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t bytes);
void *__wrap_aligned_alloc(size_t alignment, size_t bytes);
void __wrap_free(void *memory);
char *__wrap_strdup(const char *text);
char *__wrap_cJSON_Print(const cJSON *item);
FILE *__wrap_open_memstream(char **text, size_t *length);

enum { LEAST_ALIGNMENT = 16 };

static SelAllocator host;
static bool has_host;
static atomic_bool is_settled;

void allocator_settle(void) { atomic_store(&is_settled, true); }

SelStatus sel_set_allocator(const SelAllocator *allocator)
{
    if (atomic_load(&is_settled))
        return SEL_ERROR_STATE;
    if (allocator && (allocator->size < sizeof *allocator || !allocator->allocate || !allocator->resize || !allocator->release))
        return SEL_ERROR_ARGUMENT;
    has_host = allocator != NULL;
    if (allocator)
        host = *allocator;
    return SEL_OK;
}

void *__wrap_malloc(size_t bytes)
{
    if (!has_host)
        return __real_malloc(bytes);
    void *memory = host.allocate(host.user, bytes > 0 ? bytes : 1, LEAST_ALIGNMENT);
    if (!memory)
        errno = ENOMEM;
    return memory;
}

// Large arrays of a simulator, such as those for contacts of a tool with itself, are hardly used. calloc() would fill recycled memory with zeros and so make all
// of it resident, 5 MB a simulator instead of 2.5: the pages are given back instead, and read as zeros when they are used.
static size_t page_bytes(void) { return (size_t)sysconf(_SC_PAGESIZE); }

static void *zeroed_pages(size_t bytes)
{
    unsigned char *memory = __real_malloc(bytes);
    uintptr_t page = page_bytes(), skip = -(uintptr_t)memory & (page - 1);
    size_t whole = (bytes - skip) / page * page;
    if (!memory)
        return NULL;
    if (madvise(memory + skip, whole, MADV_DONTNEED) != 0)       // locked memory
        return memset(memory, 0, bytes);
    memset(memory, 0, skip);
    memset(memory + skip + whole, 0, bytes - skip - whole);
    return memory;
}

void *__wrap_calloc(size_t count, size_t size)
{
    enum { LARGE = 1 << 14 };
    if (!has_host && size > 0 && count < SIZE_MAX / size && count * size >= LARGE && count * size > 2 * page_bytes())
        return zeroed_pages(count * size);
    if (!has_host)
        return __real_calloc(count, size);
    if (size > 0 && count > SIZE_MAX / size) {
        errno = ENOMEM;
        return NULL;
    }
    void *memory = __wrap_malloc(count * size);
    return memory ? memset(memory, 0, count * size) : NULL;
}

void *__wrap_realloc(void *memory, size_t bytes)
{
    if (!has_host)
        return __real_realloc(memory, bytes);
    if (!memory)
        return __wrap_malloc(bytes);
    void *longer = host.resize(host.user, memory, bytes > 0 ? bytes : 1);
    if (!longer)
        errno = ENOMEM;
    return longer;
}

void *__wrap_aligned_alloc(size_t alignment, size_t bytes)
{
    if (!has_host)
        return __real_aligned_alloc(alignment, bytes);
    return host.allocate(host.user, bytes > 0 ? bytes : 1, alignment > LEAST_ALIGNMENT ? alignment : LEAST_ALIGNMENT);
}

void __wrap_free(void *memory)
{
    if (!has_host)
        __real_free(memory);
    else if (memory)
        host.release(host.user, memory);
}

char *__wrap_strdup(const char *text)
{
    size_t bytes = strlen(text) + 1;
    char *copy = __wrap_malloc(bytes);
    return copy ? memcpy(copy, text, bytes) : NULL;
}

// cJSON has its own allocator, but the caller releases the text with free().
char *__wrap_cJSON_Print(const cJSON *item)
{
    char *text = __real_cJSON_Print(item), *copy = text ? __wrap_strdup(text) : NULL;
    cJSON_free(text);
    return copy;
}

// --- open_memstream: the text grows with each write; it is complete and NUL-terminated once the stream is closed ---

typedef struct TextStream {
    char **text;
    size_t *length;
    size_t capacity;
} TextStream;

static ssize_t add_text(void *cookie, const char *bytes, size_t count)
{
    TextStream *stream = cookie;
    size_t needed = *stream->length + count + 1;
    if (needed > stream->capacity) {
        size_t capacity = 2 * needed;
        char *longer = __wrap_realloc(*stream->text, capacity);
        if (!longer)
            return 0;
        *stream->text = longer;
        stream->capacity = capacity;
    }
    memcpy(*stream->text + *stream->length, bytes, count);
    *stream->length += count;
    (*stream->text)[*stream->length] = 0;
    return (ssize_t)count;
}

static int end_text(void *cookie)
{
    __wrap_free(cookie);
    return 0;
}

FILE *__wrap_open_memstream(char **text, size_t *length)
{
    TextStream *stream = __wrap_calloc(1, sizeof *stream);
    if (!stream)
        return NULL;
    *stream = (TextStream){.text = text, .length = length, .capacity = 64};
    *length = 0;
    *text = __wrap_calloc(1, stream->capacity);
    FILE *file = *text ? fopencookie(stream, "w", (cookie_io_functions_t){.write = add_text, .close = end_text}) : NULL;
    if (file)
        return file;
    __wrap_free(*text);
    __wrap_free(stream);
    return NULL;
}

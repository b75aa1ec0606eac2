// Counts calls of the heap and of mmap by this thread: functions of the test program replace those of the C library, for calls by any library. Include once per
// program, after cmocka.h.
#ifndef SELDINGER_TESTS_HEAP_CALLS_H
#define SELDINGER_TESTS_HEAP_CALLS_H

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/types.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
#define COUNTS_HEAP 0
static long heap_calls(void) { return 0; }
static void heap_watch(bool on) { (void)on; }
#else
#define COUNTS_HEAP 1
// volatile: the compiler assumes that malloc() and free() neither read nor write the variables of a program
static _Thread_local volatile bool watched;
static _Thread_local volatile long calls;

static long heap_calls(void) { return calls; }
static void heap_watch(bool on) { watched = on; }

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *memory);
long syscall(long number, ...);   // hidden by _POSIX_C_SOURCE

void *malloc(size_t size)
{
    calls += watched;
    return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    calls += watched;
    return __libc_calloc(count, size);
}

void *realloc(void *memory, size_t size)
{
    calls += watched;
    return __libc_realloc(memory, size);
}

void free(void *memory)
{
    calls += watched;
    __libc_free(memory);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    calls += watched;
    return __libc_memalign(alignment, size);
}

int posix_memalign(void **memory, size_t alignment, size_t size)
{
    calls += watched;
    *memory = __libc_memalign(alignment, size);
    return *memory ? 0 : ENOMEM;
}

void *mmap(void *address, size_t length, int protection, int flags, int file, off_t offset)
{
    calls += watched;
    return (void *)syscall(SYS_mmap, address, length, protection, flags, file, offset);
}

int munmap(void *address, size_t length)
{
    calls += watched;
    return (int)syscall(SYS_munmap, address, length);
}
#endif

static void need_counting(void)
{
    if (COUNTS_HEAP)
        return;
    print_message("skipped: the heap is the sanitizer's\n");
    skip();
}

// Checks the counter: the test would notice a call.
static void the_counter_counts(void **state)
{
    (void)state;
    need_counting();
    long before = heap_calls();
    heap_watch(true);
    char *volatile memory = malloc(100);
    memory = realloc(memory, 200);
    free(memory);
    heap_watch(false);
    assert_int_equal(heap_calls() - before, 3);
}

#endif

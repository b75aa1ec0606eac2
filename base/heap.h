// Allocation for offline computations deep in loops and callbacks that cannot return an error: if out of memory, the program ends with a message and exit code
// 2.
// Not for simulation steps, nor while a file is being written: those return faults.
#ifndef SELDINGER_BASE_HEAP_H
#define SELDINGER_BASE_HEAP_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

// Allocates `count` values of `size` bytes, zeroed; never returns NULL, even for 0 values. `file` appears in the message. The caller frees.
void *heap_zeroed(size_t count, size_t size, const char *file);
#define HEAP_ZEROED(count, size) heap_zeroed(count, size, __FILE__)
// Resizes `old`; new bytes are uninitialised. Never returns NULL.
void *heap_grown(void *old, size_t count, size_t size, const char *file);
#define HEAP_GROWN(old, count, size) heap_grown(old, count, size, __FILE__)
// Copies a text. The caller frees it.
char *heap_text(const char *text, const char *file);
#define HEAP_TEXT(text) heap_text(text, __FILE__)
// True if a block of this size can be allocated now. Check this before calling a library that crashes if out of memory.
bool heap_can_allocate(size_t bytes);
// Four times what the HDF5 library (1.10) allocates at once for the cache of a file (H5AC_create).
#define HEAP_RESERVE_OF_HDF5 ((size_t)8 << 20)
// For a library, which must not end the program: runs call(context). Returns false if an allocation failed and ended the call early; `*lacking` is then the
// size of the
// failed allocation [bytes], or 1 if unknown. A failed allocation in a thread of base/parallel.h also ends the call. Memory and open files that the call had
// acquired
// until then are not released.
bool heap_try(void (*call)(void *context), void *context, size_t *lacking);
bool heap_is_tried(void);            // true inside heap_try() on this thread
// Reports a failed allocation of `bytes`: ends the innermost heap_try() of this thread, or, outside heap_try(), prints a message and ends the program.
__attribute__((noreturn)) void heap_is_empty(size_t bytes, const char *file);

#ifdef __cplusplus
}
#endif

#endif

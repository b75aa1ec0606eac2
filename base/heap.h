// Allocation for offline computations deep in loops and callbacks that cannot return an error: out of memory ends the program with a message and exit
// code 2. Not for simulation steps or while a file is being written: those return faults.
#ifndef SELDINGER_BASE_HEAP_H
#define SELDINGER_BASE_HEAP_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

// `count` values of `size` bytes, zeroed; never NULL, even for 0 values. `file` is used in the message. The caller frees.
void *heap_zeroed(size_t count, size_t size, const char *file);
#define HEAP_ZEROED(count, size) heap_zeroed(count, size, __FILE__)
// Resizes `old`; new bytes are uninitialised.
void *heap_grown(void *old, size_t count, size_t size, const char *file);
#define HEAP_GROWN(old, count, size) heap_grown(old, count, size, __FILE__)
// A copy of a text.
char *heap_text(const char *text, const char *file);
#define HEAP_TEXT(text) heap_text(text, __FILE__)
// Whether a block of this size can be allocated now: to be checked before calling a library that crashes without it.
bool heap_has_room(size_t bytes);
// Four times what the HDF5 library (1.10) allocates at once for a file's cache (H5AC_create).
#define HEAP_ROOM_OF_HDF5 ((size_t)8 << 20)
// For a library, which must not end the program: calls `call`. False where memory that could not be had broke it off; `*lacking` is then what was asked for [bytes], 1 where
// that is not known.
// Its threads of base/parallel.h are broken off too. What the call had taken until then, memory and open files, is not given back.
bool heap_try(void (*call)(void *context), void *context, size_t *lacking);
bool heap_is_tried(void);            // by this thread, now
// What cannot be had: breaks off the innermost heap_try() of this thread, else says so and ends the program.
__attribute__((noreturn)) void heap_is_empty(size_t bytes, const char *file);

#ifdef __cplusplus
}
#endif

#endif

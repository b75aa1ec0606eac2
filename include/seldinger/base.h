// Seldinger as a library: what all parts share. Version, results, contexts, memory.
//
// Units: mm, s, N, N mm, degrees; each name carries its unit. Vectors are x, y, z; quaternions are w, x, y, z and turn the tool's frame (x along the tool
// towards its tip) into space.
//
// Results: a function that can fail returns a SelStatus and writes its result through its last parameter, or leaves that unchanged. The context keeps the
// faults, with file, line and column, until its next call: sel_fault(). Functions that only read return 0, NaN or NULL for a NULL handle.
//
// Handles: sel_NAME_destroy() accepts NULL. Handles may be destroyed in any order: a handle that still needs a context or a scene keeps it alive.
//
// Options: a structure that begins with `size` may grow in later versions. Get one from its sel_NAME_defaults() and change what you need; a program that was
// compiled with an older header keeps working. Other structures do not change while the library's major version (libseldinger.so.N) stays the same.
//
// Threads: use a context, and the handles created with it, in one thread at a time. Several contexts may work in several threads, except in functions that read
// or write files: the HDF5 library that they use is not thread-safe, so call these one at a time. Simulators of one scene may step in several threads.
//
// Process-wide state: only the allocator, the choice of vector instructions (environment variable SELDINGER_SIMD), open vessels (sel_vessels_forget()) and the
// names of unfinished files.
// The library does not write to standard output or standard error, installs no signal handler and leaves the host's HDF5 settings and locale as they are.
#ifndef SELDINGER_PUBLIC_BASE_H
#define SELDINGER_PUBLIC_BASE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SEL_API __attribute__((visibility("default")))

#define SEL_VERSION_MAJOR 0
#define SEL_VERSION_MINOR 1
#define SEL_VERSION_PATCH 0

// The version of the library that is loaded, such as "0.1.0".
SEL_API const char *sel_version(void);

typedef enum SelStatus {
    SEL_OK = 0,
    SEL_ERROR_ARGUMENT = 1,      // an argument is NULL, not finite or out of range; nothing was done
    SEL_ERROR_INPUT = 2,         // a file cannot be read, or a scene, volume, tree or recording is not valid
    SEL_ERROR_OUTPUT = 3,        // a file cannot be written
    SEL_ERROR_MEMORY = 4,        // out of memory; memory that the call had allocated may be lost
    SEL_ERROR_STATE = 5,         // the call is not possible now, for example recording after the first step
    SEL_DIFFERENT = 6            // a replay does not give the recorded states
} SelStatus;

// A short name such as "bad input", for messages.
SEL_API const char *sel_status_name(SelStatus status);

// --- memory ---

// The library's memory functions. All three are called from several threads at once.
typedef struct SelAllocator {
    size_t size;
    void *user;
    void *(*allocate)(void *user, size_t bytes, size_t alignment);   // alignment: a power of two, at least 16; returns NULL if out of memory
    void *(*resize)(void *user, void *memory, size_t bytes);         // as realloc, for memory allocated with alignment 16
    void (*release)(void *user, void *memory);                       // never NULL
} SelAllocator;

// Replaces malloc and free for all of the library's own memory. It applies to the whole process, not to a context: call it once, before the first
// sel_context_create(). NULL: malloc again. The libraries that Seldinger uses (HDF5, libyaml, cJSON, zlib, Embree) keep their own allocators. Errors:
// SEL_ERROR_STATE (a context was created before), SEL_ERROR_ARGUMENT (a function is NULL).
SEL_API SelStatus sel_set_allocator(const SelAllocator *allocator);
// Frees a text that the library returned. NULL is allowed.
SEL_API void sel_free(void *text);

// --- contexts ---

typedef struct SelContext SelContext;

typedef enum SelMessageLevel { SEL_NOTE = 0, SEL_WARNING = 1 } SelMessageLevel;

typedef struct SelContextOptions {
    size_t size;
    void *user;                  // passed to both callbacks
    // Receives remarks of a call that succeeds, one line without newline: repaired defects of a mesh, doubts about a start point.
    void (*message)(void *user, SelMessageLevel level, const char *text);
    // Receives the progress of a long call (tracking, fitting), about ten times a second, in the calling thread. A call cannot be cancelled.
    void (*progress)(void *user, long done, long total);
} SelContextOptions;

// Writes the defaults: no callbacks. `size`: sizeof(SelContextOptions).
SEL_API void sel_context_options_init(SelContextOptions *options, size_t size);
static inline SelContextOptions sel_context_defaults(void)
{
    SelContextOptions options;
    sel_context_options_init(&options, sizeof options);
    return options;
}

// `options` may be NULL. Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_MEMORY.
SEL_API SelStatus sel_context_create(const SelContextOptions *options, SelContext **context);
SEL_API void sel_context_destroy(SelContext *context);

// The faults of the context's last call: `FILE:LINE:COLUMN: what is wrong; what is valid`, or `FILE:byte OFFSET: …`, or `FUNCTION: …`. All faults of a file are
// reported in one call. Texts stay valid until the next call with the context. sel_fault() returns "" if there is no fault `index`.
SEL_API int sel_fault_count(const SelContext *context);
SEL_API const char *sel_fault(const SelContext *context, int index);

#ifdef __cplusplus
}
#endif

#endif

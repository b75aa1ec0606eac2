// Shared by the parts of the public library: the handles and the execution of a call. The public headers document the functions.
#ifndef SELDINGER_SIM_LIBRARY_CONTEXT_H
#define SELDINGER_SIM_LIBRARY_CONTEXT_H

#include "base/base.h"
#include "recon/recon.h"
#include "seldinger/recording.h"
#include "sim/vessel_cache.h"
#include "sim/open_vessel.h"
#include "sim/recording.h"
#include "solver/solver.h"

#include <stdatomic.h>

struct SelContext {
    atomic_int holders;      // the host, and the handles that report to it
    SelContextOptions options;
    Faults faults;           // of the last call
};

struct SelScene {
    atomic_int holders;
    Scene *scene;
    SharedVessel *shared;    // NULL: not open yet
    OpenVessel open;         // what it holds
    ATOMIC(Checkpoint *) start;   // the state at time 0, which all its simulators share; NULL before the first
};

struct SelRecording {
    char *path;
    RecordedRun *run;
};

SelContext *context_held(SelContext *context);
void context_release(SelContext *context);
const SelScene *scene_held(const SelScene *scene);
void scene_release(const SelScene *scene);
// Takes ownership of the parsed scene and opens its vessel. Returns false with faults, after freeing everything.
bool scene_open_parsed(SelContext *context, Scene *scene, const SelOpenOptions *options, SelScene **out);

// Work that reports failure by faults. context_call runs it in the "C" locale with HDF5 messages off; if out of memory, the work is aborted (base/heap.h).
// Returns `otherwise` if the work adds faults or returns false.
typedef bool (*Work)(SelContext *context, void *what);
SelStatus context_call(SelContext *context, Work work, void *what, SelStatus otherwise);
// Adds `FUNCTION: words` and returns `status`. The context may be NULL.
SelStatus context_refuse(SelContext *context, SelStatus status, const char *function, const char *text);

// Reports the progress of a call to the host; `call` is NULL if the host has no callback.
Progress context_progress(SelContext *context);
// Passes notes to the host of the call in which this thread is; a NoteFunction.
void context_note(const char *path, const char *text);
void context_message(SelContext *context, SelMessageLevel level, const char *path, const char *text);

// Copies the given options over the defaults in `own`. Returns false if their `size` is invalid.
bool options_take(void *own, size_t own_size, const void *given);
// Copies a structure to the host, up to the size that the host knows; its first member is the size.
void result_give(void *out, size_t size, void *own, size_t own_size);

ToolCommands commands_of(const SelHand *hand);
SelHand hand_of(const ToolCommands *commands);
// Returns NULL, or a description of what is wrong with the hand.
const char *hand_trouble(const SelHand *hand);

#endif

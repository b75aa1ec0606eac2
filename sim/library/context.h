// What the parts of the public library share: the handles, and how a call is made. The public headers say what each function does.
#ifndef SELDINGER_SIM_LIBRARY_CONTEXT_H
#define SELDINGER_SIM_LIBRARY_CONTEXT_H

#include "base/base.h"
#include "recon/recon.h"
#include "seldinger/recording.h"
#include "sim/open_vessel.h"
#include "sim/recording.h"

#include <stdatomic.h>

struct SelContext {
    atomic_int holders;      // the host, and the handles that report to it
    SelContextOptions options;
    Faults faults;           // of the last call
};

struct SelScene {
    atomic_int holders;
    Scene *scene;
    OpenVessel open;
};

struct SelRecording {
    char *path;
    RecordedRun *run;
};

SelContext *context_held(SelContext *context);
void context_let_go(SelContext *context);
const SelScene *scene_held(const SelScene *scene);
void scene_let_go(const SelScene *scene);
// Takes the parsed scene, opens its vessel; false with faults, then nothing is left of it.
bool scene_open_parsed(SelContext *context, Scene *scene, const SelOpenOptions *options, SelScene **out);

// Work that may fail by its faults. Runs in the "C" locale, with HDF5 silent; memory that lacks breaks it off (base/heap.h). `otherwise` where it adds faults or
// returns false.
typedef bool (*Work)(SelContext *context, void *what);
SelStatus context_call(SelContext *context, Work work, void *what, SelStatus otherwise);
// Adds `FUNCTION: words` and returns `status`. The context may be NULL.
SelStatus context_refuse(SelContext *context, SelStatus status, const char *function, const char *words);

// Progress of a call to the host; `call` NULL where nobody asks.
Progress context_progress(SelContext *context);
// Notes to the host, of the call that this thread is in; a NoteFunction.
void context_note(const char *path, const char *text);
void context_say(SelContext *context, SelMessageLevel level, const char *path, const char *text);

// The given options over the defaults that `own` holds. False where their `size` cannot be one.
bool options_take(void *own, size_t own_size, const void *given);
// A structure to the host as far as it knows it; its first member is the size.
void result_give(void *out, size_t size, void *own, size_t own_size);

ToolCommands commands_of(const SelHand *hand);
SelHand hand_of(const ToolCommands *commands);
// NULL, or what is wrong with it.
const char *hand_trouble(const SelHand *hand);

#endif

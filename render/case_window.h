// The window of `seldinger case`: from an angiogram to a case in which somebody steers.
#ifndef SELDINGER_RENDER_CASE_WINDOW_H
#define SELDINGER_RENDER_CASE_WINDOW_H

#include "sim/sim.h"

typedef struct CaseWindowOptions {
    const CaseOptions *made;     // all but the trace
    const char *folder;          // of the case; NULL: one of the cache
    const char *picture;         // of the window at its end; NULL: none
    int width, height;
    double duration_s;           // ends after this much real time; 0: never
} CaseWindowOptions;

// Runs until the user steers or leaves. `steer` gets the folder of the case that was saved to steer in; "": none. False with faults if no window can be opened.
bool case_window_run(const CaseWindowOptions *options, char *steer, size_t capacity, Faults *faults);

#endif

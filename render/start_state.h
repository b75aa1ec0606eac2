// What the start window is given, what it keeps, and what the user chose.
#ifndef SELDINGER_RENDER_START_STATE_H
#define SELDINGER_RENDER_START_STATE_H

#include "input/input.h"
#include "sim/sim.h"

typedef enum { START_LEAVE, START_STEER, START_REPLAY, START_REPORT } StartChoice;

typedef struct StartOptions {
    const Shelf *shelf;
    const char *message;         // what happened before, one or more lines; "": nothing
    const HidTransport *transport; // of the page of devices; NULL: hidapi
    int width, height;
    double duration_s;           // ends after this much real time; 0: never
} StartOptions;

// Kept between two calls: which page is open and where.
typedef struct StartState {
    int page, row;
    char folder[4096];           // that the page of files shows
    char trainee[64];
    bool is_examination;         // steer without 3D view and angioscopy
    char path[4096];             // result: the scene or case, the file to open, or the session file
} StartState;

#endif

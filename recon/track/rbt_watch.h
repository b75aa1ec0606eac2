// Shows a tree while it is tracked, and ends the tracking on request.
#ifndef SELDINGER_RECON_TRACK_RBT_WATCH_H
#define SELDINGER_RECON_TRACK_RBT_WATCH_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct RbtSeen {     // a node as far as it is known
    Vec3 center;             // [mm]
    double radius;           // [mm]
    int parent;              // index; -1: none, or not yet attached
    int kind;                // NODE_VESSEL or NODE_ANEURYSM
} RbtSeen;

typedef struct RbtWatch {
    void *context;
    // Called from the thread that called rbt_track, after every few nodes; copies what it keeps. The result does not depend on it. May be NULL.
    void (*show)(void *context, const RbtSeen *node, int count);
    bool (*is_stopped)(void *context);   // as in Progress
    // Translates the doubts about the first start (as sim/words.h); NULL: English.
    const char *(*words)(const char *text) __attribute__((format_arg(1)));
} RbtWatch;

static inline bool rbt_watch_is_stopped(const RbtWatch *watch) { return watch && watch->is_stopped && watch->is_stopped(watch->context); }

#endif

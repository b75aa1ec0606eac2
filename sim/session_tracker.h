// What a session tracks besides the tool: the score and the contrast agent. Follows a simulator step by step, on its thread; a replay uses the same
// code.
#ifndef SELDINGER_SIM_SESSION_TRACKER_H
#define SELDINGER_SIM_SESSION_TRACKER_H

#include "sim/contrast_injection.h"
#include "sim/score.h"

// The part published with each pose; plain data of session_tracker_view_bytes() bytes.
typedef struct TrackerView {
    ScoreFigures score;
    double injected_ml;
    double flow_ml_s;            // flow of contrast agent now, as far as the tool's lumen passes the requested rate …
    int contrast_tool;           // … through this tool; -1: no tool has a lumen
    int node_count;              // N of the tree, 0 without
    int filling_count;           // M of all tools
    float concentration[];       // (N + M) 0 to 1: contrast agent at the tree's nodes, then in the tools' lumens at theirs
} TrackerView;

typedef struct SessionTracker SessionTracker;

// Before the first step. `tree` may be NULL; it and the simulator must outlive the tracker. NULL if out of memory.
SessionTracker *session_tracker_create(Simulator *simulator, const VesselTree *tree);
void session_tracker_free(SessionTracker *tracker);
// Callbacks for realtime's after_step and publish. Neither allocates.
void session_tracker_step(void *tracker, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
void session_tracker_publish(void *tracker, void *view);
size_t session_tracker_view_bytes(const SessionTracker *tracker);
const Score *session_tracker_score(const SessionTracker *tracker);

#endif

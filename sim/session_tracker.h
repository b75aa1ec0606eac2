// Follows a simulator step by step, on its thread, and keeps the score and the contrast agent of a session. A replay uses the same code.
#ifndef SELDINGER_SIM_SESSION_TRACKER_H
#define SELDINGER_SIM_SESSION_TRACKER_H

#include "sim/contrast_injection.h"
#include "sim/score.h"

// The state published with each pose; plain data of session_tracker_view_bytes() bytes.
typedef struct TrackerView {
    ScoreFigures score;
    double injected_ml;
    double flow_ml_s;            // present flow of contrast agent: the requested rate, limited by the tool's lumen …
    int contrast_tool;           // … through this tool; -1: no tool has a lumen
    int node_count;              // N of the tree; 0 without a tree
    int filling_count;           // M of all tools
    float concentration[];       // (N + M) 0 to 1: contrast agent at the tree's nodes, then in the tools' lumens at theirs
} TrackerView;

typedef struct SessionTracker SessionTracker;

// To be called before the first step. `tree` may be NULL; it and the simulator must outlive the tracker. Returns NULL if out of memory.
SessionTracker *session_tracker_create(Simulator *simulator, const VesselTree *tree);
void session_tracker_free(SessionTracker *tracker);
// Callbacks for realtime's after_step and publish. Neither allocates.
void session_tracker_step(void *tracker, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
void session_tracker_publish(void *tracker, void *view);
size_t session_tracker_view_bytes(const SessionTracker *tracker);
const Score *session_tracker_score(const SessionTracker *tracker);

#endif

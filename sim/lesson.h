// What a session tracks besides the tool: the score and the contrast agent. Follows a simulator step by step, on its thread; a replay uses the same
// code.
#ifndef SELDINGER_SIM_LESSON_H
#define SELDINGER_SIM_LESSON_H

#include "sim/contrast_injection.h"
#include "sim/score.h"

// The part published with each pose; plain data of lesson_view_bytes() bytes.
typedef struct LessonView {
    ScoreFigures score;
    double injected_ml;
    double flow_ml_s;            // flow of contrast agent now, as far as the tool's lumen passes the requested rate …
    int contrast_tool;           // … through this tool; -1: no tool has a lumen
    int node_count;              // N of the tree, 0 without
    int filling_count;           // M of all tools
    float concentration[];       // (N + M) 0 to 1: contrast agent at the tree's nodes, then in the tools' lumens at theirs
} LessonView;

typedef struct Lesson Lesson;

// Before the first step. `tree` may be NULL; it and the simulator must outlive the lesson. NULL if out of memory.
Lesson *lesson_create(Simulator *simulator, const VesselTree *tree);
void lesson_free(Lesson *lesson);
// Callbacks for realtime's after_step and publish. Neither allocates.
void lesson_step(void *lesson, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
void lesson_publish(void *lesson, void *view);
size_t lesson_view_bytes(const Lesson *lesson);
const Score *lesson_score(const Lesson *lesson);

#endif

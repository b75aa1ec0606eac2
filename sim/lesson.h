// What goes on beside the tool in a session: the score and the contrast agent. Follows a simulator step by step, on its thread; a replay has the same.
#ifndef SELDINGER_SIM_LESSON_H
#define SELDINGER_SIM_LESSON_H

#include "sim/contrast_injection.h"
#include "sim/score.h"

// What of it goes out with a moment; plain data of lesson_view_bytes().
typedef struct LessonView {
    ScoreFigures score;
    double injected_ml;
    double flow_ml_s;            // of contrast agent now, what is asked for or what the tool's lumen passes of it …
    int contrast_tool;           // … through this tool; -1: none has a lumen
    int node_count;              // N of the tree, 0 without
    int filling_count;           // M of all tools
    float concentration[];       // (N + M) 0 to 1: contrast agent at the tree's nodes, then in the tools' lumens at theirs
} LessonView;

typedef struct Lesson Lesson;

// Before the first step. `tree` may be NULL; it and the simulator must outlive the lesson. NULL where memory lacks.
Lesson *lesson_create(Simulator *simulator, const VesselTree *tree);
void lesson_free(Lesson *lesson);
// These two fit realtime's after_step and publish. Neither allocates.
void lesson_step(void *lesson, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
void lesson_publish(void *lesson, void *view);
size_t lesson_view_bytes(const Lesson *lesson);
const Score *lesson_score(const Lesson *lesson);

#endif

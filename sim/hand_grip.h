// How the hands hold coaxial tools: one is chosen, others are pinned; neighbours may be locked together, any may be let go or exchanged. The operator's, who
// changes it between frames; hands obey it from the next step on.
#ifndef SELDINGER_SIM_HAND_GRIP_H
#define SELDINGER_SIM_HAND_GRIP_H

#include "input/input.h"

#include <stdbool.h>

// A lock is two hands that move as one: letting a tool go opens its locks, and locking takes both tools in hand. So no tool is locked and let go.
typedef struct HandGrip {
    int chosen;              // moved by hands that name no tool
    unsigned locked;         // bit k: tool k moves as tool k - 1 does
    unsigned released;       // bit k: no hand holds tool k (input/input.h)
    int fitted[TOOLS_MOST];  // which of its devices each tool shall be (input/input.h): one that is not at its hub stays as it is, see hand_grip_fit()
} HandGrip;

// The next tool inside the chosen one; of the innermost the next around it; of one tool itself. With the chosen one it is the pair.
int hand_grip_partner(const HandGrip *grip, int tool_count);
// The tool that a hand moves which drives this (HandDrives of input/hand_port.h).
int hand_grip_tool(const HandGrip *grip, int tool_count, int drives);
void hand_grip_choose(HandGrip *grip, int tool_count, int tool);       // nothing where there is no such tool
// Locks the pair, or opens its lock. Nothing where there is one tool.
void hand_grip_lock(HandGrip *grip, int tool_count);
bool hand_grip_pair_is_locked(const HandGrip *grip, int tool_count);
// Lets the chosen tool go, or takes it again.
void hand_grip_release(HandGrip *grip);
// Asks for device `which` of tool `tool` (0: the scene's, 1, 2, … those under its `exchange:`). The tool is taken in hand for that, alone: its locks open.
// Nothing where there is no such tool. An exchange that is refused (Pose.refused_exchanges grows, Pose.refusal says why) is tried again only after something
// else was asked for: ask for what is in (PoseTool.fitted), then again.
void hand_grip_fit(HandGrip *grip, int tool_count, int tool, int which);
// What devices' buttons ask for (HAND_ bits) that were not held `before`, which becomes what is held now.
void hand_grip_obey(HandGrip *grip, int tool_count, unsigned buttons, unsigned *before);
// The outermost of the tools that move as `tool` does.
int hand_grip_lead(const HandGrip *grip, int tool);
// Of `value` [tool_count] the sum over the tools that move as `tool` does: what a hand on it feels.
double hand_grip_sum(const HandGrip *grip, int tool_count, int tool, const double *value);

#endif

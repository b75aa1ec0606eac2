// How coaxial tools are held: one is selected, the others are pinned; neighbours may be locked together, any may be released or exchanged. The
// operator changes it between frames; it takes effect with the next step.
#ifndef SELDINGER_SIM_HAND_GRIP_H
#define SELDINGER_SIM_HAND_GRIP_H

#include "input/input.h"

#include <stdbool.h>

// A lock moves two tools as one: releasing a tool opens its locks, and locking takes hold of both tools. So no tool is both locked and released.
typedef struct HandGrip {
    int chosen;              // moved by inputs that select no tool
    unsigned locked;         // bit k: tool k moves as tool k - 1 does
    unsigned released;       // bit k: no hand holds tool k (input/command.h)
    int fitted[TOOLS_MOST];  // device requested for each tool (input/command.h); a tool not at its hub keeps its device, see hand_grip_fit()
} HandGrip;

// The tool that a hand with this HandDrives setting moves (input/hand_port.h).
int hand_grip_tool(const HandGrip *grip, int tool_count, int drives);
void hand_grip_choose(HandGrip *grip, int tool_count, int tool);       // no effect if there is no such tool
// Locks the pair, or opens its lock. No effect with one tool.
void hand_grip_lock(HandGrip *grip, int tool_count);
bool hand_grip_pair_is_locked(const HandGrip *grip, int tool_count);
// Releases the chosen tool, or takes hold of it again.
void hand_grip_release(HandGrip *grip);
// Requests device `which` of tool `tool` (0: the scene's, 1, 2, … those under its `exchange:`). A tool is exchanged on its own, so its locks open. No effect if
// there is no such tool. An exchange that is refused (Pose.refused_exchanges grows, Pose.refusal gives the reason) is retried only after another request:
// request the inserted device (PoseTool.fitted), then the new one again.
void hand_grip_fit(HandGrip *grip, int tool_count, int tool, int which);
// Obeys newly pressed buttons (HAND_ bits): those not in `before`, which is updated to the buttons held now.
void hand_grip_obey(HandGrip *grip, int tool_count, unsigned buttons, unsigned *before);
// The outermost of the tools locked together with `tool`.
int hand_grip_lead(const HandGrip *grip, int tool);
// The sum of `value` [tool_count] over the tools locked together with `tool`: the reaction felt at it.
double hand_grip_sum(const HandGrip *grip, int tool_count, int tool, const double *value);

#endif

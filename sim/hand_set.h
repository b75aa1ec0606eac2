// The hands that hold the tools: their rates and ways become one command for each tool and step, and the reaction of the tool that a hand moves goes back
// to it. Rates of hands on one tool add up. Ways (an encoder's counts) are totals: what is not yet taken is fed at no more than the fastest rate, the rest
// in the steps after, so that a hand never gets ahead of the tool by what one report brings, and no count is lost.
//
// Tools that are locked together move by the sum of what their hands ask for, and each of these hands feels the sum of their reactions. What a hand does
// while its tool is let go or stopped, and what it has still to feed when it takes another tool, is forgotten.
#ifndef SELDINGER_SIM_HAND_SET_H
#define SELDINGER_SIM_HAND_SET_H

#include "input/hand_port.h"
#include "sim/hand_grip.h"
#include "solver/step.h"

enum { HANDS_SAMPLED = 64 };

typedef struct HandSet {
    int tool_count;
    HandGrip grip;                   // hand_set_grip changes it
    int count;
    HandPort *port[HANDS_SAMPLED];   // (count) borrowed; each written by one hand, see input/hand_port.h
    double taken_mm[HANDS_SAMPLED], taken_deg[HANDS_SAMPLED];   // of each port's ways; the simulation thread's
    double fastest_mm_s, fastest_deg_s;                   // what a tool is moved by at most, default 200 and 1440
} HandSet;

void hand_set_init(HandSet *set, int tool_count);  // the first tool chosen, none locked or let go
bool hand_set_add(HandSet *set, HandPort *port);   // false where there is no room. What it has gone so far does not count
void hand_set_grip(HandSet *set, const HandGrip *grip);
// The commands of the next step of dt [ms]; a hand that holds HAND_STOP stops all tools.
ToolCommands hand_set_command(HandSet *set, double dt);
unsigned hand_set_buttons(const HandSet *set);
// After a step: force, torque and the step's number.
void hand_set_answer(HandSet *set, const StepReport *report, int64_t step);

#endif

// The hands that hold the tool: their rates and ways become one command a step, and the sheath's reaction goes back to each.
// Rates add up. Ways (an encoder's counts) are totals: what is not yet taken is fed at no more than the fastest rate, the rest in the steps after,
// so that a hand never gets ahead of the tool by what one report brings, and no count is lost.
#ifndef SELDINGER_SIM_HAND_SET_H
#define SELDINGER_SIM_HAND_SET_H

#include "input/hand_port.h"
#include "input/input.h"
#include "solver/step.h"

enum { HANDS_SAMPLED = 16 };

typedef struct HandSet {
    int count;
    HandPort *port[HANDS_SAMPLED];   // (count) borrowed; each written by one hand, see input/hand_port.h
    double taken_mm[HANDS_SAMPLED], taken_deg[HANDS_SAMPLED];   // of each port's ways; the simulation thread's
    double fastest_mm_s, fastest_deg_s;                   // what the tool is moved by at most, default 200 and 1440
} HandSet;

void hand_set_init(HandSet *set);
bool hand_set_add(HandSet *set, HandPort *port);   // false where there is no room. What it has gone so far does not count
// The command of the next step of dt [ms]; a hand that holds HAND_STOP stops the tool, and what it would have moved meanwhile is forgotten.
Command hand_set_command(HandSet *set, double dt);
unsigned hand_set_buttons(const HandSet *set);
// After a step: force, torque and the step's number.
void hand_set_answer(HandSet *set, const StepReport *report, int64_t step);

#endif

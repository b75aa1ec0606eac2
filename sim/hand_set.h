// The input devices ("hands") that hold the tools: their rates and displacements become one command per tool and step, and the tool's reaction is returned to
// them. Rates of several hands on one tool add up. Displacements (an encoder's counts) are totals: the outstanding part is fed at no more than the fastest
// rate, the rest in later steps, so a burst of counts causes no jump of the tool and no count is lost.
//
// Tools locked together move by the sum of their hands' commands, and each hand feels the sum of their reactions. Motion made while a tool is
// released or stopped is discarded, as is the outstanding displacement when a hand switches tools.
#ifndef SELDINGER_SIM_HAND_SET_H
#define SELDINGER_SIM_HAND_SET_H

#include "input/input.h"
#include "sim/hand_grip.h"
#include "solver/solver.h"

enum { HANDS_SAMPLED = 64 };

typedef struct HandSet {
    int tool_count;
    HandGrip grip;                   // hand_set_grip changes it
    int count;
    HandPort *port[HANDS_SAMPLED];   // (count) borrowed; each written by one hand, see input/hand_port.h
    double taken_mm[HANDS_SAMPLED], taken_deg[HANDS_SAMPLED];   // displacement of each port already fed; owned by the simulation thread
    bool is_let_go;                  // see hand_set_let_go
    double fastest_mm_s, fastest_deg_s;                   // fastest rate of a tool, default 200 and 1440
} HandSet;

void hand_set_init(HandSet *set, int tool_count);  // the first tool selected, none locked or released
bool hand_set_add(HandSet *set, HandPort *port);   // false if there is no space. Its displacement so far is ignored
void hand_set_grip(HandSet *set, const HandGrip *grip);
// Until it is set to false, all tools are stopped as by HAND_STOP.
void hand_set_let_go(HandSet *set, bool is_let_go);
// The commands of the next step of dt [ms]; HAND_STOP on any hand stops all tools.
ToolCommands hand_set_command(HandSet *set, double dt);
unsigned hand_set_buttons(const HandSet *set);
bool hand_set_has_device(const HandSet *set);      // whether a device is connected, not only keys: it may give forces
// To be called after a step: returns force, torque and the step's number to the hands.
void hand_set_answer(HandSet *set, const StepReport *report, int64_t step);

#endif

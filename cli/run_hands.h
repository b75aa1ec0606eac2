// `run --device`: devices drive a headless run, what they have to say goes to standard error. A device whose map names no tool
// moves the chosen one: the first, until a button of a device chooses another.
#ifndef SELDINGER_CLI_RUN_HANDS_H
#define SELDINGER_CLI_RUN_HANDS_H

#include "sim/sim.h"

typedef struct RunHands RunHands;

enum { RUN_MAPS = 8 };

// `map`: files of device maps; "auto" stands for the built-in ones. Waits up to 5 s for the first device. NULL with faults.
RunHands *run_hands_open(int map_count, const char *const *map, const Scene *scene, Faults *faults);
ToolCommands run_hands_command(void *hands);          // of the next step, as DriveOptions.hand wants it: `context` is the RunHands
void run_hands_answer(RunHands *hands, const StepReport *report, int64_t step);
void run_hands_close(RunHands *hands);           // NULL is fine

#endif

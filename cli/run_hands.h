// `run --device`: devices drive a headless run; their messages go to standard error. A device whose map has no key `tool` moves the selected tool: the first
// one, until a
// button of a device selects another.
#ifndef SELDINGER_CLI_RUN_HANDS_H
#define SELDINGER_CLI_RUN_HANDS_H

#include "sim/sim.h"

typedef struct RunHands RunHands;

enum { RUN_MAPS = 8 };

// `map`: files of device maps; "auto" stands for the built-in maps. Waits up to 5 s for the first device. Returns NULL with faults.
RunHands *run_hands_open(int map_count, const char *const *map, const Scene *scene, Faults *faults);
ToolCommands run_hands_command(void *hands);          // the commands of the next step, for DriveOptions.hand: `context` is the RunHands
void run_hands_answer(RunHands *hands, const StepReport *report, int64_t step);
void run_hands_close(RunHands *hands);           // NULL is allowed

#endif

// The figures of a run over time, for `run --chart`: forces at the hand and the wall, contacts, depth, cost.
#ifndef SELDINGER_RENDER_RUN_CHART_H
#define SELDINGER_RENDER_RUN_CHART_H

#include "sim/sim.h"

typedef struct RunChart RunChart;

// NULL: out of memory. `expected_steps`: at most as many are added, more are left out.
RunChart *run_chart_create(int64_t expected_steps);
void run_chart_free(RunChart *chart);
// After a step. Allocates nothing. Of a long run, least and greatest of several steps are kept, so that no spike is lost.
void run_chart_step(RunChart *chart, const Simulator *simulator);
// False with a fault.
bool run_chart_draw(const RunChart *chart, const Simulator *simulator, const char *path, Faults *faults);

#endif

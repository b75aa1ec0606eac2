// Golden tool paths: the result of a run of a scene as a file with which later runs are compared (sim/compare.h).
#ifndef SELDINGER_SIM_GOLDEN_H
#define SELDINGER_SIM_GOLDEN_H

#include "sim/compare.h"
#include "sim/golden_figures.h"
#include "sim/open_vessel.h"

// The tool path of a run of `duration_s`; NULL with faults. *diverged is set if it ended early.
ToolPath *golden_run(const Scene *scene, const OpenVessel *open, double duration_s, bool *diverged, Faults *faults);
// The same, and its figures; NULL: none.
ToolPath *golden_run_measured(const Scene *scene, const OpenVessel *open, double duration_s, GoldenFigures *figures, bool *diverged, Faults *faults);
ToolPath *golden_load(const char *path, Faults *faults);         // NULL with faults
void golden_save(const char *path, const ToolPath *run, Faults *faults);

#endif

// The output files of `run`: the recording, figures, the last state, pictures.
#ifndef SELDINGER_CLI_RUN_FILES_H
#define SELDINGER_CLI_RUN_FILES_H

#include "cli/output_plan.h"
#include "render/render.h"
#include "sim/sim.h"

typedef struct RunFiles {    // NULL: not requested
    const char *record, *summary, *final, *score, *picture, *chart;
} RunFiles;

void run_files_plan(const RunFiles *files, OutputPlan *plan);
// Writes the files after the run. Returns false with faults if one could not be written. `contact`: the requested contact kind, for the title of the picture;
// NULL: the scene's.
bool run_files_write(const RunFiles *files, HeadlessRun *run, OpenVessel *open, const RunChart *chart, const char *contact, Faults *faults);

#endif

// The folder of a repeated run: its scene and script, which `seldinger run` takes.
#ifndef SELDINGER_STUDY_RUN_FOLDER_H
#define SELDINGER_STUDY_RUN_FOLDER_H

#include "sim/sim.h"
#include "study/spec.h"

// Writes scene.yaml and, if it has one, script.csv. Files that the scene names get absolute paths. False with faults.
bool run_folder_write(const char *folder, const Scene *scene, const Study *study, int64_t run, Faults *faults);

#endif

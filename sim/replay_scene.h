// Turns a recording into a regression scene: a folder with the scene's text, the recorded commands as its script, and the golden tool path.
#ifndef SELDINGER_SIM_REPLAY_SCENE_H
#define SELDINGER_SIM_REPLAY_SCENE_H

#include "sim/compare.h"
#include "sim/replay.h"

// Writes FOLDER/scene.yaml and FOLDER/hand.csv; the folder is created if it does not exist. Paths in the scene are made relative to the folder. Returns false
// with faults.
bool replay_write_scene(const RecordedRun *run, const Scene *scene, const char *folder, Faults *faults);
// Writes FOLDER/scene.golden.csv. Returns false with faults.
bool replay_write_golden(const ToolPath *path, const char *folder, Faults *faults);

#endif

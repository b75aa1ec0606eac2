// Baselines: a folder FOLDER/VERSION with the golden runs of a version, outside the scenes. The golden path of a scene has the scene's path below the current
// folder, so that the scenes of several folders do not meet: FOLDER/VERSION/scenes/phantom/scene.golden.csv. Of a scene elsewhere it is the absolute path.
#ifndef SELDINGER_SIM_BASELINE_H
#define SELDINGER_SIM_BASELINE_H

#include "base/base.h"
#include "sim/scene_list.h"

// Where a scene or a folder is in a baseline; the caller frees it.
char *baseline_place(const char *baseline, const char *path);
// The golden path of a scene in a baseline; the caller frees it.
char *baseline_path_of(const char *baseline, const char *scene);
// Creates FOLDER/VERSION and writes its path (PATH_MAX characters); a fault if it has files already or the version is no file name.
bool baseline_begin(const char *folder, const char *version, char *baseline, Faults *faults);
// A fault, with the versions that lie beside it, if there is no such baseline.
bool baseline_check(const char *baseline, Faults *faults);
// Whether the file's text has the key `seldinger` of scenes at the start of a line.
bool baseline_is_scene(const char *path);
// All golden paths in the baseline, by name.
void baseline_list(const char *baseline, SceneList *golden);

#endif

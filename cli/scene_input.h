// What the user names to steer in: a scene, the folder of a case, or a tree or model, of which a case is made and kept.
#ifndef SELDINGER_CLI_SCENE_INPUT_H
#define SELDINGER_CLI_SCENE_INPUT_H

#include "sim/sim.h"

// Loads the scene. Of a tree or a model it is that of a case in the user's cache (base/folders.h), which is made once for each content of the file. Any other file is a fault that names the command for it.
Scene *cli_scene_input(const char *path, int threads, bool quiet, Faults *faults);

#endif

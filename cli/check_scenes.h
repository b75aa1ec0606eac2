// The scenes of a call of `seldinger check`.
#ifndef SELDINGER_CLI_CHECK_SCENES_H
#define SELDINGER_CLI_CHECK_SCENES_H

#include "cli/cli.h"

typedef struct CheckScenes {
    bool update, stores;
    const char *baseline;    // compare with it; NULL: with golden runs beside the scenes
    SceneList golden, verify;
} CheckScenes;

// Finds the scenes below each path. Those that cannot be checked become cases of the log: missing, without a golden run, in the baseline but not below the paths
// any more. Returns an exit code.
int check_scenes_gather(CheckScenes *scenes, int path_count, char *const *path, CheckLog *log);
void check_scenes_free(CheckScenes *scenes);

#endif

#include "cli/replay_beside.h"

#include "cli/cli.h"
#include "cli/file_kind.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

// A headless run of the scene's script, recorded in a folder of its own and read back.
static RecordedRun *run_script(const Scene *scene, const OpenVessel *open, Faults *faults)
{
    char folder[] = "/tmp/seldinger-beside-XXXXXX", path[64];
    RecordedRun *run = NULL;
    if (!mkdtemp(folder)) {
        faults_add(faults, "/tmp", 0, 0, "cannot make a folder for the recording of the script");
        return NULL;
    }
    snprintf(path, sizeof path, "%s/hand.h5", folder);
    HeadlessOptions options = {.record = path, .duration_s = -1};
    HeadlessRun headless = {0};
    if (headless_open(&headless, &options, scene, open, faults) && headless_drive(&headless, NULL, NULL, faults))
        run = recorded_run_load(path, faults);
    headless_close(&headless);
    unlink(path);
    rmdir(folder);
    return run;
}

bool replay_beside_open(ReplayBeside *beside, const char *path, const RecordedRun *main, const char *main_path, int threads, bool quiet, Faults *faults)
{
    const bool is_script = file_kind(path) != FILE_RECORDING;
    if (!is_script)
        beside->run = recorded_run_load(path, faults);
    if (is_script || beside->run)
        beside->scene = replay_scene(is_script ? main : beside->run, is_script ? main_path : path, faults);
    bool good =
        beside->scene && (!is_script || scene_use_script(beside->scene, path, faults)) && cli_open_scene(beside->scene, threads, quiet, &beside->open, faults);
    if (good && is_script)
        beside->run = run_script(beside->scene, &beside->open, faults);
    return good && beside->run;
}

void replay_beside_close(ReplayBeside *beside)
{
    open_vessel_close(&beside->open);
    scene_free(beside->scene);
    recorded_run_free(beside->run);
    *beside = (ReplayBeside){0};
}

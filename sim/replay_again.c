#include "sim/replay_again.h"

#include "base/base.h"
#include "sim/replay_scene.h"

#include <stdlib.h>
#include <string.h>

typedef struct Sampling {
    ToolPath *path;          // NULL: not requested
    bool no_memory;
} Sampling;

static bool sample(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    (void)commands;
    (void)xray;
    Sampling *sampling = context;
    sampling->no_memory |= sampling->path && !tool_path_sample(sampling->path, simulator, false);
    return !sampling->no_memory;
}

// Writes scene and golden path to the folder; returns false with faults.
static bool write_scene(const Sampling *sampling, Simulator *simulator, const RecordedRun *run, const Scene *scene, const char *folder, const char *name,
                        Faults *faults)
{
    if (tool_path_sample(sampling->path, simulator, true) && !sampling->no_memory)
        return replay_write_scene(run, scene, folder, faults) && replay_write_golden(sampling->path, folder, faults);
    faults_add(faults, name, 0, 0, "not enough memory for its tool path");
    return false;
}

bool replay_again(const RecordedRun *run, const Scene *scene, const OpenVessel *open, const char *folder, const char *name, ReplayAgain *again, Faults *faults)
{
    Simulator *simulator = simulator_create(scene, open->vessel, faults);
    Sampling sampling = {0};
    *again = (ReplayAgain){0};
    if (!simulator)
        return false;
    if (replay_fits(run, simulator, faults) && folder && !(sampling.path = tool_path_create(simulator, (double)run->step_count * run->step_ms / 1000)))
        faults_add(faults, name, 0, 0, "not enough memory for its tool path");
    bool good = faults->count == 0;
    if (good) {
        again->verdict = replay_verify(simulator, run, -1, folder != NULL, sample, &sampling);
        again->diverged = simulator_totals(simulator)->flags & STEP_DIVERGED;
        again->is_written = sampling.path && write_scene(&sampling, simulator, run, scene, folder, name, faults);
    }
    tool_path_free(sampling.path);
    simulator_destroy(simulator);
    return good;
}

void replay_print_changed_files(FILE *out, const RecordedRun *run)
{
    const char *file = run->files ? run->files : "", *sum = run->sha256 ? run->sha256 : "";
    while (*file && *sum) {
        size_t n = strcspn(file, "\n"), m = strcspn(sum, "\n");
        char path[4096], hex[65] = "";
        snprintf(path, sizeof path, "%.*s", (int)n, file);
        if (!sha256_of_file(path, hex))
            fprintf(out, "%s: cannot be read; the recording was made with it\n", path);
        else if (strlen(hex) != m || strncmp(hex, sum, m) != 0)
            fprintf(out, "%s: is not what the recording was made with; its sha256 was %.*s\n", path, (int)m, sum);
        file += n + (file[n] == '\n');
        sum += m + (sum[m] == '\n');
    }
}

bool replay_is_of(const RecordedRun *run, const Scene *scene, const char *recording, Faults *faults)
{
    if (run->scene_text && !strcmp(run->scene_text, scene->text) && run->step_ms == scene->dt)
        return true;
    faults_add(faults, recording, 0, 0,
               "is a recording of another scene than %s, of an older state of it, or with devices added from the tray; `seldinger replay` can continue any "
               "recording",
               scene->path);
    return false;
}

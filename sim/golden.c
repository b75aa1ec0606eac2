#include "sim/golden.h"

#include "base/base.h"
#include "sim/drive.h"

#include <stdlib.h>

typedef struct Sampling {
    ToolPath *path;
    GoldenFigures *figures;  // NULL: not kept
    bool no_memory;
} Sampling;

// The figures have the times of the path.
static void sample(Sampling *sampling, Simulator *simulator, bool last)
{
    int before = sampling->path->row_count;
    sampling->no_memory |= !tool_path_sample(sampling->path, simulator, last);
    if (sampling->figures && sampling->path->row_count > before)
        golden_figures_sample(sampling->figures, simulator);
}

static bool sample_step(void *context, Simulator *simulator, const ToolCommands *commands)
{
    (void)commands;
    Sampling *sampling = context;
    sample(sampling, simulator, false);
    return !sampling->no_memory;
}

ToolPath *golden_run(const Scene *scene, const OpenVessel *open, double duration_s, bool *diverged, Faults *faults)
{
    return golden_run_measured(scene, open, duration_s, NULL, diverged, faults);
}

ToolPath *golden_run_measured(const Scene *scene, const OpenVessel *open, double duration_s, GoldenFigures *figures, bool *diverged, Faults *faults)
{
    Sampling sampling = {.figures = figures};
    Simulator *simulator = simulator_create(scene, open->vessel, faults);
    if (simulator && (sampling.path = tool_path_create(simulator, duration_s))) {
        DriveOptions drive = drive_default_options();
        drive.script = scene->script;
        drive.duration_s = duration_s;
        drive.after_step = sample_step;
        drive.context = &sampling;
        *diverged = simulator_drive(simulator, &drive).end == DRIVE_DIVERGED;
        sample(&sampling, simulator, true);
        if (figures)
            golden_figures_end(figures, simulator);
    }
    if (simulator && (!sampling.path || sampling.no_memory)) {
        faults_add(faults, scene->path, 0, 0, "not enough memory for its tool path");
        tool_path_free(sampling.path);
        sampling.path = NULL;
    }
    simulator_destroy(simulator);
    return sampling.path;
}

ToolPath *golden_load(const char *path, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    ToolPath *golden = text ? tool_path_parse(text, length, path, faults) : NULL;
    free(text);
    return golden;
}

void golden_save(const char *path, const ToolPath *run, Faults *faults)
{
    size_t length;
    char *text = tool_path_print(run, &length);
    if (text)
        output_write(path, text, length, faults);
    else
        faults_add(faults, path, 0, 0, "out of memory");
    free(text);
}

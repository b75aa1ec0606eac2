#include "cli/run_files.h"

#include "render/render.h"
#include "sim/sim.h"

#include <stdlib.h>
#include <string.h>

void run_files_plan(const RunFiles *files, OutputPlan *plan)
{
    output_plan_write(plan, "--summary", files->summary);
    output_plan_write(plan, "--final", files->final);
    output_plan_write(plan, "--score", files->score);
    output_plan_picture(plan, "--picture", files->picture);
    output_plan_picture(plan, "--chart", files->chart);
    output_plan_write_file(plan, "--record", files->record);
}

static bool write_score(const char *path, const HeadlessRun *run, Faults *faults)
{
    ScoreFigures figures = score_figures(session_tracker_score(run->tracker));
    char *text = score_json(&figures, simulator_scene(run->simulator));
    bool good = text && output_write(path, text, strlen(text), faults);
    free(text);
    return good;
}

bool run_files_write(const RunFiles *files, HeadlessRun *run, OpenVessel *open, const RunChart *chart, const char *contact, Faults *faults)
{
    bool good = !files->summary || run_write_summary(files->summary, run->simulator, &run->report, run->node, faults);
    good = (!files->final || run_write_final(files->final, run->simulator, run->node, faults)) && good;
    good = (!files->score || write_score(files->score, run, faults)) && good;
    const Scene *scene = simulator_scene(run->simulator);
    char title[300];
    snprintf(title, sizeof title, "%.200s%s%s", scene->path, contact ? ", contact: " : "", contact ? contact : "");
    good = (!files->picture || picture_moments(files->picture, title, scene, open, &run->moments, faults)) && good;
    return (!files->chart || run_chart_draw(chart, run->simulator, files->chart, faults)) && good;
}

#include "cli/run_files.h"

#include "sim/sim.h"
#ifdef SELDINGER_RENDER
#include "render/render.h"
#endif

#include <stdlib.h>
#include <string.h>

void run_files_plan(const RunFiles *files, OutputPlan *plan)
{
    output_plan_write(plan, "--summary", files->summary);
    output_plan_write(plan, "--final", files->final);
    output_plan_write(plan, "--score", files->score);
    output_plan_write_file(plan, "--picture", files->picture);
    output_plan_write_file(plan, "--chart", files->chart);
    output_plan_write_file(plan, "--record", files->record);
#ifndef SELDINGER_RENDER
    if (files->picture || files->chart)
        faults_add(plan->faults, files->picture ? "--picture" : "--chart", 0, 0, "this build has no pictures; build with -DSELDINGER_RENDER=ON");
#endif
}

static bool write_score(const char *path, const HeadlessRun *run, Faults *faults)
{
    ScoreFigures figures = score_figures(session_tracker_score(run->tracker));
    char *text = score_json(&figures, simulator_scene(run->simulator));
    bool good = text && output_write(path, text, strlen(text), faults);
    free(text);
    return good;
}

static bool write_chart(const char *path, const RunChart *chart, const Simulator *simulator, Faults *faults)
{
    char message[512];
    bool good = run_chart_draw(chart, simulator, path, message, sizeof message);
    if (!good)
        faults_add(faults, path, 0, 0, "no chart: %s", message);
    return good;
}

bool run_files_write(const RunFiles *files, HeadlessRun *run, OpenVessel *open, const RunChart *chart, const char *contact, Faults *faults)
{
    bool good = !files->summary || run_write_summary(files->summary, run->simulator, &run->report, run->node, faults);
    good = (!files->final || run_write_final(files->final, run->simulator, run->node, faults)) && good;
    good = (!files->score || write_score(files->score, run, faults)) && good;
#ifdef SELDINGER_RENDER
    const Scene *scene = simulator_scene(run->simulator);
    char title[300];
    snprintf(title, sizeof title, "%.200s%s%s", scene->path, contact ? ", contact: " : "", contact ? contact : "");
    good = (!files->picture || picture_moments(files->picture, title, scene, open, &run->moments, faults)) && good;
#else
    (void)open, (void)contact;
#endif
    return (!files->chart || write_chart(files->chart, chart, run->simulator, faults)) && good;
}

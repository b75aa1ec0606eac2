#include "sim/replay.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

Scene *replay_scene(const RecordedRun *run, const char *path, Faults *faults)
{
    if (!run->scene_text || !run->scene_path) {
        faults_add(faults, path, 0, 0, "lacks its scene's text or path; a recording that `seldinger run --record` or `nav` wrote holds both");
        return NULL;
    }
    Scene *scene = scene_parse(run->scene_text, strlen(run->scene_text), run->scene_path, faults);
    if (scene && run->contact < CONTACT_COUNT)
        scene->contact = run->contact;
    if (scene) {
        script_free(scene->script);
        scene->script = NULL;
    }
    return scene;
}

ReplayVerdict replay_verify(Simulator *simulator, const RecordedRun *run, int64_t steps, bool go_on,
                            bool (*each)(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray), void *context)
{
    ReplayVerdict verdict = {.first_different = -1};
    bool was_watched = recorded_run_was_watched(run);
    int64_t count = steps < 0 || steps > run->step_count ? run->step_count : steps;
    for (int64_t i = 0; i < count; i++) {
        ToolCommands commands = recorded_run_commands(run, i);
        simulator_step_tools(simulator, &commands);
        verdict.steps = i + 1;
        if (verdict.first_different < 0) {
            verdict.recorded = run->state_hash[i];
            verdict.simulated = simulator_hash(simulator);
            if (verdict.recorded != verdict.simulated)
                verdict.first_different = i;
        }
        if (each && !each(context, simulator, &commands, was_watched ? &run->xray[i] : NULL))
            break;
        if (verdict.first_different >= 0 && !go_on)
            break;
    }
    return verdict;
}

char *replay_script(const RecordedRun *run, size_t *length)
{
    char *text = NULL;
    FILE *stream = open_memstream(&text, length);
    if (!stream)
        return NULL;
    fprintf(stream, "t_s,push_mm_s,twist_deg_s\n");
    for (int64_t i = 0; i < run->step_count; i++) {
        Command now = recorded_run_commands(run, i).tool[0], before = i ? recorded_run_commands(run, i - 1).tool[0] : (Command){0, 0};
        if (i == 0 || memcmp(&now, &before, sizeof now) != 0)
            fprintf(stream, "%.17g,%.17g,%.17g\n", (double)i * run->step_ms / 1000, now.push_mm_s, now.twist_deg_s);
    }
    fprintf(stream, "%.17g,0,0\n", (double)run->step_count * run->step_ms / 1000);
    if (fclose(stream) == 0)
        return text;
    free(text);
    return NULL;
}

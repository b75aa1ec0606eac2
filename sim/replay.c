#include "sim/replay.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

Scene *replay_scene(const RecordedRun *run, const char *path, Faults *faults)
{
    if (!run->scene_text || !run->scene_path) {
        faults_add(faults, path, 0, 0, "has no scene text or no scene path; expected a recording made by `seldinger run --record` or `nav`");
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
        simulator_step(simulator, &commands);
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

bool replay_fits(const RecordedRun *run, Simulator *simulator, Faults *faults)
{
    const char *path = simulator_scene(simulator)->path;
    const Stepper *stepper = simulator_stepper(simulator);
    int tools = stepper_tool_count(stepper), nodes = stepper_node_capacity(stepper);
    if (tools != run->tool_count) {
        faults_add(faults, path, 0, 0, "gives %d tools, the recording holds %d", tools, run->tool_count);
        return false;
    }
    bool fits = run->frame_count == 0 || run->node_count == nodes;
    for (int k = 0; run->frame_count > 0 && tools > 1 && k < tools; k++)
        fits &= run->tool[k].node_count == (run->exchange ? scene_most_nodes(simulator_scene(simulator), k) : stepper_tool_nodes(stepper, k, NULL));
    if (!fits)
        faults_add(faults, path, 0, 0, "gives a tool of %d nodes, the recording holds one of %d", nodes, run->node_count);
    return fits;
}

// Columns that a tool needs in the script in addition to its motion.
typedef struct ScriptUse {
    bool releases[TOOLS_MOST], injects[TOOLS_MOST], exchanges[TOOLS_MOST];
} ScriptUse;

// A single tool has no name, but a script can inject only through a named tool.
static ScriptUse find_use(const RecordedRun *run)
{
    ScriptUse use = {0};
    for (int64_t i = 0; i < run->step_count; i++) {
        ToolCommands commands = recorded_run_commands(run, i);
        for (int k = 0; k < run->tool_count; k++) {
            use.releases[k] |= commands.released >> k & 1;
            use.exchanges[k] |= commands.fitted[k] != 0;
            use.injects[k] |= run->tool_count > 1 && commands.contrast_ml_s > 0 && commands.contrast_tool == k + 1;
        }
    }
    return use;
}

static void print_heads(FILE *stream, const RecordedRun *run, const ScriptUse *use)
{
    fputs("t_s", stream);
    for (int k = 0; k < run->tool_count; k++) {
        const char *name = run->tool_count > 1 ? run->tool[k].name : "", *dot = *name ? "." : "";
        fprintf(stream, ",%s%spush_mm_s,%s%stwist_deg_s", name, dot, name, dot);
        if (use->releases[k])
            fprintf(stream, ",%s%sreleased", name, dot);
        if (use->injects[k])
            fprintf(stream, ",%s%scontrast_ml_s", name, dot);
        if (use->exchanges[k])
            fprintf(stream, ",%s%sexchange", name, dot);
    }
    fputc('\n', stream);
}

static void print_row(FILE *stream, const RecordedRun *run, double t_s, const ToolCommands *commands, const ScriptUse *use)
{
    fprintf(stream, "%.17g", t_s);
    for (int k = 0; k < run->tool_count; k++) {
        fprintf(stream, ",%.17g,%.17g", commands->tool[k].push_mm_s, commands->tool[k].twist_deg_s);
        if (use->releases[k])
            fprintf(stream, ",%u", commands->released >> k & 1);
        if (use->injects[k])
            fprintf(stream, ",%.9g", commands->contrast_tool == k + 1 ? commands->contrast_ml_s : 0);
        if (use->exchanges[k])
            fprintf(stream, ",%d", commands->fitted[k]);
    }
    fputc('\n', stream);
}

static bool is_same(const ToolCommands *a, const ToolCommands *b)
{
    return memcmp(a->tool, b->tool, sizeof a->tool) == 0 && a->released == b->released && memcmp(a->fitted, b->fitted, sizeof a->fitted) == 0 &&
           !(a->contrast_ml_s < b->contrast_ml_s) && !(a->contrast_ml_s > b->contrast_ml_s) && a->contrast_tool == b->contrast_tool;
}

char *replay_script(const RecordedRun *run, size_t *length)
{
    char *text = NULL;
    FILE *stream = open_memstream(&text, length);
    ToolCommands before = {0};
    if (!stream)
        return NULL;
    const ScriptUse use = find_use(run);
    print_heads(stream, run, &use);
    for (int64_t i = 0; i < run->step_count; i++) {
        ToolCommands now = recorded_run_commands(run, i);
        if (i == 0 || !is_same(&now, &before))
            print_row(stream, run, (double)i * run->step_ms / 1000, &now, &use);
        before = now;
    }
    ToolCommands end = {0};
    memcpy(end.fitted, before.fitted, sizeof end.fitted);
    print_row(stream, run, (double)run->step_count * run->step_ms / 1000, &end, &use);
    if (fclose(stream) == 0)
        return text;
    free(text);
    return NULL;
}

#include "sim/describe_run.h"

#include "sim/recording.h"

#include <inttypes.h>
#include <stdio.h>

static void add_vector(cJSON *object, const char *name, Vec3 v) { cJSON_AddItemToObject(object, name, cJSON_CreateDoubleArray((double[]){v.x, v.y, v.z}, 3)); }

// Adds when which device replaced a tool.
static void add_recorded_exchanges(cJSON *tool, const RecordedRun *run, int index)
{
    cJSON *list = cJSON_AddArrayToObject(tool, "exchanges");
    int before = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        int fitted = recorded_run_fitted(run, index, i);
        if (fitted != before) {
            cJSON *exchange = cJSON_CreateObject();
            cJSON_AddNumberToObject(exchange, "time_s", run->time_s[i] - run->step_ms / 1000);
            cJSON_AddNumberToObject(exchange, "device", fitted);
            cJSON_AddItemToArray(list, exchange);
        }
        before = fitted;
    }
}

static void add_recorded_tools(cJSON *object, const RecordedRun *run)
{
    cJSON *list = cJSON_AddArrayToObject(object, "tools");
    for (int k = 0; k < run->tool_count; k++) {
        const RecordedTool *own = &run->tool[k];
        cJSON *tool = cJSON_CreateObject();
        cJSON_AddStringToObject(tool, "name", own->name);
        cJSON_AddStringToObject(tool, "kind", own->kind);
        RecordedToolFrame at = {.node_count = own->device_nodes[0], .s = own->s};
        if (run->frame_count > 0)
            at = recorded_run_tool_frame(run, k, run->frame_count - 1);
        cJSON_AddNumberToObject(tool, "length_mm", at.s[at.node_count - 1]);
        if (run->step_count > 0)
            cJSON_AddNumberToObject(tool, "inserted_mm", own->inserted[run->step_count - 1]);
        if (run->frame_count > 0)
            add_vector(tool, "tip_mm", at.position[at.node_count - 1]);
        if (run->exchange)
            add_recorded_exchanges(tool, run, k);
        cJSON_AddItemToArray(list, tool);
    }
}

bool describe_recording(cJSON *object, const char *path, Faults *faults)
{
    RecordedRun *run = recorded_run_load(path, faults);
    char hash[17] = "";
    if (!run)
        return false;
    cJSON_AddStringToObject(object, "what", "recording");
    cJSON_AddNumberToObject(object, "steps", (double)run->step_count);
    cJSON_AddNumberToObject(object, "frames", (double)run->frame_count);
    cJSON_AddNumberToObject(object, "nodes", run->node_count);
    cJSON_AddNumberToObject(object, "simulated_s", run->step_count > 0 ? run->time_s[run->step_count - 1] : 0);
    RecordedFrame last = recorded_run_frame(run, run->frame_count > 0 ? run->frame_count - 1 : 0);
    if (run->frame_count > 0)
        add_vector(object, "tip_mm", last.position[last.node_count - 1]);
    if (run->tool_count > 1)
        add_recorded_tools(object, run);
    if (run->step_count > 0) {
        snprintf(hash, sizeof hash, "%016" PRIx64, run->state_hash[run->step_count - 1]);
        cJSON_AddStringToObject(object, "state_hash", hash);
    }
    recorded_run_free(run);
    return true;
}

static void add_tools(cJSON *object, const Scene *scene)
{
    cJSON *list = cJSON_AddArrayToObject(object, "tools");
    for (int k = 0; k < scene->tool_count; k++) {
        WireOptions wire = scene_tool_wire(scene, k);
        cJSON *tool = cJSON_CreateObject();
        cJSON_AddStringToObject(tool, "name", scene->tool[k].name);
        cJSON_AddStringToObject(tool, "kind", tool_kind_name[scene->tool[k].kind]);
        cJSON_AddNumberToObject(tool, "length_mm", wire_length(&wire));
        cJSON_AddNumberToObject(tool, "inserted_mm", wire.inserted);
        cJSON *spares = scene_device_count(scene, k) > 1 ? cJSON_AddArrayToObject(tool, "exchange") : NULL;
        for (int i = 1; spares && i < scene_device_count(scene, k); i++) {
            wire = scene_device_wire(scene, k, i);
            cJSON *spare = cJSON_CreateObject();
            cJSON_AddNumberToObject(spare, "length_mm", wire_length(&wire));
            cJSON_AddItemToArray(spares, spare);
        }
        cJSON_AddItemToArray(list, tool);
    }
}

bool describe_scene(cJSON *object, const char *path, Faults *faults)
{
    static const char *const sources[] = {"model", "shape", "tube", "plane", "mesh", "none"};
    Scene *scene = scene_load(path, faults);
    if (!scene)
        return false;
    double length = wire_length(&scene->wire);
    cJSON_AddStringToObject(object, "what", "scene");
    cJSON_AddStringToObject(object, "vessel", sources[scene->source]);
    if (scene->model_path)
        cJSON_AddStringToObject(object, "model", scene->model_path);
    if (scene->mesh_path)
        cJSON_AddStringToObject(object, "mesh", scene->mesh_path);
    cJSON_AddStringToObject(object, "contact", contact_name[scene->contact]);
    if (scene->source == SOURCE_SHAPE)
        cJSON_AddStringToObject(object, "shape", scene->shape_name);
    cJSON_AddNumberToObject(object, "friction", scene->friction);
    if (scene->tool_count > 1)
        add_tools(object, scene);
    cJSON_AddNumberToObject(object, "elements", scene->wire.elements);
    cJSON_AddNumberToObject(object, "sections", scene->wire.section_count);
    cJSON_AddNumberToObject(object, "length_mm", length);
    cJSON_AddNumberToObject(object, "step_ms", scene->dt);
    cJSON_AddBoolToObject(object, "sheath", scene->wire.has_sheath);
    cJSON_AddNumberToObject(object, "script_s", scene->script ? script_duration_s(scene->script) : 0);
    cJSON_AddNumberToObject(object, "targets", scene->target_count);
    scene_free(scene);
    return true;
}

// Adds the sums of a script's motions of one tool.
static void add_hand(cJSON *object, const Script *script, int tool)
{
    double push = 0, twist = 0, released = 0;
    int exchanges = 0, before = 0;
    for (int i = 0; i + 1 < script->count; i++) {
        double seconds = script->row[i + 1].t_s - script->row[i].t_s;
        const Command *command = script_row_command(&script->row[i], tool);
        push += command->push_mm_s * seconds;
        twist += command->twist_deg_s * seconds;
        released += script->row[i].released >> tool & 1 ? seconds : 0;
        exchanges += script->row[i].fitted[tool] != before;
        before = script->row[i].fitted[tool];
    }
    cJSON_AddNumberToObject(object, "push_mm", push);
    cJSON_AddNumberToObject(object, "twist_deg", twist);
    if (released > 0)
        cJSON_AddNumberToObject(object, "released_s", released);
    if (exchanges > 0)
        cJSON_AddNumberToObject(object, "exchanges", exchanges);
}

bool describe_script(cJSON *object, const char *path, Faults *faults)
{
    ScriptTools tools;
    Script *script = script_load_any(path, &tools, faults);
    if (!script)
        return false;
    bool named = *tools.names.name[0];
    cJSON_AddStringToObject(object, "what", "script");
    cJSON_AddNumberToObject(object, "rows", script->count);
    cJSON_AddNumberToObject(object, "duration_s", script_duration_s(script));
    cJSON *list = named ? cJSON_AddArrayToObject(object, "tools") : NULL;
    for (int k = 0; k < tools.names.count; k++) {
        cJSON *tool = named ? cJSON_CreateObject() : object;
        if (named) {
            cJSON_AddStringToObject(tool, "name", tools.names.name[k]);
            cJSON_AddItemToArray(list, tool);
        }
        add_hand(tool, script, k);
    }
    script_free(script);
    return true;
}

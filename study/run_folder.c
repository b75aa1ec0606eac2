#define _XOPEN_SOURCE 700   // realpath
#include "study/run_folder.h"

#include "study/points.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Replaces the value at `key`, if the scene has it. Takes `text` and frees it.
static char *with_path(char *text, const char *key, const char *path)
{
    char whole[PATH_MAX];
    char *out = text && path ? yaml_edit(text, key, realpath(path, whole) ? whole : path, false) : NULL;
    if (!out)
        return text;
    free(text);
    return out;
}

static char *with_absolute_paths(const Scene *scene)
{
    char key[60], *text = HEAP_TEXT(scene->text);
    text = with_path(text, "vessel.model", scene->model_path);
    text = with_path(text, "vessel.mesh", scene->mesh_path);
    text = with_path(text, "vessel.tube.points", scene->tube_points_path);
    text = with_path(text, "fluoroscopy.volume", scene->anatomy_path);
    text = with_path(text, "wire.device", scene->tool[0].device_path);
    for (int k = 0; k < scene->tool_count; k++) {
        snprintf(key, sizeof key, "tools.%d.device", k);
        text = with_path(text, key, scene->tool[k].device_path);
    }
    for (int i = 0, of_tool = 0; i < scene->exchange_count; i++) {
        of_tool = i > 0 && scene->exchange[i - 1].tool == scene->exchange[i].tool ? of_tool + 1 : 0;
        snprintf(key, sizeof key, "tools.%d.exchange.%d.device", scene->exchange[i].tool, of_tool);
        text = with_path(text, key, scene->exchange[i].device.device_path);
    }
    return text;
}

static char *path_in(const char *folder, const char *name)
{
    char *path = text_file_in(folder, name);
    return path ? path : HEAP_TEXT(name);
}

// Random hands, or a copy of the scene's file; a script within the scene stays there.
static char *script_of(const Scene *scene, const Study *study, int64_t run, Faults *faults)
{
    ToolNames tools = scene_tool_names(scene);
    size_t length;
    if (study->hands.wanted)
        return study_hands(&study->hands, study_hand_seed(study, run), &tools);
    return scene->script_path ? text_file_read(scene->script_path, &length, faults) : NULL;
}

bool run_folder_write(const char *folder, const Scene *scene, const Study *study, int64_t run, Faults *faults)
{
    int before = faults->count;
    char *text = with_absolute_paths(scene), *script = script_of(scene, study, run, faults);
    char *scene_path = path_in(folder, "scene.yaml"), *script_path = path_in(folder, "script.csv");
    char *linked = script ? yaml_edit(text, "script", "script.csv", true) : HEAP_TEXT(text);
    if (!linked)
        faults_add(faults, scene_path, 0, 0, "cannot be written: its script cannot be named in it");
    else
        output_write(scene_path, linked, strlen(linked), faults);
    if (script)
        output_write(script_path, script, strlen(script), faults);
    free(linked);
    free(scene_path);
    free(script_path);
    free(script);
    free(text);
    return faults->count == before;
}

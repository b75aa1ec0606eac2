#define _XOPEN_SOURCE 700   // realpath
#include "sim/replay_scene.h"

#include "base/base.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

// The path of `file` relative to `folder`, both absolute and without symbolic links.
static void relative_path(const char *file, const char *folder, char *out, size_t capacity)
{
    size_t shared = 0;
    for (size_t i = 0; file[i] && file[i] == folder[i]; i++)
        if (file[i] == '/' || (file[i + 1] == '/' && !folder[i + 1]))
            shared = i + 1;
    size_t used = 0;
    out[0] = 0;
    const char *rest = folder + shared;
    while (*rest == '/')
        rest++;
    for (bool inside = *rest; inside && used + 4 < capacity; used += 3) {
        memcpy(out + used, "../", 4);
        rest = strchr(rest, '/');
        inside = rest && *++rest;
    }
    const char *down = file + shared;
    while (*down == '/')
        down++;
    snprintf(out + used, capacity - used, "%s", down);
}

// Replaces the path at `key` of the scene by the path relative to `folder`.
static bool rename_file(char **text, const char *key, const char *file, const char *folder, Faults *faults)
{
    char whole[PATH_MAX], named[PATH_MAX + 64];
    if (!file)
        return true;
    if (!realpath(file, whole)) {
        faults_add(faults, file, 0, 0, "cannot be found: %s; the recording's scene refers to it", strerror(errno));
        return false;
    }
    relative_path(whole, folder, named, sizeof named);
    char *edited = yaml_edit(*text, key, named, false);
    if (!edited)
        return true;   // inline, or no path at this key
    free(*text);
    *text = edited;
    return true;
}

static bool set_key(char **text, const char *key, const char *value)
{
    char *edited = yaml_edit(*text, key, value, true);
    if (edited) {
        free(*text);
        *text = edited;
    }
    return edited != NULL;
}

static bool write_part(const char *folder, const char *name, const char *text, size_t length, Faults *faults)
{
    char path[PATH_MAX + 64];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return output_write(path, text, length, faults);
}

bool replay_write_scene(const RecordedRun *run, const Scene *scene, const char *folder, Faults *faults)
{
    char whole[PATH_MAX];
    if ((mkdir(folder, 0777) != 0 && errno != EEXIST) || !realpath(folder, whole)) {
        faults_add(faults, folder, 0, 0, "cannot be created: %s; expected a path in a writable folder", strerror(errno));
        return false;
    }
    size_t length = 0;
    char *script = replay_script(run, &length), *text = strdup(run->scene_text);
    bool good = script && text && set_key(&text, "script", "hand.csv");
    if (good && run->contact < CONTACT_COUNT && scene->source != SOURCE_NONE)
        good = set_key(&text, "vessel.contact", contact_name[run->contact]);
    if (!good)
        faults_add(faults, folder, 0, 0, "not enough memory for the scene");
    good = good && rename_file(&text, "vessel.model", scene->model_path, whole, faults) && rename_file(&text, "vessel.mesh", scene->mesh_path, whole, faults) &&
           rename_file(&text, "vessel.tube.points", scene->tube_points_path, whole, faults) &&
           rename_file(&text, "fluoroscopy.volume", scene->anatomy_path, whole, faults);
    for (int k = 0; good && k < scene->tool_count; k++)
        for (int i = 0; good && i < scene_device_count(scene, k); i++) {
            char key[48];
            if (i == 0)
                snprintf(key, sizeof key, "tools.%d.device", k);
            else
                snprintf(key, sizeof key, "tools.%d.exchange.%d.device", k, i - 1);
            good = rename_file(&text, key, scene_device(scene, k, i)->device_path, whole, faults);
        }
    good = good && write_part(folder, "hand.csv", script, length, faults) && write_part(folder, "scene.yaml", text, strlen(text), faults);
    free(script);
    free(text);
    return good;
}

bool replay_write_golden(const ToolPath *path, const char *folder, Faults *faults)
{
    size_t length;
    char *text = tool_path_print(path, &length);
    if (!text)
        faults_add(faults, folder, 0, 0, "not enough memory for the golden path");
    bool good = text && write_part(folder, "scene.golden.csv", text, length, faults);
    free(text);
    return good;
}

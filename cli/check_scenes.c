#include "cli/check_scenes.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int refuse(CheckLog *log, const char *path, const char *why)
{
    fprintf(stderr, "%s: %s\n", path, why);
    return check_log_add(log, &(CheckCase){.scene = path, .name = "golden run", .status = CHECK_ERROR, .message = why, .code = EXIT_BAD_INPUT});
}

// A scene whose golden run is not in the baseline is new: nothing to compare.
static void skip_new(CheckScenes *scenes, CheckLog *log)
{
    SceneList known = {0};
    for (int i = 0; i < scenes->golden.count; i++) {
        char *path = scenes->golden.path[i], *golden = baseline_path_of(scenes->baseline, path);
        if (access(golden, F_OK) == 0) {
            scene_list_add(&known, path);
        } else {
            printf("%-44s skipped   is not in the baseline\n", path);
            check_log_add(log, &(CheckCase){.scene = path, .name = "golden run", .status = CHECK_SKIPPED, .message = "is not in the baseline"});
        }
        free(golden);
    }
    scene_list_free(&scenes->golden);
    scenes->golden = known;
}

static bool is_expected(const CheckScenes *scenes, const char *golden)
{
    bool found = false;
    for (int i = 0; i < scenes->golden.count && !found; i++) {
        char *own = baseline_path_of(scenes->baseline, scenes->golden.path[i]);
        found = !strcmp(own, golden);
        free(own);
    }
    return found;
}

// The golden runs of the baseline below a path whose scenes are gone.
static int find_gone(const CheckScenes *scenes, const char *path, const SceneList *stored, CheckLog *log)
{
    char *place = baseline_place(scenes->baseline, path);
    size_t stem = strlen(place);
    int code = EXIT_DONE;
    for (int i = 0; i < stored->count; i++) {
        const char *golden = stored->path[i];
        bool is_below = !strncmp(golden, place, stem) && (golden[stem] == '/' || (stem > 0 && place[stem - 1] == '/'));
        if (is_below && !is_expected(scenes, golden))
            code = refuse(log, golden, "is the golden run of a scene that no longer exists; expected the scene at its place below the current folder");
    }
    free(place);
    return code;
}

static bool can_be_checked(const CheckScenes *scenes, const char *path)
{
    return scenes->update || scenes->stores || scenes->baseline || scene_has_golden(path) || scene_has_verify(path);
}

int check_scenes_gather(CheckScenes *scenes, int path_count, char *const *path, CheckLog *log)
{
    bool takes_all = scenes->stores || scenes->baseline;
    SceneList all = {0}, stored = {0};
    int code = EXIT_DONE;
    for (int i = 0; i < path_count; i++) {
        struct stat status;
        if (stat(path[i], &status) != 0)
            code = refuse(log, path[i], "does not exist; give a scene (X.yaml) or a folder");
        else if (S_ISDIR(status.st_mode) && takes_all)
            scene_list_add_files(&all, path[i], ".yaml", baseline_is_scene);
        else if (S_ISDIR(status.st_mode))
            scene_list_add_folder(&all, path[i]);
        else if (can_be_checked(scenes, path[i]))
            scene_list_add(&all, path[i]);
        else
            code = refuse(log, path[i], "has no golden tool path in its folder and no key `verify:`; `seldinger check --update` makes a golden path");
    }
    for (int i = 0; i < all.count; i++) {
        bool verifies = scene_has_verify(all.path[i]);
        // --update with a folder renews the existing golden runs; with a scene it also creates one
        if (takes_all || scene_has_golden(all.path[i]) || !verifies)
            scene_list_add(&scenes->golden, all.path[i]);
        if (!takes_all && !scenes->update && verifies)
            scene_list_add(&scenes->verify, all.path[i]);
    }
    scene_list_free(&all);
    if (scenes->baseline) {
        baseline_list(scenes->baseline, &stored);
        for (int i = 0; i < path_count; i++)
            code |= find_gone(scenes, path[i], &stored, log);
        skip_new(scenes, log);
    }
    scene_list_free(&stored);
    return code;
}

void check_scenes_free(CheckScenes *scenes)
{
    scene_list_free(&scenes->golden);
    scene_list_free(&scenes->verify);
}

// Lists scenes that can be checked: those with a golden tool path next to them or with the key `verify:`.
#ifndef SELDINGER_SIM_SCENE_LIST_H
#define SELDINGER_SIM_SCENE_LIST_H

#include <stdbool.h>

typedef struct SceneList {
    int count, capacity;
    char **path;             // (count) scenes, without repeats
} SceneList;

void scene_list_add(SceneList *list, const char *path);
// Adds all such scenes below a folder, by name; links to folders are not followed.
void scene_list_add_folder(SceneList *list, const char *folder);
// Adds all files below a folder with that ending for which `is_wanted` (NULL: all), by name.
void scene_list_add_files(SceneList *list, const char *folder, const char *ending, bool (*is_wanted)(const char *path));
void scene_list_free(SceneList *list);

// Returns whether X.golden.csv exists next to X.yaml.
bool scene_has_golden(const char *scene);
// Returns whether the file's text holds the key at the start of a line; also true if it cannot be read, because opening it later reports the reason.
bool scene_has_verify(const char *path);

#endif

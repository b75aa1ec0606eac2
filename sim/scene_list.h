// Scenes that can be checked, by what lies beside them and in them: a golden tool path, the key `verify:`.
#ifndef SELDINGER_SIM_SCENE_LIST_H
#define SELDINGER_SIM_SCENE_LIST_H

#include <stdbool.h>

typedef struct SceneList {
    int count, capacity;
    char **path;             // (count) scenes, without repeats
} SceneList;

void scene_list_add(SceneList *list, const char *path);
// All below a folder that have one of both, by name; links to folders are not followed.
void scene_list_add_folder(SceneList *list, const char *folder);
void scene_list_free(SceneList *list);

// X.golden.csv beside X.yaml.
bool scene_has_golden(const char *scene);
// Does the file's text hold the key, at the start of a line? True too where it cannot be read: whoever opens it says why.
bool scene_has_verify(const char *path);

#endif

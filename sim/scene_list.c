#include "sim/scene_list.h"

#include "base/base.h"
#include "sim/compare.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

void scene_list_add(SceneList *list, const char *path)
{
    for (int i = 0; i < list->count; i++)
        if (!strcmp(list->path[i], path))
            return;
    if (list->count == list->capacity) {
        list->capacity = list->capacity * 2 + 16;
        list->path = HEAP_GROWN(list->path, (size_t)list->capacity, sizeof *list->path);
    }
    list->path[list->count++] = HEAP_TEXT(path);
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n > m && !strcmp(text + n - m, end);
}

static char *golden_of(const char *scene)
{
    char *golden = golden_path_of(scene);
    if (!golden)
        heap_is_empty(strlen(scene), __FILE__);
    return golden;
}

bool scene_has_golden(const char *scene)
{
    char *golden = golden_of(scene);
    bool there = access(golden, F_OK) == 0;
    free(golden);
    return there;
}

bool scene_has_verify(const char *path)
{
    static Faults ignored;
    size_t length;
    faults_clear(&ignored);
    char *text = text_file_read(path, &length, &ignored);
    // a file that cannot be read is listed, because opening it later reports the reason
    bool found = !text || !strncmp(text, "verify:", 7) || strstr(text, "\nverify:");
    free(text);
    return found;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

enum { DEEPEST_FOLDER = 32 };

// Symbolic links to folders are not followed, so there are no cycles.
static void find_files(const char *folder, int depth, const char *ending, bool (*is_wanted)(const char *path), SceneList *list)
{
    DIR *open = depth < DEEPEST_FOLDER ? opendir(folder) : NULL;
    for (struct dirent *entry; open && (entry = readdir(open));) {
        struct stat status;
        size_t capacity = strlen(folder) + strlen(entry->d_name) + 2;
        if (entry->d_name[0] == '.')
            continue;
        char *path = HEAP_ZEROED(capacity, 1);
        bool slash = ends_with(folder, "/");
        snprintf(path, capacity, "%s%s%s", folder, slash ? "" : "/", entry->d_name);
        if (lstat(path, &status) == 0 && S_ISDIR(status.st_mode))
            find_files(path, depth + 1, ending, is_wanted, list);
        else if (ends_with(path, ending) && (!is_wanted || is_wanted(path)))
            scene_list_add(list, path);
        free(path);
    }
    if (open)
        closedir(open);
}

void scene_list_add_files(SceneList *list, const char *folder, const char *ending, bool (*is_wanted)(const char *path))
{
    int before = list->count;
    find_files(folder, 0, ending, is_wanted, list);
    qsort(list->path + before, (size_t)(list->count - before), sizeof *list->path, by_name);
}

static bool can_be_checked(const char *path) { return scene_has_golden(path) || scene_has_verify(path); }

void scene_list_add_folder(SceneList *list, const char *folder)
{
    int before = list->count;
    find_files(folder, 0, ".yaml", can_be_checked, list);
    find_files(folder, 0, ".yml", can_be_checked, list);
    qsort(list->path + before, (size_t)(list->count - before), sizeof *list->path, by_name);
}

void scene_list_free(SceneList *list)
{
    for (int i = 0; i < list->count; i++)
        free(list->path[i]);
    free(list->path);
    *list = (SceneList){0};
}

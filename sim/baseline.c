#include "sim/baseline.h"

#include "sim/compare.h"

#include <dirent.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

char *baseline_place(const char *baseline, const char *path)
{
    char whole[PATH_MAX], here[PATH_MAX];
    const char *shown = path_resolve(path, whole) ? whole : path;
    size_t stem = getcwd(here, sizeof here) ? strlen(here) : 0;
    if (stem > 0 && !strncmp(shown, here, stem) && (shown[stem] == '/' || !shown[stem]))
        shown += stem;
    shown += *shown == '/';
    size_t capacity = strlen(baseline) + strlen(shown) + 2;
    char *place = HEAP_ZEROED(capacity, 1);
    snprintf(place, capacity, "%s/%s", baseline, shown);
    return place;
}

char *baseline_path_of(const char *baseline, const char *scene)
{
    char *place = baseline_place(baseline, scene), *golden = golden_path_of(place);
    if (!golden)
        heap_is_empty(strlen(place), __FILE__);
    free(place);
    return golden;
}

static bool is_empty(const char *folder)
{
    bool empty = true;
    DIR *open = opendir(folder);
    for (struct dirent *entry; open && (entry = readdir(open));)
        empty &= !strcmp(entry->d_name, ".") || !strcmp(entry->d_name, "..");
    if (open)
        closedir(open);
    return empty;
}

bool baseline_begin(const char *folder, const char *version, char *baseline, Faults *faults)
{
    int before = faults->count, length = snprintf(baseline, PATH_MAX, "%s/%s", folder, version);
    if (!*version || *version == '.' || strchr(version, '/') || length >= PATH_MAX)
        faults_add(faults, folder, 0, 0, "cannot hold a baseline named '%s'; expected a file name that does not begin with a dot", version);
    else if (!folders_create(baseline))
        faults_add(faults, baseline, 0, 0, "cannot be created; expected a folder in which files can be written");
    else if (!is_empty(baseline))
        faults_add(faults, baseline, 0, 0, "already holds a baseline, which is not overwritten; delete it, or give another name with --as");
    return faults->count == before;
}

static bool is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

bool baseline_check(const char *baseline, Faults *faults)
{
    char parent[PATH_MAX], versions[300] = "";
    if (is_folder(baseline) && !is_empty(baseline))
        return true;
    snprintf(parent, sizeof parent, "%s", baseline);
    char *slash = strrchr(parent, '/');
    if (slash)
        *slash = 0;
    DIR *open = opendir(slash ? parent : ".");
    for (struct dirent *entry; slash && open && (entry = readdir(open));) {
        size_t used = strlen(versions);
        if (entry->d_name[0] != '.')
            snprintf(versions + used, sizeof versions - used, "%s%s", used ? ", " : "", entry->d_name);
    }
    if (open)
        closedir(open);
    faults_add(faults, baseline, 0, 0, "is no baseline; %s%s", *versions ? "beside it are: " : "`seldinger check PATH --store FOLDER` makes FOLDER/VERSION",
               versions);
    return false;
}

bool baseline_is_scene(const char *path)
{
    Faults *ignored = HEAP_ZEROED(1, sizeof *ignored);
    size_t length;
    char *text = text_file_read(path, &length, ignored);
    bool found = text && (!strncmp(text, "seldinger:", 10) || strstr(text, "\nseldinger:"));
    free(text);
    free(ignored);
    return found;
}

void baseline_list(const char *baseline, SceneList *golden) { scene_list_add_files(golden, baseline, ".golden.csv", NULL); }

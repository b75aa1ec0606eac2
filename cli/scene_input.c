#include "cli/scene_input.h"

#include "base/base.h"
#include "cli/file_kind.h"

#include <stdlib.h>
#include <string.h>

// Names the command for a file in which nobody can steer.
static void refuse(const char *path, FileKind kind, Faults *faults)
{
    if (kind == FILE_VOLUME)
        faults_add(faults, path, 0, 0, "is a volume; make a case of it, from a point in a vessel: seldinger case %s --start X,Y,Z -o CASE", path);
    else if (kind == FILE_SURFACE)
        faults_add(faults, path, 0, 0, "is a surface; make a tree of it: seldinger import --surface %s -o TREE.h5", path);
    else if (kind == FILE_RECORDING)
        faults_add(faults, path, 0, 0, "is a recording; show it: seldinger replay %s", path);
    else
        faults_add(faults, path, 0, 0, "is a script; name a scene, and run the script in it: seldinger run SCENE --script %s", path);
}

// The folder of the case in the user's cache. Its name covers the content of the file, and the program, whose defaults are the fit's options.
static bool cached_case(const char *path, char *out, size_t capacity, Faults *faults)
{
    char text[4096], digest[65];
    const char *name = strrchr(path, '/');
    Sha256 sha;
    name = name ? name + 1 : path;
    sha256_begin(&sha);
    if (!sha256_of_file(path, digest)) {
        faults_add(faults, path, 0, 0, "cannot be read");
        return false;
    }
    sha256_add(&sha, digest, strlen(digest));
    if (process_code_id(digest))
        sha256_add(&sha, digest, strlen(digest));
    sha256_end(&sha, digest);
    size_t used = folders_cache(text, sizeof text) ? strlen(text) : 0;
    int length = snprintf(out, capacity, "%s/cases/%.*s-%.12s", text, (int)strcspn(name, "."), name, digest);
    if (used == 0 || length <= 0 || (size_t)length >= capacity || !folders_create(out)) {
        faults_add(faults, path, 0, 0,
                   "no case of it can be kept in a cache: neither $XDG_CACHE_HOME nor $HOME names a writable folder; make a case: seldinger case %s -o CASE",
                   path);
        return false;
    }
    return true;
}

static Scene *scene_of_tree(const char *path, int threads, bool quiet, Faults *faults)
{
    char folder[8192];
    CaseFigures figures;
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "case", quiet);
    if (!cached_case(path, folder, sizeof folder, faults))
        return NULL;
    CaseOptions options = {.input = path, .threads = threads, .progress = &progress};
    return case_is_there(folder) || case_make(folder, &options, &figures, faults) ? scene_load(folder, faults) : NULL;
}

Scene *cli_scene_input(const char *path, int threads, bool quiet, Faults *faults)
{
    FileKind kind = case_is_there(path) ? FILE_SCENE : file_kind(path);
    if (kind == FILE_TREE)
        return scene_of_tree(path, threads, quiet, faults);
    if (kind == FILE_SCENE || kind == FILE_MISSING || kind == FILE_UNKNOWN)
        return scene_load(path, faults);     // which says what is wrong with it
    refuse(path, kind, faults);
    return NULL;
}

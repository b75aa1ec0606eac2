#include "sim/session_files.h"

#include "base/base.h"
#include "recon/recon.h"
#include "sim/ordered_file.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool session_folder(const char *wanted, char *out, size_t capacity, Faults *faults)
{
    char data[PATH_MAX];
    int length = wanted                            ? snprintf(out, capacity, "%s", wanted)
                 : folders_data(data, sizeof data) ? snprintf(out, capacity, "%s/sessions", data)
                                                   : snprintf(out, capacity, "sessions");
    bool fits = length > 0 && (size_t)length < capacity - 512;
    if (!fits)
        errno = ENAMETOOLONG;
    if (fits && folders_create(out) && access(out, W_OK | X_OK) == 0)
        return true;
    faults_add(faults, wanted ? wanted : out, 0, 0, "cannot store sessions: %s; give a writable folder by --sessions FOLDER", strerror(errno));
    return false;
}

void session_file_name(const char *folder, const char *scene_path, const char *extension, char *out, size_t capacity)
{
    const char *end = scene_path + strlen(scene_path), *plain = "/scene.yaml";
    if (end - scene_path > (ptrdiff_t)strlen(plain) && !strcmp(end - strlen(plain), plain))
        end -= strlen(plain);
    const char *name = end;
    while (name > scene_path && name[-1] != '/')
        name--;
    int stem = (int)strcspn(name, "./");
    char when[32];
    time_t now = time(NULL);
    struct tm local;
    strftime(when, sizeof when, "%Y%m%d-%H%M%S", localtime_r(&now, &local));
    snprintf(out, capacity, "%s/%.*s-%s%s", folder, stem < 100 ? stem : 100, name, when, extension);
    for (int i = 2; access(out, F_OK) == 0 && i < 1000; i++)
        snprintf(out, capacity, "%s/%.*s-%s-%d%s", folder, stem < 100 ? stem : 100, name, when, i, extension);
}

void session_file_beside(const char *recording, const char *extension, char *out, size_t capacity)
{
    const char *dot = strrchr(recording, '.'), *slash = strrchr(recording, '/');
    int stem = dot && (!slash || dot > slash) ? (int)(dot - recording) : (int)strlen(recording);
    snprintf(out, capacity, "%.*s%s", stem, recording, extension);
}

bool session_files_save(const Scene *scene, const char *trainee, const char *device, const char *date, const Score *score, const char *recording,
                        Faults *faults)
{
    char path[4096];
    const char *name = strrchr(recording, '/');
    RecordedRun *run = recorded_run_load_series(recording, faults);
    Session *session = run ? calloc(1, sizeof *session) : NULL;
    char *text = NULL;
    bool is_read = run != NULL;
    if (session) {
        session_begin(session, scene, trainee, device, date);
        session_set_score(session, score);
        session_set_run(session, run, name ? name + 1 : recording);
        text = session_json(session);
    }
    recorded_run_free(run);
    free(session);
    session_file_beside(recording, ".json", path, sizeof path);
    if (!text) {
        if (is_read)
            faults_add(faults, path, 0, 0, "no session file could be made: out of memory");
        return false;
    }
    bool good = output_write(path, text, strlen(text), faults);
    free(text);
    return good;
}

// --- interrupted sessions ---

static bool has_session_file(const char *recording)
{
    char path[4200];
    session_file_beside(recording, ".json", path, sizeof path);
    return access(path, F_OK) == 0;
}

static bool is_cut_off(const char *recording)
{
    if (has_session_file(recording) || ordered_file_is_being_written(recording))
        return false;
    Faults *ignored = calloc(1, sizeof *ignored);
    Hdf5Reader *file = ignored ? hdf5_reader_open(recording, "", ignored) : NULL;
    char *trainee = file ? hdf5_text_attribute(file, "/scene", "trainee") : NULL;
    bool is_session = trainee != NULL;
    hdf5_reader_close(file);
    free(trainee);
    free(ignored);
    return is_session;
}

static int compare_paths(const void *a, const void *b) { return strcmp(a, b); }

CutOff session_find_cut_off(const char *folder)
{
    CutOff found = {0};
    DIR *directory = opendir(folder);
    for (struct dirent *entry; directory && (entry = readdir(directory));) {
        char path[sizeof *found.path];
        const char *dot = strrchr(entry->d_name, '.');
        if (!dot || strcmp(dot, ".h5") != 0 || (size_t)snprintf(path, sizeof path, "%s/%s", folder, entry->d_name) >= sizeof path || !is_cut_off(path))
            continue;
        char(*more)[4096] = realloc(found.path, (size_t)(found.count + 1) * sizeof *found.path);
        if (!more)
            break;
        found.path = more;
        memcpy(found.path[found.count++], path, sizeof path);
    }
    if (directory)
        closedir(directory);
    if (found.count > 1)
        qsort(found.path, (size_t)found.count, sizeof *found.path, compare_paths);
    return found;
}

void session_free_cut_off(CutOff *found)
{
    free(found->path);
    *found = (CutOff){0};
}

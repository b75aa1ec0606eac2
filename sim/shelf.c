#include "sim/shelf.h"

#include "sim/case_make.h"
#include "sim/scene.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool ends_in(const char *name, const char *ending)
{
    size_t length = strlen(name), tail = strlen(ending);
    return length > tail && !strcmp(name + length - tail, ending);
}

static void *room_for_one(void *list, int count, size_t size) { return realloc(list, (size_t)(count + 1) * size); }

// A scene with an exercise, or any case.
static bool take_case(const char *path, const char *name, ShelfCase *out)
{
    Faults *ignored = calloc(1, sizeof *ignored);
    bool is_folder = case_is_there(path);
    Scene *scene = ignored ? scene_load(path, ignored) : NULL;
    bool is_taken = scene && (is_folder || scene->exercise);
    free(ignored);
    *out = (ShelfCase){0};
    if (is_taken) {
        const char *needed = scene_needed_file(scene);
        snprintf(out->path, sizeof out->path, "%s", path);
        snprintf(out->title, sizeof out->title, "%.90s", scene->exercise ? scene->exercise->title : name);
        snprintf(out->text, sizeof out->text, "%.990s", scene->exercise ? scene->exercise->instructions : "");
        out->level = scene->exercise ? scene->exercise->level : 0;
        out->is_guided = scene->exercise && scene->exercise->guide.count > 0;
        snprintf(out->missing, sizeof out->missing, "%s", needed && access(needed, R_OK) != 0 ? needed : "");
    }
    scene_free(scene);
    return is_taken;
}

static bool read_cases(Shelf *shelf, const char *folder)
{
    struct dirent **entry = NULL;
    int found = scandir(folder, &entry, NULL, alphasort);
    bool good = true;
    for (int i = 0; i < found; i++) {
        const char *name = entry[i]->d_name;
        char *path = name[0] != '.' && good ? text_file_in(folder, name) : NULL;
        if (path && (ends_in(name, ".yaml") || case_is_there(path))) {
            ShelfCase *more = room_for_one(shelf->cases, shelf->case_count, sizeof *more);
            good = more != NULL;
            if (more) {
                shelf->cases = more;
                shelf->case_count += take_case(path, name, &more[shelf->case_count]);
            }
        }
        free(path);
        free(entry[i]);
    }
    free(entry);
    return good;
}

static int newest_first(const void *a, const void *b) { return strcmp(((const ShelfSession *)b)->date, ((const ShelfSession *)a)->date); }

static void take_session(Shelf *shelf, const char *path, const Session *session)
{
    ShelfSession *out = &shelf->session[shelf->session_count++];
    *out = (ShelfSession){.points = session->figures.points};
    snprintf(out->path, sizeof out->path, "%s", path);
    char *recording = *session->recording_path ? text_file_beside(path, session->recording_path) : NULL;
    snprintf(out->recording, sizeof out->recording, "%s", recording ? recording : "");
    free(recording);
    snprintf(out->trainee, sizeof out->trainee, "%s", session->trainee);
    snprintf(out->title, sizeof out->title, "%s", session->title);
    snprintf(out->date, sizeof out->date, "%s", session->date);
    for (int i = 0; i < shelf->case_count; i++)
        if (!strcmp(shelf->cases[i].title, session->title)) {
            shelf->cases[i].sessions++;
            shelf->cases[i].best = out->points > shelf->cases[i].best ? out->points : shelf->cases[i].best;
        }
}

static bool read_sessions(Shelf *shelf, const char *folder)
{
    struct dirent **entry = NULL;
    int found = scandir(folder, &entry, NULL, alphasort);
    Session *session = calloc(1, sizeof *session);
    Faults *ignored = calloc(1, sizeof *ignored);
    shelf->session = calloc((size_t)(found > 0 ? found : 0) + 1, sizeof *shelf->session);
    bool good = session && ignored && shelf->session;
    for (int i = 0; i < found; i++) {
        char *path = good && ends_in(entry[i]->d_name, ".json") ? text_file_in(folder, entry[i]->d_name) : NULL;
        if (path) {
            faults_clear(ignored);
            if (session_load(path, session, ignored))
                take_session(shelf, path, session);
            else
                shelf->broken++;
        }
        free(path);
        free(entry[i]);
    }
    free(entry);
    free(session);
    free(ignored);
    if (good && shelf->session_count > 1)
        qsort(shelf->session, (size_t)shelf->session_count, sizeof *shelf->session, newest_first);
    return good;
}

// By level, those without one last; of one level a guided exercise first, then by path.
static int easiest_first(const void *a, const void *b)
{
    const ShelfCase *p = a, *q = b;
    if (p->level != q->level)
        return !p->level ? 1 : !q->level ? -1 : p->level - q->level;
    return p->is_guided != q->is_guided ? (int)q->is_guided - (int)p->is_guided : strcmp(p->path, q->path);
}

bool shelf_read(Shelf *shelf, const char *const *folder, int folder_count, const char *sessions)
{
    bool good = true;
    *shelf = (Shelf){0};
    for (int i = 0; good && i < folder_count; i++)
        good = !folder[i] || read_cases(shelf, folder[i]);
    if (shelf->case_count > 1)
        qsort(shelf->cases, (size_t)shelf->case_count, sizeof *shelf->cases, easiest_first);
    return good && read_sessions(shelf, sessions);
}

void shelf_free(Shelf *shelf)
{
    free(shelf->cases);
    free(shelf->session);
    *shelf = (Shelf){0};
}

#include "render/session_report.h"

#include "base/base.h"
#include "render/session_page.h"
#include "sim/sim.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

// Opens scene and tree as recorded; missing parts stay NULL. Faults are only reported: the page is then shorter.
static Scene *open_scene(const RecordedRun *run, NoteFunction note, OpenVessel *open, VesselTree **tree, Faults *faults)
{
    Scene *scene = run && run->scene_text ? scene_parse(run->scene_text, strlen(run->scene_text), run->scene_path ? run->scene_path : "scene", faults) : NULL;
    if (!scene)
        return NULL;
    if (scene->source == SOURCE_MODEL || scene->source == SOURCE_SHAPE)
        scene->contact = CONTACT_LIM;            // only the tree is needed, not the wall
    if (scene->source == SOURCE_MODEL || scene->source == SOURCE_SHAPE || scene->source == SOURCE_TUBE)
        open_vessel(scene, &(OpenVesselOptions){.note = note}, open, faults);
    *tree = open->tree;
    if (scene->source == SOURCE_TUBE && open->vessel)
        *tree = tube_tree(open->vessel, &scene->tube, scene->path, faults);
    return scene;
}

static void print_faults(const Faults *faults)
{
    for (int i = 0; i < faults->count && i < FAULTS_CAPACITY; i++)
        fprintf(stderr, "seldinger report: %s\n", faults->text[i]);
}

// The frames of an hour would fill the memory of a small machine: from such a recording only the data of every step are read, and the path is omitted.
static RecordedRun *load_run(const char *path, Faults *faults)
{
    static const off_t most_bytes = 1500 * 1000 * (off_t)1000;
    struct stat file;
    bool is_long = stat(path, &file) == 0 && file.st_size > most_bytes;
    return is_long ? recorded_run_load_series(path, faults) : recorded_run_load(path, faults);
}

char *session_report(const char *path, const Session *session, const char *with, NoteFunction note, size_t *length, Faults *faults)
{
    char *bytes = NULL, *recording = text_file_beside(path, session->recording_path);
    Faults *gone = calloc(1, sizeof *gone);
    FILE *out = recording && gone ? open_memstream(&bytes, length) : NULL;
    if (out) {
        OpenVessel open = {0};
        VesselTree *tree = NULL;
        SessionPage page = {.out = out, .path = path, .session = session};
        RecordedRun *run = *session->recording_path ? load_run(recording, gone) : NULL;
        Scene *scene = open_scene(run, note, &open, &tree, gone);
        Session *earlier = session_list(with, session->trainee, session->title, &page.earlier_count, &page.broken, gone);
        print_faults(gone);
        if (page.broken > 0)
            fprintf(stderr, "seldinger report: %s: %d session file%s could not be read\n", with, page.broken, page.broken == 1 ? "" : "s");
        page.run = run;
        page.run_is_its = run && session_is_of(session, run);
        page.scene = scene;
        page.tree = tree;
        page.earlier = earlier;
        session_page(&page);
        free(earlier);
        if (tree != open.tree)
            vessel_tree_free(tree);
        open_vessel_close(&open);
        scene_free(scene);
        recorded_run_free(run);
    }
    bool good = out && !ferror(out);
    good = out && fclose(out) == 0 && good;
    free(gone);
    free(recording);
    if (!good) {
        faults_add(faults, path, 0, 0, "out of memory for the page");
        free(bytes);
        return NULL;
    }
    return bytes;
}

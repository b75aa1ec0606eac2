#include "sim/case_make.h"

#include "recon/recon.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#define MODEL "model.h5"
#define SCENE "scene.yaml"
#define TRACE "trace.yaml"

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool case_is_there(const char *folder)
{
    struct stat status;
    char *path = text_file_in(folder, SCENE);
    bool is_there = path && stat(path, &status) == 0;
    free(path);
    return is_there;
}

static bool create_folder(const char *folder, Faults *faults)
{
    struct stat status;
    if (case_is_there(folder))
        faults_add(faults, folder, 0, 0, "is a case already; name another folder, or remove this one");
    else if (mkdir(folder, 0777) != 0 && !(errno == EEXIST && stat(folder, &status) == 0 && S_ISDIR(status.st_mode)))
        faults_add(faults, folder, 0, 0, "cannot be created as a folder: %s", strerror(errno));
    return faults->count == 0;
}

static bool write_text(const char *folder, const char *name, const char *text, Faults *faults)
{
    char *path = text_file_in(folder, name);
    if (!path)
        faults_add(faults, folder, 0, 0, "out of memory");
    bool good = path && whole_file_write(path, text, strlen(text), faults);
    free(path);
    return good;
}

// Tracks the volume. `file` gets the tree and what its file would say; `frame` the patient's orientation.
static bool track(const CaseOptions *options, ModelFile *file, char frame[32], Faults *faults)
{
    RbtReport report = {0};
    Trace *trace = trace_parse(options->trace, strlen(options->trace), options->trace_path, faults);
    Volume *volume = trace ? volume_load(options->input, faults) : NULL;
    *file = (ModelFile){.kind = -1};
    if (volume) {
        snprintf(frame, 32, "%s", volume->frame);
        file->tree = rbt_track(volume, &trace->parameters, trace->branch, trace->branch_count, trace->aneurysm, trace->aneurysm_count, options->threads,
                               options->progress, &report, options->trace_path, faults);
    }
    if (file->tree)
        file->info =
            (TreeFileInfo){.source = HEAP_TEXT(options->input), .parameters = segment_parameters_text(&trace->parameters, &report, volume, file->tree)};
    rbt_report_free(&report);
    volume_free(volume);
    trace_free(trace);
    return file->tree != NULL;
}

// Fits the model unless the file has one of its kind, and saves it with the others.
static bool fit(const char *folder, const CaseOptions *options, ModelFile *file, Faults *faults)
{
    TreeFitOptions how = tree_fit_default_options();
    TreeFit made = {0};
    SweepModels swept = file->swept;
    how.model = (FitModel)options->kind;
    how.local.threads = options->threads;
    tree_fit_complete_options(&how, file->tree, &file->info);
    bool has_it = fit_model_is_swept(how.model) ? swept.of[fit_model_section(how.model)] != NULL : vessel_tree_is_model(file->tree);
    if (!has_it && !tree_fit(file->tree, options->input, &how, options->progress, &made, faults))
        return false;
    if (made.sweep)
        swept.of[fit_model_section(how.model)] = made.sweep;
    char created_by[] = "seldinger " SELDINGER_VERSION " case", *path = text_file_in(folder, MODEL);
    TreeFileInfo info = {
        .source = file->info.source, .parameters = has_it ? file->info.parameters : tree_fit_parameters(&how, &file->info), .created_by = created_by};
    bool good = tree_file_save_with(made.model ? made.model : file->tree, &swept, &info, path, faults);
    if (!has_it)
        free(info.parameters);
    free(path);
    sweep_model_free(made.sweep);
    vessel_tree_free(made.model);
    return good;
}

static bool write_scene(const char *folder, const CaseOptions *options, const VesselTree *tree, const char *frame, Faults *faults)
{
    char behind[PATH_MAX];
    CaseScene scene = {.model = MODEL,
                       .contact = options->kind > 0 ? (ContactKind)(CONTACT_SWEEP + options->kind - 1) : CONTACT_LIM,
                       .frame = frame,
                       .behind = options->is_behind && path_resolve(options->input, behind) ? behind : NULL,
                       .has_target = options->has_target,
                       .target = options->target};
    char *text = case_scene_text(tree, &scene, faults);
    bool good = text && write_text(folder, SCENE, text, faults);
    free(text);
    return good;
}

static void measure(const VesselTree *tree, CaseFigures *figures)
{
    figures->nodes = tree->node_count;
    figures->length = vessel_tree_length(tree);
    for (int i = 1; i < tree->node_count; i++)
        figures->branches += tree->kind[i] == NODE_VESSEL && tree->neighbour_offset[i + 1] - tree->neighbour_offset[i] == 1;
}

bool case_make(const char *folder, const CaseOptions *options, CaseFigures *figures, Faults *faults)
{
    ModelFile file = {0};
    char frame[32] = "";
    *figures = (CaseFigures){0};
    if (!create_folder(folder, faults) || (options->trace && !write_text(folder, TRACE, options->trace, faults)))
        return false;
    double start = seconds();
    if (options->trace ? !track(options, &file, frame, faults) : !model_file_load(options->input, -1, &file, faults))
        return false;
    figures->track_s = seconds() - start;
    bool good = fit(folder, options, &file, faults);
    figures->fit_s = seconds() - start - figures->track_s;
    good = good && write_scene(folder, options, file.tree, frame, faults);
    measure(file.tree, figures);
    model_file_free(&file);
    return good;
}

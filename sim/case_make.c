#include "sim/case_make.h"

#include "sim/clock.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define MODEL "model.h5"
#define SCENE "scene.yaml"
#define TRACE "trace.yaml"

bool case_is_there(const char *folder)
{
    struct stat status;
    char *path = text_file_in(folder, SCENE);
    bool is_there = path && stat(path, &status) == 0;
    free(path);
    return is_there;
}

// `is_new`: it was created here, and nothing is in it.
static bool create_folder(const char *folder, bool *is_new, Faults *faults)
{
    struct stat status;
    *is_new = false;
    if (case_is_there(folder))
        faults_add(faults, folder, 0, 0, "is a case already; name another folder, or remove this one");
    else if (!(*is_new = mkdir(folder, 0777) == 0) && !(errno == EEXIST && stat(folder, &status) == 0 && S_ISDIR(status.st_mode)))
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

// --- the entry ---

bool case_tree_is_end(const VesselTree *tree, int node)
{
    return tree->kind[node] == NODE_VESSEL && tree->neighbour_offset[node + 1] - tree->neighbour_offset[node] == 1;
}

int case_tree_end_near(const VesselTree *tree, Vec3 x)
{
    int best = 0;
    for (int i = 1; i < tree->node_count; i++)
        if (case_tree_is_end(tree, i) && vec3_distance(x, tree->center[i]) < vec3_distance(x, tree->center[best]))
            best = i;
    return best;
}

// The widest neighbour that leads on; -1: the vessel ends, or a sac begins.
static int node_ahead(const VesselTree *tree, int node, int from)
{
    int next = -1;
    for (int k = tree->neighbour_offset[node]; k < tree->neighbour_offset[node + 1]; k++) {
        int at = tree->neighbour[k];
        if (at != from && tree->kind[at] == NODE_VESSEL && (next < 0 || tree->radius[at] > tree->radius[next]))
            next = at;
    }
    return next;
}

// How wide the vessel is for a tool that enters at this end: the mean of the least radius passed so far, over six radii of the end (or to the vessel's other end). The very
// last node is often cut by the border, and a short wide stub in a sac is no way in.
static double width_at_end(const VesselTree *tree, int end)
{
    const double radii = 6;
    double length = radii * tree->radius[end], way = 0, sum = 0, least = tree->radius[end];
    for (int from = -1, node = end, next; way < length && (next = node_ahead(tree, node, from)) >= 0; from = node, node = next) {
        double step = fmin(vec3_distance(tree->center[node], tree->center[next]), length - way);
        least = way > 0 ? fmin(least, tree->radius[next]) : fmax(least, tree->radius[next]);
        sum += least < 0.5 * tree->radius[end] ? 0 : step * least;       // so soon no vessel narrows to half, but the way out of a sac does
        way += step;
    }
    return way > 0 ? sum / way : 0;
}

// Whether the end lies within two of its radii and two voxels of the border.
static bool is_at_border(const VesselTree *tree, int end, const Volume *volume)
{
    Vec3 v = volume_voxel_of(volume, tree->center[end]);
    double at[3] = {v.x, v.y, v.z};
    for (int k = 0; k < 3; k++) {
        double near = 2 + 2 * tree->radius[end] / vec3_norm(volume->axis[k]);
        if (at[k] < near || at[k] > volume->size[k] - 1 - near)
            return true;
    }
    return false;
}

// An end at the border was cut off by the field of view; the field of a rotational angiography ends within its volume, as do vessels without contrast.
static const double BORDER = 2;

int case_tree_widest_end(const VesselTree *tree, const Volume *volume)
{
    int best = -1;
    double widest = 0;
    for (int i = 0; i < tree->node_count; i++) {
        double width = case_tree_is_end(tree, i) ? width_at_end(tree, i) * (is_at_border(tree, i, volume) ? BORDER : 1) : 0;
        if (width > widest)
            widest = width, best = i;
    }
    return best;
}

// Makes the entry the root of the tree.
static bool turn_to_entry(CaseWork *work, const CaseOptions *options, const Volume *volume, Faults *faults)
{
    VesselTree *tree = work->file.tree;
    bool is_given = options->has_entry || (work->trace && work->trace->made.has_entry);
    Vec3 entry = options->has_entry ? options->entry : work->trace ? work->trace->made.entry : vec3(0, 0, 0);
    int root = is_given ? case_tree_end_near(tree, entry) : volume && !work->trace->branch[0].has_toward ? case_tree_widest_end(tree, volume) : 0;
    if (is_given && vec3_distance(entry, tree->center[root]) > 4 * tree->radius[root]) {
        Vec3 at = tree->center[root];
        faults_add(faults, "entry", 0, 0,
                   "lies %.1f mm from the nearest end of a vessel, which is at (%.2f, %.2f, %.2f); expected a point at the end of a vessel",
                   vec3_distance(entry, at), at.x, at.y, at.z);
        return false;
    }
    if (root <= 0)
        return true;
    if (vessel_tree_is_model(tree)) {
        faults_add(faults, "entry", 0, 0, "the file has a model, which was fitted from another root; expected a tree or a volume");
        return false;
    }
    VesselTree *turned = vessel_tree_with_root(tree, root);
    if (!turned) {
        faults_add(faults, "entry", 0, 0, "out of memory");
        return false;
    }
    vessel_tree_free(tree);
    work->file.tree = turned;
    return true;
}

// --- in steps ---

bool case_work_track(CaseWork *work, const CaseOptions *options, const Volume *volume, const RbtWatch *watch, Faults *faults)
{
    *work = (CaseWork){.file.kind = -1};
    if (!volume)
        return model_file_load(options->input, -1, &work->file, faults) && turn_to_entry(work, options, NULL, faults);
    work->trace = trace_parse(options->trace, strlen(options->trace), options->trace_path, faults);
    if (!work->trace)
        return false;
    Trace *trace = work->trace;
    trace->parameters.watch = watch;
    snprintf(work->frame, sizeof work->frame, "%s", volume->frame);
    VesselTree *tree = work->file.tree = rbt_track(volume, &trace->parameters, trace->branch, trace->branch_count, trace->aneurysm, trace->aneurysm_count,
                                                   options->threads, options->progress, &work->report, options->trace_path, faults);
    if (!tree)
        return false;
    work->file.info =
        (TreeFileInfo){.source = HEAP_TEXT(options->input), .parameters = segment_parameters_text(&trace->parameters, &work->report, volume, tree)};
    return turn_to_entry(work, options, volume, faults);
}

bool case_work_fit(CaseWork *work, const CaseOptions *options, Faults *faults)
{
    ModelFile *file = &work->file;
    sweep_editor_free(work->editor);
    work->editor = NULL, work->edited = NULL;
    sweep_model_free(work->made.sweep);
    vessel_tree_free(work->made.model);
    work->made = (TreeFit){0};
    bool is_corrected = work->how.is_corrected;
    work->how = tree_fit_default_options();
    work->how.is_corrected = is_corrected;
    work->how.model = (FitModel)(options->has_kind || !work->trace ? options->kind : work->trace->made.model);
    work->how.local.threads = options->threads;
    tree_fit_complete_options(&work->how, file->tree, &file->info);
    work->has_it = fit_model_is_swept(work->how.model) ? file->swept.of[fit_model_section(work->how.model)] != NULL : vessel_tree_is_model(file->tree);
    bool good = work->has_it || tree_fit(file->tree, options->input, &work->how, options->progress, &work->made, faults);
    work->how.is_corrected |= !work->has_it;
    return good;
}

const VesselTree *case_work_tree(const CaseWork *work) { return work->made.model ? work->made.model : work->file.tree; }

const SweepModel *case_work_sweep(const CaseWork *work)
{
    if (work->made.sweep || !fit_model_is_swept(work->how.model))
        return work->made.sweep;
    return work->file.swept.of[fit_model_section(work->how.model)];
}

bool case_work_choose(CaseWork *work, const CaseOptions *options, Faults *faults)
{
    Trace *now = trace_parse(options->trace, strlen(options->trace), options->trace_path, faults);
    if (!now)
        return false;
    EditList *before = work->trace->edits;
    work->trace->made = now->made;
    work->trace->edits = now->edits;
    now->edits = before;
    trace_free(now);
    return true;
}

bool case_work_edit(CaseWork *work, const CaseOptions *options, Faults *faults)
{
    const EditList *edits = work->trace ? work->trace->edits : NULL;
    sweep_editor_free(work->editor);
    work->editor = NULL, work->edited = NULL;
    if (!edits || edits->count == 0)
        return true;
    if (work->how.model != FIT_MODEL_SWEEP) {
        faults_add(faults, options->trace_path, edits->edit[0].line, edits->edit[0].column,
                   "the model of the case is '%s', which has no sections to edit; expected `case: {model: sweep}`, or a trace without edits",
                   model_names[work->how.model]);
        return false;
    }
    work->editor = sweep_editor_create(case_work_sweep(work));
    if (!work->editor || (sweep_editor_replay(work->editor, edits, options->trace_path, faults) && !(work->edited = sweep_editor_result(work->editor))))
        faults_add(faults, options->trace_path, 0, 0, "the edits need more memory than is available");
    return work->edited != NULL;
}

bool case_work_wall(const CaseWork *work, ModelField *wall)
{
    const SweepModel *sweep = work->edited ? work->edited : case_work_sweep(work);
    *wall = model_field_of_blobs(case_work_tree(work));
    return !sweep || model_field_of_sweep(work->file.tree, sweep, wall);
}

static bool write_model(const CaseWork *work, const char *folder, Faults *faults)
{
    SweepModels swept = work->file.swept;
    if (work->made.sweep)
        swept.of[fit_model_section(work->how.model)] = work->made.sweep;
    if (work->edited)
        swept.of[SECTION_POLAR] = (SweepModel *)(uintptr_t)work->edited;
    char created_by[] = "seldinger " SELDINGER_VERSION " case", *path = text_file_in(folder, MODEL);
    TreeFileInfo info = {.source = work->file.info.source,
                         .parameters = work->has_it ? work->file.info.parameters : tree_fit_parameters(&work->how, &work->file.info),
                         .created_by = created_by};
    bool good = path && tree_file_save_with(case_work_tree(work), &swept, &info, path, faults);
    if (!path)
        faults_add(faults, folder, 0, 0, "out of memory");
    if (!work->has_it)
        free(info.parameters);
    free(path);
    return good;
}

// A device of the library, which the folder gets as a copy, so that the case can be copied.
typedef struct CaseDevice {
    const char *name;        // NULL: none
    char *text;
    ToolKind kind;
} CaseDevice;

static bool read_device(CaseDevice *device, const char *library, Faults *faults)
{
    size_t length;
    if (!device->name)
        return true;
    if (library && !trace_is_device_name(device->name)) {
        faults_add(faults, device->name, 0, 0, "is not the name of a device file, without its folder, of letters, digits and . - _");
        return false;
    }
    if (!library) {
        faults_add(faults, device->name, 0, 0, "there is no folder of devices; name one: --tools FOLDER");
        return false;
    }
    char *path = text_file_in(library, device->name);
    device->text = path ? whole_file_read_most(path, 1 << 20, &length, faults) : NULL;
    if (!path)
        faults_add(faults, device->name, 0, 0, "out of memory");
    bool good = device->text && scene_device_kind(device->text, length, path, &device->kind, faults);
    free(path);
    return good;
}

// Whether the scene can be opened: the wire fits into its catheter, and the segment exists. Its devices are those of the library.
static bool is_valid(const char *library, const char *text, Faults *faults)
{
    char *path = text_file_in(library ? library : ".", SCENE);
    Scene *scene = path ? scene_parse(text, strlen(text), path, faults) : NULL;
    if (!path)
        faults_add(faults, SCENE, 0, 0, "out of memory");
    scene_free(scene);
    free(path);
    return scene != NULL;
}

static const char *choice(const char *option, const char *said) { return option && option[0] ? option : said && said[0] ? said : NULL; }

// What is written beside the model.
typedef struct CaseTexts {
    CaseDevice device, catheter;
    char *scene;
} CaseTexts;

static void free_texts(CaseTexts *texts)
{
    free(texts->device.text);
    free(texts->catheter.text);
    free(texts->scene);
}

static bool prepare_texts(CaseTexts *texts, const CaseWork *work, const CaseOptions *options, Faults *faults)
{
    char behind[PATH_MAX];
    const TraceCase *said = work->trace ? &work->trace->made : NULL;
    *texts = (CaseTexts){.device.name = choice(options->device, said ? said->device : NULL),
                         .catheter.name = choice(options->catheter, said ? said->catheter : NULL)};
    bool is_behind = options->is_behind || (said && said->is_behind);
    CaseScene scene = {.model = MODEL,
                       .contact = fit_model_is_swept(work->how.model) ? (ContactKind)(CONTACT_SWEEP + fit_model_section(work->how.model)) : CONTACT_LIM,
                       .frame = work->frame,
                       .behind = is_behind && path_resolve(options->input, behind) ? behind : NULL,
                       .device = texts->device.name,
                       .catheter = texts->catheter.name,
                       .anatomy = choice(options->anatomy, said ? said->anatomy : NULL),
                       .has_target = options->has_target || (said && said->has_target),
                       .target = options->has_target || !said ? options->target : said->target};
    if (!read_device(&texts->device, options->library, faults) || !read_device(&texts->catheter, options->library, faults))
        return false;
    scene.is_micro = texts->catheter.name && texts->catheter.kind == TOOL_MICROCATHETER;
    texts->scene = case_scene_text(work->file.tree, &scene, faults);
    return texts->scene && is_valid(options->library, texts->scene, faults);
}

// The trace, with the kind of the model as it was chosen beside it: the trace alone makes the same case.
static bool write_trace(const CaseWork *work, const char *folder, const CaseOptions *options, Faults *faults)
{
    const bool is_said = options->has_kind && work->trace && work->trace->made.model != options->kind;
    char *text = is_said ? yaml_edit(options->trace, "case.model", model_names[options->kind], true) : NULL;
    char flow[80];
    snprintf(flow, sizeof flow, "{model: %s}", model_names[is_said ? options->kind : 0]);
    if (is_said && !text)            // there is no `case:` yet
        text = yaml_edit_flow(options->trace, "case", flow, true);
    if (is_said && !text)
        faults_add(faults, options->trace_path, 0, 0, "the model '%s' cannot be written into it; expected one YAML document with a map",
                   model_names[options->kind]);
    bool good = (!is_said || text) && write_text(folder, TRACE, text ? text : options->trace, faults);
    free(text);
    return good;
}

bool case_work_write(const CaseWork *work, const char *folder, const CaseOptions *options, Faults *faults)
{
    CaseTexts texts;
    bool is_new, good = prepare_texts(&texts, work, options, faults) && create_folder(folder, &is_new, faults);
    const CaseDevice *const device[] = {&texts.device, &texts.catheter};
    good = good && (!options->trace || write_trace(work, folder, options, faults)) && write_model(work, folder, faults);
    for (int i = 0; good && i < 2; i++)
        good = !device[i]->name || write_text(folder, device[i]->name, device[i]->text, faults);
    good = good && write_text(folder, SCENE, texts.scene, faults);
    free_texts(&texts);
    return good;
}

void case_work_measure(const CaseWork *work, CaseFigures *figures)
{
    const VesselTree *tree = work->file.tree;
    figures->nodes = tree->node_count;
    figures->length = vessel_tree_length(tree);
    figures->branches = 0;
    for (int i = 1; i < tree->node_count; i++)
        figures->branches += case_tree_is_end(tree, i);
}

void case_work_free(CaseWork *work)
{
    sweep_editor_free(work->editor);
    sweep_model_free(work->made.sweep);
    vessel_tree_free(work->made.model);
    rbt_report_free(&work->report);
    trace_free(work->trace);
    model_file_free(&work->file);
    *work = (CaseWork){0};
}

bool case_make(const char *folder, const CaseOptions *options, CaseFigures *figures, Faults *faults)
{
    CaseWork work = {0};
    *figures = (CaseFigures){0};
    bool is_new;
    // before the work that would be lost
    if (!create_folder(folder, &is_new, faults))
        return false;
    double start = clock_s(CLOCK_MONOTONIC);
    Volume *volume = options->trace ? volume_load(options->input, faults) : NULL;
    bool good = (volume || !options->trace) && case_work_track(&work, options, volume, NULL, faults);
    volume_free(volume);
    figures->track_s = clock_s(CLOCK_MONOTONIC) - start;
    good = good && case_work_fit(&work, options, faults) && case_work_edit(&work, options, faults);
    figures->fit_s = clock_s(CLOCK_MONOTONIC) - start - figures->track_s;
    good = good && case_work_write(&work, folder, options, faults);
    if (work.file.tree)
        case_work_measure(&work, figures);
    case_work_free(&work);
    if (!good && is_new)
        rmdir(folder);       // unless something was written
    return good;
}

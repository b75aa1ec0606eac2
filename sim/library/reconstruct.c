#include "sim/library/recon.h"

#include "base/base.h"
#include "recon/recon.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void sel_segment_options_init(SelSegmentOptions *options, size_t size)
{
    SelSegmentOptions own = {.seed = -1};
    result_give(options, size, &own, sizeof own);
}

void sel_fit_options_init(SelFitOptions *options, size_t size)
{
    SelFitOptions own = {.voxel_mm = -1, .edge_blur_mm = -1};
    result_give(options, size, &own, sizeof own);
}

// --- tracking ---

typedef struct Segmenting {
    const SelVolume *volume;
    SelSegmentOptions options;
    SelTree *tree;
} Segmenting;

static void add_points(Trace *trace, const char *key, int count, const double *point)
{
    for (int i = 0; point && i < count; i++)
        if (!trace_add_point(trace, key, vec3(point[3 * i], point[3 * i + 1], point[3 * i + 2])))
            heap_is_empty(sizeof(RbtRegion), __FILE__);
}

// Converts all forms of starts to the text of a trace file, so that there is one reader.
static Trace *trace_of(const SelSegmentOptions *o, Faults *faults)
{
    char text[160];
    int length = snprintf(text, sizeof text, "branches: [{start_mm: [%.17g, %.17g, %.17g]}]", o->start_mm[0], o->start_mm[1], o->start_mm[2]);
    Trace *trace = o->trace ? trace_load(o->trace, faults) : trace_parse(text, (size_t)length, "start_mm", faults);
    if (!trace)
        return NULL;
    if (o->seed >= 0)
        trace->parameters.seed = o->seed;
    add_points(trace, "until", o->until_count, o->until_mm);
    add_points(trace, "not", o->not_count, o->not_mm);
    return trace;
}

static TreeFileInfo info_of(const Segmenting *segmenting, const Trace *trace, const RbtReport *report, const VesselTree *tree)
{
    return (TreeFileInfo){.source = HEAP_TEXT(segmenting->volume->path),
                          .parameters = segment_parameters_text(&trace->parameters, report, segmenting->volume->volume, tree),
                          .created_by = HEAP_TEXT("seldinger " SELDINGER_VERSION " segment")};
}

static bool segment(SelContext *context, void *what)
{
    Segmenting *segmenting = what;
    Trace *trace = trace_of(&segmenting->options, &context->faults);
    if (!trace)
        return false;
    RbtReport report = {0};
    Progress progress = context_progress(context);
    VesselTree *tree = rbt_track(segmenting->volume->volume, &trace->parameters, trace->branch, trace->branch_count, trace->aneurysm, trace->aneurysm_count,
                                 segmenting->options.threads, progress.call ? &progress : NULL, &report,
                                 segmenting->options.trace ? segmenting->options.trace : "start_mm", &context->faults);
    if (tree)
        segmenting->tree = tree_handle(tree, info_of(segmenting, trace, &report, tree));
    for (int i = 0; tree && i < report.check.warning_count; i++)
        context_message(context, SEL_WARNING, segmenting->volume->path, report.check.warning[i].text);
    rbt_report_free(&report);
    trace_free(trace);
    return tree != NULL;
}

static bool are_points(int count, const double *point)
{
    for (int i = 0; point && i < 3 * count; i++)
        if (!isfinite(point[i]))
            return false;
    return count == 0 || (count > 0 && count <= 64 && point);
}

static bool is_valid_segment(const SelSegmentOptions *o)
{
    bool has_start = o->trace || are_points(1, o->start_mm), has_seed = o->seed < 0 || (o->seed <= 9007199254740991.0 && floor(o->seed) >= o->seed);
    return has_start && has_seed && are_points(o->until_count, o->until_mm) && are_points(o->not_count, o->not_mm) && o->threads >= 0;
}

SelStatus sel_segment(SelContext *context, const SelVolume *volume, const SelSegmentOptions *options, SelTree **tree)
{
    Segmenting segmenting = {.volume = volume};
    if (!context || !volume || !options || !tree)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, volume, options or tree is NULL");
    sel_segment_options_init(&segmenting.options, sizeof segmenting.options);
    if (!options_take(&segmenting.options, sizeof segmenting.options, options) || !is_valid_segment(&segmenting.options))
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__,
                              "size is not set, a point is not finite, there are more than 64 points, or seed or threads is out of range");
    SelStatus status = context_call(context, segment, &segmenting, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *tree = segmenting.tree;
    return status;
}

// --- fitting ---

typedef struct Fitting {
    const SelTree *tree;
    SelFitOptions options;
    SelTree *model;
} Fitting;

// A copy with nodes and points only, the input of a fit.
static VesselTree *points_of(const VesselTree *from)
{
    VesselTree *tree = vessel_tree_create(from->node_count, from->point_count, 0);
    if (!tree)
        heap_is_empty((size_t)from->point_count * sizeof *from->point, __FILE__);
    size_t nodes = (size_t)from->node_count;
    memcpy(tree->center, from->center, nodes * sizeof *tree->center);
    memcpy(tree->radius, from->radius, nodes * sizeof *tree->radius);
    memcpy(tree->direction, from->direction, nodes * sizeof *tree->direction);
    memcpy(tree->height, from->height, nodes * sizeof *tree->height);
    memcpy(tree->parent, from->parent, nodes * sizeof *tree->parent);
    memcpy(tree->kind, from->kind, nodes * sizeof *tree->kind);
    memcpy(tree->point, from->point, (size_t)from->point_count * sizeof *tree->point);
    memcpy(tree->point_offset, from->point_offset, (nodes + 1) * sizeof *tree->point_offset);
    if (!vessel_tree_link(tree))
        heap_is_empty(nodes * sizeof(int), __FILE__);
    return tree;
}

static TreeFitOptions how_of(const Fitting *fitting)
{
    const SelFitOptions *options = &fitting->options;
    TreeFitOptions how = tree_fit_default_options();
    how.local.threads = options->threads;
    how.local.target_mm = options->target_mm;
    how.local.voxel_mm = options->voxel_mm;
    how.has_voxel = options->voxel_mm >= 0;
    how.edge_blur = options->edge_blur_mm;
    tree_fit_complete_options(&how, fitting->tree->tree, &fitting->tree->info);
    return how;
}

static TreeFileInfo model_info(const SelTree *tree, const TreeFitOptions *how)
{
    return (TreeFileInfo){.source = HEAP_TEXT(tree->info.source ? tree->info.source : ""),
                          .parameters = tree_fit_parameters(how, &tree->info),
                          .created_by = HEAP_TEXT("seldinger " SELDINGER_VERSION " fit")};
}

static bool fit(SelContext *context, void *what)
{
    Fitting *fitting = what;
    TreeFit fitted = {0};
    const TreeFitOptions how = how_of(fitting);
    VesselTree *points = points_of(fitting->tree->tree);
    Progress progress = context_progress(context);
    bool is_good = tree_fit(points, "sel_fit", &how, progress.call ? &progress : NULL, &fitted, &context->faults);
    vessel_tree_free(points);
    if (is_good)
        fitting->model = tree_handle(fitted.model, model_info(fitting->tree, &how));
    return is_good;
}

static bool is_valid_fit(const SelFitOptions *o)
{
    return o->target_mm >= 0 && o->target_mm <= 100 && o->voxel_mm <= 100 && o->edge_blur_mm <= 100 && o->threads >= 0;
}

SelStatus sel_fit(SelContext *context, const SelTree *tree, const SelFitOptions *options, SelTree **model)
{
    enum { LEAST_POINTS = 4 };
    Fitting fitting = {.tree = tree};
    if (!context || !tree || !model)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, tree or model is NULL");
    sel_fit_options_init(&fitting.options, sizeof fitting.options);
    if (!options_take(&fitting.options, sizeof fitting.options, options) || !is_valid_fit(&fitting.options))
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "size is not set, a length is not finite or above 100 mm, or threads is negative");
    if (tree->tree->point_count < LEAST_POINTS)
        return context_refuse(context, SEL_ERROR_INPUT, __func__, "the tree has fewer than 4 points on the wall");
    SelStatus status = context_call(context, fit, &fitting, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *model = fitting.model;
    return status;
}

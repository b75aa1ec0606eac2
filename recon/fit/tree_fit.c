#include "recon/fit/tree_fit.h"

#include "base/base.h"
#include "recon/volume/blurred_edge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const char *const fit_preset_name[] = {"default", "local", "paper", NULL};

TreeFitOptions tree_fit_default_options(void)
{
    return (TreeFitOptions){.sweep = sweep_fit_default_options(), .local = lim_fit_default_options(), .edge_blur = -1};
}

static FieldFitOptions shared_options(const TreeFitOptions *options)
{
    FieldFitOptions field = field_fit_default_options();
    field.threads = options->local.threads;
    field.target_mm = options->local.target_mm;
    field.voxel_mm = options->local.voxel_mm;
    return field;
}

static SweepFitOptions swept_options(const TreeFitOptions *options)
{
    SweepFitOptions sweep = options->sweep;
    SectionKind kind = fit_model_section(options->model);
    if (options->preset == FIT_PAPER)
        sweep = sweep_fit_paper_options(kind == SECTION_POLAR ? SECTION_RASTER : kind);
    else
        sweep.section = section_default_options(kind, SECTION_MENDED);
    sweep.threads = options->local.threads;
    sweep.voxel_mm = options->local.voxel_mm;
    if (sweep.voxel_mm > 0)
        sweep.section.voxel_mm = sweep.voxel_mm;
    return sweep;
}

static int describe_fit(const TreeFitOptions *options, char *text, size_t capacity)
{
    const LimFitOptions *o = &options->local;
    if (fit_model_is_swept(options->model)) {
        SweepFitOptions w = swept_options(options);
        return snprintf(text, capacity,
                        "fit:\n  model: %s\n  preset: %s\n  section: %s\n  edge_blur_mm: %g\n  voxel_mm: %g\n  spacing_radii: %g\n  fork_spacing_radii: %g\n  "
                        "harmonics: %d\n  rounds: %d\n"
                        "  blend: %g\ntree:\n",
                        sweep_file_group(fit_model_section(options->model)), fit_preset_name[options->preset], section_kind_name[w.section.kind],
                        options->edge_blur, o->voxel_mm, w.spacing, w.fork_spacing, w.harmonics, w.rounds, w.blend);
    }
    if (options->preset == FIT_DEFAULT) {
        FieldFitOptions f = shared_options(options);
        return snprintf(text, capacity,
                        "fit:\n  preset: %s\n  edge_blur_mm: %g\n  target_mm: %g\n  voxel_mm: %g\n  tolerance_voxels: %g\n  tolerance_radii: %g\n"
                        "  tolerance_without_voxel_radii: %g\n  least_reach_voxels: %g\n  significance: %g\n  levels: %d\ntree:\n",
                        fit_preset_name[options->preset], options->edge_blur, f.target_mm, f.voxel_mm, f.tolerance_voxels, f.tolerance, f.tolerance_unknown,
                        f.least_reach_voxels, f.significance, f.levels);
    }
    return snprintf(
        text, capacity,
        "fit:\n  preset: %s\n  edge_blur_mm: %g\n  alpha: %g\n  beta: %g\n  s: %g\n  iso_level: %g\n  max_blobs: %d\n  target_mm: %g\n  voxel_mm: %g\n"
        "  topological_distance: %d\n  max_loops: %d\n  line_searches: %d\n  weigh_distance: %d\n  project_points: %d\n"
        "  sweep_all_blobs: %d\n  give_up_splits: %d\n  extend_inlet: %d\n  guard_shape: %d\n  agree: %d\n  max_points: %d\ntree:\n",
        fit_preset_name[options->preset], options->edge_blur, o->alpha, o->beta, o->s, o->iso_level, o->max_blobs, o->target_mm, o->voxel_mm,
        o->topological_distance, o->max_loops, o->line_searches, o->weigh_distance, o->project_points, o->sweep_all_blobs, o->give_up_splits, o->extend_inlet,
        o->guard_shape, o->agree, o->max_points);
}

char *tree_fit_parameters(const TreeFitOptions *options, const TreeFileInfo *tree)
{
    size_t capacity = 1024 + 4 * (tree->parameters ? strlen(tree->parameters) : 0);
    char *text = HEAP_ZEROED(capacity, 1);
    int n = describe_fit(options, text, capacity);
    char *out = text + n;
    bool line_start = true;
    for (const char *in = tree->parameters; in && *in && out < text + capacity - 4; in++) {
        if (line_start)
            *out++ = ' ', *out++ = ' ';
        *out++ = *in;
        line_start = *in == '\n';
    }
    *out = '\0';
    return text;
}

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void tree_fit_complete_options(TreeFitOptions *options, const VesselTree *tree, const TreeFileInfo *info)
{
    if (!options->has_voxel) {
        double stated = tree_file_number(info, "voxel_mm", 0);
        options->local.voxel_mm = stated > 1e-4 && stated < 100 ? stated : 0;
    }
    if (options->edge_blur < 0)      // the points of a model were already corrected by its fit
        options->edge_blur = vessel_tree_is_model(tree) || options->preset == FIT_PAPER ? 0 : fmax(tree_file_number(info, "edge_blur_mm", 0), 0);
}

bool tree_fit(VesselTree *tree, const char *path, const TreeFitOptions *options, const Progress *progress, TreeFit *fit, Faults *faults)
{
    *fit = (TreeFit){0};
    if (!options->is_corrected && !blurred_edge_correct(tree, options->edge_blur)) {
        faults_add(faults, path, 0, 0, "not enough memory");
        return false;
    }
    double begin = seconds_now();
    if (fit_model_is_swept(options->model)) {
        SweepFitOptions sweep = swept_options(options);
        fit->sweep = sweep_fit(tree, &sweep, &fit->figures, faults);
        fit->left_out = fit->figures.left_out;
    } else if (options->preset == FIT_DEFAULT) {
        FieldFitOptions shared = shared_options(options);
        shared.left_out = &fit->left_out;
        fit->model = field_fit(tree, &shared, progress, faults);
    } else {
        fit->model = lim_fit(tree, &options->local, progress, faults);
    }
    fit->seconds = seconds_now() - begin;
    return fit->model || fit->sweep;
}

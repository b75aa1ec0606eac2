// seldinger fit: fits a model (LIM) to a tree of point sets, and prints the figures of tables 3 and 4 of the paper (Kerrien et al. 2017).
#include "cli/cli.h"

#include "cli/fit_options.h"
#include "cli/output_plan.h"
#include "recon/recon.h"
#include "render/render.h"

#include <stdlib.h>
#include <string.h>

static VesselTree *load_tree(const FitCommand *command, TreeFileInfo *info, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", command->output);
    output_plan_write(&plan, "--json", command->json);
    output_plan_picture(&plan, "--picture", command->picture);
    output_plan_picture(&plan, "--junctions", command->junctions.picture);
    output_plan_series(&plan, "--junctions", ".png");
    output_plan_read(&plan, "the tree", command->tree);
    output_plan_read_volume(&plan, "--volume", command->junctions.volume);
    VesselTree *tree = tree_file_load(command->tree, info, faults);
    if (tree && tree->point_count < 4)
        faults_add(faults, command->tree, 0, 0, "has %d nodes and %lld points; expected at least 4 points on the wall", tree->node_count,
                   (long long)tree->point_count);
    if (tree && !command->output && !vessel_tree_is_model(tree))
        faults_add(faults, command->tree, 0, 0, "is a tree without a model; fit it with -o MODEL.h5");
    return tree;
}

static bool save(const FitCommand *command, const VesselTree *model, const TreeFileInfo *from, Faults *faults)
{
    TreeFileInfo info = {
        .source = from->source, .parameters = tree_fit_parameters(&command->fit, from), .created_by = (char *)(size_t) "seldinger " SELDINGER_VERSION " fit"};
    bool good = tree_file_save(model, &info, command->output, faults);
    free(info.parameters);
    return good;
}

// Prints the figures to standard output and writes them as JSON. False with faults.
static bool write_results(const FitCommand *command, const TreeFit *fit, Faults *faults)
{
    bool prints = !command->quiet && !cli_is_standard_output(command->json);
    double voxel = command->fit.local.voxel_mm > 0 ? command->fit.local.voxel_mm : lim_fit_default_options().voxel_mm;
    FitFigures figures = fit_figures(fit->model, voxel, fit->seconds);
    figures.left_out = (long)fit->left_out;
    ModelMeasure measure;
    if (command->measure && !model_measure(fit->model, NULL, command->fit.local.threads, &measure)) {
        faults_add(faults, command->tree, 0, 0, "out of memory while measuring the model");
        return false;
    }
    if (prints)
        fit_figures_print(stdout, fit->model, &figures, voxel);
    if (prints && command->measure)
        model_measure_print(stdout, &measure);
    cJSON *root = cJSON_CreateObject();
    bool good = (!prints && !command->json) || reach_report(fit->model, command->tree, command->junctions.tool_radius, prints ? stdout : NULL, root, faults);
    fit_figures_add(root, fit->model, &figures, voxel);
    if (command->measure)
        model_measure_add(root, &measure);
    good = good && (!command->json || cli_write_json(command->json, root, faults));
    cJSON_Delete(root);
    return good;
}

static bool draw(const FitCommand *command, const VesselTree *model, Faults *faults)
{
    bool good = junction_pages_draw(&command->junctions, command->output ? command->output : command->tree, model, faults);
    return good && (!command->picture || picture_model_fit(command->picture, model, faults));
}

static int call(void *structure, Faults *faults)
{
    FitCommand *command = structure;
    TreeFileInfo from = {0};
    TreeFit fit = {0};
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "fit", command->quiet);
    VesselTree *tree = load_tree(command, &from, faults);
    bool good = faults->count == 0;
    if (good)
        tree_fit_complete_options(&command->fit, tree, &from);
    if (good && command->output)
        good = tree_fit(tree, command->tree, &command->fit, &progress, &fit, faults) && save(command, fit.model, &from, faults);
    else
        fit.model = tree, tree = NULL;
    good = good && write_results(command, &fit, faults) && draw(command, fit.model, faults);
    vessel_tree_free(fit.model);
    vessel_tree_free(tree);
    tree_file_info_free(&from);
    return EXIT_DONE;
}

const Verb fit_verb = {.options = &fit_options, .call = call};

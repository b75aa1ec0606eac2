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

// Saves the new model with the tree, and with the models of other kinds from the tree's file.
static bool save(const FitCommand *command, const TreeFit *fit, const VesselTree *tree, const TreeFileInfo *from, Faults *faults)
{
    SweepModels swept;
    if (!sweep_models_load(command->tree, tree, &swept, faults))
        return false;
    SweepModel **place = fit->sweep ? &swept.of[fit_model_section(command->fit.model)] : NULL, *replaced = place ? *place : NULL;
    if (place)
        *place = fit->sweep;
    TreeFileInfo info = {
        .source = from->source, .parameters = tree_fit_parameters(&command->fit, from), .created_by = (char *)(size_t) "seldinger " SELDINGER_VERSION " fit"};
    bool good = tree_file_save_with(fit->sweep ? tree : fit->model, &swept, &info, command->output, faults);
    free(info.parameters);
    if (place)
        *place = replaced;
    sweep_models_free(&swept);
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

// The figures of a swept model.
static bool write_sweep_results(const FitCommand *command, const TreeFit *fit, Faults *faults)
{
    const SweepFitFigures *f = &fit->figures;
    SectionKind kind = fit_model_section(command->fit.model);
    if (!command->quiet && !cli_is_standard_output(command->json))
        printf("swept model with sections of kind %s: %d branches, %d sections, %lld numbers, %.1f s\n"
               "distance of %lld points from the wall: mean %.4f, 99 %% %.4f, largest %.4f mm; noise %.4f mm\n"
               "%lld points left out (another vessel's lumen, outliers), %lld beyond the focal line of a bend, %lld where a section is not star-shaped\n"
               "%d sections are stored as %s: a polar section does not hold them\n",
               section_kind_name[kind], fit->sweep->branch_count, fit->sweep->row_count, (long long)f->numbers, f->seconds, (long long)f->points, f->mean,
               f->p99, f->most, f->noise, (long long)f->left_out, (long long)f->folded, (long long)f->not_star_shaped, f->shaped,
               section_kind_name[kind == SECTION_POLAR ? SECTION_RASTER : kind]);
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "model", sweep_file_group(kind));
    cJSON_AddNumberToObject(root, "branches", fit->sweep->branch_count);
    cJSON_AddNumberToObject(root, "sections", fit->sweep->row_count);
    cJSON_AddNumberToObject(root, "numbers", (double)f->numbers);
    cJSON_AddNumberToObject(root, "points", (double)f->points);
    cJSON_AddNumberToObject(root, "mean_mm", f->mean);
    cJSON_AddNumberToObject(root, "p99_mm", f->p99);
    cJSON_AddNumberToObject(root, "max_mm", f->most);
    cJSON_AddNumberToObject(root, "noise_mm", f->noise);
    cJSON_AddNumberToObject(root, "left_out", (double)f->left_out);
    cJSON_AddNumberToObject(root, "folded", (double)f->folded);
    cJSON_AddNumberToObject(root, "not_star_shaped", (double)f->not_star_shaped);
    cJSON_AddNumberToObject(root, "shaped_sections", f->shaped);
    cJSON_AddNumberToObject(root, "seconds", f->seconds);
    bool good = !command->json || cli_write_json(command->json, root, faults);
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
        good = tree_fit(tree, command->tree, &command->fit, &progress, &fit, faults) && save(command, &fit, tree, &from, faults);
    else
        fit.model = tree, tree = NULL;
    if (good && fit.sweep)
        good = write_sweep_results(command, &fit, faults);
    else
        good = good && write_results(command, &fit, faults) && draw(command, fit.model, faults);
    sweep_model_free(fit.sweep);
    vessel_tree_free(fit.model);
    vessel_tree_free(tree);
    tree_file_info_free(&from);
    return EXIT_DONE;
}

const Verb fit_verb = {.options = &fit_options, .call = call};

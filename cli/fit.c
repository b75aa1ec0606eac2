// seldinger fit: fits a model to a tree of point sets, and prints the figures of tables 3 and 4 of the paper (Kerrien et al. 2017).
#include "cli/cli.h"

#include "cli/fit_options.h"
#include "cli/output_plan.h"
#include "recon/recon.h"
#include "render/render.h"

#include <stdlib.h>
#include <string.h>

// Loads the tree with the models that its file has. Without -o one of these is measured.
static bool load(const FitCommand *command, ModelFile *file, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", command->output);
    output_plan_write(&plan, "--json", command->json);
    output_plan_picture(&plan, "--picture", command->picture);
    output_plan_picture(&plan, "--junctions", command->junctions.picture);
    output_plan_series(&plan, "--junctions", ".png");
    output_plan_read(&plan, "the tree", command->tree);
    output_plan_read_volume(&plan, "--volume", command->junctions.volume);
    if (!model_file_load(command->tree, command->output || !command->has_model ? -1 : (int)command->fit.model, file, faults))
        return false;
    if (file->tree->point_count < 4)
        faults_add(faults, command->tree, 0, 0, "has %d nodes and %lld points; expected at least 4 points on the wall", file->tree->node_count,
                   (long long)file->tree->point_count);
    if (!command->output && file->kind < 0)
        faults_add(faults, command->tree, 0, 0, "is a tree without a model; fit it with -o MODEL.h5");
    return faults->count == 0;
}

// Saves the new model with the tree, and with the models of other kinds from the tree's file.
static bool save(const FitCommand *command, const TreeFit *fit, const ModelFile *file, Faults *faults)
{
    SweepModels swept = file->swept;
    if (fit->sweep)
        swept.of[fit_model_section(command->fit.model)] = fit->sweep;
    TreeFileInfo info = {.source = file->info.source,
                         .parameters = tree_fit_parameters(&command->fit, &file->info),
                         .created_by = (char *)(size_t) "seldinger " SELDINGER_VERSION " fit"};
    bool good = tree_file_save_with(fit->sweep ? file->tree : fit->model, &swept, &info, command->output, faults);
    free(info.parameters);
    return good;
}

// Prints the figures to standard output and writes them as JSON. False with faults.
static bool write_results(const FitCommand *command, const TreeFit *fit, const ModelField *model, Faults *faults)
{
    bool prints = !command->quiet && !cli_is_standard_output(command->json);
    double voxel = command->fit.local.voxel_mm > 0 ? command->fit.local.voxel_mm : lim_fit_default_options().voxel_mm;
    FitFigures figures = fit_figures(model, voxel, fit->seconds);
    figures.left_out += fit->sweep ? 0 : (long)fit->left_out;
    ModelMeasure measure;
    if (command->measure && !model_measure(model, NULL, command->fit.local.threads, &measure)) {
        faults_add(faults, command->tree, 0, 0, "out of memory while measuring the model");
        return false;
    }
    if (prints && fit->sweep)
        sweep_figures_print(stdout, fit->sweep, fit_model_section(command->fit.model), &fit->figures);
    if (prints)
        fit_figures_print(stdout, model, &figures, voxel);
    if (prints && command->measure)
        model_measure_print(stdout, &measure);
    cJSON *root = cJSON_CreateObject();
    bool good = (!prints && !command->json) || reach_report(model, command->tree, command->junctions.tool_radius, prints ? stdout : NULL, root, faults);
    if (fit->sweep)
        sweep_figures_add(root, fit->sweep, fit_model_section(command->fit.model), &fit->figures);
    fit_figures_add(root, model, &figures, voxel);
    if (command->measure)
        model_measure_add(root, &measure);
    good = good && (!command->json || cli_write_json(command->json, root, faults));
    cJSON_Delete(root);
    return good;
}

static bool draw(const FitCommand *command, const ModelField *model, Faults *faults)
{
    bool good = junction_pages_draw(&command->junctions, command->output ? command->output : command->tree, model, faults);
    return good && (!command->picture || picture_model_fit(command->picture, model, faults));
}

// Fits, saves, and makes the new model the one that is looked at.
static bool fit_and_save(FitCommand *command, ModelFile *file, TreeFit *fit, Faults *faults)
{
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "fit", command->quiet);
    if (!tree_fit(file->tree, command->tree, &command->fit, &progress, fit, faults) || !save(command, fit, file, faults))
        return false;
    model_field_free(&file->field);
    file->field = model_field_of_blobs(fit->model);
    if (!fit->sweep || model_field_of_sweep(file->tree, fit->sweep, &file->field))
        return true;
    faults_add(faults, command->tree, 0, 0, "out of memory while measuring the model");
    return false;
}

static int call(void *structure, Faults *faults)
{
    FitCommand *command = structure;
    ModelFile file;
    TreeFit fit = {0};
    bool good = load(command, &file, faults);
    if (good)
        tree_fit_complete_options(&command->fit, file.tree, &file.info);
    good = good && (!command->output || fit_and_save(command, &file, &fit, faults));
    good = good && write_results(command, &fit, &file.field, faults) && draw(command, &file.field, faults);
    model_file_free(&file);
    sweep_model_free(fit.sweep);
    vessel_tree_free(fit.model);
    return EXIT_DONE;
}

const Verb fit_verb = {.options = &fit_options, .call = call};

// seldinger import: makes from a surface, with or without centrelines, the tree of nodes and local points that `fit` takes (recon/surface/import_surface.h).
#include "cli/cli.h"

#include "cli/import_options.h"
#include "base/base.h"
#include "cli/output_plan.h"
#include "recon/recon.h"

#include <stdlib.h>
#include <time.h>

enum { TEXT_MAX = 4096 };

static bool write_curves(const ImportCommand *command, const CurveSet *set, Faults *faults)
{
    size_t length;
    char *text = centreline_text(set, command->centreline_out, &length, faults);
    bool good = text && output_write(command->centreline_out, text, length, faults);
    free(text);
    return good;
}

static bool save(const ImportCommand *command, const VesselTree *tree, Faults *faults)
{
    char parameters[512], created_by[] = "seldinger " SELDINGER_VERSION " import", source[] = "surface";
    snprintf(parameters, sizeof parameters, "surface: %.200s\ncentrelines: %d\nscale: %g\nspacing: %g\npoints_per_node: %g\n", command->surface,
             command->centreline_count, command->scale, command->options.spacing, command->options.points_per_node);
    TreeFileInfo info = {.source = source, .parameters = parameters, .created_by = created_by};
    return tree_file_save(tree, &info, command->output, faults);
}

static bool write_figures(const ImportCommand *command, const ImportFigures *figures, Faults *faults)
{
    char text[TEXT_MAX];
    cJSON *root = cJSON_CreateObject();
    import_figures_add(root, figures);
    bool good = !command->json || cli_write_json(command->json, root, faults);
    cJSON_Delete(root);
    if (good && !command->quiet && !cli_is_standard_output(command->json)) {
        mesh_check_text(&figures->check, true, text, sizeof text);
        cli_notes(stdout, command->surface, text);
        import_figures_print(stdout, command->surface, figures);
    }
    return good;
}

static void plan_files(const ImportCommand *command, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", command->output);
    output_plan_write(&plan, "--json", command->json);
    output_plan_write(&plan, "--centerline-out", command->centreline_out);
    output_plan_read(&plan, "--surface", command->surface);
    for (int k = 0; k < command->centreline_count; k++)
        output_plan_read(&plan, "--centreline", command->centreline[k]);
}

// Makes the tree of `mesh` and writes it; false with faults.
static bool import(const ImportCommand *command, const SurfaceMesh *mesh, ImportFigures *found, Faults *faults)
{
    CurveSet *set =
        import_load_curves(mesh, command->scale, command->centreline_count, command->centreline, &command->options, &found->report, command->surface, faults);
    VesselTree *tree = set ? import_surface(mesh, set, &command->options, &found->report, command->surface, faults) : NULL;
    const double left = import_left_percent(&found->report);
    if (tree && found->computed && left > IMPORT_LEFT_MOST_PERCENT)
        faults_add(faults, command->surface, 0, 0,
                   "the computed centrelines miss %.0f %% of the surface, more than %d %%: no tree is written; give --centerline F", left,
                   IMPORT_LEFT_MOST_PERCENT);
    bool good = tree && faults->count == 0 && save(command, tree, faults) && (!command->centreline_out || write_curves(command, set, faults));
    if (good) {
        found->curve_count = set->curve_count;
        found->nodes = tree->node_count;
        found->points = (long)tree->point_count;
    }
    vessel_tree_free(tree);
    curve_set_free(set);
    return good;
}

static int call(void *structure, Faults *faults)
{
    const ImportCommand *command = structure;
    ImportFigures found = {.computed = command->centreline_count == 0, .report = {.curves_scaled = 1, .inside_percent = 100}};
    plan_files(command, faults);
    double start = clock_s(CLOCK_MONOTONIC);
    SurfaceMesh *mesh =
        faults->count == 0 ? mesh_load_repaired(command->surface, command->has_scale ? command->scale : 0, "--scale ", &found.check, faults) : NULL;
    bool good = mesh && import(command, mesh, &found, faults);
    found.seconds = clock_s(CLOCK_MONOTONIC) - start;
    if (good)
        write_figures(command, &found, faults);
    surface_free(mesh);
    return EXIT_DONE;
}

const Verb import_verb = {.options = &import_options, .call = call};

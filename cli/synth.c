// seldinger synth: makes synthetic shapes with known truth, as point sets, surfaces or noisy volumes; measures a fitted model against the truth.
#include "cli/cli.h"

#include "cli/synth_options.h"
#include "cli/output_plan.h"
#include "recon/recon.h"

#include <stdlib.h>
#include <string.h>

static bool measure(const SynthCommand *command, const Shape *shape, Faults *faults)
{
    ModelFile file;
    ShapeMeasure figures;
    bool good = model_file_load_model(command->measure, command->model, &file, faults) && shape_measure(shape, &file.field, &figures);
    if (!good && faults->count == 0)
        faults_add(faults, command->measure, 0, 0, "out of memory");
    cJSON *root = cJSON_CreateObject();
    if (good && command->json) {
        shape_measure_add(root, &figures);
        good = cli_write_json(command->json, root, faults);
    }
    if (good && !command->quiet && !cli_is_standard_output(command->json))
        shape_measure_print(stdout, &figures);
    cJSON_Delete(root);
    model_file_free(&file);
    return good;
}

static int call(void *structure, Faults *faults)
{
    const SynthCommand *command = structure;
    Shape *shape = shape_create(command->files.name, command->files.option_count, command->files.option, "synth", faults);
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", command->output);
    output_plan_write(&plan, "--json", command->json);
    output_plan_read(&plan, "--measure", command->measure);
    if (faults->count == 0 && command->measure)
        measure(command, shape, faults);
    else if (faults->count == 0)
        phantom_write(&command->files, shape, command->output, command->quiet ? NULL : stdout, faults);
    shape_free(shape);
    return EXIT_DONE;
}

const Verb synth_verb = {.options = &synth_options, .call = call};

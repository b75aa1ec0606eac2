#include "recon/model_file.h"

const char *const model_names[MODELS + 1] = {"lim", "sweep", "raster", "rbf", "pas", NULL};

static bool choose(const char *path, int kind, ModelFile *file, Faults *faults)
{
    file->kind = -1;
    for (int i = MODELS - 1; i >= 0; i--)
        if ((kind < 0 || kind == i) && (i == 0 ? vessel_tree_is_model(file->tree) : file->swept.of[i - 1] != NULL))
            file->kind = i;
    if (kind >= 0 && file->kind < 0) {
        faults_add(faults, path, 0, 0, "has no model of the kind '%s'; `seldinger fit --model %s` makes one", model_names[kind], model_names[kind]);
        return false;
    }
    file->sweep = file->kind > 0 ? file->swept.of[file->kind - 1] : NULL;
    file->field = model_field_of_blobs(file->tree);
    if (!file->sweep || model_field_of_sweep(file->tree, file->sweep, &file->field))
        return true;
    faults_add(faults, path, 0, 0, "not enough memory for the model");
    return false;
}

bool model_file_load(const char *path, int kind, ModelFile *file, Faults *faults)
{
    *file = (ModelFile){.kind = -1};
    file->tree = tree_file_load(path, &file->info, faults);
    if (file->tree && sweep_models_load(path, file->tree, &file->swept, faults) && choose(path, kind, file, faults))
        return true;
    model_file_free(file);
    return false;
}

bool model_file_load_model(const char *path, int kind, ModelFile *file, Faults *faults)
{
    if (!model_file_load(path, kind, file, faults))
        return false;
    if (file->kind >= 0)
        return true;
    faults_add(faults, path, 0, 0, "is a tree without a model; make one with `seldinger fit`");
    model_file_free(file);
    return false;
}

void model_file_free(ModelFile *file)
{
    model_field_free(&file->field);
    sweep_models_free(&file->swept);
    tree_file_info_free(&file->info);
    vessel_tree_free(file->tree);
    *file = (ModelFile){.kind = -1};
}

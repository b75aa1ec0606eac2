// A problem with the cache is never an error: the shape is then fitted again.
#include "sim/fitted_shape.h"

#include "base/base.h"
#include "recon/recon.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { CACHE_PATH = 4096 };

// The folder of the cache, created if it does not exist; false if none is available.
static bool cache_folder(char folder[CACHE_PATH])
{
    return folders_cache(folder, CACHE_PATH - 128) && folders_create(folder) && access(folder, R_OK | W_OK | X_OK) == 0;
}

// The key covers all inputs of fit_shape(): the shape with its options, the kind of contact, and the program or library itself, whose defaults are the fit's
// options. Returns false if the program cannot be read.
static bool cache_key(const Scene *scene, char hex[65])
{
    int kind = contact_is_local(scene->contact) ? 1 : contact_is_swept(scene->contact) ? 2 + (int)contact_section(scene->contact) : 0;
    Sha256 sha;
    char program[PROCESS_CODE_ID];
    if (!process_code_id(program))
        return false;
    sha256_begin(&sha);
    sha256_add(&sha, program, strlen(program));
    sha256_add(&sha, &kind, sizeof kind);
    sha256_add(&sha, scene->shape_name, strlen(scene->shape_name) + 1);
    for (int i = 0; i < scene->shape_option_count; i++)
        for (int j = 0; j < 2; j++)
            sha256_add(&sha, scene->shape_option[i][j], strlen(scene->shape_option[i][j]) + 1);
    sha256_end(&sha, hex);
    return true;
}

VesselTree *fit_samples(const VesselTree *sampled, ContactKind contact, const LimFitOptions *options, const Progress *progress, Faults *faults)
{
    if (contact_is_local(contact))
        return lim_fit(sampled, options, progress, faults);
    FieldFitOptions shared = field_fit_default_options();
    shared.voxel_mm = options->voxel_mm;
    shared.threads = options->threads;
    return field_fit(sampled, &shared, progress, faults);
}

SweepModel *sweep_samples(const VesselTree *sampled, SectionKind kind, double voxel_mm, int threads, Faults *faults)
{
    SweepFitOptions options = sweep_fit_default_options();
    options.section = section_default_options(kind, SECTION_MENDED);
    options.voxel_mm = voxel_mm;
    options.threads = threads;
    return sweep_fit(sampled, &options, NULL, faults);
}

static VesselTree *fit_shape(const Scene *scene, int threads, const Progress *progress, SweepModel **sweep, Faults *faults)
{
    LimFitOptions options = lim_fit_default_options();
    // exact samples allow a tighter fit than an angiogram's
    options.voxel_mm = shape_options_voxel_mm(scene->shape_option_count, (const char(*)[2][64])scene->shape_option);
    options.threads = threads;
    VesselTree *sampled = shape_tree(scene->shape_name, scene->shape_option_count, (const char(*)[2][64])scene->shape_option, scene->path, faults);
    if (sweep) {
        *sweep = sampled ? sweep_samples(sampled, contact_section(scene->contact), options.voxel_mm, threads, faults) : NULL;
        if (*sweep)
            return sampled;
        vessel_tree_free(sampled);
        return NULL;
    }
    VesselTree *model = sampled ? fit_samples(sampled, scene->contact, &options, progress, faults) : NULL;
    vessel_tree_free(sampled);
    return model;
}

// The cached model. `sweep` may be NULL, see fitted_shape.
static VesselTree *load_cached(const char *path, SectionKind kind, SweepModel **sweep, Faults *ignored)
{
    VesselTree *model = tree_file_load(path, NULL, ignored);
    if (model && sweep)
        *sweep = sweep_file_load(path, kind, model, ignored);
    if (model && !(sweep ? *sweep != NULL : vessel_tree_is_model(model))) {
        vessel_tree_free(model);
        return NULL;
    }
    return model;
}

VesselTree *fitted_shape(const Scene *scene, int threads, const Progress *progress, SweepModel **sweep, Faults *faults)
{
    char folder[CACHE_PATH], path[CACHE_PATH] = "", hex[65];
    Faults *ignored = calloc(1, sizeof *ignored);
    VesselTree *model = NULL;
    if (ignored && cache_folder(folder) && cache_key(scene, hex)) {
        snprintf(path, sizeof path, "%.4000s/fit-%.32s.h5", folder, hex);
        if (access(path, R_OK) == 0)
            model = load_cached(path, contact_section(scene->contact), sweep, ignored);
    }
    if (!model) {
        model = fit_shape(scene, threads, progress, sweep, faults);
        char source[sizeof scene->shape_name];
        strcpy(source, scene->shape_name);
        char created_by[] = "seldinger " SELDINGER_VERSION, parameters[] = "";
        TreeFileInfo info = {.source = source, .parameters = parameters, .created_by = created_by};
        SweepModels swept = {{NULL}};
        if (sweep)
            swept.of[contact_section(scene->contact)] = *sweep;
        if (model && *path)
            tree_file_save_with(model, &swept, &info, path, ignored);
    }
    free(ignored);
    return model;
}

#include "cli/export_tree.h"

#include "cli/cli.h"

#include <string.h>

const char *const export_frames[] = {"LPS", "RAS", NULL};

static bool export_surface(const ExportOptions *options, const char *extension, const ModelFile *file, Faults *faults)
{
    ModelSurfaceOptions wanted = options->surface;
    SurfaceFigures surface;
    OutputText text;
    void (*print)(FILE *, const SurfaceFigures *) = !strcmp(extension, ".stl")   ? surface_print_stl
                                                    : !strcmp(extension, ".ply") ? surface_print_ply
                                                    : !strcmp(extension, ".obj") ? surface_print_obj
                                                                                 : surface_print_vtp;
    wanted.with_error = print == surface_print_ply || print == surface_print_vtp;
    wanted.figures = options->quiet || cli_is_standard_output(options->out) ? NULL : stdout;
    wanted.warnings = stderr;
    bool good = model_surface(&file->field, options->in, &wanted, &surface, faults);
    if (good && output_text_open(&text)) {
        print(text.stream, &surface);
        good = output_text_write(&text, options->out, faults);
    } else if (good) {
        faults_add(faults, options->out, 0, 0, "cannot be written: out of memory");
        good = false;
    }
    model_surface_free(&surface);
    return good;
}

static bool export_mask(const ExportOptions *options, const ModelFile *file, Faults *faults)
{
    ModelMaskOptions mask = {.sweep = file->sweep, .spacing_mm = options->spacing, .frame = export_frames[options->frame]};
    return model_mask_write(options->mask, file->tree, options->in, &mask, faults);
}

bool export_tree(const ExportOptions *options, const char *extension, Faults *faults)
{
    ModelFile file;
    if (!model_file_load(options->in, options->model, &file, faults))
        return false;
    bool model = file.kind >= 0, good = false;
    bool line_only = !strcmp(extension, ".swc") || !strcmp(extension, ".json");
    bool surface_only = !strcmp(extension, ".stl") || !strcmp(extension, ".ply") || !strcmp(extension, ".obj");
    bool surface = options->what >= 0 ? options->what == WHAT_SURFACE : surface_only || (model && !line_only);
    if (options->mask && !model)
        faults_add(faults, options->in, 0, 0, "has no model to make a mask of; `seldinger fit` makes one");
    else if (options->mask)
        good = export_mask(options, &file, faults);
    if (!options->out || faults->count > 0)
        ;    // the mask alone
    else if (!line_only && !surface_only && strcmp(extension, ".vtp"))
        faults_add(faults, options->out, 0, 0, "unknown extension '%s' for a tree or model; expected .stl .ply .obj .vtp .mrk.json .swc", extension);
    else if (surface ? line_only : surface_only)
        faults_add(faults, options->out, 0, 0, "'%s' cannot hold a %s; valid: %s", extension, surface ? "surface" : "centreline",
                   surface ? ".stl .ply .obj .vtp" : ".vtp .mrk.json .swc");
    else if (options->surface.tags && (!surface || !strcmp(extension, ".stl") || !strcmp(extension, ".obj")))
        faults_add(faults, options->out, 0, 0, "'%s' cannot hold --tags, which are data of a surface's vertices; valid: .ply .vtp",
                   surface ? extension : "a centreline");
    else if (surface && !model)
        faults_add(faults, options->in, 0, 0, "is a tree without a model, so it has no surface; `seldinger fit` makes one, or export the centreline");
    else
        good = surface ? export_surface(options, extension, &file, faults)
                       : centreline_write_file(options->out, extension, file.tree, export_frames[options->frame], faults);
    model_file_free(&file);
    return good;
}

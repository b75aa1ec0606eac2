// seldinger export: writes surfaces, centrelines and recordings for other programs.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "recon/recon.h"
#include "sim/sim.h"

#include <string.h>

typedef enum { WHAT_SURFACE, WHAT_CENTRELINE, WHAT_CENTERLINE } What;

typedef struct ExportOptions {
    const char *in, *out;
    int what;                // -1: by the file's extension
    int model;               // index in `models`; -1: the first that the file has
    int frame;               // index in `frames`
    int threads;
    ModelSurfaceOptions surface;
    bool quiet;
} ExportOptions;

#define AT(member) OPTION_AT(ExportOptions, member)
static const char *const whats[] = {"surface", "centreline", "centerline", NULL}, *const frames[] = {"LPS", "RAS", NULL}, *const models[] = {"lim",    "sweep",
                                                                                                                                             "raster", "rbf",
                                                                                                                                             "pas",    NULL};
static const Option rows[] = {
    {"what", "surface|centreline", OPTION_CHOICE, AT(what), "what a .vtp holds", .choices = whats,
     .otherwise = "the surface of a model, the centreline of a tree"},
    {"model", "KIND", OPTION_CHOICE, AT(model), "the model whose surface is written: lim (blobs) or a swept one: sweep, raster, rbf, pas", .choices = models,
     .otherwise = "the first of these that FILE has"},
    {"cell-mm", "X", OPTION_NUMBER, AT(surface.cell_mm), "cell size of the surface, or edges of a swept model's [mm]", .least = 0.001, .most = 1000,
     .otherwise = "about ten to twenty cells around the thinnest branch; swept: 24 edges around each section"},
    {"tags", NULL, OPTION_FLAG, AT(surface.tags),
     "also writes for each vertex its branch, the way along it, and the boundary; a swept model ends with flat caps then"},
    {"keep-floating", NULL, OPTION_FLAG, AT(surface.keep_floating),
     "keeps parts of the surface that are not connected to the inlet; by default they are dropped and reported"},
    {"open-inlet", NULL, OPTION_FLAG, AT(surface.open_inlet), "cuts the surface open at the plane of the root; otherwise blobs close it"},
    {"frame", "RAS|LPS", OPTION_CHOICE, AT(frame), "coordinate system written into a .mrk.json; coordinates are never converted", .choices = frames},
    {"output", "OUT", OPTION_FILE, AT(out), "the file to write", .letter = 'o'},
    CLI_QUIET(ExportOptions, quiet, "does not print the figures of a surface: parts, open edges, Euler characteristic, area, volume"),
    {"threads", "N", OPTION_INT, AT(threads), "accepted for uniformity, has no effect", .most = 256, .otherwise = ""},
};

static void set_defaults(void *structure) { *(ExportOptions *)structure = (ExportOptions){.what = -1, .model = -1}; }

static const char *check(void *structure) { return ((ExportOptions *)structure)->out ? NULL : "expected one file and `-o OUT`"; }

static const OptionTable table = {
    .program = "seldinger export",
    .does = "writes a surface, centreline or recording for other programs",
    .usage = "FILE -o OUT [options]",
    .intro = "Converts FILE (a tree, model or recording) for other programs; the extension of OUT selects the format. Lengths are in mm.\n\n"
             "  model, surface         .stl (binary)  .ply  .obj  .vtp; .ply and .vtp also contain for each vertex\n"
             "                         node      node whose local model the vertex lies on\n"
             "                         error_mm  signed distance of the nearest data point to that model, > 0 inside: the model is too wide there\n"
             "                         data_mm   distance of the vertex to that data point: large where there are no data, such as on caps\n"
             "                         with --tags, for flow solvers:\n"
             "                         branch    of the tree, 0 the root's; -1: an aneurysm\n"
             "                         along_mm  way along the branch\n"
             "                         boundary  0 wall, 1 inlet, 2, 3 ... outlets in the order of the branches. A triangle belongs to the flat cap of\n"
             "                                   an end if its three vertices have the same number above 0. Only swept models have such caps\n"
             "                         (.stl and .obj cannot store these)\n"
             "  tree or model, centreline  .vtp (lines with Radius)  .mrk.json (3D Slicer curves)  .swc\n"
             "  recording              .csv (a row per node and frame)  .vtp or .pvd (one .vtp per frame and a .pvd that lists them); with several\n"
             "                         tools all nodes of each, and the tool that carries them: a column of the .csv, numbers (0 outermost) in a .vtp",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(rows, ExportOptions),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(ExportOptions, in),
    .missing = "expected one file and `-o OUT`",
    .too_many = "expected one file and `-o OUT`, not also ",
};

// The model to write: 0 blobs, 1 + kind a swept one; -1: the file lacks it.
static int model_of(const ExportOptions *options, const VesselTree *tree, const SweepModels *swept)
{
    for (int i = 0; i <= SECTION_KINDS; i++)
        if ((options->model < 0 || options->model == i) && (i == 0 ? vessel_tree_is_model(tree) : swept->of[i - 1] != NULL))
            return i;
    return -1;
}

static bool export_surface(const ExportOptions *options, const char *extension, const VesselTree *tree, const SweepModel *sweep, Faults *faults)
{
    ModelSurfaceOptions wanted = options->surface;
    wanted.sweep = sweep;
    SurfaceFigures surface;
    OutputText text;
    void (*print)(FILE *, const SurfaceFigures *) = !strcmp(extension, ".stl")   ? surface_print_stl
                                                    : !strcmp(extension, ".ply") ? surface_print_ply
                                                    : !strcmp(extension, ".obj") ? surface_print_obj
                                                                                 : surface_print_vtp;
    wanted.with_error = print == surface_print_ply || print == surface_print_vtp;
    wanted.figures = options->quiet || cli_is_standard_output(options->out) ? NULL : stdout;
    wanted.warnings = stderr;
    bool good = model_surface(tree, options->in, &wanted, &surface, faults);
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

static bool export_tree(const ExportOptions *options, const char *extension, Faults *faults)
{
    VesselTree *tree = tree_file_load(options->in, NULL, faults);
    if (!tree)
        return false;
    SweepModels swept = {0};
    if (!sweep_models_load(options->in, tree, &swept, faults)) {
        vessel_tree_free(tree);
        return false;
    }
    int chosen = model_of(options, tree, &swept);
    bool model = chosen >= 0, good = false;
    bool line_only = !strcmp(extension, ".swc") || !strcmp(extension, ".json");
    bool surface_only = !strcmp(extension, ".stl") || !strcmp(extension, ".ply") || !strcmp(extension, ".obj");
    bool surface = options->what >= 0 ? options->what == WHAT_SURFACE : surface_only || (model && !line_only);
    if (!line_only && !surface_only && strcmp(extension, ".vtp"))
        faults_add(faults, options->out, 0, 0, "unknown extension '%s' for a tree or model; expected .stl .ply .obj .vtp .mrk.json .swc", extension);
    else if (surface ? line_only : surface_only)
        faults_add(faults, options->out, 0, 0, "'%s' cannot hold a %s; valid: %s", extension, surface ? "surface" : "centreline",
                   surface ? ".stl .ply .obj .vtp" : ".vtp .mrk.json .swc");
    else if (surface && !model && options->model >= 0)
        faults_add(faults, options->in, 0, 0, "has no model of the kind '%s'; `seldinger fit --model %s` makes one", models[options->model],
                   models[options->model]);
    else if (options->surface.tags && (!surface || !strcmp(extension, ".stl") || !strcmp(extension, ".obj")))
        faults_add(faults, options->out, 0, 0, "'%s' cannot hold --tags, which are data of a surface's vertices; valid: .ply .vtp",
                   surface ? extension : "a centreline");
    else if (surface && !model)
        faults_add(faults, options->in, 0, 0, "is a tree without a model, so it has no surface; `seldinger fit` makes one, or export the centreline");
    else
        good = surface ? export_surface(options, extension, tree, chosen > 0 ? swept.of[chosen - 1] : NULL, faults)
                       : centreline_write_file(options->out, extension, tree, frames[options->frame], faults);
    sweep_models_free(&swept);
    vessel_tree_free(tree);
    return good;
}

static bool export_recording(const ExportOptions *options, const char *extension, Faults *faults)
{
    bool is_table = !strcmp(extension, ".csv"), series = !strcmp(extension, ".vtp") || !strcmp(extension, ".pvd");
    if (!is_table && !series) {
        faults_add(faults, options->out, 0, 0, "unknown extension '%s' for a recording%s; expected .csv .vtp .pvd", extension,
                   !strcmp(extension, ".vtkhdf") || !strcmp(extension, ".hdf") ? " (VTKHDF is not supported yet)" : "");
        return false;
    }
    RecordedRun *run = recorded_run_load(options->in, faults);
    bool good = run && (is_table ? recording_export_rows(run, options->out, faults) : recording_export_series(run, options->out, faults));
    recorded_run_free(run);
    return good;
}

static int call(void *structure, Faults *faults)
{
    const ExportOptions *options = structure;
    char extension[16];
    output_extension(options->out, extension);
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "-o", options->out);
    output_plan_series(&plan, "-o", ".vtp");
    output_plan_read(&plan, "the file", options->in);
    if (faults->count > 0)
        return EXIT_BAD_INPUT;
    switch (file_kind(options->in)) {
    case FILE_TREE: export_tree(options, extension, faults); break;
    case FILE_RECORDING: export_recording(options, extension, faults); break;
    case FILE_MISSING: faults_add(faults, options->in, 0, 0, "cannot be opened; give a tree, model or recording"); break;
    default: faults_add(faults, options->in, 0, 0, "cannot be exported; expected a tree, model or recording");
    }
    return EXIT_DONE;
}

const Verb export_verb = {.options = &table, .call = call};

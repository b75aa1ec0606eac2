// seldinger export: surfaces, centrelines and recordings for other programs.
#include "cli/cli.h"

#include "base/heap.h"
#include "base/output.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "geom/surface_parts.h"
#include "recon/surface/centreline_write.h"
#include "recon/surface/surface_write.h"
#include "recon/tree_file.h"
#include "sim/recording.h"
#include "sim/recording_export.h"

#include <getopt.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "Usage: seldinger export FILE -o OUT [options]\n\n"
    "Writes what FILE (a tree, model or recording) holds for other programs; the extension of OUT says how. Lengths mm.\n\n"
    "  model, surface         .stl (binary)  .ply  .obj  .vtp; .ply and .vtp also hold for each vertex\n"
    "                         node      whose local model it lies on\n"
    "                         error_mm  signed distance of the nearest data point to that model, > 0 inside: the model is too wide there\n"
    "                         data_mm   distance of the vertex to that data point: large where there are no data, as on caps\n"
    "                         (.stl and .obj have no place for these)\n"
    "  tree or model, centreline  .vtp (lines with Radius)  .mrk.json (3D Slicer curves)  .swc\n"
    "  recording              .csv (a row a node and frame)  .vtp or .pvd (one .vtp a frame and a .pvd that names them); of several\n"
    "                         tools all nodes of each, with what carries them: a column of the .csv, numbers (0 outermost) in a .vtp\n\n"
    "  --what surface|centreline  what a .vtp holds; default: the surface of a model, the centreline of a tree\n"
    "  --cell-mm X                size of the surface's cells [mm]; default: about ten to twenty cells round the thinnest branch\n"
    "  --keep-floating            also the parts of a surface to which no point gets from the inlet; dropped otherwise, which is said\n"
    "  --open-inlet               the surface is cut open at the root's plane; blobs close it otherwise\n"
    "  --frame RAS|LPS            coordinate system that a .mrk.json names; coordinates are never converted; default LPS\n"
    "  -o OUT                     the file to write\n"
    "  --quiet                    does not print what a surface is: parts, open edges, Euler characteristic, area, volume\n"
    "  --threads N                accepted as everywhere; nothing here takes long\n\n"
    "Exit codes: 0 done; 2 wrong usage or bad input.\n";

typedef struct ExportOptions {
    const char *in, *out, *what, *frame;
    double cell_mm;          // 0: automatic
    bool open_inlet, keep_floating, quiet;
} ExportOptions;

static void print_census(const SurfaceCensus *c, double cell_mm, int bubbles)
{
    printf("surface        %d vertices, %d triangles, cells of %.3g mm\n", c->vertices, c->triangles, cell_mm);
    printf("parts          %d, Euler characteristic %" PRId64 "%s\n", c->parts, c->euler,
           bubbles ? "; bubbles inside the lumen and specks beside it were dropped" : "");
    printf("edges          %" PRId64 " open, %" PRId64 " non-manifold, %" PRId64 " between triangles turned against each other\n", c->open_edges,
           c->non_manifold_edges, c->turned_edges);
    printf("area, volume   %.6g mm2, %.6g mm3\n", c->area, c->volume);
}

// Parts that the flood from the inlet does not reach: how many and where, on standard error, so that it is seen whatever is asked for.
static void say_dropped(const char *file, const SurfaceParts *parts)
{
    enum { SHOWN = 6 };
    int count[PART_KINDS] = {0}, shown = 0;
    double volume = 0;
    for (int p = 0; p < parts->count; p++) {
        const SurfacePart *part = &parts->part[p];
        count[part->kind]++;
        volume += part->kind == PART_SHUT || part->kind == PART_GHOST ? part->volume : 0;
    }
    if (count[PART_SHUT] + count[PART_GHOST] == 0)
        return;
    fprintf(stderr, "%s: %d part%s of the surface dropped, %.3g mm3: %d with nodes of the tree that are shut off from the inlet, %d that hold%s none (--keep-floating keeps them)\n",
            file, count[PART_SHUT] + count[PART_GHOST], count[PART_SHUT] + count[PART_GHOST] == 1 ? "" : "s", volume, count[PART_SHUT], count[PART_GHOST],
            count[PART_GHOST] == 1 ? "s" : "");
    for (int p = 0; p < parts->count && shown < SHOWN; p++) {
        const SurfacePart *part = &parts->part[p];
        if (part->kind != PART_SHUT && part->kind != PART_GHOST)
            continue;
        shown++;
        fprintf(stderr, "    %.3g mm3 with %d nodes at %.2f, %.2f, %.2f (node %d)\n", part->volume, part->nodes, part->place.x, part->place.y, part->place.z,
                part->node);
    }
    if (count[PART_SHUT] + count[PART_GHOST] > shown)
        fprintf(stderr, "    and %d smaller ones\n", count[PART_SHUT] + count[PART_GHOST] - shown);
}

// Bubbles in the lumen, and what hangs on nothing unless that is wanted. False where there is no memory.
static bool drop_parts(const ExportOptions *options, double cell, const VesselTree *tree, TriangleMesh *mesh, int *bubbles)
{
    ReachOptions flood = reach_default_options();
    Reach *reach = reach_create(tree, &flood);
    SurfaceParts *parts = reach ? surface_parts_create(mesh, tree, reach) : NULL;
    bool kinds[PART_KINDS] = {[PART_INLET] = true, [PART_SHUT] = options->keep_floating, [PART_GHOST] = options->keep_floating};
    // specks of a few cells beside the lumen proper come from the lattice, not from the wall
    for (int p = 1; parts && p < parts->count; p++)
        if (parts->part[p].kind == PART_INLET && parts->part[p].volume < 64 * cell * cell * cell)
            parts->part[p].kind = PART_BUBBLE;
    bool good = parts && surface_parts_keep(mesh, parts, kinds);
    *bubbles = 0;
    for (int p = 0; good && p < parts->count; p++)
        *bubbles += parts->part[p].kind == PART_BUBBLE;
    if (good && !options->keep_floating)
        say_dropped(options->in, parts);
    surface_parts_free(parts);
    reach_free(reach);
    return good;
}

// The surface as it will be written, what there is to say of it told. False with faults.
static bool make_surface(const ExportOptions *options, bool with_error, const VesselTree *tree, SurfaceFigures *surface, Faults *faults)
{
    double cell = options->cell_mm > 0 ? options->cell_mm : isosurface_cell_for(tree);
    TriangleMesh *mesh = surface->mesh = isosurface_of_tree(tree, cell);
    if (!mesh || mesh->triangle_count < 1) {
        faults_add(faults, options->in, 0, 0, "gives no surface: %s", mesh ? "the model is empty at this --cell-mm" : "no memory; a larger --cell-mm may do");
        return false;
    }
    SurfaceCensus census;
    int bubbles;
    bool good = drop_parts(options, cell, tree, mesh, &bubbles);
    if (options->open_inlet && !surface_open_inlet(mesh, tree)) {
        faults_add(faults, options->in, 0, 0, "has no inlet to open: the tree goes on upstream of its root, or the root's points close it; leave --open-inlet away");
        return false;
    }
    good = good && surface_census(mesh, &census);
    if (good && with_error && tree->point_count > 0) {
        surface->error = malloc(((size_t)mesh->vertex_count + 1) * sizeof *surface->error);
        surface->distance = malloc(((size_t)mesh->vertex_count + 1) * sizeof *surface->distance);
        good = surface->error && surface->distance && surface_point_error(mesh, tree, surface->error, surface->distance);
    }
    if (!good)
        faults_add(faults, options->in, 0, 0, "gives no surface: no memory; a larger --cell-mm may do");
    else if (!options->quiet && strcmp(options->out, "-"))
        print_census(&census, cell, bubbles);
    return good;
}

static bool export_surface(const ExportOptions *options, const char *extension, const VesselTree *tree, Faults *faults)
{
    SurfaceFigures surface = {0};
    OutputText text;
    bool good = make_surface(options, !strcmp(extension, ".ply") || !strcmp(extension, ".vtp"), tree, &surface, faults);
    if (good && !output_text_open(&text)) {
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
        good = false;
    }
    if (good) {
        void (*print)(FILE *, const SurfaceFigures *) = !strcmp(extension, ".stl")   ? surface_print_stl
                                                 : !strcmp(extension, ".ply") ? surface_print_ply
                                                 : !strcmp(extension, ".obj") ? surface_print_obj
                                                                              : surface_print_vtp;
        print(text.stream, &surface);
        good = output_text_write(&text, options->out, faults);
    }
    triangle_mesh_free(surface.mesh);
    free(surface.error);
    free(surface.distance);
    return good;
}

static bool export_centreline(const ExportOptions *options, const char *extension, const VesselTree *tree, Faults *faults)
{
    OutputText text;
    if (!output_text_open(&text)) {
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
        return false;
    }
    bool good = !strcmp(extension, ".vtp")   ? centreline_print_vtp(text.stream, tree)
                : !strcmp(extension, ".swc") ? centreline_print_swc(text.stream, tree)
                                             : centreline_print_markups(text.stream, tree, options->frame);
    if (!good)
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
    return good ? output_text_write(&text, options->out, faults) : output_text_forget(&text);
}

static bool export_tree(const ExportOptions *options, const char *extension, Faults *faults)
{
    VesselTree *tree = tree_file_load(options->in, NULL, faults);
    if (!tree)
        return false;
    bool model = vessel_tree_is_model(tree), good = false;
    bool line_only = !strcmp(extension, ".swc") || !strcmp(extension, ".json");
    bool surface_only = !strcmp(extension, ".stl") || !strcmp(extension, ".ply") || !strcmp(extension, ".obj");
    bool surface = options->what ? !strcmp(options->what, "surface") : surface_only || (model && !line_only);
    if (!line_only && !surface_only && strcmp(extension, ".vtp"))
        faults_add(faults, options->out, 0, 0, "extension '%s' is no format of a tree or model; valid: .stl .ply .obj .vtp .mrk.json .swc", extension);
    else if (surface ? line_only : surface_only)
        faults_add(faults, options->out, 0, 0, "'%s' cannot hold a %s; valid: %s", extension, surface ? "surface" : "centreline",
                   surface ? ".stl .ply .obj .vtp" : ".vtp .mrk.json .swc");
    else if (surface && !model)
        faults_add(faults, options->in, 0, 0, "is a tree without a model, so it has no surface; `seldinger fit` makes one, or export the centreline");
    else
        good = surface ? export_surface(options, extension, tree, faults) : export_centreline(options, extension, tree, faults);
    vessel_tree_free(tree);
    return good;
}

static bool export_recording(const ExportOptions *options, const char *extension, Faults *faults)
{
    bool rows = !strcmp(extension, ".csv"), series = !strcmp(extension, ".vtp") || !strcmp(extension, ".pvd");
    if (!rows && !series) {
        faults_add(faults, options->out, 0, 0, "extension '%s' is no format of a recording here%s; valid: .csv .vtp .pvd", extension,
                   !strcmp(extension, ".vtkhdf") || !strcmp(extension, ".hdf") ? " (VTKHDF is not built yet)" : "");
        return false;
    }
    RecordedRun *run = recorded_run_load(options->in, faults);
    bool good = run && (rows ? recording_export_rows(run, options->out, faults) : recording_export_series(run, options->out, faults));
    recorded_run_free(run);
    return good;
}

// --- the verb ---

static int parse_options(int argc, char **argv, ExportOptions *options)
{
    enum { WHAT = 256, CELL, FRAME, OPEN, FLOATING, THREADS, QUIET, HELP };
    static const struct option table[] = {{"what", required_argument, NULL, WHAT},       {"cell-mm", required_argument, NULL, CELL},
                                          {"frame", required_argument, NULL, FRAME},     {"output", required_argument, NULL, 'o'},
                                          {"threads", required_argument, NULL, THREADS}, {"quiet", no_argument, NULL, QUIET},
                                          {"open-inlet", no_argument, NULL, OPEN},       {"keep-floating", no_argument, NULL, FLOATING},
                                          {"help", no_argument, NULL, HELP},
                                          {0}};
    *options = (ExportOptions){.frame = "LPS"};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "ho:", table, NULL)) != -1;) {
        switch (choice) {
        case 'o': options->out = optarg; break;
        case WHAT:
            options->what = optarg;
            if (!strcmp(optarg, "centerline"))
                options->what = "centreline";
            if (strcmp(options->what, "surface") && strcmp(options->what, "centreline")) {
                fprintf(stderr, "--what: '%s' is not valid; surface or centreline\n", optarg);
                return EXIT_BAD_INPUT;
            }
            break;
        case FRAME:
            options->frame = optarg;
            if (strcmp(optarg, "RAS") && strcmp(optarg, "LPS")) {
                fprintf(stderr, "--frame: '%s' is not valid; RAS or LPS\n", optarg);
                return EXIT_BAD_INPUT;
            }
            break;
        case CELL:
            if (!cli_number("--cell-mm", optarg, 0.001, 1000, &options->cell_mm))
                return EXIT_BAD_INPUT;
            break;
        case THREADS:
            if (!cli_whole_number("--threads", optarg, 0, 256, &number))
                return EXIT_BAD_INPUT;
            break;
        case OPEN: options->open_inlet = true; break;
        case FLOATING: options->keep_floating = true; break;
        case QUIET: options->quiet = true; break;
        case HELP:
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: fprintf(stderr, "seldinger export: unknown option or lacking value; see `seldinger export --help`\n"); return EXIT_BAD_INPUT;
        }
    }
    if (optind != argc - 1 || !options->out) {
        fprintf(stderr, "seldinger export: one file and `-o OUT` are needed; see `seldinger export --help`\n");
        return EXIT_BAD_INPUT;
    }
    options->in = argv[optind];
    return -1;
}

int verb_export(int argc, char **argv)
{
    static Faults faults;
    ExportOptions options;
    char extension[16];
    int code = parse_options(argc, argv, &options);
    if (code >= 0)
        return code;
    faults_clear(&faults);
    output_extension(options.out, extension);
    OutputPlan plan = {.faults = &faults};
    output_plan_write(&plan, "-o", options.out);
    output_plan_series(&plan, "-o", ".vtp");
    output_plan_read(&plan, "the file", options.in);
    bool good = faults.count == 0;
    switch (good ? file_kind(options.in) : FILE_UNKNOWN) {
    case FILE_TREE: good = export_tree(&options, extension, &faults); break;
    case FILE_RECORDING: good = export_recording(&options, extension, &faults); break;
    case FILE_MISSING:
        faults_add(&faults, options.in, 0, 0, "cannot be opened; give a tree, model or recording");
        good = false;
        break;
    default:
        if (good)
            faults_add(&faults, options.in, 0, 0, "is no tree, model or recording; those can be exported");
        good = false;
    }
    return good ? EXIT_DONE : cli_bad_input(&faults);
}

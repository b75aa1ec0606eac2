// seldinger export: writes surfaces, centrelines and recordings for other programs.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/export_tree.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "recon/recon.h"
#include "sim/sim.h"

#include <string.h>

#define AT(member) OPTION_AT(ExportOptions, member)
static const char *const whats[] = {"surface", "centreline", "centerline", NULL};
static const Option rows[] = {
    {"what", "surface|centreline", OPTION_CHOICE, AT(what), "what a .vtp holds", .choices = whats,
     .otherwise = "the surface of a model, the centreline of a tree"},
    CLI_MODEL(ExportOptions, model, "the model whose surface is written"),
    {"cell-mm", "X", OPTION_NUMBER, AT(surface.cell_mm), "cell size of the surface, or edges of a swept model's [mm]", .least = 0.001, .most = 1000,
     .otherwise = "about ten to twenty cells around the thinnest branch; swept: 24 edges around each section"},
    {"tags", NULL, OPTION_FLAG, AT(surface.tags),
     "also writes for each vertex its branch, the way along it, boundary and flow; a swept model ends with flat caps then"},
    {"keep-floating", NULL, OPTION_FLAG, AT(surface.keep_floating),
     "keeps parts of the surface that are not connected to the inlet; by default they are dropped and reported"},
    {"open-inlet", NULL, OPTION_FLAG, AT(surface.open_inlet), "cuts the surface open at the plane of the root; otherwise blobs close it"},
    {"mask", "F.nrrd", OPTION_FILE, AT(mask),
     "of a model: voxels, 0 outside, 1 + branch inside, 1 + number of branches inside an aneurysm; -o may be absent then"},
    {"spacing-mm", "X", OPTION_NUMBER, AT(spacing), "edge of the mask's voxels [mm]", .least = 0.001, .most = 1000,
     .otherwise = "a sixth of the median radius"},
    {"frame", "RAS|LPS", OPTION_CHOICE, AT(frame), "coordinate system written into a .mrk.json or a mask; coordinates are never converted",
     .choices = export_frames},
    {"output", "OUT", OPTION_FILE, AT(out), "the file to write", .letter = 'o'},
    CLI_QUIET(ExportOptions, quiet, "does not print the figures of a surface: parts, open edges, Euler characteristic, area, volume"),
    {"threads", "N", OPTION_INT, AT(threads), "accepted for uniformity, has no effect", .most = 256, .otherwise = ""},
};

static void set_defaults(void *structure) { *(ExportOptions *)structure = (ExportOptions){.what = -1, .model = -1}; }

static const char *check(void *structure)
{
    const ExportOptions *options = structure;
    return options->out || options->mask ? NULL : "expected one file and `-o OUT`";
}

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
             "                         boundary  0 wall, else the number of a flat end: 1, 2 ... inlets, then outlets, from 2 on, both in the order of\n"
             "                                   the branches. A triangle belongs to an end if its three vertices have the same number above 0.\n"
             "                                   Only swept models have flat ends\n"
             "                         flow      0 wall, 1 blood enters here, 2 it leaves: as tagged by `edit`; untagged, it enters at the root\n"
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
    extension[0] = 0;
    if (options->out)
        output_extension(options->out, extension);
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "-o", options->out);
    output_plan_series(&plan, "-o", ".vtp");
    output_plan_write_file(&plan, "--mask", options->mask);
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

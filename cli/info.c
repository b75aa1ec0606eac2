// seldinger info: what a file is and its figures, for people or as JSON. The figures are gathered once as JSON; the text is that, printed plainly.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/file_kind.h"
#include "cli/junction_pages.h"
#include "cli/output_plan.h"
#include "recon/recon.h"
#include "render/render.h"
#include "sim/sim.h"

#include <stdlib.h>

typedef struct InfoCommand {
    const char *file, *report, *picture, *sections;
    JunctionPages junctions;    // and the radius of the tool that is led through the model
    char *reach;                 // comes out: where a tool gets to, as text
    int model;                   // index in model_names; -1: the first that the file has
    bool json, quiet;
} InfoCommand;

#define AT(member) OPTION_AT(InfoCommand, member)
static const Option options[] = {
    {"json", NULL, OPTION_FLAG, AT(json), "as JSON on standard output"},
    {"report", "F.html", OPTION_FILE, AT(report),
     "of a tree or model: a page for readers, all in one file: tree, candidates (narrow places, wide places, "
     "aneurysms), branches, radius along each, quality of the fit; for training and research, not a medical device"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "of a model: its surface coloured by the distance to the data, and the paper's Table 4 as a histogram"},
    {"junctions", "F.png", OPTION_FILE, AT(junctions.picture),
     "of a model: a section through each junction, the narrowest first; further pages are F-2.png and so on"},
    {"sections", "F.csv", OPTION_FILE, AT(sections),
     "of a swept model (fit --model sweep): its sections, a row each: branch, way along it, centre, normal, area, radii, perimeter, circularity, diameters"},
    CLI_MODEL(InfoCommand, model, "of several models in the file, the one that is described"),
    {"volume", "V", OPTION_FILE, AT(junctions.volume), "the angiogram behind these"},
    {"before", "M.h5", OPTION_FILE, AT(junctions.before), "another model of the same vessels: the ten narrowest junctions in that, beside what they are now"},
    {"tool-radius-mm", "X", OPTION_NUMBER, AT(junctions.tool_radius), "of the tool that is led from a model's inlet through the tree", .least = 0.01,
     .most = 100},
    CLI_QUIET(InfoCommand, quiet, "no figures as text: the report or picture alone"),
};

static void set_defaults(void *structure)
{
    *(InfoCommand *)structure = (InfoCommand){.model = -1, .junctions = {.tool_radius = reach_default_options().tool_radius}};
}

static const OptionTable table = {
    .program = "seldinger info",
    .does = "what a file is and its figures",
    .usage = "FILE [options]",
    .intro = "Says what FILE is (volume or folder of a DICOM series, surface, tree, model, recording, scene or script) and its figures. Lengths mm.\n"
             "Of a model also where a tool gets to from the inlet, and where it is blocked and why.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, InfoCommand),
    .set_defaults = set_defaults,
    .takes_argument = true,
    .argument = offsetof(InfoCommand, file),
    .missing = "one file is needed",
    .too_many = "one file is needed, not also ",
};

static bool add_reach(cJSON *object, const ModelField *model, InfoCommand *command, Faults *faults)
{
    size_t length;
    FILE *out = open_memstream(&command->reach, &length);
    if (!out)
        heap_is_empty(BUFSIZ, __FILE__);
    bool good = reach_report(model, command->file, command->junctions.tool_radius, out, object, faults);
    if (fclose(out) != 0)
        heap_is_empty(length, __FILE__);
    return good;
}

static bool draw(const InfoCommand *command, const ModelFile *file, Faults *faults)
{
    double voxel = tree_file_number(&file->info, "voxel_mm", 0.2);
    return !command->picture || picture_model_error(command->picture, command->file, &file->field, voxel > 0 ? voxel : 0.2, faults);
}

static bool describe_tree_file(cJSON *object, InfoCommand *command, Faults *faults)
{
    ModelFile file;
    if (!model_file_load(command->file, command->model, &file, faults))
        return false;
    describe_tree(object, &file);
    bool good = section_table_of_file(command->sections, command->file, &file, faults) && add_reach(object, &file.field, command, faults);
    good = good && (!command->report || tree_page_write(command->report, command->file, &file.field, &file.info, faults));
    good = good && junction_pages_draw(&command->junctions, command->file, &file.field, faults) && draw(command, &file, faults);
    model_file_free(&file);
    return good;
}

static bool describe(cJSON *object, FileKind kind, InfoCommand *command, Faults *faults)
{
    const char *path = command->file;
    switch (kind) {
    case FILE_TREE: return describe_tree_file(object, command, faults);
    case FILE_RECORDING: return describe_recording(object, path, faults);
    case FILE_SCENE: return describe_scene(object, path, faults);
    case FILE_SCRIPT: return describe_script(object, path, faults);
    case FILE_VOLUME: return describe_volume(object, path, faults);
    case FILE_SURFACE: return describe_surface(object, path, faults);
    case FILE_MISSING: faults_add(faults, path, 0, 0, "cannot be opened; a file that is there and may be read, or a folder with a DICOM series"); break;
    case FILE_UNKNOWN: break;
    }
    if (kind == FILE_UNKNOWN)
        faults_add(faults, path, 0, 0,
                   "is of no kind that `info` can describe; it reads volumes (NRRD, MetaImage, NIfTI, DICOM), surfaces (STL, PLY, OBJ, VTP), "
                   "trees, models, recordings, scenes and scripts");
    return false;
}

static void plan_files(const InfoCommand *command, FileKind kind, Faults *faults)
{
    const JunctionPages *junctions = &command->junctions;
    if ((command->report || command->sections || command->picture || junctions->picture) && kind != FILE_TREE && kind != FILE_MISSING)
        faults_add(faults, command->file, 0, 0, "is no tree or model; --report, --sections, --picture and --junctions are made of those");
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--report", command->report);
    output_plan_write(&plan, "--sections", command->sections);
    output_plan_picture(&plan, "--picture", command->picture);
    output_plan_picture(&plan, "--junctions", junctions->picture);
    output_plan_series(&plan, "--junctions", ".png");
    output_plan_read(&plan, "the file", command->file);
    output_plan_read(&plan, "--before", junctions->before);
    output_plan_read_volume(&plan, "--volume", junctions->volume);
    if ((junctions->volume || junctions->before) && !junctions->picture)
        faults_add(faults, command->file, 0, 0, "--volume and --before belong to the pictures of --junctions F.png");
}

static int call(void *structure, Faults *faults)
{
    InfoCommand *command = structure;
    FileKind kind = file_kind(command->file);
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "file", command->file);
    plan_files(command, kind, faults);
    bool good = faults->count == 0 && describe(object, kind, command, faults);
    good = good && !cli_is_standard_output(command->report);
    if (good && command->json) {
        output_write_line("-", cJSON_Print(object), faults);
    } else if (good && !command->quiet) {
        plain_json_print(stdout, object, "reach");   // which is printed as text below
        fputs(command->reach ? command->reach : "", stdout);
    }
    free(command->reach);
    cJSON_Delete(object);
    return EXIT_DONE;
}

const Verb info_verb = {.options = &table, .call = call};

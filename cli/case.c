// seldinger case: a folder with everything that a session needs, from a volume or a tree.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/file_kind.h"
#include "recon/recon.h"

#include <stdlib.h>
#include <string.h>

typedef struct CaseCommand {
    const char *input, *trace, *start, *output;
    Vec3 start_mm;
    CaseOptions made;
    bool quiet;
} CaseCommand;

// Kept as it was typed, for messages.
static const char *take_start(void *structure, const Option *option, const char *text)
{
    CaseCommand *command = structure;
    double point[3];
    (void)option;
    if (!option_point(text, point))
        return "--start takes a point: three numbers X,Y,Z in mm";
    command->start = text;
    command->start_mm = vec3(point[0], point[1], point[2]);
    return NULL;
}

static const char *take_target(void *structure, const Option *option, const char *text)
{
    CaseCommand *command = structure;
    double point[3];
    (void)option;
    if (!option_point(text, point))
        return "--target takes a point: three numbers X,Y,Z in mm";
    command->made.has_target = true;
    command->made.target = vec3(point[0], point[1], point[2]);
    return NULL;
}

#define AT(member) OPTION_AT(CaseCommand, member)
static const Option rows[] = {
    {"start", "X,Y,Z", OPTION_POINT, AT(start), "of a volume: a point in a vessel, from which the whole tree is tracked", .unit = "mm", .take = take_start},
    {"trace", "F.yaml", OPTION_FILE, AT(trace), "of a volume, instead of --start: a trace as `segment` takes it", .letter = 't'},
    {"target", "X,Y,Z", OPTION_POINT, AT(made.target), "where the tip of the wire has to go, in a vessel or a sac; default: no exercise", .unit = "mm",
     .take = take_target},
    {"model", "KIND", OPTION_CHOICE, AT(made.kind), "the wall's model (`seldinger fit --help`): lim, sweep, raster, rbf, pas", .choices = model_names},
    {"behind", NULL, OPTION_FLAG, AT(made.is_behind), "of a CT volume: shows its bone and soft tissue behind the vessels, instead of a plain head"},
    {"output", "CASE", OPTION_FOLDER, AT(output), "the folder (required); it must not hold a case yet", .letter = 'o'},
    CLI_THREADS(CaseCommand, made.threads),
    CLI_QUIET(CaseCommand, quiet, "no summary, no progress"),
};

static void set_defaults(void *structure) { *(CaseCommand *)structure = (CaseCommand){0}; }

static const char *check(void *structure)
{
    const CaseCommand *command = structure;
    return !command->output ? "missing -o CASE, the folder" : command->trace && command->start ? "expected either --trace F.yaml or --start X,Y,Z" : NULL;
}

static const OptionTable table = {
    .program = "seldinger case",
    .does = "makes a case, a folder that `nav` opens, from an angiogram, a tree or a model",
    .usage = "VOLUME --start X,Y,Z -o CASE\nTREE.h5 -o CASE",
    .intro = "Tracks the vessels of an angiogram from a point in one of them, fits their wall, and writes a scene with a wire that suits them. The wire enters "
             "at the "
             "root of the tree: the end of the first vessel that lies at the border of the volume, otherwise its wider end.",
    .notes =
        "CASE holds model.h5, scene.yaml and, from a volume, trace.yaml. It can be copied; only the volume of --behind stays where it is. `seldinger nav CASE` "
        "steers in it, `seldinger run CASE` simulates. The same volume and trace give the same bytes.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(rows, CaseCommand),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(CaseCommand, input),
    .missing = "missing the volume or tree",
    .too_many = "one volume or tree, not also ",
};

// The text of the trace; NULL without one, or with a fault.
static char *trace_text(const CaseCommand *command, Faults *faults)
{
    size_t length;
    char text[160];
    Vec3 x = command->start_mm;
    if (command->trace)
        return text_file_read(command->trace, &length, faults);
    snprintf(text, sizeof text, "branches:\n  - {start_mm: [%.17g, %.17g, %.17g]}\n", x.x, x.y, x.z);
    return command->start ? HEAP_TEXT(text) : NULL;
}

// Whether the input and the options about it fit together; otherwise adds a fault that names the command for such a file.
static bool is_possible(const CaseCommand *command, Faults *faults)
{
    FileKind kind = file_kind(command->input);
    bool has_trace = command->start || command->trace;
    if (kind == FILE_VOLUME && !has_trace)
        faults_add(faults, command->input, 0, 0, "is a volume; add --start X,Y,Z, a point in a vessel (or --trace F.yaml)");
    else if (kind == FILE_TREE && (has_trace || command->made.is_behind))
        faults_add(faults, command->input, 0, 0, "is a tree; --start, --trace and --behind are for volumes");
    else if (kind == FILE_SURFACE)
        faults_add(faults, command->input, 0, 0, "is a surface; make a tree of it first: seldinger import --surface %s -o TREE.h5", command->input);
    else if (kind != FILE_VOLUME && kind != FILE_TREE && kind != FILE_MISSING)
        faults_add(faults, command->input, 0, 0, "is neither a volume nor a tree; `seldinger info` says what it is");
    return faults->count == 0;
}

static int call(void *structure, Faults *faults)
{
    CaseCommand *command = structure;
    CaseFigures figures;
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "case", command->quiet);
    if (!is_possible(command, faults))
        return EXIT_BAD_INPUT;
    char *trace = trace_text(command, faults);
    command->made.input = command->input;
    command->made.trace = trace;
    command->made.trace_path = command->trace ? command->trace : "--start";
    command->made.progress = &progress;
    bool good = faults->count == 0 && case_make(command->output, &command->made, &figures, faults);
    free(trace);
    if (good && !command->quiet)
        printf("%s: %.0f mm of vessels with %d ends, %d nodes; read and tracked in %.1f s, wall in %.1f s\nseldinger nav %s\n", command->output, figures.length,
               figures.branches, figures.nodes, figures.track_s, figures.fit_s, command->output);
    return good ? EXIT_DONE : EXIT_BAD_INPUT;
}

const Verb case_verb = {.options = &table, .call = call};

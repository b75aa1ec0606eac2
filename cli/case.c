// seldinger case: a folder with everything that a session needs, from a volume or a tree.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "recon/recon.h"

#ifdef SELDINGER_RENDER
#include "cli/case_open.h"
#endif

#include <stdlib.h>
#include <string.h>

typedef struct CaseCommand {
    const char *input, *trace, *start, *output, *picture;
    Vec3 start_mm;
    CaseOptions made;
    bool quiet;
    int width, height;
    double duration_s;
} CaseCommand;

static const char *take_place(const char *text, const char *refused, Vec3 *place)
{
    double point[3];
    if (!option_point(text, point))
        return refused;
    *place = vec3(point[0], point[1], point[2]);
    return NULL;
}

// Kept as it was typed, for messages.
static const char *take_start(void *structure, const Option *option, const char *text)
{
    CaseCommand *command = structure;
    (void)option;
    command->start = text;
    return take_place(text, "--start takes a point: three numbers X,Y,Z in mm", &command->start_mm);
}

static const char *take_target(void *structure, const Option *option, const char *text)
{
    CaseCommand *command = structure;
    (void)option;
    command->made.has_target = true;
    return take_place(text, "--target takes a point: three numbers X,Y,Z in mm", &command->made.target);
}

static const char *take_entry(void *structure, const Option *option, const char *text)
{
    CaseCommand *command = structure;
    (void)option;
    command->made.has_entry = true;
    return take_place(text, "--entry takes a point: three numbers X,Y,Z in mm", &command->made.entry);
}

#define AT(member) OPTION_AT(CaseCommand, member)
static const Option rows[] = {
    {"start", "X,Y,Z", OPTION_POINT, AT(start), "of a volume: a point in a vessel, from which the whole tree is tracked", .unit = "mm", .take = take_start},
    {"trace", "F.yaml", OPTION_FILE, AT(trace), "of a volume, instead of --start: a trace as `segment` takes it", .letter = 't'},
    {"entry", "X,Y,Z", OPTION_POINT, AT(made.entry),
     "the end of a vessel where the tool enters; default: of a volume the widest one at its border, of a tree its root", .unit = "mm", .take = take_entry},
    {"target", "X,Y,Z", OPTION_POINT, AT(made.target), "where the tip of the wire has to go, in a vessel or a sac; default: no exercise", .unit = "mm",
     .take = take_target},
    {"device", "F.yaml", OPTION_TEXT, AT(made.device), "the tool: a wire of the device library, which is copied; default: a wire that suits the vessels"},
    {"tools", "FOLDER", OPTION_FOLDER, AT(made.library), "the device library", .otherwise = "scenes/tools"},
    {"model", "KIND", OPTION_CHOICE, AT(made.kind), "the wall's model (`seldinger fit --help`): lim, sweep, raster, rbf, pas", .choices = model_names},
    {"behind", NULL, OPTION_FLAG, AT(made.is_behind), "of a CT volume: shows its bone and soft tissue behind the vessels, instead of a plain head"},
    {"output", "CASE", OPTION_FOLDER, AT(output), "the folder (required without the window); it must not hold a case yet; default in the window: a folder of the cache",
     .letter = 'o'},
#ifdef SELDINGER_RENDER
    {"picture", "F.png", OPTION_FILE, AT(picture), "the window as it looks at its end"},
    CLI_SIZE(CaseCommand, width, "size of the window"),
    {"duration-s", "S", OPTION_NUMBER, AT(duration_s), "ends the window after S seconds of real time", .most = SCRIPT_LONGEST_S, .otherwise = ""},
#endif
    CLI_THREADS(CaseCommand, made.threads),
    CLI_QUIET(CaseCommand, quiet, "no summary, no progress"),
};

static void set_defaults(void *structure) { *(CaseCommand *)structure = (CaseCommand){.width = 1280, .height = 720}; }

static const char *check(void *structure)
{
    const CaseCommand *command = structure;
    return command->trace && command->start ? "expected either --trace F.yaml or --start X,Y,Z" : NULL;
}

static const OptionTable table = {
    .program = "seldinger case",
    .does = "makes a case, a folder that `nav` opens, from an angiogram, a tree or a model",
    .usage = "VOLUME [-o CASE]\nVOLUME --start X,Y,Z -o CASE\nTREE.h5 -o CASE",
    .intro = "Tracks the vessels of an angiogram from a point in one of them, fits their wall, and writes a scene with a wire that suits them. Without --start "
             "and --trace, on a display, a window shows the volume: click a vessel, look at the tree and its marks, correct it, and steer. The wire enters at "
             "the root of the tree: the widest end of a vessel at the border of the volume, or the end that --entry names.",
    .notes =
        "CASE holds model.h5, scene.yaml and, from a volume, trace.yaml. It can be copied; only the volume of --behind stays where it is. `seldinger nav CASE` "
        "steers in it, `seldinger run CASE` simulates. The same volume and trace give the same bytes, in the window and without: `seldinger case VOLUME --trace "
        "CASE/trace.yaml -o OTHER`.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(rows, CaseCommand),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(CaseCommand, input),
    .missing = "missing the volume or tree",
    .too_many = "one volume or tree, not also ",
};

// The trace of the options, as the window writes it for the same acts.
static char *trace_of_options(const CaseCommand *command)
{
    CaseActs acts = {0};
    const CaseOptions *o = &command->made;
    CaseAct device = {.kind = CASE_DEVICE};
    snprintf(device.device, sizeof device.device, "%s", o->device ? o->device : "");
    bool good = case_acts_add(&acts, &(CaseAct){.kind = CASE_START, .place = command->start_mm}) &&
                (!o->has_entry || case_acts_add(&acts, &(CaseAct){.kind = CASE_ENTRY, .place = o->entry})) &&
                (!o->has_target || case_acts_add(&acts, &(CaseAct){.kind = CASE_TARGET, .place = o->target})) &&
                (!o->device || case_acts_add(&acts, &device)) && (!o->is_behind || case_acts_add(&acts, &(CaseAct){.kind = CASE_BEHIND, .is_on = true}));
    char *text = good ? case_acts_trace(&acts) : NULL;
    case_acts_free(&acts);
    return text;
}

// The text of the trace; NULL without one, or with a fault.
static char *trace_text(const CaseCommand *command, Faults *faults)
{
    size_t length;
    if (command->trace)
        return text_file_read(command->trace, &length, faults);
    char *text = command->start ? trace_of_options(command) : NULL;
    if (command->start && !text)
        faults_add(faults, command->input, 0, 0, "out of memory");
    return text;
}

// Whether the input and the options about it fit together; otherwise adds a fault that names the command for such a file.
static bool is_possible(const CaseCommand *command, Faults *faults)
{
    FileKind kind = file_kind(command->input);
    bool has_trace = command->start || command->trace;
    if (kind == FILE_VOLUME && !has_trace)
        faults_add(faults, command->input, 0, 0, "is a volume; add --start X,Y,Z, a point in a vessel (or --trace F.yaml), or call this on a display");
    else if (kind == FILE_TREE && (has_trace || command->made.is_behind))
        faults_add(faults, command->input, 0, 0, "is a tree; --start, --trace and --behind are for volumes");
    else if (kind == FILE_SURFACE)
        faults_add(faults, command->input, 0, 0, "is a surface; make a tree of it first: seldinger import --surface %s -o TREE.h5", command->input);
    else if (kind != FILE_VOLUME && kind != FILE_TREE && kind != FILE_MISSING)
        faults_add(faults, command->input, 0, 0, "is neither a volume nor a tree; `seldinger info` says what it is");
    else if (!command->output)
        faults_add(faults, "seldinger case", 0, 0, "missing -o CASE, the folder");
    return faults->count == 0;
}

#ifdef SELDINGER_RENDER
static bool opens_window(const CaseCommand *command) { return !command->start && !command->trace && case_can_open(command->input); }

static int open_window(const CaseCommand *command, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    if (command->made.has_target || command->made.has_entry || command->made.device || command->made.is_behind)
        faults_add(faults, "seldinger case", 0, 0, "target, entry, device and background are chosen in the window; or add --start X,Y,Z");
    output_plan_picture(&plan, "--picture", command->picture);
    output_plan_read_volume(&plan, "the volume", command->input);
    const CaseWindowOptions window = {&command->made, command->output, command->picture, command->width, command->height, command->duration_s};
    return faults->count == 0 ? case_open(&window, faults) : EXIT_BAD_INPUT;
}
#endif

static int call(void *structure, Faults *faults)
{
    CaseCommand *command = structure;
    CaseFigures figures;
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "case", command->quiet);
#ifdef SELDINGER_RENDER
    char library[PATH_MAX];
    command->made.input = command->input;
    if (!command->made.library && case_library(library))
        command->made.library = library;
    if (opens_window(command))
        return open_window(command, faults);
#endif
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

#include "cli/case_options.h"

#include "recon/recon.h"
#include "sim/sim.h"

#include <string.h>

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

static const char *take_anatomy(void *structure, const Option *option, const char *text)
{
    CaseCommand *command = structure;
    (void)option;
    for (const char *const *name = patient_segment_name; *name; name++)
        if (!strcmp(*name, text))
            command->made.anatomy = text;
    return command->made.anatomy ? NULL
                                 : "--anatomy takes the name of a segment: left_internal_carotid, basilar, aortic_arch, … (docs/scene-format.md lists them)";
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
    {"catheter", "F.yaml", OPTION_TEXT, AT(made.catheter),
     "a catheter or microcatheter of the device library around the wire, which then is one that fits into it unless --device names another; default: none"},
    {"anatomy", "NAME", OPTION_TEXT, AT(made.anatomy),
     "which vessel of the body it is (`anatomy:` in docs/scene-format.md): the patient is drawn around it; default: not said", .take = take_anatomy},
    {"tools", "FOLDER", OPTION_FOLDER, AT(made.library), "the device library", .otherwise = "scenes/tools"},
    {"model", "KIND", OPTION_CHOICE, AT(made.kind), "the wall's model (`seldinger fit --help`): lim, sweep, raster, rbf, pas", .choices = model_names,
     .given = offsetof(CaseCommand, made.has_kind)},
    {"behind", NULL, OPTION_FLAG, AT(made.is_behind), "of a CT volume: shows its bone and soft tissue behind the vessels, instead of a plain head"},
    {"output", "CASE", OPTION_FOLDER, AT(output),
     "the folder (required without the window); it must not hold a case yet; default in the window: a folder of the user's data, which the start window lists",
     .letter = 'o'},
#ifdef SELDINGER_RENDER
    {"trainee", "NAME", OPTION_TEXT, AT(trainee), "name of who steers from the window, for the report"},
    {"examination", NULL, OPTION_FLAG, AT(is_examination), "what is steered from the window is an examination (`seldinger nav`)"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "the window as it looks at its end"},
    CLI_SIZE(CaseCommand, width, "size of the window"),
    {"duration-s", "S", OPTION_NUMBER, AT(duration_s), "ends the window after S seconds of real time", .most = SCRIPT_LONGEST_S, .otherwise = ""},
#endif
    CLI_THREADS(CaseCommand, made.threads),
    CLI_QUIET(CaseCommand, quiet, "no summary, no progress"),
};

static void set_defaults(void *structure) { *(CaseCommand *)structure = (CaseCommand){.trainee = "", .width = 1280, .height = 720}; }

static const char *check(void *structure)
{
    const CaseCommand *command = structure;
    return command->trace && command->start ? "expected either --trace F.yaml or --start X,Y,Z" : NULL;
}

const OptionTable case_options = {
    .program = "seldinger case",
    .does = "makes a case, a folder that `nav` opens, from an angiogram, a tree or a model",
    .usage = "VOLUME [-o CASE]\nVOLUME --start X,Y,Z -o CASE\nTREE.h5 -o CASE",
    .intro = "Tracks the vessels of an angiogram from a point in one of them, fits their wall, and writes a scene with a wire that suits them. Without --start "
             "and --trace, on a display, a window shows the volume: click a vessel, look at the tree and its marks, correct it, and steer. The wire enters at "
             "the root of the tree: the widest end of a vessel at the border of the volume, or the end that --entry names.",
    .notes =
        "CASE holds model.h5, scene.yaml and, from a volume, trace.yaml. It can be copied; only the volume of --behind stays where it is. `seldinger nav CASE` "
        "steers in it, `seldinger run CASE` simulates. The same volume and trace give the same bytes, in the window and without: `seldinger case VOLUME "
        "--trace "
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

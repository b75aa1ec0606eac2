// seldinger edit: edits of a swept model, replayed from YAML or made in a window.
#include "cli/cli.h"

#include "cli/output_plan.h"
#include "cli/user_settings.h"
#include "recon/recon.h"
#include "render/render.h"

#include <stdlib.h>
#include <string.h>

typedef struct EditCommand {
    const char *model, *edits, *output, *text, *volume, *picture;
    bool list, quiet;
    int width, height;
    double duration_s;
} EditCommand;

#define AT(member) OPTION_AT(EditCommand, member)
static const Option options[] = {
    {"do", "F.yaml", OPTION_FILE, AT(edits), "edits to replay (docs/file-formats.md, \"Edits\")"},
    {"output", "OUT.h5", OPTION_FILE, AT(output), "the edited model", .letter = 'o'},
    {"list", NULL, OPTION_FLAG, AT(list), "prints branches, sections, tags and the edits since the fit, after those of --do"},
    {"save-edits", "F.yaml", OPTION_FILE, AT(text), "all edits since the fit, as --do reads them; - is standard output"},
#ifdef SELDINGER_RENDER
    {"volume", "V", OPTION_FILE, AT(volume), "angiogram that the window shows behind the sections"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "the window as it looks at its end"},
    CLI_SIZE(EditCommand, width, "size of the window"),
    {"duration-s", "S", OPTION_NUMBER, AT(duration_s), "ends the window after S seconds of real time", .most = SCRIPT_LONGEST_S, .otherwise = ""},
#endif
    CLI_QUIET(EditCommand, quiet, "no summary"),
};

static bool opens_window(const EditCommand *command) { return !command->edits && !command->list && !command->text; }

static void set_defaults(void *structure) { *(EditCommand *)structure = (EditCommand){.width = 1280, .height = 720}; }

static const char *check(void *structure)
{
    const EditCommand *command = structure;
    if (command->edits && !command->output && !command->list && !command->text)
        return "missing -o OUT.h5";
#ifdef SELDINGER_RENDER
    if (opens_window(command) && !command->output)
        return "missing -o OUT.h5, where the window saves; or --do F.yaml, --list or --save-edits F.yaml";
#else
    if (opens_window(command))
        return "missing --do F.yaml, --list or --save-edits F.yaml; this program was built without windows";
#endif
    if (!opens_window(command) && (command->volume || command->picture))
        return "--volume and --picture are of the window, which --do, --list and --save-edits do not open";
    return NULL;
}

static bool save(const EditCommand *command, const EditFile *file, SweepEditor *editor, Faults *faults)
{
    if (command->output && !edit_file_save(file, editor, command->output, faults))
        return false;
    const SweepModel *result = sweep_editor_result(editor);
    const char *text = result && result->edits ? result->edits : "edits: []\n";
    if (command->text && !output_write(command->text, text, strlen(text), faults))
        return false;
    if (command->list && result)
        edit_file_list(result, stdout);
    return result != NULL;
}

#ifdef SELDINGER_RENDER
static void open_window(const EditCommand *command, const EditFile *file, SweepEditor *editor, Faults *faults)
{
    const EditWindowOptions window = {command->model, command->output, command->picture, command->width, command->height, command->duration_s};
    Volume *volume = command->volume ? volume_load(command->volume, faults) : NULL;
    cli_use_settings();
    if (faults->count == 0)
        edit_window_run(&window, file, editor, volume, faults);
    volume_free(volume);
}
#endif

static int call(void *structure, Faults *faults)
{
    const EditCommand *command = structure;
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", command->output);
    output_plan_write(&plan, "--save-edits", command->text);
    output_plan_picture(&plan, "--picture", command->picture);
    output_plan_read(&plan, "the model", command->model);
    output_plan_read_volume(&plan, "--volume", command->volume);
    output_plan_read(&plan, "--do", command->edits);
    EditFile file;
    bool good = edit_file_load(command->model, &file, faults);
    EditList *list = command->edits ? edit_list_load(command->edits, faults) : NULL;
    SweepEditor *editor = good ? sweep_editor_create(file.model) : NULL;
    if (good && !editor)
        faults_add(faults, command->model, 0, 0, "needs more memory than is available");
    if (editor && list && sweep_editor_replay(editor, list, command->edits, faults) && !command->quiet && !cli_is_standard_output(command->text) &&
        faults->count == 0)
        printf("%d edits applied\n", list->count);
    if (editor && faults->count == 0 && opens_window(command)) {
#ifdef SELDINGER_RENDER
        open_window(command, &file, editor, faults);
#endif
    } else if (editor && faults->count == 0)
        save(command, &file, editor, faults);
    sweep_editor_free(editor);
    edit_list_free(list);
    edit_file_free(&file);
    return EXIT_DONE;
}

static const OptionTable table = {
    .program = "seldinger edit",
    .does = "edits sections and branches of a swept model",
    .usage = "MODEL.h5 -o OUT.h5 [--volume V]\nMODEL.h5 --do edits.yaml -o OUT.h5\nMODEL.h5 --list",
    .intro = "Edits a swept model (`fit --model sweep`): replaces, inserts, deletes and smooths cross-sections, draws and cuts branches, sets the blend of a "
             "fork and the tags of the ends: in a window, or from a file. Every edit is a line of YAML, and the same lines give the same model, byte for byte.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, EditCommand),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(EditCommand, model),
    .missing = "missing the model",
    .too_many = "one model at a time, not also ",
};

const Verb edit_verb = {.options = &table, .call = call};

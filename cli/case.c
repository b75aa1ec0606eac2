// seldinger case: a folder with everything that a session needs, from a volume or a tree.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/case_options.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "recon/recon.h"

#ifdef SELDINGER_RENDER
#include "cli/case_open.h"
#endif

#include <stdlib.h>
#include <string.h>

// The trace of the options, as the window writes it for the same acts.
static char *trace_of_options(const CaseCommand *command)
{
    const CaseOptions *o = &command->made;
    CaseActs acts = {.model = o->has_kind ? model_names[o->kind] : NULL};
    const struct {
        CaseActKind kind;
        const char *name;
    } named[] = {{CASE_DEVICE, o->device}, {CASE_CATHETER, o->catheter}, {CASE_ANATOMY, o->anatomy}};
    bool good = case_acts_add(&acts, &(CaseAct){.kind = CASE_START, .place = command->start_mm}) &&
                (!o->has_entry || case_acts_add(&acts, &(CaseAct){.kind = CASE_ENTRY, .place = o->entry})) &&
                (!o->has_target || case_acts_add(&acts, &(CaseAct){.kind = CASE_TARGET, .place = o->target})) &&
                (!o->is_behind || case_acts_add(&acts, &(CaseAct){.kind = CASE_BEHIND, .is_on = true}));
    for (size_t i = 0; i < sizeof named / sizeof *named; i++) {
        CaseAct act = {.kind = named[i].kind};
        snprintf(act.name, sizeof act.name, "%s", named[i].name ? named[i].name : "");
        good = good && (!named[i].name || case_acts_add(&acts, &act));
    }
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
    if (command->made.has_target || command->made.has_entry || command->made.device || command->made.catheter || command->made.anatomy ||
        command->made.is_behind)
        faults_add(faults, "seldinger case", 0, 0, "target, entry, device, catheter, anatomy and background are chosen in the window; or add --start X,Y,Z");
    output_plan_picture(&plan, "--picture", command->picture);
    output_plan_read_volume(&plan, "the volume", command->input);
    const CaseWindowOptions window = {&command->made, command->output, command->picture, command->width, command->height, command->duration_s};
    return faults->count == 0 ? case_open(&window, command->trainee, command->is_examination, faults) : EXIT_BAD_INPUT;
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
    if (!command->made.library && process_scenes("tools", library))
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

const Verb case_verb = {.options = &case_options, .call = call};

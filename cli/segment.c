// seldinger segment: tracks a volume with RBT to a tree of centreline nodes with local point sets (recon/track/rbt_track.h).
#include "cli/cli.h"

#include "cli/segment_options.h"
#include "base/base.h"
#include "cli/output_plan.h"
#include "recon/recon.h"
#include "render/render.h"

#include <stdlib.h>
#include <time.h>

// Prints what makes the result doubtful on standard error, even with --quiet.
static void print_warnings(const char *volume, const RbtStartCheck *check)
{
    for (int i = 0; i < check->warning_count; i++)
        fprintf(stderr, "%s: warning: %s\n", volume, check->warning[i].text);
}

static bool write_json(const SegmentCommand *command, const VesselTree *tree, const RbtReport *report, double load_s, double track_s, Faults *faults)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "volume", command->volume);
    cJSON_AddStringToObject(root, command->start ? "start_mm" : "trace", command->start ? command->start : command->trace);
    segment_report_add(root, tree, report, load_s, track_s);
    bool good = cli_write_json(command->json, root, faults);
    cJSON_Delete(root);
    return good;
}

// Returns false with a fault if no picture can be drawn; the tree is written all the same.
static bool draw_picture(const SegmentCommand *command, const Volume *volume, const VesselTree *tree, Faults *faults)
{
    char message[512];
    PictureOptions picture = picture_default_options();
    picture.title = command->volume;
    bool drawn =
        picture_of_tree(command->picture, &picture, volume->size, volume->origin, volume->axis, volume->value, 0, 0, tree, 0, NULL, message, sizeof message);
    if (!drawn)
        faults_add(faults, command->picture, 0, 0, "no picture: %s", message);
    return drawn;
}

static Trace *trace_of(const SegmentCommand *command, Faults *faults)
{
    Vec3 x = command->start_mm;
    char text[160];
    int length = snprintf(text, sizeof text, "branches: [{start_mm: [%.17g, %.17g, %.17g]}]", x.x, x.y, x.z);
    Trace *trace = command->start ? trace_parse(text, (size_t)length, "--start", faults) : trace_load(command->trace, faults);
    bool good = true;
    for (int i = 0; trace && good && i < command->until_count; i++)
        good = trace_add_point(trace, "until", command->until[i]);
    for (int i = 0; trace && good && i < command->rival_count; i++)
        good = trace_add_point(trace, "not", command->rival[i]);
    if (!good)
        faults_add(faults, command->volume, 0, 0, "out of memory");
    if (trace && command->seed >= 0)
        trace->parameters.seed = command->seed;
    return trace;
}

static bool save(const SegmentCommand *command, const Trace *trace, const RbtReport *report, const Volume *volume, const VesselTree *tree, Faults *faults)
{
    char created_by[] = "seldinger " SELDINGER_VERSION " segment", *source = HEAP_TEXT(command->volume);
    TreeFileInfo info = {.source = source, .parameters = segment_parameters_text(&trace->parameters, report, volume, tree), .created_by = created_by};
    bool good = tree_file_save(tree, &info, command->out, faults);
    free(source);
    free(info.parameters);
    return good;
}

static void plan_files(const SegmentCommand *command, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", command->out);
    output_plan_write(&plan, "--json", command->json);
    output_plan_picture(&plan, "--picture", command->picture);
    output_plan_read_volume(&plan, "the volume", command->volume);
    output_plan_read(&plan, "--trace", command->trace);
}

static int call(void *structure, Faults *faults)
{
    const SegmentCommand *command = structure;
    plan_files(command, faults);
    double start = clock_s(CLOCK_MONOTONIC);
    Trace *trace = trace_of(command, faults);
    Volume *volume = volume_load(command->volume, faults);
    RbtReport report = {0};
    VesselTree *tree = NULL;
    double load_s = clock_s(CLOCK_MONOTONIC) - start;
    if (trace && volume && faults->count == 0) {
        ProgressBar bar;
        Progress progress = progress_bar(&bar, "tracking", command->quiet);
        tree = rbt_track(volume, &trace->parameters, trace->branch, trace->branch_count, trace->aneurysm, trace->aneurysm_count, command->threads, &progress,
                         &report, command->start ? "--start" : command->trace, faults);
    }
    double track_s = clock_s(CLOCK_MONOTONIC) - start - load_s;
    bool good = tree && save(command, trace, &report, volume, tree, faults) && (!command->json || write_json(command, tree, &report, load_s, track_s, faults));
    if (good && !command->quiet && !cli_is_standard_output(command->json))
        segment_report_print(stdout, tree, &report, load_s, track_s);
    if (good)
        print_warnings(command->volume, &report.check);
    if (good && command->picture)
        draw_picture(command, volume, tree, faults);
    rbt_report_free(&report);
    vessel_tree_free(tree);
    volume_free(volume);
    trace_free(trace);
    return EXIT_DONE;
}

const Verb segment_verb = {.options = &segment_options, .call = call};

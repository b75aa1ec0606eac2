// seldinger bench torture: random commands, tools and vessels, checked against the true wall. Every run is a scene file made from its seed
// (torture_scene.h).
#define _XOPEN_SOURCE 700   // realpath
#include "base/output.h"
#include "bench/bench.h"
#include "bench/shape_vessel.h"
#include "bench/torture_scene.h"
#include "recon/phantom/phantom.h"
#include "recon/tree_file.h"
#include "sim/drive.h"

#include <limits.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MODELS_MOST = 8, TRUTH_EVERY = 5, FAULT_TEXT = 240 };
static const double outside_mm = 0.2;     // a run fails if a node is deeper in the true wall than this …
static const double unreported_mm = 0.05; // … or deeper than reported by this
static const double kink_rad = 1;         // an element with a larger rotation is outside beam theory: such runs are counted, and their energy is not judged
static const double stuck_mm = 10;        // [mm] fed but not inserted, though inserted with steps and elements half as long

typedef enum { FAILED_DEEP = 1, FAILED_UNREPORTED = 2, FAILED_NUMBER = 4, FAILED_ENERGY = 8, FAILED_STUCK = 16, FAILED_REFUSED = 32 } Failure;
static const char *const failure_name[] = {"outside the wall", "outside and not reported", "diverged or not a number", "gained energy", "stuck", "refused"};
enum { FAILURES = sizeof failure_name / sizeof failure_name[0] };

typedef struct Outcome {
    TortureVessel vessel;
    TortureTool tool;
    unsigned failed;
    int64_t steps, cut, not_converged;
    double deepest, unreported;      // [mm] depth in the true wall; unreported part of the depth
    double deepest_s, gained, gained_end, gained_mean, work;  // time of `deepest`; energies [mJ]
    double not_taken;                // [mm] fed by the hands but not inserted
    bool was_compared, kinks;
    char reason[FAULT_TEXT];         // FAILED_REFUSED
} Outcome;

typedef struct Torture {
    BenchOptions common;
    double first, runs, steps, finer;    // whole numbers
    const char *keep;
    int model_count;
    const char *model[MODELS_MOST];
    double lumen[MODELS_MOST];
    Outcome *outcome;        // (runs)
    pthread_mutex_t files;   // HDF5 is not thread-safe
} Torture;

// --- one run ---

typedef struct Witness {
    Outcome *outcome;
    const Vessel *contact, *truth;
    Stepper *stepper;
    NodeReport *node;
    double outside_before;   // [mm] true depth of the state to which the next report applies
    int64_t step;
    double fed[STEP_TOOLS_MAX];
} Witness;

// Queries without the previous position on the wall.
static double true_gap(const Vessel *vessel, Vec3 place, double reach)
{
    VesselHit hit;
    VesselMemory memory = {.node = vessel->locate(vessel, place, -1)};
    vessel_query(vessel, 1, &place, reach, &memory, &hit);
    return hit.flags & (VESSEL_FAR | VESSEL_OPEN_END | VESSEL_BEYOND) ? HUGE_VAL : hit.gap;
}

static double true_depth(const Witness *w)
{
    const WireState *state = stepper_state(w->stepper);
    double deepest = 0;
    stepper_node_report(w->stepper, w->node);
    for (int i = 0; i < state->node_count; i++) {
        const NodeReport *node = &w->node[i];
        if (node->vessel_node < 0 && isinf(node->gap))
            continue;        // in the sheath
        double gap = true_gap(w->contact, state->position[i], node->radius + 0.5);
        if (w->truth && gap < node->radius + 0.5)
            gap = true_gap(w->truth, state->position[i], node->radius + 1);
        deepest = fmax(deepest, node->radius - gap);
    }
    return deepest;
}

static bool is_kinked(const WireState *state)
{
    for (int i = 0; i + 1 < state->node_count; i++) {
        const Quat *p = &state->orientation[i], *q = p + 1;
        // only about the transverse axes; the twist does not count
        Quat turn = quat_mul(quat_conjugate(*p), *q);
        if (2 * asin(fmin(1, hypot(turn.y, turn.z))) > kink_rad)
            return true;
    }
    return false;
}

static bool is_finite(const WireState *state)
{
    double sum = 0;
    for (int i = 0; i < state->node_count; i++)
        sum += 0 * (vec3_norm2(state->position[i]) + vec3_norm2(state->velocity[i]) + state->orientation[i].w);
    return sum == 0;
}

static bool watch_step(void *context, Simulator *simulator, const ToolCommands *commands)
{
    Witness *w = context;
    const StepReport *report = simulator_last(simulator);
    for (int k = 0; k < stepper_tool_count(w->stepper); k++)
        w->fed[k] += commands->tool[k].push_mm_s * simulator_scene(simulator)->dt / 1000;
    // the report is for the state at the start of the step, which was measured after the previous step
    if (w->outside_before - report->penetration > w->outcome->unreported)
        w->outcome->unreported = w->outside_before - report->penetration;
    w->outside_before = 0;
    if (++w->step % TRUTH_EVERY != 0)
        return true;
    if (!is_finite(stepper_state(w->stepper))) {
        w->outcome->failed |= FAILED_NUMBER;
        return false;
    }
    w->outcome->kinks |= is_kinked(stepper_state(w->stepper));
    w->outside_before = true_depth(w);
    if (w->outside_before > w->outcome->deepest) {
        w->outcome->deepest = w->outside_before;
        w->outcome->deepest_s = simulator_time_s(simulator);
    }
    return true;
}

static void drive(const Scene *scene, const Vessel *contact, const Vessel *truth, Outcome *outcome, Faults *faults)
{
    Simulator *simulator = simulator_create(scene, contact, faults);
    Witness witness = {.outcome = outcome, .contact = contact, .truth = truth, .stepper = simulator ? simulator_stepper(simulator) : NULL};
    witness.node = simulator ? calloc((size_t)stepper_node_capacity(witness.stepper), sizeof *witness.node) : NULL;
    if (simulator && witness.node) {
        double inserted[STEP_TOOLS_MAX];
        int tools = stepper_tool_count(witness.stepper);
        for (int k = 0; k < tools; k++)
            inserted[k] = stepper_tool_inserted(witness.stepper, k);
        simulator_watch_energy(simulator);
        DriveOptions options = drive_default_options();
        options.script = scene->script;
        options.after_step = watch_step;
        options.context = &witness;
        DriveReport report = simulator_drive(simulator, &options);
        const RunTotals *totals = simulator_totals(simulator);
        outcome->steps = totals->steps;
        outcome->cut = totals->limited_steps;
        outcome->not_converged = totals->not_converged_steps;
        outcome->gained = simulator_energy(simulator)->gained;
        outcome->gained_end = simulator_energy(simulator)->gained_end;
        outcome->gained_mean = simulator_energy(simulator)->gained_mean;
        outcome->work = simulator_energy(simulator)->work;
        for (int k = 0; k < tools; k++)
            outcome->not_taken = fmax(outcome->not_taken, fabs(inserted[k] + witness.fed[k] - stepper_tool_inserted(witness.stepper, k)));
        outcome->failed |= (report.end == DRIVE_DIVERGED ? FAILED_NUMBER : 0) | (outcome->deepest > outside_mm ? FAILED_DEEP : 0) |
                           (outcome->unreported > unreported_mm ? FAILED_UNREPORTED : 0) |
                           (simulator_gains_energy(simulator) && !outcome->kinks ? FAILED_ENERGY : 0);
    }
    free(witness.node);
    simulator_destroy(simulator);
}

// Writes the whole text of a scene; `name` is for messages.
static void run_text(Torture *torture, const char *text, const char *name, Outcome *outcome)
{
    Faults *faults = calloc(1, sizeof *faults);
    if (!faults) {
        outcome->failed |= FAILED_REFUSED;
        return;
    }
    OpenVessel open = {0};
    Shape *shape = NULL;
    pthread_mutex_lock(&torture->files);
    Scene *scene = scene_parse(text, strlen(text), name, faults);
    bool good = scene && cli_open_vessel(scene, torture->common.threads, true, &open, faults) && open_vessel_inlet(scene, &open, faults);
    if (good && scene->source == SOURCE_SHAPE)
        shape = shape_create(scene->shape_name, scene->shape_option_count, (const char(*)[2][64])scene->shape_option, name, faults);
    pthread_mutex_unlock(&torture->files);
    Vessel *truth = shape ? shape_vessel_create(shape) : NULL;
    if (good && faults->count == 0)
        drive(scene, open.vessel, truth, outcome, faults);
    if (faults->count > 0) {
        outcome->failed |= FAILED_REFUSED;
        snprintf(outcome->reason, sizeof outcome->reason, "%.*s", FAULT_TEXT - 1, faults->text[0]);
    }
    if (truth)
        truth->destroy(truth);
    shape_free(shape);
    open_vessel_close(&open);
    scene_free(scene);
    free(faults);
}

static void keep_scene(const Torture *torture, int64_t seed, const char *text, const Outcome *outcome)
{
    char path[4200], what[400] = "";
    Faults *faults = calloc(1, sizeof *faults);
    for (int i = 0; i < FAILURES; i++)
        if (outcome->failed >> i & 1)
            snprintf(what + strlen(what), sizeof what - strlen(what), "%s%s", *what ? ", " : "", failure_name[i]);
    snprintf(path, sizeof path, "%.4000s/torture-%lld.yaml", torture->keep, (long long)seed);
    bool is_kept = faults && output_write(path, text, strlen(text), faults);
    fprintf(stderr, "seed %lld, %s in a %s: %s (%.3f mm deep at %.3f s, %.3f mm of it not reported, gained %.3g of %.3g mJ)%s%s; %s\n", (long long)seed,
            torture_tool_name[outcome->tool], torture_vessel_name[outcome->vessel], what, outcome->deepest, outcome->deepest_s, fmax(0, outcome->unreported),
            outcome->gained, outcome->work, *outcome->reason ? ": " : "", outcome->reason, is_kept ? path : "not kept");
    free(faults);
}

static void run_seed(void *context, long index)
{
    Torture *torture = context;
    Outcome *outcome = &torture->outcome[index];
    char name[64];
    int64_t seed = (int64_t)torture->first + index;
    TortureScene scene = torture_scene((uint64_t)seed, (int64_t)torture->steps, torture->model_count, torture->model, torture->lumen);
    snprintf(name, sizeof name, "torture-%lld.yaml", (long long)seed);
    *outcome = (Outcome){.vessel = scene.vessel, .tool = scene.tool};
    if (!scene.text) {
        outcome->failed = FAILED_REFUSED;
        return;
    }
    run_text(torture, scene.text, name, outcome);
    if (torture->finer > 0 && seed % (int64_t)torture->finer == 0 && outcome->failed == 0) {
        Outcome finer = {0};
        char *text = torture_scene_finer((uint64_t)seed, (int64_t)torture->steps, torture->model_count, torture->model, torture->lumen);
        if (text)
            run_text(torture, text, name, &finer);
        free(text);
        outcome->was_compared = !(finer.failed & FAILED_REFUSED);
        outcome->failed |= outcome->was_compared && outcome->not_taken > finer.not_taken + stuck_mm ? FAILED_STUCK : 0;
    }
    if (outcome->failed)
        keep_scene(torture, seed, scene.text, outcome);
    free(scene.text);
}

// --- the table ---

typedef struct Row {
    int64_t runs, steps, cut, not_converged, compared, kinked;
    int64_t failed[FAILURES], by_end, by_mean;     // by_end, by_mean: runs that gain energy by one criterion alone (simulator.h)
    double deepest, unreported, gained_share;
} Row;

static void add_run(Row *row, const Outcome *o)
{
    row->runs++;
    row->steps += o->steps;
    row->cut += o->cut;
    row->not_converged += o->not_converged;
    row->compared += o->was_compared;
    row->kinked += o->kinks;
    row->deepest = fmax(row->deepest, o->deepest);
    row->unreported = fmax(row->unreported, o->unreported);
    row->gained_share = fmax(row->gained_share, o->work > 0 && !o->kinks ? o->gained / o->work : 0);
    double allowed = energy_gain_share * o->work + 1e-6;
    row->by_end += !o->kinks && o->gained_end > allowed;
    row->by_mean += !o->kinks && o->gained_mean > allowed;
    for (int i = 0; i < FAILURES; i++)
        row->failed[i] += o->failed >> i & 1;
}

static void print_row(FILE *out, const char *vessel, const char *tool, const Row *row)
{
    fprintf(out, "%-7s %-18s %6lld %10lld %9.3f %9.3f %9.1e %8lld %8lld %6lld |%5lld %5lld %5lld %5lld (%lld, %lld) %5lld/%-4lld %5lld\n", vessel, tool,
            (long long)row->runs, (long long)row->steps, row->deepest, row->unreported, row->gained_share, (long long)row->cut, (long long)row->not_converged,
            (long long)row->kinked, (long long)row->failed[0], (long long)row->failed[1], (long long)row->failed[2], (long long)row->failed[3],
            (long long)row->by_end, (long long)row->by_mean, (long long)row->failed[4], (long long)row->compared, (long long)row->failed[5]);
}

static cJSON *row_json(const char *vessel, const char *tool, const Row *row)
{
    cJSON *at = cJSON_CreateObject();
    const struct {
        const char *name;
        double value;
    } figure[] = {{"runs", (double)row->runs},
                  {"steps", (double)row->steps},
                  {"deepest_mm", row->deepest},
                  {"unreported_mm", row->unreported},
                  {"gained_share", row->gained_share},
                  {"cut_steps", (double)row->cut},
                  {"not_converged_steps", (double)row->not_converged},
                  {"compared", (double)row->compared},
                  {"kinked", (double)row->kinked},
                  {"gained_by_end", (double)row->by_end},
                  {"gained_by_mean", (double)row->by_mean}};
    cJSON_AddStringToObject(at, "vessel", vessel);
    cJSON_AddStringToObject(at, "tool", tool);
    for (size_t i = 0; i < sizeof figure / sizeof figure[0]; i++)
        cJSON_AddNumberToObject(at, figure[i].name, figure[i].value);
    cJSON *failed = cJSON_AddObjectToObject(at, "failed");
    for (int i = 0; i < FAILURES; i++)
        cJSON_AddNumberToObject(failed, failure_name[i], (double)row->failed[i]);
    return at;
}

// True if no run failed.
static bool print_table(const Torture *torture, cJSON *list)
{
    static Row row[TORTURE_VESSELS][TORTURE_TOOLS], all;
    FILE *out = bench_text(&torture->common);
    for (int64_t i = 0; i < (int64_t)torture->runs; i++) {
        add_run(&row[torture->outcome[i].vessel][torture->outcome[i].tool], &torture->outcome[i]);
        add_run(&all, &torture->outcome[i]);
    }
    fprintf(out, "vessel  tool                 runs      steps   deepest    unrep.    gained     cut    not conv. kinked | deep unrep.  NaN energy (by end, by "
                 "mean) stuck/of  refused\n"
                 "                                                  [mm]      [mm]   of work   [steps]  [steps]   runs | runs that failed\n");
    for (int v = 0; v < TORTURE_VESSELS; v++)
        for (int t = 0; t < TORTURE_TOOLS; t++)
            if (row[v][t].runs > 0) {
                print_row(out, torture_vessel_name[v], torture_tool_name[t], &row[v][t]);
                cJSON_AddItemToArray(list, row_json(torture_vessel_name[v], torture_tool_name[t], &row[v][t]));
            }
    print_row(out, "all", "", &all);
    cJSON_AddItemToArray(list, row_json("all", "", &all));
    int64_t failed = 0;
    for (int i = 0; i < FAILURES; i++)
        failed += all.failed[i];
    return failed == 0;
}

// --- the verb ---

// The radius of each model at its root, and its absolute path.
static bool look_at_models(Torture *torture, Faults *faults)
{
    static char whole[MODELS_MOST][PATH_MAX];
    for (int i = 0; i < torture->model_count; i++) {
        VesselTree *tree = tree_file_load(torture->model[i], NULL, faults);
        if (!tree || !vessel_tree_is_model(tree) || !realpath(torture->model[i], whole[i])) {
            faults_add(faults, torture->model[i], 0, 0, "is not a fitted model; make one with `seldinger fit`");
            vessel_tree_free(tree);
            return false;
        }
        torture->model[i] = whole[i];
        torture->lumen[i] = tree->radius[0];
        vessel_tree_free(tree);
    }
    return true;
}

static int call(void *options, Faults *faults)
{
    Torture *torture = options;
    ProgressBar bar;
    torture->outcome = calloc((size_t)torture->runs, sizeof *torture->outcome);
    if (!torture->outcome)
        faults_add(faults, "bench torture", 0, 0, "no memory for %.0f runs", torture->runs);
    if (!torture->outcome || !look_at_models(torture, faults)) {
        free(torture->outcome);
        return EXIT_BAD_INPUT;
    }
    pthread_mutex_init(&torture->files, NULL);
    Progress progress = progress_bar(&bar, "torture", false);
    parallel_for(torture->common.threads, (long)torture->runs, run_seed, torture, &progress);
    cJSON *root = cJSON_CreateObject();
    bool good = print_table(torture, cJSON_AddArrayToObject(root, "rows"));
    bool written = bench_write_json(&torture->common, root, faults);
    cJSON_Delete(root);
    pthread_mutex_destroy(&torture->files);
    free(torture->outcome);
    return !written ? EXIT_BAD_INPUT : good ? EXIT_DONE : EXIT_DIFFERENT;
}

#define NUMBER(member, low, high, text) OPTION_WHOLE, OPTION_AT(Torture, member), text, .least = low, .most = high
static const Option rows[] = {
    {"runs", "N", NUMBER(runs, 1, 1e7, "random runs")},
    {"first", "N", NUMBER(first, 0, 1e15, "the first seed")},
    {"steps", "N", NUMBER(steps, 10, 1e7, "of each run")},
    {"finer", "N", NUMBER(finer, 0, 1e9, "every N-th run again with half the step and half the elements' length; 0: never")},
    {"model", "F", OPTION_FILE, OPTION_AT(Torture, model), "a model file as one of the vessels, up to 8", .count = offsetof(Torture, model_count),
     .times = MODELS_MOST, .otherwise = "scenes/aneurism/aneurism.h5 and scenes/arch/arch.h5 where they are here"},
    {"keep", "FOLDER", OPTION_FOLDER, OPTION_AT(Torture, keep), "for the scenes of runs that fail: torture-SEED.yaml", .otherwise = "the working folder"},
    BENCH_OPTIONS(Torture, common, "40 runs"),
};

static void set_defaults(void *structure)
{
    Torture *torture = structure;
    torture->runs = 200;
    torture->first = 1;
    torture->steps = 2000;
    torture->finer = 20;
    torture->keep = ".";
}

static const char *check(void *structure)
{
    static const char *const own[] = {"scenes/aneurism/aneurism.h5", "scenes/arch/arch.h5"};
    Torture *torture = structure;
    if (torture->common.quick)
        torture->runs = 40;
    bool given = torture->model_count > 0;
    for (int i = 0; !given && i < 2; i++)
        if (access(own[i], R_OK) == 0)
            torture->model[torture->model_count++] = own[i];
    return NULL;
}

static const OptionTable table = {
    .program = "seldinger bench torture",
    .does = "random hands, tools and vessels, compared with the true wall",
    .usage = "[options]",
    .intro =
        "Random scripts (push and pull up to 100 mm/s, twist up to 1000 degrees a second), tools (0.2 to 2 mm, 5 to 200 GPa, J, Simmons, pigtail, two to four "
        "coaxial tools), vessels (exact tubes of random bends, synthetic shapes, models of real vessels) and steps of 0.5 to 4 ms. Each run is compared with "
        "the true wall, not with that of the contact. A run fails if a node is more than 0.2 mm outside, or outside without a report; if a value is not a "
        "number; if single steps gain more than 1e-3 of the work (unless an element is bent by more than a radian: a kink); or if a tool is stuck but not in "
        "a finer run. The scene of each failed run is kept and can be run again.",
    .exits = "0 done; 1 a run failed; 2 wrong usage or bad input",
    CLI_OPTIONS(rows, Torture),
    .set_defaults = set_defaults,
    .check = check,
    .too_many = "unexpected argument ",
};

const Verb bench_torture = {.options = &table, .call = call};

// seldinger bench step: the cost of a simulation step, by stage, and its accuracy.
//
//   scenes       the whole script of spiral, phantom and aneurism with the widest SIMD level: CPU time of the step and its stages, contacts, depth
//   force error  steps at regular intervals, and all that did not converge, are repeated from a checkpoint with tolerance 1e-10; the error is the largest
//                difference of a node's wall force, divided by the largest force of the step. Some are repeated with the pointwise form, to 1e-8
//   growth       the spiral's wire in 50 to 800 elements
//   levels       the same runs with each SIMD level forced: the state hash must not change
//   kernels      assembly, factor and solve, detection alone, against the budgets (list_budgets)
#include "bench/tools.h"

#include "base/heap.h"
#include "base/output.h"
#include "base/simd.h"
#include "solver/block_chain.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CASES = 3, GROWTHS = 5 };

typedef struct Case {
    const char *name, *path, *needs;     // `needs`: without this file the case is skipped
} Case;
static const Case cases[CASES] = {{"spiral", "scenes/spiral/scene.yaml", NULL},
                                  {"phantom", "scenes/phantom/scene.yaml", NULL},
                                  {"aneurism", "scenes/aneurism/sac.yaml", "scenes/aneurism/aneurism.h5"}};
static const int growth_elements[GROWTHS] = {50, 100, 200, 400, 800};

typedef struct ForceError {
    int samples, unresolved;             // steps with contact; those whose reference did not converge
    double median, max;
    int capped_samples, capped_unresolved;   // the same of steps that did not converge themselves
    double capped_max;
    int pointwise_samples;
    double pointwise_max;                // tight block form against pointwise form
} ForceError;

typedef struct Kernels {                 // [us]
    double assembly, factor_solve;
    double detection[CASES];             // of this many points near the wall
    int points[CASES];
} Kernels;

typedef struct StepBench {
    BenchOptions options;
    bool tools;
    int64_t most_steps;
    bool present[CASES];
    StepFigures run[SIMD_COUNT][CASES];
    ForceError error[CASES];
    StepFigures growth[GROWTHS];
    Kernels kernels[SIMD_COUNT];
    bool same_hash;
} StepBench;

// --- force error ---

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Largest difference of a node's force over the largest force of `exact`; -1 if nothing touches.
static double force_difference(const NodeReport *node, const NodeReport *exact, int count)
{
    double top = 0, worst = 0;
    for (int i = 0; i < count; i++) {
        top = fmax(top, vec3_norm(exact[i].force));
        worst = fmax(worst, vec3_distance(node[i].force, exact[i].force));
    }
    return top > 1e-6 ? worst / top : -1;
}

static void solve_again(Simulator *solver, const Checkpoint *start, Command command, NodeReport *node)
{
    stepper_restore(simulator_stepper(solver), start);
    simulator_step_one_tool(solver, command);
    stepper_node_report(simulator_stepper(solver), node);
}

enum { RUN, TIGHT, POINTWISE, SOLVERS };

static void compare_forces(Simulator *const solver[SOLVERS], const Scene *scene, int64_t steps, int64_t every, int pointwise_every, NodeReport *node,
                           double *error, ForceError *out)
{
    int count = simulator_state(solver[RUN])->node_count, cursor = 0;
    Checkpoint *start = NULL;
    for (int64_t i = 0; i < steps; i++) {
        Command command = bench_command(scene, i, &cursor);
        start = stepper_save(simulator_stepper(solver[RUN]), start);
        simulator_step_one_tool(solver[RUN], command);
        bool capped = simulator_last(solver[RUN])->flags & STEP_NOT_CONVERGED;
        if ((i % every != 0 && !capped) || !start || simulator_last(solver[RUN])->active == 0)
            continue;
        stepper_node_report(simulator_stepper(solver[RUN]), node);
        solve_again(solver[TIGHT], start, command, node + count);
        if (simulator_last(solver[TIGHT])->flags & STEP_NOT_CONVERGED) {
            out->unresolved += !capped;
            out->capped_unresolved += capped;
            continue;
        }
        double e = force_difference(node, node + count, count);
        if (capped) {
            out->capped_samples++;
            out->capped_max = fmax(out->capped_max, e);
        }
        if (capped || e < 0)
            continue;
        error[out->samples++] = e;
        if (out->samples % pointwise_every != 1)
            continue;
        solve_again(solver[POINTWISE], start, command, node);
        if (!(simulator_last(solver[POINTWISE])->flags & STEP_NOT_CONVERGED)) {
            out->pointwise_samples++;
            out->pointwise_max = fmax(out->pointwise_max, force_difference(node, node + count, count));
        }
    }
    checkpoint_free(start);
}

// Runs the script a second time; its hash must be that of the first.
static bool force_error(const Scene *scene, const Vessel *vessel, int64_t steps, int samples, ForceError *out, uint64_t *hash, Faults *faults)
{
    Scene exact[SOLVERS] = {*scene, *scene, *scene};
    exact[TIGHT].contact_options = (ContactOptions){.form = CONTACT_BLOCK, .max_iterations = 5000, .tolerance = 1e-10};
    exact[POINTWISE].contact_options = (ContactOptions){.form = CONTACT_POINTWISE, .max_iterations = 100000, .tolerance = 1e-8};
    Simulator *solver[SOLVERS] = {0};
    bool good = true;
    *out = (ForceError){0};
    for (int k = 0; k < SOLVERS; k++)
        good &= (solver[k] = simulator_create(&exact[k], vessel, faults)) != NULL;
    NodeReport *node = good ? calloc((size_t)simulator_state(solver[RUN])->node_count * 2, sizeof *node) : NULL;
    double *error = calloc((size_t)samples + 2, sizeof *error);
    if (good && node && error) {
        int64_t every = steps / samples > 0 ? steps / samples + (steps % samples != 0) : 1;
        compare_forces(solver, scene, steps, every, samples / (samples > 100 ? 8 : 3) + 1, node, error, out);
        qsort(error, (size_t)out->samples, sizeof *error, ascending);
        out->median = out->samples ? error[out->samples / 2] : 0;
        out->max = out->samples ? error[out->samples - 1] : 0;
        *hash = simulator_hash(solver[RUN]);
    } else {
        good = false;
    }
    free(error);
    free(node);
    for (int k = 0; k < SOLVERS; k++)
        simulator_destroy(solver[k]);
    return good;
}

// --- kernels ---

enum { BATCH = 8, BATCHES = 201 };

// Median time of a call [us] over batches, after one batch to warm up.
static double time_of(void (*call)(void *context), void *context)
{
    double time[BATCHES];
    for (int i = -1; i < BATCHES; i++) {
        int64_t begin = bench_cpu_ns();
        for (int k = 0; k < BATCH; k++)
            call(context);
        if (i >= 0)
            time[i] = (double)(bench_cpu_ns() - begin) / 1000 / BATCH;
    }
    qsort(time, BATCHES, sizeof *time, ascending);
    return time[BATCHES / 2];
}

static void call_assemble(void *context) { step_assemble(context); }

// 200 free elements: a wire without sheath and vessel.
static double time_assembly(const Scene *spiral, Faults *faults)
{
    Scene loose = *spiral;
    loose.wire.has_sheath = false;
    loose.wire.elements = 200;
    Simulator *simulator = simulator_create(&loose, NULL, faults);
    if (!simulator)
        return 0;
    Stepper *stepper = simulator_stepper(simulator);
    step_feed(stepper, (StepCommand){0});
    step_detect(stepper);
    double time = time_of(call_assemble, stepper);
    simulator_destroy(simulator);
    return time;
}

typedef struct ChainSystem {
    BlockChain chain;
    BlockFactor *factor;
    double *b, *x;
} ChainSystem;

static void call_factor_solve(void *context)
{
    ChainSystem *s = context;
    block_chain_factor(&s->chain, s->factor);
    block_factor_solve(s->factor, s->b, s->x);
}

// 201 blocks: the time does not depend on their contents.
static double time_factor_solve(void)
{
    enum { NODES = 201 };
    ChainSystem s = {.factor = block_factor_create(NODES, 6), .b = HEAP_ZEROED(12 * NODES, sizeof(double))};
    double time = 0;
    if (block_chain_create(&s.chain, NODES, 6) && s.factor) {
        s.x = s.b + 6 * NODES;
        for (int i = 0; i < NODES; i++)
            for (int k = 0; k < 36; k++) {
                s.chain.diag[36 * i + k] = k % 7 == 0 ? 4 : 0.1;
                if (i + 1 < NODES)
                    s.chain.lower[36 * i + k] = 0.2 - 0.01 * k;
            }
        for (int i = 0; i < 6 * NODES; i++)
            s.b[i] = i % 5;
        time = time_of(call_factor_solve, &s);
    }
    block_chain_destroy(&s.chain);
    if (s.factor)
        block_factor_destroy(s.factor);
    free(s.b);
    return time;
}

enum { POINTS = 80 };

typedef struct Detection {
    const Vessel *vessel;
    int count;
    double reach;
    Vec3 point[2][POINTS];               // at two successive steps, used alternately
    VesselMemory memory[POINTS];
    VesselHit hit[POINTS];
    int turn;
} Detection;

static void call_query(void *context)
{
    Detection *d = context;
    d->turn ^= 1;
    vessel_query(d->vessel, d->count, d->point[d->turn], d->reach, d->memory, d->hit);
}

// The free nodes nearest to the wall at a step with many contacts, in order along the wire; they alternate between the positions before and after that step.
void bench_detection(const Scene *scene, const Vessel *vessel, int64_t step, double *detection, int *points, Faults *faults)
{
    Simulator *simulator = simulator_create(scene, vessel, faults);
    if (!simulator)
        return;
    int nodes = simulator_state(simulator)->node_count, cursor = 0;
    NodeReport *node = HEAP_ZEROED((size_t)nodes, sizeof *node);
    Vec3 *before = HEAP_ZEROED((size_t)nodes, sizeof *before);
    double *gap = HEAP_ZEROED((size_t)nodes, sizeof *gap);
    Detection d = {.vessel = vessel, .reach = 1};   // the query range of a step at this speed
    for (int64_t i = 0; i <= step; i++) {
        memcpy(before, simulator_state(simulator)->position, (size_t)nodes * sizeof *before);
        simulator_step_one_tool(simulator, bench_command(scene, i, &cursor));
    }
    stepper_node_report(simulator_stepper(simulator), node);
    for (int i = 0; i < nodes; i++)
        gap[i] = node[i].gap;
    qsort(gap, (size_t)nodes, sizeof *gap, ascending);
    double limit = fmin(gap[nodes < POINTS ? nodes - 1 : POINTS - 1], d.reach);
    for (int i = 0; i < nodes && d.count < POINTS; i++)
        if (node[i].gap <= limit && node[i].vessel_node >= 0) {
            d.memory[d.count] = (VesselMemory){.node = node[i].vessel_node};
            d.point[0][d.count] = before[i];
            d.point[1][d.count++] = simulator_state(simulator)->position[i];
        }
    *points = d.count;
    *detection = time_of(call_query, &d);
    free(gap);
    free(before);
    free(node);
    simulator_destroy(simulator);
}

// --- the runs ---

static bool run_cases(StepBench *bench, SimdLevel level, SimdLevel widest, Faults *faults)
{
    simd_force(level);
    for (int c = 0; c < CASES; c++) {
        if (!bench->present[c])
            continue;
        BenchScene s;
        StepFigures *run = &bench->run[level][c];
        bool good = bench_open(cases[c].path, bench->options.threads, &s, faults) && bench_run(s.scene, s.open.vessel, bench->most_steps, NULL, run, faults);
        if (good && c == 0) {
            bench->kernels[level].assembly = time_assembly(s.scene, faults);
            bench->kernels[level].factor_solve = time_factor_solve();
        }
        if (good)
            bench_detection(s.scene, s.open.vessel, run->crowded_step, &bench->kernels[level].detection[c], &bench->kernels[level].points[c], faults);
        if (good && level == widest) {
            uint64_t hash = 0;
            good = force_error(s.scene, s.open.vessel, run->steps, bench->options.quick ? 20 : 200, &bench->error[c], &hash, faults);
            bench->same_hash &= hash == run->hash;
        }
        for (int e = 0; good && c == 0 && level == widest && e < GROWTHS; e++) {
            s.scene->wire.elements = growth_elements[e];
            good = bench_run(s.scene, s.open.vessel, bench->most_steps, NULL, &bench->growth[e], faults);
        }
        bench_close(&s);
        if (!good)
            return false;
        bench->same_hash &= run->hash == bench->run[widest][c].hash;
    }
    return true;
}

// --- text ---

static void print_spread(FILE *out, const char *name, Spread s) { fprintf(out, "    %-10s %9.1f %9.1f %9.1f %9.1f\n", name, s.median, s.p99, s.p999, s.max); }

static void print_scene(FILE *out, const char *name, const StepFigures *run, const ForceError *error)
{
    fprintf(out, "\n%s: %" PRId64 " steps, %.2f times real time\n    CPU [us]      median       p99     p99.9       max\n", name, run->steps,
            run->simulated_s / run->cpu_s);
    print_spread(out, "step", run->step_us);
    for (int k = 0; k < STAGE_COUNT; k++)
        print_spread(out, stage_name[k], run->stage_us[k]);
    fprintf(out, "  candidates %.0f median, %.0f max; contacts with force %.0f median, %.0f max; %.0f iterations median, %.0f max\n", run->candidates.median,
            run->candidates.max, run->contacts.median, run->contacts.max, run->iterations.median, run->iterations.max);
    fprintf(out,
            "  penetration %.2f um median, %.2f p99, %.2f max; %" PRId64 " steps not converged (residual at most %.1e), %" PRId64 " linearised again, %" PRId64
            " limited\n",
            run->penetration_um.median, run->penetration_um.p99, run->penetration_um.max, run->not_converged, run->residual_max, run->linearised_again,
            run->limited);
    fprintf(out, "  force error %.1e median, %.1e max of %d steps (%d without reference); steps not converged %.1e max of %d (%d)\n", error->median, error->max,
            error->samples, error->unresolved, error->capped_max, error->capped_samples, error->capped_unresolved);
    fprintf(out, "  block against pointwise form %.1e at most, of %d steps; state hash %016" PRIx64 "\n", error->pointwise_max, error->pointwise_samples,
            run->hash);
}

// The steps of a tool that does not advance are fast, so that their times mean nothing.
static void print_stall(FILE *out, const StepFigures *run)
{
    if (fabs(run->stalled_mm) > 0.01)
        fprintf(out, "  STALLED: %.2f mm of the length fed by the hand are not in the vessel at the end\n", run->stalled_mm);
}

static void print_growth(FILE *out, const StepBench *bench)
{
    fprintf(out, "\ngrowth, spiral\n    elements  candidates   step [us]  per doubling       p99     p99.9  deepest [um]\n");
    for (int e = 0; e < GROWTHS; e++) {
        const StepFigures *g = &bench->growth[e];
        char ratio[32] = "-";
        if (e > 0)
            snprintf(ratio, sizeof ratio, "%.2f", g->step_us.median / bench->growth[e - 1].step_us.median);
        fprintf(out, "    %8d  %10.0f  %10.1f  %12s  %8.1f  %8.1f  %12.2f%s\n", growth_elements[e], g->candidates.max, g->step_us.median, ratio, g->step_us.p99,
                g->step_us.p999, g->penetration_um.max, g->flags & STEP_DIVERGED ? "  DIVERGED" : "");
    }
}

static void print_levels(FILE *out, const StepBench *bench, SimdLevel widest)
{
    fprintf(out, "\nSIMD levels: step and detection are medians [us]\n");
    for (int level = SIMD_SSE2; level <= (int)widest; level++) {
        const Kernels *k = &bench->kernels[level];
        fprintf(out, "    %-7s assembly of 200 elements %.2f us, factor and solve %.2f us\n", simd_name[level], k->assembly, k->factor_solve);
        for (int c = 0; c < CASES; c++) {
            const StepFigures *run = &bench->run[level][c];
            if (bench->present[c])
                fprintf(out, "      %-9s step %7.1f   detection of %2d points %6.2f   state hash %016" PRIx64 "%s\n", cases[c].name, run->step_us.median,
                        k->points[c], k->detection[c], run->hash, run->hash == bench->run[widest][c].hash ? "" : "  DIFFERS");
        }
    }
}

// --- budgets ---

typedef struct Budget {
    const char *scene, *item;
    double must, aim, measured;
} Budget;

enum { MOST_BUDGETS = 48 };

static int list_budgets(const StepBench *bench, SimdLevel widest, Budget *list)
{
    static const char *const factors[SIMD_COUNT] = {"factor and solve, SSE2 [us]", "factor and solve, AVX2 [us]", "factor and solve, AVX-512 [us]"};
    static const double factor_must[SIMD_COUNT] = {35, 20, 12}, factor_aim[SIMD_COUNT] = {25, 12, 8};
    static const char *const names[] = {"detection of 80 points [us]", "step, median [us]",     "step, p99.9 [us]",    "penetration, p50 [um]",
                                        "penetration, p99 [um]",       "penetration, max [um]", "force error, median", "force error, max"};
    enum { SCENE_BUDGETS = sizeof names / sizeof names[0] };
    static const double must[SCENE_BUDGETS] = {5, 300, 700, 2, 20, 200, 1e-3, 1e-3}, aim[SCENE_BUDGETS] = {2.5, 100, 400, 1, 10, 50, 1e-6, 1e-6};
    int count = 0;
    list[count++] = (Budget){"", "assembly of 200 elements [us]", 12, 6, bench->kernels[widest].assembly};
    for (int level = SIMD_SSE2; level <= (int)widest; level++)
        list[count++] = (Budget){"", factors[level], factor_must[level], factor_aim[level], bench->kernels[level].factor_solve};
    for (int c = 0; c < CASES; c++) {
        const StepFigures *run = &bench->run[widest][c];
        const Kernels *k = &bench->kernels[widest];
        const ForceError *error = &bench->error[c];
        const double measured[SCENE_BUDGETS] = {k->detection[c] * POINTS / fmax(1, k->points[c]),
                                                run->step_us.median,
                                                run->step_us.p999,
                                                run->penetration_um.median,
                                                run->penetration_um.p99,
                                                run->penetration_um.max,
                                                error->median,
                                                fmax(error->max, error->capped_max)};
        for (int i = 0; bench->present[c] && i < SCENE_BUDGETS; i++)
            list[count++] = (Budget){cases[c].name, names[i], must[i], aim[i], measured[i]};
    }
    double worst = 0;
    for (int e = 1; e < GROWTHS; e++)
        worst = fmax(worst, bench->growth[e].step_us.median / bench->growth[e - 1].step_us.median);
    list[count++] = (Budget){"spiral", "cost when nodes double, worst", 2.6, 2.1, worst};
    return count;
}

static const char *verdict(const Budget *b) { return b->measured <= b->aim ? "aim" : b->measured <= b->must ? "must" : "MISSED"; }

static void print_budgets(FILE *out, const StepBench *bench, SimdLevel widest)
{
    Budget list[MOST_BUDGETS];
    int count = list_budgets(bench, widest, list);
    fprintf(out, "\nbudgets                                              must        aim   measured\n");
    for (int i = 0; i < count; i++)
        fprintf(out, "    %-9s %-32s %10.3g %10.3g %10.3g  %s\n", list[i].scene, list[i].item, list[i].must, list[i].aim, list[i].measured, verdict(&list[i]));
}

// --- JSON ---

static void add_levels(cJSON *list, const StepBench *bench, SimdLevel widest)
{
    for (int level = SIMD_SSE2; level <= (int)widest; level++) {
        cJSON *at = cJSON_CreateObject();
        const Kernels *k = &bench->kernels[level];
        cJSON_AddStringToObject(at, "level", simd_name[level]);
        cJSON_AddNumberToObject(at, "assembly_us", k->assembly);
        cJSON_AddNumberToObject(at, "factor_solve_us", k->factor_solve);
        for (int c = 0; c < CASES; c++) {
            if (!bench->present[c])
                continue;
            cJSON *run = bench_figures_json(&bench->run[level][c]);
            cJSON_AddNumberToObject(run, "detection_us", k->detection[c]);
            cJSON_AddNumberToObject(run, "detection_points", k->points[c]);
            cJSON_AddItemToObject(at, cases[c].name, run);
        }
        cJSON_AddItemToArray(list, at);
    }
}

static bool write_json(const StepBench *bench, SimdLevel widest, Faults *faults)
{
    cJSON *root = cJSON_CreateObject(), *scenes = cJSON_AddArrayToObject(root, "scenes"), *at;
    cJSON_AddStringToObject(root, "processor", bench_processor());
    for (int c = 0; c < CASES; c++) {
        if (!bench->present[c])
            continue;
        const ForceError *error = &bench->error[c];
        cJSON_AddItemToArray(scenes, at = bench_figures_json(&bench->run[widest][c]));
        cJSON_AddStringToObject(at, "name", cases[c].name);
        cJSON_AddStringToObject(at, "level", simd_name[widest]);
        cJSON *e = cJSON_AddObjectToObject(at, "force_error");
        cJSON_AddNumberToObject(e, "median", error->median);
        cJSON_AddNumberToObject(e, "max", error->max);
        cJSON_AddNumberToObject(e, "samples", error->samples);
        cJSON_AddNumberToObject(e, "without_reference", error->unresolved);
        cJSON_AddNumberToObject(e, "not_converged_max", error->capped_max);
        cJSON_AddNumberToObject(e, "not_converged_samples", error->capped_samples);
        cJSON_AddNumberToObject(e, "not_converged_without_reference", error->capped_unresolved);
        cJSON_AddNumberToObject(e, "pointwise_max", error->pointwise_max);
        cJSON_AddNumberToObject(e, "pointwise_samples", error->pointwise_samples);
    }
    cJSON *growth = cJSON_AddArrayToObject(root, "growth");
    for (int e = 0; e < GROWTHS; e++) {
        cJSON_AddItemToArray(growth, at = bench_figures_json(&bench->growth[e]));
        cJSON_AddNumberToObject(at, "elements", growth_elements[e]);
    }
    add_levels(cJSON_AddArrayToObject(root, "levels"), bench, widest);
    cJSON_AddBoolToObject(root, "same_hash", bench->same_hash);
    Budget list[MOST_BUDGETS];
    int count = list_budgets(bench, widest, list);
    cJSON *budgets = cJSON_AddArrayToObject(root, "budgets");
    for (int i = 0; i < count; i++) {
        cJSON_AddItemToArray(budgets, at = cJSON_CreateObject());
        if (*list[i].scene)
            cJSON_AddStringToObject(at, "scene", list[i].scene);
        cJSON_AddStringToObject(at, "item", list[i].item);
        cJSON_AddNumberToObject(at, "must", list[i].must);
        cJSON_AddNumberToObject(at, "aim", list[i].aim);
        cJSON_AddNumberToObject(at, "measured", list[i].measured);
        cJSON_AddStringToObject(at, "verdict", verdict(&list[i]));
    }
    bool good = bench_write_json(&bench->options, root, faults);
    cJSON_Delete(root);
    return good;
}

// --- the verb ---

static int tools_table(const BenchOptions *options, Faults *faults)
{
    static ToolsBench bench;
    FILE *out = bench_text(options);
    fprintf(out, "%s, %s\n", bench_processor(), simd_name[simd_level()]);
    if (!bench_tools(options, &bench, faults))
        return EXIT_BAD_INPUT;
    bench_tools_print(out, &bench);
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "processor", bench_processor());
    bench_tools_json(cJSON_AddArrayToObject(root, "tools"), &bench);
    bool good = bench_write_json(options, root, faults);
    cJSON_Delete(root);
    return good ? EXIT_DONE : EXIT_BAD_INPUT;
}

static int call(void *options, Faults *faults)
{
    StepBench *bench = options;
    if (!output_check(bench->options.json, faults))
        return EXIT_BAD_INPUT;
    if (bench->tools)
        return tools_table(&bench->options, faults);
    FILE *out = bench_text(&bench->options);
    bench->most_steps = bench->options.quick ? 200 : INT64_MAX;
    SimdLevel widest = simd_level();
    bench->same_hash = true;
    fprintf(out, "%s, %s\n", bench_processor(), simd_name[widest]);
    for (int c = 0; c < CASES; c++) {
        bench->present[c] = !cases[c].needs || access(cases[c].needs, R_OK) == 0;
        if (!bench->present[c])
            fprintf(out, "%s: skipped, %s is not here\n", cases[c].name, cases[c].needs);
    }
    bool good = run_cases(bench, widest, widest, faults);
    for (int c = 0; good && c < CASES; c++)
        if (bench->present[c]) {
            print_scene(out, cases[c].name, &bench->run[widest][c], &bench->error[c]);
            print_stall(out, &bench->run[widest][c]);
        }
    if (good)
        print_growth(out, bench);
    fflush(out);
    for (int level = (int)widest - 1; good && level >= SIMD_SSE2; level--)
        good = run_cases(bench, (SimdLevel)level, widest, faults);
    simd_force(widest);
    if (good) {
        print_levels(out, bench, widest);
        print_budgets(out, bench, widest);
        if (!bench->same_hash)
            fprintf(out, "\nSTATE HASHES DIFFER\n");
        good = write_json(bench, widest, faults);
    }
    if (!good)
        return EXIT_BAD_INPUT;
    return bench->same_hash ? EXIT_DONE : EXIT_DIFFERENT;
}

static const Option rows[] = {
    {"tools", NULL, OPTION_FLAG, OPTION_AT(StepBench, tools),
     "coaxial tools instead: one to four of them with 50 to 400 nodes, in the phantom, the arch and the angiogram"},
    BENCH_OPTIONS(StepBench, options, "200 steps of each scene, fewer samples"),
};

static const OptionTable table = {
    .program = "seldinger bench step",
    .does = "a simulation step: spiral at 100 GPa, phantom, aneurism; growth with the elements; SIMD levels; budgets; --tools: coaxial tools",
    .usage = "[options]",
    .intro = "Time of a simulation step by stage, and its error: spiral at 100 GPa, phantom and aneurism; 50 to 800 elements; each SIMD level. Run it "
             "from the "
             "project's folder. Times are CPU times of the simulation's thread.",
    .exits = "0 done; 1 state hashes differ between SIMD levels or repetitions; 2 wrong usage or bad input",
    CLI_OPTIONS(rows, StepBench),
    .too_many = "unexpected argument ",
};

const Verb bench_step = {.options = &table, .call = call};

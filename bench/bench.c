// Measurement of runs, shared by all tables.
#include "bench/bench.h"

#include "base/output.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

int64_t bench_cpu_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

const char *bench_processor(void)
{
    static char name[128] = "unknown processor";
    FILE *file = fopen("/proc/cpuinfo", "r");
    char line[256];
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "model name : %127[^\n]", name) == 1)
            break;
    if (file)
        fclose(file);
    return name;
}

Spread bench_spread(const TimeHistogram *histogram, double unit)
{
    return (Spread){histogram_quantile(histogram, 0.5) / unit, histogram_quantile(histogram, 0.99) / unit, histogram_quantile(histogram, 0.999) / unit,
                    (double)histogram->largest / unit};
}

static void bench_add_spread(cJSON *object, const char *name, Spread s)
{
    cJSON *at = cJSON_AddObjectToObject(object, name);
    cJSON_AddNumberToObject(at, "median", s.median);
    cJSON_AddNumberToObject(at, "p99", s.p99);
    cJSON_AddNumberToObject(at, "p999", s.p999);
    cJSON_AddNumberToObject(at, "max", s.max);
}

cJSON *bench_figures_json(const StepFigures *run)
{
    cJSON *at = cJSON_CreateObject();
    char hash[17];
    snprintf(hash, sizeof hash, "%016" PRIx64, run->hash);
    cJSON_AddNumberToObject(at, "steps", (double)run->steps);
    cJSON_AddNumberToObject(at, "real_time_factor", run->simulated_s / run->cpu_s);
    bench_add_spread(at, "step_us", run->step_us);
    cJSON *stages = cJSON_AddObjectToObject(at, "stage_us");
    for (int k = 0; k < STAGE_COUNT; k++)
        bench_add_spread(stages, stage_name[k], run->stage_us[k]);
    bench_add_spread(at, "candidates", run->candidates);
    bench_add_spread(at, "contacts", run->contacts);
    bench_add_spread(at, "iterations", run->iterations);
    bench_add_spread(at, "penetration_um", run->penetration_um);
    cJSON_AddNumberToObject(at, "not_converged_steps", (double)run->not_converged);
    cJSON_AddNumberToObject(at, "linearised_again_steps", (double)run->linearised_again);
    cJSON_AddNumberToObject(at, "limited_steps", (double)run->limited);
    cJSON_AddNumberToObject(at, "residual_max", run->residual_max);
    cJSON_AddNumberToObject(at, "stalled_mm", run->stalled_mm);
    cJSON_AddStringToObject(at, "state_hash", hash);
    return at;
}

Command bench_command(const Scene *scene, int64_t step, int *cursor)
{
    return scene->script ? script_at(scene->script, (double)step * scene->dt / 1000, cursor) : (Command){0, 0};
}

int64_t bench_steps(const Scene *scene, int64_t most)
{
    int64_t steps = scene->script ? (int64_t)ceil(script_duration_s(scene->script) * 1000 / scene->dt - 1e-6) : 0;
    return steps < most ? steps : most;
}

void bench_figures(const Simulator *simulator, double cpu_s, StepFigures *figures)
{
    figures->cpu_s = cpu_s;
    const StepProfile *profile = simulator_profile(simulator);
    const RunTotals *totals = simulator_totals(simulator);
    figures->steps = totals->steps;
    figures->simulated_s = simulator_time_s(simulator);
    figures->step_us = bench_spread(&profile->step, 1000);
    for (int k = 0; k < STAGE_COUNT; k++)
        figures->stage_us[k] = bench_spread(&profile->stage[k], 1000);
    figures->candidates = bench_spread(&profile->candidates, 1);
    figures->contacts = bench_spread(&profile->contacts, 1);
    figures->iterations = bench_spread(&profile->iterations, 1);
    figures->penetration_um = bench_spread(&profile->penetration_nm, 1000);
    figures->not_converged = totals->not_converged_steps;
    figures->linearised_again = totals->further_linearisations;
    figures->limited = totals->limited_steps;
    figures->residual_max = totals->residual_max;
    figures->flags = totals->flags;
    figures->last = *simulator_last(simulator);
    figures->inserted_mm = simulator_state(simulator)->inserted;
    figures->hash = simulator_hash(simulator);
}

bool bench_run(const Scene *scene, const Vessel *vessel, int64_t most, const StepTrace *trace, StepFigures *figures, Faults *faults)
{
    *figures = (StepFigures){0};
    Simulator *simulator = simulator_create(scene, vessel, faults);
    if (!simulator)
        return false;
    int64_t steps = bench_steps(scene, most), begin = bench_cpu_ns();
    int cursor = 0, crowd = -1;
    double fed = simulator_state(simulator)->inserted, length = wire_length(&scene->wire);
    for (int64_t i = 0; i < steps && !(simulator_last(simulator)->flags & STEP_DIVERGED); i++) {
        int64_t start = trace ? bench_cpu_ns() : 0;
        Command command = bench_command(scene, i, &cursor);
        simulator_step_one_tool(simulator, command);
        fed = fmin(length, fmax(0, fed + command.push_mm_s * scene->dt / 1000));
        if (trace) {
            trace->us[i] = (double)(bench_cpu_ns() - start) / 1000;
            trace->contacts[i] = simulator_last(simulator)->active;
        }
        if (crowd < 80 && simulator_last(simulator)->candidates > crowd) {
            crowd = simulator_last(simulator)->candidates;
            figures->crowded_step = i;
        }
    }
    bench_figures(simulator, (double)(bench_cpu_ns() - begin) * 1e-9, figures);
    figures->stalled_mm = scene->wire.has_sheath ? fed - figures->inserted_mm : 0;
    simulator_destroy(simulator);
    return true;
}

bool bench_open(const char *path, int threads, BenchScene *out, Faults *faults)
{
    *out = (BenchScene){0};
    out->scene = scene_load(path, faults);
    return out->scene && cli_open_vessel(out->scene, threads, true, &out->open, faults) && open_vessel_inlet(out->scene, &out->open, faults);
}

void bench_close(BenchScene *scene)
{
    open_vessel_close(&scene->open);
    scene_free(scene->scene);
    *scene = (BenchScene){0};
}

FILE *bench_text(const BenchOptions *options) { return options->json && !strcmp(options->json, "-") ? stderr : stdout; }

bool bench_write_json(const BenchOptions *options, const cJSON *root, Faults *faults)
{
    if (!options->json)
        return true;
    char *text = cJSON_Print(root);
    if (!text)
        faults_add(faults, options->json, 0, 0, "cannot be written: out of memory");
    bool good = text && output_write(options->json, text, strlen(text), faults);
    free(text);
    return good;
}

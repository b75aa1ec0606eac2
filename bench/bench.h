// Shared by all benchmarks: runs of scenes to the end of their script, and the figures of a run.
#ifndef SELDINGER_BENCH_BENCH_H
#define SELDINGER_BENCH_BENCH_H

#include "cli/cli.h"
#include "sim/simulator.h"

#include <cJSON.h>

extern const Verb bench_step, bench_peer, bench_track, bench_fit, bench_collision, bench_wall, bench_torture, bench_drawing, bench_models, bench_papers;

typedef struct Spread {
    double median, p99, p999, max;
} Spread;

typedef struct StepFigures { // of all steps of a run; times are the thread's CPU time
    int64_t steps;
    double simulated_s, cpu_s;
    Spread step_us, stage_us[STAGE_COUNT];
    Spread candidates, contacts, iterations, penetration_um;
    int64_t not_converged, linearised_again, limited;
    double residual_max;
    unsigned flags;
    int64_t crowded_step;    // the first with 80 candidates, or else the most
    StepReport last;
    double inserted_mm, stalled_mm;      // at the end; length fed by the hand by which the tool did not advance
    uint64_t hash;
} StepFigures;

int64_t bench_cpu_ns(void);
// Figures at the end of a run, except `crowded_step` and `stalled_mm`. cpu_s: CPU time of the run.
void bench_figures(const Simulator *simulator, double cpu_s, StepFigures *figures);
Spread bench_spread(const TimeHistogram *histogram, double unit);
cJSON *bench_figures_json(const StepFigures *figures);
// The command of step i, from the scene's script.
Command bench_command(const Scene *scene, int64_t step, int *cursor);
int64_t bench_steps(const Scene *scene, int64_t most);   // number of steps of the script, at most `most`
typedef struct StepTrace {   // of each step; arrays of the caller with room for bench_steps()
    double *us;
    int *contacts;
} StepTrace;
// Runs at most `most` steps of the script; stops if a step diverges. `trace` may be NULL. False with a fault.
bool bench_run(const Scene *scene, const Vessel *vessel, int64_t most, const StepTrace *trace, StepFigures *figures, Faults *faults);

// Time of detection for the up to 80 points nearest to the wall at that step of the script [us], and the number of points.
void bench_detection(const Scene *scene, const Vessel *vessel, int64_t step, double *detection_us, int *points, Faults *faults);

// Opens a scene with its vessel; false with faults.
typedef struct BenchScene {
    Scene *scene;
    OpenVessel open;
} BenchScene;
bool bench_open(const char *path, int threads, BenchScene *out, Faults *faults);
void bench_close(BenchScene *scene);

// The processor's name for the head of a table.
const char *bench_processor(void);

// Options of all benchmarks.
typedef struct BenchOptions {
    bool quick;
    int threads;
    const char *json;
} BenchOptions;
// Their rows in an option table. `member`: the BenchOptions in the structure; `quick_text`: the effect of --quick.
#define BENCH_OPTIONS(structure, member, quick_text)                                                                                                           \
    {"quick", NULL, OPTION_FLAG, OPTION_AT(structure, member.quick), quick_text}, CLI_THREADS(structure, member.threads),                                      \
    {                                                                                                                                                          \
        "json", "F.json", OPTION_FILE, OPTION_AT(structure, member.json),                                                                                      \
            "also writes the figures; - is standard output, the tables then go to standard error"                                                              \
    }
// The stream for text: standard error if the JSON goes to standard output.
FILE *bench_text(const BenchOptions *options);
// No effect without --json.
bool bench_write_json(const BenchOptions *options, const cJSON *root, Faults *faults);

#endif

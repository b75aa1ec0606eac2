// What the timing tables share: a scene run to the end of its script, and its figures.
#ifndef SELDINGER_CLI_BENCH_H
#define SELDINGER_CLI_BENCH_H

#include "cli/cli.h"
#include "sim/simulator.h"

VerbFunction bench_step, bench_peer;

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
    double inserted_mm;
    uint64_t hash;
} StepFigures;

int64_t bench_cpu_ns(void);
Spread bench_spread(const TimeHistogram *histogram, double unit);
// The command of step i, from the scene's script.
Command bench_command(const Scene *scene, int64_t step, int *cursor);
int64_t bench_steps(const Scene *scene, int64_t most);   // of the script, but not more than `most`
// Runs the script, at most `most` steps of it; stops where a step diverges. False with a fault.
bool bench_run(const Scene *scene, const Vessel *vessel, int64_t most, StepFigures *figures, Faults *faults);

// A scene with its vessel, opened; false with faults.
typedef struct BenchScene {
    Scene *scene;
    OpenVessel open;
} BenchScene;
bool bench_open(const char *path, int threads, BenchScene *out, Faults *faults);
void bench_close(BenchScene *scene);

// A process name of the machine for the head of a table.
const char *bench_processor(void);

#endif

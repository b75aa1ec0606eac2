// Tools in a model, for `bench wall`.
#ifndef SELDINGER_BENCH_WALL_RUNS_H
#define SELDINGER_BENCH_WALL_RUNS_H

#include "bench/bench.h"

typedef struct StiffRun {
    double speed_mm_s, friction;
} StiffRun;
typedef struct StiffFigures {
    double in_mm, fed_mm, deepest_mm, push_max_n;
    unsigned flags;
    bool all_in;             // all that was fed is inserted, to 0.1 mm
} StiffFigures;
// A straight wire of 100 GPa and `diameter_mm`, pushed for `seconds` from the inlet. The scene is made here; nothing is read. False with a fault.
bool wall_stiff_run(const Vessel *vessel, double diameter_mm, double length_mm, double seconds, StiffRun run, StiffFigures *out, Faults *faults);
typedef struct PushFelt {
    double over_exact;       // mean push without friction over that on the exact wall, less 1
    double change_rms;       // change of the push from step to step over its mean …
    double exact_rms;        // … and on the exact wall, where it comes from the tool's snaps alone
    bool survived;
} PushFelt;
// The run of a scene of `bench collision` without friction, on the model and on the exact wall. False with faults.
bool wall_push_felt(const char *scene, const char *model_path, PushFelt *out, Faults *faults);

#endif

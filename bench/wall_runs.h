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
    bool all_in;             // the whole length fed is inserted, to 0.1 mm
} StiffFigures;
// Pushes a straight wire of 100 GPa and `diameter_mm` for `seconds` from the inlet. The scene is made here; no file is read. False with a fault.
bool wall_stiff_run(const Vessel *vessel, double diameter_mm, double length_mm, double seconds, StiffRun run, StiffFigures *out, Faults *faults);
typedef struct PushFelt {
    double over_exact;       // ratio of the mean push without friction to that on the exact wall, less 1
    double change_rms;       // change of the push from step to step, divided by the mean push …
    double exact_rms;        // … and the same on the exact wall, where only snaps of the tool cause it
    bool survived;
} PushFelt;
// Runs a scene of `bench collision` without friction, on the model and on the exact wall. False with faults.
bool wall_push_felt(const char *scene, const char *model_path, PushFelt *out, Faults *faults);

#endif

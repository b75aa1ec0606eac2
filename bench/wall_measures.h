// The measurements of `bench wall`, and the commands that make its trees and models.
#ifndef SELDINGER_BENCH_WALL_MEASURES_H
#define SELDINGER_BENCH_WALL_MEASURES_H

#include "bench/bench.h"
#include "geom/reach.h"

// --- The commands of `seldinger`, run as children in the order of use, so that users' results are measured ---
typedef struct WallCost {
    double cpu_s, wall_s;    // of all its threads
} WallCost;
// argv[0] is the verb; NULL at the end. False with a fault that gives the exit code. `cost` may be NULL.
bool wall_command(const char *const *argv, WallCost *cost, Faults *faults);

// --- Models ---
typedef struct PointFigures {
    int count, unsure;       // number of points queried, at most 60,000, evenly by their order; number of unsure results
    double mean, p99, most;  // [mm] of their distance to the wall as in contact
} PointFigures;
bool wall_points(const VesselTree *model, PointFigures *out);

// The junctions of a tree against the true shape: a link is false if its line leaves the true lumen by more than `slack_mm`.
typedef struct Shape Shape;
typedef struct TruthFigures {
    int junctions, capped, false_links, false_open;   // capped: of the true ones
} TruthFigures;
TruthFigures wall_judge_junctions(const VesselTree *model, const Reach *reach, const Shape *truth, double slack_mm);

// Moves the points randomly by `sigma_mm` in each direction (standard deviation), for fits with different noise. False with a fault.
bool wall_write_jittered(const char *tree_path, double sigma_mm, uint64_t seed, const char *out_path, Faults *faults);

#endif

// What `bench wall` is made of: the table, the commands that make its trees and models, and the measurements of a model and of tools in it.
#ifndef SELDINGER_BENCH_WALL_H
#define SELDINGER_BENCH_WALL_H

#include "bench/bench.h"

#include "geom/reach.h"

typedef struct WallLimits {
    double must, aim;        // NAN: none
    bool at_least;           // otherwise: at most
} WallLimits;

typedef struct WallLine {
    char row[24], on[32], what[64], unit[16], note[160];
    double value;            // NAN: could not be measured, the note says why
    WallLimits limits;
} WallLine;

typedef struct WallTable {
    int count, capacity;
    WallLine *line;
    FILE *out;
    const char *row, *on;    // of the lines that are added
} WallTable;

// Adds a line and prints it. `note` may be NULL.
void wall_add(WallTable *table, const char *what, double value, const char *unit, WallLimits limits, const char *note);
// Says that a row is left out, and why.
void wall_skip(WallTable *table, const char *why);

// --- The commands of `seldinger`, run as children in the order of use, so that what is measured is what a user gets ---
typedef struct WallCost {
    double cpu_s, wall_s;    // of all its threads
} WallCost;
// argv[0] is the verb; NULL at the end. False with a fault that says how it ended. `cost` may be NULL.
bool wall_command(const char *const *argv, WallCost *cost, Faults *faults);

// --- Models ---
typedef struct PointFigures {
    int count, unsure;       // points asked, at most 60,000, evenly by their order; answers that are not sure
    double mean, p99, most;  // [mm] of their distance to the wall as met
} PointFigures;
bool wall_points(const VesselTree *model, PointFigures *out);

// The junctions of a tree against the true shape: a link is false where its line leaves the true lumen by more than `slack_mm`.
typedef struct Shape Shape;
typedef struct TruthFigures {
    int junctions, capped, false_links, false_open;   // capped: of the true ones
} TruthFigures;
TruthFigures wall_judge_junctions(const VesselTree *model, const Reach *reach, const Shape *truth, double slack_mm);

// The points moved by `sigma_mm` in each direction (standard deviation), for fits whose input's noise differs. False with a fault.
bool wall_write_jittered(const char *tree_path, double sigma_mm, uint64_t seed, const char *out_path, Faults *faults);

// --- Tools ---
typedef struct StiffRun {
    double speed_mm_s, friction;
} StiffRun;
typedef struct StiffFigures {
    double in_mm, fed_mm, deepest_mm, push_max_n;
    unsigned flags;
    bool all_in;             // what the hand fed is in, to 0.1 mm
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

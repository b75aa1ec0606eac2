// Measurements of `bench collision`: a recorded motion queried from any wall, and closed-loop runs compared with the true wall.
#ifndef SELDINGER_BENCH_COLLISION_RUN_H
#define SELDINGER_BENCH_COLLISION_RUN_H

#include "bench/bench.h"

// Where all free nodes were at the end of each step of a run.
typedef struct CollisionMotion {
    int node_count;
    double *radius;          // (M) [mm] of the tool
    int steps, step_capacity;
    int *first_node;         // (S) the first free node; all from there to the tip are free
    size_t *offset;          // (S+1) into the points
    double *reach;           // (S) [mm] range of the solver's queries at that step
    size_t point_capacity;
    Vec3 *point;             // (P)
    double *gap;             // (P) the truth [mm]; +HUGE_VAL if it is beyond reach or there is no wall
    Vec3 *normal;            // (P) the truth
} CollisionMotion;

void collision_motion_free(CollisionMotion *motion);
// Fills gap and normal by queries to `truth`. False if out of memory.
bool collision_motion_judge(CollisionMotion *motion, const Vessel *truth);

typedef struct ErrorFigures {
    double rms, max;
} ErrorFigures;

typedef struct CollisionReplay {
    int64_t steps, near_points;      // near: gap less the tool's radius is below half the query range, as for the solver's candidates
    double points_per_step, us_per_step, us_per_80_points;
    int64_t judged, lost;            // near points compared; near points without a result
    ErrorFigures gap_um, normal_deg; // over judged points; the normal only where the wall is nearer than half of the tool's clearance
} CollisionReplay;

// Each node has its own state, as in the solver. Times are CPU times of the queries, the smallest of `repeats` replays. False if out of memory.
bool collision_replay(const Vessel *wall, const CollisionMotion *motion, int repeats, CollisionReplay *out);

typedef struct CollisionLoop {
    int64_t steps, wanted;
    Spread step_us;
    double detect_us, contact_us;    // medians
    double candidates, candidates_max, contacts, contacts_max;   // points near enough to touch, and points with force; median and largest number
    double iterations;               // factorisations or sweeps, median
    int64_t not_converged;
    double penetration_um;           // deepest node outside the true wall
    double fed_mm, stalled_mm;
    bool survived;
    int64_t failed_step;             // -1
    char why[96];                    // first failure
    // measured only with without_friction
    double work_n;                   // [mJ/mm] lost along the true wall for each millimetre fed
    double work_mu;                  // the same as a coefficient of friction: over the work of the wall's forces if they were normal forces
} CollisionLoop;

typedef struct LoopOptions {
    int64_t most_steps;
    bool without_friction;           // mu = 0 everywhere, and the work is measured
    bool stop_at_failure;
    ContactOptions contact;
    CollisionMotion *record;         // NULL: not recorded
    double *push_n;                  // (bench_steps) proximal force at each step; NULL
} LoopOptions;

// `truth_gap` gives the same gaps as `truth`, perhaps without normals; it is used for depths.
bool collision_loop(const Scene *scene, const Vessel *wall, const Vessel *truth, const Vessel *truth_gap, const LoopOptions *options, CollisionLoop *out,
                    Faults *faults);

typedef struct PushFigures {
    double mean_n, reference_n;      // over the steps that both runs took
    double jitter_rms, jitter_p99;   // change of the push from step to step over its mean
} PushFigures;
PushFigures collision_push(const double *push_n, int64_t steps, const double *reference_n, int64_t reference_steps);

#endif

// What a vessel model does under a tool, for `bench models`: jumps of its wall, the time of queries, and runs of the wire.
#ifndef SELDINGER_BENCH_MODEL_RUNS_H
#define SELDINGER_BENCH_MODEL_RUNS_H

#include "bench/vessel_models.h"

// Largest jump of the wall's normal along the vessels [deg]: lines beside the wall are walked from node to node, and where the normal turns fast the turn is
// followed down to 1e-7 of their distance. What is left is no bend but an edge.
double model_jump_deg(const FittedModel *model, const VesselTree *tree);

// Median time [us] of 80 queries: points 0.3 radii inside the wall, which move 0.05 mm along it between queries.
double model_query_us(const FittedModel *model, const VesselTree *tree);

typedef struct ModelMesh {
    double seconds, update_s;        // of the whole mesh; of its update after the section in the middle of the first branch grew by a hundredth, NAN: has none
    int64_t triangles;
} ModelMesh;
// The mesh that `export` writes. False if out of memory. A swept model's rows are changed for the update, and restored.
bool model_mesh(const FittedModel *model, const VesselTree *tree, ModelMesh *out);

typedef struct ModelLoop {
    double deepest_mm;       // of a node outside the true wall
    double push_over_exact;  // mean push without friction relative to that on the exact wall, less 1
    double jitter_rms;       // change of the push from step to step over its mean
    double work_n;           // lost along the true wall for each millimetre fed, without friction: should be 0
    bool survived;
} ModelLoop;
// Runs a scene of `bench collision` without friction, in the model fitted to the scene's shape and in the exact shape. False with faults.
bool model_loop(const char *scene_path, const ModelKind *kind, int threads, ModelLoop *out, Faults *faults);

#endif

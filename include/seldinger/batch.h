// Many simulators stepped together, on all cores, by threads that live as long as the batch.
#ifndef SELDINGER_PUBLIC_BATCH_H
#define SELDINGER_PUBLIC_BATCH_H

#include "simulator.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct SelBatch SelBatch;

typedef struct SelBatchOptions {
    size_t size;
    int threads;                 // 1 to 256, the calling one among them; 0 (default): one for each core. The states do not depend on it
    int keeps_score;             // as SelSimulatorOptions
} SelBatchOptions;
SEL_API void sel_batch_options_init(SelBatchOptions *options, size_t size);
static inline SelBatchOptions sel_batch_defaults(void)
{
    SelBatchOptions options;
    sel_batch_options_init(&options, sizeof options);
    return options;
}

// A simulator for each of `count` scenes, 1 to 1000000; the same scene may be given many times. `options` may be NULL. Errors as for sel_simulator_create().
SEL_API SelStatus sel_batch_create(SelContext *context, int count, const SelScene *const *scene, const SelBatchOptions *options, SelBatch **batch);
// Also destroys its simulators.
SEL_API void sel_batch_destroy(SelBatch *batch);
SEL_API int sel_batch_count(const SelBatch *batch);
// A simulator of the batch, for all other functions while no batch step runs; never destroy it. NULL: no such index.
SEL_API SelSimulator *sel_batch_simulator(SelBatch *batch, int index);

// Makes `steps` steps of each simulator with its command, hand[index]. Simulators with skip[index] other than 0 are left as they are; `skip` may be NULL. Then
// updates the arrays below. Errors: SEL_ERROR_ARGUMENT (a command is out of range, which sel_fault() describes with its index; no step was taken),
// SEL_ERROR_OUTPUT (a recording cannot be written; all steps of the others were taken).
SEL_API SelStatus sel_batch_step(SelBatch *batch, const SelHand *hand, int steps, const unsigned char *skip);
// Updates the arrays below after simulators were changed by other functions.
SEL_API SelStatus sel_batch_refresh(SelBatch *batch);

// What every simulator shows after the last step. The arrays live as long as the batch.
typedef struct SelBatchRow {
    double time_s;
    double tip_mm[3];                    // of the innermost tool
    double push_n[SEL_TOOLS_MOST];       // as in SelReport …
    double torque_n_mm[SEL_TOOLS_MOST];
    double inserted_mm[SEL_TOOLS_MOST];
    double turned_deg[SEL_TOOLS_MOST];
    double wall_force_max_n, wall_force_sum_n;
    double penetration_mm;
    double target_mm;                    // distance of the foremost tip from the scene's first target; infinite without one
    uint64_t hash;                       // of the state, if sel_batch_hashes() wants it
    uint32_t flags, flags_ever;
    int32_t contacts;
    int32_t is_reached;                  // 1: the first target was reached
} SelBatchRow;
SEL_API const SelBatchRow *sel_batch_rows(const SelBatch *batch);        // (count)
// 1: rows have the hash of the state, about 5 us each; 0 (default): they have 0.
SEL_API SelStatus sel_batch_hashes(SelBatch *batch, int are_wanted);

#ifdef __cplusplus
}
#endif

#endif

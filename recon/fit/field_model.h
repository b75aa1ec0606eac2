// The shared blobs while they are fitted: who sees which, their residuals, and the solver. Inside recon; see field_fit.h.
#ifndef SELDINGER_RECON_FIT_FIELD_MODEL_H
#define SELDINGER_RECON_FIT_FIELD_MODEL_H

#include "recon/fit/field_rows.h"
#include "recon/fit/fit_lanes.h"

// How far, in its reach, a blob may come to reach in a sweep: nodes and rows are listed for that.
#define FIELD_ROOM 1.15

typedef struct FieldBlob {
    Vec3 center;
    double reach, amplitude;
    int owner;               // the node that the flood starts from
    Vec3 birth;              // where it was put, and how large: priors
    double birth_reach;
    int node_count, *node;   // nodes that see it, for FIELD_ROOM times its reach
    bool is_base;            // its amplitude stays positive: the base is lumen
    bool moved;              // since those were found
} FieldBlob;

typedef struct FieldModel {
    const VesselTree *tree;
    const FieldRows *rows;
    int threads;
    int count, capacity;
    FieldBlob *blob;         // (count)
    int64_t *offset;         // (N+1) node i sees blobs seen[offset[i] … offset[i+1]-1], ascending
    int *seen;
    bool *due;               // (N) rows of this node wait for a better fit
    bool amplitudes_only;    // places and sizes stand still
    double guard_weight;     // of a guard against a data point
    double smooth;           // weight of the slope rows
    double knee;             // of the loss, in local radii: a point further from the wall than that contradicts the others more than it counts
} FieldModel;

bool field_model_create(FieldModel *model, const VesselTree *tree, const FieldRows *rows, int threads);
void field_model_free(FieldModel *model);
// A blob of node `owner`; marks the rows that it touches as due when field_model_list is called. False without memory.
bool field_model_add(FieldModel *model, int owner, Vec3 center, double reach, double amplitude);
// Who sees which, anew for what is new or has moved.
bool field_model_list(FieldModel *model);
// Drops the blobs whose `keep` is false.
void field_model_keep(FieldModel *model, const bool *keep);
// A blob as a tile's rows see it, and whether any of them is within `share` of its reach.
LaneBlob field_lane_blob(const VesselTree *tree, int node, const FieldBlob *blob);
bool field_tile_meets(const RowTile *tile, const LaneBlob *blob, float share);
// Signed distances f/|grad f| [mm] of a tile's data (D), > 0 inside.
void field_model_residuals(const FieldModel *model, const RowTile *tile, float *distance);
// One sweep over all regions that hold due rows, `steps` accepted steps each at most; `shift` moves the regions' borders. The sum of squares gained,
// as a share of the whole; < 0 without memory.
double field_model_solve(FieldModel *model, int steps, bool shift);

#endif

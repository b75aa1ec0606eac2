// The shared blobs during the fit: which node sees which blob, their residuals, and the solver. Internal to recon; see field_fit.h.
#ifndef SELDINGER_RECON_FIT_FIELD_MODEL_H
#define SELDINGER_RECON_FIT_FIELD_MODEL_H

#include "recon/fit/field_rows.h"
#include "recon/fit/fit_lanes.h"

// The factor by which a blob's reach may grow in a sweep; nodes and rows are listed for that.
#define FIELD_ROOM 1.15

typedef struct FieldBlob {
    Vec3 center;
    double reach, amplitude;
    int owner;               // the node that the flood starts from
    Vec3 birth;              // initial position and size: priors
    double birth_reach;
    int node_count, *node;   // nodes that see it, for FIELD_ROOM times its reach
    bool is_base;            // its amplitude stays positive: the base is lumen
    bool moved;              // the lists are up to date
} FieldBlob;

typedef struct FieldModel {
    const VesselTree *tree;
    const FieldRows *rows;
    int threads;
    int count, capacity;
    FieldBlob *blob;         // (count)
    int64_t *offset;         // (N+1) node i sees blobs seen[offset[i] … offset[i+1]-1], ascending
    int *seen;
    bool *due;               // (N) rows of this node are due to be fitted
    bool amplitudes_only;    // positions and sizes are fixed
    double guard_weight;     // of a guard against a data point
    double smooth;           // weight of the slope rows
    double knee;             // knee of the loss, in local radii: points further from the wall lose weight
} FieldModel;

bool field_model_create(FieldModel *model, const VesselTree *tree, const FieldRows *rows, int threads);
void field_model_free(FieldModel *model);
// A blob of node `owner`; marks the rows that it touches as due when field_model_list is called. False if out of memory.
bool field_model_add(FieldModel *model, int owner, Vec3 center, double reach, double amplitude);
// Updates which node sees which blob, for new or moved blobs.
bool field_model_list(FieldModel *model);
// A blob as a tile's rows see it, and whether any of them is within `share` of its reach.
LaneBlob field_lane_blob(const VesselTree *tree, int node, const FieldBlob *blob);
bool field_tile_meets(const RowTile *tile, const LaneBlob *blob, float share);
// Signed distances f/|grad f| [mm] of a tile's data (D), > 0 inside.
void field_model_residuals(const FieldModel *model, const RowTile *tile, float *distance);
// One sweep over all regions with due rows, at most `steps` accepted steps each; `shift` moves the regions' borders. Returns the reduction of the sum
// of squares, as a share of the whole; < 0 if out of memory.
double field_model_solve(FieldModel *model, int steps, bool shift);

#endif

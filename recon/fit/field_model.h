// The state of the fit: the shared blobs, which node sees which blob, their residuals, and the solver. Internal to recon; see field_fit.h.
#ifndef SELDINGER_RECON_FIT_FIELD_MODEL_H
#define SELDINGER_RECON_FIT_FIELD_MODEL_H

#include "recon/fit/field_rows.h"
#include "recon/fit/fit_lanes.h"

// Factor by which a blob's reach may grow in a sweep; the lists of nodes and rows allow for it.
#define FIELD_MARGIN 1.15

typedef struct FieldBlob {
    Vec3 center;
    double reach, amplitude;
    int owner;               // node from which the search for the nodes that see it starts
    Vec3 birth;              // initial position and size: priors
    double birth_reach;
    int node_count, *node;   // nodes that see it, at FIELD_MARGIN times its reach
    bool is_base;            // its amplitude stays positive, because the base is lumen
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
    bool *due;               // (N) rows of this node have to be fitted
    bool amplitudes_only;    // positions and sizes are fixed
    double guard_weight;     // weight of a guard relative to a data point
    double smooth;           // weight of the slope rows
    double knee;             // knee of the loss, in local radii: points further from the wall lose weight
} FieldModel;

bool field_model_create(FieldModel *model, const VesselTree *tree, const FieldRows *rows, int threads);
void field_model_free(FieldModel *model);
// Adds a blob of node `owner`. field_model_list then marks the rows that it touches as due. Returns false if out of memory.
bool field_model_add(FieldModel *model, int owner, Vec3 center, double reach, double amplitude);
// Updates which node sees which blob, for new or moved blobs. Returns false if out of memory.
bool field_model_list(FieldModel *model);
// field_lane_blob: a blob relative to a node's centre, as the rows of its tiles use it. field_tile_meets: whether any row of a tile is within `share` of its
// reach.
LaneBlob field_lane_blob(const VesselTree *tree, int node, const FieldBlob *blob);
bool field_tile_meets(const RowTile *tile, const LaneBlob *blob, float share);
// Computes the signed distances f/|grad f| [mm] of a tile's data (D), > 0 inside.
void field_model_residuals(const FieldModel *model, const RowTile *tile, float *distance);
// Makes one sweep over all regions with due rows, with at most `steps` accepted steps each; `shift` moves the regions' borders. Returns the reduction of the
// sum of squares as a fraction of the whole; < 0 if out of memory.
double field_model_solve(FieldModel *model, int steps, bool shift);

#endif

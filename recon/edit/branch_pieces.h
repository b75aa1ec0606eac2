// A swept model as a list of branches that may be changed, left out or added before they become a model again. Internal to recon.
#ifndef SELDINGER_RECON_EDIT_BRANCH_PIECES_H
#define SELDINGER_RECON_EDIT_BRANCH_PIECES_H

#include "geom/geom.h"

// A branch and its arrays, borrowed; of `branch`, the counts are used, and the places of its first knot, break and row are not.
typedef struct BranchPiece {
    SweepBranch branch;
    int from;                // the branch of `like` that it was, whose stretches it keeps; -1: new
    const Vec3 *knot;
    const int32_t *node;
    const double *at;        // breaks
    const double *row;
} BranchPiece;

// The branches of a model, with room for `more`. NULL if out of memory; the caller frees it.
BranchPiece *branch_pieces(const SweepModel *model, int more);
// A model of the pieces with blend, stretches and sacs of `like`; the sacs are borrowed. NULL if out of memory.
SweepModel *branch_pieces_join(const SweepModel *like, int count, const BranchPiece *piece);

#endif

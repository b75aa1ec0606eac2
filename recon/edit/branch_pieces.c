// See branch_pieces.h.
#include "recon/edit/branch_pieces.h"

#include <stdlib.h>
#include <string.h>

BranchPiece *branch_pieces(const SweepModel *m, int more)
{
    SEL_ASSERT(more >= 0, "branches are added to a model");
    BranchPiece *piece = calloc((size_t)m->branch_count + (size_t)more, sizeof *piece);
    for (int i = 0; piece && i < m->branch_count; i++) {
        const SweepBranch *b = &m->branch[i];
        piece[i] = (BranchPiece){
            *b, i, m->knot + b->first_knot, m->knot_node + b->first_knot, m->break_t + b->first_break, m->row + (size_t)b->first_row * SWEEP_TERMS};
    }
    return piece;
}

// Copies the stretches of branches that are kept, with their new numbers.
static bool keep_stretches(const SweepModel *like, int count, const BranchPiece *piece, SweepModel *m)
{
    Faults ignored;
    StretchList list = {0};
    for (int i = 0; i < count; i++)
        for (int k = 0; k < like->stretch_count; k++) {
            SweepStretch s = like->stretch[k];
            if (s.branch != piece[i].from)
                continue;
            s.branch = i;
            stretch_list_copy(&list, &s, like->station, like->contour);
        }
    faults_clear(&ignored);
    bool good = stretch_list_give(&list, m, "the edited model", &ignored);
    stretch_list_free(&list);
    return good;
}

SweepModel *branch_pieces_join(const SweepModel *like, int count, const BranchPiece *piece)
{
    int knots = 0, breaks = 0;
    for (int i = 0; i < count; i++)
        knots += piece[i].branch.knot_count, breaks += piece[i].branch.break_count;
    SweepModel *m = sweep_model_create(count, knots, breaks, breaks + 2 * count);
    if (!m)
        return NULL;
    knots = breaks = 0;
    for (int i = 0; i < count; i++) {
        SweepBranch b = piece[i].branch;
        b.first_knot = knots, b.first_break = breaks, b.first_row = breaks + 2 * i;
        m->branch[i] = b;
        memcpy(m->knot + knots, piece[i].knot, (size_t)b.knot_count * sizeof *m->knot);
        memcpy(m->knot_node + knots, piece[i].node, (size_t)b.knot_count * sizeof *m->knot_node);
        memcpy(m->break_t + breaks, piece[i].at, (size_t)b.break_count * sizeof *m->break_t);
        memcpy(m->row + (size_t)b.first_row * SWEEP_TERMS, piece[i].row, (size_t)(b.break_count + 2) * SWEEP_TERMS * sizeof *m->row);
        knots += b.knot_count, breaks += b.break_count;
    }
    m->blend = like->blend;
    m->sac = like->sac, m->sac_node = like->sac_node, m->borrows_sac = true;
    if (like->stretch_count == 0 || keep_stretches(like, count, piece, m))
        return m;
    sweep_model_free(m);
    return NULL;
}

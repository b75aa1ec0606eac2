// The arrays of the swept model and their validation. See sweep_model.h.
#include "geom/sweep_model.h"

#include <limits.h>
#include <stdlib.h>

static const double BLEND = 0.6;
// More of anything than a tree of vessels has: counts stay far from overflow.
enum { COUNT_MAX = 1 << 24 };

SweepModel *sweep_model_create(int branch_count, int knot_count, int break_count, int row_count)
{
    if (branch_count < 1 || knot_count < 1 || break_count < 1 || row_count < 1 || branch_count > COUNT_MAX || knot_count > COUNT_MAX ||
        break_count > COUNT_MAX || row_count > COUNT_MAX)
        return NULL;
    SweepModel *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    m->branch_count = branch_count, m->knot_count = knot_count, m->break_count = break_count, m->row_count = row_count;
    m->blend = BLEND;
    m->branch = calloc((size_t)branch_count, sizeof *m->branch);
    m->knot = calloc((size_t)knot_count, sizeof *m->knot);
    m->knot_node = calloc((size_t)knot_count, sizeof *m->knot_node);
    m->break_t = calloc((size_t)break_count, sizeof *m->break_t);
    m->row = calloc((size_t)row_count * SWEEP_TERMS, sizeof *m->row);
    if (!m->branch || !m->knot || !m->knot_node || !m->break_t || !m->row) {
        sweep_model_free(m);
        return NULL;
    }
    return m;
}

void sweep_model_free(SweepModel *model)
{
    if (!model)
        return;
    free(model->branch);
    free(model->knot);
    free(model->knot_node);
    free(model->break_t);
    free(model->row);
    if (!model->borrows_sac) {
        vessel_tree_free(model->sac);
        free(model->sac_node);
    }
    free(model->edits);
    free(model);
}

double sweep_model_length(const SweepModel *model, int branch)
{
    SEL_ASSERT(branch >= 0 && branch < model->branch_count, "the branch is one of the model");
    const SweepBranch *b = &model->branch[branch];
    double length = 0;
    for (int i = b->first_knot + 1; i < b->first_knot + b->knot_count; i++)
        length += vec3_distance(model->knot[i], model->knot[i - 1]);
    return length;
}

SweepTag sweep_model_tag(const SweepModel *model, int branch, int end)
{
    SEL_ASSERT(branch >= 0 && branch < model->branch_count && (end == 0 || end == 1), "a branch of the model has two ends");
    if (end == 0 && model->branch[branch].parent >= 0)
        return SWEEP_TAG_NONE;
    SweepTag tag = (SweepTag)model->branch[branch].tag[end];
    return tag != SWEEP_TAG_NONE ? tag : end == 0 ? SWEEP_TAG_IN : SWEEP_TAG_OUT;
}

// Ranges: each branch's begins where the last one's ends, and has its least length. Nothing else can be checked if this fails.
static bool check_ranges(const SweepModel *m, const char *file, Faults *faults)
{
    int64_t knot = 0, at_break = 0, row = 0;
    for (int i = 0; i < m->branch_count; i++) {
        const SweepBranch *b = &m->branch[i];
        if (b->first_knot != knot || b->first_break != at_break || b->first_row != row || b->knot_count < 2 || b->break_count < 2 ||
            b->knot_count > m->knot_count - knot || b->break_count > m->break_count - at_break || b->break_count + 2 > m->row_count - row) {
            faults_add(faults, file, 0, 0,
                       "sweep/branch[%d] begins at knot %d (count %d), break %d (count %d), row %d; expected knot %lld, break %lld and row %lld, at least 2 "
                       "knots and 2 breaks, and no more than there are",
                       i, b->first_knot, b->knot_count, b->first_break, b->break_count, b->first_row, (long long)knot, (long long)at_break, (long long)row);
            return false;
        }
        knot += b->knot_count, at_break += b->break_count, row += b->break_count + 2;
    }
    if (knot != m->knot_count || at_break != m->break_count || row != m->row_count) {
        faults_add(faults, file, 0, 0, "sweep: the branches have %lld knots, %lld breaks and %lld rows; expected %d, %d and %d", (long long)knot,
                   (long long)at_break, (long long)row, m->knot_count, m->break_count, m->row_count);
        return false;
    }
    return true;
}

static bool check_numbers(const double *value, int64_t count, const char *name, const char *file, Faults *faults)
{
    for (int64_t i = 0; i < count; i++)
        if (!isfinite(value[i]) || fabs(value[i]) > 1e9) {
            faults_add(faults, file, 0, 0, "sweep/%s[%lld] is %g; expected a finite number below 1e9", name, (long long)i, value[i]);
            return false;
        }
    return true;
}

static void check_knots(const SweepModel *m, const char *file, Faults *faults)
{
    for (int i = 0; i < m->branch_count; i++) {
        const SweepBranch *b = &m->branch[i];
        for (int k = b->first_knot + 1; k < b->first_knot + b->knot_count; k++)
            if (!(vec3_distance(m->knot[k], m->knot[k - 1]) > 1e-9)) {
                faults_add(faults, file, 0, 0, "sweep/knot[%d] lies at the knot before it; expected knots of a branch to be apart", k);
                return;
            }
    }
}

static void check_breaks(const SweepModel *m, const char *file, Faults *faults)
{
    for (int i = 0; i < m->branch_count; i++) {
        const SweepBranch *b = &m->branch[i];
        const double *t = m->break_t + b->first_break;
        double length = sweep_model_length(m, i);
        if (t[0] != 0 || !(fabs(t[b->break_count - 1] - length) <= 1e-6 * length)) {
            faults_add(faults, file, 0, 0, "sweep/break_t of branch %d go from %g to %g; expected 0 to the curve's length %g", i, t[0], t[b->break_count - 1],
                       length);
            return;
        }
        for (int k = 1; k < b->break_count; k++)
            if (!(t[k] - t[k - 1] > 1e-9 * length)) {
                faults_add(faults, file, 0, 0, "sweep/break_t[%d] is %g after %g; expected increasing values", b->first_break + k, t[k], t[k - 1]);
                return;
            }
    }
}

static void check_branches(const SweepModel *m, const char *file, Faults *faults)
{
    for (int i = 0; i < m->branch_count; i++) {
        const SweepBranch *b = &m->branch[i];
        if (b->parent < -1 || b->parent >= i || (i == 0) != (b->parent == -1)) {
            faults_add(faults, file, 0, 0, "sweep/branch[%d] has parent %d; expected -1 for the first branch, and an earlier branch for others", i, b->parent);
            return;
        }
        double most = b->parent >= 0 ? sweep_model_length(m, b->parent) : 0;
        if (b->parent >= 0 && !(b->parent_t >= 0 && b->parent_t <= most * (1 + 1e-6))) {
            faults_add(faults, file, 0, 0, "sweep/branch[%d] springs from t = %g of its parent; expected 0 to %g", i, b->parent_t, most);
            return;
        }
        if (!(b->radius > 0 && b->radius < 1e6)) {
            faults_add(faults, file, 0, 0, "sweep/branch[%d] has radius %g; expected a length above 0", i, b->radius);
            return;
        }
        if (b->has_blend && !(b->blend >= 0 && b->blend <= 2)) {
            faults_add(faults, file, 0, 0, "sweep/branch[%d] has blend %g; expected 0 to 2", i, b->blend);
            return;
        }
        if (b->tag[0] >= SWEEP_TAGS || b->tag[1] >= SWEEP_TAGS) {
            faults_add(faults, file, 0, 0, "sweep/branch[%d] has tags %d and %d; expected 0 (none), 1 (in) or 2 (out)", i, b->tag[0], b->tag[1]);
            return;
        }
    }
}

static void check_nodes(const int32_t *node, int count, const char *name, const char *file, Faults *faults)
{
    for (int i = 0; i < count; i++)
        if (node[i] < 0 || node[i] > COUNT_MAX) {
            faults_add(faults, file, 0, 0, "sweep/%s[%d] is %d; expected the index of a node", name, i, node[i]);
            return;
        }
}

// The mean radius, c_0, of every row is positive: otherwise the branch has no inside there.
static void check_rows(const SweepModel *m, const char *file, Faults *faults)
{
    for (int i = 0; i < m->row_count; i++)
        if (!(m->row[(size_t)i * SWEEP_TERMS] > 0)) {
            faults_add(faults, file, 0, 0, "sweep/row[%d] has mean radius %g; expected a length above 0", i, m->row[(size_t)i * SWEEP_TERMS]);
            return;
        }
}

bool sweep_model_validate(const SweepModel *m, const char *file, Faults *faults)
{
    int before = faults->count;
    if (m->branch_count < 1) {
        faults_add(faults, file, 0, 0, "the swept model has no branches; expected at least one");
        return false;
    }
    if (!check_ranges(m, file, faults))
        return false;
    bool knots = check_numbers((const double *)m->knot, 3 * (int64_t)m->knot_count, "knot", file, faults);
    bool breaks = check_numbers(m->break_t, m->break_count, "break_t", file, faults);
    if (check_numbers(m->row, (int64_t)m->row_count * SWEEP_TERMS, "row", file, faults))
        check_rows(m, file, faults);
    if (knots) {
        check_knots(m, file, faults);
        check_branches(m, file, faults);
        if (breaks)
            check_breaks(m, file, faults);
    }
    check_nodes(m->knot_node, m->knot_count, "knot_node", file, faults);
    if (!(m->blend >= 0 && m->blend <= 2))
        faults_add(faults, file, 0, 0, "sweep/blend is %g; expected 0 to 2", m->blend);
    if (m->sac && (!m->sac_node || !vessel_tree_is_shared(m->sac) || !m->sac->seen || !m->sac->near))
        faults_add(faults, file, 0, 0, "sweep/sac is no field of shared blobs, is not linked, or has no sac_node; expected all three");
    else if (m->sac && vessel_tree_validate(m->sac, file, faults))
        check_nodes(m->sac_node, m->sac->node_count, "sac_node", file, faults);
    return faults->count == before;
}

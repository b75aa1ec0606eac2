// The arrays of the swept model and their validation. See sweep_model.h.
#include "geom/sweep_model.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

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
    sweep_model_set_stretches(model, 0, NULL, 0, NULL, 0, NULL, "", NULL);
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

// --- Stretches ---

enum { ROW_MOST = 4096 };    // stations of one stretch

static void drop_stretches(SweepModel *m)
{
    for (int i = 0; m->section && i < m->station_count; i++)
        section_free(m->section[i]);
    free(m->stretch);
    free(m->station);
    free(m->station_t);
    free(m->contour);
    free(m->section);
    m->stretch = NULL, m->station = NULL, m->station_t = NULL, m->contour = NULL, m->section = NULL;
    m->stretch_count = m->station_count = m->contour_count = 0;
}

static bool check_stretch(const SweepModel *m, int index, const SweepStretch *s, const SweepStretch *last, const char *file, Faults *faults)
{
    if (s->branch < 0 || s->branch >= m->branch_count || (last && s->branch < last->branch)) {
        faults_add(faults, file, 0, 0, "sweep/stretch[%d] lies on branch %d; expected a branch of the model, 0 to %d, in ascending order", index, s->branch,
                   m->branch_count - 1);
        return false;
    }
    double length = sweep_model_length(m, s->branch), least = last && last->branch == s->branch ? last->to : 0, range = s->to - s->from;
    if (!(s->from >= least && s->to <= length * (1 + 1e-6) && range > 0 && s->fade > 0 && 2 * s->fade <= range * (1 + 1e-9))) {
        faults_add(faults, file, 0, 0,
                   "sweep/stretch[%d] reaches from t = %g to %g and fades over %g; expected a range within %g to %g, twice as long as the fade", index, s->from,
                   s->to, s->fade, least, length);
        return false;
    }
    const SectionOptions *o = &s->section;
    bool sound = (int)o->kind >= 0 && o->kind < SECTION_KINDS && (o->form == SECTION_MENDED || o->form == SECTION_AS_PRINTED) && o->harmonics >= 0 &&
                 o->harmonics <= 16 && o->stiffness >= 0 && o->stiffness < 1e6 && o->delta_mm >= 0 && o->delta_mm < 1e6 && o->voxel_mm > 0 &&
                 o->voxel_mm < 1e6 && (s->weights == SECTION_CATMULL_ROM || s->weights == SECTION_PSP) && s->tension > 0 && s->tension <= 1 && s->width > 0 &&
                 s->width <= 0.5;
    if (!sound)
        faults_add(
            faults, file, 0, 0,
            "sweep/stretch[%d] has kind %d, form %d, %d harmonics, stiffness %g, delta %g, voxel %g, weights %d, tension %g, width %g; expected kind 0 to 3, "
            "form and weights 0 or 1, 0 to 16 harmonics, tension 0 to 1, width 0 to 0.5, lengths above 0",
            index, (int)o->kind, (int)o->form, o->harmonics, o->stiffness, o->delta_mm, o->voxel_mm, (int)s->weights, s->tension, s->width);
    return sound;
}

static bool check_stations(const SweepStretch *stretch, int index, const SweepStation *station, int *next_point, int contour_count, const char *file,
                           Faults *faults)
{
    for (int k = stretch->first_station; k < stretch->first_station + stretch->station_count; k++) {
        const SweepStation *s = &station[k];
        bool in_order = k == stretch->first_station || s->t - s[-1].t > 1e-9;
        if (!isfinite(s->t) || !in_order || s->first_point != *next_point || s->point_count < 3 || s->point_count > 4096 ||
            s->point_count > contour_count - *next_point) {
            faults_add(faults, file, 0, 0,
                       "sweep/station[%d] of stretch %d lies at t = %g and has %d points from %d; expected increasing t and 3 to 4096 points from %d", k, index,
                       s->t, s->point_count, s->first_point, *next_point);
            return false;
        }
        *next_point += s->point_count;
    }
    return true;
}

static bool check_stretches(const SweepModel *m, int stretches, const SweepStretch *stretch, int stations, const SweepStation *station, int contours,
                            const char *file, Faults *faults)
{
    int next_station = 0, next_point = 0;
    for (int i = 0; i < stretches; i++) {
        const SweepStretch *s = &stretch[i];
        if (s->first_station != next_station || s->station_count < 1 || s->station_count > ROW_MOST || s->station_count > stations - next_station) {
            faults_add(faults, file, 0, 0, "sweep/stretch[%d] has %d stations from %d; expected 1 to %d from %d", i, s->station_count, s->first_station,
                       (int)ROW_MOST, next_station);
            return false;
        }
        if (!check_stretch(m, i, s, i > 0 ? &stretch[i - 1] : NULL, file, faults) || !check_stations(s, i, station, &next_point, contours, file, faults))
            return false;
        next_station += s->station_count;
    }
    if (next_station != stations || next_point != contours)
        faults_add(faults, file, 0, 0, "sweep: the stretches have %d stations and %d points; expected %d and %d", next_station, next_point, stations, contours);
    return next_station == stations && next_point == contours;
}

bool sweep_model_set_stretches(SweepModel *m, int stretch_count, const SweepStretch *stretch, int station_count, const SweepStation *station, int contour_count,
                               const SectionPoint *contour, const char *file, Faults *faults)
{
    drop_stretches(m);
    if (stretch_count == 0)
        return true;
    if (!check_stretches(m, stretch_count, stretch, station_count, station, contour_count, file, faults))
        return false;
    size_t stretches = (size_t)stretch_count, stations = (size_t)station_count, points = (size_t)contour_count;
    m->stretch = malloc(stretches * sizeof *m->stretch);
    m->station = malloc(stations * sizeof *m->station);
    m->station_t = malloc(stations * sizeof *m->station_t);
    m->contour = malloc(points * sizeof *m->contour);
    m->section = calloc(stations, sizeof *m->section);
    if (!m->stretch || !m->station || !m->station_t || !m->contour || !m->section) {
        drop_stretches(m);
        faults_add(faults, file, 0, 0, "needs more memory than is available (%d stations of sections)", station_count);
        return false;
    }
    memcpy(m->stretch, stretch, stretches * sizeof *stretch);
    memcpy(m->station, station, stations * sizeof *station);
    memcpy(m->contour, contour, points * sizeof *contour);
    m->stretch_count = stretch_count, m->station_count = station_count, m->contour_count = contour_count;
    for (int i = 0; i < stretch_count; i++)
        for (int k = stretch[i].first_station; k < stretch[i].first_station + stretch[i].station_count; k++) {
            m->station_t[k] = station[k].t;
            m->section[k] = section_create(&stretch[i].section, station[k].point_count, contour + station[k].first_point);
            if (!m->section[k]) {
                faults_add(faults, file, 0, 0, "sweep/station[%d] at t = %g of branch %d: its %d points give no section of kind %s", k, station[k].t,
                           stretch[i].branch, station[k].point_count, section_kind_name[stretch[i].section.kind]);
                drop_stretches(m);
                return false;
            }
        }
    return true;
}

int sweep_model_harmonics(const SweepModel *m)
{
    int highest = 1;
    for (int i = 0; i < m->row_count; i++)
        for (int k = 1; k < SWEEP_TERMS; k++)
            if (m->row[i * SWEEP_TERMS + k] != 0 && (k + 1) / 2 > highest)
                highest = (k + 1) / 2;
    return highest;
}

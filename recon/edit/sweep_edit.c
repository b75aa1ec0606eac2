// The edits of sections, of branches and of tags, see sweep_edit.h.
#include "recon/edit/sweep_edit.h"

#include "recon/edit/branch_pieces.h"
#include "recon/edit/contour_terms.h"
#include "recon/edit/edit_rows.h"
#include "recon/edit/edit_stretch.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// What an edit works on.
typedef struct Work {
    const SweepModel *model;
    const SweepField *field;
    const SweepEdit *edit;
    const char *name;
    EditChange *change;
    Faults *faults;
} Work;

// NULL with a fault at the edit
__attribute__((format(printf, 2, 3))) static SweepModel *refuse(const Work *w, const char *format, ...)
{
    char text[FAULT_LENGTH];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    faults_add(w->faults, w->name, w->edit->line, w->edit->column, "%s", text);
    return NULL;
}

static const char no_memory[] = "the edit needs more memory than is available";

// --- sections ---

// The model with new breaks and rows of the edited branch, which are freed.
static SweepModel *with_rows(const Work *w, EditRows *rows)
{
    BranchPiece *piece = rows->at ? branch_pieces(w->model, 0) : NULL;
    SweepModel *m = NULL;
    if (piece) {
        BranchPiece *p = &piece[w->edit->branch];
        p->branch.break_count = rows->breaks, p->at = rows->at, p->row = rows->row;
        m = branch_pieces_join(w->model, w->model->branch_count, piece);
    }
    free(piece);
    edit_rows_free(rows);
    return m ? m : refuse(w, "%s", no_memory);
}

// States the stations between which rows first … last act.
static void mark_rows(const Work *w, const EditRows *rows, int first, int last)
{
    int from = first - 3, to = last + 1;
    w->change->branch = w->edit->branch;
    w->change->from = rows->at[from < 0 ? 0 : from], w->change->to = rows->at[to > rows->breaks - 1 ? rows->breaks - 1 : to];
}

static void hold_now(const EditRows *rows, double t, HeldSections *held)
{
    held->t[held->count] = t;
    edit_rows_section(rows, t, held->target[held->count++]);
}

// Gives the section at t; frees the rows.
static SweepModel *set_section(const Work *w, EditRows *rows, double t, const double term[SWEEP_TERMS])
{
    double within;
    int at = edit_rows_station(rows, t, &within);
    bool is_there = fabs(t - rows->at[at]) <= within;
    if (!is_there) {
        edit_rows_insert(rows, t);
        at = edit_rows_station(rows, t, &within);
    }
    HeldSections held = {.count = 1, .t = {t}};
    memcpy(held.target[0], term, sizeof held.target[0]);
    for (int i = at - 2; i <= at + 2; i++)
        if (i >= 0 && i < rows->breaks && i != at)
            hold_now(rows, rows->at[i], &held);
    int first = at - 1, last = at + 3;
    mark_rows(w, rows, first, last);
    bool good = edit_rows_hold(rows, first, last, &held);
    for (int i = first < 0 ? 0 : first; good && i <= last && i < rows->breaks + 2; i++)
        good = rows->row[(size_t)i * SWEEP_TERMS] > 0;
    if (good)
        return with_rows(w, rows);
    edit_rows_free(rows);
    return refuse(w, "the section at %g mm differs too much from those beside it; expected one of similar size, or edit those first", t);
}

// Gives a contour that the row cannot hold to a stretch of the model, which is freed if that fails.
static SweepModel *set_stretch(const Work *w, SweepModel *m, double within, const SectionPoint *contour)
{
    const SweepEdit *e = w->edit;
    if (edit_stretch_set(m, e->branch, e->t, within, e->count, contour, w->name, w->faults)) {
        int at = edit_stretch_at(m, e->branch, e->t, e->t);
        SEL_ASSERT(at >= 0, "a stretch reaches beyond the station that it is given, or to the branch's end");
        const SweepStretch *s = &m->stretch[at];
        w->change->from = fmin(w->change->from, s->from), w->change->to = fmax(w->change->to, s->to);
        w->change->misfit = 0;
        return m;
    }
    sweep_model_free(m);
    return NULL;
}

// The nearest polar section to a contour that is none: through the outermost points of the rays. False if the contour has no area or does not go around the curve.
static bool outermost_terms(int count, const SectionPoint *contour, double term[SWEEP_TERMS])
{
    enum { RAYS = 64 };
    double radius[RAYS];
    SectionOptions options = section_default_options(SECTION_RASTER, SECTION_MENDED);
    Section *section = section_create(&options, count, contour);
    bool good = section && section_radii(section, 0, 0, RAYS, radius) >= 0;
    section_free(section);
    if (good)
        sweep_terms_of_radii(RAYS, radius, term);
    return good;
}

static SweepModel *edit_section(const Work *w)
{
    const SweepEdit *e = w->edit;
    Vec3 *flat = calloc((size_t)e->count, sizeof *flat);
    EditRows rows;
    if (!flat || !edit_rows_take(w->model, e->branch, &rows)) {
        free(flat);
        return refuse(w, "%s", no_memory);
    }
    SweepJet j = sweep_curve_at(w->field->curve[e->branch], e->t);
    for (int i = 0; i < e->count; i++) {
        Vec3 u = vec3_sub(e->point[i], j.s);
        flat[i] = e->in_space ? vec3(vec3_dot(u, j.n), vec3_dot(u, j.b), 0) : e->point[i];
    }
    double term[SWEEP_TERMS], within;
    const char *wrong = contour_terms(e->count, flat, term, &w->change->misfit);
    SectionPoint *contour = (SectionPoint *)calloc((size_t)e->count, sizeof *contour);
    for (int i = 0; contour && i < e->count; i++)
        contour[i] = (SectionPoint){flat[i].x, flat[i].y};
    free(flat);
    edit_rows_station(&rows, e->t, &within);
    bool is_raster = wrong && contour && outermost_terms(e->count, contour, term);
    if (!contour || (wrong && !is_raster)) {
        edit_rows_free(&rows);
        free(contour);
        return refuse(w, "%s", wrong && !is_raster ? wrong : no_memory);
    }
    SweepModel *m = set_section(w, &rows, e->t, term);
    if (m && (is_raster || edit_stretch_at(m, e->branch, e->t, e->t) >= 0))
        m = set_stretch(w, m, within, contour);
    free(contour);
    return m;
}

static SweepModel *edit_delete(const Work *w)
{
    EditRows rows;
    double within;
    if (!edit_rows_take(w->model, w->edit->branch, &rows))
        return refuse(w, "%s", no_memory);
    int at = edit_rows_station(&rows, w->edit->t, &within);
    if (fabs(w->edit->t - rows.at[at]) > within || at == 0 || at == rows.breaks - 1) {
        if (fabs(w->edit->t - rows.at[at]) <= within)
            refuse(w, "the section at %g mm is at an end of the branch and stays; expected one between, or `cut`", w->edit->t);
        else
            refuse(w, "branch %d has no section at %g mm; expected a station, the nearest is at %.6g mm", w->edit->branch, w->edit->t, rows.at[at]);
        edit_rows_free(&rows);
        return NULL;
    }
    HeldSections held = {0};
    for (int i = at - 2; i <= at + 2; i++)
        if (i >= 0 && i < rows.breaks && i != at)
            hold_now(&rows, rows.at[i], &held);
    mark_rows(w, &rows, at - 1, at + 3);
    edit_rows_remove(&rows, at);
    if (edit_rows_hold(&rows, at - 1, at + 2, &held)) {
        SweepModel *m = with_rows(w, &rows);
        if (!m || edit_stretch_at(m, w->edit->branch, w->edit->t, w->edit->t) < 0 ||
            edit_stretch_delete(m, w->edit->branch, w->edit->t, within, w->name, w->faults))
            return m;
        sweep_model_free(m);
        return NULL;
    }
    edit_rows_free(&rows);
    return refuse(w, "the section at %g mm cannot be deleted without changing those beside it", w->edit->t);
}

static SweepModel *smooth_section(const Work *w)
{
    EditRows rows;
    if (!edit_rows_take(w->model, w->edit->branch, &rows))
        return refuse(w, "%s", no_memory);
    double term[SWEEP_TERMS];
    edit_rows_section(&rows, w->edit->t, term);
    terms_smooth(term, w->edit->shape == SMOOTH_ELLIPSE, w->edit->amount);
    return set_section(w, &rows, w->edit->t, term);
}

// Smooths the rows of a branch whose place is within a range.
static void smooth_rows(const Work *w, SweepModel *m, int branch, double from, double to)
{
    const SweepBranch *b = &m->branch[branch];
    const EditRows rows = {b->break_count, m->break_t + b->first_break, m->row + (size_t)b->first_row * SWEEP_TERMS};
    int first = b->break_count + 1, last = 0;
    for (int i = 0; i < b->break_count + 2; i++) {
        double place = edit_rows_place(&rows, i);
        if (place < from || place > to)
            continue;
        terms_smooth(rows.row + (size_t)i * SWEEP_TERMS, w->edit->shape == SMOOTH_ELLIPSE, w->edit->amount);
        first = i < first ? i : first, last = i;
    }
    if (w->edit->extent != SMOOTH_TREE && first <= last)
        mark_rows(w, &rows, first, last);
}

// --- the whole model with one change ---

static SweepModel *copy_of(const Work *w)
{
    BranchPiece *piece = branch_pieces(w->model, 0);
    SweepModel *m = piece ? branch_pieces_join(w->model, w->model->branch_count, piece) : NULL;
    free(piece);
    return m ? m : refuse(w, "%s", no_memory);
}

static SweepModel *edit_smooth(const Work *w)
{
    const SweepEdit *e = w->edit;
    bool is_tree = e->extent == SMOOTH_TREE;
    double from = e->extent == SMOOTH_SECTION ? e->t
                  : e->extent == SMOOTH_RANGE ? e->from
                                              : 0,
           to = e->extent == SMOOTH_SECTION ? e->t
                : e->extent == SMOOTH_RANGE ? e->to
                                            : HUGE_VAL;
    int at = is_tree ? (w->model->stretch_count > 0 ? 0 : -1) : edit_stretch_at(w->model, e->branch, from, to);
    if (at >= 0) {
        const SweepStretch *s = &w->model->stretch[at];
        return refuse(w,
                      "branch %d has sections of kind %s from %g to %g mm, which are not smoothed; expected a place without them, or draw their contours anew",
                      s->branch, section_kind_name[s->section.kind], s->from, s->to);
    }
    if (e->extent == SMOOTH_SECTION)
        return smooth_section(w);
    SweepModel *m = copy_of(w);
    if (m && e->extent != SMOOTH_TREE) {
        w->change->branch = e->branch;
        smooth_rows(w, m, e->branch, e->extent == SMOOTH_RANGE ? e->from : 0, e->extent == SMOOTH_RANGE ? e->to : HUGE_VAL);
    }
    for (int i = 0; m && e->extent == SMOOTH_TREE && i < m->branch_count; i++)
        smooth_rows(w, m, i, 0, HUGE_VAL);
    return m;
}

static SweepModel *edit_blend(const Work *w)
{
    if (w->model->branch[w->edit->branch].parent < 0)
        return refuse(w, "branch %d is the root and springs from no fork; expected a branch with a parent", w->edit->branch);
    SweepModel *m = copy_of(w);
    if (m)
        m->branch[w->edit->branch].has_blend = true, m->branch[w->edit->branch].blend = w->edit->amount;
    w->change->branch = w->edit->branch;
    w->change->to = w->field->curve[w->edit->branch]->length;
    return m;
}

static SweepModel *edit_tag(const Work *w)
{
    const SweepEdit *e = w->edit;
    SweepTag now = sweep_model_tag(w->model, e->branch, e->end);
    if (now == SWEEP_TAG_NONE)
        return refuse(w, "the start of branch %d is a fork, not an open end; expected end: end, or the start of branch 0", e->branch);
    SweepModel *m = copy_of(w);
    SweepTag other = now == SWEEP_TAG_IN ? SWEEP_TAG_OUT : SWEEP_TAG_IN;
    if (m)
        m->branch[e->branch].tag[e->end] = (uint8_t)(e->tag == EDIT_TAG_FLIP ? other : e->tag == EDIT_TAG_IN ? SWEEP_TAG_IN : SWEEP_TAG_OUT);
    w->change->branch = e->branch;
    w->change->from = w->change->to = e->end ? w->field->curve[e->branch]->length : 0;
    return m;
}

// --- branches ---

// Breaks about a mean radius apart, and circles whose radius is linear between the points. The caller frees `at` and `row`.
static bool circles(const SweepCurve *curve, const double *radius, double mean, EditRows *rows)
{
    enum { MOST = 10000 };
    int spans = (int)fmax(1, fmin(MOST, floor(curve->length / mean + 0.5)));
    *rows = (EditRows){spans + 1, calloc((size_t)spans + 1, sizeof(double)), calloc(((size_t)spans + 3) * SWEEP_TERMS, sizeof(double))};
    if (!rows->at || !rows->row)
        return false;
    for (int i = 0; i <= spans; i++)
        rows->at[i] = i == spans ? curve->length : curve->length * i / spans;
    for (int i = 0, k = 0; i < spans + 3; i++) {
        double t = edit_rows_place(rows, i);
        while (k < curve->knot_count - 2 && curve->knot_t[k + 1] < t)
            k++;
        // the start, on the parent's curve, has the radius of the first point
        double from = radius[k > 0 ? k - 1 : 0], part = (t - curve->knot_t[k]) / (curve->knot_t[k + 1] - curve->knot_t[k]);
        rows->row[(size_t)i * SWEEP_TERMS] = from + fmax(0, fmin(1, part)) * (radius[k] - from);
    }
    return true;
}

static SweepModel *edit_branch(const Work *w)
{
    const SweepEdit *e = w->edit;
    const SweepCurve *parent = w->field->curve[e->branch];
    int knots = e->count + 1, near = 0;
    double mean = 0;
    Vec3 *knot = calloc((size_t)knots, sizeof *knot);
    int32_t *node = calloc((size_t)knots, sizeof *node);
    BranchPiece *piece = branch_pieces(w->model, 1);
    EditRows rows = {0};
    SweepCurve *curve = NULL;
    SweepModel *m = NULL;
    bool good = knot && node && piece, apart = true;
    for (int k = 1; k < parent->knot_count; k++)
        near = fabs(parent->knot_t[k] - e->t) < fabs(parent->knot_t[near] - e->t) ? k : near;
    for (int i = 0; good && i < knots; i++) {
        knot[i] = i > 0 ? e->point[i - 1] : sweep_curve_at(parent, e->t).s;
        node[i] = w->model->knot_node[w->model->branch[e->branch].first_knot + near];
        mean += i > 0 ? e->radius[i - 1] / e->count : 0;
        apart = apart && (i == 0 || vec3_distance(knot[i], knot[i - 1]) > 1e-3);
    }
    if (good && apart) {
        curve = sweep_curve_create(knots, knot);
        good = curve && circles(curve, e->radius, mean, &rows);
    }
    if (good && apart) {
        SweepBranch branch = {.parent = e->branch, .parent_t = e->t, .radius = mean, .knot_count = knots, .break_count = rows.breaks};
        piece[w->model->branch_count] = (BranchPiece){branch, -1, knot, node, rows.at, rows.row};
        m = branch_pieces_join(w->model, w->model->branch_count + 1, piece);
        *w->change = (EditChange){.branch = w->model->branch_count, .to = curve->length};
    }
    sweep_curve_free(curve);
    edit_rows_free(&rows);
    free(knot);
    free(node);
    free(piece);
    if (good && !apart)
        return refuse(w, "two points of the new branch, or its first one and the parent's curve, coincide; expected points that are apart");
    return m ? m : refuse(w, "%s", no_memory);
}

// Shortens a branch to 0 … t: its section there is the spline's value, and the last rows are those of de Boor's triangle. The rows and knots are given room.
static void shorten(const EditRows *whole, double t, EditRows *part)
{
    int span = 0;
    while (span < whole->breaks - 2 && whole->at[span + 1] < t * (1 - 1e-9))
        span++;
    double k[8], d[4][SWEEP_TERMS];
    for (int i = 0; i < 8; i++)
        k[i] = whole->at[span + i - 3 < 0 ? 0 : span + i - 3 > whole->breaks - 1 ? whole->breaks - 1 : span + i - 3];
    memcpy(part->at, whole->at, (size_t)(span + 1) * sizeof *part->at);
    part->at[span + 1] = t, part->breaks = span + 2;
    memcpy(part->row, whole->row, (size_t)(span + 1) * SWEEP_TERMS * sizeof *part->row);
    memcpy(d, whole->row + (size_t)span * SWEEP_TERMS, sizeof d);
    for (int level = 1; level <= 3; level++) {
        for (int i = 3; i >= level; i--) {
            double a = (t - k[i]) / (k[i + 4 - level] - k[i]);
            for (int term = 0; term < SWEEP_TERMS; term++)
                d[i][term] = (1 - a) * d[i - 1][term] + a * d[i][term];
        }
        memcpy(part->row + (size_t)(span + level) * SWEEP_TERMS, d[level], sizeof d[level]);
    }
}

// Removes branches that are marked and renumbers parents. Returns how many are left.
static int leave_out(BranchPiece *piece, int count, bool *is_out)
{
    int *place = calloc((size_t)count, sizeof *place), left = 0;
    if (!place)
        return 0;
    for (int i = 0; i < count; i++) {
        int parent = piece[i].branch.parent;
        is_out[i] = is_out[i] || (parent >= 0 && is_out[parent]);
        if (is_out[i])
            continue;
        place[i] = left;
        piece[left] = piece[i];
        piece[left++].branch.parent = parent >= 0 ? place[parent] : -1;
    }
    free(place);
    return left;
}

static bool has_sac(const SweepField *field, int branch, double from)
{
    for (int s = sweep_field_segment(field, branch, from); s < field->first_segment[branch + 1]; s++)
        if (field->view[s].sac >= 0)
            return true;
    return false;
}

// Marks what goes. Returns the branch on whose removed part a sac hangs, or -1.
static int mark_cut(const Work *w, bool *is_out, double t)
{
    const SweepModel *m = w->model;
    int cut = w->edit->branch, sac = -1;
    for (int i = cut; i < m->branch_count; i++) {
        int parent = m->branch[i].parent;
        is_out[i] = i == cut ? t <= 0 : parent >= 0 && (is_out[parent] || (parent == cut && m->branch[i].parent_t >= t));
        if ((is_out[i] && has_sac(w->field, i, 0)) || (i == cut && has_sac(w->field, i, t)))
            sac = i;
    }
    return sac;
}

// Knots of the shortened curve; the last one is its place at t. Returns their number and its length.
static int cut_knots(const SweepCurve *curve, double t, Vec3 *knot, double *length)
{
    int count = 1;
    knot[0] = curve->interval[1].s[0];
    // a knot that is too near to the new end would bend the curve there
    while (count < curve->knot_count - 1 && curve->knot_t[count] < t - 0.25 * (curve->knot_t[count + 1] - curve->knot_t[count]) && curve->knot_t[count] < t) {
        knot[count] = curve->interval[count + 1].s[0];
        count++;
    }
    knot[count] = sweep_curve_at(curve, t).s;
    *length = curve->knot_t[count - 1] + vec3_distance(knot[count], knot[count - 1]);
    return count + 1;
}

static SweepModel *edit_cut(const Work *w)
{
    const SweepModel *m = w->model;
    const SweepCurve *curve = w->field->curve[w->edit->branch];
    const SweepBranch *b = &m->branch[w->edit->branch];
    double t = w->edit->t, least = 0.25 * b->radius;
    t = t < least ? 0 : t;
    if (t <= 0 && b->parent < 0)
        return refuse(w, "the root cannot be removed; expected a cut at %.3g mm or more", least);
    if (t > curve->length - 1e-3)
        return refuse(w, "branch %d is %.6g mm long; expected a cut before its end", w->edit->branch, curve->length);
    bool *is_out = calloc((size_t)m->branch_count, sizeof *is_out);
    BranchPiece *piece = branch_pieces(m, 0);
    Vec3 *knot = calloc((size_t)b->knot_count + 1, sizeof *knot);
    EditRows whole = {0}, part = {0};
    SweepModel *result = NULL;
    bool good = is_out && piece && knot && edit_rows_take(m, w->edit->branch, &whole) && edit_rows_take(m, w->edit->branch, &part);
    int sac = good ? mark_cut(w, is_out, t) : -1;
    if (good && sac < 0) {
        if (t > 0) {
            BranchPiece *p = &piece[w->edit->branch];
            shorten(&whole, t, &part);
            p->branch.knot_count = cut_knots(curve, t, knot, &part.at[part.breaks - 1]);
            p->branch.break_count = part.breaks;
            p->knot = knot, p->at = part.at, p->row = part.row;
        }
        int left = leave_out(piece, m->branch_count, is_out);
        result = left > 0 ? branch_pieces_join(m, left, piece) : NULL;
        // the end's condition reaches along the whole curve, ever less
        *w->change = (EditChange){.branch = w->edit->branch, .to = curve->length};
    }
    free(is_out);
    free(piece);
    free(knot);
    edit_rows_free(&whole);
    edit_rows_free(&part);
    if (sac >= 0)
        return refuse(w, "a sac hangs on the part of branch %d that would be removed; expected a cut beyond it", sac);
    return result ? result : refuse(w, "%s", no_memory);
}

// --- all of them ---

static bool check_place(const Work *w)
{
    const SweepEdit *e = w->edit;
    if (e->kind == EDIT_SMOOTH && e->extent == SMOOTH_TREE)
        return true;
    if (e->branch < 0 || e->branch >= w->model->branch_count) {
        refuse(w, "there is no branch %d; expected 0 to %d", e->branch, w->model->branch_count - 1);
        return false;
    }
    double length = w->field->curve[e->branch]->length;
    bool has_t = e->kind == EDIT_SECTION || e->kind == EDIT_DELETE_SECTION || e->kind == EDIT_BRANCH || e->kind == EDIT_CUT ||
                 (e->kind == EDIT_SMOOTH && e->extent == SMOOTH_SECTION);
    if (has_t && !(e->t >= 0 && e->t <= length)) {
        refuse(w, "t_mm %g is beyond branch %d; expected 0 to %.6g", e->t, e->branch, length);
        return false;
    }
    int at = e->kind == EDIT_CUT ? edit_stretch_at(w->model, e->branch, e->t, HUGE_VAL) : -1;
    if (at >= 0) {
        const SweepStretch *s = &w->model->stretch[at];
        refuse(w, "branch %d has %s sections from %.6g to %.6g mm, through or before which it cannot be cut; expected a place beyond, or delete them first",
               e->branch, section_kind_name[s->section.kind], s->from, s->to);
    }
    return at < 0;
}

SweepModel *sweep_edit_apply(const SweepModel *model, const SweepField *field, const SweepEdit *edit, const char *name, EditChange *change, Faults *faults)
{
    static SweepModel *(*const apply[EDIT_KINDS])(const Work *) = {edit_section, edit_delete, edit_smooth, edit_blend, edit_branch, edit_cut, edit_tag};
    SEL_ASSERT(field->model == model && edit->kind >= 0 && edit->kind < EDIT_KINDS, "the field is that of the model");
    *change = (EditChange){.branch = -1};
    const Work work = {model, field, edit, name, change, faults};
    SweepModel *result = check_place(&work) ? apply[edit->kind](&work) : NULL;
    if (result && !sweep_model_validate(result, name, faults)) {
        sweep_model_free(result);
        return NULL;
    }
    return result;
}

bool sweep_edit_place(const SweepField *field, Vec3 x, int *branch, double *t)
{
    double best = HUGE_VAL;
    *branch = -1;
    for (int i = 0; i < field->branch_count; i++) {
        double at = sweep_curve_nearest(field->curve[i], x, 2 * field->model->branch[i].radius);
        SweepPart part;
        sweep_field_branch(field, i, x, at, &part);
        if (fabs(part.f) < best)
            best = fabs(part.f), *branch = i, *t = fmax(0, fmin(field->curve[i]->length, part.t));
    }
    if (*branch < 0 || !field->model->sac)
        return *branch >= 0;
    SweepBlend blend;
    sweep_field_blend(field, (SweepPlace){.branch = *branch, .t = *t, .sac = -1}, x, &blend);
    return blend.part[blend.largest].branch >= 0;
}

void sweep_edit_terms(const SweepModel *m, int branch, double t, double term[SWEEP_TERMS])
{
    const SweepBranch *b = &m->branch[branch];
    edit_rows_section(&(EditRows){b->break_count, m->break_t + b->first_break, m->row + (size_t)b->first_row * SWEEP_TERMS}, t, term);
}

double sweep_edit_station(const SweepModel *m, int branch, double t, double *within)
{
    const SweepBranch *b = &m->branch[branch];
    const EditRows rows = {b->break_count, m->break_t + b->first_break, m->row + (size_t)b->first_row * SWEEP_TERMS};
    return rows.at[edit_rows_station(&rows, t, within)];
}

void sweep_edit_contour(const SweepModel *m, int branch, double t, int count, Vec3 *point)
{
    double term[SWEEP_TERMS];
    sweep_edit_terms(m, branch, t, term);
    for (int i = 0; i < count; i++) {
        double theta = 2 * PI * i / count, r = sweep_terms_radius(term, theta);
        point[i] = vec3(r * same_cos(theta), r * same_sin(theta), 0);
    }
}

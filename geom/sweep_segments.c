// Cuts the branches of a swept model into segments: between any two neighbouring knots and breaks of a branch, curve, frame and section are single polynomials.
//
// B-splines over breaks t_0 … t_m, with knots k_i = t_(i-3), limited to t_0 and t_m: N_(i,0) = 1 on the span, and
//   N_(i,p)(t) = (t - k_i) / (k_(i+p) - k_i) N_(i,p-1)(t) + (k_(i+p+1) - t) / (k_(i+p+1) - k_(i+1)) N_(i+1,p-1)(t).
#include "geom/sweep_field.h"
#include "geom/sweep_stretch.h"
#include "geom/sweep_views.h"

#include <stdlib.h>

// --- B-splines ---

static double break_at(const double *t, int last, int i) { return t[i < 0 ? 0 : i > last ? last : i]; }

// The four B-splines that are not zero on the span from break `span` to the next, as polynomials of t - origin.
static void span_polynomials(const double *t, int last, int span, double origin, double out[4][4])
{
    SEL_ASSERT(span >= 0 && span < last, "a span lies between two breaks");
    double lower[5][4] = {{0}}, value[5][4] = {{0}};
    lower[3][0] = 1;                         // entry j is N_(span+j,p)
    for (int p = 1; p <= 3; p++) {
        for (int j = 3 - p; j <= 3; j++) {
            // k_i = t_(i-3) with i = span + j
            double rise_from = break_at(t, last, span + j - 3), rise_to = break_at(t, last, span + j + p - 3);
            double fall_from = break_at(t, last, span + j - 2), fall_to = break_at(t, last, span + j + p - 2);
            double rise = rise_to > rise_from ? 1 / (rise_to - rise_from) : 0, fall = fall_to > fall_from ? 1 / (fall_to - fall_from) : 0;
            for (int k = 0; k < 4; k++) {
                double below = k > 0 ? rise * lower[j][k - 1] - fall * lower[j + 1][k - 1] : 0;
                value[j][k] = below + rise * (origin - rise_from) * lower[j][k] + fall * (fall_to - origin) * lower[j + 1][k];
            }
        }
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < 4; k++)
                lower[j][k] = value[j][k];
    }
    for (int j = 0; j < 4; j++)
        for (int k = 0; k < 4; k++)
            out[j][k] = lower[j][k];
}

// The span that holds t.
static int span_of(const double *t, int last, double x)
{
    int low = 0, high = last - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (x < t[middle + 1])
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

// How far the section runs on at the height s >= 0 over an end's plane, and its slope: s - s^2/h + s^3/(3 h^2) up to h.
static double run_on(double s, double h, double *slope)
{
    double left = s < h ? 1 - s / h : 0;
    *slope = left * left;
    return h / 3 * (1 - left * left * left);
}

SweepBasis sweep_field_basis(const SweepField *field, int branch, double t)
{
    const SweepBranch *b = &field->model->branch[branch];
    const double *breaks = field->model->break_t + b->first_break;
    int last = b->break_count - 1;
    double length = field->curve[branch]->length, at = fmax(0, fmin(breaks[last], t)), end = t < 0 ? 0 : t > length ? length : t, go = 0, slope = 1, p[4][4];
    if (t < 0)
        go = -run_on(-t, field->level_from[branch], &slope);
    if (t > length)
        go = run_on(t - length, field->level_to[branch], &slope);
    int span = span_of(breaks, last, at);
    span_polynomials(breaks, last, span, end, p);
    SweepBasis basis = {.first = b->first_row + span};
    for (int j = 0; j < 4; j++) {
        basis.weight[j] = p[j][0] + go * p[j][1];
        basis.slope[j] = slope * p[j][1];
    }
    return basis;
}

// --- Segments ---

// Polynomials of t - to from those of t - from.
static void shift_polynomial(double *c, int stride, double by)
{
    double c0 = c[0], c1 = c[stride], c2 = c[2 * stride], c3 = c[3 * stride];
    c[0] = c0 + by * (c1 + by * (c2 + by * c3));
    c[stride] = c1 + by * (2 * c2 + by * 3 * c3);
    c[2 * stride] = c2 + 3 * by * c3;
}

static void take_curve(SweepSegment *s, const SweepInterval *i)
{
    for (int k = 0; k < 4; k++)
        s->s[k] = i->s[k], s->n[k] = i->n[k], s->b[k] = i->b[k];
    double by = s->origin - i->origin;
    if (by == 0)
        return;
    for (int k = 0; k < 3; k++) {
        shift_polynomial(&s->s[0].x + k, 3, by);
        shift_polynomial(&s->n[0].x + k, 3, by);
        shift_polynomial(&s->b[0].x + k, 3, by);
    }
}

static void take_section(const SweepModel *m, const SweepBranch *b, SweepSegment *s)
{
    const double *breaks = m->break_t + b->first_break;
    double p[4][4], middle = 0.5 * (s->from + s->to);
    int span = span_of(breaks, b->break_count - 1, middle);
    span_polynomials(breaks, b->break_count - 1, span, s->origin, p);
    SEL_ASSERT(span + 4 <= b->break_count + 2, "a span has four rows");
    const double *row = m->row + (size_t)(b->first_row + span) * SWEEP_TERMS;
    for (int k = 0; k < SWEEP_TERMS; k++)
        for (int power = 0; power < 4; power++) {
            double sum = 0;
            for (int j = 0; j < 4; j++)
                sum += p[j][power] * row[j * SWEEP_TERMS + k];
            s->section[k][power] = sum;
        }
}

// [mm] bound of R: |c_0| + sum |c_k|, by the polynomials' largest values at five places, enlarged a little for what lies between.
static double bound_section(const SweepSegment *s)
{
    enum { PLACES = 5 };
    double most = 0, from = isfinite(s->from) ? s->from : s->origin, to = isfinite(s->to) ? s->to : s->origin;
    for (int i = 0; i < PLACES; i++) {
        double x = from + (to - from) * i / (PLACES - 1) - s->origin, sum = 0, a[SWEEP_TERMS];
        for (int k = 0; k < SWEEP_TERMS; k++)
            a[k] = s->section[k][0] + x * (s->section[k][1] + x * (s->section[k][2] + x * s->section[k][3]));
        for (int k = 1; k < SWEEP_TERMS; k += 2)
            sum += same_hypot(a[k], a[k + 1]);
        most = fmax(most, fabs(a[0]) + sum);
    }
    return 1.02 * most;
}

// The two segments beyond an end of a branch; `inner`: the branch's segment there; side: -1 before the start, 1 beyond the end.
static void extend(const SweepInterval *line, const SweepSegment *inner, double side, double h, bool closed, SweepSegment *near, SweepSegment *far)
{
    double origin = line->origin, x = origin - inner->origin;
    *near = (SweepSegment){
        .origin = origin, .rise = closed ? vec3_norm(line->s[1]) : 0, .from = side > 0 ? origin : origin - h, .to = side > 0 ? origin + h : origin};
    take_curve(near, line);
    *far = *near;
    far->from = side > 0 ? near->to : -HUGE_VAL, far->to = side > 0 ? HUGE_VAL : near->from;
    for (int k = 0; k < SWEEP_TERMS; k++) {
        const double *c = inner->section[k];
        double value = c[0] + x * (c[1] + x * (c[2] + x * c[3])), slope = c[1] + x * (2 * c[2] + x * 3 * c[3]);
        near->section[k][0] = value, near->section[k][1] = slope, near->section[k][2] = -side * slope / h, near->section[k][3] = slope / (3 * h * h);
        far->section[k][0] = value + side * slope * h / 3;
    }
    near->largest = bound_section(near), far->largest = bound_section(far);
}

// Segments of a branch between its ends: the places of knots and breaks in order. Returns their number; writes them if `segment` is not NULL.
static int cut_branch(const SweepField *field, int branch, SweepSegment *segment)
{
    const SweepBranch *b = &field->model->branch[branch];
    const SweepCurve *curve = field->curve[branch];
    const double *breaks = field->model->break_t + b->first_break;
    double at = 0, same = 1e-7 * curve->length;
    int count = 0;
    for (int knot = 1, next = 1; knot < curve->knot_count;) {
        double to = curve->knot_t[knot];
        bool is_break = next < b->break_count - 1 && breaks[next] < to - same;
        if (is_break)
            to = breaks[next];
        if (segment) {
            SweepSegment *s = &segment[count];
            *s = (SweepSegment){.origin = at, .from = at, .to = to};
            take_curve(s, &curve->interval[knot]);
            take_section(field->model, b, s);
            s->largest = bound_section(s);
        }
        count++;
        at = to;
        // a break at a knot belongs to it
        while (next < b->break_count - 1 && breaks[next] <= to + same)
            next++;
        knot += !is_break;
    }
    return count;
}

static double level_height(const SweepBranch *b, double mean) { return fmax(0.1 * b->radius, fmin(0.5 * mean, b->radius)); }

static void fill_branch(SweepField *field, int branch)
{
    const SweepBranch *b = &field->model->branch[branch];
    const SweepCurve *curve = field->curve[branch];
    int first = field->first_segment[branch], last = field->first_segment[branch + 1] - 1;
    SweepSegment *s = field->segment;
    cut_branch(field, branch, s + first + 2);
    field->level_from[branch] = level_height(b, field->model->row[(size_t)b->first_row * SWEEP_TERMS]);
    field->level_to[branch] = level_height(b, field->model->row[(size_t)(b->first_row + b->break_count + 1) * SWEEP_TERMS]);
    for (int i = first + 2; i <= last - 2; i++)
        sweep_stretch_mark(field->model, branch, &s[i]);
    extend(&curve->interval[0], &s[first + 2], -1, field->level_from[branch], !b->open_start, &s[first + 1], &s[first]);
    extend(&curve->interval[curve->knot_count], &s[last - 2], 1, field->level_to[branch], true, &s[last - 1], &s[last]);
    for (int i = first; i < first + 2 && b->open_start; i++)
        sweep_stretch_mark(field->model, branch, &s[i]);
}

static void fill_forks(SweepField *field)
{
    for (int i = 1; i < field->model->branch_count; i++) {
        const SweepBranch *b = &field->model->branch[i];
        double parent = fmax(sweep_field_mean(field, b->parent, b->parent_t), 1e-3 * b->radius);
        double child = sweep_field_mean(field, i, fmin(parent, field->curve[i]->length));
        field->fork[i] = (SweepFork){.delta = sweep_model_blend(field->model, i) * fmax(child, 0), .reach = 3 * parent};
    }
}

static void fill_around(SweepField *field, int branch)
{
    double near = field->model->branch[branch].radius;
    int first = field->first_segment[branch], end = field->first_segment[branch + 1];
    for (int i = first; i < end; i++) {
        SweepSegment *s = &field->segment[i];
        s->around = s->largest;
        s->harmonics = 1;
        for (int k = 3; k < SWEEP_TERMS; k++)
            for (int power = 0; power < 4; power++)
                s->harmonics = s->section[k][power] != 0 ? (k + 1) / 2 : s->harmonics;
        for (int k = i - 1; k >= first && field->segment[k].to >= s->from - near; k--)
            s->around = fmax(s->around, field->segment[k].largest);
        for (int k = i + 1; k < end && field->segment[k].from <= s->to + near; k++)
            s->around = fmax(s->around, field->segment[k].largest);
    }
}

SweepField *sweep_field_create(const SweepModel *model)
{
    SweepField *field = calloc(1, sizeof *field);
    if (!field)
        return NULL;
    SEL_ASSERT(model->branch_count > 0, "a model has branches");
    size_t branches = (size_t)model->branch_count;
    field->model = model;
    field->branch_count = model->branch_count;
    field->curve = calloc(branches, sizeof(SweepCurve *));
    field->first_segment = calloc(branches + 1, sizeof *field->first_segment);
    field->fork = calloc(branches, sizeof *field->fork);
    field->level_from = calloc(branches, sizeof *field->level_from);
    field->level_to = calloc(branches, sizeof *field->level_to);
    if (model->sac) {
        field->sac = calloc((size_t)model->sac->node_count, sizeof *field->sac);
        field->sac_group = calloc((size_t)model->sac->node_count, sizeof *field->sac_group);
    }
    if (!field->curve || !field->first_segment || !field->fork || !field->level_from || !field->level_to ||
        (model->sac && (!field->sac || !field->sac_group))) {
        sweep_field_free(field);
        return NULL;
    }
    for (int i = 0; i < model->branch_count; i++) {
        field->curve[i] = sweep_curve_create(model->branch[i].knot_count, model->knot + model->branch[i].first_knot);
        if (!field->curve[i]) {
            sweep_field_free(field);
            return NULL;
        }
        field->first_segment[i + 1] = field->first_segment[i] + cut_branch(field, i, NULL) + 4;
    }
    size_t segments = (size_t)field->first_segment[branches];
    field->segment = aligned_alloc(64, segments * sizeof *field->segment);
    field->view = calloc(segments, sizeof *field->view);
    if (!field->segment || !field->view) {
        sweep_field_free(field);
        return NULL;
    }
    for (int i = 0; i < model->branch_count; i++)
        fill_branch(field, i);
    for (int i = 0; i < model->branch_count; i++)
        fill_around(field, i);
    fill_forks(field);
    sweep_field_fill_views(field);
    return field;
}

void sweep_field_free(SweepField *field)
{
    if (!field)
        return;
    for (int i = 0; field->curve && i < field->branch_count; i++)
        sweep_curve_free(field->curve[i]);
    free(field->curve);
    free(field->first_segment);
    free(field->segment);
    free(field->view);
    free(field->fork);
    free(field->sac);
    free(field->sac_group);
    free(field->level_from);
    free(field->level_to);
    free(field);
}

// Which branches and sacs are seen from where. A child is followed from its start along each branch that is seen at its fork, as long as the two tubes,
// enlarged by the width of the blend, overlap: over this length each sees the other. Where two vessels come together elsewhere, nothing leads from one to the
// other, and they are never blended.
#include "geom/sweep_views.h"

#include "geom/power_walk.h"

enum { PASSES = 4 };
static const double STEP = 0.25;             // of a walk, relative to the narrower tube
static const double LEAST_STEP = 1e-4;       // … but at least this, relative to the length
static const double MARGIN = 0.25;           // relative to the narrower tube's radius: what is further apart is not seen
static const double LOWEST = 0.995, MOST_DELTA = 0.45;    // of a sac's scale, below which its field does not fall
static const double ASIDE = 1.5;             // how much longer the overlap may be on the parent's curve, on the inner side of a bend

// Branches stay in ascending order; one that is already listed keeps its first place.
static void add_candidate(SweepField *field, SweepView *view, int branch, double t, double slope)
{
    SEL_ASSERT(branch >= 0 && branch < field->model->branch_count, "a view lists branches of the model");
    int at = 0;
    while (at < view->count && view->of[at].branch < branch)
        at++;
    if (at < view->count && view->of[at].branch == branch)
        return;
    if (view->count == SWEEP_CANDIDATES) {
        field->crowded++;
        return;
    }
    for (int i = view->count; i > at; i--)
        view->of[i] = view->of[i - 1];
    view->of[at] = (SweepCandidate){branch, sweep_field_segment(field, branch, t), t, slope};
    view->count++;
}

static double width_at(const SweepField *field, int branch, double t)
{
    const SweepFork *fork = &field->fork[branch];
    double s = fork->reach > 0 ? t / fork->reach : 2, left = 1 - s * s;
    return fork->delta * (SWEEP_LEAST_BLEND + (left > 0 ? (1 - SWEEP_LEAST_BLEND) * left * left : 0));
}

// A place on two branches, the later one and an earlier one, where their tubes may overlap.
typedef struct Meeting {
    int later, earlier;
    double t, t_earlier;
} Meeting;

// [mm] How far the tubes, enlarged by the width of the blend, are apart at a meeting; < 0: they overlap. Moves t_earlier to the foot of the later branch's
// point.
static double apart(const SweepField *field, Meeting *m, double *own, double *least, double *blend)
{
    Vec3 x = sweep_curve_at(field->curve[m->later], m->t).s;
    m->t_earlier = sweep_curve_project(field->curve[m->earlier], x, m->t_earlier, 2 * field->model->branch[m->earlier].radius);
    double their = sweep_field_largest(field, m->earlier, m->t_earlier);
    *own = sweep_field_largest(field, m->later, m->t), *least = fmin(*own, their);
    // the earlier one may blend with a third branch before they meet
    *blend = 2 * (width_at(field, m->later, m->t) + width_at(field, m->earlier, m->t_earlier)) + MARGIN * *least;
    return vec3_distance(x, sweep_curve_at(field->curve[m->earlier], m->t_earlier).s) - *own - their - *blend;
}

// Follows the later branch of a meeting, forwards or backwards, as long as the tubes overlap.
static void follow(SweepField *field, Meeting m, double way)
{
    double length = field->curve[m.later]->length, end = way > 0 ? length : 0, own, least, blend;
    int first = field->first_segment[m.later], last = field->first_segment[m.later + 1] - 1, before = sweep_field_segment(field, m.later, m.t);
    while (apart(field, &m, &own, &least, &blend) < 0) {
        int here = sweep_field_segment(field, m.later, m.t), low = here < before ? here : before, high = here < before ? before : here;
        // the segments beyond an end see what the end sees
        low = m.t <= 0 ? first : low, high = m.t >= length ? last : high;
        for (int s = low; s <= high; s++)
            add_candidate(field, &field->view[s], m.earlier, m.t_earlier, 0);
        before = here;
        double aside = ASIDE * (own + blend);
        int from = sweep_field_segment(field, m.earlier, m.t_earlier - aside), to = sweep_field_segment(field, m.earlier, m.t_earlier + aside);
        for (int s = from; s <= to; s++)
            add_candidate(field, &field->view[s], m.later, m.t, 0);
        if (m.t == end)
            return;
        m.t = fmax(0, fmin(length, m.t + way * fmax(STEP * least, LEAST_STEP * length)));
    }
}

// The middle of a segment, or its finite end.
static double middle_of(const SweepSegment *s)
{
    if (!isfinite(s->from))
        return s->to;
    return isfinite(s->to) ? 0.5 * (s->from + s->to) : s->from;
}

static bool sees(const SweepView *view, int branch)
{
    for (int i = 0; i < view->count; i++)
        if (view->of[i].branch == branch)
            return true;
    return false;
}

// What a branch that is seen from a segment sees there is seen from the segment, too, if it overlaps: otherwise the wall would depend on the place from which it
// is seen. Returns whether something was added.
static bool see_through(SweepField *field, int segment, int branch)
{
    bool added = false;
    double middle = middle_of(&field->segment[segment]), own, least, blend;
    if (middle < 0 || middle > field->curve[branch]->length)
        return false;
    SweepView view = field->view[segment];
    for (int i = 0; i < view.count; i++) {
        if (view.of[i].branch == branch)
            continue;
        SweepView through = field->view[sweep_field_segment(field, view.of[i].branch, view.of[i].t)];
        for (int k = 0; k < through.count; k++) {
            int other = through.of[k].branch;
            if (other == branch || other == view.of[i].branch || sees(&field->view[segment], other))
                continue;
            Meeting m = other < branch ? (Meeting){branch, other, middle, through.of[k].t} : (Meeting){other, branch, fmax(0, through.of[k].t), middle};
            if (apart(field, &m, &own, &least, &blend) >= 0)
                continue;
            int before = field->view[segment].count;
            follow(field, m, 1);
            follow(field, m, -1);
            added |= field->view[segment].count > before;
        }
    }
    return added;
}

// Where Newton starts on each candidate: the curve's point nearest to that of the place.
static void refine_starts(SweepField *field, int branch)
{
    for (int s = field->first_segment[branch]; s < field->first_segment[branch + 1]; s++) {
        double middle = middle_of(&field->segment[s]), length = field->curve[branch]->length, at = fmax(0, fmin(length, middle));
        SweepJet here = sweep_curve_at(field->curve[branch], at);
        for (int i = 0; i < field->view[s].count; i++) {
            SweepCandidate *c = &field->view[s].of[i];
            if (c->branch == branch)
                continue;
            double t = sweep_curve_project(field->curve[c->branch], here.s, c->t, field->model->branch[c->branch].radius);
            Vec3 s1 = sweep_curve_at(field->curve[c->branch], t).s1;
            c->slope = vec3_dot(here.s1, s1) / vec3_norm2(s1);
            c->t = t - c->slope * at;
            c->segment = sweep_field_segment(field, c->branch, t);
        }
    }
}

// --- Sacs ---

// The sac to which a node of the sacs' tree belongs, as the first node of its group: an aneurysm's nodes are linked, a vessel's belong to the nearest
// aneurysm's.
static int group_of(const VesselTree *sac, int node)
{
    if (sac->kind[node] != NODE_ANEURYSM) {
        int best = -1;
        for (int i = 0; i < sac->node_count; i++)
            if (sac->kind[i] == NODE_ANEURYSM &&
                (best < 0 || vec3_distance(sac->center[i], sac->center[node]) < vec3_distance(sac->center[best], sac->center[node])))
                best = i;
        if (best < 0)
            return 0;
        node = best;
    }
    while (sac->parent[node] >= 0 && sac->kind[sac->parent[node]] == NODE_ANEURYSM)
        node = sac->parent[node];
    return node;
}

// The place on a branch of the tree's node to which a node of the sacs' tree corresponds; the nearest knot if no knot does.
static SweepPlace place_of(const SweepField *field, int node)
{
    const SweepModel *m = field->model;
    SweepPlace place = {0};
    double best = HUGE_VAL;
    for (int i = 0; i < m->branch_count; i++)
        for (int k = 0; k < m->branch[i].knot_count; k++) {
            int knot = m->branch[i].first_knot + k;
            bool same = m->sac->kind[node] == NODE_VESSEL && m->knot_node[knot] == m->sac_node[node];
            double far = vec3_distance(m->knot[knot], m->sac->center[node]) - (same ? 1e6 : 0);
            if (far < best)
                best = far, place = (SweepPlace){.branch = i, .t = field->curve[i]->knot_t[k]};
        }
    return place;
}

// Returns whether the sac's wall, enlarged by the width of the blend, reaches the tube's at t. Blobs reach much further than the wall that they make: by them, a
// vessel that leaves the neck and passes the sac's flank would blend with it there.
static bool is_reached(const SweepField *field, int group, int branch, double t)
{
    enum { AROUND = 16 };
    const SweepSac *sac = &field->sac[group];
    const SweepSegment *s = &field->segment[sweep_field_segment(field, branch, t)];
    SweepJet jet = sweep_curve_at(field->curve[branch], t);
    double radius[SWEEP_TERMS], x = t - s->origin, near = -fmin(2 * sac->delta + MARGIN * field->model->branch[branch].radius, LOWEST * sac->scale);
    SweepPart part;
    for (int k = 0; k < SWEEP_TERMS; k++)
        radius[k] = s->section[k][0] + x * (s->section[k][1] + x * (s->section[k][2] + x * s->section[k][3]));
    sweep_field_sac(field, group, jet.s, &part);
    for (int i = 0; i < AROUND && !(part.f > near); i++) {
        double angle = 2 * PI * i / AROUND, r = radius[0];
        for (int k = 1; k <= SWEEP_HARMONICS; k++)
            r += radius[2 * k - 1] * same_cos(k * angle) + radius[2 * k] * same_sin(k * angle);
        Vec3 out = vec3_add(vec3_scale(jet.n, same_cos(angle)), vec3_scale(jet.b, same_sin(angle)));
        sweep_field_sac(field, group, vec3_add_scaled(jet.s, r, out), &part);
    }
    return part.f > near;
}

static void mark_sac(SweepField *field, int group, const int *group_of_node, int branch, double start)
{
    const SweepCurve *curve = field->curve[branch];
    const VesselTree *sac = field->model->sac;
    double step = fmax(STEP * field->model->branch[branch].radius, LEAST_STEP * curve->length);
    for (int side = -1; side <= 1; side += 2)
        for (double t = fmax(0, fmin(curve->length, start)); is_reached(field, group, branch, t);) {
            // a little further, for points outside the wall
            int from = sweep_field_segment(field, branch, t - 2 * step), to = sweep_field_segment(field, branch, t + 2 * step);
            for (int s = from; s <= to; s++) {
                SweepView *view = &field->view[s];
                if (view->sac < 0)
                    view->sac = power_walk(sac, sweep_curve_at(curve, fmax(0, fmin(curve->length, middle_of(&field->segment[s])))).s, group, 1 << 20);
                else if (group_of_node[view->sac] != group)
                    field->crowded++;
            }
            if (t == (side > 0 ? curve->length : 0))
                break;
            t = fmax(0, fmin(curve->length, t + side * step));
        }
}

static void see_from_sac(SweepField *field, int node, int branch, double start)
{
    double t = sweep_curve_project(field->curve[branch], field->model->sac->center[node], start, field->model->branch[branch].radius);
    add_candidate(field, &field->sac[node].view, branch, t, 0);
}

static void fill_sac(SweepField *field, int group, const int *group_of_node)
{
    const VesselTree *sac = field->model->sac;
    double largest = 0, vessel = 0;
    int vessels = 0, places = 0;
    for (int i = 0; i < sac->node_count; i++) {
        if (group_of_node[i] != group)
            continue;
        if (sac->kind[i] == NODE_VESSEL)
            vessel += sac->radius[i], vessels++;
        else
            largest = fmax(largest, sac->radius[i]);
    }
    largest = largest > 0 ? largest : vessel / vessels;
    double width = field->model->blend * 0.5 * (vessels > 0 ? fmin(largest, vessel / vessels) : largest);
    for (int i = 0; i < sac->node_count; i++)
        if (group_of_node[i] == group)
            field->sac[i].scale = 0.5 * largest, field->sac[i].delta = fmin(width, MOST_DELTA * field->sac[i].scale);
    for (int i = 0; i < sac->node_count; i++) {
        if (group_of_node[i] != group)
            continue;
        // a sac without vessel nodes hangs on the branch nearest to its first node
        if (sac->kind[i] != NODE_VESSEL && (vessels > 0 || places > 0))
            continue;
        SweepPlace place = place_of(field, i);
        SweepView view = field->view[sweep_field_segment(field, place.branch, place.t)];
        places++;
        for (int k = 0; k < view.count; k++) {
            double t = view.of[k].branch == place.branch ? place.t : view.of[k].t + view.of[k].slope * place.t;
            mark_sac(field, group, group_of_node, view.of[k].branch, t);
            for (int j = 0; j < sac->node_count; j++)
                if (group_of_node[j] == group)
                    see_from_sac(field, j, view.of[k].branch, t);
        }
    }
}

void sweep_field_fill_views(SweepField *field)
{
    const SweepModel *m = field->model;
    for (int i = 0; i < m->branch_count; i++) {
        for (int s = field->first_segment[i]; s < field->first_segment[i + 1]; s++) {
            field->view[s].sac = -1;
            add_candidate(field, &field->view[s], i, 0, 1);
        }
        if (i == 0)
            continue;
        const SweepBranch *b = &m->branch[i];
        SweepView fork = field->view[sweep_field_segment(field, b->parent, b->parent_t)];
        for (int k = 0; k < fork.count; k++)
            follow(field, (Meeting){i, fork.of[k].branch, 0, fork.of[k].branch == b->parent ? b->parent_t : fork.of[k].t}, 1);
    }
    bool added = true;
    for (int pass = 0; pass < PASSES && added; pass++) {
        added = false;
        for (int i = 0; i < m->branch_count; i++)
            for (int s = field->first_segment[i]; s < field->first_segment[i + 1]; s++)
                added |= see_through(field, s, i);
    }
    for (int i = 0; i < m->branch_count; i++)
        refine_starts(field, i);
    if (!m->sac)
        return;
    int *group = field->sac_group;
    for (int i = 0; i < m->sac->node_count; i++)
        group[i] = group_of(m->sac, i);
    for (int i = 0; i < m->sac->node_count; i++) {
        field->sac[i].view.sac = i;
        if (group[i] == i)
            fill_sac(field, i, group);
    }
}

// Projection onto a swept wall, as in blobby.c: x falls onto F = 0 along the gradient; from inside, where the field need not fall towards the nearest wall, rays
// in 14 directions are tried too. Then Newton on the surface, the step -(I + d S)^-1 P (foot - x) along the direction of P (foot - x) only, halved until the
// distance falls.
#include "geom/model_field.h"

#include "base/base.h"
#include "geom/power_walk.h"
#include "geom/sweep_vessel.h"

#include <stdlib.h>
#include <string.h>

static const double PITCH = 0.75;    // of the nodes, in mean radii of the section
static const double OUT = 0.5;       // [radii] points further from the wall are not its own

// --- Nodes of a swept model ---

static double step_at(const SweepField *field, int branch, double t)
{
    enum { MOST = 20000 };
    double length = field->curve[branch]->length, radius = field->model->branch[branch].radius;
    return fmax(PITCH * fmax(sweep_field_mean(field, branch, t), 0.1 * radius), length / MOST);
}

// Calls for each node of a branch in the order of t; without room (t == NULL) only counts them. A child begins one step from the fork, whose node is the parent's.
static int place_nodes(const SweepField *field, int branch, double *t)
{
    double length = field->curve[branch]->length, at = branch == 0 ? 0 : fmin(length, step_at(field, branch, 0));
    int count = 0;
    for (;; count++) {
        double step = step_at(field, branch, at);
        if (at + 0.5 * step > length)
            at = length;
        if (t)
            t[count] = at;
        if (at == length)
            return count + 1;
        at = fmin(length, at + step);
    }
}

static int nearest_knot(const SweepCurve *curve, double t)
{
    int best = 0;
    for (int k = 1; k < curve->knot_count; k++)
        best = fabs(curve->knot_t[k] - t) < fabs(curve->knot_t[best] - t) ? k : best;
    return best;
}

static void fill_branch(ModelField *m, int branch, const double *t)
{
    const SweepBranch *b = &m->swept->branch[branch];
    VesselTree *tree = m->own;
    int first = m->first_node[branch];
    for (int i = first; i < m->first_node[branch + 1]; i++) {
        double at = t[i - first];
        SweepJet jet = sweep_curve_at(m->field->curve[branch], at);
        tree->center[i] = jet.s, tree->direction[i] = vec3_unit(jet.s1);
        tree->radius[i] = fmax(sweep_field_mean(m->field, branch, at), 1e-3 * b->radius);
        tree->kind[i] = NODE_VESSEL, tree->parent[i] = i - 1;
        m->place[i] = (SweepPlace){.branch = branch, .t = at, .sac = -1};
        m->file_node[i] = m->swept->knot_node[b->first_knot + nearest_knot(m->field->curve[branch], at)];
    }
    tree->parent[first] = branch == 0 ? -1 : model_field_node_at(m, (SweepPlace){.branch = b->parent, .t = b->parent_t});
}

// The vessel's node nearest to x.
static int nearest_vessel(const ModelField *m, Vec3 x)
{
    int best = 0, vessels = m->first_node[m->swept->branch_count];
    for (int i = 1; i < vessels; i++)
        if (power_distance(x, m->own->center[i], m->own->radius[i]) < power_distance(x, m->own->center[best], m->own->radius[best]))
            best = i;
    return best;
}

// `of`: (nodes of the sacs' tree) comes out as their node, -1 for those of vessels.
static void fill_sacs(ModelField *m, int *of)
{
    const VesselTree *sac = m->swept->sac;
    VesselTree *tree = m->own;
    int at = m->first_node[m->swept->branch_count];
    for (int i = 0; sac && i < sac->node_count; i++) {
        of[i] = -1;
        if (sac->kind[i] != NODE_ANEURYSM)
            continue;
        int parent = sac->parent[i];
        tree->center[at] = sac->center[i], tree->direction[at] = sac->direction[i], tree->radius[at] = sac->radius[i];
        tree->kind[at] = NODE_ANEURYSM;
        tree->parent[at] = parent >= 0 && of[parent] >= 0 ? of[parent] : nearest_vessel(m, sac->center[parent >= 0 ? parent : i]);
        m->place[at] = (SweepPlace){.branch = -1, .sac = i};
        m->file_node[at] = m->swept->sac_node[i];
        of[i] = at++;
    }
}

int model_field_node_at(const ModelField *m, SweepPlace place)
{
    int sacs = m->first_node[m->swept->branch_count];
    if (place.branch < 0) {
        for (int i = sacs; i < m->own->node_count; i++)
            if (m->place[i].sac == place.sac)
                return i;
        return nearest_vessel(m, m->swept->sac->center[place.sac]);
    }
    int low = m->first_node[place.branch], high = m->first_node[place.branch + 1] - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (place.t > 0.5 * (m->place[middle].t + m->place[middle + 1].t))
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

// --- Points ---

// The node of the model at which points of a node of the file's tree begin their walk; -1: the model has no vessel there.
static int node_for(const ModelField *m, const VesselTree *tree, int node)
{
    if (tree->kind[node] == NODE_ANEURYSM)
        for (int i = m->first_node[m->swept->branch_count]; i < m->own->node_count; i++)
            if (m->file_node[i] == node)
                return i;
    int near = power_nearest(m->own, tree->center[node]);
    double radius = fmax(m->own->radius[near], tree->radius[node]);
    return vec3_distance(tree->center[node], m->own->center[near]) < 2 * radius ? near : -1;
}

static void take_points(ModelField *m, const VesselTree *tree)
{
    enum { HOPS = 64 };
    VesselTree *own = m->own;
    int *owner = HEAP_ZEROED((size_t)tree->point_count + 1, sizeof *owner);
    for (int i = 0; i < tree->node_count; i++) {
        int from = tree->point_offset[i] < tree->point_offset[i + 1] ? node_for(m, tree, i) : -1;
        for (int64_t p = tree->point_offset[i]; p < tree->point_offset[i + 1]; p++) {
            owner[p] = from < 0 ? -1 : own->kind[from] == NODE_ANEURYSM ? from : power_walk(own, tree->point[p], from, HOPS);
            own->point_offset[owner[p] + 1] += owner[p] >= 0;
            m->left_out += owner[p] < 0;
        }
    }
    for (int i = 0; i < own->node_count; i++)
        own->point_offset[i + 1] += own->point_offset[i];
    own->point_count = own->point_offset[own->node_count];
    int64_t *at = HEAP_ZEROED((size_t)own->node_count, sizeof *at);
    memcpy(at, own->point_offset, (size_t)own->node_count * sizeof *at);
    for (int64_t p = 0; p < tree->point_count; p++)
        if (owner[p] >= 0)
            own->point[at[owner[p]]++] = tree->point[p];
    free(at);
    free(owner);
}

static void measure_points(ModelField *m)
{
    VesselTree *own = m->own;
    double *value = HEAP_ZEROED((size_t)own->point_count + 1, sizeof *value);
    for (int i = 0; i < own->node_count; i++) {
        int count = 0;
        for (int64_t p = own->point_offset[i]; p < own->point_offset[i + 1]; p++) {
            double e = fabs(model_field_distance(m, i, own->point[p]));
            bool near = e < OUT * own->radius[i];
            m->left_out += !near;
            if (near)
                value[count++] = e;
        }
        sort_doubles(value, (size_t)count);
        own->error[i] = count > 0 ? value[(int)(0.9 * (count - 1))] : 0;
    }
    free(value);
}

// --- Creation ---

static bool fill(ModelField *m, const VesselTree *tree)
{
    const SweepModel *model = m->swept;
    int nodes = 0, most = 0, sacs = 0;
    m->first_node = HEAP_ZEROED((size_t)model->branch_count + 1, sizeof *m->first_node);
    for (int i = 0; i < model->branch_count; i++) {
        int count = place_nodes(m->field, i, NULL);
        most = count > most ? count : most;
        m->first_node[i + 1] = nodes += count;
    }
    for (int i = 0; model->sac && i < model->sac->node_count; i++)
        sacs += model->sac->kind[i] == NODE_ANEURYSM;
    m->own = vessel_tree_create(nodes + sacs, tree->point_count, 0);
    if (!m->own)
        return false;
    m->tree = m->own;
    m->place = HEAP_ZEROED((size_t)(nodes + sacs), sizeof *m->place), m->file_node = HEAP_ZEROED((size_t)(nodes + sacs), sizeof *m->file_node);
    double *t = HEAP_ZEROED((size_t)most, sizeof *t);
    for (int i = 0; i < model->branch_count; i++) {
        place_nodes(m->field, i, t);
        fill_branch(m, i, t);
    }
    free(t);
    int *of = HEAP_ZEROED((size_t)(model->sac ? model->sac->node_count : 0) + 1, sizeof *of);
    fill_sacs(m, of);
    free(of);
    return vessel_tree_link(m->own);
}

bool model_field_of_sweep(const VesselTree *tree, const SweepModel *model, ModelField *out)
{
    *out = (ModelField){.swept = model, .field = sweep_field_create(model)};
    if (!out->field || !fill(out, tree)) {
        model_field_free(out);
        return false;
    }
    take_points(out, tree);
    measure_points(out);
    return true;
}

void model_field_free(ModelField *m)
{
    sweep_field_free(m->field);
    vessel_tree_free(m->own);
    free(m->place);
    free(m->file_node);
    free(m->first_node);
    *m = (ModelField){0};
}

// --- Evaluation ---

double model_field_at(const ModelField *m, int node, Vec3 x, Vec3 *gradient)
{
    SEL_ASSERT(node >= 0 && node < m->tree->node_count, "the field is seen from a node");
    if (!m->swept) {
        Blobby model = blobby_of(m->tree, node);
        return gradient ? blobby_gradient(&model, x, gradient) : blobby_field(&model, x);
    }
    SweepBlend blend;
    sweep_field_blend(m->field, m->place[node], x, &blend);
    if (gradient)
        *gradient = blend.gradient;
    return blend.f;
}

double model_field_distance(const ModelField *m, int node, Vec3 x)
{
    Vec3 gradient;
    if (!m->swept && blobby_of(m->tree, node).count < 1)
        return NAN;
    double f = model_field_at(m, node, x, &gradient);
    return f / vec3_norm(gradient);
}

// --- Projection ---

// Moves p onto F = 0 along the gradient, in steps no longer than `longest`.
static bool fall(const ModelField *m, int node, double longest, Vec3 *p, SweepBlend *blend)
{
    for (int i = 0; i < 40; i++) {
        sweep_field_blend(m->field, m->place[node], *p, blend);
        double slope2 = vec3_norm2(blend->gradient);
        if (!(slope2 > 1e-12) || !isfinite(blend->f))
            return false;
        double slope = sqrt(slope2), step = fmax(-longest, fmin(longest, blend->f / slope));
        if (fabs(blend->f) < 1e-11 * slope)
            return true;
        *p = vec3_add_scaled(*p, -step / slope, blend->gradient);
    }
    return fabs(blend->f) < 1e-9 * vec3_norm(blend->gradient);
}

static SurfacePoint point_at(Vec3 x, Vec3 foot, const SweepBlend *blend)
{
    double slope = vec3_norm(blend->gradient);
    Vec3 n = vec3_scale(blend->gradient, 1 / slope), hn = vec3_scale(sym3_mul_vec(&blend->hessian, n), -1 / slope);
    SurfacePoint s = {.foot = foot, .normal = n, .distance = vec3_dot(vec3_sub(x, foot), n)};
    // P H P / slope
    sym3_add(&s.shape, 1 / slope, &blend->hessian);
    sym3_add_pair(&s.shape, 1, n, hn);
    sym3_add_outer(&s.shape, -vec3_dot(n, hn), n);
    double away = vec3_distance(x, foot);
    Vec3 rest = vec3_add_scaled(vec3_sub(x, foot), -s.distance, n);
    s.converged = fabs(blend->f) < 1e-9 * slope && (away < 1e-6 || vec3_norm(rest) <= 1e-4 * away);
    return s;
}

// Slides a foot on the wall towards x.
static SurfacePoint slide(const ModelField *m, int node, Vec3 x, Vec3 foot, SweepBlend blend)
{
    double radius = m->tree->radius[node];
    SurfacePoint best = point_at(x, foot, &blend);
    for (int i = 0; i < 60; i++) {
        Vec3 rest = vec3_add_scaled(vec3_sub(x, best.foot), -best.distance, best.normal), along = vec3_unit_or(rest, best.normal);
        double far = vec3_distance(x, best.foot), length = vec3_norm(rest);
        if (length <= 1e-12 * (1 + far))
            break;
        length = fmin(radius, length / fmax(fabs(1 + best.distance * sym3_quadratic(&best.shape, along)), 0.05));
        bool taken = false;
        for (int half = 0; half < 12 && !taken; half++, length *= 0.5) {
            Vec3 p = vec3_add_scaled(best.foot, length, along);
            if (!fall(m, node, radius, &p, &blend) || !(vec3_distance(x, p) < far * (1 - 1e-15)))
                continue;
            best = point_at(x, p, &blend);
            taken = true;
        }
        if (!taken)
            break;
    }
    return best;
}

// The first change of sign on a ray no longer than `most`.
static bool cross(const ModelField *m, int node, Vec3 x, Vec3 way, double most, Vec3 *at)
{
    double step = 0.1 * m->tree->radius[node], low = 0, high = 0;
    while (high == 0 && low < most)
        *(model_field_at(m, node, vec3_add_scaled(x, low + step, way), NULL) > 0 ? &low : &high) = low + step;
    if (high == 0)
        return false;
    for (int i = 0; i < 40; i++) {
        double middle = 0.5 * (low + high);
        *(model_field_at(m, node, vec3_add_scaled(x, middle, way), NULL) > 0 ? &low : &high) = middle;
    }
    *at = vec3_add_scaled(x, low, way);
    return true;
}

static SurfacePoint project_swept(const ModelField *m, int node, Vec3 x, Vec3 start)
{
    double radius = m->tree->radius[node];
    SweepBlend blend;
    Vec3 p = start;
    bool inside = model_field_at(m, node, x, NULL) > 0, warm = vec3_distance(start, x) > 0, found = fall(m, node, 0.5 * radius, &p, &blend);
    SurfacePoint best = {.foot = m->tree->center[node], .normal = vec3(1, 0, 0), .distance = -vec3_distance(x, m->tree->center[node])};
    if (found)
        best = slide(m, node, x, p, blend);
    // near the wall there is no nearer one on another side
    if (warm || !inside || (found && best.distance < 0.3 * radius))
        return best;
    for (int k = 0; k < 14; k++) {
        double corner = 1 - 2.0 * (k & 1);
        Vec3 way = k < 6 ? vec3(k / 2 == 0 ? corner : 0, k / 2 == 1 ? corner : 0, k / 2 == 2 ? corner : 0)
                         : vec3_unit(vec3(k - 6 < 4 ? 1 : -1, k % 4 < 2 ? 1 : -1, k % 2 == 0 ? 1 : -1));
        if (!cross(m, node, x, way, found ? 1.25 * fabs(best.distance) : 8 * radius, &p) || !fall(m, node, radius, &p, &blend))
            continue;
        SurfacePoint other = slide(m, node, x, p, blend);
        if (!found || fabs(other.distance) < fabs(best.distance))
            best = other;
        found = true;
    }
    return best;
}

SurfacePoint model_field_project(const ModelField *m, int node, Vec3 x, Vec3 start)
{
    if (m->swept)
        return project_swept(m, node, x, start);
    Blobby model = blobby_of(m->tree, node);
    return blobby_project(&model, x, start);
}

Vessel *model_field_vessel(const ModelField *m) { return m->swept ? sweep_vessel_create(m->swept) : model_vessel_create(m->tree); }

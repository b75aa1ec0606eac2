// Small swept models for tests, made branch by branch. Include after the headers of cmocka.
#ifndef SELDINGER_TESTS_SWEEP_MODELS_H
#define SELDINGER_TESTS_SWEEP_MODELS_H

#include "geom/sweep_field.h"
#include "geom/sweep_model.h"

#include <stdlib.h>

enum { SWEEP_SHAPE_KNOTS = 400 };
// One branch: its knots, breaks every `pitch` mm (roughly), and the section at t.
typedef struct SweepShape {
    int knots;
    Vec3 knot[SWEEP_SHAPE_KNOTS];
    double pitch;
    int parent;
    double parent_t;
    bool open_start;
    double radius;
    void (*section)(double t, double length, double *term);
    const double *circle;    // if section is NULL: radius at the start and at the end
} SweepShape;

static inline void sweep_shape_line(SweepShape *s, Vec3 from, Vec3 to, int knots)
{
    s->knots = knots;
    for (int i = 0; i < knots; i++)
        s->knot[i] = vec3_mix(from, to, (double)i / (knots - 1));
}

// Mean of the three knots inside a B-spline's support: a row with the value of a linear function there gives that function.
static inline double sweep_greville(const double *t, int last, int row)
{
    double sum = 0;
    for (int k = row + 1; k <= row + 3; k++)
        sum += t[k - 3 < 0 ? 0 : k - 3 > last ? last : k - 3];
    return sum / 3;
}

static inline SweepModel *sweep_model_of(const SweepShape *shape, int branches)
{
    int knots = 0, breaks = 0, rows = 0, count[32];
    for (int i = 0; i < branches; i++) {
        double length = 0;
        for (int k = 1; k < shape[i].knots; k++)
            length += vec3_distance(shape[i].knot[k], shape[i].knot[k - 1]);
        int spans = (int)(length / shape[i].pitch + 0.5);
        count[i] = (spans < 1 ? 1 : spans) + 1;
        knots += shape[i].knots, breaks += count[i], rows += count[i] + 2;
    }
    SweepModel *m = sweep_model_create(branches, knots, breaks, rows);
    knots = breaks = rows = 0;
    for (int i = 0; i < branches; i++) {
        const SweepShape *s = &shape[i];
        m->branch[i] = (SweepBranch){.parent = s->parent,
                                     .parent_t = s->parent_t,
                                     .open_start = s->open_start,
                                     .radius = s->radius,
                                     .first_knot = knots,
                                     .knot_count = s->knots,
                                     .first_break = breaks,
                                     .break_count = count[i],
                                     .first_row = rows};
        for (int k = 0; k < s->knots; k++) {
            m->knot[knots + k] = s->knot[k];
            m->knot_node[knots + k] = knots + k;
        }
        double length = sweep_model_length(m, i), *t = m->break_t + breaks;
        for (int k = 0; k < count[i]; k++)
            t[k] = k == count[i] - 1 ? length : length * k / (count[i] - 1);
        for (int k = 0; k < count[i] + 2; k++) {
            double at = sweep_greville(t, count[i] - 1, k), *term = m->row + (size_t)(rows + k) * SWEEP_TERMS;
            if (s->section)
                s->section(at, length, term);
            else
                term[0] = s->circle ? s->circle[0] + (s->circle[1] - s->circle[0]) * at / length : s->radius;
        }
        knots += s->knots, breaks += count[i], rows += count[i] + 2;
    }
    return m;
}

// One blob whose surface is a sphere, of a node linked to `parent`.
static inline void sweep_set_sphere(VesselTree *t, int node, int parent, int blob, Vec3 center, double radius)
{
    t->center[node] = t->blob_center[blob] = center;
    t->radius[node] = radius;
    t->direction[node] = vec3_unit(vec3_sub(center, t->center[parent]));
    t->parent[node] = parent;
    t->kind[node] = NODE_ANEURYSM;
    t->blob_width[blob] = 2 * radius;
    t->blob_amplitude[blob] = 1 / (0.75 * 0.75 * 0.75);      // u = 3/4 at d = radius
    t->blob_offset[node + 1] = blob + 1;
}

static inline void sweep_set_neck(VesselTree *t, int node, int parent, Vec3 center, double radius, Vec3 towards)
{
    t->center[node] = center, t->radius[node] = radius, t->direction[node] = vec3_unit(vec3_sub(towards, center));
    t->parent[node] = parent, t->kind[node] = NODE_VESSEL;
    t->blob_offset[node + 1] = t->blob_offset[node];
}

static inline void sweep_own_sac(SweepModel *m, VesselTree *t)
{
    vessel_tree_link(t);
    if (m->sac)
        vessel_tree_free(m->sac);
    free(m->sac_node);
    m->sac = t;
    m->sac_node = (int32_t *)calloc((size_t)t->node_count, sizeof *m->sac_node);
    for (int i = 0; i < t->node_count; i++)
        m->sac_node[i] = m->knot_count + i;
}

// A round sac beside the first branch of a model, linked to the branch's knot. The model owns it.
static inline void sweep_add_sac(SweepModel *m, int knot, Vec3 center, double radius)
{
    VesselTree *t = vessel_tree_create_shared(2, 0, 1);
    sweep_set_neck(t, 0, -1, m->knot[knot], m->branch[0].radius, center);
    sweep_set_sphere(t, 1, 0, 0, center, radius);
    sweep_own_sac(m, t);
    m->sac_node[0] = m->knot_node[knot];
}

// A second round sac, beside the model's sac and linked to it by a vessel's node between them: a group of its own.
static inline void sweep_add_lobe(SweepModel *m, Vec3 center, double radius)
{
    const VesselTree *old = m->sac;
    VesselTree *t = vessel_tree_create_shared(4, 0, 2);
    sweep_set_neck(t, 0, -1, old->center[0], old->radius[0], old->center[1]);
    sweep_set_sphere(t, 1, 0, 0, old->center[1], old->radius[1]);
    sweep_set_neck(t, 2, 1, vec3_mix(old->center[1], center, 0.5), 0.2 * radius, center);
    sweep_set_sphere(t, 3, 2, 1, center, radius);
    sweep_own_sac(m, t);
}

#endif

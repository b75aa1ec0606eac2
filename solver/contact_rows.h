// Internal to solver: contacts in the form used by the solvers, sorted along the chain.
//
//   d = J u = sum over its one or two nodes of w u_i + theta_i x (lever_i + w a),  a = -radius * normal
// J^T f loads a node with w f and (lever + w a) x f. Constrained degrees of freedom (`mask`, unit rows) receive no load, but their motion moves the contact.
// At a node w = 1 and the lever is 0.
//
// Slides are rows as well, in their own space: x is the displacement S, y is radius phi, and the normal is z, along which there is neither motion nor force.
// Only the tangential part of a wall contact's law remains, with the slide's bound in place of mu f_n.
//
// A pair is the row of its first end; `far` is the row of its second end, whose weights, levers and radius have the opposite sign. d and J^T f are the sums
// over both ends.
#ifndef SELDINGER_SOLVER_CONTACT_ROWS_H
#define SELDINGER_SOLVER_CONTACT_ROWS_H

#include "base/base.h"
#include "solver/block_chain.h"

#include <stdbool.h>
#include <stddef.h>
#include "solver/contact.h"

typedef struct ContactRow ContactRow;
struct ContactRow {
    int node, chain_node;        // in the chain being solved, which may be condensed (block_condense.h), and in the caller's chain
    int stride;                  // unknowns per node
    int slide;                   // 0: not a slide; otherwise index of the first of its two unknowns
    int point;                   // index in the caller's array of walls, slides or pairs
    int nodes;                   // 1, or 2 where xi > 0
    double weight[2];
    Vec3 lever[2];               // used only with two nodes
    unsigned mask[2];            // free degrees of freedom: of the first six, or of a slide's two
    bool waits;                  // excluded until the motion violates it (contact_slides.c)
    bool inert;                  // no force: the node cannot move along the normal, or the slide can neither move nor carry load
    Vec3 normal;
    double gap, radius, friction;
    double bound;                // [N] of a slide …
    double spring;               // [N/mm] … bound / give …
    Vec3 held;                   // [N] … and its force at x_n
    double stiffness_n, stiffness_t; // [N/mm] of the node alone with its neighbours fixed: scale of the residual and of the penalties
    Vec3 force;                  // [N] on the tool
    ContactRow *far;             // NULL: not a pair
};

// Fills the rows, sorted by node, then xi, with the slides of a node after its walls and the pairs last. Insertion sort, because the caller's set is nearly
// sorted. Returns the number of rows; with slides_apart the slides are not counted and follow in the caller's order. `far` holds the pairs' second ends.
int contact_rows_fill(const ContactSet *set, const BlockChain *chain, bool slides_apart, ContactRow *row, ContactRow *far);

// Sort key of rows with the same node: contacts at the node precede those between it and the next.
static inline double contact_row_place(const ContactRow *c) { return c->nodes == 1 ? -1 : c->weight[1]; }

// Minus the arm of node e's rotation: the contact's motion is w u + negative_arm x theta.
static inline Vec3 contact_row_negative_arm(const ContactRow *c, int e)
{
    SEL_ASSERT(e >= 0 && e < c->nodes, "a contact has the arms of its nodes");
    Vec3 arm = vec3_scale(c->normal, c->weight[e] * c->radius);
    return c->nodes == 1 ? arm : vec3_sub(arm, c->lever[e]);
}

static inline Vec3 contact_end_motion(const ContactRow *c, const double *u)
{
    SEL_ASSERT(c->node >= 0 && (c->nodes == 1 || c->nodes == 2), "a contact is at a node or between two");
    SEL_ASSERT(c->slide == 0 || (c->slide >= 6 && c->slide + 1 < c->stride), "the unknowns of a slide follow the first six");
    const double *v = u + (size_t)c->stride * (size_t)c->node;
    if (c->slide)
        return vec3(c->mask[0] & 1 ? v[c->slide] : 0, c->mask[0] & 2 ? c->radius * v[c->slide + 1] : 0, 0);
    if (c->nodes == 1)
        return vec3_add_scaled(vec3(v[0], v[1], v[2]), c->radius, vec3_cross(c->normal, vec3(v[3], v[4], v[5])));
    Vec3 d = {0, 0, 0};
    for (int e = 0; e < 2; e++, v += c->stride) {
        d = vec3_add_scaled(d, c->weight[e], vec3(v[0], v[1], v[2]));
        d = vec3_add(d, vec3_cross(contact_row_negative_arm(c, e), vec3(v[3], v[4], v[5])));
    }
    return d;
}

static inline Vec3 contact_row_motion(const ContactRow *c, const double *u)
{
    Vec3 d = contact_end_motion(c, u);
    return c->far ? vec3_add(d, contact_end_motion(c->far, u)) : d;
}

// y += J^T f
static inline void contact_end_push(const ContactRow *c, Vec3 f, double *y)
{
    SEL_ASSERT(c->node >= 0 && (c->nodes == 1 || c->nodes == 2), "a contact is at a node or between two");
    if (c->slide) {
        double *v = y + (size_t)c->stride * (size_t)c->node + c->slide;
        v[0] += c->mask[0] & 1 ? f.x : 0;
        v[1] += c->mask[0] & 2 ? c->radius * f.y : 0;
        return;
    }
    for (int e = 0; e < c->nodes; e++) {
        Vec3 moment = c->nodes == 1 ? vec3_scale(vec3_cross(f, c->normal), c->radius) : vec3_cross(f, contact_row_negative_arm(c, e));
        const double w = c->weight[e], g[6] = {w * f.x, w * f.y, w * f.z, moment.x, moment.y, moment.z};
        double *v = y + (size_t)c->stride * (size_t)(c->node + e);
        if (c->mask[e] == 63)
            for (int k = 0; k < 6; k++)
                v[k] += g[k];
        else
            for (int k = 0; k < 6; k++)
                v[k] += c->mask[e] >> k & 1 ? g[k] : 0;
    }
}

static inline void contact_row_push(const ContactRow *c, Vec3 f, double *y)
{
    contact_end_push(c, f, y);
    if (c->far)
        contact_end_push(c->far, f, y);
}

static inline Vec3 contact_tangential(Vec3 v, Vec3 normal) { return vec3_add_scaled(v, -vec3_dot(v, normal), normal); }

// Nearest force in the Coulomb cone at the given normal force: f_n+ n, with the tangential part limited to mu f_n+ (of a slide, to its bound).
static inline Vec3 contact_project(const ContactRow *c, Vec3 f)
{
    Vec3 normal = c->normal;
    double fn = vec3_dot(f, normal);
    if (!(fn > 0) && !c->slide)
        return (Vec3){0, 0, 0};
    Vec3 t = contact_tangential(f, normal);
    double size = vec3_norm(t), bound = c->slide ? c->bound : c->friction * fn;
    return vec3_add_scaled(vec3_scale(t, size > bound ? bound / size : 1), fn, normal);
}

// True for most candidates: no force, and none required.
static inline bool contact_row_is_idle(const ContactRow *c, Vec3 motion)
{
    return !c->slide && c->force.x == 0 && c->force.y == 0 && c->force.z == 0 && c->gap + vec3_dot(motion, c->normal) >= 0;
}

// Excess of the tangential force over its limit, relative to the normal force or to the slide's bound.
static inline double contact_row_excess(const ContactRow *c)
{
    SEL_ASSERT(!c->slide || c->bound > 0, "a loaded slide has a positive bound");
    double fn = vec3_dot(c->force, c->normal), ft = vec3_norm(contact_tangential(c->force, c->normal));
    return c->slide ? ft / c->bound - 1 : ft / fn - c->friction;
}

// Natural map in N: f minus the projection of f - slope k violation, separately in the normal and the tangential direction.
static inline Vec3 contact_error(const ContactRow *c, Vec3 f, Vec3 d, double slope)
{
    if (c->slide)
        return vec3_sub(f, contact_project(c, vec3_add_scaled(c->held, -c->spring, d)));
    Vec3 n = c->normal;
    double fn = vec3_dot(f, n), wish_n = fn - slope * c->stiffness_n * (c->gap + vec3_dot(d, n));
    Vec3 ft = contact_tangential(f, n), wish = vec3_add_scaled(ft, -slope * c->stiffness_t, contact_tangential(d, n));
    double normal = wish_n > 0 ? fn - wish_n : fn, bound = fn > 0 ? c->friction * fn : 0, size = vec3_norm(wish);
    return vec3_add_scaled(vec3_sub(ft, vec3_scale(wish, size > bound ? bound / size : 1)), normal, n);
}

#endif

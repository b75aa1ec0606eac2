// Internal to solver: contacts as the solvers use them, in the order of the chain.
//
//   d = J u = sum over its one or two nodes of w u_i + theta_i x (lever_i + w a),  a = -radius * normal
// J^T f gives a node w f and (lever + w a) x f; constrained degrees of freedom (`mask`, unit rows) get nothing, but move the contact.
// At a node w = 1 and there is no lever.
//
// Slides are rows too, in a space of their own: x is the displacement S, y is radius phi, and the normal z, along which nothing moves or presses,
// so that what is tangential for a wall is all there is. In place of mu f_n they have their bound.
//
// A pair is the row of its first end, and `far` that of its second, where weights, levers and radius have the other sign: d and J^T f are the sums of both.
#ifndef SELDINGER_SOLVER_CONTACT_ROWS_H
#define SELDINGER_SOLVER_CONTACT_ROWS_H

#include "base/base.h"
#include "solver/block_chain.h"

#include <stdbool.h>
#include <stddef.h>
#include "solver/contact.h"

typedef struct ContactRow ContactRow;
struct ContactRow {
    int node, chain_node;        // in the chain that is solved, which may be condensed (block_condense.h), and in the caller's
    int stride;                  // unknowns of a node
    int slide;                   // 0: a wall; else the first of a slide's two unknowns
    int point;                   // its place in the caller's set, among the walls, the slides or the pairs
    int nodes;                   // 1, or 2 where xi > 0
    double weight[2];
    Vec3 lever[2];               // looked at only where there are two nodes
    unsigned mask[2];            // free degrees of freedom: the first six, or a slide's two
    bool waits;                  // left out until something goes through it (contact_slides.c)
    bool inert;                  // the node cannot yield along the normal, or no slide can move or bear: no force
    Vec3 normal;
    double gap, radius, friction;
    double bound;                // [N] of a slide …
    double spring;               // [N/mm] … and bound over give …
    Vec3 held;                   // … on the force that it began with
    double stiffness_n, stiffness_t; // [N/mm] of the node alone, neighbours held: the scale of the residual and of penalties
    Vec3 force;                  // on the tool
    ContactRow *far;             // NULL: no pair
};

// Sorted by node, then xi, the slides of a node behind its walls (insertion sort: the caller's set comes nearly in order), pairs behind all others.
// Returns their number, without that of the slides where these are wanted apart: they then follow in the caller's order. `far` has room for the
// pairs' second ends.
int contact_rows_fill(const ContactSet *set, const BlockChain *chain, bool slides_apart, ContactRow *row, ContactRow *far);

// The order of rows with one node along the chain: those at the node come before those between it and the next.
static inline double contact_row_place(const ContactRow *c) { return c->nodes == 1 ? -1 : c->weight[1]; }

// Minus the arm at which node e's turn moves the contact: its motion is w u + negative_arm x theta.
static inline Vec3 contact_row_negative_arm(const ContactRow *c, int e)
{
    SEL_ASSERT(e >= 0 && e < c->nodes, "a contact has the arms of its nodes");
    Vec3 arm = vec3_scale(c->normal, c->weight[e] * c->radius);
    return c->nodes == 1 ? arm : vec3_sub(arm, c->lever[e]);
}

static inline Vec3 contact_end_motion(const ContactRow *c, const double *u)
{
    SEL_ASSERT(c->node >= 0 && (c->nodes == 1 || c->nodes == 2), "a contact is at a node or between two");
    SEL_ASSERT(c->slide == 0 || (c->slide >= 6 && c->slide + 1 < c->stride), "a slide's unknowns stand behind the first six");
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

// The nearest force in Coulomb's cone of the normal force that it has: f_n+ n, and the tangent cut to mu f_n+ (of a slide, to its bound).
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

// Most candidates: no force, and none due.
static inline bool contact_row_is_idle(const ContactRow *c, Vec3 motion)
{
    return !c->slide && c->force.x == 0 && c->force.y == 0 && c->force.z == 0 && c->gap + vec3_dot(motion, c->normal) >= 0;
}

// What the tangential force has more than it may, as a share of its normal force or of its bound.
static inline double contact_row_excess(const ContactRow *c)
{
    SEL_ASSERT(!c->slide || c->bound > 0, "a slide that bears has a bound");
    double fn = vec3_dot(c->force, c->normal), ft = vec3_norm(contact_tangential(c->force, c->normal));
    return c->slide ? ft / c->bound - 1 : ft / fn - c->friction;
}

// What is wrong with force f and motion d, in N: f less the nearest force in the cone to f - slope k violation, each direction by itself.
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

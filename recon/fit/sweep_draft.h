// The state of the swept model's fit (sweep_fit.h): curves, breaks, wall points. Internal to recon. Lengths mm.
#ifndef SELDINGER_RECON_FIT_SWEEP_DRAFT_H
#define SELDINGER_RECON_FIT_SWEEP_DRAFT_H

#include "geom/geom.h"
#include "recon/fit/sweep_options.h"

typedef struct SweepGuard {
    int branch;
    double t, rho;           // a point beside the curve at the tree's radius
    Vec3 x;
} SweepGuard;

typedef struct SweepDraft {
    const VesselTree *tree;
    const SweepFitOptions *options;
    VesselBranches *branches;
    int count;               // branches
    Vec3 **knot;             // (count) knots …
    int *knot_count;         // … and their numbers
    SweepCurve **curve;      // (count)
    double *node_t;          // (N) place of each vessel node on its branch's curve
    SweepModel *model;       // breaks and rows; made by sweep_draft_divide
    double *scale;           // (breaks) local radius of the interval that begins there
    uint8_t *is_fork;        // (breaks) whether it lies at a fork
    double *prior_radius;    // (rows) mean radius by the tree's nodes
    bool *is_hidden;         // (rows) within the parent's lumen, where no point is
    uint8_t *harmonics;      // (rows) highest harmonic that is not held at 0

    int64_t point_count, vessel_point_count;     // wall points: first those of vessel nodes, branch by branch, then those of sacs
    Vec3 *point;
    int *owner;              // (points) branch, -1: a sac
    int *node;               // (points) node
    int64_t guard_count;     // places at forks where a branch's wall is hidden in another vessel's lumen …
    SweepGuard *guard;        // … if at all: sweep_draft_guard
    double *t;               // (vessel points) [mm] foot on the branch's curve
} SweepDraft;

// Lays the curves of all branches through the smoothed and thinned centres. Returns false if out of memory.
bool sweep_draft_create(SweepDraft *draft, const VesselTree *tree, const SweepFitOptions *options);
void sweep_draft_free(SweepDraft *draft);
// Moves knots so that no bend is sharper than the vessel is wide, as far as it can be done. Returns false if out of memory.
bool sweep_draft_relax(SweepDraft *draft);
// Makes curves anew after knots have moved, and places nodes on them.
bool sweep_draft_curves(SweepDraft *draft);
// Divides the curves into intervals, `spacing` [radii] on tubes and the option's at forks, and makes an empty model.
bool sweep_draft_divide(SweepDraft *draft, double spacing);
// Radius of the tree at t, from its nodes.
double sweep_draft_radius(const SweepDraft *draft, int branch, double t);
// Lists the places for guards. Returns false if out of memory.
bool sweep_draft_guard(SweepDraft *draft);
// Feet of all points on their own branch: `t`. Returns false if out of memory.
bool sweep_draft_project(SweepDraft *draft);
// Value of a term of a branch at t.
double sweep_draft_term(const SweepDraft *draft, int branch, int term, double t);

#endif

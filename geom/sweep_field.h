// The swept model (sweep_model.h) made ready for evaluation: branches cut into segments on which curve, frame and section are cubic polynomials, each with the
// list of the branches that can be seen there; and the plain evaluation of single branches and of the blended field, with exact first and second derivatives.
// The lanes of sweep_lanes.h compute the same faster.
//
// Borrows the model, whose rows, knots and breaks must not change. Immutable after creation, may be shared by threads. Lengths mm.
#ifndef SELDINGER_GEOM_SWEEP_FIELD_H
#define SELDINGER_GEOM_SWEEP_FIELD_H

#include "geom/sweep_curve.h"
#include "geom/sweep_model.h"
#include "geom/sweep_part.h"

// A branch that is seen from a segment of another: its t near a place t' of the segment is about t + slope t', t' limited to 0 ... length of its own branch.
typedef struct SweepCandidate {
    int branch, segment;     // segment: the branch's that holds t near the middle of the place's
    double t, slope;
} SweepCandidate;

// What is seen from a segment: branches in ascending order, among them its own (t = 0, slope = 1), and a node of the sacs' tree, -1: none.
typedef struct SweepView {
    int count;
    int sac;
    SweepCandidate of[SWEEP_CANDIDATES];
} SweepView;

// Where two branches still overlap far from their fork, delta does not fall below this part of its value at the fork.
#define SWEEP_LEAST_BLEND 0.2
typedef struct SweepFork {   // delta of a branch with those before it
    double delta;            // [mm] at t = 0
    double reach;            // [mm] t beyond which delta is least
} SweepFork;

// The group of blobs of one sac, by node of the sacs' tree.
typedef struct SweepSac {
    double scale;            // f = scale (sum a u^3 - 1) [mm]
    double delta;            // [mm]
    SweepView view;          // branches seen from the node
} SweepSac;

typedef struct SweepField {
    const SweepModel *model;
    int branch_count;        // as in the model
    SweepCurve **curve;      // (branches)
    int *first_segment;      // (branches + 1)
    SweepSegment *segment;   // by branch and t
    SweepView *view;         // (segments)
    SweepFork *fork;         // (branches)
    SweepSac *sac;           // (nodes of model->sac)
    int *sac_group;          // (nodes of model->sac) the first node of the node's sac
    double *level_from, *level_to;       // (branches) [mm] h before the start and beyond the end
    int crowded;             // views that lack candidates because there are too many
} SweepField;

// Returns NULL if out of memory. The model is valid (sweep_model_validate).
SweepField *sweep_field_create(const SweepModel *model);
void sweep_field_free(SweepField *field);
// Index of the branch's segment that holds t.
int sweep_field_segment(const SweepField *field, int branch, double t);

// [mm] upper bound of the section's R at t on a branch.
double sweep_field_largest(const SweepField *field, int branch, double t);
// [mm] mean radius of the section at t, c_0.
double sweep_field_mean(const SweepField *field, int branch, double t);

// Where on the model a wall point is sought: it determines the candidates and where Newton for their t starts.
typedef struct SweepPlace {
    int branch;              // -1: on a sac
    double t;                // on the branch [mm], near the point's own
    int sac;                 // on a sac: a node of model->sac near the point
} SweepPlace;

typedef struct SweepBlend {
    int count, largest;      // parts, and the one of largest share
    SweepPart part[SWEEP_CANDIDATES + 1];
    double f;                // F [mm]
    Vec3 gradient;
    Sym3 hessian;
} SweepBlend;

// One branch alone at x; Newton for t starts from `start`.
void sweep_field_branch(const SweepField *field, int branch, Vec3 x, double start, SweepPart *part);
// The same at a known t, which the segment holds; leaves `branch`, `share` and `sac` unset.
void sweep_branch_evaluate(const SweepField *field, int branch, const SweepSegment *segment, Vec3 x, double t, SweepPart *part);
// The same of the rows alone, without sections of another kind.
void sweep_segment_evaluate(const SweepSegment *segment, Vec3 x, double t, SweepPart *part);
// A sac alone at x, from a node near x.
void sweep_field_sac(const SweepField *field, int node, Vec3 x, SweepPart *part);
// The blended field at x, as seen from a place.
void sweep_field_blend(const SweepField *field, SweepPlace place, Vec3 x, SweepBlend *blend);

// The rows that determine the section at t, and the weights: c_k(t) = sum_j weight[j] row[first + j][k], slope[j] = d weight[j]/dt. Holds beyond the ends, too.
typedef struct SweepBasis {
    int first;
    double weight[4], slope[4];
} SweepBasis;
SweepBasis sweep_field_basis(const SweepField *field, int branch, double t);
// The factors of a row's terms at a part's angle: R = sum_k term[k] c_k: 1, rho'^1 cos theta, rho'^1 sin theta, ..., with rho' = |(n, b)| / |(n, b, w)|. So
// dF/d row[first + j][k] = share weight[j] term[k].
void sweep_part_terms(const SweepPart *part, double term[SWEEP_TERMS]);

#endif

// The corotational beam element: large rotation, small strain, Timoshenko shear, circular section, rest curvature.
// Equations in beam_equations.h. Lengths mm, forces N, moments N mm, energies mJ.
//
// Arrays are one per quantity (lanes are elements, so that loops over elements vectorise); the caller owns all of them.
// Nothing here allocates. Kernels give the same bits on every instruction set (no contraction, one order per lane).
#ifndef SELDINGER_SOLVER_BEAM_H
#define SELDINGER_SOLVER_BEAM_H

#include "geom/geom.h"
#include "solver/block_chain.h"

typedef struct BeamRest {    // what an element is when nothing acts on it, (E) each
    int count;               // E
    double *length;          // [mm] L, along the arc
    double *extend;          // [mm] what chord + bow must be for no axial force: L less the arc's fourth-order rest
    double *axial;           // [N/mm] EA / L
    double *near;            // [N mm] c: moment at a node per rotation of the same node
    double *far;             // [N mm] d: per rotation of the other one
    double *twist;           // [N mm] GJ / L
    double *half_w, *half_y, *half_z;   // rotation from node 1's frame to the rest chord, as a quaternion (w, 0, y, z); node 2 has its conjugate
    double *curvature;       // [1/mm] at rest, >= 0 after its sign has gone into the plane
    double *bending;         // [N mm2] EI
    double *shear;           // [N] kappa G A
} BeamRest;

typedef struct BeamPose {    // nodes, (M) each
    double *x, *y, *z, *qw, *qx, *qy, *qz;
} BeamPose;

typedef struct BeamInertia { // nodes, (M) each
    double *mass, *lateral, *excess;     // [g], [g mm2] about a diameter, and what the inertia about the axis is more than that
    double *ax, *ay, *az, *tx, *ty, *tz; // [mm/ms2], [rad/ms2] a: the right-hand side gets M a
} BeamInertia;
enum { BEAM_REST_ARRAYS = 12, BEAM_POSE_ARRAYS = 7, BEAM_INERTIA_ARRAYS = 9 };

// One element, for the sheath and for tests.
typedef struct BeamInput {
    Vec3 x1, x2;
    Quat q1, q2;
    double length, extend, axial, near, far, twist;
    double half_w, half_y, half_z;
} BeamInput;
typedef struct BeamOutput {
    Vec3 chord, tangent1, tangent2, stretch, bow1, bow2, axis;     // as in BeamStrain
    Vec3 force2, moment1, moment2;   // gradients
    double inverse, tension, torque, energy;   // 1 / length of the chord; [N], [N mm], [mJ]
    double bow;                      // [mm] arc length less chord, by the cubic shape
    Vec3 angle1, angle2;             // [rad] bending angles against the rest chord
    Vec3 turn1, turn2;               // [rad] from the chord to the nodes' tangents
    Vec3 own1, own2;                 // the nodes' tangents
    double spin1, spin2;             // [N mm] >= 0 stiffness of a spin about them: where a rest curvature is held bent the other way
    Vec3 chord1, chord2;             // [N mm] the part of moment1 and moment2 that comes through the rest chord (bending, torsion)
} BeamOutput;
void beam_element(const BeamInput *in, BeamOutput *out);

// The tangent's 6x6 blocks of one element (row-major): main stiffness times `scale` plus the positive part of the geometric one.
typedef struct BeamTangent {
    double k11[36], k21[36], k22[36];
} BeamTangent;
void beam_tangent(const BeamInput *in, const BeamOutput *out, double scale, BeamTangent *tangent);

// A chain: element i joins nodes i and i+1. Kernels read up to BEAM_PADDING entries past the last one of each array (any numbers will do).
enum { BEAM_PADDING = 8 };
typedef struct BeamChain {
    BeamRest rest;
    BeamPose pose;
    BeamInertia inertia;
    double slides;           // [mm] by which the chain is expected to slide along itself: its forces are those of the elements turned so
    double *drag;            // (E) [N] viscous tension, which stiffens like the elastic one: 0, or what beam_chain_damp() left
} BeamChain;

// Elements first to last-1 with the nodes first to last, into `chain` and b (M, 6): the lower blocks of the elements, the diagonal blocks and the
// right-hand side of the nodes, written, not added to (so what joins node `first` from before comes afterwards).
//   block = scale K_main + positive part of the geometric stiffness + rate M,   b = M a - gradient of the energy
// The gradient is turned with each chord by `slides`, but for a tension, which the geometric stiffness turns.
void beam_chain_assemble(const BeamChain *beam, int first, int last, double scale, double rate, BlockChain *chain, double *b);

// For an iterate, before its assembly: drag, and in b (M, 6), written for the nodes first to last, the forces of stiffness damping between the poses
// `start` and the chain's: -rate J' C (strain - strain at the start). An element's rigid motion is taken off, so that a turn of any size is not damped.
void beam_chain_damp(const BeamChain *beam, const BeamPose *start, int first, int last, double rate, double *b);

// c and d of a beam of this length: moments per rotation of the near and of the far end.
void beam_bending(double length, double bending, double shear, double *near, double *far);
// Their derivatives with length.
void beam_bending_slope(double length, double bending, double shear, double *near, double *far);
// L less chord and bow of a rest arc: its fourth-order rest, [mm], and the derivative with length.
double beam_arc_rest(double length, double curvature, double *slope);

#endif

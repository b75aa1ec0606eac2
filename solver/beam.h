// Corotational beam element: large rotation, small strain, Timoshenko shear, circular section, rest curvature.
// beam_equations.h derives the equations. Lengths in mm, forces in N, moments in N mm, energies in mJ.
//
// Each quantity has its own array, so that loops over the elements vectorise; the caller owns all arrays. Nothing here allocates.
// The kernels give identical bits on every instruction set (no contraction, one order of operations per lane).
#ifndef SELDINGER_SOLVER_BEAM_H
#define SELDINGER_SOLVER_BEAM_H

#include "geom/geom.h"
#include "solver/block_chain.h"

typedef struct BeamRest {    // the unloaded elements; every array has E entries
    int count;               // E, number of elements
    double *length;          // [mm] L, arc length
    double *extend;          // [mm] chord + bow at zero axial force: L minus the fourth-order remainder of the arc
    double *axial;           // [N/mm] EA / L
    double *near;            // [N mm] c: moment at a node per rotation of the same node
    double *far;             // [N mm] d: moment at a node per rotation of the other node
    double *twist;           // [N mm] GJ / L
    double *half_w, *half_y, *half_z;   // rotation from the frame of node 1 to the rest chord, quaternion (w, 0, y, z); node 2 has its conjugate
    double *curvature;       // [1/mm] at rest, >= 0: the sign is in the plane of curvature
    double *bending;         // [N mm2] EI
    double *shear;           // [N] kappa G A
} BeamRest;

typedef struct BeamPose {    // nodes; every array has M entries
    double *x, *y, *z, *qw, *qx, *qy, *qz;
} BeamPose;

typedef struct BeamInertia { // nodes; every array has M entries
    double *mass, *lateral, *excess;     // [g], [g mm2] about a diameter, [g mm2] axial minus lateral inertia
    double *ax, *ay, *az, *tx, *ty, *tz; // [mm/ms2], [rad/ms2] a: the term M a of the right-hand side
} BeamInertia;
enum { BEAM_REST_ARRAYS = 12, BEAM_POSE_ARRAYS = 7, BEAM_INERTIA_ARRAYS = 9 };

// A single element, for the sheath and for tests.
typedef struct BeamInput {
    Vec3 x1, x2;
    Quat q1, q2;
    double length, extend, axial, near, far, twist;
    double half_w, half_y, half_z;
} BeamInput;
typedef struct BeamOutput {
    Vec3 chord, tangent1, tangent2, stretch, bow1, bow2, axis;     // unit chord; rest chord direction at each node; derivatives of extension, bow and twist
                                                                   // (beam_equations.h)
    Vec3 force2, moment1, moment2;   // gradients of the energy
    double inverse, tension, torque, energy;   // 1 / chord length [1/mm]; [N], [N mm], [mJ]
    double bow;                      // [mm] arc length minus chord length, cubic shape function
    Vec3 angle1, angle2;             // [rad] bending angles relative to the rest chord
    Vec3 turn1, turn2;               // [rad] angles from the chord to the nodes' tangents
    Vec3 own1, own2;                 // tangents of the nodes
    double spin1, spin2;             // [N mm] >= 0, stiffness against a spin about own1, own2: nonzero where a rest curvature is held bent the other way
    Vec3 chord1, chord2;             // [N mm] the part of moment1 and moment2 that acts through the rest chord (bending and torsion)
} BeamOutput;
void beam_element(const BeamInput *in, BeamOutput *out);

// Tangent stiffness of one element as row-major 6x6 blocks: `scale` times the main stiffness plus the positive part of the geometric stiffness.
typedef struct BeamTangent {
    double k11[36], k21[36], k22[36];
} BeamTangent;
void beam_tangent(const BeamInput *in, const BeamOutput *out, double scale, BeamTangent *tangent);

// A chain: element i joins nodes i and i+1. The kernels read up to BEAM_PADDING entries past the last one of each array; their values do not matter.
enum { BEAM_PADDING = 8 };
typedef struct BeamChain {
    BeamRest rest;
    BeamPose pose;
    BeamInertia inertia;
    double slides;           // [mm] expected motion of the chain along itself in the step: element forces are rotated accordingly
    double *drag;            // (E) [N] viscous tension, which contributes geometric stiffness like the elastic tension; 0 or set by beam_chain_damp()
} BeamChain;

// Assembles elements first to last-1 with nodes first to last into `chain` and b (M, 6). The elements' lower blocks and the nodes' diagonal blocks and
// right-hand sides are overwritten, not accumulated: add everything else that couples to node `first` afterwards.
//   block = scale K_main + positive part of the geometric stiffness + rate M,   b = M a - gradient of the energy
// The gradient is rotated with each chord by `slides`, except for the part of a tension, which the geometric stiffness rotates.
void beam_chain_assemble(const BeamChain *beam, int first, int last, double scale, double rate, BlockChain *chain, double *b);

// To be called for an iterate before its assembly. Sets drag and writes to b (M, 6), for nodes first to last, the forces of stiffness-proportional damping
// between the pose `start` and the chain's pose: -rate J' C (strain - strain at the start). The rigid-body motion of an element is removed first, so that
// a rotation of any size causes no damping.
void beam_chain_damp(const BeamChain *beam, const BeamPose *start, int first, int last, double rate, double *b);

// Elastic energy [mJ] of elements first to last-1 at the chain's pose, added up in their order.
double beam_chain_energy(const BeamChain *beam, int first, int last);

// c and d of a beam of this length: moment per rotation of the near end and of the far end.
void beam_bending(double length, double bending, double shear, double *near, double *far);
// Derivatives of c and d with respect to length.
void beam_bending_slope(double length, double bending, double shear, double *near, double *far);
// L minus chord minus bow of a rest arc, a fourth-order remainder [mm], and its derivative with respect to length.
double beam_arc_rest(double length, double curvature, double *slope);

#endif

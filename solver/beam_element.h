// The corotational beam element: large rotation, small strain, Timoshenko shear, circular section, rest curvature.
// DESIGN section 3; equations at the head of beam_element.c. Lengths mm, forces N, moments N mm, energies mJ.
//
// Arrays are one per quantity (lanes are elements, so that the loop over elements vectorises); the caller owns all of them.
// Nothing here allocates. A kernel gives the same bits on every instruction set (no contraction, one order per lane).
#ifndef SELDINGER_SOLVER_BEAM_ELEMENT_H
#define SELDINGER_SOLVER_BEAM_ELEMENT_H

#include "geom/linear.h"
#include "solver/block_chain.h"

// Kernels are compiled once per instruction set and picked at start-up; sanitizers cannot run before the resolver does.
#if defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__x86_64__)
#define BEAM_KERNEL __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define BEAM_KERNEL
#endif

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

// What the energy's first derivative gives, and what the tangent is made of, (E) each. Gradients: the force on a node is minus these.
typedef struct BeamVectors {         // three arrays
    double *x, *y, *z;
} BeamVectors;
typedef struct BeamStrain {
    BeamVectors chord;               // unit
    BeamVectors tangent1, tangent2;  // unit: where the nodes' frames see the rest chord
    BeamVectors stretch;             // derivative of the extension with the position of node 2 …
    BeamVectors bow1, bow2;          // [mm] … and with the rotations of the nodes
    BeamVectors axis;                // derivative of the twist with the rotation of node 2; with that of node 1 the opposite
    BeamVectors force2;              // [N] gradient for the position of node 2; that of node 1 is the opposite
    BeamVectors moment1, moment2;    // [N mm] gradient for rotations about the space axes
    double *inverse;                 // [1/mm] of the chord's length
    double *tension;                 // [N]
    double *energy;                  // [mJ]
} BeamStrain;
enum { BEAM_REST_ARRAYS = 12, BEAM_POSE_ARRAYS = 7, BEAM_STRAIN_VECTORS = 10, BEAM_STRAIN_ARRAYS = 33 };

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
    double inverse, tension, energy;
    double bow;                      // [mm] arc length less chord, by the cubic shape
    Vec3 angle1, angle2;             // [rad] bending angles against the rest chord
    Vec3 turn1, turn2;               // [rad] from the chord to the nodes' tangents
    Vec3 chord1, chord2;             // [N mm] the part of moment1 and moment2 that comes through the rest chord (bending, torsion)
} BeamOutput;
void beam_element(const BeamInput *in, BeamOutput *out);

// Elements first to last-1 of a chain; element i joins nodes i and i+1.
void beam_chain_strain(const BeamRest *rest, const BeamPose *pose, int first, int last, const BeamStrain *strain);

// The tangent's 6x6 blocks of one element (row-major): main stiffness times `scale` plus the positive part of the geometric one.
typedef struct BeamTangent {
    double k11[36], k21[36], k22[36];
} BeamTangent;
void beam_tangent(const BeamInput *in, const BeamOutput *out, double scale, BeamTangent *tangent);
// Writes the blocks of elements first to last-1 into the chain: lower ones, and the diagonal ones of nodes first to last, of which the first
// is added to.
void beam_chain_tangent(const BeamRest *rest, const BeamStrain *strain, int first, int last, double scale, BlockChain *chain);

// c and d of a beam of this length: moments per rotation of the near and of the far end.
void beam_bending(double length, double bending, double shear, double *near, double *far);
// Their derivatives with length.
void beam_bending_slope(double length, double bending, double shear, double *near, double *far);
// L less chord and bow of a rest arc: its fourth-order rest, [mm], and the derivative with length.
double beam_arc_rest(double length, double curvature, double *slope);

#endif

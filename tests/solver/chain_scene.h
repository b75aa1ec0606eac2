// A small wire in an exact tube, independent of solver/wire.c and the step. It generates the contact problems on which the two forms of contact_solve are
// compared. Linear strain elements about the present chords, matrices as B^T C B, no velocities.
#ifndef SELDINGER_TESTS_CHAIN_SCENE_H
#define SELDINGER_TESTS_CHAIN_SCENE_H

#include "geom/vessel.h"
#include "solver/block_chain.h"
#include "solver/contact.h"
#include "solver/contact_solve.h"

typedef struct ChainSceneOptions {
    int elements;
    double element_length;   // [mm]
    double young_modulus;    // [MPa]
    double poisson_ratio;
    double diameter;         // [mm]
    double density;          // [g/mm3]
    double inserted;         // [mm] beyond x = 0, where the sheath ends
    double friction;
    double tip_curvature;    // [1/mm] rest curvature of the last 15 mm
    double reach;            // [mm] candidates are nodes with a gap below this
    const Vessel *vessel;    // entered along +x at the origin
} ChainSceneOptions;

typedef struct ChainScene {
    ChainSceneOptions options;
    int nodes;
    Vec3 *position, *velocity, *spin, *force;
    Quat *orientation;
    VesselMemory *memory;
    VesselHit *hit;
    BlockChain chain;
    BlockFactor *factor;
    double *b, *u;
    ContactSet set;
    int *candidate_of;       // (set.count) node
    ContactSolver *solver;
    double penetration;      // [mm] at the start of the last step
} ChainScene;

ChainSceneOptions chain_scene_default_options(void);
void chain_scene_create(ChainScene *scene, const ChainSceneOptions *options);
void chain_scene_destroy(ChainScene *scene);
// Detects, assembles and factors: writes the problem to chain, factor, b, set.
void chain_scene_prepare(ChainScene *scene, double advance, double twist);
// Applies u and the set's forces as the result of the step.
void chain_scene_finish(ChainScene *scene);
// The paper's spiral in space: a straight lead, then arcs with decreasing radius and rotating plane.
Vessel *chain_scene_spiral(double radius, bool in_space);
Vessel *chain_scene_straight(double radius);
// A closed capsule of 10 mm, entered beside its axis: the wire coils up in it.
Vessel *chain_scene_capsule(double radius);

#endif

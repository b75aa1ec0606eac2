// Coaxial elements (coaxial.h) of straight tools, eight at a time: most of a chain. An element is one of them where no tool has a rest curvature, a border of
// its sections or its tip inside, and the carrier is fixed. Then there is one piece, all tools' angles act by torsion alone, and S1 acts as minus S2.
// Same results as coaxial_element() and coaxial_tangent() to rounding; the same bits on every instruction set.
#ifndef SELDINGER_SOLVER_COAXIAL_LANES_H
#define SELDINGER_SOLVER_COAXIAL_LANES_H

#include "solver/coaxial.h"

enum { COAXIAL_LANES = 8, COAXIAL_INNER_MAX = COAXIAL_TOOLS_MAX - 1, COAXIAL_CROSS = 12 };

// Rows are quantities, columns elements. Of inner tool i (in the element, after the carrier), S and phi are those at node 2: with those at node 1 the
// entries of the tangent have the other sign, with both the same one.
typedef struct CoaxialTile {
    int count;                                                 // tools of each element
    int lanes;                                                 // elements in it
    // given
    _Alignas(64) double x1[3][COAXIAL_LANES];
    double x2[3][COAXIAL_LANES], q1[4][COAXIAL_LANES], q2[4][COAXIAL_LANES];
    double length[COAXIAL_TOOLS_MAX][COAXIAL_LANES], turn[COAXIAL_TOOLS_MAX][COAXIAL_LANES];     // [mm] own, [rad] phi2 - phi1
    double bending[COAXIAL_TOOLS_MAX][COAXIAL_LANES], axial[COAXIAL_TOOLS_MAX][COAXIAL_LANES], torsion[COAXIAL_TOOLS_MAX][COAXIAL_LANES],
        shear[COAXIAL_TOOLS_MAX][COAXIAL_LANES];               // of the sections
    double spread[COAXIAL_TOOLS_MAX][COAXIAL_LANES];           // [mm]
    // found
    double k11[21][COAXIAL_LANES], k21[36][COAXIAL_LANES], k22[21][COAXIAL_LANES];     // the nodes' tangent: symmetric blocks by the rows of their lower triangle
    double force[12][COAXIAL_LANES];                           // gradient with the nodes' unknowns
    double by_slide[COAXIAL_INNER_MAX][COAXIAL_CROSS][COAXIAL_LANES];     // tangent: nodes' unknowns with S …
    double by_turn[COAXIAL_INNER_MAX][3][COAXIAL_LANES];       // … and rotation 2 with phi (rotation 1: the opposite)
    double slide_slide[COAXIAL_INNER_MAX][COAXIAL_INNER_MAX][COAXIAL_LANES], slide_turn[COAXIAL_INNER_MAX][COAXIAL_LANES],
        turn_turn[COAXIAL_INNER_MAX][COAXIAL_LANES];
    double slide_force[COAXIAL_INNER_MAX][COAXIAL_LANES], turn_force[COAXIAL_INNER_MAX][COAXIAL_LANES];      // gradient with S and phi
    double bent[COAXIAL_LANES];                                // [1/mm] curvature at the middle
    double moment[COAXIAL_TOOLS_MAX][3][COAXIAL_LANES], tension[COAXIAL_TOOLS_MAX][COAXIAL_LANES];   // [N mm], [N] there of tool i and all inside it
} CoaxialTile;

// Takes the element into the tile's next lane; false where it is none of these. Those of one tile have as many tools.
bool coaxial_tile_take(CoaxialTile *tile, const CoaxialInput *in);
// Main stiffness times `scale`, as coaxial_tangent().
void coaxial_tile_find(CoaxialTile *tile, double scale);

#endif

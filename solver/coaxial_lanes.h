// Coaxial elements (coaxial.h) of straight tools, eight at a time: the majority of a chain. An element qualifies if no tool has a rest curvature, a section
// border or its tip inside it, and the carrier is fixed. It then has a single piece, the tools' angles act by torsion alone, and S1 acts as minus S2.
// Results equal those of coaxial_element() and coaxial_tangent() to rounding and have identical bits on every instruction set.
#ifndef SELDINGER_SOLVER_COAXIAL_LANES_H
#define SELDINGER_SOLVER_COAXIAL_LANES_H

#include "solver/coaxial.h"

enum { COAXIAL_LANES = 8, COAXIAL_INNER_MAX = COAXIAL_TOOLS_MAX - 1, COAXIAL_CROSS = 12 };

// Rows are quantities, columns are elements. S and phi of inner tool i (counted after the carrier) are those at node 2: the tangent entries with one
// unknown at node 1 have the opposite sign, those with both at node 1 the same sign.
typedef struct CoaxialTile {
    int count;                                                 // tools in each element
    int lanes;                                                 // elements in the tile
    // input
    _Alignas(64) double x1[3][COAXIAL_LANES];
    double x2[3][COAXIAL_LANES], q1[4][COAXIAL_LANES], q2[4][COAXIAL_LANES];
    double length[COAXIAL_TOOLS_MAX][COAXIAL_LANES], turn[COAXIAL_TOOLS_MAX][COAXIAL_LANES];     // [mm] length of each tool, [rad] phi2 - phi1
    double bending[COAXIAL_TOOLS_MAX][COAXIAL_LANES], axial[COAXIAL_TOOLS_MAX][COAXIAL_LANES], torsion[COAXIAL_TOOLS_MAX][COAXIAL_LANES],
        shear[COAXIAL_TOOLS_MAX][COAXIAL_LANES];               // section properties
    double spread[COAXIAL_TOOLS_MAX][COAXIAL_LANES];           // [mm]
    // results
    double k11[21][COAXIAL_LANES], k21[36][COAXIAL_LANES], k22[21][COAXIAL_LANES];     // tangent of the nodes: symmetric blocks as rows of their lower
                                                                                       // triangles
    double force[12][COAXIAL_LANES];                           // gradient with respect to the nodes' unknowns
    double by_slide[COAXIAL_INNER_MAX][COAXIAL_CROSS][COAXIAL_LANES];     // tangent: nodes' unknowns with S
    double by_turn[COAXIAL_INNER_MAX][3][COAXIAL_LANES];       // tangent: rotation of node 2 with phi (node 1: opposite sign)
    double slide_slide[COAXIAL_INNER_MAX][COAXIAL_INNER_MAX][COAXIAL_LANES], slide_turn[COAXIAL_INNER_MAX][COAXIAL_LANES],
        turn_turn[COAXIAL_INNER_MAX][COAXIAL_LANES];
    double slide_force[COAXIAL_INNER_MAX][COAXIAL_LANES], turn_force[COAXIAL_INNER_MAX][COAXIAL_LANES];      // gradient with respect to S and phi
    double bent[COAXIAL_LANES];                                // [1/mm] curvature at the middle
    double moment[COAXIAL_TOOLS_MAX][3][COAXIAL_LANES], tension[COAXIAL_TOOLS_MAX][COAXIAL_LANES];   // [N mm], [N] at the middle, of tool i and all tools
                                                                                                     // inside it
} CoaxialTile;

// Adds the element to the next lane of the tile. Returns false if the element does not qualify. All elements of a tile have the same number of tools.
bool coaxial_tile_take(CoaxialTile *tile, const CoaxialInput *in);
// Computes the results with the main stiffness times `scale`, as coaxial_tangent().
void coaxial_tile_find(CoaxialTile *tile, double scale);

#endif

// The 256 cases of marching cubes, derived by the program instead of listed by hand.
//
// Corner c sits at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge axis * 4 + (u | v << 1) runs along `axis` at (u, v) on the next two axes (cyclic). On each face, one
// segment cuts off each run of inside corners, whatever the rest of the cube: the two cubes at a face agree, so the surface is closed. The segments form loops.
// A loop is triangulated without a diagonal between two edges of one face, because such a diagonal could coincide with the neighbour's segment; so no edge has
// more than two triangles.
#ifndef SELDINGER_GEOM_CUBE_TRIANGLES_H
#define SELDINGER_GEOM_CUBE_TRIANGLES_H

enum { CUBE_TRIANGLES_MAX = 10 };

typedef struct CubeCase {
    int count;
    int edge[CUBE_TRIANGLES_MAX][3];   // counter-clockwise seen from outside (the side of the corners that are not in the case's mask)
} CubeCase;

typedef struct CubeTable {
    CubeCase of[256];                  // index: bit c is set if corner c is inside
    int flat_diagonals;                // number of diagonals that lie in a face; expected 0
} CubeTable;

void cube_table_fill(CubeTable *table);
// The two corners of an edge, the lower one first.
static inline int cube_edge_start(int edge)
{
    int axis = edge / 4, u = edge & 1, v = edge >> 1 & 1;
    return u << (axis + 1) % 3 | v << (axis + 2) % 3;
}
static inline int cube_edge_end(int edge) { return cube_edge_start(edge) | 1 << edge / 4; }

#endif

// The 256 cases of marching cubes, derived instead of typed in.
//
// Corner c sits at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge axis * 4 + (u | v << 1) runs along `axis` at (u, v) on the two axes after it (cyclic).
// On each face every run of inside corners is cut off by its own segment, whatever the rest of the cube: both cubes at a face agree, so the surface
// is closed. The segments form loops; a loop is cut into triangles without a diagonal between two edges of one face, which could coincide with the
// neighbour's segment there: so no edge has more than two triangles.
#ifndef SELDINGER_GEOM_CUBE_TRIANGLES_H
#define SELDINGER_GEOM_CUBE_TRIANGLES_H

enum { CUBE_TRIANGLES_MAX = 10 };

typedef struct CubeCase {
    int count;
    int edge[CUBE_TRIANGLES_MAX][3];   // counter-clockwise seen from outside (the side of corners that are not in the case's mask)
} CubeCase;

typedef struct CubeTable {
    CubeCase of[256];                  // index: bit c set where corner c is inside
    int flat_diagonals;                // diagonals in a face that could not be avoided: 0
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

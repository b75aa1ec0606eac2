// Marching cubes over a sparse lattice (cube_triangles.h): the part that does not depend on the surface that is meshed. Used inside geom only.
//
// The lattice point (i, j, k) lies at cell * (i, j, k), for every surface. Points belong to cubic blocks of 8 cells; there are blocks only within reach of one
// of a set of balls. The caller fills a block's values (> 0 inside, NaN: unknown) and calls march_block; cells with an unknown corner give no triangles.
// Neighbouring blocks must get the same values at the points they share.
#ifndef SELDINGER_GEOM_SPARSE_MARCH_H
#define SELDINGER_GEOM_SPARSE_MARCH_H

#include "geom/cube_triangles.h"
#include "geom/isosurface.h"
#include "geom/key_map.h"

enum {
    MARCH_BLOCK = 8,                         // cells per side
    MARCH_SIDE = MARCH_BLOCK + 1,            // lattice points per side
    MARCH_POINTS = MARCH_SIDE * MARCH_SIDE * MARCH_SIDE,
};

typedef struct MarchBlock {
    int base[3];             // lattice point of its lowest corner
    int first, latest;       // its balls: first and last link, in the order of the balls
    bool is_marched;
} MarchBlock;

typedef struct MarchLink {   // balls of a block
    int ball, next;          // next: -1 at the end
} MarchLink;

typedef struct March March;
struct March {
    double cell;
    KeyMap block_of, vertex_of;
    int block_count, block_capacity;
    MarchBlock *block;
    int link_count, link_capacity;
    MarchLink *link;
    TriangleMesh *mesh;
    int vertex_capacity, triangle_capacity;
    CubeTable table;
    double least_share;      // vertices stay at least this fraction of a cell away from lattice points, which several edges share
    double value[MARCH_POINTS];              // of the current block, see march_index
    int owner[MARCH_POINTS];                 // set by the caller, passed to `place`
    // Called by march_block: fills the vertex for a crossing at p; `owner` is that of the inside end of its edge.
    void (*place)(March *march, const MarchBlock *block, Vec3 p, int owner, Vec3 *vertex, Vec3 *normal, int *node);
};

static inline int march_index(int i, int j, int k) { return (i * MARCH_SIDE + j) * MARCH_SIDE + k; }
static inline Vec3 march_point(const March *march, const MarchBlock *b, int i, int j, int k)
{
    return vec3((b->base[0] + i) * march->cell, (b->base[1] + j) * march->cell, (b->base[2] + k) * march->cell);
}
// Centre and radius of the ball around a block.
Vec3 march_block_ball(const March *march, const MarchBlock *b, double *radius);

// Initialises a zeroed March. Returns false if out of memory.
bool march_begin(March *march, double cell, double least_share);
// Adds all blocks that hold a lattice point of the ball `index`, or a neighbour of one. Returns false if out of memory or if there would be more than 2e7
// blocks.
bool march_add_ball(March *march, int index, Vec3 center, double reach);
// Index of the block `steps` blocks away; -1 if there is none.
int march_block_beside(const March *march, const MarchBlock *b, const int steps[3]);
// A lattice point's key, below 2^60.
uint64_t march_key(int i, int j, int k);
// Makes room for one more vertex in the mesh's arrays. Returns false if out of memory. march_add_triangle adds a triangle, with the same result.
bool march_reserve(March *march);
bool march_add_triangle(March *march, const int corner[3]);
// Adds the triangles of the current block. Returns false if out of memory.
bool march_block(March *march, MarchBlock *b);
// Sets the normal of each vertex that has none (0) from its triangles, weighted by area. Returns false if out of memory.
bool march_repair_normals(TriangleMesh *mesh);
// Frees everything that the march owns except the mesh.
void march_end(March *march);

#endif

// Marching cubes over a sparse lattice (cube_triangles.h), the part that does not depend on what is meshed. Inside geom only.
//
// The lattice point (i, j, k) lies at cell * (i, j, k), for every surface the same. Points belong to cubic blocks of 8 cells; there are blocks only where
// one of a set of balls reaches. The caller fills a block's values (> 0 inside, NaN not known) and has it marched; cells with a corner that is not
// known give no triangles. Neighbouring blocks must get the same values at the points they share.
#ifndef SELDINGER_GEOM_SPARSE_MARCH_H
#define SELDINGER_GEOM_SPARSE_MARCH_H

#include "geom/cube_triangles.h"
#include "geom/isosurface.h"
#include "geom/key_map.h"

enum {
    MARCH_BLOCK = 8,                         // cells a side
    MARCH_SIDE = MARCH_BLOCK + 1,            // lattice points a side
    MARCH_POINTS = MARCH_SIDE * MARCH_SIDE * MARCH_SIDE,
};

typedef struct MarchBlock {
    int base[3];             // lattice point of its lowest corner
    int first, latest;       // its balls: first and last link, first in the order of balls
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
    double least_share;      // vertices stay this share of a cell away from lattice points, which other edges share
    double value[MARCH_POINTS];              // of the block at hand, see march_index
    int owner[MARCH_POINTS];                 // the caller's, handed back to `place`
    // Of march_block: fills the vertex for a crossing at p; `owner` is that of the inside end of its edge.
    void (*place)(March *march, const MarchBlock *block, Vec3 p, int owner, Vec3 *vertex, Vec3 *normal, int *node);
};

static inline int march_index(int i, int j, int k) { return (i * MARCH_SIDE + j) * MARCH_SIDE + k; }
static inline Vec3 march_point(const March *march, const MarchBlock *b, int i, int j, int k)
{
    return vec3((b->base[0] + i) * march->cell, (b->base[1] + j) * march->cell, (b->base[2] + k) * march->cell);
}
// Middle and radius of the ball around a block.
Vec3 march_block_ball(const March *march, const MarchBlock *b, double *radius);

// Sets up an otherwise zeroed March. False where memory lacks.
bool march_begin(March *march, double cell, double least_share);
// All blocks that hold a lattice point of the ball `index`, or a neighbour of one. False where memory lacks or there would be more than 2e7.
bool march_add_ball(March *march, int index, Vec3 center, double reach);
// The block `steps` away, -1 where there is none.
int march_block_beside(const March *march, const MarchBlock *b, const int steps[3]);
// A lattice point's key, below 2^60.
uint64_t march_key(int i, int j, int k);
// Room for one more vertex in the mesh's arrays; one more triangle. False where memory lacks.
bool march_make_room(March *march);
bool march_add_triangle(March *march, const int corner[3]);
// Triangles of the block whose values are at hand. False where memory lacks.
bool march_block(March *march, MarchBlock *b);
// Where a vertex has no normal (0), the triangles around give it one, by area. False where memory lacks.
bool march_mend_normals(TriangleMesh *mesh);
// Frees what the march holds but the mesh.
void march_end(March *march);

#endif

// Adds up the walls of the lumen over a square of pixels on the processor, as the shaders of render/fluoroscope_vessel.c do: a software renderer spends most of its
// time on preparing triangles that cover one or two pixels.
#ifndef SELDINGER_RENDER_LUMEN_RASTER_H
#define SELDINGER_RENDER_LUMEN_RASTER_H

#include <stdbool.h>

typedef struct WallMesh {        // zeroed: empty
    int vertex_count, triangle_count;
    float (*vertex)[4];          // (V) position relative to the mesh's origin, and the node of the tree
    int (*triangle)[3];          // (T)
    struct WallPoint *point;     // (V) scratch
} WallMesh;

typedef struct WallView {
    float clip[16];              // from the mesh's frame to clip space, column-major; w is positive at all vertices
    float towards[3], shift;     // depth of a vertex: towards . position + shift
    float facing;                // sign of a wall that is counter-clockwise on the screen
    const float (*shift_slope)[2];   // (nodes of the tree) F = shift + slope depth
} WallView;

bool wall_mesh_make(WallMesh *mesh, int vertices, const float (*vertex)[4], int triangles, const int (*triangle)[3]);   // false if out of memory
void wall_mesh_free(WallMesh *mesh);
// Adds F of each wall, times the sign of its facing, to value (side, side), rows from the bottom.
void lumen_raster(WallMesh *mesh, const WallView *view, int side, float *value);

#endif

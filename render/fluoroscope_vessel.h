// The lumen in fluoroscopy: the integral of contrast agent along each ray, computed from the walls.
//
// The integral of the concentration along a ray is the sum, over the walls that it crosses, of F where it leaves minus F where it enters, with dF/dz =
// concentration along
// the ray. With concentration c(n) and depth z(n) of the nodes of the tree: F = P(n) + c(n) (z - z(n)), where P is the integral of c dz along the tree from its
// root
// to n. P allows a ray to enter at one node and leave at another, as along a vessel; where c is 1 everywhere, F = z, and where it is 0 on one side, nothing
// remains.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_VESSEL_H
#define SELDINGER_RENDER_FLUOROSCOPE_VESSEL_H

#include "geom/geom.h"
#include "render/fluoroscope_options.h"
#include "render/lumen_raster.h"

typedef struct LumenMesh {
    unsigned array, vertices, indices;
    int index_count;
    WallMesh wall;               // the same in memory
} LumenMesh;

typedef struct Lumen {
    bool is_there;
    unsigned program;
    LumenMesh fine, coarse;      // mesh at rest; mesh while the C-arm turns or contrast agent flows
    Vec3 origin;                 // of the vertices
    Vec3 low, high;              // box of the vertices, from the origin
    double sign;                 // -1 if the triangles face inwards
    int node_count;
    int *parent;                 // (N)
    Vec3 *center;                // (N)
    float (*shift_slope)[2];     // (N) F = shift + slope z
    unsigned buffer, texture;    // texture of shift_slope
} Lumen;

// `lids` and `closure` belong to options->vessel. Returns false if the driver fails or if out of memory; `message` may also receive a remark.
bool lumen_layer_create(Lumen *lumen, const FluoroscopeOptions *options, const MeshClosure *closure, const MeshLids *lids, char *message, size_t capacity);
void lumen_layer_destroy(Lumen *lumen);
// True if the whole lumen lies between source and detector. Otherwise rays are wrong and nothing may be drawn.
bool lumen_is_in_beam(const Lumen *lumen, const CArm *c_arm);
// The pixels of a square of `side` that the lumen may cover, including blur; high exclusive.
void lumen_box(const Lumen *lumen, const CArm *c_arm, int side, int low[2], int high[2]);
// Adds F to the bound framebuffer with one float channel (depth along the axis of the C-arm, ignoring the obliquity of the rays).
void lumen_layer_draw(Lumen *lumen, const CArm *c_arm, const float *concentration, bool coarse);
// The same on the processor, added to value (side, side), rows from the bottom.
void lumen_add(Lumen *lumen, const CArm *c_arm, const float *concentration, bool coarse, int side, float *value);

#endif

// The lumen in fluoroscopy: the integral of contrast agent along each ray, computed from the walls.
//
// A ray's integral of concentration is the sum over the walls that it crosses of F, out minus in, where along the ray dF/dz = concentration. With
// concentration c(n) and depth z(n) of the tree's nodes: F = P(n) + c(n) (z - z(n)), P the integral of c dz along the tree from its root to n. P
// allows a ray to enter at one node and leave at another, as along a vessel; where c is 1 everywhere F = z, and where it is 0 on one side nothing
// remains.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_VESSEL_H
#define SELDINGER_RENDER_FLUOROSCOPE_VESSEL_H

#include "geom/geom.h"
#include "render/fluoroscope_options.h"

typedef struct LumenMesh {
    unsigned array, vertices, indices;
    int index_count;
} LumenMesh;

typedef struct Lumen {
    bool is_there;
    unsigned program;
    LumenMesh fine, coarse;      // mesh at rest; mesh while the C-arm turns or contrast agent flows
    Vec3 origin;                 // of the vertices
    Vec3 low, high;              // box of the vertices, from the origin
    double sign;                 // -1 where triangles face inwards
    int node_count;
    int *parent;                 // (N)
    Vec3 *center;                // (N)
    float (*shift_slope)[2];     // (N) F = shift + slope z
    unsigned buffer, texture;    // of the same
} Lumen;

// `lids` and `closure` of options->vessel. False if the driver or memory fails; `message` may get a remark besides.
bool lumen_layer_create(Lumen *lumen, const FluoroscopeOptions *options, const MeshClosure *closure, const MeshLids *lids, char *message, size_t capacity);
void lumen_layer_destroy(Lumen *lumen);
// Whether the whole lumen lies between source and detector: otherwise rays are wrong and nothing may be drawn.
bool lumen_is_in_beam(const Lumen *lumen, const CArm *c_arm);
// The pixels of a square of `side` that the lumen may cover, blur included; high exclusive.
void lumen_box(const Lumen *lumen, const CArm *c_arm, int side, int low[2], int high[2]);
// Adds F into the bound framebuffer of one float channel (depth along the C-arm's axis, without the rays' slant).
void lumen_layer_draw(Lumen *lumen, const CArm *c_arm, const float *concentration, bool coarse);

#endif

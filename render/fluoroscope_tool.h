// The tools in fluoroscopy: one ribbon along the projection of each tool, as wide as its shadow, that carries the thickness of wall and lumen along the rays.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_TOOL_H
#define SELDINGER_RENDER_FLUOROSCOPE_TOOL_H

#include "render/tool_look.h"
#include "sim/sim.h"

typedef struct RibbonVertex {
    float place[2];          // [pixel] in the square, y up
    float across;            // [pixel] from the tool's axis
    float radius, lumen;     // [pixel] of the shadow's two circles
    float density[2];        // a ray through k pixels of the outer circle and m of the inner one is attenuated by exp(-density[0] k - density[1] m)
} RibbonVertex;

typedef struct RibbonPlace { // a point of the tool where the ribbon may have a vertex
    int node;                // after this node of the tool …
    double u;                // … at this fraction of the distance to the next
    bool is_border;          // another stretch begins
    double radius, lumen;    // [mm] of the stretch before it …
    double attenuation;      // [1/mm] … and of its wall
} RibbonPlace;

typedef struct RibbonPath {  // of one tool; zeroed: no path
    int node_count;
    int count;
    RibbonPlace *place;
} RibbonPath;

typedef struct Ribbon {      // zeroed: empty
    int count, capacity;     // vertices; triangles are (0,1,2), (3,4,5), …
    RibbonVertex *vertex;
    int low[2], high[2];     // [pixel] box of all vertices within the square; high exclusive, empty if high <= low
    int point_capacity;      // scratch
    struct RibbonPoint *point;
} Ribbon;

// `s` (node_count) [mm]: arc length of the nodes. Returns false if out of memory.
bool ribbon_path_make(RibbonPath *path, int node_count, const double *s, int stretch_count, const TubeStretch *stretch);
void ribbon_path_free(RibbonPath *path);

void ribbon_begin(Ribbon *ribbon);
// `side` [pixel]: side of the square. `filling` (node_count): fraction of the lumen at each node, 0 to 1, that is filled by a substance of `attenuation`
// [1/mm];
// NULL: none. Points nearer to the source than C_ARM_NEAREST_MM and NaNs are skipped. Returns false if out of memory.
bool ribbon_add(Ribbon *ribbon, const CArm *c_arm, int side, const RibbonPath *path, const Vec3 *position, const float *filling, double attenuation);
void ribbon_end(Ribbon *ribbon, int side);
void ribbon_free(Ribbon *ribbon);

#endif

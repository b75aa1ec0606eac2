// The tool in fluoroscopy: one ribbon along its projection, as wide as its shadow, that carries how thick it is along the rays.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_TOOL_H
#define SELDINGER_RENDER_FLUOROSCOPE_TOOL_H

#include "render/c_arm.h"

typedef struct RibbonVertex {
    float place[2];          // [pixel] of the square, y up
    float across;            // [pixel] from the tool's axis
    float radius;            // [pixel] of the shadow
    float density;           // attenuation for each pixel of chord: a ray through a chord of k pixels is taken away by exp(-density k)
} RibbonVertex;

typedef struct Ribbon {
    int count, capacity;     // vertices; triangles are (0,1,2), (3,4,5), …
    RibbonVertex *vertex;
    int low[2], high[2];     // [pixel] box of all within the square; high exclusive, nothing where high <= low
} Ribbon;

// `side` [pixel] of the square. Points nearer to the source than C_ARM_NEAREST_MM and what is not a number are left out. False where memory lacks.
bool ribbon_lay(Ribbon *ribbon, const CArm *c_arm, int side, int count, const Vec3 *position, const double *radius, const double *attenuation);
void ribbon_free(Ribbon *ribbon);

#endif

// Small opaque shapes made on the CPU: tubes, arrows, spheres, circles, in one list of triangles with normals and colours. And points.
#ifndef SELDINGER_RENDER_SOLIDS_H
#define SELDINGER_RENDER_SOLIDS_H

#include "geom/linear.h"
#include "render/color_map.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct SolidVertex {
    float position[3];         // [mm] relative to the list's origin
    float normal[3];
    Color color;
} SolidVertex;

typedef struct Solids {
    Vec3 origin;               // near the shapes, so that float coordinates keep their digits
    int sides;                 // of round things, >= 3; 0: 14
    int vertex_count, vertex_capacity;
    SolidVertex *vertex;
    int index_count, index_capacity;
    uint32_t *index;           // three to a triangle, counter-clockwise from outside
    bool is_short_of_memory;   // out of memory: some shape is missing
} Solids;

void solids_clear(Solids *solids);
void solids_free(Solids *solids);   // a zeroed list is valid

// A round tube through the points (smoothed by a Catmull-Rom spline) with hemispherical ends; radius and colour at each point.
void solids_tube(Solids *solids, int count, const Vec3 *point, const double *radius, const Color *color);
// The same with a lumen and flat ends; the lumen's wall has the colour `inside`. With `open_towards` only the half away from that direction is drawn.
void solids_pipe(Solids *solids, int count, const Vec3 *point, const double *radius, const double *lumen, const Color *color, Color inside,
                 const Vec3 *open_towards);
// The tip of the head lies at `tip`.
void solids_arrow(Solids *solids, Vec3 tail, Vec3 tip, double radius, Color color);
void solids_sphere(Solids *solids, Vec3 center, double radius, Color color);
// A ring: circle of `radius` around `center` across `axis`, drawn as a tube of `thickness` (radius of the line).
void solids_circle(Solids *solids, Vec3 center, Vec3 axis, double radius, double thickness, Color color);

#endif

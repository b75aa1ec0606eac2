// Small opaque shapes made on the CPU: tubes, arrows, spheres and circles in one list of triangles with normals and colours; and points.
#ifndef SELDINGER_RENDER_PRIMITIVES_H
#define SELDINGER_RENDER_PRIMITIVES_H

#include "geom/geom.h"
#include "render/color_map.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct PrimitiveVertex {
    float position[3];         // [mm] relative to the list's origin
    float normal[3];
    Color color;
} PrimitiveVertex;

typedef struct Primitives {
    Vec3 origin;               // near the shapes, so that float coordinates keep their precision
    int sides;                 // number of sides of round shapes, >= 3; 0: 14
    int vertex_count, vertex_capacity;
    PrimitiveVertex *vertex;
    int index_count, index_capacity;
    uint32_t *index;           // three to a triangle, counter-clockwise from outside
    bool is_short_of_memory;   // out of memory: a shape is missing
} Primitives;

void primitives_clear(Primitives *primitives);
void primitives_free(Primitives *primitives);   // a zeroed list is valid

// A round tube through the points (smoothed by a Catmull-Rom spline) with hemispherical ends; radius and colour at each point.
void primitives_tube(Primitives *primitives, int count, const Vec3 *point, const double *radius, const Color *color);
// As primitives_tube(), with a lumen and flat ends; the wall of the lumen has the colour `inside`. With `open_towards` only the half facing away from that
// direction is drawn.
void primitives_pipe(Primitives *primitives, int count, const Vec3 *point, const double *radius, const double *lumen, const Color *color, Color inside,
                     const Vec3 *open_towards);
// The tip of the arrowhead lies at `tip`.
void primitives_arrow(Primitives *primitives, Vec3 tail, Vec3 tip, double radius, Color color);
void primitives_sphere(Primitives *primitives, Vec3 center, double radius, Color color);
// A ring: a circle of `radius` around `center`, perpendicular to `axis`, drawn as a tube of radius `thickness`.
void primitives_circle(Primitives *primitives, Vec3 center, Vec3 axis, double radius, double thickness, Color color);

#endif

// Moving objects of the live 3D view: lines and thin tubes as ribbons that face the eye, antialiased in any framebuffer, sorted from far to near and
// seen through the walls in front (vessel_scene_layers.h). Inside the live 3D view only.
#ifndef SELDINGER_RENDER_VESSEL_SCENE_STROKES_H
#define SELDINGER_RENDER_VESSEL_SCENE_STROKES_H

#include "render/camera.h"
#include "render/color_map.h"
#include "render/vessel_scene_layers.h"

#include <stdint.h>

typedef struct StrokeVertex {
    float x, y;                // [pixel] from the view's lower left corner
    float across, past;        // [pixel] off the axis; beyond the stroke's end
    float half;                // [pixel] half the stroke's width
    float depth;               // clip space's, 0 near to 1 far
    float side[2];             // unit, in the picture, where `across` grows
    float facing[3];           // unit, eye space: the normal where the stroke's middle is seen
    Color color;
} StrokeVertex;

typedef struct Strokes {       // zeroed: an empty one without GL objects
    Camera camera;
    int quad_count, quad_capacity;
    StrokeVertex *vertex;      // (quads, 4)
    uint64_t *order;           // (quads, 2) sort keys and scratch
    uint32_t *index;           // (quads, 6)
    int point_capacity;        // scratch for one polyline
    struct StrokePoint *point;
    unsigned program, array, vertices, indices;
    bool is_short_of_memory;
} Strokes;

bool strokes_create(Strokes *strokes, char *message, size_t capacity);
void strokes_destroy(Strokes *strokes);

void strokes_begin(Strokes *strokes, const Camera *camera);
// A tube through the points with round or flat ends; half widths in pixels, colours with alpha. Points that are not finite end it, and it begins
// again after them. Of two through the same points the later lies over the earlier.
void strokes_polyline(Strokes *strokes, int count, const Vec3 *point, const double *half_pixels, const Color *color, bool has_round_ends);
void strokes_line(Strokes *strokes, Vec3 a, Vec3 b, double half_pixels, Color color);
// A circle around `center` across the unit `axis`; its far half is fainter.
void strokes_circle(Strokes *strokes, Vec3 center, Vec3 axis, double radius, double half_pixels, Color color);
void strokes_arrow(Strokes *strokes, Vec3 tail, Vec3 tip, double half_pixels, Color color);   // the tip of the head lies at `tip`
// Draws all, far ones first, over what the port shows.
void strokes_draw(Strokes *strokes, const VesselLayers *layers, ViewPort port);

#endif

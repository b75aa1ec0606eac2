// Moving objects of the live 3D view: lines and thin tubes as ribbons that face the eye, antialiased in any framebuffer, sorted from far to near and
// seen through the walls in front (vessel_scene_layers.h). Internal to the live 3D view.
#ifndef SELDINGER_RENDER_VESSEL_SCENE_STROKES_H
#define SELDINGER_RENDER_VESSEL_SCENE_STROKES_H

#include "render/camera.h"
#include "render/color_map.h"
#include "render/vessel_scene_layers.h"

#include <stdint.h>

typedef struct StrokeVertex {
    float x, y;                // [pixel] from the view's lower left corner
    float across, past;        // [pixel] distance from the axis; distance beyond the end of the stroke
    float half;                // [pixel] half the width of the stroke
    float depth;               // in clip space, 0 near to 1 far
    float side[2];             // unit vector in the picture, in the direction in which `across` grows
    float facing[3];           // unit vector in eye space: the normal where the middle of the stroke is seen
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
// A tube through the points with round or flat ends; half widths in pixels, colours with alpha. It is interrupted at points that are not finite. Of two tubes
// through the same
// points the later one covers the earlier one.
void strokes_polyline(Strokes *strokes, int count, const Vec3 *point, const double *half_pixels, const Color *color, bool has_round_ends);
void strokes_line(Strokes *strokes, Vec3 a, Vec3 b, double half_pixels, Color color);
// A circle around `center`, perpendicular to the unit vector `axis`; its far half is fainter.
void strokes_circle(Strokes *strokes, Vec3 center, Vec3 axis, double radius, double half_pixels, Color color);
void strokes_arrow(Strokes *strokes, Vec3 tail, Vec3 tip, double half_pixels, Color color);   // the tip of the head lies at `tip`
// Draws all strokes, far ones first, over the contents of the port.
void strokes_draw(Strokes *strokes, const VesselLayers *layers, ViewPort port);

#endif

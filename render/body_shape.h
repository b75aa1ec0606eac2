// The solids that the simulated patient is made of: ellipsoids and straight elliptical tubes, each between up to two planes and perhaps hollow. The length of a
// ray in each is exact, and attenuations add up: a cavity is a solid of negative attenuation within another one.
//
// The body's frame [mm]: x to the patient's right, y anterior, z superior; the origin is the sella turcica.
#ifndef SELDINGER_RENDER_BODY_SHAPE_H
#define SELDINGER_RENDER_BODY_SHAPE_H

#include "geom/geom.h"

typedef struct BodyShape {
    Vec3 center;
    Mat3 to_unit;            // a point at x from the centre is inside if |to_unit x| <= 1; the last row of a tube is 0
    double hollow;           // the part |to_unit x| <= hollow is filled differently
    double wall, filling;    // [1/mm] attenuation added outside and inside of it
    Vec3 plane[2];           // and if plane . x <= offset; a zero vector: no limit
    double offset[2];
    Vec3 reach[3];           // the box center +- reach contains it
} BodyShape;

typedef struct Body {
    int count, capacity;
    BodyShape *shape;
    bool is_out_of_memory;
} Body;

void body_free(Body *body);

// The box of which the ellipsoid is the largest; `turn` rotates it.
typedef struct BodyEllipsoid {
    Vec3 center, semi;
    Quat turn;               // zero: none
    double attenuation;
} BodyEllipsoid;
BodyShape *body_add_ellipsoid(Body *body, const BodyEllipsoid *ellipsoid);   // NULL if out of memory; valid until the next one is added
void body_shape_clip(BodyShape *shape, int which, Vec3 normal, double offset);       // to normal . x <= offset, x in the body's frame. NULL is ignored
void body_shape_hollow(BodyShape *shape, double hollow, double filling);

// A tube along a polyline, mitred at its corners. Its section is an ellipse; pieces have the mean of the sizes at their ends.
typedef struct BodyTube {
    Vec3 width;              // direction of the section's first axis, made perpendicular to the tube; zero: any
    double hollow, wall, filling;
    bool is_closed;          // the last point is joined to the first
} BodyTube;
typedef struct TubeSize {      // [mm] semi-axes of the section: along the width, across it
    double along, across;
} TubeSize;
void body_add_tube(Body *body, const BodyTube *tube, int count, const Vec3 *point, const TubeSize *semi);
// The shapes since `first`, once more on the other side of the plane x = 0.
void body_mirror(Body *body, int first);

// Attenuation along the ray from `source` in the unit direction.
double body_shape_along(const BodyShape *shape, Vec3 source, Vec3 direction);

#endif

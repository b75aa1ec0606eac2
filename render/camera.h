// A parallel projection: one millimetre is the same number of pixels everywhere, so a scale bar is valid and the outline of a sphere shows its radius.
#ifndef SELDINGER_RENDER_CAMERA_H
#define SELDINGER_RENDER_CAMERA_H

#include "geom/geom.h"

typedef struct Camera {
    Vec3 right, up, back;      // orthonormal, right-handed; back points towards the eye
    Vec3 center;               // projected to the middle of the view
    double mm_per_pixel;
    double near_depth, far_depth;   // [mm] along back, relative to center: depths between far < near are drawn
    int width, height;         // size of the view [pixel]
} Camera;

// Sets the axes from a view direction and an up vector. A zero vector is replaced: `view` by the principal axis of least extent of the points, with the sign
// for which
// the camera looks along +y, -z or -x (from a patient's front, head or left in LPS); `up` by the coordinate axis best seen from there (z before y before x).
// If the points are thin in two directions or in none, `view` is as near to +y as possible.
void camera_orient(Camera *camera, Vec3 view, Vec3 up, int count, const Vec3 *point);
// Frames the points (each with `margin` mm around it) in a view of width x height, with a border of `border` pixels on each side. Axes must be set.
void camera_frame(Camera *camera, int width, int height, double border, int count, const Vec3 *point, double margin);
// Height of the points in the view [pixel].
double camera_height_of(const Camera *camera, int count, const Vec3 *point);
// Frames a sphere; the depth range is unchanged.
void camera_frame_sphere(Camera *camera, int width, int height, double border, Vec3 center, double radius);
// Projects a point to pixels (x right, y down, from the upper left corner of the view); z: depth towards the eye [mm] relative to center.
Vec3 camera_project(const Camera *camera, Vec3 point);
// Column-major matrix from space relative to `origin` to clip space.
void camera_matrix(const Camera *camera, Vec3 origin, float matrix[16]);
// Column-major rotation from space to right, up and towards the eye, for normals.
void camera_axes(const Camera *camera, float matrix[9]);
// Eigenvectors of a symmetric matrix by Jacobi rotations, values ascending; the signs are arbitrary but repeatable.
void camera_principal_axes(const Sym3 *matrix, double value[3], Vec3 axis[3]);

#endif

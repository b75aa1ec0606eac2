// The camera of the live 3D view: a parallel projection that orbits, pans and zooms by mouse movements. Plain data without OpenGL; lengths in mm in the frame
// of the model
// (LPS: +x to the patient's left, +y to the back, +z to the head).
#ifndef SELDINGER_RENDER_VESSEL_SCENE_CAMERA_H
#define SELDINGER_RENDER_VESSEL_SCENE_CAMERA_H

#include "render/camera.h"

typedef struct FreeCamera {
    Vec3 focus;                // projected to the middle of the view, which orbits around it
    Quat turn;                 // rotates x, y, z to the directions right, up and towards the eye
    double width_mm, height_mm;         // size of a rectangle around the focus that just fits into the view, > 0
    Vec3 low, high;            // the box of all visible objects …
    Vec3 home_focus;           // … and the view of it that free_camera_reset restores
    Quat home_turn;
    double home_width_mm, home_height_mm;
} FreeCamera;

typedef enum {
    LOOK_FACE_ON,              // the initial view: along the axis in which the scene is thinnest
    LOOK_FRONT,                // from the patient's front (along +y), head up
    LOOK_BACK,
    LOOK_RIGHT,                // from the patient's right (along +x), head up
    LOOK_LEFT,
    LOOK_TOP,                  // from the head (along -z), front up
    LOOK_BOTTOM,
} LookFrom;

// Frames the points, seen face on. Without points: a ball of 10 mm around the origin.
FreeCamera free_camera_framing(int count, const Vec3 *point);
// The near side of the view follows the mouse by 0.4 degrees per pixel; dx right, dy down [pixel].
void free_camera_orbit(FreeCamera *camera, double dx, double dy);
// Rotates the picture counter-clockwise [rad].
void free_camera_roll(FreeCamera *camera, double angle);
// The point under the mouse stays under it. width, height: size of the view [pixel].
void free_camera_pan(FreeCamera *camera, double dx, double dy, int width, int height);
// Zooms in by a factor of 1.15 for each `notch` > 0 of the wheel; the point at (x, y), from the upper left corner of the view, stays in place.
// A view is at least 1/400 and at most 20 times as wide as the home view.
void free_camera_zoom(FreeCamera *camera, double notch, double x, double y, int width, int height);
void free_camera_reset(FreeCamera *camera);
void free_camera_look_from(FreeCamera *camera, LookFrom from);   // shows the whole scene
// The projection for a view of width x height; the depths drawn extend `depth` mm in front of and behind the focus.
Camera free_camera_projection(const FreeCamera *camera, int width, int height, double depth);

#endif

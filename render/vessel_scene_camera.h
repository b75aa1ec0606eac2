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

// Frames the points, seen along the axis in which the scene is thinnest. Without points: a ball of 10 mm around the origin.
FreeCamera free_camera_framing(int count, const Vec3 *point);
// The near side of the view follows the mouse by 0.4 degrees per pixel; dx right, dy down [pixel].
void free_camera_orbit(FreeCamera *camera, double dx, double dy);
// The point under the mouse stays under it. width, height: size of the view [pixel].
void free_camera_pan(FreeCamera *camera, double dx, double dy, int width, int height);
// Zooms in by a factor of 1.15 for each `notch` > 0 of the wheel; the point at (x, y), from the upper left corner of the view, stays in place.
// A view is at least 1/400 and at most 20 times as wide as the home view.
void free_camera_zoom(FreeCamera *camera, double notch, double x, double y, int width, int height);
void free_camera_reset(FreeCamera *camera);
// Frames the whole scene, seen along `view` (from the eye into the scene), with `up`, made perpendicular to it, upwards.
void free_camera_look_along(FreeCamera *camera, Vec3 view, Vec3 up);
// Only turns the camera, as above; focus and zoom stay.
void free_camera_turn_along(FreeCamera *camera, Vec3 view, Vec3 up);
// The present view becomes the one that free_camera_reset restores.
void free_camera_set_home(FreeCamera *camera);
// The projection for a view of width x height; the depths drawn extend `depth` mm in front of and behind the focus.
Camera free_camera_projection(const FreeCamera *camera, int width, int height, double depth);

#endif

// The camera of the live 3D view: a parallel projection that orbits, pans and zooms by mouse movements. Plain data without OpenGL; lengths mm, the
// frame is the model's (LPS: +x to the patient's left, +y to the back, +z to the head).
#ifndef SELDINGER_RENDER_VESSEL_SCENE_CAMERA_H
#define SELDINGER_RENDER_VESSEL_SCENE_CAMERA_H

#include "render/camera.h"

typedef struct FreeCamera {
    Vec3 focus;                // lands in the middle of the view, and the view orbits around it
    Quat turn;                 // takes x, y, z to the directions right, up and towards the eye
    double width_mm, height_mm;         // size of a rectangle around the focus that just fits into the view, > 0
    Vec3 low, high;            // the box of what there is to see …
    Vec3 home_focus;           // … and the view of it that free_camera_reset goes back to
    Quat home_turn;
    double home_width_mm, home_height_mm;
} FreeCamera;

// Frames the points, seen face on. Fewer than one point: a ball of 10 mm around the origin.
FreeCamera free_camera_framing(int count, const Vec3 *point);
// The view's near side follows the mouse by 0.4 degrees a pixel; dx right, dy down [pixel].
void free_camera_orbit(FreeCamera *camera, double dx, double dy);
// The point under the mouse stays under it. width, height of the view [pixel].
void free_camera_pan(FreeCamera *camera, double dx, double dy, int width, int height);
// Nearer by a factor of 1.15 for each `notch` > 0 of the wheel; what lies at (x, y), from the view's upper left corner, stays where it is.
// A view is at least 1/400 and at most 20 times as wide as home's.
void free_camera_zoom(FreeCamera *camera, double notch, double x, double y, int width, int height);
void free_camera_reset(FreeCamera *camera);
// Looks at all there is to see along `view`, from the eye into the scene, with `up` (made perpendicular to it) upwards.
void free_camera_look_along(FreeCamera *camera, Vec3 view, Vec3 up);
// The projection for a view of width x height; depths that are drawn reach `depth` mm before and behind the focus.
Camera free_camera_projection(const FreeCamera *camera, int width, int height, double depth);

#endif

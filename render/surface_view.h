// The 3D view: a translucent vessel, opaque shapes inside and in front of it, points. Needs a current GL context; draws into the bound framebuffer.
//
// Order: shapes and points first (they write depth), then the shell, its triangles sorted from far to near, blended and tested against that depth.
#ifndef SELDINGER_RENDER_SURFACE_VIEW_H
#define SELDINGER_RENDER_SURFACE_VIEW_H

#include "geom/geom.h"
#include "render/camera.h"
#include "render/primitives.h"

#include <stddef.h>

typedef struct SurfaceView SurfaceView;

typedef struct ShellStyle {
    float front[3], back[3];   // colour of the wall's outer and inner face
    float front_opacity, back_opacity;   // opacity where the wall is seen face on; 0 to 1
    float rim;                 // opacity where the wall is seen edge on; 0 to 1
    float rim_power;           // how narrow the rim is
    float haze[3];             // far parts fade to this …
    float haze_amount;         // … by this much at far_depth; 0 to 1
    float fade_from, fade_to;  // [mm] towards the eye from the camera's centre: nearer walls fade out between these; equal: no fading
} ShellStyle;
ShellStyle shell_style_glass(void);   // a translucent vessel on a light background

typedef struct ViewPoint {
    float position[3];         // [mm] relative to the origin given with the list
    Color color;
    float size;                // [pixel] diameter
} ViewPoint;

SurfaceView *surface_view_create(char *message, size_t capacity);
void surface_view_destroy(SurfaceView *view);
// Copies the mesh. Returns false if indices are out of range, numbers are not finite, or if out of memory.
bool surface_view_set_mesh(SurfaceView *view, const TriangleMesh *mesh, char *message, size_t capacity);
void surface_view_draw_primitives(SurfaceView *view, const Camera *camera, const Primitives *primitives, const ShellStyle *style);
void surface_view_draw_points(SurfaceView *view, const Camera *camera, Vec3 origin, int count, const ViewPoint *point);
void surface_view_draw_shell(SurfaceView *view, const Camera *camera, const ShellStyle *style);

#endif

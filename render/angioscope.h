// Angioscopy: the view from the tip of a tool forward inside the lumen, in a vessel with a tree along the centreline ahead. Perspective projection; the lamp is at the eye, so the light falls off with distance
// and the
// far lumen is dark; the normals of the wall are those of the vessel's own field. The eye is fixed to the tool, slightly behind its tip and beside its axis,
// so that the end of the tool is visible at the lower rim of the picture, and it rotates with the tool. If it would come too close to a wall it is moved away
// from it.
// Inside another tool it lies between the two tools and sees the lumen of the outer one, its open end and what is beyond. Needs a current GL context (3.3
// core),
// always the same one. Lengths in mm.
#ifndef SELDINGER_RENDER_ANGIOSCOPE_H
#define SELDINGER_RENDER_ANGIOSCOPE_H

#include "geom/geom.h"
#include "render/tool_look.h"
#include "render/view_port.h"
#include "sim/sim.h"

typedef struct Angioscope Angioscope;

typedef struct AngioscopeView {    // a perspective camera
    Vec3 eye;
    Vec3 right, up, forward;       // orthonormal; right = forward x up
    double half_angle_tan;         // of the angle from the middle of the view to the middle of its shorter side
} AngioscopeView;

// `mesh` NULL: no wall (a dark picture with the tool). The mesh is copied; `vessel` (NULL: normals as in the mesh, the eye is not moved off the wall) and
// `tree` (may be NULL) are borrowed. Returns NULL with a reason.
Angioscope *angioscope_create(const TriangleMesh *mesh, const Vessel *vessel, const VesselTree *tree, char *message, size_t capacity);
void angioscope_destroy(Angioscope *scope);
// Also antialiases the wall, at two to three times the cost: for off-screen pictures and videos. Default: off.
void angioscope_set_full_detail(Angioscope *scope, bool on);
// `tools` is borrowed and gives the lumens of the tools. NULL (default): all tools are solid.
void angioscope_set_tools(Angioscope *scope, const ToolLooks *tools);
// Default: none.
void angioscope_set_sheath(Angioscope *scope, SheathLook sheath);
// Draws the view from the tip of `tool` (-1: the tool that reaches furthest) into the whole rectangle of the port. In the sheath, outside the vessel, or
// without a
// finite pose, the picture is dark or empty.
void angioscope_draw(Angioscope *scope, const Pose *pose, int tool, ViewPort port);
// The camera for a pose; returns false if the tip has no finite position.
bool angioscope_view(const Angioscope *scope, const Pose *pose, int tool, AngioscopeView *view);

#endif

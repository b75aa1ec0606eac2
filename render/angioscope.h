// Angioscopy: from a tool's tip looking forward inside the lumen. Perspective; the lamp is at the eye, so that light falls off with distance and the
// far lumen is dark; the wall's normals are those of the vessel's own field. The eye rides on the tool, a little behind its tip and beside its axis,
// so that the tool's end is seen at the picture's lower rim, and turns with the tool. If it would come too near to a wall it is moved away from it.
// Inside another tool it lies between the two and sees that tool's lumen, its open end and what is beyond. Needs a current GL context (3.3 core),
// always the same one. Lengths mm.
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
    double half_angle_tan;         // of the angle from the view's middle to the middle of its shorter side
} AngioscopeView;

// `mesh` NULL: no wall (a dark picture with the tool). The mesh is copied; `vessel` (NULL: normals as in the mesh, eye not moved off the wall) and
// `tree` (may be NULL) are borrowed. NULL with a reason.
Angioscope *angioscope_create(const TriangleMesh *mesh, const Vessel *vessel, const VesselTree *tree, char *message, size_t capacity);
void angioscope_destroy(Angioscope *scope);
// Antialiases the wall too, at two to three times the cost: for off-screen pictures and films. Default: off.
void angioscope_set_full_detail(Angioscope *scope, bool on);
// Borrowed: lumens of the tools. NULL (default): all are solid.
void angioscope_set_tools(Angioscope *scope, const ToolLooks *tools);
// From the tip of `tool`; -1: of the one that reaches furthest. Draws all of the port's rectangle. In the sheath, outside the vessel, or without a
// finite pose the picture is dark or empty.
void angioscope_draw(Angioscope *scope, const Pose *pose, int tool, ViewPort port);
// The camera for a pose; false if the tip has no finite position.
bool angioscope_view(const Angioscope *scope, const Pose *pose, int tool, AngioscopeView *view);

#endif

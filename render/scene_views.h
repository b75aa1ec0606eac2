// The views of a scene and the operator's controls, for the window and for off-screen pictures.
#ifndef SELDINGER_RENDER_SCENE_VIEWS_H
#define SELDINGER_RENDER_SCENE_VIEWS_H

#include "render/operator_controls.h"
#include "render/views.h"
#include "sim/sim.h"

// Creates the views with everything visible: the wall, the volume behind it if the scene has one, the tool at the start. Needs a current GL context. Returns
// NULL with
// faults. `note` (capacity bytes): empty, or what is missing in the pictures.
Views *scene_views_create(Scene *scene, OpenVessel *open, OperatorControls *controls, char *note, size_t capacity, Faults *faults);

#endif

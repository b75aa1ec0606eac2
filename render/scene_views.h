// The views of a scene and the operator's desk before them, for the window and for pictures off screen.
#ifndef SELDINGER_RENDER_SCENE_VIEWS_H
#define SELDINGER_RENDER_SCENE_VIEWS_H

#include "render/desk.h"
#include "render/views.h"
#include "sim/open_vessel.h"

// Everything that is seen: the wall, the volume behind it where the scene names one, the tool as it stands at the start. Needs a current GL context.
// NULL with faults. `note` (capacity bytes): empty, or what the pictures lack.
Views *scene_views_create(Scene *scene, OpenVessel *open, Desk *desk, char *note, size_t capacity, Faults *faults);

#endif

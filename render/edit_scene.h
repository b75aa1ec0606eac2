// The surface under edit in space, with the section's plane, the new branch and the arrows of in- and outflow.
#ifndef SELDINGER_RENDER_EDIT_SCENE_H
#define SELDINGER_RENDER_EDIT_SCENE_H

#include "render/edit_state.h"
#include "render/gui.h"
#include "render/vessel_scene_camera.h"

typedef struct EditScene EditScene;

// Frames the state's mesh. NULL with a reason.
EditScene *edit_scene_create(const EditState *state, char *message, size_t capacity);
void edit_scene_destroy(EditScene *scene);
FreeCamera *edit_scene_camera(EditScene *scene);     // after a change of it, edit_scene_redraw
void edit_scene_redraw(EditScene *scene);
// Draws into the window's framebuffer; `at`: the view, y down, in a window of `height` pixels. What did not change is copied.
bool edit_scene_draw(EditScene *scene, EditState *state, GuiRect at, int height, char *message, size_t capacity);
// The nearest point of the wall under a pixel of the view; false if there is none. `branch`: -1 on a sac.
bool edit_scene_pick(const EditScene *scene, const EditState *state, GuiRect at, double x, double y, Vec3 *wall, int *branch, double *t);
// The point under a pixel in the plane, parallel to the screen, through `through`.
Vec3 edit_scene_point(const EditScene *scene, GuiRect at, double x, double y, Vec3 through);
// How the view at `at` sees space.
Camera edit_scene_projection(const EditScene *scene, GuiRect at);
// Turns the camera's focus to a point.
void edit_scene_focus(EditScene *scene, Vec3 x);

#endif

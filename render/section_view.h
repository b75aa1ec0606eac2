// The cross-section of the place that is edited: the image resampled in the plane (n, b), or a grid without an image, and the contour with its handles.
#ifndef SELDINGER_RENDER_SECTION_VIEW_H
#define SELDINGER_RENDER_SECTION_VIEW_H

#include "render/edit_state.h"
#include "render/gui.h"

typedef struct SectionView SectionView;

// `volume` may be NULL; it is borrowed. NULL if out of memory.
SectionView *section_view_create(const Volume *volume);
void section_view_destroy(SectionView *view);
// Draws the image into the window's framebuffer; `at`: the view, y down, in a window of `height` pixels.
void section_view_draw_image(SectionView *view, const EditState *state, GuiRect at, int height);
// Draws grid, contour, handles and stroke by the gui, in its current window.
void section_view_draw_contour(const SectionView *view, Gui *gui, const EditState *state, GuiRect at);
// (n, b) of a pixel, and the handle there: -1 if none is near.
Vec3 section_view_place(const SectionView *view, GuiRect at, double x, double y);
int section_view_handle(const SectionView *view, const EditState *state, GuiRect at, double x, double y, double near);
void section_view_zoom(SectionView *view, double notches);

#endif

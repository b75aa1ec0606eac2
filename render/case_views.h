// The pictures of the case window: three slices and the projection, or the wall in space; and over them the tree, the wall, marks, the cross-hair and the letters
// of the patient's sides.
#ifndef SELDINGER_RENDER_CASE_VIEWS_H
#define SELDINGER_RENDER_CASE_VIEWS_H

#include "render/case_state.h"
#include "render/gui.h"

typedef struct CaseViews CaseViews;

CaseViews *case_views_create(char *message, size_t capacity);
void case_views_destroy(CaseViews *views);
// Draws the pictures into the window's framebuffer, of `height` pixels; `at`: the CASE_VIEWS views, y down. What did not change is copied. `is_moving`: coarser, in less time.
bool case_views_draw(CaseViews *views, const CaseState *state, const GuiRect *at, int height, bool is_moving, char *message, size_t capacity);
// Draws over one view by the gui, in its current window.
void case_views_draw_over(CaseViews *views, Gui *gui, const CaseState *state, int view, GuiRect at);

#endif

// The panel of the case window: what is being made, what a click does, marks, acts, and Steer. It changes the state; saving and leaving are left to the window.
#ifndef SELDINGER_RENDER_CASE_PANEL_H
#define SELDINGER_RENDER_CASE_PANEL_H

#include "render/case_state.h"
#include "render/gui.h"

typedef struct CasePanelActions {
    bool steer, help, edit, leave;
} CasePanelActions;

CasePanelActions case_panel_draw(Gui *gui, CaseState *state, GuiRect at, bool shows_help);
// The keys, in a window over the others.
void case_panel_help(Gui *gui, const WindowInput *input);

#endif

// The panel of the editor: the place, smoothing, the fork, branches, tags, and the list of edits as lines of YAML. It changes the state; saving and leaving are
// left to the window.
#ifndef SELDINGER_RENDER_EDIT_PANEL_H
#define SELDINGER_RENDER_EDIT_PANEL_H

#include "render/edit_state.h"
#include "render/gui.h"

typedef struct EditPanelActions {
    bool save, help;
} EditPanelActions;

EditPanelActions edit_panel_draw(Gui *gui, EditState *state, GuiRect at, bool shows_help);
// The keys, in a window over the others.
void edit_panel_help(Gui *gui, const WindowInput *input);

#endif

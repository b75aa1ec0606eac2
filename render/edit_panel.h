// The panel of the editor: the place, smoothing, the fork, branches, tags, and the list of edits as lines of YAML. It changes the state; saving,
// undoing and leaving are left to the window.
#ifndef SELDINGER_RENDER_EDIT_PANEL_H
#define SELDINGER_RENDER_EDIT_PANEL_H

#include "render/edit_state.h"
#include "render/gui.h"

typedef struct EditPanelActions {
    bool save, undo, redo, help;
} EditPanelActions;

// `is_of_case`: every edit is kept at once, and the button to save leads back.
EditPanelActions edit_panel_draw(Gui *gui, EditState *state, GuiRect at, bool shows_help, bool is_of_case);
// The keys, in a window over the others.
void edit_panel_help(Gui *gui, const WindowInput *input);

#endif

// The desk on which a swept model is edited: the surface on the left, the section in the middle, the panel on the right (Kretschmer et al. 2013, section 5.1). The
// windows of `seldinger edit` and `seldinger case` show it.
#ifndef SELDINGER_RENDER_EDIT_DESK_H
#define SELDINGER_RENDER_EDIT_DESK_H

#include "render/edit_state.h"
#include "render/gui.h"
#include "render/window.h"

// What the user wants of the window, since it was asked last.
typedef struct EditDeskWants {
    bool save, undo, redo, leave;
    bool leave_again;        // without another key between
} EditDeskWants;

typedef struct EditDesk EditDesk;

// The state and the volume (NULL: none) are borrowed. `is_of_case`: what is saved is the case, not a file. NULL with a message. Needs a current GL context.
EditDesk *edit_desk_create(EditState *state, const Volume *volume, bool is_of_case, char *message, size_t capacity);
void edit_desk_destroy(EditDesk *desk);
// Takes the keys and the mouse of a frame.
void edit_desk_take_input(EditDesk *desk, const WindowInput *input);
// Fills the window. False with a message.
bool edit_desk_draw(EditDesk *desk, Gui *gui, const WindowInput *input, char *message, size_t capacity);
// As Esc does: ends what is under way, or leaves.
void edit_desk_leave(EditDesk *desk);
EditDeskWants edit_desk_wants(EditDesk *desk);

#endif

// The window of `seldinger edit`: the surface on the left, the section in the middle, the panel on the right (Kretschmer et al. 2013, section 5.1).
#ifndef SELDINGER_RENDER_EDIT_WINDOW_H
#define SELDINGER_RENDER_EDIT_WINDOW_H

#include "recon/recon.h"

typedef struct EditWindowOptions {
    const char *name;                // of the model, for the title
    const char *output;              // Ctrl+S writes it
    const char *picture;             // of the window at its end; NULL: none
    int width, height;
    double duration_s;               // ends after this much real time; 0: never
} EditWindowOptions;

// Runs until the user leaves. `volume` may be NULL. False with faults if no window can be opened, or if the last save failed.
bool edit_window_run(const EditWindowOptions *options, const EditFile *file, SweepEditor *editor, const Volume *volume, Faults *faults);

#endif

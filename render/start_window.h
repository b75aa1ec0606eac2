// The window of `seldinger` without arguments: exercises and cases, earlier sessions, files to open, devices, settings. It only asks; the caller does what was chosen.
#ifndef SELDINGER_RENDER_START_WINDOW_H
#define SELDINGER_RENDER_START_WINDOW_H

#include "render/start_state.h"

// Runs until the user has chosen or leaves. START_LEAVE with a fault if no window can be opened.
StartChoice start_window_run(const StartOptions *options, StartState *state, Faults *faults);

#endif

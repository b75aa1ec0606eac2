// Opens the case window for a volume, and steers in the case that comes of it.
#ifndef SELDINGER_CLI_CASE_OPEN_H
#define SELDINGER_CLI_CASE_OPEN_H

#include "render/render.h"

#include <stdbool.h>

// Whether `path` is a volume that a window can be opened for: there is a display.
bool case_can_open(const char *path);
// Runs the window; then, if the user chose to, `nav` in a process of its own, for this trainee ("": nobody's name), as an examination or not. Returns an exit code.
int case_open(const CaseWindowOptions *options, const char *trainee, bool is_examination, Faults *faults);

#endif

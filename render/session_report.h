// The page about a session, with its recording, vessel and earlier sessions.
#ifndef SELDINGER_RENDER_SESSION_REPORT_H
#define SELDINGER_RENDER_SESSION_REPORT_H

#include "sim/sim.h"

// Returns the HTML of `session`, stored at `path`; the folder `with` contains earlier sessions of the trainee. Missing parts are reported through `note` and
// omitted.
// The caller frees the result. Returns NULL with a fault if out of memory.
char *session_report(const char *path, const Session *session, const char *with, NoteFunction note, size_t *length, Faults *faults);

#endif

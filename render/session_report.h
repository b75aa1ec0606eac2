// The page about a session, with all that belongs to it: its recording, the vessel, earlier sessions.
#ifndef SELDINGER_RENDER_SESSION_REPORT_H
#define SELDINGER_RENDER_SESSION_REPORT_H

#include "sim/sim.h"

// HTML of `session`, which lies at `path`; earlier ones of the trainee lie in the folder `with`. What cannot be had is said on standard error, and the page is
// shorter. To be freed; NULL with a fault where there is no memory.
char *session_report(const char *path, const Session *session, const char *with, NoteFunction note, size_t *length, Faults *faults);

#endif

// Pages over all sessions of a folder, one self-contained HTML5 page each: of a trainee with learning curves for each exercise, and of all trainees for their
// instructor. Files that cannot be read are listed with the reason.
#ifndef SELDINGER_RENDER_ARCHIVE_PAGE_H
#define SELDINGER_RENDER_ARCHIVE_PAGE_H

#include "sim/sim.h"

// Returns the HTML; `trainee` NULL: the instructor's page. `folder` is named in the page. The caller frees the result. NULL with a fault if out of memory.
char *archive_page(const SessionArchive *archive, const char *folder, const char *trainee, size_t *length, Faults *faults);

#endif

// The page of a trainee's session: one self-contained HTML5 page with the points and their parts, errors, plots over time, the tip's path through the vessel,
// and
// earlier sessions. Missing parts (recording, vessel, scene) are omitted with a note.
#ifndef SELDINGER_RENDER_SESSION_PAGE_H
#define SELDINGER_RENDER_SESSION_PAGE_H

#include "render/session_figures.h"

// Writes the whole page to page->out.
void session_page(const SessionPage *page);

#endif

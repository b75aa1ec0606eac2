// PDF output of a report page.
#ifndef SELDINGER_RENDER_PAGE_PDF_H
#define SELDINGER_RENDER_PAGE_PDF_H

#include "base/base.h"

// Writes the page as PDF, printed by chromium. Returns false with a fault, also if chromium is not installed. SIGINT, SIGTERM and SIGHUP are deferred until the
// temporary copies of the page are removed.
bool page_write_pdf(const char *path, const char *page, size_t length, Faults *faults);

#endif

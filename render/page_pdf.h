// A page on paper.
#ifndef SELDINGER_RENDER_PAGE_PDF_H
#define SELDINGER_RENDER_PAGE_PDF_H

#include "base/faults.h"

// Writes the page as PDF, printed by chromium. False with a fault: also where that is not installed. SIGINT, SIGTERM and SIGHUP wait until nothing of the
// page is left elsewhere.
bool page_write_pdf(const char *path, const char *page, size_t length, Faults *faults);

#endif

// Shared parts of report pages: self-contained HTML for the screen in light and dark and for paper.
#ifndef SELDINGER_RENDER_PAGE_H
#define SELDINGER_RENDER_PAGE_H

#include <stdio.h>

extern const char page_style[];                                // of every page: light, dark and paper
// Text as HTML: markup escaped, bytes that are not UTF-8 and control characters replaced.
void page_text(FILE *out, const char *text);

#endif

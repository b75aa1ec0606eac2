// Shared parts of report pages: self-contained HTML for the screen, light and dark, and for paper.
#ifndef SELDINGER_RENDER_PAGE_H
#define SELDINGER_RENDER_PAGE_H

#include <stdio.h>

extern const char page_style[];                                // style of every page: light, dark and paper
// Writes text as HTML: markup is escaped; control characters and bytes that are not UTF-8 are replaced.
void page_text(FILE *out, const char *text);
// Writes the document up to its heading; the caller closes its elements header, body and html. `kind` precedes the title in the browser's tab; `style` is appended to
// page_style.
void page_begin(FILE *out, const char *kind, const char *title, const char *style);

#endif

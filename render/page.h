// Shared parts of report pages: self-contained HTML for the screen in light and dark and for paper.
#ifndef SELDINGER_RENDER_PAGE_H
#define SELDINGER_RENDER_PAGE_H

#include <stdio.h>

extern const char page_style[];                                // of every page: light, dark and paper
// A round step (1, 2, 5 times a power of ten) so that at most `most` fit into `range`.
double page_tick_step(double range, int most);
// Text as HTML: markup escaped, bytes that are not UTF-8 and control characters replaced.
void page_text(FILE *out, const char *text);

#endif

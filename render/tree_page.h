// The report of a tree or model: one self-contained HTML5 file (no script, no picture file, no network), for the screen, light and dark, and for paper. The
// same input
// gives the same bytes.
#ifndef SELDINGER_RENDER_TREE_PAGE_H
#define SELDINGER_RENDER_TREE_PAGE_H

#include "geom/geom.h"
#include "recon/recon.h"

// `model`: may be a tree without a wall. `name`: the file that it was loaded from. Returns false with faults if the file cannot be written or if out of memory.
bool tree_page_write(const char *path, const char *name, const ModelField *model, const TreeFileInfo *info, Faults *faults);

#endif

// The report of a tree or model: one self-contained HTML5 file (no script, no picture file, no network), for the screen in light and dark and for
// paper. The same bytes for the same input.
#ifndef SELDINGER_RENDER_TREE_PAGE_H
#define SELDINGER_RENDER_TREE_PAGE_H

#include "geom/geom.h"
#include "recon/recon.h"

// `name` is what the tree was loaded from. False with faults where the file cannot be written or memory runs out.
bool tree_page_write(const char *path, const char *name, const VesselTree *tree, const TreeFileInfo *info, Faults *faults);

#endif

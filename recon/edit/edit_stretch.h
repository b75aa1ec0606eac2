// Edits of sections that are not polar: contours that a row cannot hold become stations of a stretch (geom/sweep_model.h), of the kind raster unless the stretch
// there has another. Internal to recon.
#ifndef SELDINGER_RECON_EDIT_EDIT_STRETCH_H
#define SELDINGER_RECON_EDIT_EDIT_STRETCH_H

#include "geom/geom.h"

// Index of a stretch of the branch that overlaps from … to, or has from = to within it; one that reaches to an end of the branch has the end, too. -1: none.
int edit_stretch_at(const SweepModel *model, int branch, double from, double to);
// Gives the contour at the station t to a stretch that reaches to the stations beside it; those that it overlaps become one with it. A station nearer to t than
// `within` is replaced. Returns false with a fault.
bool edit_stretch_set(SweepModel *model, int branch, double t, double within, int count, const SectionPoint *contour, const char *name, Faults *faults);
// Removes the station nearest to t, within `within`, from its stretch, and a stretch that has only its ends left. Returns false with a fault.
bool edit_stretch_delete(SweepModel *model, int branch, double t, double within, const char *name, Faults *faults);

#endif

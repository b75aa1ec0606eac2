// Sections of the kind that is asked for, from the fitted rows and the points: the last step of the swept model's fit. Internal to recon.
//
// Mended kinds: each break is a station. Its contour is sampled from the rows; where they miss points (the lumen is not star-shaped), it is the shortest
// closed polygon through the points beside the station. A section of the kind is made from it. Where the section's curve agrees with a polar one to 0.01 radii
// the rows are moved to it; where it does not, the model gets a stretch there (sweep_model.h), for polar sections of the kind raster.
// As printed: one stretch for each whole branch, contours of each station alone, rows laid between the stations. raster: weights of Catmull and Rom with tension
// 0.7. rbf: through the raw points beside the station; PSP weights. pas: sections in the straight frames of their stations. Where the points beside a station give
// no contour around the curve, it is mended (rbf: as the other kinds have it; these: no ray shorter than a tenth of the tree's radius) and counted.
#ifndef SELDINGER_RECON_FIT_SWEEP_STRETCHS_H
#define SELDINGER_RECON_FIT_SWEEP_STRETCHS_H

#include "recon/fit/sweep_rows.h"

typedef struct SweepStretchFigures {
    int64_t second_sheets;   // points of sections that a ray from the middle meets more than once
    int mended;              // as printed: stations whose points give no contour around the curve
    int stations;            // with sections of another kind than polar
    int64_t numbers;         // that the sections store, if all are of the kind; 0 for polar ones
} SweepStretchFigures;

// Fills the model's stretches, and moves its rows, if options->section.kind is not polar. The draft's feet are those of its points, the system's distances those
// from the model's wall. Returns false with faults.
bool sweep_stretches_fit(SweepDraft *draft, const SweepSystem *system, SweepStretchFigures *figures, Faults *faults);
// Drops the stretches in which the points' mean distance is not less than with the rows alone by NEARER. `before`: (points) distances from the rows' wall; the
// system's distances are those from the wall with the stretches. Returns the number dropped; -1 with faults.
int sweep_stretches_keep_better(SweepDraft *draft, const SweepSystem *system, const double *before, SweepStretchFigures *figures, Faults *faults);

#endif

// Where the fitted wall still differs from the data by more than the tolerance and the noise: there a finer blob is put. Inside recon; see field_fit.h.
#ifndef SELDINGER_RECON_FIT_FIELD_REFINE_H
#define SELDINGER_RECON_FIT_FIELD_REFINE_H

#include "recon/fit/field_model.h"

typedef struct FieldRefine {
    double reach;            // of the new blobs, in local radii
    double tolerance, tolerance_mm;   // of a mean residual: the larger of so many local radii and so many mm
    double least_reach;      // [mm] no blob smaller than what the image resolves
    double significance;     // in standard deviations of the mean's noise
} FieldRefine;

// Adds blobs; returns how many, -1 without memory. Their rows become due.
int field_refine(FieldModel *model, const FieldRefine *how);

#endif

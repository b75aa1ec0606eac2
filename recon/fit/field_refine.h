// Adds finer blobs where the fitted wall differs from the data by more than the tolerance and the noise. Internal to recon; see field_fit.h.
#ifndef SELDINGER_RECON_FIT_FIELD_REFINE_H
#define SELDINGER_RECON_FIT_FIELD_REFINE_H

#include "recon/fit/field_model.h"

typedef struct FieldRefine {
    double reach;            // of the new blobs, in local radii
    double tolerance, tolerance_mm;   // of a mean residual: the larger of so many local radii and so many mm
    double least_reach;      // [mm] smallest blob (image resolution)
    double significance;     // in standard deviations of the mean's noise
} FieldRefine;

// Adds blobs; returns how many, -1 if out of memory. Their rows become due.
int field_refine(FieldModel *model, const FieldRefine *how);

#endif

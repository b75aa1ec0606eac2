// Adds finer blobs where the fitted wall differs from the data by more than the tolerance and the noise. Internal to recon; see field_fit.h.
#ifndef SELDINGER_RECON_FIT_FIELD_REFINE_H
#define SELDINGER_RECON_FIT_FIELD_REFINE_H

#include "recon/fit/field_model.h"

typedef struct FieldRefine {
    double reach;            // reach of the new blobs, in local radii
    double tolerance, tolerance_mm;   // tolerance of a mean residual: the larger of `tolerance` in local radii and tolerance_mm
    double least_reach;      // [mm] reach of the smallest blob (image resolution)
    double significance;     // least mean residual, in standard deviations of the mean's noise
} FieldRefine;

// Adds blobs and marks their rows as due. Returns the number added, or -1 if out of memory.
int field_refine(FieldModel *model, const FieldRefine *how);

#endif

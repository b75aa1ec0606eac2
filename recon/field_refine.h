// Where the fitted wall still differs from the data by more than the tolerance and the noise: there a finer blob is put. Inside recon; see field_fit.h.
#ifndef SELDINGER_RECON_FIELD_REFINE_H
#define SELDINGER_RECON_FIELD_REFINE_H

#include "recon/field_model.h"

typedef struct FieldRefine {
    double reach;            // of the new blobs, in local radii
    double tolerance;        // of a mean residual, in local radii …
    double target_mm;        // … or, where > 0, in mm
    double significance;     // in standard deviations of the mean's noise
} FieldRefine;

// Adds blobs; returns how many, -1 without memory. Their rows become due.
int field_refine(FieldModel *model, const FieldRefine *how);

#endif

// Pictures of a model from the model alone: its surface is made for them.
#ifndef SELDINGER_RENDER_PICTURE_MODEL_H
#define SELDINGER_RENDER_PICTURE_MODEL_H

#include "base/base.h"
#include "geom/geom.h"

// picture_of_fit() and picture_of_error(): false with a fault where there is none. A tree without a model has no picture.
bool picture_model_fit(const char *path, const VesselTree *model, Faults *faults);
// `voxel_mm`: of the classes of the histogram.
bool picture_model_error(const char *path, const char *title, const VesselTree *model, double voxel_mm, Faults *faults);

#endif

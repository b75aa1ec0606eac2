// Pictures of a model, with its surface computed for them.
#ifndef SELDINGER_RENDER_PICTURE_MODEL_H
#define SELDINGER_RENDER_PICTURE_MODEL_H

#include "base/base.h"
#include "geom/geom.h"

// picture_of_fit() and picture_of_error() of a model. Return false with a fault if no picture can be drawn, for example for a tree without a model.
bool picture_model_fit(const char *path, const ModelField *model, Faults *faults);
// `voxel_mm`: voxel size for the classes of the histogram.
bool picture_model_error(const char *path, const char *title, const ModelField *model, double voxel_mm, Faults *faults);

#endif

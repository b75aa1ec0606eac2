// Adds up the attenuation of the patient's solids over rows of a square of pixels on the processor, as the shader of render/fluoroscope_layers.c does.
#ifndef SELDINGER_RENDER_SHAPE_RASTER_H
#define SELDINGER_RENDER_SHAPE_RASTER_H

#include "render/fluoroscope_anatomy.h"

enum { SHAPE_BLOCK = 16 };     // the side is a multiple of it

// Fills rows `first` to first + rows - 1 of value (side, side), rows from the bottom.
void shape_raster(const ShapeShadows *shadows, const CArm *c_arm, int side, int first, int rows, float *value);

#endif

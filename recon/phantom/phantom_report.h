// Reports the distance of a model from its true shape (recon/phantom/phantom_measure.h), as text and as JSON.
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_REPORT_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_REPORT_H

#include "recon/phantom/phantom_measure.h"

#include <cJSON.h>
#include <stdio.h>

void shape_measure_print(FILE *out, const ShapeMeasure *figures);
void shape_measure_add(cJSON *root, const ShapeMeasure *figures);

#endif

// Prints the measurements of a model (recon/fit/model_measure.h), as text and as JSON.
#ifndef SELDINGER_RECON_FIT_MEASURE_REPORT_H
#define SELDINGER_RECON_FIT_MEASURE_REPORT_H

#include "recon/fit/model_measure.h"

#include <cJSON.h>
#include <stdio.h>

void model_measure_print(FILE *out, const ModelMeasure *measure);
void model_measure_add(cJSON *root, const ModelMeasure *measure);

#endif

// The report of `info` and `fit` on which parts of a model a tool can reach from the inlet (geom/reach.h), as text and JSON.
#ifndef SELDINGER_RECON_FIT_REACH_REPORT_H
#define SELDINGER_RECON_FIT_REACH_REPORT_H

#include "geom/geom.h"

#include <cJSON.h>
#include <stdio.h>

// Reports the reach of a tool of radius `tool_radius` [mm], with the nodes' numbers in the file. Without a model nothing is printed or added, and it returns true. Returns false with a
// fault if out of memory. `json` and `out` may be NULL.
bool reach_report(const ModelField *model, const char *file, double tool_radius, FILE *out, cJSON *json, Faults *faults);

#endif

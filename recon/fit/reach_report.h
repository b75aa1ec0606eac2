// The report of `info` and `fit` on which parts of a model a tool can reach from the inlet (geom/reach.h), as text and JSON.
#ifndef SELDINGER_RECON_FIT_REACH_REPORT_H
#define SELDINGER_RECON_FIT_REACH_REPORT_H

#include "geom/geom.h"

#include <cJSON.h>
#include <stdio.h>

// A tree without a model has no such report: nothing is printed or added, without a fault. False with a fault if out of memory. `json` may be NULL,
// `out` too. `tool_radius` [mm].
bool reach_report(const VesselTree *tree, const char *file, double tool_radius, FILE *out, cJSON *json, Faults *faults);

#endif

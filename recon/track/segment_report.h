// Reports the results of tracking (recon/track/rbt_report.h), as text and as JSON.
#ifndef SELDINGER_RECON_TRACK_SEGMENT_REPORT_H
#define SELDINGER_RECON_TRACK_SEGMENT_REPORT_H

#include "geom/geom.h"
#include "recon/track/rbt_report.h"

#include <cJSON.h>
#include <stdio.h>

// Prints a row for each branch, then the junctions that the image does not clearly support, the loops, the removed vessels, and totals. Times in seconds.
void segment_report_print(FILE *out, const VesselTree *tree, const RbtReport *report, double load_s, double track_s);
void segment_report_add(cJSON *root, const VesselTree *tree, const RbtReport *report, double load_s, double track_s);

#endif

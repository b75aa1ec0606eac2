// Writes the record of how a tree was tracked, for its file.
#ifndef SELDINGER_RECON_TRACK_SEGMENT_PARAMETERS_H
#define SELDINGER_RECON_TRACK_SEGMENT_PARAMETERS_H

#include "geom/geom.h"
#include "recon/track/rbt_parameters.h"
#include "recon/track/rbt_report.h"
#include "recon/volume/volume.h"

// Returns the parameters and the results of tracking in the syntax of a trace file. The caller frees it.
char *segment_parameters_text(const RbtParameters *parameters, const RbtReport *report, const Volume *volume, const VesselTree *tree);

#endif

// What a tree's file says of how it was tracked.
#ifndef SELDINGER_RECON_TRACK_SEGMENT_PARAMETERS_H
#define SELDINGER_RECON_TRACK_SEGMENT_PARAMETERS_H

#include "geom/geom.h"
#include "recon/track/rbt_parameters.h"
#include "recon/track/rbt_report.h"
#include "recon/volume/volume.h"

// What was found beside the parameters that found it, in the words of a trace; to be freed.
char *segment_parameters_text(const RbtParameters *parameters, const RbtReport *report, const Volume *volume, const VesselTree *tree);

#endif

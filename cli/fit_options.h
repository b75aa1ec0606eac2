// The options of `fit`.
#ifndef SELDINGER_CLI_FIT_OPTIONS_H
#define SELDINGER_CLI_FIT_OPTIONS_H

#include "base/base.h"
#include "cli/junction_pages.h"
#include "recon/recon.h"

typedef struct FitCommand {
    const char *tree, *output, *json, *picture;
    TreeFitOptions fit;
    JunctionPages junctions;    // also contains the radius of the tool for the reach report
    bool has_model, has_alpha, has_beta, has_max_blobs, has_max_points, quiet, measure;
} FitCommand;
extern const OptionTable fit_options;

#endif

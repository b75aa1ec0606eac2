// The options of `synth`.
#ifndef SELDINGER_CLI_SYNTH_OPTIONS_H
#define SELDINGER_CLI_SYNTH_OPTIONS_H

#include "base/base.h"
#include "recon/recon.h"

enum { SHAPE_OPTIONS = 19 };

typedef struct SynthCommand {
    const char *shape, *output, *measure, *json;
    int option_count;
    char option[SHAPE_OPTIONS][2][64];
    PhantomFiles files;
    double gap_voxels;               // < 0: not given
    double background_grey, noise_grey, band_grey;   // the first two -1: not given
    bool quiet;
} SynthCommand;
extern const OptionTable synth_options;

#endif

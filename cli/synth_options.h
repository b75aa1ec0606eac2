// The options of `synth`.
#ifndef SELDINGER_CLI_SYNTH_OPTIONS_H
#define SELDINGER_CLI_SYNTH_OPTIONS_H

#include "base/base.h"
#include "recon/recon.h"

enum { SHAPE_OPTIONS = 19 };

typedef struct SynthCommand {
    const char *output, *measure, *json;
    char option[SHAPE_OPTIONS][2][64];
    PhantomFiles files;              // their options are those above
    int model;                       // that is measured: index in model_names; -1: the first that the file has
    double gap_voxels;               // < 0: not given
    double background_grey, noise_grey, band_grey;   // the first two -1: not given
    bool quiet;
} SynthCommand;
extern const OptionTable synth_options;

#endif

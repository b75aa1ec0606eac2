// The options of `run`.
#ifndef SELDINGER_CLI_RUN_OPTIONS_H
#define SELDINGER_CLI_RUN_OPTIONS_H

#include "base/base.h"
#include "cli/run_files.h"
#include "cli/run_hands.h"

typedef struct RunOptions {
    const char *scene, *script, *device[RUN_MAPS];
    RunFiles files;
    HeadlessOptions headless;
    int device_count, threads;
    int contact;                     // index in run_contact; -1: the scene's
    bool quiet;
} RunOptions;

extern const char *const run_contact[];      // names of the contact kinds …
extern const ContactKind run_contact_kind[]; // … and their values
extern const OptionTable run_options;

#endif

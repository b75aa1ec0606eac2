// The options of `seldinger case`.
#ifndef SELDINGER_CLI_CASE_OPTIONS_H
#define SELDINGER_CLI_CASE_OPTIONS_H

#include "cli/cli.h"

typedef struct CaseCommand {
    const char *input, *trace, *start, *output, *picture;
    Vec3 start_mm;
    CaseOptions made;
    const char *trainee;         // of the session in which the window ends
    bool is_examination, quiet;
    int width, height;
    double duration_s;
} CaseCommand;

extern const OptionTable case_options;     // of a CaseCommand

#endif

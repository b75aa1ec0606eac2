// The options of `import`.
#ifndef SELDINGER_CLI_IMPORT_OPTIONS_H
#define SELDINGER_CLI_IMPORT_OPTIONS_H

#include "base/base.h"
#include "recon/recon.h"

enum { IMPORT_FILES = 1024 };

typedef struct ImportCommand {
    const char *surface, *output, *json, *centreline_out;
    const char *centreline[IMPORT_FILES];
    int centreline_count;
    ImportOptions options;
    double scale;
    bool has_scale, quiet;
} ImportCommand;
extern const OptionTable import_options;

#endif

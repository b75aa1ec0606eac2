// Prints the --help text of a table of options.
#ifndef SELDINGER_BASE_OPTIONS_HELP_H
#define SELDINGER_BASE_OPTIONS_HELP_H

#include "base/option_table.h"

#include <stdio.h>

void options_help(const OptionTable *table, FILE *out);

#endif

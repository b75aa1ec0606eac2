// A command line by a table of options. As in getopt_long(): long options by any beginning that is unambiguous, `--name value` and `--name=value`, `-o value`
// and `-ovalue`, options and arguments in any order, after `--` arguments alone. `--help` and `-h` are in every table.
#ifndef SELDINGER_BASE_OPTIONS_H
#define SELDINGER_BASE_OPTIONS_H

#include "base/option_table.h"

// Fills `structure` (table->size bytes) from argv[1] on; the order of argv changes. -1: done; otherwise the exit code: after --help, or after a message on
// standard error.
int options_parse(const OptionTable *table, int argc, char **argv, void *structure);

#endif

// Parses a command line by a table of options, as getopt_long() does: long options by any unambiguous prefix, `--name value` and `--name=value`, `-o value`
// and `-ovalue`, options and arguments in any order, only arguments after `--`. Every table accepts `--help` and `-h`.
#ifndef SELDINGER_BASE_OPTIONS_H
#define SELDINGER_BASE_OPTIONS_H

#include "base/option_table.h"

// Fills `structure` (table->size bytes) from argv[1] onwards; reorders argv. Returns -1 if done, otherwise the exit code: after --help, or after a message on
// standard error.
int options_parse(const OptionTable *table, int argc, char **argv, void *structure);

#endif

// What installs beside a program, made from its tables of options: manual pages, and completion for bash.
#ifndef SELDINGER_BASE_OPTIONS_MANUAL_H
#define SELDINGER_BASE_OPTIONS_MANUAL_H

#include "base/option_table.h"

#include <stdio.h>

// One page of section 1 (troff, man macros), named like the program with dashes: seldinger-fit(1). `version` stands at its foot.
void options_manual(const OptionTable *table, const char *version, FILE *out);
// The page of the program that has these verbs: what each does, and where its own page is. `verb` ends with NULL; each one's program is "PROGRAM VERB".
void options_overview(const OptionTable *program, const OptionTable *const *verb, const char *version, FILE *out);
// A script for bash that completes `program VERB OPTION VALUE`: choices by their words, files and folders by those that are there.
// `table` ends with NULL; each table's program is "PROGRAM VERB".
void options_completion(const char *program, const OptionTable *const *table, FILE *out);

#endif

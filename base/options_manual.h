// Files that are installed with a program, made from its tables of options: manual pages and bash completion.
#ifndef SELDINGER_BASE_OPTIONS_MANUAL_H
#define SELDINGER_BASE_OPTIONS_MANUAL_H

#include "base/option_table.h"

#include <stdio.h>

// Writes one page of section 1 (troff, man macros), named after the program with dashes: seldinger-fit(1). `version` appears in the footer.
void options_manual(const OptionTable *table, const char *version, FILE *out);
// Writes the page of a program with verbs: what each verb does and where its own page is. `verb` ends with NULL; each of its tables has the program name
// "PROGRAM VERB".
void options_overview(const OptionTable *program, const OptionTable *const *verb, const char *version, FILE *out);
// Writes a bash script that completes `program VERB OPTION VALUE`: choices by their words, files and folders by the existing ones.
// `table` ends with NULL; each of its tables has the program name "PROGRAM VERB".
void options_completion(const char *program, const OptionTable *const *table, FILE *out);

#endif

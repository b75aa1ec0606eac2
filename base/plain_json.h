// Prints JSON as plain text for readers.
#ifndef SELDINGER_BASE_PLAIN_JSON_H
#define SELDINGER_BASE_PLAIN_JSON_H

#include <cJSON.h>
#include <stdio.h>

// One line for each member of the object except `without` and empty strings: its name and its values in order.
void plain_json_print(FILE *out, const cJSON *object, const char *without);

#endif

// JSON as text for people.
#ifndef SELDINGER_BASE_PLAIN_JSON_H
#define SELDINGER_BASE_PLAIN_JSON_H

#include <cJSON.h>
#include <stdio.h>

// A line for each member of an object, but for `without`: its name and its values, one after the other.
void plain_json_print(FILE *out, const cJSON *object, const char *without);

#endif

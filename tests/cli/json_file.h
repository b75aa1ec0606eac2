// Reads a JSON file that the program wrote into the test's folder (tests/folder.h).
#ifndef SELDINGER_TESTS_CLI_JSON_FILE_H
#define SELDINGER_TESTS_CLI_JSON_FILE_H

#include <cJSON.h>

static inline cJSON *json_of(const char *name)
{
    char *text = text_of(in_folder(name));
    cJSON *json = cJSON_Parse(text);
    assert_non_null(json);
    free(text);
    return json;
}

#endif

// Converts a score's figures to and from JSON, with one table for both.
#ifndef SELDINGER_SIM_SCORE_JSON_H
#define SELDINGER_SIM_SCORE_JSON_H

#include "sim/score.h"

#include <cJSON.h>

// Adds all figures to an object; false if out of memory.
bool score_add_json(cJSON *object, const ScoreFigures *figures);
// The plain numbers of the figures by index, in the file's order and with its names; NULL beyond the last.
const char *score_figure_name(int index);
double score_figure(const ScoreFigures *figures, int index);

// Reads an object by its keys; every error is reported as a fault of `file`.
typedef struct JsonReading {
    const char *file;
    Faults *faults;
} JsonReading;
void score_read_json(const JsonReading *reading, const cJSON *object, ScoreFigures *figures);

// Checks that `object`, called `where` in messages, is an object whose members are `keys` (NULL-terminated), each once. Otherwise adds a fault and returns
// false.
bool json_keys(const JsonReading *reading, const cJSON *object, const char *where, const char *const *keys);
double json_number(const JsonReading *reading, const cJSON *object, const char *where, const char *key, double least, double most);
int64_t json_count(const JsonReading *reading, const cJSON *object, const char *where, const char *key, int64_t most);
// Index in `names` (NULL-terminated); 0 with a fault.
int json_choice(const JsonReading *reading, const cJSON *object, const char *where, const char *key, const char *const *names);
// Copies at most `capacity` bytes with the NUL; a longer text is a fault.
void json_text(const JsonReading *reading, const cJSON *object, const char *where, const char *key, size_t capacity, char *text);

#endif

// Reads a YAML document by a schema in code: a map is opened with the list of its valid keys, then each value is read by type and range. Every error becomes a
// fault with
// file:line:col; reading continues, so one pass finds all errors. Aliases are followed: a traversal of bounded depth cannot enter a cycle, and a budget of
// visited nodes
// limits repeated aliases.
#ifndef SELDINGER_BASE_YAML_READER_H
#define SELDINGER_BASE_YAML_READER_H

#include "base/faults.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct YamlReader YamlReader;

// A value of the document, with its name for messages.
typedef struct YamlValue {
    YamlReader *reader;
    int node;                // 0: absent
    char name[96];           // "wire.sections[1].length_mm"
} YamlValue;

typedef struct YamlMap {
    YamlValue value;         // node 0 if absent or not a map: all values below then count as absent, without further faults
    const char *const *keys; // NULL-terminated
} YamlMap;

// The range of a number. `above`: `least` itself is excluded.
typedef struct NumberRange {
    double least, most;
    bool above;
} NumberRange;

// Returns NULL with a fault if the text is not YAML, contains no document or several, or if out of memory. `text` is used during this call only.
YamlReader *yaml_reader_open(const char *text, size_t length, const char *file, Faults *faults);
void yaml_reader_close(YamlReader *reader);
YamlValue yaml_root(YamlReader *reader);
void yaml_place(YamlValue value, int *line, int *column);
void yaml_fault(YamlValue value, const char *format, ...) __attribute__((format(printf, 2, 3)));

// `keys`: the valid keys; any other key is a fault that suggests the nearest valid key or the right unit. NULL allows any key.
YamlMap yaml_map(YamlValue value, const char *const *keys);
bool yaml_has(const YamlMap *map, const char *key);
// The value of a key; node 0 if absent, which is a fault if `required`.
YamlValue yaml_get(const YamlMap *map, const char *key, bool required);
// Key number `index` of a map with arbitrary keys, and its value; false past the end.
bool yaml_pair(const YamlMap *map, int index, const char **key, YamlValue *value);

int yaml_count(YamlValue value, int least, int most);      // length of a list; -1 with a fault if it is not a list or out of range
YamlValue yaml_item(YamlValue list, int index);
bool yaml_is_list(YamlValue value);
bool yaml_is_map(YamlValue value);
const char *yaml_scalar(YamlValue value);                  // the text of a scalar, NULL otherwise; adds no fault
// The value, a list or map too, as one line of YAML in flow style, in which numbers stay as they were written. The caller frees it. NULL with a fault.
char *yaml_flow(YamlValue value);
bool yaml_text(YamlValue value, const char **text);        // adds a fault if it is not a scalar or is empty
bool yaml_number(YamlValue value, NumberRange range, double *number);
bool yaml_integer(YamlValue value, int least, int most, int *number);
bool yaml_boolean(YamlValue value, bool *answer);
// Index of the value in `names` (NULL-terminated), or -1 with a fault.
int yaml_choice(YamlValue value, const char *const *names);

// Reads a number by key. Returns false if the key is absent (a fault if `required`) or its value is wrong; *number is then unchanged.
bool yaml_map_number(const YamlMap *map, const char *key, bool required, NumberRange range, double *number);

#endif

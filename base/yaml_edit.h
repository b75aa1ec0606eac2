// Changes one value in a YAML text, or adds an item to a list, and preserves the rest, including comments and layout.
#ifndef SELDINGER_BASE_YAML_EDIT_H
#define SELDINGER_BASE_YAML_EDIT_H

#include <stdbool.h>

// Returns the text with the value at `path` replaced by the scalar `value` (quoted here); the caller frees it. With `add`, a missing last key is added to its
// map. A
// path consists of map keys and list indices from the root: "vessel.model", "tools.0.device", "sheath.direction.2". Returns NULL if a map or item of the path
// does not exist, if the last
// key does not exist and `add` is false, if the text is not one YAML document or would not be one afterwards (an alias of the replaced value, a line break
// in the value), or if out of memory.
char *yaml_edit(const char *text, const char *path, const char *value, bool add);
// As yaml_edit(), but the new value is `flow`: one line of YAML in flow style, a list or map too ("[1, 0, 0]").
char *yaml_edit_flow(const char *text, const char *path, const char *flow, bool add);
// Returns the text with `item`, one line of YAML in flow style, appended to the list at `path`; the caller frees it. A missing last key is added with a list of
// that one
// item. Returns NULL as above, or if the value at `path` is not a list.
char *yaml_edit_append(const char *text, const char *path, const char *item);

#endif

// Changes one value in a YAML text, or adds an item to a list, preserving the rest, including comments and layout.
#ifndef SELDINGER_BASE_YAML_EDIT_H
#define SELDINGER_BASE_YAML_EDIT_H

#include <stdbool.h>

// The text with the value at `path` replaced by the scalar `value` (quoted here); a last key that does not exist is added to its map where `add`. A
// path consists of map keys and list indices from the root: "vessel.model", "tools.0.device". The caller frees the result. NULL if a map or item of
// the path or the last key does not exist (and is not to be added), if the text is not one YAML document or would not be one afterwards (an alias of
// the replaced value, a line break in the value), or if memory runs out.
char *yaml_edit(const char *text, const char *path, const char *value, bool add);
// The text with `item`, YAML in flow style on one line, as the last of the list at `path`; a last key that does not exist is added with a list of
// that one item. The caller frees the result. NULL as above, or if the path holds something other than a list.
char *yaml_edit_append(const char *text, const char *path, const char *item);

#endif

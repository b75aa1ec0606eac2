// Changes one value in a YAML text, or adds an item to a list, and leaves the rest of it as it is, comments and layout too.
#ifndef SELDINGER_BASE_YAML_EDIT_H
#define SELDINGER_BASE_YAML_EDIT_H

#include <stdbool.h>

// The text with the value at `path` replaced by the scalar `value` (quoted here); a last key that is not there is added to its map where `add`. A path
// names keys of maps and numbers of list items from the root: "vessel.model", "tools.0.device". The caller frees the result. NULL where a map or item on
// the way is not there, the last key neither there nor to be added, the text is not one YAML document, or would not be
// one with that value there (an alias of what was replaced, a line break in the value), or memory lacks.
char *yaml_edit(const char *text, const char *path, const char *value, bool add);
// The text with `item`, YAML in flow style on one line, as the last of the list at `path`; a last key that is not there is added with a list of that one
// item. The caller frees the result. NULL as above, or where there is something other than a list.
char *yaml_edit_append(const char *text, const char *path, const char *item);

#endif

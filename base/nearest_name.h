// Suggests the valid name for a mistyped one.
#ifndef SELDINGER_BASE_NEAREST_NAME_H
#define SELDINGER_BASE_NEAREST_NAME_H

// Index of the name (NULL-terminated list) with the smallest edit distance; -1 if that exceeds one letter plus a quarter of the name's length.
int nearest_name(const char *name, const char *const *names);

#endif

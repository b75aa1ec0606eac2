// A name that was mistyped: which valid one was meant.
#ifndef SELDINGER_BASE_NEAREST_NAME_H
#define SELDINGER_BASE_NEAREST_NAME_H

// Index of the name (NULL-terminated list) that takes the fewest letters to change, insert or drop; -1 where even that takes more than one letter and a
// quarter of the name's own.
int nearest_name(const char *name, const char *const *names);

#endif

#include "base/assert.h"

#include <stdio.h>
#include <stdlib.h>

void sel_assert_failed(const char *file, int line, const char *condition, const char *assumed)
{
    fprintf(stderr, "%s:%d: assertion failed: %s; assumed: %s\n", file, line, condition, assumed);
    abort();
}

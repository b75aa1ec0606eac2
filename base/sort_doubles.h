// Sorts numbers in ascending order, for medians and percentiles.
#ifndef SELDINGER_BASE_SORT_DOUBLES_H
#define SELDINGER_BASE_SORT_DOUBLES_H

#include <stddef.h>
#include <stdlib.h>

static inline int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// No value may be NaN.
static inline void sort_doubles(double *value, size_t count) { qsort(value, count, sizeof *value, compare_doubles); }

#endif

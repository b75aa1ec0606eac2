// The rows of `seldinger check` for golden runs.
#ifndef SELDINGER_CLI_CHECK_ROWS_H
#define SELDINGER_CLI_CHECK_ROWS_H

#include "cli/cli.h"

// Whether the path, a figure, or what the runs contain differs.
bool check_differs(const GoldenComparison *comparison);
// One line: each quantity above its tolerance, with the first time and the difference there; "" if none is.
void check_describe(const GoldenComparison *comparison, char *text, size_t capacity);
// The row of the table; with `quiet` only if the runs differ.
void check_print_row(FILE *out, const Scene *scene, const GoldenComparison *comparison, bool quiet);

#endif

// Progress of long computations, shown on a terminal.
#ifndef SELDINGER_BASE_PROGRESS_BAR_H
#define SELDINGER_BASE_PROGRESS_BAR_H

#include "base/parallel.h"

#include <stdbool.h>

// A progress bar on standard error: drawn only if that is a terminal and --quiet is not given.
typedef struct ProgressBar {
    const char *label;
    bool shown;
} ProgressBar;
Progress progress_bar(ProgressBar *bar, const char *label, bool quiet);

#endif

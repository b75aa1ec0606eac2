// The page of `seldinger check --page`: all cases, and for each run that differs where it parts from its golden run.
#ifndef SELDINGER_RENDER_CHECK_PAGE_H
#define SELDINGER_RENDER_CHECK_PAGE_H

#include "sim/sim.h"

#include <stdio.h>

// A self-contained HTML document. Holds no date, so the same cases give the same page except for run times.
void check_page(FILE *out, const CheckLog *log);

#endif

// Pictures of every junction of a model, for `info` and `fit`.
#ifndef SELDINGER_CLI_JUNCTION_PAGES_H
#define SELDINGER_CLI_JUNCTION_PAGES_H

#include "base/base.h"
#include "geom/geom.h"

typedef struct JunctionPages {
    const char *picture;     // the first page; NULL: none are wanted
    const char *volume;      // what lies behind them; NULL
    const char *before;      // another model of the same vessels, drawn beside this one; the ten narrowest in it; NULL
    double tool_radius;      // [mm]
} JunctionPages;

// A picture is never worth a failed command: what stops it is said on standard error. False with a fault where a file that is named cannot be read.
bool junction_pages_draw(const JunctionPages *wanted, const char *title, const VesselTree *model, Faults *faults);

#endif

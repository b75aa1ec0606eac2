// Pictures of every junction of a model, for `info` and `fit`.
#ifndef SELDINGER_CLI_JUNCTION_PAGES_H
#define SELDINGER_CLI_JUNCTION_PAGES_H

#include "base/base.h"
#include "geom/geom.h"

typedef struct JunctionPages {
    const char *picture;     // path of the first page; NULL: no pictures
    const char *volume;      // the volume shown behind the sections; NULL: none
    const char *before;      // another model of the same vessels, drawn beside this one for its ten narrowest junctions; NULL: none
    double tool_radius;      // [mm] radius of the tool
} JunctionPages;

// Draws the pages. Returns false with a fault if an input cannot be read or a picture cannot be drawn.
bool junction_pages_draw(const JunctionPages *wanted, const char *title, const ModelField *model, Faults *faults);

#endif

// A set of line segments inside a lumen, each with a clearance radius within which no point can be wall. Used to remove wall points that lie in a tool's
// path.
#ifndef SELDINGER_RECON_TRACK_LUMEN_LINES_H
#define SELDINGER_RECON_TRACK_LUMEN_LINES_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct LumenLine {
    Vec3 from, to;           // [mm]
    double clear;            // [mm] > 0
} LumenLine;

// Clearance radii as fractions of the vessel's radius: for a link through an ostium, where the parent's edges are often mistaken for wall, and for any other
// centreline, whose radius is less certain at bends and near branches.
static const double LUMEN_LINK_CLEAR = 0.7, LUMEN_TUBE_CLEAR = 0.5;

typedef struct LumenLines LumenLines;
// Creates a set with a copy of the lines. Returns NULL if out of memory.
LumenLines *lumen_lines_create(const LumenLine *line, int count);
void lumen_lines_free(LumenLines *lines);
// Returns true if x lies within the clearance radius of a line. Read-only: threads may share the set.
bool lumen_lines_hold(const LumenLines *lines, Vec3 x);

#endif

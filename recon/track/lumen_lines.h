// Lines that run inside a lumen, each with the distance up to which nothing can be wall: which points of a tree lie where a tool passes.
#ifndef SELDINGER_RECON_TRACK_LUMEN_LINES_H
#define SELDINGER_RECON_TRACK_LUMEN_LINES_H

#include "geom/linear.h"

#include <stdbool.h>

typedef struct LumenLine {
    Vec3 from, to;           // [mm]
    double clear;            // [mm] > 0
} LumenLine;

// Shares of the radius within which a point is none of the wall: of a link through an ostium, where the parent's edges are often taken for wall, and of any
// other centreline, whose own radius is less sure at a bend or beside a branch.
static const double LUMEN_LINK_CLEAR = 0.7, LUMEN_TUBE_CLEAR = 0.5;

typedef struct LumenLines LumenLines;
// Keeps a copy of the lines. NULL where memory lacks.
LumenLines *lumen_lines_create(const LumenLine *line, int count);
void lumen_lines_free(LumenLines *lines);
// Whether x is nearer to one of the lines than that one's clear distance. Read-only: threads may share it.
bool lumen_lines_hold(const LumenLines *lines, Vec3 x);

#endif

// The silhouette of a vessel with tools in it, seen along the coordinate axis in which they extend least: inline SVG for pages. The page's style
// has the class `vessel`.
#ifndef SELDINGER_RENDER_SILHOUETTE_H
#define SELDINGER_RENDER_SILHOUETTE_H

#include "sim/sim.h"

#include <stdio.h>

typedef struct Silhouette {
    int across, up;          // axes 0 x, 1 y, 2 z
    double left, bottom;     // [mm] corner of the picture
    double scale;            // [px/mm]
    double width, height;    // [px]
} Silhouette;

void silhouette_widen(Vec3 point, Vec3 *low, Vec3 *high);    // a box
// A picture of the box whose longer side has `side` pixels.
Silhouette silhouette_frame(Vec3 low, Vec3 high, double side);
double silhouette_x(const Silhouette *view, Vec3 point);
double silhouette_y(const Silhouette *view, Vec3 point);
char silhouette_axis(const Silhouette *view);    // 'x': seen along it
// Opens the SVG; the caller draws and ends, which adds the scale.
void silhouette_begin(FILE *out, const Silhouette *view, const char *id, const char *title);
void silhouette_wall(FILE *out, const Silhouette *view, const CheckWall *wall);
void silhouette_end(FILE *out, const Silhouette *view);

#endif

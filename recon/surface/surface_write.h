// Writes surfaces for other programs: STL, PLY, OBJ, VTP.
#ifndef SELDINGER_RECON_SURFACE_SURFACE_WRITE_H
#define SELDINGER_RECON_SURFACE_SURFACE_WRITE_H

#include "geom/geom.h"

#include <stdio.h>

typedef struct SurfaceFigures {
    TriangleMesh *mesh;
    double *error, *distance;   // (V) [mm], both NULL if the tree has no points
} SurfaceFigures;

void surface_print_stl(FILE *out, const SurfaceFigures *surface);
void surface_print_ply(FILE *out, const SurfaceFigures *surface);
void surface_print_obj(FILE *out, const SurfaceFigures *surface);
void surface_print_vtp(FILE *out, const SurfaceFigures *surface);

#endif

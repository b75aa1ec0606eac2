// Writes surfaces for other programs: STL, PLY, OBJ, VTP.
#ifndef SELDINGER_RECON_SURFACE_SURFACE_WRITE_H
#define SELDINGER_RECON_SURFACE_SURFACE_WRITE_H

#include "geom/geom.h"

#include <stdio.h>

typedef struct SurfaceFigures {
    TriangleMesh *mesh;
    double *error, *distance;   // (V) [mm], both NULL if the tree has no points
    int *branch, *boundary;     // (V) tags, NULL if not wanted: branch (-1: a sac); 0 wall, else the number of the flat cap (geom/sweep_mesh.h)
    int *flow;                  // (V) SweepTag of that cap; 0: wall
    double *along;              // (V) [mm] way along the branch
} SurfaceFigures;

void surface_print_stl(FILE *out, const SurfaceFigures *surface);
void surface_print_ply(FILE *out, const SurfaceFigures *surface);
void surface_print_obj(FILE *out, const SurfaceFigures *surface);
void surface_print_vtp(FILE *out, const SurfaceFigures *surface);

#endif

// The surface of a model for export to other programs: without bubbles, specks and parts that are not connected to the inlet.
#ifndef SELDINGER_RECON_SURFACE_MODEL_SURFACE_H
#define SELDINGER_RECON_SURFACE_MODEL_SURFACE_H

#include "base/base.h"
#include "recon/surface/surface_write.h"

typedef struct ModelSurfaceOptions {
    double cell_mm;          // [mm] grid spacing, or the edges of a swept model; 0: chosen for the thinnest branch, or by the local radius
    bool tags;               // branch, way along it and boundary of each vertex; the ends of a swept model are flat
    bool open_inlet;         // cut the surface open at the root's plane
    bool keep_floating;      // keep parts that no point can reach from the inlet
    bool with_error;         // compute the signed distance and the distance of the nearest data point for each vertex
    FILE *figures, *warnings;        // streams for the surface's figures and for the list of removed parts; NULL: not printed
} ModelSurfaceOptions;

// Creates the surface. Returns false with faults, prefixed by `name`; the caller must call model_surface_free() in this case too.
bool model_surface(const ModelField *model, const char *name, const ModelSurfaceOptions *options, SurfaceFigures *surface, Faults *faults);
void model_surface_free(SurfaceFigures *surface);

#endif

// The surface of a model as other programs get it: without bubbles and specks, and without what hangs on nothing.
#ifndef SELDINGER_RECON_SURFACE_MODEL_SURFACE_H
#define SELDINGER_RECON_SURFACE_MODEL_SURFACE_H

#include "base/base.h"
#include "recon/surface/surface_write.h"

typedef struct ModelSurfaceOptions {
    double cell_mm;          // 0: by the thinnest branch
    bool open_inlet;         // cut at the root's plane
    bool keep_floating;      // also parts to which no point gets from the inlet
    bool with_error;         // signed distance and distance of the nearest data point, for each vertex
    FILE *figures, *warnings;        // what the surface is, what was dropped of it; NULL: not said
} ModelSurfaceOptions;

// False with faults, which `name` begins; model_surface_free() is due all the same.
bool model_surface(const VesselTree *tree, const char *name, const ModelSurfaceOptions *options, SurfaceFigures *surface, Faults *faults);
void model_surface_free(SurfaceFigures *surface);

#endif

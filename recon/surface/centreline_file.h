// Centrelines from files, recognised by their content: VTK XML PolyData (.vtp; lines, with VMTK's MaximumInscribedSphereRadius if present), 3D Slicer
// Markups curves (.mrk.json, with a `Radius` measurement if present) and SWC. Several files make one set: curves may overlap. A file has at most 256
// MB. Coordinates are used unchanged; `coordinateSystem` is kept for messages only (import_surface.h looks at the mesh instead).
#ifndef SELDINGER_RECON_SURFACE_CENTRELINE_FILE_H
#define SELDINGER_RECON_SURFACE_CENTRELINE_FILE_H

#include "base/base.h"
#include "geom/geom.h"

#include <stddef.h>

typedef struct CurveSet {
    int point_count;         // P
    Vec3 *point;             // (P) finite
    double *radius;          // (P) > 0, or 0 if not given
    int curve_count;         // C
    int *offset;             // (C+1) curve i owns points offset[i] … offset[i+1], at least 2 of them
} CurveSet;

CurveSet *curve_set_create(void);
void curve_set_free(CurveSet *set);
// Appends a curve; points that repeat the one before are left out, and a curve of fewer than two then adds nothing. `radius` may be NULL. False if
// out of memory.
bool curve_set_add(CurveSet *set, const Vec3 *point, const double *radius, int count);

// Appends the file's curves to `set`. False with faults, `set` is then unchanged.
bool centreline_load(const char *path, CurveSet *set, Faults *faults);
bool centreline_parse(const void *bytes, size_t length, const char *name, CurveSet *set, Faults *faults);
// As text by the extension: .vtp, .mrk.json or .swc; the caller frees. NULL with a fault.
char *centreline_text(const CurveSet *set, const char *name, size_t *length, Faults *faults);

#endif

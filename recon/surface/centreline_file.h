// Reads centrelines from files, recognised by their content: VTK XML PolyData (.vtp; lines, with VMTK's MaximumInscribedSphereRadius if present), 3D Slicer
// Markups curves (.mrk.json, with a `Radius` measurement if present) and SWC. Several files make one set: curves may overlap. A file has at most 256 MB.
// Coordinates are used unchanged; `coordinateSystem` is used in messages only (import_surface.h determines the frame from the mesh instead).
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
    int *offset;             // (C+1) curve i has points offset[i] … offset[i+1]-1, at least 2
} CurveSet;

CurveSet *curve_set_create(void);
void curve_set_free(CurveSet *set);
// Appends a curve without points that repeat the previous one. A curve with fewer than two points left adds nothing. `radius` may be NULL. Returns false if
// out of memory.
bool curve_set_add(CurveSet *set, const Vec3 *point, const double *radius, int count);

// Appends the file's curves to `set`. Returns false with faults; `set` is then unchanged.
bool centreline_load(const char *path, CurveSet *set, Faults *faults);
bool centreline_parse(const void *bytes, size_t length, const char *name, CurveSet *set, Faults *faults);
// Returns the curves as text in the format of the extension of `name`: .vtp, .mrk.json or .swc. The caller frees it. Returns NULL with a fault.
char *centreline_text(const CurveSet *set, const char *name, size_t *length, Faults *faults);

#endif

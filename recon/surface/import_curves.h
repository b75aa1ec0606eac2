// Curves set in the mesh's frame and in its lumen. Lengths mm.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_CURVES_H
#define SELDINGER_RECON_SURFACE_IMPORT_CURVES_H

#include "recon/surface/centreline_file.h"
#include "recon/surface/import_report.h"
#include "recon/surface/mesh_check.h"
#include "recon/surface/mesh_tree.h"

// The frame in which the curves lie inside the mesh: unchanged, with x and y negated, or scaled by `scale`. False with a fault where fewer than half
// of the points of any lie inside. `mesh` is repaired (mesh_repair).
bool import_place_curves(const SurfaceMesh *mesh, double scale, CurveSet *set, ImportReport *report, const char *name, Faults *faults);
enum { SECTION_RAYS = 16 };
// Median distance of the wall from p square to unit `tangent` [mm] within `reach`, the least, and the section's centroid; 0 if there is little wall.
double section_radius(const MeshTree *tree, Vec3 p, Vec3 tangent, double reach, double *least, Vec3 *centroid);
// The sampled curves, corrected where they leave the lumen or graze its wall. NULL if out of memory.
CurveSet *curves_in_lumen(const SurfaceMesh *mesh, const MeshTree *tree, const CurveSet *set, ImportReport *report);

#endif

// Moves curves into the mesh's frame and into its lumen. Lengths in mm.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_CURVES_H
#define SELDINGER_RECON_SURFACE_IMPORT_CURVES_H

#include "recon/surface/centreline_file.h"
#include "recon/surface/import_report.h"
#include "recon/surface/mesh_check.h"
#include "recon/surface/mesh_tree.h"

// Finds the frame in which the curves lie inside the mesh: unchanged, with x and y negated, or scaled by `scale`. Returns false with a fault if fewer than
// half of their points lie inside in every frame. `mesh` must be repaired (mesh_repair).
bool import_place_curves(const SurfaceMesh *mesh, double scale, CurveSet *set, ImportReport *report, const char *name, Faults *faults);
enum { SECTION_RAYS = 16 };
// Median distance [mm] from p to the wall, perpendicular to the unit `tangent`, within `reach`; also the least distance and the cross-section's centroid.
// Returns 0 if there is little wall.
double section_radius(const MeshTree *tree, Vec3 p, Vec3 tangent, double reach, double *least, Vec3 *centroid);
// Returns the sampled curves, corrected where they leave the lumen or graze its wall. Returns NULL if out of memory.
CurveSet *curves_in_lumen(const SurfaceMesh *mesh, const MeshTree *tree, const CurveSet *set, ImportReport *report);

#endif

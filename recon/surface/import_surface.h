// Builds the tree for `fit` from a surface and centrelines. It replaces RBT (Kerrien et al. 2017, section 3) for vessels that are already segmented.
//
// Curves are moved into the mesh's frame, joined to one tree (curves may overlap, or begin on another; a loop is cut where it closes), and resampled to
// nodes; flat lids over the ends of a closed surface are removed, so that inlets and outlets are open; the surface is sampled with a density that suits the
// local radius, and each point is assigned to the node nearest by power distance among those that see it. Lengths in mm.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_SURFACE_H
#define SELDINGER_RECON_SURFACE_IMPORT_SURFACE_H

#include "geom/geom.h"
#include "recon/surface/centreline_file.h"
#include "recon/surface/import_curves.h"
#include "recon/surface/import_report.h"
#include "recon/surface/mesh_check.h"

ImportOptions import_default_options(void);

// Returns NULL with faults. `name` is used in messages.
VesselTree *import_surface(const SurfaceMesh *mesh, const CurveSet *set, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults);

// The curves of `count` files, moved into the mesh's frame (`scale`: see import_place_curves), or of none the computed centrelines. Returns NULL with faults.
CurveSet *import_load_curves(const SurfaceMesh *mesh, double scale, int count, const char *const *file, const ImportOptions *options, ImportReport *report,
                             const char *name, Faults *faults);
// Percentage of the points sampled on the surface that belong to no node. Computed centrelines that leave more than IMPORT_LEFT_MOST_PERCENT are no tree.
double import_left_percent(const ImportReport *report);
enum { IMPORT_LEFT_MOST_PERCENT = 10 };

#endif

// Surfaces that answer contact queries instead of the vessel that they were made from: `contact: mesh`, `smooth_mesh`, `flat_mesh` and `grid` of a scene, and the
// representations of `bench collision`.
#ifndef SELDINGER_SIM_CONTACT_SURFACE_H
#define SELDINGER_SIM_CONTACT_SURFACE_H

#include "geom/geom.h"
#include "sim/scene.h"

// Receives remarks that are not faults about the file or vessel `path`, one line each.
typedef void (*NoteFunction)(const char *path, const char *text);

// The wall of `exact` as triangles (isosurface_of_vessel). `nodes` is a tree with the vessel's centres and radii (points, if it has any, say how far
// the wall goes beyond them); its mesh continues for four radii upstream of the root if the vessel does, and around the last node where `open_end`.
// NULL with a fault. Triangles' vertices carry the tree's nodes. `note` may be NULL.
TriangleMesh *contact_surface_mesh(const Vessel *exact, const VesselTree *nodes, bool open_end, double cell_mm, const char *name, NoteFunction note,
                                   Faults *faults);
// The cell edge [mm] that gives about `triangles` triangles, by the area of the nodes' tubes.
double contact_surface_cell(const VesselTree *nodes, double triangles);

double contact_surface_edge(const TriangleMesh *mesh);      // [mm] the triangles' sides, the mean

// A vessel of `kind` (mesh, smooth_mesh, flat_mesh, grid) from the mesh; the grid samples `exact` on the mesh's cell. Inlet from `exact`. NULL with a fault.
Vessel *contact_surface_vessel(ContactKind kind, const Vessel *exact, const TriangleMesh *mesh, double cell_mm, const char *name, Faults *faults);

// A surface from a file as a wall: read, repaired (recon/surface/mesh_check.h) and scaled. `note` (may be NULL) receives what was found wrong, one
// line each. NULL with faults: unreadable, edges of three triangles, one side only, not millimetres. `scale` 0: not given; the file must then be in
// mm.
TriangleMesh *contact_surface_load(const char *path, double scale, NoteFunction note, Faults *faults);

#endif

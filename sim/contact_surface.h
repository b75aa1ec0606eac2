// Surfaces that replace the vessel that they were made from in contact queries: `contact: mesh`, `smooth_mesh`, `flat_mesh` and `grid` of a scene, and the
// representations of `bench collision`.
#ifndef SELDINGER_SIM_CONTACT_SURFACE_H
#define SELDINGER_SIM_CONTACT_SURFACE_H

#include "geom/geom.h"
#include "sim/scene.h"

// Receives remarks that are not faults about the file or vessel `path`, one line each.
typedef void (*NoteFunction)(const char *path, const char *text);

// The wall of `exact` as triangles (isosurface_of_vessel). `nodes` is a tree with the vessel's centres and radii (points, if it has any, say how far the wall
// extends beyond them); the mesh continues for four radii upstream of the root if the vessel does, and around the last node with `open_end`. The vertices carry
// the tree's nodes. `note` may be NULL. Returns NULL with a fault.
TriangleMesh *contact_surface_mesh(const Vessel *exact, const VesselTree *nodes, bool open_end, double cell_mm, const char *name, NoteFunction note,
                                   Faults *faults);
// The cell edge [mm] that gives about `triangles` triangles, by the area of the nodes' tubes.
double contact_surface_cell(const VesselTree *nodes, double triangles);

double contact_surface_edge(const TriangleMesh *mesh);      // [mm] mean length of the triangles' sides

// A vessel of `kind` (mesh, smooth_mesh, flat_mesh, grid) from the mesh; the grid samples `exact` on the mesh's cell. Inlet from `exact`. NULL with a fault.
Vessel *contact_surface_vessel(ContactKind kind, const Vessel *exact, const TriangleMesh *mesh, double cell_mm, const char *name, Faults *faults);

// Reads a wall surface from a file, repairs it (recon/surface/mesh_check.h) and scales it. `note` (may be NULL) receives the defects found, one line each.
// `scale` 0: not given; the file must then be in mm. Returns NULL with faults: unreadable, edges of three triangles, a one-sided surface, not in millimetres.
TriangleMesh *contact_surface_load(const char *path, double scale, NoteFunction note, Faults *faults);

#endif

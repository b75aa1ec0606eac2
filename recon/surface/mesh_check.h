// Checks a triangle mesh as a vessel's wall, reports defects with counts and first positions, and repairs them: vertices welded, degenerate and
// duplicate triangles and unused vertices removed, orientation unified, outwards (out of the lumen). Defects that cannot be repaired are reported
// too: open edges (an open vessel has them at its ends), edges of three or more triangles, surfaces with one side only. Vertices nearer than 1e-6 of
// the mesh's size are merged, because exporters round.
#ifndef SELDINGER_RECON_SURFACE_MESH_CHECK_H
#define SELDINGER_RECON_SURFACE_MESH_CHECK_H

#include "recon/surface/surface_file.h"

typedef struct MeshFinding {
    int count;
    int first;               // index in the file, from 0: of a vertex for the first two, of a triangle for the others; -1 if none
    Vec3 place;              // [file's unit]
} MeshFinding;

typedef struct MeshCheck {
    int vertex_count, triangle_count;    // as read
    Vec3 low, high;          // bounding box
    double area, volume;     // of the repaired mesh; volume with flat lids over openings, > 0
    int component_count;     // pieces that share no vertex
    int opening_count;       // closed loops of open edges
    int inside_out_count;    // components whose normals (nearly all) pointed into the lumen
    MeshFinding duplicate_vertices, unreferenced_vertices;         // repaired
    MeshFinding degenerate_triangles, duplicate_triangles;         // repaired; triangles without area but with three corners stay
    MeshFinding flipped_triangles;       // repaired; against the rest of their component
    MeshFinding open_edges;  // used by one triangle
    MeshFinding nonmanifold_edges;       // used by three or more
    MeshFinding one_sided_edges;         // where no orientation fits
    bool unit_is_doubtful;   // less than 1 or more than 5000 across: not mm
} MeshCheck;

// Repairs `mesh` in place. False if out of memory.
bool mesh_repair(SurfaceMesh *mesh, MeshCheck *check);
// The same figures, without changing the mesh.
bool mesh_check(const SurfaceMesh *mesh, MeshCheck *check);
// Read (surface_file.h), scaled to mm and repaired. `scale` 0: not given; the file must be in mm. `option` is the user's option for a scale, for
// messages: "--scale ", "mesh_scale: ". NULL with faults: unreadable, not millimetres, one side only, no triangle with an area.
SurfaceMesh *mesh_load_repaired(const char *path, double scale, const char *option, MeshCheck *check, Faults *faults);
// The findings, one line each with a newline; empty if the mesh is sound. Open meshes have a line on openings. `mended`: tell what was repaired.
// NUL-terminated, truncated at `capacity`; returns the number of lines.
int mesh_check_text(const MeshCheck *check, bool mended, char *text, size_t capacity);

#endif

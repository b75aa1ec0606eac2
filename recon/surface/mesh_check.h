// Checks a triangle mesh as a vessel's wall, reports defects with counts and first positions, and repairs them: it welds vertices, removes degenerate and
// duplicate triangles and unused vertices, and orients the triangles consistently outwards (out of the lumen). Defects that cannot be repaired are reported
// too: open edges (an open vessel has them at its ends), edges of three or more triangles, one-sided surfaces. Vertices nearer than 1e-6 of the mesh's size
// are merged, because exporters round coordinates.
#ifndef SELDINGER_RECON_SURFACE_MESH_CHECK_H
#define SELDINGER_RECON_SURFACE_MESH_CHECK_H

#include "recon/surface/surface_file.h"

typedef struct MeshFinding {
    int count;
    int first;               // index in the file, from 0, of a vertex for the first two findings, of a triangle for the others; -1: none
    Vec3 place;              // [file's unit]
} MeshFinding;

typedef struct MeshCheck {
    int vertex_count, triangle_count;    // in the file
    Vec3 low, high;          // corners of the bounding box
    double area, volume;     // of the repaired mesh; the volume is that with flat lids over openings, > 0
    int component_count;     // number of parts that share no vertex
    int opening_count;       // number of closed loops of open edges
    int inside_out_count;    // number of components whose normals (nearly all) pointed into the lumen
    MeshFinding duplicate_vertices, unreferenced_vertices;         // repaired
    MeshFinding degenerate_triangles, duplicate_triangles;         // repaired; triangles without area but with three different corners stay
    MeshFinding flipped_triangles;       // repaired: oriented opposite to the rest of their component
    MeshFinding open_edges;  // edges of one triangle
    MeshFinding nonmanifold_edges;       // edges of three or more triangles
    MeshFinding one_sided_edges;         // edges at which no consistent orientation is possible
    bool unit_is_doubtful;   // size below 1 or above 5000: probably not mm
} MeshCheck;

// Repairs `mesh` in place. Returns false if out of memory.
bool mesh_repair(SurfaceMesh *mesh, MeshCheck *check);
// The same figures, without changing the mesh.
bool mesh_check(const SurfaceMesh *mesh, MeshCheck *check);
// Reads a surface (surface_file.h), scales it to mm and repairs it. `scale` 0: not given; the file must be in mm. `option` is the user's option for a scale,
// for messages: "--scale ", "mesh_scale: ". Returns NULL with faults: unreadable, not millimetres, one-sided, no triangle with an area.
SurfaceMesh *mesh_load_repaired(const char *path, double scale, const char *option, MeshCheck *check, Faults *faults);
// Writes the findings, one line each with a newline; empty if the mesh has no defects. Open meshes have a line on openings. `repaired`: the lines also say
// what was repaired. NUL-terminated, truncated at `capacity`; returns the number of lines.
int mesh_check_text(const MeshCheck *check, bool repaired, char *text, size_t capacity);

#endif

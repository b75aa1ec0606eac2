// Reads triangle surfaces from files, recognised by their content: STL (text, binary), PLY (text, binary of either byte order), OBJ, and VTK XML PolyData
// (.vtp). Polygons are split into fans of triangles. The mesh is read as it is in the file; mesh_check.h reports and repairs its defects. A file has at most
// 2 GB. The caller owns the mesh.
#ifndef SELDINGER_RECON_SURFACE_SURFACE_FILE_H
#define SELDINGER_RECON_SURFACE_SURFACE_FILE_H

#include "base/base.h"
#include "geom/geom.h"

#include <stddef.h>

typedef struct SurfaceMesh {
    int vertex_count, triangle_count;
    Vec3 *vertex;            // (V) finite, in the file's unit
    int (*triangle)[3];      // (T) indices of vertices
} SurfaceMesh;

// Loads a surface. Returns NULL with faults (line or byte): unknown format, truncated file, index out of range, invalid number, no triangle.
SurfaceMesh *surface_load(const char *path, Faults *faults);
// The same from memory; `name` is used in messages.
SurfaceMesh *surface_parse(const void *bytes, size_t length, const char *name, Faults *faults);
void surface_free(SurfaceMesh *mesh);
// Returns true if the first bytes of a file look like one of the formats; used by file_kind. Needs 512 bytes if the file has so many.
bool surface_is_known(const void *head, size_t length, const char *name);

#endif

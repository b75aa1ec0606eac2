// Checks and converts a surface for OpenGL.
#ifndef SELDINGER_RENDER_DRAWABLE_MESH_H
#define SELDINGER_RENDER_DRAWABLE_MESH_H

#include "geom/geom.h"

#include <stddef.h>

// Returns false with a reason if indices are out of range or numbers are not finite.
bool drawable_mesh_check(const TriangleMesh *mesh, char *message, size_t capacity);
// Position relative to `origin` and normal of each vertex, (vertex_count, 6) floats; the caller frees it. Returns NULL with a reason if out of memory.
float *drawable_mesh_floats(const TriangleMesh *mesh, Vec3 origin, char *message, size_t capacity);

#endif

// Whether a surface can be given to OpenGL.
#ifndef SELDINGER_RENDER_DRAWABLE_MESH_H
#define SELDINGER_RENDER_DRAWABLE_MESH_H

#include "geom/geom.h"

#include <stddef.h>

// False with a reason where indices are out of range or numbers are not finite.
bool drawable_mesh_check(const TriangleMesh *mesh, char *message, size_t capacity);
// Position relative to `origin` and normal of each vertex, (vertex_count, 6) floats; the caller frees it. NULL with a reason if memory runs out.
float *drawable_mesh_floats(const TriangleMesh *mesh, Vec3 origin, char *message, size_t capacity);

#endif

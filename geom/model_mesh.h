// The wall of any model (model_field.h) as triangles.
#ifndef SELDINGER_GEOM_MODEL_MESH_H
#define SELDINGER_GEOM_MODEL_MESH_H

#include "geom/isosurface.h"
#include "geom/model_field.h"
#include "geom/sweep_mesh.h"

// Of blobs isosurface_of_tree, of a swept model that of sweep_mesh_create. `cell_mm`: cell size, or the length of the edges; 0: chosen by the radii. The `node` of
// a vertex is one of model->tree. Returns NULL if out of memory, or as these do.
TriangleMesh *triangle_mesh_of_model(const ModelField *model, double cell_mm);
// Makes the nodes of a swept model's mesh those of model->tree.
void model_mesh_take_nodes(const ModelField *model, SweepMesh *mesh);

#endif

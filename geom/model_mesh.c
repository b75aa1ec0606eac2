#include "geom/model_mesh.h"

void model_mesh_take_nodes(const ModelField *model, SweepMesh *mesh)
{
    for (int v = 0; v < mesh->surface->vertex_count; v++)
        mesh->surface->node[v] = model_field_node_at(model, (SweepPlace){.branch = mesh->branch[v], .t = mesh->along[v], .sac = mesh->sac[v]});
}

TriangleMesh *triangle_mesh_of_model(const ModelField *model, double cell_mm)
{
    if (!model->swept)
        return isosurface_of_tree(model->tree, cell_mm > 0 ? cell_mm : isosurface_cell_for(model->tree));
    SweepMeshOptions options = sweep_mesh_default_options();
    options.edge_mm = cell_mm;
    SweepMesh *mesh = sweep_mesh_create(model->field, &options);
    if (!mesh)
        return NULL;
    model_mesh_take_nodes(model, mesh);
    TriangleMesh *surface = mesh->surface;
    mesh->surface = NULL;
    sweep_mesh_free(mesh);
    return surface;
}

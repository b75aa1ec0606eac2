#include "render/picture_model.h"

#include "geom/geom.h"
#include "render/picture.h"

#include <stdlib.h>

bool picture_model_fit(const char *path, const ModelField *model, Faults *faults)
{
    char message[256] = "";
    TriangleMesh *mesh = triangle_mesh_of_model(model, 0);
    PictureOptions options = picture_default_options();
    bool drawn = picture_of_fit(path, &options, model, mesh, NULL, message, sizeof message);
    if (!drawn)
        faults_add(faults, path, 0, 0, "no picture: %s", message);
    triangle_mesh_free(mesh);
    return drawn;
}

bool picture_model_error(const char *path, const char *title, const ModelField *model, double voxel_mm, Faults *faults)
{
    char message[512] = "the tree has no fitted model to draw";
    TriangleMesh *mesh = model_field_exists(model) ? triangle_mesh_of_model(model, 0) : NULL;
    double *error = mesh ? malloc(((size_t)mesh->vertex_count + 1) * sizeof *error) : NULL;
    PictureOptions options = picture_default_options();
    options.title = title;
    bool drawn =
        error && surface_point_error(mesh, model, error, NULL) && picture_of_error(path, &options, model, mesh, error, voxel_mm, message, sizeof message);
    if (!drawn)
        faults_add(faults, path, 0, 0, "no picture: %s", message);
    free(error);
    triangle_mesh_free(mesh);
    return drawn;
}

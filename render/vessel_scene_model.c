// A tip at the border of two power cells alternates between their models, so the last eight are kept.
#include "render/vessel_scene_model.h"

#include "geom/geom.h"

#include <stdlib.h>

enum { KEPT = 8 };

typedef struct ModelWire {
    int node;
    long last_use;             // 0: empty
    TriangleMesh *mesh;        // NULL: the node's model has no surface
} ModelWire;

struct ModelWires {
    const VesselTree *tree;
    long uses;
    ModelWire wire[KEPT];
};

static const Color WIRE_COLOR = {214, 236, 255, 255};
static const double cells_a_radius = 2.5;

ModelWires *model_wires_create(const VesselTree *tree)
{
    ModelWires *models = calloc(1, sizeof *models);
    if (models)
        models->tree = tree && vessel_tree_is_model(tree) ? tree : NULL;
    return models;
}

void model_wires_free(ModelWires *models)
{
    if (!models)
        return;
    for (int k = 0; k < KEPT; k++)
        triangle_mesh_free(models->wire[k].mesh);
    free(models);
}

static const TriangleMesh *mesh_of(ModelWires *models, int node)
{
    ModelWire *oldest = &models->wire[0];
    models->uses++;
    for (int k = 0; k < KEPT; k++) {
        ModelWire *wire = &models->wire[k];
        if (wire->last_use > 0 && wire->node == node) {
            wire->last_use = models->uses;
            return wire->mesh;
        }
        if (wire->last_use < oldest->last_use)
            oldest = wire;
    }
    triangle_mesh_free(oldest->mesh);
    *oldest = (ModelWire){node, models->uses, isosurface_of_model(models->tree, node, models->tree->radius[node] / cells_a_radius)};
    return oldest->mesh;
}

void model_wires_add(ModelWires *models, int node, Strokes *strokes, double line)
{
    if (!models->tree || node < 0 || node >= models->tree->node_count)
        return;
    const TriangleMesh *mesh = mesh_of(models, node);
    // lines closer together than a few pixels would make a white patch
    double spacing = models->tree->radius[node] / cells_a_radius / strokes->camera.mm_per_pixel;
    double clear = fmin(fmax(spacing / (9 * line), 0.12), 1);
    for (int t = 0; mesh && t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            // a closed surface has each edge twice, once in each direction
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            if (a > b)
                continue;
            double toward = vec3_dot(vec3_add(mesh->normal[a], mesh->normal[b]), strokes->camera.back) / 2;
            strokes_line(strokes, mesh->vertex[a], mesh->vertex[b], 0.5 * line, color_with_alpha(WIRE_COLOR, clear * (toward > 0 ? 0.60 : 0.20)));
        }
}

// Local models as wireframes, meshed on first use and cached for the last few nodes. Internal to the live 3D view.
#ifndef SELDINGER_RENDER_VESSEL_SCENE_MODEL_H
#define SELDINGER_RENDER_VESSEL_SCENE_MODEL_H

#include "geom/geom.h"
#include "render/vessel_scene_strokes.h"

typedef struct ModelWires ModelWires;

// Borrows the tree; NULL or a tree without model: no wireframe. Returns NULL if out of memory.
ModelWires *model_wires_create(const VesselTree *tree);
void model_wires_free(ModelWires *models);
// Adds the surface of the node's own model; nothing if there is no such node. Lines on the far side are fainter.
void model_wires_add(ModelWires *models, int node, Strokes *strokes, double line);

#endif

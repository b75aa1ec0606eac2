// The walls of the vessel as two cached pictures with depth: the outer faces and the inner faces nearest to the eye. Internal to the live 3D view.
#ifndef SELDINGER_RENDER_VESSEL_SCENE_LAYERS_H
#define SELDINGER_RENDER_VESSEL_SCENE_LAYERS_H

#include "geom/geom.h"
#include "render/camera.h"
#include "render/view_port.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct VesselLayers VesselLayers;

typedef struct LayersKey {     // the inputs of the pictures
    Camera camera;
    bool is_quick;             // the coarser mesh if there is one; no antialiasing
    bool has_section;
    Vec3 section_normal;       // unit; walls with normal . x > offset are not drawn
    double section_offset;
} LayersKey;

// True if the keys are equal apart from is_quick.
bool layers_key_same(const LayersKey *a, const LayersKey *b);

enum { LAYER_FRONT, LAYER_BACK, LAYER_COUNT };

// Either mesh may be NULL. Returns NULL with a reason.
VesselLayers *vessel_layers_create(const TriangleMesh *fine, const TriangleMesh *coarse, char *message, size_t capacity);
void vessel_layers_destroy(VesselLayers *layers);
// Redraws if the key differs from the last one; returns true if so.
bool vessel_layers_update(VesselLayers *layers, const LayersKey *key);
// Draws background and both layers into the port, whose size is that of the key's camera.
void vessel_layers_show(const VesselLayers *layers, ViewPort port);
// Binds front colour, front depth, back colour and back depth to texture units 0 to 3. Colours are premultiplied.
void vessel_layers_bind(const VesselLayers *layers);

#endif

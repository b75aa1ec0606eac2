// The GL side of fluoroscopy: float layers of the picture's square, the programs that fill, bake and show them.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_LAYERS_H
#define SELDINGER_RENDER_FLUOROSCOPE_LAYERS_H

#include "render/fluoroscope_anatomy.h"
#include "render/fluoroscope_tool.h"

typedef struct Layer {
    unsigned texture, framebuffer;
    int side;                // [pixel], 0: none yet
} Layer;

typedef enum { LAYER_R32F, LAYER_RGBA16 } LayerFormat;

typedef struct LayerPrograms {
    unsigned anatomy, total, bake, tool, show;
    unsigned empty_array;    // a full-screen triangle needs no vertices
    unsigned tool_array, tool_vertices;
    unsigned noise;          // NOISE_TILE^2 R8: normal numbers n as (n + 4) / 8
    unsigned volume;         // 3D R8: Anatomy.level; 0: none
} LayerPrograms;

enum { NOISE_TILE = 512 };

// How brightness follows from transmission; the tool multiplies it by T^brightness and the noise by T^noise.
typedef struct LayerTone {
    int mode;                // XrayMode
    double exposure;         // attenuation that automatic exposure takes away
    double contrast;         // [1/mm] attenuation of undiluted contrast agent
    double gain;             // of DSA
    double quanta;
    bool has_roadmap;
} LayerTone;

bool layers_create(LayerPrograms *programs, const Anatomy *anatomy, char *message, size_t capacity);
void layers_destroy(LayerPrograms *programs);
// Makes the layer anew where its side differs. False where the driver gives none.
bool layer_fit(Layer *layer, int side, LayerFormat format);
void layer_destroy(Layer *layer);
void layer_begin(const Layer *layer);   // bound, cleared to 0, viewport set

void layers_draw_anatomy(const LayerPrograms *programs, const Anatomy *anatomy, const CArm *c_arm, const Layer *to, int steps);

typedef struct LayerStack {  // what is baked
    const Layer *anatomy, *lumen, *roadmap, *mask;   // NULL: none
} LayerStack;
// Attenuation of anatomy and contrast agent, without exposure, into a float layer: DSA's mask.
void layers_draw_total(const LayerPrograms *programs, const LayerStack *stack, const CArm *c_arm, const LayerTone *tone, const Layer *to);
// Brightness / 1.75, noise sigma in units of layers_sigma, roadmap's opacity.
void layers_bake(const LayerPrograms *programs, const LayerStack *stack, const CArm *c_arm, const LayerTone *tone, const float blades[4], uint32_t mask_pulse,
                 const Layer *to);
// The tool's shadow: multiplied into a baked layer, or (as attenuation) added into a float layer.
void layers_draw_tool(const LayerPrograms *programs, const Ribbon *ribbon, const LayerTone *tone, bool as_attenuation, const Layer *to);
// Baked layer and noise into the framebuffer, at x, y.
void layers_show(const LayerPrograms *programs, const Layer *baked, const LayerTone *tone, uint32_t pulse, unsigned framebuffer, int x, int y);

#endif

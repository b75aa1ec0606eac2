// The OpenGL part of fluoroscopy: float layers of the square picture, and the programs that fill, bake and show them.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_LAYERS_H
#define SELDINGER_RENDER_FLUOROSCOPE_LAYERS_H

#include "render/fluoroscope_anatomy.h"
#include "render/fluoroscope_tool.h"
#include "render/xray_pixels.h"

typedef struct Layer {
    unsigned texture, framebuffer;
    int side;                // [pixel], 0: not created yet
} Layer;

typedef enum { LAYER_R32F, LAYER_RG16, LAYER_RGBA16, LAYER_RGBA16_SMOOTH } LayerFormat;   // smooth: to be magnified

typedef struct LayerPrograms {
    unsigned volume_march, shape, total, tool;
    unsigned bake[2];        // live, subtracted
    unsigned opacify[2][2];  // by a lumen of full or lower resolution; without or with a roadmap
    unsigned show[2];        // without or with a roadmap
    unsigned empty_array;    // a full-screen triangle needs no vertices
    unsigned tool_array, tool_vertices;
    unsigned shape_array, shape_vertices;
    unsigned noise;          // NOISE_SIDE^2 R8: normally distributed numbers n as (n + 4) / 8
    uint8_t *tile[2];        // the same in memory, and with columns as rows
    unsigned volume;         // 3D R8: Anatomy.level; 0: none
} LayerPrograms;

// How the brightness follows from the transmission T; the tool multiplies it by T^brightness and the noise by T^noise.
typedef struct LayerTone {
    bool is_subtracted;      // DSA, with a mask
    double exposure;         // attenuation that automatic exposure compensates
    double mean;             // of the anatomy in the beam (anatomy_shown)
    double contrast;         // [1/mm] attenuation of undiluted contrast agent
    double gain;             // gain of DSA
    double quanta;
    bool has_roadmap;
} LayerTone;

void layers_set_state(void);   // sets the GL state that the passes rely on; call once before them. Each pass restores what it changes
bool layers_create(LayerPrograms *programs, const Anatomy *anatomy, char *message, size_t capacity);
void layers_destroy(LayerPrograms *programs);
// Recreates the layer if its size differs. Returns false if the driver fails.
bool layer_fit(Layer *layer, int side, LayerFormat format);
void layer_destroy(Layer *layer);
void layer_put(const Layer *layer, int first, int rows, const float *value);   // (rows, side) from row `first`, counted from below, into a float layer
void layer_begin(const Layer *layer);   // binds it, clears it to 0 and sets the viewport

// Draws the attenuation of rows `first` to `first` + `rows` of the layer.
void layers_draw_anatomy(const LayerPrograms *programs, const Anatomy *anatomy, const ShapeShadows *shadows, const CArm *c_arm, const Layer *to, int first,
                         int rows, int steps);

// Draws what is shown of the attenuation of anatomy and contrast agent, without exposure, into a float layer: the mask of DSA. Layers may be NULL if empty.
void layers_draw_total(const LayerPrograms *programs, const Layer *anatomy, const Layer *lumen, const CArm *c_arm, const LayerTone *tone, const Layer *to);
// Bakes a layer without the lumen. Channels: brightness and noise sigma, each with headroom above white; unused; opening of the blades.
void layers_bake(const LayerPrograms *programs, const Layer *anatomy, const Layer *mask, const LayerTone *tone, const float blades[4], uint32_t mask_pulse,
                 const Layer *to);
// Darkens a baked layer by the lumen within a box [pixel] and writes the opacity of the roadmap (at the resolution of the lumen) to its third channel. A lumen
// at less
// than full resolution is not blurred further.
void layers_opacify(const LayerPrograms *programs, const Layer *bare, const Layer *lumen, const Layer *roadmap, const CArm *c_arm, const LayerTone *tone,
                    const int low[2], const int high[2], const Layer *to);
// Draws the shadow of the tools: multiplied into a baked layer, or (as attenuation) added into a float layer.
void layers_draw_tools(const LayerPrograms *programs, const Ribbon *ribbon, const LayerTone *tone, bool as_attenuation, const Layer *to);
// Draws a baked layer, of any resolution, and noise into a square of the framebuffer at x, y.
void layers_show(const LayerPrograms *programs, const Layer *baked, const LayerTone *tone, uint32_t pulse, unsigned framebuffer, int x, int y, int side);

// The same on the processor (render/xray_pixels.h), from a layer baked without the lumen. `tools`: a layer of two channels for the tools' transmission.
void layers_take_tools(const LayerPrograms *programs, const Ribbon *ribbon, const LayerTone *tone, const Layer *tools, XrayPixels *to);
// Also draws the port around the square.
bool layers_show_pixels(const LayerPrograms *programs, XrayPixels *pixels, bool has_lumen, const CArm *c_arm, const LayerTone *tone, uint32_t pulse,
                        ViewPort port, const int corner[2], int side);
#define SURROUNDINGS_GREY 0.016f

#endif

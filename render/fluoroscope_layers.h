// The GL side of fluoroscopy: float layers of the picture's square, the programs that fill, bake and show them.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_LAYERS_H
#define SELDINGER_RENDER_FLUOROSCOPE_LAYERS_H

#include "render/fluoroscope_anatomy.h"
#include "render/fluoroscope_tool.h"

typedef struct Layer {
    unsigned texture, framebuffer;
    int side;                // [pixel], 0: not created yet
} Layer;

typedef enum { LAYER_R32F, LAYER_RGBA16, LAYER_RGBA16_SMOOTH } LayerFormat;   // smooth: to be shown larger

typedef struct LayerPrograms {
    unsigned anatomy, total, tool;
    unsigned bake[2];        // live, subtracted
    unsigned opacify[2][2];  // by a lumen of full or lower resolution; with a roadmap
    unsigned show[2];        // with a roadmap
    unsigned empty_array;    // a full-screen triangle needs no vertices
    unsigned tool_array, tool_vertices;
    unsigned noise;          // NOISE_TILE^2 R8: normal numbers n as (n + 4) / 8
    unsigned volume;         // 3D R8: Anatomy.level; 0: none
} LayerPrograms;

enum { NOISE_TILE = 512 };

// How brightness follows from transmission; the tool multiplies it by T^brightness and the noise by T^noise.
typedef struct LayerTone {
    bool is_subtracted;      // DSA, with a mask
    double exposure;         // attenuation that automatic exposure takes away
    double contrast;         // [1/mm] attenuation of undiluted contrast agent
    double gain;             // of DSA
    double quanta;
    bool has_roadmap;
} LayerTone;

void layers_set_state(void);   // the GL state that the passes rely on, once before them: each pass restores what it changes
bool layers_create(LayerPrograms *programs, const Anatomy *anatomy, char *message, size_t capacity);
void layers_destroy(LayerPrograms *programs);
// Recreates the layer if its size differs. False if the driver fails.
bool layer_fit(Layer *layer, int side, LayerFormat format);
void layer_destroy(Layer *layer);
void layer_begin(const Layer *layer);   // bound, cleared to 0, viewport set

// Rows `first` to `first` + `rows` of the layer.
void layers_draw_anatomy(const LayerPrograms *programs, const Anatomy *anatomy, const CArm *c_arm, const Layer *to, int first, int rows, int steps);

// Layers may be NULL if empty. Attenuation of anatomy and contrast agent, without exposure, into a float layer: DSA's mask.
void layers_draw_total(const LayerPrograms *programs, const Layer *anatomy, const Layer *lumen, const CArm *c_arm, const LayerTone *tone, const Layer *to);
// Without the lumen: brightness and noise sigma, each with headroom above white; unused; opening of the blades.
void layers_bake(const LayerPrograms *programs, const Layer *anatomy, const Layer *mask, const LayerTone *tone, const float blades[4], uint32_t mask_pulse,
                 const Layer *to);
// A baked layer darkened by the lumen, with the roadmap's opacity (of the lumen's resolution) in its third channel, within a box [pixel]. A lumen of less than
// the full resolution is not blurred further.
void layers_opacify(const LayerPrograms *programs, const Layer *bare, const Layer *lumen, const Layer *roadmap, const CArm *c_arm, const LayerTone *tone,
                    const int low[2], const int high[2], const Layer *to);
// The tools' shadow: multiplied into a baked layer, or (as attenuation) added into a float layer.
void layers_draw_tools(const LayerPrograms *programs, const Ribbon *ribbon, const LayerTone *tone, bool as_attenuation, const Layer *to);
// Baked layer, of whatever resolution, and noise into a square of the framebuffer at x, y.
void layers_show(const LayerPrograms *programs, const Layer *baked, const LayerTone *tone, uint32_t pulse, unsigned framebuffer, int x, int y, int side);

#endif

// Internals of a Fluoroscope, for its own files and tests.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_PARTS_H
#define SELDINGER_RENDER_FLUOROSCOPE_PARTS_H

#include "render/fluoroscope_layers.h"
#include "render/fluoroscope_vessel.h"
#include "render/pulse_memory.h"

// The objects in a picture.
typedef struct Exposure {
    XrayControl xray;
    uint32_t pulse;
    bool has_tools;
    const RibbonPath *tool[TOOLS_MOST];  // of the devices inserted
    Vec3 *position;              // (of all tools' nodes, one tool after the other)
    float *filling;              // (as position)
    float *contrast;             // (N)
} Exposure;

typedef struct PictureLayers {
    Layer bare, base, picture;   // without the lumen; with it; with the tools too. On the processor: no base, and the transmission of the tools alone
} PictureLayers;

typedef struct Fluoroscope Fluoroscope;
struct Fluoroscope {
    FluoroscopeOptions options;  // its pointers are invalid
    bool is_beside;              // vessel, anatomy and programs belong to another one
    int tool_count;
    const ToolLooks *looks;
    int tool_capacity[TOOLS_MOST]; // upper limit of nodes
    RibbonPath tool[TOOLS_MOST][1 + EXCHANGES_MOST];     // of each device, made when it is first seen
    Anatomy anatomy;
    ShapeShadows shadows;        // of the anatomy's solids, at c_arm
    Lumen lumen;
    LayerPrograms programs;
    Layer anatomy_layer, anatomy_next, lumen_layer, roadmap_layer, mask;
    int anatomy_rows;            // rows drawn of anatomy_next, which replaces the coarse one when complete
    PictureLayers still, turning, *now;   // at full and at half resolution; the one that is shown
    bool on_processor;           // lumen, tools and noise are added by `pixels`, else by shaders; fixed before the first draw
    XrayPixels pixels;
    float *solids;               // scratch for the attenuation of the anatomy's solids; NULL: none yet
    Ribbon ribbon;
    RibbonPath sheath;           // count 0: none
    Vec3 sheath_node[2];
    int drawn_low[2], drawn_high[2];   // box of the tools in `picture`
    Exposure shown, masked;      // the picture's and the mask's
    bool has_picture;
    bool is_exact;               // layers are drawn finely at any difference, so that a picture does not depend on the ones before
    // contents of the layers
    bool layers_are_stale, roadmap_is_stale, lumen_is_coarse, anatomy_is_coarse, lumen_is_empty, roadmap_is_empty, lumen_out_of_beam;
    CArm c_arm;                  // C-arm of the layers
    float *lumen_contrast, *roadmap_contrast;   // (N) contrast of these layers
    XrayControl baked;           // settings of the base
    LayerTone tone;
    int side;
    // mask and roadmap
    PulseMemory memory;
    bool has_mask, mask_is_due;  // the mask's layer is drawn; the exposure of the mask is not yet drawn
    CArm mask_c_arm;
    bool is_held;
    int corner[2];
};

#endif

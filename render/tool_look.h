// Appearance of the tools of a scene: names, colours, and stretches of constant width, lumen and attenuation.
#ifndef SELDINGER_RENDER_TOOL_LOOK_H
#define SELDINGER_RENDER_TOOL_LOOK_H

#include "render/color_map.h"
#include "sim/sim.h"

typedef struct TubeStretch {     // part of a tool, from the end of the previous stretch to `end`
    double end;                  // [mm] from the proximal end; the last stretch extends to the tip wherever it is
    double radius, lumen;        // [mm] of its outer surface, > 0; of its inner surface, 0 if it is solid
    double attenuation;          // [1/mm] of the wall, >= 0
} TubeStretch;

typedef struct ToolLook {
    const char *name;            // borrowed
    Color color, on_paper;       // on a dark background and on white
    int stretch_count;           // >= 1
    TubeStretch *stretch;
} ToolLook;

typedef struct ToolLooks {       // zeroed: none
    int count;
    ToolLook tool[TOOLS_MOST];   // outermost first
    ToolLook spare[TOOLS_MOST][EXCHANGES_MOST];  // their replacements, with the same name and colours; stretch_count 0: none
} ToolLooks;

// For `scene`, which must outlive them. Returns false if out of memory; free them even then.
bool tool_looks_make(ToolLooks *looks, const Scene *scene);
void tool_looks_free(ToolLooks *looks);
// Look of the inserted device (PoseTool.fitted).
const ToolLook *tool_looks_of(const ToolLooks *looks, int tool, int fitted);
// The stretch at the arc length `s`; at a border the one before it.
const TubeStretch *tool_look_at(const ToolLook *look, double s);
// The sheath through which the tools enter, as drawn in every view: a pipe that ends at its mouth.
#define SHEATH_SHOWN_MM 25.0
typedef struct SheathLook {
    bool is_there;
    Vec3 mouth, direction;       // unit, into the vessel
    double radius, lumen;        // [mm]: its lumen lets the widest tool through
    double attenuation;          // [1/mm] of its wall
} SheathLook;
SheathLook sheath_look_make(const Scene *scene, const ToolLooks *tools);

// Colours for tools of these kinds, distinguishable with colour-vision deficiency, on a dark background or on paper: one per kind, and an unused colour for a
// repeated kind.
void tool_colors(int count, const ToolKind *kind, bool is_on_paper, Color *color);

#endif

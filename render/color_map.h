// Colour maps that are readable with colour-vision deficiency: a sequential map (inferno without its black and white ends: dark is nothing, bright is much),
// a diverging one (blue, white, red: ColorBrewer's RdBu), and a qualitative one (the seven colours of Okabe and Ito, and tints of them).
#ifndef SELDINGER_RENDER_COLOR_MAP_H
#define SELDINGER_RENDER_COLOR_MAP_H

#include <stdint.h>

typedef struct Color {
    uint8_t r, g, b, a;
} Color;

static inline Color color_rgb(int r, int g, int b) { return (Color){(uint8_t)r, (uint8_t)g, (uint8_t)b, 255}; }
static inline Color color_with_alpha(Color c, double alpha) { return (Color){c.r, c.g, c.b, (uint8_t)(255 * alpha + 0.5)}; }

Color color_sequential(double x);    // x in [0, 1], clamped; NaN counts as 0
Color color_diverging(double x);     // x in [-1, 1], clamped: blue below, red above
Color color_qualitative(int index);  // any index >= 0; repeats after 14

#endif

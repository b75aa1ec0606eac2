// The last passes of fluoroscopy on the processor: the baked picture is darkened by lumen and tools, enlarged if it is coarse, and shown with the noise of the
// pulse, each row once and while it is in the cache. For software renderers, on which a shader takes ten times as long for a pixel; the shaders of
// render/fluoroscope_layers.c are the reference (test_xray_pixels). Needs a current OpenGL context, the same in every call.
#ifndef SELDINGER_RENDER_XRAY_PIXELS_H
#define SELDINGER_RENDER_XRAY_PIXELS_H

#include "render/gl_strip.h"

#include <stddef.h>
#include <stdint.h>

typedef struct PixelField {      // a layer of floats, rows from the bottom
    int side;
    size_t capacity;
    float *value;                // (side, side)
    int (*span)[2];              // (side) in a row only first to end - 1 differ from zero
    // how it is sampled: three weighted texels from `first` for each of `to` places
    int from, to;
    bool is_blurred;
    int *first;                  // (to)
    float *weight[3];            // (to)
} PixelField;

typedef struct PixelRow {        // brightness, noise sigma and opacity of the roadmap, in units of the screen's white
    float *part[3];
    int index;                   // of the row; -1: none
} PixelRow;

typedef struct XrayPixels {      // initialise with zeros
    int side;                    // of the picture before it is enlarged
    int side_most, shown_most;   // for which there is memory
    uint16_t *bare[3];           // (side, side) brightness, sigma and opening of the blades of the baked layer
    uint16_t (*strip)[4];        // (STRIP_ROWS, side) scratch
    PixelField lumen, roadmap;
    int low[2], high[2];         // box of the tools
    uint16_t (*tool)[2];         // (box) transmission for brightness and sigma
    float *sample[2];            // scratch for a row of a field: at its own width, and at the picture's
    PixelRow row, wide[2], mixed;
    int column_from, column_to;  // the picture's side and the screen's, to which these belong:
    int *column;                 // pixel of the picture before each column of the screen …
    float *weight;               // … and the weight of the next
    GlStrip out;
} XrayPixels;

typedef struct PixelLook {
    double unit[2];              // of full scale of the baked brightness and sigma, on a screen where white is 1
    double power[2];             // a lumen of length l darkens brightness and sigma by 2^(-power l)
    double slant;                // tangent of the angle between the rays to both sides of the picture, in the plane of a side
    const uint8_t *noise;        // (NOISE_SIDE, NOISE_SIDE) tile, periodic
    int offset[2];               // of the picture's lower left corner in it
    bool has_lumen, has_roadmap; // false: the field is zero everywhere
} PixelLook;

enum { NOISE_SIDE = 512 };

// Memory for a picture of up to `side` pixels. Returns false if it runs out.
bool xray_pixels_fit(XrayPixels *pixels, int side);
void xray_pixels_free(XrayPixels *pixels);
// What a framebuffer of side x side holds: 16 bits in four channels; its box, if it has 16 bits in two channels.
void xray_pixels_take_bare(XrayPixels *pixels, unsigned framebuffer, int side);
void xray_pixels_take_tools(XrayPixels *pixels, unsigned framebuffer, const int low[2], const int high[2]);
// A field to be filled, zero at first; NULL if memory runs out. Filled: call pixel_field_end().
float *pixel_field_begin(PixelField *field, int side);
void pixel_field_end(PixelField *field);
// Draws into a square of `side` pixels, not less than the picture's, at `corner` of the port, and `dark` (0 to 1) around it. Returns false if the driver fails.
bool xray_pixels_show(XrayPixels *pixels, const PixelLook *look, ViewPort port, const int corner[2], int side, double dark);

#endif

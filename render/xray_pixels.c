// Each row of the picture is made in floats: brightness and sigma of the baked layer, times 2^(-power l) for a ray of length l in contrast agent, times the
// transmission of the tools. Blocks without contrast agent are left out. A picture of half the resolution is enlarged by bilinear interpolation: rows in width
// first, then two of them are mixed, as the texture units of a shader do. Positions, weights and clamping at the edges are those of OpenGL.
#include "render/xray_pixels.h"

#include "base/base.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 16, EDGE = 16 };    // EDGE: floats before a row, which repeat its end

#define LEAST_LENGTH 1e-4f         // [mm] of a ray in contrast agent, which darkens it by 1e-5: what remains where walls cancel in floats

typedef struct SlantRow {
    float first, step, square;     // tangent of the first pixel's ray along the row, from pixel to pixel; square of the tangent across it
} SlantRow;

#define KERNEL_TEXT "render/xray_pixels_kernel.inc"
#include "base/each_simd.inc"

typedef struct PixelKernels {
    void (*split)(int, const uint16_t (*)[4], uint16_t *, uint16_t *, uint16_t *);
    void (*scale)(int, const uint16_t *, float, float *);
    void (*mix)(int, const float *, const float *, float, float *);
    void (*mix_three)(int, const float *const[3], const float[3], float *);
    void (*spread_three)(int, const float *, const int *, float *const[3], int, float *);
    void (*spread)(int, const float *, const int *, const float *, float *);
    void (*spread_twice)(int, const float *, float *);
    void (*darken)(int, const float *, const SlantRow *, const float[2], float *, float *);
    void (*tint)(int, const float *, const SlantRow *, const uint16_t *, float *);
    void (*shade)(int, const uint16_t (*)[2], float *, float *);
    void (*grain)(int, const float *, const float *, const uint8_t *, uint32_t *);
    void (*grain_tinted)(int, const PixelRow *, int, const uint8_t *, const int[2], uint32_t *);
} PixelKernels;

#define FORMS(set)                                                                                                                                             \
    {                                                                                                                                                          \
        split_##set, scale_##set, mix_##set, mix_three_##set, spread_three_##set, spread_##set, spread_twice_##set, darken_##set, tint_##set, shade_##set,     \
            grain_##set, grain_tinted_##set                                                                                                                    \
    }
static const PixelKernels kernels_on[SIMD_COUNT] = SIMD_EACH(FORMS);

static const PixelKernels *kernels(void) { return &kernels_on[simd_level()]; }

// --- memory ---

static float *make_row(int side) { return (float *)calloc((size_t)side + 2 * EDGE + BLOCK, sizeof(float)); }

static void free_row(PixelRow *row)
{
    for (int k = 0; k < 3; k++)
        free(row->part[k]);
    *row = (PixelRow){.index = -1};
}

static bool fit_row(PixelRow *row, int side)
{
    bool good = true;
    free_row(row);
    for (int k = 0; k < 3; k++)
        good = (row->part[k] = make_row(side)) && good;
    return good;
}

static void free_taps(PixelField *field)
{
    free(field->first);
    for (int k = 0; k < 3; k++)
        free(field->weight[k]);
    field->first = NULL;
    field->weight[0] = field->weight[1] = field->weight[2] = NULL;
    field->from = field->to = 0;
}

static void free_field(PixelField *field)
{
    free(field->value);
    free(field->span);
    free_taps(field);
    *field = (PixelField){0};
}

void xray_pixels_free(XrayPixels *pixels)
{
    for (int k = 0; k < 3; k++)
        free(pixels->bare[k]);
    free(pixels->strip);
    free_field(&pixels->lumen);
    free_field(&pixels->roadmap);
    free(pixels->tool);
    free(pixels->sample[0]);
    free(pixels->sample[1]);
    PixelRow *row[4] = {&pixels->row, &pixels->wide[0], &pixels->wide[1], &pixels->mixed};
    for (int k = 0; k < 4; k++)
        free_row(row[k]);
    free(pixels->column);
    free(pixels->weight);
    gl_strip_destroy(&pixels->out);
    *pixels = (XrayPixels){0};
}

bool xray_pixels_fit(XrayPixels *pixels, int side)
{
    if (pixels->side_most == side)
        return true;
    const size_t cells = (size_t)side * (size_t)side;
    xray_pixels_free(pixels);
    for (int k = 0; k < 3; k++)
        pixels->bare[k] = malloc((cells + BLOCK) * sizeof *pixels->bare[k]);
    pixels->strip = malloc((size_t)side * STRIP_ROWS * sizeof *pixels->strip);
    pixels->tool = malloc((cells + BLOCK) * sizeof *pixels->tool);
    pixels->sample[0] = make_row(side);
    pixels->sample[1] = make_row(side);
    pixels->column = malloc((size_t)side * sizeof *pixels->column);
    pixels->weight = malloc((size_t)side * sizeof *pixels->weight);
    bool good = pixels->bare[0] && pixels->bare[1] && pixels->bare[2] && pixels->strip && pixels->tool && pixels->sample[0] && pixels->sample[1] &&
                pixels->column && pixels->weight;
    PixelRow *row[4] = {&pixels->row, &pixels->wide[0], &pixels->wide[1], &pixels->mixed};
    for (int k = 0; good && k < 4; k++)
        good = fit_row(row[k], side);
    if (!good) {
        xray_pixels_free(pixels);
        return false;
    }
    pixels->side_most = side;
    return true;
}

// --- what the layers hold ---

static void forget_rows(XrayPixels *pixels) { pixels->wide[0].index = pixels->wide[1].index = -1; }

void xray_pixels_take_bare(XrayPixels *pixels, unsigned framebuffer, int side)
{
    SEL_ASSERT(side <= pixels->side_most, "there is memory for the picture");
    pixels->side = side;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    for (int y = 0; y < side; y += STRIP_ROWS) {
        const int rows = side - y < STRIP_ROWS ? side - y : STRIP_ROWS;
        const size_t at = (size_t)y * (size_t)side;
        glReadPixels(0, y, side, rows, GL_RGBA, GL_UNSIGNED_SHORT, pixels->strip);
        kernels()->split(rows * side, (const uint16_t(*)[4])pixels->strip, pixels->bare[0] + at, pixels->bare[1] + at, pixels->bare[2] + at);
    }
}

static bool fit_field(PixelField *field, int side)
{
    const size_t cells = (size_t)side * (size_t)side;
    if (field->capacity >= cells)
        return true;
    free_field(field);
    field->value = malloc(cells * sizeof *field->value);
    field->span = malloc((size_t)side * sizeof *field->span);
    if (!field->value || !field->span) {
        free_field(field);
        return false;
    }
    field->capacity = cells;
    return true;
}

float *pixel_field_begin(PixelField *field, int side)
{
    if (!fit_field(field, side))
        return NULL;
    field->side = side;
    memset(field->value, 0, (size_t)side * (size_t)side * sizeof *field->value);
    return field->value;
}

void pixel_field_end(PixelField *field)
{
    const int side = field->side;
    for (int y = 0; y < side; y++) {
        const float *row = field->value + (size_t)y * (size_t)side;
        int first = 0, end = side;
        while (first < end && row[first] == 0)
            first++;
        while (end > first && row[end - 1] == 0)
            end--;
        field->span[y][0] = first;
        field->span[y][1] = end;
    }
}

void xray_pixels_take_tools(XrayPixels *pixels, unsigned framebuffer, const int low[2], const int high[2])
{
    const int width = high[0] - low[0], height = high[1] - low[1];
    memcpy(pixels->low, low, sizeof pixels->low);
    memcpy(pixels->high, high, sizeof pixels->high);
    if (width < 1 || height < 1) {
        pixels->high[1] = pixels->low[1];
        return;
    }
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(low[0], low[1], width, height, GL_RG, GL_UNSIGNED_SHORT, pixels->tool);
}

// --- a row of a field ---

// The texels and weights of a sample: the two beside it, or for the blur of the detector the mean of two such samples, half a texel before and behind it.
static int place_taps(int at, int from, int to, bool is_blurred, float weight[3])
{
    const double place = (at + 0.5) * from / to - (is_blurred ? 1 : 0.5), before = floor(place), part = place - before;
    weight[0] = (float)(is_blurred ? 0.5 * (1 - part) : 1 - part);
    weight[1] = (float)(is_blurred ? 0.5 : part);
    weight[2] = (float)(is_blurred ? 0.5 * part : 0);
    return (int)before;
}

static bool fit_taps(PixelField *field, int to, bool is_blurred)
{
    const int from = field->side;
    if (field->from == from && field->to == to && field->is_blurred == is_blurred)
        return true;
    free_taps(field);
    field->first = malloc((size_t)to * sizeof *field->first);
    for (int k = 0; k < 3; k++)
        field->weight[k] = malloc((size_t)to * sizeof *field->weight[k]);
    if (!field->first || !field->weight[0] || !field->weight[1] || !field->weight[2]) {
        free_taps(field);
        return false;
    }
    for (int x = 0; x < to; x++) {
        float weight[3];
        field->first[x] = place_taps(x, from, to, is_blurred, weight);
        for (int k = 0; k < 3; k++)
            field->weight[k][x] = weight[k];
    }
    field->from = from;
    field->to = to;
    field->is_blurred = is_blurred;
    return true;
}

static int limited(int i, int count) { return i < 0 ? 0 : i < count ? i : count - 1; }

// Samples row y of the picture into out[range[0]] to out[range[1] - 1]; it is zero elsewhere, and a block of zeros follows. Returns false if all is zero.
static bool sample_row(const PixelField *field, int y, float *own, float *out, int range[2])
{
    const int from = field->from, to = field->to;
    float weight[3];
    const float *texel[3];
    int first = place_taps(y, from, to, field->is_blurred, weight), low = from, high = 0;
    for (int k = 0; k < 3; k++) {
        const int row = limited(first + k, from), *span = field->span[row];
        texel[k] = field->value + (size_t)row * (size_t)from;
        if (span[0] < span[1]) {
            low = span[0] < low ? span[0] : low;
            high = span[1] > high ? span[1] : high;
        }
    }
    if (low >= high)
        return false;
    const int begin = low > EDGE / 2 ? low - EDGE / 2 : 0, end = high + EDGE / 2 < from ? high + EDGE / 2 : from;
    const float *const part[3] = {texel[0] + begin, texel[1] + begin, texel[2] + begin};
    kernels()->mix_three(end - begin, part, weight, own + begin);
    for (int k = 1; k <= 3; k++) {
        own[begin - k] = begin == 0 ? own[0] : 0;
        own[end - 1 + k] = end == from ? own[from - 1] : 0;
    }
    const double ratio = (double)to / from;
    range[0] = limited((int)floor((low - 3) * ratio), to);
    range[1] = limited((int)ceil((high + 3) * ratio), to) + 1;
    kernels()->spread_three(range[1] - range[0], own, field->first + range[0], field->weight, range[0], out + range[0]);
    memset(out + range[1], 0, BLOCK * sizeof *out);
    return true;
}

// --- a row of the picture ---

static SlantRow slant_of(const PixelLook *look, int side, int x, int y)
{
    const double across = look->slant * ((y + 0.5) / side - 0.5), step = look->slant / side;
    return (SlantRow){(float)(look->slant * ((x + 0.5) / side - 0.5)), (float)step, (float)(across * across)};
}

static void add_roadmap(XrayPixels *pixels, const PixelLook *look, int y, float *opacity)
{
    const int side = pixels->side;
    int range[2];
    memset(opacity, 0, (size_t)side * sizeof *opacity);
    if (!sample_row(&pixels->roadmap, y, pixels->sample[0] + EDGE, pixels->sample[1] + EDGE, range))
        return;
    const SlantRow slant = slant_of(look, side, range[0], y);
    kernels()->tint(range[1] - range[0], pixels->sample[1] + EDGE + range[0], &slant, pixels->bare[2] + (size_t)y * (size_t)side + range[0],
                    opacity + range[0]);
}

static void make_row_of(XrayPixels *pixels, const PixelLook *look, int y)
{
    const PixelKernels *run = kernels();
    const int side = pixels->side, *low = pixels->low, *high = pixels->high;
    const size_t at = (size_t)y * (size_t)side;
    float *part[3] = {pixels->row.part[0] + EDGE, pixels->row.part[1] + EDGE, pixels->row.part[2] + EDGE};
    int range[2];
    for (int k = 0; k < 2; k++)
        run->scale(side, pixels->bare[k] + at, (float)(look->unit[k] / 65535), part[k]);
    if (look->has_lumen && sample_row(&pixels->lumen, y, pixels->sample[0] + EDGE, pixels->sample[1] + EDGE, range)) {
        const SlantRow slant = slant_of(look, side, range[0], y);
        const float power[2] = {(float)look->power[0], (float)look->power[1]};
        run->darken(range[1] - range[0], pixels->sample[1] + EDGE + range[0], &slant, power, part[0] + range[0], part[1] + range[0]);
    }
    if (look->has_roadmap)
        add_roadmap(pixels, look, y, part[2]);
    if (y >= low[1] && y < high[1])
        run->shade(high[0] - low[0], (const uint16_t(*)[2])pixels->tool + (size_t)(y - low[1]) * (size_t)(high[0] - low[0]), part[0] + low[0],
                   part[1] + low[0]);
}

// --- the screen ---

static void fit_columns(XrayPixels *pixels, int side)
{
    const int from = pixels->side;
    if (pixels->column_from == from && pixels->column_to == side)
        return;
    for (int x = 0; x < side; x++) {
        const double place = fmin(fmax((x + 0.5) * from / side - 0.5, 0), from - 1);
        pixels->column[x] = (int)place;
        pixels->weight[x] = (float)(place - (int)place);
    }
    pixels->column_from = from;
    pixels->column_to = side;
}

// Row y of the picture at the screen's width.
static const PixelRow *widened(XrayPixels *pixels, const PixelLook *look, int y, int side)
{
    PixelRow *wide = &pixels->wide[y % 2];
    const int from = pixels->side;
    if (wide->index == y)
        return wide;
    make_row_of(pixels, look, y);
    for (int k = 0; k < (look->has_roadmap ? 3 : 2); k++) {
        float *row = pixels->row.part[k] + EDGE;
        row[-1] = row[0];
        row[from] = row[from - 1];
        if (2 * from == side)
            kernels()->spread_twice(from, row, wide->part[k]);
        else
            kernels()->spread(side, row, pixels->column, pixels->weight, wide->part[k]);
    }
    wide->index = y;
    return wide;
}

static void grain_row(const PixelLook *look, const PixelRow *row, int edge, int y, int side, bool is_turned, uint32_t *out)
{
    const int shift[2] = {is_turned ? 16 : 0, is_turned ? 0 : 16}, last = NOISE_SIDE - 1;
    const uint8_t *noise = look->noise + (size_t)((y + look->offset[1]) & last) * NOISE_SIDE;
    for (int x = 0, count; x < side; x += count) {
        const int at = (x + look->offset[0]) & last;
        count = NOISE_SIDE - at < side - x ? NOISE_SIDE - at : side - x;
        if (look->has_roadmap)
            kernels()->grain_tinted(count, row, edge + x, noise + at, shift, out + x);
        else
            kernels()->grain(count, row->part[0] + edge + x, row->part[1] + edge + x, noise + at, out + x);
    }
}

// Row y of the screen.
static void show_row(XrayPixels *pixels, const PixelLook *look, int y, int side, uint32_t *out)
{
    const bool is_turned = pixels->out.is_turned;
    if (pixels->side == side) {
        make_row_of(pixels, look, y);
        grain_row(look, &pixels->row, EDGE, y, side, is_turned, out);
        return;
    }
    const double place = fmin(fmax((y + 0.5) * pixels->side / side - 0.5, 0), pixels->side - 1);
    const int below = (int)place;
    const PixelRow *a = widened(pixels, look, below, side), *b = widened(pixels, look, limited(below + 1, pixels->side), side);
    for (int k = 0; k < (look->has_roadmap ? 3 : 2); k++)
        kernels()->mix(side, a->part[k], b->part[k], (float)(place - below), pixels->mixed.part[k]);
    grain_row(look, &pixels->mixed, 0, y, side, is_turned, out);
}

static bool fit_fields(XrayPixels *pixels, const PixelLook *look)
{
    const bool is_blurred = (look->has_lumen ? pixels->lumen.side : pixels->roadmap.side) >= pixels->side;   // as opacify of the shaders
    return (!look->has_lumen || fit_taps(&pixels->lumen, pixels->side, is_blurred)) &&
           (!look->has_roadmap || fit_taps(&pixels->roadmap, pixels->side, is_blurred));
}

static void fill_pixels(uint32_t *out, int count, uint32_t value)
{
    for (int i = 0; i < count; i++)
        out[i] = value;
}

bool xray_pixels_show(XrayPixels *pixels, const PixelLook *look, ViewPort port, const int corner[2], int side, double dark)
{
    SEL_ASSERT(pixels->side <= side && side <= pixels->side_most, "the square is not smaller than the picture, and there is memory for its rows");
    if (!fit_fields(pixels, look) || !gl_strip_fit(&pixels->out, port))
        return false;
    const uint32_t ground = (uint32_t)lround(255 * dark) * 0x010101u | 0xff000000u;
    const int right = corner[0] + side;
    fit_columns(pixels, side);
    forget_rows(pixels);
    gl_strip_begin(&pixels->out, port);
    for (int first = 0; first < port.height; first += STRIP_ROWS) {
        const int rows = port.height - first < STRIP_ROWS ? port.height - first : STRIP_ROWS;
        for (int k = 0; k < rows; k++) {
            const int y = first + k - corner[1], at = pixels->out.is_turned ? rows - 1 - k : k;
            uint32_t *out = pixels->out.pixel + (size_t)at * (size_t)port.width;
            const bool is_beside = y < 0 || y >= side;
            fill_pixels(out, is_beside ? port.width : corner[0], ground);
            if (is_beside)
                continue;
            show_row(pixels, look, y, side, out + corner[0]);
            fill_pixels(out + right, port.width - right, ground);
        }
        gl_strip_send(&pixels->out, port, first, rows);
    }
    return true;
}

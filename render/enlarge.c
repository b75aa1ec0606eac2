// First each row of the picture is enlarged in width: a pixel is spread over a word of 64 bits, 16 for each channel, so that one multiplication weighs all four.
// Then each row of the result is mixed from two of these, in loops over channels that a compiler makes vectors of.
#include "render/enlarge.h"

#include "base/base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ONE = 256, CHANNELS = 4 };

void enlarger_free(Enlarger *enlarger)
{
    free(enlarger->picture);
    free(enlarger->spread);
    free(enlarger->row[0]);
    free(enlarger->row[1]);
    free(enlarger->column);
    free(enlarger->weight);
    *enlarger = (Enlarger){0};
}

// Where pixel `at` of `to` lies among `from` pixels, pixel centres at halves: the pixel before it, and the weight of the next.
static int place(int at, int from, int to, int *weight)
{
    double x = (at + 0.5) * from / to - 0.5;
    x = fmin(fmax(x, 0), from - 1);
    int i = (int)x;
    *weight = (int)lround((x - i) * ONE);
    return i;
}

bool enlarger_fit(Enlarger *e, int from_width, int from_height, int to_width, int to_height)
{
    if (e->from[0] == from_width && e->from[1] == from_height && e->to[0] == to_width && e->to[1] == to_height)
        return true;
    enlarger_free(e);
    e->picture = malloc((size_t)from_width * (size_t)from_height * sizeof *e->picture);
    e->spread = calloc((size_t)from_width + 1, sizeof *e->spread);
    for (int i = 0; i < 2; i++)
        e->row[i] = malloc((size_t)to_width * sizeof *e->row[i]);
    e->column = malloc((size_t)to_width * sizeof *e->column);
    e->weight = malloc((size_t)to_width * sizeof *e->weight);
    if (!e->picture || !e->spread || !e->row[0] || !e->row[1] || !e->column || !e->weight) {
        enlarger_free(e);
        return false;
    }
    e->from[0] = from_width, e->from[1] = from_height;
    e->to[0] = to_width, e->to[1] = to_height;
    for (int x = 0; x < to_width; x++)
        e->column[x] = place(x, from_width, to_width, &e->weight[x]);
    enlarger_begin(e);
    return true;
}

void enlarger_begin(Enlarger *e) { e->row_of[0] = e->row_of[1] = -1; }

static uint64_t spread(uint32_t p)
{
    return (uint64_t)(p & 0xff) | (uint64_t)(p >> 8 & 0xff) << 16 | (uint64_t)(p >> 16 & 0xff) << 32 | (uint64_t)(p >> 24) << 48;
}

static uint64_t mixed(uint64_t a, uint64_t b, uint64_t weight)
{
    const uint64_t half = 0x0080008000800080u, bytes = 0x00ff00ff00ff00ffu;
    return (a * (ONE - weight) + b * weight + half) >> 8 & bytes;
}

static uint32_t exchanged(uint32_t p) { return (p & 0xff00ff00u) | (p & 0xff) << 16 | (p >> 16 & 0xff); }

static const uint64_t *widened(Enlarger *e, int y, bool turned)
{
    const int i = y % 2, width = e->from[0];
    if (e->row_of[i] == y)
        return e->row[i];
    const uint32_t *from = e->picture + (size_t)y * (size_t)width;
    uint64_t *to = e->row[i];
    for (int x = 0; x < width; x++)
        e->spread[x] = spread(turned ? exchanged(from[x]) : from[x]);
    e->spread[width] = e->spread[width - 1];
    for (int x = 0; x < e->to[0]; x++)
        to[x] = mixed(e->spread[e->column[x]], e->spread[e->column[x] + 1], (uint64_t)e->weight[x]);
    e->row_of[i] = y;
    return to;
}

#define KERNEL_TEXT "render/enlarge_kernel.inc"
#include "base/each_simd.inc"
static void (*const mix_rows_on[SIMD_COUNT])(const uint16_t *, const uint16_t *, int, int, uint8_t *) = SIMD_FORMS(mix_rows);

void enlarger_rows(Enlarger *e, int first, int count, bool turned, uint32_t *out)
{
    const int width = e->to[0], height = e->from[1];
    for (int y = first; y < first + count; y++) {
        int weight, above = place(y, height, e->to[1], &weight), next = above + 1 < height ? above + 1 : above;
        const uint64_t *a = widened(e, above, turned), *b = widened(e, next, turned);
        uint32_t *to = out + (size_t)(turned ? first + count - 1 - y : y - first) * (size_t)width;
        mix_rows_on[simd_level()]((const uint16_t *)(const void *)a, (const uint16_t *)(const void *)b, weight, CHANNELS * width, (uint8_t *)to);
    }
}

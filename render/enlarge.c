// A pixel is spread over a word of 64 bits, 16 for each channel, so that one multiplication weighs all four.
#include "render/enlarge.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ONE = 256 };

void enlarger_free(Enlarger *enlarger)
{
    free(enlarger->picture);
    free(enlarger->enlarged);
    free(enlarger->row);
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
    e->enlarged = malloc((size_t)to_width * (size_t)to_height * sizeof *e->enlarged);
    e->row = calloc((size_t)from_width + 1, sizeof *e->row);
    e->column = malloc((size_t)to_width * sizeof *e->column);
    e->weight = malloc((size_t)to_width * sizeof *e->weight);
    if (!e->picture || !e->enlarged || !e->row || !e->column || !e->weight) {
        enlarger_free(e);
        return false;
    }
    e->from[0] = from_width, e->from[1] = from_height;
    e->to[0] = to_width, e->to[1] = to_height;
    for (int x = 0; x < to_width; x++)
        e->column[x] = place(x, from_width, to_width, &e->weight[x]);
    return true;
}

static uint64_t spread(uint32_t p)
{
    return (uint64_t)(p & 0xff) | (uint64_t)(p >> 8 & 0xff) << 16 | (uint64_t)(p >> 16 & 0xff) << 32 | (uint64_t)(p >> 24) << 48;
}

static uint64_t mixed(uint64_t a, uint64_t b, uint64_t weight)
{
    const uint64_t half = 0x0080008000800080u, bytes = 0x00ff00ff00ff00ffu;
    return (a * (ONE - weight) + b * weight + half) >> 8 & bytes;
}

static uint32_t joined(uint64_t p)
{
    p |= p >> 8;                         // two channels in the lower half of each 32 bits
    return (uint32_t)((p & 0xffff) | (p >> 16 & 0xffff0000u));
}

static uint32_t exchanged(uint32_t p) { return (p & 0xff00ff00u) | (p & 0xff) << 16 | (p >> 16 & 0xff); }

void enlarger_run(Enlarger *e, bool turned)
{
    const int width = e->from[0], height = e->from[1];
    for (int y = 0; y < e->to[1]; y++) {
        int weight, above = place(y, height, e->to[1], &weight), next = above + 1 < height ? above + 1 : above;
        const uint32_t *a = e->picture + (size_t)above * (size_t)width, *b = e->picture + (size_t)next * (size_t)width;
        for (int x = 0; x < width; x++)
            e->row[x] = mixed(spread(turned ? exchanged(a[x]) : a[x]), spread(turned ? exchanged(b[x]) : b[x]), (uint64_t)weight);
        e->row[width] = e->row[width - 1];
        uint32_t *out = e->enlarged + (size_t)(turned ? e->to[1] - 1 - y : y) * (size_t)e->to[0];
        for (int x = 0; x < e->to[0]; x++)
            out[x] = joined(mixed(e->row[e->column[x]], e->row[e->column[x] + 1], (uint64_t)e->weight[x]));
    }
}

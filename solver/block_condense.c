// From both ends towards a node `middle`, each end in runs of nodes between two kept ones, `origin` behind and the next kept one ahead.
//
//   D_i = T d T^T,  C = A(i', i) with the neighbour i' ahead,  O = A(origin, i),  Z = C T^-T d^-1,  H = O T^-T d^-1
//   A(i', i') loses Z d Z^T,  A(origin, i') becomes -H d Z^T,  A(origin, origin) loses H d H^T
//   y = T^-1 b,  b_i' loses Z y,  b_origin loses H y;   back:  x = T^-T (d^-1 y - Z^T x' - H^T x_origin)
// Interleaved as in block_chain.c, and for the same reason; the lane behind the last row of C and O carries y.
#include "solver/block_condense.h"

#include "geom/simd.h"
#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// A node holds T, Z (lane n: d^-1 y) and H by columns, and 1/d.
#define T_AT 0
#define Z_AT PANEL
#define H_AT (2 * PANEL)
#define INVERSE_AT (3 * PANEL)
#define NODE (3 * PANEL + COLUMN)
enum { LIVE_BYTES = 1 + BLOCK_LARGEST };
static size_t node_doubles(int size) { return (size_t)(3 * BLOCK_PANEL(size) + BLOCK_COLUMN(size)); }

struct BlockCondenser {
    int count, size, middle;
    bool *keep;
    int *place;                  // (M) in the small chain, -1: eliminated …
    int *origin;                 // (M) … into this one and the next ahead; -1: from an end of the chain
    unsigned char *live;         // (M, LIVE_BYTES) how many unknowns of a node are coupled to anything, and which; the others have unit rows
    double *node;
    double *side;
    BlockChain small;
};

BlockCondenser *block_condenser_create(int count, int size)
{
    BlockCondenser *k = count < 1 || !block_size_is_known(size) ? NULL : calloc(1, sizeof *k);
    if (!k)
        return NULL;
    size_t m = (size_t)count, bytes = m * node_doubles(size) * sizeof *k->node;
    k->count = count;
    k->size = size;
    k->keep = calloc(m, sizeof *k->keep);
    k->place = calloc(m, sizeof *k->place);
    k->origin = calloc(m, sizeof *k->origin);
    k->side = calloc((size_t)size * m, sizeof *k->side);
    k->live = calloc(m, LIVE_BYTES);
    k->node = aligned_alloc(64, bytes);
    if (!block_chain_create(&k->small, count, size) || !k->keep || !k->place || !k->origin || !k->side || !k->live || !k->node) {
        block_condenser_destroy(k);
        return NULL;
    }
    memset(k->node, 0, bytes);
    return k;
}

void block_condenser_destroy(BlockCondenser *k)
{
    if (!k)
        return;
    block_chain_destroy(&k->small);
    free(k->keep);
    free(k->place);
    free(k->origin);
    free(k->side);
    free(k->live);
    free(k->node);
    free(k);
}

bool *block_condenser_keep(BlockCondenser *k) { return k->keep; }
double *block_condenser_side(BlockCondenser *k) { return k->side; }
int block_condenser_place(const BlockCondenser *k, int node) { return k->place[node]; }

// One end: the node it is at, and the kept one behind it.
typedef struct Walk {
    int step, at, origin;
    bool runs;                   // the node before was eliminated
} Walk;

static double *coupling(BlockCondenser *k, int place) { return k->small.lower + (size_t)place * (size_t)(k->size * k->size); }

// Goes on to the next node to eliminate; false at the middle.
static bool seek(BlockCondenser *k, const BlockChain *a, Walk *w)
{
    const size_t block = (size_t)(k->size * k->size);
    for (; w->at != k->middle && k->place[w->at] >= 0; w->at += w->step) {
        int next = w->at + w->step, behind = w->step > 0 ? w->at : next;
        if (k->place[next] >= 0)
            memcpy(coupling(k, k->place[behind]), a->lower + (size_t)behind * block, block * sizeof(double));
        w->origin = w->at;
        w->runs = false;
    }
    return w->at != k->middle;
}

static const double zeros[BLOCK_LARGEST];

#define KERNELS "solver/block_condense_kernel.inc"
#define SMALL 6
#include "solver/block_sizes.inc"

static void (*const eliminate_on[BLOCK_SIZES][SIMD_COUNT])(BlockCondenser *, const BlockChain *, const double *) = BLOCK_FORMS(eliminate);
static void (*const expand_on[BLOCK_SIZES][SIMD_COUNT])(const BlockCondenser *, double *) = BLOCK_FORMS(expand);

// The eliminated node with as many eliminated ones before it as behind is kept.
static void choose_middle(BlockCondenser *k)
{
    int left = 0, seen = 0;
    for (int i = 0; i < k->count; i++)
        left += !k->keep[i];
    k->middle = k->count / 2;
    for (int i = 0; i < k->count && seen <= left / 2; i++)
        if (!k->keep[i]) {
            seen++;
            k->middle = i;
        }
    k->keep[k->middle] = true;
}

static bool is_coupled(const BlockChain *a, int node, int r)
{
    const int n = a->size;
    const size_t block = (size_t)(n * n), i = (size_t)node;
    const double *d = a->diag + block * i, *before = a->lower + block * (i > 0 ? i - 1 : 0), *after = a->lower + block * i;
    bool any = d[(n + 1) * r] != 1;
    for (int c = 0; c < n && !any; c++)
        any = (c != r && d[n * r + c] != 0) || (node > 0 && before[n * r + c] != 0) || (node + 1 < a->count && after[n * c + r] != 0);
    return any;
}

static void find_live(BlockCondenser *k, const BlockChain *a)
{
    for (int i = 0; i < a->count; i++) {
        unsigned char *live = k->live + LIVE_BYTES * i;
        live[0] = 0;
        for (int r = 0; r < a->size; r++)
            if (is_coupled(a, i, r))
                live[++live[0]] = (unsigned char)r;
    }
}

const BlockChain *block_condense(BlockCondenser *k, const BlockChain *chain, const double *b)
{
    const size_t n = (size_t)k->size, block = n * n;
    k->count = chain->count;
    choose_middle(k);
    if (k->size > 6)     // of the smallest blocks the kernels take all
        find_live(k, chain);
    k->small.count = 0;
    for (int i = 0; i < k->count; i++) {
        k->place[i] = k->keep[i] ? k->small.count : -1;
        if (!k->keep[i])
            continue;
        size_t p = (size_t)k->small.count++;
        memcpy(k->small.diag + p * block, chain->diag + (size_t)i * block, block * sizeof(double));
        memcpy(k->side + n * p, b + n * (size_t)i, n * sizeof(double));
        k->keep[i] = false;
    }
    eliminate_on[block_size_index(k->size)][simd_level()](k, chain, b);
    const size_t stride = node_doubles(k->size);
    const double *inverse = k->node + stride - BLOCK_COLUMN(k->size);
    bool ok = true;
    for (int i = 0; i < k->count; i++, inverse += stride)
        for (int j = 0; k->place[i] < 0 && j < k->size; j++)
            ok &= inverse[j] > 0 && inverse[j] <= DBL_MAX;
    return ok ? &k->small : NULL;
}

void block_condenser_expand(const BlockCondenser *k, const double *kept, double *x)
{
    const size_t n = (size_t)k->size;
    for (int i = 0; i < k->count; i++)
        if (k->place[i] >= 0)
            memcpy(x + n * (size_t)i, kept + n * (size_t)k->place[i], n * sizeof *x);
    expand_on[block_size_index(k->size)][simd_level()](k, x);
}

// From both ends towards a node `middle`, each end in runs of nodes between two kept ones, `origin` behind and the next kept one ahead.
//
//   D_i = T d T^T,  C = A(i', i) with the neighbour i' ahead,  O = A(origin, i),  Z = C T^-T d^-1,  H = O T^-T d^-1
//   A(i', i') loses Z d Z^T,  A(origin, i') becomes -H d Z^T,  A(origin, origin) loses H d H^T
//   y = T^-1 b,  b_i' loses Z y,  b_origin loses H y;   back:  x = T^-T (d^-1 y - Z^T x' - H^T x_origin)
// Interleaved as in block_chain.c, and for the same reason; lane 6 of C and O carries y.
#include "solver/block_condense.h"

#include "geom/simd.h"
#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Per node, by columns of eight.
typedef struct Node {
    _Alignas(64) double t[6][COLUMN], z[6][COLUMN], h[6][COLUMN]; // z lane 6: d^-1 y
    double inverse[COLUMN];
    int place;                   // in the small chain, -1: eliminated …
    int origin;                  // … into this one and the next ahead; -1: from an end of the chain
} Node;

struct BlockCondenser {
    int count, middle;
    bool *keep;
    Node *node;
    double *side;
    BlockChain small;
};

BlockCondenser *block_condenser_create(int count)
{
    BlockCondenser *k = count < 1 ? NULL : calloc(1, sizeof *k);
    if (!k)
        return NULL;
    size_t m = (size_t)count, bytes = m * sizeof *k->node;
    k->count = count;
    k->keep = calloc(m, sizeof *k->keep);
    k->side = calloc(6 * m, sizeof *k->side);
    k->node = aligned_alloc(64, bytes);
    if (!block_chain_create(&k->small, count) || !k->keep || !k->side || !k->node) {
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
    free(k->side);
    free(k->node);
    free(k);
}

bool *block_condenser_keep(BlockCondenser *k) { return k->keep; }
double *block_condenser_side(BlockCondenser *k) { return k->side; }
int block_condenser_place(const BlockCondenser *k, int node) { return k->node[node].place; }

// One end: the node it is at, and the kept one behind it.
typedef struct Walk {
    int step, at, origin;
    bool runs;                   // the node before was eliminated
} Walk;

static double *coupling(BlockCondenser *k, int place) { return k->small.lower + (size_t)place * BLOCK; }

// Goes on to the next node to eliminate; false at the middle.
static bool seek(BlockCondenser *k, const BlockChain *a, Walk *w)
{
    for (; w->at != k->middle && k->node[w->at].place >= 0; w->at += w->step) {
        int next = w->at + w->step, behind = w->step > 0 ? w->at : next;
        if (k->node[next].place >= 0)
            memcpy(coupling(k, k->node[behind].place), a->lower + (size_t)behind * BLOCK, BLOCK * sizeof(double));
        w->origin = w->at;
        w->runs = false;
    }
    return w->at != k->middle;
}

// r = d^-1 y - Z^T x' - H^T x_origin, then T^T x = r
INLINE void expand_node(const Node *o, const double *next, const double *origin, double *x)
{
    double r[6];
    UNROLL
    for (int k = 0; k < 6; k++) {
        const double *z = o->z[k], *h = o->h[k];
        r[k] = z[6] - ((z[0] * next[0] + z[1] * next[1]) + (z[2] * next[2] + z[3] * next[3]) + (z[4] * next[4] + z[5] * next[5])) -
               ((h[0] * origin[0] + h[1] * origin[1]) + (h[2] * origin[2] + h[3] * origin[3]) + (h[4] * origin[4] + h[5] * origin[5]));
    }
    UNROLL
    for (int k = 5; k >= 0; k--)
        UNROLL
        for (int j = 0; j < k; j++)
            r[j] -= o->t[j][k] * r[k];
    UNROLL
    for (int k = 0; k < 6; k++)
        x[k] = r[k];
}

static const double zeros[6];

#define WIDTH 2
#define TARGET
#define KERNEL(name) name##_baseline
#include "solver/block_condense_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#if BLOCK_HAS_AVX
#define WIDTH 4
#define TARGET __attribute__((target("avx2")))
#define KERNEL(name) name##_avx2
#include "solver/block_condense_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#define WIDTH 8
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl")))
#define KERNEL(name) name##_avx512
#include "solver/block_condense_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#define ON(name) {name##_baseline, name##_avx2, name##_avx512}
#else
#define ON(name) {name##_baseline, name##_baseline, name##_baseline}
#endif

static void (*const eliminate_on[SIMD_COUNT])(BlockCondenser *, const BlockChain *, const double *) = ON(eliminate);
static void (*const expand_on[SIMD_COUNT])(const BlockCondenser *, double *) = ON(expand);

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

const BlockChain *block_condense(BlockCondenser *k, const BlockChain *chain, const double *b)
{
    choose_middle(k);
    k->small.count = 0;
    for (int i = 0; i < k->count; i++) {
        k->node[i].place = k->keep[i] ? k->small.count : -1;
        if (!k->keep[i])
            continue;
        size_t p = (size_t)k->small.count++;
        memcpy(k->small.diag + p * BLOCK, chain->diag + (size_t)i * BLOCK, BLOCK * sizeof(double));
        memcpy(k->side + 6 * p, b + 6 * (size_t)i, 6 * sizeof(double));
        k->keep[i] = false;
    }
    eliminate_on[simd_level()](k, chain, b);
    bool ok = true;
    for (int i = 0; i < k->count; i++)
        for (int j = 0; k->node[i].place < 0 && j < 6; j++)
            ok &= k->node[i].inverse[j] > 0 && k->node[i].inverse[j] <= DBL_MAX;
    return ok ? &k->small : NULL;
}

void block_condenser_expand(const BlockCondenser *k, const double *kept, double *x)
{
    for (int i = 0; i < k->count; i++)
        if (k->node[i].place >= 0)
            memcpy(x + 6 * (size_t)i, kept + 6 * (size_t)k->node[i].place, 6 * sizeof *x);
    expand_on[simd_level()](k, x);
}

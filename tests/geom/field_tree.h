// Small trees with a field of shared blobs, made branch by branch, for tests: nodes half a radius apart with a blob at each, whose amplitude gives the right
// radius on a straight line. Include after the headers of cmocka.
#ifndef SELDINGER_TESTS_FIELD_TREE_H
#define SELDINGER_TESTS_FIELD_TREE_H

#include "geom/blobby.h"
#include "geom/vessel_tree.h"

#include <stdbool.h>
#include <stdlib.h>

enum { FIELD_TREE_NODES = 4000, FIELD_TREE_BLOBS = 8000 };

typedef struct FieldTree {
    int nodes, blobs;
    Vec3 center[FIELD_TREE_NODES], direction[FIELD_TREE_NODES];
    double radius[FIELD_TREE_NODES];
    int parent[FIELD_TREE_NODES];
    uint8_t kind[FIELD_TREE_NODES];
    Vec3 blob_center[FIELD_TREE_BLOBS];
    double blob_width[FIELD_TREE_BLOBS], blob_amplitude[FIELD_TREE_BLOBS];
    int blob_owner[FIELD_TREE_BLOBS];
} FieldTree;

// Amplitude of blobs of support 2 r, half a radius apart on a line, whose surface has radius r: 1 = a sum (1 - (r^2 + s^2) / (4 r^2))^3.
static inline double field_tree_amplitude(void)
{
    double sum = 0;
    for (int k = -4; k <= 4; k++) {
        double u = 1 - (1 + 0.25 * k * k) / 4;
        sum += u > 0 ? u * u * u : 0;
    }
    return 1 / sum;
}

static inline void field_tree_blob(FieldTree *t, int owner, Vec3 center, double width, double amplitude)
{
    int b = t->blobs++;
    t->blob_center[b] = center;
    t->blob_width[b] = width;
    t->blob_amplitude[b] = amplitude;
    t->blob_owner[b] = owner;
}

// From `from` to `to`, the first node's parent is `parent`; a blob at each node unless it lies within [bare_from, bare_to] mm from the beginning. The
// row of blobs continues for 2 r beyond an end that is `open_before` or at the last node: ends are flat there. Returns the last node.
static inline int field_tree_branch(FieldTree *t, int parent, Vec3 from, Vec3 to, double radius, double bare_from, double bare_to)
{
    double length = vec3_distance(from, to), a = field_tree_amplitude();
    int count = (int)(length / (0.5 * radius) + 0.5);
    Vec3 d = vec3_unit(vec3_sub(to, from));
    for (int k = 0; k <= count; k++) {
        int i = t->nodes++;
        double at = length * k / count;
        t->center[i] = vec3_mix(from, to, (double)k / count);
        t->direction[i] = d;
        t->radius[i] = radius;
        t->parent[i] = k > 0 ? i - 1 : parent;
        t->kind[i] = NODE_VESSEL;
        if (at < bare_from || at > bare_to)
            field_tree_blob(t, i, t->center[i], 2 * radius, a);
    }
    return t->nodes - 1;
}

// Blobs upstream of the root, so that the tube continues there.
static inline void field_tree_extend_root(FieldTree *t)
{
    for (int k = 1; k <= 4; k++)
        field_tree_blob(t, 0, vec3_add_scaled(t->center[0], -0.5 * k * t->radius[0], t->direction[0]), 2 * t->radius[0], field_tree_amplitude());
}

// x -> turn x; the matrix `turn` may also mirror.
static inline VesselTree *field_tree_make(const FieldTree *t, const Mat3 *turn)
{
    VesselTree *tree = vessel_tree_create_shared(t->nodes, 0, t->blobs);
    int64_t filled = 0;
    for (int i = 0; i < t->nodes; i++) {
        tree->center[i] = turn ? mat3_mul_vec(turn, t->center[i]) : t->center[i];
        tree->direction[i] = turn ? mat3_mul_vec(turn, t->direction[i]) : t->direction[i];
        tree->radius[i] = t->radius[i];
        tree->parent[i] = t->parent[i];
        tree->kind[i] = t->kind[i];
        for (int b = 0; b < t->blobs; b++) {
            if (t->blob_owner[b] != i)
                continue;
            tree->blob_center[filled] = turn ? mat3_mul_vec(turn, t->blob_center[b]) : t->blob_center[b];
            tree->blob_width[filled] = t->blob_width[b];
            tree->blob_amplitude[filled++] = t->blob_amplitude[b];
        }
        tree->blob_offset[i + 1] = filled;
    }
    vessel_tree_link(tree);
    return tree;
}

#endif

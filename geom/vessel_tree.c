// The tree's arrays, their validation and the tree's length. See vessel_tree.h; names in messages are those of the model file.
#include "geom/vessel_tree.h"

#include <limits.h>
#include <stdlib.h>

// More memory than the intended machines have: a count that needs it comes from a corrupt file. (The sanitizers' allocator aborts above twice this.)
static const uint64_t BYTES_MAX = (uint64_t)1 << 39;

// An empty array also gets an address, so that NULL means "out of memory".
static void *array(int64_t count, size_t size)
{
    if (count < 0 || (uint64_t)count > BYTES_MAX / size)
        return NULL;
    return calloc(count > 0 ? (size_t)count : 1, size);
}

VesselTree *vessel_tree_create(int node_count, int64_t point_count, int64_t blob_count)
{
    // the neighbour list holds 2 (N - 1) entries indexed by int
    if (node_count < 1 || node_count > INT_MAX / 2 || point_count < 0 || blob_count < 0)
        return NULL;
    VesselTree *tree = calloc(1, sizeof *tree);
    if (!tree)
        return NULL;
    int64_t n = node_count;
    tree->node_count = node_count;
    tree->point_count = point_count;
    tree->blob_count = blob_count;
    tree->iso_level = 0.1;
    tree->center = array(n, sizeof *tree->center);
    tree->radius = array(n, sizeof *tree->radius);
    tree->direction = array(n, sizeof *tree->direction);
    tree->height = array(n, sizeof *tree->height);
    tree->parent = array(n, sizeof *tree->parent);
    tree->kind = array(n, sizeof *tree->kind);
    tree->point = array(point_count, sizeof *tree->point);
    tree->point_offset = array(n + 1, sizeof *tree->point_offset);
    tree->blob_center = array(blob_count, sizeof *tree->blob_center);
    tree->blob_width = array(blob_count, sizeof *tree->blob_width);
    tree->blob_offset = array(n + 1, sizeof *tree->blob_offset);
    tree->error = array(n, sizeof *tree->error);
    tree->neighbour_offset = array(n + 1, sizeof *tree->neighbour_offset);
    tree->neighbour = array(2 * n, sizeof *tree->neighbour);
    if (!tree->center || !tree->radius || !tree->direction || !tree->height || !tree->parent || !tree->kind || !tree->point || !tree->point_offset ||
        !tree->blob_center || !tree->blob_width || !tree->blob_offset || !tree->error || !tree->neighbour_offset || !tree->neighbour) {
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

VesselTree *vessel_tree_create_shared(int node_count, int64_t point_count, int64_t blob_count)
{
    VesselTree *tree = vessel_tree_create(node_count, point_count, blob_count);
    if (!tree)
        return NULL;
    tree->iso_level = 1;
    tree->blob_amplitude = array(blob_count, sizeof *tree->blob_amplitude);
    if (!tree->blob_amplitude) {
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

void vessel_tree_free(VesselTree *tree)
{
    if (!tree)
        return;
    free(tree->center);
    free(tree->radius);
    free(tree->direction);
    free(tree->height);
    free(tree->parent);
    free(tree->kind);
    free(tree->point);
    free(tree->point_offset);
    free(tree->blob_center);
    free(tree->blob_width);
    free(tree->blob_amplitude);
    free(tree->blob_offset);
    free(tree->error);
    free(tree->neighbour_offset);
    free(tree->neighbour);
    free(tree->near_offset);
    free(tree->near);
    free(tree->seen_offset);
    free(tree->seen);
    free(tree);
}

static void check_offsets(const int64_t *offset, int node_count, int64_t total, const char *name, const char *file, Faults *faults)
{
    if (offset[0] != 0) {
        faults_add(faults, file, 0, 0, "%s/offset[0] is %lld; expected 0", name, (long long)offset[0]);
        return;
    }
    for (int i = 0; i < node_count; i++)
        if (offset[i + 1] < offset[i]) {
            faults_add(faults, file, 0, 0, "%s/offset[%d] is %lld, below the one before it (%lld); expected offsets that do not decrease", name, i + 1,
                       (long long)offset[i + 1], (long long)offset[i]);
            return;
        }
    if (offset[node_count] != total)
        faults_add(faults, file, 0, 0, "%s/offset ends at %lld; expected the number of rows, %lld", name, (long long)offset[node_count], (long long)total);
}

#define MOST_MM 1e9   // squares and products of lengths do not overflow

static void check_vectors(const Vec3 *v, int64_t count, const char *name, const char *file, Faults *faults)
{
    for (int64_t i = 0; i < count; i++)
        if (!(fabs(v[i].x) < MOST_MM && fabs(v[i].y) < MOST_MM && fabs(v[i].z) < MOST_MM)) {
            faults_add(faults, file, 0, 0, "%s[%lld] is (%g, %g, %g); expected finite numbers below 1e9 mm", name, (long long)i, v[i].x, v[i].y, v[i].z);
            return;
        }
}

// `positive`: the value must be > 0, else >= 0.
static void check_lengths(const double *v, int64_t count, bool positive, const char *name, const char *file, Faults *faults)
{
    for (int64_t i = 0; i < count; i++)
        if (!(v[i] < MOST_MM) || v[i] < 0 || (positive && !(v[i] > 0))) {
            faults_add(faults, file, 0, 0, "%s[%lld] is %g; expected a number of mm %s 0 and below 1e9", name, (long long)i, v[i],
                       positive ? "above" : "of at least");
            return;
        }
}

static void check_amplitudes(const VesselTree *tree, const char *file, Faults *faults)
{
    for (int64_t i = 0; i < tree->blob_count; i++)
        if (!(fabs(tree->blob_amplitude[i]) < MOST_MM)) {
            faults_add(faults, file, 0, 0, "blobs/amplitude[%lld] is %g; expected a finite number below 1e9", (long long)i, tree->blob_amplitude[i]);
            return;
        }
}

static void check_parents(const VesselTree *tree, const char *file, Faults *faults)
{
    if (tree->parent[0] != -1)
        faults_add(faults, file, 0, 0, "nodes/parent[0] is %d; expected -1, because node 0 is the root", (int)tree->parent[0]);
    for (int i = 1; i < tree->node_count; i++)
        if (tree->parent[i] < 0 || tree->parent[i] >= i) {
            faults_add(faults, file, 0, 0, "nodes/parent[%d] is %d; %s 0 to %d", i, (int)tree->parent[i],
                       tree->parent[i] == -1 ? "a tree has one root, node 0; expected" : "parents come before children; expected", i - 1);
            return;
        }
}

bool vessel_tree_validate(const VesselTree *tree, const char *file, Faults *faults)
{
    int before = faults->count, n = tree->node_count;
    if (n < 1) {
        faults_add(faults, file, 0, 0, "the tree has no nodes; expected at least one");
        return false;
    }
    check_vectors(tree->center, n, "nodes/center", file, faults);
    check_lengths(tree->radius, n, true, "nodes/radius", file, faults);
    for (int i = 0; i < n; i++) {
        double length = vec3_norm(tree->direction[i]);
        if (!(fabs(length - 1) <= 1e-6)) {
            faults_add(faults, file, 0, 0, "nodes/direction[%d] has length %g; expected length 1", i, length);
            break;
        }
    }
    check_lengths(tree->height, n, false, "nodes/height", file, faults);
    check_parents(tree, file, faults);
    for (int i = 0; i < n; i++)
        if (tree->kind[i] != NODE_VESSEL && tree->kind[i] != NODE_ANEURYSM) {
            faults_add(faults, file, 0, 0, "nodes/kind[%d] is %d; expected 0 (vessel) or 1 (aneurysm)", i, tree->kind[i]);
            break;
        }
    check_vectors(tree->point, tree->point_count, "points/xyz", file, faults);
    check_offsets(tree->point_offset, n, tree->point_count, "points", file, faults);
    check_vectors(tree->blob_center, tree->blob_count, "blobs/center", file, faults);
    check_lengths(tree->blob_width, tree->blob_count, true, "blobs/width", file, faults);
    check_offsets(tree->blob_offset, n, tree->blob_count, "blobs", file, faults);
    if (vessel_tree_is_shared(tree))
        check_amplitudes(tree, file, faults);
    if (tree->blob_count > 0)
        check_lengths(tree->error, n, false, "blobs/error_mm", file, faults);
    if (!isfinite(tree->iso_level) || !(tree->iso_level > 0))
        faults_add(faults, file, 0, 0, "iso_level is %g; expected a finite number above 0", tree->iso_level);
    return faults->count == before;
}

bool vessel_tree_root_is_open(const VesselTree *tree)
{
    Vec3 root = tree->center[0], upstream = vec3_negate(tree->direction[0]);
    double radius = tree->radius[0];
    for (int k = tree->neighbour_offset[0]; k < tree->neighbour_offset[1]; k++) {
        Vec3 to = vec3_sub(tree->center[tree->neighbour[k]], root);
        if (vec3_dot(to, upstream) > 0.5 * vec3_norm(to))
            return false;
    }
    int closing = 0;
    for (int64_t i = tree->point_offset[0]; i < tree->point_offset[1]; i++) {
        Vec3 p = vec3_sub(tree->point[i], root);
        double t = vec3_dot(p, upstream);
        closing += t > 0.5 * radius && vec3_norm2(p) - t * t < 0.36 * radius * radius;
    }
    return closing < 3;
}

double vessel_tree_length(const VesselTree *tree)
{
    double length = 0;
    for (int i = 1; i < tree->node_count; i++)
        length += tree->kind[i] == NODE_VESSEL ? vec3_distance(tree->center[i], tree->center[tree->parent[i]]) : 0;
    return length;
}

// The tree's arrays, its rules and its neighbour lists. See vessel_tree.h; names in messages are those of the model file.
#include "geom/vessel_tree.h"

#include "geom/blob_flood.h"

#include <limits.h>
#include <stdlib.h>

// More than a machine of ours has: a count that wants it comes from a broken file. (The sanitizers' allocator aborts above twice this.)
static const uint64_t BYTES_MAX = (uint64_t)1 << 39;

// An array of no entries still gets an address, so that NULL means "no memory".
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
    if (!tree->center || !tree->radius || !tree->direction || !tree->height || !tree->parent || !tree->kind || !tree->point ||
        !tree->point_offset || !tree->blob_center || !tree->blob_width || !tree->blob_offset || !tree->error || !tree->neighbour_offset ||
        !tree->neighbour) {
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
        faults_add(faults, file, 0, 0, "%s/offset[0] is %lld; the first offset is 0", name, (long long)offset[0]);
        return;
    }
    for (int i = 0; i < node_count; i++)
        if (offset[i + 1] < offset[i]) {
            faults_add(faults, file, 0, 0, "%s/offset[%d] is %lld, below the one before it (%lld); offsets never fall", name, i + 1,
                       (long long)offset[i + 1], (long long)offset[i]);
            return;
        }
    if (offset[node_count] != total)
        faults_add(faults, file, 0, 0, "%s/offset ends at %lld; the last offset is the number of rows, %lld", name,
                   (long long)offset[node_count], (long long)total);
}

#define MOST_MM 1e9   // squares and products of lengths stay far from overflow

static void check_vectors(const Vec3 *v, int64_t count, const char *name, const char *file, Faults *faults)
{
    for (int64_t i = 0; i < count; i++)
        if (!(fabs(v[i].x) < MOST_MM && fabs(v[i].y) < MOST_MM && fabs(v[i].z) < MOST_MM)) {
            faults_add(faults, file, 0, 0, "%s[%lld] is (%g, %g, %g); coordinates are finite numbers below 1e9 mm", name, (long long)i, v[i].x,
                       v[i].y, v[i].z);
            return;
        }
}

// `positive`: the value must be > 0, else >= 0.
static void check_lengths(const double *v, int64_t count, bool positive, const char *name, const char *file, Faults *faults)
{
    for (int64_t i = 0; i < count; i++)
        if (!(v[i] < MOST_MM) || v[i] < 0 || (positive && !(v[i] > 0))) {
            faults_add(faults, file, 0, 0, "%s[%lld] is %g; a number of mm %s 0 and below 1e9 is valid", name, (long long)i, v[i],
                       positive ? "above" : "of at least");
            return;
        }
}

static void check_amplitudes(const VesselTree *tree, const char *file, Faults *faults)
{
    for (int64_t i = 0; i < tree->blob_count; i++)
        if (!(fabs(tree->blob_amplitude[i]) < MOST_MM)) {
            faults_add(faults, file, 0, 0, "blobs/amplitude[%lld] is %g; finite numbers below 1e9 are valid", (long long)i, tree->blob_amplitude[i]);
            return;
        }
}

static void check_parents(const VesselTree *tree, const char *file, Faults *faults)
{
    if (tree->parent[0] != -1)
        faults_add(faults, file, 0, 0, "nodes/parent[0] is %d; node 0 is the root and has parent -1", (int)tree->parent[0]);
    for (int i = 1; i < tree->node_count; i++)
        if (tree->parent[i] < 0 || tree->parent[i] >= i) {
            faults_add(faults, file, 0, 0, "nodes/parent[%d] is %d; %s 0 to %d are valid", i, (int)tree->parent[i],
                       tree->parent[i] == -1 ? "a tree has one root, node 0, and" : "parents stand before children:", i - 1);
            return;
        }
}

bool vessel_tree_validate(const VesselTree *tree, const char *file, Faults *faults)
{
    int before = faults->count, n = tree->node_count;
    if (n < 1) {
        faults_add(faults, file, 0, 0, "the tree has no nodes; at least one is needed");
        return false;
    }
    check_vectors(tree->center, n, "nodes/center", file, faults);
    check_lengths(tree->radius, n, true, "nodes/radius", file, faults);
    for (int i = 0; i < n; i++) {
        double length = vec3_norm(tree->direction[i]);
        if (!(fabs(length - 1) <= 1e-6)) {
            faults_add(faults, file, 0, 0, "nodes/direction[%d] has length %g; directions have length 1", i, length);
            break;
        }
    }
    check_lengths(tree->height, n, false, "nodes/height", file, faults);
    check_parents(tree, file, faults);
    for (int i = 0; i < n; i++)
        if (tree->kind[i] != NODE_VESSEL && tree->kind[i] != NODE_ANEURYSM) {
            faults_add(faults, file, 0, 0, "nodes/kind[%d] is %d; 0 (vessel) and 1 (aneurysm) are valid", i, tree->kind[i]);
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
        faults_add(faults, file, 0, 0, "iso_level is %g; a finite number above 0 is valid", tree->iso_level);
    return faults->count == before;
}

static void link_neighbours(VesselTree *tree)
{
    int n = tree->node_count, *offset = tree->neighbour_offset;
    for (int i = 0; i <= n; i++)
        offset[i] = 0;
    // count, sum, fill, as in counting sort; offset[i + 1] serves as node i's fill position and ends as its end
    for (int i = 1; i < n; i++) {
        int p = tree->parent[i];
        if (p >= 0 && p < i) {
            offset[i + 1]++;
            offset[p + 1]++;
        }
    }
    int sum = 0;
    for (int i = 0; i < n; i++) {
        int own = offset[i + 1];
        offset[i + 1] = sum;
        sum += own;
    }
    // a node's own parent comes before any of its children do, because parents stand before children
    for (int i = 1; i < n; i++) {
        int p = tree->parent[i];
        if (p >= 0 && p < i) {
            tree->neighbour[offset[i + 1]++] = p;
            tree->neighbour[offset[p + 1]++] = i;
        }
    }
}

// A way through the tree from a node, as far as it has been followed.
typedef struct Way {
    int node, from, top;     // top: the common ancestor of both ends
} Way;

typedef struct NearSearch {
    const VesselTree *tree;
    double *along;           // (N) [mm] from the root
    double largest;          // radius
    double part;             // of the distances that count as near: 1, or less where a tree is too crowded
    Way *way;                // (N) a tree has one way to each node
    int64_t visits;
    int *near;               // all nodes' lists
    size_t count, capacity;
} NearSearch;

// More than any vessel has; a broken file's nodes, all in one place, would be near each other in pairs.
static const int64_t VISITS_MAX = (int64_t)1 << 27;
static const size_t NEAR_MAX = (size_t)1 << 24;

static bool add_near(NearSearch *s, int node)
{
    if (s->count == s->capacity) {
        size_t capacity = 2 * s->capacity + 1024;
        int *more = realloc(s->near, capacity * sizeof *more);
        if (!more)
            return false;
        s->near = more;
        s->capacity = capacity;
    }
    s->near[s->count++] = node;
    return true;
}

// The length of a way is the same from both of its ends, to the bit: so is who is near whom.
static double way_length(const NearSearch *s, int from, Way way)
{
    return (s->along[from] - s->along[way.top]) + (s->along[way.node] - s->along[way.top]);
}

// How long a way and how far apart near nodes are at most, in sums of their radii: see vessel_tree_link.
typedef struct NearLimits {
    double way, apart;
} NearLimits;

static const NearLimits near_most = {3, 1.5}, near_local_sac = {2, 1.5}, near_local = {1.5, 1.2};

static NearLimits near_limits(const VesselTree *tree, int a, int b)
{
    bool local_models = vessel_tree_is_model(tree) && !vessel_tree_is_shared(tree);
    if (!local_models)
        return near_most;
    bool at_sac = tree->kind[a] != NODE_VESSEL || tree->kind[b] != NODE_VESSEL;
    return at_sac ? near_local_sac : near_local;
}

// The nodes near `node`, its neighbours always among them. Breadth first, so that the order is that of links, then of indices. False where there is
// no memory.
static bool collect_near(NearSearch *s, int node)
{
    const VesselTree *tree = s->tree;
    int known = 1;
    double farthest = s->part * near_most.way * (tree->radius[node] + s->largest);
    s->way[0] = (Way){node, -1, node};
    for (int w = 0; w < known; w++, s->visits++) {
        Way at = s->way[w];
        double reach = s->part * (tree->radius[node] + tree->radius[at.node]);
        NearLimits most = near_limits(tree, node, at.node);
        bool is_near = way_length(s, node, at) < most.way * reach && vec3_distance(tree->center[node], tree->center[at.node]) < most.apart * reach;
        if (w > 0 && (at.from == node || is_near) && !add_near(s, at.node))
            return false;
        for (int k = tree->neighbour_offset[at.node]; k < tree->neighbour_offset[at.node + 1]; k++) {
            int next = tree->neighbour[k];
            Way way = {next, at.node, next < at.node ? next : at.top};
            if (next != at.from && (w == 0 || way_length(s, node, way) < farthest))
                s->way[known++] = way;
        }
    }
    return true;
}

static bool link_near(VesselTree *tree, NearSearch *s)
{
    int n = tree->node_count;
    for (int i = 0; i < n; i++) {
        s->largest = fmax(s->largest, tree->radius[i]);
        int p = tree->parent[i];
        s->along[i] = p >= 0 && p < i ? s->along[p] + vec3_distance(tree->center[i], tree->center[p]) : 0;
    }
    for (s->part = 1;; s->part = s->part > 0.1 ? 0.5 * s->part : 0) {
        s->visits = 0;
        s->count = 0;
        int i = 0;
        for (; i < n && (s->part == 0 || (s->visits < VISITS_MAX && s->count < NEAR_MAX)); i++) {
            if (!collect_near(s, i))
                return false;
            tree->near_offset[i + 1] = (int)s->count;
        }
        if (i == n)
            return true;
    }
}

bool vessel_tree_link(VesselTree *tree)
{
    size_t n = (size_t)tree->node_count;
    link_neighbours(tree);
    free(tree->near_offset);
    free(tree->near);
    tree->near = NULL;
    tree->near_offset = calloc(n + 1, sizeof *tree->near_offset);
    NearSearch search = {.tree = tree, .along = calloc(n, sizeof *search.along), .way = calloc(n, sizeof *search.way)};
    bool good = tree->near_offset && search.along && search.way && link_near(tree, &search);
    free(search.along);
    free(search.way);
    if (search.near)
        tree->near = realloc(search.near, search.count * sizeof *search.near);
    else
        tree->near = calloc(1, sizeof *tree->near);
    return good && tree->near && (!vessel_tree_is_shared(tree) || blob_flood_list(tree));
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

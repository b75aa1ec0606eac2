// The tree's derived lists: neighbours, near nodes, the blobs that each node sees. See vessel_tree.h.
#include "geom/vessel_tree.h"
#include "base/base.h"

#include "geom/blob_flood.h"

#include <limits.h>
#include <stdlib.h>

static void link_neighbours(VesselTree *tree)
{
    int n = tree->node_count, *offset = tree->neighbour_offset;
    for (int i = 0; i <= n; i++)
        offset[i] = 0;
    // counting sort: count, sum, fill; offset[i + 1] is node i's fill position and finally its end
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
    SEL_REQUIRE(sum <= 2 * (n - 1), "each node but the root has one link up, so the list of 2 (N - 1) neighbours holds all");
    // a node's parent is listed before its children, because parents come before children
    for (int i = 1; i < n; i++) {
        int p = tree->parent[i];
        if (p >= 0 && p < i) {
            tree->neighbour[offset[i + 1]++] = p;
            tree->neighbour[offset[p + 1]++] = i;
        }
    }
}

// The end of a path through the tree from a node.
typedef struct TreePath {
    int node, from, top;     // top: the common ancestor of both ends
} TreePath;

typedef struct NearSearch {
    const VesselTree *tree;
    double *along;           // (N) [mm] from the root
    double largest;          // largest radius
    double part;             // factor for the distances that count as near: 1, or less if the tree is too crowded
    TreePath *path;          // (N) a tree has one path to each node
    int64_t visits;
    int *near;               // the lists of all nodes
    size_t count, capacity;
} NearSearch;

// More than any vessel needs; in a corrupt file with all nodes in one place, every pair would be near.
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
    SEL_ASSERT(node >= 0 && node < s->tree->node_count, "near nodes are nodes of the tree");
    s->near[s->count++] = node;
    return true;
}

// The length of a path is the same from both of its ends, bit for bit; so "near" is symmetric.
static double path_length(const NearSearch *s, int from, TreePath path)
{
    return (s->along[from] - s->along[path.top]) + (s->along[path.node] - s->along[path.top]);
}

// Largest length of a path and largest distance between near nodes, relative to the sum of their radii: see vessel_tree_link.
typedef struct NearLimits {
    double path, apart;
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

// Collects the nodes near `node`, including its neighbours. Breadth first, so that the order is by number of links, then by index. Returns false if out of
// memory.
static bool collect_near(NearSearch *s, int node)
{
    const VesselTree *tree = s->tree;
    int known = 1;
    double farthest = s->part * near_most.path * (tree->radius[node] + s->largest);
    s->path[0] = (TreePath){node, -1, node};
    for (int w = 0; w < known; w++, s->visits++) {
        TreePath at = s->path[w];
        double reach = s->part * (tree->radius[node] + tree->radius[at.node]);
        NearLimits most = near_limits(tree, node, at.node);
        bool is_near = path_length(s, node, at) < most.path * reach && vec3_distance(tree->center[node], tree->center[at.node]) < most.apart * reach;
        if (w > 0 && (at.from == node || is_near) && !add_near(s, at.node))
            return false;
        for (int k = tree->neighbour_offset[at.node]; k < tree->neighbour_offset[at.node + 1]; k++) {
            int next = tree->neighbour[k];
            TreePath path = {next, at.node, next < at.node ? next : at.top};
            if (next != at.from && (w == 0 || path_length(s, node, path) < farthest)) {
                SEL_REQUIRE(known < tree->node_count, "a tree has one path to each node");
                s->path[known++] = path;
            }
        }
    }
    return true;
}

static bool link_near(VesselTree *tree, NearSearch *s)
{
    SEL_ASSERT(tree->near_offset[0] == 0, "the first list starts at 0");
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
            SEL_REQUIRE(s->count <= INT_MAX, "the number of entries of the near list fits an int");
            tree->near_offset[i + 1] = (int)s->count;
        }
        if (i == n)
            return true;
    }
}

bool vessel_tree_link(VesselTree *tree)
{
    SEL_ASSERT(tree->node_count > 0, "a tree has a root");
    size_t n = (size_t)tree->node_count;
    link_neighbours(tree);
    free(tree->near_offset);
    free(tree->near);
    tree->near = NULL;
    tree->near_offset = calloc(n + 1, sizeof *tree->near_offset);
    NearSearch search = {.tree = tree, .along = calloc(n, sizeof *search.along), .path = calloc(n, sizeof *search.path)};
    bool good = tree->near_offset && search.along && search.path && link_near(tree, &search);
    free(search.along);
    free(search.path);
    if (search.near)
        tree->near = realloc(search.near, search.count * sizeof *search.near);
    else
        tree->near = calloc(1, sizeof *tree->near);
    return good && tree->near && (!vessel_tree_is_shared(tree) || blob_flood_list(tree));
}

// d(X, C) = |X - C|^2 - r^2, Kerrien et al. 2017, eq. (12). The paper's rule takes the best of the node and its neighbours once per step. This code uses the
// near nodes (vessel_tree_link) and repeats the rule a few times, because a tip that springs back may cross several short nodes in one step.
//
// Strict descent has a trap: the cell of a vessel's node extends sideways until another node's cell begins, also across a wide sac that belongs to another
// node, with worse nodes between. (Seen on the phantom: a wire crossed the whole sac, 9 mm, on the spurious lobe of a node beside the neck.) A point that is
// clearly outside its node's ball therefore searches, along all paths through the tree that are not much longer than its distance, for a ball that holds it.
#include "geom/power_walk.h"

#include "base/base.h"

enum { PATHS_MAX = 64 };

typedef struct TreePath {
    int node, from;
    double length;
} TreePath;

static int look_around(const VesselTree *tree, Vec3 x, int node)
{
    SEL_ASSERT(node >= 0 && node < tree->node_count, "paths start at a node of the tree");
    TreePath path[PATHS_MAX] = {{node, -1, 0}};
    int known = 1, best_node = node;
    double longest = 2.5 * vec3_distance(x, tree->center[node]), best = 0;   // only nodes whose ball holds x improve on 0
    for (int w = 0; w < known; w++) {
        TreePath at = path[w];
        double d = power_distance(x, tree->center[at.node], tree->radius[at.node]);
        if (d < best) {
            best = d;
            best_node = at.node;
        }
        for (int k = tree->neighbour_offset[at.node]; k < tree->neighbour_offset[at.node + 1] && known < PATHS_MAX; k++) {
            int next = tree->neighbour[k];
            SEL_ASSERT(next >= 0 && next < tree->node_count, "neighbours are nodes of the tree");
            double length = at.length + vec3_distance(tree->center[at.node], tree->center[next]);
            if (next != at.from && length < longest)
                path[known++] = (TreePath){next, at.node, length};
        }
    }
    return best_node;
}

// A vessel that runs beside a sac whose wall bulges out of its ball would capture points of the sac that are many of the vessel's radii away, where it has no
// wall.
static bool is_nearer_in_radii(const VesselTree *tree, Vec3 x, int node, int next)
{
    double r2 = tree->radius[node] * tree->radius[node], next_r2 = tree->radius[next] * tree->radius[next];
    double far2 = vec3_norm2(vec3_sub(x, tree->center[next]));
    return far2 < 4 * next_r2 || far2 * r2 < vec3_norm2(vec3_sub(x, tree->center[node])) * next_r2;
}

int power_walk(const VesselTree *tree, Vec3 x, int node, int hops)
{
    SEL_ASSERT(tree->near_offset && tree->near, "the tree is linked (vessel_tree_link)");
    if (node < 0 || node >= tree->node_count)
        return power_nearest(tree, x);
    double best = power_distance(x, tree->center[node], tree->radius[node]);
    for (int hop = 0; hop < hops; hop++) {
        int here = node;
        for (int k = tree->near_offset[here]; k < tree->near_offset[here + 1]; k++) {
            int next = tree->near[k];
            SEL_ASSERT(next >= 0 && next < tree->node_count && next != here, "near nodes are other nodes of the tree");
            double d = power_distance(x, tree->center[next], tree->radius[next]);
            if (d < best && is_nearer_in_radii(tree, x, here, next)) {
                best = d;
                node = next;
            }
        }
        if (node == here)
            break;
    }
    double r = tree->radius[node];
    return hops > 0 && best > 0.44 * r * r ? look_around(tree, x, node) : node;   // further than 1.2 r from the centre
}

int power_nearest(const VesselTree *tree, Vec3 x)
{
    SEL_ASSERT(tree->node_count > 0, "a tree has a root");
    int node = 0;
    double best = power_distance(x, tree->center[0], tree->radius[0]);
    for (int i = 1; i < tree->node_count; i++) {
        double d = power_distance(x, tree->center[i], tree->radius[i]);
        if (d < best) {
            best = d;
            node = i;
        }
    }
    SEL_ASSERT(node >= 0 && node < tree->node_count, "the nearest node is one of the tree");
    return node;
}

// d(X, C) = |X - C|^2 - r^2, Kerrien 2017, eq. (12). The paper's rule takes the best of the node and its neighbours once a step; we
// take the near nodes (vessel_tree_link) and repeat it a few times, because a tip that springs back may cross several short nodes in one step.
#include "geom/power_walk.h"

int power_walk(const VesselTree *tree, Vec3 x, int node, int hops)
{
    if (node < 0 || node >= tree->node_count)
        return power_nearest(tree, x);
    double best = power_distance(x, tree->center[node], tree->radius[node]);
    for (int hop = 0; hop < hops; hop++) {
        int here = node;
        for (int k = tree->near_offset[here]; k < tree->near_offset[here + 1]; k++) {
            int next = tree->near[k];
            double d = power_distance(x, tree->center[next], tree->radius[next]);
            if (d < best) {
                best = d;
                node = next;
            }
        }
        if (node == here)
            break;
    }
    return node;
}

int power_nearest(const VesselTree *tree, Vec3 x)
{
    int node = 0;
    double best = power_distance(x, tree->center[0], tree->radius[0]);
    for (int i = 1; i < tree->node_count; i++) {
        double d = power_distance(x, tree->center[i], tree->radius[i]);
        if (d < best) {
            best = d;
            node = i;
        }
    }
    return node;
}

// The width of a child is the mean radius of its next few nodes, because a single node just beyond the fork is not representative.
#include "geom/vessel_branches.h"

#include <stdlib.h>

enum { LOOK = 5 };

// next[i]: the child through which node i's branch continues; -1 at its end.
static bool choose_next(const VesselTree *tree, int *next)
{
    int n = tree->node_count;
    int *first = malloc((size_t)n * sizeof *first);   // (N) child of kind vessel with the lowest index
    double *width = malloc((size_t)n * sizeof *width);
    if (!first || !width) {
        free(first);
        free(width);
        return false;
    }
    for (int i = 0; i < n; i++)
        first[i] = next[i] = -1;
    for (int i = n - 1; i > 0; i--)
        if (tree->kind[i] == NODE_VESSEL)
            first[tree->parent[i]] = i;
    for (int i = 0; i < n; i++) {
        double sum = 0;
        int count = 0;
        for (int k = i; k >= 0 && count < LOOK; k = first[k], count++)
            sum += tree->radius[k];
        width[i] = sum / count;
    }
    for (int i = 1; i < n; i++) {
        int p = tree->parent[i];
        if (tree->kind[i] == NODE_VESSEL && tree->kind[p] == NODE_VESSEL && (next[p] < 0 || width[i] > width[next[p]]))
            next[p] = i;
    }
    free(first);
    free(width);
    return true;
}

static void measure(const VesselTree *tree, const VesselBranches *b, VesselBranch *branch)
{
    const int *node = b->node + branch->first;
    double *along = b->along + branch->first, covered = 0;
    Vec3 start = tree->center[branch->from_node >= 0 ? branch->from_node : node[0]], at = start;
    branch->radius_least = HUGE_VAL;
    for (int k = 0; k < branch->count; k++) {
        double r = tree->radius[node[k]];
        covered += vec3_distance(at, tree->center[node[k]]);
        at = tree->center[node[k]];
        along[k] = covered;
        branch->radius_mean += r / branch->count;
        branch->radius_least = fmin(branch->radius_least, r);
        branch->radius_largest = fmax(branch->radius_largest, r);
    }
    double chord = vec3_distance(start, at);
    branch->length = covered;
    branch->tortuosity = chord > 1e-9 * covered && covered > 0 ? covered / chord : 1;
}

VesselBranches *vessel_branches_create(const VesselTree *tree)
{
    size_t n = (size_t)tree->node_count;
    VesselBranches *b = calloc(1, sizeof *b);
    int *next = malloc(n * sizeof *next), used = 0;
    if (b) {
        b->branch = calloc(n, sizeof *b->branch);
        b->node = malloc(n * sizeof *b->node);
        b->along = malloc(n * sizeof *b->along);
        b->of_node = malloc(n * sizeof *b->of_node);
    }
    if (!b || !next || !b->branch || !b->node || !b->along || !b->of_node || !choose_next(tree, next)) {
        free(next);
        vessel_branches_free(b);
        return NULL;
    }
    for (int i = 0; i < tree->node_count; i++)
        b->of_node[i] = -1;
    for (int i = 0; i < tree->node_count; i++) {
        int from = tree->parent[i], above = from;
        if (tree->kind[i] != NODE_VESSEL || (from >= 0 && next[from] == i))
            continue;
        while (above >= 0 && b->of_node[above] < 0)
            above = tree->parent[above];
        VesselBranch *branch = &b->branch[b->count];
        *branch = (VesselBranch){.first = used, .from_node = from, .parent = above >= 0 ? b->of_node[above] : -1};
        branch->order = branch->parent >= 0 ? b->branch[branch->parent].order + 1 : 1;
        for (int k = i; k >= 0; k = next[k]) {
            b->node[used++] = k;
            b->of_node[k] = b->count;
            branch->count++;
        }
        measure(tree, b, branch);
        b->count++;
    }
    free(next);
    return b;
}

void vessel_branches_free(VesselBranches *b)
{
    if (!b)
        return;
    free(b->branch);
    free(b->node);
    free(b->along);
    free(b->of_node);
    free(b);
}

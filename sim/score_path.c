// Parents come before children, so one pass in index order reaches every node from its parent; nodes upstream of the path or the target are filled in first by
// climbing from there to the root.
#include "sim/score_path.h"

#include "geom/geom.h"

#include <stdlib.h>
#include <string.h>

static double link_length(const VesselTree *tree, int child) { return vec3_distance(tree->center[child], tree->center[tree->parent[child]]); }

// Sets left and toward: first from the goal up to the root, then down to all other nodes.
static void measure_left(ScorePath *path)
{
    const VesselTree *tree = path->tree;
    for (int i = 0; i < tree->node_count; i++)
        path->toward[i] = -1;
    path->toward[path->goal] = path->goal;
    path->left[path->goal] = 0;
    // the target need not be at its node's centre: the offset along the path is subtracted or added for all nodes upstream
    int before = tree->parent[path->goal];
    Vec3 along = before >= 0 ? vec3_unit(vec3_sub(tree->center[path->goal], tree->center[before])) : tree->direction[path->goal];
    double extra = vec3_dot(vec3_sub(path->target, tree->center[path->goal]), along), total = extra;
    for (int i = path->goal; tree->parent[i] >= 0; i = tree->parent[i]) {
        int up = tree->parent[i];
        total += link_length(tree, i);
        path->left[up] = fmax(total, 0);
        path->toward[up] = i;
    }
    for (int i = 0; i < tree->node_count; i++)
        if (path->toward[i] < 0) {
            path->toward[i] = tree->parent[i];
            path->left[i] = path->left[tree->parent[i]] + link_length(tree, i);
        }
}

// `on`: 1 on the path. The path consists of the nodes on exactly one of the two chains to the root, and the fork where they meet.
static void mark_path(const ScorePath *path, uint8_t *on)
{
    const VesselTree *tree = path->tree;
    for (int i = path->goal; i >= 0; i = tree->parent[i])
        on[i] = 1;
    int meeting = path->entry;
    while (!on[meeting])
        meeting = tree->parent[meeting];
    for (int i = tree->parent[meeting]; i >= 0; i = tree->parent[i])
        on[i] = 0;
    for (int i = path->entry; i != meeting; i = tree->parent[i])
        on[i] = 1;
    if (tree->kind[path->goal] != NODE_ANEURYSM)
        return;
    int top = path->goal;        // the first node of the sac that holds the target; the whole sac counts as the target
    while (tree->parent[top] >= 0 && tree->kind[tree->parent[top]] == NODE_ANEURYSM)
        top = tree->parent[top];
    on[top] = 2;
    for (int i = top + 1; i < tree->node_count; i++)
        if (tree->kind[i] == NODE_ANEURYSM && tree->parent[i] >= top && on[tree->parent[i]] == 2)
            on[i] = 2;
}

// Sets off: the distance from the path, minus the radius at which the branch begins; `base` (N) is that radius.
static void measure_off(ScorePath *path, uint8_t *on, double *base, double target_radius)
{
    const VesselTree *tree = path->tree;
    for (int i = 0; i < tree->node_count; i++) {
        path->off[i] = 0;
        base[i] = i == path->goal ? fmax(tree->radius[i], target_radius) : tree->radius[i];
    }
    int top = path->entry;
    while (tree->parent[top] >= 0 && on[tree->parent[top]])
        top = tree->parent[top];
    for (int i = top; tree->parent[i] >= 0; i = tree->parent[i]) {       // upstream of the path
        int up = tree->parent[i];
        path->off[up] = path->off[i] + link_length(tree, i);
        base[up] = base[top];
        on[up] = 3;
    }
    for (int i = 0; i < tree->node_count; i++)
        if (!on[i]) {
            path->off[i] = path->off[tree->parent[i]] + link_length(tree, i);
            base[i] = base[tree->parent[i]];
        }
    for (int i = 0; i < tree->node_count; i++)
        path->off[i] = fmax(path->off[i] - base[i], 0);
}

bool score_path_create(ScorePath *path, const VesselTree *tree, Vec3 mouth, Vec3 target, double target_radius)
{
    *path = (ScorePath){.target = target};
    if (!tree)
        return true;
    size_t count = (size_t)tree->node_count;
    uint8_t *on = calloc(count, 1);
    double *base = calloc(count, sizeof *base);
    path->off = calloc(count, sizeof *path->off);
    path->left = calloc(count, sizeof *path->left);
    path->toward = calloc(count, sizeof *path->toward);
    bool good = on && base && path->off && path->left && path->toward;
    if (good) {
        path->tree = tree;
        path->entry = power_nearest(tree, mouth);
        path->goal = power_nearest(tree, target);
        measure_left(path);
        mark_path(path, on);
        measure_off(path, on, base, target_radius);
    } else {
        score_path_destroy(path);
    }
    free(on);
    free(base);
    return good;
}

void score_path_destroy(ScorePath *path)
{
    free(path->off);
    free(path->left);
    free(path->toward);
    *path = (ScorePath){0};
}

double score_path_left(const ScorePath *path, Vec3 x, int node)
{
    if (!path->tree || node < 0 || node == path->goal)
        return vec3_distance(x, path->target);
    Vec3 center = path->tree->center[node], next = path->tree->center[path->toward[node]];
    return fmax(path->left[node] - vec3_dot(vec3_sub(x, center), vec3_unit(vec3_sub(next, center))), 0);
}

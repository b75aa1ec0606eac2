// Parents stand before children, so one pass in index order reaches every node from its parent; nodes upstream of the path or the target are filled
// in first by climbing from there to the root.
#include "sim/score_way.h"

#include "geom/geom.h"

#include <stdlib.h>
#include <string.h>

static double link_length(const VesselTree *tree, int child) { return vec3_distance(tree->center[child], tree->center[tree->parent[child]]); }

// left and toward: up from the goal to the root, then down everywhere else.
static void measure_left(ScoreWay *way)
{
    const VesselTree *tree = way->tree;
    for (int i = 0; i < tree->node_count; i++)
        way->toward[i] = -1;
    way->toward[way->goal] = way->goal;
    way->left[way->goal] = 0;
    // the target need not be at its node's centre: the offset along the path is subtracted or added for all nodes upstream
    int before = tree->parent[way->goal];
    Vec3 along = before >= 0 ? vec3_unit(vec3_sub(tree->center[way->goal], tree->center[before])) : tree->direction[way->goal];
    double extra = vec3_dot(vec3_sub(way->target, tree->center[way->goal]), along), total = extra;
    for (int i = way->goal; tree->parent[i] >= 0; i = tree->parent[i]) {
        int up = tree->parent[i];
        total += link_length(tree, i);
        way->left[up] = fmax(total, 0);
        way->toward[up] = i;
    }
    for (int i = 0; i < tree->node_count; i++)
        if (way->toward[i] < 0) {
            way->toward[i] = tree->parent[i];
            way->left[i] = way->left[tree->parent[i]] + link_length(tree, i);
        }
}

// `on`: 1 on the path. The path consists of the nodes on exactly one of the two chains to the root, and the fork where they meet.
static void mark_way(const ScoreWay *way, uint8_t *on)
{
    const VesselTree *tree = way->tree;
    for (int i = way->goal; i >= 0; i = tree->parent[i])
        on[i] = 1;
    int meeting = way->entry;
    while (!on[meeting])
        meeting = tree->parent[meeting];
    for (int i = tree->parent[meeting]; i >= 0; i = tree->parent[i])
        on[i] = 0;
    for (int i = way->entry; i != meeting; i = tree->parent[i])
        on[i] = 1;
    if (tree->kind[way->goal] != NODE_ANEURYSM)
        return;
    int top = way->goal;         // of the sac that holds the target: all of it is at the target
    while (tree->parent[top] >= 0 && tree->kind[tree->parent[top]] == NODE_ANEURYSM)
        top = tree->parent[top];
    on[top] = 2;
    for (int i = top + 1; i < tree->node_count; i++)
        if (tree->kind[i] == NODE_ANEURYSM && tree->parent[i] >= top && on[tree->parent[i]] == 2)
            on[i] = 2;
}

// off, with the radius of where each branch begins taken off; `base` (N) is that radius.
static void measure_off(ScoreWay *way, uint8_t *on, double *base, double target_radius)
{
    const VesselTree *tree = way->tree;
    for (int i = 0; i < tree->node_count; i++) {
        way->off[i] = 0;
        base[i] = i == way->goal ? fmax(tree->radius[i], target_radius) : tree->radius[i];
    }
    int top = way->entry;
    while (tree->parent[top] >= 0 && on[tree->parent[top]])
        top = tree->parent[top];
    for (int i = top; tree->parent[i] >= 0; i = tree->parent[i]) {       // upstream of the path
        int up = tree->parent[i];
        way->off[up] = way->off[i] + link_length(tree, i);
        base[up] = base[top];
        on[up] = 3;
    }
    for (int i = 0; i < tree->node_count; i++)
        if (!on[i]) {
            way->off[i] = way->off[tree->parent[i]] + link_length(tree, i);
            base[i] = base[tree->parent[i]];
        }
    for (int i = 0; i < tree->node_count; i++)
        way->off[i] = fmax(way->off[i] - base[i], 0);
}

bool score_way_create(ScoreWay *way, const VesselTree *tree, Vec3 mouth, Vec3 target, double target_radius)
{
    *way = (ScoreWay){.target = target};
    if (!tree)
        return true;
    size_t count = (size_t)tree->node_count;
    uint8_t *on = calloc(count, 1);
    double *base = calloc(count, sizeof *base);
    way->off = calloc(count, sizeof *way->off);
    way->left = calloc(count, sizeof *way->left);
    way->toward = calloc(count, sizeof *way->toward);
    bool good = on && base && way->off && way->left && way->toward;
    if (good) {
        way->tree = tree;
        way->entry = power_nearest(tree, mouth);
        way->goal = power_nearest(tree, target);
        measure_left(way);
        mark_way(way, on);
        measure_off(way, on, base, target_radius);
    } else {
        score_way_destroy(way);
    }
    free(on);
    free(base);
    return good;
}

void score_way_destroy(ScoreWay *way)
{
    free(way->off);
    free(way->left);
    free(way->toward);
    *way = (ScoreWay){0};
}

double score_way_left(const ScoreWay *way, Vec3 x, int node)
{
    if (!way->tree || node < 0 || node == way->goal)
        return vec3_distance(x, way->target);
    Vec3 center = way->tree->center[node], next = way->tree->center[way->toward[node]];
    return fmax(way->left[node] - vec3_dot(vec3_sub(x, center), vec3_unit(vec3_sub(next, center))), 0);
}

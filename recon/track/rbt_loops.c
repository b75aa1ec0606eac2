// An end closes a loop with a node if it lies within reach of the node's tube and points at it, if the straight line between them stays in the lumen, and if
// the path along the tree is longer than a bend of both vessels: six times the sum of their radii. A ring that two ends close from both sides is one loop.
#include "recon/track/rbt_loops.h"

#include <stdlib.h>

static const double least_lit = 0.5, least_round = 6;

static double lit_between(const Tracker *t, const TrackNode *a, const TrackNode *b)
{
    double ia = tracker_brightness(t, a->cylinder.center), ib = tracker_brightness(t, b->cylinder.center), inside = fmin(ia, ib), least = 1;
    double outside = fmin(fmax(ia - a->contrast, ib - b->contrast), inside), range = fmax(inside - outside, 1e-12);
    int steps = 2 + (int)(vec3_distance(a->cylinder.center, b->cylinder.center) / (0.25 * t->voxel));
    for (int i = 0; i <= steps; i++)
        least = fmin(least, (tracker_brightness(t, vec3_mix(a->cylinder.center, b->cylinder.center, (double)i / steps)) - outside) / range);
    return least;
}

// Path length along the tree from a to b; parents come before children.
static double arc_between(const Track *tree, const double *arc, int a, int b)
{
    int x = a, y = b;
    while (x != y)
        if (x > y)
            x = tree->node[x].parent;
        else
            y = tree->node[y].parent;
    return arc[a] + arc[b] - 2 * arc[x];
}

// Returns the node with which the end `tip`, which points along `ahead`, closes a loop, or -1. `round` receives the loop's length.
static int met_by(const Tracker *t, const double *arc, int tip, Vec3 ahead, double *round)
{
    const Track *tree = &t->tree;
    const TrackNode *end = &tree->node[tip];
    int best = -1;
    double least = HUGE_VAL;
    for (int i = 0; i < tree->count; i++) {
        const TrackNode *n = &tree->node[i];
        Vec3 to = vec3_sub(n->cylinder.center, end->cylinder.center);
        double distance = vec3_norm(to), depth = distance - n->cylinder.radius;
        if (i == tip || n->kind != NODE_VESSEL || depth > end->cylinder.radius + 2 * t->voxel || depth >= least ||
            (depth > 0 && vec3_dot(to, ahead) < 0.5 * distance))
            continue;
        double along = arc_between(tree, arc, tip, i);
        if (along < least_round * (end->cylinder.radius + n->cylinder.radius) || lit_between(t, end, n) < least_lit)
            continue;
        least = depth;
        best = i;
        *round = along + distance;
    }
    return best;
}

static int report_number(const RbtReport *report, int node)
{
    for (int b = 0; b < report->branch_count; b++)
        if (node >= report->branch[b].first_node && node < report->branch[b].first_node + report->branch[b].node_count)
            return b;
    return 0;
}

static bool is_known(const RbtReport *report, const RbtLoop *loop, double reach)
{
    for (int i = 0; i < report->loop_count; i++) {
        const RbtLoop *l = &report->loop[i];
        bool same = (l->branch == loop->branch && l->meets == loop->meets) || (l->branch == loop->meets && l->meets == loop->branch);
        if (same && vec3_distance(l->place, loop->place) < reach)
            return true;
    }
    return false;
}

bool rbt_find_loops(const Tracker *t, RbtReport *report)
{
    const Track *tree = &t->tree;
    double *arc = malloc((size_t)tree->count * sizeof *arc);
    int *children = calloc((size_t)tree->count, sizeof *children), only = -1;
    bool good = arc && children;
    report->loop = good ? calloc((size_t)tree->count + 1, sizeof *report->loop) : NULL;
    good = good && report->loop;
    for (int i = 0; good && i < tree->count; i++) {
        int parent = tree->node[i].parent;
        arc[i] = parent >= 0 ? arc[parent] + vec3_distance(tree->node[i].cylinder.center, tree->node[parent].cylinder.center) : 0;
        if (parent >= 0)
            children[parent]++;
        only = parent == 0 ? i : only;
    }
    for (int i = 0; good && i < tree->count; i++) {
        bool is_root = i == 0 && children[0] == 1;
        if (tree->node[i].kind != NODE_VESSEL || (children[i] > 0 && !is_root))
            continue;
        double round = 0;
        int parent = tree->node[i].parent, before = is_root ? only : parent;
        Vec3 ahead = vec3_unit_or(vec3_sub(tree->node[i].cylinder.center, tree->node[before >= 0 ? before : i].cylinder.center), tree->node[i].cylinder.axis);
        int met = met_by(t, arc, i, ahead, &round);
        if (met < 0)
            continue;
        RbtLoop loop = {tree->node[i].cylinder.center, report_number(report, i), report_number(report, met), round};
        double reach = 2 * (tree->node[i].cylinder.radius + tree->node[met].cylinder.radius) + 4 * t->voxel;
        if (!is_known(report, &loop, reach))
            report->loop[report->loop_count++] = loop;
    }
    free(arc);
    free(children);
    return good;
}

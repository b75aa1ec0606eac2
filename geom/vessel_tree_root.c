// Another end of a tree as its root. Nodes are numbered again, as parents come before their children: depth first, at each node the child with the lowest old
// number last, so that a branch's nodes stay together.
#include "geom/vessel_tree.h"

#include <stdlib.h>
#include <string.h>

typedef struct Renumbering {
    int *order;              // (N) old number of each new node
    int *place;              // (N) new number of each old node
    int *parent;             // (N) old number of each old node's new parent; -1: the root
    int *waiting;            // (N) stack
    bool *turns;             // (N) of old nodes: on the way from the new root to the old one
} Renumbering;

static void number_again(const VesselTree *tree, int root, Renumbering *r)
{
    int count = 0, waiting = 0;
    for (int i = root; i >= 0; i = tree->parent[i])
        r->turns[i] = true;
    r->parent[root] = -1;
    r->waiting[waiting++] = root;
    while (waiting > 0) {
        int node = r->waiting[--waiting];
        r->place[node] = count;
        r->order[count++] = node;
        for (int k = tree->neighbour_offset[node]; k < tree->neighbour_offset[node + 1]; k++) {
            int next = tree->neighbour[k];
            if (next == r->parent[node])
                continue;
            r->parent[next] = node;
            r->waiting[waiting++] = next;
        }
    }
}

static void copy_nodes(const VesselTree *from, const Renumbering *r, VesselTree *to)
{
    int64_t used = 0;
    for (int i = 0; i < from->node_count; i++) {
        int old = r->order[i];
        int64_t first = from->point_offset[old], count = from->point_offset[old + 1] - first;
        to->center[i] = from->center[old];
        to->radius[i] = from->radius[old];
        to->direction[i] = r->turns[old] ? vec3_negate(from->direction[old]) : from->direction[old];
        to->height[i] = from->height[old];
        to->parent[i] = r->parent[old] >= 0 ? r->place[r->parent[old]] : -1;
        to->kind[i] = from->kind[old];
        to->point_offset[i] = used;
        if (count > 0)
            memcpy(to->point + used, from->point + first, (size_t)count * sizeof *to->point);
        used += count;
    }
    to->point_offset[from->node_count] = used;
}

VesselTree *vessel_tree_with_root(const VesselTree *tree, int node)
{
    size_t n = (size_t)tree->node_count;
    Renumbering r = {calloc(n, sizeof(int)), calloc(n, sizeof(int)), calloc(n, sizeof(int)), calloc(n, sizeof(int)), calloc(n, sizeof(bool))};
    VesselTree *out = r.order && r.place && r.parent && r.waiting && r.turns ? vessel_tree_create(tree->node_count, tree->point_count, 0) : NULL;
    if (out) {
        number_again(tree, node, &r);
        copy_nodes(tree, &r, out);
        if (!vessel_tree_link(out)) {
            vessel_tree_free(out);
            out = NULL;
        }
    }
    free(r.order);
    free(r.place);
    free(r.parent);
    free(r.waiting);
    free(r.turns);
    return out;
}

// Steady flow in a tree: at each fork Q_child = Q r_child^3 / sum r^3 (Murray), along a branch the transit time of a piece is its volume / Q. A branch's cells
// have equal transit times, as close to the step as an integer number of cells allows, and never shorter than it unless the branch is. So a step moves the
// contents of each cell by nearly one cell, which upwind transport does without numerical diffusion at any speed.
#include "sim/contrast_network.h"

#include "base/base.h"

#include <stdlib.h>

enum { LEAST_CELLS_MAX = 20000 };

static const double INLET_SPEED = 250, HEART_FLOW = 5e6 / 60;   // [mm/s], [mm3/s]; contrast.h has the sources
static const double LEAST_SHARE = 1e-9;                         // of a fork's flow, so that no branch has zero flow
static const double LEAST_SAC = 1e-9;                           // [mm3]

typedef struct Builder {
    const VesselTree *tree;
    int node_count;
    int *up;           // (N) upstream node, -1 at the inlet
    int *order;        // (N) upstream first
    bool *flows;       // (N) blood flows through it: a vessel, or a sac's node with a vessel downstream
    double *lumen;     // (N) [mm] radius of the flow cross-section
    int *first;        // (N + 1) downstream neighbours with flow …
    int *next;         // (N) … by node
    int *branch_of;    // (N)
    int *sac_of;       // (N) -1 if none
    double *along;     // (N) [s] transit time within its branch
} Builder;

static void builder_free(Builder *b)
{
    free(b->up);
    free(b->order);
    free(b->flows);
    free(b->lumen);
    free(b->first);
    free(b->next);
    free(b->branch_of);
    free(b->sac_of);
    free(b->along);
}

static bool builder_create(Builder *b, const VesselTree *tree)
{
    size_t n = (size_t)tree->node_count;
    *b = (Builder){.tree = tree,
                   .node_count = tree->node_count,
                   .up = calloc(n, sizeof *b->up),
                   .order = calloc(n, sizeof *b->order),
                   .flows = calloc(n, sizeof *b->flows),
                   .lumen = calloc(n, sizeof *b->lumen),
                   .first = calloc(n + 2, sizeof *b->first),
                   .next = calloc(n, sizeof *b->next),
                   .branch_of = calloc(n, sizeof *b->branch_of),
                   .sac_of = calloc(n, sizeof *b->sac_of),
                   .along = calloc(n, sizeof *b->along)};
    return b->up && b->order && b->flows && b->lumen && b->first && b->next && b->branch_of && b->sac_of && b->along;
}

static bool is_sac(const Builder *b, int node) { return b->tree->kind[node] == NODE_ANEURYSM; }

// Upstream of each node, seen from the inlet: between the root and the inlet the tree's links are reversed.
static void orient(Builder *b, int inlet)
{
    const int32_t *parent = b->tree->parent;
    for (int i = 0; i < b->node_count; i++)
        b->up[i] = parent[i];
    b->up[inlet] = -1;
    for (int node = inlet; parent[node] >= 0; node = parent[node])
        b->up[parent[node]] = node;
    // upstream first: the reversed path, then all others, whose parents come before them
    int count = 0;
    bool *placed = b->flows;   // temporary use, set again below
    for (int node = inlet; node >= 0; node = parent[node]) {
        b->order[count++] = node;
        placed[node] = true;
    }
    for (int i = 0; i < b->node_count; i++)
        if (!placed[i])
            b->order[count++] = i;
    for (int i = 0; i < b->node_count; i++)
        placed[i] = false;
}

static void find_flow(Builder *b, int inlet)
{
    for (int k = b->node_count - 1; k >= 0; k--) {
        int node = b->order[k];
        b->flows[node] = b->flows[node] || !is_sac(b, node) || node == inlet;
        if (b->flows[node] && b->up[node] >= 0)
            b->flows[b->up[node]] = true;
    }
    for (int k = 0; k < b->node_count; k++) {
        int node = b->order[k], up = b->up[node];
        double radius = b->tree->radius[node];
        b->lumen[node] = is_sac(b, node) && up >= 0 ? fmin(radius, b->lumen[up]) : radius;
    }
    int *first = b->first;   // counting sort: first[node + 1] is node's fill position and finally its end
    for (int node = 0; node < b->node_count; node++)
        if (b->flows[node] && b->up[node] >= 0)
            first[b->up[node] + 2]++;
    for (int node = 0; node < b->node_count; node++)
        first[node + 2] += first[node + 1];
    for (int node = 0; node < b->node_count; node++)
        if (b->flows[node] && b->up[node] >= 0)
            b->next[first[b->up[node] + 1]++] = node;
}

static int child_count(const Builder *b, int node) { return b->first[node + 1] - b->first[node]; }
static double link_length(const Builder *b, int node) { return vec3_distance(b->tree->center[node], b->tree->center[b->up[node]]); }

// Mean radius of the branch that begins with the link to `node`, from the point where it leaves the lumen of the upstream vessel over ten radii of that vessel.
static double branch_radius(const Builder *b, int node)
{
    int start = b->up[node];
    double trunk = b->lumen[start], length = 0, sum = 0, last = b->lumen[node];
    for (int i = node;; i = b->next[b->first[i]]) {
        length += link_length(b, i);
        last = b->lumen[i];
        if (child_count(b, i) != 1 || length > 10 * trunk)
            break;
    }
    double from = fmin(trunk, length / 2), to = fmin(10 * trunk, length), s = 0;
    if (!(to > from))
        return last;
    for (int i = node; s < to; i = b->next[b->first[i]]) {
        double step = link_length(b, i), p = fmax(s, from), q = fmin(s + step, to), r0 = b->lumen[b->up[i]], r1 = b->lumen[i];
        if (q > p)
            sum += (q - p) * (r0 + (r1 - r0) * ((p + q) / 2 - s) / step);
        s += step;
        if (child_count(b, i) != 1)
            break;
    }
    return sum / (to - from);
}

static double inlet_flow(const Builder *b, int inlet, double requested_ml_s)
{
    if (requested_ml_s > 0)
        return 1000 * requested_ml_s;
    double radius = child_count(b, inlet) > 0 ? branch_radius(b, b->next[b->first[inlet]]) : b->lumen[inlet];
    return fmin(INLET_SPEED * PI * radius * radius, HEART_FLOW);
}

// Volume of a truncated cone between the sections of two nodes.
static double link_volume(const Builder *b, int node)
{
    double r0 = b->lumen[b->up[node]], r1 = b->lumen[node];
    return link_length(b, node) * PI / 3 * (r0 * r0 + r0 * r1 + r1 * r1);
}

// Follows a branch whose first node is `node`: sets its transit time and returns its last node.
static int follow(Builder *b, int node, int index, FlowBranch *branch)
{
    double volume = 0;
    for (;; node = b->next[b->first[node]]) {
        volume += b->up[node] >= 0 ? link_volume(b, node) : 0;
        b->branch_of[node] = index;
        b->along[node] = volume > 0 ? volume / branch->flow : 0;
        if (child_count(b, node) != 1)
            break;
    }
    if (branch->parent < 0 && volume == 0) {   // a single node: its own extent
        double radius = b->lumen[node];
        volume = PI * radius * radius * fmax(b->tree->height[node], radius);
    }
    branch->cell_volume = volume;   // of the whole branch, until it is divided into cells
    branch->transit = volume > 0 ? volume / branch->flow : 0;
    return node;
}

static bool make_branches(Builder *b, FlowNetwork *network, int inlet, double flow)
{
    int most = 1;
    for (int node = 0; node < b->node_count; node++)
        most += b->flows[node] && child_count(b, node) > 1 ? child_count(b, node) : 0;
    int *start = calloc((size_t)most, sizeof *start);
    network->branch = calloc((size_t)most, sizeof *network->branch);
    if (!start || !network->branch) {
        free(start);
        return false;
    }
    start[0] = inlet;
    network->branch[0] = (FlowBranch){.parent = -1, .flow = flow};
    network->branch_count = 1;
    for (int i = 0; i < network->branch_count; i++) {
        FlowBranch *branch = &network->branch[i];
        int last = follow(b, start[i], i, branch), children = child_count(b, last);
        branch->first_child = network->branch_count;
        branch->child_count = children;
        double cubes = 0, shares = 0;
        for (int pass = 0; pass < 3 && children > 0; pass++)
            for (int k = 0; k < children; k++) {
                int node = b->next[b->first[last] + k];
                double radius = branch_radius(b, node), cube = radius * radius * radius, share = fmax(cube / cubes, LEAST_SHARE);
                if (pass == 0) {
                    cubes += cube;
                } else if (pass == 1) {
                    shares += share;
                } else {
                    start[network->branch_count] = node;
                    network->branch[network->branch_count++] = (FlowBranch){.parent = i, .flow = branch->flow * share / shares};
                }
            }
    }
    free(start);
    return true;
}

// A long slow branch may need too many cells; then all branches get fewer cells.
static void cut_cells(FlowNetwork *network, double step_s)
{
    double wanted = 0, most = fmax(LEAST_CELLS_MAX, 4.0 * network->node_count);
    for (int i = 0; i < network->branch_count; i++)
        wanted += fmin(network->branch[i].transit / step_s, most);
    double share = fmin(1, most / fmax(wanted, 1));
    for (int i = 0; i < network->branch_count; i++) {
        FlowBranch *branch = &network->branch[i];
        // an integer number of cells that rounding reduced by one
        double cells = fmin(branch->transit / step_s, most) * share * (1 + 1e-12);
        branch->first_cell = network->cell_count;
        branch->cell_count = cells > 1 ? (int)cells : 1;
        branch->cell_volume /= branch->cell_count;
        network->cell_count += branch->cell_count;
    }
}

static void place_nodes(const Builder *b, FlowNetwork *network, double *start)
{
    for (int i = 0; i < network->branch_count; i++) {
        const FlowBranch *branch = &network->branch[i];
        start[i] = branch->parent >= 0 ? start[branch->parent] + network->branch[branch->parent].transit : 0;
    }
    for (int k = 0; k < b->node_count; k++) {
        int node = b->order[k];
        if (!b->flows[node]) {   // find the neck of its sac
            network->place[node] = network->place[b->up[node]];
            continue;
        }
        const FlowBranch *branch = &network->branch[b->branch_of[node]];
        double last = branch->cell_count - 1, share = branch->transit > 0 ? fmin(b->along[node] / branch->transit, 1) : 1;
        double at = fmin(fmax(share * branch->cell_count - 0.5, 0), last);
        int first = (int)at;
        network->place[node] = (FlowPlace){.branch = b->branch_of[node],
                                           .first = branch->first_cell + first,
                                           .second = branch->first_cell + (first < (int)last ? first + 1 : first),
                                           .sac = -1,
                                           .weight = (float)(at - first),
                                           .transit = start[b->branch_of[node]] + b->along[node]};
    }
}

static double sphere_volume(double r) { return 4 * PI / 3 * r * r * r; }

// Common volume of two spheres a distance d apart.
static double lens_volume(double r0, double r1, double d)
{
    if (d >= r0 + r1)
        return 0;
    double less = fmin(r0, r1), more = fmax(r0, r1);
    if (d <= more - less)
        return sphere_volume(less);
    double gap = more + less - d;
    return PI * gap * gap * (d * d + 2 * d * (more + less) - 3 * (more - less) * (more - less)) / (12 * d);
}

static int compare_necks(const void *left, const void *right)
{
    const FlowSac *a = left, *b = right;
    return a->cell != b->cell ? (a->cell > b->cell) - (a->cell < b->cell) : (a->exchange_flow > b->exchange_flow) - (a->exchange_flow < b->exchange_flow);
}

// Each connected set of a sac's nodes is one compartment: spheres around the nodes, with the overlap of neighbours counted once.
static bool hang_sacs(Builder *b, FlowNetwork *network, const ContrastOptions *options)
{
    int count = 0;
    for (int k = 0; k < b->node_count; k++) {
        int node = b->order[k], up = b->up[node];
        b->sac_of[node] = !is_sac(b, node) ? -1 : up >= 0 && is_sac(b, up) ? b->sac_of[up] : count++;
    }
    int *rank = calloc((size_t)count + 1, sizeof *rank);
    network->sac = calloc((size_t)count + 1, sizeof *network->sac);
    if (!rank || !network->sac) {
        free(rank);
        return false;
    }
    network->sac_count = count;
    for (int k = 0; k < b->node_count; k++) {
        int node = b->order[k], up = b->up[node], own = b->sac_of[node];
        if (own < 0)
            continue;
        double radius = b->tree->radius[node];
        FlowSac *sac = &network->sac[own];
        if (up < 0 || b->sac_of[up] != own) {
            const FlowPlace *neck = &network->place[up >= 0 ? up : node];
            sac->branch = neck->branch;
            sac->cell = neck->weight < 0.5f ? neck->first : neck->second;
            // stores its index until the sacs are sorted
            sac->exchange_flow = own;
        } else {
            sac->volume -= lens_volume(radius, b->tree->radius[up], link_length(b, node));
        }
        sac->volume += sphere_volume(radius);
    }
    qsort(network->sac, (size_t)count, sizeof *network->sac, compare_necks);
    for (int i = 0; i < count; i++)
        rank[(int)network->sac[i].exchange_flow] = i;
    for (int node = 0; node < b->node_count; node++)
        network->place[node].sac = b->sac_of[node] < 0 ? -1 : rank[b->sac_of[node]];
    int s = 0;
    for (int i = 0; i < network->branch_count; i++) {
        FlowBranch *branch = &network->branch[i];
        branch->first_sac = s;
        for (; s < count && network->sac[s].branch == i; s++) {
            FlowSac *sac = &network->sac[s];
            sac->volume = fmax(sac->volume, LEAST_SAC);
            // loses per step as much as an exponential would; at most half of the vessel's flow
            sac->exchange_flow = fmin(-same_expm1(-options->step_s / options->sac_residence_s) * sac->volume / options->step_s, branch->flow / 2);
        }
        branch->sac_count = s - branch->first_sac;
    }
    free(rank);
    return true;
}

bool flow_network_build(FlowNetwork *network, const VesselTree *tree, const ContrastOptions *options)
{
    *network = (FlowNetwork){.node_count = tree->node_count};
    Builder b;
    double *start = NULL;
    bool good = builder_create(&b, tree);
    if (good) {
        orient(&b, options->inlet_node);
        find_flow(&b, options->inlet_node);
        good = make_branches(&b, network, options->inlet_node, inlet_flow(&b, options->inlet_node, options->inlet_flow_ml_s));
    }
    if (good) {
        cut_cells(network, options->step_s);
        network->place = calloc((size_t)tree->node_count, sizeof *network->place);
        start = calloc((size_t)network->branch_count, sizeof *start);
        good = network->place && start;
    }
    if (good) {
        place_nodes(&b, network, start);
        good = hang_sacs(&b, network, options);
    }
    free(start);
    builder_free(&b);
    return good;
}

void flow_network_free(FlowNetwork *network)
{
    free(network->branch);
    free(network->sac);
    free(network->place);
}

// --- the inlet ---

// Mean radius of the end branch at `end`, over at most ten of its radii; 0 if the branch is shorter than 1.5 radii.
static double end_radius(const VesselTree *tree, const int *vessel_children, int end)
{
    double reach = 10 * tree->radius[end], length = 0, sum = 0;
    for (int node = end; tree->parent[node] >= 0 && length < reach; node = tree->parent[node]) {
        int up = tree->parent[node];
        double step = vec3_distance(tree->center[node], tree->center[up]);
        sum += step * (tree->radius[node] + tree->radius[up]) / 2;
        length += step;
        if (vessel_children[up] != 1)
            break;
    }
    return length > 1.5 * tree->radius[end] ? sum / length : 0;
}

static double root_radius(const VesselTree *tree, const int *vessel_children, const int *only_child)
{
    double reach = 10 * tree->radius[0], length = 0, sum = 0;
    for (int node = 0; vessel_children[node] == 1 && length < reach; node = only_child[node]) {
        double step = vec3_distance(tree->center[node], tree->center[only_child[node]]);
        sum += step * (tree->radius[node] + tree->radius[only_child[node]]) / 2;
        length += step;
    }
    return length > 0 ? sum / length : tree->radius[0];
}

int contrast_find_inlet(const VesselTree *tree)
{
    if (!tree || tree->node_count < 1)
        return -1;
    size_t n = (size_t)tree->node_count;
    int *children = calloc(n, sizeof *children), *only = calloc(n, sizeof *only), best = 0;
    if (children && only) {
        for (int i = 1; i < tree->node_count; i++)
            if (tree->kind[i] == NODE_VESSEL) {
                children[tree->parent[i]]++;
                only[tree->parent[i]] = i;
            }
        bool root_is_end = children[0] < 2 || vessel_tree_root_is_open(tree);
        double widest = root_is_end ? 1.1 * root_radius(tree, children, only) : 0;
        for (int i = 1; i < tree->node_count; i++) {
            double radius = tree->kind[i] == NODE_VESSEL && children[i] == 0 ? end_radius(tree, children, i) : 0;
            if (radius > widest) {
                widest = radius;
                best = i;
            }
        }
    }
    free(children);
    free(only);
    return best;
}

// Which rows there are.
//
// Data: the nodes' points, each in the cell that it lies in; the root's once more upstream of an open inlet, so that the wall is a tube through its plane.
// A point well inside another node's tube (half its radius) is no wall: rays cast from a parent hit the far wall of a child's mouth, and the reverse.
//
// Guards inside: every node's centre, and along a lumen's link; between a point and its axis. Their bound is half of what a round vessel's scaled field,
// 1 - (d/r)^2, has there, at most; in a cell wider than the link the field rises as slowly as that cell's, 2/r a millimetre.
// Guards outside: beyond a point, along the normal, where neither a tube nor data of a node near by are; and on a ring where a section has no points.
// They act only where they are violated. Without them a fit of signed blobs grows sheets where nothing speaks against them.
#include "recon/field_rows.h"

#include "geom/power_walk.h"
#include "recon/parallel.h"

#include <stdlib.h>
#include <string.h>

// Of a tube's radius: points nearer to its axis are not wall.
static const double LUMEN_POINT = 0.5;
enum { GUARD_EVERY = 8, RING = 10, LINK_GUARDS = 4 };

typedef struct Draft {       // rows of a node while they are collected
    int data, guards, data_room, guard_room;
    Vec3 *point, *at;
    float (*bound)[2];
    bool failed;
} Draft;

typedef struct Job {
    const VesselTree *tree;
    Draft *draft;            // (N) what each node's points and tube give …
    int **cell;              // … (N) and the cells that those rows lie in, data first
    FieldRows *rows;
    int64_t *dropped;        // (N)
} Job;

bool field_link_is_lumen(const VesselTree *tree, int node)
{
    int parent = tree->parent[node];
    return parent >= 0 && vec3_distance(tree->center[node], tree->center[parent]) <= tree->radius[node] + tree->radius[parent];
}

static void add_point(Draft *d, Vec3 x)
{
    if (d->data == d->data_room) {
        int room = 2 * d->data_room + 64;
        Vec3 *more = realloc(d->point, (size_t)room * sizeof *more);
        if (!more) {
            d->failed = true;
            return;
        }
        d->point = more;
        d->data_room = room;
    }
    d->point[d->data++] = x;
}

static void add_guard(Draft *d, Vec3 x, double low, double high)
{
    if (d->guards == d->guard_room) {
        int room = 2 * d->guard_room + 64;
        Vec3 *more = realloc(d->at, (size_t)room * sizeof *more);
        d->at = more ? more : d->at;
        float(*bound)[2] = realloc(d->bound, (size_t)room * sizeof *bound);
        d->bound = bound ? bound : d->bound;
        if (!more || !bound) {
            d->failed = true;
            return;
        }
        d->guard_room = room;
    }
    d->at[d->guards] = x;
    d->bound[d->guards][0] = (float)low;
    d->bound[d->guards++][1] = (float)high;
}

// Distance of x from the axis of node's link to its parent (its own centre, where that is no lumen), as a share of the radius there.
static double share_of_tube(const VesselTree *tree, int node, Vec3 x)
{
    int parent = tree->parent[node];
    Vec3 b = tree->center[node];
    if (!field_link_is_lumen(tree, node))
        return vec3_distance(x, b) / tree->radius[node];
    Vec3 a = tree->center[parent], e = vec3_sub(b, a);
    double length2 = vec3_norm2(e), t = length2 > 0 ? fmax(0, fmin(1, vec3_dot(vec3_sub(x, a), e) / length2)) : 1;
    // a narrow branch's link does not widen towards its parent's axis
    double r = tree->radius[node] + (1 - t) * fmin(0, tree->radius[parent] - tree->radius[node]);
    return vec3_distance(x, vec3_mix(a, b, t)) / r;
}

static bool is_in_lumen(const VesselTree *tree, int node, Vec3 x)
{
    for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1]; k++) {
        int at = k < tree->near_offset[node] ? node : tree->near[k];
        if (tree->kind[at] == NODE_VESSEL && share_of_tube(tree, at, x) < LUMEN_POINT)
            return true;
    }
    return false;
}

// Whether x is clear by `clear` of every tube and of all data near the node.
static bool is_outside(const VesselTree *tree, int node, Vec3 x, double clear)
{
    for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1]; k++) {
        int at = k < tree->near_offset[node] ? node : tree->near[k];
        double r = tree->radius[at];
        if (share_of_tube(tree, at, x) * r < 1.1 * r + 0.5 * clear)
            return false;
        if (vec3_distance(x, tree->center[at]) > r + tree->height[at] + 2 * clear + 1.5 * r)
            continue;
        for (int64_t i = tree->point_offset[at]; i < tree->point_offset[at + 1]; i++)
            if (vec3_norm2(vec3_sub(x, tree->point[i])) < clear * clear)
                return false;
    }
    return true;
}

static Vec3 axis_point(const VesselTree *tree, int node, Vec3 p)
{
    Vec3 c = tree->center[node], d = tree->direction[node];
    double along = tree->kind[node] == NODE_VESSEL ? vec3_dot(vec3_sub(p, c), d) : 0, most = 0.5 * tree->height[node];
    return vec3_add_scaled(c, fmax(-most, fmin(most, along)), d);
}

// The bound of a place at `clear` mm from the wall in a vessel of radius r.
static double low_bound(double clear, double r) { return 0.5 * fmin(1, 2 * clear / r); }

static void guard_around_point(const VesselTree *tree, int node, Vec3 p, Draft *d)
{
    Vec3 axis = axis_point(tree, node, p), out = vec3_sub(p, axis);
    double r = tree->radius[node], far = vec3_norm(out);
    if (!(far > 0.2 * r))
        return;
    out = vec3_scale(out, 1 / far);
    for (int k = 1; k <= 2; k++) {
        double in = far * k / 3;
        add_guard(d, vec3_add_scaled(p, -in, out), low_bound(0.5 * in, r), HUGE_VAL);
    }
    for (int k = 0; k < 3; k++) {
        static const double away[3] = {0.35, 0.8, 1.4};
        Vec3 x = vec3_add_scaled(p, away[k] * r, out);
        if (is_outside(tree, node, x, 0.3 * r))
            add_guard(d, x, -HUGE_VAL, -fmin(0.5, 0.5 * away[k]));
    }
}

static void guard_ring(const VesselTree *tree, int node, Draft *d)
{
    Vec3 c = tree->center[node], axis = tree->direction[node], e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
    double r = tree->radius[node];
    for (int k = 0; k < RING; k++) {
        double angle = 2 * PI * k / RING;
        Vec3 out = vec3_add(vec3_scale(e1, cos(angle)), vec3_scale(e2, sin(angle)));
        for (int far = 0; far < 2; far++) {
            Vec3 x = vec3_add_scaled(c, (1.6 + 0.6 * far) * r, out);
            if (is_outside(tree, node, x, 0.4 * r))
                add_guard(d, x, -HUGE_VAL, -0.4);
        }
    }
}

static void guard_axis(const VesselTree *tree, int node, Draft *d)
{
    int parent = tree->parent[node];
    double r = tree->radius[node];
    add_guard(d, tree->center[node], low_bound(0.5 * r, r), HUGE_VAL);
    if (!field_link_is_lumen(tree, node))
        return;
    Vec3 a = tree->center[parent], b = tree->center[node], axis = vec3_unit_or(vec3_sub(b, a), tree->direction[node]);
    Vec3 e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
    int steps = vec3_distance(a, b) > 0.3 * r ? LINK_GUARDS : 1;
    for (int k = 0; k < steps; k++) {
        double t = (k + 0.5) / steps, free = fmin(r, tree->radius[parent]);
        Vec3 x = vec3_mix(a, b, t);
        add_guard(d, x, low_bound(0.5 * free, free), HUGE_VAL);
        for (int around = 0; around < 4; around++) {
            Vec3 side = around < 2 ? e1 : e2;
            add_guard(d, vec3_add_scaled(x, (around % 2 ? 0.4 : -0.4) * free, side), low_bound(0.3 * free, free), HUGE_VAL);
        }
    }
}

// The root's own points again, upstream by their extent along the axis.
static void extend_inlet(const VesselTree *tree, Draft *d)
{
    Vec3 root = tree->center[0], up = vec3_negate(tree->direction[0]);
    double r = tree->radius[0], least = HUGE_VAL, most = -HUGE_VAL;
    int own = d->data, slab_points = 0;
    for (int i = 0; i < own; i++) {
        double t = vec3_dot(vec3_sub(d->point[i], root), up);
        least = fmin(least, t), most = fmax(most, t);
    }
    double slab = fmin(most - least, 0.4 * r);
    if (own < 12 || most - least < 0.2 * r)
        return;
    for (int i = 0; i < own; i++)
        slab_points += vec3_dot(vec3_sub(d->point[i], root), up) >= most - slab;
    slab = slab_points < 12 ? most - least : slab;
    for (int copy = 1; copy < 16 && most + (copy - 1) * slab < FIELD_INLET_RADII * r; copy++)
        for (int i = 0; i < own; i++) {
            Vec3 p = d->point[i];
            double t = vec3_dot(vec3_sub(p, root), up);
            if (t >= most - slab && t + copy * slab < FIELD_INLET_RADII * r)
                add_point(d, vec3_add_scaled(p, copy * slab, up));
        }
    for (int k = 1; k <= 4; k++)
        add_guard(d, vec3_add_scaled(root, 0.5 * k * r, up), low_bound(0.5 * r, r), HUGE_VAL);
}

static void draft_node(void *context, long index)
{
    Job *job = context;
    const VesselTree *tree = job->tree;
    int node = (int)index, root_open = node == 0 && vessel_tree_root_is_open(tree);
    Draft *d = &job->draft[node];
    for (int64_t i = tree->point_offset[node]; i < tree->point_offset[node + 1]; i++) {
        Vec3 p = tree->point[i];
        if (is_in_lumen(tree, node, p))
            job->dropped[node]++;
        else
            add_point(d, p);
    }
    for (int i = (node * 3) % GUARD_EVERY; i < d->data; i += GUARD_EVERY)
        guard_around_point(tree, node, d->point[i], d);
    if (root_open)
        extend_inlet(tree, d);
    guard_axis(tree, node, d);
    if (tree->kind[node] == NODE_VESSEL)
        guard_ring(tree, node, d);
    if (d->failed)
        return;
    job->cell[node] = malloc(((size_t)(d->data + d->guards) + 1) * sizeof **job->cell);
    if (!job->cell[node]) {
        d->failed = true;
        return;
    }
    for (int i = 0; i < d->data; i++)
        job->cell[node][i] = power_walk(tree, d->point[i], node, 8);
    for (int i = 0; i < d->guards; i++)
        job->cell[node][d->data + i] = power_walk(tree, d->at[i], node, 8);
}

static bool reserve(NodeRows *n)
{
    n->data_padded = (n->data + FIELD_LANES - 1) / FIELD_LANES * FIELD_LANES;
    n->guards_padded = (n->guards + FIELD_LANES - 1) / FIELD_LANES * FIELD_LANES;
    size_t d = (size_t)n->data_padded, g = (size_t)n->guards_padded, all = 3 * (d + g) + d + 3 * g;
    n->memory = aligned_alloc(64, (all + FIELD_LANES) * sizeof(float));
    if (!n->memory)
        return false;
    memset(n->memory, 0, (all + FIELD_LANES) * sizeof(float));
    n->x = n->memory, n->y = n->x + d + g, n->z = n->y + d + g;
    n->weight = n->z + d + g, n->low = n->weight + d, n->high = n->low + g, n->guard = n->high + g;
    n->data = n->guards = 0;
    return true;
}

static void put_rows(const Job *job)
{
    const VesselTree *tree = job->tree;
    for (int i = 0; i < tree->node_count; i++) {
        const Draft *d = &job->draft[i];
        for (int k = 0; k < d->data + d->guards; k++) {
            bool is_data = k < d->data;
            int cell = job->cell[i][k];
            NodeRows *to = &job->rows->node[cell];
            int at = is_data ? to->data++ : to->data_padded + to->guards++;
            Vec3 x = vec3_sub(is_data ? d->point[k] : d->at[k - d->data], tree->center[cell]);
            to->x[at] = (float)x.x, to->y[at] = (float)x.y, to->z[at] = (float)x.z;
            if (is_data) {
                to->weight[at] = 1;
                continue;
            }
            int g = at - to->data_padded;
            // in a cell wider than the vessel that the guard is of, its field rises more slowly
            float scale = (float)fmin(1, tree->radius[i] / tree->radius[cell]);
            to->low[g] = d->bound[k - d->data][0] * scale, to->high[g] = d->bound[k - d->data][1] * scale;
            to->guard[g] = 1;
        }
    }
}

static bool count_rows(const Job *job)
{
    for (int i = 0; i < job->tree->node_count; i++) {
        const Draft *d = &job->draft[i];
        if (d->failed)
            return false;
        for (int k = 0; k < d->data + d->guards; k++)
            if (k < d->data)
                job->rows->node[job->cell[i][k]].data++;
            else
                job->rows->node[job->cell[i][k]].guards++;
    }
    for (int i = 0; i < job->tree->node_count; i++)
        if (!reserve(&job->rows->node[i]))
            return false;
    return true;
}

bool field_rows_create(FieldRows *rows, const VesselTree *tree, int threads)
{
    size_t n = (size_t)tree->node_count;
    *rows = (FieldRows){.node_count = tree->node_count, .node = calloc(n, sizeof *rows->node)};
    Job job = {tree, calloc(n, sizeof *job.draft), calloc(n, sizeof *job.cell), rows, calloc(n, sizeof *job.dropped)};
    bool good = rows->node && job.draft && job.cell && job.dropped;
    if (good) {
        parallel_for(threads, tree->node_count, draft_node, &job, NULL);
        good = count_rows(&job);
    }
    if (good)
        put_rows(&job);
    for (int i = 0; i < tree->node_count && job.draft && job.cell && job.dropped; i++) {
        rows->dropped += job.dropped[i];
        free(job.draft[i].point);
        free(job.draft[i].at);
        free(job.draft[i].bound);
        free(job.cell[i]);
    }
    free(job.draft);
    free(job.cell);
    free(job.dropped);
    if (!good)
        field_rows_free(rows);
    return good;
}

void field_rows_free(FieldRows *rows)
{
    for (int i = 0; i < rows->node_count && rows->node; i++)
        free(rows->node[i].memory);
    free(rows->node);
    *rows = (FieldRows){0};
}

// The surface of a fitted tree as sheets: marching cubes in which a lattice point may lie in several lumens at once.
//
// A state is a lattice point x and a node at which a tool point at x may be, whose field at x is above 0. For local models it must be a node that power_walk
// does not leave; for shared blobs, a node that no near node beats by power distance, because only within such cells does a node see all blobs. Where vessels
// touch, x has a state for each of them; where they overlap, both lumens contain it. Two states at the ends of a lattice edge are linked if a tool point that
// moves from one end to the other, in either direction, goes from one node to the other. In each cube, the states connected by linked edges make a sheet, and
// each sheet gives the triangles of its own case. Neighbouring cubes give the same segments on their common face, because a case cuts off each run of corners
// on a face separately (cube_triangles.h), and runs follow from the edges of that face. So the surface is closed, and lumens that only touch neither merge nor
// cut each other open.
//
// Two rules ensure this although walks are not symmetric: states of one point that are in one sheet of some cube are one state everywhere, and two states at
// the ends of an edge that are in one sheet are linked. Both rules are repeated until nothing changes, over the cubes in which some point has two states or the
// states of some edge are not linked; all other cubes are plain marching cubes.
//
// A block of the lattice (sparse_march.h) is visited only if some model reaches it, and skipped if bounds of the kernels show that it is all outside or all
// inside: work and memory grow with the surface. The lattice point (i, j, k) lies at cell * (i, j, k), for every tree.
#include "base/base.h"
#include "geom/blobby.h"
#include "geom/isosurface.h"
#include "geom/power_walk.h"
#include "geom/sparse_march.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum { STATES_MAX = 8, CUBE_STATES_MAX = 8 * STATES_MAX, RIVALS_MAX = 96, PATHS_MAX = 256, PASSES_MAX = 100 };

// A node has no lumen further from its centre than this [its radii], because other nodes are closer there; the blobs of a sac reach far into all cells around
// it. For the root, upstream of which there is no node, the limit is twice as large.
static const double REACH_MOST = 3;

typedef struct Candidate {   // a node that reaches the current block, whose field may be above 0 there and that no other node beats in all of it
    int node, ball, first_row;
    double low;              // lower bound of its field
    Blobby model;
    double reach;            // [mm] upper bound of the distance of the model's surface from the node's centre
    int rivals, rival[RIVALS_MAX];           // near nodes that beat it somewhere in the block
} Candidate;

typedef struct States {      // of a lattice point
    int count, node[STATES_MAX];
    double field[STATES_MAX];
} States;

typedef struct TreePath {    // path to a node whose ball may hold points that another node's model reaches
    int node, from;
    double length;           // [mm] through the tree
} TreePath;

typedef struct SheetPoint {  // a corner of a cube that is not plain
    int at[3], first, count;
} SheetPoint;
typedef struct SheetCube {
    int corner[8];           // points
} SheetCube;

typedef struct SheetMarch {
    March march;
    const VesselTree *tree;
    int alone;               // the only node whose model is meshed; -1: the whole tree
    bool by_power;           // a point goes to any near node with a lesser power distance, without further conditions
    int ball_count, *node;   // the march's balls: their nodes …
    double *reach;           // … and reaches
    int *path_offset, path_capacity;         // (balls + 1) offset of the paths of each ball …
    TreePath *path;          // … the paths that look_around of power_walk.c would find, at most PATHS_MAX
    int candidate_count, candidate_capacity, out_count, out_capacity;
    Candidate *candidate;
    int *out;                // nodes excluded as candidates only because their field is below 0 all over the block
    int32_t *row;            // blobs of candidates that reach the block
    int row_count, row_capacity;
    States states[MARCH_POINTS];             // of the current block
    // for cubes that are not plain
    KeyMap point_of, link_of, vertex_of_state;
    int point_count, point_capacity, cube_count, cube_capacity, state_count, state_capacity;
    SheetPoint *point;
    SheetCube *cube;
    struct SheetState {
        int node, point;
        double field;
    } * state;
    int *same, same_capacity;                // disjoint sets of identical states
} SheetMarch;

// --- Extent of the models ---

// f > 0 requires one blob that alone contributes T / n, rho (1 + x^2 / (5 rho^2))^-2 > T / n; or, for compact blobs, the support of one with a > 0.
static double reach_of_model(const Blobby *m, Vec3 center)
{
    double reach = 0;
    for (int j = 0; j < m->count && m->amplitude; j++) {
        int k = blobby_row(m, j);
        if (m->amplitude[k] > 0)
            reach = fmax(reach, vec3_distance(center, m->center[k]) + m->width[k]);
    }
    for (int j = 0; j < m->count && !m->amplitude; j++) {
        double rho = m->width[j], ratio = rho * m->count / m->iso_level;
        if (ratio > 1)
            reach = fmax(reach, vec3_distance(center, m->center[j]) + rho * sqrt(5 * (sqrt(ratio) - 1)));
    }
    return reach;
}

// Bounds of a model's field in the ball of radius h about x.
static void field_bounds(const Blobby *m, Vec3 x, double h, double *low, double *high)
{
    *low = *high = -m->iso_level;
    for (int j = 0; j < m->count; j++) {
        int k = blobby_row(m, j);
        double rho = m->width[k], d = vec3_distance(x, m->center[k]), near = d > h ? d - h : 0, far = d + h;
        if (m->amplitude) {
            if (near >= rho)
                continue;
            double a = m->amplitude[k], u = 1 - near * near / (rho * rho), v = far < rho ? 1 - far * far / (rho * rho) : 0;
            *high += a * (a > 0 ? u * u * u : v * v * v);
            *low += a * (a > 0 ? v * v * v : u * u * u);
            continue;
        }
        double u = 1 / (1 + near * near / (5 * rho * rho)), v = 1 / (1 + far * far / (5 * rho * rho));
        *high += rho * u * u;
        *low += rho * v * v;
    }
}

// Breadth-first search through the tree, as far as a point at the end of the ball's reach would search.
static bool list_paths(SheetMarch *job, int ball)
{
    const VesselTree *tree = job->tree;
    int node = job->node[ball], known = 1;
    TreePath path[PATHS_MAX] = {{node, -1, 0}};
    job->path_offset[ball + 1] = job->path_offset[ball];
    for (int w = 0; w < known; w++) {
        TreePath at = path[w];
        for (int k = tree->neighbour_offset[at.node]; k < tree->neighbour_offset[at.node + 1] && known < PATHS_MAX; k++) {
            int next = tree->neighbour[k];
            double length = at.length + vec3_distance(tree->center[at.node], tree->center[next]);
            if (next != at.from && length < 2.5 * job->reach[ball])
                path[known++] = (TreePath){next, at.node, length};
        }
        int *count = &job->path_offset[ball + 1];
        if (w == 0 || vec3_distance(tree->center[at.node], tree->center[node]) - tree->radius[at.node] > job->reach[ball])
            continue;
        if (*count == job->path_capacity) {
            int capacity = 2 * job->path_capacity + 4096;
            TreePath *more = realloc(job->path, (size_t)capacity * sizeof *more);
            if (!more)
                return false;
            job->path = more;
            job->path_capacity = capacity;
        }
        job->path[(*count)++] = at;
    }
    return true;
}

static bool find_blocks(SheetMarch *job, int first, int end)
{
    const VesselTree *tree = job->tree;
    job->node = malloc((size_t)(end - first) * sizeof *job->node);
    job->reach = malloc((size_t)(end - first) * sizeof *job->reach);
    job->path_offset = calloc((size_t)(end - first) + 1, sizeof *job->path_offset);
    if (!job->node || !job->reach || !job->path_offset)
        return false;
    for (int i = first; i < end; i++) {
        Blobby model = blobby_of(tree, i);
        double reach = reach_of_model(&model, tree->center[i]);
        if (!(reach > 0))
            continue;
        if (job->alone < 0)
            reach = fmin(reach, (tree->parent[i] < 0 ? 2 : 1) * REACH_MOST * tree->radius[i]);
        job->node[job->ball_count] = i;
        job->reach[job->ball_count++] = reach + 2 * job->march.cell;
    }
    for (int n = 0; n < job->ball_count; n++)
        if ((job->alone < 0 && !list_paths(job, n)) || !march_add_ball(&job->march, n, tree->center[job->node[n]], job->reach[n]))
            return false;
    return true;
}

// Returns whether all points of the ball (x, h) lie clearly outside their node's ball and move to a node whose ball holds them (power_walk.h). The list of
// paths does not depend on the point, so what holds for a block holds for its points.
static bool walks_elsewhere(const SheetMarch *job, int ball, Vec3 x, double h)
{
    const VesselTree *tree = job->tree;
    double near = vec3_distance(x, tree->center[job->node[ball]]) - h;
    if (job->alone >= 0 || !(near > 1.2 * tree->radius[job->node[ball]]))
        return false;
    for (int k = job->path_offset[ball]; k < job->path_offset[ball + 1]; k++) {
        const TreePath *path = &job->path[k];
        double r = tree->radius[path->node] - h;
        if (path->length < 2.5 * near && r > 0 && vec3_norm2(vec3_sub(x, tree->center[path->node])) < r * r)
            return true;
    }
    return false;
}

// --- Candidates of a block ---

// A walk moves to a better node only within two radii of it, or if the point is closer to it relative to the radii (power_walk.h). The difference of two power
// distances is linear, so its range over the cube around `middle` (h: circumscribed radius) follows from its slope.
static bool list_rivals(const SheetMarch *job, Candidate *c, Vec3 middle, double h)
{
    const VesselTree *tree = job->tree;
    double half = h / sqrt(3), own_far = vec3_distance(middle, tree->center[c->node]), own_radius = tree->radius[c->node];
    double own = own_far * own_far - own_radius * own_radius;
    c->rivals = 0;
    for (int k = tree->near_offset[c->node]; k < tree->near_offset[c->node + 1] && job->alone < 0; k++) {
        int other = tree->near[k];
        double r = tree->radius[other], far = vec3_distance(middle, tree->center[other]), better = own - (far * far - r * r);
        Vec3 apart = vec3_sub(tree->center[other], tree->center[c->node]);
        double change = 2 * half * (fabs(apart.x) + fabs(apart.y) + fabs(apart.z));
        if (better - change > 0 && (job->by_power || far + h < 2 * r || (far + h) * own_radius < (own_far - h) * r))
            return false;
        if (better + change > 0 && c->rivals < RIVALS_MAX)
            c->rival[c->rivals++] = other;
    }
    return true;
}

static bool grow_by(void **array, int count, int *capacity, int more, size_t size)
{
    if (count + more <= *capacity)
        return true;
    if (*capacity > INT_MAX / 4)
        return false;
    int bigger = 2 * *capacity + more + 1024;
    void *moved = realloc(*array, (size_t)bigger * size);
    if (!moved)
        return false;
    *array = moved;
    *capacity = bigger;
    return true;
}

// For compact blobs, keeps only those that reach the ball (middle, h), because the others' terms are 0 there. Their rows start at c->first_row.
static bool narrow_model(SheetMarch *job, Candidate *c, Vec3 middle, double h)
{
    const Blobby *all = &c->model;
    c->first_row = job->row_count;
    if (!all->amplitude)
        return true;
    if (!grow_by((void **)&job->row, job->row_count, &job->row_capacity, all->count, sizeof *job->row))
        return false;
    for (int j = 0; j < all->count; j++) {
        int k = blobby_row(all, j);
        double most = all->width[k] + h;
        if (vec3_norm2(vec3_sub(middle, all->center[k])) < most * most)
            job->row[job->row_count++] = k;
    }
    c->model.count = job->row_count - c->first_row;
    return true;
}

static bool list_candidates(SheetMarch *job, const MarchBlock *b)
{
    double h, high;
    Vec3 middle = march_block_ball(&job->march, b, &h);
    job->candidate_count = job->out_count = job->row_count = 0;
    for (int l = b->first; l >= 0; l = job->march.link[l].next) {
        if (!grow_by((void **)&job->candidate, job->candidate_count, &job->candidate_capacity, 1, sizeof *job->candidate) ||
            !grow_by((void **)&job->out, job->out_count, &job->out_capacity, 1, sizeof *job->out))
            return false;
        int ball = job->march.link[l].ball;
        Candidate *c = &job->candidate[job->candidate_count];
        c->node = job->node[ball];
        c->ball = ball;
        c->reach = job->reach[ball];
        if (!list_rivals(job, c, middle, h) || walks_elsewhere(job, ball, middle, h))
            continue;
        c->model = blobby_of(job->tree, c->node);
        field_bounds(&c->model, middle, h, &c->low, &high);
        if (!(high > -1e-9)) {
            job->out[job->out_count++] = c->node;
            continue;
        }
        if (!narrow_model(job, c, middle, 1.001 * h))
            return false;
        job->candidate_count++;
    }
    for (int k = 0; k < job->candidate_count; k++)
        if (job->candidate[k].model.amplitude)
            job->candidate[k].model.index = job->row + job->candidate[k].first_row;
    return true;
}

static bool is_near(const VesselTree *tree, int node, int other)
{
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++)
        if (tree->near[k] == other)
            return true;
    return false;
}

// Returns whether a walk from a candidate may lead to a node whose field is below 0.
static bool may_lead_out(const SheetMarch *job)
{
    for (int k = 0; k < job->candidate_count; k++)
        for (int i = 0; i < job->out_count; i++)
            if (is_near(job->tree, job->candidate[k].node, job->out[i]))
                return true;
    return false;
}

// Returns whether the block certainly contains no surface: either no model can be above 0 in it, or all are above 0 and a walk from one of them does not leave
// it anywhere in the block.
static bool block_is_plain(const SheetMarch *job, const MarchBlock *b)
{
    double h;
    Vec3 middle = march_block_ball(&job->march, b, &h);
    bool all_in = true, covered = false;
    for (int k = 0; k < job->candidate_count && all_in; k++) {
        const Candidate *c = &job->candidate[k];
        double furthest = vec3_distance(middle, job->tree->center[c->node]) + h;
        all_in = c->low > 1e-9;
        covered = covered || (furthest < c->reach && (job->alone >= 0 || (c->rivals == 0 && furthest < 1.2 * job->tree->radius[c->node])));
    }
    return job->candidate_count == 0 || (all_in && covered && (job->alone >= 0 || !may_lead_out(job)));
}

// --- States ---

static int walk_on(const SheetMarch *job, Vec3 x, int node)
{
    const VesselTree *tree = job->tree;
    if (job->alone >= 0)
        return node;
    if (!job->by_power)
        return power_walk(tree, x, node, 4);
    double best = power_distance(x, tree->center[node], tree->radius[node]);
    for (int here = -1; here != node;) {
        here = node;
        for (int k = tree->near_offset[here]; k < tree->near_offset[here + 1]; k++) {
            double d = power_distance(x, tree->center[tree->near[k]], tree->radius[tree->near[k]]);
            if (d < best)
                best = d, node = tree->near[k];
        }
    }
    return node;
}

static bool is_beaten(const SheetMarch *job, const Candidate *c, Vec3 x)
{
    const VesselTree *tree = job->tree;
    double own_far2 = vec3_norm2(vec3_sub(x, tree->center[c->node])), own_r2 = tree->radius[c->node] * tree->radius[c->node], own = own_far2 - own_r2;
    for (int k = 0; k < c->rivals; k++) {
        int other = c->rival[k];
        double r = tree->radius[other], far2 = vec3_norm2(vec3_sub(x, tree->center[other]));
        if (far2 - r * r < own && (job->by_power || far2 < 4 * r * r || far2 * own_r2 < own_far2 * r * r))
            return true;
    }
    return false;
}

// Removes nodes that are further from x than 1.2 of their radii if another node's ball holds x in its lumen: the cell of a vessel beside a sac extends all
// across the sac and sees some of its blobs.
static void drop_distant(const SheetMarch *job, Vec3 x, States *states)
{
    const VesselTree *tree = job->tree;
    bool is_held = false;
    int kept = 0;
    for (int s = 0; s < states->count; s++) {
        int node = states->node[s];
        is_held = is_held || vec3_norm2(vec3_sub(x, tree->center[node])) < tree->radius[node] * tree->radius[node];
    }
    for (int s = 0; s < states->count; s++) {
        int node = states->node[s];
        if (is_held && vec3_norm2(vec3_sub(x, tree->center[node])) > 1.44 * tree->radius[node] * tree->radius[node])
            continue;
        states->node[kept] = node;
        states->field[kept++] = states->field[s];
    }
    states->count = kept;
}

static void find_states(SheetMarch *job, Vec3 x, States *states)
{
    states->count = 0;
    for (int k = 0; k < job->candidate_count && states->count < STATES_MAX; k++) {
        const Candidate *c = &job->candidate[k];
        if (vec3_norm2(vec3_sub(x, job->tree->center[c->node])) > c->reach * c->reach || is_beaten(job, c, x) || walks_elsewhere(job, c->ball, x, 0))
            continue;
        double field = blobby_field(&c->model, x);
        if (field > 0) {
            states->node[states->count] = c->node;
            states->field[states->count++] = field;
        }
    }
    if (states->count > 1)
        drop_distant(job, x, states);
}

// Returns whether a tool point that moves from x, where its node is a, to y arrives at node b, or the reverse.
static bool is_linked(const SheetMarch *job, Vec3 x, int a, Vec3 y, int b)
{
    return a == b || is_near(job->tree, a, b) || is_near(job->tree, b, a) || walk_on(job, y, a) == b || walk_on(job, x, b) == a;
}

// --- Vertices ---

// Moves p onto the model's surface, by at most three quarters of a cell: where neighbouring models disagree there may be no surface near, and p stays.
static Vec3 settle(const SheetMarch *job, const Blobby *m, Vec3 p, Vec3 *normal)
{
    Vec3 g, x = p;
    for (int i = 0; i < 20; i++) {
        double f = blobby_gradient(m, x, &g), g2 = vec3_norm2(g);
        if (!(g2 > 1e-200))
            break;
        Vec3 step = vec3_scale(g, -f / g2);
        x = vec3_add(x, step);
        if (vec3_distance(x, p) > 0.75 * job->march.cell)
            break;
        if (vec3_norm(step) < 1e-12) {
            *normal = vec3_unit(vec3_negate(g));
            return x;
        }
    }
    blobby_gradient(m, p, &g);
    *normal = vec3_unit_or(vec3_negate(g), vec3(1, 0, 0));
    return p;
}

static Vec3 lattice_point(const SheetMarch *job, const int at[3]) { return vec3(at[0] * job->march.cell, at[1] * job->march.cell, at[2] * job->march.cell); }

static uint64_t lattice_key(const int at[3]) { return march_key(at[0], at[1], at[2]); }

// The vertex on the edge from the inside point `at` along axis, up or down, stored in `map` under `key`.
static bool add_vertex(SheetMarch *job, KeyMap *map, uint64_t key, const int at[3], int axis, bool up, int node, double field, int *index)
{
    TriangleMesh *mesh = job->march.mesh;
    bool is_new;
    int *found = key_map_find_or_add(map, key, mesh->vertex_count, &is_new);
    if (!found)
        return false;
    *index = *found;
    if (!is_new)
        return true;
    if (!march_reserve(&job->march))
        return false;
    int beside[3] = {at[0], at[1], at[2]};
    beside[axis] += up ? 1 : -1;
    Vec3 in = lattice_point(job, at), out = lattice_point(job, beside);
    Blobby model = blobby_of(job->tree, walk_on(job, out, node));
    double there = blobby_field(&model, out), share = there < 0 ? field / (field - there) : 0.5, least = job->march.least_share;
    Vec3 p = vec3_mix(in, out, fmin(fmax(share, least), 1 - least));
    int v = mesh->vertex_count++, of = walk_on(job, p, node);
    model = blobby_of(job->tree, of);
    mesh->vertex[v] = settle(job, &model, p, &mesh->normal[v]);
    mesh->node[v] = of;
    return true;
}

// --- Cubes ---

static const States *corner_states(const SheetMarch *job, int i, int j, int k, int corner)
{
    return &job->states[march_index(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2 & 1))];
}

static bool cube_is_plain(const SheetMarch *job, const MarchBlock *b, int i, int j, int k)
{
    for (int c = 0; c < 8; c++)
        if (corner_states(job, i, j, k, c)->count > 1)
            return false;
    for (int edge = 0; edge < 12; edge++) {
        int c = cube_edge_start(edge), d = cube_edge_end(edge);
        const States *s = corner_states(job, i, j, k, c), *t = corner_states(job, i, j, k, d);
        if (s->count == 0 || t->count == 0 || s->node[0] == t->node[0])
            continue;
        Vec3 x = march_point(&job->march, b, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1));
        Vec3 y = march_point(&job->march, b, i + (d & 1), j + (d >> 1 & 1), k + (d >> 2 & 1));
        if (!is_linked(job, x, s->node[0], y, t->node[0]))
            return false;
    }
    return true;
}

static bool march_plain_cube(SheetMarch *job, const MarchBlock *b, int i, int j, int k, int mask)
{
    const CubeCase *cube = &job->march.table.of[mask];
    for (int t = 0; t < cube->count; t++) {
        int triangle[3];
        for (int v = 0; v < 3; v++) {
            int edge = cube->edge[t][v], low = cube_edge_start(edge), high = cube_edge_end(edge);
            bool up = mask >> low & 1;
            int c = up ? low : high, axis = edge / 4, at[3] = {b->base[0] + i + (c & 1), b->base[1] + j + (c >> 1 & 1), b->base[2] + k + (c >> 2 & 1)};
            const States *s = corner_states(job, i, j, k, c);
            uint64_t key = lattice_key(at) << 3 | (uint64_t)(2 * axis + up);
            if (!add_vertex(job, &job->march.vertex_of, key, at, axis, up, s->node[0], s->field[0], &triangle[v]))
                return false;
        }
        if (!march_add_triangle(&job->march, triangle))
            return false;
    }
    return true;
}

// The point's index; a new point is added with its states. Returns -1 if out of memory.
static int keep_point(SheetMarch *job, const int at[3], const States *states)
{
    bool is_new;
    int *found = key_map_find_or_add(&job->point_of, lattice_key(at), job->point_count, &is_new);
    if (!found)
        return -1;
    if (!is_new)
        return *found;
    int index = *found;
    if (!grow_by((void **)&job->point, job->point_count, &job->point_capacity, 1, sizeof *job->point) ||
        !grow_by((void **)&job->state, job->state_count, &job->state_capacity, states->count, sizeof *job->state) ||
        !grow_by((void **)&job->same, job->state_count, &job->same_capacity, states->count, sizeof *job->same))
        return -1;
    job->point[job->point_count++] = (SheetPoint){{at[0], at[1], at[2]}, job->state_count, states->count};
    for (int s = 0; s < states->count; s++, job->state_count++) {
        job->state[job->state_count] = (struct SheetState){states->node[s], index, states->field[s]};
        job->same[job->state_count] = job->state_count;
    }
    return index;
}

static bool keep_cube(SheetMarch *job, const MarchBlock *b, int i, int j, int k)
{
    if (!grow_by((void **)&job->cube, job->cube_count, &job->cube_capacity, 1, sizeof *job->cube))
        return false;
    SheetCube *cube = &job->cube[job->cube_count++];
    for (int c = 0; c < 8; c++) {
        int at[3] = {b->base[0] + i + (c & 1), b->base[1] + j + (c >> 1 & 1), b->base[2] + k + (c >> 2 & 1)};
        cube->corner[c] = keep_point(job, at, corner_states(job, i, j, k, c));
        if (cube->corner[c] < 0)
            return false;
    }
    return true;
}

static bool march_cubes(SheetMarch *job, const MarchBlock *b)
{
    for (int i = 0; i < MARCH_BLOCK; i++)
        for (int j = 0; j < MARCH_BLOCK; j++)
            for (int k = 0; k < MARCH_BLOCK; k++) {
                int mask = 0;
                for (int c = 0; c < 8; c++)
                    mask |= (corner_states(job, i, j, k, c)->count > 0) << c;
                if (mask == 0)
                    continue;
                if (!(cube_is_plain(job, b, i, j, k) ? march_plain_cube(job, b, i, j, k, mask) : keep_cube(job, b, i, j, k)))
                    return false;
            }
    return true;
}

// --- Cubes that are not plain ---

typedef struct CubeSheets {  // the states at a cube's corners; sheet[s]: the lowest of the states that are connected with s
    int count, state[CUBE_STATES_MAX], corner[CUBE_STATES_MAX], sheet[CUBE_STATES_MAX];
} CubeSheets;

static uint64_t pair_key(int a, int b) { return a < b ? (uint64_t)(uint32_t)a << 32 | (uint32_t)b : (uint64_t)(uint32_t)b << 32 | (uint32_t)a; }

static bool states_linked(const SheetMarch *job, int a, int b)
{
    const struct SheetState *s = &job->state[a], *t = &job->state[b];
    if (key_map_find(&job->link_of, pair_key(a, b)) >= 0)
        return true;
    return is_linked(job, lattice_point(job, job->point[s->point].at), s->node, lattice_point(job, job->point[t->point].at), t->node);
}

static void find_sheets(SheetMarch *job, const SheetCube *cube, CubeSheets *sheets)
{
    sheets->count = 0;
    for (int c = 0; c < 8; c++) {
        const SheetPoint *p = &job->point[cube->corner[c]];
        for (int s = 0; s < p->count; s++) {
            sheets->state[sheets->count] = p->first + s;
            sheets->corner[sheets->count] = c;
            sheets->sheet[sheets->count] = sheets->count;
            sheets->count++;
        }
    }
    for (int a = 0; a < sheets->count; a++)
        for (int b = a + 1; b < sheets->count; b++) {
            int apart = sheets->corner[a] ^ sheets->corner[b];
            bool same = apart == 0 && disjoint_root(job->same, sheets->state[a]) == disjoint_root(job->same, sheets->state[b]);
            if (apart == 1 || apart == 2 || apart == 4)
                same = states_linked(job, sheets->state[a], sheets->state[b]);
            if (same)
                disjoint_join(sheets->sheet, a, b);
        }
    for (int a = 0; a < sheets->count; a++)
        sheets->sheet[a] = disjoint_root(sheets->sheet, a);
}

// Applies the two rules to a cube: states connected in it must be identical or linked wherever their points and edges occur again. Returns true if that changed
// anything.
static bool unify(SheetMarch *job, const CubeSheets *sheets, bool *failed)
{
    bool changed = false;
    for (int a = 0; a < sheets->count; a++)
        for (int b = a + 1; b < sheets->count; b++) {
            int apart = sheets->corner[a] ^ sheets->corner[b], s = sheets->state[a], t = sheets->state[b];
            if (sheets->sheet[a] != sheets->sheet[b])
                continue;
            if (apart == 0 && disjoint_root(job->same, s) != disjoint_root(job->same, t)) {
                disjoint_join(job->same, s, t);
                changed = true;
            }
            if ((apart == 1 || apart == 2 || apart == 4) && !states_linked(job, s, t)) {
                bool is_new;
                *failed = *failed || !key_map_find_or_add(&job->link_of, pair_key(s, t), 0, &is_new);
                changed = true;
            }
        }
    return changed;
}

static bool march_sheet(SheetMarch *job, const SheetCube *cube, const CubeSheets *sheets, int sheet)
{
    int mask = 0, of[8];
    for (int a = 0; a < sheets->count; a++)
        if (sheets->sheet[a] == sheet) {
            mask |= 1 << sheets->corner[a];
            of[sheets->corner[a]] = disjoint_root(job->same, sheets->state[a]);
        }
    const CubeCase *triangles = &job->march.table.of[mask];
    for (int t = 0; t < triangles->count; t++) {
        int triangle[3];
        for (int v = 0; v < 3; v++) {
            int edge = triangles->edge[t][v], low = cube_edge_start(edge), high = cube_edge_end(edge), axis = edge / 4;
            bool up = mask >> low & 1;
            int c = up ? low : high;
            const SheetPoint *p = &job->point[cube->corner[c]];
            const struct SheetState *s = &job->state[of[c]];
            bool several = p->count > 1;
            uint64_t key = (several ? (uint64_t)of[c] : lattice_key(p->at)) << 3 | (uint64_t)(2 * axis + up);
            if (!add_vertex(job, several ? &job->vertex_of_state : &job->march.vertex_of, key, p->at, axis, up, s->node, s->field, &triangle[v]))
                return false;
        }
        if (!march_add_triangle(&job->march, triangle))
            return false;
    }
    return true;
}

static bool march_kept_cubes(SheetMarch *job)
{
    CubeSheets sheets;
    bool changed = true, failed = false;
    for (int pass = 0; pass < PASSES_MAX && changed && !failed; pass++) {
        changed = false;
        for (int c = 0; c < job->cube_count; c++) {
            find_sheets(job, &job->cube[c], &sheets);
            changed = unify(job, &sheets, &failed) || changed;
        }
    }
    for (int c = 0; c < job->cube_count && !failed; c++) {
        find_sheets(job, &job->cube[c], &sheets);
        for (int a = 0; a < sheets.count && !failed; a++)
            if (sheets.sheet[a] == a)
                failed = !march_sheet(job, &job->cube[c], &sheets, a);
    }
    return !failed;
}

// --- The surface ---

static bool march_blocks(SheetMarch *job)
{
    March *march = &job->march;
    for (int n = 0; n < march->block_count; n++) {
        MarchBlock *b = &march->block[n];
        if (!list_candidates(job, b))
            return false;
        if (block_is_plain(job, b))
            continue;
        for (int i = 0; i < MARCH_SIDE; i++)
            for (int j = 0; j < MARCH_SIDE; j++)
                for (int k = 0; k < MARCH_SIDE; k++)
                    find_states(job, march_point(march, b, i, j, k), &job->states[march_index(i, j, k)]);
        b->is_marched = true;
        if (!march_cubes(job, b))
            return false;
    }
    return true;
}

static void free_march(SheetMarch *job)
{
    march_end(&job->march);
    key_map_free(&job->point_of);
    key_map_free(&job->link_of);
    key_map_free(&job->vertex_of_state);
    free(job->node);
    free(job->reach);
    free(job->path_offset);
    free(job->path);
    free(job->candidate);
    free(job->out);
    free(job->row);
    free(job->point);
    free(job->cube);
    free(job->state);
    free(job->same);
    free(job);
}

static TriangleMesh *surface_of_nodes(const VesselTree *tree, int first, int end, double cell_mm)
{
    if (!tree || !vessel_tree_is_model(tree) || !isfinite(cell_mm) || !(cell_mm > 0))
        return NULL;
    SheetMarch *job = calloc(1, sizeof *job);
    if (!job)
        return NULL;
    job->tree = tree;
    job->alone = end - first == 1 ? first : -1;
    job->by_power = job->alone >= 0 || vessel_tree_is_shared(tree);
    bool good = march_begin(&job->march, cell_mm, 0.001) && find_blocks(job, first, end) && march_blocks(job) && march_kept_cubes(job);
    TriangleMesh *mesh = job->march.mesh;
    if (!good) {
        triangle_mesh_free(mesh);
        mesh = NULL;
    }
    free_march(job);
    return mesh;
}

TriangleMesh *isosurface_of_model(const VesselTree *tree, int node, double cell_mm)
{
    if (!tree || node < 0 || node >= tree->node_count)
        return NULL;
    return surface_of_nodes(tree, node, node + 1, cell_mm);
}

TriangleMesh *isosurface_of_tree(const VesselTree *tree, double cell_mm) { return tree ? surface_of_nodes(tree, 0, tree->node_count, cell_mm) : NULL; }

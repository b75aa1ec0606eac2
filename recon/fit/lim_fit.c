// LIM for a whole tree (Kerrien et al. 2017, 4.5): collects the points to which a node's model is fitted, chooses its start, and runs one job per node.
// Points: concatenated up to topological distance 2; if nodes are closer than half a radius, as on imported centrelines, up to one radius along the tree, so
// that the overlap does not depend on the spacing. The root's points are repeated upstream: without that a model closes 1.4 to 1.7 r before the inlet.
// Guards (our extension): the centres of the nodes must be in the lumen, and a ring of points beyond the wall outside it. They act only where violated. They
// prevent constrictions in the tool's path, and ghost lobes where points are missing, for example at the ostium of an untracked branch that one model would
// open and its neighbour close.
// Agreement (our extension): on noisy points with holes neighbouring models stop at different places, one with a bulge more than the next. The second pass
// starts from the first pass's models and adds points of the blended wall, which all models around see, where the first wall is further than AGREES from it.
// Fitting every model again costs a third more and gains little: the p99 of the jump as a tool meets it on the angiogram's tubes is 0.003 mm in both cases.
// Tried and rejected: agreed points alone (the wall drifts 0.02 mm from the data, and out of the aneurysm); starting from scratch (1.3 times the jumps, more
// work).
#include "recon/fit/lim_fit.h"

#include "base/base.h"
#include "geom/geom.h"
#include "recon/fit/lim_agree.h"

#include <stdlib.h>
#include <string.h>

enum { NEAR_CAPACITY = 256, GUARD_ANGLES = 12, GUARD_NODES = 6, SPHERE_DIRECTIONS = 48, LEAST_POINTS = 24 };

// Models whose wall is everywhere within this distance of the agreed wall, in radii, are not fitted again.
static const double AGREES = 0.03;

LimFitOptions lim_fit_default_options(void)
{
    return (LimFitOptions){.alpha = 0,
                           .beta = 1e-4,
                           .s = 2,
                           .iso_level = 0.1,
                           .max_blobs = 100,
                           .target_mm = 0,
                           .topological_distance = 2,
                           .max_loops = 2,
                           .line_searches = 4,
                           .voxel_mm = 0.2,
                           .weigh_distance = true,
                           .project_points = true,
                           .sweep_all_blobs = true,
                           .give_up_splits = 3,
                           .extend_inlet = true,
                           .guard_shape = true,
                           .agree = true,
                           .max_points = 300};
}

LimFitOptions lim_fit_paper_options(void)
{
    LimFitOptions options = lim_fit_default_options();
    options.alpha = 1e-5;
    options.beta = 1e-3;
    options.target_mm = 0.3;
    options.max_loops = 5;
    options.line_searches = 20;   // with 4 the displacement by the repulsion is never undone and the new blob vanishes outside
    options.weigh_distance = options.project_points = options.sweep_all_blobs = options.extend_inlet = options.guard_shape = options.agree = false;
    options.give_up_splits = 0;
    options.max_points = 1500;
    return options;
}

static bool check_options(const LimFitOptions *o, Faults *faults)
{
    int before = faults->count;
    const struct {
        const char *name;
        double value, least, most;
    } range[] = {{"alpha", o->alpha, 0, 1},
                 {"beta", o->beta, 0, 10},
                 {"s", o->s, 0.1, 10},
                 {"iso-level", o->iso_level, 1e-4, 10},
                 {"max-blobs", o->max_blobs, 2, 1000},
                 {"target-mm", o->target_mm, 0, 100},
                 {"voxel-mm", o->voxel_mm, 0, 100},
                 {"topological-distance", o->topological_distance, 0, 50},
                 {"max-loops", o->max_loops, 1, 100},
                 {"line-searches", o->line_searches, 1, 100},
                 {"give-up-splits", o->give_up_splits, 0, 1000},
                 {"max-points", o->max_points, 50, 100000}};
    for (size_t i = 0; i < sizeof range / sizeof range[0]; i++)
        if (!(range[i].value >= range[i].least && range[i].value <= range[i].most))
            faults_add(faults, "fit", 0, 0, "%s is %g; expected %g to %g", range[i].name, range[i].value, range[i].least, range[i].most);
    return faults->count == before;
}

// --- The neighbourhood of a node ---

typedef struct Near {
    int node, hops;
    double path;             // [mm] path length along the tree
} Near;

typedef struct Gather {      // the memory of one job
    Near near[NEAR_CAPACITY];
    int near_count;
    int own_count;           // number of nodes, at the start of `near`, that contribute points
    Vec3 *point;
    int point_count, point_capacity;
    float *weight;           // (point_count), or NULL
    bool at_sac;
    Vec3 guard[GUARD_NODES * GUARD_ANGLES + NEAR_CAPACITY * 2 + SPHERE_DIRECTIONS];
    double clearance[GUARD_NODES * GUARD_ANGLES + NEAR_CAPACITY * 2 + SPHERE_DIRECTIONS];
    int guard_count;
    Vec3 retry[NEAR_CAPACITY];
    double retry_radius[NEAR_CAPACITY];
    int retry_count;
    LimTube tube[NEAR_CAPACITY + 1];
    int tube_count;
    bool is_extended;        // the inlet's points were repeated upstream
    double reach;            // [mm] points further than this from the node belong to other models
} Gather;

// Searches breadth first, so `near` is sorted by the number of links; then moves nodes that contribute points to the front, keeping their order.
static void find_near(const VesselTree *tree, int node, const LimFitOptions *options, int hops, Gather *gather)
{
    double radius = tree->radius[node], own_path = 0.5 * hops * radius, wide_path = 5 * radius;
    gather->near[0] = (Near){node, 0, 0};
    gather->near_count = 1;
    for (int i = 0; i < gather->near_count; i++) {
        Near at = gather->near[i];
        for (int n = tree->neighbour_offset[at.node]; n < tree->neighbour_offset[at.node + 1]; n++) {
            Near next = {tree->neighbour[n], at.hops + 1, at.path + vec3_distance(tree->center[at.node], tree->center[tree->neighbour[n]])};
            bool seen = false;
            for (int k = 0; k < gather->near_count && !seen; k++)
                seen = gather->near[k].node == next.node;
            if (!seen && gather->near_count < NEAR_CAPACITY && (next.hops <= hops + 2 || next.path <= wide_path))
                gather->near[gather->near_count++] = next;
        }
    }
    Near sorted[NEAR_CAPACITY];
    int count = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < gather->near_count; i++) {
            bool own = gather->near[i].hops <= hops || (options->guard_shape && gather->near[i].path <= own_path);
            if (own == (pass == 0))
                sorted[count++] = gather->near[i];
        }
        if (pass == 0)
            gather->own_count = count;
    }
    memcpy(gather->near, sorted, (size_t)count * sizeof sorted[0]);
}

static bool add_point(Gather *gather, Vec3 p)
{
    if (gather->point_count == gather->point_capacity) {
        int capacity = gather->point_capacity ? 2 * gather->point_capacity : 1024;
        Vec3 *more = realloc(gather->point, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        gather->point = more;
        gather->point_capacity = capacity;
    }
    gather->point[gather->point_count++] = p;
    return true;
}

// Repeats the root's own points upstream by their extent along the axis, so that the copies continue the tube to 2.2 r before the root.
static bool extend_inlet(const VesselTree *tree, Gather *gather, Vec3 center)
{
    Vec3 root = tree->center[0], upstream = vec3_negate(tree->direction[0]);
    double least = 0, most = 0, radius = tree->radius[0];
    int64_t first = tree->point_offset[0], last = tree->point_offset[1];
    for (int64_t i = first; i < last; i++) {
        Vec3 p = vec3_sub(tree->point[i], root);
        double t = vec3_dot(p, upstream);
        least = i == first || t < least ? t : least;
        most = i == first || t > most ? t : most;
    }
    double extent = most - least, slab = fmin(extent, 0.4 * radius);
    int in_slab = 0;
    for (int64_t i = first; i < last; i++)
        in_slab += vec3_dot(vec3_sub(tree->point[i], root), upstream) >= most - slab;
    if (in_slab < 12)
        slab = extent;
    if (last - first < 12 || extent < 0.2 * radius || !vessel_tree_root_is_open(tree))
        return true;
    gather->is_extended = true;
    for (int copy = 1; copy < 12 && most + (copy - 1) * slab < 2.2 * radius; copy++)
        for (int64_t i = first; i < last; i++) {
            Vec3 p = vec3_add_scaled(tree->point[i], copy * slab, upstream);
            // in a bent vessel more distant points would add its sagitta, 0.1 mm on an arc of radius 4 mm
            if (vec3_dot(vec3_sub(tree->point[i], root), upstream) >= most - slab && vec3_dot(vec3_sub(p, root), upstream) < 2.2 * radius &&
                vec3_distance(p, center) < gather->reach && !add_point(gather, p))
                return false;
        }
    return true;
}

// Keeps at most `most` of `count` points, evenly spaced in the list.
static int thin_points(Vec3 *point, int count, int most)
{
    if (count <= most)
        return count;
    int kept = 0;
    for (int i = 0; i < count; i++)
        if ((int64_t)(i + 1) * most / count > (int64_t)i * most / count)
            point[kept++] = point[i];
    return kept;
}

// Returns true if an aneurysm is near the node: it needs more points, because it is wide and neither round nor a tube.
static bool is_at_sac(const VesselTree *tree, const Gather *gather)
{
    bool at_sac = false;
    for (int k = 0; k < gather->near_count; k++)
        at_sac = at_sac || tree->kind[gather->near[k].node] == NODE_ANEURYSM;
    return at_sac;
}

static bool gather_points(const VesselTree *tree, int node, const LimFitOptions *options, Gather *gather)
{
    Vec3 center = tree->center[node];
    bool has_root = false;
    double widest = 0;
    for (int k = 0; k < gather->own_count; k++)
        widest = fmax(widest, tree->radius[gather->near[k].node]);
    // this model is never evaluated further away: its power cell ends before
    gather->reach = options->guard_shape ? fmax(3.5 * tree->radius[node], 1.5 * widest) : HUGE_VAL;
    gather->point_count = 0;
    gather->is_extended = false;
    for (int k = 0; k < gather->own_count; k++) {
        int from = gather->near[k].node;
        has_root = has_root || from == 0;
        for (int64_t i = tree->point_offset[from]; i < tree->point_offset[from + 1]; i++)
            if (vec3_distance(tree->point[i], center) < gather->reach && !add_point(gather, tree->point[i]))
                return false;
    }
    // the ostium of a sac or branch may reach into this node's cell from a node further along the tree
    for (int k = gather->own_count; k < gather->near_count && options->guard_shape; k++) {
        int from = gather->near[k].node;
        double apart = vec3_distance(tree->center[from], center), slack = 0.3 * tree->radius[node] * apart;
        for (int64_t i = tree->point_offset[from]; i < tree->point_offset[from + 1]; i++) {
            Vec3 p = tree->point[i];
            bool reaches = power_distance(p, center, tree->radius[node]) < power_distance(p, tree->center[from], tree->radius[from]) + slack;
            if (reaches && vec3_distance(p, center) < gather->reach && !add_point(gather, p))
                return false;
        }
    }
    if (has_root && options->extend_inlet && tree->kind[0] == NODE_VESSEL && !extend_inlet(tree, gather, center))
        return false;
    gather->at_sac = options->guard_shape && is_at_sac(tree, gather);
    gather->point_count = thin_points(gather->point, gather->point_count, options->max_points * (gather->at_sac ? 5 : 1));
    return true;
}

// --- Guards ---

static void add_guard(Gather *gather, Vec3 p, double clearance)
{
    if (gather->guard_count < (int)(sizeof gather->guard / sizeof gather->guard[0])) {
        gather->guard[gather->guard_count] = p;
        gather->clearance[gather->guard_count++] = clearance;
    }
}

static void guard_lumen(const VesselTree *tree, int node, bool extended, Gather *gather)
{
    for (int k = 0; k < gather->own_count; k++) {
        int at = gather->near[k].node, parent = tree->parent[at];
        if (vec3_distance(tree->center[at], tree->center[node]) > 0.8 * gather->reach)
            continue;
        add_guard(gather, tree->center[at], 0.5 * tree->radius[at]);
        // halfway to the parent, if the two spheres overlap well (a longer link may run through background)
        double length = parent >= 0 ? vec3_distance(tree->center[at], tree->center[parent]) : HUGE_VAL;
        if (length < 0.8 * (tree->radius[at] + tree->radius[parent >= 0 ? parent : at]))
            add_guard(gather, vec3_mix(tree->center[at], tree->center[parent], 0.5), 0.4 * fmin(tree->radius[at], tree->radius[parent]));
    }
    if (extended && gather->near[0].node == 0 && tree->kind[0] == NODE_VESSEL)
        for (int k = 1; k <= 3; k++)
            add_guard(gather, vec3_add_scaled(tree->center[0], -0.5 * k * tree->radius[0], tree->direction[0]), 0.5 * tree->radius[0]);
}

// Returns true if x is certainly outside: clear of all nearby data and tubes.
static bool is_outside(const VesselTree *tree, const Gather *gather, Vec3 x, double clearance)
{
    for (int k = 0; k < gather->near_count; k++) {
        int at = gather->near[k].node;
        if (vec3_distance(x, tree->center[at]) < 1.1 * tree->radius[at] + 0.5 * clearance)
            return false;
    }
    for (int i = 0; i < gather->point_count; i++)
        if (vec3_norm2(vec3_sub(x, gather->point[i])) < clearance * clearance)
            return false;
    return true;
}

// Adds a ring of guards around a vessel node, half a radius beyond the furthest point of each sector; 1.6 r in sectors without points.
static void guard_ring(const VesselTree *tree, int at, Gather *gather)
{
    Vec3 c = tree->center[at], d = tree->direction[at], e1, e2;
    lim_frame(tree, at, &e1, &e2);
    double radius = tree->radius[at], far[GUARD_ANGLES] = {0};
    for (int i = 0; i < gather->point_count; i++) {
        Vec3 p = vec3_sub(gather->point[i], c);
        double along = vec3_dot(p, d), x = vec3_dot(p, e1), y = vec3_dot(p, e2), across = sqrt(x * x + y * y);
        if (fabs(along) > 0.6 * radius || across > 2 * radius)
            continue;
        int sector = (int)floor(same_atan2(y, x) / (2 * PI) * GUARD_ANGLES + 0.5);
        sector = (sector + GUARD_ANGLES) % GUARD_ANGLES;
        far[sector] = fmax(far[sector], across);
    }
    for (int m = 0; m < GUARD_ANGLES; m++) {
        double angle = 2 * PI * m / GUARD_ANGLES, out = far[m] > 0 ? far[m] + 0.5 * radius : 1.6 * radius;
        Vec3 x = vec3_add_scaled(vec3_add_scaled(c, out * same_cos(angle), e1), out * same_sin(angle), e2);
        if (is_outside(tree, gather, x, 0.4 * radius))
            add_guard(gather, x, -0.4 * radius);
    }
}

// The same around an aneurysm's centre, in all directions that have points.
static void guard_sphere(const VesselTree *tree, int at, Gather *gather)
{
    Vec3 c = tree->center[at];
    double radius = tree->radius[at];
    for (int m = 0; m < SPHERE_DIRECTIONS; m++) {
        double z = 1 - (2 * m + 1.0) / SPHERE_DIRECTIONS, ring = sqrt(1 - z * z), angle = m * PI * (3 - sqrt(5)), far = 0;
        Vec3 d = {ring * same_cos(angle), ring * same_sin(angle), z};
        for (int i = 0; i < gather->point_count; i++) {
            Vec3 p = vec3_sub(gather->point[i], c);
            double along = vec3_dot(p, d), length = vec3_norm(p);
            if (along > 0.94 * length)
                far = fmax(far, length);
        }
        Vec3 x = vec3_add_scaled(c, far + 0.4 * radius, d);
        if (far > 0 && is_outside(tree, gather, x, 0.3 * radius))
            add_guard(gather, x, -0.3 * radius);
    }
}

static void gather_guards(const VesselTree *tree, int node, bool extended, Gather *gather)
{
    gather->guard_count = 0;
    guard_lumen(tree, node, extended, gather);
    if (tree->kind[node] == NODE_ANEURYSM)
        guard_sphere(tree, node, gather);
    int vessels = 0, taken = 0;
    for (int k = 0; k < gather->own_count; k++)
        vessels += tree->kind[gather->near[k].node] == NODE_VESSEL;
    for (int k = 0, seen = 0; k < gather->own_count && taken < GUARD_NODES; k++) {
        int at = gather->near[k].node;
        if (tree->kind[at] != NODE_VESSEL)
            continue;
        // on dense centrelines, a subset of the nodes is enough
        if (vessels <= GUARD_NODES || seen * GUARD_NODES / vessels >= taken) {
            guard_ring(tree, at, gather);
            taken++;
        }
        seen++;
    }
}

// Collects the region for blobs: the tubes between nearby nodes and their parents, slightly thinner than the vessel, but wider at an aneurysm, which is
// seldom round.
static void gather_tubes(const VesselTree *tree, Gather *gather)
{
    const double inside = 0.9;
    gather->tube_count = 0;
    for (int k = 0; k < gather->near_count; k++) {
        int at = gather->near[k].node, parent = tree->parent[at];
        int from = parent >= 0 ? parent : at;
        bool sac = tree->kind[at] == NODE_ANEURYSM;
        double own = (sac ? 1.2 : inside) * tree->radius[at], before = inside * fmin(tree->radius[from], tree->radius[at]);
        gather->tube[gather->tube_count++] = (LimTube){tree->center[from], tree->center[at], from == at ? own : before, own};
        if (at == 0)   // continue it upstream of the inlet
            gather->tube[gather->tube_count++] =
                (LimTube){tree->center[0], vec3_add_scaled(tree->center[0], -3 * tree->radius[0], tree->direction[0]), own, own};
    }
}

// Places blobs on nearby nodes, not too close to each other, for a second attempt.
static void gather_retry(const VesselTree *tree, int node, Gather *gather)
{
    gather->retry_count = 0;
    for (int k = 0; k < gather->own_count; k++) {
        int at = gather->near[k].node;
        bool free_place = vec3_distance(tree->center[at], tree->center[node]) < 0.8 * gather->reach;
        for (int m = 0; m < gather->retry_count && free_place; m++)
            free_place = vec3_distance(gather->retry[m], tree->center[at]) > 0.8 * fmin(tree->radius[at], gather->retry_radius[m]);
        if (free_place) {
            gather->retry[gather->retry_count] = tree->center[at];
            gather->retry_radius[gather->retry_count++] = 0.8 * tree->radius[at];
        }
    }
}

// --- Jobs ---

typedef struct NodeModel {
    int count;
    Vec3 *center;
    double *width;
    double error;
    bool failed;             // out of memory
} NodeModel;

typedef struct Job {
    const VesselTree *tree;
    const LimFitOptions *options;
    const int *order;        // (N) nodes, the largest job first
    NodeModel *model;        // (N)
    // the second pass
    const VesselTree *first; // the first pass's models; NULL in the first pass
    const Vec3 *agreed;      // (N, LIM_AGREED_MOST)
    const int *agreed_count; // (N)
    const double *differs;   // (N) [mm] largest distance of the first pass's wall from the agreed wall
} Job;

// d_a: the 90th percentile of the Taubin distances of the node's own points, or of the gathered points if it has none.
static double node_error(const VesselTree *tree, int node, const Gather *gather, const NodeModel *model, double iso_level)
{
    int64_t first = tree->point_offset[node], own = tree->point_offset[node + 1] - first;
    const Vec3 *point = own > 0 ? tree->point + first : gather->point;
    int64_t count = own > 0 ? own : gather->point_count;
    if (count == 0)
        return 0;
    double *distance = HEAP_ZEROED((size_t)count, sizeof *distance);
    Blobby blobby = {.count = model->count, .center = model->center, .width = model->width, .iso_level = iso_level};
    for (int64_t i = 0; i < count; i++) {
        Vec3 g;
        double f = blobby_gradient(&blobby, point[i], &g);
        distance[i] = fabs(f) / fmax(vec3_norm(g), 1e-12);
    }
    sort_doubles(distance, (size_t)count);
    double error = distance[(int64_t)(0.9 * (double)(count - 1) + 0.5)];
    free(distance);
    return error;
}

static bool add_agreed(const Job *job, int node, Gather *gather)
{
    const VesselTree *tree = job->tree;
    for (int k = 0; k < gather->own_count; k++) {
        int from = gather->near[k].node;
        for (int i = 0; i < job->agreed_count[from]; i++) {
            Vec3 p = job->agreed[(size_t)from * LIM_AGREED_MOST + (size_t)i];
            if (vec3_distance(p, tree->center[node]) < gather->reach && !add_point(gather, p))
                return false;
        }
    }
    return true;
}

static bool gather_node(const Job *job, int node, Gather *gather)
{
    const LimFitOptions *options = job->options;
    // if a node has very few points nearby, search further along the tree
    for (int more = 0; more <= 8; more++) {
        find_near(job->tree, node, options, options->topological_distance + more, gather);
        if (!gather_points(job->tree, node, options, gather))
            return false;
        if (gather->point_count >= LEAST_POINTS)
            break;
    }
    if (options->guard_shape && gather->point_count >= 4) {   // both use the data, not derived points
        gather_guards(job->tree, node, gather->is_extended, gather);
        gather_tubes(job->tree, gather);
    }
    return !job->first || add_agreed(job, node, gather);
}

// Reduces the weight of points with their power distance beyond the node's ball, except at an aneurysm, whose cells extend far from their balls. The model is
// evaluated only in the node's cell, where a few blobs bulge: fitted evenly to five nodes' points they were 0.01 mm too wide there.
static bool weigh_points(const VesselTree *tree, int node, Gather *gather)
{
    const double least = 0.3;
    double r2 = tree->radius[node] * tree->radius[node], mean = 0;
    gather->weight = malloc((size_t)gather->point_count * sizeof *gather->weight);
    for (int i = 0; i < gather->point_count && gather->weight; i++) {
        double beyond = fmax(power_distance(gather->point[i], tree->center[node], tree->radius[node]), 0);
        gather->weight[i] = (float)fmax(least, r2 / (r2 + beyond));
        mean += (double)gather->weight[i] / gather->point_count;
    }
    for (int i = 0; i < gather->point_count && gather->weight; i++)
        gather->weight[i] /= (float)mean;
    return gather->weight != NULL;
}

static LimFitTask task_of(const Job *job, int node, Gather *gather, double *start_radius)
{
    const VesselTree *tree = job->tree, *first = job->first;
    LimFitTask task = {.point_count = gather->point_count,
                       .point = gather->point,
                       .weight = gather->weight,
                       .center = tree->center[node],
                       .direction = tree->direction[node],
                       .radius = tree->radius[node]};
    if (job->options->guard_shape) {
        task.guard_count = gather->guard_count;
        task.guard = gather->guard;
        task.clearance = gather->clearance;
        task.tube_count = gather->tube_count;
        task.tube = gather->tube;
    }
    if (first) {
        int64_t at = first->blob_offset[node];
        task.start_count = (int)(first->blob_offset[node + 1] - at);
        task.start = first->blob_center + at;
        task.start_radius = start_radius;
        for (int k = 0; k < task.start_count; k++)
            start_radius[k] = blob_radius(first->blob_width[at + k], first->iso_level);
        return task;
    }
    if (job->options->sweep_all_blobs) {
        gather_retry(tree, node, gather);
        task.retry_count = gather->retry_count;
        task.retry = gather->retry;
        task.retry_radius = gather->retry_radius;
    }
    if (tree->kind[node] == NODE_ANEURYSM) {   // start with one blob, as in the paper's figure 5
        task.start_count = 1;
        task.start = &tree->center[node];
        task.start_radius = &tree->radius[node];
    }
    return task;
}

// In the second pass: copies the first pass's model.
static void keep_first(const VesselTree *first, int node, NodeModel *model)
{
    int64_t at = first->blob_offset[node];
    model->count = (int)(first->blob_offset[node + 1] - at);
    size_t n = (size_t)model->count;
    model->center = malloc(n * sizeof *model->center);
    model->width = malloc(n * sizeof *model->width);
    model->failed = !model->center || !model->width;
    if (model->failed)
        return;
    memcpy(model->center, first->blob_center + at, n * sizeof *model->center);
    memcpy(model->width, first->blob_width + at, n * sizeof *model->width);
    model->error = first->error[node];
}

static void fit_node(void *context, long index)
{
    Job *job = context;
    const VesselTree *tree = job->tree;
    LimFitOptions options = *job->options;
    int node = job->order[index];
    NodeModel *model = &job->model[node];
    if (job->first && job->differs[node] < AGREES * tree->radius[node]) {
        keep_first(job->first, node, model);
        return;
    }
    Gather *gather = calloc(1, sizeof *gather);
    Vec3 *center = calloc((size_t)options.max_blobs + 1, sizeof *center);
    double *width = calloc((size_t)options.max_blobs + 1, sizeof *width), *start_radius = calloc((size_t)options.max_blobs + 1, sizeof *start_radius);
    bool good = gather && center && width && start_radius && gather_node(job, node, gather);
    if (job->first && options.give_up_splits > 1)
        options.give_up_splits = 1;
    // neighbouring models at an aneurysm agree only as well as each fits the data: to 0.19 mm with the usual t_g, to 0.06 mm with half of it
    if (good && gather->at_sac)
        options.voxel_mm *= 0.5;
    if (good && options.target_mm == 0 && options.voxel_mm == 0)
        options.target_mm = (gather->at_sac ? 0.04 : 0.08) * tree->radius[node];
    if (good && options.weigh_distance && !gather->at_sac && gather->point_count > 0)
        good = weigh_points(tree, node, gather);
    if (good && gather->point_count >= 4) {
        LimFitTask task = task_of(job, node, gather, start_radius);
        model->count = lim_fit_model(&task, &options, center, width);
        good = model->count > 0;
    } else if (good) {   // no points to fit: use the node's sphere
        model->count = 1;
        center[0] = tree->center[node];
        width[0] = blob_width_for_radius(tree->radius[node], options.iso_level);
    }
    model->failed = !good;
    if (good) {
        Vec3 *less_center = realloc(center, (size_t)model->count * sizeof *center);
        double *less_width = realloc(width, (size_t)model->count * sizeof *width);
        model->center = less_center ? less_center : center;
        model->width = less_width ? less_width : width;
        model->error = node_error(tree, node, gather, model, options.iso_level);
    } else {
        free(center);
        free(width);
    }
    free(start_radius);
    if (gather) {
        free(gather->point);
        free(gather->weight);
    }
    free(gather);
}

static VesselTree *assemble(const VesselTree *tree, const NodeModel *model, double iso_level)
{
    int64_t blobs = 0;
    for (int i = 0; i < tree->node_count; i++)
        blobs += model[i].count;
    VesselTree *out = vessel_tree_create(tree->node_count, tree->point_count, blobs);
    if (!out)
        return NULL;
    size_t n = (size_t)tree->node_count;
    memcpy(out->center, tree->center, n * sizeof *out->center);
    memcpy(out->radius, tree->radius, n * sizeof *out->radius);
    memcpy(out->direction, tree->direction, n * sizeof *out->direction);
    memcpy(out->height, tree->height, n * sizeof *out->height);
    memcpy(out->parent, tree->parent, n * sizeof *out->parent);
    memcpy(out->kind, tree->kind, n * sizeof *out->kind);
    memcpy(out->point_offset, tree->point_offset, (n + 1) * sizeof *out->point_offset);
    if (tree->point_count > 0)
        memcpy(out->point, tree->point, (size_t)tree->point_count * sizeof *out->point);
    out->iso_level = iso_level;
    for (int i = 0; i < tree->node_count; i++) {
        int64_t at = out->blob_offset[i];
        memcpy(out->blob_center + at, model[i].center, (size_t)model[i].count * sizeof(Vec3));
        memcpy(out->blob_width + at, model[i].width, (size_t)model[i].count * sizeof(double));
        out->blob_offset[i + 1] = at + model[i].count;
        out->error[i] = model[i].error;
    }
    if (!vessel_tree_link(out)) {
        vessel_tree_free(out);
        return NULL;
    }
    return out;
}

// --- The tree ---

typedef struct Size {
    int64_t points;
    int node;
} Size;

static int compare_sizes(const void *a, const void *b)
{
    const Size *x = a, *y = b;
    return x->points != y->points ? (x->points < y->points) - (x->points > y->points) : (x->node > y->node) - (x->node < y->node);
}

// Orders nodes by the number of points around them, most first, so that the longest job, usually an aneurysm, does not run last on one core.
static int *order_by_size(const VesselTree *tree)
{
    SEL_ASSERT(tree->node_count >= 0, "a number of nodes");
    int n = tree->node_count, *order = calloc((size_t)n, sizeof *order);
    Size *size = calloc((size_t)n, sizeof *size);
    for (int i = 0; i < n && order && size; i++) {
        size[i] = (Size){tree->point_offset[i + 1] - tree->point_offset[i], i};
        for (int k = tree->neighbour_offset[i]; k < tree->neighbour_offset[i + 1]; k++)
            size[i].points += tree->point_offset[tree->neighbour[k] + 1] - tree->point_offset[tree->neighbour[k]];
    }
    if (order && size) {
        qsort(size, (size_t)n, sizeof *size, compare_sizes);
        for (int i = 0; i < n; i++)
            order[i] = size[i].node;
    } else {
        free(order);
        order = NULL;
    }
    free(size);
    return order;
}

typedef struct PassProgress {   // progress of one pass of several
    const Progress *of_all;
    long before, total;
} PassProgress;

static void pass_on(void *context, long done, long total)
{
    const PassProgress *pass = context;
    (void)total;
    pass->of_all->call(pass->of_all->context, pass->before + done, pass->total);
}

// Fits all nodes once. Returns NULL if out of memory.
static VesselTree *fit_pass(Job *job, const Progress *progress)
{
    const VesselTree *tree = job->tree;
    long nodes = tree->node_count;
    PassProgress pass = {progress, job->first ? nodes : 0, job->options->agree ? 2 * nodes : nodes};
    Progress own = {.call = pass_on, .context = &pass};
    job->model = calloc((size_t)nodes, sizeof *job->model);
    if (!job->model)
        return NULL;
    parallel_for(job->options->threads, nodes, fit_node, job, progress && progress->call ? &own : NULL);
    bool good = true;
    for (int i = 0; i < nodes; i++)
        good = good && !job->model[i].failed;
    VesselTree *out = good ? assemble(tree, job->model, job->options->iso_level) : NULL;
    for (int i = 0; i < nodes; i++) {
        free(job->model[i].center);
        free(job->model[i].width);
    }
    free(job->model);
    job->model = NULL;
    return out;
}

// Makes the second pass; frees the first pass's models.
static VesselTree *fit_to_agree(Job *job, VesselTree *first, const Progress *progress)
{
    size_t nodes = (size_t)first->node_count;
    Vec3 *point = calloc(nodes * LIM_AGREED_MOST, sizeof *point);
    int *count = calloc(nodes, sizeof *count);
    double *differs = calloc(nodes, sizeof *differs);
    VesselTree *out = NULL;
    if (point && count && differs && lim_agree(first, job->options->threads, point, count, differs)) {
        job->first = first;
        job->agreed = point;
        job->agreed_count = count;
        job->differs = differs;
        out = fit_pass(job, progress);
    }
    free(point);
    free(count);
    free(differs);
    vessel_tree_free(first);
    return out;
}

VesselTree *lim_fit(const VesselTree *tree, const LimFitOptions *options, const Progress *progress, Faults *faults)
{
    if (!check_options(options, faults))
        return NULL;
    if (tree->node_count < 1 || tree->point_count < 4) {
        faults_add(faults, "fit", 0, 0, "the tree has %d nodes and %lld points; expected at least 1 node and 4 points", tree->node_count,
                   (long long)tree->point_count);
        return NULL;
    }
    // T is a length: without an angiogram it scales with the vessels, so that the possible shapes of blobs scale too
    LimFitOptions scaled = *options;
    double radius = 0;
    for (int i = 0; i < tree->node_count; i++)
        radius += tree->radius[i] / tree->node_count;
    if (options->voxel_mm == 0 && options->target_mm == 0)
        scaled.iso_level *= radius;
    int *order = order_by_size(tree);
    Job job = {.tree = tree, .options = &scaled, .order = order};
    VesselTree *out = order ? fit_pass(&job, progress) : NULL;
    if (out && options->agree)
        out = fit_to_agree(&job, out, progress);
    free(order);
    if (!out)
        faults_add(faults, "fit", 0, 0, "not enough memory for the models of %d nodes", tree->node_count);
    return out;
}

// Wall points are found by rays from a node's centre to its model's surface, in Fibonacci directions, as long as they stay in the node's power cell among the
// nodes near it. Points within 0.1 r of a border are moved onto it along the wall. Moving them only perpendicular to the border's plane put those of a sac of
// r = 5 mm up to 0.5 mm outside, where another vessel's cell begins that no tool in the lumen can touch (2 mm of "jump").
#include "recon/fit/model_measure.h"

#include "base/base.h"
#include "geom/geom.h"
#include "recon/fit/lim_agree.h"

#include <stdlib.h>

enum { VESSEL_RAYS = 120, SAC_RAYS = 1500, LINK_SAMPLES = 5 };   // many for a sac, because its neck is a small part of its wall

const char *const model_place_name[PLACES] = {"tube", "bifurcation", "sac", "end"};

typedef enum { RAW, MET, COLD, JUMPS } Jump;
typedef struct Join {
    int place, node, other;
    double gap[JUMPS], normal[JUMPS];
} Join;
typedef struct WallPoint {
    int place;
    double excess;           // distance from the true wall, > 0 outside
} WallPoint;
typedef struct NodeFigures {
    Join *join;
    WallPoint *wall;
    int joins, join_capacity, walls;
    double bare, ghost;      // [mm] largest distance from data; 0: none
    double clearance;        // least clearance of the link to the parent, relative to the radius
    bool failed;
} NodeFigures;
typedef struct Job {
    const ModelField *model;
    const VesselTree *tree;  // its nodes
    const Shape *truth;
    const Vessel *vessel;
    const uint8_t *place;    // (N)
    NodeFigures *node;       // (N)
} Job;

// --- Places ---

static void mark_around(const VesselTree *tree, int from, double reach, int place, uint8_t *mark, int *stack, double *path)
{
    // depth-first search; the tree has no loops, so storing the predecessor is enough
    int depth = 0;
    int *came = stack + tree->node_count;
    stack[depth] = from, came[depth] = -1, path[depth++] = 0;
    while (depth > 0) {
        int at = stack[--depth], back = came[depth];
        double length = path[depth];
        mark[at] = (uint8_t)place;
        for (int k = tree->neighbour_offset[at]; k < tree->neighbour_offset[at + 1]; k++) {
            int next = tree->neighbour[k];
            double to = length + vec3_distance(tree->center[at], tree->center[next]);
            if (next != back && to < reach)
                stack[depth] = next, came[depth] = at, path[depth++] = to;
        }
    }
}

// Returns the place of each link. Later kinds override earlier ones: end, bifurcation, sac.
static uint8_t *find_places(const VesselTree *tree)
{
    size_t n = (size_t)tree->node_count;
    uint8_t *place = calloc(n, 1);
    int *stack = calloc(2 * n, sizeof *stack);
    double *path = calloc(n, sizeof *path);
    for (int order = 0; order < 3 && place && stack && path; order++)
        for (int i = 0; i < tree->node_count; i++) {
            int first = tree->neighbour_offset[i], links = tree->neighbour_offset[i + 1] - first;
            double widest = tree->radius[i];
            for (int k = 0; k < links; k++)
                widest = fmax(widest, tree->radius[tree->neighbour[first + k]]);
            if (order == 0 && links < 2)
                mark_around(tree, i, 2 * tree->radius[i], PLACE_END, place, stack, path);
            if (order == 1 && links > 2)
                mark_around(tree, i, 2.5 * widest, PLACE_BIFURCATION, place, stack, path);
            if (order == 2 && tree->kind[i] == NODE_ANEURYSM)
                mark_around(tree, i, 2 * widest, PLACE_SAC, place, stack, path);
        }
    bool good = place && stack && path;
    free(stack);
    free(path);
    if (!good)
        free(place);
    return good ? place : NULL;
}

static int place_of(const Job *job, int a, int b)
{
    static const int order[PLACES] = {PLACE_SAC, PLACE_BIFURCATION, PLACE_END, PLACE_TUBE};
    for (int k = 0; k < PLACES; k++)
        if (job->place[a] == order[k] || job->place[b] == order[k])
            return order[k];
    return PLACE_TUBE;
}

// --- One node ---

static bool is_inside(const ModelField *model, int node, Vec3 x) { return model_field_at(model, node, x, NULL) > 0; }

static Vec3 bisect(const ModelField *model, int node, Vec3 c, Vec3 d, double low, double high)
{
    bool in = is_inside(model, node, vec3_add_scaled(c, low, d));
    for (int i = 0; i < 40; i++) {
        double middle = 0.5 * (low + high);
        if (is_inside(model, node, vec3_add_scaled(c, middle, d)) == in)
            low = middle;
        else
            high = middle;
    }
    return vec3_add_scaled(c, low, d);
}

// Distance from x to the nearest data point of the node and of those near it.
static double distance_to_data(const VesselTree *tree, int node, Vec3 x)
{
    double least2 = HUGE_VAL;
    for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1]; k++) {
        int from = k < tree->near_offset[node] ? node : tree->near[k];
        for (int64_t i = tree->point_offset[from]; i < tree->point_offset[from + 1]; i++)
            least2 = fmin(least2, vec3_norm2(vec3_sub(tree->point[i], x)));
    }
    return sqrt(least2);
}

static int ray_count(const VesselTree *tree, int node) { return tree->kind[node] == NODE_ANEURYSM ? SAC_RAYS : VESSEL_RAYS; }

static VesselHit query_with(const Job *job, VesselMemory *memory, Vec3 x)
{
    VesselHit hit;
    vessel_query(job->vessel, 1, &x, HUGE_VAL, memory, &hit);
    return hit;
}

static VesselHit query_from(const Job *job, int node, Vec3 x)
{
    VesselMemory memory = {.node = model_field_file_node(job->model, node)};
    return query_with(job, &memory, x);
}

// Measures the jump at x, on the border between the cells of `node` and `other`.
static void add_join(const Job *job, int node, int other, Vec3 x, Vec3 across, NodeFigures *f)
{
    const double aside = 1e-4;   // [mm] larger than the rounding of the cells' planes
    SurfacePoint p = model_field_project(job->model, node, x, x), q = model_field_project(job->model, other, x, x);
    VesselMemory memory = {.node = model_field_file_node(job->model, node)};
    VesselHit before = query_with(job, &memory, vec3_add_scaled(x, -aside, across)), behind = query_with(job, &memory, vec3_add_scaled(x, aside, across));
    VesselHit fresh = query_from(job, other, vec3_add_scaled(x, aside, across));
    unsigned unfit = VESSEL_OPEN_END | VESSEL_BEYOND;
    if ((before.flags | behind.flags | fresh.flags) & unfit)
        return;
    if (f->joins == f->join_capacity) {
        int capacity = f->join_capacity ? 2 * f->join_capacity : 64;
        Join *more = realloc(f->join, (size_t)capacity * sizeof *more);
        if (!more) {
            f->failed = true;
            return;
        }
        f->join = more;
        f->join_capacity = capacity;
    }
    double moved = aside * vec3_dot(vec3_add(before.normal, behind.normal), across),
           moved_fresh = aside * vec3_dot(vec3_add(before.normal, fresh.normal), across);
    f->join[f->joins++] = (Join){place_of(job, node, other),
                                 node,
                                 other,
                                 {fabs(p.distance - q.distance), fabs(behind.gap - before.gap - moved), fabs(fresh.gap - before.gap - moved_fresh)},
                                 {vec3_angle(p.normal, q.normal), vec3_angle(before.normal, behind.normal), vec3_angle(before.normal, fresh.normal)}};
}

// Moves x in the plane with normal `across` to the model's wall. Returns false if it is still further than `far` away after some steps.
static bool slide_to_wall(const ModelField *model, int node, Vec3 across, double far, Vec3 *x)
{
    for (int i = 0; i < 6; i++) {
        SurfacePoint s = model_field_project(model, node, *x, *x);
        if (fabs(s.distance) < far)
            return true;
        Vec3 tangent = vec3_add_scaled(s.normal, -vec3_dot(s.normal, across), across);
        double steep = vec3_norm2(tangent);
        if (!s.converged || steep < 0.04)   // the wall is nearly parallel to the border
            return false;
        *x = vec3_add_scaled(*x, -s.distance / steep, tangent);
    }
    return false;
}

static void look_at_wall(const Job *job, int node, Vec3 p, NodeFigures *f)
{
    const VesselTree *tree = job->tree;
    double own = power_distance(p, tree->center[node], tree->radius[node]);
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++) {
        int other = tree->near[k];
        Vec3 e = vec3_sub(tree->center[other], tree->center[node]);
        double apart = vec3_norm(e);
        if (!(apart > 1e-9))
            continue;
        double beyond = (power_distance(p, tree->center[other], tree->radius[other]) - own) / (2 * apart);
        Vec3 across = vec3_scale(e, 1 / apart), x = vec3_add_scaled(p, beyond, across);
        if (beyond < 0.1 * tree->radius[node] && slide_to_wall(job->model, node, across, 0.01 * tree->radius[node], &x) &&
            lim_is_in_cell(tree, node, other, x) && lim_is_in_cell(tree, other, node, x))
            add_join(job, node, other, x, across, f);
    }
    if (job->truth) {
        VesselHit hit = query_from(job, node, p);
        Vec3 wall = vec3_add_scaled(p, -hit.gap, hit.normal);
        if (!(hit.flags & (VESSEL_OPEN_END | VESSEL_BEYOND)) && !shape_beyond_open_end(job->truth, wall))
            f->wall[f->walls++] = (WallPoint){job->place[node], -shape_distance(job->truth, wall, NULL)};
    }
}

static void cast_rays_of(const Job *job, int node, NodeFigures *f)
{
    const VesselTree *tree = job->tree;
    Vec3 c = tree->center[node];
    double radius = tree->radius[node], step = 0.05 * radius;
    int rays = ray_count(tree, node);
    for (int k = 0; k < rays; k++) {
        double z = 1 - (2 * k + 1.0) / rays, ring = sqrt(1 - z * z), angle = k * PI * (3 - sqrt(5));
        Vec3 d = {ring * same_cos(angle), ring * same_sin(angle), z};
        bool in = is_inside(job->model, node, c), first = true;
        for (int i = 1; i * step < 3 * radius; i++) {
            Vec3 x = vec3_add_scaled(c, i * step, d);
            if (!lim_is_in_cell(tree, node, -1, x))
                break;   // cells are convex
            bool now = is_inside(job->model, node, x);
            if (now == in)
                continue;
            Vec3 p = bisect(job->model, node, c, d, (i - 1) * step, i * step);
            if (first && in)
                look_at_wall(job, node, p, f);
            double far = job->place[node] == PLACE_END && first ? 0 : distance_to_data(tree, node, p);
            // a second sheet may be another branch's wall, which other nodes' models represent in their own cells
            if (far > 0.6 * radius && far < HUGE_VAL && (first || power_nearest(tree, p) == node)) {
                double *most = first ? &f->bare : &f->ghost;
                *most = fmax(*most, far);
            }
            in = now;
            first = false;
        }
    }
}

static void measure_node(void *context, long index)
{
    const Job *job = context;
    const VesselTree *tree = job->tree;
    int node = (int)index, parent = tree->parent[node];
    NodeFigures *f = &job->node[node];
    f->clearance = HUGE_VAL;
    if (job->truth && !(f->wall = calloc((size_t)ray_count(tree, node), sizeof *f->wall))) {
        f->failed = true;
        return;
    }
    if (job->model->swept || blobby_of(tree, node).count > 0)
        cast_rays_of(job, node, f);
    for (int k = 0; k < LINK_SAMPLES && parent >= 0; k++) {
        double t = (k + 0.5) / LINK_SAMPLES, radius = tree->radius[node] + t * (tree->radius[parent] - tree->radius[node]);
        VesselHit hit = query_from(job, node, vec3_mix(tree->center[node], tree->center[parent], t));
        f->clearance = fmin(f->clearance, hit.gap / fmin(radius, fmin(tree->radius[node], tree->radius[parent])));
    }
}

// --- Sums ---

static double part_of(const double *sorted, int count, double part) { return count > 0 ? sorted[(int)(part * (count - 1))] : 0; }

static JumpRow jump_row(const Job *job, int place, Jump jump, double *value)
{
    JumpRow row = {.worst_node = -1, .worst_other = -1};
    for (int what = 0; what < 2; what++) {
        int count = 0;
        for (int i = 0; i < job->tree->node_count; i++)
            for (int k = 0; k < job->node[i].joins; k++) {
                const Join *join = &job->node[i].join[k];
                if (join->place != place)
                    continue;
                double gap = join->gap[jump];
                if (what == 0 && (count == 0 || gap > row.gap_most))
                    row.gap_most = gap, row.worst_node = join->node, row.worst_other = join->other;
                value[count++] = what == 0 ? gap : join->normal[jump];
            }
        sort_doubles(value, (size_t)count);
        row.count = count;
        *(what ? &row.normal_median : &row.gap_median) = part_of(value, count, 0.5);
        *(what ? &row.normal_p99 : &row.gap_p99) = part_of(value, count, 0.99);
        *(what ? &row.normal_most : &row.gap_most) = part_of(value, count, 1);
    }
    return row;
}

static WallRow wall_row(const Job *job, int place, double *value)
{
    WallRow row = {.worst_node = -1};
    double sum = 0, sum2 = 0;
    for (int i = 0; i < job->tree->node_count; i++)
        for (int k = 0; k < job->node[i].walls; k++) {
            const WallPoint *wall = &job->node[i].wall[k];
            if (wall->place != place)
                continue;
            double far = fabs(wall->excess);
            sum += wall->excess;
            sum2 += far * far;
            if (far > row.most || row.worst_node < 0)
                row.most = far, row.worst_node = i;
            value[row.count++] = far;
        }
    sort_doubles(value, (size_t)row.count);
    row.p99 = part_of(value, row.count, 0.99);
    if (row.count > 0) {
        row.bias = sum / row.count;
        row.rms = sqrt(sum2 / row.count);
    }
    return row;
}

// Nodes are then those of the file.
static void name_nodes(const ModelField *model, ModelMeasure *out)
{
    for (int place = 0; place < PLACES; place++) {
        JumpRow *row[JUMPS] = {&out->raw[place], &out->met[place], &out->cold[place]};
        for (int k = 0; k < JUMPS; k++)
            row[k]->worst_node = model_field_file_node(model, row[k]->worst_node), row[k]->worst_other = model_field_file_node(model, row[k]->worst_other);
        out->wall[place].worst_node = model_field_file_node(model, out->wall[place].worst_node);
    }
    out->bare_worst = model_field_file_node(model, out->bare_worst), out->ghost_worst = model_field_file_node(model, out->ghost_worst);
    out->narrowest_node = model_field_file_node(model, out->narrowest_node);
}

static bool add_up(const Job *job, ModelMeasure *out)
{
    size_t capacity = 1;
    for (int i = 0; i < job->tree->node_count; i++)
        capacity += (size_t)job->node[i].joins + (size_t)job->node[i].walls;
    double *value = malloc(capacity * sizeof *value);
    if (!value)
        return false;
    *out = (ModelMeasure){.bare_worst = -1, .ghost_worst = -1, .narrowest_node = -1, .least_clearance = HUGE_VAL};
    for (int place = 0; place < PLACES; place++) {
        out->raw[place] = jump_row(job, place, RAW, value);
        out->met[place] = jump_row(job, place, MET, value);
        out->cold[place] = jump_row(job, place, COLD, value);
        out->wall[place] = wall_row(job, place, value);
    }
    for (int i = 0; i < job->tree->node_count; i++) {
        const NodeFigures *f = &job->node[i];
        out->bare_nodes += f->bare > 0;
        out->ghost_nodes += f->ghost > 0;
        if (f->bare > out->bare_most_mm)
            out->bare_most_mm = f->bare, out->bare_worst = i;
        if (f->ghost > out->ghost_most_mm)
            out->ghost_most_mm = f->ghost, out->ghost_worst = i;
        out->links += job->tree->parent[i] >= 0;
        out->narrow_links += f->clearance < 0.5;
        if (f->clearance < out->least_clearance)
            out->least_clearance = f->clearance, out->narrowest_node = i;
    }
    free(value);
    name_nodes(job->model, out);
    return true;
}

bool model_measure(const ModelField *model, const Shape *truth, int threads, ModelMeasure *out)
{
    Job job = {.model = model, .tree = model->tree, .truth = truth};
    if (!model_field_exists(model))
        return false;
    Vessel *vessel = model_field_vessel(model);
    uint8_t *place = find_places(model->tree);
    job.vessel = vessel;
    job.place = place;
    job.node = calloc((size_t)model->tree->node_count, sizeof *job.node);
    bool good = vessel && place && job.node;
    if (good) {
        parallel_for(threads, model->tree->node_count, measure_node, &job, NULL);
        for (int i = 0; i < model->tree->node_count; i++)
            good = good && !job.node[i].failed;
        good = good && add_up(&job, out);
        for (int i = 0; i < model->tree->node_count; i++) {
            free(job.node[i].join);
            free(job.node[i].wall);
        }
    }
    free(job.node);
    free(place);
    if (vessel)
        vessel->destroy(vessel);
    return good;
}

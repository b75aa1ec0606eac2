// Collects the rows of the fit.
// Data: the nodes' points, each in the cell that contains it; the root's points once more upstream of an open inlet, so that the wall is a tube through its
// plane. A point deep inside another node's tube (half its radius) is not wall: rays cast from a parent hit the far wall of a child's ostium, and vice versa.
// Guards inside: at every node's centre, along links that are lumen, and between a point and its axis. Their bound is at most half the scaled field of a
// round vessel, 1 - (d/r)^2; in a cell wider than the link the field rises only at that cell's rate, 2/r per millimetre. Guards outside: beyond a point,
// along the normal, where there is neither a tube nor data of a nearby node; and on a ring where a cross-section has no points. Guards act only where they
// are violated. Without them a fit of signed blobs grows spurious sheets where there are no data.
#include "recon/fit/field_rows.h"

#include "base/base.h"
#include "geom/geom.h"

#include <stdlib.h>
#include <string.h>

// Largest value of the field inside, which so stays near the scaled distance's 0 to 1: large amplitudes that cancel at the wall would leave hollows beside
// the axis.
static const double MOST_INSIDE = 1.5;
// Points nearer to a tube's axis than this fraction of its radius are not wall.
static const double LUMEN_POINT = 0.5;
// An aneurysm is not a ball: only this fraction of its radius is certainly lumen; outside that its data decide.
static const double SAC_BALL = 0.6;
// Cosine of the half-angle of the cone around a direction from a sac's centre: a point of the sac's wall within the cone gives the wall's distance in that
// direction.
static const double SAC_CONE = 0.97;
// Largest bound of an outside guard: enough to prevent a closed sheet there. Between two walls a smooth field is not lower, and guards that demand the scaled
// distance would push the walls apart.
static const double OUTSIDE = 0.15;
// Of the selection: points on an area of wall as large as a voxel's face, and least number of points of a node.
static const double FEW_A_FACE = 4, FEW_LEAST = 16;
enum { GUARD_EVERY = 3, RING = 12, LINK_GUARDS = 4 };

typedef struct DraftPoint {
    Vec3 at;
    float few;               // weight in the selection; 0: not selected
} DraftPoint;

typedef struct DraftGuard {
    Vec3 at;
    float low, high, weight;
} DraftGuard;

typedef struct Draft {       // rows of a node while they are being collected
    int data, guards, data_capacity, guard_capacity;
    DraftPoint *point;
    DraftGuard *guard;
    bool failed;
} Draft;

typedef struct Job {
    const VesselTree *tree;
    double voxel;            // [mm] 0: unknown
    PowerBlocks blocks;
    double *reach;           // (N) [mm] no point of a node lies further from its centre
    double *link;            // (N) [mm] length of the link that is lumen to the parent; 0: there is none
    Draft *draft;            // (N) rows from each node's points and tube
    int **cell;              // (N) the cells that contain those rows, data first
    int64_t *dropped;        // (N)
} Job;

bool field_link_is_lumen(const VesselTree *tree, int node)
{
    int parent = tree->parent[node];
    bool at_sac = parent >= 0 && (tree->kind[node] != NODE_VESSEL || tree->kind[parent] != NODE_VESSEL);
    return parent >= 0 && vec3_distance(tree->center[node], tree->center[parent]) <= (at_sac ? 1.5 : 1) * (tree->radius[node] + tree->radius[parent]);
}

static void add_point(Draft *d, Vec3 x, double few)
{
    if (d->data == d->data_capacity) {
        int capacity = 2 * d->data_capacity + 64;
        DraftPoint *more = realloc(d->point, (size_t)capacity * sizeof *more);
        if (!more) {
            d->failed = true;
            return;
        }
        d->point = more;
        d->data_capacity = capacity;
    }
    d->point[d->data++] = (DraftPoint){x, (float)few};
}

static void add_guard(Draft *d, Vec3 x, double low, double high, double weight)
{
    if (d->guards == d->guard_capacity) {
        int capacity = 2 * d->guard_capacity + 64;
        DraftGuard *more = realloc(d->guard, (size_t)capacity * sizeof *more);
        if (!more) {
            d->failed = true;
            return;
        }
        d->guard = more;
        d->guard_capacity = capacity;
    }
    d->guard[d->guards++] = (DraftGuard){x, (float)low, (float)high, (float)weight};
}

// Distance of x from the axis of node's link to its parent (from its own centre if the link is not lumen), as a fraction of the radius there.
static double share_of_tube(const VesselTree *tree, int node, Vec3 x)
{
    int parent = tree->parent[node];
    Vec3 b = tree->center[node];
    if (!field_link_is_lumen(tree, node))
        return vec3_distance(x, b) / tree->radius[node];
    Vec3 a = tree->center[parent], e = vec3_sub(b, a);
    double length2 = vec3_norm2(e), t = length2 > 0 ? fmax(0, fmin(1, vec3_dot(vec3_sub(x, a), e) / length2)) : 1;
    // do not widen a narrow branch's link towards its parent's axis
    double r = tree->radius[node] + (1 - t) * fmin(0, tree->radius[parent] - tree->radius[node]);
    return vec3_distance(x, vec3_mix(a, b, t)) / r;
}

// Returns true if x is nearer to the node's tube than `limit`, measured as if the tube had the node's radius all along. Most tubes are so far away that the
// distance from the node's centre tells.
static bool is_near_tube(const Job *job, int node, Vec3 x, double limit)
{
    const double rounding = 1 + 1e-9, reach = rounding * (job->link[node] + limit);
    const VesselTree *tree = job->tree;
    return vec3_norm2(vec3_sub(x, tree->center[node])) < reach * reach && share_of_tube(tree, node, x) * tree->radius[node] < limit;
}

static bool is_in_lumen(const Job *job, int node, Vec3 x)
{
    const VesselTree *tree = job->tree;
    for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1]; k++) {
        int at = k < tree->near_offset[node] ? node : tree->near[k];
        if (tree->kind[at] == NODE_VESSEL && is_near_tube(job, at, x, LUMEN_POINT * tree->radius[at]))
            return true;
    }
    return false;
}

// Returns true if a sac's wall point lies behind x, seen from the sac's centre. A vessel's guards would otherwise reach far into an aneurysm attached to it.
static bool is_between(Vec3 x, Vec3 wall)
{
    double along = vec3_dot(x, wall), x2 = vec3_norm2(x), wall2 = vec3_norm2(wall);
    return along > 0 && wall2 > x2 && along * along > SAC_CONE * SAC_CONE * wall2 * x2;
}

// Returns true if x is at least `clear` away from every tube and from all data near the node.
static bool is_clear(const Job *job, int node, Vec3 x, double clear)
{
    const VesselTree *tree = job->tree;
    for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1]; k++) {
        int at = k < tree->near_offset[node] ? node : tree->near[k];
        double r = tree->radius[at], share = tree->kind[at] == NODE_VESSEL ? 1.1 : SAC_BALL;
        if (is_near_tube(job, at, x, share * r + 0.5 * clear))
            return false;
        double away = vec3_distance(x, tree->center[at]);
        if (away > r + tree->height[at] + 2 * clear + 1.5 * r || (tree->kind[at] == NODE_VESSEL && away > job->reach[at] + clear))
            continue;
        Vec3 out = vec3_sub(x, tree->center[at]);
        for (int64_t i = tree->point_offset[at]; i < tree->point_offset[at + 1]; i++) {
            if (vec3_norm2(vec3_sub(x, tree->point[i])) < clear * clear)
                return false;
            if (tree->kind[at] != NODE_VESSEL && is_between(out, vec3_sub(tree->point[i], tree->center[at])))
                return false;
        }
    }
    return true;
}

// Returns true if x is clear near `node` and near the node whose power cell (of the whole tree) contains x: just outside a vessel's wall the lumen of another
// vessel may begin, a sibling or a part of the same vessel that bends back, which is not near in the tree but shares blobs with it.
static bool is_outside(const Job *job, int node, Vec3 x, double clear)
{
    if (!is_clear(job, node, x, clear))
        return false;
    int cell = power_blocks_nearest_from(&job->blocks, x, node);
    return cell == node || is_clear(job, cell, x, clear);
}

static Vec3 axis_point(const VesselTree *tree, int node, Vec3 p)
{
    Vec3 c = tree->center[node], d = tree->direction[node];
    double along = tree->kind[node] == NODE_VESSEL ? vec3_dot(vec3_sub(p, c), d) : 0, most = 0.5 * tree->height[node];
    return vec3_add_scaled(c, fmax(-most, fmin(most, along)), d);
}

// The bound of a guard `clear` mm from the wall in a vessel of radius r.
static double low_bound(double clear, double r) { return 0.5 * fmin(1, 2 * clear / r); }

static void guard_around_point(const Job *job, int node, DraftPoint point, Draft *d)
{
    const VesselTree *tree = job->tree;
    Vec3 p = point.at, axis = axis_point(tree, node, p), out = vec3_sub(p, axis);
    double r = tree->radius[node], far = vec3_norm(out);
    if (!(far > 0.2 * r))
        return;
    out = vec3_scale(out, 1 / far);
    for (int k = 1; k <= 2; k++) {
        double in = far * k / 3;
        add_guard(d, vec3_add_scaled(p, -in, out), low_bound(0.5 * in, r), MOST_INSIDE, (double)point.few);
    }
    for (int k = 0; k < 3; k++) {
        static const double away[3] = {0.35, 0.8, 1.4};
        Vec3 x = vec3_add_scaled(p, away[k] * r, out);
        if (is_outside(job, node, x, 0.3 * r))
            add_guard(d, x, -HUGE_VAL, -OUTSIDE * fmin(1, away[k]), (double)point.few);
    }
}

static void guard_ring(const Job *job, int node, Draft *d)
{
    const VesselTree *tree = job->tree;
    Vec3 c = tree->center[node], axis = tree->direction[node], e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
    double r = tree->radius[node];
    for (int k = 0; k < RING; k++) {
        double angle = 2 * PI * k / RING;
        Vec3 out = vec3_add(vec3_scale(e1, same_cos(angle)), vec3_scale(e2, same_sin(angle)));
        for (int far = 0; far < 2; far++) {
            Vec3 x = vec3_add_scaled(c, (1.6 + 0.6 * far) * r, out);
            if (is_outside(job, node, x, 0.4 * r))
                add_guard(d, x, -HUGE_VAL, -0.8 * OUTSIDE, 1);
        }
    }
}

static void guard_axis(const VesselTree *tree, int node, Draft *d)
{
    int parent = tree->parent[node];
    double r = tree->radius[node];
    add_guard(d, tree->center[node], low_bound(0.5 * r, r), MOST_INSIDE, 1);
    if (!field_link_is_lumen(tree, node))
        return;
    Vec3 a = tree->center[parent], b = tree->center[node], axis = vec3_unit_or(vec3_sub(b, a), tree->direction[node]);
    Vec3 e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
    int steps = vec3_distance(a, b) > 0.3 * r ? LINK_GUARDS : 1;
    for (int k = 0; k < steps; k++) {
        double t = (k + 0.5) / steps, free = fmin(r, tree->radius[parent]);
        Vec3 x = vec3_mix(a, b, t);
        add_guard(d, x, low_bound(0.5 * free, free), MOST_INSIDE, 1);
        for (int around = 0; around < 4; around++) {
            Vec3 side = around < 2 ? e1 : e2;
            add_guard(d, vec3_add_scaled(x, (around % 2 ? 0.4 : -0.4) * free, side), low_bound(0.3 * free, free), MOST_INSIDE, 1);
        }
    }
}

// Repeats the root's own points upstream, shifted by their extent along the axis.
static void extend_inlet(const VesselTree *tree, Draft *d)
{
    Vec3 root = tree->center[0], up = vec3_negate(tree->direction[0]);
    double r = tree->radius[0], least = HUGE_VAL, most = -HUGE_VAL;
    int own = d->data, slab_points = 0;
    for (int i = 0; i < own; i++) {
        double t = vec3_dot(vec3_sub(d->point[i].at, root), up);
        least = fmin(least, t), most = fmax(most, t);
    }
    double slab = fmin(most - least, 0.4 * r);
    if (own < 12 || most - least < 0.2 * r)
        return;
    for (int i = 0; i < own; i++)
        slab_points += vec3_dot(vec3_sub(d->point[i].at, root), up) >= most - slab;
    slab = slab_points < 12 ? most - least : slab;
    for (int copy = 1; copy < 16 && most + (copy - 1) * slab < FIELD_INLET_RADII * r; copy++)
        for (int i = 0; i < own; i++) {
            Vec3 p = d->point[i].at;
            double t = vec3_dot(vec3_sub(p, root), up);
            if (t >= most - slab && t + copy * slab < FIELD_INLET_RADII * r)
                add_point(d, vec3_add_scaled(p, copy * slab, up), (double)d->point[i].few);
        }
    for (int k = 1; k <= 4; k++)
        add_guard(d, vec3_add_scaled(root, 0.5 * k * r, up), low_bound(0.5 * r, r), MOST_INSIDE, 1);
}

static void measure_reach(const VesselTree *tree, double *reach, double *link)
{
    const double rounding = 1 + 1e-12;
    for (int node = 0; node < tree->node_count; node++) {
        link[node] = field_link_is_lumen(tree, node) ? vec3_distance(tree->center[node], tree->center[tree->parent[node]]) : 0;
        for (int64_t i = tree->point_offset[node]; i < tree->point_offset[node + 1]; i++) {
            double away = rounding * vec3_distance(tree->point[i], tree->center[node]);
            reach[node] = away > reach[node] ? away : reach[node];
        }
    }
}

static bool is_fork(const VesselTree *tree, int node) { return tree->neighbour_offset[node + 1] - tree->neighbour_offset[node] > 2; }

static bool is_near_fork(const VesselTree *tree, int node)
{
    bool found = is_fork(tree, node);
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1] && !found; k++)
        found = is_fork(tree, tree->near[k]);
    return found;
}

// Returns the number of a node's points that one selected point stands for. Many rays pass through the same voxels, and nodes overlap along the tree: FEW_A_FACE
// points are enough for each voxel's face of wall. Near forks all are needed: with fewer, mouths of aneurism.nrrd became narrower.
static double points_a_row(const VesselTree *tree, double voxel_mm, int node)
{
    double r = tree->radius[node], along = tree->height[node], points = (double)(tree->point_offset[node + 1] - tree->point_offset[node]);
    if (!(voxel_mm > 0) || is_near_fork(tree, node))
        return 1;
    if (tree->parent[node] >= 0)
        along = fmin(along, vec3_distance(tree->center[node], tree->center[tree->parent[node]]));
    double wall = tree->kind[node] == NODE_VESSEL ? 2 * PI * r * along : 4 * PI * r * r;
    return fmax(1, points / fmax(FEW_LEAST, FEW_A_FACE * wall / (voxel_mm * voxel_mm)));
}

// Returns the weight of point i of the tree if one in `every` is selected; 0 if it is not selected. Multiples of the golden section spread the selection over
// all directions of the rays, whatever their order.
static double few_weight(int64_t i, double every)
{
    const double golden = 0.6180339887498949;
    double at = golden * (double)i;
    return at - floor(at) < 1 / every ? every : 0;
}

static void draft_node(void *context, long index)
{
    Job *job = context;
    const VesselTree *tree = job->tree;
    int node = (int)index, root_open = node == 0 && vessel_tree_root_is_open(tree);
    Draft *d = &job->draft[node];
    double every = points_a_row(tree, job->voxel, node);
    for (int64_t i = tree->point_offset[node]; i < tree->point_offset[node + 1]; i++) {
        Vec3 p = tree->point[i];
        if (is_in_lumen(job, node, p))
            job->dropped[node]++;
        else
            add_point(d, p, few_weight(i, every));
    }
    for (int i = 0; i < d->data; i += GUARD_EVERY)
        if (d->point[i].few > 0)
            guard_around_point(job, node, d->point[i], d);
    if (root_open)
        extend_inlet(tree, d);
    guard_axis(tree, node, d);
    if (tree->kind[node] == NODE_VESSEL)
        guard_ring(job, node, d);
    if (d->failed)
        return;
    job->cell[node] = malloc(((size_t)(d->data + d->guards) + 1) * sizeof **job->cell);
    if (!job->cell[node]) {
        d->failed = true;
        return;
    }
    for (int i = 0; i < d->data; i++)
        job->cell[node][i] = power_walk(tree, d->point[i].at, node, 8);
    for (int i = 0; i < d->guards; i++)
        job->cell[node][d->data + i] = power_walk(tree, d->guard[i].at, node, 8);
}

// --- Tiles ---

typedef struct Row {
    float x[3], low, high, weight;
    bool is_data;
} Row;

// Order of rows along an axis, to halve a node's rows at the middle of the longest axis.
static int compare_rows(const void *a, const void *b, int axis)
{
    float x = ((const Row *)a)->x[axis], y = ((const Row *)b)->x[axis];
    return (x > y) - (x < y);
}
static int by_x(const void *a, const void *b) { return compare_rows(a, b, 0); }
static int by_y(const void *a, const void *b) { return compare_rows(a, b, 1); }
static int by_z(const void *a, const void *b) { return compare_rows(a, b, 2); }

static int padded(int count) { return (count + FIELD_LANES - 1) / FIELD_LANES * FIELD_LANES; }

typedef struct TileJob {
    FieldRows *rows;
    Row *row;                // (M) by cell
    const int *first;        // (N+1) cell i has rows first[i] … first[i+1]-1
    size_t *floats;          // (N+1) a cell's numbers; then where they begin
} TileJob;

static void measure_rows(const Row *row, int count, int *data, float low[3], float high[3])
{
    *data = 0;
    for (int k = 0; k < 3; k++)
        low[k] = HUGE_VALF, high[k] = -HUGE_VALF;
    for (int i = 0; i < count; i++) {
        *data += row[i].is_data;
        for (int k = 0; k < 3; k++)
            low[k] = fminf(low[k], row[i].x[k]), high[k] = fmaxf(high[k], row[i].x[k]);
    }
}

static bool is_tile(int data, int count) { return data <= FIELD_TILE && count - data <= GUARD_TILE; }

// Halves the rows until a tile holds no more than its limit. Sorts them for that, and counts tiles and their numbers.
static void split_rows(Row *row, int count, int *tiles, size_t *floats)
{
    int data;
    float low[3], high[3];
    measure_rows(row, count, &data, low, high);
    if (count == 0)
        return;
    if (!is_tile(data, count)) {
        int axis = high[1] - low[1] > high[0] - low[0] ? 1 : 0;
        axis = high[2] - low[2] > high[axis] - low[axis] ? 2 : axis;
        qsort(row, (size_t)count, sizeof *row, axis == 0 ? by_x : axis == 1 ? by_y : by_z);
        split_rows(row, count / 2, tiles, floats);
        split_rows(row + count / 2, count - count / 2, tiles, floats);
        return;
    }
    int d = padded(data), g = padded(count - data);
    *tiles += 1;
    *floats += (size_t)(4 * (d + g) + 2 * g);
}

// Fills the tiles of rows that were split; their numbers go to `memory`.
static void fill_tiles(const Row *row, int count, int node, RowTile **tile, float **memory)
{
    int data;
    float low[3], high[3];
    measure_rows(row, count, &data, low, high);
    if (count == 0)
        return;
    if (!is_tile(data, count)) {
        fill_tiles(row, count / 2, node, tile, memory);
        fill_tiles(row + count / 2, count - count / 2, node, tile, memory);
        return;
    }
    int d = padded(data), g = padded(count - data);
    float *next = *memory;
    RowTile *to = (*tile)++;
    *to = (RowTile){.node = node, .data_padded = d, .guards_padded = g, .x = next, .y = next + d + g, .z = next + 2 * (d + g), .weight = next + 3 * (d + g)};
    to->low = to->weight + d + g, to->high = to->low + g;
    *memory = to->high + g;
    for (int k = 0; k < 3; k++)
        to->middle[k] = 0.5f * (low[k] + high[k]);
    for (int i = 0; i < count; i++) {
        int at = row[i].is_data ? to->data++ : d + to->guards++;
        to->x[at] = row[i].x[0], to->y[at] = row[i].x[1], to->z[at] = row[i].x[2];
        to->weight[at] = row[i].weight;
        if (!row[i].is_data)
            to->low[at - d] = row[i].low, to->high[at - d] = row[i].high;
        float dx = row[i].x[0] - to->middle[0], dy = row[i].x[1] - to->middle[1], dz = row[i].x[2] - to->middle[2];
        to->radius = fmaxf(to->radius, sqrtf(dx * dx + dy * dy + dz * dz));
    }
    for (int i = to->guards; i < g; i++)
        to->low[i] = -HUGE_VALF, to->high[i] = HUGE_VALF;
}

static void split_cell(void *context, long index)
{
    TileJob *job = context;
    split_rows(job->row + job->first[index], job->first[index + 1] - job->first[index], &job->rows->first[index], &job->floats[index]);
}

static void fill_cell(void *context, long index)
{
    TileJob *job = context;
    RowTile *tile = job->rows->tile + job->rows->first[index];
    float *memory = job->rows->memory + job->floats[index];
    fill_tiles(job->row + job->first[index], job->first[index + 1] - job->first[index], (int)index, &tile, &memory);
}

// Weight of row k of a draft, data first. Only selected points have guards, so a guard has its point's weight in the selection and among all rows.
static float weight_of(const Draft *d, int k, bool few) { return k >= d->data ? d->guard[k - d->data].weight : few ? d->point[k].few : 1; }

static Row row_of(const Job *job, int node, int k, bool few)
{
    const VesselTree *tree = job->tree;
    const Draft *d = &job->draft[node];
    int cell = job->cell[node][k];
    // in a cell wider than the guard's own vessel, the field rises more slowly
    float scale = (float)fmin(1, tree->radius[node] / tree->radius[cell]);
    bool is_data = k < d->data;
    DraftGuard from = is_data ? (DraftGuard){.at = d->point[k].at} : d->guard[k - d->data];
    Vec3 x = vec3_sub(from.at, tree->center[cell]);
    return (Row){{(float)x.x, (float)x.y, (float)x.z}, from.low * scale, from.high < 0 ? from.high * scale : from.high, weight_of(d, k, few), is_data};
}

// Collects the rows (M), those of a cell consecutive; first (N+1) gives the first row of each cell.
static Row *collect_rows(const Job *job, int *first, bool few)
{
    int n = job->tree->node_count, total = 0;
    for (int i = 0; i < n; i++) {
        const Draft *d = &job->draft[i];
        if (d->failed)
            return NULL;
        for (int k = 0; k < d->data + d->guards; k++)
            if (weight_of(d, k, few) > 0)
                first[job->cell[i][k] + 1]++, total++;
    }
    Row *row = malloc(((size_t)total + 1) * sizeof *row);
    int sum = 0;
    for (int i = 0; i < n; i++) {   // first[i + 1] is the position of the next row of cell i, and finally its end
        int own = first[i + 1];
        first[i + 1] = sum;
        sum += own;
    }
    for (int i = 0; i < n && row; i++) {
        const Draft *d = &job->draft[i];
        for (int k = 0; k < d->data + d->guards; k++)
            if (weight_of(d, k, few) > 0)
                row[first[job->cell[i][k] + 1]++] = row_of(job, i, k, few);
    }
    return row;
}

static bool make_tiles(const Job *job, FieldRows *rows, bool few, int threads)
{
    *rows = (FieldRows){.node_count = job->tree->node_count, .first = calloc((size_t)job->tree->node_count + 1, sizeof *rows->first)};
    int n = rows->node_count, *first = calloc((size_t)n + 1, sizeof *first), tiles = 0;
    TileJob t = {rows, first ? collect_rows(job, first, few) : NULL, first, calloc((size_t)n + 1, sizeof *t.floats)};
    size_t floats = 0;
    bool good = rows->first && t.row && t.floats;
    if (good)
        parallel_for(threads, n, split_cell, &t, NULL);
    for (int i = 0; i <= n && good; i++) {
        int own = rows->first[i];
        size_t numbers = t.floats[i];
        rows->first[i] = tiles, t.floats[i] = floats;
        tiles += own, floats += numbers;
    }
    rows->tile = good ? calloc((size_t)tiles + 1, sizeof *rows->tile) : NULL;
    rows->memory = good ? aligned_alloc(64, (floats + FIELD_LANES) / FIELD_LANES * 64) : NULL;
    good = rows->tile && rows->memory;
    if (good) {
        memset(rows->memory, 0, floats * sizeof(float));
        parallel_for(threads, n, fill_cell, &t, NULL);
    }
    free(first);
    free(t.row);
    free(t.floats);
    return good;
}

// Returns true if less than half of the points are selected.
static bool are_few(const Job *job)
{
    int64_t all = 0, few = 0;
    for (int i = 0; i < job->tree->node_count; i++) {
        const Draft *d = &job->draft[i];
        all += d->data;
        for (int k = 0; k < d->data; k++)
            few += d->point[k].few > 0;
    }
    return 2 * few < all;
}

bool field_rows_create(FieldRows *rows, FieldRows *few, const VesselTree *tree, double voxel_mm, int threads)
{
    size_t n = (size_t)tree->node_count;
    *rows = *few = (FieldRows){0};
    Job job = {.tree = tree,
               .voxel = voxel_mm,
               .reach = calloc(n, sizeof *job.reach),
               .link = calloc(n, sizeof *job.link),
               .draft = calloc(n, sizeof *job.draft),
               .cell = calloc(n, sizeof *job.cell),
               .dropped = calloc(n, sizeof *job.dropped)};
    bool good = power_blocks_create(&job.blocks, tree) && job.reach && job.link && job.draft && job.cell && job.dropped;
    if (good) {
        measure_reach(tree, job.reach, job.link);
        parallel_for(threads, tree->node_count, draft_node, &job, NULL);
        good = make_tiles(&job, rows, false, threads) && (!are_few(&job) || make_tiles(&job, few, true, threads));
    }
    for (int i = 0; i < tree->node_count && job.draft && job.cell && job.dropped; i++) {
        rows->dropped += job.dropped[i];
        free(job.draft[i].point);
        free(job.draft[i].guard);
        free(job.cell[i]);
    }
    free(job.reach);
    free(job.link);
    free(job.draft);
    free(job.cell);
    free(job.dropped);
    power_blocks_free(&job.blocks);
    return good;
}

void field_rows_free(FieldRows *rows)
{
    free(rows->first);
    free(rows->tile);
    free(rows->memory);
    *rows = (FieldRows){0};
}

// Levenberg and Marquardt's method on a region's blobs at a time, the others standing still.
//
// Rows, in mm: data  e = f/|g|, by Huber's loss;  slope  e = s r (r |g| / 2 - 1);  guards  e = w r/2 (f - clamp(f, low, high)). A linearisation holds
// |g| and the direction of g. A region is some two dozen blobs that follow each other along the tree; its rows are those of all nodes that see one of
// them, so that a step that is accepted lowers the sum of squares of the whole tree, whatever the other regions do. Regions that share a node's rows are
// solved one after the other, in the order of their colours: the result does not depend on the threads.
#include "recon/field_model.h"
#include "recon/lim_energy.h"
#include "recon/parallel.h"

#include <stdlib.h>
#include <string.h>

enum { REGION_BLOBS = 28, UNKNOWNS = 5, COLOURS_MAX = 4096 };
static const double HUBER_RADII = 0.08, LEAST_SLOPE = 0.5;
// Priors: a blob's place and size are held to where it was put, as firmly as a few points a hundredth of a radius off would.
static const double PRIOR_PLACE = 0.02, PRIOR_AMPLITUDE = 0.002;

typedef struct RegionNode {
    int node, count;         // blobs of the region that it sees …
    int *local;              // … their numbers in the region
    float *still_f, *still_g[3], *f, *g[3];
} RegionNode;

typedef struct Region {
    int first, count;        // blobs order[first … first+count-1]
    int nodes, *node;        // that see one of them, ascending
    int colour;
    double before, after;    // sum of squares
    bool failed;
} Region;

typedef struct Sweep {
    FieldModel *model;
    int *order;              // (blobs) along the tree
    int *region_of;          // (blobs)
    int regions;
    Region *region;
    int batch_count, *batch; // regions of one colour
    int steps;
} Sweep;

typedef struct Work {        // of one region
    const Sweep *sweep;
    const Region *region;
    RegionNode *node;
    float *memory;
    int unknowns;
    double *matrix, *slope;  // (U, U), (U)
    double *factor, *step;
    FieldBlob *trial;        // (region's blobs)
    float *column;
    double *gram;
    int columns_most, length_most;
} Work;

static const NodeRows *rows_of(const Work *w, int n) { return &w->sweep->model->rows->node[w->node[n].node]; }

static LaneBlob lane_of(const VesselTree *tree, int node, const FieldBlob *blob)
{
    Vec3 c = vec3_sub(blob->center, tree->center[node]);
    return (LaneBlob){(float)c.x, (float)c.y, (float)c.z, (float)blob->reach, (float)blob->amplitude};
}

// --- Setting up ---

static int local_of(const Work *w, int blob)
{
    const Sweep *s = w->sweep;
    for (int k = 0; k < w->region->count; k++)
        if (s->order[w->region->first + k] == blob)
            return k;
    return -1;
}

static bool begin_work(Work *w, const Sweep *sweep, const Region *region)
{
    const FieldModel *model = sweep->model;
    *w = (Work){.sweep = sweep, .region = region, .unknowns = UNKNOWNS * region->count};
    int number = (int)(region - sweep->region);
    size_t floats = 0, locals = 0;
    for (int n = 0; n < region->nodes; n++) {
        int node = region->node[n];
        const NodeRows *rows = &model->rows->node[node];
        int d = rows->data_padded, all = d + rows->guards_padded, seen = 0;
        floats += 2 * ((size_t)all + 3 * (size_t)d);
        for (int64_t s = model->offset[node]; s < model->offset[node + 1]; s++)
            seen += sweep->region_of[model->seen[s]] == number;
        locals += (size_t)seen;
        int columns = (UNKNOWNS * seen + 1 + 3) / 4 * 4;
        w->columns_most = columns > w->columns_most ? columns : w->columns_most;
        w->length_most = all + d > w->length_most ? all + d : w->length_most;
    }
    size_t u = (size_t)w->unknowns;
    w->node = calloc((size_t)region->nodes, sizeof *w->node);
    w->memory = malloc((floats + 1) * sizeof *w->memory);
    int *local = malloc((locals + 1) * sizeof *local);
    w->matrix = malloc(2 * (u * u + u) * sizeof *w->matrix);
    w->trial = malloc((size_t)region->count * sizeof *w->trial);
    w->column = aligned_alloc(64, ((size_t)w->columns_most + 2) * ((size_t)w->length_most + 16) / 16 * 64 + 64);
    w->gram = malloc((size_t)w->columns_most * (size_t)w->columns_most * sizeof *w->gram);
    if (!w->node || !w->memory || !local || !w->matrix || !w->trial || !w->column || !w->gram) {
        free(local);
        return false;
    }
    w->slope = w->matrix + u * u, w->factor = w->slope + u, w->step = w->factor + u * u;
    float *next = w->memory;
    for (int n = 0; n < region->nodes; n++) {
        RegionNode *rn = &w->node[n];
        int node = rn->node = region->node[n], d = model->rows->node[node].data_padded, all = d + model->rows->node[node].guards_padded;
        rn->local = local;
        rn->still_f = next, next += all;
        rn->f = next, next += all;
        for (int k = 0; k < 3; k++, next += 2 * (size_t)d)
            rn->still_g[k] = next, rn->g[k] = next + d;
        const NodeRows *rows = &model->rows->node[node];
        for (int i = 0; i < all; i++)
            rn->still_f[i] = -1;
        for (int k = 0; k < 3; k++)
            memset(rn->still_g[k], 0, (size_t)d * sizeof(float));
        for (int64_t s = model->offset[node]; s < model->offset[node + 1]; s++) {
            int b = model->seen[s];
            if (sweep->region_of[b] == number) {
                rn->local[rn->count++] = local_of(w, b);
                continue;
            }
            LaneBlob lane = lane_of(model->tree, node, &model->blob[b]);
            field_lanes_sum(rows->x, rows->y, rows->z, all, d, &lane, 1, rn->still_f, rn->still_g);
        }
        local += rn->count;
    }
    return true;
}

static void end_work(Work *w)
{
    if (w->node)
        free(w->node[0].local);
    free(w->node);
    free(w->memory);
    free(w->matrix);
    free(w->trial);
    free(w->column);
    free(w->gram);
}

// --- Rows ---

static void sum_node(const Work *w, int n, const FieldBlob *blob)
{
    const RegionNode *rn = &w->node[n];
    const NodeRows *rows = rows_of(w, n);
    int d = rows->data_padded, all = d + rows->guards_padded;
    memcpy(rn->f, rn->still_f, (size_t)all * sizeof(float));
    for (int k = 0; k < 3; k++)
        memcpy(rn->g[k], rn->still_g[k], (size_t)d * sizeof(float));
    for (int k = 0; k < rn->count; k++) {
        LaneBlob lane = lane_of(w->sweep->model->tree, rn->node, &blob[rn->local[k]]);
        field_lanes_sum(rows->x, rows->y, rows->z, all, d, &lane, 1, rn->f, rn->g);
    }
}

static double huber(double e, double knee) { return fabs(e) <= knee ? e * e : knee * (2 * fabs(e) - knee); }

// Sum of squares of a node's rows from the sums as they are.
static double energy_of_rows(const FieldModel *model, int node, const NodeRows *rows, const float *f, float *const g[3])
{
    double r = model->tree->radius[node], knee = HUBER_RADII * r, least = LEAST_SLOPE / r, bend = model->smooth * r, sum = 0;
    for (int i = 0; i < rows->data; i++) {
        double slope = sqrt((double)(g[0][i] * g[0][i] + g[1][i] * g[1][i] + g[2][i] * g[2][i])), off = bend * (0.5 * r * slope - 1);
        sum += huber((double)f[i] / fmax(slope, least), knee) + off * off;
    }
    double scale = 0.5 * r * model->guard_weight;
    for (int i = 0; i < rows->guards; i++) {
        float value = f[rows->data_padded + i];
        double e = value < rows->low[i] ? (double)(value - rows->low[i]) : value > rows->high[i] ? (double)(value - rows->high[i]) : 0;
        sum += scale * scale * e * e;
    }
    return sum;
}

static double prior_of(const FieldModel *model, const FieldBlob *b)
{
    double r = model->tree->radius[b->owner], p = PRIOR_PLACE * r, q = PRIOR_AMPLITUDE * r * b->amplitude, size = log(b->reach / b->birth_reach);
    return p * p * (vec3_norm2(vec3_sub(b->center, b->birth)) / (b->birth_reach * b->birth_reach) + size * size) + q * q;
}

static double energy(const Work *w, const FieldBlob *blob)
{
    double sum = 0;
    for (int n = 0; n < w->region->nodes; n++) {
        sum_node(w, n, blob);
        sum += energy_of_rows(w->sweep->model, w->node[n].node, rows_of(w, n), w->node[n].f, w->node[n].g);
    }
    for (int k = 0; k < w->region->count; k++)
        sum += prior_of(w->sweep->model, &blob[k]);
    return sum;
}

// --- Normal equations ---

// The weights of a node's rows, sums made: scale (D + G), bend (D), unit normals in place of the gradients; and the residuals, as the columns stand.
static void weigh_rows(const FieldModel *model, int node, const NodeRows *rows, RegionNode *rn, float *scale, float *bend, float *residual)
{
    int d = rows->data_padded, g = rows->guards_padded;
    float r = (float)model->tree->radius[node], knee = (float)HUBER_RADII * r, least = (float)LEAST_SLOPE / r, half = 0.5f * r, bw = (float)model->smooth * r * half,
          gw = half * (float)model->guard_weight;
    for (int i = 0; i < d; i++) {
        float gx = rn->g[0][i], gy = rn->g[1][i], gz = rn->g[2][i], slope = sqrtf(gx * gx + gy * gy + gz * gz), held = slope > least ? slope : least;
        float e = rn->f[i] / held, size = fabsf(e), w = rows->weight[i] * (size > knee ? sqrtf(knee / size) : 1.0f), unit = slope > 1e-6f ? 1 / slope : 0;
        scale[i] = w / held;
        residual[i] = w * e;
        bend[i] = rows->weight[i] * bw;
        residual[d + g + i] = bend[i] * (slope - 1 / half);
        rn->g[0][i] = gx * unit, rn->g[1][i] = gy * unit, rn->g[2][i] = gz * unit;
    }
    for (int i = 0; i < g; i++) {
        float f = rn->f[d + i], e = f < rows->low[i] ? f - rows->low[i] : f > rows->high[i] ? f - rows->high[i] : 0;
        scale[d + i] = e != 0 ? rows->guard[i] * gw : 0;
        residual[d + i] = scale[d + i] * e;
    }
}

static void add_node(Work *w, int n)
{
    RegionNode *rn = &w->node[n];
    const NodeRows *rows = rows_of(w, n);
    const FieldModel *model = w->sweep->model;
    int d = rows->data_padded, all = d + rows->guards_padded, length = all + d, columns = UNKNOWNS * rn->count + 1, padded = (columns + 3) / 4 * 4;
    float *scale = w->column + (size_t)padded * (size_t)length, *bend = scale + all;
    if (length == 0 || rn->count == 0)
        return;
    weigh_rows(model, rn->node, rows, rn, scale, bend, w->column + (size_t)(columns - 1) * (size_t)length);
    memset(w->column + (size_t)columns * (size_t)length, 0, (size_t)(padded - columns) * (size_t)length * sizeof(float));
    for (int k = 0; k < rn->count; k++) {
        LaneBlob lane = lane_of(model->tree, rn->node, &w->trial[rn->local[k]]);
        const float *normal[3] = {rn->g[0], rn->g[1], rn->g[2]};
        field_lanes_columns(rows->x, rows->y, rows->z, all, d, &lane, scale, bend, normal, w->column + (size_t)(UNKNOWNS * k) * (size_t)length, length);
    }
    for (int a = 0; a < padded; a += 4)
        for (int b = a; b < padded; b += 4)
            lim_energy_gram(w->column + (size_t)a * (size_t)length, w->column + (size_t)b * (size_t)length, (size_t)length, length,
                            w->gram + (size_t)a * (size_t)padded + b, (size_t)padded);
    for (int a = 0; a < columns - 1; a++) {
        int to_a = UNKNOWNS * rn->local[a / UNKNOWNS] + a % UNKNOWNS;
        for (int b = a; b < columns - 1; b++) {
            int to_b = UNKNOWNS * rn->local[b / UNKNOWNS] + b % UNKNOWNS;
            double value = w->gram[(size_t)a * (size_t)padded + (size_t)b];
            w->matrix[(size_t)(to_a < to_b ? to_a : to_b) * (size_t)w->unknowns + (size_t)(to_a < to_b ? to_b : to_a)] += value;
        }
        w->slope[to_a] += w->gram[(size_t)a * (size_t)padded + (size_t)columns - 1];
    }
}

static void add_priors(Work *w)
{
    const FieldModel *model = w->sweep->model;
    size_t u = (size_t)w->unknowns;
    for (int k = 0; k < w->region->count; k++) {
        const FieldBlob *b = &w->trial[k];
        double r = model->tree->radius[b->owner], p = PRIOR_PLACE * r, q = PRIOR_AMPLITUDE * r, share = b->reach / b->birth_reach;
        Vec3 off = vec3_scale(vec3_sub(b->center, b->birth), 1 / b->birth_reach);
        double weight[UNKNOWNS] = {q * q, p * p * share * share, p * p * share * share, p * p * share * share, p * p};
        double slope[UNKNOWNS] = {q * q * b->amplitude, p * p * share * off.x, p * p * share * off.y, p * p * share * off.z, p * p * log(share)};
        for (int m = 0; m < UNKNOWNS; m++) {
            size_t at = (size_t)(UNKNOWNS * k + m);
            w->matrix[at * u + at] += weight[m];
            w->slope[at] += slope[m];
        }
    }
}

static void linearise(Work *w)
{
    memset(w->matrix, 0, (size_t)w->unknowns * (size_t)w->unknowns * sizeof *w->matrix);
    memset(w->slope, 0, (size_t)w->unknowns * sizeof *w->slope);
    for (int n = 0; n < w->region->nodes; n++)
        add_node(w, n);
    add_priors(w);
}

// --- Steps ---

static double bound(double value, double most) { return fmax(-most, fmin(most, value)); }

static FieldBlob moved_by(const FieldModel *model, const FieldBlob *b, const double *step)
{
    FieldBlob to = *b;
    double r = model->tree->radius[b->owner];
    to.amplitude += bound(step[0], 0.5 + 0.5 * fabs(b->amplitude));
    Vec3 way = vec3_scale(vec3(step[1], step[2], step[3]), b->reach);
    double length = vec3_norm(way), most = 0.15 * b->reach;
    to.center = vec3_add_scaled(b->center, length > most ? most / length : 1, way);
    Vec3 off = vec3_sub(to.center, b->birth);
    double away = vec3_norm(off), furthest = 0.8 * b->birth_reach;
    if (away > furthest)
        to.center = vec3_add_scaled(b->birth, furthest / away, off);
    double reach = b->reach * exp(bound(step[4], 0.2));
    to.reach = fmax(fmax(0.25 * r, 0.5 * b->birth_reach), fmin(fmin(reach, 1.12 * b->reach), fmin(3 * r, 2 * b->birth_reach)));
    to.moved = true;
    return to;
}

static bool solve_step(Work *w, double damping)
{
    size_t u = (size_t)w->unknowns;
    memcpy(w->factor, w->matrix, u * u * sizeof *w->factor);
    for (size_t k = 0; k < u; k++) {
        w->factor[k * u + k] += damping * w->matrix[k * u + k] + 1e-18;
        w->step[k] = -w->slope[k];
    }
    return lim_solve(w->factor, w->unknowns, w->unknowns, w->step);
}

static void solve_region(void *context, long index)
{
    Sweep *sweep = context;
    FieldModel *model = sweep->model;
    Region *region = &sweep->region[sweep->batch[index]];
    const int *order = sweep->order + region->first;
    Work w;
    FieldBlob *now = malloc((size_t)region->count * sizeof *now);
    if (!begin_work(&w, sweep, region) || !now) {
        region->failed = true;
        end_work(&w);
        free(now);
        return;
    }
    for (int k = 0; k < region->count; k++)
        now[k] = w.trial[k] = model->blob[order[k]];
    double least = region->before = energy(&w, now), damping = 1e-3;
    bool is_summed = true;   // the sums are those of `now`
    for (int step = 0, tries = 0; step < sweep->steps && tries < 3 * sweep->steps; tries++) {
        if (tries == 0 || is_summed) {
            memcpy(w.trial, now, (size_t)region->count * sizeof *now);
            linearise(&w);
            is_summed = false;
        }
        if (solve_step(&w, damping)) {
            for (int k = 0; k < region->count; k++)
                w.trial[k] = moved_by(model, &now[k], w.step + UNKNOWNS * k);
            double there = energy(&w, w.trial);
            if (there < least) {
                bool enough = there > 0.999 * least;
                least = there;
                memcpy(now, w.trial, (size_t)region->count * sizeof *now);
                damping = fmax(damping / 6, 1e-6);
                is_summed = true;
                step++;
                if (enough)
                    break;
                continue;
            }
        }
        damping *= 8;
        if (damping > 1e4)
            break;
    }
    region->after = least;
    for (int k = 0; k < region->count; k++)
        model->blob[order[k]] = now[k];
    bool gained = least < 0.995 * region->before;
    for (int n = 0; n < region->nodes; n++)
        model->due[region->node[n]] |= gained;
    end_work(&w);
    free(now);
}

// --- Regions ---

typedef struct Place {
    int owner, blob;
    unsigned morton;
} Place;

static int compare_places(const void *a, const void *b)
{
    const Place *p = a, *q = b;
    if (p->owner != q->owner)
        return p->owner < q->owner ? -1 : 1;
    if (p->morton != q->morton)
        return p->morton < q->morton ? -1 : 1;
    return (p->blob > q->blob) - (p->blob < q->blob);
}

// Neighbours in space get near numbers: a sac's many blobs all belong to one node.
static unsigned morton_of(const VesselTree *tree, const FieldBlob *b)
{
    Vec3 x = vec3_scale(vec3_sub(b->birth, tree->center[b->owner]), 1 / tree->radius[b->owner]);
    unsigned code = 0, at[3] = {(unsigned)fmax(0, fmin(15, 6 * (x.x + 1.3))), (unsigned)fmax(0, fmin(15, 6 * (x.y + 1.3))),
                                (unsigned)fmax(0, fmin(15, 6 * (x.z + 1.3)))};
    for (unsigned bit = 4; bit-- > 0;)
        for (int k = 0; k < 3; k++)
            code = code << 1 | (at[k] >> bit & 1);
    return code;
}

static bool order_blobs(Sweep *s)
{
    const FieldModel *model = s->model;
    Place *place = malloc(((size_t)model->count + 1) * sizeof *place);
    if (!place)
        return false;
    for (int b = 0; b < model->count; b++)
        place[b] = (Place){model->blob[b].owner, b, morton_of(model->tree, &model->blob[b])};
    qsort(place, (size_t)model->count, sizeof *place, compare_places);
    for (int b = 0; b < model->count; b++)
        s->order[b] = place[b].blob;
    free(place);
    return true;
}

static int compare_ints(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

static bool collect_nodes(const Sweep *s, Region *region)
{
    const FieldModel *model = s->model;
    int total = 0, kept = 0;
    for (int k = 0; k < region->count; k++)
        total += model->blob[s->order[region->first + k]].node_count;
    region->node = malloc(((size_t)total + 1) * sizeof *region->node);
    if (!region->node)
        return false;
    total = 0;
    for (int k = 0; k < region->count; k++) {
        const FieldBlob *b = &model->blob[s->order[region->first + k]];
        memcpy(region->node + total, b->node, (size_t)b->node_count * sizeof *region->node);
        total += b->node_count;
    }
    qsort(region->node, (size_t)total, sizeof *region->node, compare_ints);
    for (int k = 0; k < total; k++)
        if (kept == 0 || region->node[kept - 1] != region->node[k])
            region->node[kept++] = region->node[k];
    region->nodes = kept;
    return true;
}

static bool is_due(const Sweep *s, const Region *region)
{
    for (int n = 0; n < region->nodes; n++)
        if (s->model->due[region->node[n]])
            return true;
    return false;
}

// Colours: a region takes the first that none before it has on any of its nodes. `last` (N, words) holds each node's colours as bits.
static int colour_regions(const Sweep *s)
{
    enum { WORDS = 4 };
    int colours = 0, n = s->model->tree->node_count;
    uint64_t *used = calloc((size_t)n * WORDS, sizeof *used);
    if (!used)
        return -1;
    for (int i = 0; i < s->regions; i++) {
        Region *region = &s->region[i];
        uint64_t taken[WORDS] = {0};
        int colour = 0;
        if (region->colour < 0)
            continue;
        for (int k = 0; k < region->nodes; k++)
            for (int word = 0; word < WORDS; word++)
                taken[word] |= used[(size_t)region->node[k] * WORDS + (size_t)word];
        while (colour < 64 * WORDS && taken[colour / 64] >> (colour % 64) & 1)
            colour++;
        region->colour = colour;   // 64 * WORDS: alone, after all others
        for (int k = 0; k < region->nodes && colour < 64 * WORDS; k++)
            used[(size_t)region->node[k] * WORDS + (size_t)(colour / 64)] |= (uint64_t)1 << (colour % 64);
        colours = colour + 1 > colours ? colour + 1 : colours;
    }
    free(used);
    return colours;
}

static bool make_regions(Sweep *s, bool shift)
{
    int count = s->model->count;
    for (int first = 0; first < count;) {
        int size = first == 0 && shift ? REGION_BLOBS / 2 : REGION_BLOBS;
        size = size < count - first ? size : count - first;
        Region *region = &s->region[s->regions];
        *region = (Region){.first = first, .count = size};
        if (!collect_nodes(s, region))
            return false;
        for (int k = 0; k < size; k++)
            s->region_of[s->order[first + k]] = s->regions;
        region->colour = is_due(s, region) ? 0 : -1;
        s->regions++;
        first += size;
    }
    return true;
}

double field_model_solve(FieldModel *model, int steps, bool shift)
{
    size_t blobs = (size_t)model->count + 1;
    Sweep s = {.model = model, .steps = steps, .order = malloc(blobs * sizeof *s.order), .region_of = malloc(blobs * sizeof *s.region_of)};
    s.region = calloc(blobs, sizeof *s.region);
    s.batch = malloc(blobs * sizeof *s.batch);
    bool good = s.order && s.region_of && s.region && s.batch && order_blobs(&s) && make_regions(&s, shift);
    int colours = good ? colour_regions(&s) : -1;
    memset(model->due, 0, (size_t)model->tree->node_count * sizeof *model->due);
    good = good && colours >= 0;
    double before = 1e-300, after = 1e-300;
    for (int colour = 0; good && colour < colours; colour++) {
        s.batch_count = 0;
        for (int i = 0; i < s.regions; i++)
            if (s.region[i].colour == colour)
                s.batch[s.batch_count++] = i;
        parallel_for(colour < 256 ? model->threads : 1, s.batch_count, solve_region, &s, NULL);
    }
    for (int i = 0; i < s.regions; i++) {
        good = good && !s.region[i].failed;
        if (s.region[i].colour >= 0)
            before += s.region[i].before, after += s.region[i].after;
        free(s.region[i].node);
    }
    free(s.order);
    free(s.region_of);
    free(s.region);
    free(s.batch);
    return good && field_model_list(model) ? 1 - after / before : -1;
}

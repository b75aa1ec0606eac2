// Levenberg and Marquardt's method on one region's blobs at a time, with the other blobs fixed.
// Rows, in mm: data e = f/|g|, with Geman and McClure's loss; slope e = s r (r |g| / 2 - 1); guards e = w r/2 (f - clamp(f, low, high)). The linearisation
// keeps |g| and the direction of g fixed. A region is about two dozen blobs that are consecutive along the tree; its rows are those of all nodes that see one
// of them, so an accepted step reduces the sum of squares of the whole tree, independently of the other regions. Regions that share a node's rows are solved
// one after the other, in the order of their colours, so the result does not depend on the number of threads.
#include "base/base.h"
#include "recon/fit/field_model.h"
#include "recon/fit/lim_energy.h"

#include <stdlib.h>
#include <string.h>

enum { REGION_BLOBS = 28, UNKNOWNS = 5 };
static const double LEAST_SLOPE = 0.5;
// Priors: a blob's position and size are tied to their initial values, as strongly as by a few points with an error of a hundredth of a radius.
static const double PRIOR_PLACE = 0.02, PRIOR_AMPLITUDE = 0.03, LEAST_BASE = 0.1;

typedef struct TileWork {    // a tile's data in a region's solution
    const RowTile *tile;
    int count, *local;       // blobs of the region that reach the tile: their numbers in the region
    float *still_f, *still_g[3], *f, *g[3];
} TileWork;

typedef struct Region {
    int first, count;        // blobs order[first … first+count-1]
    int nodes, *node;        // nodes that see one of its blobs, ascending
    int colour;
    double before, after;    // sums of squares before and after the step
    bool failed;
} Region;

typedef struct Sweep {
    FieldModel *model;
    int *order;              // (blobs) in order along the tree
    int *region_of, *local_of;   // (blobs)
    int regions;
    Region *region;
    int batch_count, *batch; // regions of one colour
    int steps;
} Sweep;

typedef struct Work {        // memory of one region's solution
    const Sweep *sweep;
    const Region *region;
    int tiles;
    TileWork *tile;
    int *local;              // local numbers of all tiles
    float *memory;
    int unknowns;
    double *matrix, *slope;  // (U, U), (U)
    double *factor, *step;
    FieldBlob *trial;        // (region's blobs)
    FitRows *rows;           // (region's blobs) their rows in a tile
} Work;

// With less damping most first steps would make the sum of squares larger and would be tried again.
static const double FIRST_DAMPING = 0.1;
// A region is left when a step reduces its sum of squares by a smaller share than ENOUGH; it is due in the next sweep if this one reduced it by more than AGAIN.
static const double ENOUGH = 0.01, AGAIN = 0.02;

// --- Setting up ---

static int tiles_of(const Sweep *sweep, const Region *region)
{
    int tiles = 0;
    for (int n = 0; n < region->nodes; n++)
        tiles += sweep->model->rows->first[region->node[n] + 1] - sweep->model->rows->first[region->node[n]];
    return tiles;
}

// Lists the region's blobs that reach the tile in `local`; returns their number.
static int find_blobs(const Sweep *sweep, int region, const RowTile *tile, int *local)
{
    const FieldModel *model = sweep->model;
    int count = 0;
    for (int64_t s = model->offset[tile->node]; s < model->offset[tile->node + 1]; s++) {
        int b = model->seen[s];
        if (sweep->region_of[b] != region)
            continue;
        LaneBlob lane = field_lane_blob(model->tree, tile->node, &model->blob[b]);
        if (field_tile_meets(tile, &lane, (float)FIELD_MARGIN))
            local[count++] = sweep->local_of[b];
    }
    return count;
}

// Computes the sums of the fixed blobs.
static void sum_still(const Sweep *sweep, int region, TileWork *tw)
{
    const FieldModel *model = sweep->model;
    const RowTile *tile = tw->tile;
    int d = tile->data_padded, all = d + tile->guards_padded;
    for (int i = 0; i < all; i++)
        tw->still_f[i] = -1;
    for (int k = 0; k < 3; k++)
        memset(tw->still_g[k], 0, (size_t)d * sizeof(float));
    for (int64_t s = model->offset[tile->node]; s < model->offset[tile->node + 1]; s++) {
        int b = model->seen[s];
        LaneBlob lane = field_lane_blob(model->tree, tile->node, &model->blob[b]);
        if (sweep->region_of[b] != region && field_tile_meets(tile, &lane, 1))
            fit_lanes_sum(tile->x, tile->y, tile->z, all, d, &lane, 1, tw->still_f, tw->still_g);
    }
}

enum { POINTS_MAX = FIELD_TILE + GUARD_TILE };   // of a tile
_Static_assert(POINTS_MAX + FIELD_TILE <= FIT_ROWS, "a tile's data, guards and slopes fit");

static bool begin_work(Work *w, const Sweep *sweep, const Region *region)
{
    *w = (Work){.sweep = sweep, .region = region, .unknowns = UNKNOWNS * region->count};
    int number = (int)(region - sweep->region), most = tiles_of(sweep, region);
    size_t u = (size_t)w->unknowns;
    w->tile = calloc((size_t)most + 1, sizeof *w->tile);
    w->local = malloc(((size_t)most * (size_t)region->count + 1) * sizeof *w->local);
    w->memory = malloc(((size_t)most * (2 * POINTS_MAX + 6 * FIELD_TILE) + 1) * sizeof *w->memory);
    w->matrix = malloc(2 * (u * u + u) * sizeof *w->matrix);
    w->trial = malloc((size_t)region->count * sizeof *w->trial);
    w->rows = malloc((size_t)region->count * sizeof *w->rows);
    if (!w->tile || !w->local || !w->memory || !w->matrix || !w->trial || !w->rows)
        return false;
    w->slope = w->matrix + u * u, w->factor = w->slope + u, w->step = w->factor + u * u;
    float *next = w->memory;
    int *local = w->local;
    for (int n = 0; n < region->nodes; n++)
        for (int t = sweep->model->rows->first[region->node[n]]; t < sweep->model->rows->first[region->node[n] + 1]; t++) {
            TileWork *tw = &w->tile[w->tiles];
            tw->tile = &sweep->model->rows->tile[t];
            tw->local = local;
            tw->count = find_blobs(sweep, number, tw->tile, local);
            if (tw->count == 0)
                continue;
            local += tw->count;
            int d = tw->tile->data_padded, all = d + tw->tile->guards_padded;
            tw->still_f = next, tw->f = next + all, next += 2 * all;
            for (int k = 0; k < 3; k++, next += 2 * d)
                tw->still_g[k] = next, tw->g[k] = next + d;
            sum_still(sweep, number, tw);
            w->tiles++;
        }
    return true;
}

static void end_work(Work *w)
{
    free(w->tile);
    free(w->local);
    free(w->memory);
    free(w->matrix);
    free(w->trial);
    free(w->rows);
}

// --- Rows ---

static void sum_tile(const Work *w, TileWork *tw, const FieldBlob *blob)
{
    const RowTile *tile = tw->tile;
    int d = tile->data_padded, all = d + tile->guards_padded;
    memcpy(tw->f, tw->still_f, (size_t)all * sizeof(float));
    for (int k = 0; k < 3; k++)
        memcpy(tw->g[k], tw->still_g[k], (size_t)d * sizeof(float));
    LaneBlob lane[REGION_BLOBS];
    for (int k = 0; k < tw->count; k++)
        lane[k] = field_lane_blob(w->sweep->model->tree, tile->node, &blob[tw->local[k]]);
    fit_lanes_sum(tile->x, tile->y, tile->z, all, d, lane, tw->count, tw->f, tw->g);
}

// Sum of squares of a tile's rows from the present sums. The loss is at most knee^2, so that points which contradict the others do not outweigh them.
static double energy_of_tile(const FieldModel *model, const TileWork *tw)
{
    const RowTile *tile = tw->tile;
    double r = model->tree->radius[tile->node], loss[FIELD_TILE > GUARD_TILE ? FIELD_TILE : GUARD_TILE], sum = 0;
    FitScale scale = {.radius = r, .knee = model->knee * r, .least_slope = LEAST_SLOPE / r, .bend = model->smooth * r};
    fit_lanes_losses(tw->f, tw->g, tile->weight, tile->data, &scale, loss);
    for (int i = 0; i < tile->data; i++)
        sum += loss[i];
    fit_lanes_guard_losses(tw->f + tile->data_padded, tile->low, tile->high, tile->weight + tile->data_padded, tile->guards, 0.5 * r * model->guard_weight,
                           loss);
    for (int i = 0; i < tile->guards; i++)
        sum += loss[i];
    return sum;
}

static double prior_of(const FieldModel *model, const FieldBlob *b)
{
    double r = model->tree->radius[b->owner], p = PRIOR_PLACE * r, q = PRIOR_AMPLITUDE * r * b->amplitude, size = same_log(b->reach / b->birth_reach);
    return p * p * (vec3_norm2(vec3_sub(b->center, b->birth)) / (b->birth_reach * b->birth_reach) + size * size) + q * q;
}

static double energy(const Work *w, const FieldBlob *blob)
{
    double sum = 0;
    for (int t = 0; t < w->tiles; t++) {
        sum_tile(w, &w->tile[t], blob);
        sum += energy_of_tile(w->sweep->model, &w->tile[t]);
    }
    for (int k = 0; k < w->region->count; k++)
        sum += prior_of(w->sweep->model, &blob[k]);
    return sum;
}

// --- Normal equations ---

// A tile's active rows in a linearisation: data, and violated guards.
typedef struct Weighed {
    int data, rows;          // padded: D, D + guards
    float x[POINTS_MAX], y[POINTS_MAX], z[POINTS_MAX], scale[POINTS_MAX], bend[FIELD_TILE], n[3][FIELD_TILE];
} Weighed;

// Computes the sums; writes the residuals to `residual` in the order of the columns: data, guards, slopes.
static void weigh_rows(const FieldModel *model, const TileWork *tw, Weighed *to, float *residual)
{
    const RowTile *tile = tw->tile;
    int d = tile->data_padded, rows = d;
    float r = (float)model->tree->radius[tile->node], guard = 0.5f * r * (float)model->guard_weight;
    memcpy(to->x, tile->x, (size_t)d * sizeof(float)), memcpy(to->y, tile->y, (size_t)d * sizeof(float)), memcpy(to->z, tile->z, (size_t)d * sizeof(float));
    for (int i = 0; i < tile->guards; i++) {
        float f = tw->f[d + i], e = f < tile->low[i] ? f - tile->low[i] : f > tile->high[i] ? f - tile->high[i] : 0;
        if (e == 0)
            continue;
        to->x[rows] = tile->x[d + i], to->y[rows] = tile->y[d + i], to->z[rows] = tile->z[d + i];
        float scale = guard * sqrtf(tile->weight[d + i]);
        to->scale[rows] = scale;
        residual[rows++] = scale * e;
    }
    for (; rows % FIELD_LANES != 0; rows++)
        to->x[rows] = to->y[rows] = to->z[rows] = to->scale[rows] = residual[rows] = 0;
    to->data = d, to->rows = rows;
    FitScale scale = {.radius = (double)r,
                      .knee = (double)((float)model->knee * r),
                      .least_slope = (double)((float)LEAST_SLOPE / r),
                      .bend = (double)((float)model->smooth * r)};
    float *const normal[3] = {to->n[0], to->n[1], to->n[2]};
    fit_lanes_weigh(tw->f, tw->g, tile->weight, d, &scale, to->scale, to->bend, residual, residual + rows, normal);
}

// Adds the block of a pair of blobs to the upper triangle of the matrix.
static void add_pair(Work *w, int a, int b, float block[UNKNOWNS][FIT_ENTRIES])
{
    bool turned = a > b;     // transposed, because the numbers of a tile's blobs need not be sorted
    double *to = w->matrix + (size_t)(UNKNOWNS * (turned ? b : a)) * (size_t)w->unknowns + (size_t)(UNKNOWNS * (turned ? a : b));
    for (int i = 0; i < UNKNOWNS; i++)
        for (int k = a == b ? i : 0; k < UNKNOWNS; k++)
            to[(size_t)i * (size_t)w->unknowns + (size_t)k] += (double)(turned ? block[k][i] : block[i][k]);
}

static void add_tile(Work *w, const TileWork *tw)
{
    const FieldModel *model = w->sweep->model;
    Weighed rows;
    float residual[FIT_ROWS], column[UNKNOWNS][FIT_ROWS], block[UNKNOWNS][FIT_ENTRIES];
    weigh_rows(model, tw, &rows, residual);
    int length = rows.rows + rows.data;
    const float *normal[3] = {rows.n[0], rows.n[1], rows.n[2]};
    for (int k = 0; k < tw->count; k++) {
        LaneBlob lane = field_lane_blob(model->tree, tw->tile->node, &w->trial[tw->local[k]]);
        fit_lanes_columns(rows.x, rows.y, rows.z, rows.rows, rows.data, &lane, rows.scale, rows.bend, normal, column[0], FIT_ROWS);
        fit_lanes_transpose(column[0], FIT_ROWS, residual, length, &w->rows[k]);
    }
    for (int a = 0; a < tw->count; a++)
        for (int b = a; b < tw->count; b++) {
            fit_lanes_product(&w->rows[a], &w->rows[b], length, block);
            add_pair(w, tw->local[a], tw->local[b], block);
            for (int k = 0; k < UNKNOWNS && a == b; k++)
                w->slope[UNKNOWNS * tw->local[a] + k] += (double)block[k][UNKNOWNS];
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
        double slope[UNKNOWNS] = {q * q * b->amplitude, p * p * share * off.x, p * p * share * off.y, p * p * share * off.z, p * p * same_log(share)};
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
    for (int t = 0; t < w->tiles; t++)
        add_tile(w, &w->tile[t]);
    add_priors(w);
}

// --- Steps ---

static double bound(double value, double most) { return fmax(-most, fmin(most, value)); }

// Returns the blob after a step. `start`: the blob at the start of the sweep, whose rows are known up to FIELD_MARGIN times its reach; a larger blob would be
// judged without the rows that it worsens.
static FieldBlob moved_by(const FieldBlob *b, const double *step, const FieldBlob *start)
{
    FieldBlob to = *b;
    to.amplitude += bound(step[0], 0.5 + 0.5 * fabs(b->amplitude));
    to.amplitude = b->is_base ? fmax(to.amplitude, LEAST_BASE) : to.amplitude;
    Vec3 shift = vec3_scale(vec3(step[1], step[2], step[3]), b->reach);
    double length = vec3_norm(shift), most = 0.15 * b->reach;
    to.center = vec3_add_scaled(b->center, length > most ? most / length : 1, shift);
    Vec3 off = vec3_sub(to.center, b->birth);
    double away = vec3_norm(off), furthest = (b->is_base ? 0.25 : 0.6) * b->birth_reach;
    if (away > furthest)
        to.center = vec3_add_scaled(b->birth, furthest / away, off);
    double reach = b->reach * same_exp(bound(step[4], 0.2));
    double least = (b->is_base ? 0.75 : 0.5) * b->birth_reach, largest = fmin((b->is_base ? 1.5 : 2) * b->birth_reach, 1.12 * b->reach);
    to.reach = fmax(least, fmin(reach, largest));
    Vec3 gone = vec3_sub(to.center, start->center);
    double beyond = vec3_norm(gone) + fmax(0, to.reach - start->reach), margin = (FIELD_MARGIN - 1) * start->reach;
    if (beyond > margin) {
        to.center = vec3_add_scaled(start->center, margin / beyond, gone);
        to.reach = to.reach > start->reach ? start->reach + margin / beyond * (to.reach - start->reach) : to.reach;
    }
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
        if (w->sweep->model->amplitudes_only && k % UNKNOWNS != 0) {
            w->factor[k * u + k] += 1e12;
            w->step[k] = 0;
        }
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
    double least = region->before = energy(&w, now), damping = FIRST_DAMPING;
    bool is_summed = true;   // the sums are those of `now`
    for (int step = 0, tries = 0; step < sweep->steps && tries < 3 * sweep->steps; tries++) {
        if (is_summed) {
            memcpy(w.trial, now, (size_t)region->count * sizeof *now);
            linearise(&w);
            is_summed = false;
        }
        if (solve_step(&w, damping)) {
            for (int k = 0; k < region->count; k++)
                w.trial[k] = moved_by(&now[k], w.step + UNKNOWNS * k, &model->blob[order[k]]);
            double there = energy(&w, w.trial);
            if (there < least) {
                bool enough = there > (1 - ENOUGH) * least;
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
    bool gained = least < (1 - AGAIN) * region->before;
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

// Morton number of a blob: spatial neighbours get similar numbers, because an aneurysm's many blobs all belong to one node.
static unsigned morton_of(const VesselTree *tree, const FieldBlob *b)
{
    Vec3 x = vec3_scale(vec3_sub(b->birth, tree->center[b->owner]), 1 / tree->radius[b->owner]);
    unsigned code = 0,
             at[3] = {(unsigned)fmax(0, fmin(15, 6 * (x.x + 1.3))), (unsigned)fmax(0, fmin(15, 6 * (x.y + 1.3))), (unsigned)fmax(0, fmin(15, 6 * (x.z + 1.3)))};
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

// Graph colouring: a region takes the first colour that is not used on any of its nodes. `used` (N, WORDS) holds each node's colours as bits. Returns the
// number of colours.
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
        region->colour = colour;   // 64 * WORDS: processed alone, after all others
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
            s->region_of[s->order[first + k]] = s->regions, s->local_of[s->order[first + k]] = k;
        region->colour = is_due(s, region) ? 0 : -1;
        s->regions++;
        first += size;
    }
    return true;
}

double field_model_solve(FieldModel *model, int steps, bool shift)
{
    size_t blobs = (size_t)model->count + 1;
    Sweep s = {.model = model,
               .steps = steps,
               .order = malloc(blobs * sizeof *s.order),
               .region_of = malloc(blobs * sizeof *s.region_of),
               .local_of = malloc(blobs * sizeof *s.local_of)};
    s.region = calloc(blobs, sizeof *s.region);
    s.batch = malloc(blobs * sizeof *s.batch);
    bool good = s.order && s.region_of && s.local_of && s.region && s.batch && order_blobs(&s) && make_regions(&s, shift);
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
    free(s.local_of);
    free(s.region);
    free(s.batch);
    return good && field_model_list(model) ? 1 - after / before : -1;
}

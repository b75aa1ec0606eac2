// Each data point p is a candidate. The residuals of the data nearby, weighted by the profile of a blob of reach R at p, w = (1 - d^2/R^2)^3, have the mean m
// = sum w e / sum w and, for noise of standard deviation s, the standard deviation s sqrt(sum w^2) / sum w. s is measured at each node, as the spread of the
// residuals about their mean over a third of the radius: over a larger region, misfit at a bifurcation would count as noise and no blob would be added.
// Residuals are weighted as in the fit: those above the loss's knee count less and less. Candidates above tolerance and noise are accepted by size, none
// within 0.8 R of one accepted before.
#include "recon/fit/field_refine.h"

#include "base/base.h"

#include <stdlib.h>

// Depth of a new blob's centre inside the wall, and least distance between two blobs of a level, as fractions of its reach.
static const double INSIDE = 0.25, APART = 0.8;
// With fewer points per blob than this, more blobs would only fit the noise.
static const double POINTS_A_BLOB = 3;
// Radius of the region over which the noise is measured, in local radii; doubled where points are few.
static const double NOISE_REACH = 0.35;

typedef struct Candidate {
    double score;            // mean residual, in units of the tolerance
    int node;
    Vec3 at;
    double mean;             // [mm] mean residual
} Candidate;

typedef struct Job {
    FieldModel *model;
    const FieldRefine *how;
    float (*residual)[FIELD_TILE];   // (tiles) residuals of the data
    Candidate **found;       // (N)
    int *count;              // (N)
    bool *failed;            // (N)
} Job;

static const RowTile *tile_of(const Job *job, int t) { return &job->model->rows->tile[t]; }

static void measure_residuals(void *context, long index)
{
    Job *job = context;
    const int *first = job->model->rows->first;
    float knee = (float)(job->model->knee * job->model->tree->radius[index]);
    for (int t = first[index]; t < first[index + 1]; t++) {
        float *residual = job->residual[t];
        field_model_residuals(job->model, tile_of(job, t), residual);
        for (int i = 0; i < tile_of(job, t)->data; i++) {
            float share = residual[i] / knee, held = 1 / (1 + share * share);
            residual[i] *= held * held;
        }
    }
}

// Counts the blobs whose centres lie within `reach` of x.
static int blobs_about(const FieldModel *model, int node, Vec3 x, double reach)
{
    int count = 0;
    for (int64_t s = model->offset[node]; s < model->offset[node + 1]; s++)
        count += vec3_norm2(vec3_sub(model->blob[model->seen[s]].center, x)) < reach * reach;
    return count;
}

typedef struct Mean {
    double weight, weight2, sum, sum2;
} Mean;

// Adds the sums over the data of node `from` within `reach` of x.
static void add_mean(const Job *job, int from, Vec3 x, double reach, float sum[4][FIELD_LANES])
{
    const int *first = job->model->rows->first;
    Vec3 local = vec3_sub(x, job->model->tree->center[from]);
    LaneBlob ball = {(float)local.x, (float)local.y, (float)local.z, (float)reach, 0};
    for (int t = first[from]; t < first[from + 1]; t++) {
        const RowTile *tile = tile_of(job, t);
        if (tile->data > 0 && field_tile_meets(tile, &ball, 1))
            fit_lanes_mean(tile->x, tile->y, tile->z, tile->weight, job->residual[t], tile->data_padded, &ball, sum);
    }
}

static Mean mean_about(const Job *job, int node, Vec3 x, double reach)
{
    const VesselTree *tree = job->model->tree;
    float lane[4][FIELD_LANES] = {{0}};
    double sum[4] = {0};
    add_mean(job, node, x, reach, lane);
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++)
        add_mean(job, tree->near[k], x, reach, lane);
    for (int k = 0; k < 4; k++)
        for (int l = 0; l < FIELD_LANES; l++)
            sum[k] += (double)lane[k][l];
    return (Mean){sum[0], sum[1], sum[2], sum[3]};
}

static Vec3 row_place(const Job *job, const RowTile *tile, int i)
{
    return vec3_add(job->model->tree->center[tile->node], vec3((double)tile->x[i], (double)tile->y[i], (double)tile->z[i]));
}

static int data_of(const Job *job, int node)
{
    int data = 0;
    for (int t = job->model->rows->first[node]; t < job->model->rows->first[node + 1]; t++)
        data += tile_of(job, t)->data;
    return data;
}

// Effective number of points of the weighted mean.
static double points_of(const Mean *m) { return m->weight * m->weight / fmax(m->weight2, 1e-12); }

// Standard deviation of the noise of a node's residuals [mm].
static double noise_of(const Job *job, int node)
{
    enum { SAMPLES = 24 };
    const int *first = job->model->rows->first;
    int step = data_of(job, node) / SAMPLES + 1, taken = 0, next = 0;
    double spread[SAMPLES], r = job->model->tree->radius[node];
    for (int t = first[node]; t < first[node + 1]; t++) {
        const RowTile *tile = tile_of(job, t);
        for (; next < tile->data && taken < SAMPLES; next += step) {
            Vec3 x = row_place(job, tile, next);
            double each = (double)tile->weight[next];
            Mean m = mean_about(job, node, x, NOISE_REACH * r);
            if (points_of(&m) < 4 * each)
                m = mean_about(job, node, x, 2 * NOISE_REACH * r);
            double points = points_of(&m) / each, mean = m.sum / fmax(m.weight, 1e-12);
            if (points >= 3)
                spread[taken++] = sqrt(fmax(0, m.sum2 / m.weight - mean * mean) * points / (points - 1));
        }
        next -= tile->data;
        next = next > 0 ? next : 0;
    }
    sort_doubles(spread, (size_t)taken);
    return taken > 0 ? spread[taken / 2] : 0;
}

static int compare_candidates(const void *a, const void *b)
{
    const Candidate *p = a, *q = b;
    if (p->score != q->score)
        return p->score > q->score ? -1 : 1;
    if (p->node != q->node)
        return p->node < q->node ? -1 : 1;
    return (p->at.x > q->at.x) - (p->at.x < q->at.x);
}

static void find_candidates(void *context, long index)
{
    Job *job = context;
    int node = (int)index, found = 0;
    double r = job->model->tree->radius[node], reach = job->how->reach * r, noise = -1;   // measured when it is first needed: few nodes have candidates
    double tolerance = fmax(job->how->tolerance_mm, job->how->tolerance * r);
    const int *first = job->model->rows->first;
    Candidate *list = malloc(((size_t)data_of(job, node) + 1) * sizeof *list);
    job->failed[node] = !list;
    job->found[node] = list;
    for (int t = first[node]; t < first[node + 1] && list && reach >= job->how->least_reach; t++) {
        const RowTile *tile = tile_of(job, t);
        for (int i = 0; i < tile->data; i++) {
            Vec3 x = row_place(job, tile, i);
            Mean m = mean_about(job, node, x, reach);
            double mean = m.sum / m.weight, points = points_of(&m);
            if (!(points >= 4 && fabs(mean) > tolerance && points >= POINTS_A_BLOB * (1 + blobs_about(job->model, node, x, reach))))
                continue;
            noise = noise < 0 ? noise_of(job, node) : noise;
            double least = fmax(tolerance, job->how->significance * noise * sqrt(m.weight2) / m.weight);
            if (fabs(mean) > least)
                list[found++] = (Candidate){fabs(mean) / least, node, x, mean};
        }
    }
    // sorting first: candidates too near to a larger one of the same node are excluded anyway
    if (found > 1)
        qsort(list, (size_t)found, sizeof *list, compare_candidates);
    int kept = 0;
    for (int i = 0; i < found; i++) {
        bool is_free = true;
        for (int k = 0; k < kept && is_free; k++)
            is_free = vec3_distance(list[k].at, list[i].at) > APART * reach;
        if (is_free)
            list[kept++] = list[i];
    }
    job->count[node] = kept;
}

// Adds the candidate's blob, with the amplitude that cancels its mean residual for a slope of 2/r.
static bool put_blob(Job *job, const Candidate *c)
{
    FieldModel *model = job->model;
    double r = model->tree->radius[c->node], reach = job->how->reach * r;
    Vec3 in = vec3_unit_or(vec3_sub(model->tree->center[c->node], c->at), vec3(0, 0, 0));
    double amplitude = -c->mean * 2 / r;
    return field_model_add(model, c->node, vec3_add_scaled(c->at, INSIDE * reach, in), reach, fmax(-1, fmin(1, amplitude)));
}

static int take_candidates(Job *job)
{
    FieldModel *model = job->model;
    const VesselTree *tree = model->tree;
    int n = tree->node_count, added = 0, total = 0;
    for (int i = 0; i < n; i++)
        total += job->count[i];
    Candidate *all = malloc(((size_t)total + 1) * sizeof *all);
    int *first = malloc(((size_t)n + 1) * sizeof *first), *next = malloc(((size_t)total + 1) * sizeof *next);   // accepted candidates by node, a linked list
    bool good = all && first && next;
    total = 0;
    for (int i = 0; i < n && good; i++) {
        first[i] = -1;
        for (int k = 0; k < job->count[i]; k++)
            all[total++] = job->found[i][k];
    }
    if (good && total > 1)
        qsort(all, (size_t)total, sizeof *all, compare_candidates);
    for (int c = 0; c < total && good; c++) {
        int node = all[c].node;
        double reach = job->how->reach * tree->radius[node];
        bool is_free = true;
        for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1] && is_free; k++) {
            int other = k < tree->near_offset[node] ? node : tree->near[k];
            double apart = APART * fmin(reach, job->how->reach * tree->radius[other]);
            for (int t = first[other]; t >= 0 && is_free; t = next[t])
                is_free = vec3_norm2(vec3_sub(all[t].at, all[c].at)) > apart * apart;
        }
        if (!is_free)
            continue;
        next[c] = first[node];
        first[node] = c;
        good = put_blob(job, &all[c]);
        added++;
    }
    free(all);
    free(first);
    free(next);
    return good ? added : -1;
}

int field_refine(FieldModel *model, const FieldRefine *how)
{
    size_t n = (size_t)model->tree->node_count, tiles = (size_t)model->rows->first[n] + 1;
    Job job = {.model = model,
               .how = how,
               .residual = calloc(tiles, sizeof *job.residual),
               .found = calloc(n, sizeof *job.found),
               .count = calloc(n, sizeof *job.count),
               .failed = calloc(n, sizeof *job.failed)};
    bool good = job.residual && job.found && job.count && job.failed;
    void (*const stage[])(void *, long) = {measure_residuals, find_candidates};
    for (int k = 0; k < 2 && good; k++) {
        parallel_for(model->threads, (long)n, stage[k], &job, NULL);
        for (size_t i = 0; i < n; i++)
            good = good && !job.failed[i];
    }
    int before = model->count, added = good ? take_candidates(&job) : -1;
    for (size_t i = 0; i < n && job.found; i++)
        free(job.found[i]);
    free(job.residual);
    free(job.found);
    free(job.count);
    free(job.failed);
    if (added < 0 || !field_model_list(model))
        return -1;
    for (int b = before; b < model->count; b++)
        for (int k = 0; k < model->blob[b].node_count; k++)
            model->due[model->blob[b].node[k]] = true;
    return added;
}

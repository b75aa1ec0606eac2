#include "recon/field_model.h"

#include "geom/blob_flood.h"
#include "recon/parallel.h"

#include <stdlib.h>
#include <string.h>

// Nodes are found for a reach so much larger, so that they still hold while a blob grows in a sweep.
static const double LIST_REACH = 1.15;

bool field_model_create(FieldModel *model, const VesselTree *tree, const FieldRows *rows, int threads)
{
    size_t n = (size_t)tree->node_count;
    *model = (FieldModel){.tree = tree, .rows = rows, .threads = threads, .guard_weight = 1, .smooth = 0.1};
    model->offset = calloc(n + 1, sizeof *model->offset);
    model->due = calloc(n, sizeof *model->due);
    if (model->offset && model->due)
        return true;
    field_model_free(model);
    return false;
}

void field_model_free(FieldModel *model)
{
    for (int i = 0; i < model->count; i++)
        free(model->blob[i].node);
    free(model->blob);
    free(model->offset);
    free(model->seen);
    free(model->due);
    *model = (FieldModel){0};
}

bool field_model_add(FieldModel *model, int owner, Vec3 center, double reach, double amplitude)
{
    if (model->count == model->capacity) {
        int capacity = 2 * model->capacity + 256;
        FieldBlob *more = realloc(model->blob, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        model->blob = more;
        model->capacity = capacity;
    }
    model->blob[model->count++] = (FieldBlob){.center = center, .reach = reach, .amplitude = amplitude, .owner = owner, .birth = center, .birth_reach = reach,
                                              .moved = true};
    return true;
}

typedef struct FloodJob {
    FieldModel *model;
    int chunks;
    bool *failed;            // (chunks)
} FloodJob;

static void flood_chunk(void *context, long index)
{
    FloodJob *job = context;
    FieldModel *model = job->model;
    BlobFlood flood;
    if (!blob_flood_create(&flood, model->tree->node_count)) {
        job->failed[index] = true;
        return;
    }
    int64_t first = (int64_t)model->count * index / job->chunks, end = (int64_t)model->count * (index + 1) / job->chunks;
    for (int64_t b = first; b < end; b++) {
        FieldBlob *blob = &model->blob[b];
        if (!blob->moved)
            continue;
        int count = blob_flood_nodes(&flood, model->tree, blob->owner, blob->center, LIST_REACH * blob->reach);
        int *node = realloc(blob->node, (size_t)count * sizeof *node);
        if (!node) {
            job->failed[index] = true;
            break;
        }
        memcpy(node, flood.node, (size_t)count * sizeof *node);
        blob->node = node;
        blob->node_count = count;
    }
    blob_flood_free(&flood);
}

bool field_model_list(FieldModel *model)
{
    enum { CHUNKS = 64 };
    bool failed[CHUNKS] = {false}, good = true;
    FloodJob job = {model, CHUNKS, failed};
    parallel_for(model->threads, CHUNKS, flood_chunk, &job, NULL);
    for (int i = 0; i < CHUNKS; i++)
        good = good && !failed[i];
    int n = model->tree->node_count;
    int64_t total = 0;
    for (int b = 0; b < model->count && good; b++)
        total += model->blob[b].node_count;
    int *seen = good ? realloc(model->seen, ((size_t)total + 1) * sizeof *seen) : NULL;
    if (!seen)
        return false;
    model->seen = seen;
    memset(model->offset, 0, ((size_t)n + 1) * sizeof *model->offset);
    for (int b = 0; b < model->count; b++)
        for (int k = 0; k < model->blob[b].node_count; k++)
            model->offset[model->blob[b].node[k] + 1]++;
    int64_t sum = 0;
    for (int i = 0; i < n; i++) {
        int64_t own = model->offset[i + 1];
        model->offset[i + 1] = sum;
        sum += own;
    }
    for (int b = 0; b < model->count; b++) {
        FieldBlob *blob = &model->blob[b];
        for (int k = 0; k < blob->node_count; k++)
            seen[model->offset[blob->node[k] + 1]++] = b;
        blob->moved = false;
    }
    return true;
}

void field_model_keep(FieldModel *model, const bool *keep)
{
    int kept = 0;
    for (int b = 0; b < model->count; b++) {
        if (keep[b])
            model->blob[kept++] = model->blob[b];
        else
            free(model->blob[b].node);
    }
    model->count = kept;
}

static LaneBlob lane_blob(const FieldModel *model, int node, int b)
{
    const FieldBlob *blob = &model->blob[b];
    Vec3 c = vec3_sub(blob->center, model->tree->center[node]);
    return (LaneBlob){(float)c.x, (float)c.y, (float)c.z, (float)blob->reach, (float)blob->amplitude};
}

void field_model_sum(const FieldModel *model, int node, float *f, float *const g[3])
{
    const NodeRows *rows = &model->rows->node[node];
    int all = rows->data_padded + rows->guards_padded;
    for (int i = 0; i < all; i++)
        f[i] = -1;
    for (int k = 0; k < 3; k++)
        memset(g[k], 0, (size_t)rows->data_padded * sizeof *g[k]);
    for (int64_t s = model->offset[node]; s < model->offset[node + 1]; s++) {
        LaneBlob blob = lane_blob(model, node, model->seen[s]);
        field_lanes_sum(rows->x, rows->y, rows->z, all, rows->data_padded, &blob, 1, f, g);
    }
}

void field_model_residuals(const FieldModel *model, int node, float *distance)
{
    const NodeRows *rows = &model->rows->node[node];
    int d = rows->data_padded, all = d + rows->guards_padded;
    float least = 0.5f / (float)model->tree->radius[node];
    float *f = malloc(((size_t)all + 3 * (size_t)d + 1) * sizeof *f), *const g[3] = {f + all, f + all + d, f + all + 2 * d};
    if (!f) {
        memset(distance, 0, (size_t)d * sizeof *distance);
        return;
    }
    field_model_sum(model, node, f, g);
    for (int i = 0; i < rows->data; i++)
        distance[i] = f[i] / fmaxf(sqrtf(g[0][i] * g[0][i] + g[1][i] * g[1][i] + g[2][i] * g[2][i]), least);
    free(f);
}

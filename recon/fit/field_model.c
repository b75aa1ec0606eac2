#include "recon/fit/field_model.h"

#include "base/base.h"
#include "geom/geom.h"

#include <stdlib.h>
#include <string.h>

bool field_model_create(FieldModel *model, const VesselTree *tree, const FieldRows *rows, int threads)
{
    size_t n = (size_t)tree->node_count;
    *model = (FieldModel){.tree = tree, .rows = rows, .threads = threads, .guard_weight = 2, .smooth = 0.1};
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
    model->blob[model->count++] =
        (FieldBlob){.center = center, .reach = reach, .amplitude = amplitude, .owner = owner, .birth = center, .birth_reach = reach, .moved = true};
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
        int count = blob_flood_nodes(&flood, model->tree, blob->owner, blob->center, FIELD_MARGIN * blob->reach);
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

LaneBlob field_lane_blob(const VesselTree *tree, int node, const FieldBlob *blob)
{
    Vec3 c = vec3_sub(blob->center, tree->center[node]);
    return (LaneBlob){(float)c.x, (float)c.y, (float)c.z, (float)blob->reach, (float)blob->amplitude};
}

bool field_tile_meets(const RowTile *tile, const LaneBlob *blob, float share)
{
    float dx = blob->x - tile->middle[0], dy = blob->y - tile->middle[1], dz = blob->z - tile->middle[2], far = share * blob->reach + tile->radius;
    return dx * dx + dy * dy + dz * dz < far * far;
}

void field_model_residuals(const FieldModel *model, const RowTile *tile, float *distance)
{
    int d = tile->data_padded;
    float least = 0.5f / (float)model->tree->radius[tile->node], sum[4][FIELD_TILE], *const g[3] = {sum[1], sum[2], sum[3]};
    for (int i = 0; i < d; i++)
        sum[0][i] = -1, sum[1][i] = sum[2][i] = sum[3][i] = 0;
    for (int64_t s = model->offset[tile->node]; s < model->offset[tile->node + 1]; s++) {
        LaneBlob blob = field_lane_blob(model->tree, tile->node, &model->blob[model->seen[s]]);
        if (field_tile_meets(tile, &blob, 1))
            fit_lanes_sum(tile->x, tile->y, tile->z, d, d, &blob, 1, sum[0], g);
    }
    for (int i = 0; i < tile->data; i++)
        distance[i] = sum[0][i] / fmaxf(sqrtf(g[0][i] * g[0][i] + g[1][i] * g[1][i] + g[2][i] * g[2][i]), least);
}

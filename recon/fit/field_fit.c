#include "recon/fit/field_fit.h"

#include "base/base.h"
#include "geom/geom.h"
#include "recon/fit/field_refine.h"

#include <stdlib.h>
#include <string.h>

static const double BASE_APART = 0.75, BASE_REACH = 2;   // distance and reach of the base blobs, in local radii: a line of them, or a single one, has slope 2/r
// Target for mean distances, as a fraction of target_mm, which is for single points.
static const double TARGET_SHARE = 0.2;
static const double level_reach[] = {1.4, 1.4, 1, 1, 0.7, 0.7, 0.5, 0.35};
// The loss gets sharper from level to level: with a sharp loss from the start, a wall far from the base would remain an outlier.
static const double base_knee = 1, level_knee[] = {0.35, 0.35, 0.35, 0.25, 0.25, 0.25, 0.25, 0.25};
// A new reach needs two sweeps, because a region's first step changes what its neighbours need; later blobs of the same reach, and the finest, are few.
static const int level_sweeps[] = {2, 1, 2, 1, 2, 1, 1, 1};
enum { LEVELS = sizeof level_reach / sizeof level_reach[0], BASE_SWEEPS = 3, LAST_SWEEPS = 2, BASE_STEPS = 3, STEPS = 4 };

FieldFitOptions field_fit_default_options(void)
{
    return (FieldFitOptions){
        .tolerance_voxels = 0.05, .least_reach_voxels = 0.8, .tolerance = 0.004, .tolerance_unknown = 0.02, .significance = 6.5, .levels = LEVELS};
}

static bool check_options(const FieldFitOptions *o, Faults *faults)
{
    int before = faults->count;
    const struct {
        const char *name;
        double value, least, most;
    } range[] = {{"tolerance", o->tolerance, 1e-4, 1},
                 {"tolerance without voxel", o->tolerance_unknown, 1e-4, 1},
                 {"tolerance in voxels", o->tolerance_voxels, 0, 10},
                 {"voxel-mm", o->voxel_mm, 0, 100},
                 {"least reach in voxels", o->least_reach_voxels, 0, 10},
                 {"target-mm", o->target_mm, 0, 100},
                 {"significance", o->significance, 0, 100},
                 {"levels", o->levels, 0, LEVELS}};
    for (size_t i = 0; i < sizeof range / sizeof range[0]; i++)
        if (!(range[i].value >= range[i].least && range[i].value <= range[i].most))
            faults_add(faults, "fit", 0, 0, "%s is %g; expected %g to %g", range[i].name, range[i].value, range[i].least, range[i].most);
    return faults->count == before;
}

// --- The base ---

// Returns true if a base blob of a nearby node is so close to x that no other one is needed.
static bool is_crowded(const FieldModel *model, const int *first, const int *next, int node, Vec3 x)
{
    const VesselTree *tree = model->tree;
    for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1]; k++) {
        int other = k < tree->near_offset[node] ? node : tree->near[k];
        double apart = BASE_APART * fmin(tree->radius[node], tree->radius[other]);
        for (int b = first[other]; b >= 0; b = next[b])
            if (vec3_distance(model->blob[b].center, x) < 0.999 * apart)
                return true;
    }
    return false;
}

static bool put_base(FieldModel *model, int *first, int **next, int *capacity, int node, Vec3 x)
{
    const VesselTree *tree = model->tree;
    if (is_crowded(model, first, *next, node, x))
        return true;
    double reach = BASE_REACH * tree->radius[node];
    if (model->count == *capacity) {
        int *more = realloc(*next, (size_t)(2 * *capacity + 256) * sizeof *more);
        if (!more)
            return false;
        *next = more;
        *capacity = 2 * *capacity + 256;
    }
    (*next)[model->count] = first[node];
    first[node] = model->count;
    return field_model_add(model, node, x, reach, tree->kind[node] == NODE_ANEURYSM ? 2.4 : 1.1);
}

static bool lay_base(FieldModel *model)
{
    const VesselTree *tree = model->tree;
    int *first = malloc((size_t)tree->node_count * sizeof *first), *next = NULL, capacity = 0;
    bool good = first != NULL;
    for (int i = 0; i < tree->node_count && good; i++)
        first[i] = -1;
    for (int i = 0; i < tree->node_count && good; i++) {
        if (field_link_is_lumen(tree, i)) {   // place blobs from the parent to here, so that long links are filled
            Vec3 a = tree->center[tree->parent[i]], b = tree->center[i];
            int steps = (int)(vec3_distance(a, b) / (BASE_APART * tree->radius[i]));
            for (int k = 1; k <= steps && good; k++)
                good = put_base(model, first, &next, &capacity, i, vec3_mix(a, b, k * BASE_APART * tree->radius[i] / vec3_distance(a, b)));
        }
        good = good && put_base(model, first, &next, &capacity, i, tree->center[i]);
    }
    double r = tree->radius[0];
    for (int k = 1; good && vessel_tree_root_is_open(tree) && k * BASE_APART < FIELD_INLET_RADII + 0.5; k++)
        good = field_model_add(model, 0, vec3_add_scaled(tree->center[0], -k * BASE_APART * r, tree->direction[0]), BASE_REACH * r, 1.1);
    free(first);
    free(next);
    for (int b = 0; b < model->count; b++)
        model->blob[b].is_base = true;
    return good && field_model_list(model);
}

// --- The sequence of levels ---

typedef struct Schedule {
    FieldModel *model;
    const Progress *progress;
    int done, total;
    bool failed;             // or stopped
} Schedule;

static void sweep(Schedule *s, int steps)
{
    double gain = s->failed ? 0 : field_model_solve(s->model, steps, s->done % 2 == 1);
    s->failed |= gain < 0 || progress_is_stopped(s->progress);
    s->done++;
    if (s->progress && s->progress->call)
        s->progress->call(s->progress->context, s->done, s->total);
}

static void all_due(FieldModel *model)
{
    for (int i = 0; i < model->tree->node_count; i++)
        model->due[i] = true;
}

// Fits to the model's rows, at last to `all`.
static bool fit(FieldModel *model, const FieldRows *all, const FieldFitOptions *options, const Progress *progress)
{
    Schedule s = {model, progress, 0, BASE_SWEEPS + LAST_SWEEPS, false};
    for (int level = 0; level < options->levels; level++)
        s.total += level_sweeps[level];
    if (!lay_base(model))
        return false;
    all_due(model);
    model->knee = base_knee;
    // fit the amplitudes alone first: centres that start far from the solution end in bad minima that no finer blob corrects
    for (int k = 0; k < BASE_SWEEPS; k++) {
        model->amplitudes_only = k < 2;
        sweep(&s, BASE_STEPS);
    }
    for (int level = 0; level < options->levels && !s.failed; level++) {
        bool known = options->voxel_mm > 0, given = options->target_mm > 0;
        FieldRefine how = {level_reach[level],
                           given   ? 0
                           : known ? options->tolerance
                                   : options->tolerance_unknown,
                           given ? TARGET_SHARE * options->target_mm : options->tolerance_voxels * options->voxel_mm,
                           options->least_reach_voxels * options->voxel_mm, options->significance};
        model->knee = level_knee[level];
        s.failed |= field_refine(model, &how) < 0;
        for (int k = 0; k < level_sweeps[level]; k++)
            sweep(&s, STEPS);
    }
    model->rows = all;
    all_due(model);
    for (int k = 0; k < LAST_SWEEPS; k++)
        sweep(&s, STEPS);
    return !s.failed;
}

// --- The result ---

static VesselTree *make_tree(const FieldModel *model, Faults *faults)
{
    const VesselTree *from = model->tree;
    VesselTree *tree = vessel_tree_create_shared(from->node_count, from->point_count, model->count);
    size_t n = (size_t)from->node_count;
    if (!tree) {
        faults_add(faults, "fit", 0, 0, "not enough memory");
        return NULL;
    }
    memcpy(tree->center, from->center, n * sizeof *tree->center);
    memcpy(tree->radius, from->radius, n * sizeof *tree->radius);
    memcpy(tree->direction, from->direction, n * sizeof *tree->direction);
    memcpy(tree->height, from->height, n * sizeof *tree->height);
    memcpy(tree->parent, from->parent, n * sizeof *tree->parent);
    memcpy(tree->kind, from->kind, n * sizeof *tree->kind);
    memcpy(tree->point, from->point, (size_t)from->point_count * sizeof *tree->point);
    memcpy(tree->point_offset, from->point_offset, (n + 1) * sizeof *tree->point_offset);
    for (int b = 0; b < model->count; b++)
        tree->blob_offset[model->blob[b].owner + 1]++;
    int64_t sum = 0;
    for (int i = 0; i < from->node_count; i++) {
        int64_t own = tree->blob_offset[i + 1];
        tree->blob_offset[i + 1] = sum;
        sum += own;
    }
    for (int b = 0; b < model->count; b++) {
        int64_t at = tree->blob_offset[model->blob[b].owner + 1]++;
        tree->blob_center[at] = model->blob[b].center;
        tree->blob_width[at] = model->blob[b].reach;
        tree->blob_amplitude[at] = model->blob[b].amplitude;
    }
    if (!vessel_tree_link(tree)) {
        faults_add(faults, "fit", 0, 0, "not enough memory");
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

static void measure_error(void *context, long index)
{
    VesselTree *tree = context;
    int64_t first = tree->point_offset[index], count = tree->point_offset[index + 1] - first;
    double *distance = HEAP_ZEROED((size_t)count, sizeof *distance);
    Blobby model = blobby_of(tree, (int)index);
    for (int64_t i = 0; i < count; i++) {
        Vec3 g;
        double f = blobby_gradient(&model, tree->point[first + i], &g);
        distance[i] = fmin(fabs(f) / fmax(vec3_norm(g), 0.5 / tree->radius[index]), 10 * tree->radius[index]);
    }
    if (count > 0) {
        sort_doubles(distance, (size_t)count);
        tree->error[index] = distance[(int64_t)(0.9 * (double)(count - 1) + 0.5)];
    }
    free(distance);
}

VesselTree *field_fit(const VesselTree *tree, const FieldFitOptions *options, const Progress *progress, Faults *faults)
{
    if (!check_options(options, faults))
        return NULL;
    if (tree->point_count < 4) {
        faults_add(faults, "fit", 0, 0, "the tree has %lld points; expected at least 4 points on the wall", (long long)tree->point_count);
        return NULL;
    }
    FieldRows rows, few;
    FieldModel model = {0};
    VesselTree *out = NULL;
    if (field_rows_create(&rows, &few, tree, options->voxel_mm, options->threads) &&
        field_model_create(&model, tree, few.first ? &few : &rows, options->threads) && fit(&model, &rows, options, progress)) {
        out = make_tree(&model, faults);
        if (options->left_out)
            *options->left_out = rows.dropped;
        if (out)
            parallel_for(options->threads, out->node_count, measure_error, out, NULL);
    } else {
        faults_add(faults, "fit", 0, 0, progress_is_stopped(progress) ? "stopped" : "not enough memory");
    }
    field_model_free(&model);
    field_rows_free(&rows);
    field_rows_free(&few);
    return out;
}

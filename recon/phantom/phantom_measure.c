// True surface points are found by rays from the nodes' centres to the true surface, the model's surface points by rays to the local
// model's surface as seen from the node, both while the ray stays in the node's power cell. 200 rays per node, Fibonacci directions.
#include "recon/phantom/phantom_measure.h"

#include "base/base.h"
#include "geom/geom.h"

#include <stdlib.h>

enum { RAYS = 200 };

typedef struct List {
    double *value;
    int count;
} List;

static MeasureRow row_of(List *list)
{
    MeasureRow row = {.count = list->count};
    if (list->count == 0)
        return row;
    sort_doubles(list->value, (size_t)list->count);
    for (int i = 0; i < list->count; i++)
        row.mean += list->value[i] / list->count, row.rms += list->value[i] * list->value[i] / list->count;
    row.rms = sqrt(row.rms);
    row.median = list->value[list->count / 2];
    row.p90 = list->value[(int)(0.9 * (list->count - 1))];
    row.p99 = list->value[(int)(0.99 * (list->count - 1))];
    row.most = list->value[list->count - 1];
    return row;
}

// Finds the first change of sign of the model's field (NULL: the shape's field), as its node sees it, from the node's centre along d. Returns false if it is not in the node's
// cell. Cells are convex, so only the end of the ray must be checked.
static bool first_crossing(const Shape *shape, const ModelField *model, const VesselTree *tree, int node, Vec3 d, Vec3 *hit)
{
    Vec3 c = tree->center[node];
    double step = 0.04 * tree->radius[node], low = 0, high = 0, longest = 8 * tree->radius[node];
    for (int i = 1; !model && low < longest; i++) {   // |grad f| <= 1: the field is a safe step length
        *hit = vec3_add_scaled(c, low, d);
        double f = shape_field(shape, *hit, NULL);
        if (f < 1e-9)
            return power_nearest(tree, *hit) == node;
        low += f;
    }
    for (int i = 1; model && high == 0; i++) {
        Vec3 x = vec3_add_scaled(c, i * step, d);
        if (i * step > longest || (i % 8 == 0 && power_nearest(tree, x) != node))
            return false;
        if (model_field_at(model, node, x, NULL) < 0)
            high = i * step;
        else
            low = i * step;
    }
    if (!model)
        return false;
    for (int i = 0; i < 40; i++) {
        double middle = 0.5 * (low + high);
        Vec3 x = vec3_add_scaled(c, middle, d);
        if (model_field_at(model, node, x, NULL) < 0)
            high = middle;
        else
            low = middle;
    }
    *hit = vec3_add_scaled(c, low, d);
    return power_nearest(tree, *hit) == node;
}

static void add_jumps(const ModelField *model, int node, Vec3 p, double distance, List *jump)
{
    const VesselTree *tree = model->tree;
    double own = power_distance(p, tree->center[node], tree->radius[node]);
    for (int k = tree->neighbour_offset[node]; k < tree->neighbour_offset[node + 1]; k++) {
        int other = tree->neighbour[k];
        double apart = vec3_distance(tree->center[node], tree->center[other]);
        double beyond = (power_distance(p, tree->center[other], tree->radius[other]) - own) / (2 * apart);
        if (beyond > 0.1 * tree->radius[node])
            continue;
        jump->value[jump->count++] = fabs(model_field_project(model, other, p, p).distance - distance);
    }
}

bool shape_measure(const Shape *shape, const ModelField *model, ShapeMeasure *out)
{
    const VesselTree *tree = model->tree;
    size_t room = (size_t)tree->node_count * RAYS;
    size_t links = 2 * (size_t)tree->node_count * RAYS;
    List to_model = {calloc(room, sizeof(double)), 0}, to_truth = {calloc(room, sizeof(double)), 0}, jump = {calloc(links + 1, sizeof(double)), 0};
    *out = (ShapeMeasure){.least_clearance = HUGE_VAL};
    double worst = -1;
    bool good = to_model.value && to_truth.value && jump.value && model_field_exists(model);
    for (int node = 0; good && node < tree->node_count; node++) {
        Vec3 c = tree->center[node], hit;
        double truth = shape_field(shape, c, NULL);
        // on the axis the projection may find no closest point; the sign is then that of the field
        double clearance = model_field_project(model, node, c, c).distance;
        bool inside = model_field_at(model, node, c, NULL) > 0;
        if (inside == (clearance > 0))
            out->least_clearance = fmin(out->least_clearance, clearance / truth);
        else if (!inside)
            out->least_clearance = fmin(out->least_clearance, 0);
        for (int k = 0; k < RAYS; k++) {
            double z = 1 - (2 * k + 1.0) / RAYS, ring = sqrt(1 - z * z), angle = k * PI * (3 - sqrt(5)), far = 0;
            Vec3 d = {ring * same_cos(angle), ring * same_sin(angle), z};
            if (first_crossing(shape, NULL, tree, node, d, &hit) && !shape_beyond_open_end(shape, hit)) {
                double signed_distance = model_field_project(model, node, hit, hit).distance;
                out->bias += signed_distance;
                far = fabs(signed_distance);
                to_model.value[to_model.count++] = far;
                if ((size_t)jump.count + (size_t)(tree->neighbour_offset[node + 1] - tree->neighbour_offset[node]) <= links)
                    add_jumps(model, node, hit, signed_distance, &jump);
            }
            if (first_crossing(shape, model, tree, node, d, &hit) && !shape_beyond_open_end(shape, hit)) {
                double distance = fabs(shape_distance(shape, hit, NULL));
                to_truth.value[to_truth.count++] = distance;
                far = fmax(far, distance);
            }
            if (far > worst)
                worst = far, out->worst_node = node;
        }
    }
    if (to_model.count > 0)
        out->bias /= to_model.count;
    if (good) {
        out->to_model = row_of(&to_model);
        out->to_truth = row_of(&to_truth);
        out->jump = row_of(&jump);
        out->worst_node = model_field_file_node(model, out->worst_node);
    }
    free(to_model.value);
    free(to_truth.value);
    free(jump.value);
    return good;
}

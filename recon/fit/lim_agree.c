// Casts rays from the node's centre to its own model's wall, on rings around its direction, as long as they stay in its cell; then moves from there to the
// blended wall.
#include "recon/fit/lim_agree.h"

#include "base/base.h"
#include "geom/geom.h"

enum { RINGS = 15, AROUND = LIM_AGREED_MOST / RINGS, STRIDES = 30 };

typedef struct Job {
    const VesselTree *tree;
    const Vessel *vessel;
    Vec3 *point;
    int *count;
    double *differs;
} Job;

bool lim_is_in_cell(const VesselTree *tree, int node, int spared, Vec3 x)
{
    double own = power_distance(x, tree->center[node], tree->radius[node]);
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++) {
        int other = tree->near[k];
        if (other != spared && power_distance(x, tree->center[other], tree->radius[other]) < own)
            return false;
    }
    return true;
}

void lim_frame(const VesselTree *tree, int node, Vec3 *e1, Vec3 *e2)
{
    Vec3 d = tree->direction[node], across = {0, 0, 0};
    for (int64_t i = tree->point_offset[node]; i < tree->point_offset[node + 1] && !(vec3_norm(across) > 0.3 * tree->radius[node]); i++) {
        Vec3 p = vec3_sub(tree->point[i], tree->center[node]);
        across = vec3_add_scaled(p, -vec3_dot(p, d), d);
    }
    *e1 = vec3_norm(across) > 0.3 * tree->radius[node] ? vec3_unit(across) : vec3_normal_to(d);
    *e2 = vec3_cross(d, *e1);
}

// Finds the wall from c along d. Returns false if it is outside the cell.
static bool find_wall(const VesselTree *tree, int node, const Blobby *model, Vec3 d, Vec3 *wall)
{
    Vec3 c = tree->center[node];
    double step = 0.1 * tree->radius[node], low = 0, high = 0;
    for (int i = 1; i < STRIDES && high == 0; i++) {
        Vec3 x = vec3_add_scaled(c, i * step, d);
        if (!lim_is_in_cell(tree, node, -1, x))
            return false;
        if (blobby_field(model, x) < 0)
            high = i * step;
        else
            low = i * step;
    }
    if (high == 0)
        return false;
    for (int i = 0; i < 20; i++) {
        double middle = 0.5 * (low + high);
        if (blobby_field(model, vec3_add_scaled(c, middle, d)) < 0)
            high = middle;
        else
            low = middle;
    }
    *wall = vec3_add_scaled(c, low, d);
    return true;
}

static void agree_on_node(void *context, long index)
{
    const Job *job = context;
    const VesselTree *tree = job->tree;
    int node = (int)index, count = 0;
    double most = 0;
    int64_t first = tree->blob_offset[node];
    Blobby model = {.count = (int)(tree->blob_offset[node + 1] - first),
                    .center = tree->blob_center + first,
                    .width = tree->blob_width + first,
                    .iso_level = tree->iso_level};
    Vec3 along = tree->direction[node], e1, e2, wall;
    lim_frame(tree, node, &e1, &e2);
    bool good = model.count > 0 && blobby_field(&model, tree->center[node]) > 0;
    for (int k = 0; good && k < RINGS * AROUND; k++) {
        // every other ring is rotated by half a step, so that the pattern is its own mirror image
        double z = 1 - (2 * (k / AROUND) + 1.0) / RINGS, ring = sqrt(1 - z * z), angle = 2 * PI * (k % AROUND + 0.5 * (k / AROUND % 2)) / AROUND;
        Vec3 out = vec3_add(vec3_scale(e1, ring * same_cos(angle)), vec3_scale(e2, ring * same_sin(angle)));
        if (!find_wall(tree, node, &model, vec3_add_scaled(out, z, along), &wall))
            continue;
        VesselMemory memory = {.node = node};
        VesselHit hit;
        vessel_query(job->vessel, 1, &wall, tree->radius[node], &memory, &hit);
        if (hit.flags != 0)
            continue;
        job->point[(size_t)node * LIM_AGREED_MOST + (size_t)count++] = vec3_add_scaled(wall, -hit.gap, hit.normal);
        most = fmax(most, fabs(hit.gap));
    }
    job->count[node] = count;
    job->differs[node] = most;
}

bool lim_agree(const VesselTree *model, int threads, Vec3 *point, int *count, double *differs)
{
    Vessel *vessel = lim_vessel_create(model);
    Job job = {model, vessel, point, count, differs};
    if (!vessel)
        return false;
    parallel_for(threads, model->node_count, agree_on_node, &job, NULL);
    vessel->destroy(vessel);
    return true;
}

#include "recon/track/rbt_aneurysm.h"

#include "base/base.h"
#include "recon/track/cast_rays.h"
#include "recon/track/rbt_branch.h"
#include "recon/track/rbt_trunk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_HUB_ROUNDS = 2 };

typedef struct SacJob {
    const Tracker *t;
    const Vec3 *direction;
    int direction_count;
    const Vec3 *center;
    double (*distance)[MAX_RAYS];   // per centre
} SacJob;

static void cast_sac_rays(void *context, long index)
{
    SacJob *job = context;
    const RbtParameters *p = job->t->parameters;
    int samples = (int)(p->aneurysm_reach_mm / (0.25 * job->t->voxel));
    samples = samples < 32 ? 32 : samples > MAX_RAY_SAMPLES ? MAX_RAY_SAMPLES : samples;
    RayOptions rays = {p->aneurysm_reach_mm, samples, 0, 0};
    cast_rays_first_edge(job->t->volume, job->center[index], job->direction, job->direction_count, &rays, job->distance[index]);
}

// Returns true if x lies on the wall of a tracked cylinder, as its consensus set does.
static bool is_in_consensus(const Tracker *t, Vec3 x, int node_count)
{
    for (int i = 0; i < node_count; i++) {
        const Cylinder *c = &t->tree.node[i].cylinder;
        Vec3 q = vec3_sub(x, c->center);
        double along = vec3_dot(q, c->axis);
        if (fabs(along) > c->height / 2)
            continue;
        double rho = sqrt(fmax(vec3_norm2(q) - along * along, 0));
        if (fabs(rho - c->radius) <= fmax(t->parameters->r_t * c->radius, t->parameters->r_t_voxels * t->voxel))
            return true;
    }
    return false;
}

static double power_of(const Cylinder *c, Vec3 x) { return vec3_norm2(vec3_sub(x, c->center)) - c->radius * c->radius; }

// Returns true if x belongs to a vessel's node rather than to the sac. The ray to x then passed through the neck, and x lies on the vessel's wall.
static bool is_vessels(const Tracker *t, Vec3 x, int node_count, const TrackNode *sac, int sac_count)
{
    double least = HUGE_VAL;
    for (int i = 0; i < sac_count; i++)
        least = fmin(least, power_of(&sac[i].cylinder, x));
    for (int i = 0; i < node_count; i++)
        if (power_of(&t->tree.node[i].cylinder, x) < least)
            return true;
    return false;
}

// Returns the listed vessel node to which x belongs, or -1 if it belongs to the sac.
static int vessel_owner(const Tracker *t, Vec3 x, const int *near, int near_count, const TrackNode *sac, int sac_count)
{
    double least = HUGE_VAL;
    int owner = -1;
    for (int i = 0; i < sac_count; i++)
        least = fmin(least, power_of(&sac[i].cylinder, x));
    for (int i = 0; i < near_count; i++)
        if (power_of(&t->tree.node[near[i]].cylinder, x) < least) {
            least = power_of(&t->tree.node[near[i]].cylinder, x);
            owner = near[i];
        }
    return owner;
}

typedef struct Neck {        // where the sac's rays enter the vessels' cells
    int count;
    Vec3 *place;             // (count)
    int *owner;              // (count) vessel node
    int *center;             // (count) centre of the sac
} Neck;

static bool find_neck(const Tracker *t, const SacJob *job, int node_count, const TrackNode *sac, int sac_count, Neck *neck)
{
    size_t capacity = (size_t)sac_count * (size_t)job->direction_count;
    int *near = malloc((size_t)node_count * sizeof *near);
    *neck = (Neck){0, malloc(capacity * sizeof(Vec3)), malloc(capacity * sizeof(int)), malloc(capacity * sizeof(int))};
    bool good = near && neck->place && neck->owner && neck->center;
    for (int i = 0; good && i < sac_count; i++) {
        int near_count = 0;
        for (int k = 0; k < node_count; k++)
            if (vec3_distance(t->tree.node[k].cylinder.center, job->center[i]) < t->parameters->aneurysm_reach_mm + t->tree.node[k].cylinder.radius)
                near[near_count++] = k;
        for (int k = 0; k < job->direction_count; k++) {
            double end = job->distance[i][k] > 0 ? job->distance[i][k] - t->voxel : t->parameters->aneurysm_reach_mm;
            for (double s = 0.5 * t->voxel; s < end; s += 0.5 * t->voxel) {
                Vec3 x = vec3_add_scaled(job->center[i], s, job->direction[k]);
                int owner = vessel_owner(t, x, near, near_count, sac, sac_count);
                if (owner < 0)
                    continue;
                neck->place[neck->count] = x;
                neck->owner[neck->count] = owner;
                neck->center[neck->count++] = i;
                break;
            }
        }
    }
    free(near);
    return good;
}

static void neck_free(Neck *neck)
{
    free(neck->place);
    free(neck->owner);
    free(neck->center);
}

static bool follows(const Track *tree, int i) { return i > 0 && tree->node[i].parent == i - 1 && tree->node[i].branch == tree->node[i - 1].branch; }

// Merges nodes lo … hi of a branch into node lo, with their links and points.
static bool merge_nodes(Track *tree, int lo, int hi, const Cylinder *hub)
{
    TrackNode node = tree->node[lo];
    int64_t points = 0, used = tree->point_count;
    double rate = 0;
    for (int i = lo; i <= hi; i++) {
        points += tree->node[i].point_count;
        rate += tree->node[i].inlier_rate / (hi - lo + 1);
    }
    if (used + points > tree->point_capacity) {
        Vec3 *grown = realloc(tree->point, (size_t)(used + points) * sizeof *grown);
        if (!grown)
            return false;
        tree->point = grown;
        tree->point_capacity = used + points;
    }
    node.point_start = used;
    node.point_count = (int)points;
    for (int i = lo; i <= hi; i++) {   // copied to the end: the old space stays unused
        memcpy(tree->point + used, tree->point + tree->node[i].point_start, (size_t)tree->node[i].point_count * sizeof *tree->point);
        used += tree->node[i].point_count;
    }
    tree->point_count = used;
    node.cylinder = *hub;
    node.inlier_rate = rate;
    node.is_junction = true;
    tree->node[lo] = node;
    for (int i = hi + 1; i < tree->count; i++)
        tree->node[i - hi + lo] = tree->node[i];
    tree->count -= hi - lo;
    for (int i = lo + 1; i < tree->count; i++)
        if (tree->node[i].parent > lo)
            tree->node[i].parent = tree->node[i].parent > hi ? tree->node[i].parent - (hi - lo) : lo;
    return true;
}

// Chooses the node to which the sac is attached, or -1 if no ray finds a neck; `center` receives the sac's centre attached there. A tool's node search moves
// from neighbour to neighbour, so it must be able to move from every vessel cell that borders on the sac's cells into them and back. The tree has only one
// link, so the vessel nodes along the neck are merged into one. Its position is the mean of theirs, weighted by their share of the neck, and its radius
// preserves the border between vessel and sac.
static int make_hub(Tracker *t, const SacJob *job, const TrackNode *sac, int sac_count, int *center)
{
    Neck neck;
    Track *tree = &t->tree;
    int *rays = calloc((size_t)tree->count, sizeof *rays), *of_center = calloc((size_t)sac_count, sizeof *of_center), best = -1;
    if (!rays || !of_center || !find_neck(t, job, tree->count, sac, sac_count, &neck)) {
        t->out_of_memory = true;
        free(rays);
        free(of_center);
        return -1;
    }
    for (int i = 0; i < neck.count; i++)
        rays[neck.owner[i]]++;
    for (int i = 0; i < tree->count; i++)
        if (rays[i] > 0 && (best < 0 || rays[i] > rays[best]))
            best = i;
    if (best >= 0) {
        int lo = best, hi = best;
        // vessels that touch the sac elsewhere do not belong to its neck
        while (follows(tree, lo) && rays[lo - 1] >= 0.1 * rays[best])
            lo--;
        while (hi + 1 < tree->count && follows(tree, hi + 1) && rays[hi + 1] >= 0.1 * rays[best])
            hi++;
        for (bool grown = hi > lo; grown;) {
            Cylinder hub = {.center = {0, 0, 0}};
            double weight = 0, square = 0;
            int used = 0;
            for (int i = lo; i <= hi; i++)
                if (rays[i] > 0) {
                    hub.center = vec3_add_scaled(hub.center, rays[i], tree->node[i].cylinder.center);
                    weight += rays[i];
                }
            hub.center = vec3_scale(hub.center, 1 / weight);
            for (int i = 0; i < neck.count; i++)
                if (neck.owner[i] >= lo && neck.owner[i] <= hi) {
                    double border = HUGE_VAL;
                    for (int k = 0; k < sac_count; k++)
                        border = fmin(border, power_of(&sac[k].cylinder, neck.place[i]));
                    square += vec3_norm2(vec3_sub(neck.place[i], hub.center)) - border;
                    used++;
                }
            hub.radius = sqrt(fmax(square / used, same_square(tree->node[best].cylinder.radius)));
            // neighbours that would lie in its cell are merged too
            grown = false;
            if (follows(tree, lo) && power_of(&hub, tree->node[lo - 1].cylinder.center) < -same_square(tree->node[lo - 1].cylinder.radius))
                grown = true, lo--;
            if (hi + 1 < tree->count && follows(tree, hi + 1) &&
                power_of(&hub, tree->node[hi + 1].cylinder.center) < -same_square(tree->node[hi + 1].cylinder.radius))
                grown = true, hi++;
            if (!grown) {
                Vec3 from = tree->node[lo].cylinder.center, to = tree->node[hi].cylinder.center;
                hub.axis = vec3_unit_or(vec3_sub(to, from), tree->node[best].cylinder.axis);
                hub.height = vec3_distance(from, to) + 0.5 * (tree->node[lo].cylinder.height + tree->node[hi].cylinder.height);
                t->out_of_memory = !merge_nodes(tree, lo, hi, &hub);
                best = lo;
            }
        }
        *center = 0;
        for (int i = 0; i < neck.count; i++)
            if (neck.owner[i] >= lo && neck.owner[i] <= hi && ++of_center[neck.center[i]] > of_center[*center])
                *center = neck.center[i];
    }
    neck_free(&neck);
    free(rays);
    free(of_center);
    return best;
}

// Adds one sac: finds wall points by rays from each centre, fits a sphere to each, then links the centres: one to the tree, each other one to its nearest.
bool track_aneurysm(Tracker *t, const RbtAneurysm *aneurysm, const Vec3 *center, int number, int threads, Faults *faults, const char *path)
{
    int n = aneurysm->center_count, rays = (int)t->parameters->aneurysm_rays, vessel_count = t->tree.count;
    Vec3 *direction = malloc(MAX_RAYS * sizeof *direction), *point = malloc((size_t)n * MAX_RAYS * sizeof *point);
    double(*distance)[MAX_RAYS] = malloc((size_t)n * sizeof *distance);
    TrackNode *sac = calloc((size_t)n, sizeof *sac);
    bool good = direction && point && distance && sac;
    SacJob job = {t, direction, rays, center, distance};
    t->out_of_memory = !good;
    if (good) {
        sphere_directions(sphere_level_of(rays), direction);
        parallel_for(threads, n, cast_sac_rays, &job, NULL);
    }
    for (int i = 0; good && i < n; i++) {
        Vec3 *own = point + (size_t)i * MAX_RAYS, middle;
        int count = 0;
        for (int k = 0; k < rays; k++) {
            Vec3 x = vec3_add_scaled(center[i], distance[i][k], direction[k]);
            if (distance[i][k] > 0 && !is_in_consensus(t, x, vessel_count))
                own[count++] = x;
        }
        double radius;
        good = count >= rays / 8 && sphere_fit(own, count, &middle, &radius);
        if (!good) {
            faults_add(faults, path, aneurysm->line, aneurysm->column,
                       "no wall found around centre %d of the aneurysm (%d of %d rays within %g mm); expected a point well "
                       "inside the sac, or a longer aneurysm_reach_mm",
                       i + 1, count, rays, t->parameters->aneurysm_reach_mm);
            break;
        }
        sac[i] = (TrackNode){.cylinder = {center[i], radius, {1, 0, 0}, 2 * radius},
                             .inlier_rate = (double)count / rays,
                             .kind = NODE_ANEURYSM,
                             .branch = number,
                             .point_count = count,
                             .parent = -1};
    }
    for (int i = 0; good && i < n; i++) {
        Vec3 *own = point + (size_t)i * MAX_RAYS;
        int kept = 0;
        for (int k = 0; k < sac[i].point_count; k++)
            if (!is_vessels(t, own[k], vessel_count, sac, n))
                own[kept++] = own[k];
        sac[i].point_count = kept;
        sac[i].inlier_rate = (double)kept / rays;
    }
    // Prim's spanning tree over the centres, starting from the one attached to the vessel. Merging much of the neck changes which nodes border on it, so
    // make_hub is repeated once or twice.
    int root_center = 0, root = -1, before = 0;
    for (int i = 0; good && i < MAX_HUB_ROUNDS && before != t->tree.count && !t->out_of_memory; i++) {
        before = t->tree.count;
        root = make_hub(t, &job, sac, n, &root_center);
    }
    good = good && !t->out_of_memory;
    vessel_count = t->tree.count;
    for (int done = 0; good && done < n; done++) {
        int next = root_center, parent = root >= 0 ? root : tracker_attachment(t, center[root_center], vessel_count);
        double least = HUGE_VAL;
        for (int i = 0; i < n && done > 0; i++)
            for (int j = vessel_count; sac[i].parent == -1 && j < t->tree.count; j++)
                if (vec3_distance(center[i], t->tree.node[j].cylinder.center) < least) {
                    least = vec3_distance(center[i], t->tree.node[j].cylinder.center);
                    next = i;
                    parent = j;
                }
        sac[next].parent = parent;
        sac[next].cylinder.axis = vec3_unit(vec3_sub(center[next], t->tree.node[parent].cylinder.center));
        sac[next].point_start = 0;
        good = track_append(&t->tree, &sac[next], point + (size_t)next * MAX_RAYS);
        t->out_of_memory = !good;
    }
    free(direction);
    free(point);
    free(distance);
    free(sac);
    return good;
}

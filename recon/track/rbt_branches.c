// A limb is first tracked backwards. At an ostium this return path ends in the parent's tube. Where vessels only touch, it runs past the contact, and the
// limb is rejected: its vessel has another parent, from which it is found later, or no parent. Then the outgoing path is tracked.
//
// Limbs of a round are tracked in parallel on the same tree, and adopted widest first; parts that lie in a tube adopted before are omitted.
#include "recon/track/rbt_branches.h"
#include "base/base.h"
#include "recon/track/rbt_branch.h"
#include "recon/track/rbt_links.h"
#include "recon/track/rbt_sacs.h"
#include "recon/track/rbt_trunk.h"
#include "recon/volume/bspline.h"

#include <stdlib.h>
#include <string.h>

enum { WAVE = 8 };          // limbs tracked in parallel; the tree depends on this number, not on the number of threads
static const double least_tube = 0.7;   // mean inlier rate of a branch, as a fraction of the first branch's

typedef struct Found {       // result for a limb
    Track out, back;
    const char *why;
    double radius;           // radius of its first nodes
    int limb;
    bool good, is_sac;       // is_sac: an aneurysm, one node in `out`
    bool out_of_memory;
} Found;

typedef struct Round {
    const Tracker *t;
    const RbtPaint *paint;
    const RbtLimb *limb;
    Found *found;
    double share, noise;
} Round;

static double median_radius(const Track *track, int most)
{
    double radius[16];
    int n = track->count < most ? track->count : most;
    for (int i = 0; i < n; i++) {
        int k = i;
        double r = track->node[i].cylinder.radius;
        for (; k > 0 && radius[k - 1] > r; k--)
            radius[k] = radius[k - 1];
        radius[k] = r;
    }
    return n > 0 ? radius[n / 2] : 0;
}

// Returns true if the estimate is a vessel along the limb.
static bool is_along(const Tracker *t, const RbtLimb *limb, Vec3 place, Vec3 direction, double share)
{
    const TrackNode *n = &t->estimate.node;
    const TrackNode *parent = &t->tree.node[limb->contact];
    return vec3_dot(n->cylinder.axis, direction) > 0.5 && vec3_distance(n->cylinder.center, place) < 1.5 * fmax(n->cylinder.radius, t->voxel) &&
           n->contrast > 0.7 * share * parent->contrast && tracker_is_inside(t->volume, n->cylinder.center) && !tracker_is_forbidden(t, n->cylinder.center) &&
           tracker_brightness(t, n->cylinder.center) >= fmax(limb->level, t->floor) && tracker_brightness(t, n->cylinder.center) <= limb->ceiling &&
           tracker_node_around(t, n->cylinder.center, 0.8) < 0;
}

// Returns true if the limb lies behind the first start, where the vessel comes from.
static bool is_upstream(const Tracker *t, const RbtLimb *limb)
{
    const Cylinder *root = &t->tree.node[0].cylinder;
    Vec3 offset = vec3_sub(limb->place[0], root->center);
    double along = vec3_dot(offset, root->axis);
    return along < 0 && along > -4 * root->radius - 4 * t->voxel && vec3_norm(vec3_add_scaled(offset, -along, root->axis)) < root->radius;
}

// Returns true if the limb is the blurred rim of a dense neighbour, in which every brightness occurs: most of the limb then lies next to something too bright
// for a vessel.
static bool is_rim(const Tracker *t, const RbtLimb *limb)
{
    int beside = 0;
    double bright = limb->ceiling - RBT_NOISE_SHARE * t->noise;   // one bright sample may be noise, two are unlikely to be
    for (int i = 0; i < limb->count; i++) {
        int count = 0;
        for (int k = 0; k < 18; k++) {
            double step[3] = {0, 0, 0};
            step[k % 3] = (k / 3 % 2 ? 1 : -1) * (2 + 1.5 * (k / 6)) * t->voxel;
            count += tracker_brightness(t, vec3_add(limb->place[i], vec3(step[0], step[1], step[2]))) > bright;
        }
        beside += count >= 2;
    }
    return 2 * beside > limb->count;
}

// Returns true if the track is too bright for a vessel. Noise may darken single samples of bone below the ceiling, but not their median.
static bool is_dense(const Tracker *t, const RbtLimb *limb, const Track *track)
{
    enum { MOST = 256 };
    double value[MOST];
    int n = 0, stride = track->count / MOST + 1;
    for (int i = 0; i < track->count && n < MOST; i += stride)
        value[n++] = tracker_brightness(t, track->node[i].cylinder.center);
    sort_doubles(value, (size_t)n);
    return n > 0 && value[n / 2] > fmin(limb->ceiling, t->ceiling) - RBT_NOISE_SHARE * t->noise;
}

// Returns true if the nodes are a vessel: most nodes of a vessel are cylinders, while nodes tracked through a shapeless neighbour all have low inlier rates.
static bool is_tube(const Tracker *t, const TrackNode *node, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += node[i].inlier_rate;
    return sum >= least_tube * t->usual_inliers * count;
}

// Finds a cylinder on the limb: tries its middle first, then outwards, then inwards.
static bool seed_on_limb(Tracker *t, const RbtLimb *limb, double share, Cylinder *seed)
{
    const RbtParameters *p = t->parameters;
    double widest = 1.5 * fmax(t->tree.node[limb->contact].cylinder.radius, t->voxel);
    for (int n = 0; n < limb->count; n++) {
        int middle = limb->count / 2, k = middle + n < limb->count ? middle + n : limb->count - 1 - n, before = k > 0 ? k - 1 : k,
            after = k + 1 < limb->count ? k + 1 : k;
        if (after == before)
            return false;
        Cylinder predicted = {.center = limb->place[k],
                              .radius = fmax(limb->radius[k], 0.8 * t->voxel),
                              .axis = vec3_unit_or(vec3_sub(limb->place[after], limb->place[before]), vec3(0, 0, 1))};
        if (predicted.radius > widest)
            continue;
        for (int second = 0; second <= (p->r_t_second > 0); second++)
            if (tracker_estimate(t, &predicted, second ? p->r_t_second : p->r_t) && is_along(t, limb, predicted.center, predicted.axis, share) &&
                t->estimate.node.cylinder.radius < widest) {
                *seed = t->estimate.node.cylinder;
                return true;
            }
    }
    return false;
}

// Distance of x from the limb's path, which starts at the contact's node.
static double distance_from_limb(const Tracker *t, const RbtLimb *limb, Vec3 x)
{
    double least = tracker_segment_distance(x, t->tree.node[limb->contact].cylinder.center, limb->place[0]);
    for (int i = 1; i < limb->count; i++)
        least = fmin(least, tracker_segment_distance(x, limb->place[i - 1], limb->place[i]));
    return least;
}

// Brightness of the darkest place between a node and a node of the tree, on a scale from background (0) to the darker of both lumens (1).
static double neck_of(const Tracker *t, const TrackNode *parent, const TrackNode *node)
{
    Vec3 x = node->cylinder.center, c = parent->cylinder.center;
    double own = tracker_brightness(t, x), other = tracker_brightness(t, c), inside = fmin(own, other),
           outside = fmin(own - node->contrast, other - parent->contrast), least = 1;
    int steps = 2 + (int)(vec3_distance(x, c) / (0.25 * t->voxel));
    for (int i = 0; i <= steps; i++)
        least = fmin(least, (tracker_brightness(t, vec3_mix(x, c, (double)i / steps)) - outside) / fmax(inside - outside, 1e-12));
    return least;
}

// Returns true if the return path ends at the wall of a vessel and points into it. The caller has found that it runs past the contact. Vessels that only
// touch lie side by side.
static bool meets_wall(const Tracker *t, const RbtPaint *paint, const TrackNode *end)
{
    int node = rbt_paint_node(paint, end->cylinder.center);
    if (node < 0 || t->tree.node[node].kind != NODE_VESSEL)
        return false;
    Vec3 in = vec3_unit_or(vec3_sub(t->tree.node[node].cylinder.center, end->cylinder.center), end->cylinder.axis);
    return vec3_dot(in, end->cylinder.axis) > 0.5 && neck_of(t, &t->tree.node[node], end) >= 0.8;
}

// Returns true if the return path ends where the limb begins; removes the part that runs past it.
static bool meets_parent(const Tracker *t, const RbtPaint *paint, const RbtLimb *limb, Track *back)
{
    const Cylinder *end = &back->node[back->count - 1].cylinder;
    if (tracker_node_around(t, end->center, 0.9) >= 0)
        return true;
    int nearest = 0;
    Vec3 contact = t->tree.node[limb->contact].cylinder.center;
    for (int i = 0; i < back->count; i++)
        if (vec3_distance(back->node[i].cylinder.center, contact) < vec3_distance(back->node[nearest].cylinder.center, contact))
            nearest = i;
    // it left the limb and followed a sibling straight ahead: keep the part before that
    if (distance_from_limb(t, limb, back->node[nearest].cylinder.center) > 2 * fmax(back->node[nearest].cylinder.radius, t->voxel))
        for (nearest = 0; nearest + 1 < back->count; nearest++)
            if (distance_from_limb(t, limb, back->node[nearest + 1].cylinder.center) > 2 * fmax(back->node[nearest + 1].cylinder.radius, t->voxel))
                break;
    double past = 0, radius = back->node[nearest].cylinder.radius;
    for (int i = nearest + 1; i < back->count; i++)
        past += vec3_distance(back->node[i].cylinder.center, back->node[i - 1].cylinder.center);
    double gap = vec3_distance(back->node[nearest].cylinder.center, contact);
    bool goes_past = past > 4 * radius && past > 4 * t->voxel && gap < 1.25 * (radius + t->tree.node[limb->contact].cylinder.radius) + 3 * t->voxel;
    // if the parent ends here, the contact is a fork and its neck may be darker; a parent that continues only passes by
    int ahead = limb->contact;
    double left = 0;
    while (ahead + 1 < t->tree.count && t->tree.node[ahead + 1].branch == t->tree.node[limb->contact].branch && left < 3 * radius) {
        ahead++;
        left += vec3_distance(t->tree.node[ahead].cylinder.center, t->tree.node[ahead - 1].cylinder.center);
    }
    bool is_end = left < fmax(2 * t->tree.node[limb->contact].cylinder.radius, 2 * t->voxel);
    if (goes_past && neck_of(t, &t->tree.node[limb->contact], &back->node[nearest]) < (is_end ? 0.4 : 0.8))
        return meets_wall(t, paint, &back->node[back->count - 1]);
    track_cut(back, nearest + 1);
    return true;
}

static void track_limb(void *context, long index)
{
    Round *round = context;
    Found *found = &round->found[index];
    const RbtLimb *limb = &round->limb[index];
    Tracker *t = HEAP_ZEROED(1, sizeof *t);
    found->limb = (int)index;
    *t = *round->t;
    t->random = random_from_seed((uint64_t)t->parameters->seed, limb->key);
    t->is_guarded = true;
    Cylinder seed;
    found->why = "no cylinder along the limb";
    if (is_upstream(t, limb)) {
        found->why = "is upstream of the first start";
    } else if (is_rim(t, limb)) {
        found->why = "is the rim of a dense neighbour";
    } else if (rbt_is_sac(t, round->paint, limb)) {
        found->is_sac = true;
        found->radius = t->estimate.node.cylinder.radius;
        found->why = "aneurysm";
        t->out_of_memory = !track_append(&found->out, &t->estimate.node, t->estimate.point);
        found->good = !t->out_of_memory && rbt_fill_sac(t, round->paint, limb, &found->out);
    } else if (seed_on_limb(t, limb, round->share, &seed) && rbt_paint_node(round->paint, seed.center) < 0) {
        found->why = "does not lead back to its parent";
        Cylinder behind = seed;
        behind.axis = vec3_negate(behind.axis);
        t->longest = limb->depth + 8 * fmax(seed.radius, t->voxel);
        tracker_run(t, &behind, &found->back, true);
        if (found->back.count > 0 && meets_parent(t, round->paint, limb, &found->back)) {
            t->longest = HUGE_VAL;
            tracker_run(t, &seed, &found->out, false);
            found->why = t->why;
            found->radius = median_radius(&found->out, 7);
            found->good = found->out.count > 0 && !t->out_of_memory && is_tube(t, found->out.node, found->out.count) && !is_dense(t, limb, &found->out);
        }
    }
    found->out_of_memory = t->out_of_memory;
    free(t);
}

static int compare_found(const void *a, const void *b)
{
    const Found *x = *(Found *const *)a, *y = *(Found *const *)b;
    return x->radius != y->radius ? (x->radius < y->radius) - (x->radius > y->radius) : (x->limb > y->limb) - (x->limb < y->limb);
}

static bool is_painted(const RbtPaint *paint, Vec3 x) { return rbt_paint_node(paint, x) >= 0; }

bool rbt_ends_add(RbtEnds *ends, const char *why, int seed)
{
    if (ends->count == ends->capacity) {
        int capacity = ends->capacity ? 2 * ends->capacity : 64;
        const char **whys = realloc(ends->why, (size_t)capacity * sizeof *whys);
        if (whys)
            ends->why = whys;
        int *seeds = realloc(ends->seed, (size_t)capacity * sizeof *seeds);
        if (seeds)
            ends->seed = seeds;
        if (!whys || !seeds)
            return false;
        ends->capacity = capacity;
    }
    ends->why[ends->count] = why;
    ends->seed[ends->count++] = seed;
    return true;
}

// Returns the node to which a branch is attached: the node that contains its first node, else the best attachment.
static int parent_of(const Tracker *t, const RbtPaint *paint, const Cylinder *first)
{
    int inside = rbt_paint_node(paint, first->center);
    return inside >= 0 && tracker_node_around(t, first->center, 1) >= 0 ? inside : tracker_attachment(t, first->center, t->tree.count);
}

// Appends the return path reversed, then the outgoing path, without the parts inside other tubes. Returns false if out of memory.
static bool adopt(Tracker *t, RbtPaint *paint, const Found *found, RbtEnds *ends)
{
    int total = found->back.count - 1 + found->out.count, first = 0, last = total - 1, before = t->tree.count, number = ends->count;
    const TrackNode **node = malloc((size_t)total * sizeof *node);
    const Vec3 **point = malloc((size_t)total * sizeof *point);
    bool good = node && point;
    for (int i = 0; good && i < total; i++) {   // the first node of both paths is the same, in opposite directions
        bool is_back = i < found->back.count - 1;
        const Track *from = is_back ? &found->back : &found->out;
        node[i] = &from->node[is_back ? found->back.count - 1 - i : i - (found->back.count - 1)];
        point[i] = from->point + node[i]->point_start;
    }
    int seed = found->back.count - 1;
    good = good && total > 0;
    if (good) {
        while (first < seed && tracker_node_around(t, node[first]->cylinder.center, 1) >= 0)
            first++;
        // two limbs may lead to the same vessel: the second ends at the first
        int outside = seed;
        while (outside < total && !is_painted(paint, node[outside]->cylinder.center))
            outside++;
        last = outside - 1;
        double length = 0;
        for (int i = first + 1; i <= last; i++)
            length += vec3_distance(node[i]->cylinder.center, node[i - 1]->cylinder.center);
        if (last >= seed && length >= fmax(3 * t->voxel, found->radius)) {
            int parent = parent_of(t, paint, &node[first]->cylinder);
            for (int i = first; good && i <= last; i++) {
                TrackNode copy = *node[i];
                if (i < found->back.count - 1)
                    copy.cylinder.axis = vec3_negate(copy.cylinder.axis);
                copy.branch = number;
                copy.parent = i > first ? t->tree.count - 1 : parent;
                good = track_append(&t->tree, &copy, point[i]);
            }
            bool is_joined = false;
            good = good && rbt_repair_links(t, paint, before, &is_joined);
            if (good && is_joined && !is_tube(t, t->tree.node + before, t->tree.count - before)) {   // including the path that joins it
                track_cut(&t->tree, before);
                is_joined = false;
            }
            good = good && (!is_joined || rbt_ends_add(ends, last < total - 1 ? "runs into another branch" : found->why, -1));
            if (good)
                rbt_paint_nodes(paint, &t->tree, before, t->tree.count);
        }
    }
    free(node);
    free(point);
    return good || total == 0;
}

// Appends an aneurysm, attached to the nearest node. Several limbs may lead to the same aneurysm; it is added once. Returns false if out of memory.
static bool adopt_sac(Tracker *t, RbtPaint *paint, const RbtLimb *limb, const Found *found, RbtEnds *ends)
{
    int before = t->tree.count;
    bool is_joined;
    if (is_painted(paint, found->out.node[0].cylinder.center))
        return true;
    for (int i = 0; i < found->out.count; i++) {
        TrackNode node = found->out.node[i];
        node.branch = ends->count;
        node.parent = i > 0 ? before + node.parent : limb->contact;
        if (!track_append(&t->tree, &node, found->out.point + node.point_start))
            return false;
    }
    if (!rbt_repair_links(t, paint, before, &is_joined) || (is_joined && !rbt_ends_add(ends, found->why, -1)))
        return false;
    rbt_paint_nodes(paint, &t->tree, before, t->tree.count);
    return true;
}

// Sorts wider limbs first, so that narrower ones stop at vessels already tracked.
static int compare_limbs(const void *a, const void *b)
{
    const RbtLimb *x = a, *y = b;
    double rx = x->radius[x->count / 2], ry = y->radius[y->count / 2];
    return rx != ry ? (rx < ry) - (rx > ry) : (x->key > y->key) - (x->key < y->key);
}

// Tracks `count` limbs in parallel and adopts them. Returns false if out of memory.
static bool grow_wave(Tracker *t, RbtPaint *paint, const RbtLimb *limb, int count, double share, double noise, int threads, RbtEnds *ends)
{
    Found found[WAVE] = {0}, *order[WAVE];
    bool good = true;
    Round round = {t, paint, limb, found, share, noise};
    parallel_for(threads, count, track_limb, &round, NULL);
    for (int i = 0; i < count; i++) {
        order[i] = &found[i];
        good = good && !found[i].out_of_memory;
    }
    qsort(order, (size_t)count, sizeof(*order), compare_found);
    for (int i = 0; good && i < count; i++)
        if (order[i]->good)
            good = order[i]->is_sac ? adopt_sac(t, paint, &limb[order[i]->limb], order[i], ends) : adopt(t, paint, order[i], ends);
    for (int i = 0; i < count; i++) {
        track_free(&found[i].out);
        track_free(&found[i].back);
    }
    return good;
}

// Grows one round of limbs from the nodes first … end-1. Returns false if out of memory.
static bool grow_round(Tracker *t, RbtPaint *paint, int first, int end, double share, double noise, int threads, RbtEnds *ends)
{
    int count = 0;
    RbtLimb *limb = rbt_find_limbs(t, paint, first, end, share, noise, &count);
    bool good = count >= 0;
    if (count > 0)
        qsort(limb, (size_t)count, sizeof *limb, compare_limbs);
    for (int i = 0; good && i < count && !tracker_is_stopped_by_user(t); i += WAVE) {
        good = grow_wave(t, paint, limb + i, count - i < WAVE ? count - i : WAVE, share, noise, threads, ends);
        tracker_show(t, NULL);
    }
    free(limb);
    return good;
}

// Standard deviation of the spline's values in the background, from the median absolute deviation from their median, because vessels are few.
static double noise_of(const Tracker *t)
{
    enum { SAMPLES = 20000 };
    const int *size = t->volume->size;
    size_t voxels = (size_t)size[0] * (size_t)size[1] * (size_t)size[2], stride = voxels / SAMPLES + 1;
    double value[SAMPLES];
    int n = 0;
    for (size_t i = 0; i < voxels && n < SAMPLES; i += stride)
        value[n++] = (double)bspline_sample(
            t->volume, vec3((double)(i % (size_t)size[0]), (double)(i / (size_t)size[0] % (size_t)size[1]), (double)(i / ((size_t)size[0] * (size_t)size[1]))));
    sort_doubles(value, (size_t)n);
    double middle = value[n / 2];
    for (int i = 0; i < n; i++)
        value[i] = fabs(value[i] - middle);
    sort_doubles(value, (size_t)n);
    return 1.4826 * value[n / 2];
}

// Measures the first branch: the medians of its brightness and contrast set the limits for too faint and too bright; its inlier rate shows how well cylinders
// fit in this volume.
static void measure_root(Tracker *t, double noise)
{
    enum { MOST = 512 };
    double inside[MOST], contrast[MOST], inliers = 0;
    int n = 0, stride = t->tree.count / MOST + 1;
    for (int i = 0; i < t->tree.count && t->tree.node[i].branch == 0 && n < MOST; i += stride) {
        inside[n] = tracker_brightness(t, t->tree.node[i].cylinder.center);
        inliers += t->tree.node[i].inlier_rate;
        contrast[n++] = t->tree.node[i].contrast;
    }
    sort_doubles(inside, (size_t)n);
    sort_doubles(contrast, (size_t)n);
    t->usual_inliers = inliers / n;
    t->floor = inside[n / 2] - (1 - t->parameters->residue) * contrast[n / 2];
    t->ceiling = inside[n - 1 - n / 10] + RBT_BRIGHTER * contrast[n / 2] + RBT_NOISE_SHARE * noise;
}

bool rbt_grow_branches(Tracker *t, RbtPaint *paint, int first, int threads, const Progress *progress, RbtEnds *ends)
{
    const double share[] = {0.5, 0.5 * (0.5 + t->parameters->residue), t->parameters->residue};
    double noise = 4 * noise_of(t);
    t->noise = noise;
    if (first == 0)
        measure_root(t, noise);
    rbt_paint_nodes(paint, &t->tree, first, t->tree.count);
    bool good = true;
    for (int pass = 0; good && pass < 3; pass++)
        for (int start = first, end = t->tree.count; good && start < end; start = end, end = t->tree.count) {
            good = grow_round(t, paint, start, end, share[pass], noise, threads, ends);
            if (progress && progress->call)
                progress->call(progress->context, end - start, t->tree.count - start);
        }
    return good;
}

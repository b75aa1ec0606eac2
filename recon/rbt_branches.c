// A limb is tracked back first. At an ostium the way back ends in the parent's tube; where vessels kiss it goes past the contact, and the limb is
// refused: its vessel has another parent, from which it is found later, or none. Then the way out is tracked.
//
// Limbs of a round are tracked at the same time on the tree as it was, and adopted widest first; what lies in a tube that was adopted before is left out.
#include "recon/rbt_branches.h"
#include "recon/bspline.h"

#include <stdlib.h>
#include <string.h>

typedef struct Found {       // what became of a limb
    Track out, back;
    const char *why;
    double radius;           // of its first nodes
    int limb;
    bool good;
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

// Is the estimate a vessel along the limb?
static bool is_along(const Tracker *t, const RbtLimb *limb, Vec3 place, Vec3 direction, double share)
{
    const TrackNode *n = &t->estimate.node;
    const TrackNode *parent = &t->tree.node[limb->contact];
    return vec3_dot(n->cylinder.axis, direction) > 0.5 && vec3_distance(n->cylinder.center, place) < 1.5 * fmax(n->cylinder.radius, t->voxel) &&
           n->contrast > 0.7 * share * parent->contrast && tracker_is_inside(t->volume, n->cylinder.center) && !tracker_is_forbidden(t, n->cylinder.center) &&
           tracker_brightness(t, n->cylinder.center) >= limb->level && tracker_node_around(t, n->cylinder.center, 0.8) < 0;
}

// A cylinder somewhere on the limb: its middle first, then outwards, then inwards.
static bool seed_on_limb(Tracker *t, const RbtLimb *limb, double share, Cylinder *seed)
{
    const RbtParameters *p = t->parameters;
    double widest = 1.5 * fmax(t->tree.node[limb->contact].cylinder.radius, t->voxel);
    for (int n = 0; n < limb->count; n++) {
        int middle = limb->count / 2, k = middle + n < limb->count ? middle + n : limb->count - 1 - n, before = k > 0 ? k - 1 : k, after = k + 1 < limb->count ? k + 1 : k;
        if (after == before)
            return false;
        Cylinder predicted = {.center = limb->place[k], .radius = fmax(limb->radius[k], 0.8 * t->voxel), .axis = vec3_unit_or(vec3_sub(limb->place[after], limb->place[before]), vec3(0, 0, 1))};
        if (predicted.radius > widest)
            continue;
        for (int second = 0; second <= (p->r_t_second > 0); second++)
            if (tracker_estimate(t, &predicted, second ? p->r_t_second : p->r_t) && is_along(t, limb, predicted.center, predicted.axis, share) && t->estimate.node.cylinder.radius < widest) {
                *seed = t->estimate.node.cylinder;
                return true;
            }
    }
    return false;
}

// Does the way back end where the limb begins: in the tree, or near the contact and heading for it?
static bool meets_parent(const Tracker *t, const RbtLimb *limb, const Cylinder *end)
{
    if (tracker_node_around(t, end->center, 0.9) >= 0)
        return true;
    const Cylinder *parent = &t->tree.node[limb->contact].cylinder;
    Vec3 gap = vec3_sub(limb->place[0], end->center), to_parent = vec3_sub(parent->center, end->center);
    double reach = 2 * parent->radius + 2 * end->radius + 3 * t->voxel;
    return vec3_norm(to_parent) < reach && vec3_norm(gap) < reach && vec3_dot(vec3_unit_or(to_parent, end->axis), end->axis) > 0.3;
}

static void track_limb(void *context, long index)
{
    Round *round = context;
    Found *found = &round->found[index];
    const RbtLimb *limb = &round->limb[index];
    Tracker *t = malloc(sizeof *t);
    found->limb = (int)index;
    if (!t) {
        found->why = "out of memory";
        return;
    }
    *t = *round->t;
    t->random = random_from_seed((uint64_t)t->parameters->seed, limb->key);
    t->is_guarded = true;
    Cylinder seed;
    if (seed_on_limb(t, limb, round->share, &seed)) {
        Cylinder behind = seed;
        behind.axis = vec3_negate(behind.axis);
        t->longest = 3 * limb->depth + 6 * seed.radius;
        tracker_run(t, &behind, &found->back, true);
        if (found->back.count > 0 && meets_parent(t, limb, &found->back.node[found->back.count - 1].cylinder)) {
            t->longest = HUGE_VAL;
            tracker_run(t, &seed, &found->out, false);
            found->why = t->why;
            found->radius = median_radius(&found->out, 7);
            found->good = found->out.count > 0 && !t->out_of_memory;
        }
    }
    if (t->out_of_memory)
        found->why = "out of memory";
    free(t);
}

static int compare_found(const void *a, const void *b)
{
    const Found *x = *(Found *const *)a, *y = *(Found *const *)b;
    return x->radius != y->radius ? (x->radius < y->radius) - (x->radius > y->radius) : (x->limb > y->limb) - (x->limb < y->limb);
}

static bool is_painted(const RbtPaint *paint, Vec3 x) { return rbt_paint_node(paint, x) >= 0; }

bool rbt_ends_add(RbtEnds *ends, const char *why)
{
    if (ends->count == ends->capacity) {
        int capacity = ends->capacity ? 2 * ends->capacity : 64;
        const char **grown = realloc(ends->why, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        ends->why = grown;
        ends->capacity = capacity;
    }
    ends->why[ends->count++] = why;
    return true;
}

// Where a branch that comes from `axis` hangs: the node that its first one lies in or next to; of those near it the one whose link is brightest and straightest on.
static int parent_of(const Tracker *t, const RbtPaint *paint, const RbtLimb *limb, const Cylinder *first)
{
    int inside = rbt_paint_node(paint, first->center);
    (void)limb;
    return inside >= 0 && tracker_node_around(t, first->center, 1) >= 0 ? inside : tracker_attachment(t, first->center, t->tree.count);
}

// Appends back turned round, then out, without what lies inside other tubes. False: out of memory.
static bool adopt(Tracker *t, RbtPaint *paint, const RbtLimb *limb, const Found *found, RbtEnds *ends)
{
    int total = found->back.count - 1 + found->out.count, first = 0, last = total - 1, before = t->tree.count, number = ends->count;
    const TrackNode **node = malloc((size_t)total * sizeof *node);
    const Vec3 **point = malloc((size_t)total * sizeof *point);
    bool good = node && point;
    for (int i = 0; good && i < total; i++) {   // the first node of the way back is that of the way out, seen the other way
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
        // one vessel may be met by two limbs: the second ends where the first is
        int outside = seed;
        while (outside < total && !is_painted(paint, node[outside]->cylinder.center))
            outside++;
        last = outside - 1;
        double length = 0;
        for (int i = first + 1; i <= last; i++)
            length += vec3_distance(node[i]->cylinder.center, node[i - 1]->cylinder.center);
        if (last >= seed && length >= fmax(3 * t->voxel, found->radius)) {
            int parent = parent_of(t, paint, limb, &node[first]->cylinder);
            for (int i = first; good && i <= last; i++) {
                TrackNode copy = *node[i];
                if (i < found->back.count - 1)
                    copy.cylinder.axis = vec3_negate(copy.cylinder.axis);
                copy.branch = number;
                copy.parent = i > first ? t->tree.count - 1 : parent;
                good = track_append(&t->tree, &copy, point[i]);
            }
            good = good && rbt_ends_add(ends, last < total - 1 ? "runs into another branch" : found->why);
            if (good)
                rbt_paint_nodes(paint, &t->tree, before, t->tree.count);
        }
    }
    free(node);
    free(point);
    return good || total == 0;
}

// One round over branches whose nodes are first … end-1. False: out of memory.
static bool grow_round(Tracker *t, RbtPaint *paint, int first, int end, double share, double noise, int threads, RbtEnds *ends)
{
    int count = 0;
    RbtLimb *limb = rbt_find_limbs(t, paint, first, end, share, noise, &count);
    if (count < 0)
        return false;
    Found *found = calloc((size_t)count + 1, sizeof *found), **order = malloc(((size_t)count + 1) * sizeof *order);
    bool good = found && order;
    if (good) {
        Round round = {t, paint, limb, found, share, noise};
        parallel_for(threads, count, track_limb, &round, NULL);
        for (int i = 0; i < count; i++)
            order[i] = &found[i];
        qsort(order, (size_t)count, sizeof(*order), compare_found);
        for (int i = 0; good && i < count; i++)
            if (order[i]->good)
                good = adopt(t, paint, &limb[order[i]->limb], order[i], ends);
    }
    for (int i = 0; found && i < count; i++) {
        track_free(&found[i].out);
        track_free(&found[i].back);
    }
    free(found);
    free(order);
    free(limb);
    return good;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Standard deviation of the spline's values in the background, from the median of their distances to its median: vessels are few.
static double noise_of(const Tracker *t)
{
    enum { SAMPLES = 20000 };
    const int *size = t->volume->size;
    size_t voxels = (size_t)size[0] * (size_t)size[1] * (size_t)size[2], stride = voxels / SAMPLES + 1;
    double value[SAMPLES];
    int n = 0;
    for (size_t i = 0; i < voxels && n < SAMPLES; i += stride)
        value[n++] = (double)bspline_sample(t->volume, vec3((double)(i % (size_t)size[0]), (double)(i / (size_t)size[0] % (size_t)size[1]),
                                                            (double)(i / ((size_t)size[0] * (size_t)size[1]))));
    qsort(value, (size_t)n, sizeof *value, compare_doubles);
    double middle = value[n / 2];
    for (int i = 0; i < n; i++)
        value[i] = fabs(value[i] - middle);
    qsort(value, (size_t)n, sizeof *value, compare_doubles);
    return 1.4826 * value[n / 2];
}

bool rbt_grow_branches(Tracker *t, RbtPaint *paint, int first, int threads, const Progress *progress, RbtEnds *ends)
{
    const double share[] = {0.5, 0.5 * (0.5 + t->parameters->residue), t->parameters->residue};
    double noise = 4 * noise_of(t);
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

// An excluded vessel of `not` is called a rival here. Its branches are grown in the same rounds as the tree's, widest first, and a limb ends where it reaches
// a vessel tracked before: so every vessel belongs to the tree that reaches it through the wider path. Only the first branches of both, which are tracked
// independently, are divided here.
#include "recon/track/rbt_limits.h"
#include "recon/track/rbt_start.h"
#include "recon/track/rbt_start_check.h"
#include "recon/track/rbt_trunk.h"

#include <stdlib.h>
#include <string.h>

enum { RIVAL_STREAM = 1 << 20 };     // stream of random numbers

static Vec3 point_of(const Tracker *t, const RbtRegion *region) { return region->is_voxel ? volume_point_of(t->volume, region->center) : region->center; }

// Finds the vessel at a given point. Returns false with a fault if the point is not in a vessel; `what` is the key in the trace file.
static bool vessel_at(Tracker *t, const RbtRegion *region, const char *what, const char *path, Faults *faults, RbtSeed *seed, Cylinder *out)
{
    double rate;
    *seed = (RbtSeed){.start = point_of(t, region), .line = region->line, .column = region->column};
    Vec3 x = seed->start;
    if (!tracker_is_inside(t->volume, x)) {
        faults_add(faults, path, region->line, region->column, "the point of `%s` (%g, %g, %g) mm lies outside the volume; expected a point inside a vessel",
                   what, x.x, x.y, x.z);
        return false;
    }
    Cylinder tube[RBT_SCANS];
    bool found = !t->is_noisy && tracker_brightness(t, x) >= t->dark && rbt_estimate_start(t, seed, out, &rate);
    if (!found && !t->out_of_memory && rbt_stands_out(t, t->levels, seed)) {
        found = rbt_scan(t, t->levels, x, 0, NULL, tube) > 0;
        *out = tube[0];
    }
    if (!found && !t->out_of_memory)
        faults_add(faults, path, region->line, region->column, "the point of `%s` (%g, %g, %g) mm lies in no vessel; expected a point well inside one", what,
                   x.x, x.y, x.z);
    return found;
}

bool rbt_place_stops(Tracker *t, Vec3 start, const char *path, Faults *faults)
{
    const RbtParameters *p = t->parameters;
    bool good = true;
    t->stop = calloc((size_t)p->until_count + 1, sizeof *t->stop);
    if (!t->stop)
        return false;
    RbtStop *stop = t->stop;
    for (int i = 0; i < p->until_count && !t->out_of_memory; i++) {
        RbtSeed seed;
        Cylinder c;
        if (!vessel_at(t, &p->until[i], "until", path, faults, &seed, &c)) {
            good = false;
            continue;
        }
        Vec3 q = vec3_sub(seed.start, c.center);
        // the disc lies at the point itself, not at the best-fitting cylinder
        *stop = (RbtStop){vec3_add_scaled(c.center, vec3_dot(q, c.axis), c.axis), c.axis, 1.5 * c.radius + t->voxel, fmax(0.5 * c.radius, t->voxel)};
        if (vec3_distance(start, stop->center) < 2 * stop->half) {
            faults_add(faults, path, seed.line, seed.column,
                       "the point of `until` (%g, %g, %g) mm lies at the first start; expected a point further along the vessel", seed.start.x, seed.start.y,
                       seed.start.z);
            good = false;
        }
        stop++;
    }
    t->stop_count = (int)(stop - t->stop);
    return good && !t->out_of_memory;
}

// --- rivals ---

// Returns the node of a chain nearest to x, or -1 if x lies outside its tube.
static int node_at(const TrackNode *node, int count, Vec3 x, double share)
{
    int best = -1;
    for (int i = 0; i < count; i++)
        if (vec3_distance(x, node[i].cylinder.center) < share * node[i].cylinder.radius &&
            (best < 0 || vec3_distance(x, node[i].cylinder.center) < vec3_distance(x, node[best].cylinder.center)))
            best = i;
    return best;
}

// Returns the narrowest node between `from` and `to` (in either order) that is two radii away from both, or the middle one if there is none.
static int narrowest_between(const TrackNode *node, int from, int to)
{
    int low = from < to ? from : to, high = from < to ? to : from, best = (low + high) / 2;
    double least = HUGE_VAL;
    for (int i = low; i <= high; i++) {
        double r = node[i].cylinder.radius;
        bool is_free = vec3_distance(node[i].cylinder.center, node[low].cylinder.center) > 2 * r &&
                       vec3_distance(node[i].cylinder.center, node[high].cylinder.center) > 2 * r;
        if (is_free && r < least) {
            least = r;
            best = i;
        }
    }
    return best;
}

// Keeps only nodes low … high; node `low` becomes the root.
static bool keep_range(Track *chain, int low, int high)
{
    bool *keep = malloc(((size_t)chain->count + 1) * sizeof *keep);
    int *place = malloc(((size_t)chain->count + 1) * sizeof *place);
    bool good = keep && place;
    for (int i = 0; good && i < chain->count; i++) {
        keep[i] = i >= low && i <= high;
        place[i] = 0;
    }
    if (good) {
        chain->node[low].parent = -1;
        track_keep(chain, keep, place);
    }
    free(keep);
    free(place);
    return good;
}

// Cuts the chain on both sides of `seed` where it enters the tube of the other one.
static bool end_at_tube(Track *chain, int seed, const Track *other)
{
    int low = seed, high = seed;
    while (low > 0 && node_at(other->node, other->count, chain->node[low - 1].cylinder.center, 1) < 0)
        low--;
    while (high + 1 < chain->count && node_at(other->node, other->count, chain->node[high + 1].cylinder.center, 1) < 0)
        high++;
    return keep_range(chain, low, high);
}

// Cuts a chain at node `at` and keeps the side of `seed`.
static bool cut_beyond(Track *chain, int seed, int at)
{
    return at > seed ? keep_range(chain, 0, at - 1) : at < seed ? keep_range(chain, at + 1, chain->count - 1) : true;
}

// Returns the nearest node, at any distance.
static int nearest_node(const Track *chain, Vec3 x) { return node_at(chain->node, chain->count, x, HUGE_VAL); }

static bool divide(Track *wanted, Vec3 start, Track *rival, Vec3 point)
{
    int own = nearest_node(wanted, start), theirs = nearest_node(rival, point), passed = node_at(wanted->node, wanted->count, point, 1),
        passes = node_at(rival->node, rival->count, start, 1);
    if (passed >= 0 || passes >= 0) {
        // one vessel contains both points: divide it at its narrowest place between them
        const Track *both = passed >= 0 ? wanted : rival;
        int at = passed >= 0 ? narrowest_between(both->node, own, passed) : narrowest_between(both->node, passes, theirs);
        Vec3 border = both->node[at].cylinder.center;
        int here = node_at(wanted->node, wanted->count, border, 1), there = node_at(rival->node, rival->count, border, 1);
        if ((here >= 0 && !cut_beyond(wanted, own, here)) || (there >= 0 && !cut_beyond(rival, theirs, there)))
            return false;
    }
    // where they still touch, the wanted vessel ends at the rival's tube
    return end_at_tube(wanted, nearest_node(wanted, start), rival);
}

bool rbt_add_rival(Tracker *t, const RbtRegion *point, Vec3 start, int number, const char *path, Faults *faults)
{
    RbtSeed seed;
    Cylinder c;
    char before[sizeof t->start];
    Track wanted = t->tree, rival = {0};
    if (!vessel_at(t, point, "not", path, faults, &seed, &c))
        return false;
    if (vec3_distance(start, seed.start) < 2 * c.radius) {
        faults_add(faults, path, point->line, point->column,
                   "the point of `not` (%g, %g, %g) mm lies %.2f mm from the first start; expected at least %.2f mm, two radii", seed.start.x, seed.start.y,
                   seed.start.z, vec3_distance(start, seed.start), 2 * c.radius);
        return false;
    }
    t->random = random_from_seed((uint64_t)t->parameters->seed, (uint64_t)(RIVAL_STREAM + number));
    memcpy(before, t->start, sizeof before);
    t->tree = (Track){0};
    bool found = tracker_both_ways(t, &seed, &c, number);
    rival = t->tree;
    t->tree = wanted;
    memcpy(t->start, before, sizeof before);
    if (!found && !t->out_of_memory)
        faults_add(faults, path, point->line, point->column,
                   "nothing could be tracked from the point of `not` (%g, %g, %g) mm; expected a point well inside a vessel", seed.start.x, seed.start.y,
                   seed.start.z);
    // only the first branch is divided; nodes of earlier rivals follow it in the list
    int first = 0;
    while (first < t->tree.count && t->tree.node[first].branch == 0)
        first++;
    if (found && first == t->tree.count) {
        t->out_of_memory = !divide(&t->tree, start, &rival, seed.start);
    } else if (found) {

        Track chain = {0}, rest = {0};
        for (int i = 0; i < t->tree.count && !t->out_of_memory; i++)
            t->out_of_memory = !track_append(i < first ? &chain : &rest, &t->tree.node[i], t->tree.point + t->tree.node[i].point_start);
        t->out_of_memory = t->out_of_memory || !divide(&chain, start, &rival, seed.start);
        for (int i = 0; i < rest.count && !t->out_of_memory; i++) {
            TrackNode node = rest.node[i];
            node.parent = node.parent < 0 ? -1 : chain.count - 1;
            t->out_of_memory = !track_append(&chain, &node, rest.point + rest.node[i].point_start);
        }
        track_free(&t->tree);
        track_free(&rest);
        t->tree = chain;
    }
    for (int i = 0; found && i < rival.count && !t->out_of_memory; i++) {
        TrackNode node = rival.node[i];
        node.branch = number;
        node.parent = i > 0 ? t->tree.count - 1 : -1;
        t->out_of_memory = !track_append(&t->tree, &node, rival.point + node.point_start);
    }
    track_free(&rival);
    return found && !t->out_of_memory;
}

bool rbt_drop_rivals(Tracker *t, int *branches, double *length)
{
    Track *tree = &t->tree;
    bool *keep = malloc((size_t)tree->count * sizeof *keep);
    int *place = malloc((size_t)tree->count * sizeof *place), last = -1;
    *branches = 0;
    *length = 0;
    for (int i = 0; keep && place && i < tree->count; i++) {
        int parent = tree->node[i].parent;
        keep[i] = parent < 0 ? i == 0 : keep[parent];
        if (keep[i])
            continue;
        *branches += tree->node[i].branch != last;
        last = tree->node[i].branch;
        *length += parent >= 0 ? vec3_distance(tree->node[i].cylinder.center, tree->node[parent].cylinder.center) : 0;
    }
    bool good = keep && place;
    if (good)
        track_keep(tree, keep, place);
    free(keep);
    free(place);
    return good;
}

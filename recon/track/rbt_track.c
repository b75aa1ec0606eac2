// Builds the tree from its seeds: clicked branches, branches found from them, aneurysms, cuts and links, and the report.
#include "recon/track/rbt_track.h"

#include "base/base.h"
#include "recon/track/cast_rays.h"
#include "recon/track/ransac_cylinder.h"
#include "recon/track/rbt_aneurysm.h"
#include "recon/track/rbt_branch.h"
#include "recon/track/rbt_branches.h"
#include "recon/track/rbt_limits.h"
#include "recon/track/rbt_links.h"
#include "recon/track/rbt_loops.h"
#include "recon/track/rbt_ostia.h"
#include "recon/track/rbt_residue.h"
#include "recon/track/rbt_sac_start.h"
#include "recon/track/rbt_scan.h"
#include "recon/track/rbt_start_check.h"
#include "recon/track/rbt_trunk.h"
#include "recon/volume/bspline.h"
#include "recon/volume/ct_soft_tissue.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Fills in the report of a branch. Nodes of a branch are consecutive; a later aneurysm may have merged some of them. Nodes of links are counted but not used
// for the vessel's statistics.
static void report_branch(const Tracker *t, int number, double p_inl, RbtBranchReport *report)
{
    int first = t->tree.count, end = 0, links = 0;
    for (int i = 0; i < t->tree.count; i++)
        if (t->tree.node[i].branch == number) {
            first = i < first ? i : first;
            end = i + 1;
            links += t->tree.node[i].is_link;
        }
    report->first_node = first;
    report->node_count = end - first;
    report->link_count = links;
    int sacs = 0, tracked = end - first - links;
    double sac_radius = 0, widest = 0;
    report->inlier_rate_min = 1;
    for (int i = first; i < end; i++) {
        const TrackNode *n = &t->tree.node[i];
        if (n->parent >= 0)
            report->length += vec3_distance(n->cylinder.center, t->tree.node[n->parent].cylinder.center);
        if (n->is_link)
            continue;
        report->inlier_rate += n->inlier_rate / tracked;
        report->inlier_rate_min = fmin(report->inlier_rate_min, n->inlier_rate);
        report->relaxed_count += n->inlier_rate <= p_inl;
        report->retried_count += n->retried;
        report->junction_count += n->is_junction;
        bool is_sac = n->kind == NODE_ANEURYSM;
        sacs += is_sac;
        sac_radius += is_sac ? n->cylinder.radius : 0;
        report->radius += n->cylinder.radius / tracked;
        if (!is_sac || n->cylinder.radius > widest)   // the widest of an aneurysm's centres represents it
            report->center = n->cylinder.center;
        widest = is_sac ? fmax(widest, n->cylinder.radius) : widest;
    }
    if (sacs > 0)
        report->radius = sac_radius / sacs;
}

// Finds the nearest point of the centreline and its node, for the projection of section 3.3.
static int project_to_tree(const Tracker *t, Vec3 x, Vec3 *foot)
{
    int node = 0;
    double least = HUGE_VAL;
    for (int i = 0; i < t->tree.count; i++) {
        const TrackNode *n = &t->tree.node[i];
        Vec3 a = n->cylinder.center, b = n->parent >= 0 ? t->tree.node[n->parent].cylinder.center : a, ab = vec3_sub(b, a);
        double l2 = vec3_norm2(ab), s = l2 > 0 ? fmax(0, fmin(1, vec3_dot(vec3_sub(x, a), ab) / l2)) : 0, d = vec3_distance(x, vec3_add_scaled(a, s, ab));
        if (d < least) {
            least = d;
            node = i;
            *foot = vec3_add_scaled(a, s, ab);
        }
    }
    return node;
}

// Tracks seed `number`. With a `toward`: from its start, and for further branches also back to the parent. Without: as in section 3.3, from just outside the
// parent's wall; if nothing is found there (the point was set far along the branch), from the point itself in both directions.
static bool track_seed(Tracker *t, const RbtSeed *seed, int number)
{
    Track out = {0}, back = {0};
    bool is_first = t->tree.count == 0, both_ways = !is_first;
    Cylinder start = {.center = seed->start, .radius = seed->radius};
    t->random = random_from_seed((uint64_t)t->parameters->seed, (uint64_t)number);
    if (seed->has_toward)
        start.axis = vec3_unit(vec3_sub(seed->toward, seed->start));
    if (is_first && (!seed->has_toward || !(seed->radius > 0))) {
        if (!rbt_first_start(t, t->levels, seed, &start))
            return false;
        if (!seed->has_toward)
            return tracker_both_ways(t, seed, &start, number);
        tracker_report_start(t, seed, &start, "the root is the start");
    }
    if (is_first && seed->has_toward && seed->radius > 0 && !rbt_suit_given(t, t->levels, &start))
        return false;
    if (!is_first) {
        Vec3 foot = seed->start;
        int parent = project_to_tree(t, seed->start, &foot);
        Vec3 away = vec3_unit_or(vec3_sub(seed->start, foot), t->tree.node[parent].cylinder.axis);
        double parent_radius = t->tree.node[parent].cylinder.radius;
        if (!(start.radius > 0))
            start.radius = parent_radius;
        if (!seed->has_toward) {
            Cylinder beside = {.center = vec3_add_scaled(foot, 1.25 * parent_radius, away), .radius = start.radius, .axis = away};
            start.axis = away;
            tracker_run(t, &beside, &out, false);
            both_ways = out.count < 3;
            if (both_ways)
                track_free(&out);
        }
    }
    if (out.count == 0)
        tracker_run(t, &start, &out, false);
    const char *why = t->why;
    if (is_first && seed->has_toward && seed->radius > 0 && out.count > 0 && !rbt_check_given(t, t->levels, seed, &out.node[0])) {
        track_free(&out);
        return false;
    }
    if (both_ways && out.count > 0 && !t->out_of_memory) {
        Cylinder behind = out.node[0].cylinder;
        behind.axis = vec3_negate(behind.axis);
        Track reverse = {0};
        tracker_run(t, &behind, &reverse, true);
        // its first node is the branch's own first node in the opposite direction
        for (int i = 1; i < reverse.count && !t->out_of_memory; i++)
            t->out_of_memory = !track_append(&back, &reverse.node[i], reverse.point + reverse.node[i].point_start);
        track_free(&reverse);
    }
    t->why = why;
    bool found = out.count > 0 && !t->out_of_memory;
    if (found)
        t->out_of_memory = !tracker_adopt(t, &out, &back, number);
    track_free(&out);
    track_free(&back);
    return found;
}

// --- the whole tree ---

// Brightness range of a million samples: `low` is the first quartile, which is background (vessels fill less than three quarters of any angiogram), `high`
// the 99.9th percentile. The extremes would be noise or metal: with them half of a noisy background was taken for vessel.
static void brightness_range(const Volume *volume, double *low, double *high)
{
    enum { BINS = 1 << 12 };
    static const double share[2] = {0.25, 0.999};
    long count[BINS] = {0}, total = 0, sum = 0;
    size_t voxels = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2], stride = voxels / 1000003 + 1;
    double least = (double)volume->minimum, width = ((double)volume->maximum - least) / BINS;
    for (size_t i = 0; i < voxels && width > 0; i += stride, total++)
        count[(int)fmin(((double)volume->value[i] - least) / width, BINS - 1)]++;
    *low = *high = least;
    for (int bin = 0; bin < BINS; bin++) {
        sum += count[bin];
        if ((double)sum < share[0] * (double)total)
            *low = least + (bin + 1) * width;
        if ((double)sum < share[1] * (double)total)
            *high = least + (bin + 1) * width;
    }
}

// `seed` is NULL for points other than starts.
static bool check_point(Tracker *t, Vec3 x, const RbtSeed *seed, const char *what, int line, int column, const char *path, Faults *faults)
{
    Vec3 v = volume_voxel_of(t->volume, x);
    const int *size = t->volume->size;
    if (!tracker_is_inside(t->volume, x)) {
        faults_add(faults, path, line, column,
                   "%s (%g, %g, %g) mm, voxel (%.1f, %.1f, %.1f), lies outside the volume; expected voxel (0, 0, 0) to (%d, %d, %d)", what, x.x, x.y, x.z, v.x,
                   v.y, v.z, size[0] - 1, size[1] - 1, size[2] - 1);
        return false;
    }
    double value = tracker_brightness(t, x), low = (double)t->volume->minimum, high = (double)t->volume->maximum;
    if (!(high > low) || (value < fmax(low + 0.1 * (high - low), t->dark) && !(seed ? rbt_stands_out(t, t->levels, seed) : t->is_noisy))) {
        faults_add(faults, path, line, column,
                   "%s (%g, %g, %g) mm, voxel (%.1f, %.1f, %.1f), lies on background (%g in a volume of %g to %g); expected a point inside a vessel, above %g",
                   what, x.x, x.y, x.z, v.x, v.y, v.z, value, low, high, fmax(low + 0.1 * (high - low), t->dark));
        return false;
    }
    return true;
}

static bool check_seed(Tracker *t, RbtSeed *seed, int number, const char *path, Faults *faults)
{
    char what[64];
    int before = faults->count;
    snprintf(what, sizeof what, "the start of branch %d", number + 1);
    check_point(t, seed->start, seed, what, seed->line, seed->column, path, faults);
    if (tracker_is_forbidden(t, seed->start))
        faults_add(faults, path, seed->line, seed->column, "the start of branch %d lies in a region of `forbid`; expected a start outside it", number + 1);
    if (seed->has_toward && !(vec3_distance(seed->start, seed->toward) > 1e-6 * t->voxel))
        faults_add(faults, path, seed->line, seed->column,
                   "the start and the toward of branch %d are the same point; expected a toward further down the vessel", number + 1);
    double extent = 0;
    for (int i = 0; i < 3; i++)
        extent = fmax(extent, vec3_norm(t->volume->axis[i]) * t->volume->size[i]);
    if (seed->radius > extent / 2)
        faults_add(faults, path, seed->line, seed->column, "the radius %g mm of branch %d is larger than the volume; expected at most %g mm", seed->radius,
                   number + 1, extent / 2);
    return faults->count == before;
}

// A start on bone that is left out.
static bool check_bone(const Tracker *t, const Volume *whole, const RbtSeed *seed, int number, const char *path, Faults *faults)
{
    const double value = tracker_is_inside(whole, seed->start) ? (double)bspline_sample(whole, volume_voxel_of(whole, seed->start)) : 0;
    if (t->volume == whole || !(t->parameters->bone_hu > 0) || value < t->parameters->bone_hu || tracker_brightness(t, seed->start) >= t->parameters->bone_hu)
        return true;
    faults_add(faults, path, seed->line, seed->column,
               "the start of branch %d (%g, %g, %g) mm has %.0f HU as bone has (vessels with contrast agent: 150 to 600), and bone above %.0f HU is left out; "
               "expected a point in a vessel, or bone_hu above the vessel's CT number (0: nothing is bone)",
               number + 1, seed->start.x, seed->start.y, seed->start.z, value, t->parameters->bone_hu);
    return false;
}

static RbtSeed seed_in_mm(const Volume *volume, const RbtSeed *given)
{
    RbtSeed seed = *given;
    seed.start = tracker_in_mm(volume, given->start, given->start_is_voxel);
    seed.toward = tracker_in_mm(volume, given->toward, given->toward_is_voxel);
    seed.start_is_voxel = seed.toward_is_voxel = false;
    return seed;
}

static VesselTree *finish_tree(const Track *track)
{
    int64_t points = 0, used = 0;
    for (int i = 0; i < track->count; i++)   // merging nodes left unused points
        points += track->node[i].point_count;
    VesselTree *tree = vessel_tree_create(track->count, points, 0);
    if (!tree)
        return NULL;
    for (int i = 0; i < track->count; i++) {
        const TrackNode *n = &track->node[i];
        tree->center[i] = n->cylinder.center;
        tree->radius[i] = n->cylinder.radius;
        tree->direction[i] = n->cylinder.axis;
        tree->height[i] = n->cylinder.height;
        tree->parent[i] = n->parent;
        tree->kind[i] = (uint8_t)n->kind;
        tree->point_offset[i] = used;
        if (n->point_count > 0)
            memcpy(tree->point + used, track->point + n->point_start, (size_t)n->point_count * sizeof *tree->point);
        used += n->point_count;
    }
    tree->point_offset[track->count] = used;
    if (!vessel_tree_link(tree)) {
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

typedef struct Job {         // arguments of rbt_track
    RbtSeed *seed;
    int seed_count;
    const RbtAneurysm *aneurysm;
    Vec3 **center;           // (aneurysm_count) [mm]
    int aneurysm_count, threads;
    const Progress *progress;
    const char *path;
    Faults *faults;
} Job;

static bool out_of_memory_at(const Job *job, int number)
{
    faults_add(job->faults, job->path, 0, 0, "out of memory at branch %d", number + 1);
    return false;
}

static bool start_is_refused(const Tracker *t, const RbtSeed *seed, int number, const char *path, Faults *faults)
{
    faults_add(faults, path, seed->line, seed->column, "the start of branch %d (%g, %g, %g) mm: %s", number + 1, seed->start.x, seed->start.y, seed->start.z,
               t->refusal);
    return false;
}

static bool run_seed(Tracker *t, const Job *job, int i)
{
    if (track_seed(t, &job->seed[i], i)) {
        if (i == 0)
            rbt_judge_branch(t, t->levels, t->tree.count);
        return true;
    }
    if (t->out_of_memory)
        return out_of_memory_at(job, i);
    if (t->refusal[0])
        return start_is_refused(t, &job->seed[i], i, job->path, job->faults);
    faults_add(job->faults, job->path, job->seed[i].line, job->seed[i].column,
               "nothing could be tracked from the start of branch %d (%s); expected a point well inside a vessel and, if "
               "they are given, about its radius and direction",
               i + 1, t->why);
    return false;
}

// The first branch. If its start lies in a sac, it is tracked again from the vessel beside it; if nothing is found there, it stays.
static bool run_first_seed(Tracker *t, const Job *job)
{
    RbtSeed *seed = &job->seed[0];
    const RbtSeed given = *seed;
    SacStart sac;
    if (!run_seed(t, job, 0))
        return false;
    if (given.has_toward || given.radius > 0 || !rbt_starts_in_sac(t, given.start, &sac))
        return true;
    const Track through = t->tree;
    const RbtStartCheck check = t->check;
    const char *why = t->why;
    const int before = job->faults->count;
    t->tree = (Track){0};
    for (int i = 0; i < sac.count && !t->out_of_memory; i++) {
        track_free(&t->tree);
        t->scan_count = -1;
        t->refusal[0] = 0;
        seed->start = sac.vessel[i];
        if (run_seed(t, job, 0) && rbt_is_vessel_of_sac(t, &sac)) {
            Track dropped = through;
            track_free(&dropped);
            rbt_report_sac_start(t, given.start, sac.radius, sac.vessel[i]);
            job->faults->count = before;
            return true;
        }
    }
    track_free(&t->tree);
    t->tree = through, t->check = check, t->why = why, *seed = given;
    t->refusal[0] = 0;
    job->faults->count = t->out_of_memory ? job->faults->count : before;
    return !t->out_of_memory;
}

// Lists the branches in the order of their nodes: a branch attached to a later one comes after it. Returns how many have nodes.
static int order_branches(const Track *tree, int total, int *order)
{
    int count = 0;
    for (int i = 0; i < tree->count; i++)
        if (count < total && (i == 0 || tree->node[i].branch != tree->node[i - 1].branch))
            order[count++] = tree->node[i].branch;
    return count;
}

// Moves the junctions into the report, with the report's branch numbers.
static void report_junctions(RbtJunctions *junctions, const int *renamed, RbtReport *report)
{
    for (int i = 0; i < junctions->count; i++) {
        RbtJunction *j = &junctions->junction[i];
        j->branch = j->support == RBT_REFUSED && !j->is_inner ? -1 : renamed[j->branch];
        j->parent = renamed[j->parent];
    }
    report->junction = junctions->junction;
    report->junction_count = junctions->count;
    *junctions = (RbtJunctions){0};
}

// Writes the report. Branches that lost all of their nodes are omitted.
static bool make_report(Tracker *t, const Job *job, const RbtEnds *ends, RbtJunctions *junctions, RbtReport *report)
{
    int total = ends->count + job->aneurysm_count;
    int *renamed = malloc(((size_t)total + 1) * sizeof *renamed), *order = malloc(((size_t)total + 1) * sizeof *order);
    report->branch = calloc((size_t)total + 1, sizeof *report->branch);
    bool good = renamed && order && report->branch;
    int count = good ? order_branches(&t->tree, total, order) : 0;
    for (int i = 0; good && i < total; i++)
        renamed[i] = -1;
    for (int k = 0; good && k < count; k++) {
        int i = order[k];
        RbtBranchReport *b = &report->branch[k];
        *b = (RbtBranchReport){.is_aneurysm = i >= ends->count, .is_found = i < ends->count && ends->seed[i] < 0, .parent = -1, .order = 1};
        report_branch(t, i, t->parameters->p_inl, b);
        renamed[i] = k;
        if (b->is_aneurysm)
            memcpy(b->name, job->aneurysm[i - ends->count].name, sizeof b->name);
        else if (!b->is_found)
            memcpy(b->name, job->seed[ends->seed[i]].name, sizeof b->name);
        b->is_aneurysm = b->is_aneurysm || t->tree.node[b->first_node + b->node_count - 1].kind == NODE_ANEURYSM;
        snprintf(b->end, sizeof b->end, "%s", i < ends->count && ends->why[i] && !b->is_aneurysm ? ends->why[i] : "");
        int parent = t->tree.node[b->first_node].parent;
        if (parent >= 0) {
            b->parent = renamed[t->tree.node[parent].branch];
            b->order = b->parent >= 0 ? report->branch[b->parent].order + 1 : 1;
        }
    }
    report->branch_count = count;
    if (good)
        report_junctions(junctions, renamed, report);
    free(renamed);
    free(order);
    return good;
}

// Distance from x to node i and to the part of its link outside its parent's lumen: a cut there belongs to the node's own branch.
static double distance_to_node(const Tracker *t, int i, Vec3 x)
{
    const TrackNode *n = &t->tree.node[i];
    double least = vec3_distance(x, n->cylinder.center);
    if (n->parent >= 0 && t->tree.node[n->parent].branch != n->branch) {
        Cylinder p = t->tree.node[n->parent].cylinder;
        double gap = vec3_distance(p.center, n->cylinder.center);
        Vec3 wall = vec3_mix(p.center, n->cylinder.center, gap > 0 ? fmin(1, p.radius / gap) : 1);
        least = fmin(least, tracker_segment_distance(x, wall, n->cylinder.center));
    }
    return least;
}

// After a cut the rest of a branch is removed too if it extends less than two of its radii outside its parent's wall.
static void drop_stub(const Track *tree, int branch, bool *keep)
{
    int first = 0, last = -1;
    while (first < tree->count && tree->node[first].branch != branch)
        first++;
    for (int i = first; i < tree->count && tree->node[i].branch == branch; i++)
        last = keep[i] ? i : last;
    if (first >= tree->count || last < 0 || tree->node[first].parent < 0)
        return;
    const Cylinder *tip = &tree->node[last].cylinder;
    if (-rbt_depth_in_vessel(tree, tree->node[first].parent, tip->center) < 2 * tip->radius)
        for (int i = first; i <= last; i++)
            keep[i] = false;
}

// Removes each branch from the node nearest to a cut point onwards, with its subtree. Returns false with a fault if a point is not on a branch.
static bool make_cuts(Tracker *t, const Job *job)
{
    Track *tree = &t->tree;
    bool *keep = malloc((size_t)tree->count * sizeof *keep), good = keep != NULL;
    int *place = malloc((size_t)tree->count * sizeof *place);
    good = good && place;
    if (!good)
        faults_add(job->faults, job->path, 0, 0, "out of memory");
    for (int i = 0; good && i < tree->count; i++)
        keep[i] = true;
    for (int k = 0; good && k < t->parameters->cut_count; k++) {
        const RbtRegion *cut = &t->parameters->cut[k];
        Vec3 x = tracker_in_mm(t->volume, cut->center, cut->is_voxel);
        int nearest = 0;
        double distance = HUGE_VAL;
        for (int i = 0; i < tree->count; i++) {
            double d = distance_to_node(t, i, x);
            if (d < distance) {
                nearest = i;
                distance = d;
            }
        }
        double radius = tree->node[nearest].cylinder.radius;
        if (nearest == 0 || distance > 2 * radius + 3 * t->voxel) {
            faults_add(job->faults, job->path, cut->line, cut->column, "the cut at (%g, %g, %g) mm %s; expected a point on the branch to cut", x.x, x.y, x.z,
                       nearest == 0 ? "would remove the whole tree" : "is not on a branch");
            good = false;
        } else {
            keep[nearest] = false;
            for (int i = nearest + 1; i < tree->count && tree->node[i].branch == tree->node[nearest].branch; i++)
                keep[i] = keep[i] && keep[tree->node[i].parent];
            drop_stub(tree, tree->node[nearest].branch, keep);
        }
    }
    for (int i = 0; good && i < tree->count; i++)
        if (tree->node[i].parent >= 0 && !keep[tree->node[i].parent])
            keep[i] = false;
    if (good)
        track_keep(tree, keep, place);
    free(keep);
    free(place);
    return good;
}

// Removes stubs: found branches that end in front of a forbidden region before they have left their parent. Returns false if out of memory.
static bool drop_forbidden_stubs(Tracker *t, const RbtEnds *ends)
{
    Track *tree = &t->tree;
    bool *keep = malloc((size_t)tree->count * sizeof *keep);
    int *place = malloc((size_t)tree->count * sizeof *place);
    bool good = keep && place;
    for (int i = 0; good && i < tree->count; i++)
        keep[i] = true;
    for (int b = 0; good && b < ends->count; b++)
        if (ends->seed[b] < 0 && ends->why[b] == rbt_enters_forbidden)
            drop_stub(tree, b, keep);
    for (int i = 0; good && i < tree->count; i++)
        keep[i] = keep[i] && (tree->node[i].parent < 0 || keep[tree->node[i].parent]);
    if (good)
        track_keep(tree, keep, place);
    free(keep);
    free(place);
    return good;
}

// Returns true if a node of the tree lies on this start: the branch was already found.
static bool is_found_already(const Tracker *t, const RbtSeed *seed) { return tracker_node_around(t, seed->start, 1) >= 0; }

// Grows branches from the nodes `first` and later.
static bool grow(Tracker *t, const Job *job, RbtPaint *paint, int first, RbtEnds *ends)
{
    return rbt_grow_branches(t, paint, first, job->threads, job->progress, ends) || out_of_memory_at(job, ends->count);
}

// Adds the vessels given by `not`, which compete with the first branch.
static bool add_rivals(Tracker *t, const Job *job, RbtEnds *ends)
{
    if (!rbt_ends_add(ends, t->why, 0))
        return out_of_memory_at(job, 0);
    for (int i = 0; i < t->parameters->rival_count; i++) {
        if (!rbt_add_rival(t, &t->parameters->rival[i], job->seed[0].start, ends->count, job->path, job->faults))
            return t->out_of_memory ? out_of_memory_at(job, ends->count) : false;
        if (!rbt_ends_add(ends, t->why, -1))
            return out_of_memory_at(job, ends->count);
    }
    return true;
}

// Removes the subtrees of these vessels, which must not contain a branch given in the trace file.
static bool drop_rivals(Tracker *t, const Job *job, const RbtEnds *ends, RbtReport *report)
{
    if (t->parameters->rival_count == 0)
        return true;
    if (!rbt_drop_rivals(t, &report->left_out_count, &report->left_out_length))
        return out_of_memory_at(job, 0);
    for (int b = 0; b < ends->count; b++) {
        bool has_nodes = false;
        for (int i = 0; i < t->tree.count && !has_nodes; i++)
            has_nodes = t->tree.node[i].branch == b;
        if (has_nodes || ends->seed[b] < 0)
            continue;
        const RbtSeed *seed = &job->seed[ends->seed[b]];
        faults_add(job->faults, job->path, seed->line, seed->column,
                   "branch %d is attached to a vessel excluded by `not`; expected a start on the tree's own side, or another `not`", ends->seed[b] + 1);
        return false;
    }
    return true;
}

// Tracks the whole tree: all branches found from the first start, then the cuts, then the branches that the other starts add.
static bool track_automatic(Tracker *t, const Job *job, RbtEnds *ends)
{
    bool is_joined, good = run_first_seed(t, job) && add_rivals(t, job, ends) && (rbt_repair_links(t, NULL, 0, &is_joined) || out_of_memory_at(job, 0));
    RbtPaint *paint = good ? rbt_paint_create(t->volume) : NULL;
    t->paint = paint;
    good = good && (paint || out_of_memory_at(job, 0)) && grow(t, job, paint, 0, ends);
    if (good && t->parameters->cut_count > 0) {
        rbt_paint_free(paint);
        t->paint = NULL;
        good = make_cuts(t, job);
        paint = good ? rbt_paint_create(t->volume) : NULL;
        good = good && (paint || out_of_memory_at(job, 0));
        t->paint = paint;
        if (good)
            rbt_paint_nodes(paint, &t->tree, 0, t->tree.count);
    }
    for (int i = 1; good && i < job->seed_count; i++) {
        int first = t->tree.count;
        if (is_found_already(t, &job->seed[i]))
            continue;
        good = run_seed(t, job, i);
        for (int k = first; good && k < t->tree.count; k++)
            t->tree.node[k].branch = ends->count;
        good = good && ((rbt_ends_add(ends, t->why, i) && rbt_repair_links(t, paint, first, &is_joined)) || out_of_memory_at(job, i)) &&
               grow(t, job, paint, first, ends);
    }
    t->paint = NULL;
    rbt_paint_free(paint);
    return good;
}

// Models the ostia of the present tree.
static bool open_ostia(Tracker *t, const Job *job, const RbtEnds *ends, RbtJunctions *junctions)
{
    int total = ends->count + job->aneurysm_count;
    bool *is_named = malloc(((size_t)total + 1) * sizeof *is_named), good = is_named != NULL;
    for (int i = 0; good && i < total; i++)
        is_named[i] = i >= ends->count || ends->seed[i] >= 0;
    good = good && rbt_open_ostia(t, is_named, job->threads, junctions);
    free(is_named);
    return good;
}

static bool track_all(Tracker *t, const Job *job, RbtReport *report)
{
    RbtEnds ends = {0};
    RbtJunctions junctions = {0};
    bool automatic = t->parameters->automatic > 0, good = true;
    if (automatic)
        good = track_automatic(t, job, &ends);
    for (int i = 0; good && !automatic && i < job->seed_count; i++) {
        int first = t->tree.count;
        good = run_seed(t, job, i);
        for (int k = first; good && k < t->tree.count; k++)
            t->tree.node[k].branch = ends.count;
        good = good && (i == 0 ? add_rivals(t, job, &ends) : rbt_ends_add(&ends, t->why, i) || out_of_memory_at(job, i));
        if (good && job->progress && job->progress->call)
            job->progress->call(job->progress->context, i + 1, job->seed_count + job->aneurysm_count);
    }
    if (good && !automatic && t->parameters->cut_count > 0)
        good = make_cuts(t, job);
    good = good && drop_rivals(t, job, &ends, report);
    for (int i = 0; good && i < job->aneurysm_count; i++) {
        good = track_aneurysm(t, &job->aneurysm[i], job->center[i], ends.count + i, job->threads, job->faults, job->path);
        if (t->out_of_memory)
            good = out_of_memory_at(job, ends.count + i);
        if (good && job->progress && job->progress->call)
            job->progress->call(job->progress->context, job->seed_count + i + 1, job->seed_count + job->aneurysm_count);
    }
    if (good && t->parameters->forbid_count > 0 && !drop_forbidden_stubs(t, &ends))
        good = out_of_memory_at(job, ends.count);
    if (good && t->parameters->ostia > 0 && !open_ostia(t, job, &ends, &junctions))
        good = out_of_memory_at(job, ends.count);
    if (good && (!make_report(t, job, &ends, &junctions, report) || !rbt_find_loops(t, report)))
        good = out_of_memory_at(job, ends.count);
    free(junctions.junction);
    free(ends.why);
    free(ends.seed);
    return good;
}

VesselTree *rbt_track(const Volume *whole, const RbtParameters *parameters, const RbtSeed *given, int seed_count, const RbtAneurysm *aneurysm,
                      int aneurysm_count, int threads, const Progress *progress, RbtReport *report, const char *path, Faults *faults)
{
    Tracker *t = calloc(1, sizeof *t);
    RbtSeed *seed = malloc((size_t)(seed_count > 0 ? seed_count : 1) * sizeof *seed);
    Vec3 **center = calloc((size_t)(aneurysm_count > 0 ? aneurysm_count : 1), sizeof *center);
    RbtReport own = {0};
    Volume *without = volume_has_ct_numbers(whole) ? ct_soft_tissue(whole, parameters->bone_hu) : NULL;
    const Volume *volume = without ? without : whole;
    RbtLevels levels = rbt_levels_of(volume, threads);
    VesselTree *tree = NULL;
    bool good = t && seed && center && (without || !volume_has_ct_numbers(whole));
    int before = faults->count;
    for (int i = 0; good && i < aneurysm_count; i++)
        good = (center[i] = malloc((size_t)aneurysm[i].center_count * sizeof **center)) != NULL;
    if (!good)
        faults_add(faults, path, 0, 0, "out of memory");
    if (good && parameters->powell > 0 && !cylinder_refine_has_powell())
        faults_add(faults, path, 0, 0,
                   "powell: 1 (as with `parameters: paper`) needs NLopt, and this program was built without it; install libnlopt-dev and build again, or "
                   "set powell: 0, which reaches the same minimum");
    if (good && seed_count < 1)
        faults_add(faults, path, 0, 0, "there is no branch to track; expected `branches` with at least one start");
    if (good) {
        *t = (Tracker){.volume = volume,
                       .parameters = parameters,
                       .voxel = volume_voxel_size(volume),
                       .ray_count = (int)parameters->n_r,
                       .axis_count = (int)parameters->n_d,
                       .longest = HUGE_VAL,
                       .scan_count = -1};
        double low, high;
        brightness_range(volume, &low, &high);
        t->background = low;
        t->dark = low + 0.2 * (high - low);
        for (int i = 0; i < seed_count; i++)
            seed[i] = seed_in_mm(volume, &given[i]);
        sphere_directions(sphere_level_of(t->ray_count), t->ray);
        tracker_prepare_axes(t);
        t->levels = &levels;
        if (seed_count > 0 && tracker_is_inside(volume, seed[0].start) && !rbt_look_at_noise(t, &levels, &seed[0])) {
            if (t->out_of_memory)
                faults_add(faults, path, 0, 0, "out of memory");
            else
                start_is_refused(t, &seed[0], 0, path, faults);
        }
        for (int i = 0; i < seed_count; i++)
            if (check_bone(t, whole, &seed[i], i, path, faults))
                check_seed(t, &seed[i], i, path, faults);
        for (int i = 0; i < aneurysm_count; i++)
            for (int k = 0; k < aneurysm[i].center_count; k++) {
                center[i][k] = tracker_in_mm(volume, aneurysm[i].center[k], aneurysm[i].is_voxel);
                check_point(t, center[i][k], NULL, "a centre of an aneurysm", aneurysm[i].line, aneurysm[i].column, path, faults);
            }
    }
    if (good && faults->count == before && !rbt_place_stops(t, seed[0].start, path, faults) && faults->count == before)
        faults_add(faults, path, 0, 0, "out of memory");
    if (good && faults->count == before) {
        Job job = {seed, seed_count, aneurysm, center, aneurysm_count, threads, progress, path, faults};
        if (track_all(t, &job, &own) && !tracker_is_stopped_by_user(t) && !(tree = finish_tree(&t->tree)))
            faults_add(faults, path, 0, 0, "out of memory for a tree of %d nodes", t->tree.count);
        if (!tree && tracker_is_stopped_by_user(t))
            faults_add(faults, path, 0, 0, "stopped");
        memcpy(own.start, t->start, sizeof own.start);
        own.check = t->check;
    }
    rbt_levels_free(&levels);
    if (t) {
        track_free(&t->tree);
        free(t->stop);
    }
    for (int i = 0; center && i < aneurysm_count; i++)
        free(center[i]);
    volume_free(without);
    free(center);
    free(seed);
    free(t);
    if (tree && report)
        *report = own;
    else
        rbt_report_free(&own);
    return tree;
}

// Prediction, eq. (1), (2): C* = C + s h/2 d, and r, d, h stay. Estimation: rays from C* give candidate points; for axis directions in order of their
// angle with d* a RANSAC circle across each gives a cylinder, the first valid one is kept; refinement by least squares; the centre goes to the median of
// the consensus set along the axis; new rays from there give the node's points and its height. Kerrien et al. 2017, section 3.
//
// What was tried and lost: the paper as written stalls at bifurcations and beside a sac, where the consensus lies upstream and the median pulls the
// centre back to where it came from. A failed step is repeated from the last good node with longer steps, which look past such a place; then the
// radius and the contrast must agree with the vessel, or branches are invented off open ends. That does not suffice at a giant aneurysm: the natural
// way is straight on into the sac, and the tracking ends at its bottom. Where a branch swells or ends, the lumen ahead is searched for tubes that
// leave it (rbt_exits.h), and the branch goes on from the widest one that tracks.
#include "recon/track/rbt_track.h"

#include "base/heap.h"
#include "base/same_math.h"
#include "base/sort_doubles.h"
#include "recon/track/cast_rays.h"
#include "recon/track/ransac_cylinder.h"
#include "recon/track/rbt_branches.h"
#include "recon/track/rbt_exits.h"
#include "recon/track/rbt_limits.h"
#include "recon/track/rbt_links.h"
#include "recon/track/rbt_loops.h"
#include "recon/track/rbt_ostia.h"
#include "recon/track/rbt_residue.h"
#include "recon/track/rbt_start.h"
#include "recon/track/rbt_start_check.h"
#include "recon/track/rbt_tracker.h"
#include "recon/volume/bspline.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char ENTERS_FORBIDDEN[] = "enters a forbidden region";
enum { CONTRAST_MEMORY = 8, MAX_NODES = 200000, MAX_HUB_ROUNDS = 2 };

// --- growing tree ---

bool track_append(Track *track, const TrackNode *node, const Vec3 *point)
{
    if (track->count == track->capacity) {
        int capacity = track->capacity ? 2 * track->capacity : 256;
        TrackNode *grown = realloc(track->node, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        track->node = grown;
        track->capacity = capacity;
    }
    if (track->point_count + node->point_count > track->point_capacity) {
        int64_t capacity = 2 * track->point_capacity + 65536;
        Vec3 *grown = realloc(track->point, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        track->point = grown;
        track->point_capacity = capacity;
    }
    TrackNode *added = &track->node[track->count++];
    *added = *node;
    added->point_start = track->point_count;
    if (node->point_count > 0)
        memcpy(track->point + track->point_count, point, (size_t)node->point_count * sizeof *point);
    track->point_count += node->point_count;
    return true;
}

void track_free(Track *track)
{
    free(track->node);
    free(track->point);
    *track = (Track){0};
}

// --- estimation, section 3.1 ---

// Half of the sphere's vertices, +z first, then by angle with it: the directions of a RANSAC are these, turned so that +z is the predicted axis.
static void prepare_axes(Tracker *t)
{
    Vec3 all[2 * MAX_AXES];
    int level = sphere_level_of(2 * t->axis_count), used = 0;
    sphere_directions(level, all);
    // turn vertex 0 onto z, then keep the upper half; on the equator one of two opposite vertices
    Vec3 z = all[0], x = vec3_normal_to(z), y = vec3_cross(z, x);
    for (int i = 0; i < 2 * t->axis_count; i++) {
        Vec3 a = vec3(vec3_dot(all[i], x), vec3_dot(all[i], y), vec3_dot(all[i], z));
        bool upper = a.z > 1e-9 || (a.z > -1e-9 && (a.y > 1e-9 || (a.y > -1e-9 && a.x > 0)));
        if (!upper || used == t->axis_count)
            continue;
        int k = used++;
        for (; k > 0 && t->axis[k - 1].z < a.z - 1e-9; k--)   // insertion keeps the order of equals
            t->axis[k] = t->axis[k - 1];
        t->axis[k] = a;
    }
    t->axis_count = used;
}

double tracker_brightness(const Tracker *t, Vec3 point) { return (double)bspline_sample(t->volume, volume_voxel_of(t->volume, point)); }

// Lumen on the axis less the darker half of a ring outside the wall: a neighbour in contact must not hide the vessel.
static double contrast_of(const Tracker *t, const Cylinder *c)
{
    enum { RING = 16 };
    double inside = 0, ring[RING], outside = 0, radius = 1.5 * c->radius + t->voxel;
    Vec3 e1 = vec3_normal_to(c->axis), e2 = vec3_cross(c->axis, e1);
    for (int i = -1; i <= 1; i++)
        inside += tracker_brightness(t, vec3_add_scaled(c->center, 0.25 * i * c->radius, c->axis)) / 3;
    for (int i = 0; i < RING; i++) {
        double a = 2 * PI * i / RING;
        ring[i] = tracker_brightness(t, vec3_add_scaled(vec3_add_scaled(c->center, radius * same_cos(a), e1), radius * same_sin(a), e2));
    }
    sort_doubles(ring, RING);
    for (int i = 0; i < RING / 2; i++)
        outside += ring[i] / (RING / 2);
    return inside - outside;
}

// RANSAC over the axis directions in order of their angle with the predicted one: the first valid cylinder, or the best of all if that is above
// the relaxed rate. Returns its inlier rate, 0 where there is none.
static double search_axes(Tracker *t, const Cylinder *predicted, int candidates, double threshold, Cylinder *out)
{
    const RbtParameters *p = t->parameters;
    RansacOptions options = {.threshold = threshold, .radius_min = predicted->radius / 2, .radius_max = 1.5 * predicted->radius,
                             .offset_max = 1.5 * predicted->radius, .inlier_rate = p->p_inl, .trials_min = (int)p->n_min, .trials_max = (int)p->n_max};
    Vec3 z = predicted->axis, x = vec3_normal_to(z), y = vec3_cross(z, x);
    double best = 0;
    for (int i = 0; i < t->axis_count && best <= p->p_inl; i++) {
        Vec3 a = t->axis[i], axis = vec3_add(vec3_add(vec3_scale(x, a.x), vec3_scale(y, a.y)), vec3_scale(z, a.z));
        Cylinder cylinder;
        double rate = ransac_circle(t->candidate, candidates, predicted->center, vec3_unit(axis), &options, &t->random, &cylinder);
        if (rate > best) {
            best = rate;
            *out = cylinder;
        }
    }
    return best > p->relaxed * p->p_inl ? best : 0;
}

// The consensus set's median position along the axis becomes the centre; the height encloses the share of the inliers around it.
static double median_along(Tracker *t, const Cylinder *c, int inliers)
{
    for (int i = 0; i < inliers; i++)
        t->along[i] = vec3_dot(vec3_sub(t->candidate[t->inlier[i]], c->center), c->axis);
    sort_doubles(t->along, (size_t)inliers);
    return inliers % 2 ? t->along[inliers / 2] : 0.5 * (t->along[inliers / 2 - 1] + t->along[inliers / 2]);
}

// The whole of the estimation step. False where no cylinder is valid (t->why says which part failed); else t->estimate holds the node.
bool tracker_estimate(Tracker *t, const Cylinder *predicted, double relative_threshold)
{
    const RbtParameters *p = t->parameters;
    RayOptions rays = {p->ray_length * predicted->radius, (int)p->n_p, p->ray_smoothing_voxels * t->voxel, p->ray_edge};
    double threshold = fmax(relative_threshold * predicted->radius, p->r_t_voxels * t->voxel);
    int least = t->ray_count / 8;   // fewer edges than this are no tube
    Cylinder c;
    int n = cast_rays(t->volume, predicted->center, t->ray, t->ray_count, &rays, t->candidate);
    t->why = "too few rays meet a wall";
    if (n < least)
        return false;
    t->why = "no cylinder among the points";
    if (search_axes(t, predicted, n, threshold, &c) <= 0)
        return false;
    if (vec3_dot(c.axis, predicted->axis) < 0)
        c.axis = vec3_negate(c.axis);
    // refine, and select the consensus anew: the axis of the discrete set lags otherwise
    int inliers = cylinder_inliers(&c, t->candidate, n, threshold, t->inlier);
    for (int i = 0; i <= (int)p->refits; i++) {
        bool good;
        cylinder_refine(&c, t->candidate, t->inlier, inliers, p->powell > 0, &good);
        if (!good || c.radius < predicted->radius / 2 || c.radius > 1.5 * predicted->radius)
            return false;
        inliers = cylinder_inliers(&c, t->candidate, n, threshold, t->inlier);
    }
    if (inliers < least)
        return false;
    c.center = vec3_add_scaled(c.center, median_along(t, &c, inliers), c.axis);
    // new candidates from the new centre give the node's points and height
    rays.length = p->ray_length * c.radius;
    n = cast_rays(t->volume, c.center, t->ray, t->ray_count, &rays, t->candidate);
    inliers = n < least ? 0 : cylinder_inliers(&c, t->candidate, n, threshold, t->inlier);
    double rate = n > 0 ? (double)inliers / n : 0;
    if (inliers < least || rate <= p->relaxed * p->p_inl)
        return false;
    for (int i = 0; i < inliers; i++)
        t->along[i] = fabs(vec3_dot(vec3_sub(t->candidate[t->inlier[i]], c.center), c.axis));
    sort_doubles(t->along, (size_t)inliers);
    int inside = (int)ceil(p->height_share * inliers);
    c.height = 2 * t->along[inside > 0 ? inside - 1 : 0];
    t->estimate.node = (TrackNode){.cylinder = c, .inlier_rate = rate, .contrast = contrast_of(t, &c), .kind = NODE_VESSEL, .parent = -1};
    int kept = 0;
    for (int i = 0; i < inliers; i++) {
        Vec3 x = t->candidate[t->inlier[i]];
        if (2 * fabs(vec3_dot(vec3_sub(x, c.center), c.axis)) <= c.height)
            t->estimate.point[kept++] = x;
    }
    t->estimate.node.point_count = kept;
    t->why = NULL;
    return c.height > 0 && vec3_is_finite(c.center);
}

// --- one branch ---

bool tracker_is_inside(const Volume *volume, Vec3 x)
{
    Vec3 v = volume_voxel_of(volume, x);
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x <= volume->size[0] - 1 && v.y <= volume->size[1] - 1 && v.z <= volume->size[2] - 1;
}

static Vec3 in_mm(const Volume *volume, Vec3 x, bool is_voxel) { return is_voxel ? volume_point_of(volume, x) : x; }

bool tracker_is_forbidden(const Tracker *t, Vec3 x)
{
    for (int i = 0; i < t->parameters->forbid_count; i++)
        if (vec3_distance(x, in_mm(t->volume, t->parameters->forbid[i].center, t->parameters->forbid[i].is_voxel)) < t->parameters->forbid[i].radius)
            return true;
    for (int i = 0; i < t->stop_count; i++) {
        Vec3 q = vec3_sub(x, t->stop[i].center);
        double along = vec3_dot(q, t->stop[i].axis);
        if (fabs(along) < t->stop[i].half && vec3_norm2(q) - along * along < t->stop[i].radius * t->stop[i].radius)
            return true;
    }
    return false;
}

bool tracker_is_stopped(const Tracker *t, Vec3 a, Vec3 b)
{
    for (int i = 0; i < t->stop_count; i++) {
        const RbtStop *s = &t->stop[i];
        double from = vec3_dot(vec3_sub(a, s->center), s->axis), to = vec3_dot(vec3_sub(b, s->center), s->axis);
        if (from * to <= 0 && from != to && vec3_distance(vec3_mix(a, b, from / (from - to)), s->center) < s->radius)
            return true;
    }
    return false;
}

static double segment_distance(Vec3 x, Vec3 a, Vec3 b)
{
    Vec3 ab = vec3_sub(b, a);
    double l2 = vec3_norm2(ab), s = l2 > 0 ? vec3_dot(vec3_sub(x, a), ab) / l2 : 0;
    return vec3_distance(x, vec3_add_scaled(a, fmax(0, fmin(1, s)), ab));
}

// A node of the finished tree whose tube holds x near its middle, or -1.
int tracker_node_around(const Tracker *t, Vec3 x, double share)
{
    if (t->paint) {   // the owner of a voxel is the nearest in its own radii; at a voxel's border it may be the one beside it
        int owner = rbt_paint_node(t->paint, x);
        for (int i = owner > 0 ? owner - 1 : owner; i >= 0 && i <= owner + 1 && i < t->tree.count; i++)
            if (vec3_distance(x, t->tree.node[i].cylinder.center) < share * t->tree.node[i].cylinder.radius)
                return i;
        return -1;
    }
    for (int i = 0; i < t->tree.count; i++)
        if (vec3_distance(x, t->tree.node[i].cylinder.center) < share * t->tree.node[i].cylinder.radius)
            return i;
    return -1;
}

static double recent_contrast(const Track *track)
{
    int first = track->count > CONTRAST_MEMORY ? track->count - CONTRAST_MEMORY : 0;
    double sum = 0;
    for (int i = first; i < track->count; i++)
        sum += track->node[i].contrast;
    return sum / (track->count - first);
}

double tracker_usual_radius(const Track *branch)
{
    double radius[12];
    int n = branch->count < 12 ? branch->count : 12;
    for (int i = 0; i < n; i++)
        radius[i] = branch->node[branch->count - 1 - i].cylinder.radius;
    sort_doubles(radius, (size_t)n);
    return radius[n / 2];
}

// Is the estimate the next node after the last one of the branch?
static bool is_progress(Tracker *t, const Track *branch, double step, bool is_retry, bool may_overlap)
{
    const RbtParameters *p = t->parameters;
    const TrackNode *last = &branch->node[branch->count - 1];
    const TrackNode *next = &t->estimate.node;
    Vec3 move = vec3_sub(next->cylinder.center, last->cylinder.center);
    t->why = "leaves the volume";
    if (!tracker_is_inside(t->volume, next->cylinder.center))
        return false;
    t->why = "ends where `until` says";
    if (tracker_is_stopped(t, last->cylinder.center, next->cylinder.center))
        return false;
    t->why = ENTERS_FORBIDDEN;
    if (tracker_is_forbidden(t, next->cylinder.center))
        return false;
    t->why = "steps back";
    if (vec3_dot(move, last->cylinder.axis) < 0.25 * step)
        return false;
    for (int i = 0; i + 1 < branch->count; i++)
        if (segment_distance(next->cylinder.center, branch->node[i].cylinder.center, branch->node[i + 1].cylinder.center) <
            p->back_step * last->cylinder.radius)
            return false;
    t->why = "turns back";
    double way = vec3_norm(move), least = same_cos(p->turn_deg * PI / 180) - 1e-9;
    for (int i = branch->count - 1; i >= 0 && way < 2 * last->cylinder.radius; i--) {
        if (vec3_dot(next->cylinder.axis, branch->node[i].cylinder.axis) < least)
            return false;
        way += i > 0 ? vec3_distance(branch->node[i].cylinder.center, branch->node[i - 1].cylinder.center) : 0;
    }
    t->why = "runs into itself";
    way = vec3_norm(move);
    for (int i = branch->count - 2; i >= 0; i--) {
        way += vec3_distance(branch->node[i].cylinder.center, branch->node[i + 1].cylinder.center);
        if (way > 4 * last->cylinder.radius &&
            vec3_distance(next->cylinder.center, branch->node[i].cylinder.center) < p->overlap * branch->node[i].cylinder.radius)
            return false;
    }
    t->why = "the contrast is lost";
    double contrast = recent_contrast(branch);
    if (next->contrast < p->contrast * contrast || !(next->contrast > 0.02 * ((double)t->volume->maximum - (double)t->volume->minimum)))
        return false;
    t->why = "does not stand out of the noise";
    if (t->is_noisy && !rbt_node_stands_out(t, t->levels, &next->cylinder))
        return false;
    t->why = "too faint";
    if (t->is_guarded && tracker_brightness(t, next->cylinder.center) < t->floor)
        return false;
    t->why = "leaks into a wider or brighter neighbour";
    if (t->is_guarded && branch->count >= 3 && (next->cylinder.radius > 1.8 * tracker_usual_radius(branch) || next->contrast > 1.8 * contrast))
        return false;
    t->why = "no vessel beyond";
    if (is_retry && (fabs(next->cylinder.radius - last->cylinder.radius) > p->retry_radius * last->cylinder.radius ||
                     next->contrast < p->retry_contrast * contrast))
        return false;
    t->why = "runs into another branch";
    return may_overlap || tracker_node_around(t, next->cylinder.center, p->overlap) < 0;
}

// The next node of a branch: the step of eq. (1), then the longer ones, each with both thresholds. False at the end of the vessel.
static bool next_node(Tracker *t, const Track *branch, bool may_overlap)
{
    const RbtParameters *p = t->parameters;
    const TrackNode *last = &branch->node[branch->count - 1];
    double step = p->s * last->cylinder.height / 2;
    const char *first_reason = NULL;
    for (int k = 0; k <= p->retry_count; k++) {
        Cylinder predicted = last->cylinder;
        double length = k ? p->retry_steps[k - 1] * step : step;
        predicted.center = vec3_add_scaled(predicted.center, length, predicted.axis);
        for (int second = 0; second <= (p->r_t_second > 0); second++) {
            bool found = tracker_estimate(t, &predicted, second ? p->r_t_second : p->r_t) && is_progress(t, branch, length, k > 0, may_overlap);
            if (found) {
                t->estimate.node.retried = k > 0;
                return true;
            }
            if (!first_reason)
                first_reason = t->why;
        }
    }
    t->why = first_reason;
    return false;
}

// Darkest place on the way from a to b.
static double darkest_between(const Tracker *t, Vec3 a, Vec3 b)
{
    double least = HUGE_VAL;
    int steps = 2 + (int)fmin(vec3_distance(a, b) / (0.5 * t->voxel), 3998);
    for (int i = 0; i <= steps; i++)
        least = fmin(least, tracker_brightness(t, vec3_mix(a, b, (double)i / steps)));
    return least;
}

// … as a share of the lumen's brightness at both ends.
double tracker_link_brightness(const Tracker *t, Vec3 a, Vec3 b)
{
    double base = (double)t->volume->minimum, ends = fmin(tracker_brightness(t, a), tracker_brightness(t, b)) - base;
    return ends > 0 ? (darkest_between(t, a, b) - base) / ends : 0;
}

// --- past what is no cylinder ---

void tracker_opening(Tracker *t, const Cylinder *c, double contrast)
{
    double distance[MAX_RAYS];
    RayOptions rays = {2 * c->radius, (int)t->parameters->n_p, t->parameters->ray_smoothing_voxels * t->voxel, 0};
    t->estimate.node = (TrackNode){.cylinder = *c, .contrast = contrast, .kind = NODE_VESSEL, .parent = -1, .is_junction = true};
    cast_rays_first_edge(t->volume, c->center, t->ray, t->ray_count, &rays, distance);
    int kept = 0;
    for (int k = 0; k < t->ray_count; k++)
        if (distance[k] > 0 && distance[k] < 1.5 * c->radius)
            t->estimate.point[kept++] = vec3_add_scaled(c->center, distance[k], t->ray[k]);
    t->estimate.node.point_count = kept;
    t->estimate.node.inlier_rate = (double)kept / t->ray_count;
}

// Nodes on the straight way between two cylinders, in an opening where no cylinder fits: their points are the first walls that rays meet nearby.
static bool append_junction(Tracker *t, Track *branch, const Cylinder *from, const Cylinder *to)
{
    Vec3 way = vec3_sub(to->center, from->center);
    double gap = vec3_norm(way);
    int steps = (int)ceil(gap / (0.5 * fmin(from->radius, to->radius)));
    for (int i = 1; i < steps; i++) {
        double share = (double)i / steps;
        Cylinder c = {vec3_mix(from->center, to->center, share), from->radius + share * (to->radius - from->radius), vec3_unit(way), 2 * gap / steps};
        tracker_opening(t, &c, recent_contrast(branch));
        if (!track_append(branch, &t->estimate.node, t->estimate.point))
            return false;
    }
    return true;
}

void track_cut(Track *track, int count)
{
    if (count < track->count)
        track->point_count = track->node[count].point_start;
    track->count = count;
}

static bool next_node(Tracker *t, const Track *branch, bool may_overlap);

// From an exit back towards the branch, until that is met or the tube widens into what is to be passed. Then joins: the branch up to `keep` nodes, the
// junction, the way back turned round. False where the exit is no vessel or cannot be seen from the branch.
static bool join_exit(Tracker *t, Track *branch, int keep, const RbtExit *exit, int place)
{
    const RbtParameters *p = t->parameters;
    const Cylinder last = branch->node[keep - 1].cylinder;
    Cylinder predicted = {exit->center[place], exit->radius, exit->direction[place], 0};
    Track back = {0};
    if (tracker_is_stopped(t, last.center, exit->center[place]) || tracker_node_around(t, exit->center[place], 1) >= 0 ||
        !(tracker_estimate(t, &predicted, p->r_t) || (p->r_t_second > 0 && tracker_estimate(t, &predicted, p->r_t_second))))
        return false;
    if (t->estimate.node.contrast < p->retry_contrast * recent_contrast(branch) || tracker_node_around(t, t->estimate.node.cylinder.center, p->overlap) >= 0)
        return false;
    t->estimate.node.cylinder.axis = vec3_negate(t->estimate.node.cylinder.axis);
    bool good = true;
    int joined = -1;   // the node of the way back that is nearest to the branch and in plain sight of it
    double nearest = HUGE_VAL, brightest = 0.5;
    for (int i = 0; good && i < 40; i++) {
        const Cylinder *c = &t->estimate.node.cylinder;
        double link = tracker_link_brightness(t, last.center, c->center), distance = vec3_distance(c->center, last.center);
        if (t->is_guarded && darkest_between(t, last.center, c->center) < t->floor)   // no leap over what is too faint for a vessel
            link = 0;
        // it has met the branch, has come into the wide part, or has passed by
        if (i > 0 && (distance < last.radius || c->radius > 1.35 * tracker_usual_radius(&back) || (brightest >= 0.9 && link < 0.5)))
            break;
        good = track_append(&back, &t->estimate.node, t->estimate.point);
        if (link >= 0.9 ? brightest < 0.9 || distance < nearest : link > brightest) {
            joined = i;
            nearest = distance;
            brightest = fmin(link, 0.9);
        }
        if (!good || !next_node(t, &back, false))
            break;
    }
    t->out_of_memory = !good;
    good = good && joined >= 0 && !tracker_is_stopped(t, last.center, back.node[joined].cylinder.center);
    if (good) {
        track_cut(branch, keep);
        good = append_junction(t, branch, &last, &back.node[joined].cylinder);
        for (int i = joined; good && i >= 0; i--) {
            TrackNode node = back.node[i];
            node.cylinder.axis = vec3_negate(node.cylinder.axis);
            good = track_append(branch, &node, back.point + back.node[i].point_start);
        }
        t->out_of_memory = !good;
    }
    track_free(&back);
    return good;
}

// The branch has swelled or ended: looks ahead for its continuation and joins the widest one that tracks.
static bool look_ahead(Tracker *t, Track *branch)
{
    enum { MAX_EXITS = 16 };
    RbtExit exit[MAX_EXITS];
    double radius = tracker_usual_radius(branch), base = (double)t->volume->minimum;
    int keep = branch->count;
    while (keep > 2 && branch->node[keep - 1].cylinder.radius > 1.15 * radius)
        keep--;
    const Cylinder *last = &branch->node[keep - 1].cylinder;
    double level = base + 0.5 * (tracker_brightness(t, last->center) - base);
    RbtBlock *block = HEAP_ZEROED((size_t)keep, sizeof *block);
    for (int i = 0; i < keep; i++)
        block[i] = (RbtBlock){branch->node[i].cylinder.center, 1.4 * branch->node[i].cylinder.radius};
    int found = rbt_find_exits(t->volume, last->center, last->axis, radius, t->parameters->look_ahead * radius, level, block, keep, exit, MAX_EXITS);
    free(block);
    const char *why = t->why;
    for (int i = 0; i < found && !t->out_of_memory; i++)
        for (int place = 0; exit[i].radius < 2 * radius && place < exit[i].count && !t->out_of_memory; place++)
            if (join_exit(t, branch, keep, &exit[i], place))
                return true;
    t->why = why;
    return false;
}

static double branch_length(const Track *branch)
{
    double length = 0;
    for (int i = 1; i < branch->count; i++)
        length += vec3_distance(branch->node[i].cylinder.center, branch->node[i - 1].cylinder.center);
    return length;
}

// Tracks from an estimate of the first node until the vessel ends. The branch's nodes are appended to `branch`, without parents.
// `until_tree`: it is on its way back to its parent and ends inside another branch's tube.
void tracker_run(Tracker *t, const Cylinder *start, Track *branch, bool until_tree)
{
    const RbtParameters *p = t->parameters;
    double length = 0;
    bool left = tracker_node_around(t, start->center, 1) < 0;   // it may start within its parent's tube, and be there until it has left it
    Cylinder predicted = *start;
    if (!tracker_estimate(t, &predicted, p->r_t) && !(p->r_t_second > 0 && tracker_estimate(t, &predicted, p->r_t_second)))
        return;
    int rest = 0;   // nodes until it looks ahead again
    for (bool found = true; found;) {
        if (!track_append(branch, &t->estimate.node, t->estimate.point)) {
            t->out_of_memory = true;
            return;
        }
        Vec3 here = t->estimate.node.cylinder.center;
        left = left || tracker_node_around(t, here, 1) < 0;
        length = branch_length(branch);
        t->why = "is as long as max_length_mm";
        if (length >= fmin(p->max_length_mm, t->longest) || branch->count >= MAX_NODES)
            return;
        t->why = "reached its parent";
        if (until_tree && tracker_node_around(t, here, 0.9) >= 0)
            return;
        t->why = "does not leave its parent";
        if (!left && length > 6 * branch->node[0].cylinder.radius)
            return;
        found = next_node(t, branch, !left);
        bool swells = found && branch->count >= 6 && t->estimate.node.cylinder.radius > 1.35 * tracker_usual_radius(branch);
        rest -= rest > 0;
        if (p->look_ahead > 0 && !t->is_noisy && !until_tree && left && branch->count >= 6 && rest == 0 && (swells || !found)) {
            rest = 12;
            Estimate *kept = malloc(sizeof *kept);   // the search uses the tracker's own
            if (!kept) {
                t->out_of_memory = true;
                return;
            }
            *kept = t->estimate;
            bool joined = look_ahead(t, branch);
            if (!joined)
                t->estimate = *kept;
            free(kept);
            if (t->out_of_memory)
                return;
            if (joined)
                found = next_node(t, branch, false);
        }
    }
}

// --- the tree, section 3.3 ---

// Where a subtree that starts at x hangs on the tree: the node of least power distance whose straight link stays inside the lumen (at least half as
// bright as its ends); if no link does, the brightest one among the near nodes.
int tracker_attachment(const Tracker *t, Vec3 x, int node_count)
{
    int best = -1, brightest = -1;
    double least = HUGE_VAL, most = -HUGE_VAL, reach = HUGE_VAL;
    for (int i = 0; i < node_count; i++)
        reach = fmin(reach, vec3_distance(x, t->tree.node[i].cylinder.center));
    for (int i = 0; i < node_count; i++) {
        const TrackNode *n = &t->tree.node[i];
        double distance = vec3_distance(x, n->cylinder.center), power = distance * distance - n->cylinder.radius * n->cylinder.radius;
        if (distance > 2 * reach + 4 * n->cylinder.radius)
            continue;
        double link = tracker_link_brightness(t, x, n->cylinder.center);
        if (link >= 0.5 && power < least) {
            least = power;
            best = i;
        }
        if (link > most) {
            most = link;
            brightest = i;
        }
    }
    return best >= 0 ? best : brightest;
}

// Appends a branch's nodes: those of the way back reversed, then those of the way out.
static bool adopt_branch(Tracker *t, const Track *out, const Track *back, int number)
{
    int before = t->tree.count;
    for (int i = 0; i < back->count + out->count; i++) {
        bool is_back = i < back->count;
        const Track *from = is_back ? back : out;
        TrackNode node = from->node[is_back ? back->count - 1 - i : i - back->count];
        const Vec3 *point = from->point + node.point_start;
        if (is_back)
            node.cylinder.axis = vec3_negate(node.cylinder.axis);
        node.branch = number;
        node.parent = i > 0 ? t->tree.count - 1 : before > 0 ? tracker_attachment(t, node.cylinder.center, before) : -1;
        if (!track_append(&t->tree, &node, point))
            return false;
    }
    return true;
}

// Nodes of a branch follow each other; a later aneurysm may have joined some of them. Nodes of links are counted, but say nothing of the vessel.
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
        if (!is_sac || n->cylinder.radius > widest)   // the widest of a sac's centres stands for it
            report->center = n->cylinder.center;
        widest = is_sac ? fmax(widest, n->cylinder.radius) : widest;
    }
    if (sacs > 0)
        report->radius = sac_radius / sacs;
}

// The nearest point of the centreline and its node, for the projection of section 3.3.
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

// What was estimated at the first start, for the report.
static void say_start(Tracker *t, const RbtSeed *seed, const Cylinder *start, const char *root)
{
    char radius[48] = "", direction[80] = "";
    if (!(seed->radius > 0))
        snprintf(radius, sizeof radius, ", radius %.2f mm", start->radius);
    if (!seed->has_toward)
        snprintf(direction, sizeof direction, ", direction (%.2f, %.2f, %.2f)", start->axis.x, start->axis.y, start->axis.z);
    snprintf(t->start, sizeof t->start, "first start estimated: middle (%.2f, %.2f, %.2f) mm, %.2f mm from the click%s%s; %s", start->center.x,
             start->center.y, start->center.z, vec3_distance(start->center, seed->start), radius, direction, root);
}

// Nodes of `way` up to where it meets `other`, which starts at the same place: a ring of vessels closes there.
static int nodes_before_meeting(const Track *way, const Track *other, double share)
{
    double length = 0;
    for (int i = 1; i < way->count; i++) {
        length += vec3_distance(way->node[i].cylinder.center, way->node[i - 1].cylinder.center);
        for (int k = 0; length > 4 * way->node[0].cylinder.radius && k < other->count; k++)
            if (vec3_distance(way->node[i].cylinder.center, other->node[k].cylinder.center) < share * other->node[k].cylinder.radius)
                return i;
    }
    return way->count;
}

// The first branch from a start without direction: it may lie anywhere along the vessel.
bool tracker_both_ways(Tracker *t, const RbtSeed *seed, const Cylinder *start, int number)
{
    Track way[2] = {{0}, {0}}, back = {0};
    const char *end[2], *why = "the vessel was tracked one way only";
    for (int i = 0; i < 2 && !t->out_of_memory; i++) {
        Cylinder from = *start;
        from.axis = i ? vec3_negate(from.axis) : from.axis;
        tracker_run(t, &from, &way[i], false);
        end[i] = t->why;
    }
    if (way[0].count > 0 && way[1].count > 0)
        track_cut(&way[1], nodes_before_meeting(&way[1], &way[0], t->parameters->overlap));
    int out = way[0].count == 0 || (way[1].count > 0 && rbt_root_is_at_end_of(t, &way[0], &way[1], &why));
    bool found = way[out].count > 0 && !t->out_of_memory;
    // the first node of both is the same one, seen from either side
    for (int i = 1; found && i < way[1 - out].count && !t->out_of_memory; i++)
        t->out_of_memory = !track_append(&back, &way[1 - out].node[i], way[1 - out].point + way[1 - out].node[i].point_start);
    if (found && !t->out_of_memory)
        t->out_of_memory = !adopt_branch(t, &way[out], &back, number);
    if (found) {
        char root[120];
        snprintf(root, sizeof root, "tracked both ways, the root is %s", why);
        say_start(t, seed, start, way[1 - out].count > 0 ? root : why);
        t->why = end[out];
    }
    for (int i = 0; i < 2; i++)
        track_free(&way[i]);
    track_free(&back);
    return found && !t->out_of_memory;
}

// Tracks seed `number`. With a `toward`: from its start, and for further branches also back to the parent. Without: as section 3.3 has it, from just
// outside the parent's wall; where nothing is found there (the point was set far down the branch) from the point itself, and back.
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
        say_start(t, seed, &start, "the root is the start");
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
        Track way = {0};
        tracker_run(t, &behind, &way, true);
        // its first node is the branch's own first one, seen the other way
        for (int i = 1; i < way.count && !t->out_of_memory; i++)
            t->out_of_memory = !track_append(&back, &way.node[i], way.point + way.node[i].point_start);
        track_free(&way);
    }
    t->why = why;
    bool found = out.count > 0 && !t->out_of_memory;
    if (found)
        t->out_of_memory = !adopt_branch(t, &out, &back, number);
    track_free(&out);
    track_free(&back);
    return found;
}

// --- aneurysms, section 3.4 ---

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

// Is x on the wall of a tracked cylinder, as its consensus set is?
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

// Does a vessel's node own x rather than the sac? Such points were seen through the neck and lie on the vessel's wall.
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

// Which of the listed vessel nodes owns x, or -1 where the sac does.
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

typedef struct Neck {        // where the sac's rays pass into the vessels' cells
    int count;
    Vec3 *place;             // (count)
    int *owner;              // (count) vessel node
    int *center;             // (count) of the sac
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

// Nodes lo … hi of a branch become one, at lo; every link to them leads there. Their points are its points.
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
    for (int i = lo; i <= hi; i++) {   // a copy at the end: the old places are left unused
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

// The node that the sac hangs on, and the centre that hangs there: -1 where no ray finds a neck. A tool that follows its node from neighbour to neighbour
// must find the way from every vessel cell that borders on the sac's into it and out again, but the tree has one link: the vessel nodes along the neck
// become one. It stands where they stood, weighted by their share of the neck, and its radius keeps the border between vessel and sac where it was.
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
        // vessels that touch the sac elsewhere are no part of its neck
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
            // neighbours that would lie in its cell are part of it
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

// One sac: points by rays from each centre, a sphere for each, then the centres are linked: one to the tree, every next one to its nearest.
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
                       "centre %d of the aneurysm sees no wall around it (%d of %d rays within %g mm); a point well "
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
    // Prim's tree over the centres, from the one that hangs on the vessel
    // a hub that took much of the neck changes who else borders on it: once or twice more
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

// --- the whole ---

// [low, high] of a million samples: the first quartile, which is background (vessels fill less than three quarters of any angiogram), and the 99.9th
// percentile. The extremes would be noise, air or metal: with them half of a noisy background passed for vessel.
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

// `seed` is NULL for points that are no starts.
static bool check_point(Tracker *t, Vec3 x, const RbtSeed *seed, const char *what, int line, int column, const char *path, Faults *faults)
{
    Vec3 v = volume_voxel_of(t->volume, x);
    const int *size = t->volume->size;
    if (!tracker_is_inside(t->volume, x)) {
        faults_add(faults, path, line, column,
                   "%s (%g, %g, %g) mm, voxel (%.1f, %.1f, %.1f), lies outside the volume; voxels (0, 0, 0) to (%d, %d, %d)", what, x.x, x.y, x.z,
                   v.x, v.y, v.z, size[0] - 1, size[1] - 1, size[2] - 1);
        return false;
    }
    double value = tracker_brightness(t, x), low = (double)t->volume->minimum, high = (double)t->volume->maximum;
    if (!(high > low) || (value < fmax(low + 0.1 * (high - low), t->dark) && !(seed ? rbt_stands_out(t, t->levels, seed) : t->is_noisy))) {
        faults_add(faults, path, line, column,
                   "%s (%g, %g, %g) mm, voxel (%.1f, %.1f, %.1f), lies on background (%g in a volume of %g to %g); a point inside a vessel, above %g",
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
        faults_add(faults, path, seed->line, seed->column, "the start of branch %d lies in a region of `forbid`; a start outside of it", number + 1);
    if (seed->has_toward && !(vec3_distance(seed->start, seed->toward) > 1e-6 * t->voxel))
        faults_add(faults, path, seed->line, seed->column,
                   "the start of branch %d and its toward are the same point; toward is a point further down the vessel", number + 1);
    double extent = 0;
    for (int i = 0; i < 3; i++)
        extent = fmax(extent, vec3_norm(t->volume->axis[i]) * t->volume->size[i]);
    if (seed->radius > extent / 2)
        faults_add(faults, path, seed->line, seed->column, "the radius %g mm of branch %d is larger than the volume; at most %g mm", seed->radius,
                   number + 1, extent / 2);
    return faults->count == before;
}

static RbtSeed seed_in_mm(const Volume *volume, const RbtSeed *given)
{
    RbtSeed seed = *given;
    seed.start = in_mm(volume, given->start, given->start_is_voxel);
    seed.toward = in_mm(volume, given->toward, given->toward_is_voxel);
    seed.start_is_voxel = seed.toward_is_voxel = false;
    return seed;
}

static VesselTree *finish_tree(const Track *track)
{
    int64_t points = 0, used = 0;
    for (int i = 0; i < track->count; i++)   // merged nodes left unused ones
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

void rbt_report_free(RbtReport *report)
{
    free(report->branch);
    free(report->junction);
    free(report->loop);
    *report = (RbtReport){0};
}

typedef struct Job {         // what rbt_track was asked for
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
    faults_add(faults, path, seed->line, seed->column, "the start of branch %d (%g, %g, %g) mm: %s", number + 1, seed->start.x, seed->start.y, seed->start.z, t->refusal);
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
               "nothing could be tracked from the start of branch %d (%s); a point well inside the vessel, "
               "about its true radius and direction",
               i + 1, t->why);
    return false;
}

// The numbers of the branches in the order of their nodes: one that was hung on a later one stands behind it. Returns how many have nodes.
static int order_branches(const Track *tree, int total, int *order)
{
    int count = 0;
    for (int i = 0; i < tree->count; i++)
        if (count < total && (i == 0 || tree->node[i].branch != tree->node[i - 1].branch))
            order[count++] = tree->node[i].branch;
    return count;
}

// Takes the junctions over, their branches by the report's numbers.
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

// Branches that lost all of their nodes are left out.
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

// Node by node: those for which keep[i] is false go; nothing may hang on them that stays.
void track_keep(Track *tree, const bool *keep, int *place)
{
    int used = 0;
    for (int i = 0; i < tree->count; i++) {
        if (!keep[i])
            continue;
        TrackNode node = tree->node[i];
        node.parent = node.parent >= 0 ? place[node.parent] : -1;
        place[i] = used;
        tree->node[used++] = node;
    }
    tree->count = used;
}

// Distance from x to node i, and to its link as far as that lies outside its parent's lumen: there the node's own branch is cut.
static double distance_to_node(const Tracker *t, int i, Vec3 x)
{
    const TrackNode *n = &t->tree.node[i];
    double least = vec3_distance(x, n->cylinder.center);
    if (n->parent >= 0 && t->tree.node[n->parent].branch != n->branch) {
        Cylinder p = t->tree.node[n->parent].cylinder;
        double gap = vec3_distance(p.center, n->cylinder.center);
        Vec3 wall = vec3_mix(p.center, n->cylinder.center, gap > 0 ? fmin(1, p.radius / gap) : 1);
        least = fmin(least, segment_distance(x, wall, n->cylinder.center));
    }
    return least;
}

// What is left of a branch after a cut is a stub where it does not reach two of its radii beyond its parent's wall: it goes too.
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

// From the node nearest to each point on its branch goes, and all that hangs on what went. False with a fault where a point is on no branch.
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
        Vec3 x = in_mm(t->volume, cut->center, cut->is_voxel);
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
            faults_add(job->faults, job->path, cut->line, cut->column, "the cut at (%g, %g, %g) mm %s; a point on the branch that is to be cut", x.x, x.y, x.z,
                       nearest == 0 ? "leaves nothing of the tree" : "is on no branch");
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

// A found branch that ends in front of a forbidden region before it has left its parent is a stub. False: out of memory.
static bool drop_forbidden_stubs(Tracker *t, const RbtEnds *ends)
{
    Track *tree = &t->tree;
    bool *keep = malloc((size_t)tree->count * sizeof *keep);
    int *place = malloc((size_t)tree->count * sizeof *place);
    bool good = keep && place;
    for (int i = 0; good && i < tree->count; i++)
        keep[i] = true;
    for (int b = 0; good && b < ends->count; b++)
        if (ends->seed[b] < 0 && ends->why[b] == ENTERS_FORBIDDEN)
            drop_stub(tree, b, keep);
    for (int i = 0; good && i < tree->count; i++)
        keep[i] = keep[i] && (tree->node[i].parent < 0 || keep[tree->node[i].parent]);
    if (good)
        track_keep(tree, keep, place);
    free(keep);
    free(place);
    return good;
}

// A node of the tree so far lies on this start: the branch was found already.
static bool is_found_already(const Tracker *t, const RbtSeed *seed) { return tracker_node_around(t, seed->start, 1) >= 0; }

// What grows out of the nodes from `first` on.
static bool grow(Tracker *t, const Job *job, RbtPaint *paint, int first, RbtEnds *ends)
{
    return rbt_grow_branches(t, paint, first, job->threads, job->progress, ends) || out_of_memory_at(job, ends->count);
}

// The vessels that `not` names compete with the first branch.
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

// What hangs on these goes; a branch that was named must not.
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
        faults_add(job->faults, job->path, seed->line, seed->column, "branch %d hangs on a vessel that `not` names; a start on the tree's own side, or another `not`",
                   ends->seed[b] + 1);
        return false;
    }
    return true;
}

// The whole tree: all that is found from the first start, then the cuts, then what the other starts add to the rest.
static bool track_automatic(Tracker *t, const Job *job, RbtEnds *ends)
{
    bool is_joined, good = run_seed(t, job, 0) && add_rivals(t, job, ends) && (rbt_mend_links(t, NULL, 0, &is_joined) || out_of_memory_at(job, 0));
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
        good = good && ((rbt_ends_add(ends, t->why, i) && rbt_mend_links(t, paint, first, &is_joined)) || out_of_memory_at(job, i)) &&
               grow(t, job, paint, first, ends);
    }
    t->paint = NULL;
    rbt_paint_free(paint);
    return good;
}

// The ostia of the tree as it now is.
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

VesselTree *rbt_track(const Volume *volume, const RbtParameters *parameters, const RbtSeed *given, int seed_count, const RbtAneurysm *aneurysm,
                      int aneurysm_count, int threads, const Progress *progress, RbtReport *report, const char *path, Faults *faults)
{
    Tracker *t = calloc(1, sizeof *t);
    RbtSeed *seed = malloc((size_t)(seed_count > 0 ? seed_count : 1) * sizeof *seed);
    Vec3 **center = calloc((size_t)(aneurysm_count > 0 ? aneurysm_count : 1), sizeof *center);
    RbtReport own = {0};
    RbtLevels levels = rbt_levels_of(volume, threads);
    VesselTree *tree = NULL;
    bool good = t && seed && center;
    int before = faults->count;
    for (int i = 0; good && i < aneurysm_count; i++)
        good = (center[i] = malloc((size_t)aneurysm[i].center_count * sizeof **center)) != NULL;
    if (!good)
        faults_add(faults, path, 0, 0, "out of memory");
    if (good && seed_count < 1)
        faults_add(faults, path, 0, 0, "there is no branch to track; `branches` with at least one start");
    if (good) {
        *t = (Tracker){.volume = volume, .parameters = parameters, .voxel = volume_voxel_size(volume), .ray_count = (int)parameters->n_r,
                       .axis_count = (int)parameters->n_d, .longest = HUGE_VAL, .scan_count = -1};
        double low, high;
        brightness_range(volume, &low, &high);
        t->background = low;
        t->dark = low + 0.2 * (high - low);
        for (int i = 0; i < seed_count; i++)
            seed[i] = seed_in_mm(volume, &given[i]);
        sphere_directions(sphere_level_of(t->ray_count), t->ray);
        prepare_axes(t);
        t->levels = &levels;
        if (seed_count > 0 && tracker_is_inside(volume, seed[0].start) && !rbt_look_at_noise(t, &levels, &seed[0])) {
            if (t->out_of_memory)
                faults_add(faults, path, 0, 0, "out of memory");
            else
                start_is_refused(t, &seed[0], 0, path, faults);
        }
        for (int i = 0; i < seed_count; i++)
            check_seed(t, &seed[i], i, path, faults);
        for (int i = 0; i < aneurysm_count; i++)
            for (int k = 0; k < aneurysm[i].center_count; k++) {
                center[i][k] = in_mm(volume, aneurysm[i].center[k], aneurysm[i].is_voxel);
                check_point(t, center[i][k], NULL, "a centre of an aneurysm", aneurysm[i].line, aneurysm[i].column, path, faults);
            }
    }
    if (good && faults->count == before && !rbt_place_stops(t, seed[0].start, path, faults) && faults->count == before)
        faults_add(faults, path, 0, 0, "out of memory");
    if (good && faults->count == before) {
        Job job = {seed, seed_count, aneurysm, center, aneurysm_count, threads, progress, path, faults};
        if (track_all(t, &job, &own) && !(tree = finish_tree(&t->tree)))
            faults_add(faults, path, 0, 0, "out of memory for a tree of %d nodes", t->tree.count);
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
    free(center);
    free(seed);
    free(t);
    if (tree && report)
        *report = own;
    else
        rbt_report_free(&own);
    return tree;
}

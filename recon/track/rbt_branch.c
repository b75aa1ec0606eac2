// Prediction, eq. (1), (2): C* = C + s h/2 d; r, d, h are unchanged. Estimation: rays from C* give candidate points; for axis directions in order of their
// angle with d*, a RANSAC circle across each gives a cylinder, and the first valid one is kept; refinement by least squares; the centre goes to the
// median of the consensus set along the axis; new rays from there give the node's points and its height. Kerrien et al. 2017, section 3.
//
// Tried and rejected: the paper's method as published stalls at bifurcations and beside a sac, where the consensus set lies upstream and the
// median pulls the centre back to where it came from. A failed step is therefore repeated from the last good node with longer steps, to get past this
// place; then the radius and the contrast must agree with the vessel, or spurious branches grow from open ends. This is not enough at a giant
// aneurysm: the direct path leads into the sac, and the tracking ends at its bottom. Where a branch widens or ends, the lumen ahead is
// searched for tubes that leave it (rbt_exits.h), and the branch continues from the widest one that tracks.
#include "recon/track/rbt_branch.h"

#include "base/base.h"
#include "recon/track/cast_rays.h"
#include "recon/track/rbt_exits.h"
#include "recon/track/rbt_paint.h"
#include "recon/track/rbt_scan.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char rbt_enters_forbidden[] = "enters a forbidden region";
static const char no_cylinder[] = "no cylinder fits the points";
enum { CONTRAST_MEMORY = 8, MAX_NODES = 200000, SHOWN_EACH = 4 };

// --- estimation, section 3.1 ---

// Takes half of the sphere's vertices, +z first, then by increasing angle with it. RANSAC uses these directions, rotated so that +z is the predicted axis.
void tracker_prepare_axes(Tracker *t)
{
    Vec3 all[2 * MAX_AXES];
    int level = sphere_level_of(2 * t->axis_count), used = 0;
    sphere_directions(level, all);
    // rotate vertex 0 onto z, then keep the upper half; of two opposite vertices on the equator keep one
    Vec3 z = all[0], x = vec3_normal_to(z), y = vec3_cross(z, x);
    for (int i = 0; i < 2 * t->axis_count; i++) {
        Vec3 a = vec3(vec3_dot(all[i], x), vec3_dot(all[i], y), vec3_dot(all[i], z));
        bool upper = a.z > 1e-9 || (a.z > -1e-9 && (a.y > 1e-9 || (a.y > -1e-9 && a.x > 0)));
        if (!upper || used == t->axis_count)
            continue;
        int k = used++;
        for (; k > 0 && t->axis[k - 1].z < a.z - 1e-9; k--)   // insertion sort, because it is stable
            t->axis[k] = t->axis[k - 1];
        t->axis[k] = a;
    }
    t->axis_count = used;
}

// Brightness on the axis minus the brightness of the darker half of a ring outside the wall, so that a touching neighbour does not hide the vessel.
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

// RANSAC over the axis directions in order of their angle with the predicted one: takes the first valid cylinder, or the best of all if its inlier rate is
// above the relaxed one. Returns the inlier rate, or 0 if there is no cylinder.
static double search_axes(Tracker *t, const Cylinder *predicted, int candidates, double threshold, Cylinder *out)
{
    const RbtParameters *p = t->parameters;
    RansacOptions options = {.threshold = threshold,
                             .radius_min = predicted->radius / 2,
                             .radius_max = 1.5 * predicted->radius,
                             .offset_max = 1.5 * predicted->radius,
                             .inlier_rate = p->p_inl,
                             .trials_min = (int)p->n_min,
                             .trials_max = (int)p->n_max};
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

// Puts the value there that sorting would put at `place` (less than `count`), lower or equal ones before and higher or equal ones behind it, and returns it.
// Hoare's FIND (1961): in proportion to the count, where sorting calls a function for each comparison. No value may be NaN.
static double place_double(double *value, int count, int place)
{
    for (int first = 0, last = count - 1; first < last;) {
        double middle = value[place];
        int low = first, high = last;
        while (low <= high) {
            while (value[low] < middle)
                low++;
            while (middle < value[high])
                high--;
            if (low <= high) {
                double moved = value[low];
                value[low++] = value[high];
                value[high--] = moved;
            }
        }
        if (high < place)
            first = low;
        if (place < low)
            last = high;
    }
    return value[place];
}

// Returns the consensus set's median position along the axis, relative to the centre; the median becomes the new centre.
static double median_along(Tracker *t, const Cylinder *c, int inliers)
{
    for (int i = 0; i < inliers; i++)
        t->along[i] = vec3_dot(vec3_sub(t->candidate[t->inlier[i]], c->center), c->axis);
    double upper = place_double(t->along, inliers, inliers / 2);
    return inliers % 2 ? upper : 0.5 * (place_double(t->along, inliers / 2, inliers / 2 - 1) + upper);
}

static RayOptions rays_of(const Tracker *t, double radius)
{
    const RbtParameters *p = t->parameters;
    return (RayOptions){p->ray_length * radius, (int)p->n_p, p->ray_smoothing_voxels * t->voxel, p->ray_edge};
}

// Finds the wall points around a prediction, or keeps those of the last call if they are the same. Returns their number.
static int find_candidates(Tracker *t, const Cylinder *predicted)
{
    RayOptions rays = rays_of(t, predicted->radius);
    const Vec3 x = predicted->center, last = t->cast.center;
    bool is_same = t->cast.volume == t->volume && memcmp(&x, &last, sizeof x) == 0 && memcmp(&rays.length, &t->cast.length, sizeof rays.length) == 0;
    if (!is_same) {
        t->cast.volume = t->volume;
        t->cast.center = x;
        t->cast.length = rays.length;
        t->cast.count = cast_rays(t->volume, x, t->ray, t->ray_count, &rays, t->candidate);
    }
    return t->cast.count;
}

static double threshold_of(const Tracker *t, const Cylinder *predicted, double relative_threshold)
{
    return fmax(relative_threshold * predicted->radius, t->parameters->r_t_voxels * t->voxel);
}

static int fewest_points(const Tracker *t) { return t->ray_count / 8; }   // fewer edges than this cannot be a tube

// Fits a cylinder to the wall points around a prediction. Returns false if none is valid (t->why gives the reason); otherwise t->estimate holds its centre,
// axis, radius and contrast.
static bool fit_cylinder(Tracker *t, const Cylinder *predicted, double relative_threshold)
{
    const RbtParameters *p = t->parameters;
    double threshold = threshold_of(t, predicted, relative_threshold);
    Cylinder c;
    int n = find_candidates(t, predicted);
    t->why = "too few rays reach a wall";
    if (n < fewest_points(t))
        return false;
    t->why = no_cylinder;
    if (search_axes(t, predicted, n, threshold, &c) <= 0)
        return false;
    if (vec3_dot(c.axis, predicted->axis) < 0)
        c.axis = vec3_negate(c.axis);
    // refine, then select the consensus set again: otherwise its axis, one of a discrete set, stays inaccurate
    int inliers = cylinder_inliers(&c, t->candidate, n, threshold, t->inlier);
    for (int i = 0; i <= (int)p->refits; i++) {
        bool good;
        cylinder_refine(&c, t->candidate, t->inlier, inliers, p->powell > 0, &good);
        if (!good || c.radius < predicted->radius / 2 || c.radius > 1.5 * predicted->radius)
            return false;
        inliers = cylinder_inliers(&c, t->candidate, n, threshold, t->inlier);
    }
    if (inliers < fewest_points(t))
        return false;
    c.center = vec3_add_scaled(c.center, median_along(t, &c, inliers), c.axis);
    t->estimate.node = (TrackNode){.cylinder = c, .contrast = contrast_of(t, &c), .kind = NODE_VESSEL, .parent = -1};
    return true;
}

// Casts rays from the centre of the fitted cylinder, which give the node's points and height. Returns false if too few of them agree with it.
static bool measure_node(Tracker *t, const Cylinder *predicted, double relative_threshold)
{
    const RbtParameters *p = t->parameters;
    Cylinder *c = &t->estimate.node.cylinder;
    Vec3 *point = t->estimate.point;
    RayOptions rays = rays_of(t, c->radius);
    int n = cast_rays(t->volume, c->center, t->ray, t->ray_count, &rays, point), least = fewest_points(t);
    int inliers = n < least ? 0 : cylinder_inliers(c, point, n, threshold_of(t, predicted, relative_threshold), t->inlier);
    double rate = n > 0 ? (double)inliers / n : 0;
    t->why = no_cylinder;
    if (inliers < least || rate <= p->relaxed * p->p_inl)
        return false;
    for (int i = 0; i < inliers; i++)
        t->along[i] = fabs(vec3_dot(vec3_sub(point[t->inlier[i]], c->center), c->axis));
    int inside = (int)ceil(p->height_share * inliers);
    c->height = 2 * place_double(t->along, inliers, inside > 0 ? inside - 1 : 0);
    int kept = 0;
    for (int i = 0; i < inliers; i++) {
        Vec3 x = point[t->inlier[i]];
        if (2 * fabs(vec3_dot(vec3_sub(x, c->center), c->axis)) <= c->height)
            point[kept++] = x;
    }
    t->estimate.node.inlier_rate = rate;
    t->estimate.node.point_count = kept;
    t->why = NULL;
    return c->height > 0 && vec3_is_finite(c->center);
}

// The complete estimation step. Returns false if no cylinder is valid (t->why gives the reason); otherwise t->estimate holds the node.
bool tracker_estimate(Tracker *t, const Cylinder *predicted, double relative_threshold)
{
    return fit_cylinder(t, predicted, relative_threshold) && measure_node(t, predicted, relative_threshold);
}

// --- one branch ---

static double recent_contrast(const Track *track)
{
    int first = track->count > CONTRAST_MEMORY ? track->count - CONTRAST_MEMORY : 0;
    double sum = 0;
    for (int i = first; i < track->count; i++)
        sum += track->node[i].contrast;
    return sum / (track->count - first);
}

// Returns true if the fitted cylinder is acceptable as the next node of the branch.
static bool is_progress(Tracker *t, const Track *branch, double step, bool is_retry, bool may_overlap)
{
    const RbtParameters *p = t->parameters;
    const TrackNode *last = &branch->node[branch->count - 1];
    const TrackNode *next = &t->estimate.node;
    Vec3 move = vec3_sub(next->cylinder.center, last->cylinder.center);
    t->why = "leaves the volume";
    if (!tracker_is_inside(t->volume, next->cylinder.center))
        return false;
    t->why = "stopped by `until`";
    if (tracker_is_stopped(t, last->cylinder.center, next->cylinder.center))
        return false;
    t->why = rbt_enters_forbidden;
    if (tracker_is_forbidden(t, next->cylinder.center))
        return false;
    t->why = "steps back";
    if (vec3_dot(move, last->cylinder.axis) < 0.25 * step)
        return false;
    for (int i = 0; i + 1 < branch->count; i++)
        if (tracker_segment_distance(next->cylinder.center, branch->node[i].cylinder.center, branch->node[i + 1].cylinder.center) <
            p->back_step * last->cylinder.radius)
            return false;
    t->why = "turns back";
    double arc = vec3_norm(move), least = same_cos(p->turn_deg * PI / 180) - 1e-9;
    for (int i = branch->count - 1; i >= 0 && arc < 2 * last->cylinder.radius; i--) {
        if (vec3_dot(next->cylinder.axis, branch->node[i].cylinder.axis) < least)
            return false;
        arc += i > 0 ? vec3_distance(branch->node[i].cylinder.center, branch->node[i - 1].cylinder.center) : 0;
    }
    t->why = "runs into itself";
    arc = vec3_norm(move);
    for (int i = branch->count - 2; i >= 0; i--) {
        arc += vec3_distance(branch->node[i].cylinder.center, branch->node[i + 1].cylinder.center);
        if (arc > 4 * last->cylinder.radius &&
            vec3_distance(next->cylinder.center, branch->node[i].cylinder.center) < p->overlap * branch->node[i].cylinder.radius)
            return false;
    }
    t->why = "the contrast is too low";
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
    t->why = "no similar vessel ahead";
    if (is_retry &&
        (fabs(next->cylinder.radius - last->cylinder.radius) > p->retry_radius * last->cylinder.radius || next->contrast < p->retry_contrast * contrast))
        return false;
    t->why = "runs into another branch";
    return may_overlap || tracker_node_around(t, next->cylinder.center, p->overlap) < 0;
}

// One attempt to find the next node. The node is measured last, because that takes as many rays as the fit; an unacceptable cylinder is only measured if
// the reason is wanted.
static bool try_node(Tracker *t, const Track *branch, const Cylinder *predicted, double relative_threshold, double step, bool is_retry, bool may_overlap,
                     bool is_reason_wanted)
{
    if (!fit_cylinder(t, predicted, relative_threshold))
        return false;
    bool is_good = is_progress(t, branch, step, is_retry, may_overlap);
    const char *why = t->why;
    if ((!is_good && !is_reason_wanted) || !measure_node(t, predicted, relative_threshold))
        return false;
    t->why = why;
    return is_good;
}

// Finds the next node of a branch: the step of eq. (1), then the longer ones, each with both thresholds. Returns false at the end of the vessel.
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
            if (try_node(t, branch, &predicted, second ? p->r_t_second : p->r_t, length, k > 0, may_overlap, !first_reason)) {
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

// --- across openings where no cylinder fits ---

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

// Appends nodes on the straight line between two cylinders, in an opening where no cylinder fits: their points are the first wall points that rays hit
// nearby.
static bool append_junction(Tracker *t, Track *branch, const Cylinder *from, const Cylinder *to)
{
    Vec3 line = vec3_sub(to->center, from->center);
    double gap = vec3_norm(line);
    int steps = (int)ceil(gap / (0.5 * fmin(from->radius, to->radius)));
    for (int i = 1; i < steps; i++) {
        double share = (double)i / steps;
        Cylinder c = {vec3_mix(from->center, to->center, share), from->radius + share * (to->radius - from->radius), vec3_unit(line), 2 * gap / steps};
        tracker_opening(t, &c, recent_contrast(branch));
        if (!track_append(branch, &t->estimate.node, t->estimate.point))
            return false;
    }
    return true;
}

static bool next_node(Tracker *t, const Track *branch, bool may_overlap);

// Tracks from an exit back towards the branch until it reaches the branch or the tube widens into the opening. Then joins the branch up to `keep` nodes, the
// junction, and the return path reversed. Returns false if the exit is not a vessel or is not in line of sight of the branch.
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
    int joined = -1;   // the node of the return path nearest to the branch and in its line of sight
    double nearest = HUGE_VAL, brightest = 0.5;
    for (int i = 0; good && i < 40; i++) {
        const Cylinder *c = &t->estimate.node.cylinder;
        double link = tracker_link_brightness(t, last.center, c->center), distance = vec3_distance(c->center, last.center);
        if (t->is_guarded && tracker_darkest(t, last.center, c->center) < t->floor)   // do not bridge regions too faint for a vessel
            link = 0;
        // it has reached the branch, entered the wide part, or passed the branch
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

// Called where the branch widens or ends: searches ahead for its continuation and joins the widest candidate that can be tracked.
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

// Tracks from an estimate of the first node until the vessel ends. The nodes are appended to `branch`, without parents. `until_tree`: the branch is tracked
// back towards its parent and ends inside another branch's tube.
void tracker_run(Tracker *t, const Cylinder *start, Track *branch, bool until_tree)
{
    const RbtParameters *p = t->parameters;
    double length = 0;
    bool left = tracker_node_around(t, start->center, 1) < 0;   // it may start inside its parent's tube
    Cylinder predicted = *start;
    if (!tracker_estimate(t, &predicted, p->r_t) && !(p->r_t_second > 0 && tracker_estimate(t, &predicted, p->r_t_second)))
        return;
    int rest = 0;   // number of nodes until the next search ahead
    for (bool found = true; found;) {
        if (!track_append(branch, &t->estimate.node, t->estimate.point)) {
            t->out_of_memory = true;
            return;
        }
        Vec3 here = t->estimate.node.cylinder.center;
        left = left || tracker_node_around(t, here, 1) < 0;
        length = branch_length(branch);
        if (!t->is_guarded && branch->count % SHOWN_EACH == 0)   // the limbs of a wave are tracked in other threads, and shown when they are adopted
            tracker_show(t, branch);
        t->why = "stopped";
        if (tracker_is_stopped_by_user(t))
            return;
        t->why = "reached max_length_mm";
        if (length >= fmin(p->max_length_mm, t->longest) || branch->count >= MAX_NODES)
            return;
        t->why = "reached its parent";
        if (until_tree && tracker_node_around(t, here, 0.9) >= 0)
            return;
        t->why = "stays inside its parent";
        if (!left && length > 6 * branch->node[0].cylinder.radius)
            return;
        found = next_node(t, branch, !left);
        bool swells = found && branch->count >= 6 && t->estimate.node.cylinder.radius > 1.35 * tracker_usual_radius(branch);
        rest -= rest > 0;
        if (p->look_ahead > 0 && !t->is_noisy && !until_tree && left && branch->count >= 6 && rest == 0 && (swells || !found)) {
            rest = 12;
            Estimate *kept = malloc(sizeof *kept);   // because the search overwrites the tracker's estimate
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

// Rays find where the brightness falls halfway to the background. The short chords through the start cross the vessel. The point nearest to the middles of
// the chords, weighted by length^-4, is closer to the middle of the lumen; the direction perpendicular to the short chords is the axis.
#include "recon/track/rbt_start.h"

#include "base/base.h"
#include "recon/track/rbt_branch.h"

#include <stdlib.h>

enum { MAX_CENTRINGS = 12 };

static double wall_distance(const Tracker *t, Vec3 x, Vec3 direction, double level, double reach)
{
    double step = 0.25 * t->voxel, before = tracker_brightness(t, x);
    for (double s = step; s < reach; s += step) {
        Vec3 here = vec3_add_scaled(x, s, direction);
        if (!tracker_is_inside(t->volume, here))   // an open chord: a vessel that leaves the volume has no wall there
            return reach;
        double value = tracker_brightness(t, here);
        if (value < level)
            return s - step * (level - value) / fmax(before - value, 1e-12);
        before = value;
    }
    return reach;
}

typedef struct Chords {
    double ahead[MAX_RAYS], behind[MAX_RAYS];
    double nearest;          // distance of the nearest wall
    Mat3 across;             // sum of length^-4 d d^T
    Vec3 middles;            // sum of length^-4 (ahead - behind) / 2 d
} Chords;

static void cast_chords(const Tracker *t, Vec3 x, double level, double reach, Chords *c)
{
    *c = (Chords){.nearest = reach};
    for (int i = 0; i < t->ray_count; i++) {
        Vec3 d = t->ray[i];
        c->ahead[i] = wall_distance(t, x, d, level, reach);
        c->behind[i] = wall_distance(t, x, vec3_negate(d), level, reach);
        c->nearest = fmin(c->nearest, fmin(c->ahead[i], c->behind[i]));
        double length = fmax((c->ahead[i] + c->behind[i]) / t->voxel, 0.5), weight = 1 / same_square(same_square(length)), part[3] = {d.x, d.y, d.z};
        for (int m = 0; m < 3; m++)
            for (int n = 0; n < 3; n++)
                c->across.m[m][n] += weight * part[m] * part[n];
        c->middles = vec3_add_scaled(c->middles, weight * 0.5 * (c->ahead[i] - c->behind[i]), d);
    }
}

// Solves (across + a small multiple of the identity) x = middles by Cramer's rule. Along the axis, where the chords give no information, the point does not
// move.
static Vec3 step_to_middle(const Chords *c)
{
    Mat3 a = c->across;
    double trace = a.m[0][0] + a.m[1][1] + a.m[2][2];
    for (int i = 0; i < 3; i++)
        a.m[i][i] += 0.05 * trace;
    Vec3 u = mat3_column(&a, 0), v = mat3_column(&a, 1), w = mat3_column(&a, 2), b = c->middles;
    double det = vec3_dot(u, vec3_cross(v, w));
    return vec3_scale(vec3(vec3_dot(b, vec3_cross(v, w)), vec3_dot(u, vec3_cross(b, w)), vec3_dot(u, vec3_cross(v, b))), 1 / det);
}

// Half the median chord perpendicular to the axis.
static double radius_across(const Tracker *t, const Chords *c, Vec3 axis)
{
    double half[MAX_RAYS];
    int n = 0;
    for (int i = 0; i < t->ray_count; i++)
        if (fabs(vec3_dot(t->ray[i], axis)) < 0.3)
            half[n++] = 0.5 * (c->ahead[i] + c->behind[i]);
    sort_doubles(half, (size_t)n);
    return n > 0 ? half[n / 2] : c->nearest;
}

// Background beside this vessel: the darker half of the points half a radius outside the wall, perpendicular to the axis.
static double background_beside(const Tracker *t, Vec3 x, Vec3 axis, double radius)
{
    double value[MAX_RAYS], sum = 0;
    int n = 0;
    for (int i = 0; i < t->ray_count; i++)
        if (fabs(vec3_dot(t->ray[i], axis)) < 0.3)
            value[n++] = tracker_brightness(t, vec3_add_scaled(x, 1.5 * radius + t->voxel, t->ray[i]));
    sort_doubles(value, (size_t)n);
    for (int i = 0; i < n / 2; i++)
        sum += value[i] / (n / 2);
    return n > 1 ? sum : t->background;
}

// Returns the ray direction to which the short chords are most nearly perpendicular.
static Vec3 axis_of(const Tracker *t, const Chords *c)
{
    int best = 0;
    double least = HUGE_VAL;
    for (int i = 0; i < t->ray_count; i++) {
        double across = vec3_dot(t->ray[i], mat3_mul_vec(&c->across, t->ray[i]));
        if (across < least) {
            least = across;
            best = i;
        }
    }
    return t->ray[best];
}

// Returns the direction of the longest chord, for a lumen that is not a tube.
static Vec3 longest_of(const Tracker *t, const Chords *c)
{
    int best = 0;
    for (int i = 1; i < t->ray_count; i++)
        if (c->ahead[i] + c->behind[i] > c->ahead[best] + c->behind[best])
            best = i;
    return t->ray[best];
}

// Finds the cylinder of highest inlier rate near the middle x, or a little further along. Returns false if there is none.
static bool best_cylinder(Tracker *t, Vec3 x, const Vec3 *axis, int axis_count, double radius, bool is_known, double level, Cylinder *out, double *inlier_rate)
{
    static const double along[] = {0, 1.5, -1.5, 3, -3}, size[] = {1, 0.75, 1.35};
    const RbtParameters *p = t->parameters;
    double best = 0;
    for (int place = 0; place < 5 && best <= 0; place++)
        for (int a = 0; a < axis_count; a++)
            for (int k = 0; k < (is_known ? 1 : 3); k++)
                for (int second = 0; second <= (p->r_t_second > 0); second++) {
                    Cylinder predicted = {vec3_add_scaled(x, along[place] * radius, axis[a]), fmax(size[k] * radius, 0.8 * t->voxel), axis[a], 0};
                    if (tracker_brightness(t, predicted.center) < level || !tracker_estimate(t, &predicted, second ? p->r_t_second : p->r_t))
                        continue;
                    const TrackNode *n = &t->estimate.node;
                    if (n->inlier_rate <= best || !tracker_is_inside(t->volume, n->cylinder.center) || tracker_brightness(t, n->cylinder.center) < level ||
                        vec3_distance(n->cylinder.center, predicted.center) > 2 * predicted.radius)
                        continue;
                    best = n->inlier_rate;
                    *out = n->cylinder;
                }
    *inlier_rate = best;
    return best > 0;
}

bool rbt_refine_start(Tracker *t, const Cylinder *guess, bool radius_is_known, double level, Cylinder *out, double *inlier_rate)
{
    if (!best_cylinder(t, guess->center, &guess->axis, 1, guess->radius, radius_is_known, level, out, inlier_rate))
        return false;
    if (vec3_dot(out->axis, guess->axis) < 0)
        out->axis = vec3_negate(out->axis);
    return true;
}

bool rbt_estimate_start(Tracker *t, const RbtSeed *seed, Cylinder *out, double *inlier_rate)
{
    Chords *chords = malloc(sizeof *chords);
    Vec3 x = seed->start, axis[2] = {{0, 0, 1}, {0, 0, 1}};
    double level = 0.5 * (t->background + tracker_brightness(t, x)), reach = 8 * t->voxel, radius = seed->radius;
    if (!chords) {
        t->out_of_memory = true;
        return false;
    }
    for (int i = 0; i < MAX_CENTRINGS; i++) {
        cast_chords(t, x, level, reach, chords);
        while (chords->nearest > reach / 4 && reach < 256 * t->voxel) {
            reach *= 2;
            cast_chords(t, x, level, reach, chords);
        }
        axis[0] = seed->has_toward ? vec3_unit(vec3_sub(seed->toward, seed->start)) : axis_of(t, chords);
        axis[1] = longest_of(t, chords);
        if (!(seed->radius > 0))
            radius = radius_across(t, chords, axis[0]);
        Vec3 move = step_to_middle(chords), next = vec3_add(x, move);
        bool is_done = !(vec3_norm(move) > 0.05 * t->voxel) || !tracker_is_inside(t->volume, next) || tracker_brightness(t, next) < level;
        x = is_done ? x : next;
        if (is_done && i > 1)
            break;
        double inside = tracker_brightness(t, x);
        level = 0.5 * (inside + fmin(background_beside(t, x, axis[0], radius), inside));
    }
    free(chords);
    if (best_cylinder(t, x, axis, seed->has_toward ? 1 : 2, radius, seed->radius > 0, level, out, inlier_rate)) {
        if (vec3_dot(out->axis, axis[0]) < 0)
            out->axis = vec3_negate(out->axis);
        return true;
    }
    t->why = "no tube found there";
    return false;
}

// --- the root ---

static double distance_to_border(const Volume *v, Vec3 x)
{
    Vec3 c = volume_voxel_of(v, x);
    double at[3] = {c.x, c.y, c.z}, least = HUGE_VAL;
    for (int i = 0; i < 3; i++) {
        double thickness = 1 / vec3_norm(vec3(v->to_voxel.m[i][0], v->to_voxel.m[i][1], v->to_voxel.m[i][2]));   // of a layer of voxels
        least = fmin(least, thickness * fmin(at[i], v->size[i] - 1 - at[i]));
    }
    return least;
}

bool rbt_root_is_at_end_of(const Tracker *t, const Track *a, const Track *b, const char **why)
{
    const Cylinder *ends[2] = {&a->node[a->count - 1].cylinder, &b->node[b->count - 1].cylinder};
    double distance[2], radius[2] = {tracker_usual_radius(a), tracker_usual_radius(b)};
    bool at_border[2];
    for (int i = 0; i < 2; i++) {
        distance[i] = distance_to_border(t->volume, ends[i]->center);
        at_border[i] = distance[i] < 2 * radius[i] + 2 * t->voxel;
    }
    *why = "the end at the volume's border";
    if (at_border[0] != at_border[1])
        return at_border[0];
    *why = "the wider end";
    if (fabs(radius[0] - radius[1]) > 0.1 * fmax(radius[0], radius[1]))
        return radius[0] > radius[1];
    *why = "of two equally wide ends the one nearer to the volume's border";
    return distance[0] <= distance[1];
}

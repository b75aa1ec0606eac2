#include "recon/track/rbt_tracker.h"

#include "base/base.h"
#include "recon/volume/bspline.h"

#include <stdlib.h>
#include <string.h>

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

void track_cut(Track *track, int count)
{
    if (count < track->count)
        track->point_count = track->node[count].point_start;
    track->count = count;
}

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

void track_free(Track *track)
{
    free(track->node);
    free(track->point);
    *track = (Track){0};
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

double tracker_brightness(const Tracker *t, Vec3 point) { return (double)bspline_sample(t->volume, volume_voxel_of(t->volume, point)); }

Vec3 tracker_in_mm(const Volume *volume, Vec3 x, bool is_voxel) { return is_voxel ? volume_point_of(volume, x) : x; }

bool tracker_is_inside(const Volume *volume, Vec3 x)
{
    Vec3 v = volume_voxel_of(volume, x);
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x <= volume->size[0] - 1 && v.y <= volume->size[1] - 1 && v.z <= volume->size[2] - 1;
}

bool tracker_is_forbidden(const Tracker *t, Vec3 x)
{
    for (int i = 0; i < t->parameters->forbid_count; i++)
        if (vec3_distance(x, tracker_in_mm(t->volume, t->parameters->forbid[i].center, t->parameters->forbid[i].is_voxel)) < t->parameters->forbid[i].radius)
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

double tracker_darkest(const Tracker *t, Vec3 a, Vec3 b)
{
    double least = HUGE_VAL;
    int steps = 2 + (int)fmin(vec3_distance(a, b) / (0.5 * t->voxel), 3998);
    for (int i = 0; i <= steps; i++)
        least = fmin(least, tracker_brightness(t, vec3_mix(a, b, (double)i / steps)));
    return least;
}

double tracker_link_brightness(const Tracker *t, Vec3 a, Vec3 b)
{
    double base = (double)t->volume->minimum, ends = fmin(tracker_brightness(t, a), tracker_brightness(t, b)) - base;
    return ends > 0 ? (tracker_darkest(t, a, b) - base) / ends : 0;
}

double tracker_segment_distance(Vec3 x, Vec3 a, Vec3 b)
{
    Vec3 ab = vec3_sub(b, a);
    double l2 = vec3_norm2(ab), s = l2 > 0 ? vec3_dot(vec3_sub(x, a), ab) / l2 : 0;
    return vec3_distance(x, vec3_add_scaled(a, fmax(0, fmin(1, s)), ab));
}

static RbtSeen seen(const TrackNode *node, int parent) { return (RbtSeen){node->cylinder.center, node->cylinder.radius, parent, node->kind}; }

void tracker_show(const Tracker *t, const Track *branch)
{
    const RbtWatch *watch = t->parameters->watch;
    int old = t->tree.count, count = old + (branch ? branch->count : 0);
    if (!watch || !watch->show)
        return;
    RbtSeen *node = HEAP_ZEROED((size_t)count, sizeof *node);
    for (int i = 0; i < old; i++)
        node[i] = seen(&t->tree.node[i], t->tree.node[i].parent);
    for (int i = old; i < count; i++)
        node[i] = seen(&branch->node[i - old], i > old ? i - 1 : -1);
    watch->show(watch->context, node, count);
    free(node);
}

// The path is the cheapest one over 26 neighbours. A step to a voxel costs its length divided by the cube of the brightness on a scale from background (0) to
// lumen (1), where the brightness is the mean of the voxel's and the spline's value. The path therefore stays in the middle and crosses dim places only where
// it must.
#include "recon/track/rbt_links.h"

#include "base/base.h"
#include "recon/track/rbt_branch.h"
#include "recon/track/path_heap.h"
#include "recon/volume/bspline.h"

#include <stdlib.h>
#include <string.h>

typedef struct Light {       // brightness scale of a link, from background to lumen
    double inside, outside;
} Light;

enum { MOST_PATH = 512 };
static const double least_lit = 0.6;   // least brightness on a link

static Light light_of(const Tracker *t, const TrackNode *a, const TrackNode *b)
{
    double ia = tracker_brightness(t, a->cylinder.center), ib = tracker_brightness(t, b->cylinder.center), inside = fmin(ia, ib);
    double outside = fmin(fmax(ia - a->contrast, ib - b->contrast), inside);
    // a brightness too low for a vessel is too low for a link
    if (outside + least_lit * (inside - outside) < 0.8 * t->floor && inside > 0.8 * t->floor)
        outside = inside - (inside - 0.8 * t->floor) / (1 - least_lit);
    return (Light){inside, outside};
}

// Brightness on the scale 0 (background) to 1 (lumen).
static double lit(const Light *l, double value)
{
    double range = l->inside - l->outside;
    return range > 0 ? fmax(0, fmin(1, (value - l->outside) / range)) : value >= l->inside;
}

static double darkest(const Tracker *t, Vec3 a, Vec3 b, const Light *light)
{
    double least = 1;
    int steps = 2 + (int)fmin(4000, vec3_distance(a, b) / (0.25 * t->voxel));
    for (int i = 0; i <= steps; i++)
        least = fmin(least, lit(light, tracker_brightness(t, vec3_mix(a, b, (double)i / steps))));
    return least;
}

typedef struct Search {
    int low[3], size[3];
    float *cost;
    int *from;
} Search;

static int index_in(const Search *s, const int at[3]) { return (at[2] * s->size[1] + at[1]) * s->size[0] + at[0]; }

static void place_in(const Search *s, int i, int at[3])
{
    at[0] = i % s->size[0];
    at[1] = i / s->size[0] % s->size[1];
    at[2] = i / (s->size[0] * s->size[1]);
}

static Vec3 voxel_in(const Search *s, int i)
{
    int at[3];
    place_in(s, i, at);
    return vec3(s->low[0] + at[0], s->low[1] + at[1], s->low[2] + at[2]);
}

// The value of the voxel itself: the spline blurs, so half a voxel outside a thin vessel it is still bright.
static double voxel_value(const Volume *v, Vec3 voxel)
{
    return (double)v->value[((size_t)voxel.z * (size_t)v->size[1] + (size_t)voxel.y) * (size_t)v->size[0] + (size_t)voxel.x];
}

// Searches the path from `start` to `end`, or with `paint` to the nearest tube of a node below `before` whose centre is in line of sight. Writes the voxels
// to path[0 … count-1], start first, and the node reached to `met`. Returns the count, 0 if there is no path, -1 if out of memory.
static int search_path(const Tracker *t, const RbtPaint *paint, int before, Vec3 start, Vec3 end, const Light *light, Vec3 *path, int *met)
{
    const Volume *v = t->volume;
    Search s;
    Vec3 a = volume_voxel_of(v, start), b = volume_voxel_of(v, end);
    double from[3] = {a.x, a.y, a.z}, to[3] = {b.x, b.y, b.z}, gap = vec3_distance(start, end);
    int first[3], last[3];
    for (int i = 0; i < 3; i++) {
        double margin = 6 + 0.75 * gap / vec3_norm(v->axis[i]);
        s.low[i] = (int)fmax(0, floor(fmin(from[i], to[i]) - margin));
        s.size[i] = (int)fmin(v->size[i] - 1, ceil(fmax(from[i], to[i]) + margin)) - s.low[i] + 1;
        if (s.size[i] < 1)
            return 0;
        first[i] = (int)fmax(0, fmin(s.size[i] - 1, floor(from[i] + 0.5) - s.low[i]));
        last[i] = (int)fmax(0, fmin(s.size[i] - 1, floor(to[i] + 0.5) - s.low[i]));
    }
    size_t box = (size_t)s.size[0] * (size_t)s.size[1] * (size_t)s.size[2];
    if (box > (1u << 24))
        return 0;
    PathHeap heap = {0};
    s.cost = malloc(box * sizeof *s.cost);
    s.from = malloc(box * sizeof *s.from);
    int goal = index_in(&s, last), origin = index_in(&s, first), reached = -1, count = -1;
    float length[27];
    for (int n = 0; n < 27; n++) {
        Vec3 step = vec3_scale(v->axis[0], n % 3 - 1);
        step = vec3_add_scaled(vec3_add_scaled(step, n / 3 % 3 - 1, v->axis[1]), n / 9 - 1, v->axis[2]);
        length[n] = (float)vec3_norm(step);
    }
    bool good = s.cost && s.from && path_heap_push(&heap, (PathEntry){0, origin});
    for (size_t i = 0; good && i < box; i++)
        s.cost[i] = HUGE_VALF;
    if (good) {
        s.cost[origin] = 0;
        s.from[origin] = -1;
    }
    while (good && heap.count > 0 && reached < 0) {
        PathEntry here = path_heap_pop(&heap);
        if (here.cost > s.cost[here.place])
            continue;
        Vec3 x = volume_point_of(v, voxel_in(&s, here.place));
        if (paint) {
            int node = rbt_paint_node(paint, x);
            if (node >= 0 && node < before && vec3_distance(x, t->tree.node[node].cylinder.center) < fmax(t->tree.node[node].cylinder.radius, t->voxel) &&
                darkest(t, x, t->tree.node[node].cylinder.center, light) >= least_lit) {
                *met = node;
                reached = here.place;
                break;
            }
        } else if (here.place == goal) {
            reached = goal;
            break;
        }
        int at[3];
        place_in(&s, here.place, at);
        for (int n = 0; n < 27 && good; n++) {
            int next[3] = {at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
            if (n == 13 || next[0] < 0 || next[1] < 0 || next[2] < 0 || next[0] >= s.size[0] || next[1] >= s.size[1] || next[2] >= s.size[2])
                continue;
            int k = index_in(&s, next);
            Vec3 voxel = voxel_in(&s, k);
            double bright = lit(light, (double)bspline_sample(v, voxel));
            if (tracker_is_forbidden(t, volume_point_of(v, voxel)) || bright < 0.7 * least_lit)
                continue;
            bright = 0.5 * (bright + lit(light, voxel_value(v, voxel)));
            float cost = here.cost + length[n] / (float)(bright * bright * bright);
            if (cost < s.cost[k]) {
                s.cost[k] = cost;
                s.from[k] = here.place;
                good = path_heap_push(&heap, (PathEntry){cost, k});
            }
        }
    }
    if (good) {
        count = 0;
        for (int i = reached; i >= 0; i = s.from[i])
            count++;
        int n = count;
        for (int i = reached; i >= 0; i = s.from[i])
            if (--n < MOST_PATH)
                path[n] = volume_point_of(v, voxel_in(&s, i));
        if (count > MOST_PATH)
            count = 0;
    }
    free(s.cost);
    free(s.from);
    free(heap.entry);
    return count;
}

// Inserts nodes along the path from the parent's centre to the child's: each as far along as the line of sight from the previous one allows, but at most half
// a radius.
static bool insert_nodes(Tracker *t, Track *out, const TrackNode *parent, const TrackNode *child, const Vec3 *path, int count, int number, int parent_index,
                         const Light *light)
{
    Vec3 last = parent->cylinder.center;
    double radius = child->kind == NODE_ANEURYSM ? fmin(parent->cylinder.radius, child->cylinder.radius) : child->cylinder.radius,
           spacing = fmax(0.7 * radius, t->voxel);
    for (int i = count - 1; i >= 0;) {   // the path runs from child to parent
        int next = i;
        while (next > 0 && vec3_distance(path[next - 1], last) <= spacing && darkest(t, last, path[next - 1], light) >= least_lit)
            next--;
        if (next == 0 && darkest(t, last, child->cylinder.center, light) >= least_lit && vec3_distance(last, child->cylinder.center) < 2 * spacing)
            break;
        Vec3 ahead = next > 0 ? path[next - 1] : child->cylinder.center;
        Cylinder c = {path[next], radius, vec3_unit_or(vec3_sub(ahead, last), child->cylinder.axis), 2 * fmax(vec3_distance(last, path[next]), 0.5 * t->voxel)};
        // in a wide ostium the walls are further away than the branch's radius
        for (int k = 0; k < 4; k++, c.radius = fmin(1.4 * c.radius, fmax(parent->cylinder.radius, child->cylinder.radius))) {
            tracker_opening(t, &c, fmax(0, child->contrast + tracker_brightness(t, c.center) - tracker_brightness(t, child->cylinder.center)));
            if (t->estimate.node.point_count >= t->ray_count / 4)
                break;
        }
        t->estimate.node.branch = number;
        t->estimate.node.parent = parent_index;
        t->estimate.node.is_on_voxels = true;
        if (!track_append(out, &t->estimate.node, t->estimate.point))
            return false;
        parent_index = -2;   // marks the node appended before
        last = path[next];
        i = next - 1;
    }
    return true;
}

bool rbt_repair_links(Tracker *t, const RbtPaint *paint, int first, bool *is_joined)
{
    Track *tree = &t->tree, new = {0};
    int count = tree->count - first;
    int *place = malloc(((size_t)count + 1) * sizeof *place);   // new index of a node of the branch
    bool good = place != NULL;
    *is_joined = true;
    Vec3 path[MOST_PATH];
    for (int i = 0; good && i < count; i++) {
        TrackNode node = tree->node[first + i];
        int parent = node.parent, path_count = 0;
        if (parent >= 0 && (parent >= first || paint)) {
            const TrackNode *p = &tree->node[parent];
            Light light = light_of(t, p, &node);
            if (darkest(t, p->cylinder.center, node.cylinder.center, &light) < least_lit) {
                path_count = search_path(t, parent < first ? paint : NULL, first, node.cylinder.center, p->cylinder.center, &light, path, &parent);
                good = path_count >= 0;
                if (path_count == 0) {
                    *is_joined = false;
                    // keep the nodes tracked up to here, if they are attached to the tree
                    break;
                }
            }
            if (good && path_count > 0) {
                int before = new.count;
                good = insert_nodes(t, &new, &tree->node[parent], &node, path, path_count, node.branch,
                                    parent >= first ? first + place[parent - first] : parent, &light);
                for (int k = before; k < new.count; k++)
                    if (new.node[k].parent == -2)
                        new.node[k].parent = first + k - 1;
                if (new.count > before)
                    parent = -2;
            }
        }
        if (good) {
            place[i] = new.count;
            node.parent = parent == -2 ? first + new.count - 1 : parent >= first ? first + place[parent - first] : parent;
            good = track_append(&new, &node, tree->point + tree->node[first + i].point_start);
        }
    }
    if (good) {
        track_cut(tree, first);
        for (int i = 0; good && i < new.count; i++)
            good = track_append(tree, &new.node[i], new.point + new.node[i].point_start);
        *is_joined = tree->count > first;
    }
    free(place);
    track_free(&new);
    return good;
}

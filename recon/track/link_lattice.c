// Dijkstra's algorithm over 26 neighbours on slices across the link; the first slice is at its start, the last at its end.
#include "recon/track/link_lattice.h"

#include "base/base.h"
#include "recon/track/path_heap.h"

#include <stdlib.h>

enum { ACROSS_MOST = 6, ALONG_MOST = 400, SMOOTHINGS = 3 };
static const double LEAST_CLEAR = 0.05;   // lower bound of the clearness in a step's cost

typedef struct Lattice {
    Vec3 from, step[3];      // step[2] along the link
    int half;                // number of lattice points to each side of the link
    int size[3];
    float *clear;            // (size[2], size[1], size[0]) clearness; < 0: not a lattice point
    float *cost;
    int *before;             // predecessor on the path
} Lattice;

float link_step_cost(float length, double a, double b)
{
    double clear = fmax(LEAST_CLEAR, 0.5 * (a + b)), square = clear * clear;
    return length / (float)(square * square);
}

void link_path_smooth(LinkPath *path)
{
    for (int pass = 0; pass < SMOOTHINGS; pass++) {
        Vec3 before = path->point[0];
        for (int i = 1; i + 1 < path->count; i++) {
            Vec3 here = path->point[i];
            path->point[i] = vec3_add(vec3_scale(here, 0.5), vec3_scale(vec3_add(before, path->point[i + 1]), 0.25));
            before = here;
        }
    }
}

static void place_in(const Lattice *l, int i, int at[3])
{
    at[0] = i % l->size[0];
    at[1] = i / l->size[0] % l->size[1];
    at[2] = i / (l->size[0] * l->size[1]);
}

static Vec3 point_of(const Lattice *l, const int at[3])
{
    return vec3_add_scaled(vec3_add_scaled(vec3_add_scaled(l->from, at[0] - l->half, l->step[0]), at[1] - l->half, l->step[1]), at[2], l->step[2]);
}

static bool lattice_create(Vec3 from, Vec3 to, double beside, double spacing, const LinkGround *ground, Lattice *l)
{
    double gap = vec3_distance(from, to), across = fmax(spacing, beside / ACROSS_MOST);
    int along = (int)fmax(1, fmin(ceil(gap / fmin(across, 2 * spacing)), ALONG_MOST));
    Vec3 axis = vec3_unit(vec3_sub(to, from)), u = vec3_normal_to(axis);
    *l = (Lattice){.from = from, .half = (int)floor(beside / across)};
    l->step[0] = vec3_scale(u, across);
    l->step[1] = vec3_scale(vec3_cross(axis, u), across);
    l->step[2] = vec3_scale(vec3_sub(to, from), 1.0 / along);
    l->size[0] = l->size[1] = 2 * l->half + 1;
    l->size[2] = along + 1;
    size_t n = (size_t)l->size[0] * (size_t)l->size[1] * (size_t)l->size[2];
    l->clear = malloc(n * sizeof *l->clear);
    l->cost = malloc(n * sizeof *l->cost);
    l->before = malloc(n * sizeof *l->before);
    if (!l->clear || !l->cost || !l->before)
        return false;
    for (size_t i = 0; i < n; i++) {
        int at[3];
        place_in(l, (int)i, at);
        double aside = across * same_hypot(at[0] - l->half, at[1] - l->half);
        l->clear[i] = aside > beside + 1e-9 ? -1 : (float)ground->clear(ground->context, point_of(l, at));
        l->cost[i] = HUGE_VALF;
    }
    return true;
}

static void lattice_free(Lattice *l)
{
    free(l->clear);
    free(l->cost);
    free(l->before);
}

// Searches the cheapest path from `start` to `goal`. Returns false if out of memory.
static bool cross_lattice(Lattice *l, const LinkGround *ground, int start, int goal)
{
    PathHeap heap = {0};
    l->cost[start] = 0;
    l->before[start] = -1;
    bool good = path_heap_push(&heap, (PathEntry){0, start});
    while (good && heap.count > 0) {
        PathEntry here = path_heap_pop(&heap);
        int at[3];
        if (here.place == goal)
            break;
        if (here.cost > l->cost[here.place])
            continue;
        place_in(l, here.place, at);
        for (int n = 0; n < 27 && good; n++) {
            int next[3] = {at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
            if (n == 13 || next[0] < 0 || next[1] < 0 || next[2] < 0 || next[0] >= l->size[0] || next[1] >= l->size[1] || next[2] >= l->size[2])
                continue;
            int k = (next[2] * l->size[1] + next[1]) * l->size[0] + next[0];
            Vec3 a = point_of(l, at), b = point_of(l, next);
            float cost = here.cost + link_step_cost((float)vec3_distance(a, b), (double)l->clear[here.place], (double)l->clear[k]);
            if (l->clear[k] < 0 || cost >= l->cost[k] || (ground->passes && !ground->passes(ground->context, a, b)))
                continue;
            l->cost[k] = cost;
            l->before[k] = here.place;
            good = path_heap_push(&heap, (PathEntry){cost, k});
        }
    }
    free(heap.entry);
    return good;
}

bool link_lattice_path(Vec3 from, Vec3 to, double beside, double spacing, const LinkGround *ground, LinkPath *out)
{
    Lattice l;
    bool good = lattice_create(from, to, beside, spacing, ground, &l);
    *out = (LinkPath){.share = 1};
    if (good) {
        int middle = l.half * l.size[0] + l.half, goal = (l.size[2] - 1) * l.size[0] * l.size[1] + middle, at[3];
        good = cross_lattice(&l, ground, middle, goal);
        bool is_met = good && l.cost[goal] < HUGE_VALF;
        for (int i = goal; is_met && i >= 0; i = l.before[i])
            out->count++;
        out->point = is_met ? malloc((size_t)out->count * sizeof *out->point) : NULL;
        good = good && (!is_met || out->point);
        for (int i = goal, n = out->count; good && is_met && i >= 0; i = l.before[i]) {
            place_in(&l, i, at);
            out->point[--n] = point_of(&l, at);
            out->share = fmin(out->share, (double)l.clear[i]);
        }
        if (good && is_met)
            link_path_smooth(out);
    }
    lattice_free(&l);
    return good;
}

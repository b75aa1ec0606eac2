#include "sim/case_missed.h"

#include "base/base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_VOXELS = 64, MARGIN = 2 };      // MARGIN: voxels around what the tree holds

typedef struct Search {
    const Volume *volume;
    int nx, ny, nz;
    float level;
    uint64_t *held, *seen;       // a bit for each voxel
    int64_t *stack, capacity;
} Search;

static bool bit_of(const uint64_t *bits, int64_t i) { return bits[i / 64] >> (i % 64) & 1; }
static void set_bit(uint64_t *bits, int64_t i) { bits[i / 64] |= (uint64_t)1 << (i % 64); }
static int clamped(double x, int most) { return x <= 0 ? 0 : x >= most ? most : (int)x; }

static int64_t voxel_at(const Search *s, Vec3 place)
{
    Vec3 v = volume_voxel_of(s->volume, place);
    int64_t k = clamped(round(v.z), s->nz - 1), j = clamped(round(v.y), s->ny - 1);
    return (k * s->ny + j) * s->nx + clamped(round(v.x), s->nx - 1);
}

// The median brightness at the centres, and of every so many voxels; the level lies half-way between them.
static bool find_level(Search *s, const VesselTree *tree)
{
    enum { SAMPLES = 100000 };
    int64_t voxels = (int64_t)s->nx * s->ny * s->nz, step = voxels / SAMPLES + 1, samples = (voxels + step - 1) / step;
    int64_t most = samples > tree->node_count ? samples : tree->node_count;
    double *value = malloc((size_t)most * sizeof *value);
    if (!value)
        return false;
    for (int64_t i = 0; i < samples; i++)
        value[i] = (double)s->volume->value[i * step];
    sort_doubles(value, (size_t)samples);
    double background = value[samples / 2];
    for (int i = 0; i < tree->node_count; i++)
        value[i] = (double)s->volume->value[voxel_at(s, tree->center[i])];
    sort_doubles(value, (size_t)tree->node_count);
    s->level = (float)(0.5 * (background + value[tree->node_count / 2]));
    free(value);
    return true;
}

// Marks the voxels within `radius` [mm] and MARGIN voxels of `place`.
static void hold_ball(Search *s, Vec3 place, double radius)
{
    Vec3 v = volume_voxel_of(s->volume, place);
    const double at[3] = {v.x, v.y, v.z};
    const int size[3] = {s->nx, s->ny, s->nz};
    double reach[3];
    int low[3], high[3];
    for (int k = 0; k < 3; k++) {
        reach[k] = radius / vec3_norm(s->volume->axis[k]) + MARGIN;
        low[k] = clamped(ceil(at[k] - reach[k]), size[k] - 1), high[k] = clamped(floor(at[k] + reach[k]), size[k] - 1);
    }
    for (int z = low[2]; z <= high[2]; z++)
        for (int y = low[1]; y <= high[1]; y++)
            for (int x = low[0]; x <= high[0]; x++) {
                double dx = (x - at[0]) / reach[0], dy = (y - at[1]) / reach[1], dz = (z - at[2]) / reach[2];
                if (dx * dx + dy * dy + dz * dz <= 1)
                    set_bit(s->held, ((int64_t)z * s->ny + y) * s->nx + x);
            }
}

// A node's ball and link; in a sac, which is no ball, also the way to each of its points.
static void hold_node(Search *s, const VesselTree *tree, int node, double voxel)
{
    Vec3 center = tree->center[node];
    int parent = tree->parent[node];
    double length = parent >= 0 ? vec3_distance(center, tree->center[parent]) : 0;
    int steps = 1 + (int)(length / fmax(tree->radius[node], voxel));
    for (int k = 0; k < steps; k++)
        hold_ball(s, k == 0 ? center : vec3_mix(center, tree->center[parent], (double)k / steps), tree->radius[node]);
    for (int64_t i = tree->point_offset[node]; tree->kind[node] != NODE_VESSEL && i < tree->point_offset[node + 1]; i++) {
        double way = vec3_distance(center, tree->point[i]);
        for (double at = fmin(tree->radius[node], way); at <= way; at += MARGIN * voxel)
            hold_ball(s, vec3_mix(center, tree->point[i], way > 0 ? at / way : 0), 0);
    }
}

static bool push(Search *s, int64_t *count, int64_t voxel)
{
    if (*count == s->capacity) {
        int64_t capacity = 2 * s->capacity + 4096, *more = realloc(s->stack, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        s->stack = more, s->capacity = capacity;
    }
    set_bit(s->seen, voxel);
    s->stack[(*count)++] = voxel;
    return true;
}

static bool is_open(const Search *s, int64_t i) { return s->volume->value[i] >= s->level && !bit_of(s->held, i) && !bit_of(s->seen, i); }

// Goes through all voxels connected with the first one. Returns their number; -1: out of memory.
static int64_t flood(Search *s, int64_t first, int64_t *brightest)
{
    int64_t waiting = 0, count = 0;
    *brightest = first;
    if (!push(s, &waiting, first))
        return -1;
    while (waiting > 0) {
        int64_t at = s->stack[--waiting];
        int x = (int)(at % s->nx), y = (int)(at / s->nx % s->ny), z = (int)(at / s->nx / s->ny);
        count++;
        if (s->volume->value[at] > s->volume->value[*brightest])
            *brightest = at;
        const struct {
            bool is_in;
            int64_t to;
        } next[6] = {{x > 0, at - 1},
                     {x + 1 < s->nx, at + 1},
                     {y > 0, at - s->nx},
                     {y + 1 < s->ny, at + s->nx},
                     {z > 0, at - (int64_t)s->nx * s->ny},
                     {z + 1 < s->nz, at + (int64_t)s->nx * s->ny}};
        for (int k = 0; k < 6; k++)
            if (next[k].is_in && is_open(s, next[k].to) && !push(s, &waiting, next[k].to))
                return -1;
    }
    return count;
}

// The largest part stays first.
static void keep(Missed *missed, MissedPart part)
{
    int at = missed->count < MISSED_PARTS ? missed->count++ : MISSED_PARTS - 1;
    if (missed->part[at].volume > part.volume)
        return;
    for (; at > 0 && missed->part[at - 1].volume < part.volume; at--)
        missed->part[at] = missed->part[at - 1];
    missed->part[at] = part;
}

static bool search(Search *s, double voxel_mm3, Missed *missed)
{
    int64_t voxels = (int64_t)s->nx * s->ny * s->nz, held = 0, bright = 0;
    for (int64_t i = 0; i < voxels; i++) {
        if (!(s->volume->value[i] >= s->level))
            continue;
        bright++;
        held += bit_of(s->held, i);
        if (!is_open(s, i))
            continue;
        int64_t brightest, count = flood(s, i, &brightest);
        if (count < 0)
            return false;
        if (count >= LEAST_VOXELS) {
            Vec3 place =
                volume_point_of(s->volume, vec3((double)(brightest % s->nx), (double)(brightest / s->nx % s->ny), (double)(brightest / s->nx / s->ny)));
            keep(missed, (MissedPart){place, (double)count * voxel_mm3});
        }
    }
    missed->held = bright > 0 ? (double)held / (double)bright : 1;
    return true;
}

bool missed_find(const Volume *volume, const VesselTree *tree, Missed *missed)
{
    Search s = {.volume = volume, .nx = volume->size[0], .ny = volume->size[1], .nz = volume->size[2]};
    size_t words = (size_t)s.nx * (size_t)s.ny * (size_t)s.nz / 64 + 1;
    const Vec3 *axis = volume->axis;
    double voxel = fmin(fmin(vec3_norm(axis[0]), vec3_norm(axis[1])), vec3_norm(axis[2]));
    *missed = (Missed){0};
    s.held = calloc(words, sizeof *s.held);
    s.seen = calloc(words, sizeof *s.seen);
    bool good = s.held && s.seen && find_level(&s, tree);
    for (int i = 0; i < tree->node_count && good; i++)
        hold_node(&s, tree, i, voxel);
    good = good && search(&s, fabs(vec3_dot(axis[0], vec3_cross(axis[1], axis[2]))), missed);
    free(s.held);
    free(s.seen);
    free(s.stack);
    return good;
}

// The search starts at each blob's centre, moved uphill if the field is below 0 there, and tests straight lines to the centres of the node found there and of
// its near nodes. If every line leaves the lumen, the place is flooded over a lattice until a point of it has an open line: then it belongs to the tree's
// lumen. If the flood ends without one, it is a ghost.
#include "geom/ghost_lumens.h"

#include "geom/blobby.h"
#include "geom/key_map.h"
#include "geom/power_walk.h"
#include "geom/reach.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS_MOST = 100000, STEPS_UP = 12, LATTICE_BITS = 20, LOOK_EVERY = 16 };
static const double CELL = 0.3;              // relative to the least radius

typedef struct GhostPoint {
    int at[3], node;
} GhostPoint;

typedef struct Search {
    const VesselTree *tree;
    double cell;
    KeyMap known;            // lattice points: the place from which they were flooded
    int place_count, place_capacity;
    bool *is_held;           // for each place that was flooded from: connected to the tree
    int count, capacity;     // points of the current flood
    GhostPoint *point;
    int ghost_capacity;
    bool *drops;             // (B)
    int *tested;             // (B) 1 + the last place for which the blob was tested
    GhostLumens *out;
} Search;

static uint64_t lattice_key(const int at[3])
{
    uint64_t key = 0;
    for (int a = 0; a < 3; a++)
        key = key << LATTICE_BITS | (uint64_t)((int64_t)at[a] + (1 << (LATTICE_BITS - 1)));
    return key;
}

static Vec3 lattice_point(const Search *s, const int at[3]) { return vec3(at[0] * s->cell, at[1] * s->cell, at[2] * s->cell); }

static void nearest_lattice_point(const Search *s, Vec3 x, int at[3])
{
    double c[3] = {x.x, x.y, x.z};
    for (int a = 0; a < 3; a++)
        at[a] = (int)fmin(fmax(floor(c[a] / s->cell + 0.5), -(1 << 18)), 1 << 18);
}

static bool grow(void **array, int count, int *capacity, size_t size)
{
    if (count < *capacity)
        return true;
    int bigger = 2 * *capacity + 256;
    void *moved = realloc(*array, (size_t)bigger * size);
    if (!moved)
        return false;
    *array = moved;
    *capacity = bigger;
    return true;
}

// --- Straight lines to the tree ---

static bool line_is_open(const VesselTree *tree, Vec3 x, int node, Vec3 to, double step)
{
    double pieces = ceil(vec3_distance(x, to) / step);
    int count = pieces > 400 ? 400 : pieces < 1 ? 1 : (int)pieces;
    for (int k = 0; k <= count; k++)
        if (!(reach_blob_field(tree, vec3_mix(x, to, (double)k / count), &node) > 0))
            return false;
    return true;
}

static bool is_held(const VesselTree *tree, Vec3 x, int node)
{
    if (line_is_open(tree, x, node, tree->center[node], 0.15 * tree->radius[node]))
        return true;
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++)
        if (line_is_open(tree, x, node, tree->center[tree->near[k]], 0.15 * tree->radius[tree->near[k]]))
            return true;
    return false;
}

// --- The flood ---

// Adds lattice point `at` unless it is known; returns whether the flood continues from it. *held: the point is known to be connected to the tree.
static bool add_point(Search *s, const int at[3], int node, bool *held, bool *failed)
{
    bool is_new;
    int *place = key_map_find_or_add(&s->known, lattice_key(at), s->place_count, &is_new);
    if (!place || (is_new && !grow((void **)&s->point, s->count, &s->capacity, sizeof *s->point))) {
        *failed = true;
        return false;
    }
    if (!is_new) {
        *held = *held || (*place < s->place_count && s->is_held[*place]);
        return false;
    }
    s->point[s->count++] = (GhostPoint){{at[0], at[1], at[2]}, node};
    return true;
}

// Fills s->point. Returns true if the place is connected to the tree, or is too large to be a ghost.
static bool flood_from(Search *s, Vec3 x, int node, bool *failed)
{
    int at[3];
    bool held = false;
    s->count = 0;
    nearest_lattice_point(s, x, at);
    for (int c = -1; c < 6 && !held && !*failed; c++) {      // the nearest lattice point, and its neighbours
        int beside[3] = {at[0], at[1], at[2]}, of = node;
        if (c >= 0)
            beside[c / 2] += c & 1 ? 1 : -1;
        if (reach_blob_field(s->tree, lattice_point(s, beside), &of) > 0 && line_is_open(s->tree, x, node, lattice_point(s, beside), 0.5 * s->cell))
            add_point(s, beside, of, &held, failed);
    }
    for (int i = 0; i < s->count && !held && !*failed; i++) {
        GhostPoint p = s->point[i];
        held = s->count > POINTS_MOST || (i % LOOK_EVERY == 0 && is_held(s->tree, lattice_point(s, p.at), p.node));
        for (int c = 0; c < 6 && !held && !*failed; c++) {
            int beside[3] = {p.at[0], p.at[1], p.at[2]}, of = p.node;
            beside[c / 2] += c & 1 ? 1 : -1;
            if (reach_blob_field(s->tree, lattice_point(s, beside), &of) > 0)
                add_point(s, beside, of, &held, failed);
        }
    }
    for (int i = 0; i < s->count && !held && !*failed; i++)   // the points skipped above
        held = i % LOOK_EVERY != 0 && is_held(s->tree, lattice_point(s, s->point[i].at), s->point[i].node);
    return held;
}

// --- Which blobs can be removed ---

static bool is_point_of_ghost(const Search *s, Vec3 x)
{
    int at[3];
    nearest_lattice_point(s, x, at);
    for (int c = 0; c < 27; c++) {       // x may lie in the ghost although the nearest point does not
        int beside[3] = {at[0] + c % 3 - 1, at[1] + c / 3 % 3 - 1, at[2] + c / 9 - 1};
        if (key_map_find(&s->known, lattice_key(beside)) == s->place_count)
            return true;
    }
    return false;
}

static bool serves_other_lumen(const Search *s, int blob, int node)
{
    enum { SIDE = 6 };
    Vec3 c = s->tree->blob_center[blob];
    double reach = s->tree->blob_width[blob], step = reach / SIDE;
    for (int i = -SIDE; i <= SIDE; i++)
        for (int j = -SIDE; j <= SIDE; j++)
            for (int k = -SIDE; k <= SIDE; k++) {
                if (i * i + j * j + k * k >= SIDE * SIDE)
                    continue;
                Vec3 x = vec3_add(c, vec3(i * step, j * step, k * step));
                int of = node;
                if (reach_blob_field(s->tree, x, &of) > 0 && !is_point_of_ghost(s, x))
                    return true;
            }
    return false;
}

static double blob_at(const VesselTree *tree, int blob, Vec3 x)
{
    double u = 1 - vec3_norm2(vec3_sub(x, tree->blob_center[blob])) / (tree->blob_width[blob] * tree->blob_width[blob]);
    return u > 0 ? tree->blob_amplitude[blob] * u * u * u : 0;
}

// Marks the blobs of the current flood that can be removed. Returns true if nothing of the ghost remains without them.
static bool mark_drops(Search *s, Vec3 x, int node)
{
    const VesselTree *tree = s->tree;
    bool dissolves = true;
    if (s->count == 0)
        s->point[s->count++] = (GhostPoint){.node = node};   // smaller than a cell: only the place itself
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < s->count; i++) {
            bool is_place = s->count == 1 && s->point[0].at[0] == 0 && s->point[0].at[1] == 0 && s->point[0].at[2] == 0;
            Vec3 p = is_place ? x : lattice_point(s, s->point[i].at);
            Blobby model = blobby_of(tree, s->point[i].node);
            double left = -tree->iso_level;
            for (int j = 0; j < model.count; j++) {
                int blob = blobby_row(&model, j);
                double value = blob_at(tree, blob, p);
                if (pass == 0 && value > 0 && s->tested[blob] <= s->place_count) {
                    s->tested[blob] = s->place_count + 1;
                    s->drops[blob] = s->drops[blob] || !serves_other_lumen(s, blob, s->point[i].node);
                }
                left += s->drops[blob] ? 0 : value;
            }
            dissolves = dissolves && (pass == 0 || !(left > 0));
        }
    return dissolves;
}

// --- The whole tree ---

// Moves x uphill until the field is above 0. Returns false if it does not become so.
static bool climb(const VesselTree *tree, Vec3 *x, int *node, double step)
{
    for (int i = 0; i < STEPS_UP; i++) {
        if (reach_blob_field(tree, *x, node) > 0)
            return true;
        Blobby model = blobby_of(tree, *node);
        Vec3 g;
        blobby_gradient(&model, *x, &g);
        if (!(vec3_norm2(g) > 1e-200))
            return false;
        *x = vec3_add_scaled(*x, step, vec3_unit(g));
    }
    return false;
}

static bool look_from(Search *s, int owner, int64_t blob)
{
    const VesselTree *tree = s->tree;
    bool shared = vessel_tree_is_shared(tree), failed = false;
    Vec3 x = tree->blob_center[blob];
    int node = owner, at[3];
    if (shared && !(tree->blob_amplitude[blob] > 0))
        return true;
    if (!shared && power_walk(tree, x, owner, 4) != owner)   // a tool point there does not use this model
        return true;
    if (!climb(tree, &x, &node, 0.1 * tree->blob_width[blob]) || is_held(tree, x, node))
        return true;
    nearest_lattice_point(s, x, at);
    if (key_map_find(&s->known, lattice_key(at)) >= 0)
        return true;
    if (!grow((void **)&s->is_held, s->place_count, &s->place_capacity, sizeof *s->is_held) || !grow((void **)&s->point, 0, &s->capacity, sizeof *s->point))
        return false;
    bool held = flood_from(s, x, node, &failed);
    s->is_held[s->place_count] = held;
    GhostLumens *out = s->out;
    if (!held && !failed && grow((void **)&out->ghost, out->count, &s->ghost_capacity, sizeof *out->ghost)) {
        GhostLumen ghost = {.place = x, .node = node, .points = s->count, .volume = s->count * s->cell * s->cell * s->cell};
        ghost.dissolves = shared && mark_drops(s, x, node);
        out->ghost[out->count++] = ghost;
    } else {
        failed = failed || !held;
    }
    s->place_count++;
    return !failed;
}

static int by_volume(const void *a, const void *b)
{
    const GhostLumen *x = a, *y = b;
    return x->volume != y->volume ? (x->volume < y->volume) - (x->volume > y->volume) : (x->node > y->node) - (x->node < y->node);
}

static bool list_drops(Search *s)
{
    GhostLumens *out = s->out;
    out->drop = malloc(((size_t)s->tree->blob_count + 1) * sizeof *out->drop);
    for (int64_t b = 0; b < s->tree->blob_count && out->drop; b++)
        if (s->drops[b])
            out->drop[out->drop_count++] = (int32_t)b;
    return out->drop != NULL;
}

GhostLumens *ghost_lumens_find(const VesselTree *tree)
{
    if (!tree || !vessel_tree_is_model(tree) || tree->blob_count > INT_MAX / 2)
        return NULL;
    double least = HUGE_VAL;
    for (int i = 0; i < tree->node_count; i++)
        least = fmin(least, tree->radius[i]);
    Search s = {.tree = tree,
                .cell = CELL * least,
                .out = calloc(1, sizeof *s.out),
                .drops = calloc((size_t)tree->blob_count + 1, sizeof *s.drops),
                .tested = calloc((size_t)tree->blob_count + 1, sizeof *s.tested)};
    bool good = s.out && s.drops && s.tested;
    for (int i = 0; i < tree->node_count && good; i++)
        for (int64_t b = tree->blob_offset[i]; b < tree->blob_offset[i + 1] && good; b++)
            good = look_from(&s, i, b);
    good = good && list_drops(&s);
    GhostLumens *out = s.out;
    if (good) {
        out->cell = s.cell;
        if (out->count > 1)
            qsort(out->ghost, (size_t)out->count, sizeof *out->ghost, by_volume);
    } else {
        ghost_lumens_free(out);
        out = NULL;
    }
    key_map_free(&s.known);
    free(s.is_held);
    free(s.point);
    free(s.drops);
    free(s.tested);
    return out;
}

void ghost_lumens_free(GhostLumens *ghosts)
{
    if (!ghosts)
        return;
    free(ghosts->ghost);
    free(ghosts->drop);
    free(ghosts);
}

// Near a straight link the search uses a lattice along it (link_lattice.h), half a voxel apart. The search for another parent uses the image's
// voxels, with the same cost: the length of a step over the fourth power of the brightness between background (0) and the child's lumen (1).
#include "recon/track/rbt_link_path.h"

#include "base/base.h"
#include "recon/track/path_heap.h"
#include "recon/volume/bspline.h"

#include <stdlib.h>
#include <string.h>

enum { FIRST_NODES = 9, BOX_MOST = 96 };

LinkLight rbt_link_light(const Track *tree, const Tracker *t, int node)
{
    double inside[FIRST_NODES], contrast[FIRST_NODES];
    const TrackNode *first = &tree->node[node];
    int n = 0;
    for (int i = node; i < tree->count && n < FIRST_NODES && tree->node[i].branch == first->branch && tree->node[i].kind == first->kind; i++, n++) {
        inside[n] = tracker_brightness(t, tree->node[i].cylinder.center);
        contrast[n] = tree->node[i].contrast;
    }
    sort_doubles(inside, (size_t)n);
    sort_doubles(contrast, (size_t)n);
    // the contrast of an aneurysm given in the trace file is unknown; use that of the vessel to which it is attached
    double c = contrast[n / 2] > 0 || first->parent < 0 ? contrast[n / 2] : tree->node[first->parent].contrast;
    return (LinkLight){inside[n / 2], inside[n / 2] - c};
}

static double rbt_link_lit(const LinkLight *light, double value)
{
    double range = light->inside - light->outside;
    return range > 0 ? fmax(0, fmin(1, (value - light->outside) / range)) : value >= light->inside;
}

static double lit_at(const Tracker *t, const LinkLight *light, Vec3 x)
{
    return tracker_is_forbidden(t, x) ? 0 : rbt_link_lit(light, tracker_brightness(t, x));
}

typedef struct Grid {
    int size[3];
    float *lit;              // (size[2], size[1], size[0]) < 0: blocked, or not yet evaluated if `look` is set
    float *cost;
    int *from;
    float length[27];        // [mm] length of the step to each neighbour
} Grid;

static bool grid_create(Grid *g)
{
    size_t n = (size_t)g->size[0] * (size_t)g->size[1] * (size_t)g->size[2];
    g->lit = malloc(n * sizeof *g->lit);
    g->cost = malloc(n * sizeof *g->cost);
    g->from = malloc(n * sizeof *g->from);
    for (size_t i = 0; g->cost && i < n; i++)
        g->cost[i] = HUGE_VALF;
    return g->lit && g->cost && g->from;
}

static void grid_free(Grid *g)
{
    free(g->lit);
    free(g->cost);
    free(g->from);
}

static void place_in(const Grid *g, int i, int at[3])
{
    at[0] = i % g->size[0];
    at[1] = i / g->size[0] % g->size[1];
    at[2] = i / (g->size[0] * g->size[1]);
}

static int index_in(const Grid *g, const int at[3]) { return (at[2] * g->size[1] + at[1]) * g->size[0] + at[0]; }

// Index of neighbour number n (0 … 26) of a position; -1 outside the grid and for the position itself.
static int neighbour_in(const Grid *g, const int at[3], int n)
{
    int next[3] = {at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
    for (int i = 0; i < 3; i++)
        if (next[i] < 0 || next[i] >= g->size[i])
            return -1;
    return n == 13 ? -1 : index_in(g, next);
}

static void set_lengths(Grid *g, const Vec3 step[3])
{
    for (int n = 0; n < 27; n++) {
        Vec3 to = vec3_scale(step[0], n % 3 - 1);
        g->length[n] = (float)vec3_norm(vec3_add_scaled(vec3_add_scaled(to, n / 3 % 3 - 1, step[1]), n / 9 - 1, step[2]));
    }
}

// Counts the steps of the path from `goal` back to the start.
static int count_back(const Grid *g, int goal)
{
    int count = 0;
    for (int i = goal; i >= 0; i = g->from[i])
        count++;
    return count;
}

// --- near the link ---

typedef struct Lit {
    const Tracker *t;
    const LinkLight *light;
} Lit;

static double lit_on_ground(const void *context, Vec3 x)
{
    const Lit *lit = context;
    return lit_at(lit->t, lit->light, x);
}

bool rbt_link_path(const Tracker *t, Vec3 from, Vec3 to, double beside, const LinkLight *light, LinkPath *out)
{
    Lit lit = {t, light};
    return link_lattice_path(from, to, beside, 0.5 * t->voxel, &(LinkGround){lit_on_ground, NULL, &lit}, out);
}

// --- another parent ---

typedef struct Box {         // voxels low … low + size - 1
    Grid grid;
    int low[3];
    int *owner;              // number + 1 of the node in which a path may end; 0: none, -1: blocked
} Box;

static Vec3 box_point(const Tracker *t, const Box *b, const int at[3])
{
    return volume_point_of(t->volume, vec3(b->low[0] + at[0], b->low[1] + at[1], b->low[2] + at[2]));
}

// Marks the voxels in a node's ball.
static void mark_ball(const Tracker *t, Box *b, Vec3 center, double radius, int mark)
{
    Vec3 c = volume_voxel_of(t->volume, center);
    double middle[3] = {c.x, c.y, c.z};
    int first[3], last[3], at[3];
    for (int i = 0; i < 3; i++) {
        Vec3 row = vec3(t->volume->to_voxel.m[i][0], t->volume->to_voxel.m[i][1], t->volume->to_voxel.m[i][2]);
        double half = radius * vec3_norm(row);
        first[i] = (int)fmax(0, fmin(b->grid.size[i], ceil(middle[i] - half - b->low[i])));
        last[i] = (int)fmin(b->grid.size[i] - 1, fmax(-1, floor(middle[i] + half - b->low[i])));
    }
    for (at[2] = first[2]; at[2] <= last[2]; at[2]++)
        for (at[1] = first[1]; at[1] <= last[1]; at[1]++)
            for (at[0] = first[0]; at[0] <= last[0]; at[0]++)
                if (vec3_distance(box_point(t, b, at), center) < radius)
                    b->owner[index_in(&b->grid, at)] = mark;
}

static bool box_create(const Tracker *t, int node, const bool *hangs, double reach, Box *b)
{
    const Volume *v = t->volume;
    const Cylinder *child = &t->tree.node[node].cylinder;
    Vec3 c = volume_voxel_of(v, child->center);
    double at[3] = {c.x, c.y, c.z};
    *b = (Box){.low = {0}};
    for (int i = 0; i < 3; i++) {
        double half = fmin(reach / vec3_norm(v->axis[i]) + 1, BOX_MOST / 2);
        b->low[i] = (int)fmax(0, ceil(at[i] - half));
        b->grid.size[i] = (int)fmin(v->size[i] - 1, floor(at[i] + half)) - b->low[i] + 1;
        if (b->grid.size[i] < 1)
            return false;
    }
    size_t n = (size_t)b->grid.size[0] * (size_t)b->grid.size[1] * (size_t)b->grid.size[2];
    b->owner = calloc(n, sizeof *b->owner);
    set_lengths(&b->grid, v->axis);
    if (!b->owner || !grid_create(&b->grid))
        return false;
    for (size_t i = 0; i < n; i++)
        b->grid.lit[i] = -1;
    // the child's subtree is blocked with its blurred rim, except for the child's own beginning; vessels are marked last, because a path may end where they
    // touch it
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < t->tree.count; i++) {
            const Cylinder *other = &t->tree.node[i].cylinder;
            double distance = vec3_distance(other->center, child->center);
            if (hangs[i] != (pass == 0) || distance > 2 * reach + other->radius || (pass == 0 && distance < 2 * child->radius + t->voxel))
                continue;
            mark_ball(t, b, other->center, pass == 0 ? 1.15 * other->radius + t->voxel : fmax(0.8 * other->radius, 0.6 * t->voxel), pass == 0 ? -1 : i + 1);
        }
    return true;
}

static void box_free(Box *b)
{
    grid_free(&b->grid);
    free(b->owner);
}

// Returns the first voxel reached in a vessel's tube, or -1 if there is none. *good is false if out of memory.
static int search_box(const Tracker *t, Box *b, int start, double reach, double least, const LinkLight *light, bool *good)
{
    Grid *g = &b->grid;
    PathHeap heap = {0};
    int found = -1, at[3];
    // the cost limit allows a path of length `reach` that is dim throughout, but no longer path
    double most = reach / same_square(same_square(least));
    g->cost[start] = 0;
    g->from[start] = -1;
    g->lit[start] = 1;
    *good = path_heap_push(&heap, (PathEntry){0, start});
    while (*good && heap.count > 0 && found < 0) {
        PathEntry here = path_heap_pop(&heap);
        if (here.cost > g->cost[here.place])
            continue;
        if (b->owner[here.place] > 0) {
            found = here.place;
            break;
        }
        place_in(g, here.place, at);
        for (int n = 0; n < 27 && *good; n++) {
            int k = neighbour_in(g, at, n), next[3];
            if (k < 0 || b->owner[k] < 0)
                continue;
            if (g->lit[k] < 0) {
                place_in(g, k, next);
                g->lit[k] = (float)lit_at(t, light, box_point(t, b, next));
            }
            if ((double)g->lit[k] < least)
                continue;
            float cost = here.cost + link_step_cost(g->length[n], (double)g->lit[here.place], (double)g->lit[k]);
            if (cost < g->cost[k] && (double)cost < most) {
                g->cost[k] = cost;
                g->from[k] = here.place;
                *good = path_heap_push(&heap, (PathEntry){cost, k});
            }
        }
    }
    free(heap.entry);
    return found;
}

bool rbt_link_search(const Tracker *t, int node, const bool *hangs, double reach, double least, const LinkLight *light, LinkPath *out, int *met)
{
    Box b;
    *out = (LinkPath){.share = 1};
    if (!box_create(t, node, hangs, reach, &b)) {
        bool is_full = b.grid.size[0] > 0 && b.grid.size[1] > 0 && b.grid.size[2] > 0;   // otherwise the box lies outside the image
        box_free(&b);
        return !is_full;
    }
    Vec3 center = t->tree.node[node].cylinder.center, c = volume_voxel_of(t->volume, center);
    int at[3] = {(int)floor(c.x + 0.5) - b.low[0], (int)floor(c.y + 0.5) - b.low[1], (int)floor(c.z + 0.5) - b.low[2]};
    for (int i = 0; i < 3; i++)
        at[i] = at[i] < 0 ? 0 : at[i] >= b.grid.size[i] ? b.grid.size[i] - 1 : at[i];
    bool good;
    int goal = search_box(t, &b, index_in(&b.grid, at), reach, least, light, &good);
    if (good && goal >= 0) {
        // from the centre of the node reached over the voxels to the child's centre
        int count = count_back(&b.grid, goal);
        out->point = malloc(((size_t)count + 1) * sizeof *out->point);
        good = out->point != NULL;
        *met = b.owner[goal] - 1;
        for (int i = goal; good && i >= 0; i = b.grid.from[i]) {
            place_in(&b.grid, i, at);
            out->share = fmin(out->share, (double)b.grid.lit[i]);
            out->point[++out->count] = b.grid.from[i] >= 0 ? box_point(t, &b, at) : center;
        }
        if (good) {
            out->point[0] = t->tree.node[*met].cylinder.center;
            out->count++;
            link_path_smooth(out);
        }
    }
    box_free(&b);
    return good;
}

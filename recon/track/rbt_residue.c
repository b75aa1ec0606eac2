// The length of the shortest path through the residue from the labelled tubes to each voxel divides it into shells. Connected voxels of one shell form a
// piece, and the pieces form a forest by reachability (as in rbt_exits.c). The deepest leaf with its path to the root is a limb, then the deepest of the
// rest, and so on; short ones are ragged edges.
#include "recon/track/rbt_residue.h"
#include "base/base.h"
#include "recon/track/path_heap.h"
#include "recon/volume/bspline.h"

#include <stdlib.h>
#include <string.h>

// --- flood ---

typedef struct Wet {         // a voxel of the residue
    int at[3];
    float arc;               // [mm] path length from the tube
    int from, piece;         // predecessor and piece; -1: none
    int node;                // node at which the path started
} Wet;

typedef struct Flood {
    const Volume *volume;
    Wet *wet;
    int count, capacity;
    int *slot;               // (slots, a power of two) hash table: index + 1 of the wet voxel at a position
    int slots;
    PathHeap heap;
    bool out_of_memory;
} Flood;

static unsigned slot_of(const Flood *f, size_t voxel)
{
    uint64_t h = (uint64_t)voxel * 0x9e3779b97f4a7c15u;
    return (unsigned)(h >> 32) & (unsigned)(f->slots - 1);
}

static int find_wet(const Flood *f, const int at[3])
{
    if (f->slots == 0)
        return -1;
    size_t voxel = rbt_voxel_index(f->volume, at);
    for (unsigned s = slot_of(f, voxel);; s = (s + 1) & (unsigned)(f->slots - 1)) {
        int i = f->slot[s] - 1;
        if (i < 0 || rbt_voxel_index(f->volume, f->wet[i].at) == voxel)
            return i;
    }
}

static void put_in_slot(Flood *f, int wet)
{
    unsigned s = slot_of(f, rbt_voxel_index(f->volume, f->wet[wet].at));
    while (f->slot[s])
        s = (s + 1) & (unsigned)(f->slots - 1);
    f->slot[s] = wet + 1;
}

static int add_wet(Flood *f, const int at[3], float arc, int from, int node)
{
    if (f->count == f->capacity) {
        int capacity = f->capacity ? 2 * f->capacity : 1024;
        Wet *grown = realloc(f->wet, (size_t)capacity * sizeof *grown);
        int *slot = calloc(2 * (size_t)capacity, sizeof *slot);
        if (grown)
            f->wet = grown;
        if (!grown || !slot) {
            free(slot);
            f->out_of_memory = true;
            return -1;
        }
        free(f->slot);
        f->slot = slot;
        f->capacity = capacity;
        f->slots = 2 * capacity;
        for (int i = 0; i < f->count; i++)
            put_in_slot(f, i);
    }
    f->wet[f->count] = (Wet){{at[0], at[1], at[2]}, arc, from, -1, node};
    put_in_slot(f, f->count);
    return f->count++;
}

static void put_in_heap(Flood *f, float arc, int wet) { f->out_of_memory = !path_heap_push(&f->heap, (PathEntry){arc, wet}) || f->out_of_memory; }

static bool neighbour_of(const Volume *v, const int at[3], int n, int next[3])
{
    next[0] = at[0] + n % 3 - 1;
    next[1] = at[1] + n / 3 % 3 - 1;
    next[2] = at[2] + n / 9 - 1;
    for (int i = 0; i < 3; i++)
        if (next[i] < 0 || next[i] >= v->size[i])
            return false;
    return n != 13;
}

typedef struct Border {      // brightness limits of the residue beside a node
    double level, ceiling, reach;
} Border;

static bool is_residue(const Tracker *t, const RbtPaint *paint, const int at[3], const Border *border)
{
    if (paint->owner[rbt_voxel_index(t->volume, at)])
        return false;
    Vec3 x = vec3(at[0], at[1], at[2]);
    double value = (double)bspline_sample(t->volume, x);
    return value >= border->level && value <= border->ceiling && !tracker_is_forbidden(t, volume_point_of(t->volume, x));
}

static void flood(Flood *f, const Tracker *t, const RbtPaint *paint, int first, const Border *border)
{
    float length[27];
    for (int n = 0; n < 27; n++) {
        Vec3 step = vec3_scale(t->volume->axis[0], n % 3 - 1);
        step = vec3_add_scaled(vec3_add_scaled(step, n / 3 % 3 - 1, t->volume->axis[1]), n / 9 - 1, t->volume->axis[2]);
        length[n] = (float)vec3_norm(step);
    }
    while (f->heap.count > 0 && !f->out_of_memory) {
        PathEntry here = path_heap_pop(&f->heap);
        Wet wet = f->wet[here.place];
        const Border *b = &border[wet.node - first];
        if (here.cost > wet.arc)
            continue;
        for (int n = 0; n < 27 && !f->out_of_memory; n++) {
            int next[3];
            float arc = here.cost + length[n];
            if (!neighbour_of(t->volume, wet.at, n, next) || arc > (float)b->reach)
                continue;
            int known = find_wet(f, next);
            if (known >= 0 ? arc >= f->wet[known].arc : !is_residue(t, paint, next, b))
                continue;
            if (known < 0)
                known = add_wet(f, next, arc, here.place, wet.node);
            if (known < 0)
                return;
            f->wet[known].arc = arc;
            f->wet[known].from = here.place;
            f->wet[known].node = wet.node;
            put_in_heap(f, arc, known);
        }
    }
}

// --- pieces and limbs ---

typedef struct Piece {
    int shell, parent, count, node, farthest;
    Vec3 sum;
    int limb;                // limb that contains it, -1: none yet
    int place;               // position in that limb, from its tip
} Piece;

static Piece *cut_into_pieces(Flood *f, double thickness, int *piece_count)
{
    int count = 0, capacity = 256;
    Piece *piece = HEAP_ZEROED((size_t)capacity, sizeof *piece);
    int *stack = HEAP_ZEROED((size_t)f->count, sizeof *stack);
    for (int i = 0; i < f->count; i++) {
        if (f->wet[i].piece >= 0)
            continue;
        if (count == capacity) {
            capacity *= 2;
            piece = HEAP_GROWN(piece, (size_t)capacity, sizeof *piece);
        }
        int shell = (int)((double)f->wet[i].arc / thickness), held = 0;
        piece[count] = (Piece){.shell = shell, .parent = i, .node = f->wet[i].node, .farthest = i, .limb = -1};
        f->wet[i].piece = count;
        stack[held++] = i;
        while (held > 0) {
            int here = stack[--held], next[3];
            Piece *p = &piece[count];
            const Wet *w = &f->wet[here];
            p->count++;
            p->sum = vec3_add(p->sum, volume_point_of(f->volume, vec3(w->at[0], w->at[1], w->at[2])));
            if (w->arc > f->wet[p->farthest].arc ||
                (w->arc == f->wet[p->farthest].arc && rbt_voxel_index(f->volume, w->at) < rbt_voxel_index(f->volume, f->wet[p->farthest].at)))
                p->farthest = here;
            for (int n = 0; n < 27; n++) {
                if (!neighbour_of(f->volume, w->at, n, next))
                    continue;
                int k = find_wet(f, next);
                if (k >= 0 && f->wet[k].piece < 0 && (int)((double)f->wet[k].arc / thickness) == shell) {
                    f->wet[k].piece = count;
                    stack[held++] = k;
                }
            }
        }
        count++;
    }
    free(stack);
    for (int i = 0; i < count; i++) {
        int wet = piece[i].parent;   // until now `parent` holds one of its voxels
        while (wet >= 0 && f->wet[wet].piece == i)
            wet = f->wet[wet].from;
        piece[i].parent = wet >= 0 ? f->wet[wet].piece : -1;
    }
    *piece_count = count;
    return piece;
}

typedef struct Order {
    int shell, index;
    size_t voxel;
} Order;

static int compare_depth(const void *a, const void *b)
{
    const Order *x = a, *y = b;
    return x->shell != y->shell ? y->shell - x->shell : (x->voxel > y->voxel) - (x->voxel < y->voxel);
}

static double width_of(const Piece *p, double voxel_volume, double thickness) { return sqrt(p->count * voxel_volume / thickness / PI); }

static RbtLimb *gather_limbs(const Flood *f, Piece *piece, int piece_count, const Border *border, int first, double thickness, int *count)
{
    const Volume *v = f->volume;
    double voxel = volume_voxel_size(v), voxel_volume = fabs(vec3_dot(v->axis[0], vec3_cross(v->axis[1], v->axis[2])));
    Order *order = HEAP_ZEROED((size_t)piece_count, sizeof *order);
    RbtLimb *limb = NULL;
    int capacity = 0, used = 0;
    for (int i = 0; i < piece_count; i++)
        order[i] = (Order){piece[i].shell, i, rbt_voxel_index(v, f->wet[piece[i].farthest].at)};
    qsort(order, (size_t)piece_count, sizeof *order, compare_depth);
    for (int k = 0; k < piece_count; k++) {
        int leaf = order[k].index, length = 0, top = leaf;
        if (piece[leaf].limb != -1)
            continue;
        double width = 0;
        for (int i = leaf; i >= 0 && piece[i].limb == -1; i = piece[i].parent) {
            width += width_of(&piece[i], voxel_volume, thickness);
            length++;
            top = i;
        }
        width /= length;
        // if it is a ragged edge, its subtree stays available to other limbs, but the edge itself does not
        bool is_long = length * thickness >= fmax(3 * voxel, width);
        if (!is_long) {
            for (int i = leaf, n = 0; n < length; n++, i = piece[i].parent)
                piece[i].limb = -2;
            continue;
        }
        if (used == capacity) {
            capacity = capacity ? 2 * capacity : 16;
            limb = HEAP_GROWN(limb, (size_t)capacity, sizeof *limb);
        }
        RbtLimb *l = &limb[used];
        const Border *b = &border[piece[leaf].node - first];
        *l = (RbtLimb){.contact = piece[top].node,
                       .level = b->level,
                       .ceiling = b->ceiling,
                       .depth = (double)f->wet[piece[leaf].farthest].arc,
                       .key = rbt_voxel_index(v, f->wet[piece[leaf].farthest].at),
                       .stem = -1};
        l->is_cut = l->depth > b->reach - 2 * thickness;
        int above = piece[top].parent;
        if (above >= 0 && piece[above].limb >= 0) {
            l->stem = piece[above].limb;
            l->stem_place = limb[l->stem].count - 1 - piece[above].place;
        }
        l->count = length < RBT_LIMB_PLACES ? length : RBT_LIMB_PLACES;
        for (int i = leaf, n = 0; n < length; n++, i = piece[i].parent) {
            piece[i].limb = used;
            piece[i].place = n;
            int at = length - 1 - n;
            if (at < l->count) {
                l->place[at] = vec3_scale(piece[i].sum, 1.0 / piece[i].count);
                l->radius[at] = width_of(&piece[i], voxel_volume, thickness);
            }
        }
        used++;
    }
    free(order);
    *count = used;
    return limb;
}

// Sets the limits of each node from the brightness inside and beside the vessel, medians over a few nodes.
static void set_borders(const Tracker *t, int first, int end, double share, double noise, Border *border)
{
    enum { HALF = 3 };
    double brightest = -HUGE_VAL;
    for (int i = first; i < end; i++) {
        double inside[2 * HALF + 1], outside[2 * HALF + 1];
        int n = 0;
        for (int k = i - HALF; k <= i + HALF; k++)
            if (k >= first && k < end) {
                inside[n] = tracker_brightness(t, t->tree.node[k].cylinder.center);
                outside[n] = inside[n] - t->tree.node[k].contrast;
                n++;
            }
        sort_doubles(inside, (size_t)n);
        sort_doubles(outside, (size_t)n);
        double in = inside[n / 2], out = fmin(outside[n / 2], in);
        border[i - first].level = out + fmax(share * (in - out), noise);
        // narrow vessels appear dim, but their branches may be brighter
        border[i - first].ceiling = t->tree.node[i].cylinder.radius < 2 * t->voxel ? t->ceiling : in + RBT_BRIGHTER * (in - out) + RBT_NOISE_SHARE * noise;
        border[i - first].reach = fmax(14 * t->voxel, 3.5 * t->tree.node[i].cylinder.radius);
        brightest = fmax(brightest, border[i - first].ceiling);
    }
    for (int i = first; i < end; i++)
        border[i - first].ceiling = brightest;
}

RbtLimb *rbt_find_limbs(const Tracker *t, const RbtPaint *paint, int first, int end, double share, double noise, int *count)
{
    const Volume *v = t->volume;
    Flood f = {.volume = v};
    Border *border = HEAP_ZEROED((size_t)(end - first), sizeof *border);
    RbtLimb *limb = NULL;
    double thickness = 2 * t->voxel;
    *count = -1;
    set_borders(t, first, end, share, noise, border);
    for (int i = first; i < end; i++) {
        const Cylinder *c = &t->tree.node[i].cylinder;
        double reach = rbt_rim_of(v, c->radius) + 1.5 * t->voxel;
        RbtBox box = rbt_box_of_ball(v, c->center, reach);
        int at[3];
        thickness = fmax(thickness, border[i - first].reach / (RBT_LIMB_PLACES - 2));
        for (at[2] = box.low[2]; at[2] <= box.high[2]; at[2]++)
            for (at[1] = box.low[1]; at[1] <= box.high[1]; at[1]++)
                for (at[0] = box.low[0]; at[0] <= box.high[0]; at[0]++) {
                    if (paint->owner[rbt_voxel_index(v, at)] || vec3_distance(volume_point_of(v, vec3(at[0], at[1], at[2])), c->center) > reach ||
                        !is_residue(t, paint, at, &border[i - first]) || find_wet(&f, at) >= 0 ||
                        tracker_is_stopped(t, c->center, volume_point_of(v, vec3(at[0], at[1], at[2]))))
                        continue;
                    int wet = add_wet(&f, at, 0, -1, i);
                    if (wet >= 0)
                        put_in_heap(&f, 0, wet);
                }
    }
    flood(&f, t, paint, first, border);
    int piece_count = 0;
    Piece *piece = f.out_of_memory ? NULL : cut_into_pieces(&f, thickness, &piece_count);
    if (piece)
        limb = gather_limbs(&f, piece, piece_count, border, first, thickness, count);
    free(piece);
    free(border);
    free(f.wet);
    free(f.slot);
    free(f.heap.entry);
    return limb;
}

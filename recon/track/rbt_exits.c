// The length of the shortest path through the lumen from the start to each voxel (Dijkstra's algorithm over 26 neighbours) divides the lumen into shells.
// In a tube a shell is one disc; where tubes divide, a shell splits into pieces, one per tube; a sac's bottom is a piece that ends. A piece's volume over
// the shell's thickness is its cross-section. A piece is a tube if sections similar to its own follow over three times its width. The first tube piece
// after a piece that is not a tube is an exit. (Going back from the last pieces was tried; it missed exits that soon fork.)
#include "recon/track/rbt_exits.h"

#include "base/base.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct HeapEntry {
    float arc;
    int32_t voxel;
} HeapEntry;

typedef struct Flood {
    const Volume *volume;
    int low[3], size[3];     // box of voxels
    float *arc;              // (box) [mm], HUGE_VALF: not reached
    int32_t *from;           // (box) predecessor on the path
    int32_t *piece;          // (box) piece of each voxel; -1: none
    HeapEntry *heap;
    int heap_count, heap_capacity;
} Flood;

typedef struct Piece {
    int shell, parent, count;
    Vec3 sum;                // [mm] sum of the voxels' positions
} Piece;

static bool heap_before(HeapEntry a, HeapEntry b) { return a.arc < b.arc || (a.arc == b.arc && a.voxel < b.voxel); }

static void heap_push(Flood *f, HeapEntry entry)
{
    if (f->heap_count == f->heap_capacity) {
        int capacity = f->heap_capacity ? 2 * f->heap_capacity : 4096;
        f->heap = HEAP_GROWN(f->heap, (size_t)capacity, sizeof *f->heap);
        f->heap_capacity = capacity;
    }
    int i = f->heap_count++;
    for (; i > 0 && heap_before(entry, f->heap[(i - 1) / 2]); i = (i - 1) / 2)
        f->heap[i] = f->heap[(i - 1) / 2];
    f->heap[i] = entry;
}

static HeapEntry heap_pop(Flood *f)
{
    HeapEntry top = f->heap[0], last = f->heap[--f->heap_count];
    int i = 0;
    for (int child; (child = 2 * i + 1) < f->heap_count; i = child) {
        if (child + 1 < f->heap_count && heap_before(f->heap[child + 1], f->heap[child]))
            child++;
        if (!heap_before(f->heap[child], last))
            break;
        f->heap[i] = f->heap[child];
    }
    f->heap[i] = last;
    return top;
}

static void place_of(const Flood *f, int32_t voxel, int at[3])
{
    at[0] = voxel % f->size[0];
    at[1] = voxel / f->size[0] % f->size[1];
    at[2] = voxel / (f->size[0] * f->size[1]);
}

static Vec3 point_of(const Flood *f, const int at[3]) { return volume_point_of(f->volume, vec3(f->low[0] + at[0], f->low[1] + at[1], f->low[2] + at[2])); }

static float value_at(const Flood *f, const int at[3])
{
    const Volume *v = f->volume;
    return v->value[((size_t)(f->low[2] + at[2]) * (size_t)v->size[1] + (size_t)(f->low[1] + at[1])) * (size_t)v->size[0] + (size_t)(f->low[0] + at[0])];
}

static bool is_blocked(Vec3 x, Vec3 start, Vec3 direction, double radius, const RbtBlock *block, int count)
{
    // the balls near the start extend past it: they block only the part behind it
    bool is_behind = vec3_dot(vec3_sub(x, start), direction) <= -0.3 * radius;
    for (int i = 0; i < count; i++)
        if (vec3_norm2(vec3_sub(x, block[i].center)) < block[i].radius * block[i].radius &&
            (is_behind || vec3_norm2(vec3_sub(start, block[i].center)) > 4 * block[i].radius * block[i].radius))
            return true;
    return false;
}

// Finds neighbour number n (0 … 26; 13 is the voxel itself) of a position. Returns false outside the box.
static bool neighbour_of(const Flood *f, const int at[3], int n, int next[3], int32_t *voxel)
{
    next[0] = at[0] + n % 3 - 1;
    next[1] = at[1] + n / 3 % 3 - 1;
    next[2] = at[2] + n / 9 - 1;
    for (int i = 0; i < 3; i++)
        if (next[i] < 0 || next[i] >= f->size[i])
            return false;
    *voxel = (next[2] * f->size[1] + next[1]) * f->size[0] + next[0];
    return n != 13;
}

static void flood(Flood *f, int32_t first, Vec3 start, Vec3 direction, double radius, double reach, double level, const RbtBlock *block, int block_count)
{
    float length[27];
    for (int n = 0; n < 27; n++) {
        Vec3 step = vec3_scale(f->volume->axis[0], n % 3 - 1);
        step = vec3_add_scaled(vec3_add_scaled(step, n / 3 % 3 - 1, f->volume->axis[1]), n / 9 - 1, f->volume->axis[2]);
        length[n] = (float)vec3_norm(step);
    }
    f->arc[first] = 0;
    f->from[first] = -1;
    heap_push(f, (HeapEntry){0, first});
    while (f->heap_count > 0) {
        HeapEntry here = heap_pop(f);
        int at[3], next[3];
        int32_t voxel;
        if (here.arc > f->arc[here.voxel])
            continue;
        place_of(f, here.voxel, at);
        for (int n = 0; n < 27; n++) {
            float arc = here.arc + length[n];
            if (!neighbour_of(f, at, n, next, &voxel) || arc > (float)reach || arc >= f->arc[voxel] || (double)value_at(f, next) < level ||
                is_blocked(point_of(f, next), start, direction, radius, block, block_count))
                continue;
            f->arc[voxel] = arc;
            f->from[voxel] = here.voxel;
            heap_push(f, (HeapEntry){arc, voxel});
        }
    }
}

// Divides the shells into pieces of connected voxels. A piece's parent is the piece from which its first voxel was reached. Pieces are numbered in the order
// of their shells.
static Piece *cut_into_pieces(Flood *f, double thickness, int shells, int *piece_count)
{
    int box = f->size[0] * f->size[1] * f->size[2], count = 0, capacity = 256;
    Piece *piece = HEAP_ZEROED((size_t)capacity, sizeof *piece);
    int32_t *stack = HEAP_ZEROED((size_t)box, sizeof *stack);
    for (int32_t i = 0; i < box; i++) {
        if (f->arc[i] > 1e30f || f->piece[i] >= 0)
            continue;
        if (count == capacity) {
            capacity *= 2;
            piece = HEAP_GROWN(piece, (size_t)capacity, sizeof *piece);
        }
        int shell = (int)((double)f->arc[i] / thickness), held = 0;
        piece[count] = (Piece){.shell = shell < shells ? shell : shells - 1, .parent = i};   // temporarily: one of its voxels
        f->piece[i] = count;
        stack[held++] = i;
        while (held > 0) {
            int at[3], next[3];
            int32_t voxel;
            place_of(f, stack[--held], at);
            piece[count].count++;
            piece[count].sum = vec3_add(piece[count].sum, point_of(f, at));
            for (int n = 0; n < 27; n++)
                if (neighbour_of(f, at, n, next, &voxel) && f->arc[voxel] < 1e30f && f->piece[voxel] < 0 && (int)((double)f->arc[voxel] / thickness) == shell) {
                    f->piece[voxel] = count;
                    stack[held++] = voxel;
                }
        }
        count++;
    }
    free(stack);
    for (int i = 0; i < count; i++) {
        int32_t voxel = piece[i].parent;
        while (voxel >= 0 && f->piece[voxel] == i)
            voxel = f->from[voxel];
        piece[i].parent = voxel >= 0 ? f->piece[voxel] : -1;
    }
    *piece_count = count;
    return piece;
}

// Counts the pieces that follow `top` on the longest downstream path whose sections are similar to that of `first`; *next is the first of them. With some
// hundred pieces a linear search for the children is fast enough.
static int tube_below(const Piece *piece, int count, int first, int top, int limit, int *next)
{
    int longest = 0;
    *next = -1;
    for (int i = 0; limit > 0 && i < count; i++) {
        if (piece[i].parent != top || piece[i].count > 1.5 * piece[first].count || piece[i].count < 0.3 * piece[first].count)
            continue;
        int below, length = 1 + tube_below(piece, count, first, i, limit - 1, &below);
        if (length > longest || (length == longest && piece[i].count > piece[*next].count)) {
            longest = length;
            *next = i;
        }
    }
    return longest;
}

// Returns true if a piece is the head of a tube: similar sections follow over three times its width.
static bool is_tube(const Piece *piece, int count, int head, double voxel_volume, double thickness, double radius, double *width)
{
    *width = sqrt(piece[head].count * voxel_volume / thickness / PI);
    int needed = (int)ceil(fmax(3 * *width, radius) / thickness), next;
    return *width > 0.3 * radius && tube_below(piece, count, head, head, needed, &next) >= needed;
}

static void follow_tube(const Piece *piece, int count, int head, int needed, RbtExit *out)
{
    Vec3 place[RBT_EXIT_PLACES + 1];
    int n = 0, next;
    for (int i = head; n <= RBT_EXIT_PLACES && i >= 0; i = next) {
        place[n++] = vec3_scale(piece[i].sum, 1.0 / piece[i].count);
        if (tube_below(piece, count, head, i, needed, &next) < 1)
            break;
    }
    out->count = n - 1;
    for (int i = 0; i + 1 < n; i++) {
        out->center[i] = place[i];
        out->direction[i] = vec3_unit(vec3_sub(place[i + 1], place[i > 0 ? i - 1 : 0]));
    }
}

int rbt_find_exits(const Volume *volume, Vec3 start, Vec3 direction, double radius, double reach, double level, const RbtBlock *block, int block_count,
                   RbtExit *out, int capacity)
{
    Flood f = {.volume = volume};
    Vec3 middle = volume_voxel_of(volume, start);
    double at[3] = {middle.x, middle.y, middle.z}, voxel_volume = fabs(vec3_dot(volume->axis[0], vec3_cross(volume->axis[1], volume->axis[2])));
    size_t box = 1;
    for (int i = 0; i < 3; i++) {
        double half = reach / vec3_norm(volume->axis[i]) + 2;
        f.low[i] = (int)fmax(0, floor(at[i] - half));
        int high = (int)fmin(volume->size[i] - 1, ceil(at[i] + half));
        f.size[i] = high - f.low[i] + 1;
        if (f.size[i] < 1)
            return 0;
        box *= (size_t)f.size[i];
    }
    if (box > ((size_t)1 << 27))   // a search this far would not be local
        return 0;
    int found = 0, piece_count = 0;
    double thickness = fmax(0.5 * radius, 1.5 * volume_voxel_size(volume));
    int shells = (int)(reach / thickness) + 1;
    f.arc = HEAP_ZEROED(box, sizeof *f.arc);
    f.from = HEAP_ZEROED(box, sizeof *f.from);
    f.piece = HEAP_ZEROED(box, sizeof *f.piece);
    for (size_t i = 0; i < box; i++)
        f.arc[i] = HUGE_VALF;
    memset(f.piece, 0xff, box * sizeof *f.piece);
    int first[3];
    for (int i = 0; i < 3; i++)
        first[i] = (int)fmax(0, fmin(f.size[i] - 1, floor(at[i] + 0.5) - f.low[i]));
    flood(&f, (first[2] * f.size[1] + first[1]) * f.size[0] + first[0], start, direction, radius, reach, level, block, block_count);
    Piece *piece = cut_into_pieces(&f, thickness, shells, &piece_count);
    for (int i = 0; i < piece_count; i++) {
        RbtExit exit;
        double width;
        // the head of a tube: the piece before it is not a tube
        if (!is_tube(piece, piece_count, i, voxel_volume, thickness, radius, &exit.radius) ||
            (piece[i].parent >= 0 && is_tube(piece, piece_count, piece[i].parent, voxel_volume, thickness, radius, &width)))
            continue;
        follow_tube(piece, piece_count, i, (int)ceil(3 * exit.radius / thickness), &exit);
        int k = found < capacity ? found++ : capacity;
        for (; k > 0 && out[k - 1].radius < exit.radius; k--)
            if (k < capacity)
                out[k] = out[k - 1];
        if (k < capacity)
            out[k] = exit;
    }
    free(piece);
    free(f.arc);
    free(f.from);
    free(f.piece);
    free(f.heap);
    return found;
}

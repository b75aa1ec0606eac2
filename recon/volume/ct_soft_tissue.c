// Limits: smaller specks above the threshold are calcified walls or clips; contrast agent has at least 150 HU; the edge between bone and tissue is blurred over two
// voxels.
#include "recon/volume/ct_soft_tissue.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const double LEAST_MM3 = 50;
static const float TISSUE = 40, CONTRAST = 150;      // [HU] of brain and muscle; of contrast agent, at least
enum { RIM = 2 };        // voxels
enum { SEEN = 1, BONE = 2, NEAR = 4, CORE = 8, EDGE = 16, LEFT = 32 };

typedef struct Bones {
    const Volume *volume;
    float least;             // [HU] of bone
    int64_t step[3];         // voxels between neighbours along each axis
    float *value;            // (voxels) of what is left
    // (voxels) SEEN; BONE; EDGE: within its rim; NEAR: or one voxel further; CORE: inside a vessel that is NEAR; LEFT: seen among what is left
    uint8_t *mark;
    int64_t *list;           // (voxels) of the part that is being gathered
} Bones;

typedef bool (*IsPart)(const Bones *b, int64_t at);
static bool is_bone(const Bones *b, int64_t at) { return b->volume->value[at] > b->least && !b->mark[at]; }
static bool is_left(const Bones *b, int64_t at) { return b->value[at] > CONTRAST && !(b->mark[at] & LEFT); }

// Gathers the part that touches the first voxel and marks it as `seen`. Returns the number of voxels in the list.
static int64_t gather(const Bones *b, int64_t first, IsPart is_part, uint8_t seen)
{
    int64_t count = 0;
    b->mark[first] |= seen;
    b->list[count++] = first;
    for (int64_t next = 0; next < count; next++)
        for (int k = 0; k < 3; k++) {
            int64_t at = b->list[next], i = at / b->step[k] % b->volume->size[k];
            for (int side = -1; side <= 1; side += 2)
                if (i + side >= 0 && i + side < b->volume->size[k] && is_part(b, at + side * b->step[k])) {
                    b->mark[at + side * b->step[k]] |= seen;
                    b->list[count++] = at + side * b->step[k];
                }
        }
    return count;
}

// Calls `call` for the voxels of the cube of 2 reach + 1 around `at`, without its corners if `is_round`, until it returns false. Returns whether all were called.
static bool around(const Bones *b, int64_t at, int reach, bool is_round, bool (*call)(const Bones *b, int64_t at))
{
    int low[3], high[3];
    for (int k = 0; k < 3; k++) {
        const int64_t i = at / b->step[k] % b->volume->size[k], left = b->volume->size[k] - 1 - i;
        low[k] = -(int)(i < reach ? i : reach), high[k] = (int)(left < reach ? left : reach);
    }
    for (int z = low[2]; z <= high[2]; z++)
        for (int y = low[1]; y <= high[1]; y++)
            for (int x = low[0]; x <= high[0]; x++)
                if (!(is_round && x && y && z) && !call(b, at + x + y * b->step[1] + z * b->step[2]))
                    return false;
    return true;
}

static bool mark_near(const Bones *b, int64_t at)
{
    b->mark[at] |= NEAR;
    return true;
}

static bool mark_edge(const Bones *b, int64_t at)
{
    b->mark[at] |= EDGE;
    return true;
}

static bool is_lit(const Bones *b, int64_t at) { return b->volume->value[at] > CONTRAST && !(b->mark[at] & BONE); }
static bool is_no_core(const Bones *b, int64_t at) { return !(b->mark[at] & CORE); }

// A voxel on the face of bone has a neighbour that is none.
static bool is_inner(const Bones *b, int64_t at)
{
    for (int k = 0; k < 3; k++) {
        const int64_t i = at / b->step[k] % b->volume->size[k];
        if ((i > 0 && !(b->mark[at - b->step[k]] & BONE)) || (i + 1 < b->volume->size[k] && !(b->mark[at + b->step[k]] & BONE)))
            return false;
    }
    return true;
}

static void mark_bone(Bones *b, int64_t voxels, double voxel_mm3)
{
    for (int64_t i = 0; i < voxels; i++) {
        int64_t count = is_bone(b, i) ? gather(b, i, is_bone, SEEN) : 0;
        for (int64_t k = 0; (double)count * voxel_mm3 >= LEAST_MM3 && k < count; k++)
            b->mark[b->list[k]] |= BONE;
    }
    for (int64_t i = 0; i < voxels; i++)
        if (b->mark[i] & BONE && !is_inner(b, i))
            around(b, i, RIM, false, mark_edge), around(b, i, RIM + 1, false, mark_near);
    for (int64_t i = 0; i < voxels; i++)
        if (b->mark[i] & NEAR && around(b, i, 1, true, is_lit))
            b->mark[i] |= CORE;
}

// Spongy bone: what is left in bone or on it, and is too small for a vessel.
static void drop_crumbs(Bones *b, int64_t voxels, double voxel_mm3)
{
    for (int64_t i = 0; i < voxels; i++) {
        int64_t count = b->mark[i] & EDGE && is_left(b, i) ? gather(b, i, is_left, LEFT) : 0;
        for (int64_t k = 0; (double)count * voxel_mm3 < LEAST_MM3 && k < count; k++)
            b->value[b->list[k]] = TISSUE;
    }
}

Volume *ct_soft_tissue(const Volume *volume, double bone)
{
    Volume *out = volume_create(volume->size, volume->origin, volume->axis);
    const int64_t nx = volume->size[0], plane = nx * volume->size[1], voxels = plane * volume->size[2];
    const bool has_bone = bone > 0;
    Bones b = {volume,
               (float)bone,
               {1, nx, plane},
               out ? out->value : NULL,
               has_bone ? calloc((size_t)voxels, 1) : NULL,
               has_bone ? malloc((size_t)voxels * sizeof *b.list) : NULL};
    const bool good = out && (!has_bone || (b.mark && b.list));
    const double voxel_mm3 = fabs(vec3_dot(volume->axis[0], vec3_cross(volume->axis[1], volume->axis[2])));
    if (good && has_bone)
        mark_bone(&b, voxels, voxel_mm3);
    if (good) {
        memcpy(out->frame, volume->frame, sizeof out->frame);
        memcpy(out->format, volume->format, sizeof out->format);
        out->minimum = out->maximum = TISSUE;
    }
    for (int64_t i = 0; good && i < voxels; i++) {
        const float value = volume->value[i];
        const uint8_t mark = has_bone ? b.mark[i] : 0;
        const bool is_rim = mark & EDGE && value > TISSUE && around(&b, i, 1, true, is_no_core);
        out->value[i] = mark & BONE || is_rim || value < CT_NUMBER_TISSUE ? TISSUE : value;
    }
    if (good && has_bone)
        drop_crumbs(&b, voxels, voxel_mm3);
    for (int64_t i = 0; good && i < voxels; i++) {
        out->minimum = fminf(out->minimum, out->value[i]);
        out->maximum = fmaxf(out->maximum, out->value[i]);
    }
    free(b.mark);
    free(b.list);
    if (good)
        return out;
    volume_free(out);
    return NULL;
}

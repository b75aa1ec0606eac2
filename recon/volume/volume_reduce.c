#include "recon/volume/volume_reduce.h"

#include <math.h>
#include <stdlib.h>

static float brightest(const Volume *v, const int from[3], const int to[3])
{
    float most = v->minimum;
    for (int k = from[2]; k < to[2]; k++)
        for (int j = from[1]; j < to[1]; j++) {
            const float *row = v->value + ((size_t)k * (size_t)v->size[1] + (size_t)j) * (size_t)v->size[0];
            for (int i = from[0]; i < to[0]; i++)
                most = row[i] > most ? row[i] : most;
        }
    return most;
}

Volume *volume_reduced(const Volume *v, int most)
{
    int block[3], size[3];
    Vec3 axis[3], origin = v->origin;
    for (int k = 0; k < 3; k++) {
        block[k] = (v->size[k] + most - 1) / most;
        size[k] = (v->size[k] + block[k] - 1) / block[k];
        axis[k] = vec3_scale(v->axis[k], block[k]);
        origin = vec3_add_scaled(origin, 0.5 * (block[k] - 1), v->axis[k]);
    }
    Volume *out = volume_create(size, origin, axis);
    if (!out)
        return NULL;
    float *value = out->value;
    for (int k = 0; k < size[2]; k++)
        for (int j = 0; j < size[1]; j++)
            for (int i = 0; i < size[0]; i++) {
                int from[3] = {i * block[0], j * block[1], k * block[2]}, to[3];
                for (int a = 0; a < 3; a++)
                    to[a] = from[a] + block[a] < v->size[a] ? from[a] + block[a] : v->size[a];
                *value++ = brightest(v, from, to);
            }
    out->minimum = v->minimum;
    out->maximum = v->maximum;
    return out;
}

// --- bone ---

enum { SEEN = 1, BONE = 2 };
typedef struct Bones {
    const Volume *volume;
    int64_t step[3];         // voxels between neighbours along each axis
    uint8_t *mark;           // (voxels) SEEN, BONE
    int64_t *list;           // (voxels) of the part that is being gathered
} Bones;

static bool is_bone(const Bones *b, int64_t at) { return b->volume->value[at] > CT_NUMBER_BONE && !b->mark[at]; }

// Gathers what touches the first voxel. Returns the number of voxels in the list.
static int64_t gather(const Bones *b, int64_t first)
{
    int64_t count = 0;
    b->mark[first] = SEEN;
    b->list[count++] = first;
    for (int64_t next = 0; next < count; next++)
        for (int k = 0; k < 3; k++) {
            int64_t at = b->list[next], i = at / b->step[k] % b->volume->size[k];
            for (int side = -1; side <= 1; side += 2)
                if (i + side >= 0 && i + side < b->volume->size[k] && is_bone(b, at + side * b->step[k])) {
                    b->mark[at + side * b->step[k]] = SEEN;
                    b->list[count++] = at + side * b->step[k];
                }
        }
    return count;
}

// Blackens the voxels within `reach` [mm] of this one.
static void blacken_around(const Bones *b, Volume *v, int64_t at, double reach)
{
    int low[3], high[3];
    for (int k = 0; k < 3; k++) {
        int i = (int)(at / b->step[k] % v->size[k]), most = (int)(reach / vec3_norm(v->axis[k]));
        low[k] = -(i < most ? i : most), high[k] = v->size[k] - 1 - i < most ? v->size[k] - 1 - i : most;
    }
    for (int z = low[2]; z <= high[2]; z++)
        for (int y = low[1]; y <= high[1]; y++)
            for (int x = low[0]; x <= high[0]; x++) {
                Vec3 way = vec3_add_scaled(vec3_add_scaled(vec3_scale(v->axis[0], x), y, v->axis[1]), z, v->axis[2]);
                if (vec3_norm2(way) <= reach * reach)
                    v->value[at + x + y * b->step[1] + z * b->step[2]] = v->minimum;
            }
}

bool volume_hide_bone(Volume *v)
{
    const double least_mm3 = 50, reach = 2;
    const int64_t nx = v->size[0], plane = nx * v->size[1], voxels = plane * v->size[2];
    Bones b = {v, {1, nx, plane}, calloc((size_t)voxels, 1), malloc((size_t)voxels * sizeof *b.list)};
    bool good = b.mark && b.list;
    double voxel_mm3 = fabs(vec3_dot(v->axis[0], vec3_cross(v->axis[1], v->axis[2])));
    for (int64_t i = 0; good && i < voxels; i++) {
        int64_t count = is_bone(&b, i) ? gather(&b, i) : 0;
        for (int64_t k = 0; (double)count * voxel_mm3 >= least_mm3 && k < count; k++)
            b.mark[b.list[k]] = BONE;
    }
    for (int64_t i = 0; good && i < voxels; i++)
        if (b.mark[i] == BONE)
            blacken_around(&b, v, i, reach);
    free(b.mark);
    free(b.list);
    return good;
}

void volume_brightness(const Volume *v, float *low, float *high)
{
    enum { BINS = 1 << 12 };
    long count[BINS] = {0}, total = 0, sum = 0;
    size_t voxels = (size_t)v->size[0] * (size_t)v->size[1] * (size_t)v->size[2], stride = voxels / 1000003 + 1;
    double least = (double)v->minimum, width = ((double)v->maximum - least) / BINS;
    for (size_t i = 0; i < voxels && width > 0; i += stride, total++)
        count[(int)fmin(((double)v->value[i] - least) / width, BINS - 1)]++;
    *low = *high = v->minimum;
    for (int bin = 0; bin < BINS; bin++) {
        sum += count[bin];
        if (2 * sum < total)
            *low = (float)(least + (bin + 1) * width);
        if (2000 * sum < 1999 * total)
            *high = (float)(least + (bin + 1) * width);
    }
    if (!(*high > *low))
        *low = v->minimum, *high = v->maximum;
}

// Simulates the angiogram of a synthetic shape: the contrast of each voxel is the fraction of it in the vessel; then blur, noise, clipping.
//
// The fraction is that of a box filter across the wall: 1/2 + f / w, w = (sum_k (n . a_k)^2)^(1/2) for the normal n and the grid's steps a_k, so
// that its second moment w^2 / 12 equals the voxel's. It adds to the blur: b^2 = psf^2 + w^2 / 12.
#include "recon/phantom/phantom.h"

#include "base/base.h"
#include "recon/phantom/phantom_parts.h"

#include <stdlib.h>
#include <string.h>

// --- Brightness along the vessel ---

typedef struct Layer {       // the shape, or its neighbour
    const Shape *shape;
    double *arc;             // (parts) [mm] arc length from the root to the part's start
    double longest;
} Layer;

static bool measure_arcs(Layer *layer)
{
    const Shape *shape = layer->shape;
    layer->arc = calloc((size_t)shape->part_count, sizeof *layer->arc);
    for (int p = 0; layer->arc && p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        if (part->parent >= 0) {
            Vec3 g;
            double at;
            part_field(&shape->part[part->parent], part_at(part, 0).center, -HUGE_VAL, false, &g, &at);
            layer->arc[p] = layer->arc[part->parent] + at;
        }
        layer->longest = fmax(layer->longest, layer->arc[p] + part->at[part->knot_count - 1]);
    }
    return layer->arc != NULL;
}

// --- Voxels ---

enum { CELL = 16, VESSEL = 0, NEIGHBOUR, BONE, FIELDS };

typedef struct Painter {
    const Shape *shape;
    const VolumeOptions *options;
    Volume *volume;
    Layer layer[2];          // vessel and neighbour
    int cells[3];
    double diagonal, width;  // diagonal of a voxel, and its width w; 0 if it depends on the direction
} Painter;

static double field_of(const Painter *p, int which, Vec3 x, Vec3 *gradient, int *part, double *at)
{
    const Shape *shape = which == VESSEL ? p->shape : which == NEIGHBOUR ? p->shape->neighbour : NULL;
    double f = -HUGE_VAL;
    if (shape)
        return gradient ? shape_field(shape, x, gradient) : shape_field_of_part(shape, x, part, at);
    for (int i = 0; which == BONE && i < p->shape->block_count; i++)
        f = fmax(f, shape_block_distance(&p->shape->block[i], x));
    return f;
}

static double brightness(const Painter *p, int which, int part, double at)
{
    if (which == BONE)
        return p->options->bone;
    const Layer *layer = &p->layer[which];
    return p->options->fade > 0 ? 1 - p->options->fade * fmin(1, fmax(0, (layer->arc[part] + at) / layer->longest)) : 1;
}

static double voxel_value(const Painter *p, Vec3 x, const double *known)
{
    double value = 0, at = 0;
    for (int which = 0; which < FIELDS; which++) {
        int part = 0;
        double f = known[which] == 0 ? field_of(p, which, x, NULL, &part, &at) : known[which], width = p->width;
        if (known[which] > 0 && which != BONE && p->options->fade > 0)
            field_of(p, which, x, NULL, &part, &at);
        if (width == 0 && fabs(f) < p->diagonal) {
            Vec3 n = {1, 0, 0};
            if (which != BONE)
                field_of(p, which, x, &n, NULL, NULL);
            else   // smooth the blocks' faces, accurate to second order in the voxel size
                for (int k = 0; k < 3; k++)
                    *(k == 0   ? &n.x
                      : k == 1 ? &n.y
                               : &n.z) =
                        (field_of(p, which, vec3_add(x, vec3(k == 0 ? 1e-6 : 0, k == 1 ? 1e-6 : 0, k == 2 ? 1e-6 : 0)), NULL, NULL, NULL) - f) / 1e-6;
            n = vec3_unit_or(n, vec3(1, 0, 0));
            for (int k = 0; k < 3; k++)
                width += same_square(vec3_dot(n, p->volume->axis[k]));
            width = sqrt(width);
        } else if (width == 0) {
            width = p->diagonal;
        }
        double share = fmin(1, fmax(0, 0.5 + f / width));
        if (share > 0)
            value = fmax(value, share * brightness(p, which, part, at));
    }
    return value;
}

// Subdivides the cube until it lies wholly inside or outside each field, using |grad f| <= 1. `known`: > 0 all inside, < 0 all outside, 0 not known.
static void paint(const Painter *p, int i0, int j0, int k0, int edge, const double *known)
{
    Volume *v = p->volume;
    double half = 0.5 * (edge - 1), now[FIELDS];
    Vec3 middle = volume_point_of(v, vec3(i0 + half, j0 + half, k0 + half));
    bool mixed = false, empty = true;
    for (int which = 0; which < FIELDS; which++) {
        int part;
        double at;
        now[which] = known[which] != 0 ? known[which] : field_of(p, which, middle, NULL, &part, &at);
        if (known[which] == 0 && fabs(now[which]) <= (half + 1) * p->diagonal)
            now[which] = 0;
        else if (known[which] == 0)
            now[which] = now[which] > 0 ? HUGE_VAL : -HUGE_VAL;
        mixed = mixed || now[which] == 0;
        empty = empty && now[which] < 0;
    }
    if (empty || i0 >= v->size[0] || j0 >= v->size[1] || k0 >= v->size[2])
        return;
    if (mixed && edge > 2) {
        for (int c = 0; c < 8; c++)
            paint(p, i0 + (c & 1) * edge / 2, j0 + (c >> 1 & 1) * edge / 2, k0 + (c >> 2) * edge / 2, edge / 2, now);
        return;
    }
    double even = !mixed && p->options->fade == 0 ? voxel_value(p, middle, now) : -1;
    for (int k = k0; k < k0 + edge && k < v->size[2]; k++)
        for (int j = j0; j < j0 + edge && j < v->size[1]; j++)
            for (int i = i0; i < i0 + edge && i < v->size[0]; i++)
                v->value[(size_t)i + (size_t)v->size[0] * ((size_t)j + (size_t)v->size[1] * (size_t)k)] =
                    (float)(even >= 0 ? even : voxel_value(p, volume_point_of(v, vec3(i, j, k)), now));
}

static void paint_layer(void *context, long index)
{
    const Painter *p = context;
    const double known[FIELDS] = {0, p->shape->neighbour ? 0 : -HUGE_VAL, p->shape->block_count > 0 ? 0 : -HUGE_VAL};
    int k = (int)(index / p->cells[1]) * CELL, j = (int)(index % p->cells[1]) * CELL;
    for (int i = 0; i < p->cells[0]; i++)
        paint(p, i * CELL, j, k, CELL, known);
}

// --- Blur ---

typedef struct Blur {
    Volume *volume;
    int axis, reach;
    double *kernel;          // (reach + 1)
    bool *failed;            // (jobs)
} Blur;

// Blurs the lines along an axis, side by side in x unless the axis is x itself. Outside the grid is background. Empty lines are skipped.
static void blur_slab(void *context, long index)
{
    const Blur *b = context;
    const Volume *v = b->volume;
    size_t nx = (size_t)v->size[0], plane = nx * (size_t)v->size[1];
    int n = v->size[b->axis], wide = b->axis == 0 ? 1 : v->size[0];
    // axis x: one row; y: a plane of constant z; z: a plane of constant y
    float *first = v->value + (b->axis == 0 ? (size_t)index * nx : b->axis == 1 ? (size_t)index * plane : (size_t)index * nx);
    size_t stride = b->axis == 0 ? 1 : b->axis == 1 ? nx : plane;
    double *line = malloc((size_t)wide * sizeof *line);
    float *copy = malloc((size_t)n * (size_t)wide * sizeof *copy);
    bool *full = calloc((size_t)n, sizeof *full);
    b->failed[index] = !line || !copy || !full;
    for (int i = 0; i < n && !b->failed[index]; i++) {
        memcpy(copy + (size_t)i * (size_t)wide, first + (size_t)i * stride, (size_t)wide * sizeof *copy);
        for (int x = 0; x < wide && !full[i]; x++)
            full[i] = copy[(size_t)i * (size_t)wide + (size_t)x] != 0;
    }
    for (int i = 0; i < n && !b->failed[index]; i++) {
        bool any = false;
        memset(line, 0, (size_t)wide * sizeof *line);
        for (int k = -b->reach; k <= b->reach; k++) {
            if (i + k < 0 || i + k >= n || !full[i + k])
                continue;
            const float *from = copy + (size_t)(i + k) * (size_t)wide;
            double weight = b->kernel[abs(k)];
            any = true;
            for (int x = 0; x < wide; x++)
                line[x] += weight * (double)from[x];
        }
        for (int x = 0; any && x < wide; x++)
            first[(size_t)i * stride + (size_t)x] = (float)line[x];
    }
    free(line);
    free(copy);
    free(full);
}

static bool blur_axis(Volume *volume, int axis, double sigma, int threads)
{
    int reach = (int)ceil(4 * sigma);
    size_t jobs = axis == 0 ? (size_t)volume->size[1] * (size_t)volume->size[2] : axis == 1 ? (size_t)volume->size[2] : (size_t)volume->size[1];
    Blur blur = {.volume = volume, .axis = axis, .reach = reach, .kernel = calloc((size_t)reach + 1, sizeof(double)), .failed = calloc(jobs, sizeof(bool))};
    bool good = blur.kernel && blur.failed;
    double sum = 0;
    for (int k = 0; good && k <= reach; k++)   // integrated over the voxel
        sum += (k ? 2 : 1) * (blur.kernel[k] = 0.5 * (same_erf((k + 0.5) / (sigma * sqrt(2))) - same_erf((k - 0.5) / (sigma * sqrt(2)))));
    for (int k = 0; good && k <= reach; k++)
        blur.kernel[k] /= sum;
    if (good)
        parallel_for(threads, (long)jobs, blur_slab, &blur, NULL);
    for (size_t i = 0; good && i < jobs; i++)
        good = !blur.failed[i];
    free(blur.kernel);
    free(blur.failed);
    return good;
}

// --- A bright band ---

typedef struct Band {        // a slab whose faces are as blurred as the vessels' walls
    Vec3 center, normal;
    double half, blur;       // [mm] half of its thickness, and its blur
} Band;

// Places the slab across the trunk, between a fifth and four fifths of its length.
static Band place_band(const Shape *shape, const VolumeOptions *o)
{
    const Part *trunk = &shape->part[0];
    Random random = {o->seed * RANDOM_STEP + 1};
    double share = 0.2 + 0.6 * random_open(&random), z = 2 * random_open(&random) - 1, angle = 2 * PI * random_open(&random), voxel2 = 0;
    for (int k = 0; k < 3; k++)
        voxel2 += same_square(o->voxel_mm[k]) / 3;
    double ring = sqrt(1 - z * z);
    return (Band){part_at(trunk, share * trunk->at[trunk->knot_count - 1]).center, vec3(ring * same_cos(angle), ring * same_sin(angle), z), 0.5 * o->band_mm,
                  sqrt(same_square(o->psf_mm) + voxel2 / 12)};
}

static double band_at(const Band *band, Vec3 x)
{
    double d = vec3_dot(vec3_sub(x, band->center), band->normal), scale = sqrt(2) * band->blur;
    return 0.5 * (same_erf((d + band->half) / scale) - same_erf((d - band->half) / scale));
}

// --- Noise, clipping, grey values ---

typedef struct Finish {
    Volume *volume;
    const VolumeOptions *options;
    Band band;
    float (*extreme)[2];     // (slices)
} Finish;

static void finish_slice(void *context, long index)
{
    const Finish *f = context;
    size_t plane = (size_t)f->volume->size[0] * (size_t)f->volume->size[1], first = (size_t)index * plane;
    Random random = {f->options->seed + 2 * first * RANDOM_STEP};   // two random numbers per voxel
    float low = HUGE_VALF, high = -HUGE_VALF;
    for (size_t i = first; i < first + plane; i++) {
        float *value = &f->volume->value[i];
        if (f->options->band != 0) {
            size_t at = i - first, nx = (size_t)f->volume->size[0];
            *value += (float)(f->options->band * band_at(&f->band, volume_point_of(f->volume, vec3((double)(at % nx), (double)(at / nx), (double)index))));
        }
        if (f->options->noise > 0)
            *value += (float)(f->options->noise * random_normal(&random));
        *value = fminf((float)f->options->saturate, fmaxf((float)f->options->clip, *value));
        if (f->options->contrast_grey > 0)
            *value = (float)fmin(255, fmax(0, floor(f->options->background_grey + f->options->contrast_grey * (double)*value + 0.5)));
        low = fminf(low, *value);
        high = fmaxf(high, *value);
    }
    f->extreme[index][0] = low;
    f->extreme[index][1] = high;
}

// --- The grid ---

VolumeOptions volume_default_options(void)
{
    return (VolumeOptions){.voxel_mm = {0.2, 0.2, 0.2},
                           .psf_mm = 0.2,
                           .noise = 0.05,
                           .seed = 2,
                           .clip = -HUGE_VAL,
                           .saturate = HUGE_VAL,
                           .bone = 1.2,
                           .band_mm = 4,
                           .background_grey = 60};
}

static Volume *make_grid(const Shape *shape, const VolumeOptions *o, Faults *faults)
{
    // rotate about an axis oblique to the grid
    Vec3 about = vec3_unit(vec3(1, 2, 3)), unit[3];
    double turn = o->rotate_deg * PI / 180, total = 1, grow = 0;
    for (int k = 0; k < 3; k++) {
        Vec3 e = vec3(k == 0, k == 1, k == 2);
        unit[k] = turn == 0 ? e
                            : vec3_add(vec3_add(vec3_scale(e, same_cos(turn)), vec3_scale(vec3_cross(about, e), same_sin(turn))),
                                       vec3_scale(about, (1 - same_cos(turn)) * vec3_dot(about, e)));
    }
    for (int p = 0; (shape->neighbour || shape->block_count > 0) && p < shape->part_count; p++)
        grow = fmax(grow, 4 * shape->part[p].coordinate[3].value[0]);
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int p = 0; p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        for (int i = 0; i < part->sample_count; i++)
            for (int k = 0; k < 3 && part->sample_at[i] >= 0 && part->sample_at[i] <= part->at[part->knot_count - 1]; k++) {
                double at = vec3_dot(part->sample[i], unit[k]), r = 1.1 * part->sample_radius[i];
                low[k] = fmin(low[k], at - r);
                high[k] = fmax(high[k], at + r);
            }
    }
    Vec3 axis[3], origin = {0, 0, 0};
    int size[3];
    for (int k = 0; k < 3; k++) {
        double margin = 8 * o->voxel_mm[k] + 3 * o->psf_mm + grow, n = ceil((high[k] - low[k] + 2 * margin) / o->voxel_mm[k]) + 1;
        total *= n;
        size[k] = n < 1e6 ? (int)n : 0;
        axis[k] = vec3_scale(unit[k], o->voxel_mm[k]);
        origin = vec3_add_scaled(origin, low[k] - margin, unit[k]);
    }
    Volume *volume = total < 1e9 ? volume_create(size, origin, axis) : NULL;
    if (!volume)
        faults_add(faults, shape->name, 0, 0, "a volume of %.3g voxels is too large; use voxels larger than %g mm", total, o->voxel_mm[0]);
    return volume;
}

Volume *shape_volume(const Shape *shape, const VolumeOptions *options, Faults *faults)
{
    Volume *volume = make_grid(shape, options, faults);
    if (!volume)
        return NULL;
    Painter p = {.shape = shape, .options = options, .volume = volume, .layer = {{.shape = shape}, {.shape = shape->neighbour}}};
    bool even = true;
    for (int k = 0; k < 3; k++) {
        p.cells[k] = (volume->size[k] + CELL - 1) / CELL;
        p.diagonal += same_square(options->voxel_mm[k]);
        even = even && options->voxel_mm[k] == options->voxel_mm[0];
    }
    p.diagonal = sqrt(p.diagonal);
    p.width = even ? options->voxel_mm[0] : 0;
    Finish f = {.volume = volume, .options = options, .band = place_band(shape, options), .extreme = calloc((size_t)volume->size[2], sizeof *f.extreme)};
    bool good = f.extreme && measure_arcs(&p.layer[0]) && (!shape->neighbour || measure_arcs(&p.layer[1]));
    if (good)
        parallel_for(options->threads, (long)p.cells[1] * p.cells[2], paint_layer, &p, NULL);
    for (int k = 0; good && options->psf_mm > 0 && k < 3; k++)
        good = blur_axis(volume, k, options->psf_mm / options->voxel_mm[k], options->threads);
    if (good)
        parallel_for(options->threads, volume->size[2], finish_slice, &f, NULL);
    volume->minimum = HUGE_VALF, volume->maximum = -HUGE_VALF;
    for (int k = 0; good && k < volume->size[2]; k++) {
        volume->minimum = fminf(volume->minimum, f.extreme[k][0]);
        volume->maximum = fmaxf(volume->maximum, f.extreme[k][1]);
    }
    free(p.layer[0].arc);
    free(p.layer[1].arc);
    free(f.extreme);
    if (good)
        return volume;
    faults_add(faults, shape->name, 0, 0, "not enough memory for the volume");
    volume_free(volume);
    return NULL;
}

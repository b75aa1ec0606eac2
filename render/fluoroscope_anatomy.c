// Attenuations are physical (render/patient_body.h).
//   CT numbers H: that of water (1 + H / 1000) up to 150, then linear up to cortical bone at 1500 HU.
//   other volumes (angiograms, mostly cut off at 0): linear from 0 at their minimum to bone at their maximum; shown in the patient made of solids, as they
//   contain no tissue.
#include "render/fluoroscope_anatomy.h"

#include "render/message.h"

#include <stdlib.h>
#include <string.h>

// --- the volume ---

static double tissue_of(double value, double least, double greatest)
{
    const double water = ATTENUATION_WATER, bone = ATTENUATION_BONE;
    if (least < -200)
        return value < 150 ? fmax(water * (1 + value / 1000), 0) : fmin(water * 1.15 + (bone - water * 1.15) * (value - 150) / 1350, bone);
    return greatest > least ? bone * (value - least) / (greatest - least) : 0;
}

// Finds the cells inside the lumen by counting walls along the third axis of the grid: for each column of cells, the wall crossings of its centre line are
// summed with
// their direction. The lines are slightly off the centres to avoid vertices.
static void count_walls(const Anatomy *anatomy, const Vec3 corner[3], int8_t *change)
{
    const double off[2] = {0.5 + 1.2345e-7, 0.5 + 2.3456e-7};
    Vec3 g[3];
    for (int k = 0; k < 3; k++) {
        Vec3 u = mat3_mul_vec(&anatomy->to_grid, vec3_sub(corner[k], anatomy->origin));
        g[k] = vec3(u.x * anatomy->size[0] - off[0], u.y * anatomy->size[1] - off[1], u.z * anatomy->size[2]);
    }
    double area = (g[1].x - g[0].x) * (g[2].y - g[0].y) - (g[1].y - g[0].y) * (g[2].x - g[0].x);
    if (!(fabs(area) > 0))
        return;
    int low_i = (int)fmax(ceil(fmin(fmin(g[0].x, g[1].x), g[2].x)), 0), high_i = (int)fmin(floor(fmax(fmax(g[0].x, g[1].x), g[2].x)), anatomy->size[0] - 1);
    int low_j = (int)fmax(ceil(fmin(fmin(g[0].y, g[1].y), g[2].y)), 0), high_j = (int)fmin(floor(fmax(fmax(g[0].y, g[1].y), g[2].y)), anatomy->size[1] - 1);
    for (int j = low_j; j <= high_j; j++)
        for (int i = low_i; i <= high_i; i++) {
            double w[3], depth = 0;
            bool inside = true;
            for (int k = 0; k < 3; k++) {
                const Vec3 *a = &g[(k + 1) % 3], *b = &g[(k + 2) % 3];
                w[k] = ((a->x - i) * (b->y - j) - (a->y - j) * (b->x - i)) / area;
                inside &= w[k] >= 0;
                depth += w[k] * g[k].z;
            }
            int layer = (int)fmin(fmax(ceil(depth - 0.5), 0), anatomy->size[2]);
            size_t at = ((size_t)layer * (size_t)anatomy->size[1] + (size_t)j) * (size_t)anatomy->size[0] + (size_t)i;
            if (inside && layer < anatomy->size[2])
                change[at] = (int8_t)(change[at] + (area > 0 ? 1 : -1));
        }
}

// 1 if the centre of a cell is inside the lumen, or next to such a cell (blur spreads its value).
static bool find_lumen(const Anatomy *anatomy, const TriangleMesh *mesh, const MeshLids *lids, uint8_t *inside)
{
    const size_t nx = (size_t)anatomy->size[0], ny = (size_t)anatomy->size[1], nz = (size_t)anatomy->size[2], cells = nx * ny * nz;
    int8_t *change = calloc(cells, 1);
    if (!change)
        return false;
    for (int t = 0; t < mesh->triangle_count + lids->triangle_count; t++) {
        const int *c = t < mesh->triangle_count ? mesh->triangle[t] : lids->triangle[t - mesh->triangle_count];
        Vec3 corner[3];
        for (int k = 0; k < 3; k++)
            corner[k] = c[k] < mesh->vertex_count ? mesh->vertex[c[k]] : lids->middle[c[k] - mesh->vertex_count];
        count_walls(anatomy, corner, change);
    }
    for (size_t at = 0; at < nx * ny; at++) {
        int winding = 0;
        for (size_t k = 0; k < nz; k++) {
            winding += change[k * nx * ny + at];
            change[k * nx * ny + at] = winding != 0;
        }
    }
    for (size_t k = 0; k < nz; k++)
        for (size_t j = 0; j < ny; j++)
            for (size_t i = 0; i < nx; i++) {
                size_t at = (k * ny + j) * nx + i;
                if (!change[at])
                    continue;
                for (size_t z = k > 0 ? k - 1 : 0; z <= k + 1 && z < nz; z++)
                    for (size_t y = j > 0 ? j - 1 : 0; y <= j + 1 && y < ny; y++)
                        for (size_t x = i > 0 ? i - 1 : 0; x <= i + 1 && x < nx; x++)
                            inside[(z * ny + y) * nx + x] = 1;
            }
    free(change);
    return true;
}

static bool volume_is_sound(const FluoroscopeOptions *options)
{
    Mat3 axes = mat3_from_columns(options->anatomy_axis[0], options->anatomy_axis[1], options->anatomy_axis[2]);
    double det = vec3_dot(mat3_column(&axes, 0), vec3_cross(mat3_column(&axes, 1), mat3_column(&axes, 2)));
    size_t cells = 1;
    for (int k = 0; k < 3; k++) {
        if (options->anatomy_size[k] < 1 || !vec3_is_finite(options->anatomy_axis[k]) || (size_t)options->anatomy_size[k] > SIZE_MAX / 8 / cells)
            return false;
        cells *= (size_t)options->anatomy_size[k];
    }
    return isfinite(det) && fabs(det) > 1e-12 && vec3_is_finite(options->anatomy_origin);
}

static void lay_grid(Anatomy *anatomy, const FluoroscopeOptions *options, const int part[3])
{
    Vec3 corner = options->anatomy_origin, side[3];
    for (int k = 0; k < 3; k++) {
        corner = vec3_add_scaled(corner, -0.5, options->anatomy_axis[k]);
        anatomy->size[k] = (options->anatomy_size[k] + part[k] - 1) / part[k];
        side[k] = vec3_scale(options->anatomy_axis[k], (double)anatomy->size[k] * part[k]);
    }
    anatomy->origin = corner;
    double det = vec3_dot(side[0], vec3_cross(side[1], side[2]));
    for (int k = 0; k < 3; k++) {
        Vec3 row = vec3_scale(vec3_cross(side[(k + 1) % 3], side[(k + 2) % 3]), 1 / det);
        anatomy->to_grid.m[k][0] = row.x, anatomy->to_grid.m[k][1] = row.y, anatomy->to_grid.m[k][2] = row.z;
    }
}

// Mean attenuation in each cell of part[0] x part[1] x part[2] voxels.
static void fill_grid(Anatomy *anatomy, const FluoroscopeOptions *options, const int part[3], const uint8_t *inside, double least, double greatest)
{
    const int *n = options->anatomy_size;
    const double filling = least < -200 ? ATTENUATION_SOFT : 0;
    size_t at = 0;
    for (int k = 0; k < anatomy->size[2]; k++)
        for (int j = 0; j < anatomy->size[1]; j++)
            for (int i = 0; i < anatomy->size[0]; i++, at++) {
                double sum = 0;
                for (int z = k * part[2]; z < (k + 1) * part[2] && z < n[2]; z++)
                    for (int y = j * part[1]; y < (j + 1) * part[1] && y < n[1]; y++)
                        for (int x = i * part[0]; x < (i + 1) * part[0] && x < n[0]; x++)
                            sum += tissue_of(options->anatomy_value[((size_t)z * (size_t)n[1] + (size_t)y) * (size_t)n[0] + (size_t)x], least, greatest);
                double mean = inside && inside[at] ? filling : sum / ((double)part[0] * part[1] * part[2]);
                anatomy->level[at] = (uint8_t)lround(255 * fmin(fmax(mean / anatomy->most, 0), 1));
            }
}

static bool take_volume(Anatomy *anatomy, const FluoroscopeOptions *options, const MeshLids *lids, char *message, size_t capacity)
{
    if (!volume_is_sound(options))
        return message_fail(message, capacity, "the volume behind the vessel has an invalid size or invalid axes");
    int part[3];
    size_t voxels = 1;
    for (int k = 0; k < 3; k++) {
        part[k] = (options->anatomy_size[k] + ANATOMY_GRID - 1) / ANATOMY_GRID;
        voxels *= (size_t)options->anatomy_size[k];
    }
    double least = options->anatomy_value[0], greatest = least;
    for (size_t i = 0; i < voxels; i++) {
        double value = options->anatomy_value[i];
        if (!isfinite(value))
            return message_fail(message, capacity, "the volume behind the vessel contains values that are not finite");
        least = fmin(least, value);
        greatest = fmax(greatest, value);
    }
    lay_grid(anatomy, options, part);
    anatomy->most = ATTENUATION_BONE;
    size_t cells = (size_t)anatomy->size[0] * (size_t)anatomy->size[1] * (size_t)anatomy->size[2];
    uint8_t *inside = calloc(cells, 1);
    anatomy->level = malloc(cells);
    bool good = inside && anatomy->level && (!options->vessel || find_lumen(anatomy, options->vessel, lids, inside));
    if (good)
        fill_grid(anatomy, options, part, inside, least, greatest);
    free(inside);
    if (!good)
        return message_fail(message, capacity, "out of memory for the volume behind the vessel");
    anatomy->has_tissue = least < -200;
    return true;
}

// --- both ---

static Vec3 find_middle(const FluoroscopeOptions *options, Vec3 *half)
{
    const Vec3 axis[3] = {options->patient.right, options->patient.anterior, options->patient.superior};
    const TriangleMesh *mesh = options->vessel;
    double low[3] = {0}, high[3] = {0};
    for (int v = 0; mesh && v < mesh->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            double at = vec3_dot(axis[k], mesh->vertex[v]);
            low[k] = v == 0 ? at : fmin(low[k], at);
            high[k] = v == 0 ? at : fmax(high[k], at);
        }
    Vec3 middle = {0};
    for (int k = 0; k < 3; k++)
        middle = vec3_add_scaled(middle, (low[k] + high[k]) / 2, axis[k]);
    *half = vec3((high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2);
    return middle;
}

// Without landmarks the middle of the vessel is at the middle of its segment; a vessel of unknown name is one of the head if it fits into it, else the aorta.
static Similarity place_body(const FluoroscopeOptions *options)
{
    if (options->has_place)
        return options->place;
    Vec3 half, middle = find_middle(options, &half);
    bool fits_head = half.x < 66 && half.y < 86 && half.z < 104;
    Vec3 at = options->segment > 0 ? patient_segment[options->segment - 1].middle : fits_head ? vec3(0, 0, 8) : vec3(-4, -40, -330);
    Similarity place = {.turn = mat3_from_columns(options->patient.right, options->patient.anterior, options->patient.superior), .scale = 1};
    place.shift = vec3_sub(middle, mat3_mul_vec(&place.turn, at));
    return place;
}

bool anatomy_create(Anatomy *anatomy, const FluoroscopeOptions *options, const MeshLids *lids, char *message, size_t capacity)
{
    *anatomy = (Anatomy){.place = place_body(options)};
    if (options->has_no_anatomy)
        return true;
    if (options->anatomy_value && !take_volume(anatomy, options, lids, message, capacity))
        return false;
    if (!anatomy->has_tissue && !body_add_patient(&anatomy->body))
        return message_fail(message, capacity, "out of memory for the patient around the vessel");
    return true;
}

void anatomy_free(Anatomy *anatomy)
{
    free(anatomy->level);
    body_free(&anatomy->body);
    *anatomy = (Anatomy){0};
}

static double level_at(const Anatomy *anatomy, Vec3 g)
{
    const double at[3] = {g.x * anatomy->size[0] - 0.5, g.y * anatomy->size[1] - 0.5, g.z * anatomy->size[2] - 0.5};
    double sum = 0;
    for (int corner = 0; corner < 8; corner++) {
        size_t index = 0;
        double weight = 1;
        for (int k = 2; k >= 0; k--) {
            double cell = floor(at[k]), part = at[k] - cell;
            int i = (int)cell + (corner >> k & 1);
            weight *= corner >> k & 1 ? part : 1 - part;
            i = i < 0 ? 0 : i >= anatomy->size[k] ? anatomy->size[k] - 1 : i;
            index = index * (size_t)anatomy->size[k] + (size_t)i;
        }
        sum += weight * anatomy->level[index];
    }
    return sum / 255 * anatomy->most;
}

static double volume_along(const Anatomy *anatomy, Vec3 source, Vec3 direction)
{
    Vec3 o = mat3_mul_vec(&anatomy->to_grid, vec3_sub(source, anatomy->origin)), d = mat3_mul_vec(&anatomy->to_grid, direction);
    const double from[3] = {o.x, o.y, o.z}, along[3] = {d.x, d.y, d.z};
    double in = 0, out = HUGE_VAL, sum = 0;
    for (int k = 0; k < 3; k++) {
        double a = (0 - from[k]) / along[k], b = (1 - from[k]) / along[k];
        in = fmax(in, fmin(a, b));
        out = fmin(out, fmax(a, b));
    }
    int steps = 2 * ANATOMY_GRID;
    if (!(out > in) || !isfinite(out))
        return 0;
    for (int i = 0; i < steps; i++)
        sum += level_at(anatomy, vec3_add_scaled(o, in + (out - in) * (i + 0.5) / steps, d));
    return sum * (out - in) / steps;
}

// A ray in the body's frame. Attenuations are per millimetre of the model, so that the direction is of unit length in it.
static Vec3 into_body(const Similarity *place, Vec3 direction)
{
    Mat3 back = mat3_transpose(&place->turn);
    return mat3_mul_vec(&back, vec3_scale(direction, 1 / place->scale));
}

double anatomy_along(const Anatomy *anatomy, Vec3 source, Vec3 direction)
{
    Vec3 o = into_body(&anatomy->place, vec3_sub(source, anatomy->place.shift)), d = into_body(&anatomy->place, direction);
    double sum = anatomy->level ? volume_along(anatomy, source, direction) : 0, square = vec3_norm2(d);
    for (int i = 0; i < anatomy->body.count; i++) {
        const BodyShape *shape = &anatomy->body.shape[i];
        Vec3 off = vec3_cross(vec3_sub(shape->center, o), d);
        double reach = vec3_norm2(shape->reach[0]) + vec3_norm2(shape->reach[1]) + vec3_norm2(shape->reach[2]);
        if (vec3_norm2(off) < reach * square)
            sum += body_shape_along(shape, o, d);
    }
    return fmax(sum, 0);
}

// --- shadows ---

// The square of the picture, 0 to 1 each way, that the box of a shape covers; false if none.
static bool find_box(const BodyShape *shape, const Vec3 axis[3], Vec3 isocentre, double half_field, double distance, float box[4])
{
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    int behind = 0;
    for (int corner = 0; corner < 8; corner++) {
        Vec3 p = vec3_sub(shape->center, isocentre);
        for (int k = 0; k < 3; k++)
            p = vec3_add_scaled(p, corner >> k & 1 ? 1 : -1, shape->reach[k]);
        double depth = vec3_dot(p, axis[2]) + distance;
        behind += depth < 0.01 * distance;
        for (int k = 0; k < 2; k++) {
            double at = vec3_dot(p, axis[k]) * distance / (depth * 2 * half_field) + 0.5;
            low[k] = fmin(low[k], at);
            high[k] = fmax(high[k], at);
        }
    }
    for (int k = 0; k < 2; k++) {
        box[k] = behind ? 0 : (float)fmax(low[k], 0);
        box[2 + k] = behind ? 1 : (float)fmin(high[k], 1);
    }
    return behind < 8 && box[0] < box[2] && box[1] < box[3];
}

static void put_vec3(float *at, Vec3 v) { at[0] = (float)v.x, at[1] = (float)v.y, at[2] = (float)v.z; }

bool shape_shadows_cast(ShapeShadows *shadows, const Anatomy *anatomy, const CArm *c_arm)
{
    const Body *body = &anatomy->body;
    const Similarity *place = &anatomy->place;
    shadows->count = 0;
    if (shadows->capacity < body->count) {
        shape_shadows_free(shadows);
        shadows->vertex = malloc((size_t)body->count * SHADOW_VERTICES * sizeof *shadows->vertex);
        shadows->box = malloc((size_t)body->count * sizeof *shadows->box);
        shadows->shape = malloc((size_t)body->count * sizeof *shadows->shape);
        if (!shadows->vertex || !shadows->box || !shadows->shape) {
            shape_shadows_free(shadows);
            return false;
        }
        shadows->capacity = body->count;
    }
    Vec3 source = into_body(place, vec3_sub(c_arm_source(c_arm), place->shift)), isocentre = into_body(place, vec3_sub(c_arm->isocentre, place->shift));
    Vec3 ray[3] = {vec3_scale(c_arm->towards, C_ARM_SOURCE_MM), vec3_scale(c_arm->right, c_arm->field_mm), vec3_scale(c_arm->up, c_arm->field_mm)};
    for (int k = 0; k < 3; k++)
        ray[k] = into_body(place, ray[k]);
    const Vec3 axis[3] = {vec3_unit(ray[1]), vec3_unit(ray[2]), vec3_unit(ray[0])};
    for (int i = 0; i < body->count; i++) {
        const BodyShape *shape = &body->shape[i];
        float box[4];
        if (!find_box(shape, axis, isocentre, vec3_norm(ray[1]) / 2, vec3_norm(ray[0]), box))
            continue;
        ShadowVertex v = {.solid = {(float)shape->wall, (float)(shape->filling - shape->wall), (float)(shape->hollow * shape->hollow)}};
        put_vec3(v.from, mat3_mul_vec(&shape->to_unit, vec3_sub(source, shape->center)));
        for (int k = 0; k < 3; k++)
            put_vec3(v.ray[k], mat3_mul_vec(&shape->to_unit, ray[k]));
        for (int k = 0; k < 2; k++) {
            bool is_cut = vec3_norm2(shape->plane[k]) > 0;
            for (int j = 0; j < 3; j++)
                v.plane[k][j] = (float)vec3_dot(shape->plane[k], ray[j]);
            v.plane[k][3] = is_cut ? (float)(vec3_dot(shape->plane[k], source) - shape->offset[k]) : -1;
        }
        memcpy(shadows->box[shadows->count / SHADOW_VERTICES], box, sizeof box);
        shadows->shape[shadows->count / SHADOW_VERTICES] = i;
        static const int corner[SHADOW_VERTICES][2] = {{0, 1}, {2, 1}, {2, 3}, {0, 1}, {2, 3}, {0, 3}};
        for (int k = 0; k < SHADOW_VERTICES; k++) {
            v.place[0] = box[corner[k][0]];
            v.place[1] = box[corner[k][1]];
            shadows->vertex[shadows->count++] = v;
        }
    }
    return true;
}

void shape_shadows_free(ShapeShadows *shadows)
{
    free(shadows->vertex);
    free(shadows->box);
    free(shadows->shape);
    *shadows = (ShapeShadows){0};
}

double shape_shadows_along(const ShapeShadows *shadows, const Anatomy *anatomy, const CArm *c_arm, double fx, double fy)
{
    const Similarity *place = &anatomy->place;
    const Vec3 source = c_arm_source(c_arm), ray = c_arm_ray(c_arm, fx, fy);
    const Vec3 o = into_body(place, vec3_sub(source, place->shift)), d = into_body(place, ray);
    const float x = (float)(fx + 0.5), y = (float)(fy + 0.5);
    double sum = anatomy->level ? volume_along(anatomy, source, ray) : 0;
    for (int i = 0; i < shadows->count / SHADOW_VERTICES; i++) {
        const float *box = shadows->box[i];
        if (x >= box[0] && x <= box[2] && y >= box[1] && y <= box[3])
            sum += body_shape_along(&anatomy->body.shape[shadows->shape[i]], o, d);
    }
    return fmax(sum, 0);
}

// --- display ---

double anatomy_shown(double attenuation, double mean)
{
    double x = attenuation - mean, bright = SHOWN_BRIGHTEST;
    return SHOWN_SHIFT + (x > 0 ? SHOWN_SLOPE * x : -bright * (1 - exp(SHOWN_SLOPE * x / bright)));
}

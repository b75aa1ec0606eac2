// The attenuation is chosen for appearance (docs/design.md, "X-ray attenuation"): 0.0045 / mm soft tissue, 0.028 / mm bone, a fifth and a half of the
// physical values, so that the range of the picture is not exceeded without a window level set by a physician.
//   CT numbers H: 0.0045 (1 + H / 1000) up to 150, then linear up to 0.028 at 1000 HU.
//   other volumes (angiograms, mostly cut off at 0): linear from 0 at their minimum to 0.028 at their maximum; shown in a simple head, as they contain no
//   tissue.
#include "render/fluoroscope_anatomy.h"

#include "render/message.h"

#include <stdlib.h>
#include <string.h>

static const double soft = 0.0045, bone = 0.028;

// --- simple bodies ---

static void add_ellipsoid(Anatomy *anatomy, Vec3 center, Vec3 semi, double attenuation)
{
    if (anatomy->ellipsoid_count < ELLIPSOIDS_MOST)
        anatomy->ellipsoid[anatomy->ellipsoid_count++] = (Ellipsoid){center, semi, attenuation};
}

static void add_shell(Anatomy *anatomy, Vec3 center, Vec3 semi, double thickness, double attenuation)
{
    add_ellipsoid(anatomy, center, semi, attenuation);
    add_ellipsoid(anatomy, center, vec3(semi.x - thickness, semi.y - thickness, semi.z - thickness), -attenuation);
}

static void add_head(Anatomy *anatomy)
{
    add_ellipsoid(anatomy, vec3(0, 0, 0), vec3(78, 98, 116), soft);
    add_shell(anatomy, vec3(0, 0, 0), vec3(72, 92, 110), 5.5, bone);
    for (int side = -1; side <= 1; side += 2) {
        add_shell(anatomy, vec3(side * 32, 64, -14), vec3(20, 22, 18), 1.6, 0.6 * bone);   // orbits
        add_ellipsoid(anatomy, vec3(side * 36, -12, -36), vec3(25, 11, 9), 0.3 * bone);    // petrous bones
        add_shell(anatomy, vec3(side * 24, 56, -50), vec3(15, 17, 18), 1.2, 0.5 * bone);   // maxillary sinuses
    }
    add_ellipsoid(anatomy, vec3(0, 82, 22), vec3(22, 7, 14), -soft);                       // frontal sinus
    add_ellipsoid(anatomy, vec3(0, 30, -30), vec3(14, 22, 9), -soft);                      // sphenoid sinus
    add_shell(anatomy, vec3(0, -28, -96), vec3(22, 20, 30), 3, 0.5 * bone);                // first vertebrae of the neck
}

static void add_trunk(Anatomy *anatomy, Vec3 half)
{
    Vec3 semi = {fmax(170, half.x), fmax(115, half.y), fmax(260, half.z)};
    add_ellipsoid(anatomy, vec3(0, 0, 0), semi, 0.6 * soft);
    double behind = -0.45 * semi.y;
    for (int side = -1; side <= 1; side += 2)
        add_ellipsoid(anatomy, vec3(side * 0.5 * semi.x, 0.1 * semi.y, 0), vec3(0.32 * semi.x, 0.6 * semi.y, 0.5 * semi.z), -0.4 * soft);   // lungs
    for (int k = -7; k <= 7; k++)
        add_shell(anatomy, vec3(0, behind, 29.0 * k), vec3(20, 16, 12.5), 2, 0.45 * bone);
}

// Placed in the middle of the visible region, with half widths `half`, along the patient's axes.
static void add_plain_body(Anatomy *anatomy, Vec3 half)
{
    if (half.x < 66 && half.y < 86 && half.z < 104)
        add_head(anatomy);
    else
        add_trunk(anatomy, vec3_scale(half, 1.1));
}

// --- the volume ---

static double tissue_of(double value, double least, double greatest)
{
    if (least < -200)
        return value < 150 ? fmax(soft * (1 + value / 1000), 0) : fmin(soft * 1.15 + (bone - soft * 1.15) * (value - 150) / 850, bone);
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
    const double filling = least < -200 ? soft : 0;
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
    anatomy->most = bone;
    size_t cells = (size_t)anatomy->size[0] * (size_t)anatomy->size[1] * (size_t)anatomy->size[2];
    uint8_t *inside = calloc(cells, 1);
    anatomy->level = malloc(cells);
    bool good = inside && anatomy->level && (!options->vessel || find_lumen(anatomy, options->vessel, lids, inside));
    if (good)
        fill_grid(anatomy, options, part, inside, least, greatest);
    free(inside);
    if (!good)
        return message_fail(message, capacity, "out of memory for the volume behind the vessel");
    if (least >= -200)
        add_head(anatomy);
    return true;
}

// --- both ---

static void find_middle(Anatomy *anatomy, const FluoroscopeOptions *options, Vec3 *half)
{
    const Vec3 axis[3] = {anatomy->axes.right, anatomy->axes.anterior, anatomy->axes.superior};
    const TriangleMesh *mesh = options->vessel;
    double low[3] = {0}, high[3] = {0};
    for (int v = 0; mesh && v < mesh->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            double at = vec3_dot(axis[k], mesh->vertex[v]);
            low[k] = v == 0 ? at : fmin(low[k], at);
            high[k] = v == 0 ? at : fmax(high[k], at);
        }
    anatomy->middle = vec3(0, 0, 0);
    for (int k = 0; k < 3; k++)
        anatomy->middle = vec3_add_scaled(anatomy->middle, (low[k] + high[k]) / 2, axis[k]);
    *half = vec3((high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2);
}

bool anatomy_create(Anatomy *anatomy, const FluoroscopeOptions *options, const MeshLids *lids, char *message, size_t capacity)
{
    *anatomy = (Anatomy){.axes = options->patient};
    Vec3 half;
    find_middle(anatomy, options, &half);
    if (options->has_no_anatomy)
        return true;
    if (options->anatomy_value)
        return take_volume(anatomy, options, lids, message, capacity);
    add_plain_body(anatomy, half);
    return true;
}

void anatomy_free(Anatomy *anatomy)
{
    free(anatomy->level);
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

double anatomy_along(const Anatomy *anatomy, Vec3 source, Vec3 direction)
{
    Vec3 from = vec3_sub(source, anatomy->middle);
    const PatientAxes *axes = &anatomy->axes;
    Vec3 o = {vec3_dot(axes->right, from), vec3_dot(axes->anterior, from), vec3_dot(axes->superior, from)};
    Vec3 d = {vec3_dot(axes->right, direction), vec3_dot(axes->anterior, direction), vec3_dot(axes->superior, direction)};
    double sum = anatomy->level ? volume_along(anatomy, source, direction) : 0;
    for (int i = 0; i < anatomy->ellipsoid_count; i++) {
        const Ellipsoid *e = &anatomy->ellipsoid[i];
        Vec3 p = vec3_sub(o, e->center), v = {d.x / e->semi.x, d.y / e->semi.y, d.z / e->semi.z};
        p = vec3(p.x / e->semi.x, p.y / e->semi.y, p.z / e->semi.z);
        double a = vec3_norm2(v), b = vec3_dot(p, v), c = vec3_norm2(p) - 1, root = b * b - a * c;
        sum += root > 0 ? e->attenuation * 2 * sqrt(root) / a : 0;
    }
    return fmax(sum, 0);
}

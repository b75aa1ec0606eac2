// Builds the synthetic shapes by name, and parses their options.
#include "recon/phantom/phantom.h"

#include "base/base.h"
#include "recon/phantom/phantom_parts.h"
#include "recon/phantom/random_tree.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- The shapes ---

typedef struct ShapeOptions {
    double points, sac_points, noise_mm, seed, spacing, blend_mm, length_mm, radius_mm, bend_radius_mm, rise_mm, scale;
    double turns, angle_deg, branches, sacs, blocks, gap_mm, crossing_deg, twig_radius_mm, arch_type, spread, diameter_scale;
} ShapeOptions;

static bool build_capsule(Shape *shape, const ShapeOptions *o, bool open)
{
    double knot[5][4];
    for (int i = 0; i < 5; i++)
        memcpy(knot[i], (double[4]){o->length_mm * i / 4, 0, 0, o->radius_mm}, sizeof knot[i]);
    return shape_add(shape, (const double(*)[4])knot, 5, open, open, -1, NODE_VESSEL, NULL);
}

static bool build_arc(Shape *shape, const ShapeOptions *o)
{
    enum { N = 64 };
    double knot[N][4];
    for (int i = 0; i < N; i++) {
        double angle = PI * i / (N - 1);
        memcpy(knot[i], (double[4]){o->bend_radius_mm * same_sin(angle), o->bend_radius_mm * (1 - same_cos(angle)), 0, o->radius_mm}, sizeof knot[i]);
    }
    const double tangent[2][4] = {{1, 0, 0, 0}, {-1, 0, 0, 0}};
    return shape_add(shape, (const double(*)[4])knot, N, true, true, -1, NODE_VESSEL, tangent);
}

// Two quarter arcs that start in the same direction and diverge to both sides.
static bool build_bifurcation(Shape *shape, const ShapeOptions *o)
{
    enum { N = 33 };
    for (int side = 0; side < 2; side++) {
        double knot[N][4];
        for (int i = 0; i < N; i++) {
            double angle = PI / 2 * i / (N - 1), across = o->bend_radius_mm * (1 - same_cos(angle));
            memcpy(knot[i], (double[4]){o->bend_radius_mm * same_sin(angle), side ? -across : across, 0, o->radius_mm}, sizeof knot[i]);
        }
        const double tangent[2][4] = {{1, 0, 0, 0}, {0, side ? -1 : 1, 0, 0}};
        if (!shape_add(shape, (const double(*)[4])knot, N, true, true, side - 1, NODE_VESSEL, tangent))
            return false;
    }
    return true;
}

// A spiral, flat or rising out of its plane at a nearly even slope: the parameter u grows with arc length to within 1 to 5 %.
static bool build_spiral(Shape *shape, const ShapeOptions *o)
{
    enum { N = 64 };
    double knot[N][4], tangent[2][4];
    for (int i = 0; i < N; i++) {
        // knots are denser where the spiral is more strongly curved
        double u = (double)i / (N - 1), theta = PI * same_pow(4, u), polar = 15.75 / theta;
        double radius = 0.5 + (0.15 - 0.5) * (theta - PI) / (3 * PI);
        memcpy(knot[i], (double[4]){polar * same_cos(theta), polar * same_sin(theta), u * o->rise_mm, radius}, sizeof knot[i]);
    }
    for (int end = 0; end < 2; end++) {
        double theta = end ? 4 * PI : PI, polar = 15.75 / theta, z = o->rise_mm / (theta * same_log(4));
        double along = sqrt(polar * polar * (1 + 1 / (theta * theta)) + z * z);   // ds / dtheta
        double x = -polar / theta * same_cos(theta) - polar * same_sin(theta), y = -polar / theta * same_sin(theta) + polar * same_cos(theta);
        memcpy(tangent[end], (double[4]){x / along, y / along, z / along, (0.15 - 0.5) / (3 * PI) / along}, sizeof tangent[end]);
    }
    return shape_add(shape, (const double(*)[4])knot, N, true, false, -1, NODE_VESSEL, (const double(*)[4])tangent);
}

// An internal carotid artery with its siphon, continuing as the middle cerebral artery, and the anterior cerebral artery; two branches each, of which the
// anterior ones touch; a saccular aneurysm on the outer side of the siphon's anterior knee. x lateral, y anterior, z up [mm].
static bool build_phantom(Shape *shape)
{
    static const double carotid[][4] = {{0, 0, 0, 2.5},          {0, 0, 8, 2.45},        {0.4, 1.2, 15, 2.4},    {1.4, 6.2, 20.4, 2.3}, {2.4, 12.6, 22.2, 2.3},
                                        {3, 17.8, 25.4, 2.25},   {3.2, 18.6, 31, 2.2},   {3.8, 14.4, 35.2, 2.1}, {5, 8.9, 36.6, 2.05},  {7, 5.9, 40.4, 1.9},
                                        {10.4, 5.6, 44.6, 1.75}, {15.4, 6.6, 46.6, 1.5}, {21, 7.6, 46.4, 1.4},   {26.6, 7, 48.2, 1.3},  {31.4, 5, 52, 1.15}};
    static const double anterior[][4] = {{9.3, 5.6, 43.4, 1.2}, {6.6, 6.4, 47.2, 1.2},   {3.2, 9.2, 50.4, 1.1},
                                         {0.6, 12.2, 54, 1},    {-0.8, 12.4, 59.4, 0.9}, {-0.6, 10, 64.4, 0.8}};
    static const double middle_1[][4] = {{21, 7.6, 46.4, 0.9}, {21.8, 9.4, 49.6, 0.85}, {21.6, 10.2, 54, 0.8}};
    static const double middle_2[][4] = {{26.6, 7, 48.2, 0.85}, {29.4, 8.2, 45.8, 0.8}, {33, 9, 45, 0.75}};
    static const double anterior_1[][4] = {
        {3.2, 9.2, 50.4, 0.8}, {4.9, 12, 52.2, 0.75}, {4.2, 15.6, 54.8, 0.75}, {1.5, 17.4, 57.8, 0.7}, {-0.4, 18.2, 60.2, 0.65}};
    static const double anterior_2[][4] = {
        {0.6, 12.2, 54, 0.72}, {-0.6, 14.6, 54.8, 0.69}, {-0.9, 16.4, 57.2, 0.66}, {0.6, 16.2, 60.6, 0.63}, {1.6, 14.2, 63.8, 0.6}};
    static const double sac[][4] = {{3.1, 18.6, 28.2, 1.85}, {3.2, 20.6, 27.9, 1.9}, {3.3, 22.4, 27.7, 2.6}, {3.4, 24.2, 27.5, 3.35}, {3.45, 25.2, 27.4, 3.5}};
#define PART(knots, open, parent, kind) shape_add(shape, knots, (int)(sizeof knots / sizeof knots[0]), open, false, parent, kind, NULL)
    return PART(carotid, true, -1, NODE_VESSEL) && PART(anterior, false, 0, NODE_VESSEL) && PART(middle_1, false, 0, NODE_VESSEL) &&
           PART(middle_2, false, 0, NODE_VESSEL) && PART(anterior_1, false, 1, NODE_VESSEL) && PART(anterior_2, false, 1, NODE_VESSEL) &&
           PART(sac, false, 0, NODE_ANEURYSM);
#undef PART
}

static bool build_helix(Shape *shape, const ShapeOptions *o)
{
    enum { N = KNOTS };
    double knot[N][4], tangent[2][4], turn = 2 * PI * o->turns, along = sqrt(same_square(turn * o->bend_radius_mm) + o->rise_mm * o->rise_mm);
    for (int i = 0; i < N; i++) {
        double u = (double)i / (N - 1);
        memcpy(knot[i], (double[4]){o->bend_radius_mm * same_cos(turn * u), o->bend_radius_mm * same_sin(turn * u), o->rise_mm * u, o->radius_mm},
               sizeof knot[i]);
    }
    for (int end = 0; end < 2; end++)
        memcpy(tangent[end],
               (double[4]){-o->bend_radius_mm * turn * same_sin(end * turn) / along, o->bend_radius_mm * turn * same_cos(end * turn) / along,
                           o->rise_mm / along, 0},
               sizeof tangent[end]);
    return shape_add(shape, (const double(*)[4])knot, N, true, true, -1, NODE_VESSEL, (const double(*)[4])tangent);
}

// A symmetric bifurcation. Trunk and left daughter are one part; the right daughter is another, which starts as wide as the trunk. Each bends by the angle on
// an arc of three of its radii, then runs straight. The radii follow Murray's law: r / 2^(1/3).
static bool build_y(Shape *shape, const ShapeOptions *o)
{
    enum { TRUNK = 17, ARM = 33 };
    double r = o->radius_mm, small = r / same_cbrt(2), angle = o->angle_deg * PI / 180, bend = 3 * small, arc = bend * angle,
           length = fmax(o->length_mm, 4 * r);
    for (int side = 0; side < 2; side++) {
        double knot[TRUNK + ARM][4];
        int n = 0;
        for (int i = 0; side == 0 && i < TRUNK - 1; i++)
            memcpy(knot[n++], (double[4]){length * ((double)i / (TRUNK - 1) - 1), 0, 0, r}, sizeof knot[0]);
        for (int i = 0; i < ARM; i++) {
            double s = (arc + length) * i / (ARM - 1), turned = fmin(s, arc) / bend, on = fmax(0, s - arc), u = fmin(1, s / (3 * r));
            double x = bend * same_sin(turned) + on * same_cos(turned), y = bend * (1 - same_cos(turned)) + on * same_sin(turned);
            memcpy(knot[n++], (double[4]){x, side ? -y : y, 0, r + (small - r) * u * u * (3 - 2 * u)}, sizeof knot[0]);
        }
        const double tangent[2][4] = {{1, 0, 0, 0}, {same_cos(angle), side ? -same_sin(angle) : same_sin(angle), 0, 0}};
        if (!shape_add(shape, (const double(*)[4])knot, n, side == 0, true, side - 1, NODE_VESSEL, tangent))
            return false;
    }
    return true;
}

// A gentle wave in the plane y = 0. The neighbour's centreline lies in the plane y = const while the vessels touch, so the distance of the two centrelines is
// exactly that constant.
static double wave(const ShapeOptions *o, double x) { return 2 * o->radius_mm * same_sin(x / (8 * o->radius_mm)); }

static bool add_wave(Shape *shape, const ShapeOptions *o, double half_length)
{
    enum { N = 65 };
    double knot[N][4];
    for (int i = 0; i < N; i++) {
        double x = half_length * (2.0 * i / (N - 1) - 1);
        memcpy(knot[i], (double[4]){x, 0, wave(o, x), o->radius_mm}, sizeof knot[i]);
    }
    return shape_add(shape, (const double(*)[4])knot, N, true, false, -1, NODE_VESSEL, NULL);
}

// The neighbour runs beside the vessel over twelve radii with `gap_mm` from wall to wall, and bends away from it at both ends.
static bool build_kissing(Shape *shape, const ShapeOptions *o)
{
    enum { N = 97 };
    double r = o->radius_mm, half = 24 * r, turn = o->crossing_deg * PI / 180, knot[N][4];
    shape->neighbour = calloc(1, sizeof *shape->neighbour);
    if (!shape->neighbour || !add_wave(shape, o, half))
        return false;
    for (int i = 0; i < N; i++) {
        double x = half * (2.0 * i / (N - 1) - 1), z = wave(o, x), far = fmax(0, fabs(x) - 6 * r) / r;
        double y = 2 * r + o->gap_mm + r * 0.06 * same_square(far) * fmin(1, far / 3);
        memcpy(knot[i], (double[4]){x * same_cos(turn) - z * same_sin(turn), y, x * same_sin(turn) + z * same_cos(turn), r}, sizeof knot[i]);
    }
    return shape_add(shape->neighbour, (const double(*)[4])knot, N, true, true, -1, NODE_VESSEL, NULL);
}

static bool build_bone(Shape *shape, const ShapeOptions *o)
{
    double r = o->radius_mm, half = 24 * r;
    if (!add_wave(shape, o, half))
        return false;
    Random random = {shape->seed};
    for (int i = 0; i < (int)o->blocks; i++) {
        // first on one side, then on the other, then all around
        double x = half * ((i + 0.5) / o->blocks * 1.6 - 0.8), around = i * PI * (3 - sqrt(5)), size = (2 + 2 * random_open(&random)) * r;
        if (!shape_add_block(shape, vec3(x, 0, wave(o, x)), vec3(0, same_cos(around), same_sin(around)), vec3(size, size, size), o->gap_mm, &random))
            return false;
    }
    return true;
}

// A straight vessel with a tiny branch at right angles.
static bool build_twig(Shape *shape, const ShapeOptions *o)
{
    enum { N = 9 };
    double r = o->radius_mm, twig = fmin(o->twig_radius_mm, 0.7 * r), length = fmax(o->length_mm, 12 * r), knot[N][4], branch[N][4];
    for (int i = 0; i < N; i++) {
        double u = (double)i / (N - 1);
        memcpy(knot[i], (double[4]){length * u, 0, 0, r}, sizeof knot[i]);
        memcpy(branch[i], (double[4]){0.5 * length + 0.2 * u * u * length, 0.6 * length * u, 0, twig}, sizeof branch[i]);
    }
    return shape_add(shape, (const double(*)[4])knot, N, true, true, -1, NODE_VESSEL, NULL) &&
           shape_add(shape, (const double(*)[4])branch, N, false, false, 0, NODE_VESSEL, NULL);
}

static const char *const names[] = {"capsule", "open-capsule", "arc",  "bifurcation", "spiral", "phantom", "helix",
                                    "y",       "kissing",      "bone", "twig",        "tree",   "aorta",   "arch"};

static bool parse_options(int count, const char (*option)[2][64], const char *file, ShapeOptions *out, Faults *faults)
{
    const struct {
        const char *key;
        double *value, least, most;
    } known[] = {{"points", &out->points, 8, 100000},
                 {"sac_points", &out->sac_points, 8, 100000},
                 {"noise_mm", &out->noise_mm, 0, 10},
                 {"seed", &out->seed, 0, 9007199254740992.0},
                 {"spacing", &out->spacing, 0.05, 4},
                 {"blend_mm", &out->blend_mm, 0, 3},
                 {"length_mm", &out->length_mm, 0.1, 1000},
                 {"radius_mm", &out->radius_mm, 0.05, 50},
                 {"bend_radius_mm", &out->bend_radius_mm, 0.1, 1000},
                 {"rise_mm", &out->rise_mm, 0, 100},
                 {"scale", &out->scale, 0.01, 100},
                 {"turns", &out->turns, 0.1, 10},
                 {"angle_deg", &out->angle_deg, 5, 85},
                 {"branches", &out->branches, 1, 200},
                 {"sacs", &out->sacs, 0, 50},
                 {"blocks", &out->blocks, 0, 100},
                 {"gap_mm", &out->gap_mm, 0, 100},
                 {"crossing_deg", &out->crossing_deg, 0, 90},
                 {"twig_radius_mm", &out->twig_radius_mm, 0.02, 50},
                 {"arch_type", &out->arch_type, 1, 7},
                 {"spread", &out->spread, 0, 1},
                 {"diameter_scale", &out->diameter_scale, 0.5, 1.5}};
    int before = faults->count;
    for (int i = 0; i < count; i++) {
        size_t k = 0, n = sizeof known / sizeof known[0];
        while (k < n && strcmp(option[i][0], known[k].key))
            k++;
        if (k == n) {
            faults_add(faults, file, 0, 0,
                       "unknown shape option '%s'; expected points, sac_points, noise_mm, seed, spacing, blend_mm, length_mm, radius_mm, "
                       "bend_radius_mm, rise_mm, scale, turns, angle_deg, branches, sacs, blocks, gap_mm, crossing_deg, twig_radius_mm, arch_type, spread, "
                       "diameter_scale",
                       option[i][0]);
            continue;
        }
        char *end;
        double value = strtod(option[i][1], &end);
        if (end == option[i][1] || *end || !(value >= known[k].least && value <= known[k].most))
            faults_add(faults, file, 0, 0, "shape option %s is '%s'; expected a number from %g to %g", known[k].key, option[i][1], known[k].least,
                       known[k].most);
        else
            *known[k].value = value;
    }
    if (out->bend_radius_mm <= 1.05 * out->radius_mm)
        faults_add(faults, file, 0, 0, "bend_radius_mm %g is not larger than the tube's radius_mm %g", out->bend_radius_mm, out->radius_mm);
    if (out->arch_type != floor(out->arch_type) || out->arch_type == 3)
        faults_add(faults, file, 0, 0, "shape option arch_type is %g; expected 1, 2, 4, 5, 6 or 7", out->arch_type);
    return faults->count == before;
}

static bool build_tree(Shape *shape, const ShapeOptions *o, const char *file, Faults *faults)
{
    RandomTreeOptions tree = {
        .branches = (int)o->branches, .radius_mm = o->radius_mm, .seed = shape->seed, .sacs = (int)o->sacs, .blocks = (int)o->blocks, .gap_mm = o->gap_mm};
    return random_tree_grow(shape, &tree, file, faults);
}

static bool build_arch(Shape *shape, const ShapeOptions *o)
{
    ArchOptions arch = {.type = (int)o->arch_type, .spread = o->spread, .diameter_scale = o->diameter_scale, .seed = shape->seed};
    return arch_grow(shape, &arch);
}

static bool scale_shape(Shape *shape, double scale)
{
    for (int p = 0; scale != 1 && p < shape->part_count; p++)
        if (!part_scale(&shape->part[p], scale))
            return false;
    for (int i = 0; i < shape->block_count; i++) {
        shape->block[i].center = vec3_scale(shape->block[i].center, scale);
        shape->block[i].half = vec3_scale(shape->block[i].half, scale);
    }
    return !shape->neighbour || scale_shape(shape->neighbour, scale);
}

Shape *shape_create(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults)
{
    enum { HELIX = 6, Y, KISSING, BONE, TWIG, TREE, AORTA, ARCH, SHAPES };
    ShapeOptions o = {.points = 108,
                      .sac_points = 1500,
                      .seed = 1,
                      .spacing = 0.5,
                      .length_mm = 4,
                      .radius_mm = 1,
                      .bend_radius_mm = 4,
                      .scale = 1,
                      .turns = 2,
                      .angle_deg = 37.5,
                      .branches = 51,
                      .twig_radius_mm = 0.2,
                      .arch_type = 1,
                      .spread = 1,
                      .diameter_scale = 1};
    int which = 0, before = faults->count;
    while (which < SHAPES && strcmp(name, names[which]))
        which++;
    if (which == SHAPES)
        faults_add(faults, file, 0, 0, "unknown shape '%s'; expected " SHAPE_NAMES, name);
    // defaults that depend on the shape
    o.rise_mm = which == HELIX ? 12 : 0;
    o.gap_mm = which == KISSING ? 0.2 : 0;
    o.blocks = which == BONE ? 6 : 0;
    if (which == TREE)
        o.radius_mm = 1.6, o.bend_radius_mm = 60, o.points = 48;
    if (which == KISSING || which == BONE || which == TWIG || which == Y)
        o.bend_radius_mm = 60;
    if (!parse_options(option_count, option, file, &o, faults) || which == SHAPES)
        return NULL;
    Shape *shape = calloc(1, sizeof *shape);
    if (!shape) {
        faults_add(faults, file, 0, 0, "not enough memory for a shape");
        return NULL;
    }
    snprintf(shape->name, sizeof shape->name, "%s", name);
    shape->points = (int)o.points;
    shape->sac_points = (int)o.sac_points;
    shape->noise = o.noise_mm;
    shape->spacing = o.spacing;
    shape->seed = (uint64_t)o.seed;
    shape->blend = o.blend_mm;
    bool built = which == 0         ? build_capsule(shape, &o, false)
                 : which == 1       ? build_capsule(shape, &o, true)
                 : which == 2       ? build_arc(shape, &o)
                 : which == 3       ? build_bifurcation(shape, &o)
                 : which == 4       ? build_spiral(shape, &o)
                 : which == 5       ? build_phantom(shape)
                 : which == HELIX   ? build_helix(shape, &o)
                 : which == Y       ? build_y(shape, &o)
                 : which == KISSING ? build_kissing(shape, &o)
                 : which == BONE    ? build_bone(shape, &o)
                 : which == TWIG    ? build_twig(shape, &o)
                 : which == AORTA   ? aorta_grow(shape)
                 : which == ARCH    ? build_arch(shape, &o)
                                    : build_tree(shape, &o, file, faults);
    built = built && scale_shape(shape, o.scale) && shape_finish(shape);
    if (built && shape->neighbour) {
        Shape *neighbour = shape->neighbour;
        snprintf(neighbour->name, sizeof neighbour->name, "neighbour");
        neighbour->points = shape->points, neighbour->sac_points = shape->sac_points, neighbour->spacing = shape->spacing, neighbour->seed = shape->seed;
        built = shape_finish(neighbour);
    }
    if (built)
        return shape;
    if (faults->count == before)
        faults_add(faults, file, 0, 0, "cannot build shape %s: no free space for a block, or out of memory", name);
    shape_free(shape);
    return NULL;
}

const Shape *shape_neighbour(const Shape *shape) { return shape->neighbour; }
const ShapeBlock *shape_blocks(const Shape *shape, int *count)
{
    *count = shape->block_count;
    return shape->block;
}

double shape_voxel_mm(const Shape *shape) { return fmax(0.05, 2 * shape->noise); }

double shape_options_voxel_mm(int option_count, const char (*option)[2][64])
{
    double noise = 0;
    for (int i = 0; i < option_count; i++)
        if (!strcmp(option[i][0], "noise_mm"))
            noise = strtod(option[i][1], NULL);
    return fmax(0.05, noise > 0 && noise <= 10 ? 2 * noise : 0);
}

void shape_free(Shape *shape)
{
    if (!shape)
        return;
    for (int p = 0; p < shape->part_count; p++)
        part_free(&shape->part[p]);
    shape_free(shape->neighbour);
    free(shape->part);
    free(shape->block);
    free(shape->cell);
    free(shape->cell_part);
    free(shape);
}

#include "sim/xray_image.h"

#include "geom/geom.h"

#include <math.h>

static const double contrast_attenuation = 0.105;    // [1/mm] of undiluted contrast agent (docs/design.md, "X-ray attenuation")

PatientAxes xray_patient_axes(const Scene *scene)
{
    if (!(vec3_norm(scene->patient_superior) > 0))
        return patient_axes_lps();
    return (PatientAxes){
        .right = vec3_cross(scene->patient_anterior, scene->patient_superior), .anterior = scene->patient_anterior, .superior = scene->patient_superior};
}

// Of a sac, which is no sphere, the mean distance of its points.
static double radius_of(const VesselTree *tree, int node)
{
    double sum = 0;
    int64_t first = tree->point_offset[node], count = tree->point_offset[node + 1] - first;
    if (tree->kind[node] != NODE_ANEURYSM || count <= 0)
        return tree->radius[node];
    for (int64_t i = 0; i < count; i++)
        sum += vec3_distance(tree->point[first + i], tree->center[node]);
    return sum / (double)count;
}

XrayControl xray_view_all(const VesselTree *tree, const Scene *scene, const XrayControl *xray)
{
    XrayControl view = *xray;
    Vec3 middle = scene->wire.start, low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int i = 0; tree && i < tree->node_count; i++) {
        Vec3 c = tree->center[i];
        low = vec3(fmin(low.x, c.x), fmin(low.y, c.y), fmin(low.z, c.z));
        high = vec3(fmax(high.x, c.x), fmax(high.y, c.y), fmax(high.z, c.z));
    }
    if (tree && tree->node_count > 0)
        middle = vec3_mix(low, high, 0.5);
    view.table_mm[0] = (float)middle.x, view.table_mm[1] = (float)middle.y, view.table_mm[2] = (float)middle.z;
    const PatientAxes axes = xray_patient_axes(scene);
    const CArm arm = c_arm_place(&view, &axes);
    double farthest = 0;     // from the middle of the picture
    for (int i = 0; tree && i < tree->node_count; i++) {
        Vec3 p = c_arm_project(&arm, tree->center[i]);
        farthest = fmax(farthest, fmax(fabs(p.x), fabs(p.y)) * arm.field_mm + radius_of(tree, i));
    }
    view.field_mm = farthest > 0 ? (float)fmin(fmax(2.1 * farthest, 40), 400) : xray_default_control().field_mm;
    return view;
}

// --- the picture's grid ---

typedef struct Plane {
    CArm arm;
    int pixels;
    float *attenuation;
} Plane;

typedef struct Spot {
    double column, row;      // [pixel], the centre of the first pixel at 0
    double pixel_mm;         // side of a pixel at the point's depth
    double depth;            // [mm] from the source
} Spot;

static Plane plane_of(const Scene *scene, const XrayView *view, float *attenuation)
{
    const PatientAxes axes = xray_patient_axes(scene);
    return (Plane){.arm = c_arm_place(&view->xray, &axes), .pixels = view->pixels, .attenuation = attenuation};
}

static Spot spot_of(const Plane *plane, Vec3 point)
{
    const Vec3 p = c_arm_project(&plane->arm, point);
    double depth = C_ARM_SOURCE_MM + p.z;
    return (Spot){.column = (p.x + 0.5) * plane->pixels - 0.5,
                  .row = (0.5 - p.y) * plane->pixels - 0.5,
                  .pixel_mm = plane->arm.field_mm / plane->pixels * depth / C_ARM_SOURCE_MM,
                  .depth = depth};
}

static bool is_before_source(const Spot *spot) { return spot->depth > C_ARM_NEAREST_MM; }

// Samples of the way from a to b, at most half a pixel apart.
static int samples_between(const Plane *plane, const Spot *a, const Spot *b)
{
    double way = same_hypot(b->column - a->column, b->row - a->row);
    return 1 + (int)fmin(2 * way, 4.0 * plane->pixels);
}

// --- vessels ---

static int clipped(double pixel, int pixels) { return (int)fmin(fmax(pixel, -1), pixels); }

static void draw_sphere(const Plane *plane, Vec3 center, double radius)
{
    const Spot spot = spot_of(plane, center);
    if (!is_before_source(&spot))
        return;
    double r = radius / spot.pixel_mm;
    int top = clipped(ceil(spot.row - r), plane->pixels), bottom = clipped(floor(spot.row + r), plane->pixels - 1);
    int left = clipped(ceil(spot.column - r), plane->pixels), right = clipped(floor(spot.column + r), plane->pixels - 1);
    for (int i = top < 0 ? 0 : top; i <= bottom; i++)
        for (int j = left < 0 ? 0 : left; j <= right; j++) {
            double half2 = r * r - (i - spot.row) * (i - spot.row) - (j - spot.column) * (j - spot.column);
            float chord = (float)(2 * sqrt(fmax(half2, 0)) * spot.pixel_mm * contrast_attenuation), *pixel = &plane->attenuation[i * plane->pixels + j];
            *pixel = fmaxf(*pixel, chord);
        }
}

void xray_image_vessels(const VesselTree *tree, const Scene *scene, const XrayView *view, float *attenuation)
{
    const Plane plane = plane_of(scene, view, attenuation);
    for (int i = 0; i < view->pixels * view->pixels; i++)
        attenuation[i] = 0;
    for (int i = 0; tree && i < tree->node_count; i++) {
        int from = tree->parent[i] < 0 ? i : tree->parent[i];
        double r = radius_of(tree, i), start = radius_of(tree, from);
        const Spot a = spot_of(&plane, tree->center[from]), b = spot_of(&plane, tree->center[i]);
        int count = samples_between(&plane, &a, &b);
        for (int k = 1; k <= count; k++) {
            double u = (double)k / count;
            draw_sphere(&plane, vec3_mix(tree->center[from], tree->center[i], u), start + u * (r - start));
        }
    }
}

// --- tools ---

static void add(const Plane *plane, int row, int column, double value)
{
    if (row >= 0 && row < plane->pixels && column >= 0 && column < plane->pixels)
        plane->attenuation[row * plane->pixels + column] += (float)value;
}

// Shares an attenuation among the four pixels around a spot.
static void deposit(const Plane *plane, const Spot *spot, double value)
{
    if (!(spot->row > -1 && spot->row < plane->pixels && spot->column > -1 && spot->column < plane->pixels))
        return;
    int i = (int)floor(spot->row), j = (int)floor(spot->column);
    double v = spot->row - i, u = spot->column - j;
    add(plane, i, j, (1 - v) * (1 - u) * value);
    add(plane, i, j + 1, (1 - v) * u * value);
    add(plane, i + 1, j, v * (1 - u) * value);
    add(plane, i + 1, j + 1, v * u * value);
}

// [mm2] of material in the cross-section at arc length s.
static double material(const WireOptions *wire, double s)
{
    int k = 0;
    double end = wire->section[0].length;
    while (k + 1 < wire->section_count && s > end)
        end += wire->section[++k].length;
    double outer = wire->section[k].diameter, inner = wire->section[k].inner_diameter;
    return PI / 4 * (outer * outer - inner * inner);
}

void xray_image_tool(const Scene *scene, int tool, int which, const ToolNode *node, int count, const XrayView *view, float *attenuation)
{
    const Plane plane = plane_of(scene, view, attenuation);
    const WireOptions wire = scene_device_wire(scene, tool, which);
    for (int i = 1; i < count; i++) {
        if (node[i].carrier < 0)
            continue;
        Vec3 from = node[i - 1].position, to = node[i].position;
        const Spot a = spot_of(&plane, from), b = spot_of(&plane, to);
        int samples = samples_between(&plane, &a, &b);
        double length = vec3_distance(from, to) / samples;
        for (int k = 0; k < samples; k++) {
            double u = (k + 0.5) / samples, s = node[i - 1].s + u * (node[i].s - node[i - 1].s);
            const Spot spot = spot_of(&plane, vec3_mix(from, to, u));
            if (is_before_source(&spot))
                deposit(&plane, &spot, scene_device_attenuation(scene, tool, which, s) * material(&wire, s) * length / (spot.pixel_mm * spot.pixel_mm));
        }
    }
}

#include "recon/phantom/shaped_tube.h"

static const double BEND = 4, RISE = 12, TURNS = 2, APART = 0.5;
enum { AROUND = 60 };

double shaped_tube_length(void) { return sqrt(same_square(2 * PI * TURNS * BEND) + RISE * RISE); }

static Vec3 curve_at(double t, Vec3 *tangent, Vec3 *n)
{
    double length = shaped_tube_length(), a = 2 * PI * TURNS * t / length, turn = 2 * PI * TURNS * BEND / length;
    *tangent = vec3(-turn * same_sin(a), turn * same_cos(a), RISE / length);
    *n = vec3(-same_cos(a), -same_sin(a), 0);
    return vec3(BEND * same_cos(a), BEND * same_sin(a), RISE * t / length);
}

static double radius_at(ShapedTube tube, double t, double theta)
{
    if (tube == SHAPED_STAR)
        return (1.2 - 0.4 * t / shaped_tube_length()) * (1 + 0.1 * same_cos(5 * theta));
    double turned = theta - 2 * PI * t / 20, x = same_cos(turned) / 1.2, y = same_sin(turned) / 0.8;
    return 1 / sqrt(x * x + y * y);
}

// The kidney's wall at the way `share` (0 … 1) around: outer arc, end, inner arc, end; about the middle of its area.
static void kidney_at(double share, double *n, double *b)
{
    static const double RING = 0.9, HALF = 0.5, MIDDLE = 0.4484;
    double outer = PI * (RING + HALF), end = PI * HALF, inner = PI * (RING - HALF), way = share * (outer + 2 * end + inner);
    if (way < outer) {
        double a = way / (RING + HALF) - PI / 2;
        *n = (RING + HALF) * same_cos(a) - MIDDLE, *b = (RING + HALF) * same_sin(a);
    } else if (way < outer + end) {
        double a = (way - outer) / HALF + PI / 2;
        *n = HALF * same_cos(a) - MIDDLE, *b = RING + HALF * same_sin(a);
    } else if (way < outer + end + inner) {
        double a = PI / 2 - (way - outer - end) / (RING - HALF);
        *n = (RING - HALF) * same_cos(a) - MIDDLE, *b = (RING - HALF) * same_sin(a);
    } else {
        double a = (way - outer - end - inner) / HALF + PI / 2;
        *n = HALF * same_cos(a) - MIDDLE, *b = -RING + HALF * same_sin(a);
    }
}

static Vec3 wall_at(ShapedTube tube, double t, double theta)
{
    Vec3 tangent, n, s = curve_at(t, &tangent, &n), b = vec3_cross(tangent, n);
    double r = radius_at(tube, t, theta), across = r * same_cos(theta), up = r * same_sin(theta);
    if (tube == SHAPED_KIDNEY)
        kidney_at(theta / (2 * PI) - floor(theta / (2 * PI)), &across, &up);
    return vec3_add(s, vec3_add(vec3_scale(n, across), vec3_scale(b, up)));
}

Vec3 shaped_tube_wall(ShapedTube tube, double t, double theta, Vec3 *normal)
{
    static const double STEP = 1e-5;
    if (normal) {
        Vec3 along = vec3_sub(wall_at(tube, t + STEP, theta), wall_at(tube, t - STEP, theta));
        Vec3 around = vec3_sub(wall_at(tube, t, theta + STEP), wall_at(tube, t, theta - STEP));
        *normal = vec3_unit(vec3_cross(along, around));
    }
    return wall_at(tube, t, theta);
}

VesselTree *shaped_tube_sample(ShapedTube tube, double noise_mm, uint64_t seed)
{
    double length = shaped_tube_length();
    int nodes = (int)(length / APART) + 1;
    VesselTree *tree = vessel_tree_create(nodes, (int64_t)nodes * AROUND, 0);
    Random random = {seed};
    for (int i = 0; tree && i < nodes; i++) {
        double at = length * i / (nodes - 1), phase = 2 * PI * random_open(&random);
        Vec3 n;
        tree->center[i] = curve_at(at, &tree->direction[i], &n);
        tree->radius[i] = tube == SHAPED_STAR ? 1.2 - 0.4 * at / length : 1;
        tree->height[i] = 2 * tree->radius[i];
        tree->parent[i] = i - 1;
        for (int k = 0; k < AROUND; k++) {
            Vec3 normal, p = shaped_tube_wall(tube, at + APART * ((k + 0.5) / AROUND - 0.5), phase + k * PI * (3 - sqrt(5)), &normal);
            tree->point[i * AROUND + k] = noise_mm > 0 ? vec3_add_scaled(p, noise_mm * random_normal(&random), normal) : p;
        }
        tree->point_offset[i + 1] = (i + 1) * AROUND;
    }
    if (tree && !vessel_tree_link(tree)) {
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

#include "recon/volume/blurred_edge.h"

#include "base/base.h"
#include "recon/volume/bspline.h"

#include <math.h>
#include <stdlib.h>

// --- a disc ---

// I0(z) / I1(z)
static double bessel_ratio(double z)
{
    if (z > 30)              // asymptotic series; relative error below 1e-7 in this range
        return 1 + 1 / (2 * z) + 3 / (8 * z * z) + 3 / (8 * z * z * z);
    double q = z * z / 4, term = 1, zeroth = 0, first = 0;
    for (int k = 0; k < 200 && term > 1e-17 * zeroth; k++) {
        zeroth += term;
        first += term / (k + 1);
        term *= q / ((k + 1.0) * (k + 1.0));
    }
    return zeroth / (first * z / 2);
}

// The brightness falls fastest where this is 0; it is positive nearer to the disc's middle, and it grows with the radius.
static double steepness(double radius, double blur, double x) { return radius * bessel_ratio(radius * x / (blur * blur)) - blur * blur / x - x; }

double blurred_edge_of(double radius, double blur)
{
    if (!(blur > 1e-3 * radius))
        return radius;
    double low = 0, high = radius + 2 * blur;
    for (int i = 0; i < 60; i++) {
        double x = 0.5 * (low + high);
        if (steepness(radius, blur, x) > 0)
            low = x;
        else
            high = x;
    }
    return low;
}

double blurred_edge_undo(double edge, double blur)
{
    if (!(edge > 1.24 * blur) || !(blur > 0))
        return edge;
    double low = edge, high = edge + 0.2 * blur;
    for (int i = 0; i < 40; i++) {
        double radius = 0.5 * (low + high);
        if (steepness(radius, blur, edge) < 0)
            low = radius;
        else
            high = radius;
    }
    return low;
}

// --- the image's blur ---

enum { SIDE = 12, PROFILE = 2 * SIDE + 1, NODES = 400, NODES_LEAST = 10 };
static const double SAMPLING = 0.25;     // [voxel] between samples of a profile, which therefore reaches three voxels to either side
static const double WIDE = 3;            // [voxel] radius above which the inside is bright and the wall nearly flat

static Vec3 outward(const VesselTree *tree, int node, Vec3 x)
{
    Vec3 d = vec3_sub(x, tree->center[node]), along = tree->direction[node];
    if (tree->kind[node] == NODE_VESSEL)
        d = vec3_add_scaled(d, -vec3_dot(d, along), along);
    double length = vec3_norm(d);
    return length > 0 ? vec3_scale(d, 1 / length) : vec3(0, 0, 0);
}

static void mean_profile(const Volume *volume, const VesselTree *tree, int node, double profile[PROFILE])
{
    float line[PROFILE];
    double step = SAMPLING * volume_voxel_size(volume);
    for (int k = 0; k < PROFILE; k++)
        profile[k] = 0;
    for (int64_t p = tree->point_offset[node]; p < tree->point_offset[node + 1]; p++) {
        Vec3 x = tree->point[p], n = vec3_scale(outward(tree, node, x), step), from = volume_voxel_of(volume, vec3_add_scaled(x, -SIDE, n));
        bspline_sample_line(volume, from, vec3_sub(volume_voxel_of(volume, vec3_add_scaled(x, 1 - SIDE, n)), from), PROFILE, line);
        for (int k = 0; k < PROFILE; k++)
            profile[k] += (double)line[k];
    }
}

// Squared misfit of the best fit a + c s to the profile, where s is a step down at the middle, blurred by b samples; stores c in `height`.
static double misfit(const double profile[PROFILE], double b, double *height)
{
    double s1 = 0, s2 = 0, y1 = 0, y2 = 0, sy = 0;
    for (int k = 0; k < PROFILE; k++) {
        double s = 0.5 - 0.5 * same_erf((k - SIDE) / (b * sqrt(2))), y = profile[k];
        s1 += s, s2 += s * s, y1 += y, y2 += y * y, sy += s * y;
    }
    double spread = s2 - s1 * s1 / PROFILE, with = sy - s1 * y1 / PROFILE;
    *height = with / spread;
    return y2 - y1 * y1 / PROFILE - with * with / spread;
}

// Returns the blur [samples], or 0 if the profile does not fall.
static double profile_blur(const double profile[PROFILE])
{
    static const double GOLDEN = 0.6180339887498949;
    double low = 1, high = SIDE, height;
    for (int i = 0; i < 30; i++) {
        double a = high - GOLDEN * (high - low), b = low + GOLDEN * (high - low);
        if (misfit(profile, a, &height) < misfit(profile, b, &height))
            high = b;
        else
            low = a;
    }
    misfit(profile, low, &height);
    return height > 0 ? low : 0;
}

double blurred_edge_measure(const Volume *volume, const VesselTree *tree)
{
    double voxel = volume_voxel_size(volume), blur[NODES];
    int wide = 0, count = 0, at = 0;
    for (int i = 0; i < tree->node_count; i++)
        wide += tree->kind[i] == NODE_VESSEL && tree->radius[i] > WIDE * voxel;
    int stride = wide / NODES + 1;
    for (int i = 0; i < tree->node_count; i++) {
        if (tree->kind[i] != NODE_VESSEL || !(tree->radius[i] > WIDE * voxel) || at++ % stride != 0)
            continue;
        double profile[PROFILE], found;
        mean_profile(volume, tree, i, profile);
        found = profile_blur(profile);
        if (found > 0)
            blur[count++] = found;
    }
    if (count < NODES_LEAST)
        return 0;
    sort_doubles(blur, (size_t)count);
    return blur[count / 2] * SAMPLING * voxel;
}

// --- a tree ---

bool blurred_edge_correct(VesselTree *tree, double blur)
{
    for (int i = 0; i < tree->node_count; i++) {
        double move = (tree->kind[i] == NODE_VESSEL ? 1 : 2) * (blurred_edge_undo(tree->radius[i], blur) - tree->radius[i]);
        tree->radius[i] += move;
        for (int64_t p = tree->point_offset[i]; p < tree->point_offset[i + 1]; p++)
            tree->point[p] = vec3_add_scaled(tree->point[p], move, outward(tree, i, tree->point[p]));
    }
    return vessel_tree_link(tree);
}

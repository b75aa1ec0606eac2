// Trees with blobby models along a given centreline, for tests: node i is at point i of the centreline, and its model is a row of equal blobs along the
// centreline over `overlap` nodes to each side. The width of the blobs gives the right radius in the middle of a straight line.
#ifndef SELDINGER_TESTS_BLOB_TUBE_H
#define SELDINGER_TESTS_BLOB_TUBE_H

#include "geom/blobby.h"
#include "geom/vessel_tree.h"

// Width of `count` blobs in a row, `spacing` apart, whose surface is `radius` from the middle of the row.
static inline double blob_row_width(int count, double spacing, double radius)
{
    double low = 1e-6, high = 10 * radius;
    for (int i = 0; i < 200; i++) {
        double rho = 0.5 * (low + high), f = -0.1;
        for (int j = 0; j < count; j++) {
            double s = spacing * (j - 0.5 * (count - 1)), u = 1 / (1 + (s * s + radius * radius) / (5 * rho * rho));
            f += rho * u * u;
        }
        if (f > 0)
            high = rho;
        else
            low = rho;
    }
    return 0.5 * (low + high);
}

// `line` holds node_count + 2 * overlap points of equal spacing; node i sits at line[i + overlap].
static inline VesselTree *blob_tube(const Vec3 *line, int node_count, int overlap, int blobs, double radius)
{
    VesselTree *t = vessel_tree_create(node_count, 0, (int64_t)node_count * blobs);
    double spacing = vec3_distance(line[0], line[1]), pitch = 2 * overlap * spacing / (blobs - 1), rho = blob_row_width(blobs, pitch, radius);
    for (int i = 0; i < node_count; i++) {
        t->center[i] = line[i + overlap];
        t->radius[i] = radius;
        t->direction[i] = vec3_unit(vec3_sub(line[i + overlap + 1], line[i + overlap - 1]));
        t->height[i] = spacing;
        t->parent[i] = i - 1;
        t->blob_offset[i + 1] = (int64_t)(i + 1) * blobs;
        for (int j = 0; j < blobs; j++) {
            double s = 2.0 * overlap * j / (blobs - 1);
            int k = (int)s < 2 * overlap ? (int)s : 2 * overlap - 1;
            t->blob_center[i * blobs + j] = vec3_mix(line[i + k], line[i + k + 1], s - k);
            t->blob_width[i * blobs + j] = rho;
        }
    }
    vessel_tree_link(t);
    return t;
}

// A helix of the given radius and pitch; neighbouring points about `spacing` apart.
static inline void helix_line(Vec3 *line, int count, double radius, double pitch, double spacing)
{
    double a = spacing / sqrt(radius * radius + pitch * pitch / (4 * PI * PI));
    for (int i = 0; i < count; i++)
        line[i] = vec3(radius * cos(a * i), radius * sin(a * i), pitch * a * i / (2 * PI));
}

#endif

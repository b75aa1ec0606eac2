// Trees with a field of shared blobs along a line, for tests: base blobs of R = 2 r, amplitude such that a straight row's mean wall stands at r, and
// refinement blobs of either sign on the wall.
#ifndef SELDINGER_TESTS_FIELD_LINE_H
#define SELDINGER_TESTS_FIELD_LINE_H

#include "geom/blobby.h"
#include "geom/vessel_tree.h"
#include "random_numbers.h"

// Amplitude of a straight row of blobs of R = 2 r, `pitch` apart, whose field is 0 at `radius`, averaged along the row.
static inline double field_row_amplitude(double pitch, double radius)
{
    enum { PLACES = 20 };
    double sum = 0;
    for (int p = 0; p < PLACES; p++)
        for (int j = -10; j <= 10; j++) {
            double s = pitch * (j + (double)p / PLACES), u = fmax(1 - (s * s + radius * radius) / (4 * radius * radius), 0);
            sum += u * u * u;
        }
    return PLACES / sum;
}

// `line` holds node_count + 2 * over points of equal spacing; node i sits at line[i + over]; each point of the line has a base blob, of the nearest node;
// `extra` refinement blobs a node sit on the wall.
static inline VesselTree *field_tree_along(const Vec3 *line, int node_count, int over, double radius, int extra, uint64_t seed)
{
    int all = node_count + 2 * over, at = 0;
    VesselTree *t = vessel_tree_create_shared(node_count, 0, all + (int64_t)node_count * extra);
    double spacing = vec3_distance(line[0], line[1]), a = field_row_amplitude(spacing, radius);
    for (int i = 0; i < node_count; i++) {
        t->center[i] = line[i + over];
        t->radius[i] = radius;
        t->direction[i] = vec3_unit(vec3_sub(line[i + over + 1], line[i + over - 1]));
        t->height[i] = spacing;
        t->parent[i] = i - 1;
        int first = i == 0 ? 0 : i + over, last = i + 1 == node_count ? all - 1 : i + over;
        for (int k = first; k <= last; k++, at++) {
            t->blob_center[at] = line[k];
            t->blob_width[at] = 2 * radius;
            t->blob_amplitude[at] = a;
        }
        for (int k = 0; k < extra; k++, at++) {
            t->blob_center[at] = vec3_add_scaled(t->center[i], radius, random_unit_vector(&seed));
            t->blob_width[at] = random_in(&seed, 0.5, 1.2) * radius;
            t->blob_amplitude[at] = random_in(&seed, -0.08, 0.08);
        }
        t->blob_offset[i + 1] = at;
    }
    vessel_tree_link(t);
    return t;
}

#endif

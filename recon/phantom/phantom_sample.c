// Samples a synthetic shape as a tree: nodes on the centreline with points on the true surface.
#include "recon/phantom/phantom.h"

#include "base/base.h"
#include "recon/phantom/phantom_parts.h"

#include <stdlib.h>

// --- Samples ---

// Marches from a point inside along unit d to the surface. Returns false if it is further than `most`.
static bool march_out(const Shape *shape, Vec3 x, Vec3 d, double most, Vec3 *hit)
{
    double t = 0;
    for (int i = 0; i < 400 && t <= most; i++) {
        Vec3 p = vec3_add_scaled(x, t, d);
        double f = shape_field(shape, p, NULL);
        if (f < 1e-12) {
            *hit = p;
            return true;
        }
        t += f;
    }
    return false;
}

typedef struct Sampler {
    const Shape *shape;
    VesselTree *tree;        // points are appended with the nodes
    int64_t capacity;
    Random random;
    bool failed;
} Sampler;

static void add_sample(Sampler *s, Vec3 p)
{
    VesselTree *tree = s->tree;
    if (s->shape->noise > 0) {
        Vec3 g;
        shape_field(s->shape, p, &g);
        p = vec3_add_scaled(p, s->shape->noise * random_normal(&s->random), vec3_unit_or(g, vec3(0, 0, 0)));
    }
    if (tree->point_count == s->capacity) {
        int64_t capacity = 2 * s->capacity + 1024;
        Vec3 *more = realloc(tree->point, (size_t)capacity * sizeof *more);
        if (!more) {
            s->failed = true;
            return;
        }
        tree->point = more;
        s->capacity = capacity;
    }
    tree->point[tree->point_count++] = p;
}

// Samples the side of the vessel by rays perpendicular to it, evenly over the cylinder. Rays into a branch or sac reach the wall too late and are discarded.
static void sample_side(Sampler *s, const Part *part, double at, double height)
{
    double phase = 2 * PI * random_open(&s->random), last = part->at[part->knot_count - 1];
    int n = s->shape->points;
    for (int k = 0; k < n; k++) {
        double t = at + height * ((k + 0.5) / n - 0.5), angle = phase + k * PI * (3 - sqrt(5));
        if ((t < 0 && !part->open_start) || (t > last && !part->open_end))
            continue;
        Station station = part_at(part, t);
        Vec3 d = vec3_unit(station.tangent), e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1), hit;
        Vec3 out = vec3_add(vec3_scale(e1, same_cos(angle)), vec3_scale(e2, same_sin(angle)));
        if (march_out(s->shape, station.center, out, 1.4 * station.radius, &hit))
            add_sample(s, hit);
    }
}

static void sample_cap(Sampler *s, const Part *part, double at, double side)
{
    Station station = part_at(part, at);
    Vec3 d = vec3_scale(vec3_unit(station.tangent), side), e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1), hit;
    double phase = 2 * PI * random_open(&s->random);
    int n = s->shape->points / 2;
    for (int k = 0; k < n; k++) {
        double z = (k + 0.5) / n, ring = sqrt(1 - z * z), angle = phase + k * PI * (3 - sqrt(5));
        Vec3 out = vec3_add_scaled(vec3_add(vec3_scale(e1, ring * same_cos(angle)), vec3_scale(e2, ring * same_sin(angle))), z, d);
        if (march_out(s->shape, station.center, out, 1.4 * station.radius, &hit))
            add_sample(s, hit);
    }
}

// Samples a sac in all directions from its centre; points on the parent's wall belong to the parent.
static void sample_sac(Sampler *s, const Part *part, double at)
{
    Station station = part_at(part, at);
    double phase = 2 * PI * random_open(&s->random);
    int n = s->shape->sac_points;
    for (int k = 0; k < n; k++) {
        double z = 1 - (2 * k + 1.0) / n, ring = sqrt(1 - z * z), angle = phase + k * PI * (3 - sqrt(5)), t;
        Vec3 hit, g;
        if (!march_out(s->shape, station.center, vec3(ring * same_cos(angle), ring * same_sin(angle), z), 4 * station.radius, &hit))
            continue;
        double own = part_field(part, hit, -HUGE_VAL, false, &g, &t), parent = part_field(&s->shape->part[part->parent], hit, -HUGE_VAL, false, &g, &t);
        if (own >= parent)
            add_sample(s, hit);
    }
}

// Places a part's nodes (their parameters): about `spacing` local radii apart. A branch starts at its ostium; a sac has one node at its widest place.
static int place_nodes(const Shape *shape, int p, double *at, int capacity)
{
    const Part *part = &shape->part[p];
    double last = part->at[part->knot_count - 1], t = 0, total = 0;
    if (part->kind == NODE_ANEURYSM) {
        at[0] = last;
        return 1;
    }
    if (part->parent >= 0) {
        const Part *parent = &shape->part[part->parent];
        for (; t < last; t += 0.01 * part_at(part, t).radius) {
            Vec3 g;
            double u, inside = part_field(parent, part_at(part, t).center, -HUGE_VAL, false, &g, &u);
            if (inside < 0.1 * part_at(parent, u).radius)
                break;
        }
    }
    double first = t;
    for (double u = first; u < last; u += 0.001 * (last - first))
        total += 0.001 * (last - first) / part_at(part, u).radius;
    int count = (int)floor(total / shape->spacing + 0.5) + 1;
    count = count < 2 ? 2 : count > capacity ? capacity : count;
    double done = 0;
    int placed = 0;
    at[placed++] = first;
    for (double u = first; u < last && placed < count - 1; u += 0.001 * (last - first)) {
        done += 0.001 * (last - first) / part_at(part, u).radius;
        if (done >= total * placed / (count - 1))
            at[placed++] = u;
    }
    at[placed++] = last;
    return placed;
}

enum { NODES_PER_PART = 4000 };

VesselTree *shape_sample(const Shape *shape, Faults *faults)
{
    double(*at)[NODES_PER_PART] = calloc((size_t)shape->part_count, sizeof *at);
    int *count = calloc((size_t)shape->part_count, sizeof *count), *first = calloc((size_t)shape->part_count, sizeof *first), nodes = 0;
    bool room = at && count && first;
    for (int p = 0; room && p < shape->part_count; p++) {
        first[p] = nodes;
        nodes += count[p] = place_nodes(shape, p, at[p], NODES_PER_PART);
    }
    Sampler s = {.shape = shape, .tree = room ? vessel_tree_create(nodes, 0, 0) : NULL, .random = {shape->seed}};
    VesselTree *tree = s.tree;
    for (int p = 0; tree && p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        for (int k = 0; k < count[p]; k++) {
            int node = first[p] + k;
            Station station = part_at(part, at[p][k]);
            tree->center[node] = station.center;
            tree->radius[node] = station.radius;
            tree->direction[node] = vec3_unit(station.tangent);
            tree->height[node] = 2 * station.radius;
            tree->kind[node] = part->kind;
            tree->parent[node] = node - 1;
            if (k == 0 && part->parent >= 0) {   // link to the nearest node of the parent part
                int nearest = first[part->parent];
                for (int m = nearest; m < first[part->parent] + count[part->parent]; m++)
                    if (vec3_distance(tree->center[m], station.center) < vec3_distance(tree->center[nearest], station.center))
                        nearest = m;
                tree->parent[node] = nearest;
            }
            if (part->kind == NODE_ANEURYSM) {
                sample_sac(&s, part, at[p][k]);
            } else {
                sample_side(&s, part, at[p][k], 2 * station.radius);
                if (k == 0 && !part->open_start && part->parent < 0)
                    sample_cap(&s, part, at[p][k], -1);
                if (k == count[p] - 1 && !part->open_end)
                    sample_cap(&s, part, at[p][k], 1);
            }
            tree->point_offset[node + 1] = tree->point_count;
        }
    }
    free(at);
    free(count);
    free(first);
    if (!tree || s.failed || !vessel_tree_link(tree)) {
        faults_add(faults, shape->name, 0, 0, "not enough memory for %d nodes", nodes);
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

VesselTree *shape_tree(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults)
{
    Shape *shape = shape_create(name, option_count, option, file, faults);
    VesselTree *tree = shape ? shape_sample(shape, faults) : NULL;
    shape_free(shape);
    return tree;
}

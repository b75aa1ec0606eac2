// A lid is the region at which a centreline's end points: triangles of nearly one
// plane, perpendicular to the centreline, as large as the lumen, joined to the wall at a sharp edge. A round blind end has no such region: within 20 degrees
// of its pole lies only an eighth of the lumen's area.
#include "recon/surface/import_wall.h"

#include "base/base.h"
#include "recon/surface/mesh_edges.h"

#include <stdlib.h>
#include <string.h>

static const double LID_COSINE = 0.94, SQUARE_COSINE = 0.7, EDGE_COSINE = 0.82,   // 20 degrees, 45 degrees, 35 degrees
    ROUND = 0.5;                                                                // area over that of the disc around it: triangle 0.41 at most, square 0.64

static bool link_sides(const SurfaceMesh *mesh, int (*across)[3])
{
    MeshEdge *edge = malloc((3 * (size_t)mesh->triangle_count + 1) * sizeof *edge);
    if (!edge)
        return false;
    mesh_edges_sort(mesh, edge);
    mesh_edges_link(mesh, edge, across);
    free(edge);
    return true;
}

static Vec3 area_of(const SurfaceMesh *mesh, int t)
{
    Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
    return vec3_scale(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)), 0.5);
}

// Marks the lid at which a vessel's end points, if there is one.
static void mark_lid(const SurfaceMesh *mesh, const MeshTree *tree, int (*across)[3], Vec3 end, Vec3 outward, double radius, bool *lid, int *lids, int *queue,
                     bool *seen)
{
    int seed = -1, head = 0, tail = 0;
    Vec3 u = vec3_normal_to(outward), v = vec3_cross(outward, u);
    // start a radius back, in case the end lies beyond its lid; try beside the axis too, because facets there may be slivers
    for (int k = 0; k < 6 && seed < 0; k++) {
        Vec3 aside = vec3_add(vec3_scale(u, same_cos(2.4 * k)), vec3_scale(v, same_sin(2.4 * k)));
        Vec3 from = vec3_add_scaled(vec3_add_scaled(end, -radius, outward), 0.06 * k * radius, aside);
        if (isfinite(mesh_tree_ray(tree, from, outward, 4 * radius, &seed)) && (lid[seed] || vec3_dot(vec3_unit(area_of(mesh, seed)), outward) < SQUARE_COSINE))
            seed = -1;
    }
    if (seed < 0)
        return;
    Vec3 normal = vec3_unit(area_of(mesh, seed)), origin = mesh->vertex[mesh->triangle[seed][0]], sum = {0, 0, 0};
    double sharp = 0, border = 0, widest = 0;
    // once around the first facet, then around the plane of the region found
    for (int pass = 0; pass < 2; pass++) {
        Vec3 moment = {0, 0, 0};
        double weight = 0;
        for (int i = 0; i < tail; i++)
            seen[queue[i]] = false;
        sum = vec3(0, 0, 0);
        head = 0;
        sharp = border = widest = 0;
        queue[0] = seed;
        tail = 1;
        seen[seed] = true;
        while (head < tail) {
            int t = queue[head++];
            Vec3 area = area_of(mesh, t);
            sum = vec3_add(sum, area);
            weight += vec3_norm(area);
            for (int k = 0; k < 3; k++) {
                moment = vec3_add_scaled(moment, vec3_norm(area) / 3, mesh->vertex[mesh->triangle[t][k]]);
                int other = across[t][k];
                if (other >= 0 && seen[other])
                    continue;
                Vec3 n = other >= 0 ? vec3_unit(area_of(mesh, other)) : normal;
                bool joins = other >= 0 && vec3_dot(n, normal) > LID_COSINE;
                for (int c = 0; c < 3 && joins; c++)
                    joins = fabs(vec3_dot(vec3_sub(mesh->vertex[mesh->triangle[other][c]], origin), normal)) < 0.25 * radius;
                if (joins) {
                    seen[other] = true;
                    queue[tail++] = other;
                } else {
                    Vec3 from = mesh->vertex[mesh->triangle[t][k]];
                    double length = vec3_distance(from, mesh->vertex[mesh->triangle[t][(k + 1) % 3]]);
                    border += length;
                    sharp += other < 0 || vec3_dot(n, normal) < EDGE_COSINE ? length : 0;
                    widest = fmax(widest, vec3_distance(from, origin));
                }
            }
        }
        origin = vec3_scale(moment, 1 / fmax(weight, 1e-300));
        normal = vec3_unit_or(sum, normal);
    }
    double area = vec3_norm(sum);
    // a facet of a coarse round end may be as large, but it is not a disc
    bool is_lid = area > 0.5 * PI * radius * radius && area < 4 * PI * radius * radius && sharp > 0.4 * border && area > ROUND * PI * widest * widest;
    for (int i = 0; i < tail; i++) {
        seen[queue[i]] = false;
        lid[queue[i]] = lid[queue[i]] || is_lid;
    }
    *lids += is_lid;
}

// Finds a curve's end: its outward direction over the last 1.5 radii, and the largest inscribed sphere there.
static void end_of_curve(const CurveSet *set, int curve, bool last, const MeshTree *tree, Vec3 *end, Vec3 *outward, double *radius)
{
    int first = set->offset[curve], n = set->offset[curve + 1] - first, triangle = 0;
    Vec3 foot, far;
    double arc = 0;
    *end = far = set->point[last ? first + n - 1 : first];
    *radius = mesh_tree_nearest(tree, *end, INFINITY, &foot, &triangle);
    for (int i = 1; i < n && (i == 1 || arc < 1.5 * *radius); i++) {
        Vec3 next = set->point[last ? first + n - 1 - i : first + i];
        double length = vec3_distance(far, next);
        int steps = (int)fmin(ceil(length / fmax(0.25 * *radius, 1e-3 * length)), 1000);
        Vec3 from = far;
        for (int s = 1; s <= steps && (arc == 0 || arc < 1.5 * *radius); s++, arc += length / steps) {
            far = vec3_mix(from, next, (double)s / steps);
            *radius = fmax(*radius, mesh_tree_nearest(tree, far, INFINITY, &foot, &triangle));
        }
    }
    *outward = vec3_unit(vec3_sub(*end, far));
}

// Returns true if another curve continues from this one's end, straight or aside: then it is not the end of a vessel.
static bool is_junction(const CurveSet *set, int curve, Vec3 end, Vec3 outward, double radius)
{
    for (int c = 0; c < set->curve_count; c++) {
        bool passes = false, continues = false;
        for (int i = set->offset[c]; c != curve && i < set->offset[c + 1]; i++) {
            Vec3 to = vec3_sub(set->point[i], end);
            double d = vec3_norm(to);
            passes = passes || d < 0.5 * radius;
            continues = continues || (d > radius && d < 2 * radius && vec3_dot(to, outward) > -0.3 * d);
        }
        if (passes && continues)
            return true;
    }
    return false;
}

// --- openings ---

static bool find_openings(Wall *wall)
{
    const SurfaceMesh *mesh = &wall->mesh;
    size_t v = (size_t)mesh->vertex_count + 1, triangle_capacity = (size_t)mesh->triangle_count + 1;
    int(*across)[3] = malloc(triangle_capacity * sizeof *across), *parent = malloc(v * sizeof *parent), *number = malloc(v * sizeof *number), count = 0;
    double *length = NULL;
    bool good = across && parent && number && link_sides(mesh, across);
    for (int i = 0; good && i < mesh->vertex_count; i++) {
        parent[i] = i;
        number[i] = -1;
    }
    for (int t = 0; good && t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (across[t][k] < 0)
                disjoint_join(parent, mesh->triangle[t][k], mesh->triangle[t][(k + 1) % 3]);
    for (int t = 0; good && t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (across[t][k] < 0) {
                int root = disjoint_root(parent, mesh->triangle[t][k]);
                number[root] = number[root] < 0 ? count++ : number[root];
            }
    wall->opening = calloc((size_t)count + 1, sizeof *wall->opening);
    length = calloc((size_t)count + 1, sizeof *length);
    good = good && wall->opening && length;
    for (int pass = 0; good && pass < 2; pass++) {
        for (int t = 0; t < mesh->triangle_count; t++)
            for (int k = 0; k < 3; k++) {
                if (across[t][k] >= 0)
                    continue;
                int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3], o = number[disjoint_root(parent, a)];
                Vec3 p = mesh->vertex[a], q = mesh->vertex[b];
                Opening *opening = &wall->opening[o];
                double l = vec3_distance(p, q);
                if (pass == 0) {
                    opening->center = vec3_add_scaled(opening->center, l, vec3_scale(vec3_add(p, q), 0.5));
                    length[o] += l;
                } else   // a lid's edges run opposite to the wall's
                    opening->normal = vec3_add(opening->normal, vec3_scale(vec3_cross(vec3_sub(q, opening->center), vec3_sub(p, opening->center)), 0.5));
            }
        for (int o = 0; o < count; o++) {
            Opening *opening = &wall->opening[o];
            if (pass == 0)
                opening->center = vec3_scale(opening->center, 1 / fmax(length[o], 1e-300));
            else {
                opening->radius = sqrt(vec3_norm(opening->normal) / PI);
                opening->normal = vec3_unit(opening->normal);
            }
        }
    }
    wall->opening_count = good ? count : 0;
    free(across);
    free(parent);
    free(number);
    free(length);
    return good;
}

int wall_opening_near(const Wall *wall, Vec3 end, Vec3 outward, double radius)
{
    int best = -1;
    double least = INFINITY;
    for (int o = 0; o < wall->opening_count; o++) {
        const Opening *opening = &wall->opening[o];
        Vec3 to = vec3_sub(opening->center, end);
        double along = vec3_dot(to, outward), aside = sqrt(fmax(0, vec3_norm2(to) - along * along));
        // slits in a damaged mesh are not ends: neither their size nor their direction fits
        if (opening->radius > 0.4 * radius && opening->radius < 3 * radius && vec3_dot(opening->normal, outward) > 0.3 && fabs(along) < 4 * radius &&
            aside < 1.5 * opening->radius && vec3_norm(to) < least) {
            least = vec3_norm(to);
            best = o;
        }
    }
    return best;
}

bool wall_open(const SurfaceMesh *mesh, const CurveSet *set, Wall *wall)
{
    size_t n = (size_t)mesh->triangle_count + 1;
    *wall = (Wall){.mesh = {mesh->vertex_count, 0, malloc(((size_t)mesh->vertex_count + 1) * sizeof(Vec3)), malloc(n * sizeof(int[3]))}};
    MeshTree *tree = mesh_tree_create(mesh);
    int(*across)[3] = malloc(n * sizeof *across), *queue = malloc(n * sizeof *queue);
    bool *lid = calloc(n, sizeof *lid), *seen = calloc(n, sizeof *seen);
    bool good = wall->mesh.vertex && wall->mesh.triangle && tree && across && queue && lid && seen && link_sides(mesh, across);
    for (int c = 0; good && c < set->curve_count; c++)
        for (int last = 0; last < 2; last++) {
            Vec3 end, outward;
            double radius;
            end_of_curve(set, c, last, tree, &end, &outward, &radius);
            if (!is_junction(set, c, end, outward, radius))
                mark_lid(mesh, tree, across, end, outward, radius, lid, &wall->lid_count, queue, seen);
        }
    if (good) {
        memcpy(wall->mesh.vertex, mesh->vertex, (size_t)mesh->vertex_count * sizeof(Vec3));
        for (int t = 0; t < mesh->triangle_count; t++)
            if (!lid[t])
                memcpy(wall->mesh.triangle[wall->mesh.triangle_count++], mesh->triangle[t], sizeof(int[3]));
        good = (wall->tree = mesh_tree_create(&wall->mesh)) && find_openings(wall);
    }
    mesh_tree_free(tree);
    free(across);
    free(queue);
    free(lid);
    free(seen);
    if (!good)
        wall_close(wall);
    return good;
}

void wall_close(Wall *wall)
{
    mesh_tree_free(wall->tree);
    free(wall->mesh.vertex);
    free(wall->mesh.triangle);
    free(wall->opening);
    *wall = (Wall){0};
}

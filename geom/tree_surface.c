// Edges are sorted by counting on their lower vertex; parts are found by union-find over the ends of edges. The inlet is cut by clipping each triangle at the
// root's plane; vertices closer to it than a twentieth of an edge are moved onto it first, so that no slivers remain.
#include "geom/tree_surface.h"

#include "base/base.h"
#include "geom/blobby.h"

#include <stdlib.h>
#include <string.h>

// --- Parts ---

// part[v]: the lowest vertex of v's connected part. Returns NULL if out of memory.
static int *find_parts(const TriangleMesh *mesh)
{
    int *part = malloc(((size_t)mesh->vertex_count + 1) * sizeof *part);
    if (!part)
        return NULL;
    for (int v = 0; v < mesh->vertex_count; v++)
        part[v] = v;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 1; k < 3; k++)
            disjoint_join(part, mesh->triangle[t][0], mesh->triangle[t][k]);
    for (int v = 0; v < mesh->vertex_count; v++)
        part[v] = disjoint_root(part, v);
    return part;
}

static double cone_volume(const TriangleMesh *mesh, int t, Vec3 apex)
{
    const int *corner = mesh->triangle[t];
    Vec3 a = vec3_sub(mesh->vertex[corner[0]], apex), b = vec3_sub(mesh->vertex[corner[1]], apex), c = vec3_sub(mesh->vertex[corner[2]], apex);
    return vec3_dot(a, vec3_cross(b, c)) / 6;
}

static double triangle_area(const TriangleMesh *mesh, int t)
{
    const int *c = mesh->triangle[t];
    return 0.5 * vec3_norm(vec3_cross(vec3_sub(mesh->vertex[c[1]], mesh->vertex[c[0]]), vec3_sub(mesh->vertex[c[2]], mesh->vertex[c[0]])));
}

// --- Census ---

typedef struct HalfEdge {
    int to;                  // the vertex with the higher index
    bool upwards;            // runs from the lower to the higher index
} HalfEdge;

static int compare_half_edges(const void *x, const void *y)
{
    const HalfEdge *a = x, *b = y;
    return (a->to > b->to) - (a->to < b->to);
}

static void sort_half_edges(HalfEdge *edge, int count)
{
    if (count > 32) {
        qsort(edge, (size_t)count, sizeof *edge, compare_half_edges);
        return;
    }
    for (int i = 1; i < count; i++) {
        HalfEdge e = edge[i];
        int k = i;
        for (; k > 0 && edge[k - 1].to > e.to; k--)
            edge[k] = edge[k - 1];
        edge[k] = e;
    }
}

// The half edges of each vertex v, at [first[v], first[v + 1]), sorted; the caller frees them and `first`. Returns NULL if out of memory.
static HalfEdge *half_edges(const TriangleMesh *mesh, size_t **first)
{
    size_t vertices = (size_t)mesh->vertex_count, sides = 3 * (size_t)mesh->triangle_count, *at = calloc(vertices + 2, sizeof *at);
    HalfEdge *edge = malloc((sides + 1) * sizeof *edge);
    if (!at || !edge) {
        free(at);
        free(edge);
        return NULL;
    }
    for (size_t i = 0; i < sides; i++) {
        int a = mesh->triangle[i / 3][i % 3], b = mesh->triangle[i / 3][(i + 1) % 3];
        at[(a < b ? a : b) + 2]++;
    }
    for (size_t v = 2; v < vertices + 2; v++)
        at[v] += at[v - 1];
    for (size_t i = 0; i < sides; i++) {
        int a = mesh->triangle[i / 3][i % 3], b = mesh->triangle[i / 3][(i + 1) % 3], low = a < b ? a : b;
        edge[at[low + 1]++] = (HalfEdge){a < b ? b : a, a < b};
    }
    for (size_t v = 0; v < vertices; v++)
        sort_half_edges(edge + at[v], (int)(at[v + 1] - at[v]));
    *first = at;
    return edge;
}

static void count_edges(const HalfEdge *edge, int count, SurfaceCensus *census, int lower, const TriangleMesh *mesh, Vec3 *rim)
{
    for (int i = 0, n; i < count; i += n) {
        int up = 0;
        for (n = 0; i + n < count && edge[i + n].to == edge[i].to; n++)
            up += edge[i + n].upwards;
        census->edges++;
        census->open_edges += n == 1;
        census->non_manifold_edges += n > 2;
        census->turned_edges += n == 2 && up != 1;
        if (n == 1)
            *rim = vec3_add(*rim, vec3_scale(vec3_add(mesh->vertex[lower], mesh->vertex[edge[i].to]), 0.5));
    }
}

bool surface_census(const TriangleMesh *mesh, SurfaceCensus *census)
{
    *census = (SurfaceCensus){.triangles = mesh->triangle_count};
    size_t vertices = (size_t)mesh->vertex_count, sides = 3 * (size_t)mesh->triangle_count, *first = NULL;
    int *part = find_parts(mesh);
    HalfEdge *edge = half_edges(mesh, &first);
    bool good = part && edge;
    Vec3 rim = {0, 0, 0};
    for (size_t v = 0; good && v < vertices; v++)
        count_edges(edge + first[v], (int)(first[v + 1] - first[v]), census, (int)v, mesh, &rim);
    if (good) {
        // mark the vertices in use in `first`, which is no longer needed
        memset(first, 0, (vertices + 2) * sizeof *first);
        for (size_t i = 0; i < sides; i++)
            first[mesh->triangle[i / 3][i % 3]] = 1;
        for (size_t v = 0; v < vertices; v++) {
            census->vertices += first[v] != 0;
            census->parts += first[v] != 0 && part[v] == (int)v;
        }
        census->euler = census->vertices - census->edges + census->triangles;
        Vec3 apex = census->open_edges > 0 ? vec3_scale(rim, 1 / (double)census->open_edges) : vertices > 0 ? mesh->vertex[0] : rim;
        for (int t = 0; t < mesh->triangle_count; t++) {
            census->area += triangle_area(mesh, t);
            census->volume += cone_volume(mesh, t, apex);
        }
    }
    free(part);
    free(first);
    free(edge);
    return good;
}

// --- Dropping ---

// has_rim[p]: part p has an edge with a single triangle. Returns false if out of memory.
static bool find_rims(const TriangleMesh *mesh, const int *part, bool *has_rim)
{
    size_t *first = NULL;
    HalfEdge *edge = half_edges(mesh, &first);
    for (int v = 0; edge && v < mesh->vertex_count; v++)
        for (size_t i = first[v]; i < first[v + 1]; i++)
            has_rim[part[v]] |= (i == first[v] || edge[i - 1].to != edge[i].to) && (i + 1 == first[v + 1] || edge[i + 1].to != edge[i].to);
    bool good = edge != NULL;
    free(first);
    free(edge);
    return good;
}

// A part with a rim encloses nothing, and the cones over it add up to an arbitrary value: its volume is that of the ball with the same area.
int surface_drop_specks(TriangleMesh *mesh, double least_volume)
{
    int *part = find_parts(mesh), dropped = 0, largest = 0;
    double *volume = calloc((size_t)mesh->vertex_count + 1, sizeof *volume);
    bool *keep = malloc((size_t)mesh->triangle_count + 1), *has_rim = calloc((size_t)mesh->vertex_count + 1, sizeof *has_rim);
    bool good = part && volume && keep && has_rim && find_rims(mesh, part, has_rim);
    for (int t = 0; good && t < mesh->triangle_count; t++) {
        int of = part[mesh->triangle[t][0]];
        volume[of] += has_rim[of] ? triangle_area(mesh, t) : cone_volume(mesh, t, mesh->vertex[of]);
    }
    for (int v = 0; good && v < mesh->vertex_count; v++)
        volume[v] = has_rim[v] ? volume[v] * sqrt(volume[v] / PI) / 6 : volume[v];
    for (int v = 0; good && v < mesh->vertex_count; v++)
        largest = volume[v] > volume[largest] ? v : largest;
    for (int t = 0; good && t < mesh->triangle_count; t++) {
        int of = part[mesh->triangle[t][0]];
        keep[t] = of == largest || volume[of] >= least_volume;
        if (!keep[t] && !isnan(volume[of])) {
            dropped++;
            volume[of] = NAN;   // marks the part as counted
        }
    }
    good = good && (dropped == 0 || triangle_mesh_keep(mesh, keep));
    free(part);
    free(volume);
    free(keep);
    free(has_rim);
    return good ? dropped : -1;
}

// --- The inlet ---

typedef struct Inlet {
    const VesselTree *tree;
    Vec3 center, direction;
    double *height;          // (V) height above the plane; 0: on it
    bool *is_cut;            // (V) will be removed
    int split_count, split_capacity;
    struct Split {
        int a, b, vertex;    // a < b: ends of the edge, and the new vertex on it
    } * split;
    int vertex_capacity, triangle_count, triangle_capacity;
    int (*triangle)[3];
} Inlet;

// Moves p onto the node's model within the plane; returns p unchanged if that is further than `most`.
static Vec3 settle_in_plane(const Inlet *inlet, int node, Vec3 p, double most)
{
    Blobby model = blobby_of(inlet->tree, node);
    Vec3 x = p, d = inlet->direction, g;
    for (int i = 0; i < 20; i++) {
        double f = blobby_gradient(&model, x, &g);
        g = vec3_add_scaled(g, -vec3_dot(g, d), d);
        double g2 = vec3_norm2(g);
        if (!(g2 > 1e-200))
            return p;
        Vec3 step = vec3_scale(g, -f / g2);
        x = vec3_add(x, step);
        if (!(vec3_distance(x, p) < most))
            return p;
        if (vec3_norm(step) < 1e-12)
            return x;
    }
    return p;
}

static Vec3 normal_at(const Inlet *inlet, int node, Vec3 x)
{
    Blobby model = blobby_of(inlet->tree, node);
    Vec3 g;
    blobby_gradient(&model, x, &g);
    return vec3_unit(vec3_negate(g));
}

static double mean_edge(const TriangleMesh *mesh)
{
    double sum = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        sum += vec3_distance(mesh->vertex[mesh->triangle[t][0]], mesh->vertex[mesh->triangle[t][1]]);
    return sum / mesh->triangle_count;
}

// Marks the vertices that are connected upstream of the plane with the wall around the root. Returns false if they extend too far.
static bool mark_cut(const TriangleMesh *mesh, Inlet *inlet, double eps)
{
    const VesselTree *tree = inlet->tree;
    double r = tree->radius[0];
    for (int v = 0; v < mesh->vertex_count; v++) {
        Vec3 away = vec3_sub(mesh->vertex[v], inlet->center);
        double z = vec3_dot(away, inlet->direction);
        inlet->height[v] = fabs(z) <= eps ? 0 : z;
        inlet->is_cut[v] = z < -eps && z > -1.5 * r && vec3_norm2(away) - z * z < 2.25 * r * r;
    }
    for (bool grown = true; grown;) {
        grown = false;
        for (int t = 0; t < mesh->triangle_count; t++) {
            const int *c = mesh->triangle[t];
            if (!inlet->is_cut[c[0]] && !inlet->is_cut[c[1]] && !inlet->is_cut[c[2]])
                continue;
            for (int k = 0; k < 3; k++)
                if (!inlet->is_cut[c[k]] && inlet->height[c[k]] < 0) {
                    inlet->is_cut[c[k]] = grown = true;
                    if (vec3_distance(mesh->vertex[c[k]], inlet->center) > 4 * r)
                        return false;
                }
        }
    }
    return true;
}

// Returns the new vertex where the edge crosses the plane; -1 if out of memory.
static int split_edge(TriangleMesh *mesh, Inlet *inlet, int a, int b)
{
    int low = a < b ? a : b, high = a < b ? b : a;
    for (int i = inlet->split_count - 1; i >= 0; i--)
        if (inlet->split[i].a == low && inlet->split[i].b == high)
            return inlet->split[i].vertex;
    if (inlet->split_count == inlet->split_capacity) {
        int bigger = inlet->split_capacity ? 2 * inlet->split_capacity : 256;
        struct Split *split = realloc(inlet->split, (size_t)bigger * sizeof *split);
        if (!split)
            return -1;
        inlet->split = split;
        inlet->split_capacity = bigger;
    }
    if (mesh->vertex_count == inlet->vertex_capacity) {
        size_t bigger = (size_t)inlet->vertex_capacity + 4096;
        Vec3 *vertex = realloc(mesh->vertex, bigger * sizeof *vertex);
        mesh->vertex = vertex ? vertex : mesh->vertex;
        Vec3 *normal = realloc(mesh->normal, bigger * sizeof *normal);
        mesh->normal = normal ? normal : mesh->normal;
        int *node = realloc(mesh->node, bigger * sizeof *node);
        mesh->node = node ? node : mesh->node;
        if (!vertex || !normal || !node)
            return -1;
        inlet->vertex_capacity = (int)bigger;
    }
    double t = inlet->height[low] / (inlet->height[low] - inlet->height[high]);
    Vec3 p = vec3_mix(mesh->vertex[low], mesh->vertex[high], t);
    int node = mesh->node[inlet->height[low] > 0 ? low : high], made = mesh->vertex_count++;
    mesh->vertex[made] = settle_in_plane(inlet, node, p, vec3_distance(mesh->vertex[low], mesh->vertex[high]));
    mesh->normal[made] = normal_at(inlet, node, mesh->vertex[made]);
    mesh->node[made] = node;
    inlet->split[inlet->split_count++] = (struct Split){low, high, made};
    return made;
}

// Keeps the part of a triangle downstream of the plane, as up to two triangles. Returns false if out of memory.
static bool clip_triangle(TriangleMesh *mesh, Inlet *inlet, const int corner[3])
{
    int polygon[4], n = 0;
    for (int k = 0; k < 3; k++) {
        int a = corner[k], b = corner[(k + 1) % 3];
        if (!inlet->is_cut[a])
            polygon[n++] = a;
        if (inlet->is_cut[a] == inlet->is_cut[b] || inlet->height[a] == 0 || inlet->height[b] == 0)
            continue;
        polygon[n] = split_edge(mesh, inlet, a, b);
        if (polygon[n++] < 0)
            return false;
    }
    for (int k = 2; k < n; k++) {
        inlet->triangle[inlet->triangle_count][0] = polygon[0];
        inlet->triangle[inlet->triangle_count][1] = polygon[k - 1];
        inlet->triangle[inlet->triangle_count++][2] = polygon[k];
    }
    return true;
}

static bool cut_inlet(TriangleMesh *mesh, Inlet *inlet)
{
    double edge = mean_edge(mesh), eps = 0.05 * edge;
    if (!mark_cut(mesh, inlet, eps))
        return false;
    int cut = 0, before = mesh->triangle_count;
    for (int t = 0; t < before; t++) {
        const int *c = mesh->triangle[t];
        bool any = inlet->is_cut[c[0]] || inlet->is_cut[c[1]] || inlet->is_cut[c[2]];
        cut += any;
        for (int k = 0; any && k < 3; k++)
            if (inlet->height[c[k]] == 0 && !inlet->is_cut[c[k]]) {
                Vec3 *x = &mesh->vertex[c[k]];
                *x = vec3_add_scaled(*x, -vec3_dot(vec3_sub(*x, inlet->center), inlet->direction), inlet->direction);
                *x = settle_in_plane(inlet, mesh->node[c[k]], *x, edge);
                mesh->normal[c[k]] = normal_at(inlet, mesh->node[c[k]], *x);
            }
    }
    inlet->triangle = malloc(((size_t)before + (size_t)cut + 1) * sizeof *inlet->triangle);
    bool *keep = malloc((size_t)before + (size_t)cut + 1);
    bool good = cut > 0 && inlet->triangle && keep;
    for (int t = 0; good && t < before; t++)
        good = clip_triangle(mesh, inlet, mesh->triangle[t]);
    if (good) {
        // a remaining triangle with no corner above the plane lies in the plane: it belongs to the lid
        for (int t = 0; t < inlet->triangle_count; t++) {
            const int *c = inlet->triangle[t];
            keep[t] = false;
            for (int k = 0; k < 3; k++)
                keep[t] = keep[t] || vec3_dot(vec3_sub(mesh->vertex[c[k]], inlet->center), inlet->direction) > 1e-7 * edge;
        }
        free(mesh->triangle);
        mesh->triangle = inlet->triangle;
        mesh->triangle_count = inlet->triangle_count;
        inlet->triangle = NULL;
        good = triangle_mesh_keep(mesh, keep);
    }
    free(keep);
    return good;
}

static bool copy_mesh(const TriangleMesh *from, TriangleMesh *to)
{
    size_t v = (size_t)from->vertex_count, t = (size_t)from->triangle_count;
    *to = (TriangleMesh){from->vertex_count,
                         from->triangle_count,
                         malloc(v * sizeof *to->vertex),
                         malloc(v * sizeof *to->normal),
                         malloc(v * sizeof *to->node),
                         malloc(t * sizeof *to->triangle)};
    if (!to->vertex || !to->normal || !to->node || !to->triangle)
        return false;
    memcpy(to->vertex, from->vertex, v * sizeof *to->vertex);
    memcpy(to->normal, from->normal, v * sizeof *to->normal);
    memcpy(to->node, from->node, v * sizeof *to->node);
    memcpy(to->triangle, from->triangle, t * sizeof *to->triangle);
    return true;
}

bool surface_open_inlet(TriangleMesh *mesh, const VesselTree *tree)
{
    if (mesh->triangle_count < 1 || !vessel_tree_root_is_open(tree))
        return false;
    TriangleMesh work;
    Inlet inlet = {.tree = tree, .center = tree->center[0], .direction = tree->direction[0], .vertex_capacity = mesh->vertex_count};
    inlet.height = malloc((size_t)mesh->vertex_count * sizeof *inlet.height);
    inlet.is_cut = malloc((size_t)mesh->vertex_count);
    bool good = copy_mesh(mesh, &work);
    good = good && inlet.height && inlet.is_cut && cut_inlet(&work, &inlet);
    if (good) {
        TriangleMesh old = *mesh;
        *mesh = work;
        work = old;
    }
    free(work.vertex);
    free(work.normal);
    free(work.node);
    free(work.triangle);
    free(inlet.height);
    free(inlet.is_cut);
    free(inlet.split);
    free(inlet.triangle);
    return good;
}

// --- Errors ---

enum { NODES_MAX = 64 };

// The nodes whose points are compared with a vertex of `node`: those up to two links away, and further as long as they have no points.
static int nodes_around(const VesselTree *tree, int node, int around[NODES_MAX])
{
    int count = 1, ring = 0;
    int64_t points = tree->point_offset[node + 1] - tree->point_offset[node];
    around[0] = node;
    for (int link = 0; (link < 2 || points == 0) && count < NODES_MAX && ring < count; link++) {
        int end = count;
        for (; ring < end; ring++)
            for (int k = tree->neighbour_offset[around[ring]]; k < tree->neighbour_offset[around[ring] + 1] && count < NODES_MAX; k++) {
                int next = tree->neighbour[k];
                bool known = false;
                for (int i = 0; i < count; i++)
                    known = known || around[i] == next;
                if (known)
                    continue;
                around[count++] = next;
                points += tree->point_offset[next + 1] - tree->point_offset[next];
            }
    }
    return count;
}

static int64_t nearest_point(const VesselTree *tree, const int *around, int count, Vec3 x)
{
    int64_t nearest = -1;
    double least = HUGE_VAL;
    for (int i = 0; i < count; i++)
        for (int64_t k = tree->point_offset[around[i]]; k < tree->point_offset[around[i] + 1]; k++) {
            double d = vec3_norm2(vec3_sub(tree->point[k], x));
            if (d < least) {
                least = d;
                nearest = k;
            }
        }
    return nearest;
}

bool surface_point_error(const TriangleMesh *mesh, const ModelField *model, double *error, double *distance)
{
    const VesselTree *tree = model->tree;
    int around[NODES_MAX], count = 0, of = -1;
    if (tree->point_count < 1)
        return false;
    for (int v = 0; v < mesh->vertex_count; v++) {
        if (mesh->node[v] != of) {
            of = mesh->node[v];
            count = nodes_around(tree, of, around);
        }
        Vec3 x = mesh->vertex[v];
        int64_t nearest = nearest_point(tree, around, count, x);
        if (distance)
            distance[v] = nearest < 0 ? NAN : vec3_distance(x, tree->point[nearest]);
        if (error)
            error[v] = nearest < 0 ? NAN : model_field_project(model, of, tree->point[nearest], x).distance;
    }
    return true;
}

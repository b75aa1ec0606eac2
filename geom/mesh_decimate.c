// Edges are collapsed in rounds. In each round the cost of every edge is computed, and the cheap edges are collapsed in order of cost, except those with an end
// that has already been part of a collapse in this round: so no heap is needed, and the lists of triangles around a vertex stay valid where they are still
// read. The cost is the mean squared distance of the new vertex from the planes of the triangles merged into both ends, weighted by their areas w: Q(x) = (x' A
// x + 2 b' x + c) / w. It is a displacement in mm2, so that a thin branch, which is more curved, keeps shorter edges than a wide one.
#include "geom/mesh_decimate.h"

#include <stdlib.h>
#include <string.h>

typedef struct Quadric {
    Sym3 a;
    Vec3 b;
    double c, weight;
} Quadric;

typedef struct Collapse {
    float price;             // cost [mm2] >= 0
    int kept, gone;          // vertices
} Collapse;

typedef struct Decimation {
    int vertex_count, triangle_count;
    Vec3 *vertex;            // relative to the mesh's first vertex
    Quadric *quadric;
    int *node, *into;        // into[v]: the vertex into which v was merged
    int (*triangle)[3];
    int *first, *around;     // triangles around v: around[first[v]] to around[first[v + 1] - 1]
    bool *is_fixed;          // rims and non-manifold vertices
    bool *is_touched;        // was part of a collapse in this round
    Collapse *collapse, *sorted;
    int *mark;               // marks of vertices, to find common neighbours
    int stamp;
} Decimation;

static Vec3 triangle_area_vector(Vec3 a, Vec3 b, Vec3 c) { return vec3_scale(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)), 0.5); }

static void quadric_add(Quadric *to, const Quadric *q)
{
    to->a.xx += q->a.xx, to->a.xy += q->a.xy, to->a.xz += q->a.xz, to->a.yy += q->a.yy, to->a.yz += q->a.yz, to->a.zz += q->a.zz;
    to->b = vec3_add(to->b, q->b);
    to->c += q->c;
    to->weight += q->weight;
}

static double quadric_price(const Quadric *q, Vec3 x)
{
    double value = sym3_quadratic(&q->a, x) + 2 * vec3_dot(q->b, x) + q->c;
    return q->weight > 0 ? fmax(value, 0) / q->weight : 0;
}

// Minimises Q(x) + e w |x - middle|^2; the small second term makes the minimum unique on a plane or along a ridge.
static Vec3 quadric_least(const Quadric *q, Vec3 middle)
{
    double e = 1e-3 * q->weight;
    Sym3 m = q->a;
    m.xx += e, m.yy += e, m.zz += e;
    Vec3 r = vec3_add_scaled(vec3_negate(q->b), e, middle);
    Vec3 row[3] = {{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}};
    double det = vec3_dot(row[0], vec3_cross(row[1], row[2]));
    if (!(det > 0))
        return middle;
    Vec3 x = vec3_scale(vec3_cross(row[1], row[2]), r.x);
    x = vec3_add_scaled(x, r.y, vec3_cross(row[2], row[0]));
    x = vec3_add_scaled(x, r.z, vec3_cross(row[0], row[1]));
    return vec3_scale(x, 1 / det);
}

static void gather_quadrics(Decimation *d)
{
    for (int t = 0; t < d->triangle_count; t++) {
        const int *c = d->triangle[t];
        Vec3 n = triangle_area_vector(d->vertex[c[0]], d->vertex[c[1]], d->vertex[c[2]]);
        double area = vec3_norm(n), offset;
        n = vec3_unit(n);
        offset = -vec3_dot(n, d->vertex[c[0]]);
        Quadric q = {.b = vec3_scale(n, area * offset), .c = area * offset * offset, .weight = area};
        sym3_add_outer(&q.a, area, n);
        for (int k = 0; k < 3; k++)
            quadric_add(&d->quadric[c[k]], &q);
    }
}

// --- surroundings ---

static void list_surroundings(Decimation *d)
{
    size_t vertices = (size_t)d->vertex_count;
    memset(d->first, 0, (vertices + 2) * sizeof *d->first);
    for (int t = 0; t < d->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            d->first[d->triangle[t][k] + 2]++;
    for (size_t v = 2; v < vertices + 2; v++)
        d->first[v] += d->first[v - 1];
    for (int t = 0; t < d->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            d->around[d->first[d->triangle[t][k] + 1]++] = t;
}

// A vertex is free if each of its neighbours shares exactly two triangles with it.
static void find_fixed(Decimation *d)
{
    int *seen = d->mark;
    memset(seen, 0, (size_t)d->vertex_count * sizeof *seen);
    for (int v = 0; v < d->vertex_count; v++) {
        for (int pass = 0; pass < 2; pass++)
            for (int i = d->first[v]; i < d->first[v + 1]; i++)
                for (int k = 0; k < 3; k++) {
                    int other = d->triangle[d->around[i]][k];
                    if (pass == 0)
                        seen[other]++;
                    else if (other != v)
                        d->is_fixed[v] |= seen[other] != 2;
                }
        for (int i = d->first[v]; i < d->first[v + 1]; i++)
            for (int k = 0; k < 3; k++)
                seen[d->triangle[d->around[i]][k]] = 0;
    }
    d->stamp = 0;
}

// The present corners of a triangle during a round; false if it has become degenerate.
static bool corners_now(const Decimation *d, int t, int c[3])
{
    for (int k = 0; k < 3; k++)
        c[k] = d->into[d->triangle[t][k]];
    return c[0] != c[1] && c[1] != c[2] && c[2] != c[0];
}

// Number of present triangles around a vertex that has not been part of a collapse in this round; degenerate ones no longer count.
static int count_around(const Decimation *d, int v)
{
    int count = 0, c[3];
    for (int i = d->first[v]; i < d->first[v + 1]; i++)
        count += corners_now(d, d->around[i], c);
    return count;
}

// The link condition: the two ends share exactly the two corners opposite to the edge, and no corner is left with fewer than three triangles.
static bool keeps_topology(Decimation *d, int a, int b)
{
    int stamp = ++d->stamp, common = 0, c[3];
    if (count_around(d, a) + count_around(d, b) - 4 < 3)
        return false;
    for (int i = d->first[a]; i < d->first[a + 1]; i++)
        for (int k = 0; corners_now(d, d->around[i], c) && k < 3; k++)
            d->mark[c[k]] = stamp;
    d->mark[a] = d->mark[b] = 0;
    for (int i = d->first[b]; i < d->first[b + 1]; i++)
        for (int k = 0; corners_now(d, d->around[i], c) && k < 3; k++) {
            if (d->mark[c[k]] != stamp)
                continue;
            d->mark[c[k]] = 0;
            common++;
            if (count_around(d, c[k]) <= 3)
                return false;
        }
    return common == 2;
}

// Squared ratio of the area to the square of the longest side, at most 0.43^2; also sets the area vector.
static double triangle_fullness2(const Vec3 p[3], Vec3 *area)
{
    double longest = 0;
    for (int k = 0; k < 3; k++)
        longest = fmax(longest, vec3_norm2(vec3_sub(p[k], p[(k + 1) % 3])));
    *area = triangle_area_vector(p[0], p[1], p[2]);
    return longest > 0 ? vec3_norm2(*area) / (longest * longest) : 0;
}

// Triangles around v that remain must not rotate by more than about 75 degrees, nor become needles. A triangle that is a needle already (marching cubes produce
// many) has no meaningful direction and only must not become much thinner.
static bool keeps_facing(const Decimation *d, int v, int other, Vec3 place)
{
    const double needle = 0.03;
    for (int i = d->first[v]; i < d->first[v + 1]; i++) {
        int c[3];
        if (!corners_now(d, d->around[i], c) || c[0] == other || c[1] == other || c[2] == other)
            continue;
        Vec3 p[3], q[3], before, after;
        for (int k = 0; k < 3; k++) {
            p[k] = d->vertex[c[k]];
            q[k] = c[k] == v ? place : p[k];
        }
        double full_before = triangle_fullness2(p, &before), full_after = triangle_fullness2(q, &after), along = vec3_dot(before, after);
        if (full_after < needle * needle && full_after < 0.25 * full_before)
            return false;
        if (full_before > needle * needle && !(along > 0 && along * along > 0.0625 * vec3_norm2(before) * vec3_norm2(after)))
            return false;
    }
    return true;
}

// --- rounds ---

static uint32_t price_bits(float price)
{
    uint32_t bits;
    memcpy(&bits, &price, sizeof bits);
    return bits;
}

// Radix sort by cost, eleven bits at a time; non-negative floats have the order of their bits. Equal costs stay in the order of the triangles.
static void sort_collapses(Decimation *d, int count)
{
    for (int shift = 0; shift < 33; shift += 11) {
        int start[2049] = {0};
        for (int i = 0; i < count; i++)
            start[(price_bits(d->collapse[i].price) >> shift & 2047) + 1]++;
        for (int k = 0; k < 2048; k++)
            start[k + 1] += start[k];
        for (int i = 0; i < count; i++)
            d->sorted[start[price_bits(d->collapse[i].price) >> shift & 2047]++] = d->collapse[i];
        Collapse *swapped = d->collapse;
        d->collapse = d->sorted;
        d->sorted = swapped;
    }
}

static Quadric edge_quadric(const Decimation *d, int a, int b)
{
    Quadric q = d->quadric[a];
    quadric_add(&q, &d->quadric[b]);
    return q;
}

static Vec3 edge_place(const Decimation *d, const Quadric *q, int a, int b) { return quadric_least(q, vec3_mix(d->vertex[a], d->vertex[b], 0.5)); }

static int price_edges(Decimation *d)
{
    int count = 0;
    for (int t = 0; t < d->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int a = d->triangle[t][k], b = d->triangle[t][(k + 1) % 3];
            // each edge between free vertices occurs in two triangles, once in ascending order
            if (a > b || d->is_fixed[a] || d->is_fixed[b])
                continue;
            Quadric q = edge_quadric(d, a, b);
            d->collapse[count++] = (Collapse){(float)quadric_price(&q, edge_place(d, &q, a, b)), a, b};
        }
    sort_collapses(d, count);
    return count;
}

static void do_collapse(Decimation *d, const Collapse *c, Vec3 place)
{
    d->is_touched[c->kept] = d->is_touched[c->gone] = true;
    if (vec3_distance(place, d->vertex[c->gone]) < vec3_distance(place, d->vertex[c->kept]))
        d->node[c->kept] = d->node[c->gone];
    d->vertex[c->kept] = place;
    quadric_add(&d->quadric[c->kept], &d->quadric[c->gone]);
    d->into[c->gone] = c->kept;
}

static void drop_flat_triangles(Decimation *d)
{
    int kept = 0;
    for (int t = 0; t < d->triangle_count; t++) {
        int c[3];
        if (corners_now(d, t, c))
            memcpy(d->triangle[kept++], c, sizeof c);
    }
    d->triangle_count = kept;
}

// Returns the number of collapses. An edge much more expensive than the one at which the target would be reached waits for a later round.
static int do_round(Decimation *d, int triangles, double furthest)
{
    list_surroundings(d);
    memset(d->mark, 0, (size_t)d->vertex_count * sizeof *d->mark);
    memset(d->is_touched, 0, (size_t)d->vertex_count * sizeof *d->is_touched);
    d->stamp = 0;
    int edges = price_edges(d), done = 0, wanted = (d->triangle_count - triangles + 1) / 2;
    double goal = edges > 0 ? d->collapse[wanted < edges ? wanted : edges - 1].price : 0;
    for (int i = 0; i < edges && done < wanted; i++) {
        const Collapse *c = &d->collapse[i];
        if (c->price > 1.5 * goal || c->price > furthest * furthest)
            break;
        if (d->is_touched[c->kept] || d->is_touched[c->gone] || !keeps_topology(d, c->kept, c->gone))
            continue;
        Quadric q = edge_quadric(d, c->kept, c->gone);
        Vec3 place = edge_place(d, &q, c->kept, c->gone);
        if (!keeps_facing(d, c->kept, c->gone, place) || !keeps_facing(d, c->gone, c->kept, place))
            continue;
        do_collapse(d, c, place);
        done++;
    }
    drop_flat_triangles(d);
    return done;
}

// --- in and out ---

static bool open_decimation(Decimation *d, const TriangleMesh *mesh)
{
    size_t vertices = (size_t)mesh->vertex_count, triangles = (size_t)mesh->triangle_count;
    *d = (Decimation){.vertex_count = mesh->vertex_count,
                      .triangle_count = mesh->triangle_count,
                      .vertex = malloc((vertices + 1) * sizeof *d->vertex),
                      .quadric = calloc(vertices + 1, sizeof *d->quadric),
                      .node = malloc((vertices + 1) * sizeof(int)),
                      .into = malloc((vertices + 1) * sizeof(int)),
                      .triangle = malloc((triangles + 1) * sizeof *d->triangle),
                      .first = malloc((vertices + 2) * sizeof(int)),
                      .around = malloc((3 * triangles + 1) * sizeof(int)),
                      .is_fixed = calloc(vertices + 1, 1),
                      .is_touched = malloc(vertices + 1),
                      .collapse = malloc((3 * triangles + 1) * sizeof *d->collapse),
                      .sorted = malloc((3 * triangles + 1) * sizeof *d->sorted),
                      .mark = malloc((vertices + 1) * sizeof(int))};
    if (!d->vertex || !d->quadric || !d->node || !d->into || !d->triangle || !d->first || !d->around || !d->is_fixed || !d->is_touched || !d->collapse ||
        !d->sorted || !d->mark)
        return false;
    for (int v = 0; v < mesh->vertex_count; v++) {
        d->vertex[v] = vec3_sub(mesh->vertex[v], mesh->vertex[0]);
        d->node[v] = mesh->node ? mesh->node[v] : 0;
        d->into[v] = v;
    }
    memcpy(d->triangle, mesh->triangle, triangles * sizeof *d->triangle);
    return true;
}

static void close_decimation(Decimation *d)
{
    free(d->vertex), free(d->quadric), free(d->node), free(d->into), free(d->triangle), free(d->first), free(d->around);
    free(d->is_fixed), free(d->is_touched), free(d->collapse), free(d->sorted), free(d->mark);
}

static TriangleMesh *make_result(Decimation *d, Vec3 origin)
{
    int vertices = 0;
    memset(d->mark, 0xff, (size_t)d->vertex_count * sizeof *d->mark);
    for (int t = 0; t < d->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            d->mark[d->triangle[t][k]] = 0;
    for (int v = 0; v < d->vertex_count; v++)
        d->mark[v] = d->mark[v] == 0 ? vertices++ : -1;
    TriangleMesh *mesh = calloc(1, sizeof *mesh);
    if (!mesh)
        return NULL;
    *mesh = (TriangleMesh){.vertex_count = vertices,
                           .triangle_count = d->triangle_count,
                           .vertex = malloc(((size_t)vertices + 1) * sizeof *mesh->vertex),
                           .normal = calloc((size_t)vertices + 1, sizeof *mesh->normal),
                           .node = malloc(((size_t)vertices + 1) * sizeof *mesh->node),
                           .triangle = malloc(((size_t)d->triangle_count + 1) * sizeof *mesh->triangle)};
    if (!mesh->vertex || !mesh->normal || !mesh->node || !mesh->triangle) {
        triangle_mesh_free(mesh);
        return NULL;
    }
    for (int v = 0; v < d->vertex_count; v++)
        if (d->mark[v] >= 0) {
            mesh->vertex[d->mark[v]] = vec3_add(d->vertex[v], origin);
            mesh->node[d->mark[v]] = d->node[v];
        }
    for (int t = 0; t < d->triangle_count; t++) {
        const int *c = d->triangle[t];
        Vec3 n = triangle_area_vector(d->vertex[c[0]], d->vertex[c[1]], d->vertex[c[2]]);
        for (int k = 0; k < 3; k++) {
            mesh->triangle[t][k] = d->mark[c[k]];
            mesh->normal[d->mark[c[k]]] = vec3_add(mesh->normal[d->mark[c[k]]], n);
        }
    }
    for (int v = 0; v < vertices; v++)
        mesh->normal[v] = vec3_unit(mesh->normal[v]);
    return mesh;
}

TriangleMesh *mesh_decimate(const TriangleMesh *mesh, int triangles, double furthest_mm)
{
    Decimation d;
    TriangleMesh *result = NULL;
    if (open_decimation(&d, mesh)) {
        gather_quadrics(&d);
        list_surroundings(&d);
        find_fixed(&d);
        // the last rounds remove little: if fewer than one triangle in a thousand goes, the shape does not allow more
        for (int done = d.triangle_count; d.triangle_count > triangles && done > d.triangle_count / 2000;)
            done = do_round(&d, triangles, furthest_mm);
        result = make_result(&d, mesh->vertex_count > 0 ? mesh->vertex[0] : vec3(0, 0, 0));
    }
    close_decimation(&d);
    return result;
}

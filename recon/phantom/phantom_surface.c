// The true surface of a shape as triangles: marching tetrahedra. Every cell of the grid is cut into the six tetrahedra along its main diagonal
// (one per order of the axes), the same in every cell, so that faces match and the mesh is closed. Vertices lie on lattice edges of seven
// directions; a hash table keyed by (lattice point, direction) makes neighbouring cells share them. Only blocks that the surface can
// reach are looked at: |grad f| <= 1.
#include "recon/phantom/phantom.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCK = 8, SIDE = BLOCK + 1 };

typedef struct Mesher {
    const Shape *shape;
    TriangleMesh *mesh;
    int vertex_capacity, triangle_capacity;
    uint64_t *key;           // (slots) edge + 1, 0 where empty
    int *value;
    size_t slots, used;
    Vec3 origin;
    double cell;
    int64_t points[3];       // of the lattice along each axis
    double field[SIDE][SIDE][SIDE];
    int base[3];             // lattice index of the block's corner
    bool failed;
} Mesher;

static size_t slot_of(const Mesher *m, uint64_t key)
{
    uint64_t h = key * 0x9E3779B97F4A7C15u;
    size_t i = (size_t)(h >> 20) & (m->slots - 1);
    while (m->key[i] && m->key[i] != key)
        i = (i + 1) & (m->slots - 1);
    return i;
}

static bool grow_table(Mesher *m)
{
    size_t slots = m->slots ? 2 * m->slots : 1 << 14;
    uint64_t *old_key = m->key;
    int *old_value = m->value;
    size_t old_slots = m->slots;
    m->key = calloc(slots, sizeof *m->key);
    m->value = calloc(slots, sizeof *m->value);
    if (!m->key || !m->value) {
        free(m->key);
        free(m->value);
        m->key = old_key;
        m->value = old_value;
        return false;
    }
    m->slots = slots;
    for (size_t i = 0; i < old_slots; i++)
        if (old_key[i]) {
            size_t to = slot_of(m, old_key[i]);
            m->key[to] = old_key[i];
            m->value[to] = old_value[i];
        }
    free(old_key);
    free(old_value);
    return true;
}

static Vec3 lattice_point(const Mesher *m, const int64_t at[3])
{
    return vec3(m->origin.x + m->cell * (double)at[0], m->origin.y + m->cell * (double)at[1], m->origin.z + m->cell * (double)at[2]);
}

// Zero of the cut field between a (f > 0) and b (f <= 0).
static Vec3 crossing(const Mesher *m, Vec3 a, double fa, Vec3 b, double fb)
{
    double low = 0, high = 1, t = 0.5;
    for (int i = 0; i < 60 && high - low > 1e-14; i++) {   // false position, the kept end halved
        t = low + (high - low) * fa / (fa - fb);
        double f = shape_field_cut(m->shape, vec3_mix(a, b, t));
        if (fabs(f) < 1e-11)
            break;
        if (f > 0)
            low = t, fa = f, fb *= 0.5;
        else
            high = t, fb = f, fa *= 0.5;
    }
    return vec3_mix(a, b, t);
}

static int edge_vertex(Mesher *m, const int in[3], const int out[3])
{
    int64_t low[3], from[3], to[3];
    uint64_t direction = 0;
    for (int k = 0; k < 3; k++) {
        low[k] = m->base[k] + (in[k] < out[k] ? in[k] : out[k]);
        from[k] = m->base[k] + in[k];
        to[k] = m->base[k] + out[k];
        direction |= (uint64_t)(in[k] != out[k]) << k;
    }
    uint64_t key = (uint64_t)(low[0] + m->points[0] * (low[1] + m->points[1] * low[2])) * 8 + direction;
    if (2 * (m->used + 1) > m->slots && !grow_table(m)) {
        m->failed = true;
        return 0;
    }
    size_t slot = slot_of(m, key);
    if (m->key[slot])
        return m->value[slot];
    TriangleMesh *mesh = m->mesh;
    if (mesh->vertex_count == m->vertex_capacity) {
        int capacity = 2 * m->vertex_capacity + 4096;
        Vec3 *vertex = realloc(mesh->vertex, (size_t)capacity * sizeof *vertex);
        if (!vertex) {
            m->failed = true;
            return 0;
        }
        mesh->vertex = vertex;
        m->vertex_capacity = capacity;
    }
    m->key[slot] = key;
    m->value[slot] = mesh->vertex_count;
    m->used++;
    mesh->vertex[mesh->vertex_count] =
        crossing(m, lattice_point(m, from), m->field[in[2]][in[1]][in[0]], lattice_point(m, to), m->field[out[2]][out[1]][out[0]]);
    return mesh->vertex_count++;
}

static void add_triangle(Mesher *m, int a, int b, int c)
{
    TriangleMesh *mesh = m->mesh;
    if (mesh->triangle_count == m->triangle_capacity) {
        int capacity = 2 * m->triangle_capacity + 8192;
        int(*triangle)[3] = realloc(mesh->triangle, (size_t)capacity * sizeof *triangle);
        if (!triangle) {
            m->failed = true;
            return;
        }
        mesh->triangle = triangle;
        m->triangle_capacity = capacity;
    }
    int *t = mesh->triangle[mesh->triangle_count++];
    t[0] = a, t[1] = b, t[2] = c;
}

// One tetrahedron; `positive`: its corners are in right-handed order. Faces look out of the body (f > 0).
static void cut_tetrahedron(Mesher *m, const int corner[4][3], bool positive)
{
    int in[4], out[4], ins = 0, outs = 0;
    for (int i = 0; i < 4; i++) {
        if (m->field[corner[i][2]][corner[i][1]][corner[i][0]] > 0)
            in[ins++] = i;
        else
            out[outs++] = i;
    }
    if (ins == 0 || outs == 0 || m->failed)
        return;
    // parity of the order (in..., out...) tells which way round the cut runs
    int order[4], swaps = 0;
    memcpy(order, in, (size_t)ins * sizeof *in);
    memcpy(order + ins, out, (size_t)outs * sizeof *out);
    for (int i = 0; i < 4; i++)
        for (int j = i + 1; j < 4; j++)
            swaps += order[i] > order[j];
    bool turn = (swaps % 2 == 0) == positive;
#define EDGE(a, b) edge_vertex(m, corner[a], corner[b])
    if (ins == 1) {
        int a = EDGE(in[0], out[0]), b = EDGE(in[0], out[1]), c = EDGE(in[0], out[2]);
        turn ? add_triangle(m, a, b, c) : add_triangle(m, a, c, b);
    } else if (ins == 3) {
        int a = EDGE(in[0], out[0]), b = EDGE(in[1], out[0]), c = EDGE(in[2], out[0]);
        turn ? add_triangle(m, a, b, c) : add_triangle(m, a, c, b);
    } else {
        int a = EDGE(in[0], out[0]), b = EDGE(in[0], out[1]), c = EDGE(in[1], out[1]), d = EDGE(in[1], out[0]);
        if (turn) {
            add_triangle(m, a, b, c);
            add_triangle(m, a, c, d);
        } else {
            add_triangle(m, a, c, b);
            add_triangle(m, a, d, c);
        }
    }
#undef EDGE
}

static void mesh_block(Mesher *m)
{
    static const int axes[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};   // even orders first
    for (int k = 0; k < SIDE; k++)
        for (int j = 0; j < SIDE; j++)
            for (int i = 0; i < SIDE; i++)
                m->field[k][j][i] = shape_field_cut(m->shape, lattice_point(m, (int64_t[3]){m->base[0] + i, m->base[1] + j, m->base[2] + k}));
    for (int k = 0; k < BLOCK; k++)
        for (int j = 0; j < BLOCK; j++)
            for (int i = 0; i < BLOCK; i++)
                for (int t = 0; t < 6; t++) {
                    int corner[4][3] = {{i, j, k}};
                    for (int step = 0; step < 3; step++) {
                        memcpy(corner[step + 1], corner[step], sizeof corner[0]);
                        corner[step + 1][axes[t][step]]++;
                    }
                    cut_tetrahedron(m, (const int(*)[3])corner, t < 3);
                }
}

static bool finish_mesh(Mesher *m)
{
    TriangleMesh *mesh = m->mesh;
    size_t n = (size_t)mesh->vertex_count;
    mesh->normal = calloc(n + 1, sizeof *mesh->normal);
    mesh->node = calloc(n + 1, sizeof *mesh->node);
    if (!mesh->normal || !mesh->node)
        return false;
    for (int t = 0; t < mesh->triangle_count; t++) {   // by area: right on the flat ends too
        const int *v = mesh->triangle[t];
        Vec3 area = vec3_cross(vec3_sub(mesh->vertex[v[1]], mesh->vertex[v[0]]), vec3_sub(mesh->vertex[v[2]], mesh->vertex[v[0]]));
        for (int k = 0; k < 3; k++)
            mesh->normal[v[k]] = vec3_add(mesh->normal[v[k]], area);
    }
    for (size_t i = 0; i < n; i++)
        mesh->normal[i] = vec3_unit(mesh->normal[i]);
    return true;
}

TriangleMesh *shape_surface(const Shape *shape, double cell_mm, Faults *faults)
{
    Vec3 low, high;
    shape_bounds(shape, &low, &high);
    // an odd margin keeps lattice points off the planes of flat ends
    double margin = 1.377 * cell_mm;
    const double extent[3] = {high.x - low.x + 2 * margin, high.y - low.y + 2 * margin, high.z - low.z + 2 * margin};
    int blocks[3];
    double total = 1;
    Mesher m = {.shape = shape, .origin = vec3_sub(low, vec3(margin, margin, margin)), .cell = cell_mm};
    for (int k = 0; k < 3; k++) {
        double n = ceil(extent[k] / cell_mm / BLOCK);
        total *= n;
        blocks[k] = n < 1e5 ? (int)n : 0;
        m.points[k] = (int64_t)blocks[k] * BLOCK + 1;
    }
    m.mesh = total < 1e8 ? calloc(1, sizeof *m.mesh) : NULL;
    m.failed = !m.mesh;
    for (int k = 0; k < blocks[2] && !m.failed; k++)
        for (int j = 0; j < blocks[1] && !m.failed; j++)
            for (int i = 0; i < blocks[0] && !m.failed; i++) {
                double half = 0.5 * BLOCK * cell_mm;
                Vec3 middle = vec3_add(m.origin, vec3((2 * i + 1) * half, (2 * j + 1) * half, (2 * k + 1) * half));
                if (fabs(shape_field(shape, middle, NULL)) > 1.01 * sqrt(3) * half && fabs(shape_field_cut(shape, middle)) > 1.01 * sqrt(3) * half)
                    continue;
                m.base[0] = i * BLOCK, m.base[1] = j * BLOCK, m.base[2] = k * BLOCK;
                mesh_block(&m);
            }
    free(m.key);
    free(m.value);
    if (!m.failed && finish_mesh(&m))
        return m.mesh;
    triangle_mesh_free(m.mesh);
    faults_add(faults, "surface", 0, 0, "not enough memory for cells of %g mm; use larger ones", cell_mm);
    return NULL;
}

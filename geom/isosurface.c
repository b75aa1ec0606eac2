// Marching cubes over a sparse lattice (cube_triangles.h), vertices moved onto the surface by Newton steps along the gradient.
//
// The lattice point (i, j, k) lies at cell * (i, j, k), for every tree the same. Its value is the field of its power-nearest node among those whose model
// reaches it (Kerrien 2017, 5.3.3: each local surface cut to its power cell); -T where none does. Points belong to cubic blocks of 8 cells; a block is
// touched only where some model reaches it, and left again where bounds of the kernels say that it is all outside or all inside: work and memory
// grow with the surface.
#include "geom/isosurface.h"

#include "geom/blobby.h"
#include "geom/cube_triangles.h"
#include "geom/power_walk.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 8,                       // cells a side
    SIDE = BLOCK + 1,                // lattice points a side
    LATTICE_BITS = 20,
    LATTICE_MAX = (1 << (LATTICE_BITS - 1)) - 2 * BLOCK,
    BLOCKS_MAX = 20000000,
};

// --- A map from 64-bit keys to indices, open addressing ---

typedef struct KeyMap {
    size_t capacity, count;          // capacity: a power of two, at most half full
    uint64_t *key;
    int *value;                      // -1: free
} KeyMap;

static bool map_reserve(KeyMap *map, size_t capacity)
{
    KeyMap bigger = {capacity, map->count, malloc(capacity * sizeof *bigger.key), malloc(capacity * sizeof *bigger.value)};
    if (!bigger.key || !bigger.value) {
        free(bigger.key);
        free(bigger.value);
        return false;
    }
    memset(bigger.value, 0xff, capacity * sizeof *bigger.value);
    for (size_t i = 0; i < map->capacity; i++) {
        if (map->value[i] < 0)
            continue;
        size_t at = (map->key[i] * 0x9e3779b97f4a7c15u) >> 20 & (capacity - 1);
        while (bigger.value[at] >= 0)
            at = (at + 1) & (capacity - 1);
        bigger.key[at] = map->key[i];
        bigger.value[at] = map->value[i];
    }
    free(map->key);
    free(map->value);
    *map = bigger;
    return true;
}

// The place of a key's value; a new key gets `fresh` and *is_new. NULL: no memory.
static int *map_find_or_add(KeyMap *map, uint64_t key, int fresh, bool *is_new)
{
    if (2 * (map->count + 1) > map->capacity && !map_reserve(map, map->capacity ? 2 * map->capacity : 1024))
        return NULL;
    size_t at = (key * 0x9e3779b97f4a7c15u) >> 20 & (map->capacity - 1);
    while (map->value[at] >= 0 && map->key[at] != key)
        at = (at + 1) & (map->capacity - 1);
    *is_new = map->value[at] < 0;
    if (*is_new) {
        map->key[at] = key;
        map->value[at] = fresh;
        map->count++;
    }
    return &map->value[at];
}

static void map_free(KeyMap *map)
{
    free(map->key);
    free(map->value);
}

// --- The job ---

typedef struct NodeReach {
    int node;
    Blobby model;
    double reach;                    // [mm] no point of the model's surface lies further from the node's centre
} NodeReach;

typedef struct Block {
    int base[3];                     // lattice point of its lowest corner
    int first, latest;               // its candidates: first and last link
} Block;

typedef struct Link {                // candidates of a block while blocks are found
    int node, next;
} Link;

typedef struct Job {
    const VesselTree *tree;
    double cell;
    int node_count;
    NodeReach *node;
    KeyMap block_of, vertex_of;
    int block_count, block_capacity;
    Block *block;
    int link_count, link_capacity;
    Link *link;
    TriangleMesh *mesh;
    int vertex_capacity, triangle_capacity;
    CubeTable table;
    double value[SIDE * SIDE * SIDE];
    int owner[SIDE * SIDE * SIDE];   // index in `node`, -1: reached by none
} Job;

// Room for one more entry; false where memory ends or an index would not fit an int.
static bool grow(void **array, int count, int *capacity, size_t size)
{
    if (count < *capacity)
        return true;
    if (*capacity > INT_MAX / 2)
        return false;
    int bigger = *capacity ? 2 * *capacity : 1024;
    void *moved = realloc(*array, (size_t)bigger * size);
    if (!moved)
        return false;
    *array = moved;
    *capacity = bigger;
    return true;
}

static uint64_t lattice_key(int i, int j, int k)
{
    uint64_t offset = 1u << (LATTICE_BITS - 1);
    return ((uint64_t)((int64_t)i + (int64_t)offset) << (2 * LATTICE_BITS)) | ((uint64_t)((int64_t)j + (int64_t)offset) << LATTICE_BITS) |
           (uint64_t)((int64_t)k + (int64_t)offset);
}

// f > 0 needs a blob that alone gives T / n: rho (1 + x^2 / (5 rho^2))^-2 > T / n.
static double reach_of_model(const Blobby *m, Vec3 center)
{
    double reach = 0;
    for (int j = 0; j < m->count; j++) {
        double rho = m->width[j], ratio = rho * m->count / m->iso_level;
        if (ratio > 1)
            reach = fmax(reach, vec3_distance(center, m->center[j]) + rho * sqrt(5 * (sqrt(ratio) - 1)));
    }
    return reach;
}

static bool add_block(Job *job, const int base[3], int node)
{
    bool is_new;
    int *index = map_find_or_add(&job->block_of, lattice_key(base[0], base[1], base[2]), job->block_count, &is_new);
    if (!index)
        return false;
    if (is_new) {
        if (job->block_count >= BLOCKS_MAX || !grow((void **)&job->block, job->block_count, &job->block_capacity, sizeof *job->block))
            return false;
        job->block[job->block_count++] = (Block){{base[0], base[1], base[2]}, -1, -1};
    }
    if (!grow((void **)&job->link, job->link_count, &job->link_capacity, sizeof *job->link))
        return false;
    Block *b = &job->block[*index];
    job->link[job->link_count] = (Link){node, -1};
    if (b->latest >= 0)
        job->link[b->latest].next = job->link_count;
    else
        b->first = job->link_count;
    b->latest = job->link_count++;
    return true;
}

// All blocks that hold a lattice point within reach of the node, or a neighbour of one.
static bool add_blocks_of_node(Job *job, int n)
{
    const NodeReach *node = &job->node[n];
    Vec3 c = job->tree->center[node->node];
    double reach = node->reach + job->cell, block = BLOCK * job->cell, at[3] = {c.x, c.y, c.z};
    int low[3], high[3];
    for (int a = 0; a < 3; a++) {
        double l = floor((at[a] - reach) / block), h = floor((at[a] + reach) / block);
        if (!(l * BLOCK > -LATTICE_MAX && h * BLOCK < LATTICE_MAX))
            return false;
        low[a] = (int)l, high[a] = (int)h;
    }
    if ((double)(high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1) > BLOCKS_MAX)
        return false;
    for (int i = low[0]; i <= high[0]; i++)
        for (int j = low[1]; j <= high[1]; j++)
            for (int k = low[2]; k <= high[2]; k++) {
                // the nearest point of the block to the centre
                Vec3 d = vec3(fmax(0, fmax(i * block - c.x, c.x - (i + 1) * block)), fmax(0, fmax(j * block - c.y, c.y - (j + 1) * block)),
                              fmax(0, fmax(k * block - c.z, c.z - (k + 1) * block)));
                int base[3] = {i * BLOCK, j * BLOCK, k * BLOCK};
                if (vec3_norm2(d) <= reach * reach && !add_block(job, base, n))
                    return false;
            }
    return true;
}

// Bounds of a model's field over the ball of radius h about x.
static void field_bounds(const Blobby *m, Vec3 x, double h, double *low, double *high)
{
    *low = *high = -m->iso_level;
    for (int j = 0; j < m->count; j++) {
        double rho = m->width[j], d = vec3_distance(x, m->center[j]), near = fmax(0, d - h), far = d + h;
        double u = 1 / (1 + near * near / (5 * rho * rho)), v = 1 / (1 + far * far / (5 * rho * rho));
        *high += rho * u * u;
        *low += rho * v * v;
    }
}

static Vec3 block_ball(const Job *job, const Block *b, double *radius)
{
    double half = 0.5 * BLOCK * job->cell;
    *radius = half * sqrt(3) * (1 + 1e-9);
    return vec3(b->base[0] * job->cell + half, b->base[1] * job->cell + half, b->base[2] * job->cell + half);
}

// Drops candidates that are nowhere in the block the power-nearest: behind one that reaches all of it.
static void prune_candidates(Job *job, Block *b)
{
    double h, least = HUGE_VAL;
    Vec3 middle = block_ball(job, b, &h);
    for (int l = b->first; l >= 0; l = job->link[l].next) {
        const NodeReach *n = &job->node[job->link[l].node];
        double d = vec3_distance(middle, job->tree->center[n->node]), r = job->tree->radius[n->node];
        if (d + h < n->reach)
            least = fmin(least, (d + h) * (d + h) - r * r);
    }
    for (int *link = &b->first; *link >= 0;) {
        const NodeReach *n = &job->node[job->link[*link].node];
        double d = fmax(0, vec3_distance(middle, job->tree->center[n->node]) - h), r = job->tree->radius[n->node];
        if (d * d - r * r > least + 1e-9)
            *link = job->link[*link].next;
        else
            link = &job->link[*link].next;
    }
}

// Whether the block is certainly without surface: every candidate says outside, or every one inside and one covers all of it.
static bool block_is_plain(const Job *job, const Block *b)
{
    double h;
    Vec3 middle = block_ball(job, b, &h);
    bool all_out = true, all_in = true, covered = false;
    for (int l = b->first; l >= 0 && (all_out || all_in); l = job->link[l].next) {
        const NodeReach *n = &job->node[job->link[l].node];
        double low, high;
        field_bounds(&n->model, middle, h, &low, &high);
        all_out = all_out && high < -1e-9;
        all_in = all_in && low > 1e-9;
        covered = covered || vec3_distance(middle, job->tree->center[n->node]) + h < n->reach;
    }
    return all_out || (all_in && covered);
}

// The power-nearest of a block's candidates that reach x, -1 where none does.
static int owner_of(const Job *job, const Block *b, Vec3 x)
{
    int best = -1;
    double least = HUGE_VAL;
    for (int l = b->first; l >= 0; l = job->link[l].next) {
        const NodeReach *n = &job->node[job->link[l].node];
        double d2 = vec3_norm2(vec3_sub(x, job->tree->center[n->node])), r = job->tree->radius[n->node];
        if (d2 <= n->reach * n->reach && d2 - r * r < least) {
            least = d2 - r * r;
            best = job->link[l].node;
        }
    }
    return best;
}

static Vec3 lattice_point(const Job *job, const Block *b, int i, int j, int k)
{
    return vec3((b->base[0] + i) * job->cell, (b->base[1] + j) * job->cell, (b->base[2] + k) * job->cell);
}

static void sample_block(Job *job, const Block *b)
{
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++)
            for (int k = 0; k < SIDE; k++) {
                Vec3 x = lattice_point(job, b, i, j, k);
                int at = (i * SIDE + j) * SIDE + k, owner = owner_of(job, b, x);
                job->owner[at] = owner;
                job->value[at] = owner >= 0 ? blobby_field(&job->node[owner].model, x) : -job->tree->iso_level;
            }
}

// Onto the model's surface, by at most three quarters of a cell: where neighbouring models disagree there may be none near, and p stays.
static Vec3 settle(const Job *job, const Blobby *m, Vec3 p, Vec3 *normal)
{
    Vec3 g, x = p;
    for (int i = 0; i < 20; i++) {
        double f = blobby_gradient(m, x, &g), g2 = vec3_norm2(g);
        if (!(g2 > 1e-200))
            break;
        Vec3 step = vec3_scale(g, -f / g2);
        x = vec3_add(x, step);
        if (vec3_distance(x, p) > 0.75 * job->cell)
            break;
        if (vec3_norm(step) < 1e-12) {
            *normal = vec3_unit(vec3_negate(g));
            return x;
        }
    }
    blobby_gradient(m, p, &g);
    *normal = vec3_unit_or(vec3_negate(g), vec3(1, 0, 0));
    return p;
}

static bool add_vertex(Job *job, const Block *b, const int at[3], int axis, int *index)
{
    bool is_new;
    uint64_t key = lattice_key(b->base[0] + at[0], b->base[1] + at[1], b->base[2] + at[2]) << 2 | (uint64_t)axis;
    TriangleMesh *mesh = job->mesh;
    int *found = map_find_or_add(&job->vertex_of, key, mesh->vertex_count, &is_new);
    if (!found)
        return false;
    *index = *found;
    if (!is_new)
        return true;
    int capacity = job->vertex_capacity, same = capacity;
    if (!grow((void **)&mesh->vertex, mesh->vertex_count, &capacity, sizeof *mesh->vertex))
        return false;
    if (capacity != same) {
        int of_normal = same, of_node = same;
        if (!grow((void **)&mesh->normal, mesh->vertex_count, &of_normal, sizeof *mesh->normal) ||
            !grow((void **)&mesh->node, mesh->vertex_count, &of_node, sizeof *mesh->node))
            return false;
        job->vertex_capacity = capacity;
    }
    int step[3] = {axis == 0, axis == 1, axis == 2}, low = (at[0] * SIDE + at[1]) * SIDE + at[2];
    int high = low + (step[0] * SIDE + step[1]) * SIDE + step[2];
    double f0 = job->value[low], f1 = job->value[high], t = f0 / (f0 - f1);
    t = t > 0.001 ? t < 0.999 ? t : 0.999 : 0.001;   // off the lattice point, which other edges share
    Vec3 p = vec3_mix(lattice_point(job, b, at[0], at[1], at[2]), lattice_point(job, b, at[0] + step[0], at[1] + step[1], at[2] + step[2]), t);
    int owner = owner_of(job, b, p);
    owner = owner >= 0 ? owner : job->owner[f0 > 0 ? low : high];   // the inside end has one
    Vec3 normal;
    mesh->vertex[mesh->vertex_count] = settle(job, &job->node[owner].model, p, &normal);
    mesh->normal[mesh->vertex_count] = normal;
    mesh->node[mesh->vertex_count++] = job->node[owner].node;
    return true;
}

static bool march_block(Job *job, const Block *b)
{
    for (int i = 0; i < BLOCK; i++)
        for (int j = 0; j < BLOCK; j++)
            for (int k = 0; k < BLOCK; k++) {
                int mask = 0;
                for (int c = 0; c < 8; c++)
                    mask |= (job->value[((i + (c & 1)) * SIDE + j + (c >> 1 & 1)) * SIDE + k + (c >> 2 & 1)] > 0) << c;
                const CubeCase *cube = &job->table.of[mask];
                for (int t = 0; t < cube->count; t++) {
                    int triangle[3];
                    for (int v = 0; v < 3; v++) {
                        int edge = cube->edge[t][v], c = cube_edge_start(edge), at[3] = {i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)};
                        if (!add_vertex(job, b, at, edge / 4, &triangle[v]))
                            return false;
                    }
                    TriangleMesh *mesh = job->mesh;
                    if (!grow((void **)&mesh->triangle, mesh->triangle_count, &job->triangle_capacity, sizeof *mesh->triangle))
                        return false;
                    memcpy(mesh->triangle[mesh->triangle_count++], triangle, sizeof triangle);
                }
            }
    return true;
}

static bool find_blocks(Job *job, int first, int end)
{
    const VesselTree *tree = job->tree;
    job->node = calloc((size_t)(end - first), sizeof *job->node);
    job->mesh = calloc(1, sizeof *job->mesh);
    if (!job->node || !job->mesh)
        return false;
    for (int i = first; i < end; i++) {
        int64_t a = tree->blob_offset[i], z = tree->blob_offset[i + 1];
        NodeReach n = {i, {(int)(z - a), tree->blob_center + a, tree->blob_width + a, tree->iso_level}, 0};
        n.reach = reach_of_model(&n.model, tree->center[i]);
        if (!(n.reach > 0))
            continue;
        n.reach += 2 * job->cell;   // so that the outer end of a crossed edge has the model's value too
        job->node[job->node_count++] = n;
    }
    for (int n = 0; n < job->node_count; n++)
        if (!add_blocks_of_node(job, n))
            return false;
    return true;
}

static TriangleMesh *surface_of_nodes(const VesselTree *tree, int first, int end, double cell_mm)
{
    if (!tree || !vessel_tree_is_model(tree) || !isfinite(cell_mm) || !(cell_mm > 0))
        return NULL;
    Job *job = calloc(1, sizeof *job);
    if (!job)
        return NULL;
    job->tree = tree;
    job->cell = cell_mm;
    cube_table_fill(&job->table);
    bool good = find_blocks(job, first, end);
    for (int i = 0; good && i < job->block_count; i++) {
        prune_candidates(job, &job->block[i]);
        if (block_is_plain(job, &job->block[i]))
            continue;
        sample_block(job, &job->block[i]);
        good = march_block(job, &job->block[i]);
    }
    TriangleMesh *mesh = job->mesh;
    if (!good) {
        triangle_mesh_free(mesh);
        mesh = NULL;
    }
    map_free(&job->block_of);
    map_free(&job->vertex_of);
    free(job->block);
    free(job->link);
    free(job->node);
    free(job);
    return mesh;
}

TriangleMesh *isosurface_of_model(const VesselTree *tree, int node, double cell_mm)
{
    if (!tree || node < 0 || node >= tree->node_count)
        return NULL;
    return surface_of_nodes(tree, node, node + 1, cell_mm);
}

TriangleMesh *isosurface_of_tree(const VesselTree *tree, double cell_mm)
{
    return tree ? surface_of_nodes(tree, 0, tree->node_count, cell_mm) : NULL;
}

void triangle_mesh_free(TriangleMesh *mesh)
{
    if (!mesh)
        return;
    free(mesh->vertex);
    free(mesh->normal);
    free(mesh->node);
    free(mesh->triangle);
    free(mesh);
}

double isosurface_cell_for(const VesselTree *tree)
{
    double least = HUGE_VAL, area = 0;
    for (int i = 0; i < tree->node_count; i++) {
        int parent = tree->parent[i];
        least = fmin(least, tree->radius[i]);
        area += parent < 0 ? 0 : 2 * PI * tree->radius[i] * vec3_distance(tree->center[i], tree->center[parent]);
    }
    // marching cubes cut a cell's face in 2.3 triangles on the average
    double wanted = sqrt(2.3 * area / 300000);
    return fmax(fmin(fmax(wanted, 0.3 * least), 0.6 * least), 0.02);
}

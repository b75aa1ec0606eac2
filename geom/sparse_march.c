// See sparse_march.h.
#include "geom/sparse_march.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum {
    LATTICE_BITS = 20,
    LATTICE_MAX = (1 << (LATTICE_BITS - 1)) - 2 * MARCH_BLOCK,
    BLOCKS_MAX = 20000000,
};

// Makes room for one more entry; returns false if out of memory or if an index would not fit an int.
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

uint64_t march_key(int i, int j, int k)
{
    uint64_t offset = 1u << (LATTICE_BITS - 1);
    return ((uint64_t)((int64_t)i + (int64_t)offset) << (2 * LATTICE_BITS)) | ((uint64_t)((int64_t)j + (int64_t)offset) << LATTICE_BITS) |
           (uint64_t)((int64_t)k + (int64_t)offset);
}

bool march_begin(March *march, double cell, double least_share)
{
    march->cell = cell;
    march->least_share = least_share;
    march->mesh = calloc(1, sizeof *march->mesh);
    cube_table_fill(&march->table);
    return march->mesh != NULL;
}

static bool add_block(March *march, const int base[3], int ball)
{
    bool is_new;
    int *index = key_map_find_or_add(&march->block_of, march_key(base[0], base[1], base[2]), march->block_count, &is_new);
    if (!index)
        return false;
    if (is_new) {
        if (march->block_count >= BLOCKS_MAX || !grow((void **)&march->block, march->block_count, &march->block_capacity, sizeof *march->block))
            return false;
        march->block[march->block_count++] = (MarchBlock){{base[0], base[1], base[2]}, -1, -1, false};
    }
    if (!grow((void **)&march->link, march->link_count, &march->link_capacity, sizeof *march->link))
        return false;
    MarchBlock *b = &march->block[*index];
    march->link[march->link_count] = (MarchLink){ball, -1};
    if (b->latest >= 0)
        march->link[b->latest].next = march->link_count;
    else
        b->first = march->link_count;
    b->latest = march->link_count++;
    return true;
}

bool march_add_ball(March *march, int index, Vec3 c, double ball_reach)
{
    double reach = ball_reach + march->cell, block = MARCH_BLOCK * march->cell, at[3] = {c.x, c.y, c.z};
    int low[3], high[3];
    for (int a = 0; a < 3; a++) {
        double l = floor((at[a] - reach) / block), h = floor((at[a] + reach) / block);
        if (!(l * MARCH_BLOCK > -LATTICE_MAX && h * MARCH_BLOCK < LATTICE_MAX))
            return false;
        low[a] = (int)l, high[a] = (int)h;
    }
    if ((double)(high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1) > BLOCKS_MAX)
        return false;
    for (int i = low[0]; i <= high[0]; i++)
        for (int j = low[1]; j <= high[1]; j++)
            for (int k = low[2]; k <= high[2]; k++) {
                // the point of the block closest to the centre
                Vec3 d = vec3(fmax(0, fmax(i * block - c.x, c.x - (i + 1) * block)), fmax(0, fmax(j * block - c.y, c.y - (j + 1) * block)),
                              fmax(0, fmax(k * block - c.z, c.z - (k + 1) * block)));
                int base[3] = {i * MARCH_BLOCK, j * MARCH_BLOCK, k * MARCH_BLOCK};
                if (vec3_norm2(d) <= reach * reach && !add_block(march, base, index))
                    return false;
            }
    return true;
}

int march_block_beside(const March *march, const MarchBlock *b, const int steps[3])
{
    const int *base = b->base;
    return key_map_find(&march->block_of, march_key(base[0] + MARCH_BLOCK * steps[0], base[1] + MARCH_BLOCK * steps[1], base[2] + MARCH_BLOCK * steps[2]));
}

Vec3 march_block_ball(const March *march, const MarchBlock *b, double *radius)
{
    double half = 0.5 * MARCH_BLOCK * march->cell;
    *radius = half * sqrt(3) * (1 + 1e-9);
    return vec3(b->base[0] * march->cell + half, b->base[1] * march->cell + half, b->base[2] * march->cell + half);
}

bool march_reserve(March *march)
{
    TriangleMesh *mesh = march->mesh;
    int capacity = march->vertex_capacity, same = capacity;
    if (!grow((void **)&mesh->vertex, mesh->vertex_count, &capacity, sizeof *mesh->vertex))
        return false;
    if (capacity != same) {
        int of_normal = same, of_node = same;
        if (!grow((void **)&mesh->normal, mesh->vertex_count, &of_normal, sizeof *mesh->normal) ||
            !grow((void **)&mesh->node, mesh->vertex_count, &of_node, sizeof *mesh->node))
            return false;
        march->vertex_capacity = capacity;
    }
    return true;
}

bool march_add_triangle(March *march, const int corner[3])
{
    TriangleMesh *mesh = march->mesh;
    if (!grow((void **)&mesh->triangle, mesh->triangle_count, &march->triangle_capacity, sizeof *mesh->triangle))
        return false;
    memcpy(mesh->triangle[mesh->triangle_count++], corner, sizeof *mesh->triangle);
    return true;
}

static bool add_vertex(March *march, const MarchBlock *b, const int at[3], int axis, int *index)
{
    bool is_new;
    uint64_t key = march_key(b->base[0] + at[0], b->base[1] + at[1], b->base[2] + at[2]) << 2 | (uint64_t)axis;
    TriangleMesh *mesh = march->mesh;
    int *found = key_map_find_or_add(&march->vertex_of, key, mesh->vertex_count, &is_new);
    if (!found)
        return false;
    *index = *found;
    if (!is_new)
        return true;
    if (!march_reserve(march))
        return false;
    int step[3] = {axis == 0, axis == 1, axis == 2}, low = march_index(at[0], at[1], at[2]);
    int high = low + march_index(step[0], step[1], step[2]);
    double f0 = march->value[low], f1 = march->value[high], t = f0 / (f0 - f1), least = march->least_share, most = 1 - least;
    t = t > least ? t < most ? t : most : least;
    Vec3 p = vec3_mix(march_point(march, b, at[0], at[1], at[2]), march_point(march, b, at[0] + step[0], at[1] + step[1], at[2] + step[2]), t);
    int v = mesh->vertex_count++;
    march->place(march, b, p, march->owner[f0 > 0 ? low : high], &mesh->vertex[v], &mesh->normal[v], &mesh->node[v]);
    return true;
}

bool march_block(March *march, MarchBlock *b)
{
    b->is_marched = true;
    for (int i = 0; i < MARCH_BLOCK; i++)
        for (int j = 0; j < MARCH_BLOCK; j++)
            for (int k = 0; k < MARCH_BLOCK; k++) {
                int mask = 0;
                bool known = true;
                for (int c = 0; c < 8; c++) {
                    double value = march->value[march_index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1))];
                    mask |= (value > 0) << c;
                    known = known && !isnan(value);
                }
                const CubeCase *cube = &march->table.of[mask];
                for (int t = 0; known && t < cube->count; t++) {
                    int triangle[3];
                    for (int v = 0; v < 3; v++) {
                        int edge = cube->edge[t][v], c = cube_edge_start(edge), at[3] = {i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)};
                        if (!add_vertex(march, b, at, edge / 4, &triangle[v]))
                            return false;
                    }
                    if (!march_add_triangle(march, triangle))
                        return false;
                }
            }
    return true;
}

bool march_repair_normals(TriangleMesh *mesh)
{
    bool missing = false;
    for (int v = 0; v < mesh->vertex_count && !missing; v++)
        missing = vec3_norm2(mesh->normal[v]) == 0;
    if (!missing)
        return true;
    Vec3 *area = calloc((size_t)mesh->vertex_count, sizeof *area);
    if (!area)
        return false;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        Vec3 a = mesh->vertex[v[0]], n = vec3_cross(vec3_sub(mesh->vertex[v[1]], a), vec3_sub(mesh->vertex[v[2]], a));
        for (int k = 0; k < 3; k++)
            area[v[k]] = vec3_add(area[v[k]], n);
    }
    for (int v = 0; v < mesh->vertex_count; v++)
        if (vec3_norm2(mesh->normal[v]) == 0)
            mesh->normal[v] = vec3_unit(area[v]);
    free(area);
    return true;
}

void march_end(March *march)
{
    key_map_free(&march->block_of);
    key_map_free(&march->vertex_of);
    free(march->block);
    free(march->link);
}

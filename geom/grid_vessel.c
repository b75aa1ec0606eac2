// See grid_vessel.h. The lattice point (i, j, k) lies at cell * (i, j, k). A block holds 9 x 9 x 9 points, repeating those on its faces from its neighbours, so
// that a query reads one block. A map finds the block. It also holds the blocks inside and beyond open ends, which store no values: they are flooded from the
// blocks that do, with one query each at the middle. A block that the map does not hold is outside.
//
// A lattice point is queried from the node of the closest vertex of the surface (among one vertex per lattice cell). The closest vertex is found by successive
// subdivision: the candidates for a block, of these the candidates for each 3 x 3 x 3 of its points, of these the closest.
#include "geom/grid_vessel.h"

#include "base/base.h"

#include "geom/key_map.h"

#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 8,
    SIDE = BLOCK + 1,
    POINTS = SIDE * SIDE * SIDE,
    KEY_BITS = 20,
    BLOCK_MAX = (1 << (KEY_BITS - 1)) - 2,   // number of a block along an axis; that of a lattice point is 8 times larger
    BLOCKS_MAX = 4000000,                    // blocks with values: 12 GB
    IS_OUTSIDE = 0,
    IS_INSIDE,
    IS_OPEN,
    IS_HELD, // values of the map; from IS_HELD on: 3 + the block
};

typedef struct GridBlock {
    int base[3];
    float value[POINTS];
} GridBlock;

typedef struct GridVessel {
    Vessel vessel;           // first: a Vessel * points to its GridVessel
    GridVesselOptions options;
    int low[3], high[3];     // bounds of the known blocks, high included
    KeyMap state_of;
    int block_count;
    GridBlock *block;
} GridVessel;

static uint64_t key_of(int64_t i, int64_t j, int64_t k)
{
    SEL_ASSERT(i >= -BLOCK_MAX - 2 && i <= BLOCK_MAX + 2 && j >= -BLOCK_MAX - 2 && j <= BLOCK_MAX + 2 && k >= -BLOCK_MAX - 2 && k <= BLOCK_MAX + 2,
               "blocks lie within what a key counts");
    int64_t offset = (int64_t)1 << (KEY_BITS - 1);
    return (uint64_t)(i + offset) << (2 * KEY_BITS) | (uint64_t)(j + offset) << KEY_BITS | (uint64_t)(k + offset);
}

static int point_index(int i, int j, int k) { return (i * SIDE + j) * SIDE + k; }

// --- Queries ---

// Trilinear value at (u, v, w) in [0, 8] of a block, in units of its samples, and its gradient by u, v, w.
static double interpolate(const float *value, double u, double v, double w, Vec3 *gradient)
{
    SEL_ASSERT(u >= 0 && u <= BLOCK && v >= 0 && v <= BLOCK && w >= 0 && w <= BLOCK, "the point lies in the block");
    int i = u < BLOCK - 1 ? (int)u : BLOCK - 1, j = v < BLOCK - 1 ? (int)v : BLOCK - 1, k = w < BLOCK - 1 ? (int)w : BLOCK - 1;
    const float *a = value + point_index(i, j, k), *b = a + SIDE, *c = a + SIDE * SIDE, *d = c + SIDE;
    u -= i, v -= j, w -= k;
    double a0 = (double)a[0], b0 = (double)b[0], c0 = (double)c[0], d0 = (double)d[0];
    double a1 = (double)a[1] - a0, b1 = (double)b[1] - b0, c1 = (double)c[1] - c0, d1 = (double)d[1] - d0;
    double aw = a0 + w * a1, bw = b0 + w * b1, cw = c0 + w * c1, dw = d0 + w * d1;
    double low = aw + v * (bw - aw), high = cw + v * (dw - cw), slope_low = a1 + v * (b1 - a1), slope_high = c1 + v * (d1 - c1);
    *gradient = vec3(high - low, bw - aw + u * (dw - cw - bw + aw), slope_low + u * (slope_high - slope_low));
    return low + u * (high - low);
}

// State of a block beyond all known blocks: that of the nearest known block continues.
static int state_beside(const GridVessel *grid, const int block[3])
{
    int at[3];
    for (int a = 0; a < 3; a++)
        at[a] = block[a] < grid->low[a] ? grid->low[a] : block[a] > grid->high[a] ? grid->high[a] : block[a];
    int state = key_map_find(&grid->state_of, key_of(at[0], at[1], at[2]));
    return state == IS_INSIDE || state == IS_OPEN ? IS_OPEN : IS_OUTSIDE;
}

static VesselHit hit_outside(const GridVessel *grid, VesselMemory *memory)
{
    // along the last normal, if there is one
    VesselHit hit = {.gap = -grid->options.band_mm, .normal = memory->has_foot ? memory->normal : vec3(0, 0, 0), .flags = VESSEL_UNSURE};
    memory->clearance = 0;
    return hit;
}

static VesselHit hit_at(const GridVessel *grid, Vec3 x, double reach, VesselMemory *memory)
{
    double away = memory->clearance - reach;
    if (away > 0 && vec3_norm2(vec3_sub(x, memory->clear_place)) < away * away)
        return (VesselHit){.gap = memory->clearance - vec3_distance(x, memory->clear_place), .flags = VESSEL_FAR};
    if (!vec3_is_finite(x))
        return (VesselHit){.flags = VESSEL_UNSURE};
    double scale = 1 / (BLOCK * grid->options.cell_mm), at[3] = {x.x * scale, x.y * scale, x.z * scale};
    int block[3];
    bool beyond = false;
    for (int a = 0; a < 3; a++) {
        // rounds down without a function call
        double in = at[a] > -BLOCK_MAX ? at[a] < BLOCK_MAX ? at[a] : BLOCK_MAX : -BLOCK_MAX;
        block[a] = (int)in - (in < (int)in);
        beyond = beyond || block[a] < grid->low[a] || block[a] > grid->high[a];
    }
    int state = IS_HELD + memory->node;      // usually the same block as before
    if (memory->node < 0 || memory->node >= grid->block_count || memcmp(grid->block[memory->node].base, block, sizeof block) != 0)
        state = beyond ? state_beside(grid, block) : key_map_find(&grid->state_of, key_of(block[0], block[1], block[2]));
    if (state == IS_OPEN) {
        memory->clearance = 0;
        return (VesselHit){.gap = HUGE_VAL, .flags = VESSEL_OPEN_END};
    }
    if (state == IS_INSIDE) {
        memory->clearance = grid->options.band_mm;
        memory->clear_place = x;
        return (VesselHit){.gap = grid->options.band_mm, .flags = VESSEL_FAR};
    }
    if (state < IS_HELD)
        return hit_outside(grid, memory);
    Vec3 gradient;
    memory->node = state - IS_HELD;
    double gap = interpolate(grid->block[memory->node].value, BLOCK * (at[0] - block[0]), BLOCK * (at[1] - block[1]), BLOCK * (at[2] - block[2]), &gradient);
    if (gap < -grid->options.band_mm)
        return hit_outside(grid, memory);
    memory->clearance = 0.7 * gap;           // interpolated distances may fall slightly faster than the distance travelled
    memory->clear_place = x;
    if (gap > reach)
        return (VesselHit){.gap = gap, .flags = VESSEL_FAR};
    VesselHit hit = {.gap = gap, .normal = vec3_unit_or(gradient, memory->has_foot ? memory->normal : vec3(1, 0, 0))};
    memory->has_foot = true;
    memory->normal = hit.normal;
    memory->foot = vec3_add_scaled(x, -gap, hit.normal);
    memory->place = x;
    return hit;
}

static void grid_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    for (int i = 0; i < count; i++)
        hit[i] = hit_at((const GridVessel *)vessel, point[i], reach, &memory[i]);
}

static int grid_locate(const Vessel *vessel, Vec3 point, int from)
{
    (void)vessel, (void)point, (void)from;
    return 0;
}

static bool grid_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const GridVesselOptions *o = &((const GridVessel *)vessel)->options;
    *point = o->inlet;
    *direction = o->direction;
    return o->has_inlet;
}

static void grid_destroy(Vessel *vessel)
{
    GridVessel *grid = (GridVessel *)vessel;
    if (!grid)
        return;
    key_map_free(&grid->state_of);
    free(grid->block);
    free(grid);
}

// --- Creation ---

typedef struct Making {
    GridVessel *grid;
    const Vessel *exact;
    const TriangleMesh *surface;
    KeyMap list_of;          // block to the first vertex of its list
    int *next;               // (V) the next one in the list; -1 at its end
    int capacity;
    int (*base)[3];          // of each block with values …
    int *vertex;             // … and a nearby vertex, for each known block
    int near_capacity;
    int *near;               // candidate vertices for the current block, followed by those for a part of it
    int sought_count, sought_capacity;
    int (*sought)[3];        // known blocks without values, in the order found
    int *sought_vertex;
    Vec3 point[POINTS];
    VesselMemory memory[POINTS];
    VesselHit hit[POINTS];
} Making;

static bool check_options(const GridVesselOptions *o, const TriangleMesh *surface, const char *name, Faults *faults)
{
    int before = faults->count;
    bool cell = isfinite(o->cell_mm) && o->cell_mm > 0;
    if (!cell)
        faults_add(faults, name, 0, 0, "grid: cell_mm is %g; expected a number above 0", o->cell_mm);
    else if (!isfinite(o->band_mm) || !(o->band_mm >= 2 * o->cell_mm))
        faults_add(faults, name, 0, 0, "grid: band_mm is %g; expected at least two cells, %g mm", o->band_mm, 2 * o->cell_mm);
    if (o->has_inlet && (!vec3_is_finite(o->inlet) || !(fabs(vec3_norm(o->direction) - 1) < 1e-6)))
        faults_add(faults, name, 0, 0, "grid: the inlet (%g, %g, %g), direction (%g, %g, %g); expected finite mm and a unit vector", o->inlet.x, o->inlet.y,
                   o->inlet.z, o->direction.x, o->direction.y, o->direction.z);
    if (surface->triangle_count < 1)
        faults_add(faults, name, 0, 0, "grid: the surface has no triangles; expected at least one");
    double most = cell ? (double)BLOCK_MAX * BLOCK * o->cell_mm - 2 * o->band_mm : 0;
    for (int v = 0; v < surface->vertex_count && faults->count == before; v++) {
        Vec3 p = surface->vertex[v];
        if (!(vec3_is_finite(p) && fmax(fabs(p.x), fmax(fabs(p.y), fabs(p.z))) < most))
            faults_add(faults, name, 0, 0, "grid: vertex %d is at (%g, %g, %g) mm; expected coordinates below %g mm with cells of %g mm", v, p.x, p.y, p.z,
                       most, o->cell_mm);
    }
    for (int t = 0; t < surface->triangle_count && faults->count == before; t++)
        for (int k = 0; k < 3; k++)
            if (surface->triangle[t][k] < 0 || surface->triangle[t][k] >= surface->vertex_count)
                faults_add(faults, name, 0, 0, "grid: triangle %d has vertex %d of %d; expected 0 to %d", t, surface->triangle[t][k], surface->vertex_count,
                           surface->vertex_count - 1);
    return faults->count == before;
}

static bool hold_block(Making *m, int i, int j, int k, int vertex)
{
    bool is_new;
    GridVessel *grid = m->grid;
    if (!key_map_find_or_add(&grid->state_of, key_of(i, j, k), IS_HELD + grid->block_count, &is_new))
        return false;
    if (!is_new)
        return true;
    if (grid->block_count == m->capacity) {
        int capacity = 2 * m->capacity + 256;
        int(*base)[3] = realloc(m->base, (size_t)capacity * sizeof *base);
        m->base = base ? base : m->base;
        int *of = realloc(m->vertex, (size_t)capacity * sizeof *of);
        m->vertex = of ? of : m->vertex;
        if (!base || !of)
            return false;
        m->capacity = capacity;
    }
    SEL_REQUIRE(grid->block_count < m->capacity, "the list of blocks was enlarged before");
    memcpy(m->base[grid->block_count], (int[3]){i, j, k}, sizeof *m->base);
    m->vertex[grid->block_count++] = vertex;
    return grid->block_count < BLOCKS_MAX;
}

// Creates the blocks within the band of each triangle's box.
static bool hold_blocks(Making *m)
{
    const TriangleMesh *mesh = m->surface;
    double scale = 1 / (BLOCK * m->grid->options.cell_mm), band = m->grid->options.band_mm;
    for (int t = 0; t < mesh->triangle_count; t++) {
        double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
        for (int k = 0; k < 3; k++) {
            Vec3 p = mesh->vertex[mesh->triangle[t][k]];
            const double at[3] = {p.x, p.y, p.z};
            for (int a = 0; a < 3; a++)
                low[a] = fmin(low[a], at[a] - band), high[a] = fmax(high[a], at[a] + band);
        }
        int first[3], last[3];
        for (int a = 0; a < 3; a++)
            first[a] = (int)floor(low[a] * scale), last[a] = (int)floor(high[a] * scale);
        for (int i = first[0]; i <= last[0]; i++)
            for (int j = first[1]; j <= last[1]; j++)
                for (int k = first[2]; k <= last[2]; k++)
                    if (!hold_block(m, i, j, k, mesh->triangle[t][0]))
                        return false;
    }
    return true;
}

// Lattice cells may have coordinates eight times larger than blocks, so they need a separate key.
static uint64_t cell_key(const int at[3])
{
    uint64_t mask = (1u << 21) - 1;
    return ((uint64_t)(int64_t)at[0] & mask) << 42 | ((uint64_t)(int64_t)at[1] & mask) << 21 | ((uint64_t)(int64_t)at[2] & mask);
}

// Lists the vertices by block, one per lattice cell.
static bool list_vertices(Making *m)
{
    const TriangleMesh *mesh = m->surface;
    double scale = 1 / m->grid->options.cell_mm;
    KeyMap cells = {0};
    m->next = malloc((size_t)mesh->vertex_count * sizeof *m->next);
    bool good = m->next != NULL, is_new;
    for (int i = 0; good && i < 3 * mesh->triangle_count; i++) {
        int v = mesh->triangle[i / 3][i % 3];
        const Vec3 x = vec3_scale(mesh->vertex[v], scale);
        int cell[3] = {(int)floor(x.x), (int)floor(x.y), (int)floor(x.z)};
        good = key_map_find_or_add(&cells, cell_key(cell), v, &is_new) != NULL;
        if (!good || !is_new)
            continue;
        int *first = key_map_find_or_add(&m->list_of, key_of((int)floor(x.x / BLOCK), (int)floor(x.y / BLOCK), (int)floor(x.z / BLOCK)), v, &is_new);
        good = first != NULL;
        if (good) {
            m->next[v] = is_new ? -1 : *first;
            *first = v;
        }
    }
    key_map_free(&cells);
    return good;
}

static bool push_near(Making *m, int count, int v)
{
    if (count == m->near_capacity) {
        int capacity = 2 * m->near_capacity + 1024;
        int *near = realloc(m->near, (size_t)capacity * sizeof *near);
        if (!near)
            return false;
        m->near = near;
        m->near_capacity = capacity;
    }
    SEL_ASSERT(count >= 0 && count < m->near_capacity, "the list was enlarged before");
    m->near[count] = v;
    return true;
}

// Selects, from the vertices near[first … first + count), those that may be closest to some point of the ball, and appends them. Returns how many; -1 if out of
// memory.
static int narrow(Making *m, int first, int count, Vec3 middle, double radius)
{
    double least = HUGE_VAL;
    int kept = 0;
    for (int n = first; n < first + count; n++)
        least = fmin(least, vec3_norm2(vec3_sub(middle, m->surface->vertex[m->near[n]])));
    double most = sqrt(least) + 2 * radius;
    for (int n = first; n < first + count; n++)
        if (vec3_norm2(vec3_sub(middle, m->surface->vertex[m->near[n]])) <= most * most) {
            if (!push_near(m, first + count + kept, m->near[n]))
                return -1;
            kept++;
        }
    return kept;
}

// Collects the vertices in block b and in the surrounding blocks as far as the band and the vertices' triangles reach. Returns how many; -1 if out of memory.
static int gather_vertices(Making *m, int b)
{
    int around = (int)ceil(m->grid->options.band_mm / (BLOCK * m->grid->options.cell_mm)), count = 0;
    const int *base = m->base[b];
    for (int i = base[0] - around; i <= base[0] + around; i++)
        for (int j = base[1] - around; j <= base[1] + around; j++)
            for (int k = base[2] - around; k <= base[2] + around; k++)
                for (int v = key_map_find(&m->list_of, key_of(i, j, k)); v >= 0; v = m->next[v])
                    if (!push_near(m, count++, v))
                        return -1;
    return count == 0 && !push_near(m, count++, m->vertex[b]) ? -1 : count;
}

static int next_to(const Making *m, int first, int count, Vec3 x)
{
    SEL_ASSERT(count > 0, "some vertex is near each lattice point");
    int best = m->near[first];
    double least = HUGE_VAL;
    for (int n = first; n < first + count; n++) {
        double d2 = vec3_norm2(vec3_sub(x, m->surface->vertex[m->near[n]]));
        if (d2 < least)
            least = d2, best = m->near[n];
    }
    return best;
}

// Determines the vertex from which each lattice point of block b is queried.
static bool find_starts(Making *m, int b)
{
    double cell = m->grid->options.cell_mm;
    const int *base = m->base[b];
    Vec3 low = vec3(base[0] * BLOCK * cell, base[1] * BLOCK * cell, base[2] * BLOCK * cell), half = vec3(4 * cell, 4 * cell, 4 * cell);
    int all = gather_vertices(m, b), count = all < 0 ? -1 : narrow(m, 0, all, vec3_add(low, half), 1.001 * vec3_norm(half));
    for (int third = 0; third < 27; third++) {
        int i = 3 * (third / 9), j = 3 * (third / 3 % 3), k = 3 * (third % 3);
        Vec3 middle = vec3_add(low, vec3((i + 1) * cell, (j + 1) * cell, (k + 1) * cell));
        int few = count < 0 ? -1 : narrow(m, all, count, middle, 1.001 * sqrt(3) * cell);
        if (few < 0)
            return false;
        for (int p = 0; p < 27; p++) {
            int at = point_index(i + p / 9, j + p / 3 % 3, k + p % 3);
            Vec3 x = m->point[at] = vec3_add(low, vec3((i + p / 9) * cell, (j + p / 3 % 3) * cell, (k + p % 3) * cell));
            m->memory[at] = (VesselMemory){.node = m->exact->locate(m->exact, x, m->surface->node[next_to(m, all + count, few, x)])};
        }
    }
    return true;
}

static bool sample_block(Making *m, int b)
{
    double cell = m->grid->options.cell_mm, band = m->grid->options.band_mm;
    if (!find_starts(m, b))
        return false;
    memcpy(m->grid->block[b].base, m->base[b], sizeof *m->base);
    vessel_query(m->exact, POINTS, m->point, band + 2 * BLOCK * cell, m->memory, m->hit);
    for (int i = 0; i < POINTS; i++)
        m->grid->block[b].value[i] = (float)(m->hit[i].flags & VESSEL_OPEN_END ? band : m->hit[i].gap);
    return true;
}

// Adds a block without values to the map; the flood continues from it if it is inside or open.
static bool learn_block(Making *m, const int at[3], int vertex)
{
    GridVessel *grid = m->grid;
    for (int a = 0; a < 3; a++)
        if (at[a] < grid->low[a] || at[a] > grid->high[a])
            return true;
    bool is_new;
    int *state = key_map_find_or_add(&grid->state_of, key_of(at[0], at[1], at[2]), IS_OUTSIDE, &is_new);
    if (!state || !is_new)
        return state != NULL;
    double cell = grid->options.cell_mm, half = 0.5 * BLOCK * cell;
    Vec3 middle = vec3(at[0] * BLOCK * cell + half, at[1] * BLOCK * cell + half, at[2] * BLOCK * cell + half);
    VesselMemory memory = {.node = m->exact->locate(m->exact, middle, m->surface->node[vertex])};
    VesselHit hit;
    vessel_query(m->exact, 1, &middle, grid->options.band_mm, &memory, &hit);
    *state = hit.flags & VESSEL_OPEN_END ? IS_OPEN : hit.gap > 0 ? IS_INSIDE : IS_OUTSIDE;
    if (*state == IS_OUTSIDE)
        return true;
    if (m->sought_count == m->sought_capacity) {
        int capacity = 2 * m->sought_capacity + 256;
        int(*sought)[3] = realloc(m->sought, (size_t)capacity * sizeof *sought);
        m->sought = sought ? sought : m->sought;
        int *of = realloc(m->sought_vertex, (size_t)capacity * sizeof *of);
        m->sought_vertex = of ? of : m->sought_vertex;
        if (!sought || !of)
            return false;
        m->sought_capacity = capacity;
    }
    SEL_REQUIRE(m->sought_count < m->sought_capacity, "the list of blocks was enlarged before");
    memcpy(m->sought[m->sought_count], at, sizeof *m->sought);
    m->sought_vertex[m->sought_count++] = vertex;
    return true;
}

static bool learn_around(Making *m, const int at[3], int vertex)
{
    for (int face = 0; face < 6; face++) {
        int beside[3] = {at[0], at[1], at[2]};
        beside[face / 2] += face & 1 ? 1 : -1;
        if (!learn_block(m, beside, vertex))
            return false;
    }
    return true;
}

static bool flood(Making *m)
{
    SEL_ASSERT(m->grid->block_count > 0, "a surface with triangles has blocks");
    GridVessel *grid = m->grid;
    for (int a = 0; a < 3; a++) {
        grid->low[a] = grid->high[a] = m->base[0][a];
        for (int b = 0; b < grid->block_count; b++) {
            grid->low[a] = m->base[b][a] < grid->low[a] ? m->base[b][a] : grid->low[a];
            grid->high[a] = m->base[b][a] > grid->high[a] ? m->base[b][a] : grid->high[a];
        }
        grid->low[a]--, grid->high[a]++;
    }
    bool good = true;
    for (int b = 0; good && b < grid->block_count; b++)
        good = learn_around(m, m->base[b], m->vertex[b]);
    for (int s = 0; good && s < m->sought_count; s++) {
        int at[3] = {m->sought[s][0], m->sought[s][1], m->sought[s][2]};
        good = learn_around(m, at, m->sought_vertex[s]);
    }
    return good;
}

static bool fill_grid(Making *m)
{
    GridVessel *grid = m->grid;
    if (!hold_blocks(m) || !list_vertices(m))
        return false;
    grid->block = malloc((size_t)grid->block_count * sizeof *grid->block);
    bool good = grid->block != NULL;
    for (int b = 0; good && b < grid->block_count; b++)
        good = sample_block(m, b);
    return good && flood(m);
}

Vessel *grid_vessel_create(const Vessel *exact, const TriangleMesh *surface, const GridVesselOptions *options, const char *name, Faults *faults)
{
    if (!check_options(options, surface, name, faults))
        return NULL;
    Making *m = calloc(1, sizeof *m);
    GridVessel *grid = calloc(1, sizeof *grid);
    bool good = m && grid;
    if (good) {
        grid->vessel = (Vessel){.kind = "grid", .query = grid_query, .locate = grid_locate, .inlet = grid_inlet, .destroy = grid_destroy};
        grid->options = *options;
        m->grid = grid;
        m->exact = exact;
        m->surface = surface;
        good = fill_grid(m);
    }
    if (m) {
        key_map_free(&m->list_of);
        free(m->next);
        free(m->base);
        free(m->vertex);
        free(m->near);
        free(m->sought);
        free(m->sought_vertex);
        free(m);
    }
    if (!good) {
        faults_add(faults, name, 0, 0, "grid: cells of %g mm with a band of %g mm need more memory than available, or more than %d blocks; use larger cells",
                   options->cell_mm, options->band_mm, (int)BLOCKS_MAX);
        if (grid)
            grid_destroy(&grid->vessel);
        return NULL;
    }
    grid->vessel.primitives = (int64_t)grid->block_count * POINTS;
    grid->vessel.bytes = sizeof *grid + (size_t)grid->block_count * sizeof *grid->block + grid->state_of.capacity * (sizeof(uint64_t) + sizeof(int));
    return &grid->vessel;
}

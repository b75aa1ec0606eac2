// See mesh_lumen.h. Whether a row meets a triangle is asked of each side with its vertices in the order of their indices, so that neighbours agree on
// what passes through a common side and no row slips between them.
#include "recon/mesh_lumen.h"

#include "recon/parallel.h"

#include <stdlib.h>
#include <string.h>

enum { PROBES = 4000 };
static const double VOXELS_PER_RADIUS = 6, SMALLEST = 0.02;   // SMALLEST: share of the vessels' length that may be thinner

// --- lids ---

typedef struct Side {
    int low, high, from, to;
} Side;

static int compare_sides(const void *a, const void *b)
{
    const Side *x = a, *y = b;
    if (x->low != y->low)
        return x->low < y->low ? -1 : 1;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    return (x->from > y->from) - (x->from < y->from);
}

static int find_root(int *parent, int i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

bool mesh_close(const SurfaceMesh *mesh, SurfaceMesh *closed)
{
    size_t v = (size_t)mesh->vertex_count, t = (size_t)mesh->triangle_count, count = 3 * t, open = 0;
    Side *side = malloc((count + 1) * sizeof *side);
    int *parent = malloc((v + 1) * sizeof *parent), *lid = malloc((v + 1) * sizeof *lid);
    bool good = side && parent && lid;
    *closed = (SurfaceMesh){0};
    for (size_t i = 0; good && i < count; i++) {
        int a = mesh->triangle[i / 3][i % 3], b = mesh->triangle[i / 3][(i + 1) % 3];
        side[i] = (Side){a < b ? a : b, a < b ? b : a, a, b};
    }
    if (good)
        qsort(side, count, sizeof *side, compare_sides);
    for (size_t i = 0, run; good && i < count; i += run) {
        for (run = 1; i + run < count && side[i + run].low == side[i].low && side[i + run].high == side[i].high; run++)
            ;
        if (run == 1)
            side[open++] = side[i];
    }
    closed->vertex = malloc((v + open + 1) * sizeof *closed->vertex);
    closed->triangle = malloc((t + open + 1) * sizeof *closed->triangle);
    double *weight = calloc(v + open + 1, sizeof *weight);
    good = good && closed->vertex && closed->triangle && weight;
    if (good) {
        memcpy(closed->vertex, mesh->vertex, v * sizeof *closed->vertex);
        memcpy(closed->triangle, mesh->triangle, t * sizeof *closed->triangle);
        closed->vertex_count = (int)v;
        closed->triangle_count = (int)t;
        for (size_t i = 0; i < v; i++) {
            parent[i] = (int)i;
            lid[i] = -1;
        }
        for (size_t i = 0; i < open; i++) {
            int a = find_root(parent, side[i].low), b = find_root(parent, side[i].high);
            parent[a > b ? a : b] = a > b ? b : a;
        }
        for (size_t i = 0; i < open; i++) {
            int root = find_root(parent, side[i].low);
            if (lid[root] < 0) {
                lid[root] = closed->vertex_count++;
                closed->vertex[lid[root]] = vec3(0, 0, 0);
            }
            int middle = lid[root];
            Vec3 p = mesh->vertex[side[i].from], q = mesh->vertex[side[i].to];
            double length = vec3_distance(p, q);
            closed->vertex[middle] = vec3_add_scaled(closed->vertex[middle], 0.5 * length, vec3_add(p, q));
            weight[middle] += length;
            int *corner = closed->triangle[closed->triangle_count++];
            corner[0] = side[i].to;
            corner[1] = side[i].from;
            corner[2] = middle;
        }
        for (int i = (int)v; i < closed->vertex_count; i++)
            closed->vertex[i] = vec3_scale(closed->vertex[i], 1 / fmax(weight[i], 1e-300));
    }
    free(side);
    free(parent);
    free(lid);
    free(weight);
    if (!good) {
        free(closed->vertex);
        free(closed->triangle);
        *closed = (SurfaceMesh){0};
    }
    return good;
}

// --- the voxels' size ---

typedef struct Probe {
    double radius, length;
} Probe;

static int compare_probes(const void *a, const void *b)
{
    const Probe *x = a, *y = b;
    return x->radius != y->radius ? (x->radius > y->radius) - (x->radius < y->radius) : (x->length > y->length) - (x->length < y->length);
}

// Half the chord across the lumen from a triangle's middle is a radius, and area / radius the length of vessel that the triangle stands for.
static double smallest_radius(const SurfaceMesh *mesh, const MeshTree *tree, double size)
{
    int stride = mesh->triangle_count / PROBES + 1, count = 0;
    Probe *probe = malloc(((size_t)mesh->triangle_count / (size_t)stride + 1) * sizeof *probe);
    double all = 0, sum = 0;
    for (int t = 0; probe && t < mesh->triangle_count; t += stride) {
        Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
        Vec3 area = vec3_scale(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)), 0.5), n = vec3_negate(vec3_unit(area));
        Vec3 from = vec3_add_scaled(vec3_scale(vec3_add(a, vec3_add(b, c)), 1.0 / 3), 1e-6 * size, n);
        double chord = mesh_tree_ray(tree, from, n, INFINITY, NULL);
        if (!isfinite(chord) || !(chord > 1e-5 * size))
            continue;
        probe[count++] = (Probe){0.5 * chord, 2 * vec3_norm(area) / chord};
        all += probe[count - 1].length;
    }
    int i = 0;
    if (count) {
        qsort(probe, (size_t)count, sizeof *probe, compare_probes);
        for (; i + 1 < count && sum + probe[i].length < SMALLEST * all; i++)
            sum += probe[i].length;
    }
    double radius = count ? probe[i].radius : size;
    free(probe);
    return radius;
}

// --- rows ---

typedef struct Crossing {
    double x;
    int row, sign;           // +1 in, -1 out
} Crossing;

static int compare_crossings(const void *a, const void *b)
{
    const Crossing *p = a, *q = b;
    if (p->row != q->row)
        return p->row < q->row ? -1 : 1;
    return p->x != q->x ? (p->x > q->x) - (p->x < q->x) : q->sign - p->sign;
}

static bool is_left(const SurfaceMesh *mesh, int a, int b, double y, double z)
{
    Vec3 p = mesh->vertex[a < b ? a : b], q = mesh->vertex[a < b ? b : a];
    bool left = (q.y - p.y) * (z - p.z) - (q.z - p.z) * (y - p.y) >= 0;
    return a < b ? left : !left;
}

// The crossings of all rows with the wall, sorted; NULL where memory lacks.
static Crossing *find_crossings(const SurfaceMesh *mesh, const Lumen *l, size_t *count)
{
    size_t room = 1 << 16;
    Crossing *crossing = malloc(room * sizeof *crossing);
    *count = 0;
    for (int t = 0; crossing && t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        Vec3 a = mesh->vertex[v[0]], b = mesh->vertex[v[1]], c = mesh->vertex[v[2]];
        int y0 = (int)fmax(0, ceil((fmin(a.y, fmin(b.y, c.y)) - l->origin.y) / l->h)), y1 = (int)floor((fmax(a.y, fmax(b.y, c.y)) - l->origin.y) / l->h);
        int z0 = (int)fmax(0, ceil((fmin(a.z, fmin(b.z, c.z)) - l->origin.z) / l->h)), z1 = (int)floor((fmax(a.z, fmax(b.z, c.z)) - l->origin.z) / l->h);
        double det = (b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y);
        for (int k = z0; det != 0 && k <= z1 && k < l->size[2]; k++)
            for (int j = y0; j <= y1 && j < l->size[1]; j++) {
                double y = l->origin.y + j * l->h, z = l->origin.z + k * l->h;
                bool first = is_left(mesh, v[0], v[1], y, z);
                if (is_left(mesh, v[1], v[2], y, z) != first || is_left(mesh, v[2], v[0], y, z) != first)
                    continue;
                if (*count == room) {
                    room *= 2;
                    Crossing *more = realloc(crossing, room * sizeof *more);
                    if (!more) {
                        free(crossing);
                        return NULL;
                    }
                    crossing = more;
                }
                double s = ((y - a.y) * (c.z - a.z) - (z - a.z) * (c.y - a.y)) / det, u = ((b.y - a.y) * (z - a.z) - (b.z - a.z) * (y - a.y)) / det;
                crossing[(*count)++] = (Crossing){a.x + s * (b.x - a.x) + u * (c.x - a.x), j + l->size[1] * k, first ? -1 : 1};
            }
    }
    if (crossing)
        qsort(crossing, *count, sizeof *crossing, compare_crossings);
    return crossing;
}

static void add_run(Lumen *l, int row, double from, double to)
{
    int first = (int)fmax(0, ceil((from - l->origin.x) / l->h)), end = (int)fmin(l->size[0], ceil((to - l->origin.x) / l->h));
    int last = l->run_count - 1;
    if (first >= end)
        return;
    if (last >= l->row[row] && l->run[last].end == first) {
        l->run[last].end = end;
    } else
        l->run[l->run_count++] = (LumenRun){first, end, l->count, row};
    l->count += end - first;
}

static bool fill_rows(Lumen *l, const SurfaceMesh *mesh)
{
    size_t count, i = 0, rows = (size_t)l->size[1] * (size_t)l->size[2];
    Crossing *crossing = find_crossings(mesh, l, &count);
    // a spoilt row takes the runs of the row before
    l->run = crossing ? malloc((count + rows + 1) * sizeof *l->run) : NULL;
    l->row = calloc(rows + 1, sizeof *l->row);
    size_t room = count + rows + 1;
    for (int r = 0; l->run && l->row && r < (int)rows; r++) {
        size_t end = i;
        int winding = 0;
        l->row[r] = l->run_count;
        while (end < count && crossing[end].row == r)
            winding += crossing[end++].sign;
        if (winding == 0) {
            double from = 0;
            for (; i < end; i++) {
                winding += crossing[i].sign;
                if (winding == 1 && crossing[i].sign > 0)
                    from = crossing[i].x;
                if (winding == 0 && crossing[i].sign < 0)
                    add_run(l, r, from, crossing[i].x);
            }
        } else {
            l->spoilt_rows++;
            for (int k = r ? l->row[r - 1] : 0; r && k < l->row[r] && (size_t)l->run_count < room - rows; k++) {
                LumenRun run = l->run[k];
                l->run[l->run_count++] = (LumenRun){run.first, run.end, l->count, r};
                l->count += run.end - run.first;
            }
        }
        i = end;
    }
    if (l->row)
        l->row[rows] = l->run_count;
    free(crossing);
    return l->run && l->row;
}

// --- distances ---

typedef struct Measuring {
    Lumen *lumen;
    const MeshTree *tree;
} Measuring;

static void measure_run(void *context, long r)
{
    const Measuring *m = context;
    Lumen *l = m->lumen;
    const LumenRun *run = &l->run[r];
    double reach = INFINITY;
    for (int x = run->first; x < run->end; x++) {
        Vec3 foot, p = lumen_middle(l, run->base + x - run->first);
        int triangle;
        double d = mesh_tree_nearest(m->tree, p, reach, &foot, &triangle);
        l->distance[run->base + x - run->first] = (float)fmax(isfinite(d) ? d : reach, 1e-3 * l->h);
        reach = 1.001 * (d + l->h);
    }
}

Lumen *lumen_create(const SurfaceMesh *mesh, const MeshTree *tree, int voxels_max, int threads)
{
    Vec3 low = mesh->vertex[0], high = low;
    double volume = 0;
    for (int i = 0; i < mesh->vertex_count; i++) {
        Vec3 v = mesh->vertex[i];
        low = vec3(fmin(low.x, v.x), fmin(low.y, v.y), fmin(low.z, v.z));
        high = vec3(fmax(high.x, v.x), fmax(high.y, v.y), fmax(high.z, v.z));
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 a = vec3_sub(mesh->vertex[mesh->triangle[t][0]], low), b = vec3_sub(mesh->vertex[mesh->triangle[t][1]], low);
        volume += vec3_dot(a, vec3_cross(b, vec3_sub(mesh->vertex[mesh->triangle[t][2]], low))) / 6;
    }
    Lumen *l = calloc(1, sizeof *l);
    if (!l)
        return NULL;
    double size = vec3_distance(low, high);
    // the grid of rows is bounded too
    double h = fmax(smallest_radius(mesh, tree, size) / VOXELS_PER_RADIUS, cbrt(fabs(volume) / voxels_max));
    l->h = fmax(h, size / 4000);
    // off the numbers that vertices like to have
    l->origin = vec3_add_scaled(low, -l->h, vec3(0.3819660113, 0.4142135624, 0.2679491924));
    Vec3 extent = vec3_sub(high, l->origin);
    l->size[0] = (int)ceil(extent.x / l->h) + 1;
    l->size[1] = (int)ceil(extent.y / l->h) + 1;
    l->size[2] = (int)ceil(extent.z / l->h) + 1;
    bool good = fill_rows(l, mesh);
    l->distance = good ? malloc(((size_t)l->count + 1) * sizeof *l->distance) : NULL;
    if (!l->distance) {
        lumen_free(l);
        return NULL;
    }
    Measuring measuring = {l, tree};
    parallel_for(threads, l->run_count, measure_run, &measuring, NULL);
    return l;
}

void lumen_free(Lumen *l)
{
    if (!l)
        return;
    free(l->row);
    free(l->run);
    free(l->distance);
    free(l);
}

// --- places ---

void lumen_place(const Lumen *l, int voxel, int place[3])
{
    int low = 0, high = l->run_count - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (l->run[middle].base <= voxel)
            low = middle;
        else
            high = middle - 1;
    }
    place[0] = l->run[low].first + voxel - l->run[low].base;
    place[1] = l->run[low].row % l->size[1];
    place[2] = l->run[low].row / l->size[1];
}

Vec3 lumen_middle(const Lumen *l, int voxel)
{
    int p[3];
    lumen_place(l, voxel, p);
    return vec3_add_scaled(l->origin, l->h, vec3(p[0], p[1], p[2]));
}

int lumen_voxel(const Lumen *l, int x, int y, int z)
{
    if (y < 0 || z < 0 || y >= l->size[1] || z >= l->size[2])
        return -1;
    int row = y + l->size[1] * z;
    for (int r = l->row[row]; r < l->row[row + 1]; r++)
        if (x >= l->run[r].first && x < l->run[r].end)
            return l->run[r].base + x - l->run[r].first;
    return -1;
}

int lumen_neighbours(const Lumen *l, int voxel, int other[LUMEN_NEIGHBOURS], float step[LUMEN_NEIGHBOURS])
{
    static const float length[4] = {0, 1, 1.41421356f, 1.73205081f};
    int p[3], count = 0;
    lumen_place(l, voxel, p);
    for (int dz = -1; dz <= 1; dz++)
        for (int dy = -1; dy <= 1; dy++) {
            int y = p[1] + dy, z = p[2] + dz;
            if (y < 0 || z < 0 || y >= l->size[1] || z >= l->size[2])
                continue;
            int row = y + l->size[1] * z;
            for (int r = l->row[row]; r < l->row[row + 1] && l->run[r].first <= p[0] + 1; r++)
                for (int x = p[0] - 1 > l->run[r].first ? p[0] - 1 : l->run[r].first; x <= p[0] + 1 && x < l->run[r].end; x++) {
                    int index = l->run[r].base + x - l->run[r].first;
                    if (index == voxel)
                        continue;
                    other[count] = index;
                    step[count++] = length[(x != p[0]) + (dy != 0) + (dz != 0)];
                }
        }
    return count;
}

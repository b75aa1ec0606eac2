// Implements mesh_lumen.h. The test whether a row crosses a triangle evaluates each side with its vertices in the order of their indices, so that
// neighbouring triangles agree on their common side and no row slips between them.
#include "recon/surface/mesh_lumen.h"

#include "base/base.h"
#include "recon/surface/mesh_edges.h"

#include <stdlib.h>
#include <string.h>

#define SQRT3 1.73205081f

enum { PROBES = 4000, PASSES = 8 };
static const double VOXELS_PER_RADIUS = 6, NEAR = 2, CHANGE = 0.05, SMALLEST = 0.02;   // SMALLEST: fraction of the vessels' length that may be thinner

// --- lids ---

bool mesh_close(const SurfaceMesh *mesh, SurfaceMesh *closed)
{
    size_t v = (size_t)mesh->vertex_count, t = (size_t)mesh->triangle_count, open = 0;
    int count = 3 * mesh->triangle_count;
    MeshEdge *side = malloc((3 * t + 1) * sizeof *side);
    int *parent = malloc((v + 1) * sizeof *parent), *lid = malloc((v + 1) * sizeof *lid);
    bool good = side && parent && lid;
    *closed = (SurfaceMesh){0};
    if (good)
        mesh_edges_sort(mesh, side);
    for (int i = 0, run; good && i < count; i += run) {
        run = mesh_edges_run(side, count, i);
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
        for (size_t i = 0; i < open; i++)
            disjoint_join(parent, side[i].low, side[i].high);
        for (size_t i = 0; i < open; i++) {
            int root = disjoint_root(parent, side[i].low);
            if (lid[root] < 0) {
                lid[root] = closed->vertex_count++;
                closed->vertex[lid[root]] = vec3(0, 0, 0);
            }
            int middle = lid[root];
            int from = mesh->triangle[side[i].triangle][side[i].side], to = mesh->triangle[side[i].triangle][(side[i].side + 1) % 3];
            Vec3 p = mesh->vertex[from], q = mesh->vertex[to];
            double length = vec3_distance(p, q);
            closed->vertex[middle] = vec3_add_scaled(closed->vertex[middle], 0.5 * length, vec3_add(p, q));
            weight[middle] += length;
            int *corner = closed->triangle[closed->triangle_count++];
            corner[0] = to;
            corner[1] = from;
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

// Estimates the smallest radius: half the chord across the lumen from a triangle's centroid is a radius, and area / radius is the length of vessel that the
// triangle represents.
static double smallest_radius(const SurfaceMesh *mesh, const MeshTree *tree, double size)
{
    int stride = mesh->triangle_count / PROBES + 1, count = 0;
    Probe *probe = HEAP_ZEROED((size_t)mesh->triangle_count / (size_t)stride + 1, sizeof *probe);
    double all = 0, sum = 0;
    for (int t = 0; t < mesh->triangle_count; t += stride) {
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

// Returns the crossings of all rows with the wall, sorted, or NULL if out of memory.
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

static void add_run(Lumen *l, int row, double from, double to, int winding)
{
    int first = (int)fmax(0, ceil((from - l->origin.x) / l->h)), end = (int)fmin(l->size[0], ceil((to - l->origin.x) / l->h));
    if (first >= end)
        return;
    l->run[l->run_count++] = (LumenRun){first, end, l->count, row, winding};
    l->count += end - first;
}

static bool fill_rows(Lumen *l, const SurfaceMesh *mesh)
{
    size_t count, i = 0, rows = (size_t)l->size[1] * (size_t)l->size[2];
    Crossing *crossing = find_crossings(mesh, l, &count);
    // a row with inconsistent crossings takes the runs of the row before
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
            for (; i < end; i++) {
                winding += crossing[i].sign;
                if (winding > 0)
                    add_run(l, r, crossing[i].x, crossing[i + 1].x, winding);
            }
        } else {
            l->spoilt_rows++;
            for (int k = r ? l->row[r - 1] : 0; r && k < l->row[r] && (size_t)l->run_count < room - rows; k++) {
                LumenRun run = l->run[k];
                l->run[l->run_count++] = (LumenRun){run.first, run.end, l->count, r, run.winding};
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

// --- positions ---

void lumen_place(const Lumen *l, int voxel, int place[3])
{
    const LumenRun *run = &l->run[l->run_of[voxel]];
    place[0] = run->first + voxel - run->base;
    place[1] = run->row % l->size[1];
    place[2] = run->row / l->size[1];
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

// Implements lumen_neighbours; `bit` receives the bit of each neighbour in the mask `walled` (may be NULL).
static int neighbours(const Lumen *l, int voxel, int other[LUMEN_NEIGHBOURS], float step[LUMEN_NEIGHBOURS], int bit[LUMEN_NEIGHBOURS])
{
    static const float length[4] = {0, 1, 1.41421356f, SQRT3};
    const uint32_t walled = bit ? 0 : l->walled[voxel];
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
                    int index = l->run[r].base + x - l->run[r].first, place = 13 + x - p[0] + 3 * dy + 9 * dz;
                    if (index == voxel || walled >> place & 1)
                        continue;
                    if (bit)
                        bit[count] = place;
                    other[count] = index;
                    step[count++] = length[(x != p[0]) + (dy != 0) + (dz != 0)];
                }
        }
    return count;
}

int lumen_neighbours(const Lumen *l, int voxel, int other[LUMEN_NEIGHBOURS], float step[LUMEN_NEIGHBOURS]) { return neighbours(l, voxel, other, step, NULL); }

// --- distances ---

typedef struct Measuring {
    Lumen *lumen;
    const SurfaceMesh *mesh;
    const MeshTree *tree;
    int *nearest;            // (count) nearest triangle
    float (*foot)[3];        // (count) nearest point on it, relative to the origin
} Measuring;

static void set_foot(float foot[3], Vec3 p)
{
    foot[0] = (float)p.x;
    foot[1] = (float)p.y;
    foot[2] = (float)p.z;
}

static void measure_near(void *context, long r)
{
    const Measuring *m = context;
    Lumen *l = m->lumen;
    const LumenRun *run = &l->run[r];
    for (int i = run->base; i < run->base + run->end - run->first; i++) {
        Vec3 foot = {INFINITY, INFINITY, INFINITY};
        l->run_of[i] = (int)r;
        m->nearest[i] = -1;
        double d = mesh_tree_nearest(m->tree, lumen_middle(l, i), NEAR * l->h, &foot, &m->nearest[i]);
        l->distance[i] = (float)fmax(d, 1e-3 * l->h);
        set_foot(m->foot[i], vec3_sub(foot, l->origin));
    }
}

// Voxels far from the wall take the nearest of their neighbours' triangles, in alternating sweeps until nothing changes (Danielsson 1980), because a tree
// search would visit all triangles around a vessel's middle.
static void measure_far(const Measuring *m)
{
    Lumen *l = m->lumen;
    bool changed = true;
    for (int pass = 0; pass < PASSES && changed; pass++) {
        changed = false;
        for (int k = 0; k < l->count; k++) {
            int i = pass % 2 ? l->count - 1 - k : k, other[LUMEN_NEIGHBOURS], best = -1;
            float step[LUMEN_NEIGHBOURS];
            if (l->distance[i] <= NEAR * l->h)
                continue;
            Vec3 p = lumen_middle(l, i), at = vec3_sub(p, l->origin), foot;
            double least = (double)l->distance[i] * l->distance[i];
            for (int n = lumen_neighbours(l, i, other, step) - 1; n >= 0; n--) {
                const float *f = m->foot[other[n]];
                double x = f[0] - at.x, y = f[1] - at.y, z = f[2] - at.z, d2 = x * x + y * y + z * z;
                if (d2 < least) {
                    least = d2;
                    best = other[n];
                }
            }
            if (best < 0)
                continue;
            m->nearest[i] = m->nearest[best];
            float d = (float)mesh_triangle_nearest(m->mesh, m->nearest[i], p, &foot);
            changed = changed || d < l->distance[i] - CHANGE * l->h;
            l->distance[i] = d;
            set_foot(m->foot[i], vec3_sub(foot, l->origin));
        }
    }
}

// Returns true if the line between two voxels' centres leaves the lumen. No ray is needed if both distances to the wall together cover it.
static bool is_walled(const Measuring *m, int a, int b, int winding, double steps)
{
    const Lumen *l = m->lumen;
    int triangle = 0;
    if ((double)l->distance[a] + l->distance[b] > 1.0001 * steps * l->h)
        return false;
    Vec3 from = lumen_middle(l, a), d = vec3_unit(vec3_sub(lumen_middle(l, b), from));
    if (!isfinite(mesh_tree_ray(m->tree, from, d, steps * l->h, &triangle)))
        return false;
    const int *v = m->mesh->triangle[triangle];
    Vec3 p = m->mesh->vertex[v[0]], n = vec3_cross(vec3_sub(m->mesh->vertex[v[1]], p), vec3_sub(m->mesh->vertex[v[2]], p));
    // in overlapping parts the first wall separates one part from the other
    return winding == 1 && vec3_dot(n, d) > 0;
}

static void find_walls(void *context, long r)
{
    const Measuring *m = context;
    const LumenRun *run = &m->lumen->run[r];
    int other[LUMEN_NEIGHBOURS], bit[LUMEN_NEIGHBOURS];
    float step[LUMEN_NEIGHBOURS];
    for (int x = run->first; x < run->end; x++) {
        int voxel = run->base + x - run->first;
        if (m->lumen->distance[voxel] > SQRT3 * m->lumen->h)
            continue;
        uint32_t walled = 0;
        for (int k = 0, count = neighbours(m->lumen, voxel, other, step, bit); k < count; k++)
            if (other[k] > voxel && is_walled(m, voxel, other[k], run->winding, step[k]))
                walled |= UINT32_C(1) << bit[k];
        m->lumen->walled[voxel] = walled;
    }
}

// Marks each wall for the voxel on its other side too. This is done afterwards, so that each parallel job changes only its own voxels.
static void mirror_walls(Lumen *l)
{
    for (int i = 0; i < l->count; i++)
        for (int bit = 14; l->walled[i] && bit < 27; bit++)
            if (l->walled[i] >> bit & 1) {
                int p[3];
                lumen_place(l, i, p);
                int other = lumen_voxel(l, p[0] + bit % 3 - 1, p[1] + bit / 3 % 3 - 1, p[2] + bit / 9 - 1);
                l->walled[other] |= UINT32_C(1) << (26 - bit);
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
    // limit the number of voxels
    double h = fmax(smallest_radius(mesh, tree, size) / VOXELS_PER_RADIUS, same_cbrt(fabs(volume) / voxels_max));
    l->h = fmax(h, size / 4000);
    // an irrational offset avoids round coordinates, which vertices often have
    l->origin = vec3_add_scaled(low, -l->h, vec3(0.3819660113, 0.4142135624, 0.2679491924));
    Vec3 extent = vec3_sub(high, l->origin);
    l->size[0] = (int)ceil(extent.x / l->h) + 1;
    l->size[1] = (int)ceil(extent.y / l->h) + 1;
    l->size[2] = (int)ceil(extent.z / l->h) + 1;
    bool good = fill_rows(l, mesh);
    size_t n = (size_t)l->count + 1;
    l->distance = good ? malloc(n * sizeof *l->distance) : NULL;
    l->run_of = good ? malloc(n * sizeof *l->run_of) : NULL;
    l->walled = good ? calloc(n, sizeof *l->walled) : NULL;
    Measuring measuring = {l, mesh, tree, good ? malloc(n * sizeof(int)) : NULL, good ? malloc(n * sizeof(float[3])) : NULL};
    if (!l->distance || !l->run_of || !l->walled || !measuring.nearest || !measuring.foot) {
        free(measuring.nearest);
        free(measuring.foot);
        lumen_free(l);
        return NULL;
    }
    parallel_for(threads, l->run_count, measure_near, &measuring, NULL);
    measure_far(&measuring);
    free(measuring.nearest);
    free(measuring.foot);
    parallel_for(threads, l->run_count, find_walls, &measuring, NULL);
    mirror_walls(l);
    return l;
}

void lumen_free(Lumen *l)
{
    if (!l)
        return;
    free(l->row);
    free(l->run);
    free(l->run_of);
    free(l->distance);
    free(l->walled);
    free(l);
}

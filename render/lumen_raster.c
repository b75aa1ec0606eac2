// As OpenGL does: corners are rounded to 256ths of a pixel, a pixel belongs to a triangle if its centre lies inside, or on an edge that the triangle owns (each edge
// is owned by one of its two triangles, by its direction), and F is interpolated in perspective: with q = 1 / w, F = sum(b F q) / sum(b q) for the barycentric
// coordinates b. Edge functions are integers: a closed wall covers each pixel as often facing as averted, however thin its triangles are.
#include "render/lumen_raster.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { SUBPIXELS = 256 };
static const float farthest = 4e6f;        // [subpixel] a corner beyond is moved there: products of differences fit into 64 bits by far

typedef struct WallPoint {
    int32_t x, y;            // [subpixel]
    float q, fq;             // 1 / w; F / w
} WallPoint;

bool wall_mesh_make(WallMesh *mesh, int vertices, const float (*vertex)[4], int triangles, const int (*triangle)[3])
{
    *mesh = (WallMesh){.vertex_count = vertices, .triangle_count = triangles};
    mesh->vertex = malloc(((size_t)vertices + 1) * sizeof *mesh->vertex);
    mesh->triangle = malloc(((size_t)triangles + 1) * sizeof *mesh->triangle);
    mesh->point = malloc(((size_t)vertices + 1) * sizeof *mesh->point);
    if (!mesh->vertex || !mesh->triangle || !mesh->point) {
        wall_mesh_free(mesh);
        return false;
    }
    memcpy(mesh->vertex, vertex, (size_t)vertices * sizeof *mesh->vertex);
    memcpy(mesh->triangle, triangle, (size_t)triangles * sizeof *mesh->triangle);
    return true;
}

void wall_mesh_free(WallMesh *mesh)
{
    free(mesh->vertex);
    free(mesh->triangle);
    free(mesh->point);
    *mesh = (WallMesh){0};
}

static int32_t subpixel(float clip, float q, float half)
{
    const float x = half * (clip * q + 1), limited = x < -farthest ? -farthest : x < farthest ? x : farthest;
    return (int32_t)floorf(limited + 0.5f);
}

static void project(const WallMesh *mesh, const WallView *view, int side)
{
    const float *m = view->clip, half = 0.5f * (float)side * SUBPIXELS;
    for (int i = 0; i < mesh->vertex_count; i++) {
        const float *p = mesh->vertex[i], *node = view->shift_slope[(int)(p[3] + 0.5f)];
        const float depth = view->towards[0] * p[0] + view->towards[1] * p[1] + view->towards[2] * p[2] + view->shift;
        const float x = m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12], y = m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13];
        const float q = 1 / (m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15]);
        mesh->point[i] = (WallPoint){subpixel(x, q, half), subpixel(y, q, half), q, (node[0] + node[1] * depth) * q};
    }
}

static int32_t least_of(int32_t a, int32_t b, int32_t c) { return a < b ? (a < c ? a : c) : b < c ? b : c; }
static int32_t most_of(int32_t a, int32_t b, int32_t c) { return a > b ? (a > c ? a : c) : b > c ? b : c; }

// The pixels whose centres lie between two subpixels: from `low` to below `high`.
static void pixels_between(int32_t least, int32_t most, int side, int *low, int *high)
{
    const int32_t half = SUBPIXELS / 2, first = (least - half + SUBPIXELS - 1) >> 8, last = (most - half) >> 8;
    *low = first > 0 ? first : 0;
    *high = last < side - 1 ? last + 1 : side;
}

typedef struct Edge {
    int64_t value;           // at the centre of the first pixel: positive inside
    int64_t right, up;       // change to the next pixel
    int64_t owned;           // 0 if pixels on it belong to the triangle, else 1
} Edge;

static Edge edge_of(const WallPoint *a, const WallPoint *b, int x, int y)
{
    const int64_t dx = b->x - a->x, dy = b->y - a->y, px = (int64_t)x * SUBPIXELS + SUBPIXELS / 2, py = (int64_t)y * SUBPIXELS + SUBPIXELS / 2;
    return (Edge){dx * (py - a->y) - dy * (px - a->x), -dy * SUBPIXELS, dx * SUBPIXELS, dy > 0 || (dy == 0 && dx < 0) ? 0 : 1};
}

static void add_triangle(const WallPoint *a, const WallPoint *b, const WallPoint *c, float sign, int side, float *value)
{
    int low[2], high[2];
    pixels_between(least_of(a->x, b->x, c->x), most_of(a->x, b->x, c->x), side, &low[0], &high[0]);
    pixels_between(least_of(a->y, b->y, c->y), most_of(a->y, b->y, c->y), side, &low[1], &high[1]);
    if (low[0] >= high[0] || low[1] >= high[1] || (a->fq == 0 && b->fq == 0 && c->fq == 0))
        return;
    const int64_t area = (int64_t)(b->x - a->x) * (c->y - a->y) - (int64_t)(c->x - a->x) * (b->y - a->y);
    if (area == 0)
        return;
    if (area < 0) {
        const WallPoint *other = b;
        b = c;
        c = other;
        sign = -sign;
    }
    // the edge opposite to a corner gives the corner's weight
    Edge u = edge_of(b, c, low[0], low[1]), v = edge_of(c, a, low[0], low[1]), w = edge_of(a, b, low[0], low[1]);
    for (int y = low[1]; y < high[1]; y++, u.value += u.up, v.value += v.up, w.value += w.up) {
        int64_t i = u.value, j = v.value, k = w.value;
        float *out = value + (size_t)y * (size_t)side;
        for (int x = low[0]; x < high[0]; x++, i += u.right, j += v.right, k += w.right)
            if (((i - u.owned) | (j - v.owned) | (k - w.owned)) >= 0) {
                const float s = (float)i, t = (float)j, r = (float)k;
                out[x] += sign * (s * a->fq + t * b->fq + r * c->fq) / (s * a->q + t * b->q + r * c->q);
            }
    }
}

void lumen_raster(WallMesh *mesh, const WallView *view, int side, float *value)
{
    project(mesh, view, side);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangle[t];
        add_triangle(&mesh->point[corner[0]], &mesh->point[corner[1]], &mesh->point[corner[2]], view->facing, side, value);
    }
}

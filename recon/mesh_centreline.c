// See mesh_centreline.h. Coarse meshes are refined first, by halving edges longer than 0.7 local radii, so that neighbouring centres are near each other.
// A branch counts that leaves its parent's sphere by more than 1.5 of its own radii: bumps and facets' corners do not.
#include "recon/mesh_centreline.h"

#include "recon/mesh_tree.h"
#include "recon/parallel.h"

#include <stdlib.h>
#include <string.h>

enum { REFINE_PASSES = 5, TRIANGLES_MAX = 60000, BALL_STEPS = 24, CENTRING_PASSES = 12, RAYS = 16, CURVES_MAX = 4096 };
static const double EDGE = 0.7, CONTACT_COSINE = 0.5, COVER = 1.65, PROTRUDES = 1.5;

typedef struct Pieces {      // the refined wall and its balls
    SurfaceMesh mesh;
    int (*across)[3];
    Vec3 *middle, *normal, *ball;        // (T) normal into the lumen
    double *radius;          // (T) inscribed at ball
    bool *is_across;         // (T) the ball's two contacts lie more than 120 degrees apart: a tube's; at a lid's rim or tip they do not
    const MeshTree *tree;    // of the given mesh
} Pieces;

// --- refinement ---

typedef struct Side {
    int low, high, triangle, side;
} Side;

static int compare_sides(const void *a, const void *b)
{
    const Side *x = a, *y = b;
    if (x->low != y->low)
        return x->low < y->low ? -1 : 1;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    return (x->triangle > y->triangle) - (x->triangle < y->triangle);
}

static Side *sorted_sides(const SurfaceMesh *mesh)
{
    size_t count = 3 * (size_t)mesh->triangle_count;
    Side *side = malloc((count + 1) * sizeof *side);
    for (int t = 0; side && t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            side[3 * t + k] = (Side){a < b ? a : b, a < b ? b : a, t, k};
        }
    if (side)
        qsort(side, count, sizeof *side, compare_sides);
    return side;
}

static int run_of(const Side *side, int count, int at)
{
    int run = 1;
    while (at + run < count && side[at + run].low == side[at].low && side[at + run].high == side[at].high)
        run++;
    return run;
}

static bool link_sides(Pieces *p)
{
    int count = 3 * p->mesh.triangle_count;
    Side *side = sorted_sides(&p->mesh);
    free(p->across);
    p->across = malloc(((size_t)p->mesh.triangle_count + 1) * sizeof *p->across);
    if (side && p->across) {
        for (int t = 0; t < p->mesh.triangle_count; t++)
            p->across[t][0] = p->across[t][1] = p->across[t][2] = -1;
        for (int i = 0, run; i < count; i += run) {
            run = run_of(side, count, i);
            if (run != 2)
                continue;
            p->across[side[i].triangle][side[i].side] = side[i + 1].triangle;
            p->across[side[i + 1].triangle][side[i + 1].side] = side[i].triangle;
        }
    }
    free(side);
    return side && p->across;
}

// The sphere that touches the wall at piece t and across from it.
static void find_ball(void *context, long t)
{
    Pieces *p = context;
    Vec3 at = p->middle[t], n = p->normal[t], foot = at;
    int triangle = 0;
    // just inside, so that the piece itself is not hit
    double reach = mesh_tree_ray(p->tree, vec3_add_scaled(at, 1e-6 * p->radius[t], n), n, INFINITY, NULL), r = 0.5 * reach;
    if (!isfinite(reach)) {   // looks out of an opening
        p->ball[t] = at;
        p->radius[t] *= 1e-6;
        p->is_across[t] = false;
        return;
    }
    Vec3 c = vec3_add_scaled(at, r, n);
    for (int step = 0; step < BALL_STEPS; step++) {
        // only what lies within the sphere is looked for: from a tube's axis all of its wall is equally near
        double d = mesh_tree_nearest(p->tree, c, r * (1 - 1e-3), &foot, &triangle);
        p->radius[t] = isfinite(d) ? d : r;
        if (!isfinite(d))
            break;
        Vec3 to_at = vec3_sub(at, c), to_foot = vec3_sub(foot, c), chord = vec3_sub(foot, at);
        double down = vec3_dot(chord, n);
        if (down <= 0 || vec3_dot(to_at, to_foot) > CONTACT_COSINE * r * d)
            break;
        r = fmin(0.5 * vec3_norm2(chord) / down, 0.999 * r);
        c = vec3_add_scaled(at, r, n);
        p->is_across[t] = vec3_dot(vec3_sub(at, c), vec3_sub(foot, c)) < -CONTACT_COSINE * r * r;
    }
    p->ball[t] = c;
    p->radius[t] = fmax(p->radius[t], 1e-9);
}

static Vec3 area_of(const SurfaceMesh *mesh, int t)
{
    Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
    return vec3_scale(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)), 0.5);
}

static bool find_balls(Pieces *p, double size, int threads)
{
    size_t n = (size_t)p->mesh.triangle_count + 1;
    free(p->middle);
    free(p->normal);
    free(p->ball);
    free(p->radius);
    free(p->is_across);
    p->is_across = malloc(n * sizeof(bool));
    p->middle = malloc(n * sizeof(Vec3));
    p->normal = malloc(n * sizeof(Vec3));
    p->ball = malloc(n * sizeof(Vec3));
    p->radius = malloc(n * sizeof(double));
    if (!p->middle || !p->normal || !p->ball || !p->radius || !p->is_across || !link_sides(p))
        return false;
    for (int t = 0; t < p->mesh.triangle_count; t++) {
        const int *v = p->mesh.triangle[t];
        Vec3 sum = area_of(&p->mesh, t);
        // with its neighbours': half of what facets and stairs turn it away; not over sharp edges
        Vec3 own = vec3_unit(sum);
        for (int k = 0; k < 3; k++) {
            Vec3 other = p->across[t][k] >= 0 ? area_of(&p->mesh, p->across[t][k]) : vec3(0, 0, 0);
            if (vec3_dot(vec3_unit(other), own) > 0.5)
                sum = vec3_add(sum, other);
        }
        p->middle[t] = vec3_scale(vec3_add(p->mesh.vertex[v[0]], vec3_add(p->mesh.vertex[v[1]], p->mesh.vertex[v[2]])), 1.0 / 3);
        p->normal[t] = vec3_negate(vec3_unit(sum));
        p->radius[t] = size;
        p->is_across[t] = true;
    }
    parallel_for(threads, p->mesh.triangle_count, find_ball, p, NULL);
    return true;
}

// Halves the edges that are long for the balls beside them; *count: how many. False where memory lacks.
static bool refine(Pieces *p, int *count)
{
    SurfaceMesh *m = &p->mesh;
    int sides = 3 * m->triangle_count, made = 0;
    Side *side = sorted_sides(m);
    int(*half)[3] = malloc(((size_t)m->triangle_count + 1) * sizeof *half);
    Vec3 *vertex = NULL;
    int(*triangle)[3] = NULL;
    *count = 0;
    for (int i = 0, run; side && half && i < sides; i += run) {
        run = run_of(side, sides, i);
        double length = vec3_distance(m->vertex[side[i].low], m->vertex[side[i].high]), limit = 0;
        // the largest about: balls in facets' corners are small
        for (int k = 0; k < run; k++)
            for (int n = -1; n < 3; n++) {
                int t = n < 0 ? side[i + k].triangle : p->across[side[i + k].triangle][n];
                limit = fmax(limit, t >= 0 ? EDGE * p->radius[t] : 0);
            }
        for (int k = 0; k < run; k++)
            half[side[i + k].triangle][side[i + k].side] = length > limit ? m->vertex_count + *count : -1;
        *count += length > limit;
    }
    if (side && half && *count) {
        vertex = realloc(m->vertex, ((size_t)m->vertex_count + (size_t)*count) * sizeof *vertex);
        m->vertex = vertex ? vertex : m->vertex;
        triangle = malloc(4 * (size_t)m->triangle_count * sizeof *triangle);
    }
    bool good = side && half && (!*count || (vertex && triangle));
    if (good && *count) {
        for (int t = 0; t < m->triangle_count; t++) {
            const int *v = m->triangle[t], *h = half[t];
            for (int k = 0; k < 3; k++)
                if (h[k] >= 0)
                    m->vertex[h[k]] = vec3_mix(m->vertex[v[k] < v[(k + 1) % 3] ? v[k] : v[(k + 1) % 3]], m->vertex[v[k] < v[(k + 1) % 3] ? v[(k + 1) % 3] : v[k]], 0.5);
            int marked = (h[0] >= 0) + (h[1] >= 0) + (h[2] >= 0), s = 0;
            // turned so that a single halved side is the first, or a single whole one the last
            while (marked == 1 ? h[s] < 0 : marked == 2 && h[(s + 2) % 3] >= 0)
                s++;
            int a = v[s], b = v[(s + 1) % 3], c = v[(s + 2) % 3], ab = h[s], bc = h[(s + 1) % 3], ca = h[(s + 2) % 3];
            const int none[4][3] = {{a, b, c}}, one[4][3] = {{a, ab, c}, {ab, b, c}}, two[4][3] = {{ab, b, bc}, {a, ab, bc}, {a, bc, c}},
                      three[4][3] = {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}};
            memcpy(triangle[made], marked == 0 ? none : marked == 1 ? one : marked == 2 ? two : three, (size_t)(marked + 1) * sizeof *triangle);
            made += marked + 1;
        }
        m->vertex_count += *count;
        m->triangle_count = made;
        free(m->triangle);
        m->triangle = triangle;
    }
    free(side);
    free(half);
    return good;
}

// --- ways ---

typedef struct Ways {
    double *cost, *length;   // (T) from the start; length [mm]
    int *from;               // (T) -1 at the start and where there is no way
    int *heap, *slot;        // binary heap by cost
    int heap_count;
} Ways;

static bool comes_first(const Ways *w, int a, int b) { return w->cost[a] < w->cost[b] || (w->cost[a] == w->cost[b] && a < b); }

static void heap_move(Ways *w, int at)
{
    int piece = w->heap[at];
    for (int up; at > 0 && comes_first(w, piece, w->heap[up = (at - 1) / 2]); at = up) {
        w->heap[at] = w->heap[up];
        w->slot[w->heap[at]] = at;
    }
    for (int down; (down = 2 * at + 1) < w->heap_count; at = down) {
        down += down + 1 < w->heap_count && comes_first(w, w->heap[down + 1], w->heap[down]);
        if (!comes_first(w, w->heap[down], piece))
            break;
        w->heap[at] = w->heap[down];
        w->slot[w->heap[at]] = at;
    }
    w->heap[at] = piece;
    w->slot[piece] = at;
}

// Dijkstra's ways from `start` to all pieces that hang together with it.
static void find_ways(const Pieces *p, int start, Ways *w)
{
    for (int t = 0; t < p->mesh.triangle_count; t++) {
        w->cost[t] = INFINITY;
        w->length[t] = 0;
        w->from[t] = w->slot[t] = -1;
    }
    w->cost[start] = 0;
    w->heap[0] = start;
    w->slot[start] = 0;
    w->heap_count = 1;
    while (w->heap_count) {
        int t = w->heap[0], last = w->heap[--w->heap_count];
        w->slot[t] = -2;
        if (w->heap_count) {
            w->heap[0] = last;
            heap_move(w, 0);
        }
        for (int k = 0; k < 3; k++) {
            int other = p->across[t][k];
            if (other < 0 || w->slot[other] == -2)
                continue;
            // a little of the way on the wall, so that balls of one centre are not free
            double length = vec3_distance(p->ball[t], p->ball[other]), r = fmin(p->radius[t], p->radius[other]);
            double cost = w->cost[t] + (length + 0.02 * vec3_distance(p->middle[t], p->middle[other])) / (r * r);
            if (cost < w->cost[other]) {
                w->cost[other] = cost;
                w->length[other] = w->length[t] + length;
                w->from[other] = t;
                if (w->slot[other] < 0) {
                    w->slot[other] = w->heap_count;
                    w->heap[w->heap_count++] = other;
                }
                heap_move(w, w->slot[other]);
            }
        }
    }
}

// --- curves ---

typedef struct Path {
    int count;
    Vec3 *point;             // from the attachment outwards
    double *radius;
} Path;

static void cover(const Pieces *p, const Path *path, bool *covered)
{
    for (int i = 0, before = -1; i < path->count; i++) {
        if (before >= 0 && i + 1 < path->count && vec3_distance(path->point[i], path->point[before]) < 0.3 * path->radius[i])
            continue;
        before = i;
        double wide = COVER * path->radius[i], same = 0.6 * path->radius[i];
        for (int t = 0; t < p->mesh.triangle_count; t++)
            covered[t] = covered[t] || vec3_distance(p->middle[t], path->point[i]) < wide || vec3_distance(p->ball[t], path->point[i]) < same;
    }
}

static double inscribed(const Pieces *p, Vec3 c)
{
    Vec3 foot;
    int triangle = 0;
    return fmax(mesh_tree_nearest(p->tree, c, INFINITY, &foot, &triangle), 1e-9);
}

// Moves the points between the walls that rays square to the curve meet, and smooths; the first point stays, as do those within `parent_radius` of it.
static void centre(const Pieces *p, Path *path, double parent_radius)
{
    for (int pass = 0; pass < CENTRING_PASSES; pass++) {
        Vec3 before = path->point[0];
        for (int i = 1; i < path->count; i++) {
            Vec3 here = path->point[i], next = path->point[i + 1 < path->count ? i + 1 : i], axis = vec3_unit(vec3_sub(next, before));
            Vec3 u = vec3_normal_to(axis), v = vec3_cross(axis, u), shift = {0, 0, 0};
            double limit = 1.5 * path->radius[i];
            if (vec3_distance(here, path->point[0]) > parent_radius)
                for (int k = 0; k < RAYS; k++) {
                    double angle = 2 * PI * k / RAYS;
                    Vec3 d = vec3_add(vec3_scale(u, cos(angle)), vec3_scale(v, sin(angle)));
                    shift = vec3_add_scaled(shift, fmin(mesh_tree_ray(p->tree, here, d, limit, NULL), limit) * 2 / RAYS, d);
                }
            Vec3 smooth = i + 1 < path->count ? vec3_scale(vec3_add(before, next), 0.5) : here;
            Vec3 moved = vec3_add_scaled(vec3_mix(here, smooth, 0.4), 0.5, shift);
            before = here;
            // never towards the wall's other side
            if (vec3_distance(moved, here) < 0.5 * path->radius[i])
                path->point[i] = moved;
            path->radius[i] = inscribed(p, path->point[i]);
        }
    }
}

// The way from the first covered piece to `tip`, in even steps; NULL point where memory lacks. `trunk`: curves so far.
static bool trace(const Pieces *p, const Ways *w, const bool *covered, const CurveSet *trunk, int tip, Path *path, double *parent_radius)
{
    int count = 1, base = tip;
    while (w->from[base] >= 0 && !covered[base]) {
        base = w->from[base];
        count++;
    }
    Vec3 *raw = malloc(((size_t)count + 1) * sizeof *raw);
    *path = (Path){0};
    if (!raw)
        return false;
    int n = count;
    for (int t = tip, left = count; left > 0; t = w->from[t])
        raw[--left] = p->ball[t];
    *parent_radius = 0;
    if (trunk->curve_count) {   // hangs on the nearest point of the curves so far
        int nearest = 0;
        for (int i = 1; i < trunk->point_count; i++)
            if (vec3_distance(trunk->point[i], raw[0]) < vec3_distance(trunk->point[nearest], raw[0]))
                nearest = i;
        raw[0] = trunk->point[nearest];
        *parent_radius = trunk->radius[nearest];
    }
    // even steps of 0.3 radii
    size_t room = 16;
    path->point = malloc(room * sizeof(Vec3));
    path->radius = malloc(room * sizeof(double));
    for (int i = 0; path->point && path->radius && i < n; i++) {
        Vec3 from = i ? raw[i - 1] : raw[0];
        double length = vec3_distance(from, raw[i]), done = 0;
        do {
            Vec3 at = length > 0 ? vec3_mix(from, raw[i], fmin(done / length, 1)) : raw[i];
            double r = inscribed(p, at);
            if (path->count == 0 || vec3_distance(at, path->point[path->count - 1]) >= 0.3 * r) {
                if ((size_t)path->count == room) {
                    room *= 2;
                    Vec3 *point = realloc(path->point, room * sizeof *point);
                    path->point = point ? point : path->point;
                    double *radius = point ? realloc(path->radius, room * sizeof *radius) : NULL;
                    path->radius = radius ? radius : path->radius;
                    if (!radius) {
                        free(raw);
                        return false;
                    }
                }
                path->point[path->count] = at;
                path->radius[path->count++] = r;
            }
            done += 0.15 * r;
        } while (done < length);
    }
    free(raw);
    return path->point && path->radius;
}

// Takes off the end that runs into the corner of a lid or tip: it lies within 1.5 radii of a larger sphere's centre (a lid's rim at 1.41). Once
// only: a vessel that tapers would be eaten up.
static void trim_end(Path *path)
{
    int tip = path->count - 1, keep = tip;
    for (int i = tip - 1; i >= 0; i--)
        if (path->radius[tip] < 0.9 * path->radius[i] && vec3_distance(path->point[tip], path->point[i]) < 1.5 * path->radius[i] &&
            path->radius[i] > 0.97 * path->radius[keep])
            keep = i;
    path->count = keep + 1;
}

static bool protrudes(const Path *path, double parent_radius)
{
    double radius = 0;
    int n = 0;
    for (int i = 0; i < path->count; i++)
        if (vec3_distance(path->point[i], path->point[0]) > parent_radius) {
            radius += path->radius[i];
            n++;
        }
    Vec3 tip = path->point[path->count - 1];
    return n > 2 && vec3_distance(tip, path->point[0]) + path->radius[path->count - 1] > COVER * parent_radius + PROTRUDES * radius / n;
}

static void path_free(Path *path)
{
    free(path->point);
    free(path->radius);
}

static int farthest(const Pieces *p, const Ways *w, const bool *covered)
{
    int best = -1;
    for (int t = 0; t < p->mesh.triangle_count; t++)
        if (!covered[t] && p->is_across[t] && isfinite(w->cost[t]) && (best < 0 || w->length[t] > w->length[best]))
            best = t;
    return best;
}

static bool find_curves(const Pieces *p, Ways *w, bool *covered, int start, CurveSet *set)
{
    find_ways(p, start, w);
    start = farthest(p, w, covered);
    if (start < 0)
        return true;
    find_ways(p, start, w);
    for (int tip; set->curve_count < CURVES_MAX && (tip = farthest(p, w, covered)) >= 0;) {
        Path path;
        double parent_radius;
        if (!trace(p, w, covered, set, tip, &path, &parent_radius)) {
            path_free(&path);
            return false;
        }
        covered[tip] = true;
        trim_end(&path);
        bool is_first = set->curve_count == 0, good = true;
        if (is_first && path.count > 2) {   // the start is an end too
            for (int i = 0; i < path.count / 2; i++) {
                int j = path.count - 1 - i;
                Vec3 point = path.point[i];
                double radius = path.radius[i];
                path.point[i] = path.point[j];
                path.radius[i] = path.radius[j];
                path.point[j] = point;
                path.radius[j] = radius;
            }
            trim_end(&path);
        }
        if (path.count > 2 && (is_first || protrudes(&path, parent_radius))) {
            centre(p, &path, parent_radius);
            good = curve_set_add(set, path.point, path.radius, path.count);
        }
        cover(p, &path, covered);
        path_free(&path);
        if (!good)
            return false;
    }
    return true;
}

// A piece of the component that is wanted: of the most area, or nearest to the root.
static int choose_start(const SurfaceMesh *mesh, const Pieces *p, const ImportOptions *options)
{
    if (options->has_root) {
        int best = 0;
        for (int t = 1; t < mesh->triangle_count; t++)
            if (vec3_distance(p->middle[t], options->root) < vec3_distance(p->middle[best], options->root))
                best = t;
        return best;
    }
    double most = -1;
    int best = 0, *queue = malloc(((size_t)mesh->triangle_count + 1) * sizeof *queue);
    bool *seen = calloc((size_t)mesh->triangle_count + 1, sizeof *seen);
    for (int t = 0; queue && seen && t < mesh->triangle_count; t++) {
        if (seen[t])
            continue;
        double area = 0;
        int head = 0, tail = 0;
        queue[tail++] = t;
        seen[t] = true;
        while (head < tail) {
            int at = queue[head++];
            area += vec3_norm(area_of(mesh, at));
            for (int k = 0; k < 3; k++)
                if (p->across[at][k] >= 0 && !seen[p->across[at][k]]) {
                    seen[p->across[at][k]] = true;
                    queue[tail++] = p->across[at][k];
                }
        }
        if (area > most) {
            most = area;
            best = t;
        }
    }
    free(queue);
    free(seen);
    return best;
}

CurveSet *mesh_centreline(const SurfaceMesh *mesh, const ImportOptions *options, const char *name, Faults *faults)
{
    Vec3 low = mesh->vertex[0], high = low;
    for (int i = 0; i < mesh->vertex_count; i++) {
        Vec3 v = mesh->vertex[i];
        low = vec3(fmin(low.x, v.x), fmin(low.y, v.y), fmin(low.z, v.z));
        high = vec3(fmax(high.x, v.x), fmax(high.y, v.y), fmax(high.z, v.z));
    }
    double size = vec3_distance(low, high);
    Pieces p = {.mesh = {mesh->vertex_count, mesh->triangle_count, malloc(((size_t)mesh->vertex_count + 1) * sizeof(Vec3)),
                         malloc(((size_t)mesh->triangle_count + 1) * sizeof(int[3]))}};
    MeshTree *tree = mesh_tree_create(mesh);
    p.tree = tree;
    bool good = tree && p.mesh.vertex && p.mesh.triangle;
    if (good) {
        memcpy(p.mesh.vertex, mesh->vertex, (size_t)mesh->vertex_count * sizeof(Vec3));
        memcpy(p.mesh.triangle, mesh->triangle, (size_t)mesh->triangle_count * sizeof(int[3]));
        good = find_balls(&p, size, options->threads);
    }
    for (int pass = 0, halved = 1; good && halved && pass < REFINE_PASSES && p.mesh.triangle_count < TRIANGLES_MAX; pass++)
        good = refine(&p, &halved) && (!halved || find_balls(&p, size, options->threads));
    size_t n = (size_t)p.mesh.triangle_count + 1;
    Ways w = {malloc(n * sizeof(double)), malloc(n * sizeof(double)), malloc(n * sizeof(int)), malloc(n * sizeof(int)), malloc(n * sizeof(int)), 0};
    bool *covered = calloc(n, sizeof *covered);
    CurveSet *set = curve_set_create();
    good = good && w.cost && w.length && w.from && w.heap && w.slot && covered && set;
    good = good && find_curves(&p, &w, covered, choose_start(&p.mesh, &p, options), set);
    if (!good)
        faults_add(faults, name, 0, 0, "not enough memory");
    else if (set->curve_count == 0) {
        faults_add(faults, name, 0, 0, "no centreline was found: the surface is no tube");
        good = false;
    }
    if (!good) {
        curve_set_free(set);
        set = NULL;
    }
    free(w.cost);
    free(w.length);
    free(w.from);
    free(w.heap);
    free(w.slot);
    free(covered);
    mesh_tree_free(tree);
    free(p.mesh.vertex);
    free(p.mesh.triangle);
    free(p.across);
    free(p.middle);
    free(p.normal);
    free(p.ball);
    free(p.radius);
    free(p.is_across);
    return set;
}

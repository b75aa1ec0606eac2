// Implements mesh_centreline.h. Symbols: d distance to the wall, s arc length along a path, r the largest d of a path outside the curves' spheres. A path is
// accepted if
//   integral (d / r)^2 ds > 1.0 r
// which is length minus about 0.7 r for a tube, 0.5 to 0.6 r in the corners of lids, 0.33 cot(angle) r in a wedge; a sac, where d increases again behind
// its neck, has 0.7 r or more and gives one curve. Tried and rejected: centres of balls that touch the wall twice, joined like the wall's triangles
// (facets of coarse surfaces separate them: 279 curves in the aortic arch); covering by spheres 1.5 d wide (they reach into touching vessels); cells
// of an octree as small as each vessel needs (as much of the arch, half as fast, short branches lost); a start from any end (short trunks
// lost).
#include "recon/surface/mesh_centreline.h"

#include "base/base.h"
#include "recon/surface/mesh_lumen.h"
#include "recon/track/path_heap.h"

#include <stdlib.h>
#include <string.h>

enum { VOXELS_MAX = 2000000, CENTRING_PASSES = 12, RAY_PAIRS = 8, CURVES_MAX = 4096, BESIDE = 2, LID_RAYS = 200 };
static const double LID_REACH = 3, LID_COSINE = 0.94, LID_SHARE = 0.15;   // LID_SHARE: a round tip has 0.06 of the half sphere within 20 degrees
static const double STEP = 0.3, BRANCH = 1.0, SAC = 0.5, SAC_WIDENS = 1.15, ATTACHED = 0.5, LEAST = 3, STUB = 0.6, STUB_WIDTH = 0.6,   // LEAST: voxels
    PINCHED = 0.25;                                                                                                                  // of the narrower side

typedef struct LineSearch {
    const Lumen *lumen;
    const MeshTree *tree;
    const SurfaceMesh *mesh; // closed
    const int *component;    // (V) component of each voxel
    int wanted;              // the component to be searched
    float *cost, *length;    // (V) cost and length [mm] of the path from the start
    int *from;               // (V) predecessor; -1 at the start and where there is no path
    int *owner;              // (V) the curve point whose inscribed sphere contains the voxel most deeply; -1: none
    float *depth;            // (V) distance to that point, in its radii
    PathHeap heap;
    int *tip, tip_count;     // voxels farther than all their neighbours, farthest first
    CurveSet *set;
    int cut_count;           // number of loops that are pinched
    Vec3 cut;                // the first of those places
    int *end, end_count;     // the voxel at each free end; the start is first
    int *end_point;          // the curve's point a radius before each end
} LineSearch;

// --- paths ---

static int compare_tips(const void *a, const void *b)
{
    const PathEntry *x = a, *y = b;
    return x->cost != y->cost ? (x->cost < y->cost) - (x->cost > y->cost) : (x->place > y->place) - (x->place < y->place);
}

static bool find_paths(LineSearch *f, int start)
{
    const Lumen *l = f->lumen;
    for (int i = 0; i < l->count; i++) {
        f->cost[i] = INFINITY;
        f->length[i] = 0;
        f->from[i] = f->owner[i] = -1;
        f->depth[i] = INFINITY;
    }
    f->cost[start] = 0;
    f->heap.count = 0;
    bool good = path_heap_push(&f->heap, (PathEntry){0, start});
    const float least = (float)(0.2 * l->h), h = (float)l->h;
    while (good && f->heap.count) {
        PathEntry at = path_heap_pop(&f->heap);
        if (at.cost > f->cost[at.place])
            continue;
        int other[LUMEN_NEIGHBOURS];
        float step[LUMEN_NEIGHBOURS];
        int count = lumen_neighbours(l, at.place, other, step);
        for (int k = 0; k < count && good; k++) {
            float d = 0.5f * (fmaxf(l->distance[at.place], least) + fmaxf(l->distance[other[k]], least)), cost = at.cost + step[k] * h / (d * d);
            if (cost < f->cost[other[k]]) {
                f->cost[other[k]] = cost;
                f->length[other[k]] = f->length[at.place] + step[k] * h;
                f->from[other[k]] = at.place;
                good = path_heap_push(&f->heap, (PathEntry){cost, other[k]});
            }
        }
    }
    return good;
}

// Finds the voxels that have no farther neighbour; the farthest comes first.
static bool find_tips(LineSearch *f)
{
    const Lumen *l = f->lumen;
    int room = 1024;
    PathEntry *entry = malloc((size_t)room * sizeof *entry);
    f->tip_count = 0;
    for (int i = 0; entry && i < l->count; i++) {
        if (f->from[i] < 0)
            continue;
        int other[LUMEN_NEIGHBOURS];
        float step[LUMEN_NEIGHBOURS];
        bool is_farthest = true;
        for (int k = 0, count = lumen_neighbours(l, i, other, step); k < count && is_farthest; k++)
            is_farthest = f->length[other[k]] < f->length[i] || (f->length[other[k]] == f->length[i] && other[k] > i);
        if (!is_farthest)
            continue;
        if (f->tip_count == room) {
            room *= 2;
            PathEntry *more = realloc(entry, (size_t)room * sizeof *more);
            if (!more) {
                free(entry);
                return false;
            }
            entry = more;
        }
        entry[f->tip_count++] = (PathEntry){f->length[i], i};
    }
    free(f->tip);
    f->tip = entry ? malloc(((size_t)f->tip_count + 1) * sizeof *f->tip) : NULL;
    if (f->tip)
        qsort(entry, (size_t)f->tip_count, sizeof *entry, compare_tips);
    for (int i = 0; f->tip && i < f->tip_count; i++)
        f->tip[i] = entry[i].place;
    free(entry);
    return f->tip != NULL;
}

// --- curves ---

typedef struct Path {
    int count, room;
    Vec3 *point;
    double *radius;
    double first_radius, last_radius;    // points within these spheres, of the curves to which the ends are attached, are not centred; 0: free end
} Path;

static double inscribed(const LineSearch *f, Vec3 p, double reach)
{
    Vec3 foot;
    int triangle = 0;
    double d = mesh_tree_nearest(f->tree, p, reach, &foot, &triangle);
    return fmax(isfinite(d) ? d : reach, 1e-3 * f->lumen->h);
}

// Appends points up to `to` in steps of STEP radii.
static bool path_to(const LineSearch *f, Path *path, Vec3 to)
{
    Vec3 from = path->count ? path->point[path->count - 1] : to;
    double length = vec3_distance(from, to), done = 0;
    for (;;) {
        double step = path->count ? STEP * fmax(path->radius[path->count - 1], f->lumen->h) : 0;
        if (path->count && done + step > length)
            return true;
        done += step;
        if (path->count == path->room) {
            path->room = 2 * path->room + 64;
            Vec3 *point = realloc(path->point, (size_t)path->room * sizeof *point);
            path->point = point ? point : path->point;
            double *radius = point ? realloc(path->radius, (size_t)path->room * sizeof *radius) : NULL;
            path->radius = radius ? radius : path->radius;
            if (!radius)
                return false;
        }
        Vec3 p = length > 0 ? vec3_mix(from, to, done / length) : to;
        path->point[path->count] = p;
        path->radius[path->count] = inscribed(f, p, INFINITY);
        path->count++;
        if (length == 0)
            return true;
    }
}

static void path_turn(Path *path)
{
    for (int i = 0, j = path->count - 1; i < j; i++, j--) {
        Vec3 point = path->point[i];
        double radius = path->radius[i];
        path->point[i] = path->point[j];
        path->radius[i] = path->radius[j];
        path->point[j] = point;
        path->radius[j] = radius;
    }
    double radius = path->first_radius;
    path->first_radius = path->last_radius;
    path->last_radius = radius;
}

static void path_free(Path *path)
{
    free(path->point);
    free(path->radius);
}

// Centres the points between the walls that pairs of opposite rays perpendicular to the curve hit, and smooths. Ends attached to other curves are fixed.
static void path_centre(const LineSearch *f, Path *path)
{
    for (int pass = 0; pass < CENTRING_PASSES; pass++) {
        // a free end follows its neighbours, except in the last passes
        double smoothing = pass < CENTRING_PASSES - 3 ? 0.4 : 0.15;
        Vec3 before = path->point[0], first = path->point[0], last = path->point[path->count - 1];
        for (int i = 0; i < path->count; i++) {
            bool is_end = i == 0 || i + 1 == path->count;
            if ((i == 0 && path->first_radius > 0) || (i + 1 == path->count && path->last_radius > 0))
                continue;
            Vec3 here = path->point[i], next = path->point[i + 1 < path->count ? i + 1 : i], axis = vec3_unit_or(vec3_sub(next, before), vec3(1, 0, 0));
            Vec3 u = vec3_normal_to(axis), v = vec3_cross(axis, u), shift = {0, 0, 0};
            double limit = 2 * path->radius[i];
            if (vec3_distance(here, first) >= path->first_radius && vec3_distance(here, last) >= path->last_radius)
                for (int k = 0; k < RAY_PAIRS; k++) {
                    double angle = PI * k / RAY_PAIRS;
                    Vec3 d = vec3_add(vec3_scale(u, same_cos(angle)), vec3_scale(v, same_sin(angle)));
                    double there = mesh_tree_ray(f->tree, here, d, limit, NULL), back = mesh_tree_ray(f->tree, here, vec3_negate(d), limit, NULL);
                    // a ray into a branch gives no information
                    if (isfinite(there) && isfinite(back))
                        shift = vec3_add_scaled(shift, (there - back) / RAY_PAIRS, d);
                }
            Vec3 smooth = is_end ? here : vec3_scale(vec3_add(before, next), 0.5), moved = vec3_add_scaled(vec3_mix(here, smooth, smoothing), 0.5, shift);
            before = here;
            // never move to the other side of a wall
            if (vec3_distance(moved, here) < 0.5 * path->radius[i])
                path->point[i] = moved;
            path->radius[i] = inscribed(f, path->point[i], INFINITY);
        }
    }
}

// Finds the centre of the flat lid ahead of a curve's last point: of the wall that rays hit with normals in one direction, each ray weighted by the area it
// represents. The wall of a tube or of a round tip has no dominant direction. `outward`: the curve's own direction.
static bool find_lid(const LineSearch *f, Vec3 from, Vec3 outward, double radius, Vec3 *middle)
{
    Vec3 u = vec3_normal_to(outward), v = vec3_cross(outward, u), hit[LID_RAYS], normal[LID_RAYS];
    double area[LID_RAYS];
    int most = 0, best = 0;
    for (int k = 0; k < LID_RAYS; k++) {
        // evenly spaced over the half sphere: multiples of the golden angle, each with its opposite
        int pair = k / 2;
        double z = 1 - (2 * pair + 1.0) / LID_RAYS, side = sqrt(1 - z * z), angle = 2.399963229728653 * pair + PI * (k % 2);
        Vec3 d = vec3_add_scaled(vec3_scale(outward, z), side, vec3_add(vec3_scale(u, same_cos(angle)), vec3_scale(v, same_sin(angle))));
        int triangle = 0;
        double there = mesh_tree_ray(f->tree, from, d, LID_REACH * radius, &triangle);
        const int *corner = f->mesh->triangle[triangle];
        Vec3 p = f->mesh->vertex[corner[0]];
        normal[k] = vec3_unit(vec3_cross(vec3_sub(f->mesh->vertex[corner[1]], p), vec3_sub(f->mesh->vertex[corner[2]], p)));
        double facing = vec3_dot(normal[k], d);
        hit[k] = vec3_add_scaled(from, isfinite(there) ? there : 0, d);
        area[k] = isfinite(there) && facing > 0.1 && vec3_dot(normal[k], outward) > 0.5 ? there * there / facing : 0;
    }
    for (int k = 0; k < LID_RAYS; k++) {
        int count = 0;
        for (int m = 0; m < LID_RAYS; m++)
            count += area[k] > 0 && area[m] > 0 && vec3_dot(normal[m], normal[k]) > LID_COSINE;
        if (count > most) {
            most = count;
            best = k;
        }
    }
    Vec3 sum = {0, 0, 0};
    double all = 0;
    for (int m = 0; m < LID_RAYS; m++)
        if (area[m] > 0 && vec3_dot(normal[m], normal[best]) > LID_COSINE) {
            sum = vec3_add_scaled(sum, area[m], hit[m]);
            all += area[m];
        }
    *middle = vec3_scale(sum, 1 / fmax(all, 1e-300));
    return most > LID_SHARE * LID_RAYS;
}

// Extends the curve from its last point to the lid ahead, which is about a radius away. Returns false if out of memory.
static bool path_lead_out(const LineSearch *f, Path *path)
{
    int tip = path->count - 1, back = tip;
    double radius = path->radius[tip], arc = 0;
    for (; back > 0 && arc < 1.5 * radius; back--)
        arc += vec3_distance(path->point[back], path->point[back - 1]);
    Vec3 from = path->point[tip], middle;
    if (!find_lid(f, from, vec3_unit(vec3_sub(from, path->point[back])), radius, &middle))
        return true;
    double length = vec3_distance(from, middle);
    if (!path_to(f, path, vec3_mix(from, middle, fmax(0, 1 - 0.2 * radius / fmax(length, 1e-300)))))
        return false;
    for (int i = tip + 1; i < path->count; i++)
        path->radius[i] = radius;
    return true;
}

// Removes the points in the corner of a lid or tip, beyond the outermost of the widest spheres that reach it (a lid's rim is 1.41 radii away).
static void path_trim(Path *path)
{
    int tip = path->count - 1, keep = tip;
    double widest = 0, in_wedge = 0;
    for (int i = tip; i >= 0; i--) {
        double apart = vec3_distance(path->point[tip], path->point[i]);
        widest = apart < 1.5 * path->radius[i] ? fmax(widest, path->radius[i]) : widest;
        in_wedge = apart < 3 * path->radius[i] ? fmax(in_wedge, path->radius[i]) : in_wedge;
    }
    // the corner of an oblique lid or of a flare is sharper: its widest sphere is up to three radii away
    if (path->radius[tip] < 0.5 * in_wedge)
        widest = in_wedge;
    // only once, otherwise a tapering vessel would be removed
    while (keep > 1 && path->radius[tip] < 0.9 * widest && path->radius[keep] < 0.95 * widest)
        keep--;
    path->count = keep + 1;
}

// Assigns the voxels within the inscribed spheres of curve points to these points.
static void own_spheres(LineSearch *f, int first_point)
{
    const Lumen *l = f->lumen;
    for (int i = first_point; i < f->set->point_count; i++) {
        Vec3 c = f->set->point[i], g = vec3_scale(vec3_sub(c, l->origin), 1 / l->h);
        double r = fmax(f->set->radius[i], l->h) / l->h;
        for (int z = (int)fmax(0, ceil(g.z - r)); z <= g.z + r && z < l->size[2]; z++)
            for (int y = (int)fmax(0, ceil(g.y - r)); y <= g.y + r && y < l->size[1]; y++) {
                int row = y + l->size[1] * z;
                double wide2 = r * r - (y - g.y) * (y - g.y) - (z - g.z) * (z - g.z), wide = wide2 > 0 ? sqrt(wide2) : -1;
                for (int k = l->row[row]; wide > 0 && k < l->row[row + 1]; k++)
                    for (int x = (int)fmax(l->run[k].first, ceil(g.x - wide)); x <= g.x + wide && x < l->run[k].end; x++) {
                        int voxel = l->run[k].base + x - l->run[k].first;
                        float depth = (float)(sqrt(fmax(0, r * r - wide2 + (x - g.x) * (x - g.x))) / r);
                        if (depth < f->depth[voxel]) {
                            f->depth[voxel] = depth;
                            f->owner[voxel] = i;
                        }
                    }
            }
    }
}

// Adds a curve. `tip`: the set's point a radius before the lid at the last point, `front`: before that at the first point.
static bool add_curve(LineSearch *f, Path *path, int *tip, int *front)
{
    int first = f->set->point_count;
    if (path->count < 2)
        return true;
    path_centre(f, path);
    int count = path->count;
    if (path->last_radius == 0 && !path_lead_out(f, path))
        return false;
    int led = path->count;
    path_turn(path);
    if (path->last_radius == 0 && !path_lead_out(f, path))
        return false;
    path_turn(path);
    *front = first + path->count - led;
    *tip = *front + count - 1;
    if (!curve_set_add(f->set, path->point, path->radius, path->count))
        return false;
    own_spheres(f, first);
    return true;
}

// Returns the first voxel on the path from a voxel that is well within a curve's sphere, or the start.
static int joining_voxel(const LineSearch *f, int voxel)
{
    while (f->from[voxel] >= 0 && !(f->owner[voxel] >= 0 && f->depth[voxel] < ATTACHED))
        voxel = f->from[voxel];
    return voxel;
}

// Returns true if the path from a tip leaves the curves as far as a vessel or an aneurysm does, by more than a few voxels.
static bool is_branch(const LineSearch *f, int tip)
{
    const float *d = f->lumen->distance;
    double widest = 0, sum = 0;
    int entry = tip;
    for (; f->from[entry] >= 0 && f->owner[entry] < 0; entry = f->from[entry])
        widest = fmax(widest, 0.5 * (d[entry] + d[f->from[entry]]));
    for (int i = tip; i != entry; i = f->from[i]) {
        double mean = 0.5 * (d[i] + d[f->from[i]]);
        sum += (f->length[i] - f->length[f->from[i]]) * mean * mean;
    }
    sum /= fmax(widest * widest, 1e-300);
    if (sum < LEAST * f->lumen->h)
        return false;
    if (sum > BRANCH * widest || (widest > SAC_WIDENS * d[entry] && sum > SAC * widest))
        return true;
    // reject a short wide stub, unless it is the end of a flattened vessel
    int own = f->owner[entry];
    bool is_stub = own >= 0 && widest > STUB_WIDTH * f->set->radius[own] && sum > STUB * widest;
    for (int e = 0; is_stub && e < f->end_count; e++)
        is_stub = vec3_distance(f->set->point[f->end_point[e]], f->set->point[own]) > 1.5 * f->set->radius[own];
    return is_stub;
}

// Returns a voxel next to the tip whose path comes from elsewhere, so that a loop closes at the tip, or -1. `join`: where the tip's path joins a curve.
static int beyond_loop(const LineSearch *f, int tip, int join)
{
    int place[3], best = -1;
    double farthest = 0;
    Vec3 at = f->set->point[f->owner[join]];
    lumen_place(f->lumen, tip, place);
    for (int dz = -BESIDE; dz <= BESIDE; dz++)
        for (int dy = -BESIDE; dy <= BESIDE; dy++)
            for (int dx = -BESIDE; dx <= BESIDE; dx++) {
                int other = lumen_voxel(f->lumen, place[0] + dx, place[1] + dy, place[2] + dz);
                int there = other >= 0 && f->component[other] == f->wanted ? joining_voxel(f, other) : -1;
                if (there < 0 || f->owner[there] < 0)
                    continue;
                int own = f->owner[there];
                double apart = vec3_distance(f->set->point[own], at) / (f->set->radius[own] + f->set->radius[f->owner[join]]);
                // the path must come from the other side, not from further upstream in the same vessel
                if (apart > 1 && apart > farthest) {
                    farthest = apart;
                    best = other;
                }
            }
    return best;
}

static bool path_along(const LineSearch *f, Path *path, int tip, int join)
{
    bool good = true;
    for (int i = tip; good && i != join; i = f->from[i])
        good = path_to(f, path, lumen_middle(f->lumen, i));
    return good;
}

static bool path_end_at(const LineSearch *f, Path *path, int point)
{
    Vec3 p = f->set->point[point];
    double radius = f->set->radius[point];
    if (!path_to(f, path, p))
        return false;
    int last = path->count - 1;
    path->point[last] = p;
    path->radius[last] = path->last_radius = radius;
    return true;
}

// Creates the path from the point where a tip's path joins a curve, through the loop that closes at the tip, to the joining point on the other side.
static bool path_through(const LineSearch *f, Path *path, int tip, int join, int other)
{
    Path back = {0};
    int there = joining_voxel(f, other);
    bool good = path_along(f, path, tip, join) && path_end_at(f, path, f->owner[join]) && path_along(f, &back, other, there);
    path_turn(path);
    for (int i = 0; good && i < back.count; i++)
        good = path_to(f, path, back.point[i]);
    path_free(&back);
    return good && path_end_at(f, path, f->owner[there]);
}

// Returns true if two vessels only touch: the path, outside the spheres of its parent curve, is somewhere far narrower than on both sides.
static bool is_pinched(const Path *path, Vec3 *place)
{
    Vec3 first = path->point[0], last = path->point[path->count - 1];
    int least = -1;
    for (int i = 0; i < path->count; i++)
        if (vec3_distance(path->point[i], first) > path->first_radius && vec3_distance(path->point[i], last) > path->last_radius &&
            (least < 0 || path->radius[i] < path->radius[least]))
            least = i;
    double before = path->first_radius, after = path->last_radius;
    for (int i = 0; i < path->count; i++)
        if (i < least)
            before = fmax(before, path->radius[i]);
        else
            after = fmax(after, path->radius[i]);
    *place = path->point[least >= 0 ? least : 0];
    return least >= 0 && path->radius[least] < PINCHED * fmin(before, after);
}

static bool add_branch(LineSearch *f, int tip)
{
    Path path = {0};
    int join = joining_voxel(f, tip);
    if (f->owner[join] < 0)
        return true;
    int other = beyond_loop(f, tip, join);
    bool good = true;
    if (other >= 0) {
        good = path_through(f, &path, tip, join, other);
        if (good)
            path_centre(f, &path);
        Vec3 place;
        if (good && is_pinched(&path, &place)) {
            if (f->cut_count++ == 0)
                f->cut = place;
            path_free(&path);
            path = (Path){0};
            other = -1;
        }
    }
    if (good && other < 0) {
        good = path_along(f, &path, tip, join) && path_end_at(f, &path, f->owner[join]);
        path_turn(&path);
        path_trim(&path);
    }
    int first = f->set->curve_count, last = 0, front = 0;
    good = good && add_curve(f, &path, &last, &front);
    if (good && other < 0 && f->set->curve_count > first) {
        f->end[f->end_count] = tip;
        f->end_point[f->end_count++] = last;
    }
    path_free(&path);
    return good;
}

// Finds all curves of the lumen, starting from a voxel at an end.
static bool find_curves(LineSearch *f, int start)
{
    curve_set_free(f->set);
    f->set = curve_set_create();
    if (!f->set || !find_paths(f, start) || !find_tips(f))
        return false;
    free(f->end);
    free(f->end_point);
    f->end = malloc(((size_t)f->tip_count + 2) * sizeof *f->end);
    f->end_point = malloc(((size_t)f->tip_count + 2) * sizeof *f->end_point);
    f->end_count = f->cut_count = 0;
    if (!f->end || !f->end_point)
        return false;
    if (f->tip_count == 0)
        return true;
    Path trunk = {0};
    bool good = path_along(f, &trunk, f->tip[0], -1);
    path_trim(&trunk);
    path_turn(&trunk);
    path_trim(&trunk);
    path_turn(&trunk);
    int last = 0, front = 0;
    good = good && add_curve(f, &trunk, &last, &front);
    path_free(&trunk);
    if (f->set->curve_count == 0)
        return good;
    f->end_count = 2;
    f->end[0] = start;
    f->end_point[0] = front;
    f->end[1] = f->tip[0];
    f->end_point[1] = last;
    for (int i = 1; good && i < f->tip_count && f->set->curve_count < CURVES_MAX; i++)
        if (is_branch(f, f->tip[i]))
            good = add_branch(f, f->tip[i]);
    return good;
}

// --- components ---

// Numbers the lumens. Returns the requested one, or -1 if there is none or if out of memory. `last`: a voxel at one of its ends.
static int label(const Lumen *l, const ImportOptions *options, int *component, int *last)
{
    int *queue = malloc(((size_t)l->count + 1) * sizeof *queue), count = 0, most = 0, wanted = -1, widest = -1, nearest = -1;
    double least = INFINITY;
    for (int i = 0; i < l->count; i++) {
        component[i] = -1;
        double d = options->has_root ? vec3_distance(lumen_middle(l, i), options->root) : INFINITY;
        if (d < least) {
            least = d;
            nearest = i;
        }
    }
    // the last pass starts from the widest voxel of the wanted lumen: the voxel reached last is an end
    for (int seed = 0; queue && seed <= l->count; seed++) {
        if (seed == l->count) {
            wanted = nearest >= 0 ? component[nearest] : wanted;
            for (int i = 0; i < l->count; i++)
                if (component[i] == wanted && (widest < 0 || l->distance[i] > l->distance[widest]))
                    widest = i;
            for (int i = 0; i < l->count; i++)
                component[i] = component[i] == wanted ? -1 : component[i];
            if (widest < 0)
                break;
        }
        int at = seed < l->count ? seed : widest, head = 0, tail = 0, number = seed < l->count ? count : wanted;
        if (component[at] >= 0)
            continue;
        queue[tail++] = at;
        component[at] = number;
        while (head < tail) {
            int other[LUMEN_NEIGHBOURS];
            float step[LUMEN_NEIGHBOURS];
            for (int k = 0, n = lumen_neighbours(l, queue[head++], other, step); k < n; k++)
                if (component[other[k]] < 0) {
                    component[other[k]] = number;
                    queue[tail++] = other[k];
                }
        }
        if (tail > most) {
            most = tail;
            wanted = number;
        }
        count++;
        *last = queue[tail - 1];
    }
    free(queue);
    return widest < 0 ? -1 : wanted;
}

// Returns the voxel at the end nearest to the requested root, else at the widest end.
static int choose_start(const LineSearch *f, const ImportOptions *options)
{
    int best = f->end[0];
    double most = -INFINITY;
    for (int e = 0; e < f->end_count; e++) {
        double value = options->has_root ? -vec3_distance(lumen_middle(f->lumen, f->end[e]), options->root) : f->set->radius[f->end_point[e]];
        if (value > most) {
            most = value;
            best = f->end[e];
        }
    }
    return best;
}

CurveSet *mesh_centreline(const SurfaceMesh *mesh, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults)
{
    SurfaceMesh closed;
    bool good = mesh_close(mesh, &closed);
    MeshTree *tree = good ? mesh_tree_create(&closed) : NULL;
    Lumen *l = tree ? lumen_create(&closed, tree, VOXELS_MAX, options->threads) : NULL;
    CurveSet *set = NULL;
    if (l) {
        size_t n = (size_t)l->count + 1;
        int *component = malloc(n * sizeof *component), start = -1;
        LineSearch f = {.lumen = l,
                        .tree = tree,
                        .mesh = &closed,
                        .component = component,
                        .cost = malloc(n * sizeof(float)),
                        .length = malloc(n * sizeof(float)),
                        .from = malloc(n * sizeof(int)),
                        .owner = malloc(n * sizeof(int)),
                        .depth = malloc(n * sizeof(float))};
        good = component && f.cost && f.length && f.from && f.owner && f.depth;
        f.wanted = good ? label(l, options, component, &start) : -1;
        // search once from any end to find the ends, then from the root
        if (good && f.wanted >= 0) {
            good = find_curves(&f, start);
            int root = good && f.end_count ? choose_start(&f, options) : start;
            if (good && root != start)
                good = find_curves(&f, root);
            set = good ? f.set : NULL;
            if (f.cut_count) {
                report->loop = report->loop_count ? report->loop : f.cut;
                report->loop_count += f.cut_count;
            }
        }
        if (!set)
            curve_set_free(f.set);
        free(component);
        free(f.cost);
        free(f.length);
        free(f.from);
        free(f.owner);
        free(f.depth);
        free(f.heap.entry);
        free(f.tip);
        free(f.end);
        free(f.end_point);
    }
    if (!l || !good)
        faults_add(faults, name, 0, 0, "not enough memory");
    else if (!set || set->curve_count == 0) {
        faults_add(faults, name, 0, 0, "no centreline was found: the surface encloses no lumen; expected a closed tube, or one that is open at its ends");
        curve_set_free(set);
        set = NULL;
    }
    lumen_free(l);
    mesh_tree_free(tree);
    free(closed.vertex);
    free(closed.triangle);
    return set;
}

// A given curve is kept except where the surface contradicts it:
//   - a stretch that leaves the lumen sideways is moved back to the middle;
//   - a stretch that extends beyond a vessel's end is cut off there;
//   - a sample is moved to the centroid of its cross-section of the lumen (16 rays perpendicular to the curve) if the wall on one side is nearer than 0.15 of
//     the median radius, or if it is nearer than half of it and the centroid has 1.5 times the clearance; near a curve's ends only the former applies.
// Moving every sample to the middle was tried and rejected: it bends exact curves at ends and ostia by half a radius.
#include "recon/surface/import_curves.h"

#include "base/base.h"

#include <stdlib.h>

static const double STEP = 0.3, GRAZE = 0.15, BESIDE = 0.5, GAIN = 1.5;

// --- the curves' frame ---

static double inside_share(const SurfaceMesh *mesh, const CurveSet *set, double sx, double scale)
{
    // limit the number of points, because each winding number visits all triangles
    int wanted = (int)fmin(fmax(2e7 / (mesh->triangle_count + 1), 20), 400), step = set->point_count / wanted + 1, inside = 0, count = 0;
    for (int i = 0; i < set->point_count; i += step, count++) {
        Vec3 p = set->point[i];
        inside += mesh_winding(mesh, vec3(sx * scale * p.x, sx * scale * p.y, scale * p.z)) > 0.5;
    }
    return (double)inside / count;
}

static double extent(const Vec3 *point, int count)
{
    Vec3 low = point[0], high = point[0];
    for (int i = 1; i < count; i++) {
        low = vec3(fmin(low.x, point[i].x), fmin(low.y, point[i].y), fmin(low.z, point[i].z));
        high = vec3(fmax(high.x, point[i].x), fmax(high.y, point[i].y), fmax(high.z, point[i].z));
    }
    return vec3_distance(low, high);
}

bool import_place_curves(const SurfaceMesh *mesh, double scale, CurveSet *set, ImportReport *report, const char *name, Faults *faults)
{
    const double frame[4][2] = {{1, 1}, {-1, 1}, {1, scale}, {-1, scale}};
    int best = 0;
    double most = -1;
    // curves in another unit may be a speck that happens to lie inside
    double least_extent = 0.01 * extent(mesh->vertex, mesh->vertex_count), curves = extent(set->point, set->point_count);
    for (int f = 0; f < (scale != 1 ? 4 : 2); f++) {
        double share = curves * frame[f][1] < least_extent ? 0 : inside_share(mesh, set, frame[f][0], frame[f][1]);
        // keep the frame unchanged unless that is clearly wrong
        if (share > most + (f ? 0.25 : 0)) {
            most = share;
            best = f;
        }
    }
    report->inside_percent = 100 * most;
    report->curves_flipped = frame[best][0] < 0;
    report->curves_scaled = frame[best][1];
    if (most < 0.5) {
        faults_add(faults, name, 0, 0,
                   "only %.0f %% of the centrelines' points lie inside the surface, with or without x and y negated: they belong to another frame or vessel",
                   100 * most);
        return false;
    }
    for (int i = 0; i < set->point_count; i++) {
        double s = frame[best][0] * frame[best][1];
        set->point[i] = vec3(s * set->point[i].x, s * set->point[i].y, frame[best][1] * set->point[i].z);
        set->radius[i] *= frame[best][1];
    }
    return true;
}

// --- in the lumen ---

static Vec3 normal_of(const SurfaceMesh *mesh, int t)
{
    Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
    return vec3_unit(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
}

// Decides by the side of the wall that rays hit first: p is in the lumen if most rays that hit the wall hit its inner side.
static bool is_in_lumen(const SurfaceMesh *mesh, const MeshTree *tree, Vec3 p)
{
    const Vec3 axis[3] = {{0.9341, 0.2717, 0.2318}, {-0.2453, 0.9611, -0.1270}, {-0.2594, 0.0622, 0.9638}};
    int from_within = 0, met = 0;
    for (int k = 0; k < 6; k++) {
        Vec3 direction = vec3_unit(vec3_scale(axis[k / 2], k % 2 ? -1 : 1));
        int t = 0;
        if (!isfinite(mesh_tree_ray(tree, p, direction, INFINITY, &t)))
            continue;
        met++;
        from_within += vec3_dot(normal_of(mesh, t), direction) > 0;
    }
    return from_within >= 2 && 2 * from_within > met;
}

double section_radius(const MeshTree *tree, Vec3 p, Vec3 tangent, double reach, double *least, Vec3 *centroid)
{
    Vec3 u = vec3_normal_to(tangent), v = vec3_cross(tangent, u), moment = {0, 0, 0};
    double sorted[SECTION_RAYS], length[SECTION_RAYS], area = 0;
    int met = 0;
    for (int k = 0; k < SECTION_RAYS; k++) {
        double angle = 2 * PI * k / SECTION_RAYS;
        Vec3 direction = vec3_add(vec3_scale(u, same_cos(angle)), vec3_scale(v, same_sin(angle)));
        length[k] = mesh_tree_ray(tree, p, direction, reach, NULL);
        if (isfinite(length[k]))   // otherwise the ray leaves through an opening
            sorted[met++] = length[k];
    }
    *least = 0;
    *centroid = p;
    if (met < SECTION_RAYS / 4)
        return 0;
    sort_doubles(sorted, (size_t)met);
    double median = 0.5 * (sorted[(met - 1) / 2] + sorted[met / 2]);
    for (int k = 0; k < SECTION_RAYS; k++) {
        // a branch's ostium does not belong to the cross-section
        double angle = 2 * PI * k / SECTION_RAYS, d = fmin(length[k], 1.6 * median);
        moment = vec3_add_scaled(moment, d * d * d / 3, vec3_add(vec3_scale(u, same_cos(angle)), vec3_scale(v, same_sin(angle))));
        area += d * d / 2;
    }
    *least = sorted[0];
    *centroid = vec3_add_scaled(p, 1 / fmax(area, 1e-300), moment);
    return median;
}

// Moves p to the middle of the chord that starts perpendicular to the wall at the nearest point. Returns false if the wall is perpendicular to the curve
// there (the curve left through an end).
static bool back_into_lumen(const SurfaceMesh *mesh, const MeshTree *tree, Vec3 tangent, double radius, Vec3 *p)
{
    Vec3 foot = *p;
    int t = 0;
    double off = mesh_tree_nearest(tree, *p, 2 * radius, &foot, &t);
    if (!isfinite(off) || fabs(vec3_dot(vec3_sub(foot, *p), tangent)) > 0.7 * off)
        return false;
    Vec3 inward = vec3_negate(normal_of(mesh, t));
    if (fabs(vec3_dot(inward, tangent)) > 0.7)   // the nearest wall is a lid
        return false;
    double chord = mesh_tree_ray(tree, vec3_add_scaled(foot, 1e-4 * radius, inward), inward, 4 * radius, NULL);
    if (!isfinite(chord))
        return false;
    *p = vec3_add_scaled(foot, 0.5 * chord, inward);
    return true;
}

enum { KEPT, MOVED, LOST };

static int clear_sample(const SurfaceMesh *mesh, const MeshTree *tree, Vec3 tangent, double wide, bool near_end, Vec3 *p)
{
    bool moved = !is_in_lumen(mesh, tree, *p);
    if (moved && (!back_into_lumen(mesh, tree, tangent, wide, p) || !is_in_lumen(mesh, tree, *p)))
        return LOST;
    for (int pass = 0; pass < 3; pass++) {
        double least;
        Vec3 centroid, foot;
        int t = 0;
        // a lid at the curve's end does not count as grazing
        if (isfinite(mesh_tree_nearest(tree, *p, wide, &foot, &t)) && fabs(vec3_dot(normal_of(mesh, t), tangent)) > 0.7)
            break;
        double median = section_radius(tree, *p, tangent, 4 * wide, &least, &centroid);
        if (least > BESIDE * median || !is_in_lumen(mesh, tree, centroid))
            break;
        bool grazes = moved || least < GRAZE * median;
        if (!grazes && (near_end || mesh_tree_nearest(tree, centroid, INFINITY, &foot, &t) < GAIN * mesh_tree_nearest(tree, *p, INFINITY, &foot, &t)))
            break;
        *p = centroid;
        moved = true;
    }
    return moved ? MOVED : KEPT;
}

// Samples curve c in steps of STEP widths into arrays of `room` entries. Returns the number of samples.
static int sample_curve(const CurveSet *set, const MeshTree *tree, int c, double floor_step, int room, Vec3 *point, double *given, double *wide)
{
    int n = 0;
    for (int i = set->offset[c]; i < set->offset[c + 1]; i++) {
        int before = i > set->offset[c] ? i - 1 : i, t = 0;
        Vec3 from = set->point[before], to = set->point[i], foot;
        double local = fmax(set->radius[i], mesh_tree_nearest(tree, to, INFINITY, &foot, &t));
        int steps = before < i ? (int)fmax(1, ceil(vec3_distance(from, to) / fmax(STEP * local, floor_step))) : 1;
        for (int k = 1; k <= steps && n + 1 < room; k++, n++) {
            double share = (double)k / steps, a = set->radius[before], b = set->radius[i];
            point[n] = vec3_mix(from, to, share);
            given[n] = a > 0 && b > 0 ? a + share * (b - a) : 0;
            wide[n] = local;
        }
    }
    return n;
}

CurveSet *curves_in_lumen(const SurfaceMesh *mesh, const MeshTree *tree, const CurveSet *set, ImportReport *report)
{
    CurveSet *out = curve_set_create();
    double total = 0;
    for (int i = 0; i + 1 < set->point_count; i++)
        total += vec3_distance(set->point[i], set->point[i + 1]);
    size_t room = 300000 + 2 * (size_t)set->point_count;
    Vec3 *point = malloc(room * sizeof *point), *place = malloc(room * sizeof *place);
    double *given = malloc(room * sizeof *given), *wide = malloc(room * sizeof *wide);
    unsigned char *state = malloc(room);
    bool good = out && point && place && given && wide && state;
    for (int c = 0; good && c < set->curve_count; c++) {
        int n = sample_curve(set, tree, c, total / 100000, (int)room, point, given, wide), kept = 0;
        for (int i = 0; i < n; i++) {
            Vec3 tangent = vec3_unit(vec3_sub(point[i + 2 < n ? i + 2 : n - 1], point[i > 2 ? i - 2 : 0]));
            place[i] = point[i];
            double from_end = fmin(vec3_distance(point[i], point[0]), vec3_distance(point[i], point[n - 1]));
            state[i] = (unsigned char)clear_sample(mesh, tree, tangent, wide[i], from_end < 3 * wide[i], &place[i]);
            report->moved_samples += state[i] == MOVED;
            report->cut_samples += state[i] == LOST;
        }
        report->samples += n;
        for (int i = 0; i < n; i++)
            if (state[i] != LOST) {
                place[kept] = place[i];
                given[kept] = given[i];
                state[kept++] = state[i];
            }
        // moved stretches are smoothed with their surroundings
        for (int pass = 0; pass < 6; pass++)
            for (int i = 1; i + 1 < kept; i++)
                if (state[i - 1] == MOVED || state[i] == MOVED || state[i + 1] == MOVED)
                    place[i] = vec3_mix(place[i], vec3_scale(vec3_add(place[i - 1], place[i + 1]), 0.5), 0.5);
        good = kept < 2 || curve_set_add(out, place, given, kept);
    }
    free(point);
    free(place);
    free(given);
    free(wide);
    free(state);
    if (good)
        return out;
    curve_set_free(out);
    return NULL;
}

// See import_surface.h. Nodes stand every `spacing` inscribed radii along the skeleton. The wall's triangles are sampled with a density of
// points_per_node / (2 pi r spacing r), r of the nearest node, by a low-discrepancy sequence (Roberts' R2, folded into the triangle). A node that gets
// fewer than eight points lies within its parent's lumen and is left out: its children hang on the parent. The radius is then the median distance
// of the node's points from its axis, between 1 and 1.6 times the inscribed one (ostia and kissing walls pull the median away).
#include "recon/import_surface.h"

#include "recon/import_skeleton.h"
#include "recon/mesh_tree.h"
#include "recon/parallel.h"

#include <stdlib.h>
#include <string.h>

enum { CANDIDATES = 6, LEAST_POINTS = 8, PASSES = 4, CHUNK = 256 };
static const double POINTS_MAX = 4e6;

ImportOptions import_default_options(void) { return (ImportOptions){.spacing = 0.5, .points_per_node = 108}; }

// --- the curves' frame ---

static double inside_share(const SurfaceMesh *mesh, const CurveSet *set, double sx, double scale)
{
    // winding numbers cost all triangles each
    int wanted = (int)fmin(fmax(2e7 / (mesh->triangle_count + 1), 20), 400), step = set->point_count / wanted + 1, inside = 0, count = 0;
    for (int i = 0; i < set->point_count; i += step, count++) {
        Vec3 p = set->point[i];
        inside += mesh_winding(mesh, vec3(sx * scale * p.x, sx * scale * p.y, scale * p.z)) > 0.5;
    }
    return (double)inside / count;
}

bool import_place_curves(const SurfaceMesh *mesh, double scale, CurveSet *set, ImportReport *report, const char *name, Faults *faults)
{
    const double frame[4][2] = {{1, 1}, {-1, 1}, {1, scale}, {-1, scale}};
    int best = 0;
    double most = -1;
    for (int f = 0; f < (scale != 1 ? 4 : 2); f++) {
        double share = inside_share(mesh, set, frame[f][0], frame[f][1]);
        // as they stand, unless that is clearly wrong
        if (share > most + (f ? 0.25 : 0)) {
            most = share;
            best = f;
        }
    }
    report->inside_percent = 100 * most;
    report->curves_flipped = frame[best][0] < 0;
    report->curves_scaled = frame[best][1];
    if (most < 0.5) {
        faults_add(faults, name, 0, 0, "only %.0f %% of the centrelines' points lie inside the surface, with x and y negated or not: they are of another frame or vessel",
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

// --- curves that graze the wall ---

// Where a curve lies beside or beyond the wall (a coarse surface cuts its bends' corners) it goes to the middle of the chord that starts square to the
// wall at the nearest point. `radius`: what the vessel has about there; chords that are longer cross another lumen.
static Vec3 to_middle(const SurfaceMesh *mesh, const MeshTree *tree, Vec3 p, double radius, bool *moved)
{
    for (int pass = 0; pass < 3; pass++) {
        Vec3 foot = p;
        int t = 0;
        double off = mesh_tree_nearest(tree, p, INFINITY, &foot, &t);
        Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
        Vec3 inward = vec3_negate(vec3_unit(vec3_cross(vec3_sub(b, a), vec3_sub(c, a))));
        bool is_inside = vec3_dot(vec3_sub(p, foot), inward) > 0;
        double chord = mesh_tree_ray(tree, vec3_add_scaled(foot, 1e-4 * radius, inward), inward, 4 * radius, NULL);
        if (!isfinite(chord) || (is_inside && off > 0.3 * chord))
            break;
        p = vec3_add_scaled(foot, 0.5 * chord, inward);
        *moved = true;
    }
    return p;
}

// The curves in steps of 0.3 radii, what grazes the wall moved to the middle; NULL where memory lacks.
static CurveSet *clear_curves(const SurfaceMesh *mesh, const MeshTree *tree, const CurveSet *set, ImportReport *report)
{
    CurveSet *out = curve_set_create();
    double total = 0;
    for (int i = 0; i + 1 < set->point_count; i++)
        total += vec3_distance(set->point[i], set->point[i + 1]);
    size_t room = 300000 + 2 * (size_t)set->point_count;
    Vec3 *point = malloc(room * sizeof *point);
    double *radius = malloc(room * sizeof *radius);
    bool *moved = calloc(room, sizeof *moved), good = out && point && radius && moved;
    for (int c = 0; good && c < set->curve_count; c++) {
        int n = 0;
        for (int i = set->offset[c]; i < set->offset[c + 1]; i++) {
            Vec3 from = set->point[i > set->offset[c] ? i - 1 : i], to = set->point[i], foot;
            int t = 0;
            double wide = fmax(set->radius[i], mesh_tree_nearest(tree, to, INFINITY, &foot, &t)), length = vec3_distance(from, to);
            int steps = i > set->offset[c] ? (int)fmax(1, ceil(length / fmax(0.3 * wide, total / 100000))) : 1;
            for (int k = 1; k <= steps && n + 1 < (int)room; k++) {
                moved[n] = false;
                radius[n] = wide;
                point[n] = to_middle(mesh, tree, vec3_mix(from, to, (double)k / steps), wide, &moved[n]);
                report->moved_samples += moved[n];
                report->samples++;
                n++;
            }
        }
        // moved stretches are smoothed with their surroundings
        for (int pass = 0; pass < 6; pass++)
            for (int i = 1; i + 1 < n; i++)
                if (moved[i - 1] || moved[i] || moved[i + 1])
                    point[i] = vec3_mix(point[i], vec3_scale(vec3_add(point[i - 1], point[i + 1]), 0.5), 0.5);
        good = curve_set_add(out, point, radius, n);
    }
    free(point);
    free(radius);
    free(moved);
    if (good)
        return out;
    curve_set_free(out);
    return NULL;
}

// --- nodes ---

typedef struct Nodes {
    int count;
    Vec3 *center, *direction;
    double *radius;
    int *parent;
    bool *is_end;            // a leaf or the root: kept
} Nodes;

static bool choose_nodes(Skeleton *s, double spacing, Nodes *nodes)
{
    size_t room = (size_t)s->count + 1;
    int *node = malloc(room * sizeof *node);
    double *arc = calloc(room, sizeof *arc);
    bool *has_child = calloc(room, sizeof *has_child);
    *nodes = (Nodes){0, calloc(room, sizeof(Vec3)), calloc(room, sizeof(Vec3)), calloc(room, sizeof(double)), calloc(room, sizeof(int)),
                     calloc(room, sizeof(bool))};
    bool good = node && arc && has_child && nodes->center && nodes->direction && nodes->radius && nodes->parent && nodes->is_end;
    for (int i = 1; good && i < s->count; i++)
        has_child[s->parent[i]] = true;
    // a graze that is left is no stenosis of a tenth: radii fall along the tree by no more than half a step's length
    for (int i = 1; good && i < s->count; i++)
        s->radius[i] = fmax(s->radius[i], s->radius[s->parent[i]] - 0.5 * vec3_distance(s->point[i], s->point[s->parent[i]]));
    for (int i = s->count - 1; good && i > 0; i--)
        s->radius[s->parent[i]] = fmax(s->radius[s->parent[i]], s->radius[i] - 0.5 * vec3_distance(s->point[i], s->point[s->parent[i]]));
    for (int i = 0; good && i < s->count; i++) {
        int up = s->parent[i];
        double since = up < 0 ? INFINITY : arc[up] + vec3_distance(s->point[i], s->point[up]);
        bool is_end = up < 0 || !has_child[i];
        arc[i] = since;
        node[i] = up < 0 ? -1 : node[up];
        if (!is_end && since < spacing * s->radius[i])
            continue;
        int n = nodes->count;
        // a leaf too near to the node before it takes that node's place
        if (up >= 0 && !has_child[i] && since < 0.5 * spacing * s->radius[i] && node[up] == n - 1 && !nodes->is_end[n - 1])
            nodes->count = n = n - 1;
        else
            nodes->parent[n] = node[i];
        nodes->center[n] = s->point[i];
        nodes->radius[n] = s->radius[i];
        nodes->is_end[n] = is_end;
        nodes->count++;
        node[i] = n;
        arc[i] = 0;
    }
    free(node);
    free(arc);
    free(has_child);
    return good;
}

static void nodes_free(Nodes *nodes)
{
    free(nodes->center);
    free(nodes->direction);
    free(nodes->radius);
    free(nodes->parent);
    free(nodes->is_end);
}

// Along the vessel: from the parent, and to the child that goes on straightest.
static void set_directions(Nodes *nodes)
{
    for (int i = 0; i < nodes->count; i++) {
        Vec3 in = nodes->parent[i] >= 0 ? vec3_unit(vec3_sub(nodes->center[i], nodes->center[nodes->parent[i]])) : vec3(0, 0, 0), out = {0, 0, 0};
        double straightest = -2;
        for (int k = i + 1; k < nodes->count; k++) {
            if (nodes->parent[k] != i)
                continue;
            Vec3 to = vec3_unit(vec3_sub(nodes->center[k], nodes->center[i]));
            double value = nodes->parent[i] >= 0 ? vec3_dot(to, in) : nodes->radius[k];
            if (value > straightest) {
                straightest = value;
                out = to;
            }
        }
        nodes->direction[i] = vec3_unit_or(vec3_add(in, out), vec3(1, 0, 0));
    }
}

// --- points ---

typedef struct Sampling {
    const Nodes *nodes;
    const Wall *wall;
    double points_per_node, spacing;
    double *weight;          // (T) points wanted of each triangle
    long count;
    Vec3 *point;             // (P)
    int *owner;              // (P) -1: no node sees it
} Sampling;

// The nodes that are nearest to p by power distance |p - c|^2 - r^2, best first.
static int nearest_nodes(const Nodes *nodes, Vec3 p, int wanted, int *node)
{
    double value[CANDIDATES];
    int count = 0;
    for (int i = 0; i < nodes->count; i++) {
        double power = vec3_norm2(vec3_sub(p, nodes->center[i])) - nodes->radius[i] * nodes->radius[i];
        if (count == wanted && power >= value[count - 1])
            continue;
        int at = count < wanted ? count++ : count - 1;
        for (; at > 0 && value[at - 1] > power; at--) {
            value[at] = value[at - 1];
            node[at] = node[at - 1];
        }
        value[at] = power;
        node[at] = i;
    }
    return count;
}

static void weigh_triangle(void *context, long t)
{
    Sampling *s = context;
    const SurfaceMesh *mesh = &s->wall->mesh;
    Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
    double area = 0.5 * vec3_norm(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
    int node;
    nearest_nodes(s->nodes, vec3_scale(vec3_add(a, vec3_add(b, c)), 1.0 / 3), 1, &node);
    double r = s->nodes->radius[node];
    s->weight[t] = area * s->points_per_node / (2 * PI * r * r * s->spacing);
}

static void find_owners(void *context, long chunk)
{
    Sampling *s = context;
    for (long i = chunk * CHUNK; i < s->count && i < (chunk + 1) * CHUNK; i++) {
        int node[CANDIDATES], count = nearest_nodes(s->nodes, s->point[i], CANDIDATES, node);
        s->owner[i] = -1;
        for (int k = 0; k < count && s->owner[i] < 0; k++) {
            Vec3 from = s->nodes->center[node[k]], to = vec3_sub(s->point[i], from);
            double length = vec3_norm(to);
            if (length > 2.5 * s->nodes->radius[node[k]])
                continue;
            // the wall is seen where nothing stands clearly before it
            double hit = length > 0 ? mesh_tree_ray(s->wall->tree, from, vec3_scale(to, 1 / length), length, NULL) : INFINITY;
            if (!(hit < length - 0.1 * s->nodes->radius[node[k]]))
                s->owner[i] = node[k];
        }
    }
}

static bool sample_wall(Sampling *s, int threads, ImportReport *report, const char *name, Faults *faults)
{
    const SurfaceMesh *mesh = &s->wall->mesh;
    s->weight = calloc((size_t)mesh->triangle_count + 1, sizeof *s->weight);
    if (s->weight)
        parallel_for(threads, mesh->triangle_count, weigh_triangle, s, NULL);
    double total = 0;
    for (int t = 0; s->weight && t < mesh->triangle_count; t++)
        total += s->weight[t];
    if (total > POINTS_MAX) {
        faults_add(faults, name, 0, 0, "would take %.0f points: the centrelines leave wide parts of the surface out; a centreline in every vessel is valid", total);
        return false;
    }
    s->point = calloc((size_t)total + 2, sizeof *s->point);
    s->owner = calloc((size_t)total + 2, sizeof *s->owner);
    if (!s->weight || !s->point || !s->owner) {
        faults_add(faults, name, 0, 0, "not enough memory");
        return false;
    }
    double due = 0.5, u = 0.5, v = 0.5;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (due += s->weight[t]; due >= 1 && s->count < (long)total + 1; due -= 1) {
            Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
            u = fmod(u + 0.7548776662466927, 1);
            v = fmod(v + 0.5698402909980532, 1);
            double x = u + v > 1 ? 1 - u : u, y = u + v > 1 ? 1 - v : v;
            s->point[s->count++] = vec3_add(a, vec3_add(vec3_scale(vec3_sub(b, a), x), vec3_scale(vec3_sub(c, a), y)));
        }
    report->sampled_points = s->count;
    return true;
}

// Leaves out the nodes (but the root) with too few points; returns how many.
static int drop_nodes(Nodes *nodes, const long *points, int *place)
{
    int kept = 0, before = nodes->count;
    for (int i = 0; i < nodes->count; i++) {
        int parent = nodes->parent[i] < 0 ? -1 : place[nodes->parent[i]];
        if (i > 0 && points[i] < LEAST_POINTS) {
            place[i] = parent;
            continue;
        }
        nodes->center[kept] = nodes->center[i];
        nodes->radius[kept] = nodes->radius[i];
        nodes->is_end[kept] = nodes->is_end[i];
        nodes->parent[kept] = parent;
        place[i] = kept++;
    }
    nodes->count = kept;
    return before - kept;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static VesselTree *make_tree(const Nodes *nodes, const Sampling *s, ImportReport *report)
{
    long kept = 0;
    for (long i = 0; i < s->count; i++)
        kept += s->owner[i] >= 0;
    report->unseen_points = s->count - kept;
    VesselTree *tree = vessel_tree_create(nodes->count, kept, 0);
    double *aside = calloc((size_t)kept + 1, sizeof *aside);
    if (!tree || !aside) {
        vessel_tree_free(tree);
        free(aside);
        return NULL;
    }
    for (long i = 0; i < s->count; i++)
        if (s->owner[i] >= 0)
            tree->point_offset[s->owner[i] + 1]++;
    for (int n = 0; n < nodes->count; n++)
        tree->point_offset[n + 1] += tree->point_offset[n];
    for (long i = 0; i < s->count; i++)
        if (s->owner[i] >= 0)
            tree->point[tree->point_offset[s->owner[i]]++] = s->point[i];
    memmove(tree->point_offset + 1, tree->point_offset, (size_t)nodes->count * sizeof *tree->point_offset);
    tree->point_offset[0] = 0;
    report->radius_min = INFINITY;
    for (int n = 0; n < nodes->count; n++) {
        Vec3 c = nodes->center[n], d = nodes->direction[n];
        int parent = nodes->parent[n], children = 0;
        int64_t first = tree->point_offset[n], last = tree->point_offset[n + 1];
        double height = parent >= 0 ? vec3_distance(c, nodes->center[parent]) : 0, down = 0;
        for (int k = n + 1; k < nodes->count; k++)
            if (nodes->parent[k] == n) {
                down += vec3_distance(c, nodes->center[k]);
                children++;
            }
        report->length += height;
        report->end_count += n == 0 || children == 0;
        down = children ? down / children : height;
        height = parent >= 0 ? 0.5 * (height + down) : down;
        for (int64_t i = first; i < last; i++) {
            Vec3 p = vec3_sub(tree->point[i], c);
            double t = vec3_dot(p, d);
            aside[i - first] = sqrt(fmax(0, vec3_norm2(p) - t * t));
        }
        qsort(aside, (size_t)(last - first), sizeof *aside, compare_doubles);
        double median = last > first ? aside[(last - first) / 2] : nodes->radius[n];
        tree->center[n] = c;
        tree->direction[n] = d;
        tree->radius[n] = fmin(fmax(median, nodes->radius[n]), 1.6 * nodes->radius[n]);
        tree->height[n] = height;
        tree->parent[n] = parent;
        report->radius_min = fmin(report->radius_min, tree->radius[n]);
        report->radius_max = fmax(report->radius_max, tree->radius[n]);
    }
    free(aside);
    return tree;
}

static VesselTree *build(Nodes *nodes, Sampling *s, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults)
{
    long *points = calloc((size_t)nodes->count + 1, sizeof *points);
    int *place = calloc((size_t)nodes->count + 1, sizeof *place);
    VesselTree *tree = NULL;
    if (points && place && sample_wall(s, options->threads, report, name, faults)) {
        for (int pass = 0; pass < PASSES; pass++) {
            parallel_for(options->threads, (s->count + CHUNK - 1) / CHUNK, find_owners, s, NULL);
            memset(points, 0, (size_t)nodes->count * sizeof *points);
            for (long i = 0; i < s->count; i++)
                if (s->owner[i] >= 0)
                    points[s->owner[i]]++;
            int dropped = pass + 1 < PASSES ? drop_nodes(nodes, points, place) : 0;
            report->dropped_nodes += dropped;
            if (!dropped)
                break;
        }
        set_directions(nodes);
        tree = make_tree(nodes, s, report);
    }
    free(points);
    free(place);
    return tree;
}

static void describe_ends(const VesselTree *tree, const Skeleton *skeleton, ImportReport *report)
{
    report->root = tree->center[0];
    report->root_is_open = vessel_tree_root_is_open(tree);
    for (int i = 0; i < skeleton->count; i++)
        report->open_end_count += skeleton->is_open_end[i];
    int *children = calloc((size_t)tree->node_count, sizeof *children);
    for (int i = 1; children && i < tree->node_count; i++)
        children[tree->parent[i]]++;
    report->branch_count = 1;
    for (int i = 0; children && i < tree->node_count; i++)
        report->branch_count += children[i] > 1 ? children[i] : 0;
    free(children);
}

VesselTree *import_surface(const SurfaceMesh *mesh, const CurveSet *given, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults)
{
    int before = faults->count;
    Wall wall;
    MeshTree *mesh_tree = mesh_tree_create(mesh);
    CurveSet *set = mesh_tree ? clear_curves(mesh, mesh_tree, given, report) : NULL;
    mesh_tree_free(mesh_tree);
    if (!set || !wall_open(mesh, set, &wall)) {
        curve_set_free(set);
        faults_add(faults, name, 0, 0, "not enough memory");
        return NULL;
    }
    VesselTree *tree = NULL;
    Nodes nodes = {0};
    report->lid_count = wall.lid_count;
    Skeleton *skeleton = skeleton_join(set, &wall, options, report, name, faults);
    if (skeleton && choose_nodes(skeleton, options->spacing, &nodes)) {
        Sampling sampling = {.nodes = &nodes, .wall = &wall, .points_per_node = options->points_per_node, .spacing = options->spacing};
        tree = build(&nodes, &sampling, options, report, name, faults);
        free(sampling.weight);
        free(sampling.point);
        free(sampling.owner);
    }
    if (tree && (!vessel_tree_link(tree) || !vessel_tree_validate(tree, name, faults))) {
        vessel_tree_free(tree);
        tree = NULL;
    }
    if (tree)
        describe_ends(tree, skeleton, report);
    else if (faults->count == before)
        faults_add(faults, name, 0, 0, "not enough memory");
    nodes_free(&nodes);
    skeleton_free(skeleton);
    wall_close(&wall);
    curve_set_free(set);
    return tree;
}

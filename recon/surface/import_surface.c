// Implements import_surface.h. Nodes are spaced `spacing` inscribed radii along the skeleton. The wall's triangles are sampled with a density of
// points_per_node / (2 pi r spacing r), where r is the radius of the nearest node, by a low-discrepancy sequence (Roberts' R2, folded into the triangle), and
// the samples are moved to the smooth surface that the facets approximate. A node that gets fewer than eight points lies within its parent's lumen and is
// removed: its children are attached to the parent. A node's radius is the median distance of the wall perpendicular to the curve, between 1 and 1.6 times
// the inscribed radius (ostia and touching walls increase the median), or the curve's own radius on pieces where most of those agree with it. At a blind end,
// where inscribed spheres shrink, it is the radius of the last sphere that reaches the end.
#include "recon/surface/import_surface.h"

#include "base/base.h"
#include "recon/surface/import_ostia.h"
#include "recon/surface/mesh_centreline.h"
#include "recon/surface/mesh_tree.h"

#include <stdlib.h>
#include <string.h>

enum { CANDIDATES = 12, LEAST_POINTS = 8, PASSES = 4, CHUNK = 256 };
static const double POINTS_MAX = 4e6, SEEN_REACH = 2.5, REACH = 2, ASIDE = 1.3,   // reaches in radii
    AGREES = 0.05, NEARLY = 0.1, PULLED = 1.6, STEEP = 0.5, SHARP_COSINE = 0.5;

ImportOptions import_default_options(void) { return (ImportOptions){.spacing = 0.5, .points_per_node = 108}; }

// --- nodes ---

// Increases the radii along the unbranched piece at `end`, up to the last sphere that reaches the end, so that none is smaller than that sphere. `next` gives
// the sample after each.
static void widen_end(Skeleton *s, int end, const int *next)
{
    double arc = 0, widest = 0;
    int last = end;
    for (int i = end; next[i] >= 0 && arc < 3 * fmax(widest, s->radius[i]); i = next[i]) {
        arc += vec3_distance(s->point[i], s->point[next[i]]);
        if (s->radius[next[i]] > widest && arc < 1.1 * s->radius[next[i]]) {
            widest = s->radius[next[i]];
            last = next[i];
        }
    }
    for (int i = end; i != last; i = next[i])
        s->radius[i] = fmax(s->radius[i], widest);
}

static double inscribed(const Wall *wall, Vec3 p)
{
    Vec3 foot;
    int t = 0;
    return mesh_tree_nearest(wall->tree, p, INFINITY, &foot, &t);
}

// Median distance of the wall perpendicular to the vessel at sample i, where r is the inscribed radius.
static double wall_radius(const Skeleton *s, const Wall *wall, int i)
{
    int a = i > 0 ? s->parent[i] : i, b = i > 0 ? i : i + (s->count > 1);
    double least, r = s->radius[i];
    Vec3 centroid;
    double section = section_radius(wall->tree, s->point[i], vec3_unit(vec3_sub(s->point[b], s->point[a])), 6 * fmax(r, s->given[i]), &least, &centroid);
    // beside the middle the inscribed sphere is too small: use that at the cross-section's centroid
    return fmin(fmax(section, r), PULLED * fmax(r, inscribed(wall, centroid)));
}

// Limits the slope of `radius` (S): cross-sections in the ostium of a branch see the trunk's wall. The radius increases by STEEP at most along a piece, but
// is never below the inscribed one.
static void limit_slope(const Skeleton *s, const int *children, double *radius)
{
    for (int pass = 0; pass < 2; pass++)
        for (int k = 1; k < s->count; k++) {
            int i = pass ? s->count - k : k, up = s->parent[i];
            double step = STEEP * vec3_distance(s->point[i], s->point[up]);
            if (pass == 0)
                radius[i] = fmax(fmin(radius[i], radius[up] + step), s->radius[i]);
            else if (children[up] == 1)   // a branch gives no information on its trunk
                radius[up] = fmax(fmin(radius[up], radius[i] + step), s->radius[up]);
        }
}

// Uses the curves' own radii on pieces between forks where most of them agree with `radius` (S), except single values that are far off. The tolerance is
// narrow because cells are defined by power distance: trunks with radii a tenth too small lose their wall to branches. Returns false if out of memory.
static bool take_given(const Skeleton *s, const int *children, double *radius)
{
    size_t room = (size_t)s->count + 1;
    int *piece = malloc(room * sizeof *piece), *agree = calloc(room, sizeof *agree);
    bool good = piece && agree;
    for (int pass = 0; pass < 2 && good; pass++)
        for (int i = 0; i < s->count; i++) {
            int up = s->parent[i];
            piece[i] = up >= 0 && children[up] == 1 ? piece[up] : i;
            double off = s->given[i] > 0 ? fabs(s->given[i] - radius[i]) / radius[i] : INFINITY;
            if (pass == 0)
                agree[piece[i]] += off < AGREES ? 1 : -1;
            else if (off < NEARLY && agree[piece[i]] > 0)
                radius[i] = s->given[i];
        }
    free(piece);
    free(agree);
    return good;
}

// Replaces the inscribed radii by those of the vessel.
static bool vessel_radii(Skeleton *s, const Wall *wall)
{
    size_t room = (size_t)s->count + 1;
    int *up = malloc(room * sizeof *up), *down = malloc(room * sizeof *down), *children = calloc(room, sizeof *children);
    double *radius = malloc(room * sizeof *radius);
    bool good = up && down && children && radius;
    for (int i = 0; good && i < s->count; i++) {
        up[i] = s->parent[i];
        down[i] = -1;
        if (i > 0) {
            down[s->parent[i]] = i;
            children[s->parent[i]]++;
        }
    }
    for (int i = 0; good && i < s->count; i++)
        if (children[i] > 1)
            up[i] = down[i] = -1;
    for (int i = 0; good && i < s->count; i++)
        if (i == 0 || children[i] == 0)
            widen_end(s, i, i ? up : down);
    for (int i = 0; good && i < s->count; i++)
        radius[i] = wall_radius(s, wall, i);
    if (good) {
        limit_slope(s, children, radius);
        good = take_given(s, children, radius);
        memcpy(s->radius, radius, (size_t)s->count * sizeof *radius);
    }
    free(radius);
    free(up);
    free(down);
    free(children);
    return good;
}

static bool choose_nodes(Skeleton *s, const Wall *wall, double spacing, Nodes *nodes)
{
    size_t room = (size_t)s->count + 1;
    int *node = malloc(room * sizeof *node);
    double *arc = calloc(room, sizeof *arc);
    bool *has_child = calloc(room, sizeof *has_child);
    bool good = nodes_create(nodes, room) && node && arc && has_child;
    for (int i = 1; good && i < s->count; i++)
        has_child[s->parent[i]] = true;
    good = good && vessel_radii(s, wall);
    for (int i = 0; good && i < s->count; i++) {
        int up = s->parent[i];
        double since = up < 0 ? INFINITY : arc[up] + vec3_distance(s->point[i], s->point[up]);
        bool is_end = up < 0 || !has_child[i];
        arc[i] = since;
        node[i] = up < 0 ? -1 : node[up];
        if (!is_end && since < spacing * s->radius[i])
            continue;
        int n = nodes->count;
        // a leaf too near to the node before it replaces that node
        if (up >= 0 && !has_child[i] && since < 0.5 * spacing * s->radius[i] && node[up] == n - 1 && !nodes->is_end[n - 1])
            nodes->count = n = n - 1;
        else
            nodes->parent[n] = node[i];
        nodes->center[n] = s->point[i];
        nodes->radius[n] = s->radius[i];
        nodes->sample[n] = i;
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

// The root's direction: to the first node that is a radius away, along the children with the largest subtrees. A curve computed from the surface alone may
// reach the middle of its opening from the side, where a stenosis follows, or leave a stub in the opening's corner, and the inlet would then appear closed.
static Vec3 root_direction(const Nodes *nodes)
{
    int at = 0;
    for (bool found = true; found && vec3_distance(nodes->center[at], nodes->center[0]) < nodes->radius[0];) {
        int next = -1, most = 0;
        for (int k = at + 1; k < nodes->count; k++) {
            if (nodes->parent[k] != at)
                continue;
            int hanging = 0;
            for (int i = k; i < nodes->count; i++) {
                int up = i;
                while (up > k)
                    up = nodes->parent[up];
                hanging += up == k;
            }
            if (hanging > most) {
                most = hanging;
                next = k;
            }
        }
        found = next >= 0;
        at = found ? next : at;
    }
    return vec3_unit_or(vec3_sub(nodes->center[at], nodes->center[0]), vec3(1, 0, 0));
}

// Sets the nodes' directions along the vessel: the mean of the directions from the parent and to the child that continues straightest.
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
    if (nodes->count > 1)
        nodes->direction[0] = root_direction(nodes);
}

// --- points ---

typedef struct Sampling {
    const Nodes *nodes;
    const Wall *wall;
    double points_per_node, spacing;
    bool root_is_cut;        // the wall beyond the root's plane is omitted
    double *weight;          // (T) number of points wanted on each triangle
    int *component;          // (V) the first vertex of each vertex's component
    bool *used;              // (V) components that contain a node
    Vec3 *normal;            // (V) normals; 0 at a sharp edge of the surface
    long count;
    Vec3 *point;             // (P) on facets
    int *facet;              // (P) facet of each point
    Vec3 *curved;            // (P) points on the smooth surface that the facets approximate
    int *owner;              // (P) node of each point; -1: none
    bool *unseen;            // (P) assigned to a node that does not see the point
} Sampling;

// Lists the nodes that are nearest to p by power distance |p - c|^2 - r^2, best first.
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
    Vec3 middle = vec3_scale(vec3_add(a, vec3_add(b, c)), 1.0 / 3);
    nearest_nodes(s->nodes, middle, 1, &node);
    // far from every node the vessel is wider than at the node, or has no node
    double r = fmax(s->nodes->radius[node], vec3_distance(middle, s->nodes->center[node]) / PULLED);
    s->weight[t] = area * s->points_per_node / (2 * PI * r * r * s->spacing);
}

static bool is_beyond_cut(const Sampling *s, Vec3 p, int owner)
{
    const Nodes *n = s->nodes;
    Vec3 upstream = vec3_unit(vec3_sub(n->center[0], n->center[n->count > 1]));
    return s->root_is_cut && vec3_distance(n->center[owner], n->center[0]) < 3 * n->radius[0] && vec3_dot(vec3_sub(p, n->center[0]), upstream) > 0;
}

// Returns true if the point lies in a branch without a centreline: aside of the owner's vessel, and in a lumen narrower by half. A model of the vessel cannot
// represent that; a sac or a bulge, as wide as the vessel, it can.
static bool is_in_side_branch(const Sampling *s, long i, int owner)
{
    const SurfaceMesh *mesh = &s->wall->mesh;
    double r = s->nodes->radius[owner];
    if (vec3_distance(s->point[i], s->nodes->center[owner]) < ASIDE * r)
        return false;
    const int *corner = mesh->triangle[s->facet[i]];
    Vec3 a = mesh->vertex[corner[0]];
    Vec3 inward = vec3_unit(vec3_cross(vec3_sub(mesh->vertex[corner[2]], a), vec3_sub(mesh->vertex[corner[1]], a)));
    return isfinite(mesh_tree_ray(s->wall->tree, vec3_add_scaled(s->point[i], 1e-3 * r, inward), inward, r, NULL));
}

static void find_owners(void *context, long chunk)
{
    Sampling *s = context;
    for (long i = chunk * CHUNK; i < s->count && i < (chunk + 1) * CHUNK; i++) {
        int node[CANDIDATES], count = nearest_nodes(s->nodes, s->point[i], CANDIDATES, node);
        s->owner[i] = -1;
        s->unseen[i] = false;
        for (int k = 0; k < count && s->owner[i] < 0; k++) {
            Vec3 from = s->nodes->center[node[k]], to = vec3_sub(s->point[i], from);
            double length = vec3_norm(to);
            if (length > SEEN_REACH * s->nodes->radius[node[k]])
                continue;
            // the wall is visible unless a surface lies clearly in front
            double hit = length > 0 ? mesh_tree_ray(s->wall->tree, from, vec3_scale(to, 1 / length), length, NULL) : INFINITY;
            if (!(hit < length - 0.1 * s->nodes->radius[node[k]]))
                s->owner[i] = node[k];
        }
        if (s->owner[i] < 0 && count > 0 && vec3_distance(s->point[i], s->nodes->center[node[0]]) < REACH * s->nodes->radius[node[0]]) {
            s->owner[i] = node[0];
            s->unseen[i] = true;
        }
        if (s->owner[i] >= 0 && (is_beyond_cut(s, s->point[i], s->owner[i]) || is_in_side_branch(s, i, s->owner[i]))) {
            s->owner[i] = -1;
            s->unseen[i] = false;
        }
    }
}

static int first_of(int *component, int v)
{
    while (component[v] != v)
        v = component[v] = component[component[v]];
    return v;
}

// Finds the components of the wall, marks those that contain a node, and counts the others.
static bool find_components(Sampling *s, ImportReport *report)
{
    const SurfaceMesh *mesh = &s->wall->mesh;
    size_t room = (size_t)mesh->vertex_count + 1;
    bool *counted = calloc(room, sizeof *counted);
    s->component = malloc(room * sizeof *s->component);
    s->used = calloc(room, sizeof *s->used);
    bool good = counted && s->component && s->used;
    for (int v = 0; good && v < mesh->vertex_count; v++)
        s->component[v] = v;
    for (int t = 0; good && t < mesh->triangle_count; t++)
        for (int k = 1; k < 3; k++) {
            int a = first_of(s->component, mesh->triangle[t][0]), b = first_of(s->component, mesh->triangle[t][k]);
            s->component[a > b ? a : b] = a > b ? b : a;
        }
    for (int v = 0; good && v < mesh->vertex_count; v++)
        s->component[v] = first_of(s->component, v);
    for (int i = 0; good && i < s->nodes->count; i++) {
        Vec3 foot;
        int t = 0;
        if (isfinite(mesh_tree_nearest(s->wall->tree, s->nodes->center[i], INFINITY, &foot, &t)))
            s->used[s->component[mesh->triangle[t][0]]] = true;
    }
    for (int t = 0; good && t < mesh->triangle_count; t++) {
        int piece = s->component[mesh->triangle[t][0]];
        report->unused_components += !s->used[piece] && !counted[piece];
        counted[piece] = true;
    }
    free(counted);
    return good;
}

// Computes normals as means weighted by the facets' angles. A sharp edge, which normals would round off, has none.
static bool find_normals(Sampling *s)
{
    const SurfaceMesh *mesh = &s->wall->mesh;
    s->normal = calloc((size_t)mesh->vertex_count + 1, sizeof *s->normal);
    bool *sharp = calloc((size_t)mesh->vertex_count + 1, sizeof *sharp);
    for (int pass = 0; pass < 2 && s->normal && sharp; pass++) {
        for (int t = 0; t < mesh->triangle_count; t++) {
            const int *corner = mesh->triangle[t];
            Vec3 first = mesh->vertex[corner[0]];
            Vec3 n = vec3_unit(vec3_cross(vec3_sub(mesh->vertex[corner[1]], first), vec3_sub(mesh->vertex[corner[2]], first)));
            for (int k = 0; k < 3; k++) {
                Vec3 a = mesh->vertex[corner[k]], b = vec3_unit(vec3_sub(mesh->vertex[corner[(k + 1) % 3]], a)),
                     c = vec3_unit(vec3_sub(mesh->vertex[corner[(k + 2) % 3]], a));
                if (pass == 0)
                    s->normal[corner[k]] = vec3_add_scaled(s->normal[corner[k]], vec3_angle(b, c), n);
                else
                    sharp[corner[k]] = sharp[corner[k]] || vec3_dot(n, s->normal[corner[k]]) < SHARP_COSINE;
            }
        }
        for (int v = 0; v < mesh->vertex_count; v++)
            s->normal[v] = sharp[v] ? vec3(0, 0, 0) : vec3_unit_or(s->normal[v], vec3(0, 0, 0));
    }
    bool good = s->normal && sharp;
    free(sharp);
    return good;
}

// Moves a point half of the distance to the mean of its projections on the corners' tangent planes (Boubekeur, Alexa 2008: Phong tessellation): exact to
// second order on a sphere and perpendicular to a cylinder's axis.
static Vec3 curve_facet(const Sampling *s, const int *corner, const double *share, Vec3 flat)
{
    Vec3 out = flat;
    for (int k = 0; k < 3; k++) {
        Vec3 n = s->normal[corner[k]];
        out = vec3_add_scaled(out, 0.5 * share[k] * vec3_dot(vec3_sub(s->wall->mesh.vertex[corner[k]], flat), n), n);
    }
    return out;
}

static bool sample_wall(Sampling *s, int threads, ImportReport *report, const char *name, Faults *faults)
{
    const SurfaceMesh *mesh = &s->wall->mesh;
    s->weight = calloc((size_t)mesh->triangle_count + 1, sizeof *s->weight);
    if (s->weight)
        parallel_for(threads, mesh->triangle_count, weigh_triangle, s, NULL);
    double total = 0;
    bool good = s->weight && find_components(s, report);
    for (int t = 0; good && t < mesh->triangle_count; t++) {
        if (!s->used[s->component[mesh->triangle[t][0]]])
            s->weight[t] = 0;
        total += s->weight[t];
    }
    if (total > POINTS_MAX) {
        faults_add(faults, name, 0, 0, "would need %.0f points: large parts of the surface have no centreline; expected a centreline in every vessel", total);
        return false;
    }
    s->point = calloc((size_t)total + 2, sizeof *s->point);
    s->curved = calloc((size_t)total + 2, sizeof *s->curved);
    s->facet = calloc((size_t)total + 2, sizeof *s->facet);
    s->owner = calloc((size_t)total + 2, sizeof *s->owner);
    s->unseen = calloc((size_t)total + 2, sizeof *s->unseen);
    if (!good || !find_normals(s) || !s->point || !s->curved || !s->facet || !s->owner || !s->unseen) {
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
            double share[3] = {1 - x - y, x, y};
            Vec3 flat = vec3_add(a, vec3_add(vec3_scale(vec3_sub(b, a), x), vec3_scale(vec3_sub(c, a), y)));
            s->curved[s->count] = curve_facet(s, mesh->triangle[t], share, flat);
            s->facet[s->count] = t;
            s->point[s->count++] = flat;
        }
    report->sampled_points = s->count;
    return true;
}

// Removes the nodes (except the root) with too few points. Returns how many.
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
        nodes->sample[kept] = nodes->sample[i];
        nodes->is_end[kept] = nodes->is_end[i];
        nodes->parent[kept] = parent;
        place[i] = kept++;
    }
    nodes->count = kept;
    return before - kept;
}

static VesselTree *make_tree(const Nodes *nodes, const Sampling *s, ImportReport *report)
{
    long kept = 0;
    for (long i = 0; i < s->count; i++) {
        kept += s->owner[i] >= 0;
        report->unseen_points += s->unseen[i];
    }
    report->left_points = s->count - kept - report->inner_points;
    VesselTree *tree = vessel_tree_create(nodes->count, kept, 0);
    if (!tree)
        return NULL;
    for (long i = 0; i < s->count; i++)
        if (s->owner[i] >= 0)
            tree->point_offset[s->owner[i] + 1]++;
    for (int n = 0; n < nodes->count; n++)
        tree->point_offset[n + 1] += tree->point_offset[n];
    for (long i = 0; i < s->count; i++)
        if (s->owner[i] >= 0)
            tree->point[tree->point_offset[s->owner[i]]++] = s->curved[i];
    memmove(tree->point_offset + 1, tree->point_offset, (size_t)nodes->count * sizeof *tree->point_offset);
    tree->point_offset[0] = 0;
    report->radius_min = INFINITY;
    for (int n = 0; n < nodes->count; n++) {
        Vec3 c = nodes->center[n], d = nodes->direction[n];
        int parent = nodes->parent[n], children = 0;
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
        tree->center[n] = c;
        tree->direction[n] = d;
        tree->radius[n] = nodes->radius[n];
        tree->height[n] = height;
        tree->parent[n] = parent;
        report->radius_min = fmin(report->radius_min, tree->radius[n]);
        report->radius_max = fmax(report->radius_max, tree->radius[n]);
    }
    return tree;
}

// Adds nodes to the links, then assigns owners again and removes points in a tool's path, which are not wall.
static bool open_ostia(Nodes *nodes, const Skeleton *skeleton, Sampling *s, int threads, ImportReport *report)
{
    if (!nodes_open_ostia(nodes, skeleton, s->wall, report))
        return false;
    LumenLines *lines = nodes_lumen_lines(nodes);
    if (!lines)
        return false;
    parallel_for(threads, (s->count + CHUNK - 1) / CHUNK, find_owners, s, NULL);
    for (long i = 0; i < s->count; i++)
        if (s->owner[i] >= 0 && lumen_lines_hold(lines, s->curved[i])) {
            s->owner[i] = -1;
            s->unseen[i] = false;
            report->inner_points++;
        }
    lumen_lines_free(lines);
    return true;
}

static VesselTree *build(Nodes *nodes, const Skeleton *skeleton, Sampling *s, const ImportOptions *options, ImportReport *report, const char *name,
                         Faults *faults)
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
        if (open_ostia(nodes, skeleton, s, options->threads, report)) {
            set_directions(nodes);
            tree = make_tree(nodes, s, report);
        }
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
    int *children = HEAP_ZEROED((size_t)tree->node_count, sizeof *children);
    for (int i = 1; i < tree->node_count; i++)
        children[tree->parent[i]]++;
    report->branch_count = 1;
    for (int i = 0; i < tree->node_count; i++)
        report->branch_count += children[i] > 1 ? children[i] : 0;
    free(children);
}

VesselTree *import_surface(const SurfaceMesh *mesh, const CurveSet *given, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults)
{
    int before = faults->count;
    Wall wall;
    MeshTree *mesh_tree = mesh_tree_create(mesh);
    CurveSet *set = mesh_tree ? curves_in_lumen(mesh, mesh_tree, given, report) : NULL;
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
    if (skeleton && choose_nodes(skeleton, &wall, options->spacing, &nodes)) {
        Sampling sampling = {
            .nodes = &nodes, .wall = &wall, .points_per_node = options->points_per_node, .spacing = options->spacing, .root_is_cut = report->root_is_cut};
        tree = build(&nodes, skeleton, &sampling, options, report, name, faults);
        free(sampling.weight);
        free(sampling.component);
        free(sampling.used);
        free(sampling.unseen);
        free(sampling.normal);
        free(sampling.curved);
        free(sampling.facet);
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

CurveSet *import_load_curves(const SurfaceMesh *mesh, double scale, int count, const char *const *file, const ImportOptions *options, ImportReport *report,
                             const char *name, Faults *faults)
{
    if (count == 0)
        return mesh_centreline(mesh, options, report, name, faults);
    CurveSet *set = curve_set_create();
    bool is_good = set != NULL;
    for (int i = 0; set && i < count; i++)
        is_good = centreline_load(file[i], set, faults) && is_good;
    if (!set)
        faults_add(faults, name, 0, 0, "out of memory");
    if (is_good && import_place_curves(mesh, scale, set, report, file[0], faults))
        return set;
    curve_set_free(set);
    return NULL;
}

double import_left_percent(const ImportReport *report) { return 100.0 * (double)report->left_points / (double)(report->sampled_points + 1); }

// Each link is tested in the surface. Nodes in the parent's lumen see no wall of their own and were removed, so a branch begins with a link from the parent's
// axis. If the skeleton crosses a wall there, a path near it is searched, within the branch's radius; if there is none, the link is refused, however thin the
// wall, because touching vessels are separate. Sheets inside the lumen, in vessels made of overlapping parts, are not walls; winding numbers distinguish
// them. The narrowest place of the path, as a fraction of the branch's radius, tells how well the link is supported. Nodes are placed on the path every half
// radius of the branch, from 1.5 of its radii inside the parent's wall onwards.
#include "recon/surface/import_ostia.h"

#include "base/base.h"
#include "recon/track/link_lattice.h"

#include <stdlib.h>
#include <string.h>

enum { ROOT_NODES = 5, STATIONS_MOST = 2000 };
static const double SPACING = 0.5, INSIDE = 1.5,   // in radii of the branch
    DOUBTFUL = 0.25;                             // as a fraction of the branch's radius

typedef struct Link {
    int node, parent;
    double radius, length;
    bool is_inner;           // not the start of a branch: checked only if a wall crosses the link
    bool is_moved, is_refused;
    Vec3 place;
    LinkPath path;
    Vec3 *station;
    int station_count;
} Link;

bool nodes_create(Nodes *nodes, size_t capacity)
{
    *nodes = (Nodes){0,
                     calloc(capacity, sizeof(Vec3)),
                     calloc(capacity, sizeof(Vec3)),
                     calloc(capacity, sizeof(double)),
                     calloc(capacity, sizeof(int)),
                     calloc(capacity, sizeof(int)),
                     calloc(capacity, sizeof(bool)),
                     calloc(capacity, sizeof(bool))};
    return nodes->center && nodes->direction && nodes->radius && nodes->parent && nodes->sample && nodes->is_end && nodes->is_link;
}

void nodes_free(Nodes *nodes)
{
    free(nodes->center);
    free(nodes->direction);
    free(nodes->radius);
    free(nodes->parent);
    free(nodes->sample);
    free(nodes->is_end);
    free(nodes->is_link);
    *nodes = (Nodes){0};
}

// --- the parent ---

static double depth_in_segment(const Nodes *n, int i, Vec3 x)
{
    Vec3 a = n->center[i], b = n->parent[i] >= 0 ? n->center[n->parent[i]] : a, along = vec3_sub(b, a);
    double ra = n->radius[i], rb = n->parent[i] >= 0 ? n->radius[n->parent[i]] : ra, l2 = vec3_norm2(along);
    double s = l2 > 0 ? fmax(0, fmin(1, vec3_dot(vec3_sub(x, a), along) / l2)) : 0;
    return ra + s * (rb - ra) - vec3_distance(x, vec3_add_scaled(a, s, along));
}

// Depth of x inside the parent's vessel, < 0 outside: over the nodes within three radii upstream and downstream.
static double depth_in_parent(const Nodes *n, const int *first_child, int parent, Vec3 x)
{
    double reach = 3 * n->radius[parent], deepest = depth_in_segment(n, parent, x), length = 0;
    for (int i = parent; n->parent[i] >= 0 && length < reach; i = n->parent[i]) {
        length += vec3_distance(n->center[i], n->center[n->parent[i]]);
        deepest = fmax(deepest, depth_in_segment(n, i, x));
    }
    length = 0;
    for (int i = first_child[parent]; i >= 0 && length < reach; i = first_child[i]) {
        length += vec3_distance(n->center[i], n->center[n->parent[i]]);
        deepest = fmax(deepest, depth_in_segment(n, i, x));
    }
    return deepest;
}

static double root_radius(const Nodes *n, const int *first_child, int node)
{
    double radius[ROOT_NODES];
    int count = 0;
    for (int i = node; i >= 0 && count < ROOT_NODES; i = first_child[i])
        radius[count++] = n->radius[i];
    sort_doubles(radius, (size_t)count);
    return radius[count / 2];
}

// --- the surface ---

typedef struct BranchWall {  // context of the lattice search
    const Wall *wall;
    double radius;           // radius of the branch
} BranchWall;

// Returns true if the step stays inside. A winding number visits all triangles, so it is computed only behind walls that the step crosses.
static bool stays_inside(const void *context, Vec3 a, Vec3 b)
{
    const BranchWall *branch = context;
    double length = vec3_distance(a, b), past = 1e-4 * branch->radius;
    Vec3 along = vec3_unit_or(vec3_sub(b, a), vec3(1, 0, 0));
    for (int sheets = 0; length > 0 && sheets < 16; sheets++) {
        double hit = mesh_tree_ray(branch->wall->tree, a, along, length, NULL);
        if (!isfinite(hit))
            return true;
        a = vec3_add_scaled(a, hit + past, along);
        length -= hit + past;
        if (mesh_winding(&branch->wall->mesh, a) < 0.5)
            return false;
    }
    return length <= 0;
}

// Distance to the wall as a fraction of the branch's radius.
static double clearance_at(const void *context, Vec3 x)
{
    const BranchWall *branch = context;
    Vec3 foot;
    int t = 0;
    return fmin(1, mesh_tree_nearest(branch->wall->tree, x, INFINITY, &foot, &t) / branch->radius);
}

// --- links ---

// Takes the path from the parent's node along the skeleton.
static bool follow_skeleton(const Nodes *n, const Skeleton *s, Link *link)
{
    int count = 1, top = n->sample[link->parent], at = n->sample[link->node];
    for (int i = at; i != top && i >= 0; i = s->parent[i])
        count++;
    link->path = (LinkPath){malloc(((size_t)count + 1) * sizeof(Vec3)), count, 1};
    for (int k = count - 1; link->path.point && k > 0; k--, at = s->parent[at])
        link->path.point[k] = s->point[at];
    if (link->path.point)
        link->path.point[0] = n->center[link->parent];
    return link->path.point != NULL;
}

// Finds the skeleton's path, or the best path near the straight link if a wall crosses the skeleton's. Returns false if out of memory.
static bool find_path(const Nodes *n, const Skeleton *s, const Wall *wall, Link *link)
{
    BranchWall branch = {wall, link->radius};
    bool inside = true;
    if (!follow_skeleton(n, s, link))
        return false;
    for (int i = 1; i < link->path.count; i++)
        inside = inside && stays_inside(&branch, link->path.point[i - 1], link->path.point[i]);
    if (!inside) {
        free(link->path.point);
        if (!link_lattice_path(n->center[link->parent], n->center[link->node], link->radius, 0.2 * link->radius,
                               &(LinkGround){clearance_at, stays_inside, &branch}, &link->path))
            return false;
    }
    for (int i = 0; i < link->path.count; i++)
        link->path.share = fmin(link->path.share, clearance_at(&branch, link->path.point[i]));
    return true;
}

static Vec3 path_at(const Link *link, double arc)
{
    const LinkPath *path = &link->path;
    for (int i = 1; i < path->count; i++) {
        double step = vec3_distance(path->point[i], path->point[i - 1]);
        if (arc <= step && step > 0)
            return vec3_mix(path->point[i - 1], path->point[i], fmax(0, arc) / step);
        arc -= step;
    }
    return path->point[path->count - 1];
}

// Arc length from the parent's axis to the last place that is `depth` deep in the parent.
static double arc_at_depth(const Nodes *n, const int *first_child, const Link *link, double depth)
{
    double arc = link->length;
    for (int i = link->path.count - 1; i > 0; i--) {
        if (depth_in_parent(n, first_child, link->parent, link->path.point[i]) >= depth)
            return arc;
        arc -= vec3_distance(link->path.point[i], link->path.point[i - 1]);
    }
    return 0;
}

static bool place_stations(const Nodes *n, const int *first_child, Link *link)
{
    double from = arc_at_depth(n, first_child, link, INSIDE * link->radius);
    int steps = (int)fmin(STATIONS_MOST, ceil((link->length - from) / (SPACING * link->radius) - 1e-9));
    link->place = path_at(link, arc_at_depth(n, first_child, link, 0));
    link->station = malloc(((size_t)(steps > 0 ? steps : 0) + 1) * sizeof *link->station);
    for (int k = from > 0 ? 0 : 1; link->station && k < steps; k++)
        link->station[link->station_count++] = path_at(link, from + k * (link->length - from) / steps);
    return link->station != NULL;
}

static double path_length(const Link *link)
{
    double length = 0;
    for (int i = 1; i < link->path.count; i++)
        length += vec3_distance(link->path.point[i], link->path.point[i - 1]);
    return length;
}

static void mark_hanging(const Nodes *n, int node, bool *hangs)
{
    memset(hangs, 0, (size_t)n->count * sizeof *hangs);
    hangs[node] = true;
    for (int i = node + 1; i < n->count; i++)
        hangs[i] = n->parent[i] >= 0 && hangs[n->parent[i]];
}

// Finds the nearest earlier node in line of sight, by the distance outside both vessels; the path goes to link->path. Nodes come after their parents, so
// later ones are not considered. Returns false if out of memory.
static bool attach_elsewhere(const Nodes *n, const Wall *wall, Link *link)
{
    BranchWall branch = {wall, link->radius};
    double least = 3 * link->radius;
    int best = -1;
    Vec3 x = n->center[link->node];
    for (int i = 0; i < link->node; i++) {
        double apart = vec3_distance(x, n->center[i]) - n->radius[i] - link->radius;
        if (apart < least && stays_inside(&branch, n->center[i], x)) {
            least = apart;
            best = i;
        }
    }
    if (best < 0)
        return true;
    link->parent = best;
    link->is_moved = true;
    link->path = (LinkPath){malloc(2 * sizeof(Vec3)), 2, fmin(clearance_at(&branch, n->center[best]), clearance_at(&branch, x))};
    if (!link->path.point)
        return false;
    link->path.point[0] = n->center[best];
    link->path.point[1] = x;
    return true;
}

// Collects all links, because curves may pass through walls anywhere. A branch begins with a node whose parent has an earlier child.
static Link *collect_links(const Nodes *n, int *first_child, int *count)
{
    Link *link = calloc((size_t)n->count + 1, sizeof *link);
    for (int i = 0; i < n->count; i++)
        first_child[i] = -1;
    for (int i = 1; i < n->count; i++)
        if (first_child[n->parent[i]] < 0)
            first_child[n->parent[i]] = i;
    *count = link ? n->count - 1 : 0;
    for (int i = 1; link && i < n->count; i++)
        link[i - 1] = (Link){.node = i, .parent = n->parent[i], .is_inner = first_child[n->parent[i]] == i};
    return link;
}

// Reports a link. A refused link within a branch counts as another junction: between two vessels that the curves treat as one.
static void report_link(const Nodes *n, const Link *link, ImportReport *report)
{
    if (link->is_inner && !link->is_refused && !link->is_moved)
        return;
    ImportSupport support = link->is_refused ? IMPORT_REFUSED : link->path.share < DOUBTFUL ? IMPORT_DOUBTFUL : IMPORT_SUPPORTED;
    report->junction_count++;
    report->junctions_with[support]++;
    report->junctions_moved += link->is_moved;
    if (support == IMPORT_SUPPORTED)
        return;
    if (report->named_count < IMPORT_NAMED_MOST)
        report->named[report->named_count++] =
            (ImportJunction){link->is_refused ? n->center[link->node] : link->place, link->length, link->is_refused ? 0 : link->path.share, support};
}

// --- the new nodes ---

static void append(Nodes *out, Vec3 center, double radius, int parent, int sample, bool is_end, bool is_link)
{
    int i = out->count++;
    out->center[i] = center;
    out->radius[i] = radius;
    out->parent[i] = parent;
    out->sample[i] = sample;
    out->is_end[i] = is_end;
    out->is_link[i] = is_link;
}

static void rebuild(const Nodes *n, const Link *link, int link_count, const Wall *wall, const bool *dropped, int *place, Nodes *out, ImportReport *report)
{
    int next = 0;
    for (int i = 0; i < n->count; i++) {
        const Link *own = next < link_count && link[next].node == i ? &link[next++] : NULL;
        if (dropped[i])
            continue;
        int parent = i == 0 ? -1 : place[own ? own->parent : n->parent[i]];
        for (int k = 0; own && k < own->station_count; k++) {
            Vec3 foot;
            int t = 0;
            double inscribed = mesh_tree_nearest(wall->tree, own->station[k], INFINITY, &foot, &t);
            append(out, own->station[k], fmax(0.5 * own->radius, fmin(own->radius, inscribed)), parent, n->sample[i], false, true);
            parent = out->count - 1;
            report->link_nodes++;
        }
        append(out, n->center[i], n->radius[i], parent, n->sample[i], n->is_end[i], n->is_link[i]);
        place[i] = out->count - 1;
    }
}

static bool measure(const Nodes *n, const Skeleton *s, const Wall *wall, const int *first_child, Link *link)
{
    link->radius = link->is_inner ? fmax(n->radius[link->node], n->radius[link->parent]) : root_radius(n, first_child, link->node);
    link->length = vec3_distance(n->center[link->node], n->center[link->parent]);
    if (!find_path(n, s, wall, link) || (link->path.count == 0 && !attach_elsewhere(n, wall, link)))
        return false;
    link->is_refused = link->path.count == 0;
    link->length = link->is_refused ? link->length : path_length(link);
    bool needs_nodes = !link->is_inner || link->is_moved || link->length > n->radius[link->node] + n->radius[link->parent];
    return link->is_refused || !needs_nodes || place_stations(n, first_child, link);
}

bool nodes_open_ostia(Nodes *nodes, const Skeleton *skeleton, const Wall *wall, ImportReport *report)
{
    int count = 0, stations = 0;
    size_t capacity = (size_t)nodes->count + 1;
    int *first_child = malloc(capacity * sizeof *first_child), *place = malloc(capacity * sizeof *place);
    bool *dropped = calloc(capacity, sizeof *dropped), *hangs = calloc(capacity, sizeof *hangs);
    Link *link = first_child ? collect_links(nodes, first_child, &count) : NULL;
    Nodes out = {0};
    bool good = place && dropped && hangs && link;
    for (int l = 0; good && l < count; l++) {
        good = measure(nodes, skeleton, wall, first_child, &link[l]);
        stations += link[l].station_count;
    }
    for (int l = 0; good && l < count; l++) {
        bool is_lost = dropped[link[l].node] || dropped[link[l].parent];   // it was removed with its parent
        if (!is_lost)
            report_link(nodes, &link[l], report);
        if (!is_lost && !link[l].is_refused)
            continue;
        mark_hanging(nodes, link[l].node, hangs);
        for (int i = 0; i < nodes->count; i++) {
            report->refused_nodes += hangs[i] && !dropped[i];
            dropped[i] = dropped[i] || hangs[i];
        }
    }
    good = good && nodes_create(&out, capacity + (size_t)stations);
    if (good) {
        rebuild(nodes, link, count, wall, dropped, place, &out, report);
        nodes_free(nodes);
        *nodes = out;
    } else {
        nodes_free(&out);
    }
    for (int l = 0; link && l < count; l++) {
        free(link[l].path.point);
        free(link[l].station);
    }
    free(link);
    free(first_child);
    free(place);
    free(dropped);
    free(hangs);
    return good;
}

LumenLines *nodes_lumen_lines(const Nodes *n)
{
    LumenLine *line = malloc(((size_t)n->count + 1) * sizeof *line);
    for (int i = 1; line && i < n->count; i++) {
        int p = n->parent[i];
        bool is_link = n->is_link[i] || n->is_link[p];
        // the first link of an ostium begins on the parent's axis, in a lumen wider than the branch
        double radius = is_link && !n->is_link[p] ? n->radius[i] : fmin(n->radius[i], n->radius[p]);
        line[i - 1] = (LumenLine){n->center[p], n->center[i], (is_link ? LUMEN_LINK_CLEAR : LUMEN_TUBE_CLEAR) * radius};
    }
    LumenLines *lines = line ? lumen_lines_create(line, n->count - 1) : NULL;
    free(line);
    return lines;
}

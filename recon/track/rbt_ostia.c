// Each link is tested in the image. The best path near the straight link (within the child's radius, at least a voxel) is rated by its darkest place, as a
// fraction of the child's contrast: from a half up the link is supported; below a quarter it is not, and the branch is attached elsewhere or removed. Along a
// supported path nodes are placed every half radius of the child, from 1.5 of its radii inside the parent's wall onwards. Their wall points are found by rays
// perpendicular to the path, scaled by the ratio that the same rays show at the child's own first nodes, because an image edge is not where a least-squares
// cylinder lies. Points on the parent's wall or in a tool's path are not wall of the ostium and are removed, including the parent's own points across the
// ostium that come from edges on its far side.
//
// Tried before: without nodes on the links 31 to 40 of 131 ostia stayed closed; a cylinder of the child's radius on the straight link opened them,
// but not where the image shows the ostium.
#include "recon/track/rbt_ostia.h"
#include "base/base.h"
#include "recon/track/lumen_lines.h"
#include "recon/track/rbt_link_path.h"
#include "recon/track/rbt_ring.h"

#include <stdlib.h>
#include <string.h>

enum { ROOT_NODES = 8, NEAR_MOST = 64, STATIONS_MOST = 2000 };
static const double SPACING = 0.5,        // spacing of the nodes, in radii of the child
    INSIDE = 1.5,                  // depth inside the parent's wall at which they begin, in radii of the child
    NEAR_REACH = 3,                // distance along the parent that counts as near the ostium, in its radii
    IN_PARENT = 0.1;               // depth in the parent up to which a point may be wall, in its radii

typedef struct Link {
    int node, parent;        // nodes of t->tree: the child, and its parent as tracked or as attached now
    bool is_inner;           // a link within a branch
    bool is_moved, is_named;
    double radius, length, share, scale;
    Vec3 place;
    RbtSupport support;
    LinkLight light;
    LinkPath path;
    Track nodes;             // nodes from the parent to the child; their `parent` is not set
    bool failed;             // out of memory
} Link;

// --- the vessel around a node ---

// Lists the nodes of the parent's branch within reach of `node`, and their ancestors. Returns their number.
static int nodes_about(const Track *tree, int node, int *list)
{
    double reach = NEAR_REACH * tree->node[node].cylinder.radius, length = 0;
    int count = 0;
    list[count++] = node;
    for (int i = node; tree->node[i].parent >= 0 && length < reach && count < NEAR_MOST / 2; i = tree->node[i].parent) {
        length += vec3_distance(tree->node[i].cylinder.center, tree->node[tree->node[i].parent].cylinder.center);
        list[count++] = tree->node[i].parent;
    }
    length = 0;
    for (int i = node + 1;
         i < tree->count && tree->node[i].parent == i - 1 && tree->node[i].branch == tree->node[node].branch && length < reach && count < NEAR_MOST; i++) {
        length += vec3_distance(tree->node[i].cylinder.center, tree->node[i - 1].cylinder.center);
        list[count++] = i;
    }
    return count;
}

static double depth_in_segment(const Cylinder *a, const Cylinder *b, Vec3 x)
{
    Vec3 along = vec3_sub(b->center, a->center);
    double l2 = vec3_norm2(along), s = l2 > 0 ? fmax(0, fmin(1, vec3_dot(vec3_sub(x, a->center), along) / l2)) : 0;
    return a->radius + s * (b->radius - a->radius) - vec3_distance(x, vec3_add_scaled(a->center, s, along));
}

static double depth_in(const Track *tree, const int *list, int count, Vec3 x)
{
    double deepest = tree->node[list[0]].cylinder.radius - vec3_distance(x, tree->node[list[0]].cylinder.center);
    for (int i = 0; i < count; i++) {
        int parent = tree->node[list[i]].parent;
        // a link longer than the sum of both radii is not lumen
        bool is_tube = parent >= 0 && vec3_distance(tree->node[list[i]].cylinder.center, tree->node[parent].cylinder.center) <=
                                          tree->node[list[i]].cylinder.radius + tree->node[parent].cylinder.radius;
        if (is_tube)
            deepest = fmax(deepest, depth_in_segment(&tree->node[list[i]].cylinder, &tree->node[parent].cylinder, x));
    }
    return deepest;
}

double rbt_depth_in_vessel(const Track *tree, int node, Vec3 x)
{
    int list[NEAR_MOST];
    return depth_in(tree, list, nodes_about(tree, node, list), x);
}

// --- nodes along the path ---

static double path_length(const LinkPath *path)
{
    double length = 0;
    for (int i = 1; i < path->count; i++)
        length += vec3_distance(path->point[i], path->point[i - 1]);
    return length;
}

static Vec3 path_at(const LinkPath *path, double arc)
{
    for (int i = 1; i < path->count; i++) {
        double step = vec3_distance(path->point[i], path->point[i - 1]);
        if (arc <= step && step > 0)
            return vec3_mix(path->point[i - 1], path->point[i], fmax(0, arc) / step);
        arc -= step;
    }
    return path->point[path->count - 1];
}

// Arc length from the parent's axis to the last point that is `depth` deep in the parent; 0 if there is none.
static double arc_at_depth(const Track *tree, const int *list, int count, const LinkPath *path, double depth)
{
    double arc = path_length(path);
    for (int i = path->count - 1; i > 0; i--) {
        if (depth_in(tree, list, count, path->point[i]) >= depth)
            return arc;
        arc -= vec3_distance(path->point[i], path->point[i - 1]);
    }
    return 0;
}

// Appends one node: its centre and radius are those of the cross-section measured by the rays; its points are those on the ostium's wall.
static bool append_station(const Tracker *t, Link *link, Vec3 x, Vec3 axis, double spacing, const int *list, int near)
{
    const TrackNode *child = &t->tree.node[link->node];
    double most = RING_WIDEST * link->radius / link->scale, distance[RING], r = link->radius;
    Vec3 direction[RING], offset, point[RING];
    rbt_ring_cast(t, x, axis, &link->light, link->radius, direction, distance);
    if (rbt_ring_center(direction, distance, most, axis, &offset) && vec3_norm(offset) < 0.5 * r) {
        x = vec3_add(x, offset);
        rbt_ring_cast(t, x, axis, &link->light, link->radius, direction, distance);
    }
    double edge = rbt_ring_median(distance, most);
    int count = 0;
    r = edge > 0 ? fmax(0.5 * r, fmin(RING_WIDEST * r, link->scale * edge)) : r;
    for (int k = 0; k < RING; k++) {
        Vec3 wall = vec3_add_scaled(x, link->scale * distance[k], direction[k]);
        bool is_own = distance[k] > 0 && distance[k] < most && link->scale * distance[k] < 1.6 * r;
        if (is_own && (link->is_inner || depth_in(&t->tree, list, near, wall) < IN_PARENT * t->tree.node[link->parent].cylinder.radius))
            point[count++] = wall;
    }
    TrackNode node = {.cylinder = {x, r, axis, 2 * spacing},
                      .inlier_rate = (double)count / RING,
                      .contrast = link->light.inside - link->light.outside,
                      .kind = NODE_VESSEL,
                      .branch = child->branch,
                      .is_junction = true,
                      .is_link = true,
                      .point_count = count};
    return track_append(&link->nodes, &node, point);
}

// Chooses the parent node for the first node of the link: that of least power distance.
static void choose_parent(const Tracker *t, Link *link, const int *list, int near)
{
    Vec3 x = link->nodes.count > 0 ? link->nodes.node[0].cylinder.center : t->tree.node[link->node].cylinder.center;
    double least = HUGE_VAL;
    for (int i = 0; i < near; i++) {
        const Cylinder *c = &t->tree.node[list[i]].cylinder;
        double power = vec3_norm2(vec3_sub(x, c->center)) - c->radius * c->radius;
        if (power < least) {
            least = power;
            link->parent = list[i];
        }
    }
}

static bool make_nodes(const Tracker *t, Link *link)
{
    int list[NEAR_MOST], near = nodes_about(&t->tree, link->parent, list);
    double length = path_length(&link->path), depth = INSIDE * link->radius;
    double from = link->is_inner ? 0 : arc_at_depth(&t->tree, list, near, &link->path, depth);
    double wall = link->is_inner ? 0.5 * length : arc_at_depth(&t->tree, list, near, &link->path, 0);
    link->place = path_at(&link->path, wall);
    int steps = (int)fmin(STATIONS_MOST, ceil((length - from) / (SPACING * link->radius) - 1e-9));
    double spacing = steps > 0 ? (length - from) / steps : 0, ahead = 0.5 * link->radius;
    bool good = true;
    for (int k = from > 0 ? 0 : 1; good && k < steps; k++) {
        double arc = from + k * spacing;
        Vec3 axis = vec3_unit_or(vec3_sub(path_at(&link->path, arc + ahead), path_at(&link->path, arc - ahead)), t->tree.node[link->node].cylinder.axis);
        good = append_station(t, link, path_at(&link->path, arc), axis, spacing, list, near);
    }
    if (good && !link->is_inner)
        choose_parent(t, link, list, near);
    return good;
}

// --- links ---

static RbtSupport support_of(double share) { return share >= 0.5 ? RBT_SUPPORTED : share >= 0.25 ? RBT_DOUBTFUL : RBT_REFUSED; }

// Median radius over a vessel's first nodes, because the ostium may widen the first one.
static double root_radius(const Track *tree, int node)
{
    double radius[ROOT_NODES];
    int n = 0;
    for (int i = node; i < tree->count && n < ROOT_NODES && tree->node[i].branch == tree->node[node].branch && tree->node[i].kind == NODE_VESSEL; i++)
        radius[n++] = tree->node[i].cylinder.radius;
    sort_doubles(radius, (size_t)n);
    return n > 0 ? radius[n / 2] : tree->node[node].cylinder.radius;
}

static void measure_link(const Tracker *t, Link *link)
{
    const TrackNode *child = &t->tree.node[link->node], *parent = &t->tree.node[link->parent];
    bool is_sac = child->kind == NODE_ANEURYSM;
    link->length = vec3_distance(child->cylinder.center, parent->cylinder.center);
    link->radius = is_sac           ? fmin(parent->cylinder.radius, child->cylinder.radius)
                   : link->is_inner ? fmin(parent->cylinder.radius, child->cylinder.radius)
                                    : root_radius(&t->tree, link->node);
    link->light = rbt_link_light(&t->tree, t, link->node);
    link->scale = is_sac ? 1 : rbt_ring_scale(t, link->node, &link->light);
    link->failed = !rbt_link_path(t, parent->cylinder.center, child->cylinder.center, fmax(link->radius, t->voxel), &link->light, &link->path);
    link->share = link->path.share;
    link->support = support_of(link->share);
    link->place = vec3_mix(parent->cylinder.center, child->cylinder.center, 0.5);
}

// Adds nodes to the link where they are allowed: a sac's neck is described by the sac's own points if sac and vessel touch.
static void fill_link(const Tracker *t, Link *link)
{
    const TrackNode *child = &t->tree.node[link->node], *parent = &t->tree.node[link->parent];
    bool is_sac = child->kind == NODE_ANEURYSM;
    if (link->failed || link->support == RBT_REFUSED || (is_sac && link->length <= child->cylinder.radius + parent->cylinder.radius))
        return;
    link->failed = !make_nodes(t, link);
}

typedef struct Round {
    const Tracker *t;
    Link *link;
} Round;

static void measure_job(void *context, long index)
{
    Round *round = context;
    measure_link(round->t, &round->link[index]);
    fill_link(round->t, &round->link[index]);
}

// Collects the links at which branches begin, and links within branches that are longer than the sum of both radii.
static Link *collect_links(const Track *tree, const bool *is_named, int *count)
{
    Link *link = calloc((size_t)tree->count + 1, sizeof *link);
    *count = 0;
    for (int i = 1; link && i < tree->count; i++) {
        const TrackNode *n = &tree->node[i], *p = &tree->node[n->parent];
        bool is_inner = n->branch == p->branch;
        if (is_inner && (n->kind == NODE_ANEURYSM || p->kind == NODE_ANEURYSM ||
                         vec3_distance(n->cylinder.center, p->cylinder.center) <= n->cylinder.radius + p->cylinder.radius))
            continue;
        link[(*count)++] = (Link){.node = i, .parent = n->parent, .is_inner = is_inner, .is_named = is_named[n->branch]};
    }
    return link;
}

// Marks the subtree of `node`, including itself. Repeats until nothing is added, because a branch may be attached to a later one.
static void mark_hanging(const Track *tree, int node, bool *hangs)
{
    memset(hangs, 0, (size_t)tree->count * sizeof *hangs);
    hangs[node] = true;
    for (bool changed = true; changed;) {
        changed = false;
        for (int i = 0; i < tree->count; i++)
            if (!hangs[i] && tree->node[i].parent >= 0 && hangs[tree->node[i].parent]) {
                hangs[i] = true;
                changed = true;
            }
    }
}

// Finds another parent for a branch whose link the image does not support. `hangs`: space for all nodes. Returns false if out of memory.
static bool attach_elsewhere(Tracker *t, Link *link, bool *hangs)
{
    static const double least[2] = {0.5, 0.25};
    Track *tree = &t->tree;
    double reach = 1.5 * link->length + 4 * fmax(link->radius, t->voxel);
    LinkPath path = {0};
    int met = -1;
    mark_hanging(tree, link->node, hangs);
    for (int k = 0; k < 2 && path.count == 0; k++)
        if (!rbt_link_search(t, link->node, hangs, reach, least[k], &link->light, &path, &met))
            return false;
    if (path.count == 0)
        return true;
    free(link->path.point);
    link->path = path;
    link->parent = met;
    link->is_moved = true;
    link->share = path.share;
    link->support = support_of(path.share);
    link->length = path_length(&path);
    fill_link(t, link);
    tree->node[link->node].parent = link->parent;
    return !link->failed;
}

// --- the new tree ---

typedef struct Rebuild {
    Tracker *t;
    Link *link;
    int *link_of;            // (nodes) link of each node; -1: none
    bool *keep;              // (nodes)
    int *place;              // (nodes) index in the new tree
    int *first, *end;        // (branches) range of nodes
    bool *is_done;           // (branches)
    int branches;
    Track new;
    LumenLine *line;
    int line_count;
} Rebuild;

static void add_line(Rebuild *r, Vec3 from, Vec3 to, double clear) { r->line[r->line_count++] = (LumenLine){from, to, clear}; }

// Appends a node with its link, and collects the lines that wall points must keep clear of.
static bool append_node(Rebuild *r, int i)
{
    const Track *tree = &r->t->tree;
    TrackNode node = tree->node[i];
    Link *link = r->link_of[i] >= 0 ? &r->link[r->link_of[i]] : NULL;
    int parent = link ? r->place[link->parent] : node.parent >= 0 ? r->place[node.parent] : -1;
    bool good = true, is_shut = link && link->support == RBT_KEPT;
    Vec3 last = parent >= 0 ? r->new.node[parent].cylinder.center : node.cylinder.center;
    for (int k = 0; link && good && k < link->nodes.count; k++) {
        TrackNode between = link->nodes.node[k];
        between.parent = parent;
        add_line(r, last, between.cylinder.center, (link->is_inner ? LUMEN_TUBE_CLEAR : LUMEN_LINK_CLEAR) * between.cylinder.radius);
        good = track_append(&r->new, &between, link->nodes.point + between.point_start);
        parent = r->new.count - 1;
        last = between.cylinder.center;
    }
    if (parent >= 0 && !is_shut) {
        const TrackNode *p = &r->new.node[parent];
        double radius = fmin(node.cylinder.radius, p->cylinder.radius);
        bool is_link = link && !link->is_inner && node.kind == NODE_VESSEL;
        add_line(r, last, node.cylinder.center, (is_link ? LUMEN_LINK_CLEAR : LUMEN_TUBE_CLEAR) * (is_link ? link->radius : radius));
    }
    node.parent = parent;
    r->place[i] = r->new.count;
    return good && track_append(&r->new, &node, tree->point + tree->node[i].point_start);
}

// Appends a branch after its parent branch.
static bool append_branch(Rebuild *r, int branch)
{
    const Track *tree = &r->t->tree;
    int first = r->first[branch];
    bool good = true;
    if (r->is_done[branch] || first >= r->end[branch])
        return true;
    r->is_done[branch] = true;
    int parent = r->link_of[first] >= 0 ? r->link[r->link_of[first]].parent : tree->node[first].parent;
    if (parent >= 0)
        good = append_branch(r, tree->node[parent].branch);
    for (int i = first; good && i < r->end[branch]; i++)
        good = !r->keep[i] || append_node(r, i);
    return good;
}

// Removes points in a tool's path, which are not wall.
static bool drop_inner_points(Track *tree, const LumenLine *line, int line_count)
{
    LumenLines *lines = lumen_lines_create(line, line_count);
    if (!lines)
        return false;
    for (int i = 0; i < tree->count; i++) {
        TrackNode *n = &tree->node[i];
        Vec3 *point = tree->point + n->point_start;
        int kept = 0;
        for (int k = 0; k < n->point_count; k++)
            if (!lumen_lines_hold(lines, point[k]))
                point[kept++] = point[k];
        n->point_count = kept;   // the space behind them stays unused
    }
    lumen_lines_free(lines);
    return true;
}

static bool rebuild_tree(Rebuild *r)
{
    Track *tree = &r->t->tree;
    int most = tree->count + 1;
    bool good = true;
    for (int i = 0; i < tree->count; i++)
        most += r->link_of[i] >= 0 ? r->link[r->link_of[i]].nodes.count : 0;
    r->line = malloc((size_t)most * sizeof *r->line);
    r->place = malloc(((size_t)tree->count + 1) * sizeof *r->place);
    r->first = calloc((size_t)r->branches + 1, sizeof *r->first);
    r->end = calloc((size_t)r->branches + 1, sizeof *r->end);
    r->is_done = calloc((size_t)r->branches + 1, sizeof *r->is_done);
    good = r->line && r->place && r->first && r->end && r->is_done;
    for (int i = tree->count - 1; good && i >= 0; i--) {
        int branch = tree->node[i].branch;
        r->first[branch] = i;
        r->end[branch] = r->end[branch] > 0 ? r->end[branch] : i + 1;
    }
    for (int b = 0; good && b < r->branches; b++)
        good = append_branch(r, b);
    good = good && drop_inner_points(&r->new, r->line, r->line_count);
    if (good) {
        track_free(tree);
        *tree = r->new;
    } else {
        track_free(&r->new);
    }
    free(r->line);
    free(r->place);
    free(r->first);
    free(r->end);
    free(r->is_done);
    return good;
}

// Handles refused links: the branch is removed with its subtree, unless the trace file gives it or a part of the subtree.
static void decide(const Track *tree, Link *link, int link_count, const bool *is_named, bool *hangs, bool *keep)
{
    for (int i = 0; i < tree->count; i++)
        keep[i] = true;
    for (int l = 0; l < link_count; l++) {
        bool named = link[l].is_named;
        if (link[l].support != RBT_REFUSED)
            continue;
        mark_hanging(tree, link[l].node, hangs);
        for (int i = 0; i < tree->count; i++)
            named = named || (hangs[i] && is_named[tree->node[i].branch]);
        link[l].support = named ? RBT_KEPT : RBT_REFUSED;
        for (int i = 0; !named && i < tree->count; i++)
            keep[i] = keep[i] && !hangs[i];
    }
}

static void report_link(const Track *tree, const Link *link, const bool *keep, RbtJunction *out)
{
    *out = (RbtJunction){.branch = tree->node[link->node].branch,
                         .parent = tree->node[link->parent].branch,
                         .place = link->place,
                         .length = link->length,
                         .share = link->share,
                         .support = link->support,
                         .is_moved = link->is_moved,
                         .is_inner = link->is_inner,
                         .node_count = keep[link->node] ? link->nodes.count : 0};
    for (int k = 0; k < link->nodes.count && keep[link->node]; k++)
        out->point_count += link->nodes.node[k].point_count;
}

// Counts the nodes and the length [mm] of centreline removed with a refused link, without those of earlier refused links.
static void count_dropped(const Track *tree, const Link *link, bool *hangs, bool *counted, RbtJunction *out)
{
    mark_hanging(tree, link->node, hangs);
    for (int i = 0; i < tree->count; i++) {
        if (!hangs[i] || counted[i])
            continue;
        counted[i] = true;
        out->dropped_nodes++;
        out->dropped_mm += i == link->node ? 0 : vec3_distance(tree->node[i].cylinder.center, tree->node[tree->node[i].parent].cylinder.center);
    }
}

static bool list_junctions(const Track *tree, const Link *link, int link_count, const bool *keep, bool *hangs, RbtJunctions *out)
{
    bool *counted = calloc((size_t)tree->count + 1, sizeof *counted);
    out->count = 0;
    out->junction = calloc((size_t)link_count + 1, sizeof *out->junction);
    bool good = counted && out->junction;
    for (int l = 0; good && l < link_count; l++) {
        RbtJunction j;
        if (link[l].support != RBT_REFUSED && !keep[link[l].node])   // removed with its parent
            continue;
        report_link(tree, &link[l], keep, &j);
        if (link[l].support == RBT_REFUSED)
            count_dropped(tree, &link[l], hangs, counted, &j);
        if (link[l].support != RBT_REFUSED || j.dropped_nodes > 0)
            out->junction[out->count++] = j;
    }
    free(counted);
    return good;
}

bool rbt_open_ostia(Tracker *t, const bool *is_named, int threads, RbtJunctions *out)
{
    Track *tree = &t->tree;
    int count = 0;
    rbt_measure_set_nodes(t);
    Link *link = collect_links(tree, is_named, &count);
    bool *hangs = calloc((size_t)tree->count + 1, sizeof *hangs), *keep = calloc((size_t)tree->count + 1, sizeof *keep);
    int *link_of = malloc(((size_t)tree->count + 1) * sizeof *link_of);
    bool good = link && hangs && keep && link_of;
    Round round = {t, link};
    if (good)
        parallel_for(threads, count, measure_job, &round, NULL);
    for (int l = 0; good && l < count; l++)
        tree->node[link[l].node].parent = link[l].parent;
    for (int l = 0; good && l < count; l++)
        good = !link[l].failed && (link[l].support != RBT_REFUSED || link[l].is_inner || attach_elsewhere(t, &link[l], hangs));
    if (good) {
        Rebuild r = {.t = t, .link = link, .link_of = link_of, .keep = keep};
        decide(tree, link, count, is_named, hangs, keep);
        good = list_junctions(tree, link, count, keep, hangs, out);
        for (int i = 0; i < tree->count; i++) {
            link_of[i] = -1;
            r.branches = tree->node[i].branch >= r.branches ? tree->node[i].branch + 1 : r.branches;
        }
        for (int l = 0; l < count; l++)
            link_of[link[l].node] = l;
        good = good && rebuild_tree(&r);
    }
    for (int l = 0; link && l < count; l++) {
        free(link[l].path.point);
        track_free(&link[l].nodes);
    }
    free(link);
    free(hangs);
    free(keep);
    free(link_of);
    return good;
}

// A ball is free if the field is above 0 at 32 points of its surface (vertices and faces of an icosahedron) and of a ball of half its size. A point below 0 at
// the tool's radius proves that the place is blocked. Between the 32 directions a wall may come up to 7.5 % closer (a flat wall: 1 - cos 21.6 degrees); so the
// clearance is measured only where the ball enlarged by that is blocked and the ball itself is free.
//
// Aside: stations along the link, at a spacing of a quarter of its lesser radius, with 17 places at each (the line, and two rings of eight), and a depth-first
// search over neighbouring places of the same station and of the adjacent ones. It is run only if the line itself is blocked.
#include "geom/reach.h"

#include "base/base.h"
#include "geom/power_walk.h"
#include "geom/vessel_branches.h"

#include <stdlib.h>

enum { DIRECTIONS = 32, RING = 8, PLACES = 1 + 2 * RING, FINE = 10, COARSE = 4, STATIONS_MAX = 200 };
static const double BETWEEN = 1.075;         // 1 / cosine of the largest angle between any direction and the closest of the 32

typedef struct Flood {
    const ModelField *model;
    const VesselTree *tree;  // its nodes
    const ReachOptions *options;
    bool closes_root;
    Vec3 direction[DIRECTIONS];
    uint32_t *mask;          // (N) places around node i that the flood REACH_ASIDE reached, on the disc that ends its link; bit 0: the line
} Flood;

ReachOptions reach_default_options(void) { return (ReachOptions){.tool_radius = 0.18, .aside = 0.5}; }

// Golden ratio coordinates of the vertices; a face is the sum of three adjacent vertices.
static void fill_directions(Vec3 direction[DIRECTIONS])
{
    const double g = 0.5 * (1 + sqrt(5));
    int count = 0;
    Vec3 vertex[12];
    for (int axis = 0; axis < 3; axis++)
        for (int sign = 0; sign < 4; sign++) {
            double c[3] = {0, 0, 0};
            c[(axis + 1) % 3] = sign & 1 ? 1 : -1, c[(axis + 2) % 3] = sign & 2 ? g : -g;
            vertex[4 * axis + sign] = vec3_unit(vec3(c[0], c[1], c[2]));
        }
    for (int i = 0; i < 12; i++)
        direction[count++] = vertex[i];
    for (int i = 0; i < 12; i++)
        for (int j = i + 1; j < 12; j++)
            for (int k = j + 1; k < 12; k++)
                if (vec3_dot(vertex[i], vertex[j]) > 0.4 && vec3_dot(vertex[j], vertex[k]) > 0.4 && vec3_dot(vertex[i], vertex[k]) > 0.4)
                    direction[count++] = vec3_unit(vec3_add(vertex[i], vec3_add(vertex[j], vertex[k])));
}

// --- The field ---

double reach_field(const ModelField *model, Vec3 x, int *node)
{
    *node = power_walk(model->tree, x, *node, 4);
    return model_field_at(model, *node, x, NULL);
}

// The same, with the section of an open root at which the field closes extended upstream of its plane.
static double field_at(const Flood *f, Vec3 x, int *node)
{
    if (f->closes_root) {
        Vec3 away = vec3_sub(x, f->tree->center[0]);
        double z = vec3_dot(away, f->tree->direction[0]), r = f->tree->radius[0];
        if (z < 0 && vec3_norm2(away) < 16 * r * r)
            x = vec3_add_scaled(x, -z, f->tree->direction[0]);
    }
    return reach_field(f->model, x, node);
}

// Distance along the ray from x in direction d at which the field's sign first changes; `most` if that is further.
static double first_change(const Flood *f, Vec3 x, int node, Vec3 d, bool inside, double step, double most)
{
    double before = 0;
    while (before < most) {
        double at = fmin(before + step, most);
        if ((field_at(f, vec3_add_scaled(x, at, d), &node) > 0) != inside) {
            for (int i = 0; i < 20; i++) {
                double middle = 0.5 * (before + at);
                if ((field_at(f, vec3_add_scaled(x, middle, d), &node) > 0) == inside)
                    before = middle;
                else
                    at = middle;
            }
            return 0.5 * (before + at);
        }
        before = at;
    }
    return most;
}

// The closest change of sign among the 32 directions, then repeatedly along the wall's normal there, as long as the distance falls.
static double clearance_at(const Flood *f, Vec3 x, int node, double most)
{
    bool inside = field_at(f, x, &node) > 0;
    double least = most;
    Vec3 best = {0, 0, 0};
    for (int k = 0; k < DIRECTIONS; k++) {
        double t = first_change(f, x, node, f->direction[k], inside, 0.15 * fmin(least, f->tree->radius[node]), least);
        if (t < least)
            least = t, best = f->direction[k];
    }
    for (int i = 0; i < 6 && least < most; i++) {
        Vec3 wall = vec3_add_scaled(x, least, best), g;
        int at = node;
        field_at(f, wall, &at);
        model_field_at(f->model, at, wall, &g);
        Vec3 d = vec3_unit_or(inside ? vec3_negate(g) : g, best);
        double t = first_change(f, x, node, d, inside, 0.15 * fmin(least, f->tree->radius[node]), least);
        if (!(t < least * (1 - 1e-6)))
            break;
        least = t, best = d;
    }
    return inside ? least : -least;
}

double reach_clearance(const ModelField *model, Vec3 x, int node, double most)
{
    Flood f = {.model = model, .tree = model->tree, .closes_root = model_field_closes_root(model)};
    fill_directions(f.direction);
    return clearance_at(&f, x, node, most);
}

double reach_on_line(const VesselTree *of, const ReachJunction *junction, const ModelField *in, double most, Vec3 *place)
{
    enum { SAMPLES = 40 };
    Flood f = {.model = in, .tree = in->tree, .closes_root = model_field_closes_root(in)};
    double least = most;
    fill_directions(f.direction);
    *place = of->center[junction->node];
    for (int at = junction->last; at != junction->parent && at >= 0; at = of->parent[at])
        for (int i = 0; i <= SAMPLES && of->parent[at] >= 0; i++) {
            Vec3 x = vec3_mix(of->center[at], of->center[of->parent[at]], (double)i / SAMPLES);
            double c = clearance_at(&f, x, power_nearest(in->tree, x), most);
            if (c < least)
                least = c, *place = x;
        }
    return least;
}

static bool sphere_is_free(const Flood *f, Vec3 x, int node, double radius, int directions)
{
    for (int k = 0; k < directions; k++) {
        int at = node;
        if (!(field_at(f, vec3_add_scaled(x, radius, f->direction[k]), &at) > 0))
            return false;
    }
    return true;
}

static bool ball_is_free(const Flood *f, Vec3 x, int node, double radius)
{
    if (!(field_at(f, x, &node) > 0) || !sphere_is_free(f, x, node, 0.5 * radius, 12))
        return false;
    if (sphere_is_free(f, x, node, BETWEEN * radius, DIRECTIONS))
        return true;
    return sphere_is_free(f, x, node, radius, DIRECTIONS) && clearance_at(f, x, node, 1.5 * radius) >= radius;
}

// --- One link ---

typedef struct Link {
    Vec3 from, to, e1, e2;   // e1, e2: perpendicular to it
    double length, radius;   // radius: the lesser of the two nodes
    int parent, node;
    int coarse;              // number of stations - 1
} Link;

static Link link_of(const VesselTree *tree, int node)
{
    int parent = tree->parent[node];
    Link l = {.from = tree->center[parent], .to = tree->center[node], .parent = parent, .node = node};
    l.length = vec3_distance(l.from, l.to);
    l.radius = fmin(tree->radius[node], tree->radius[parent]);
    double pieces = ceil(COARSE * l.length / l.radius);
    l.coarse = pieces < 1 ? 1 : pieces > STATIONS_MAX - 1 ? STATIONS_MAX - 1 : (int)pieces;
    Vec3 along = vec3_unit_or(vec3_sub(l.to, l.from), tree->direction[node]);
    l.e1 = vec3_normal_to(along);
    l.e2 = vec3_cross(along, l.e1);
    return l;
}

static Vec3 link_place(const Flood *f, const Link *l, int station, int place)
{
    Vec3 x = vec3_mix(l->from, l->to, (double)station / l->coarse);
    if (place == 0)
        return x;
    double angle = 2 * PI / RING * ((place - 1) % RING), far = f->options->aside * l->radius * (place <= RING ? 0.5 : 1);
    return vec3_add_scaled(vec3_add_scaled(x, far * same_cos(angle), l->e1), far * same_sin(angle), l->e2);
}

// Fraction of the line, from the parent's centre, on which the field is above 0.
static double point_share(const Flood *f, const Link *l)
{
    double pieces = ceil(FINE * l->length / l->radius);
    int count = pieces < 4 ? 4 : pieces > 2000 ? 2000 : (int)pieces, node = l->parent;
    for (int k = 0; k <= count; k++) {
        if (field_at(f, vec3_mix(l->from, l->to, (double)k / count), &node) > 0)
            continue;
        double open = (double)(k - 1) / count, shut = (double)k / count;
        for (int i = 0; k > 0 && i < 12; i++) {
            double middle = 0.5 * (open + shut);
            *(field_at(f, vec3_mix(l->from, l->to, middle), &node) > 0 ? &open : &shut) = middle;
        }
        return fmax(open, 0);
    }
    return 1;
}

static double tool_share(const Flood *f, const Link *l)
{
    for (int k = 0; k <= l->coarse; k++)
        if (!ball_is_free(f, link_place(f, l, k, 0), k < l->coarse ? l->parent : l->node, f->options->tool_radius))
            return (double)(k > 0 ? k - 1 : 0) / l->coarse;
    return 1;
}

// Returns whether the ball is free between a and b; the two ends are not tested.
static bool path_is_free(const Flood *f, Vec3 a, Vec3 b, int node)
{
    double pieces = ceil(vec3_distance(a, b) / (0.5 * f->options->tool_radius));
    int count = pieces > 100 ? 100 : (int)pieces;
    for (int k = 1; k < count; k++)
        if (!ball_is_free(f, vec3_mix(a, b, (double)k / count), node, f->options->tool_radius))
            return false;
    return true;
}

typedef struct Search {
    const Flood *f;
    const Link *l;
    uint8_t state[STATIONS_MAX][PLACES];     // 0 untested, 1 blocked, 2 free, 3 reached
    uint16_t stack[STATIONS_MAX * PLACES];
    int depth, furthest;
} Search;

static bool place_is_free(Search *s, int station, int place)
{
    uint8_t *state = &s->state[station][place];
    if (*state == 0) {
        Vec3 x = link_place(s->f, s->l, station, place);
        *state = ball_is_free(s->f, x, 2 * station < s->l->coarse ? s->l->parent : s->l->node, s->f->options->tool_radius) ? 2 : 1;
    }
    return *state >= 2;
}

static void reach_place(Search *s, int station, int place)
{
    s->state[station][place] = 3;
    s->stack[s->depth++] = (uint16_t)(station * PLACES + place);
    s->furthest = station > s->furthest ? station : s->furthest;
}

static void try_place(Search *s, Vec3 from, int station, int place)
{
    if (station < 0 || station > s->l->coarse || s->state[station][place] == 3 || !place_is_free(s, station, place))
        return;
    if (path_is_free(s->f, from, link_place(s->f, s->l, station, place), 2 * station < s->l->coarse ? s->l->parent : s->l->node))
        reach_place(s, station, place);
}

// Lists a place and its neighbours on the same disc, itself first. Returns the count.
static int places_beside(int place, int beside[1 + RING])
{
    int count = 0, ring = (place - 1) / RING, at = (place - 1) % RING;
    beside[count++] = place;
    if (place == 0) {
        for (int k = 0; k < RING; k++)
            beside[count++] = 1 + k;
        return count;
    }
    beside[count++] = ring == 0 ? 0 : 1 + at;
    if (ring == 0)
        beside[count++] = 1 + RING + at;
    beside[count++] = 1 + ring * RING + (at + 1) % RING;
    beside[count++] = 1 + ring * RING + (at + RING - 1) % RING;
    return count;
}

// Pushes the previous station first and the line of the next station last, so that the latter is on top of the stack. Ends when the last station is reached.
static void search_link(Search *s)
{
    while (s->depth > 0 && s->furthest < s->l->coarse) {
        int top = s->stack[--s->depth], station = top / PLACES, place = top % PLACES, beside[1 + RING];
        Vec3 from = link_place(s->f, s->l, station, place);
        int count = places_beside(place, beside);
        for (int step = -1; step <= 1; step++)
            for (int k = count - 1; k >= 0; k--)
                try_place(s, from, station + step, beside[k]);
    }
}

// Finds the places of the first disc that the ball reaches from the places around the parent, each from the closest of these.
static void enter_link(Search *s)
{
    const Flood *f = s->f;
    int parent = s->l->parent;
    Vec3 reached[PLACES];
    int count = 0;
    Link before = f->tree->parent[parent] >= 0 ? link_of(f->tree, parent) : *s->l;
    int end = f->tree->parent[parent] >= 0 ? before.coarse : 0;
    for (int place = 0; place < PLACES; place++)
        if (f->mask[parent] >> place & 1)
            reached[count++] = link_place(f, &before, end, place);
    for (int place = PLACES - 1; place >= 0 && count > 0; place--) {
        Vec3 x = link_place(f, s->l, 0, place);
        int nearest = 0;
        for (int k = 1; k < count; k++)
            if (vec3_distance(reached[k], x) < vec3_distance(reached[nearest], x))
                nearest = k;
        try_place(s, reached[nearest], 0, place);
    }
}

static double aside_share(Flood *f, const Link *l, double on_line)
{
    if (f->mask[l->parent] == 0)
        return 0;
    if (on_line >= 1 && (f->mask[l->parent] & 1)) {
        f->mask[l->node] = 1;
        return 1;
    }
    Search s = {.f = f, .l = l, .furthest = -1};
    enter_link(&s);
    search_link(&s);
    for (int place = 0; place < PLACES; place++)
        f->mask[l->node] |= (uint32_t)(s.state[l->coarse][place] == 3) << place;
    return s.furthest <= 0 ? 0 : (double)s.furthest / l->coarse;
}

// --- Clearances ---

// The least clearance along the line between two nodes; measures only places that can be closer than the value found so far.
static void least_on_line(const Flood *f, const Link *l, double *least, Vec3 *place)
{
    double pieces = ceil(FINE * l->length / l->radius);
    int count = pieces < 4 ? 4 : pieces > 2000 ? 2000 : (int)pieces, node = l->parent;
    for (int k = 0; k <= count; k++) {
        Vec3 x = vec3_mix(l->from, l->to, (double)k / count);
        double field = field_at(f, x, &node);
        if (field > 0 && *least <= 0)
            continue;
        if (field > 0 && sphere_is_free(f, x, node, BETWEEN * *least, DIRECTIONS) && sphere_is_free(f, x, node, 0.5 * *least, 12))
            continue;
        // outside, the depth counts, so the search extends further than the value found so far
        double most = field > 0 ? *least : 3 * l->radius + l->length, c = clearance_at(f, x, node, most);
        if (c < *least)
            *least = c, *place = x;
    }
}

static int by_lost(const void *a, const void *b)
{
    const ReachStop *x = a, *y = b;
    return x->lost != y->lost ? (x->lost < y->lost) - (x->lost > y->lost) : (x->node > y->node) - (x->node < y->node);
}

static int by_clearance(const void *a, const void *b)
{
    const ReachJunction *x = a, *y = b;
    return x->clearance != y->clearance ? (x->clearance > y->clearance) - (x->clearance < y->clearance) : (x->node > y->node) - (x->node < y->node);
}

// Follows the branch from the parent's centre until its nodes are clear of the parent's wall.
static void measure_junction(const Flood *f, const VesselBranches *branches, const VesselBranch *branch, ReachJunction *out)
{
    const VesselTree *tree = f->tree;
    const int *node = branches->node + branch->first;
    int parent = branch->from_node;
    double r = tree->radius[node[0]];
    *out = (ReachJunction){.parent = parent, .node = node[0], .last = node[0], .apart = reach_link_is_apart(tree, node[0])};
    out->clearance = fmax(r, 2 * f->options->tool_radius);
    out->place = tree->center[node[0]];
    for (int k = 0; k < branch->count; k++) {
        Link l = link_of(tree, node[k]);
        least_on_line(f, &l, &out->clearance, &out->place);
        out->last = node[k];
        if (vec3_distance(tree->center[node[k]], tree->center[parent]) > tree->radius[parent] + 1.5 * r)
            break;
    }
}

static bool measure_junctions(const Flood *f, Reach *reach)
{
    VesselBranches *branches = vessel_branches_create(f->tree);
    reach->junction = branches ? calloc((size_t)branches->count + 1, sizeof *reach->junction) : NULL;
    if (!reach->junction) {
        vessel_branches_free(branches);
        return false;
    }
    for (int b = 0; b < branches->count; b++)
        if (branches->branch[b].from_node >= 0)
            measure_junction(f, branches, &branches->branch[b], &reach->junction[reach->junction_count++]);
    vessel_branches_free(branches);
    qsort(reach->junction, (size_t)reach->junction_count, sizeof *reach->junction, by_clearance);
    for (int k = 0; k < reach->junction_count; k++) {
        const ReachJunction *j = &reach->junction[k];
        reach->capped += j->clearance < 0;
        reach->capped_apart += j->clearance < 0 && j->apart;
        reach->narrow += j->clearance < reach->options.tool_radius;
        reach->narrow_apart += j->clearance < reach->options.tool_radius && j->apart;
    }
    return true;
}

// --- The whole tree ---

static void flood_root(Flood *f, Reach *reach)
{
    const VesselTree *tree = f->tree;
    int node = 0;
    bool open = field_at(f, tree->center[0], &node) > 0, free = open && ball_is_free(f, tree->center[0], 0, f->options->tool_radius);
    reach->share[0][REACH_POINT] = open;
    reach->share[0][REACH_TOOL] = free;
    f->mask[0] = free;
    // if the middle of the inlet is blocked, the first disc of the root's first link represents the inlet
    if (!free && tree->neighbour_offset[1] > tree->neighbour_offset[0]) {
        Link l = link_of(tree, tree->neighbour[tree->neighbour_offset[0]]);
        for (int place = 1; place < PLACES; place++)
            f->mask[0] |= (uint32_t)ball_is_free(f, link_place(f, &l, 0, place), 0, f->options->tool_radius) << place;
    }
    reach->share[0][REACH_ASIDE] = f->mask[0] != 0;
}

static void flood_links(Flood *f, Reach *reach)
{
    const VesselTree *tree = f->tree;
    for (int i = 1; i < tree->node_count; i++) {
        Link l = link_of(tree, i);
        const float *before = reach->share[l.parent];
        float *share = reach->share[i];
        if (before[REACH_POINT] >= 1)
            share[REACH_POINT] = (float)point_share(f, &l);
        if (before[REACH_ASIDE] >= 1) {
            double line = tool_share(f, &l);
            if (before[REACH_TOOL] >= 1)
                share[REACH_TOOL] = (float)line;
            share[REACH_ASIDE] = (float)aside_share(f, &l, line);
        }
        bool apart = reach_link_is_apart(tree, i);
        reach->apart_links += apart;
        reach->apart_open += apart && point_share(f, &l) >= 1;
        if (tree->kind[i] == NODE_VESSEL && !apart) {
            reach->length += l.length;
            for (int mode = 0; mode < REACH_MODES; mode++)
                reach->reached[mode] += share[mode] * l.length;
        }
        reach->sac_nodes += tree->kind[i] != NODE_VESSEL;
        reach->sac_nodes_reached += tree->kind[i] != NODE_VESSEL && share[REACH_POINT] >= 1;
    }
}

// The constriction that blocks a ball may lie ahead of where it stops: finds the least clearance on the line from there over one diameter, along the children
// with most centreline beyond them.
static void judge_stop(const Flood *f, const double *all, ReachStop *stop)
{
    const VesselTree *tree = f->tree;
    double ahead = -2 * f->options->tool_radius;
    stop->clearance = 4 * f->options->tool_radius;
    stop->place = tree->center[stop->node];
    for (int at = stop->node; at >= 0 && ahead <= 0;) {
        Link l = tree->parent[at] >= 0 ? link_of(tree, at) : (Link){.from = tree->center[0], .to = tree->center[0], .radius = tree->radius[0]};
        least_on_line(f, &l, &stop->clearance, &stop->place);
        ahead += at == stop->node ? 0 : l.length;
        int next = -1;
        for (int k = tree->neighbour_offset[at]; k < tree->neighbour_offset[at + 1]; k++) {
            int child = tree->neighbour[k];
            if (child > at && tree->kind[child] == tree->kind[at] && (next < 0 || all[child] > all[next]))
                next = child;
        }
        at = next;
    }
    stop->capped = stop->clearance < 0;
}

static bool list_stops(const Flood *f, Reach *reach)
{
    const VesselTree *tree = f->tree;
    double *lost = calloc((size_t)tree->node_count, sizeof *lost), *all = calloc((size_t)tree->node_count, sizeof *all);
    bool *behind = calloc((size_t)tree->node_count, sizeof *behind);
    for (int i = tree->node_count - 1; i >= 0 && lost && all; i--) {
        int parent = tree->parent[i];
        double length = parent >= 0 && tree->kind[i] == NODE_VESSEL && !reach_link_is_apart(tree, i) ? vec3_distance(tree->center[i], tree->center[parent]) : 0;
        lost[i] += length * (1 - (double)reach->share[i][REACH_ASIDE]);
        all[i] += length;
        if (parent >= 0)
            lost[parent] += lost[i], all[parent] += all[i];
        reach->stop_count += reach->share[i][REACH_ASIDE] < 1 && (parent < 0 || reach->share[parent][REACH_ASIDE] >= 1);
    }
    reach->stop = calloc((size_t)reach->stop_count + 1, sizeof *reach->stop);
    bool good = lost && all && behind && reach->stop;
    for (int i = 0, count = 0; good && i < tree->node_count; i++) {
        int parent = tree->parent[i];
        bool apart = reach_link_is_apart(tree, i);
        behind[i] = parent >= 0 && (behind[parent] || apart);
        if (behind[i] && !behind[parent])
            reach->apart_length += all[i];
        if (!(reach->share[i][REACH_ASIDE] < 1) || (parent >= 0 && reach->share[parent][REACH_ASIDE] < 1))
            continue;
        ReachStop *stop = &reach->stop[count++];
        *stop = (ReachStop){.node = i, .apart = apart, .lost = lost[i]};
        judge_stop(f, all, stop);
    }
    free(lost);
    free(all);
    free(behind);
    if (good)
        qsort(reach->stop, (size_t)reach->stop_count, sizeof *reach->stop, by_lost);
    return good;
}

Reach *reach_create(const ModelField *model, const ReachOptions *options)
{
    const VesselTree *tree = model->tree;
    if (!model_field_exists(model) || !(options->tool_radius > 0) || !isfinite(options->tool_radius) || !(options->aside >= 0) || options->aside > 1)
        return NULL;
    size_t n = (size_t)tree->node_count;
    Reach *reach = calloc(1, sizeof *reach);
    Flood f = {.model = model, .tree = tree, .options = options, .closes_root = model_field_closes_root(model), .mask = calloc(n, sizeof *f.mask)};
    bool good = reach && f.mask && (reach->share = calloc(n, sizeof *reach->share));
    if (good) {
        reach->options = *options;
        reach->node_count = tree->node_count;
        fill_directions(f.direction);
        flood_root(&f, reach);
        flood_links(&f, reach);
        good = list_stops(&f, reach) && measure_junctions(&f, reach);
    }
    free(f.mask);
    if (!good) {
        reach_free(reach);
        reach = NULL;
    }
    return reach;
}

void reach_free(Reach *reach)
{
    if (!reach)
        return;
    free(reach->share);
    free(reach->stop);
    free(reach->junction);
    free(reach);
}

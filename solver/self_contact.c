// Finds the contacts of the chain with itself.
//
// The curve consists of the elements' cubics (slot.h). Two elements i < j form a pair if the arc between them is at least 2 pi (r_i + r_j): half a turn of a
// circle of four radii. No wire or catheter bends more tightly without a kink (its surface strain would be a quarter). Closer along the tool, bending keeps
// elements apart. An arc of length a that turns by theta in total has a chord of at least a cos(theta/2) (it stays in a cone about its middle direction). Pairs
// with less than a right angle between them are therefore 3.4 (r_i + r_j) clear of each other and need no check.
//
// The others are found by a tree of spheres over the chain, with leaves of eight elements; the cost is linear in the number of elements if the tool is not
// coiled up. While no pair is near, nothing is done until some point has travelled as far as the known clearance.
//
// Elements are cut into pieces at their slots, because two adjacent arcs may be near at more than one place. The closest points of two pieces' chords are the
// initial values of Newton's method on the cubics. Each closest point has a feature: an end of a piece, or its interior. If neighbouring pairs find the same
// two features, they have found one contact. Both contact forces act at the point half-way between the surfaces, so that friction produces no net moment.
//
// As with walls, the pairs' contact planes hold for small motions only. The pairs are therefore checked again at the solution and after the motion that was
// followed, and strands that have passed through each other count as a deep overlap (self_contact_depth). The sheath is no obstacle, and the held part of the
// tool touches nothing.
#include "solver/self_contact.h"

#include "solver/tools_internal.h"

#include <stdlib.h>
#include <string.h>

static const double ARC = 2 * PI;                // of the sum of radii: least arc between elements that can touch
static const double SAFE_TURN = 0.5 * PI, SAFE_CHORD = 0.70710678118654752;      // [rad]; share of the arc
static const double REACH = 0.1, REACH_MAX = 5, REACH_MIN = 0.01;  // [mm] search margin beyond the motion expected from the speed
static const double CLOSE = 0.03;                // [mm] pairs that may come closer than this enter the contact solve
static const double STEP_OUT_MAX = 0.2;          // [mm] largest overlap removed per step, as for walls
static const double PARALLEL = 1e-4;             // squared sine below which chords count as parallel: they have an overlap instead of closest points
static const double MISSED = 1e-3;               // [mm] overlap tolerated for a pair outside the contact solve
enum { LEAF = 8, LEVELS = 32, REFINE = 2 };
enum { NEAR_MAX = 2048, TABLE = 8192, PAIRS_MAX = 160, FEATURES_ON = 2 };

typedef struct Sphere {
    Vec3 at;
    double radius;
} Sphere;

typedef struct Near {
    int element[2], piece[2], feature[2];    // of point p of the chain: 2 p, of the piece from p to p + 1: 2 p + 1
    double xi[2];                    // share of the element
    ContactEnd end[2];
    Vec3 normal, force;
    double gap;                      // [mm] at the iterate
} Near;

typedef struct Kept {
    int feature[2];
    Vec3 force;
} Kept;

struct SelfContact {
    // state
    double clearance;        // [mm] lower bound of the distance of all pairs
    double fastest;          // [mm/ms] largest speed of the last motion
    int kept_count;
    Kept kept[PAIRS_MAX];    // forces of the last solve
    // scratch
    Vec3 *x, *t;             // (M) ends of the elements and tangents there
    double *length, *along, *turned, *radius, *bulge;    // (M) per element; arc length and accumulated turn up to its start
    int first, count;        // elements searched: first to count - 1
    double safe;             // [mm] distance guaranteed by the turning angle alone
    int levels, start[LEVELS + 1], size[LEVELS];
    Sphere *sphere;
    Vec3 *point;             // (P) where the pieces begin, in the order of the chain …
    bool *laid;              // (M) … of elements already visited
    double reach, look, nearest;     // [mm] gap up to which pairs are stored; search range; smallest bound of the pairs not stored
    int near_count;
    Near *near;              // (NEAR_MAX)
    int table[TABLE];        // 1 + index of the near pair with two features; hashed
    int near_of[PAIRS_MAX];  // index in `near` of each pair in the set
};

bool self_contact_create(Stepper *s)
{
    SelfContact *c = s->self = calloc(1, sizeof *c);
    if (!c)
        return false;
    size_t m = (size_t)s->wire.node_count;
    if (s->tools.count > 1)
        m = (size_t)s->tools.capacity;
    c->x = calloc(2 * m, sizeof *c->x);
    c->length = calloc(5 * m, sizeof *c->length);
    c->sphere = calloc(m + LEVELS, sizeof *c->sphere);
    c->point = calloc((size_t)s->points.capacity + 1, sizeof *c->point);
    c->laid = calloc(m, sizeof *c->laid);
    c->near = calloc(NEAR_MAX, sizeof *c->near);
    s->system.set.pair = calloc(PAIRS_MAX, sizeof *s->system.set.pair);
    if (!c->x || !c->length || !c->sphere || !c->point || !c->laid || !c->near || !s->system.set.pair)
        return false;
    c->t = c->x + m;
    c->along = c->length + m;
    c->turned = c->along + m;
    c->radius = c->turned + m;
    c->bulge = c->radius + m;
    return contact_solver_reserve_pairs(s->system.solver, PAIRS_MAX);
}

void self_contact_destroy(SelfContact *c)
{
    if (!c)
        return;
    free(c->x);
    free(c->length);
    free(c->sphere);
    free(c->point);
    free(c->laid);
    free(c->near);
    free(c);
}

// --- motions ---

static Vec3 by_solution(const Stepper *s, int node, int from)
{
    const double *u = s->system.u + row_of(s, node) + from, *k = s->iterate.moved + row_of(s, node) + from;
    return vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]);
}

static Vec3 since_look(const Stepper *s, int node, int from)
{
    const double *k = s->iterate.moved + row_of(s, node) + from, *seen = s->iterate.seen + row_of(s, node) + from;
    return vec3(k[0] - seen[0], k[1] - seen[1], k[2] - seen[2]);
}

static Vec3 done(const Stepper *s, int node, int from)
{
    const double *k = s->iterate.moved + row_of(s, node) + from;
    return vec3(k[0], k[1], k[2]);
}

static Vec3 by_speed(const Stepper *s, int node, int from) { return vec3_scale(from ? s->state.spin[node] : s->state.velocity[node], s->dt); }

typedef Vec3 (*Motion)(const Stepper *, int, int);

static Vec3 end_motion(const Stepper *s, const ContactEnd *end, Vec3 arm, Motion motion)
{
    Vec3 d = vec3(0, 0, 0);
    for (int e = 0; e < 2; e++) {
        int node = end->node + e;
        if (node < s->first_free)
            continue;
        d = vec3_add_scaled(d, end->weight[e], motion(s, node, 0));
        d = vec3_add(d, vec3_cross(motion(s, node, 3), vec3_add_scaled(end->lever[e], end->weight[e], arm)));
    }
    return d;
}

// The displacement of the first end relative to the second.
static Vec3 pair_motion(const Stepper *s, const ContactEnd end[2], Vec3 normal, Motion motion)
{
    return vec3_sub(end_motion(s, &end[0], vec3_scale(normal, -end[0].radius), motion), end_motion(s, &end[1], vec3_scale(normal, end[1].radius), motion));
}

// [mm] An upper bound of the displacement of any point of the axis. A cubic responds to its ends' rotations by at most 4/27 of its length each.
static double largest_travel(const Stepper *s, Motion motion)
{
    double move = 0, turn = 0, longest = 0;
    for (int i = s->first_free; i < s->state.node_count; i++) {
        double a = vec3_norm2(motion(s, i, 0)), b = vec3_norm2(motion(s, i, 3)), length = i > 0 ? s->wire.length[i - 1] : 0;
        move = a > move ? a : move;
        turn = b > turn ? b : turn;
        longest = length > longest ? length : longest;
    }
    return sqrt(move) + 8.0 / 27 * longest * sqrt(turn);
}

// --- the curve ---

static Vec3 tangent_of(Quat q) { return vec3(1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y)); }

// Sets positions and tangents, at the iterate or at the solution.
static void lay_curve(Stepper *s, bool would_go)
{
    SelfContact *c = s->self;
    int nodes = s->state.node_count;
    c->first = s->first_free > 0 ? s->first_free - 1 : 0;
    c->count = nodes - 1;
    for (int i = s->first_free; i < nodes; i++) {
        c->x[i] = s->state.position[i];
        c->t[i] = tangent_of(s->state.orientation[i]);
        if (would_go) {
            c->x[i] = vec3_add(c->x[i], by_solution(s, i, 0));
            c->t[i] = vec3_add(c->t[i], vec3_cross(by_solution(s, i, 3), c->t[i]));
        }
    }
    memset(c->laid, 0, (size_t)nodes * sizeof *c->laid);
    if (s->first_free > 0) {         // the element across the mouth begins at the mouth
        c->x[c->first] = s->entry.mouth;
        c->t[c->first] = s->entry.axis[0];
    }
}

static void measure_elements(Stepper *s)
{
    SelfContact *c = s->self;
    double along = 0, turned = 0, least = HUGE_VAL;
    for (int e = c->first; e < c->count; e++) {
        double length = s->wire.length[e];
        if (s->tools.count > 1)
            length = tools_span_length(s, e);
        if (e + 1 == s->first_free)
            length += stepper_sheath_coordinate(s, e);
        c->length[e] = fmax(length, 1e-6);
        c->radius[e] = fmin(s->wire.radius[e], s->wire.radius[e + 1]);
        least = fmin(least, c->radius[e]);
        Vec3 chord = vec3_unit_or(vec3_sub(c->x[e + 1], c->x[e]), c->t[e]);
        double a = vec3_distance(c->t[e], chord), b = vec3_distance(c->t[e + 1], chord);
        c->bulge[e] = 0.15 * c->length[e] * (a + b);
        c->along[e] = along;
        c->turned[e] = turned;
        along += c->length[e];
        turned += a * (1 + 0.05 * a * a) + b * (1 + 0.05 * b * b);
    }
    c->along[c->count] = along;
    c->turned[c->count] = turned;
    c->safe = 2 * least * (SAFE_CHORD * ARC - 1);
}

static Sphere around(Sphere a, Sphere b)
{
    double d = vec3_distance(a.at, b.at);
    if (d + b.radius <= a.radius)
        return a;
    if (d + a.radius <= b.radius)
        return b;
    double radius = 0.5 * (d + a.radius + b.radius);
    return (Sphere){vec3_add_scaled(a.at, (radius - a.radius) / d, vec3_sub(b.at, a.at)), radius};
}

static void build_tree(SelfContact *c)
{
    int count = (c->count - c->first + LEAF - 1) / LEAF, at = 0;
    c->levels = 0;
    for (int k = 0; k < count; k++) {
        int from = c->first + LEAF * k, to = from + LEAF < c->count ? from + LEAF : c->count;
        Vec3 low = c->x[from], high = low;
        for (int i = from + 1; i <= to; i++) {
            Vec3 x = c->x[i];
            low = vec3(fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z));
            high = vec3(fmax(high.x, x.x), fmax(high.y, x.y), fmax(high.z, x.z));
        }
        Vec3 middle = vec3_mix(low, high, 0.5);
        double far = 0, more = 0;
        for (int i = from; i <= to; i++)
            far = fmax(far, vec3_norm2(vec3_sub(c->x[i], middle)));
        for (int e = from; e < to; e++)
            more = fmax(more, c->bulge[e] + c->radius[e]);
        c->sphere[k] = (Sphere){middle, sqrt(far) + more};
    }
    for (; count > 0; count = (count + 1) / 2) {
        SEL_REQUIRE(c->levels < LEVELS, "each level of the tree has half as many spheres");
        int below = c->levels > 0 ? c->start[c->levels - 1] : 0;
        for (int k = 0; k < count && c->levels > 0; k++)
            c->sphere[at + k] = 2 * k + 1 < c->size[c->levels - 1] ? around(c->sphere[below + 2 * k], c->sphere[below + 2 * k + 1]) : c->sphere[below + 2 * k];
        c->start[c->levels] = at;
        c->size[c->levels++] = count;
        at += count;
        if (count == 1)
            break;
    }
}

// --- two elements ---

static double clamp(double x) { return x < 0 ? 0 : x > 1 ? 1 : x; }

// The closest points of two chords, as shares of their lengths; for parallel chords, the middle of their overlap.
static void nearest_on_chords(Vec3 p, Vec3 d, Vec3 q, Vec3 e, double xi[2])
{
    Vec3 r = vec3_sub(p, q);
    double a = vec3_norm2(d), b = vec3_dot(d, e), f = vec3_norm2(e), dr = vec3_dot(d, r), er = vec3_dot(e, r), det = a * f - b * b;
    if (!(a > 0 && f > 0)) {
        xi[0] = xi[1] = 0;
        return;
    }
    if (det <= PARALLEL * a * f) {
        double from = -dr / a, to = from + b / a, low = clamp(fmin(from, to)), high = clamp(fmax(from, to));
        xi[0] = 0.5 * (low + high);
    } else {
        xi[0] = clamp((b * er - f * dr) / det);
    }
    double second = (b * xi[0] + er) / f;
    xi[1] = clamp(second);
    if (second != xi[1])
        xi[0] = clamp((b * xi[1] - dr) / a);
}

static SlotPlace place_on(const SelfContact *c, int e, double xi)
{
    SEL_ASSERT(e >= c->first && e < c->count, "the element is one of those outside the sheath");
    Slot slot = slot_shifted(&(Slot){.element = e}, c->length[e], xi);
    return slot_place(&slot, c->length[e], c->x[e], c->t[e], c->x[e + 1], c->t[e + 1]);
}

static int pieces_of(const Stepper *s, int e) { return s->points.slot_start[e + 1] - s->points.slot_start[e] + 1; }
static int point_at(const Stepper *s, int e) { return e + s->points.slot_start[e]; }

// The start points of an element's pieces, and the end point of the last one.
static const Vec3 *lay_pieces(const Stepper *s, int e)
{
    SelfContact *c = s->self;
    Vec3 *point = c->point + point_at(s, e);
    int pieces = pieces_of(s, e);
    if (!c->laid[e]) {
        SEL_REQUIRE(point_at(s, e) + pieces <= s->points.capacity, "there is room for the ends of all pieces");
        c->laid[e] = true;
        point[0] = c->x[e];
        for (int k = 1; k < pieces; k++)
            point[k] = place_on(c, e, (double)k / pieces).position;
        point[pieces] = c->x[e + 1];
    }
    return point;
}

// The closest points of two pieces of cubics, starting from those of their chords; xi are shares of the elements.
static void nearest_on_pieces(const Stepper *s, const int e[2], const int piece[2], double xi[2], SlotPlace place[2])
{
    SEL_ASSERT(piece[0] >= 0 && piece[0] < pieces_of(s, e[0]) && piece[1] >= 0 && piece[1] < pieces_of(s, e[1]), "the pieces exist in their elements");
    const SelfContact *c = s->self;
    const Vec3 *p = lay_pieces(s, e[0]) + piece[0], *q = lay_pieces(s, e[1]) + piece[1];
    nearest_on_chords(p[0], vec3_sub(p[1], p[0]), q[0], vec3_sub(q[1], q[0]), xi);
    double low[2], high[2];
    for (int k = 0; k < 2; k++) {
        double pieces = pieces_of(s, e[k]);
        low[k] = piece[k] / pieces;
        high[k] = (piece[k] + 1) / pieces;
        xi[k] = low[k] + xi[k] / pieces;
    }
    for (int k = 0;; k++) {
        place[0] = place_on(c, e[0], xi[0]);
        place[1] = place_on(c, e[1], xi[1]);
        if (k == REFINE)
            return;
        Vec3 r = vec3_sub(place[0].position, place[1].position);
        double a = -vec3_dot(r, place[0].tangent), b = vec3_dot(r, place[1].tangent), between = vec3_dot(place[0].tangent, place[1].tangent);
        // a point at the end of its piece that would leave it is fixed there
        bool free_a = !((xi[0] <= low[0] && a <= 0) || (xi[0] >= high[0] && a >= 0)), free_b = !((xi[1] <= low[1] && b <= 0) || (xi[1] >= high[1] && b >= 0));
        double det = 1 - between * between;
        if (free_a && free_b && det > 0.01) {
            double both = (a + between * b) / det;
            b = (b + between * a) / det;
            a = both;
        } else if (free_a && free_b) {
            a *= 0.5, b *= 0.5;
        }
        if (free_a)
            xi[0] = fmax(low[0], fmin(high[0], xi[0] + a / c->length[e[0]]));
        if (free_b)
            xi[1] = fmax(low[1], fmin(high[1], xi[1] + b / c->length[e[1]]));
    }
}

static int feature_at(const Stepper *s, int element, int piece, double xi)
{
    double share = xi * pieces_of(s, element) - piece;
    return 2 * (point_at(s, element) + piece) + (share < 1e-9 ? 0 : share > 1 - 1e-9 ? 2 : 1);
}

static ContactEnd end_of(const Stepper *s, int e, const SlotPlace *p)
{
    bool from_mouth = e + 1 == s->first_free;
    ContactEnd end = {.node = e, .weight = {from_mouth ? 0 : 1 - p->weight, p->weight}, .lever = {p->lever[0], p->lever[1]}};
    if (from_mouth)
        end.lever[0] = vec3(0, 0, 0);
    return end;
}

// Computes all data of a pair and returns the gap between the surfaces [mm].
static double measure_pair(const Stepper *s, const int element[2], const int piece[2], Near *n)
{
    SEL_ASSERT(element[0] + 1 < element[1], "adjacent elements form no pair, because bending keeps them apart");
    const SelfContact *c = s->self;
    SlotPlace place[2];
    nearest_on_pieces(s, element, piece, n->xi, place);
    Vec3 r = vec3_sub(place[0].position, place[1].position);
    double distance = vec3_norm(r);
    n->normal = distance > 1e-9 ? vec3_scale(r, 1 / distance) : vec3_unit_or(vec3_cross(place[0].tangent, place[1].tangent), vec3_normal_to(place[0].tangent));
    n->gap = distance - c->radius[element[0]] - c->radius[element[1]];
    for (int e = 0; e < 2; e++) {
        n->element[e] = element[e];
        n->piece[e] = piece[e];
        n->feature[e] = feature_at(s, element[e], piece[e], n->xi[e]);
        n->end[e] = end_of(s, n->element[e], &place[e]);
        n->end[e].radius = c->radius[n->element[e]] + 0.5 * n->gap;
    }
    return n->gap;
}

// --- the search ---

// Is a pair with the same features stored? If not, *slot is a free place for it in the table.
static bool is_known(const SelfContact *c, const Near *n, int *slot)
{
    unsigned at = ((unsigned)n->feature[0] * 40503u + (unsigned)n->feature[1] * 2654435761u) % TABLE;
    for (; c->table[at] > 0; at = (at + 1) % TABLE) {
        const Near *other = &c->near[c->table[at] - 1];
        if (other->feature[0] == n->feature[0] && other->feature[1] == n->feature[1])
            return true;
    }
    *slot = (int)at;
    return false;
}

static void look_at_pieces(Stepper *s, const int element[2], const int piece[2])
{
    SelfContact *c = s->self;
    Near n;
    int slot;
    double gap = measure_pair(s, element, piece, &n);
    if (gap > c->reach || (c->near_count == NEAR_MAX && !is_known(c, &n, &slot))) {
        c->nearest = fmin(c->nearest, gap);
        return;
    }
    if (is_known(c, &n, &slot))
        return;
    SEL_REQUIRE(c->near_count < NEAR_MAX, "a pair is stored already if there is no room");
    c->near[c->near_count++] = n;
    c->table[slot] = c->near_count;
}

static void look_at_elements(Stepper *s, int i, int j)
{
    SEL_ASSERT(i >= s->self->first && i < j && j < s->self->count, "two elements outside the sheath, in the order of the chain");
    SelfContact *c = s->self;
    double radii = c->radius[i] + c->radius[j];
    if (c->turned[j + 1] - c->turned[i] <= SAFE_TURN || c->along[j] - c->along[i + 1] < ARC * radii)
        return;
    // first, a check of the distance between the elements' middles
    Vec3 between = vec3_scale(vec3_sub(vec3_add(c->x[i], c->x[i + 1]), vec3_add(c->x[j], c->x[j + 1])), 0.5);
    double most = radii + c->bulge[i] + c->bulge[j] + 0.55 * (c->length[i] + c->length[j]), far = c->look + most;
    if (vec3_norm2(between) > far * far) {
        c->nearest = fmin(c->nearest, c->look);
        return;
    }
    const Vec3 *p = lay_pieces(s, i), *q = lay_pieces(s, j);
    int pieces[2] = {pieces_of(s, i), pieces_of(s, j)};
    double half = 0.55 * (c->length[i] / pieces[0] + c->length[j] / pieces[1]) + radii;
    for (int k = 0; k < pieces[0]; k++)
        for (int l = 0; l < pieces[1]; l++) {
            double apart = 0.5 * vec3_norm(vec3_sub(vec3_add(p[k], p[k + 1]), vec3_add(q[l], q[l + 1]))) - half;
            if (apart > c->reach)
                c->nearest = fmin(c->nearest, apart);
            else
                look_at_pieces(s, (int[]){i, j}, (int[]){k, l});
        }
}

static void elements_of(const SelfContact *c, int level, int k, int *from, int *to)
{
    SEL_ASSERT(level >= 0 && level < c->levels && k >= 0 && k < c->size[level], "the sphere is one of the tree's");
    *from = c->first + ((LEAF * k) << level);
    *to = c->first + ((LEAF * (k + 1)) << level);
    if (*to > c->count)
        *to = c->count;
}

static void look_between(Stepper *s, int level, int a, int b)
{
    SelfContact *c = s->self;
    int from[2], to[2];
    elements_of(c, level, a, &from[0], &to[0]);
    elements_of(c, level, b, &from[1], &to[1]);
    if (c->turned[to[1]] - c->turned[from[0]] <= SAFE_TURN)
        return;
    const Sphere *p = &c->sphere[c->start[level] + a], *q = &c->sphere[c->start[level] + b];
    double far = c->look + p->radius + q->radius;
    if (vec3_norm2(vec3_sub(p->at, q->at)) > far * far) {
        c->nearest = fmin(c->nearest, c->look);
        return;
    }
    if (level == 0) {
        for (int i = from[0]; i < to[0]; i++)
            for (int j = from[1]; j < to[1]; j++)
                look_at_elements(s, i, j);
        return;
    }
    for (int k = 2 * a; k < 2 * a + 2 && k < c->size[level - 1]; k++)
        for (int l = 2 * b; l < 2 * b + 2 && l < c->size[level - 1]; l++)
            look_between(s, level - 1, k, l);
}

static void look_within(Stepper *s, int level, int k)
{
    SelfContact *c = s->self;
    int from, to;
    elements_of(c, level, k, &from, &to);
    if (c->turned[to] - c->turned[from] <= SAFE_TURN)
        return;
    if (level == 0) {
        for (int i = from; i < to; i++)
            for (int j = i + 2; j < to; j++)
                look_at_elements(s, i, j);
        return;
    }
    bool has_two = 2 * k + 1 < c->size[level - 1];
    look_within(s, level - 1, 2 * k);
    if (has_two) {
        look_within(s, level - 1, 2 * k + 1);
        look_between(s, level - 1, 2 * k, 2 * k + 1);
    }
}

static void look(Stepper *s, double reach)
{
    SelfContact *c = s->self;
    lay_curve(s, false);
    if (c->near_count > 0)
        memset(c->table, 0, sizeof c->table);
    c->near_count = 0;
    if (c->count <= c->first)
        return;
    measure_elements(s);
    build_tree(c);
    for (c->reach = fmin(reach, REACH_MAX);; c->reach *= 0.5) {
        c->look = c->nearest = c->reach + c->safe;
        look_within(s, c->levels - 1, 0);
        if (c->near_count < NEAR_MAX || c->reach < REACH_MIN)
            break;
        memset(c->table, 0, sizeof c->table);    // coiled up: too many pairs to store, so the search range is halved
        c->near_count = 0;
    }
    c->clearance = c->near_count > 0 ? 0 : fmin(c->nearest, c->safe);
}

// --- the set ---

// Transfers the forces of the last solve to the pairs with the same features, or otherwise the closest features: sliding strands pass from piece to piece.
static void hand_on_forces(SelfContact *c)
{
    for (int k = 0; k < c->near_count; k++)
        c->near[k].force = vec3(0, 0, 0);
    for (int i = 0; i < c->kept_count; i++) {
        const Kept *kept = &c->kept[i];
        int best = -1, least = 2 * FEATURES_ON + 1;
        for (int k = 0; k < c->near_count && least > 0; k++) {
            int a = abs(c->near[k].feature[0] - kept->feature[0]), b = abs(c->near[k].feature[1] - kept->feature[1]);
            if (a <= FEATURES_ON && b <= FEATURES_ON && a + b < least) {
                least = a + b;
                best = k;
            }
        }
        if (best >= 0)
            c->near[best].force = vec3_add(c->near[best].force, kept->force);
    }
}

static double friction_of(const Stepper *s, int e)
{
    SEL_ASSERT(e >= 0 && e + 1 < s->state.node_count, "the element is one of the chain's");
    bool distal = s->tools.count > 1 && s->tools.carrier[e] != s->tools.carrier[e + 1];
    double friction = s->wire.friction[distal ? e + 1 : e];
    return friction >= 0 ? friction : s->wall_friction;
}

// [mm] An estimate of the smallest gap of a pair in this step.
static double expected_gap(const Stepper *s, const Near *n)
{
    double gap = n->gap;
    if (s->iterate.is_moved || s->iterate.knows_motion)
        return fmin(gap, gap + vec3_dot(pair_motion(s, n->end, n->normal, by_solution), n->normal));
    return fmin(gap, gap + 2 * vec3_dot(pair_motion(s, n->end, n->normal, by_speed), n->normal));
}

// Fills the set with the pairs that may close; if there are too many, with those of the smallest expected gaps.
static void fill_set(Stepper *s)
{
    SelfContact *c = s->self;
    double most = CLOSE;
    hand_on_forces(c);
    int wanted = PAIRS_MAX + 1;
    for (int tries = 0; wanted > PAIRS_MAX && tries < 20; tries++) {
        wanted = 0;
        for (int k = 0; k < c->near_count; k++)
            wanted += expected_gap(s, &c->near[k]) < most;
        if (wanted > PAIRS_MAX)
            most = most > 1e-3 ? 0.5 * most : most - 0.005;
    }
    s->system.set.pair_count = 0;
    for (int k = 0; k < c->near_count && s->system.set.pair_count < PAIRS_MAX; k++) {
        const Near *n = &c->near[k];
        Vec3 force = n->force;
        bool presses = force.x != 0 || force.y != 0 || force.z != 0;
        if (!presses && !(expected_gap(s, n) < most))
            continue;
        double gap = fmax(n->gap, -STEP_OUT_MAX);
        if (s->iterate.is_moved)
            gap -= vec3_dot(pair_motion(s, n->end, n->normal, done), n->normal);
        c->near_of[s->system.set.pair_count] = k;
        s->system.set.pair[s->system.set.pair_count++] = (ContactPair){.end = {n->end[0], n->end[1]},
                                                                       .normal = n->normal,
                                                                       .gap = gap,
                                                                       .force = force,
                                                                       .friction = 0.5 * (friction_of(s, n->element[0]) + friction_of(s, n->element[1]))};
    }
}

void self_contact_detect(Stepper *s)
{
    SelfContact *c = s->self;
    if (!c)
        return;
    s->system.set.pair_count = 0;
    double reach = REACH + 2 * fmax(fabs(s->command.advance), s->dt * c->fastest);
    c->nearest = c->clearance;
    if (c->clearance > fmin(reach, REACH_MAX))
        return;
    look(s, reach);
    fill_set(s);
    double deepest = 0;
    for (int k = 0; k < c->near_count; k++)
        deepest = fmax(deepest, -c->near[k].gap);
    s->iterate.depth = fmax(s->iterate.depth, deepest);
    if (!s->iterate.is_moved)
        s->report.self_overlap = deepest;
}

bool self_contact_misses(Stepper *s)
{
    SelfContact *c = s->self;
    if (!c)
        return false;
    double travel = 2 * largest_travel(s, by_solution);
    bool misses = false, looks = travel > c->nearest || travel > c->safe;
    s->iterate.knows_motion = true;
    if (looks)
        look(s, REACH + 1.5 * travel);
    for (int k = 0; k < c->near_count && !misses; k++) {
        const Near *n = &c->near[k];
        double gap = fmax(n->gap, -STEP_OUT_MAX);
        misses = gap + vec3_dot(pair_motion(s, n->end, n->normal, by_solution), n->normal) < -MISSED;
    }
    if (misses || looks)
        fill_set(s);
    s->iterate.knows_motion = false;
    return misses;
}

bool self_contact_is_near(const Stepper *s) { return s->self && s->self->near_count > 0; }

// [mm] The overlap of a pair; more than the sum of both radii: one strand has passed through the other.
static double depth_of(const Stepper *s, const Near *was)
{
    Near n;
    double depth = -measure_pair(s, was->element, was->piece, &n);
    bool crossed = vec3_dot(n.normal, was->normal) < 0 && ((n.feature[0] & n.feature[1] & was->feature[0] & was->feature[1] & 1) || depth > 0);
    return crossed ? n.gap + 2 * (s->self->radius[was->element[0]] + s->self->radius[was->element[1]]) : depth;
}

double self_contact_depth(Stepper *s, bool would_go)
{
    if (!self_contact_is_near(s))
        return 0;
    SelfContact *c = s->self;
    double deepest = 0;
    lay_curve(s, would_go);
    for (int k = 0; k < c->near_count; k++)
        deepest = fmax(deepest, depth_of(s, &c->near[k]));
    return deepest;
}

bool self_contact_meet(Stepper *s, double part)
{
    SelfContact *c = s->self;
    bool any = false;
    if (!c || s->system.set.pair_count == 0)
        return false;
    lay_curve(s, false);
    for (int k = 0; k < s->system.set.pair_count; k++) {
        ContactPair *p = &s->system.set.pair[k];
        const Near *n = &c->near[c->near_of[k]];
        double gap = -depth_of(s, n), linear = p->gap + vec3_dot(pair_motion(s, p->end, p->normal, done), p->normal);
        if (!(gap < 0 && gap < linear))
            continue;
        p->gap += fmax((gap - linear) / part, -STEP_OUT_MAX);
        any = true;
    }
    return any;
}

// --- between solves and steps ---

void self_contact_keep_forces(Stepper *s)
{
    SelfContact *c = s->self;
    if (!c)
        return;
    c->kept_count = 0;
    SEL_ASSERT(s->system.set.pair_count <= PAIRS_MAX, "the forces of all pairs fit the array");
    for (int k = 0; k < s->system.set.pair_count; k++) {
        const Near *n = &c->near[c->near_of[k]];
        if (vec3_norm2(s->system.set.pair[k].force) > 0)
            c->kept[c->kept_count++] = (Kept){{n->feature[0], n->feature[1]}, s->system.set.pair[k].force};
    }
}

void self_contact_use_clearance(Stepper *s)
{
    SelfContact *c = s->self;
    if (!c)
        return;
    double travel = largest_travel(s, since_look);
    c->clearance -= 2 * travel;
    c->fastest = travel / s->dt;
}

void self_contact_forget(Stepper *s)
{
    if (!s->self)
        return;
    s->self->kept_count = 0;
    s->self->clearance = s->self->fastest = 0;
}

void self_contact_work(const Stepper *s, double *wall, double *friction)
{
    for (int k = 0; k < s->system.set.pair_count; k++) {
        const ContactPair *p = &s->system.set.pair[k];
        Vec3 moved = pair_motion(s, p->end, p->normal, done);
        double pressure = vec3_dot(p->force, p->normal) * vec3_dot(moved, p->normal);
        *wall += pressure;
        *friction += pressure - vec3_dot(p->force, moved);
    }
}

// --- checkpoints ---

typedef struct Saved {
    double clearance, fastest;
    int kept_count;
} Saved;

size_t self_contact_bytes(const Stepper *s) { return s->self ? sizeof(Saved) + PAIRS_MAX * sizeof(Kept) : 0; }

void self_contact_save(const Stepper *s, void *to)
{
    const SelfContact *c = s->self;
    if (!c)
        return;
    Saved saved = {c->clearance, c->fastest, c->kept_count};
    memcpy(to, &saved, sizeof saved);
    memcpy((char *)to + sizeof saved, c->kept, (size_t)c->kept_count * sizeof *c->kept);
}

void self_contact_restore(Stepper *s, const void *from)
{
    SelfContact *c = s->self;
    if (!c)
        return;
    Saved saved;
    memcpy(&saved, from, sizeof saved);
    SEL_REQUIRE(saved.kept_count >= 0 && saved.kept_count <= PAIRS_MAX, "the pairs of a checkpoint fit the array");
    c->clearance = saved.clearance;
    c->fastest = saved.fastest;
    c->kept_count = saved.kept_count;
    memcpy(c->kept, (const char *)from + sizeof saved, (size_t)c->kept_count * sizeof *c->kept);
}

int self_contact_numbers(const Stepper *s) { return s->self ? 5 * s->self->kept_count : 0; }

double self_contact_number(const Stepper *s, int k)
{
    SEL_ASSERT(k >= 0 && k < self_contact_numbers(s), "the number belongs to a stored pair");
    const Kept *kept = &s->self->kept[k / 5];
    const double number[5] = {kept->feature[0], kept->feature[1], kept->force.x, kept->force.y, kept->force.z};
    return number[k % 5];
}

// Where between its neighbours a contact point touches the wall.
//
// A contact point stands for its cell, the part of the tool that is nearer to it than to its neighbours. A contact that stays at the point would move with the
// tool over every bend of the wall: its normal would tilt along the tool, back and forth as one point after the other takes over the force, and the hand would
// feel N l / (2 R). A tool touches where its line is nearest to the wall, and that place stays fixed in space while the tool slides. With g(s) the gap along
// the line, t its tangent, k its curvature, n and H the wall's normal and Hessian:
//   g' = n.t,   g'' = t'Ht + n.k,   offset = -g' / g''   (Newton's method for the smallest gap, from the last queried place)
// There the normal is perpendicular to the tool and does not tilt. The energy of that smallest gap has the second derivative H - (dg')(dg')' / g'', where dg'
// is the change of g' with the unknowns: the contact rolls back along a tool that turns. This is `roll` of contact.h; without it the contact oscillates from
// step to step. STIFF is the curvature of a weak spring that holds the offset at 0 where the wall hardly determines it; its energy belongs to the gap.
//
// Everything refers to the step's end: the tool slides by `slides`, so the material point that will touch then lies that far behind.
#include "solver/step_internal.h"

#include "base/base.h"

#include <string.h>

static const double STIFF = 0.02;        // [1/mm] curvature of the weak spring …
static const double FIRM = 0.1;          // … which adds up to this where the gap is less curved and hardly determines where the tool touches
static const double REACH_OUT = 1.2;     // of half a cell: largest offset
static const double LEAVES = 1.1;        // of half a cell: beyond this the contact passes to the next point
static const double STRIDE = 5, STRIDE_LEAST = 0.02,
                    STRIDE_MAX = 0.1; // times the slide, [mm]: largest change of the offset; the wall is unknown beyond
// Phi = 12 EI / (kappa G A L^2) above which the cubic through the nodes does not describe the tool: elements hardly longer than thick shear instead of bending.
static const double SHEARS = 2;
static const double BLEND = 0.5;          // of half a cell, over which the curvature is blended across a node
static const double SLIDE_MAX = 0.1;     // [mm] largest slide assumed
static const double SLIDE_PART = 0.5;    // of half a cell: likewise

bool stepper_is_slender(const Stepper *s)
{
    const BeamRest *r = &s->beam.rest;
    bool is_slender = s->entry.has_sheath && s->tools.count == 1;
    for (int i = 0; i < s->wire.element_count && is_slender; i++)
        is_slender = 12 * r->bending[i] < SHEARS * r->shear[i] * r->length[i] * r->length[i];
    return is_slender;
}

double stepper_slides(const Stepper *s)
{
    if (!s->is_slender)
        return 0;
    // a hand that slips or has just started does not move the tool, so the slide is limited to that of the last step
    double advance = s->command.advance, moved = s->dt * vec3_dot(s->state.velocity[0], s->entry.axis[0]),
           least = fmin(fabs(advance), fmin(fabs(moved), SLIDE_MAX));
    return advance * moved > 0 ? advance > 0 ? least : -least : 0;
}

static Vec3 own_tangent(const Stepper *s, int node) { return quat_rotate(s->state.orientation[node], vec3(1, 0, 0)); }

static int points_on(const Stepper *s, int element) { return 1 + s->points.slot_start[element + 1] - s->points.slot_start[element]; }

// The cubic's second derivative at `at`, a share of its rest length.
static Vec3 bend_of(const Stepper *s, int e, double at)
{
    SEL_ASSERT(e >= 0 && e + 1 < s->state.node_count, "the element is one of the chain's");
    double l = s->wire.length[e];
    Vec3 bend = vec3_scale(vec3_sub(s->state.position[e + 1], s->state.position[e]), (6 - 12 * at) / (l * l));
    return vec3_add(bend, vec3_add_scaled(vec3_scale(own_tangent(s, e), (6 * at - 4) / l), (6 * at - 2) / l, own_tangent(s, e + 1)));
}

// The curvature jumps at nodes that bear a force, because the tool shears there. It is blended near them.
static Vec3 bend_at(const Stepper *s, const Touch *t)
{
    int e = t->element, node = t->xi < 0.5 ? e : e + 1;
    double away = (t->xi < 0.5 ? t->xi : t->xi - 1) * s->wire.length[e], share = 0.5 + 0.5 * away / (BLEND * t->half);
    Vec3 own = bend_of(s, e, t->xi);
    if (!(share > 0 && share < 1))
        return own;
    return node == e ? vec3_mix(bend_of(s, e - 1, 1), own, share) : vec3_mix(own, bend_of(s, e + 1, 0), share);
}

bool touch_at(const Stepper *s, int point, double offset, Touch *t)
{
    SEL_ASSERT(point >= 0 && point < s->points.count, "the point is a node or a slot of the tool");
    int nodes = s->state.node_count, e = point < nodes ? point : s->points.slot[point - nodes].element;
    // the element at the mouth and the last one are excluded: the line ends there
    if (s->tools.count > 1 || e <= s->first_free || e + 2 >= nodes)
        return false;
    const double *length = s->wire.length;
    double half = 0.5 * length[e] / points_on(s, e), xi = offset / length[e];
    if (point < nodes)
        half = fmin(half, 0.5 * length[e - 1] / points_on(s, e - 1));
    else
        xi += s->points.slot[point - nodes].xi;
    if (xi < 0) {
        e--;
        xi = 1 + offset / length[e];
    }
    *t = (Touch){.element = e, .xi = xi, .offset = offset, .half = half, .own1 = own_tangent(s, e), .own2 = own_tangent(s, e + 1)};
    SEL_ASSERT(e >= 0 && xi >= 0 && xi <= 1, "a contact stays in the cell of its point");
    Slot slot = slot_shifted(&(Slot){.element = e}, length[e], xi);
    t->place = slot_place(&slot, length[e], s->state.position[e], t->own1, s->state.position[e + 1], t->own2);
    t->bend = bend_at(s, t);
    return true;
}

bool touch_of(const Stepper *s, int point, Touch *t)
{
    double offset = s->iterate.is_moved ? s->points.touch_next[point] : s->points.touch[point];
    return offset != 0 && touch_at(s, point, offset, t);
}

Vec3 touch_done(const Stepper *s, const Touch *t, Vec3 arm)
{
    const double weight[2] = {1 - t->place.weight, t->place.weight};
    Vec3 sum = vec3(0, 0, 0);
    for (int e = 0; e < 2; e++) {
        const double *u = s->iterate.moved + row_of(s, t->element + e);
        sum = vec3_add_scaled(sum, weight[e], vec3(u[0], u[1], u[2]));
        sum = vec3_add(sum, vec3_cross(vec3(u[3], u[4], u[5]), vec3_add_scaled(t->place.lever[e], weight[e], arm)));
    }
    return sum;
}

VesselHit touch_back(const Stepper *s, int point, const VesselHit *hit)
{
    VesselHit own = *hit;
    Touch t;
    if ((hit->flags & (VESSEL_FAR | VESSEL_OPEN_END)) || !touch_of(s, point, &t))
        return own;
    Vec3 back = vec3_add_scaled(vec3_scale(t.place.tangent, -t.offset), 0.5 * t.offset * t.offset, t.bend), turn = sym3_mul_vec(&hit->hessian, back);
    own.gap += vec3_dot(hit->normal, back) + 0.5 * vec3_dot(back, turn);
    own.normal = vec3_unit(vec3_add(hit->normal, turn));
    return own;
}

// The derivatives of g' = n.t with the unknowns of both nodes: from the change of the cubic's tangent, and from the point's motion through H t.
static void lean(const Stepper *s, const Touch *t, Vec3 normal, Vec3 turns, ContactPoint *c)
{
    double l = s->wire.length[t->element], xi = t->xi, slope = 6 * xi * (1 - xi) / l;
    const double weight[2] = {1 - t->place.weight, t->place.weight}, chord[2] = {-slope, slope};
    const double share[2] = {(1 - xi) * (1 - 3 * xi), xi * (3 * xi - 2)};
    const Vec3 own[2] = {t->own1, t->own2};
    for (int e = 0; e < 2; e++) {
        Vec3 move = vec3_add_scaled(vec3_scale(turns, weight[e]), chord[e], normal);
        Vec3 turn = vec3_add_scaled(vec3_cross(t->place.lever[e], turns), share[e], vec3_cross(own[e], normal));
        const double all[6] = {move.x, move.y, move.z, turn.x, turn.y, turn.z};
        memcpy(c->lean[e], all, sizeof all);
    }
}

void touch_contact(Stepper *s, int point, const VesselHit *hit, double gap, const Touch *touch, ContactPoint *c)
{
    Vec3 along = touch->place.tangent, turns = sym3_mul_vec(&hit->hessian, along);
    double slope = vec3_dot(hit->normal, along), bend = fmax(0, vec3_dot(along, turns) + vec3_dot(hit->normal, touch->bend)), stiff = fmax(STIFF, FIRM - bend),
           roll = 1 / (bend + stiff);
    double target = touch->offset - (slope + stiff * touch->offset) * roll, most = REACH_OUT * touch->half;
    bool rolls = fabs(target) < most;
    target = rolls ? target : target > 0 ? most : -most;
    // a moved iterate keeps the touching points of the tool
    double step = target - touch->offset, stride = s->iterate.is_moved ? 0 : fmin(STRIDE_MAX, fmax(STRIDE_LEAST, STRIDE * fabs(s->iterate.slides)));
    rolls &= fabs(step) < stride;
    step = fmax(-stride, fmin(stride, step));
    double slides = s->iterate.is_moved ? 0 : fmax(-SLIDE_PART * touch->half, fmin(SLIDE_PART * touch->half, s->iterate.slides)), offset = touch->offset + step;
    Touch t;
    touch_at(s, point, offset - slides, &t);
    if (!s->iterate.is_moved)
        s->points.touch_next[point] = t.offset;
    c->node = t.element;
    c->is_between = true;
    c->xi = t.place.weight;
    c->lever[0] = t.place.lever[0];
    c->lever[1] = t.place.lever[1];
    Vec3 on = vec3_add_scaled(vec3_scale(along, step), 0.5 * step * step, touch->bend);
    c->normal = vec3_unit(vec3_add(hit->normal, sym3_mul_vec(&hit->hessian, on)));
    c->gap = gap + step * (slope + 0.5 * bend * step) - slides * vec3_dot(c->normal, along);
    c->slid = vec3_scale(along, slides);
    if (s->iterate.is_moved)
        c->gap -= vec3_dot(touch_done(s, &t, vec3_scale(c->normal, -c->tool_radius)), c->normal);
    if (!rolls)
        return;
    lean(s, &t, c->normal, vec3_add_scaled(turns, -vec3_dot(turns, hit->normal), hit->normal), c);
    c->roll = roll;
    c->leant = slides * bend;
}

// The next contact point along the tool (way 1) or the previous one (-1).
static int neighbour(const Stepper *s, int point, int way)
{
    int nodes = s->state.node_count;
    if (point < nodes) {
        int e = way > 0 ? point : point - 1;
        return points_on(s, e) == 1 ? point + way : nodes + (way > 0 ? s->points.slot_start[e] : s->points.slot_start[e + 1] - 1);
    }
    int k = point - nodes, e = s->points.slot[k].element;
    if (way > 0)
        return k + 1 < s->points.slot_start[e + 1] ? point + 1 : e + 1;
    return k > s->points.slot_start[e] ? point - 1 : e;
}

static void go_over(Stepper *s, int from, int to, double offset)
{
    SEL_ASSERT(from != to && to >= 0 && to < s->points.count, "a contact passes to another point of the tool");
    s->points.touch[to] = offset;
    s->points.force[to] = s->points.force[from];
    s->points.place[to] = s->points.place[from];
    s->points.met[to] = s->points.met[from];
    s->points.touch[from] = 0;
    s->points.force[from] = vec3(0, 0, 0);
    s->points.clearance[to] = s->points.clearance[from] = 0;
}

void touch_keep(Stepper *s)
{
    if (s->tools.count > 1 || !s->vessel)
        return;
    if (s->report.flags & STEP_LIMITED) {
        memset(s->points.touch, 0, (size_t)s->points.count * sizeof *s->points.touch);
        return;
    }
    memcpy(s->points.touch, s->points.touch_next, (size_t)s->points.count * sizeof *s->points.touch);
    for (int p = s->first_free; p < s->points.count; p++) {
        Touch here, there;
        if (!stepper_presses(s, p))
            s->points.touch[p] = 0;
        if (s->points.touch[p] == 0 || !touch_at(s, p, 0, &here) || fabs(s->points.touch[p]) <= LEAVES * here.half)
            continue;
        int way = s->points.touch[p] > 0 ? 1 : -1, to = neighbour(s, p, way);
        if (!stepper_presses(s, to) && touch_at(s, to, 0, &there))
            go_over(s, p, to, s->points.touch[p] - way * (here.half + there.half));
    }
}

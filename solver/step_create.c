// Creates a stepper and allocates every array that a step needs.
#include "solver/self_contact.h"
#include "solver/tools_internal.h"

#include <stdio.h>
#include <stdlib.h>

enum { NEWTON_MAX = 4 };

static double *take(double **from, size_t count)
{
    double *p = *from;
    *from += count;
    return p;
}

static bool allocate_scratch(Stepper *s)
{
    size_t m = (size_t)s->wire.node_count, padded = m + BEAM_PADDING;
    size_t per_node = 7 * (size_t)s->system.chain.size + 9 + 8 * (size_t)s->state.inner_count;
    size_t total = (BEAM_REST_ARRAYS + 2 * BEAM_POSE_ARRAYS + BEAM_INERTIA_ARRAYS + 1) * padded + per_node * m;
    s->scratch = calloc(total, sizeof *s->scratch);
    if (!s->scratch)
        return false;
    double *at = s->scratch;
    BeamRest *r = &s->beam.rest;
    BeamPose *p = &s->beam.pose, *q = &s->start.pose;
    BeamInertia *i = &s->beam.inertia;
    double **array[] = {&r->length,    &r->extend,  &r->axial, &r->near, &r->far, &r->twist, &r->half_w, &r->half_y, &r->half_z,
                        &r->curvature, &r->bending, &r->shear, &p->x,    &p->y,   &p->z,     &p->qw,     &p->qx,     &p->qy,
                        &p->qz,        &q->x,       &q->y,     &q->z,    &q->qw,  &q->qx,    &q->qy,     &q->qz,     &i->mass,
                        &i->lateral,   &i->excess,  &i->ax,    &i->ay,   &i->az,  &i->tx,    &i->ty,     &i->tz,     &s->beam.drag};
    for (size_t k = 0; k < sizeof array / sizeof *array; k++)
        *array[k] = take(&at, padded);
    for (size_t k = 0; k < m; k++) {
        i->mass[k] = s->wire.mass[k];
        i->lateral[k] = s->wire.inertia_lateral[k];
        i->excess[k] = s->wire.inertia_axial[k] - s->wire.inertia_lateral[k];
    }
    size_t rows = (size_t)s->system.chain.size * m, inner = (size_t)s->state.inner_count * m;
    s->system.b = take(&at, rows);
    s->system.u = take(&at, rows);
    s->iterate.moved = take(&at, rows);
    s->rest.moved = take(&at, rows);
    s->rest.rows = rows;
    s->iterate.seen = take(&at, rows);
    s->system.product = take(&at, rows);
    s->iterate.kept = take(&at, 7 * m + rows + 2 * inner);
    s->start.slide = take(&at, inner);
    s->start.angle = take(&at, inner);
    s->tools.moment = (Vec3 *)take(&at, 3 * inner);
    s->tools.tension = take(&at, inner);
    s->tools.middle = take(&at, m);
    s->tools.bent = take(&at, m);
    SEL_REQUIRE(at <= s->scratch + total, "the arrays of a step fit the memory that they share");
    return true;
}

static bool make_slots(Stepper *s, const WireOptions *o)
{
    const Wire *w = &s->wire;
    s->points.slot_start = calloc((size_t)w->node_count, sizeof *s->points.slot_start);
    if (!s->points.slot_start)
        return false;
    if (s->tools.count > 1) {         // room for all of them; tools_chain() chooses which exist
        s->points.count = w->node_count + s->points.slot_count;
        return (s->points.slot = calloc((size_t)s->points.slot_count + 1, sizeof *s->points.slot)) != NULL;
    }
    for (int i = 0; i < w->element_count; i++)
        s->points.slot_start[i + 1] = s->points.slot_start[i] + slot_count_of(w->length[i]);
    s->points.slot_count = s->points.slot_start[w->element_count];
    s->points.count = w->node_count + s->points.slot_count;
    s->points.slot = calloc((size_t)s->points.slot_count + 1, sizeof *s->points.slot);
    if (!s->points.slot)
        return false;
    for (int i = 0; i < w->element_count; i++) {
        const WireSection *section = &o->section[w->section[i]];
        int first = s->points.slot_start[i], count = s->points.slot_start[i + 1] - first;
        for (int k = 0; k < count; k++)
            s->points.slot[first + k] = slot_make(i, w->length[i], k, count, section->diameter / 2, section->friction);
    }
    return true;
}

static bool allocate(Stepper *s)
{
    s->points.capacity = s->points.count;
    size_t m = (size_t)s->wire.node_count, points = (size_t)s->points.count, inner = (size_t)s->state.inner_count * m;
    int size = 6 + 2 * s->state.inner_count;
    s->memory_count = 13 * m + (5 + WALL_MET_DOUBLES) * points + 7 * inner;
    s->memory = calloc(s->memory_count, sizeof *s->memory);
    s->points.place = calloc(points, sizeof *s->points.place);
    s->points.trial = calloc(points, sizeof *s->points.trial);
    s->points.tried = calloc(points, sizeof *s->points.tried);
    s->rig.fixed = calloc(m, sizeof *s->rig.fixed);
    s->start.position = calloc(m, sizeof *s->start.position);
    s->points.start_force = calloc(points, sizeof *s->points.start_force);
    s->start.orientation = calloc(m, sizeof *s->start.orientation);
    s->points.slot_place = calloc(points, sizeof *s->points.slot_place);
    s->query.point = calloc(2 * points, sizeof *s->query.point);
    s->query.place = calloc(2 * points, sizeof *s->query.place);
    s->query.hit = calloc(2 * points, sizeof *s->query.hit);
    s->query.which = calloc(4 * points + m, sizeof *s->query.which);
    s->points.allowed = calloc(4 * points + m, sizeof *s->points.allowed);
    s->system.set.point = calloc(2 * points, sizeof *s->system.set.point);
    s->system.set.capacity = 2 * s->points.count;       // each may have a second contact, with the opposite wall
    s->system.factor = block_factor_create(s->wire.node_count, size);
    s->system.set.slide = calloc(inner + 1, sizeof *s->system.set.slide);
    s->system.solver = contact_solver_create(s->wire.node_count, size, s->system.set.capacity + (int)inner);
    s->tools.carrier = calloc(m, sizeof *s->tools.carrier);
    if (!s->memory || !s->points.place || !s->points.trial || !s->points.tried || !s->rig.fixed || !s->start.position || !s->points.start_force ||
        !s->start.orientation || !s->points.slot_place || !s->query.point || !s->query.place || !s->query.hit || !s->query.which || !s->points.allowed ||
        !s->system.set.point || !s->system.factor || !s->system.solver || !s->tools.carrier || !s->system.set.slide ||
        !block_chain_create(&s->system.chain, s->wire.node_count, size) || !allocate_scratch(s))
        return false;
    s->state.node_count = s->wire.node_count;
    s->state.position = (Vec3 *)s->memory;
    s->state.velocity = (Vec3 *)(s->memory + 3 * m);
    s->state.spin = (Vec3 *)(s->memory + 6 * m);
    s->state.orientation = (Quat *)(s->memory + 9 * m);
    s->points.force = (Vec3 *)(s->memory + 13 * m);
    s->points.clearance = s->memory + 13 * m + 3 * points;
    s->points.met = (WallMet *)(s->points.clearance + points);
    s->points.touch = (double *)(s->points.met + points);
    s->state.slide = s->points.touch + points;
    s->state.angle = s->state.slide + inner;
    s->state.slide_velocity = s->state.angle + inner;
    s->state.slide_spin = s->state.slide_velocity + inner;
    s->state.slide_force = s->state.slide_spin + inner;
    SEL_REQUIRE(s->state.slide_force + inner <= s->memory + s->memory_count, "the arrays of the state fit the memory that they share");
    s->points.linger = s->points.allowed + points;
    s->points.overlap = s->points.linger + points;
    s->points.touch_next = s->points.overlap + points;
    s->query.range = s->points.touch_next + points;
    s->query.near = s->query.which + points;
    s->points.candidate = s->query.near + points;
    s->query.answer_of = s->points.candidate + 2 * points;
    return true;
}

// A straight wire on the axis of a straight tube, pushed against its end, has no preferred direction in which to buckle. Its last element therefore has a rest
// rotation of this angle, towards e2. This is hardly more than the effect of rounding on a wire at an angle to the axes; 1e-7 would lift a stiff tip off a
// plane. A wire without walls stays exactly as straight as specified: rolled up by an end moment of fixed direction, it would otherwise leave the plane.
static const double IMPERFECTION = 1e-12;    // [rad]

static void make_imperfect(const Wire *wire, BeamRest *rest)
{
    SEL_ASSERT(wire->element_count > 0, "a wire has an element");
    int tip = wire->element_count - 1;
    if (rest->curvature[tip] > 0)
        return;
    rest->curvature[tip] = IMPERFECTION / wire->length[tip];
    rest->half_w[tip] = nextafter(1, 0);      // a value below 1 marks an element that is curved at rest
    rest->half_z[tip] = 0.25 * IMPERFECTION;
}

static int nearest_node(const Wire *wire, double at)
{
    int best = 0;
    for (int i = 1; i < wire->node_count; i++)
        if (fabs(wire->s[i] - at) < fabs(wire->s[best] - at))
            best = i;
    return best;
}

static bool place_rig(Stepper *s, const WireOptions *o)
{
    for (int i = 0; i < o->fix_count; i++)
        s->rig.fixed[nearest_node(&s->wire, o->fix[i].s)] |= o->fix[i].dof;
    s->rig.can_swing = true;
    for (int i = 1; i < s->wire.node_count; i++)
        s->rig.can_swing &= (s->rig.fixed[i] & DOF_POSITION) == 0;
    s->rig.load_count = o->load_count;
    s->rig.load = calloc((size_t)o->load_count + 1, sizeof *s->rig.load);
    if (!s->rig.load)
        return false;
    for (int i = 0; i < o->load_count; i++) {
        int node = 0;
        while (node + 2 < s->wire.node_count && s->wire.s[node + 1] <= o->load[i].s)
            node++;
        SEL_ASSERT(node + 1 < s->wire.node_count, "a load lies on an element");
        double weight = fmin(1, fmax(0, (o->load[i].s - s->wire.s[node]) / s->wire.length[node]));
        if (weight < 1e-9)
            weight = 0;
        if (weight > 1 - 1e-9)
            weight = 1;
        s->rig.load[i] = (LoadPlace){.load = o->load[i], .node = node, .weight = weight};
    }
    return true;
}

static void place_wire(Stepper *s, const WireOptions *o)
{
    if (s->tools.count > 1) {
        s->state.inserted = s->tools.tool[0].inserted;
        tools_place(s);
        return;
    }
    s->state.inserted = o->has_sheath ? fmin(o->inserted, s->wire.total_length) : s->wire.total_length;
    double behind = s->wire.total_length - s->state.inserted;
    for (int i = 0; i < s->wire.node_count; i++) {
        s->state.position[i] = vec3_add_scaled(s->entry.mouth, s->wire.s[i] - behind, s->entry.axis[0]);
        s->state.orientation[i] = s->entry.frame;
    }
}

static bool check_options(const StepperOptions *o, char *why, int capacity)
{
    if (!(o->dt >= 1e-6 && o->dt <= 1e9)) {
        snprintf(why, (size_t)capacity, "time step is %g ms; valid: 1e-6 to 1e9 ms", o->dt);
        return false;
    }
    if (!(o->wall_friction >= 0 && o->wall_friction <= 10)) {
        snprintf(why, (size_t)capacity, "friction of the wall is %g; valid: 0 to 10", o->wall_friction);
        return false;
    }
    if (!(o->contact.tolerance >= 0 && o->contact.tolerance <= 1) || o->contact.max_iterations < 0) {
        snprintf(why, (size_t)capacity, "contact tolerance %g or iterations %d; valid: 0 to 1, and not negative", o->contact.tolerance,
                 o->contact.max_iterations);
        return false;
    }
    return true;
}

Stepper *stepper_create(const StepperOptions *options, char *why, int capacity)
{
    StepperOptions o = *options;
    if (o.dt == 0)
        o.dt = 1;
    if (!check_options(&o, why, capacity))
        return NULL;
    Stepper *s = calloc(1, sizeof *s);
    if (!s) {
        snprintf(why, (size_t)capacity, "no memory for a stepper");
        return NULL;
    }
    if (!wire_create(&s->wire, &o.wire, why, capacity)) {
        stepper_destroy(s);
        return NULL;
    }
    s->tools.count = 1 + o.inner_count;
    s->state.inner_count = o.inner_count;
    if (s->tools.count > 1 && !(tools_create(s, &o, why, capacity) && wire_reserve(&s->wire, s->tools.capacity))) {
        if (!why[0])
            snprintf(why, (size_t)capacity, "no memory for %d tools", s->tools.count);
        stepper_destroy(s);
        return NULL;
    }
    if (!make_slots(s, &o.wire) || !allocate(s) || !place_rig(s, &o.wire)) {
        snprintf(why, (size_t)capacity, "no memory for a wire of %d elements", o.wire.elements);
        stepper_destroy(s);
        return NULL;
    }
    if ((o.self_contact == SELF_CONTACT_ON || (o.self_contact == SELF_CONTACT_AUTO && o.vessel)) && !self_contact_create(s)) {
        snprintf(why, (size_t)capacity, "no memory for a tool's contact with itself");
        stepper_destroy(s);
        return NULL;
    }
    if (s->tools.count == 1)
        wire_rest(&s->wire, &o.wire, &s->beam.rest);
    s->rig.gravity = o.wire.gravity;
    s->damping_mass = o.wire.damping_mass;
    s->damping_stiffness = o.wire.damping_stiffness;
    s->dt = o.dt;
    s->entry.has_sheath = o.wire.has_sheath;
    for (int k = 0; k < s->tools.count; k++) {
        const WireOptions *own = k == 0 ? &o.wire : &o.inner[k - 1];
        s->hands.hand[k] = (Hand){.limit = own->hand_limit, .valve = own->valve_friction};
    }
    s->entry.mouth = o.wire.start;
    s->entry.frame = wire_start_frame(&o.wire);
    Mat3 frame = quat_to_mat3(s->entry.frame);
    for (int k = 0; k < 3; k++)
        s->entry.axis[k] = mat3_column(&frame, k);
    s->vessel = o.vessel;
    if (s->vessel && s->tools.count == 1)
        make_imperfect(&s->wire, &s->beam.rest);
    s->wall_friction = o.wall_friction;
    ContactOptions usual = contact_default_options();
    s->contact = o.contact;
    if (s->contact.max_iterations == 0)
        s->contact.max_iterations = usual.max_iterations;
    if (s->contact.tolerance == 0)
        s->contact.tolerance = usual.tolerance;
    s->newton_max = o.newton_max > 0 ? o.newton_max : NEWTON_MAX;
    s->is_slender = o.follows_touch && stepper_is_slender(s);
    place_wire(s, &o.wire);      // of several tools, only now it is known which points exist
    for (int k = 0; k < s->points.count; k++)
        s->points.place[k].node = -1;
    s->first_free = stepper_count_held(s, 0);
    SEL_ASSERT(s->first_free >= 0 && s->first_free <= s->state.node_count, "the sheath holds nodes of the chain");
    return s;
}

void stepper_destroy(Stepper *s)
{
    if (!s)
        return;
    tools_destroy(s);
    free(s->tools.carrier);
    wire_destroy(&s->wire);
    block_chain_destroy(&s->system.chain);
    if (s->system.factor)
        block_factor_destroy(s->system.factor);
    if (s->system.solver)
        contact_solver_destroy(s->system.solver);
    free(s->memory);
    free(s->points.place);
    free(s->rig.fixed);
    free(s->rig.load);
    free(s->start.position);
    free(s->points.start_force);
    free(s->start.orientation);
    free(s->query.point);
    free(s->query.place);
    free(s->points.trial);
    free(s->points.tried);
    free(s->query.hit);
    free(s->query.which);
    free(s->points.slot_place);
    free(s->points.slot);
    free(s->points.slot_start);
    free(s->points.allowed);
    free(s->system.set.slide);
    free(s->system.set.point);
    free(s->system.set.pair);
    self_contact_destroy(s->self);
    free(s->scratch);
    free(s);
}

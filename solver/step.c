// One implicit Euler step (step.h). Kerrien 2017 section 6.1 with what DESIGN sections 3 and 4 add.
//
// The system is linear about x_n. A step that turns an element by more than NEWTON_MOTION is linearised again about what came out, with the
// unknown still the whole displacement from x_n, so that inertia, damping, gaps and friction keep their meaning: Newton's method on the
// implicit step. Inside an iteration no element may turn by more than TURN_MAX: a wire that springs back does so faster than
// any step (10 mJ move 0.02 g at 30 m/s), and a linear displacement of that size would stretch it.
//
// Never through the wall, and never energy from nowhere: every place that a step stops at is good, because the motion to it is halved until it is
// (follow). The whole wire is held back together, what the hand feeds included. What is not done after the last iteration is flagged
// STEP_LIMITED and left to the next steps; so is an advance into a tool that is squeezed by more than SQUEEZE_MAX: the hand stalls.
#include "solver/node_turn.h"
#include "solver/self_contact.h"
#include "solver/step_tools.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double TURN_MAX = 0.3;              // [rad]
// A chord turned by 0.02 rad stretches by 2e-4 in a linear step, which a free wire would keep as energy: another linearisation costs it 30 us.
// Among contacts it costs a contact solve, and nothing is seen to gain below 0.04.
static const double NEWTON_MOTION = 0.005, NEWTON_MOTION_IN_CONTACT = 0.04, NEWTON_MOTION_AT_MOUTH = 0.002;      // [rad]
static const double SWING_MOTION = 1e-5;         // [rad] nothing turns: displaced and turned chords are the same
enum { NEWTON_MAX = 4 };
// A tip that snaps from one wall to another lands where nobody linearised: [mm] of true penetration that asks for another linearisation there, up to
// twice NEWTON_MAX of them.
static const double OVERSHOOT = 0.015, SELF_OVERSHOOT = 0.005;
// Where a motion is followed in halves: [mm] of depth that it may leave, and where nothing else goes; halves at most, and
// how often linear walls are moved before.
static const double DEPTH_MAX = 0.02, DEPTH_LAST = 0.045;
enum { HALVES_MAX = 6, MEETINGS_MAX = 2 };
// Contact iterations after which a step looks no further, neither for walls nor for another place to linearise about: a jammed stiff tool would use hundreds a
// step and not come further. What it then has is followed as far as it is good. Not where a tool meets itself: what nobody has looked for overlaps; nor with
// several tools, which snap over more rounds and came to lie 1.3 mm outside.
enum { ITERATIONS_ENOUGH = 60 };
// A tool that is squeezed by more than this share of its length is beyond what its elements describe (and would have yielded): the hand stalls.
// One that is squeezed by JAMMED has a reason to be stuck.
static const double SQUEEZE_MAX = 0.03, JAMMED = 0.002;
static const double TAKE_BACK = 0.002;           // of an element's length past the mouth: a free node that would end nearer to it is held
static const double BORDER_FORCE = 1e-3;         // of what straightening takes at the mouth: good enough
static const double MOUTH_LENGTH = 0.1;          // share by which the length outside may end otherwise than it was taken, where the hand slips
enum { DRIVEN_TRIES = 6 };
static const double LOST = 0.1;                  // residual of a contact solve that says nothing
static const double FIRMEST = 1e5;               // share of its stiffness by which an unknown is held to the iterate at most, where nothing less will do
static const double MOUTH_TRAVEL = 1;            // of an element's length that the tool springs through the mouth in a step, besides what the hand feeds
static const double LET_GO_TURN = 0.1;           // [rad] by which a node that is let go at the mouth is turned at most
static const double SPRUNG = 0.1;                // of an element's length past the mouth: a node of several tools that has sprung so far stays on the line

// --- creation ---

static double *take(double **from, size_t count)
{
    double *p = *from;
    *from += count;
    return p;
}

static bool allocate_scratch(Stepper *s)
{
    size_t m = (size_t)s->wire.node_count, padded = m + BEAM_PADDING;
    s->scratch = calloc((BEAM_REST_ARRAYS + 2 * BEAM_POSE_ARRAYS + BEAM_INERTIA_ARRAYS + 1) * padded + (5 * (size_t)s->chain.size + 7 + (size_t)s->chain.size + 8 * (size_t)s->state.inner_count + 2) * m,
                        sizeof *s->scratch);
    if (!s->scratch)
        return false;
    double *at = s->scratch;
    BeamRest *r = &s->beam.rest;
    BeamPose *p = &s->beam.pose, *q = &s->start_pose;
    BeamInertia *i = &s->beam.inertia;
    double **array[] = {&r->length, &r->extend, &r->axial, &r->near, &r->far, &r->twist, &r->half_w, &r->half_y, &r->half_z, &r->curvature, &r->bending,
                        &r->shear, &p->x, &p->y, &p->z, &p->qw, &p->qx, &p->qy, &p->qz, &q->x, &q->y, &q->z, &q->qw, &q->qx, &q->qy, &q->qz,
                        &i->mass, &i->lateral, &i->excess, &i->ax, &i->ay, &i->az, &i->tx, &i->ty, &i->tz, &s->beam.drag};
    for (size_t k = 0; k < sizeof array / sizeof *array; k++)
        *array[k] = take(&at, padded);
    for (size_t k = 0; k < m; k++) {
        i->mass[k] = s->wire.mass[k];
        i->lateral[k] = s->wire.inertia_lateral[k];
        i->excess[k] = s->wire.inertia_axial[k] - s->wire.inertia_lateral[k];
    }
    size_t rows = (size_t)s->chain.size * m, inner = (size_t)s->state.inner_count * m;
    s->b = take(&at, rows);
    s->u = take(&at, rows);
    s->linearised = take(&at, rows);
    s->seen = take(&at, rows);
    s->product = take(&at, rows);
    s->kept = take(&at, 7 * m + rows + 2 * inner);
    s->start_slide = take(&at, inner);
    s->start_angle = take(&at, inner);
    s->inner_moment = (Vec3 *)take(&at, 3 * inner);
    s->inner_tension = take(&at, inner);
    s->middle = take(&at, m);
    s->bent = take(&at, m);
    return true;
}

static bool make_slots(Stepper *s, const WireOptions *o)
{
    const Wire *w = &s->wire;
    s->slot_start = calloc((size_t)w->node_count, sizeof *s->slot_start);
    if (!s->slot_start)
        return false;
    if (s->tool_count > 1) {         // room for all; which of them there are: tools_chain()
        s->point_count = w->node_count + s->slot_count;
        return (s->slot = calloc((size_t)s->slot_count + 1, sizeof *s->slot)) != NULL;
    }
    for (int i = 0; i < w->element_count; i++)
        s->slot_start[i + 1] = s->slot_start[i] + slot_count_of(w->length[i]);
    s->slot_count = s->slot_start[w->element_count];
    s->point_count = w->node_count + s->slot_count;
    s->slot = calloc((size_t)s->slot_count + 1, sizeof *s->slot);
    if (!s->slot)
        return false;
    for (int i = 0; i < w->element_count; i++) {
        const WireSection *section = &o->section[w->section[i]];
        int first = s->slot_start[i], count = s->slot_start[i + 1] - first;
        for (int k = 0; k < count; k++)
            s->slot[first + k] = slot_make(i, w->length[i], k, count, section->diameter / 2, section->friction);
    }
    return true;
}

static bool allocate(Stepper *s)
{
    s->point_capacity = s->point_count;
    size_t m = (size_t)s->wire.node_count, points = (size_t)s->point_count, inner = (size_t)s->state.inner_count * m;
    int size = 6 + 2 * s->state.inner_count;
    s->memory_count = 13 * m + (5 + WALL_MET_DOUBLES) * points + 7 * inner;
    s->memory = calloc(s->memory_count, sizeof *s->memory);
    s->place = calloc(points, sizeof *s->place);
    s->trial = calloc(points, sizeof *s->trial);
    s->tried = calloc(points, sizeof *s->tried);
    s->fixed = calloc(m, sizeof *s->fixed);
    s->start_position = calloc(m, sizeof *s->start_position);
    s->start_force = calloc(points, sizeof *s->start_force);
    s->start_orientation = calloc(m, sizeof *s->start_orientation);
    s->slot_place = calloc(points, sizeof *s->slot_place);
    s->query_point = calloc(2 * points, sizeof *s->query_point);
    s->query_place = calloc(2 * points, sizeof *s->query_place);
    s->query_hit = calloc(2 * points, sizeof *s->query_hit);
    s->query_which = calloc(4 * points + m, sizeof *s->query_which);
    s->room = calloc(4 * points + m, sizeof *s->room);
    s->set.point = calloc(2 * points, sizeof *s->set.point);
    s->set.capacity = 2 * s->point_count;       // each with the wall across
    s->factor = block_factor_create(s->wire.node_count, size);
    s->set.slide = calloc(inner + 1, sizeof *s->set.slide);
    s->solver = contact_solver_create(s->wire.node_count, size, s->set.capacity + (int)inner);
    s->carrier = calloc(m, sizeof *s->carrier);
    if (!s->memory || !s->place || !s->trial || !s->tried || !s->fixed || !s->start_position || !s->start_force || !s->start_orientation || !s->slot_place || !s->query_point || !s->query_place ||
        !s->query_hit || !s->query_which || !s->room || !s->set.point || !s->factor || !s->solver || !s->carrier || !s->set.slide || !block_chain_create(&s->chain, s->wire.node_count, size) ||
        !allocate_scratch(s))
        return false;
    s->state.node_count = s->wire.node_count;
    s->state.position = (Vec3 *)s->memory;
    s->state.velocity = (Vec3 *)(s->memory + 3 * m);
    s->state.spin = (Vec3 *)(s->memory + 6 * m);
    s->state.orientation = (Quat *)(s->memory + 9 * m);
    s->force = (Vec3 *)(s->memory + 13 * m);
    s->clearance = s->memory + 13 * m + 3 * points;
    s->met = (WallMet *)(s->clearance + points);
    s->touch = (double *)(s->met + points);
    s->state.slide = s->touch + points;
    s->state.angle = s->state.slide + inner;
    s->state.slide_velocity = s->state.angle + inner;
    s->state.slide_spin = s->state.slide_velocity + inner;
    s->state.slide_force = s->state.slide_spin + inner;
    s->linger = s->room + points;
    s->lack = s->linger + points;
    s->touch_next = s->lack + points;
    s->range = s->touch_next + points;
    s->query_near = s->query_which + points;
    s->candidate = s->query_near + points;
    s->answer_of = s->candidate + 2 * points;
    for (size_t k = 0; k < points; k++)
        s->place[k].node = -1;
    return true;
}

// Nothing would tell a straight wire on the axis of a straight tube, pushed against its end, which way to buckle. So its last element is not quite
// straight: it turns by this at rest, towards e2. Hardly more than rounding does to a wire that lies askew; 1e-7 would lift a stiff tip off a plane.
// Without walls a wire is as straight as it says: rolled up by an end moment that keeps its direction it would leave the plane.
static const double IMPERFECTION = 1e-12;    // [rad]

static void make_imperfect(const Wire *wire, BeamRest *rest)
{
    int tip = wire->element_count - 1;
    if (rest->curvature[tip] > 0)
        return;
    rest->curvature[tip] = IMPERFECTION / wire->length[tip];
    rest->half_w[tip] = nextafter(1, 0);      // below 1 marks an element that is curved at rest
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
        s->fixed[nearest_node(&s->wire, o->fix[i].s)] |= o->fix[i].dof;
    s->can_swing = true;
    for (int i = 1; i < s->wire.node_count; i++)
        s->can_swing &= (s->fixed[i] & DOF_POSITION) == 0;
    s->load_count = o->load_count;
    s->load = calloc((size_t)o->load_count + 1, sizeof *s->load);
    if (!s->load)
        return false;
    for (int i = 0; i < o->load_count; i++) {
        int node = 0;
        while (node + 2 < s->wire.node_count && s->wire.s[node + 1] <= o->load[i].s)
            node++;
        double weight = fmin(1, fmax(0, (o->load[i].s - s->wire.s[node]) / s->wire.length[node]));
        if (weight < 1e-9)
            weight = 0;
        if (weight > 1 - 1e-9)
            weight = 1;
        s->load[i] = (LoadPlace){.load = o->load[i], .node = node, .weight = weight};
    }
    return true;
}

static void place_wire(Stepper *s, const WireOptions *o)
{
    if (s->tool_count > 1) {
        s->state.inserted = s->tool[0].inserted;
        tools_place(s);
        return;
    }
    s->state.inserted = o->has_sheath ? fmin(o->inserted, s->wire.total_length) : s->wire.total_length;
    double behind = s->wire.total_length - s->state.inserted;
    for (int i = 0; i < s->wire.node_count; i++) {
        s->state.position[i] = vec3_add_scaled(s->mouth, s->wire.s[i] - behind, s->axis[0]);
        s->state.orientation[i] = s->line;
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

// Nodes up to the mouth are held, and a little further (sheath_border_share); one that the hand brings back in this step is held from now on.
static int count_held(const Stepper *s, double advance)
{
    if (!s->has_sheath)
        return 0;
    int k = 1;
    while (k < s->state.node_count && stepper_sheath_coordinate(s, k) + fmin(advance, 0) <= sheath_border_share * s->wire.length[k - 1])
        k++;
    return k;
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
    s->tool_count = 1 + o.inner_count;
    s->state.inner_count = o.inner_count;
    if (s->tool_count > 1 && !(tools_create(s, &o, why, capacity) && wire_reserve(&s->wire, s->capacity))) {
        if (!why[0])
            snprintf(why, (size_t)capacity, "no memory for %d tools", s->tool_count);
        stepper_destroy(s);
        return NULL;
    }
    if (!make_slots(s, &o.wire) || !allocate(s) || !place_rig(s, &o.wire)) {
        snprintf(why, (size_t)capacity, "no memory for a wire of %d elements", o.wire.elements);
        stepper_destroy(s);
        return NULL;
    }
    if ((o.self_contact == SELF_CONTACT_ON || (o.self_contact == SELF_CONTACT_AUTO && o.vessel)) && !self_contact_create(s)) {
        snprintf(why, (size_t)capacity, "no memory for a tool that meets itself");
        stepper_destroy(s);
        return NULL;
    }
    if (s->tool_count == 1)
        wire_rest(&s->wire, &o.wire, &s->beam.rest);
    s->gravity = o.wire.gravity;
    s->damping_mass = o.wire.damping_mass;
    s->damping_stiffness = o.wire.damping_stiffness;
    s->dt = o.dt;
    s->has_sheath = o.wire.has_sheath;
    for (int k = 0; k < s->tool_count; k++) {
        const WireOptions *own = k == 0 ? &o.wire : &o.inner[k - 1];
        s->hand[k] = (Hand){.limit = own->hand_limit, .valve = own->valve_friction};
    }
    s->mouth = o.wire.start;
    s->line = wire_start_frame(&o.wire);
    Mat3 frame = quat_to_mat3(s->line);
    for (int k = 0; k < 3; k++)
        s->axis[k] = mat3_column(&frame, k);
    s->vessel = o.vessel;
    if (s->vessel && s->tool_count == 1)
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
    place_wire(s, &o.wire);
    s->first_free = count_held(s, 0);
    return s;
}

void stepper_destroy(Stepper *s)
{
    if (!s)
        return;
    tools_destroy(s);
    free(s->carrier);
    wire_destroy(&s->wire);
    block_chain_destroy(&s->chain);
    if (s->factor)
        block_factor_destroy(s->factor);
    if (s->solver)
        contact_solver_destroy(s->solver);
    free(s->memory);
    free(s->place);
    free(s->fixed);
    free(s->load);
    free(s->start_position);
    free(s->start_force);
    free(s->start_orientation);
    free(s->query_point);
    free(s->query_place);
    free(s->trial);
    free(s->tried);
    free(s->query_hit);
    free(s->query_which);
    free(s->slot_place);
    free(s->slot);
    free(s->slot_start);
    free(s->room);
    free(s->set.slide);
    free(s->set.point);
    free(s->set.pair);
    self_contact_destroy(s->self);
    free(s->scratch);
    free(s);
}

// --- stages ---

// The frame turned the short way until e1 is the line's direction.
static Quat on_line(const Stepper *s, Quat q)
{
    Vec3 e = quat_rotate(q, vec3(1, 0, 0)), axis = vec3_cross(e, s->axis[0]);
    return quat_unit(quat_mul((Quat){1 + vec3_dot(e, s->axis[0]), axis.x, axis.y, axis.z}, q));
}

// A node that comes back is put on the line. One that is let go, a fiftieth of an element from the mouth, takes the place that the short piece behind it,
// from now on the one across the mouth, has under the moment there: with the curve of its own element, which at a section's border may be ten times as
// soft, the piece would spring.
static void hold(Stepper *s, int node)
{
    WireState *w = &s->state;
    double along = stepper_sheath_coordinate(s, node);
    w->position[node] = vec3_add_scaled(s->mouth, along, s->axis[0]);
    w->orientation[node] = on_line(s, w->orientation[node]);
    w->velocity[node] = vec3_scale(s->axis[0], vec3_dot(w->velocity[node], s->axis[0]));
    w->spin[node] = vec3_scale(s->axis[0], vec3_dot(w->spin[node], s->axis[0]));
}

static Vec3 mouth_curvature(const Stepper *s, int node)
{
    const WireState *w = &s->state;
    const BeamRest *r = &s->beam.rest;
    SheathElement e;
    sheath_element(r, node, s->mouth, s->axis[0], stepper_sheath_coordinate(s, node), w->orientation[node], w->position[node + 1], w->orientation[node + 1], 0, &e);
    Vec3 moment = vec3_add_scaled(e.out.moment1, -vec3_dot(e.out.moment1, s->axis[0]), s->axis[0]);
    return vec3_add_scaled(sheath_rest_curvature(r, node - 1, w->orientation[node]), -1 / r->bending[node - 1], moment);
}

static void let_go(Stepper *s, int node)
{
    WireState *w = &s->state;
    bool is_tip = node + 1 >= s->state.node_count;
    double along = stepper_sheath_coordinate(s, node);
    if (s->tool_count > 1 && !is_tip) {
        if (along > SPRUNG * s->wire.length[node - 1])
            return;
        ToolNode further = tools_further(s, node, along);
        w->position[node] = further.position;
        w->orientation[node] = further.orientation;
        return;
    }
    Vec3 curvature = is_tip ? stepper_tip_curvature(s) : mouth_curvature(s, node);
    double bend = vec3_norm(curvature) * along;
    if (bend > LET_GO_TURN)          // sprang out of the sheath: no curve is known that far
        curvature = vec3_scale(curvature, LET_GO_TURN / bend);
    w->position[node] = vec3_add_scaled(w->position[node], 0.5 * along * along, vec3_cross(curvature, s->axis[0]));
    w->orientation[node] = quat_unit(quat_mul(quat_from_rotation_vector(vec3_scale(curvature, along)), w->orientation[node]));
}

// The share of its length by which the tool is squeezed between hand and mouth, where it slides freely.
static double squeeze(const Stepper *s, const Vec3 *position)
{
    return 1 - vec3_distance(position[1], position[0]) / s->wire.length[0];
}

// The command with what is owed from before; no advance into a tool that is squeezed too much.
static StepCommand stalled(Stepper *s, StepCommand command)
{
    if (!s->has_sheath)
        return command;
    double actual = s->wire.total_length + stepper_sheath_coordinate(s, 0), owed = s->state.inserted - actual;
    if (fabs(owed) > 1e-9) {
        command.advance += owed;
        s->state.inserted = actual;
    }
    if (command.advance > 0 && squeeze(s, s->state.position) > SQUEEZE_MAX) {
        command.advance = 0;
        s->report.flags |= STEP_LIMITED;
    }
    return command;
}

void stepper_go_back(Stepper *s)
{
    size_t nodes = (size_t)s->state.node_count, inner = nodes * (size_t)s->state.inner_count * sizeof(double);
    memcpy(s->state.position, s->start_position, nodes * sizeof *s->start_position);
    memcpy(s->state.orientation, s->start_orientation, nodes * sizeof *s->start_orientation);
    memcpy(s->state.slide, s->start_slide, inner);
    memcpy(s->state.angle, s->start_angle, inner);
}

// A contact solve with coaxial tools begins with what it expects the motion to be: that of the step before.
static void expect_last_motion(Stepper *s)
{
    memset(s->u, 0, row_of(s, s->state.node_count) * sizeof *s->u);
    for (int i = s->first_free; i < s->state.node_count; i++) {
        double *u = s->u + row_of(s, i);
        Vec3 moves = vec3_scale(s->state.velocity[i], s->dt), turns = vec3_scale(s->state.spin[i], s->dt);
        u[0] = moves.x, u[1] = moves.y, u[2] = moves.z;
        u[3] = turns.x, u[4] = turns.y, u[5] = turns.z;
    }
}

// The step begins at the state's pose.
static void begin(Stepper *s)
{
    size_t nodes = (size_t)s->state.node_count;
    memcpy(s->start_position, s->state.position, nodes * sizeof *s->start_position);
    memcpy(s->start_orientation, s->state.orientation, nodes * sizeof *s->start_orientation);
    size_t inner = nodes * (size_t)s->state.inner_count * sizeof(double);
    memcpy(s->start_slide, s->state.slide, inner);
    memcpy(s->start_angle, s->state.angle, inner);
    memset(s->linearised, 0, row_of(s, s->state.node_count) * sizeof *s->linearised);
    memset(s->seen, 0, row_of(s, s->state.node_count) * sizeof *s->seen);
    s->is_iterate = s->overshoots = s->blocked = false;
    s->energy_before = -1;
    s->mouth_ahead = s->command.advance;
    s->slides = stepper_slides(s);
    if (s->tool_count > 1)
        expect_last_motion(s);
}

static void feed(Stepper *s, unsigned released)
{
    hands_feed(s, released);
    StepCommand command = s->tool_command[0];
    s->wall_force_max = s->report.wall_force_max;
    s->wall_force_sum = s->report.wall_force_sum;
    s->report = (StepReport){0};
    s->has_failed = s->was_held = false;
    if (!s->has_sheath)
        command = (StepCommand){0};
    double inserted = s->state.inserted + command.advance, total = s->wire.total_length;
    if (inserted > total) {
        s->report.flags |= STEP_FULLY_INSERTED;
        command.advance = total - s->state.inserted;
    } else if (inserted < 0) {
        s->report.flags |= STEP_FULLY_WITHDRAWN;
        command.advance = -s->state.inserted;
    }
    s->command = stalled(s, command);
    command = s->command;
    s->tool_command[0] = command;
    if (s->tool_count > 1)
        tools_feed(s);
    int held = count_held(s, command.advance);
    for (int i = s->first_free; i < held; i++) {
        hold(s, i);
        stepper_forget(s, i);
    }
    for (int i = s->first_free - 1; i >= held; i--)
        let_go(s, i);
    s->first_free = held;
    memcpy(s->start_force, s->force, (size_t)s->point_count * sizeof *s->force);
    begin(s);
}

void step_feed_tools(Stepper *s, const StepCommand *command, unsigned released)
{
    memcpy(s->tool_command, command, (size_t)s->tool_count * sizeof *command);
    feed(s, released);
}

void step_feed(Stepper *s, StepCommand command)
{
    StepCommand all[STEP_TOOLS_MAX] = {command};
    step_feed_tools(s, all, 0);
}

void step_detect(Stepper *s)
{
    stepper_detect(s);
    self_contact_detect(s);
}

void step_assemble(Stepper *s) { stepper_assemble(s); }

// The iterate in the unknowns that are solved for: hands at node 0, slips elsewhere.
static double solved_for(const Stepper *s, int c, int unknown)
{
    int k = unknown < 6 ? 0 : 1 + (unknown - 6) / 2;
    if (k == 0 || !is_inside(s, c, k))
        return s->linearised[row_of(s, c) + (size_t)unknown];
    return c == 0 ? hand_moved(s, k, unknown % 2) : tools_slipped(s, c, k, unknown % 2);
}

static bool is_unit_row(const double *row, int n, int unknown)
{
    for (int i = 0; i < n; i++)
        if (row[i] != (i == unknown))
            return false;
    return true;
}

// Holds the solution to the iterate by a share of each unknown's own stiffness.
static void hold_to_iterate(Stepper *s, double share)
{
    int n = s->chain.size;
    for (int c = 0; c < s->chain.count; c++)
        for (int i = 0; i < n; i++) {
            double *row = s->chain.diag + block_of(s, c) + n * i, more = share * fabs(row[i]);
            if (is_unit_row(row, n, i))
                continue;
            row[i] += more;
            s->b[row_of(s, c) + (size_t)i] += more * solved_for(s, c, i);
        }
}

// A matrix that is not positive definite (a tool springs, and nothing holds it) is made so: by ever larger shares, from 0 on.
static bool firmer(Stepper *s, double *share)
{
    *share = *share > 0 ? 10 * *share : 0.01;
    if (!(*share < FIRMEST))
        return false;
    hold_to_iterate(s, *share);
    return s->was_held = true;
}

void step_factor(Stepper *s)
{
    if (!contact_needs_factor(&s->set, &s->contact))
        return;
    double share = 0;
    while (!s->has_failed && !block_chain_factor(&s->chain, s->factor))
        s->has_failed = !firmer(s, &share);
}

static void solve(Stepper *s)
{
    if (s->has_failed)
        return;
    ContactReport report = {.converged = true};
    if (s->set.count + s->set.slide_count + s->set.pair_count > 0) {
        double share = 0;
        do
            report = contact_solve(s->solver, &s->chain, s->factor, s->b, &s->set, &s->contact, s->u);
        while (report.singular && firmer(s, &share));
        s->has_failed = report.singular;
        if (s->has_failed)
            return;
    } else {
        block_factor_solve(s->factor, s->b, s->u);
    }
    if (s->tool_count > 1)
        tools_from_slips(s);
    hands_solved(s);
    s->report.iterations += report.iterations;
    s->report.residual = report.residual;
    s->report.cone_violation = report.cone_violation;
    s->report.active = report.active;
    s->report.self_contacts = report.pairs;
    s->report.flags &= ~(unsigned)STEP_NOT_CONVERGED;
    if (!report.converged)
        s->report.flags |= STEP_NOT_CONVERGED;
    stepper_keep_forces(s);
    self_contact_keep_forces(s);
    double sum = 0;
    for (size_t i = 0; i < row_of(s, s->state.node_count); i++)
        sum += s->u[i] * 0;          // 0, or not a number
    s->has_failed |= sum != 0;
}

// The largest turn of an element's chord or of a node against the iterate [rad]; a node's turn about the axis does not count.
static double largest_turn(const Stepper *s)
{
    double largest = 0;
    Vec3 before = vec3(0, 0, 0);         // what the node before moves by
    for (int i = s->first_free; i < s->state.node_count; i++) {
        const double *u = s->u + row_of(s, i), *k = s->linearised + row_of(s, i);
        Vec3 turn = vec3(u[3] - k[3], u[4] - k[4], u[5] - k[5]), moves = vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]);
        Quat q = s->state.orientation[i];
        Vec3 axis = vec3(1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y));
        double node = vec3_norm2(vec3_cross(turn, axis)), chord = 0;
        if (i > 0) {
            // from the mouth: over the whole element, however little of it is outside
            bool from_mouth = i == s->first_free;
            Vec3 c = vec3_sub(s->state.position[i], from_mouth ? s->mouth : s->state.position[i - 1]);
            double length2 = vec3_norm2(c), over = from_mouth ? s->wire.length[i - 1] * s->wire.length[i - 1] : length2;
            chord = vec3_norm2(vec3_cross(c, vec3_sub(moves, before))) / (length2 * over);
        }
        before = moves;
        largest = largest > node ? largest : node;
        largest = largest > chord ? largest : chord;
    }
    return sqrt(largest);
}

// [rad] The turn of the chord from the mouth to the first node outside: a short one stretches by as much as a long one. Where the hand holds the tool; one that
// springs through the mouth changes that chord's length by more.
static double turn_at_mouth(const Stepper *s)
{
    int i = s->first_free;
    if (!s->has_sheath || i >= s->state.node_count || s->hand[0].is_released || s->hand[0].slips[0])
        return 0;
    const double *u = s->u + row_of(s, i), *k = s->linearised + row_of(s, i);
    Vec3 moves = vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]), ends = vec3_add(vec3_sub(s->state.position[i], s->mouth), moves);
    return vec3_norm(vec3_cross(moves, s->axis[0])) / fmax(vec3_dot(ends, s->axis[0]), sheath_border_share * s->wire.length[i - 1]);
}

// Where a border of the rest shape is at the mouth, straightening takes more on one side of it than on the other, and the wire may come to rest with the border
// there. Is that force another one where the solution has the border than where it was taken? Then it is taken there, or first between the two.
static bool misjudges_border(Stepper *s)
{
    int i = s->first_free - 1;
    if (s->tool_count > 1 || i < 0 || i + 1 >= s->state.node_count || s->has_failed)
        return false;
    const BeamRest *rest = &s->beam.rest;
    double start = vec3_dot(vec3_sub(s->start_position[i], s->mouth), s->axis[0]), width = sheath_border_share * rest->length[i];
    double taken = start + s->mouth_ahead, ends = start + s->u[row_of(s, i)];
    // the tool has not gone as the hand was told to: the element's stiffness was that of another length
    double length = sheath_outside(rest->length[i], taken), real = sheath_outside(rest->length[i], ends);
    if (s->hand[0].slips[0] && fabs(length - real) > MOUTH_LENGTH * fmin(length, real)) {
        s->mouth_ahead = ends - start;
        return true;
    }
    double there = sheath_straightening(rest, i, ends), linear = sheath_straightening(rest, i, taken) - s->mouth_element.border * (ends - taken);
    if (fabs(there - linear) < BORDER_FORCE * fmax(there, sheath_straightening(rest, i, taken)) + 1e-9)
        return false;
    bool crosses = fmin(taken, ends) < 0 && fmax(taken, ends) > 0, is_within = fabs(ends) <= 0.5 * width;
    s->mouth_ahead = (crosses && !is_within ? 0 : ends) - start;
    return true;
}

// What the hand and the mouth do follows from the solution.
static void solve_driven(Stepper *s)
{
    solve(s);
    for (int i = 0; i < DRIVEN_TRIES && (misjudges_border(s) || hands_misjudge(s)); i++) {
        stepper_assemble(s);
        step_factor(s);
        solve(s);
    }
}

static bool is_spent(const Stepper *s) { return s->tool_count == 1 && s->report.iterations >= ITERATIONS_ENOUGH && s->set.pair_count == 0; }

// A wire that springs goes further than anybody looked: look that far, and solve again.
static void solve_contained(Stepper *s)
{
    solve_driven(s);
    for (int i = 0; i < 2 && !s->has_failed && !is_spent(s); i++) {
        bool escapes = stepper_escapes(s);
        if (escapes) {
            s->knows_motion = true;
            stepper_detect(s);
            s->knows_motion = false;
        }
        if (!self_contact_misses(s) && !escapes)
            break;
        solve_driven(s);
    }
    s->turn = s->has_failed ? 0 : largest_turn(s);
}

// A wire that nothing holds: its mass centre goes where the linear solution, which keeps momentum, takes it.
static void keep_mass_centre(Stepper *s, double part)
{
    Vec3 away = vec3(0, 0, 0);
    double mass = 0;
    for (int i = 0; i < s->state.node_count; i++) {
        const double *u = s->u + row_of(s, i), *k = s->linearised + row_of(s, i);
        Vec3 linear = vec3(k[0] + part * (u[0] - k[0]), k[1] + part * (u[1] - k[1]), k[2] + part * (u[2] - k[2]));
        Vec3 real = vec3_sub(s->state.position[i], s->start_position[i]);
        away = vec3_add_scaled(away, s->wire.mass[i], vec3_sub(linear, real));
        mass += s->wire.mass[i];
    }
    for (int i = 0; i < s->state.node_count; i++)
        s->state.position[i] = vec3_add_scaled(s->state.position[i], 1 / mass, away);
}

// Moves the free nodes' positions by `part` of the change, chord by chord from the proximal end on: a chord c that the solution makes s = c + change
// becomes s (c.s)/(|c||s|), as long as the linear solution thinks it is. With s itself a turn of 0.005 rad would stretch the wire by 1e-5, which in
// steel is 0.1 N. Not where the rig holds a node further along.
static void swing(Stepper *s, double part)
{
    Vec3 from = s->mouth, moved = s->mouth, shift = vec3(0, 0, 0);
    for (int i = s->first_free; i < s->state.node_count; i++) {
        const double *u = s->u + row_of(s, i), *k = s->linearised + row_of(s, i);
        Vec3 own = vec3_scale(vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]), part), here = s->state.position[i];
        if (i == 0) {
            moved = vec3_add(here, own);
        } else {
            Vec3 chord = vec3_sub(here, from), sum = vec3_add(chord, vec3_sub(own, shift));
            double product = vec3_dot(chord, sum);
            moved = vec3_add_scaled(moved, product > 0 ? product / sqrt(vec3_norm2(chord) * vec3_norm2(sum)) : 1, sum);
        }
        from = here;
        shift = own;
        s->state.position[i] = moved;
    }
    if (s->first_free == 0 && (s->fixed[0] & DOF_POSITION) == 0)
        keep_mass_centre(s, part);
}

static void displace(Stepper *s, double part)
{
    for (int i = s->first_free; i < s->state.node_count; i++) {
        const double *u = s->u + row_of(s, i), *k = s->linearised + row_of(s, i);
        Vec3 d = part < 1 ? vec3(k[0] + part * (u[0] - k[0]), k[1] + part * (u[1] - k[1]), k[2] + part * (u[2] - k[2])) : vec3(u[0], u[1], u[2]);
        s->state.position[i] = vec3_add(s->start_position[i], d);
    }
}

// The iterate moves to `part` of the way from where it is to x_n + u, nodes in the sheath too: a tool that is held back is not fed.
static void move(Stepper *s, double part)
{
    WireState *w = &s->state;
    int nodes = w->node_count, held = s->first_free;
    double *rx = s->product, *ry = rx + nodes, *rz = ry + nodes;     // how far a node turns, an assembly's scratch
    if (s->turn > SWING_MOTION && s->can_swing)
        swing(s, part);
    else
        displace(s, part);
    for (int i = 0; i < held; i++) {
        // on the line exactly, whatever rounding does
        const double *u = s->u + row_of(s, i);
        double *k = s->linearised + row_of(s, i), turn = part * (u[3] - k[3]);
        k[0] = part < 1 ? k[0] + part * (u[0] - k[0]) : u[0];
        k[3] += turn;
        double along = vec3_dot(vec3_sub(s->start_position[i], s->mouth), s->axis[0]) + k[0];
        w->position[i] = vec3_add_scaled(s->mouth, along, s->axis[0]);
        rx[i] = turn * s->axis[0].x, ry[i] = turn * s->axis[0].y, rz[i] = turn * s->axis[0].z;
    }
    for (int i = held; i < nodes; i++) {
        const double *u = s->u + row_of(s, i);
        double *k = s->linearised + row_of(s, i);
        k[0] = w->position[i].x - s->start_position[i].x;
        k[1] = w->position[i].y - s->start_position[i].y;
        k[2] = w->position[i].z - s->start_position[i].z;
        Vec3 turn = vec3_scale(vec3(u[3] - k[3], u[4] - k[4], u[5] - k[5]), part);
        double angle2 = vec3_norm2(turn);
        if (angle2 > NODE_TURN_MAX * NODE_TURN_MAX)
            turn = vec3_scale(turn, NODE_TURN_MAX / sqrt(angle2));
        k[3] += turn.x, k[4] += turn.y, k[5] += turn.z;
        rx[i] = turn.x, ry[i] = turn.y, rz[i] = turn.z;
    }
    node_turn(nodes, rx, ry, rz, w->orientation);
    if (s->tool_count > 1)
        tools_move(s, part);
}

static double energy_bound(const Stepper *s)
{
    const Wire *w = &s->wire;
    double work = 0, bound = s->energy_before;
    for (int i = s->first_free; i < w->node_count; i++)
        work += w->mass[i] * fabs(vec3_dot(s->gravity, vec3(s->u[row_of(s, i)], s->u[row_of(s, i) + 1], s->u[row_of(s, i) + 2])));
    for (int k = 0; k < s->set.count; k++)
        work += fmax(0, -s->set.point[k].gap) * vec3_norm(s->set.point[k].force);
    for (int k = 0; k < s->set.pair_count; k++)
        work += fmax(0, -s->set.pair[k].gap) * vec3_norm(s->set.pair[k].force);
    work += hands_work_bound(s);
    return bound + 2 * work + 1e-6;
}

static void copy_iterate(Stepper *s, bool back)
{
    size_t m = (size_t)s->state.node_count, rows = row_of(s, (int)m), inner = m * (size_t)s->state.inner_count;
    size_t size[5] = {m * sizeof(Vec3), m * sizeof(Quat), rows * sizeof(double), inner * sizeof(double), inner * sizeof(double)};
    void *live[5] = {s->state.position, s->state.orientation, s->linearised, s->state.slide, s->state.angle};
    void *kept[5] = {s->kept, s->kept + 3 * m, s->kept + 7 * m, s->kept + 7 * m + rows, s->kept + 7 * m + rows + inner};
    for (int i = 0; i < 5; i++)
        memcpy(back ? live[i] : kept[i], back ? kept[i] : live[i], size[i]);
}

// The part of the way to a displacement `to` at which one of `from` reaches `most`.
static double part_until(double from, double to, double most)
{
    if (fabs(to) <= most)
        return 1;
    return fmax(0, fmin(1, ((to > 0 ? most : -most) - from) / (to - from)));
}

// No element turns by more than TURN_MAX, and no more of the tool springs through the mouth than one element describes.
static double largest_part(const Stepper *s)
{
    double part = s->turn > TURN_MAX ? TURN_MAX / s->turn : 1;
    if (s->tool_count > 1)
        part = fmin(part, tools_largest_part(s));
    int i = s->first_free - 1;
    if (i < 0 || i + 1 >= s->state.node_count)
        return part;
    size_t k = row_of(s, i);
    return fmin(part, part_until(s->linearised[k], s->u[k], fabs(s->command.advance) + MOUTH_TRAVEL * s->wire.length[i]));
}

// Does the solution go back to where the iterate came from? Over an edge of the wall two linearisations each send a tip to the other's place for ever:
// the answer lies between.
static bool goes_back(const Stepper *s)
{
    const double *before = s->kept + 7 * (size_t)s->state.node_count;
    double along = 0, came = 0;
    for (int i = s->first_free; i < s->state.node_count; i++)
        for (size_t k = row_of(s, i); k < row_of(s, i) + 3; k++) {
            double d = s->linearised[k] - before[k];
            along += d * (s->u[k] - s->linearised[k]);
            came += d * d;
        }
    return along < -0.5 * came;
}

// The share of the solution that was followed. A quiet step goes all the way, and so does a wire without walls but for TURN_MAX. Else only as far as
// no node is driven through the wall and the wire is not left with energy that nobody gave it. Where the wall is not where its linear form has it,
// the form is first moved there and the contacts solved again (a second-order correction); then by halves, from places that are good.
static double follow(Stepper *s, bool halfway)
{
    double part = halfway ? fmin(0.5, largest_part(s)) : largest_part(s);
    bool is_trusted = !s->was_held && s->report.residual < LOST;
    if ((!s->vessel && !self_contact_is_near(s)) || (s->turn <= NEWTON_MOTION_IN_CONTACT && !s->overshoots && is_trusted)) {
        move(s, part);
        return part;
    }
    if (s->energy_before < 0)         // of x_n, or of an iterate beside it
        s->energy_before = stepper_elastic_energy(s) + stepper_kinetic_energy(s);
    double bound = s->has_sheath && s->load_count == 0 ? energy_bound(s) : HUGE_VAL;
    copy_iterate(s, false);
    double most = fmax(DEPTH_MAX, s->depth);
    int tries = squeeze(s, s->start_position) < JAMMED ? 2 * HALVES_MAX : HALVES_MAX;
    for (int k = 0; k < tries; k++) {
        if (k == HALVES_MAX) {        // no jam: rather a little deeper than stuck for ever where neighbouring models disagree about the wall
            part = largest_part(s);
            most = fmax(most, DEPTH_LAST);
        }
        move(s, part);
        double depth = fmax(stepper_depth(s), self_contact_depth(s, false));
        bool contained = depth <= most;
        if (contained && stepper_elastic_energy(s) <= bound)
            return part;
        bool meets = !contained && k < MEETINGS_MAX && !is_spent(s) && stepper_meet_walls(s, part) + self_contact_meet(s, part) > 0;
        copy_iterate(s, true);
        part /= 2;
        if (meets) {
            solve(s);
            if (s->has_failed)
                return 0;
            s->turn = largest_turn(s);
            part = largest_part(s);
        }
    }
    return 0;
}

static void solve_system(Stepper *s)
{
    step_detect(s);
    stepper_assemble(s);
    step_factor(s);
    solve_contained(s);
}

// The length of the mouth's element has no sign: the first free node must not come to lie behind it. Where the solution has it there, the sheath holds it from
// the step's start on.
static void take_back(Stepper *s)
{
    while (s->tool_count > 1 && (tools_leave_back(s) || tools_come_out(s))) {
        begin(s);
        solve_system(s);
    }
    while (s->has_sheath && !s->has_failed && s->first_free < s->state.node_count) {
        int node = s->first_free;
        const double *u = s->u + row_of(s, node);
        double ends = vec3_dot(vec3_sub(vec3_add(s->start_position[node], vec3(u[0], u[1], u[2])), s->mouth), s->axis[0]);
        double began = vec3_dot(vec3_sub(s->start_position[node], s->mouth), s->axis[0]);
        if (ends >= TAKE_BACK * s->wire.length[node - 1] || began > s->wire.length[node - 1] + fabs(s->command.advance))
            return;
        stepper_go_back(s);
        hold(s, node);
        stepper_forget(s, node);
        s->first_free++;
        begin(s);
        solve_system(s);
    }
}

void step_contact(Stepper *s)
{
    solve_contained(s);
    take_back(s);
    for (int iteration = 1; iteration < 2 * s->newton_max && !s->has_failed && !is_spent(s); iteration++) {
        bool touches = s->report.active > 0;
        bool turns = s->turn > (touches ? NEWTON_MOTION_IN_CONTACT : NEWTON_MOTION) || (!touches && turn_at_mouth(s) > NEWTON_MOTION_AT_MOUTH);
        s->overshoots = stepper_overshoot(s) > OVERSHOOT || self_contact_depth(s, true) > SELF_OVERSHOOT;
        if (!(turns && iteration < s->newton_max) && !s->overshoots)
            break;
        if (follow(s, iteration > 1 && s->vessel && goes_back(s)) == 0) {
            s->blocked = true;
            stepper_doubt(s);
            break;
        }
        stepper_use_clearance(s);
        s->is_iterate = true;
        solve_system(s);
        take_back(s);
        s->report.newton = iteration;
        s->overshoots = true;
    }
    s->overshoots |= is_spent(s);        // nobody has looked
}

static void keep_last_state(Stepper *s)
{
    size_t nodes = (size_t)s->state.node_count, inner = nodes * (size_t)s->state.inner_count * sizeof(double);
    stepper_go_back(s);
    memset(s->state.velocity, 0, nodes * sizeof *s->state.velocity);
    memset(s->state.spin, 0, nodes * sizeof *s->state.spin);
    memset(s->force, 0, (size_t)s->point_count * sizeof *s->force);
    memset(s->clearance, 0, (size_t)s->point_count * sizeof *s->clearance);
    memset(s->touch, 0, (size_t)s->point_count * sizeof *s->touch);
    self_contact_forget(s);
    memset(s->state.slide_velocity, 0, inner);
    memset(s->state.slide_spin, 0, inner);
    s->report.flags |= STEP_DIVERGED;
}

static void set_velocities(Stepper *s)
{
    WireState *w = &s->state;
    double rate = 1 / s->dt;
    for (int i = 0; i < w->node_count; i++) {
        const double *u = s->linearised + row_of(s, i);      // what has been done, cut or not
        if (i < s->first_free) {
            w->velocity[i] = vec3_scale(s->axis[0], u[0] * rate);
            w->spin[i] = vec3_scale(s->axis[0], u[3] * rate);
            continue;
        }
        w->velocity[i] = vec3(u[0] * rate, u[1] * rate, u[2] * rate);
        w->spin[i] = vec3(u[3] * rate, u[4] * rate, u[5] * rate);
    }
    if (s->tool_count > 1) {
        tools_set_velocities(s);
        tools_keep_slides(s);
    }
    stepper_use_clearance(s);
    touch_keep(s);
}

static void report_forces(Stepper *s)
{
    if (!s->has_sheath) {
        Vec3 force = vec3(0, 0, 0), torque = vec3(0, 0, 0);
        double *f[] = {&force.x, &force.y, &force.z, &torque.x, &torque.y, &torque.z};
        for (int k = 0; k < 6; k++)
            if (s->fixed[0] >> k & 1)
                *f[k] = stepper_reaction(s, k);
        s->report.proximal_force = vec3_dot(force, s->axis[0]);
        s->report.proximal_torque = vec3_dot(torque, s->axis[0]);
    }
    hands_report(s);
    for (int k = 0; k < s->set.count; k++) {
        double force = vec3_norm(s->force[s->candidate[k]]);
        s->report.wall_force_max = fmax(s->report.wall_force_max, force);
        s->report.wall_force_sum += force;
    }
}

// A motion that was cut short has not had the forces of the whole one: the hand feels the strain that there is, and the wall has come as far as the motion.
static void report_cut_forces(Stepper *s, double part)
{
    s->report.flags |= STEP_LIMITED;
    s->report.wall_force_max = s->wall_force_max + part * (s->report.wall_force_max - s->wall_force_max);
    s->report.wall_force_sum = s->wall_force_sum + part * (s->report.wall_force_sum - s->wall_force_sum);
    if (!s->has_sheath)
        return;
    double force = stepper_strain_force(s), most = s->hand[0].limit > 0 ? s->hand[0].limit : HUGE_VAL;
    s->report.proximal_force = fmax(-most, fmin(most, force));
}

void step_correct(Stepper *s)
{
    s->state.time += s->dt;
    if (!s->has_failed) {
        report_forces(s);
        if (s->was_held)
            s->report.flags |= STEP_NOT_CONVERGED;
        double part = s->blocked ? 0 : follow(s, false);
        if (part < 1)
            report_cut_forces(s, part);
        set_velocities(s);
        hands_count(s);
    }
    if (s->has_failed)
        keep_last_state(s);
}

const StepReport *step_report(const Stepper *s) { return &s->report; }
const WireState *stepper_state(const Stepper *s) { return &s->state; }

// --- questions ---

void stepper_node_report(Stepper *s, NodeReport *node)
{
    int nodes = s->state.node_count, held = count_held(s, 0);
    for (int i = 0; i < nodes; i++) {
        node[i] = (NodeReport){.s = s->wire.s[i], .radius = s->wire.radius[i], .gap = HUGE_VAL, .vessel_node = -1};
        if (i < held || !s->vessel)
            continue;
        // a copy of the memory: a question must not change the next step
        VesselMemory place = s->place[i];
        if (place.node < 0)
            place = (VesselMemory){.node = s->vessel->locate(s->vessel, s->state.position[i], i > held ? node[i - 1].vessel_node : -1)};
        VesselHit hit;
        vessel_query(s->vessel, 1, &s->state.position[i], HUGE_VAL, &place, &hit);   // no bound will do: the gap itself is asked for
        node[i].force = s->force[i];
        node[i].vessel_node = hit.node;
        if (!(hit.flags & (VESSEL_FAR | VESSEL_OPEN_END)))
            node[i].gap = hit.gap - s->wire.radius[i];
    }
    stepper_share_forces(s, node);
}

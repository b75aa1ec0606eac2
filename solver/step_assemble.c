// The linear system of a step, linearised about an iterate x_k (x_n in the first iteration, then u_k = 0):
//
//   A = M/h^2 + D/h + K,   D = alpha M + beta K_main,   K = K_main + positive part of the geometric stiffness + the wall's curvature
//   A u = A u_k + r(x_k),   r = M (v/h + g) - (M/h^2 + alpha M/h) u_k + f(x_k) + f_ext - beta/h J' C (strain(x_k) - strain(x_n)),   u = x_{n+1} - x_n
//
// Each node has six unknowns, in space axes. Nodes in the sheath use the axes of the sheath's line instead, so that the constraint to the line is a set of unit
// rows. Reactions are computed from node 0's rows as saved before its constraints were applied.
#include "solver/tools_internal.h"
#include "base/base.h"

#include <string.h>

void stepper_load_pose(const Vec3 *restrict position, const Quat *restrict orientation, int first, int count, const BeamPose *pose)
{
    double *restrict x = pose->x, *restrict y = pose->y, *restrict z = pose->z;
    double *restrict qw = pose->qw, *restrict qx = pose->qx, *restrict qy = pose->qy, *restrict qz = pose->qz;
    for (int i = first; i < count; i++)
        x[i] = position[i].x, y[i] = position[i].y, z[i] = position[i].z;
    for (int i = first; i < count; i++)
        qw[i] = orientation[i].w, qx[i] = orientation[i].x, qy[i] = orientation[i].y, qz[i] = orientation[i].z;
}

// Accelerations that multiply the nodes' mass: v/h + g, minus `rate` times the displacement that the iterate has already made.
static void load_inertia(Stepper *s, double rate)
{
    const BeamInertia *m = &s->beam.inertia;
    double *restrict ax = m->ax, *restrict ay = m->ay, *restrict az = m->az, *restrict tx = m->tx, *restrict ty = m->ty, *restrict tz = m->tz;
    const Vec3 *restrict velocity = s->state.velocity, *restrict spin = s->state.spin, g = s->rig.gravity;
    double per = 1 / s->dt;
    int count = s->state.node_count;
    for (int i = s->first_free; i < count; i++)
        ax[i] = velocity[i].x * per + g.x, ay[i] = velocity[i].y * per + g.y, az[i] = velocity[i].z * per + g.z;
    for (int i = s->first_free; i < count; i++)
        tx[i] = spin[i].x * per, ty[i] = spin[i].y * per, tz[i] = spin[i].z * per;
    for (int i = s->first_free; i < count && s->iterate.is_moved; i++) {
        const double *u = s->iterate.moved + row_of(s, i);
        ax[i] -= rate * u[0], ay[i] -= rate * u[1], az[i] -= rate * u[2];
        tx[i] -= rate * u[3], ty[i] -= rate * u[4], tz[i] -= rate * u[5];
    }
}

static void add_vec(double *at, Vec3 v) { at[0] += v.x, at[1] += v.y, at[2] += v.z; }

// The elements between free nodes, with the inertia and gravity of these nodes.
static void free_nodes(Stepper *s, double scale, double inertia)
{
    SEL_ASSERT(s->first_free >= 0 && s->first_free < s->state.node_count, "at least one node is outside the sheath");
    int first = s->first_free, count = s->state.node_count;
    size_t from = row_of(s, first), to = row_of(s, count);
    stepper_load_pose(s->state.position, s->state.orientation, first, count, &s->beam.pose);
    load_inertia(s, inertia);
    s->beam.slides = s->iterate.is_moved ? 0 : s->iterate.slides;
    memset(s->beam.drag, 0, (size_t)s->wire.element_count * sizeof(double));
    if (s->iterate.is_moved) {
        stepper_load_pose(s->start.position, s->start.orientation, first, count, &s->start.pose);
        beam_chain_damp(&s->beam, &s->start.pose, first, count - 1, scale - 1, s->system.product);
    }
    beam_chain_assemble(&s->beam, first, count - 1, scale, inertia, &s->system.chain, s->system.b);
    for (size_t k = from; k < to && s->iterate.is_moved; k++)
        s->system.b[k] += s->system.product[k];
}

// Nodes in the sheath form a chain that is only axial and torsional; their lateral rows are unit rows.
static void sheath_nodes(Stepper *s, double scale, double inertia)
{
    SEL_ASSERT(s->system.chain.size == 6, "nodes of a single tool have six unknowns");
    const Wire *w = &s->wire;
    const double *done = s->iterate.moved;
    for (int i = 0; i < s->first_free; i++) {
        double *d = s->system.chain.diag + block_of(s, i), *b = s->system.b + row_of(s, i);
        const double *u = done + row_of(s, i);
        double push = vec3_dot(s->state.velocity[i], s->entry.axis[0]) / s->dt + vec3_dot(s->rig.gravity, s->entry.axis[0]);
        d[0] += w->mass[i] * inertia;
        d[21] += w->inertia_axial[i] * inertia;
        d[7] = d[14] = d[28] = d[35] = 1;
        b[0] += w->mass[i] * (push - inertia * u[0]);
        b[3] += w->inertia_axial[i] * (vec3_dot(s->state.spin[i], s->entry.axis[0]) / s->dt - inertia * u[3]);
        if (i + 1 == s->first_free)
            break;
        double ka = s->beam.rest.axial[i], kt = s->beam.rest.twist[i];
        double strain = stepper_sheath_coordinate(s, i + 1) - stepper_sheath_coordinate(s, i) - s->beam.rest.length[i];
        Quat p = quat_mul(quat_conjugate(s->state.orientation[i]), s->state.orientation[i + 1]);
        double tension = ka * (strain + (scale - 1) * (u[6] - u[0])), torque = kt * (2 * same_atan2(p.x, p.w) + (scale - 1) * (u[9] - u[3]));
        double *l = s->system.chain.lower + block_of(s, i), *next = d + 36;
        b[0] += tension, b[3] += torque;
        b[6] -= tension, b[9] -= torque;
        d[0] += ka * scale, d[21] += kt * scale;
        next[0] += ka * scale, next[21] += kt * scale;
        l[0] = -ka * scale, l[21] = -kt * scale;
    }
}

// The element between the last held node and the first free one. It is clamped at the mouth and turns little in a step, so its damping force is
// the tangent times the displacement, not computed from the change of strain.
static void mouth_element(Stepper *s, double scale)
{
    SEL_ASSERT(s->first_free > 0 && s->first_free < s->state.node_count, "an element goes through the mouth");
    int i = s->first_free - 1;
    double ahead = s->iterate.mouth_ahead - s->iterate.moved[row_of(s, i)], column[12];
    SheathElement *e = &s->system.mouth_element;
    sheath_element(&s->beam.rest, i, s->entry.mouth, s->entry.axis[0], stepper_sheath_coordinate(s, i), s->state.orientation[i], s->state.position[i + 1],
                   s->state.orientation[i + 1], ahead, e);
    BeamTangent t, damped;
    sheath_tangent(&s->beam.rest, i, s->entry.axis[0], e, scale, &t, column);
    double *b = s->system.b + row_of(s, i), *d = s->system.chain.diag + block_of(s, i), *l = s->system.chain.lower + block_of(s, i);
    b[0] -= e->axial_gradient;
    b[3] -= e->twist_gradient;
    add_vec(b + 6, vec3_negate(e->out.force2));
    add_vec(b + 9, vec3_negate(e->out.moment2));
    for (int k = 0; k < 12; k++)
        b[k] += column[k] * ahead;
    for (int k = 0; k < 36; k++) {
        d[k] += t.k11[k];
        d[36 + k] += t.k22[k];
        l[k] = t.k21[k];
    }
    if (!s->iterate.is_moved)
        return;
    sheath_tangent(&s->beam.rest, i, s->entry.axis[0], e, 1, &damped, column);
    const double *u = s->iterate.moved + row_of(s, i);
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) {
            int k = 6 * r + c;
            b[r] -= (t.k11[k] - damped.k11[k]) * u[c];
            b[c] -= (t.k21[k] - damped.k21[k]) * u[6 + r];
            b[6 + r] -= (t.k21[k] - damped.k21[k]) * u[c] + (t.k22[k] - damped.k22[k]) * u[6 + c];
        }
}

double stepper_tip_straightening(const Stepper *s)
{
    int last = s->state.node_count - 1;
    return s->tools.count > 1 ? tools_tip_straightening(s) : sheath_straightening(&s->beam.rest, last - 1, stepper_sheath_coordinate(s, last - 1));
}

Vec3 stepper_tip_curvature(const Stepper *s)
{
    int last = s->state.node_count - 1;
    return s->tools.count > 1 ? tools_tip_curvature(s) : sheath_rest_curvature(&s->beam.rest, last - 1, s->state.orientation[last]);
}

bool stepper_load(const Stepper *s, const LoadPlace *place, int end, double time, Vec3 *force, Vec3 *moment)
{
    SEL_ASSERT(place->weight >= 0 && place->weight <= 1 && (end == 0 || end == 1), "a load is shared by two nodes");
    const WireLoad *load = &place->load;
    double weight = end ? place->weight : 1 - place->weight, part = weight * (load->ramp > time ? time / load->ramp : 1);
    if (weight == 0)
        return false;
    *force = vec3_scale(load->force, part);
    *moment = vec3_scale(load->moment, part);
    if (load->follower) {
        Quat turn = quat_mul(s->state.orientation[place->node + end], quat_conjugate(s->entry.frame));
        *force = quat_rotate(turn, *force);
        *moment = quat_rotate(turn, *moment);
    }
    return true;
}

static void add_load(Stepper *s, const LoadPlace *place, int end)
{
    int node = place->node + end;
    double *b = s->system.b + row_of(s, node);
    Vec3 force, moment;
    if (!stepper_load(s, place, end, s->state.time + s->dt, &force, &moment))
        return;
    if (node < s->first_free) {
        b[0] += vec3_dot(force, s->entry.axis[0]);
        b[3] += vec3_dot(moment, s->entry.axis[0]);
    } else {
        add_vec(b, force);
        add_vec(b + 3, moment);
    }
}

static void constraints(Stepper *s)
{
    memcpy(s->system.grip_diag, s->system.chain.diag, block_of(s, 1) * sizeof(double));
    memcpy(s->system.grip_b, s->system.b, row_of(s, 1) * sizeof(double));
    if (s->system.chain.count > 1)
        memcpy(s->system.grip_lower, s->system.chain.lower, block_of(s, 1) * sizeof(double));
    hands_constrain(s);
    for (int i = s->first_free; i < s->system.chain.count; i++)
        for (int k = 0; s->rig.fixed[i] >> k; k++)
            if (s->rig.fixed[i] >> k & 1)
                stepper_prescribe(s, i, k, 0);
}

static void clear_held(Stepper *s)
{
    int held = s->first_free;
    memset(s->system.chain.diag, 0, block_of(s, held) * sizeof(double));
    memset(s->system.b, 0, row_of(s, held) * sizeof(double));
    if (held > 1)
        memset(s->system.chain.lower, 0, block_of(s, held - 1) * sizeof(double));
}

// The whole tool is held, and its tip may extend past the mouth. The part past the mouth is not straightened; the straightening force is applied as a constant
// over this step, scaled by the share of the step's travel that lies past the mouth.
static void tip_at_mouth(Stepper *s)
{
    SEL_ASSERT(s->first_free > 1, "the whole tool is in the sheath, and it has an element");
    int last = s->first_free - 1;
    double before = vec3_dot(vec3_sub(s->start.position[last], s->entry.mouth), s->entry.axis[0]), after = before + s->iterate.mouth_ahead,
           way = after - before;
    double share = fabs(way) > 1e-9 ? (fmax(after, 0) - fmax(before, 0)) / way : before > 1e-6;
    s->system.b[row_of(s, last)] += share * stepper_tip_straightening(s);
}

void step_assemble(Stepper *s)
{
    SEL_ASSERT(s->dt > 0, "a step takes time");
    s->system.is_factored = false;
    SEL_ASSERT(s->first_free >= 0 && s->first_free <= s->system.chain.count, "the sheath holds nodes of the chain");
    double h = s->dt, scale = 1 + s->damping_stiffness / h, inertia = 1 / (h * h) + s->damping_mass / h;
    if (s->tools.count > 1) {
        tools_assemble(s, scale, inertia);
    } else {
        clear_held(s);
        if (s->first_free < s->system.chain.count) {
            free_nodes(s, scale, inertia);
            if (s->first_free > 0)
                mouth_element(s, scale);
        }
        sheath_nodes(s, scale, inertia);
    }
    s->system.chain.slim = s->tools.count == 1 && s->first_free > 1 ? s->first_free - 1 : 0;     // not the node behind the mouth
    if (s->first_free == s->system.chain.count)
        tip_at_mouth(s);
    contact_add_curvature(&s->system.set, &s->system.chain, s->system.b);
    if (s->iterate.is_moved) {
        block_chain_multiply(&s->system.chain, s->iterate.moved, s->system.product);
        for (size_t k = 0; k < row_of(s, s->system.chain.count); k++)
            s->system.b[k] += s->system.product[k];
    }
    for (int i = 0; i < s->rig.load_count; i++) {
        add_load(s, &s->rig.load[i], 0);
        add_load(s, &s->rig.load[i], 1);
    }
    constraints(s);
    if (s->tools.count > 1) {
        tools_leave_out(s);
        tools_to_slips(s);
    }
}

double stepper_stiffness_damping(Stepper *s)
{
    double rate = s->damping_stiffness / s->dt, work = 0, column[12];
    const double *u = s->iterate.moved;
    int first = s->first_free, last = s->state.node_count - 1;
    if (rate == 0)
        return 0;
    if (s->tools.count > 1)
        return tools_stiffness_damping(s);
    if (first < last) {
        stepper_load_pose(s->state.position, s->state.orientation, first, last + 1, &s->beam.pose);
        stepper_load_pose(s->start.position, s->start.orientation, first, last + 1, &s->start.pose);
        beam_chain_damp(&s->beam, &s->start.pose, first, last, rate, s->system.product);
        for (size_t k = row_of(s, first); k < row_of(s, last + 1); k++)
            work -= s->system.product[k] * u[k];
    }
    for (int i = 0; i + 1 < first; i++) {
        const double *a = u + row_of(s, i), *b = a + 6;
        work += rate * (s->beam.rest.axial[i] * (b[0] - a[0]) * (b[0] - a[0]) + s->beam.rest.twist[i] * (b[3] - a[3]) * (b[3] - a[3]));
    }
    if (first == 0 || first > last)
        return work;
    // the element at the mouth is damped by its displacement: u' K u
    BeamTangent with, without;
    sheath_tangent(&s->beam.rest, first - 1, s->entry.axis[0], &s->system.mouth_element, 1 + rate, &with, column);
    sheath_tangent(&s->beam.rest, first - 1, s->entry.axis[0], &s->system.mouth_element, 1, &without, column);
    const double *a = u + row_of(s, first - 1), *b = a + 6;
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) {
            int k = 6 * r + c;
            work +=
                a[r] * (with.k11[k] - without.k11[k]) * a[c] + b[r] * (with.k22[k] - without.k22[k]) * b[c] + 2 * b[r] * (with.k21[k] - without.k21[k]) * a[c];
        }
    return work;
}

double stepper_strain_force(const Stepper *s)
{
    const WireState *w = &s->state;
    const BeamRest *rest = &s->beam.rest;
    double coordinate = stepper_sheath_coordinate(s, 0);
    if (s->first_free > 1)
        return -rest->axial[0] * (stepper_sheath_coordinate(s, 1) - coordinate - rest->length[0]);
    SheathElement e;
    sheath_element(rest, 0, s->entry.mouth, s->entry.axis[0], coordinate, w->orientation[0], w->position[1], w->orientation[1], 0, &e);
    return e.axial_gradient;
}

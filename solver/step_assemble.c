// The linear system of a step, linearised about an iterate x_k (x_n in the first iteration, then u_k = 0):
//
//   (M/h^2 + D/h + K) u = M v/h + f(x_k) + f_ext + K u_k,   u = x_{n+1} - x_n,   D = alpha M + beta K_main
//
// K = K_main + positive part of the geometric stiffness + the wall's curvature. Unknowns are six a node in space axes; for nodes in the sheath
// they are in the line's axes, so that "stays on the line" is unit rows. Reactions are read from node 0's rows as they were
// before its constraints.
#include "solver/step_internal.h"

#include <string.h>

double stepper_sheath_coordinate(const Stepper *s, int node)
{
    return vec3_dot(vec3_sub(s->state.position[node], s->mouth), s->axis[0]);
}

static void load_pose(Stepper *s)
{
    const WireState *w = &s->state;
    BeamPose p = s->pose;
    for (int i = 0; i < w->node_count; i++) {
        p.x[i] = w->position[i].x, p.y[i] = w->position[i].y, p.z[i] = w->position[i].z;
        p.qw[i] = w->orientation[i].w, p.qx[i] = w->orientation[i].x, p.qy[i] = w->orientation[i].y, p.qz[i] = w->orientation[i].z;
    }
}

static void add_vec(double *at, Vec3 v)
{
    at[0] += v.x, at[1] += v.y, at[2] += v.z;
}

// Inertia, gravity and the elements' forces of the free nodes.
static void free_nodes(Stepper *s)
{
    const Wire *w = &s->wire;
    double h = s->dt, inertia = 1 / (h * h) + s->damping_mass / h;
    for (int i = s->first_free; i < w->node_count; i++) {
        double *d = s->chain.diag + 36 * (size_t)i, *b = s->b + 6 * (size_t)i, m = w->mass[i];
        Quat q = s->state.orientation[i];
        double t[3] = {1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y)};
        double lateral = w->inertia_lateral[i], excess = w->inertia_axial[i] - lateral;
        d[0] += m * inertia, d[7] += m * inertia, d[14] += m * inertia;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                d[(3 + r) * 6 + 3 + c] += (excess * t[r] * t[c] + (r == c ? lateral : 0)) * inertia;
        Vec3 v = s->state.velocity[i], spin = s->state.spin[i], axis = vec3(t[0], t[1], t[2]);
        add_vec(b, vec3_scale(vec3_add_scaled(vec3_scale(s->gravity, h), 1, v), m / h));
        add_vec(b + 3, vec3_scale(vec3_add_scaled(vec3_scale(spin, lateral), excess * vec3_dot(axis, spin), axis), 1 / h));
    }
    const BeamStrain *e = &s->strain;
    for (int i = s->first_free; i < w->element_count; i++) {
        double *b = s->b + 6 * (size_t)i;
        b[0] += e->force2.x[i], b[1] += e->force2.y[i], b[2] += e->force2.z[i];
        b[3] -= e->moment1.x[i], b[4] -= e->moment1.y[i], b[5] -= e->moment1.z[i];
        b[6] -= e->force2.x[i], b[7] -= e->force2.y[i], b[8] -= e->force2.z[i];
        b[9] -= e->moment2.x[i], b[10] -= e->moment2.y[i], b[11] -= e->moment2.z[i];
    }
}

// Axial and torsional chain behind the mouth; lateral rows are unit rows.
static void sheath_nodes(Stepper *s, double scale)
{
    const Wire *w = &s->wire;
    double h = s->dt, inertia = 1 / (h * h) + s->damping_mass / h;
    for (int i = 0; i < s->first_free; i++) {
        double *d = s->chain.diag + 36 * (size_t)i, *b = s->b + 6 * (size_t)i;
        d[0] += w->mass[i] * inertia;
        d[21] += w->inertia_axial[i] * inertia;
        d[7] = d[14] = d[28] = d[35] = 1;
        b[0] += w->mass[i] * (vec3_dot(s->state.velocity[i], s->axis[0]) / h + vec3_dot(s->gravity, s->axis[0]));
        b[3] += w->inertia_axial[i] * vec3_dot(s->state.spin[i], s->axis[0]) / h;
        if (i + 1 == s->first_free)
            break;
        double ka = s->rest.axial[i], kt = s->rest.twist[i];
        double strain = stepper_sheath_coordinate(s, i + 1) - stepper_sheath_coordinate(s, i) - s->rest.length[i];
        Quat p = quat_mul(quat_conjugate(s->state.orientation[i]), s->state.orientation[i + 1]);
        double tension = ka * strain, torque = kt * 2 * atan2(p.x, p.w);
        double *l = s->chain.lower + 36 * (size_t)i, *next = d + 36;
        b[0] += tension, b[3] += torque;
        b[6] -= tension, b[9] -= torque;
        d[0] += ka * scale, d[21] += kt * scale;
        next[0] += ka * scale, next[21] += kt * scale;
        l[0] = -ka * scale, l[21] = -kt * scale;
    }
}

static void mouth_element(Stepper *s, double scale)
{
    int i = s->first_free - 1;
    double ahead = s->is_iterate ? 0 : s->command.advance, column[12];
    SheathElement *e = &s->mouth_element;
    sheath_element(&s->rest, i, s->mouth, s->axis[0], stepper_sheath_coordinate(s, i), s->state.orientation[i], s->state.position[i + 1],
                   s->state.orientation[i + 1], ahead, e);
    BeamTangent t;
    sheath_tangent(&s->rest, i, s->axis[0], e, scale, &t, column);
    double *b = s->b + 6 * (size_t)i, *d = s->chain.diag + 36 * (size_t)i;
    b[0] -= e->axial_gradient;
    b[3] -= e->twist_gradient;
    add_vec(b + 6, vec3_negate(e->out.force2));
    add_vec(b + 9, vec3_negate(e->out.moment2));
    for (int k = 0; k < 12; k++)
        b[k] += column[k] * ahead;
    for (int k = 0; k < 36; k++) {
        d[k] += t.k11[k];
        d[36 + k] += t.k22[k];
    }
    memcpy(s->chain.lower + 36 * (size_t)i, t.k21, sizeof t.k21);
}

static void add_load(Stepper *s, int node, double weight, const WireLoad *load)
{
    if (weight == 0)
        return;
    Vec3 force = load->force, moment = load->moment;
    if (load->follower) {
        Quat turn = quat_mul(s->state.orientation[node], quat_conjugate(s->line));
        force = quat_rotate(turn, force);
        moment = quat_rotate(turn, moment);
    }
    double time = s->state.time + s->dt, *b = s->b + 6 * (size_t)node;
    double part = weight * (load->ramp > time ? time / load->ramp : 1);
    if (node < s->first_free) {
        b[0] += part * vec3_dot(force, s->axis[0]);
        b[3] += part * vec3_dot(moment, s->axis[0]);
    } else {
        add_vec(b, vec3_scale(force, part));
        add_vec(b + 3, vec3_scale(moment, part));
    }
}

// Row and column of one unknown become a unit row with its value.
static void prescribe(Stepper *s, int node, int dof, double value)
{
    double *d = s->chain.diag + 36 * (size_t)node, *b = s->b + 6 * (size_t)node;
    for (int r = 0; r < 6; r++) {
        b[r] -= d[6 * r + dof] * value;
        d[6 * r + dof] = d[6 * dof + r] = 0;
    }
    if (node + 1 < s->chain.count) {
        double *l = s->chain.lower + 36 * (size_t)node;
        for (int r = 0; r < 6; r++) {
            b[6 + r] -= l[6 * r + dof] * value;
            l[6 * r + dof] = 0;
        }
    }
    if (node > 0) {
        double *l = s->chain.lower + 36 * (size_t)(node - 1);
        for (int c = 0; c < 6; c++) {
            b[c - 6] -= l[6 * dof + c] * value;
            l[6 * dof + c] = 0;
        }
    }
    d[7 * dof] = 1;
    b[dof] = value;
}

static void constraints(Stepper *s)
{
    memcpy(s->grip_diag, s->chain.diag, sizeof s->grip_diag);
    memcpy(s->grip_b, s->b, sizeof s->grip_b);
    memcpy(s->grip_lower, s->chain.lower, sizeof s->grip_lower);
    if (s->has_sheath) {
        // to where the command says, whatever has been lost to rounding before
        double coordinate = s->state.inserted + s->command.advance - s->wire.total_length;
        prescribe(s, 0, 0, coordinate - vec3_dot(vec3_sub(s->start_position[0], s->mouth), s->axis[0]));
        prescribe(s, 0, 3, s->command.twist);
    }
    for (int i = s->first_free; i < s->chain.count; i++)
        for (int k = 0; s->fixed[i] >> k; k++)
            if (s->fixed[i] >> k & 1)
                prescribe(s, i, k, 0);
}

// Nodes in the sheath and the first free one; the elements write the blocks of the others.
static void clear_system(Stepper *s)
{
    size_t nodes = (size_t)s->chain.count, held = (size_t)s->first_free;
    memset(s->chain.diag, 0, 36 * (held < nodes ? held + 1 : nodes) * sizeof(double));
    if (held > 1)
        memset(s->chain.lower, 0, 36 * (held - 1) * sizeof(double));
    memset(s->b, 0, 6 * nodes * sizeof(double));
}

// K u_k of an iterate: the main stiffness without its share of damping, geometric and curvature parts included.
static void iterate_product(Stepper *s)
{
    clear_system(s);
    beam_chain_tangent(&s->rest, &s->strain, s->first_free, s->wire.element_count, 1, &s->chain);
    if (s->first_free > 0 && s->first_free < s->chain.count)
        mouth_element(s, 1);
    contact_add_curvature(&s->set, &s->chain);
    for (int i = 0; i + 1 < s->first_free; i++) {
        double *d = s->chain.diag + 36 * (size_t)i, *l = s->chain.lower + 36 * (size_t)i, ka = s->rest.axial[i], kt = s->rest.twist[i];
        d[0] += ka, d[36] += ka, l[0] = -ka;
        d[21] += kt, d[57] += kt, l[21] = -kt;
    }
    block_chain_multiply(&s->chain, s->linearised, s->product);
}

void stepper_assemble(Stepper *s)
{
    size_t unknowns = 6 * (size_t)s->chain.count;
    double scale = 1 + s->damping_stiffness / s->dt;
    load_pose(s);
    beam_chain_strain(&s->rest, &s->pose, s->first_free, s->wire.element_count, &s->strain);
    if (s->is_iterate)
        iterate_product(s);
    clear_system(s);
    if (s->is_iterate)
        memcpy(s->b, s->product, unknowns * sizeof(double));
    beam_chain_tangent(&s->rest, &s->strain, s->first_free, s->wire.element_count, scale, &s->chain);
    free_nodes(s);
    if (s->first_free > 0) {
        if (s->first_free < s->chain.count)
            mouth_element(s, scale);
        sheath_nodes(s, scale);
    }
    for (int i = 0; i < s->load_count; i++) {
        const LoadPlace *p = &s->load[i];
        add_load(s, p->node, 1 - p->weight, &p->load);
        if (p->weight > 0)
            add_load(s, p->node + 1, p->weight, &p->load);
    }
    contact_add_curvature(&s->set, &s->chain);
    constraints(s);
}

double stepper_reaction(const Stepper *s, int dof)
{
    double sum = -s->grip_b[dof];
    for (int c = 0; c < 6; c++) {
        sum += s->grip_diag[6 * dof + c] * s->u[c];
        if (s->chain.count > 1)
            sum += s->grip_lower[6 * c + dof] * s->u[6 + c];
    }
    return sum;
}

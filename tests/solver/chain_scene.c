#include "chain_scene.h"

#include <stdlib.h>
#include <string.h>

ChainSceneOptions chain_scene_default_options(void)
{
    return (ChainSceneOptions){.elements = 200,
                               .element_length = 0.5,
                               .young_modulus = 80000,
                               .poisson_ratio = 0.3,
                               .diameter = 0.36,
                               .density = 6.45e-3,
                               .inserted = 5,
                               .friction = 0.2,
                               .reach = 0.3};
}

void chain_scene_create(ChainScene *s, const ChainSceneOptions *options)
{
    *s = (ChainScene){.options = *options};
    int m = s->nodes = options->elements + 1;
    size_t n = (size_t)m;
    s->position = calloc(n, sizeof *s->position);
    s->velocity = calloc(n, sizeof *s->velocity);
    s->spin = calloc(n, sizeof *s->spin);
    s->force = calloc(n, sizeof *s->force);
    s->orientation = calloc(n, sizeof *s->orientation);
    s->memory = calloc(n, sizeof *s->memory);
    s->hit = calloc(n, sizeof *s->hit);
    s->b = calloc(6 * n, sizeof *s->b);
    s->u = calloc(6 * n, sizeof *s->u);
    s->candidate_of = calloc(n, sizeof *s->candidate_of);
    s->set = (ContactSet){.capacity = m, .point = calloc(n, sizeof *s->set.point)};
    block_chain_create(&s->chain, m, 6);
    s->factor = block_factor_create(m, 6);
    s->solver = contact_solver_create(m, 6, m);
    for (int i = 0; i < m; i++) {
        s->position[i] = vec3(options->inserted - options->element_length * (options->elements - i), 0, 0);
        s->orientation[i] = quat_identity();
        s->memory[i].node = -1;
    }
}

void chain_scene_destroy(ChainScene *s)
{
    free(s->position);
    free(s->velocity);
    free(s->spin);
    free(s->force);
    free(s->orientation);
    free(s->memory);
    free(s->hit);
    free(s->b);
    free(s->u);
    free(s->candidate_of);
    free(s->set.point);
    block_chain_destroy(&s->chain);
    block_factor_destroy(s->factor);
    contact_solver_destroy(s->solver);
}

// Strains of an element: bending of both ends relative to the chord (3 + 3, in the plane across t), twist, stretch. Energy e'Ce/2.
static void add_element(ChainScene *s, int i)
{
    const ChainSceneOptions *o = &s->options;
    double l0 = o->element_length, area = PI * o->diameter * o->diameter / 4, inertia = area * o->diameter * o->diameter / 16;
    double e = o->young_modulus, shear = e / (2 + 2 * o->poisson_ratio);
    double kappa = 6 * (1 + o->poisson_ratio) / (7 + 6 * o->poisson_ratio);
    double phi = 12 * e * inertia / (kappa * shear * area * l0 * l0);
    double c = (4 + phi) * e * inertia / ((1 + phi) * l0), d = (2 - phi) * e * inertia / ((1 + phi) * l0), g = shear * 2 * inertia / l0, k = e * area / l0;
    Vec3 chord = vec3_sub(s->position[i + 1], s->position[i]);
    double length = vec3_norm(chord);
    Vec3 t = vec3_scale(chord, 1 / length);
    double strain[8], b[8][12] = {{0}}, cm[8][8] = {{0}};
    Vec3 bend[2];
    for (int end = 0; end < 2; end++) {
        Vec3 axis = quat_rotate(s->orientation[i + end], vec3(1, 0, 0));
        bend[end] = vec3_cross(t, axis);
        bool tip = (o->elements - i) * l0 <= 15;
        if (tip) // rest: the ends are rotated by -+ curvature l/2 about e3
            bend[end] = vec3_add_scaled(bend[end], (end ? -0.5 : 0.5) * o->tip_curvature * l0, quat_rotate(s->orientation[i + end], vec3(0, 0, 1)));
        bend[end] = vec3_add_scaled(bend[end], -vec3_dot(bend[end], t), t);
    }
    Vec3 turn = quat_to_rotation_vector(quat_mul(s->orientation[i + 1], quat_conjugate(s->orientation[i])));
    memcpy(strain, &bend[0], 24);
    memcpy(strain + 3, &bend[1], 24);
    strain[6] = vec3_dot(turn, t);
    strain[7] = length - l0;
    double tv[3] = {t.x, t.y, t.z};
    Mat3 cross = mat3_skew(t);
    for (int end = 0; end < 2; end++)
        for (int r = 0; r < 3; r++)
            for (int q = 0; q < 3; q++) {
                b[3 * end + r][6 * end + 3 + q] = (r == q) - tv[r] * tv[q];
                b[3 * end + r][q] = cross.m[r][q] / length; // theta - t x (u2 - u1) / l
                b[3 * end + r][6 + q] = -cross.m[r][q] / length;
            }
    for (int q = 0; q < 3; q++) {
        b[6][3 + q] = -tv[q];
        b[6][9 + q] = tv[q];
        b[7][q] = -tv[q];
        b[7][6 + q] = tv[q];
    }
    for (int r = 0; r < 3; r++) {
        cm[r][r] = cm[3 + r][3 + r] = c;
        cm[r][3 + r] = cm[3 + r][r] = d;
    }
    cm[6][6] = g;
    cm[7][7] = k;
    double stress[8] = {0}, cb[8][12] = {{0}}, tension = fmax(0, k * strain[7]) / length;
    for (int r = 0; r < 8; r++)
        for (int q = 0; q < 8; q++) {
            stress[r] += cm[r][q] * strain[q];
            for (int j = 0; j < 12; j++)
                cb[r][j] += cm[r][q] * b[q][j];
        }
    for (int r = 0; r < 12; r++) {
        double f = 0;
        for (int q = 0; q < 8; q++)
            f += b[q][r] * stress[q];
        s->b[6 * i + r] -= f;
        for (int j = 0; j < 12; j++) {
            double sum = 0;
            for (int q = 0; q < 8; q++)
                sum += b[q][r] * cb[q][j];
            if (r % 6 < 3 && j % 6 < 3)
                sum += (r / 6 == j / 6 ? tension : -tension) * ((r % 6 == j % 6) - tv[r % 6] * tv[j % 6]);
            if (r / 6 == j / 6)
                s->chain.diag[36 * (i + r / 6) + 6 * (r % 6) + j % 6] += sum;
            else if (r / 6 == 1)
                s->chain.lower[36 * i + 6 * (r % 6) + j] += sum;
        }
    }
}

static void constrain(ChainScene *s, int i, int dof, double value)
{
    double *d = s->chain.diag + 36 * i;
    for (int k = 0; k < 6; k++) {
        if (k != dof)
            s->b[6 * i + k] -= d[6 * k + dof] * value;
        d[6 * dof + k] = d[6 * k + dof] = k == dof;
        if (i > 0) {
            double *l = s->chain.lower + 36 * (i - 1);
            s->b[6 * (i - 1) + k] -= l[6 * dof + k] * value;
            l[6 * dof + k] = 0;
        }
        if (i + 1 < s->nodes) {
            double *l = s->chain.lower + 36 * i;
            s->b[6 * (i + 1) + k] -= l[6 * k + dof] * value;
            l[6 * k + dof] = 0;
        }
    }
    s->b[6 * i + dof] = value;
}

void chain_scene_prepare(ChainScene *s, double advance, double twist)
{
    const ChainSceneOptions *o = &s->options;
    size_t n = (size_t)s->nodes;
    double radius = o->diameter / 2, area = PI * radius * radius, mass = o->density * area * o->element_length;
    double inertia = mass * (radius * radius / 2 + o->element_length * o->element_length / 12);
    memset(s->chain.diag, 0, n * 36 * sizeof(double));
    memset(s->chain.lower, 0, (n - 1) * 36 * sizeof(double));
    memset(s->b, 0, n * 6 * sizeof(double));
    for (int i = 0; i < s->nodes; i++) {
        double share = i == 0 || i == s->nodes - 1 ? 0.5 : 1;
        const double v[6] = {s->velocity[i].x, s->velocity[i].y, s->velocity[i].z, s->spin[i].x, s->spin[i].y, s->spin[i].z};
        for (int k = 0; k < 6; k++) {
            double m = share * (k < 3 ? mass : inertia);
            s->chain.diag[36 * i + 7 * k] = m;
            s->b[6 * i + k] = m * v[k];
        }
    }
    for (int i = 0; i + 1 < s->nodes; i++)
        add_element(s, i);
    vessel_query(o->vessel, s->nodes, s->position, o->reach + radius + 0.5, s->memory, s->hit);
    s->set.count = 0;
    s->penetration = 0;
    for (int i = 1; i < s->nodes; i++) {
        const VesselHit *h = &s->hit[i];
        if (s->position[i].x <= 0 && fabs(s->position[i].y) < 1e-9)
            continue; // in the sheath
        if (h->flags & (VESSEL_FAR | VESSEL_OPEN_END) || h->gap - radius > o->reach)
            continue;
        s->penetration = fmax(s->penetration, radius - h->gap);
        s->candidate_of[s->set.count] = i;
        s->set.point[s->set.count++] = (ContactPoint){.node = i,
                                                      .normal = h->normal,
                                                      .gap = h->gap - radius,
                                                      .hessian = h->hessian,
                                                      .friction = o->friction,
                                                      .tool_radius = radius,
                                                      .force = s->force[i]};
    }
    contact_add_curvature(&s->set, &s->chain, NULL);
    for (int i = 0; i < s->nodes; i++)
        if (i == 0 || (s->position[i].x <= 0 && fabs(s->position[i].y) < 1e-9)) {
            if (i == 0) {
                constrain(s, i, 0, advance);
                constrain(s, i, 3, twist);
            }
            constrain(s, i, 1, 0);
            constrain(s, i, 2, 0);
            constrain(s, i, 4, 0);
            constrain(s, i, 5, 0);
        }
    block_chain_factor(&s->chain, s->factor);
}

void chain_scene_finish(ChainScene *s)
{
    for (int i = 0; i < s->nodes; i++) {
        const double *u = s->u + 6 * i;
        s->velocity[i] = vec3(u[0], u[1], u[2]);
        s->spin[i] = vec3(u[3], u[4], u[5]);
        s->position[i] = vec3_add(s->position[i], s->velocity[i]);
        s->orientation[i] = quat_unit(quat_mul(quat_from_rotation_vector(s->spin[i]), s->orientation[i]));
        s->force[i] = vec3(0, 0, 0);
    }
    for (int k = 0; k < s->set.count; k++)
        s->force[s->candidate_of[k]] = s->set.point[k].force;
}

Vessel *chain_scene_spiral(double radius, bool in_space)
{
    // polar radius 15.75 / theta over theta in [pi, 4 pi], as arcs of increasing curvature
    enum { ARCS = 24 };
    TubePiece piece[ARCS + 1];
    piece[0] = (TubePiece){.length = 12};
    for (int i = 0; i < ARCS; i++) {
        double a = PI + 3 * PI * (i + 0.5) / ARCS, c = 15.75;
        // curvature of r = c/theta: theta^4 / (c (1 + theta^2)^(3/2)); ds = c sqrt(1 + theta^2) / theta^2 dtheta
        double curvature = pow(a, 4) / (c * pow(1 + a * a, 1.5)), ds = c * sqrt(1 + a * a) / (a * a) * 3 * PI / ARCS;
        piece[i + 1] = (TubePiece){.arc_radius = 1 / curvature, .angle = ds * curvature, .plane = in_space && i > 0 ? 0.12 : 0};
    }
    TubeOptions options = {
        .start = vec3(0, 0, 0), .direction = vec3(1, 0, 0), .normal = vec3(0, 1, 0), .radius = radius, .piece_count = ARCS + 1, .piece = piece};
    Faults faults = {0};
    return tube_vessel_create(&options, "spiral", &faults);
}

Vessel *chain_scene_straight(double radius)
{
    TubePiece piece = {.length = 500};
    TubeOptions options = {.start = vec3(0, 0, 0), .direction = vec3(1, 0, 0), .normal = vec3(0, 1, 0), .radius = radius, .piece_count = 1, .piece = &piece};
    Faults faults = {0};
    return tube_vessel_create(&options, "straight", &faults);
}

Vessel *chain_scene_capsule(double radius)
{
    TubePiece piece = {.length = 10};
    TubeOptions options = {.start = vec3(0, 0.3, -0.1),
                           .direction = vec3(0.98401, -0.17362, 0.03984),
                           .normal = vec3(0, 1, 0),
                           .radius = radius,
                           .piece_count = 1,
                           .piece = &piece,
                           .closed_ends = true};
    Faults faults = {0};
    return tube_vessel_create(&options, "capsule", &faults);
}

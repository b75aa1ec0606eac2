// Properties of the tool: division of sections into elements, their stiffness, rest shape and mass.
//   I = pi/64 (D^4 - d^4), A = pi/4 (D^2 - d^2), J = 2 I, G = E / (2 (1 + nu))
//   kappa: Cowper 1966 for a circular tube with m = d/D; 6 (1+nu) / (7 + 6 nu) for a solid section.
// Mass is lumped: each node has half of its adjacent elements' mass and of their cross-sections' rotational inertia (rho I L about a diameter, twice that
// about the axis), which is small but keeps the rotational blocks positive definite.
#include "solver/wire.h"

#include "base/base.h"

#include "solver/beam.h"

#include <stdio.h>
#include <stdlib.h>

enum { ELEMENTS_MAX = 10000 };
static const double REST_ANGLE_MAX = 2;          // [rad] largest rest angle of an element
static const double REST_ANGLE_AIM = 0.3;        // [rad] … and the desired limit if there are enough elements

WireOptions wire_default_options(void) { return (WireOptions){.elements = 200, .damping_mass = 1e-4, .damping_stiffness = 0.2, .direction = {1, 0, 0}}; }

WireStiffness wire_stiffness(const WireSection *section)
{
    double big = section->diameter, small = section->inner_diameter, nu = section->poisson_ratio;
    double area = PI / 4 * (big * big - small * small), second = PI / 64 * (big * big * big * big - small * small * small * small);
    double shear_modulus = section->young_modulus / (2 * (1 + nu)), m2 = small / big * (small / big), q = (1 + m2) * (1 + m2);
    double kappa = 6 * (1 + nu) * q / ((7 + 6 * nu) * q + (20 + 12 * nu) * m2);
    return (WireStiffness){
        .area = area,
        .axial = section->young_modulus * area,
        .bending = section->young_modulus * second,
        .torsion = shear_modulus * 2 * second,
        .shear = kappa * shear_modulus * area,
        .line_mass = section->density * area,
        .line_inertia = section->density * second,
    };
}

static bool report_invalid(char *why, int capacity, const char *what, int index, double value, const char *valid)
{
    char place[32] = "";
    if (index >= 0)
        snprintf(place, sizeof place, " %d", index + 1);
    snprintf(why, (size_t)capacity, "%s%s is %g; valid: %s", what, place, value, valid);
    return false;
}

// Comparisons are written so that NaN fails them.
static bool within(double value, double low, double high) { return value >= low && value <= high; }

static bool check_section(const WireSection *s, int i, char *why, int capacity)
{
    if (!within(s->length, 1e-3, 1e5))
        return report_invalid(why, capacity, "length_mm of wire section", i, s->length, "0.001 to 100000 mm");
    if (!within(s->diameter, 1e-3, 100))
        return report_invalid(why, capacity, "diameter_mm of wire section", i, s->diameter, "0.001 to 100 mm");
    if (!(s->inner_diameter >= 0 && s->inner_diameter <= 0.999 * s->diameter))
        return report_invalid(why, capacity, "inner_diameter_mm of wire section", i, s->inner_diameter, "0 to 0.999 times diameter_mm");
    if (!within(s->young_modulus, 1e-3, 1e9))
        return report_invalid(why, capacity, "young_modulus (MPa) of wire section", i, s->young_modulus, "0.001 to 1e9 MPa (1e-6 to 1e6 GPa)");
    if (!(s->poisson_ratio > -1 && s->poisson_ratio < 0.5))
        return report_invalid(why, capacity, "poisson_ratio of wire section", i, s->poisson_ratio, "above -1, below 0.5");
    if (!within(s->density, 1e-7, 1))
        return report_invalid(why, capacity, "density (g/mm3) of wire section", i, s->density, "1e-7 to 1 g/mm3 (1e-4 to 1000 g/cm3)");
    if (!within(fabs(s->rest_curvature) * s->diameter, 0, 1))
        return report_invalid(why, capacity, "rest_curvature_1_mm of wire section", i, s->rest_curvature, "within +-1/diameter");
    if (!within(fabs(s->rest_plane), 0, 1e3))
        return report_invalid(why, capacity, "rest_curvature_plane (rad) of wire section", i, s->rest_plane, "a finite angle");
    if (!(s->friction <= 10))
        return report_invalid(why, capacity, "friction of wire section", i, s->friction, "0 to 10, or negative for the wall's");
    return true;
}

static bool check_rig(const WireOptions *o, double total, char *why, int capacity)
{
    if (o->fix_count < 0 || (o->fix_count > 0 && !o->fix) || o->load_count < 0 || (o->load_count > 0 && !o->load))
        return report_invalid(why, capacity, "count of fixes or loads", -1, o->fix_count, "none, or an array of them");
    for (int i = 0; i < o->fix_count; i++)
        if (!within(o->fix[i].s, 0, total * (1 + 1e-9)) || o->fix[i].dof > DOF_ALL)
            return report_invalid(why, capacity, "s_mm of fix", i, o->fix[i].s, "0 to the wire's length");
    for (int i = 0; i < o->load_count; i++) {
        const WireLoad *l = &o->load[i];
        if (!within(l->s, 0, total * (1 + 1e-9)))
            return report_invalid(why, capacity, "s_mm of load", i, l->s, "0 to the wire's length");
        if (!vec3_is_finite(l->force) || !vec3_is_finite(l->moment))
            return report_invalid(why, capacity, "force or moment of load", i, vec3_norm(l->force), "finite numbers");
        if (!within(l->ramp, 0, 1e12))
            return report_invalid(why, capacity, "ramp (ms) of load", i, l->ramp, "0 or a positive time");
    }
    return true;
}

// Returns whether all options are in range; otherwise writes a message to `why` (capacity >= 256).
static bool wire_check(const WireOptions *o, char *why, int capacity)
{
    if (o->elements < 1 || o->elements > ELEMENTS_MAX)
        return report_invalid(why, capacity, "elements of the wire", -1, o->elements, "1 to 10000");
    if (o->section_count < 1 || o->section_count > o->elements || !o->section)
        return report_invalid(why, capacity, "count of wire sections", -1, o->section_count, "at least 1, and at most as many as elements");
    double total = 0;
    for (int i = 0; i < o->section_count; i++) {
        if (!check_section(&o->section[i], i, why, capacity))
            return false;
        total += o->section[i].length;
    }
    int *elements = malloc((size_t)o->section_count * sizeof *elements);
    if (!elements)
        return report_invalid(why, capacity, "memory for wire sections", -1, o->section_count, "fewer sections");
    bool is_good = wire_divide(o, elements);
    for (int i = 0; is_good && i < o->section_count; i++) {
        double angle = fabs(o->section[i].rest_curvature) * o->section[i].length / elements[i];
        if (angle > REST_ANGLE_MAX) {
            is_good = false;
            report_invalid(why, capacity, "rest bend (rad) of one element in wire section", i, angle, "at most 2: more elements");
        }
    }
    free(elements);
    if (!is_good)
        return false;
    if (!within(o->damping_mass, 0, 1e6))
        return report_invalid(why, capacity, "damping_mass (1/ms)", -1, o->damping_mass, "0 to 1e6");
    if (!within(o->damping_stiffness, 0, 1e6))
        return report_invalid(why, capacity, "damping_stiffness (ms)", -1, o->damping_stiffness, "0 to 1e6");
    if (!vec3_is_finite(o->gravity) || !vec3_is_finite(o->start) || !vec3_is_finite(o->normal))
        return report_invalid(why, capacity, "gravity, start or normal", -1, o->gravity.x, "finite numbers");
    if (!within(vec3_norm(o->direction), 0.999, 1.001))
        return report_invalid(why, capacity, "length of the wire's direction", -1, vec3_norm(o->direction), "a unit vector");
    if (!within(o->hand_limit, 0, 1e9))
        return report_invalid(why, capacity, "hand_limit (N)", -1, o->hand_limit, "0 (never slips) to 1e9 N");
    if (!within(o->valve_friction, 0, 1e9))
        return report_invalid(why, capacity, "valve_friction (N)", -1, o->valve_friction, "0 to 1e9 N");
    if (o->has_sheath && !within(o->inserted, 0, total * (1 + 1e-12)))
        return report_invalid(why, capacity, "inserted_mm", -1, o->inserted, "0 to the wire's length");
    return check_rig(o, total, why, capacity);
}

// Weight of a section in the division: its share of the elements by length, or the number at which none turns by more than REST_ANGLE_AIM at rest.
static double wanted(const WireSection *section, double per_mm)
{
    return fmax(section->length * per_mm, fabs(section->rest_curvature) * section->length / REST_ANGLE_AIM);
}

double wire_length(const WireOptions *options)
{
    double total = 0;
    for (int i = 0; i < options->section_count; i++)
        total += options->section[i].length;
    return total;
}

bool wire_divide(const WireOptions *options, int *elements)
{
    int sections = options->section_count, left = options->elements - sections;
    if (left < 0)
        return false;
    double all = 0, per_mm = options->elements / wire_length(options);
    for (int i = 0; i < sections; i++)
        all += wanted(&options->section[i], per_mm);
    // one element each, then repeatedly one to the section with the largest weight per element: the finest division; ties go to the lower index
    for (int i = 0; i < sections; i++) {
        double share = options->elements * wanted(&options->section[i], per_mm) / all;
        int floor_count = share >= 2 ? (int)share - 1 : 0;       // safe lower bound: never more than its share
        elements[i] = 1 + (floor_count < left ? floor_count : left);
        left -= elements[i] - 1;
    }
    while (left-- > 0) {
        int most = 0;
        for (int i = 1; i < sections; i++)
            if (wanted(&options->section[i], per_mm) / elements[i] > wanted(&options->section[most], per_mm) / elements[most] * (1 + 1e-12))
                most = i;
        SEL_ASSERT(most < sections, "the section exists");
        elements[most]++;
    }
    return true;
}

static void fill(Wire *wire, const WireOptions *options, const int *elements)
{
    int e = 0;
    wire->s[0] = 0;
    double start = 0;
    for (int k = 0; k < options->section_count; k++) {
        const WireSection *section = &options->section[k];
        WireStiffness stiffness = wire_stiffness(section);
        double length = section->length / elements[k], half = length / 2;
        for (int j = 0; j < elements[k]; j++, e++) {
            wire->length[e] = length;
            wire->section[e] = k;
            wire->s[e + 1] = j + 1 == elements[k] ? start + section->length : start + (j + 1) * length;
            for (int n = e; n <= e + 1; n++) {
                wire->mass[n] += stiffness.line_mass * half;
                wire->inertia_axial[n] += 2 * stiffness.line_inertia * half;
                wire->inertia_lateral[n] += stiffness.line_inertia * half;
                wire->radius[n] = fmax(wire->radius[n], section->diameter / 2);
                wire->friction[n] = section->friction;
            }
        }
        start += section->length;
    }
    SEL_REQUIRE(e == wire->element_count, "the sections have all elements");
    wire->total_length = start;
}

bool wire_reserve(Wire *wire, int nodes)
{
    SEL_ASSERT(nodes > 1, "a wire has an element");
    size_t m = (size_t)nodes, e = m - 1;
    wire_destroy(wire);
    wire->section = calloc(e, sizeof *wire->section);
    wire->s = calloc(6 * m + e, sizeof *wire->s);
    if (!wire->section || !wire->s)
        return false;
    wire->element_count = nodes - 1;
    wire->node_count = nodes;
    wire->mass = wire->s + m;
    wire->inertia_axial = wire->s + 2 * m;
    wire->inertia_lateral = wire->s + 3 * m;
    wire->radius = wire->s + 4 * m;
    wire->friction = wire->s + 5 * m;
    wire->length = wire->s + 6 * m;
    return true;
}

bool wire_create(Wire *wire, const WireOptions *options, char *why, int capacity)
{
    *wire = (Wire){0};
    if (!wire_check(options, why, capacity))
        return false;
    int *elements = malloc((size_t)options->section_count * sizeof *elements);
    bool is_good = elements && wire_reserve(wire, options->elements + 1) && wire_divide(options, elements);
    if (is_good) {
        fill(wire, options, elements);
    } else {
        snprintf(why, (size_t)capacity, "no memory for a wire of %d elements", options->elements);
        wire_destroy(wire);
    }
    free(elements);
    return is_good;
}

void wire_destroy(Wire *wire)
{
    free(wire->section);
    free(wire->s);
    *wire = (Wire){0};
}

void wire_rest(const Wire *wire, const WireOptions *options, BeamRest *rest)
{
    rest->count = wire->element_count;
    for (int i = 0; i < wire->element_count; i++) {
        const WireSection *section = &options->section[wire->section[i]];
        SEL_ASSERT(wire->section[i] >= 0 && wire->section[i] < options->section_count, "an element belongs to a section");
        WireStiffness stiffness = wire_stiffness(section);
        double length = wire->length[i], curvature = section->rest_curvature, plane = section->rest_plane;
        SEL_ASSERT(length > 0, "an element has a length");
        if (curvature < 0)
            curvature = -curvature, plane += PI;
        rest->length[i] = length;
        rest->axial[i] = stiffness.axial / length;
        rest->twist[i] = stiffness.torsion / length;
        rest->bending[i] = stiffness.bending;
        rest->shear[i] = stiffness.shear;
        rest->curvature[i] = curvature;
        beam_bending(length, stiffness.bending, stiffness.shear, &rest->near[i], &rest->far[i]);
        // from the proximal tangent to the chord: half the arc's angle about e3 rotated by `plane`
        double quarter = 0.25 * curvature * length;
        rest->half_w[i] = same_cos(quarter);
        rest->half_y[i] = -same_sin(quarter) * same_sin(plane);
        rest->half_z[i] = same_sin(quarter) * same_cos(plane);
        // evaluated by the element's own formula, so that the rest state is free of force to rounding
        double half = 2 * quarter, chord = half > 0 ? length * same_sin(half) / half : length;
        BeamInput in = {.x2 = {chord, 0, 0},
                        .q1 = {same_cos(quarter), 0, 0, -same_sin(quarter)},
                        .q2 = {same_cos(quarter), 0, 0, same_sin(quarter)},
                        .length = length,
                        .half_w = same_cos(quarter),
                        .half_z = same_sin(quarter)};
        BeamOutput out;
        beam_element(&in, &out);
        rest->extend[i] = chord + out.bow;
    }
}

Quat wire_start_frame(const WireOptions *options)
{
    SEL_ASSERT(vec3_norm2(options->direction) > 0.5, "the direction was checked to be a unit vector");
    Vec3 e1 = vec3_unit(options->direction);
    Vec3 e2 = vec3_add_scaled(options->normal, -vec3_dot(options->normal, e1), e1);
    e2 = vec3_norm(e2) > 1e-9 * (1 + vec3_norm(options->normal)) ? vec3_unit(e2) : vec3_normal_to(e1);
    Vec3 e3 = vec3_cross(e1, e2);
    Mat3 frame = mat3_from_columns(e1, e2, e3);
    return quat_from_mat3(&frame);
}

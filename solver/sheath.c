// The element across the mouth. Its inner node has the axial coordinate a < 0 and a twist. At the mouth m the wire is clamped in position and direction d;
// the part outside has the rest length l = L + a and is a single beam (beam_element.c) from m to the outer node x.
//   E = EA/(2L) (-a + |x - m| + bow + w(l) - L)^2 + bending(l, x, R) + GJ/(2L) psi^2 + EI k0^2/2 (L - l)
// Axial strain and twist are spread over the whole element, bending only over the part outside. The last term is the energy of a wire with rest curvature k0
// that is held straight inside. As l tends to 0 the beam becomes a clamp; at l = L it is the ordinary element: nothing is discontinuous when a node passes.
// Because l depends on a, dE/da has the configurational part dE/dl, which in the frictionless case of a straight wire is -M^2/(2 EI): the axial force that a
// bend downstream exerts through a sleeve (Bigoni 2015).
//
// In a step l changes by the advance, which near the mouth exceeds l itself. The energy of constant curvature, EI/(2l) |phi - k0 l|^2 with
// phi = turn2 - turn1, is jointly convex in (phi, l); its full second derivative EI/l |d phi - k dl|^2, k = phi/l, is in the tangent. It is evaluated at the
// length of the step's end and the curvature of its start, because the curvature is what persists.
#include "solver/sheath.h"

#include "base/base.h"

// Unit vector in the node's frame: the axis of the rest curvature, e3 rotated about e1; half_y and half_z are its components times a sine.
static Vec3 bending_axis(const BeamRest *rest, int index)
{
    double y = rest->half_y[index], z = rest->half_z[index], size = sqrt(y * y + z * z);
    return size > 0 ? vec3(0, y / size, z / size) : vec3(0, 0, 1);
}

static Vec3 own_curvature(const BeamRest *rest, int index) { return vec3_scale(bending_axis(rest, index), rest->curvature[index]); }

Vec3 sheath_rest_curvature(const BeamRest *rest, int index, Quat q) { return quat_rotate(q, own_curvature(rest, index)); }

const double sheath_border_share = 0.02;

// Weight at the mouth of the element behind, 0 to 1, where the inner node is `past` it [mm]; *sum: its integral over the length past the mouth. The border is
// spread equally to both sides of the node, so that no energy is created.
static double share_behind(const BeamRest *rest, int index, double past, double *sum)
{
    double width = sheath_border_share * rest->length[index], from = past + 0.5 * width;
    *sum = 0;
    if (index == 0 || from <= 0)
        return 0;
    *sum = from < width ? 0.5 * from * from / width : past;
    return fmin(from / width, 1);
}

static double straightening(const BeamRest *rest, int index) { return 0.5 * rest->bending[index] * rest->curvature[index] * rest->curvature[index]; }

double sheath_straightening(const BeamRest *rest, int index, double coordinate)
{
    SEL_ASSERT(index >= 0 && index < rest->count, "the element at the mouth is one of the chain's");
    double sum, share = share_behind(rest, index, coordinate, &sum), own = straightening(rest, index);
    return share > 0 ? own + share * (straightening(rest, index - 1) - own) : own;
}

double sheath_outside(double length, double coordinate) { return fmax(length + coordinate, 0.01 * length); }

void sheath_element(const BeamRest *rest, int index, Vec3 mouth, Vec3 direction, double coordinate, Quat q1, Vec3 x2, Quat q2, double ahead,
                    SheathElement *element)
{
    SEL_ASSERT(index >= 0 && index < rest->count, "the element at the mouth is one of the chain's");
    SEL_ASSERT(fabs(vec3_norm2(direction) - 1) < 1e-9, "the sheath's direction is a unit vector");
    SEL_ASSERT(quat_is_unit(q1) && quat_is_unit(q2), "frames are unit quaternions");
    double length = rest->length[index], outside = sheath_outside(length, coordinate + ahead), now = sheath_outside(length, coordinate);
    double bending = rest->bending[index], own = straightening(rest, index), stored = own * (length - outside), border = 0, sum, slope, near_slope, far_slope;
    double past = outside - length, share = share_behind(rest, index, past, &sum), softer = 0;
    Vec3 rest_here = own_curvature(rest, index), rest_outside = rest_here;
    if (share > 0) {
        Vec3 change = vec3_sub(own_curvature(rest, index - 1), rest_here);
        double less = own - straightening(rest, index - 1);
        rest_outside = vec3_add_scaled(rest_here, sum / outside, change);
        rest_here = vec3_add_scaled(rest_here, share, change);
        stored += less * sum;
        border = share < 1 ? fmax(0, less) / (sheath_border_share * length) : 0;
        own -= share * less;
        // the two parts bend as springs in series
        double more = 1 / rest->bending[index - 1] - 1 / bending, flexibility = 1 / bending + more * sum / outside;
        softer = (1 - (1 / bending + more * share) / flexibility) / outside;
        bending = 1 / flexibility;
    }
    double k0 = vec3_norm(rest_outside), quarter = 0.25 * k0 * outside;
    Vec3 plane = k0 > 0 ? vec3_scale(rest_outside, 1 / k0) : vec3(0, 0, 1);
    BeamInput in = {.x1 = mouth,
                    .x2 = x2,
                    .q1 = q1,
                    .q2 = q2,
                    .length = outside,
                    .axial = rest->axial[index],
                    .twist = rest->twist[index],
                    .half_w = same_cos(quarter),
                    .half_y = same_sin(quarter) * plane.y,
                    .half_z = same_sin(quarter) * plane.z};
    in.extend = length - beam_arc_rest(outside, k0, &slope) + coordinate;
    beam_bending(outside, bending, rest->shear[index], &in.near, &in.far);
    beam_bending_slope(outside, bending, rest->shear[index], &near_slope, &far_slope);
    BeamOutput out;
    beam_element(&in, &out);

    double by_length = out.tension * (out.bow / outside + slope) - own;
    by_length += 0.5 * near_slope * (vec3_norm2(out.angle1) + vec3_norm2(out.angle2)) + far_slope * vec3_dot(out.angle1, out.angle2);
    by_length += 0.5 * softer *
                 (vec3_dot(out.angle1, vec3_add(vec3_scale(out.angle1, in.near), vec3_scale(out.angle2, in.far))) +
                  vec3_dot(out.angle2, vec3_add(vec3_scale(out.angle2, in.near), vec3_scale(out.angle1, in.far))));
    // a longer arc rotates the rest chord in both nodes' frames
    by_length += 0.5 * (vec3_dot(quat_rotate(q1, rest_here), out.chord1) - vec3_dot(quat_rotate(q2, rest_here), out.chord2));
    // second-order part that the linearisation in phi at the new length omits if the curvature persists
    Vec3 phi = vec3_sub(out.turn1, out.turn2);
    double change = 1 / outside - 1 / now;
    by_length += 0.5 * bending * vec3_norm2(phi) * change * change;

    *element = (SheathElement){
        .outside = outside,
        .axial_gradient = by_length - out.tension,
        .twist_gradient = vec3_dot(direction, out.moment1),
        .energy = out.energy + stored,
        .beam = in,
        .out = out,
        .curvature = vec3_scale(phi, 1 / now),
        .bending = bending,
        .border = border,
    };
}

void sheath_tangent(const BeamRest *rest, int index, Vec3 direction, const SheathElement *element, double scale, BeamTangent *tangent, double *length_column)
{
    SEL_ASSERT(element->outside > 0 && scale > 0, "part of the element is outside, and the stiffness factor is positive");
    BeamTangent full;
    const BeamOutput *out = &element->out;
    double ka = rest->axial[index] * scale, d[3] = {direction.x, direction.y, direction.z};
    beam_tangent(&element->beam, out, scale, &full);
    *tangent = (BeamTangent){0};
    for (int i = 0; i < 36; i++)
        tangent->k22[i] = full.k22[i];
    // rotation about the line: columns 3..5 times d
    double twist[6] = {0};
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 3; j++) {
            tangent->k21[i * 6 + 3] += full.k21[i * 6 + 3 + j] * d[j];
            twist[i] += full.k11[i * 6 + 3 + j] * d[j];
        }
    }
    tangent->k11[21] = twist[3] * d[0] + twist[4] * d[1] + twist[5] * d[2];
    // the axial unknown enters the extension with a factor of -1
    tangent->k11[0] = ka;
    tangent->k11[3] = tangent->k11[18] = -ka * vec3_dot(out->bow1, direction);
    double column[6] = {out->stretch.x, out->stretch.y, out->stretch.z, out->bow2.x, out->bow2.y, out->bow2.z};
    for (int i = 0; i < 6; i++)
        tangent->k21[i * 6] = -ka * column[i];
    // it also enters through l: EI/l |d theta1 - d theta2 - k dl|^2, with B and D of beam_equations.h
    Vec3 e = out->chord, t1 = out->tangent1, t2 = out->tangent2;
    double k = element->bending / element->outside;
    Vec3 w = vec3_scale(element->curvature, -k), across = vec3_scale(vec3_cross(vec3_sub(t1, t2), w), out->inverse);
    across = vec3_add_scaled(across, -vec3_dot(across, e), e);
    Vec3 first = vec3_add_scaled(vec3_scale(w, vec3_dot(e, t1)), -vec3_dot(t1, w), e);
    Vec3 second = vec3_add_scaled(vec3_scale(w, -vec3_dot(e, t2)), vec3_dot(t2, w), e);
    double through[12] = {
        k * vec3_norm2(element->curvature), 0, 0, vec3_dot(direction, first), 0, 0, across.x, across.y, across.z, second.x, second.y, second.z};
    for (int i = 0; i < 12; i++)
        length_column[i] = through[i];
    length_column[0] += element->border;
    tangent->k11[0] += scale * through[0] + element->border;
    tangent->k11[3] += scale * through[3];
    tangent->k11[18] += scale * through[3];
    for (int i = 0; i < 6; i++)
        tangent->k21[i * 6] += scale * through[6 + i];
}

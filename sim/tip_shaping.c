// A round core of radius r is bent to the curvature k. Its fibres have the strain k y; those further than c = e / k from the neutral axis have yielded, e the
// yield strain. With x = c / r <= 1 and My = E e pi r^3 / 4, at which the outermost fibre yields (k = e / r), the moment is
//
//   M / My = 16 / pi ( (asin x - x sqrt(1 - x^2) (1 - 2 x^2)) / (8 x) + (1 - x^2)^(3/2) / 3 )
//
// (elastic within c: 4 integrals of E k y^2 sqrt(r^2 - y^2); beyond it: of E e y sqrt(r^2 - y^2)). When released, the section springs back linearly by M / (E
// I), so
//
//   kept curvature = k - M / (E I) = k - (M / My) e / r.
//
// No fibre yields again during springback: the outermost goes from E e to E e (1 - M / My) >= -0.70 E e.
//
// Yield strain of the core: ASTM A313 gives hard-drawn stainless steel wire (302, 304) of up to 0.009 inch at least 325 ksi = 2240 MPa; its elastic limit in
// tension is 65 to 75 % of that (handbooks of spring design), its modulus 193 GPa: 0.0075 to 0.0087. Cores that were heat-treated or ground to a ribbon have
// less, 0.006. The coil around the core carries no load here and keeps no bend; earlier bends are assumed to have been straightened.
#include "sim/tip_shaping.h"

#include "base/base.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const double tip_yield_strain = 0.008;
static const double core_modulus = 193000;       // [MPa]
static const double sliver = 1e-6;               // [mm] shorter sections are skipped

double tip_core_moment(double curvature)
{
    if (curvature <= 1)
        return curvature;
    double x = 1 / curvature, root = sqrt(1 - x * x);
    // its terms cancel to x^3 / 3; below this value a series is as accurate
    double elastic = x > 0.01 ? (same_asin(x) - x * root * (1 - 2 * x * x)) / (8 * x) : x * x / 3 - x * x * x * x / 10;
    return 16 / PI * (elastic + root * root * root / 3);
}

double tip_kept_curvature(double curvature, double core_diameter)
{
    double yield = tip_yield_strain / (core_diameter / 2);
    return curvature > yield ? curvature - tip_core_moment(curvature / yield) * yield : 0;
}

double tip_core_diameter(const WireSection *section) { return same_pow(64 * wire_stiffness(section).bending / (PI * core_modulus), 0.25); }

// Appends a piece of a section; skips slivers.
static void append(WireSection *out, int *count, const WireSection *section, double length, double curvature)
{
    if (length <= sliver)
        return;
    out[*count] = *section;
    out[*count].length = length;
    out[*count].rest_curvature = curvature;
    out[(*count)++].rest_plane = 0;
}

// Shapes the section from `begin` on, which lies within the shaped part: bent until the angle is reached, then straight.
static void shape_section(WireSection *out, int *count, const WireSection *section, double length, const TipShaping *shaping, double *angle_left,
                          TipShaped *shaped)
{
    double bent = 1 / (shaping->mandrel + section->diameter / 2), kept = tip_kept_curvature(bent, tip_core_diameter(section));
    double arc = *angle_left <= 0 ? 0 : kept > 0 ? fmin(length, *angle_left / kept) : length;
    append(out, count, section, arc, kept);
    append(out, count, section, length - arc, 0);
    *angle_left = kept > 0 && arc < length ? 0 : *angle_left - arc * kept;
    shaped->bent_angle += arc * bent;
    shaped->arc += arc;
    if (arc > 0 && kept > 0)
        shaped->rest_radius = 1 / kept;
}

WireSection *tip_shaped_sections(const WireSection *section, int count, const TipShaping *shaping, int *shaped_count, TipShaped *shaped, char *why,
                                 size_t capacity)
{
    double total = 0, begin = 0, angle_left = shaping->angle;
    for (int i = 0; i < count; i++)
        total += section[i].length;
    *shaped_count = 0;
    *shaped = (TipShaped){0};
    if (!(shaping->length <= total)) {
        snprintf(why, capacity, "a tip of %g mm is to be shaped, but the wire is %g mm long; expected at most the wire's length", shaping->length, total);
        return NULL;
    }
    WireSection *out = calloc(2 * (size_t)count + 1, sizeof *out);
    if (!out) {
        snprintf(why, capacity, "out of memory");
        return NULL;
    }
    for (int i = 0; i < count; begin += section[i++].length) {
        double straight = fmax(0, fmin(section[i].length, total - shaping->length - begin));
        if (straight > sliver) {
            out[*shaped_count] = section[i];
            out[(*shaped_count)++].length = straight;
        }
        if (section[i].length - straight > sliver)
            shape_section(out, shaped_count, &section[i], section[i].length - straight, shaping, &angle_left, shaped);
    }
    if (angle_left <= 1e-9 * shaping->angle)
        return out;
    free(out);
    const double per_degree = PI / 180;
    if (angle_left >= shaping->angle)
        snprintf(why, capacity, "a mandrel of radius %g mm does not make the core yield, so it springs back; use a thinner mandrel", shaping->mandrel);
    else
        snprintf(why, capacity,
                 "%g mm of the tip, bent round a mandrel of radius %g mm, keep %.0f degrees, not %.0f; use a longer tip, a smaller angle or a thinner mandrel",
                 shaping->length, shaping->mandrel, (shaping->angle - angle_left) / per_degree, shaping->angle / per_degree);
    return NULL;
}

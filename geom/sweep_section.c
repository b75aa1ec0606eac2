// Figures of the swept model's sections: the formulas stand in sweep_section.h. N and B are perpendicular unit vectors except for terms of fourth order in the
// interval between knots, which are left out here. The trapezoidal rule converges faster than any power for a periodic function without corners.
#include "geom/sweep_section.h"

#include "geom/sweep_terms.h"

enum { ANGLES = 512 };

// The extreme value of a parabola through three neighbouring values at equal distances.
static double extreme(double before, double at, double after)
{
    double bend = before - 2 * at + after, slope = 0.5 * (after - before);
    return bend != 0 ? at - 0.5 * slope * slope / bend : at;
}

SweepSection sweep_section_at(const SweepField *field, int branch, double t)
{
    double length = field->curve[branch]->length, term[SWEEP_TERMS], radius[ANGLES];
    SEL_ASSERT(t >= 0 && t <= length, "the section lies on the branch");
    SweepJet jet = sweep_curve_at(field->curve[branch], t);
    // the section at the end belongs to the segment before it
    const SweepSegment *s = &field->segment[t < length ? sweep_field_segment(field, branch, t) : field->first_segment[branch + 1] - 3];
    double x = t - s->origin;
    SweepSection out = {.branch = branch, .t = t, .centre = jet.s, .normal = vec3_unit(jet.s1)};
    for (int k = 0; k < SWEEP_TERMS; k++)
        term[k] = s->section[k][0] + x * (s->section[k][1] + x * (s->section[k][2] + x * s->section[k][3]));
    out.mean = term[0];
    out.area = sweep_terms_area(term);
    for (int i = 0; i < ANGLES; i++) {
        double angle = 2 * PI * i / ANGLES, slope = 0;
        radius[i] = term[0];
        for (int k = 1; k <= SWEEP_HARMONICS; k++) {
            double c = same_cos(k * angle), d = same_sin(k * angle);
            radius[i] += term[2 * k - 1] * c + term[2 * k] * d;
            slope += k * (term[2 * k] * c - term[2 * k - 1] * d);
        }
        out.perimeter += 2 * PI / ANGLES * same_hypot(radius[i], slope);
    }
    out.least = HUGE_VAL;
    for (int i = 0; i < ANGLES; i++) {
        double before = radius[(i + ANGLES - 1) % ANGLES], at = radius[i], after = radius[(i + 1) % ANGLES];
        if (at <= before && at <= after)
            out.least = fmin(out.least, extreme(before, at, after));
        if (at >= before && at >= after)
            out.largest = fmax(out.largest, extreme(before, at, after));
    }
    out.circularity = 4 * PI * out.area / (out.perimeter * out.perimeter);
    return out;
}

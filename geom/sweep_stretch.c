// With g_v = grad v, H_v = Hess v of v = n, b, t (sweep_model.h) and the row's jet C(n, b, t):
//   grad C = C_n g_n + C_b g_b + C_t g_t,   Hess C = sum_v C_v H_v + sum_vw C_vw g_v g_w',
//   H_n = N' g_t' + g_t N'' + c g_t g_t' + a H_t, with a and c as in sweep_model.h; the same for b.
// The mixture f = f_rows + m (C - f_rows), with d = C - f_rows:
//   grad f = grad f_rows + m grad d + m' d g_t,
//   Hess f = Hess f_rows + m Hess d + m' (g_t grad d' + grad d g_t') + m'' d g_t g_t' + m' d H_t.
#include "geom/sweep_stretch.h"

#include "geom/section_kinds.h"

// --- Evaluation ---

typedef struct FieldJet {
    double f;
    Vec3 gradient;
    Sym3 hessian;
} FieldJet;

SweepStretchShare sweep_stretch_share(const SweepModel *model, const SweepStretch *stretch, double t)
{
    bool runs_on = stretch->from <= 0 && model->branch[stretch->branch].open_start;
    double s = 1, side = 0, per = 1 / stretch->fade;
    if (!runs_on && t < stretch->from + stretch->fade)
        s = (t - stretch->from) * per, side = per;
    if (t > stretch->to - stretch->fade)
        s = (stretch->to - t) * per, side = -per;
    if (s >= 1)
        return (SweepStretchShare){1, 0, 0};
    if (s <= 0)
        return (SweepStretchShare){0, 0, 0};
    return (SweepStretchShare){s * s * s * (10 - s * (15 - 6 * s)), 30 * s * s * (1 - s) * (1 - s) * side, 60 * s * (1 - s) * (1 - 2 * s) * side * side};
}

// C in the coordinates of the curve, in space.
static void carry_to_space(const SweepJet *j, Vec3 x, const SweepPart *p, const SectionRowJet *c, FieldJet *out)
{
    Vec3 u = vec3_sub(x, j->s), gt = p->t_gradient, axis[2] = {j->n, j->b}, axis1[2] = {j->n1, j->b1}, axis2[2] = {j->n2, j->b2}, g[2];
    double first[2] = {c->n, c->b}, mixed[2] = {c->nt, c->bt};
    out->f = c->value;
    out->gradient = vec3_scale(gt, c->t);
    out->hessian = (Sym3){0, 0, 0, 0, 0, 0};
    sym3_add(&out->hessian, c->t, &p->t_hessian);
    sym3_add_outer(&out->hessian, c->tt, gt);
    for (int i = 0; i < 2; i++) {
        double a = vec3_dot(u, axis1[i]) - vec3_dot(j->s1, axis[i]);
        double bend = vec3_dot(u, axis2[i]) - vec3_dot(j->s2, axis[i]) - 2 * vec3_dot(j->s1, axis1[i]);
        g[i] = vec3_add_scaled(axis[i], a, gt);
        out->gradient = vec3_add_scaled(out->gradient, first[i], g[i]);
        sym3_add_pair(&out->hessian, first[i], axis1[i], gt);
        sym3_add_outer(&out->hessian, first[i] * bend, gt);
        sym3_add(&out->hessian, first[i] * a, &p->t_hessian);
        sym3_add_pair(&out->hessian, mixed[i], g[i], gt);
    }
    sym3_add_outer(&out->hessian, c->nn, g[0]);
    sym3_add_outer(&out->hessian, c->bb, g[1]);
    sym3_add_pair(&out->hessian, c->nb, g[0], g[1]);
}

// C of sections in straight frames: sum_i C_i(n_i, b_i) B_i(t_i), B_i(t) = H((d/2 - t)/delta) - H((-d/2 - t)/delta), d the mean distance of the neighbours.
static void evaluate_straight(const SweepModel *model, const SweepCurve *curve, const SweepStretch *stretch, Vec3 x, double t, FieldJet *out)
{
    const SweepStation *station = model->station + stretch->first_station;
    *out = (FieldJet){.f = 0};
    for (int i = 0; i < stretch->station_count; i++) {
        double before = i > 0 ? station[i].t - station[i - 1].t : 0, after = i + 1 < stretch->station_count ? station[i + 1].t - station[i].t : 0;
        double d = before > 0 && after > 0 ? 0.5 * (before + after) : fmax(before, after), delta = stretch->width * d, up[4] = {1, 0, 0, 0},
               down[4] = {0, 0, 0, 0};
        if (stretch->station_count > 1 && fabs(t - station[i].t) > 3 * d)
            continue;
        SweepJet j = sweep_curve_at(curve, station[i].t);
        Vec3 u = vec3_sub(x, j.s), axis[3] = {j.n, j.b, vec3_unit(j.s1)};
        double along = vec3_dot(u, axis[2]), w[3] = {0, 0, 0};
        SectionJet c = section_evaluate(model->section[stretch->first_station + i], vec3_dot(u, axis[0]), vec3_dot(u, axis[1]));
        // the first and the last section run on beyond the ends
        if (i + 1 < stretch->station_count)
            section_step((0.5 * d - along) / delta, up);
        if (i > 0)
            section_step((-0.5 * d - along) / delta, down);
        w[0] = up[0] - down[0], w[1] = -(up[1] - down[1]) / delta, w[2] = (up[2] - down[2]) / (delta * delta);
        if (stretch->station_count == 1)
            w[0] = 1, w[1] = w[2] = 0;
        Vec3 across = vec3_add_scaled(vec3_scale(axis[0], c.n), c.b, axis[1]);
        out->f += w[0] * c.value;
        out->gradient = vec3_add_scaled(vec3_add_scaled(out->gradient, w[0], across), w[1] * c.value, axis[2]);
        sym3_add_outer(&out->hessian, w[0] * c.nn, axis[0]);
        sym3_add_outer(&out->hessian, w[0] * c.bb, axis[1]);
        sym3_add_pair(&out->hessian, w[0] * c.nb, axis[0], axis[1]);
        sym3_add_pair(&out->hessian, w[1], across, axis[2]);
        sym3_add_outer(&out->hessian, w[2] * c.value, axis[2]);
    }
}

static void evaluate_stretch(const SweepModel *model, const SweepCurve *curve, const SweepStretch *stretch, Vec3 x, const SweepPart *p, FieldJet *out)
{
    if (stretch->is_straight) {
        evaluate_straight(model, curve, stretch, x, p->t, out);
        return;
    }
    SweepJet j = sweep_curve_at(curve, p->t);
    const SectionRow row = {.count = stretch->station_count,
                            .t = model->station_t + stretch->first_station,
                            .section = model->section + stretch->first_station,
                            .weights = stretch->weights,
                            .tension = stretch->tension,
                            .width = stretch->width};
    SectionRowJet c = section_row_evaluate(&row, p->n, p->b, p->t);
    carry_to_space(&j, x, p, &c, out);
}

void sweep_stretch_apply(const SweepModel *model, SweepCurve *const *curve, int branch, Vec3 x, SweepPart *p)
{
    for (int i = 0; i < model->stretch_count; i++) {
        const SweepStretch *stretch = &model->stretch[i];
        if (stretch->branch != branch)
            continue;
        SweepStretchShare s = sweep_stretch_share(model, stretch, p->t);
        if (!(s.m > 0))
            continue;
        FieldJet c;
        evaluate_stretch(model, curve[branch], stretch, x, p, &c);
        double d = c.f - p->f;
        Vec3 d1 = vec3_sub(c.gradient, p->gradient);
        sym3_add(&c.hessian, -1, &p->hessian);
        p->f += s.m * d;
        p->gradient = vec3_add_scaled(vec3_add_scaled(p->gradient, s.m, d1), s.m1 * d, p->t_gradient);
        sym3_add(&p->hessian, s.m, &c.hessian);
        sym3_add_pair(&p->hessian, s.m1, p->t_gradient, d1);
        sym3_add_outer(&p->hessian, s.m2 * d, p->t_gradient);
        sym3_add(&p->hessian, s.m1 * d, &p->t_hessian);
        return;
    }
}

void sweep_stretch_mark(const SweepModel *model, int branch, SweepSegment *segment)
{
    static const double SLACK = 1.1;         // sections lie near their contours, and the row between stations near the sections
    for (int i = 0; i < model->stretch_count; i++) {
        const SweepStretch *stretch = &model->stretch[i];
        bool runs_on = stretch->from <= 0 && model->branch[branch].open_start;
        if (stretch->branch != branch || segment->from >= stretch->to || (!runs_on && segment->to <= stretch->from))
            continue;
        segment->is_shaped = 1;
        const SweepStation *station = model->station + stretch->first_station;
        for (int k = 0; k < stretch->station_count; k++) {
            int before = k > 1 ? k - 2 : 0, after = k + 2 < stretch->station_count ? k + 2 : stretch->station_count - 1;
            if ((k > 1 && station[before].t > segment->to) || (k + 2 < stretch->station_count && station[after].t < segment->from))
                continue;
            for (int p = station[k].first_point; p < station[k].first_point + station[k].point_count; p++)
                segment->largest = fmax(segment->largest, SLACK * same_hypot(model->contour[p].n, model->contour[p].b));
        }
    }
}

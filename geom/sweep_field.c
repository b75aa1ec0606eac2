// The evaluation of the swept model; its equations are those of sweep_model.h. In addition:
//
// The branch's field is f = r(u) - |v| with v = (n, b, w), u = v/|v|, r(u) = Re sum_k c_k (u_x + i u_y)^k. With q = grad r, Q = Hess r in u, P = I - u u',
//   df/dv = P q / |v| - u,   d2f/dv2 = (P Q P - (u.q) P - u (P q)' - (P q) u') / |v|^2 - P / |v|,   d2f/dv dt = P dq/dt / |v|.
// The blend, with d = x - y, q = |d|/delta < 2, A_d = sign(d) (q - q^2/4), A_delta = 2/3 - q^2/2 + q^3/6 and e = grad d - sign(d) q grad delta:
//   grad M = (grad x + grad y + A_d grad d + A_delta grad delta)/2,
//   Hess M = (Hess x + Hess y + A_d Hess d + A_delta Hess delta + (1 - q/2)/delta e e')/2.
#include "geom/sweep_field.h"

#include "geom/blobby.h"
#include "geom/power_walk.h"
#include "geom/sweep_stretch.h"

#include <string.h>

int sweep_field_segment(const SweepField *field, int branch, double t)
{
    SEL_ASSERT(branch >= 0 && branch < field->model->branch_count, "the branch is one of the model");
    int low = field->first_segment[branch], high = field->first_segment[branch + 1] - 1;     // the segment is one of low … high
    while (low < high) {
        int middle = (low + high) / 2;
        if (t < field->segment[middle].to)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

double sweep_field_largest(const SweepField *field, int branch, double t) { return field->segment[sweep_field_segment(field, branch, t)].largest; }

double sweep_field_mean(const SweepField *field, int branch, double t)
{
    const SweepSegment *s = &field->segment[sweep_field_segment(field, branch, t)];
    double x = t - s->origin;
    return s->section[0][0] + x * (s->section[0][1] + x * (s->section[0][2] + x * s->section[0][3]));
}

// --- One branch ---

// Polynomials of the section at x = t - origin and their derivatives.
typedef struct RowJet {
    double c[SWEEP_TERMS], c1[SWEEP_TERMS], c2[SWEEP_TERMS];
} RowJet;

static void section_at(const SweepSegment *s, double x, RowJet *at)
{
    for (int k = 0; k < SWEEP_TERMS; k++) {
        const double *p = s->section[k];
        at->c[k] = p[0] + x * (p[1] + x * (p[2] + x * p[3]));
        at->c1[k] = p[1] + x * (2 * p[2] + x * 3 * p[3]);
        at->c2[k] = 2 * p[2] + 6 * x * p[3];
    }
}

// sum_k c_k z^k, its first two derivatives in z (their real parts and minus their imaginary parts are derivatives in u_x and u_y), and those in t.
typedef struct SectionSum {
    double r, rx, ry, rxx, rxy;      // ryy = -rxx
    double rt, rtt, rtx, rty;
} SectionSum;

static SectionSum sum_section(const RowJet *at, double x, double y)
{
    SectionSum sum = {.r = at->c[0], .rt = at->c1[0], .rtt = at->c2[0]};
    double re[3] = {1, 0, 0}, im[3] = {0, 0, 0};     // z^k, z^(k-1), z^(k-2)
    for (int k = 1; k <= SWEEP_HARMONICS; k++) {
        re[2] = re[1], im[2] = im[1], re[1] = re[0], im[1] = im[0];
        re[0] = re[1] * x - im[1] * y, im[0] = re[1] * y + im[1] * x;
        // c_k = a - i b: Re c_k z = a Re z + b Im z, Im c_k z = a Im z - b Re z
        double a = at->c[2 * k - 1], b = at->c[2 * k], a1 = at->c1[2 * k - 1], b1 = at->c1[2 * k], a2 = at->c2[2 * k - 1], b2 = at->c2[2 * k];
        double first = k, second = k * (k - 1);
        sum.r += a * re[0] + b * im[0];
        sum.rx += first * (a * re[1] + b * im[1]), sum.ry -= first * (a * im[1] - b * re[1]);
        sum.rxx += second * (a * re[2] + b * im[2]), sum.rxy -= second * (a * im[2] - b * re[2]);
        sum.rt += a1 * re[0] + b1 * im[0], sum.rtt += a2 * re[0] + b2 * im[0];
        sum.rtx += first * (a1 * re[1] + b1 * im[1]), sum.rty -= first * (a1 * im[1] - b1 * re[1]);
    }
    return sum;
}

// grad t and Hess t at a foot on the curve.
static void differentiate_t(const SweepJet *j, Vec3 u, SweepPart *p)
{
    double speed2 = vec3_norm2(j->s1), d = fmax(speed2 - vec3_dot(u, j->s2), SWEEP_LEAST_D * speed2), d2 = d * d;
    p->t_gradient = vec3_scale(j->s1, 1 / d);
    Vec3 v = vec3_add_scaled(vec3_scale(j->s2, 1 / d2), -0.5 * (3 * vec3_dot(j->s1, j->s2) - vec3_dot(u, j->s3)) / (d2 * d), j->s1);
    p->t_hessian = (Sym3){0, 0, 0, 0, 0, 0};     // S' v' + v S'
    p->t_hessian.xx = 2 * j->s1.x * v.x, p->t_hessian.xy = j->s1.x * v.y + j->s1.y * v.x, p->t_hessian.xz = j->s1.x * v.z + j->s1.z * v.x;
    p->t_hessian.yy = 2 * j->s1.y * v.y, p->t_hessian.yz = j->s1.y * v.z + j->s1.z * v.y, p->t_hessian.zz = 2 * j->s1.z * v.z;
}

// f, gradient and Hessian at a known t on a segment.
void sweep_segment_evaluate(const SweepSegment *segment, Vec3 x, double t, SweepPart *p)
{
    static const double LEAST = 1e-12;       // [mm] rho: on the curve itself f has no gradient
    const SweepInterval interval = {.origin = segment->origin,
                                    .s = {segment->s[0], segment->s[1], segment->s[2], segment->s[3]},
                                    .n = {segment->n[0], segment->n[1], segment->n[2], segment->n[3]},
                                    .b = {segment->b[0], segment->b[1], segment->b[2], segment->b[3]}};
    SweepJet j = sweep_interval_at(&interval, t);
    Vec3 u = vec3_sub(x, j.s);
    p->t = t, p->n = vec3_dot(u, j.n), p->b = vec3_dot(u, j.b), p->w = segment->rise * (t - segment->origin);
    differentiate_t(&j, u, p);
    double rho = sqrt(p->n * p->n + p->b * p->b + p->w * p->w), r = fmax(rho, LEAST);
    double e[3] = {p->n / r, p->b / r, p->w / r};
    RowJet section;
    section_at(segment, t - segment->origin, &section);
    SectionSum sum = sum_section(&section, e[0], e[1]);
    p->rho = rho;
    p->f = sum.r - rho;
    // derivatives in v
    double q[3] = {sum.rx, sum.ry, 0}, qt[3] = {sum.rtx, sum.rty, 0}, Q[3][3] = {{sum.rxx, sum.rxy, 0}, {sum.rxy, -sum.rxx, 0}, {0, 0, 0}};
    double along = e[0] * q[0] + e[1] * q[1], along_t = e[0] * qt[0] + e[1] * qt[1], first[3], mixed[3], Qe[3] = {0}, second[3][3], eQe = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            Qe[i] += Q[i][k] * e[k];
    for (int i = 0; i < 3; i++)
        eQe += e[i] * Qe[i];
    double pq[3];
    for (int i = 0; i < 3; i++)
        pq[i] = q[i] - along * e[i], first[i] = pq[i] / r - e[i], mixed[i] = (qt[i] - along_t * e[i]) / r;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double P = (i == k ? 1 : 0) - e[i] * e[k], PQP = Q[i][k] - Qe[i] * e[k] - e[i] * Qe[k] + eQe * e[i] * e[k];
            second[i][k] = (PQP - along * P - e[i] * pq[k] - pq[i] * e[k]) / (r * r) - P / r;
        }
    // derivatives of v in space
    double a[3] = {vec3_dot(u, j.n1) - vec3_dot(j.s1, j.n), vec3_dot(u, j.b1) - vec3_dot(j.s1, j.b), 0};
    double c[3] = {vec3_dot(u, j.n2) - vec3_dot(j.s2, j.n) - 2 * vec3_dot(j.s1, j.n1), vec3_dot(u, j.b2) - vec3_dot(j.s2, j.b) - 2 * vec3_dot(j.s1, j.b1), 0};
    Vec3 gt = p->t_gradient, g[3] = {vec3_add_scaled(j.n, a[0], gt), vec3_add_scaled(j.b, a[1], gt), vec3_scale(gt, segment->rise)},
         axis1[3] = {j.n1, j.b1, {0, 0, 0}};
    p->gradient = vec3_scale(gt, sum.rt);
    p->hessian = (Sym3){0, 0, 0, 0, 0, 0};
    sym3_add(&p->hessian, sum.rt, &p->t_hessian);
    sym3_add_outer(&p->hessian, sum.rtt, gt);
    for (int i = 0; i < 3; i++) {
        p->gradient = vec3_add_scaled(p->gradient, first[i], g[i]);
        // first[i] Hess v_i, of which N' grad t' + grad t N' + c grad t grad t' + a Hess t
        sym3_add_pair(&p->hessian, first[i], axis1[i], gt);
        sym3_add_outer(&p->hessian, first[i] * c[i], gt);
        sym3_add(&p->hessian, first[i] * (i == 2 ? segment->rise : a[i]), &p->t_hessian);
        sym3_add_pair(&p->hessian, mixed[i], g[i], gt);
        sym3_add_outer(&p->hessian, second[i][i], g[i]);
        for (int k = 0; k < i; k++)
            sym3_add_pair(&p->hessian, second[i][k], g[i], g[k]);
    }
}

void sweep_branch_evaluate(const SweepField *field, int branch, const SweepSegment *segment, Vec3 x, double t, SweepPart *part)
{
    sweep_segment_evaluate(segment, x, t, part);
    if (segment->is_shaped > 0)
        sweep_stretch_apply(field->model, field->curve, branch, x, part);
}

void sweep_field_branch(const SweepField *field, int branch, Vec3 x, double start, SweepPart *part)
{
    double t = sweep_curve_project(field->curve[branch], x, start, 2 * field->model->branch[branch].radius);
    *part = (SweepPart){.branch = branch, .share = 1, .sac = -1};
    sweep_branch_evaluate(field, branch, &field->segment[sweep_field_segment(field, branch, t)], x, t, part);
}

// --- Blends ---

void sweep_field_sac(const SweepField *field, int node, Vec3 x, SweepPart *p)
{
    const VesselTree *tree = field->model->sac;
    SEL_ASSERT(tree && node >= 0 && node < tree->node_count, "a sac's node is one of the sacs' tree");
    node = power_walk(tree, x, node, 1 << 20);
    const SweepSac *sac = &field->sac[node];
    Blobby blobs = blobby_of(tree, node);
    *p = (SweepPart){.branch = -1, .share = 1, .sac = node};
    Sym3 h;
    p->f = sac->scale * blobby_hessian(&blobs, x, &p->gradient, &h);
    p->gradient = vec3_scale(p->gradient, sac->scale);
    sym3_add(&p->hessian, sac->scale, &h);
}

// delta of the part with those before it, its gradient and its Hessian.
static double blend_width(const SweepField *field, const SweepPart *p, Vec3 *gradient, Sym3 *hessian)
{
    *gradient = vec3(0, 0, 0), *hessian = (Sym3){0, 0, 0, 0, 0, 0};
    if (p->branch < 0)
        return field->sac[p->sac].delta;
    const SweepFork *fork = &field->fork[p->branch];
    double s = fork->reach > 0 ? p->t / fork->reach : 2, left = 1 - s * s, varied = (1 - SWEEP_LEAST_BLEND) * fork->delta;
    if (!(left > 0))
        return SWEEP_LEAST_BLEND * fork->delta;
    double slope = -4 * varied * left * s / fork->reach, bend = varied * (8 * s * s - 4 * left) / (fork->reach * fork->reach);
    *gradient = vec3_scale(p->t_gradient, slope);
    sym3_add(hessian, slope, &p->t_hessian);
    sym3_add_outer(hessian, bend, p->t_gradient);
    return SWEEP_LEAST_BLEND * fork->delta + varied * left * left;
}

// Blends a part into F; the parts before it are those below `count`.
static void blend_in(const SweepField *field, SweepBlend *m, int count)
{
    SweepPart *p = &m->part[count];
    Vec3 width1;
    Sym3 width2;
    double width = blend_width(field, p, &width1, &width2), d = m->f - p->f, side = d > 0 ? 1 : -1;
    if (!(fabs(d) < 2 * width)) {
        p->share = d > 0 ? 0 : 1;
        if (d > 0)
            return;
        for (int i = 0; i < count; i++)
            m->part[i].share = 0;
        m->f = p->f, m->gradient = p->gradient, m->hessian = p->hessian;
        return;
    }
    double q = fabs(d) / width, slope = side * q * (1 - 0.25 * q), by_width = 2.0 / 3 - q * q * (0.5 - q / 6);
    double x = 0.5 * (1 + slope), y = 0.5 * (1 - slope);
    Vec3 e = vec3_add_scaled(vec3_sub(m->gradient, p->gradient), -side * q, width1);
    m->f = x * m->f + y * p->f + 0.5 * (width * (2.0 / 3 + q * q * (0.5 - q / 12)) - slope * d);
    m->gradient = vec3_add_scaled(vec3_add_scaled(vec3_scale(m->gradient, x), y, p->gradient), 0.5 * by_width, width1);
    Sym3 h = {0, 0, 0, 0, 0, 0};
    sym3_add(&h, x, &m->hessian), sym3_add(&h, y, &p->hessian), sym3_add(&h, 0.5 * by_width, &width2);
    sym3_add_outer(&h, 0.5 * (1 - 0.5 * q) / width, e);
    m->hessian = h;
    for (int i = 0; i < count; i++)
        m->part[i].share *= x;
    p->share = y;
}

void sweep_field_blend(const SweepField *field, SweepPlace place, Vec3 x, SweepBlend *blend)
{
    const SweepView *view;
    double at = 0;
    if (place.branch >= 0) {
        view = &field->view[sweep_field_segment(field, place.branch, place.t)];
        at = fmax(0, fmin(field->curve[place.branch]->length, place.t));
    } else {
        SEL_ASSERT(field->sac && place.sac >= 0 && place.sac < field->model->sac->node_count, "a place on a sac is a node of the sacs' tree");
        view = &field->sac[place.sac].view;
    }
    blend->count = 0;
    for (int i = 0; i < view->count; i++) {
        const SweepCandidate *c = &view->of[i];
        bool own = c->branch == place.branch;
        sweep_field_branch(field, c->branch, x, own ? place.t : c->t + c->slope * at, &blend->part[blend->count++]);
    }
    int sac = place.branch >= 0 ? view->sac : place.sac;
    if (sac >= 0)
        sweep_field_sac(field, sac, x, &blend->part[blend->count++]);
    SEL_ASSERT(blend->count > 0, "a place sees a branch or a sac");
    blend->f = blend->part[0].f, blend->gradient = blend->part[0].gradient, blend->hessian = blend->part[0].hessian;
    for (int i = 1; i < blend->count; i++)
        blend_in(field, blend, i);
    blend->largest = 0;
    for (int i = 1; i < blend->count; i++)
        if (blend->part[i].share > blend->part[blend->largest].share)
            blend->largest = i;
}

// --- Terms ---

void sweep_part_terms(const SweepPart *p, double term[SWEEP_TERMS])
{
    double r = fmax(p->rho, 1e-12), x = p->n / r, y = p->b / r, re = 1, im = 0;
    term[0] = 1;
    for (int k = 1; k <= SWEEP_HARMONICS; k++) {
        double next = re * x - im * y;
        im = re * y + im * x, re = next;
        term[2 * k - 1] = re, term[2 * k] = im;
    }
}

// The swept model: curve, frame, B-splines, field of a branch and blends. Tests: exact shapes; derivatives against differences; convergence of spline and frame;
// partition of unity and linear precision; what is seen from where; mirrored and permuted models; faults of bad models.
#include "geom/blobby.h"
#include "geom/sweep_field.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"
#include "sweep_models.h"

static SweepField *make(const SweepModel *m)
{
    static Faults faults;
    faults_clear(&faults);
    if (!sweep_model_validate(m, "model", &faults))
        print_error("%s\n", faults.text[0]);
    assert_int_equal(faults.count, 0);
    SweepField *f = sweep_field_create(m);
    assert_non_null(f);
    return f;
}

// A bent branch with an elliptic section that twists, and a little of every harmonic.
static void twisting(double t, double length, double *term)
{
    double angle = 2 * t / length * PI;
    term[0] = 1 - 0.2 * t / length;
    term[3] = 0.15 * cos(angle), term[4] = 0.15 * sin(angle);
    for (int k = 3; k <= SWEEP_HARMONICS; k++)
        term[2 * k - 1] = 0.03 / k * cos(k + t), term[2 * k] = 0.03 / k * sin(2 * k + t);
}

static void helix_knots(SweepShape *s, int knots, double radius, double pitch, double turns)
{
    s->knots = knots;
    for (int i = 0; i < knots; i++) {
        double a = 2 * PI * turns * i / (knots - 1);
        s->knot[i] = vec3(radius * cos(a), radius * sin(a), pitch * a / (2 * PI));
    }
}

// --- curve ---

// Position and frame against a circle's: where the knots are twice as dense, the error of the position falls by sixteen (fourth order), that of the direction by
// eight.
static void spline_and_frame_converge(void **state)
{
    (void)state;
    double off[2] = {0}, turned[2] = {0};
    for (int dense = 0; dense < 2; dense++) {
        SweepShape s = {0};
        int knots = dense ? 81 : 41;
        s.knots = knots;
        for (int i = 0; i < knots; i++)
            s.knot[i] = vec3(5 * cos(0.05 * i * (dense ? 1 : 2)), 5 * sin(0.05 * i * (dense ? 1 : 2)), 0);
        SweepCurve *c = sweep_curve_create(knots, s.knot);
        for (int k = 0; k < 200; k++) {
            // the ends are straight (natural spline): their effect fades within a few knots
            double t = c->length * (0.3 + 0.4 * k / 200);
            SweepJet j = sweep_curve_at(c, t);
            Vec3 out = vec3_unit(j.s), up = vec3(0, 0, 1);
            off[dense] = fmax(off[dense], fabs(vec3_norm(j.s) - 5));
            // N starts across the circle's plane and B in it
            turned[dense] = fmax(turned[dense], fmax(vec3_distance(j.n, up), vec3_distance(j.b, out)));
        }
        sweep_curve_free(c);
    }
    print_message("circle: off by %.1e and %.1e mm, frame turned by %.1e and %.1e\n", off[0], off[1], turned[0], turned[1]);
    assert_true(off[1] < off[0] / 12 && turned[1] < turned[0] / 7);
    assert_true(off[1] < 1e-6 && turned[1] < 1e-5);
}

static void curve_derivatives(void **state)
{
    (void)state;
    SweepShape s = {0};
    helix_knots(&s, 60, 6, 9, 1.5);
    SweepCurve *c = sweep_curve_create(s.knots, s.knot);
    double h = 1e-5;
    for (int k = -5; k < 300; k++) {
        double t = 0.2137 * k + 0.05;
        SweepJet a = sweep_curve_at(c, t - h), j = sweep_curve_at(c, t), b = sweep_curve_at(c, t + h);
        const Vec3 *low[] = {&a.s, &a.s1, &a.s2, &a.n, &a.n1, &a.b, &a.b1}, *high[] = {&b.s, &b.s1, &b.s2, &b.n, &b.n1, &b.b, &b.b1},
                   *exact[] = {&j.s1, &j.s2, &j.s3, &j.n1, &j.n2, &j.b1, &j.b2};
        for (int i = 0; i < 7; i++)
            assert_true(vec3_distance(vec3_scale(vec3_sub(*high[i], *low[i]), 1 / (2 * h)), *exact[i]) < 1e-6);
    }
    sweep_curve_free(c);
}

// --- B-splines ---

static void sections_are_precise(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 0.7, .parent = -1, .radius = 1};
    sweep_shape_line(&s, vec3(0, 0, 0), vec3(10, 0, 0), 17);
    SweepModel *m = sweep_model_of(&s, 1);
    uint64_t seed = 3;
    for (int k = 1; k < m->break_count - 1; k++)
        m->break_t[k] += random_in(&seed, -0.3, 0.3);
    for (int k = 0; k < m->row_count; k++)
        m->row[k * SWEEP_TERMS] = 2 - 0.1 * sweep_greville(m->break_t, m->break_count - 1, k);
    SweepField *f = make(m);
    for (double t = 0; t <= 10; t += 0.01) {
        SweepBasis b = sweep_field_basis(f, 0, t);
        double sum = 0, slope = 0, value = 0;
        for (int j = 0; j < 4; j++) {
            assert_true(b.weight[j] >= -1e-15 && b.first + j < m->row_count);
            sum += b.weight[j], slope += b.slope[j], value += b.weight[j] * m->row[(b.first + j) * SWEEP_TERMS];
        }
        assert_near(sum, 1, 1e-14);
        assert_near(slope, 0, 1e-12);
        assert_near(value, 2 - 0.1 * t, 1e-13);
        SweepPart p;
        sweep_field_branch(f, 0, vec3(t, 0.3, 1.1), t + 0.1, &p);
        assert_near(p.t, t, 1e-13);
        assert_near(p.f, 2 - 0.1 * t - sqrt(0.3 * 0.3 + 1.1 * 1.1), 1e-13);
    }
    sweep_field_free(f);
    sweep_model_free(m);
}

// R of a part is the sum of the rows with the weights and terms that a fit uses.
static void basis_gives_the_field(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 1.3, .parent = -1, .radius = 1, .section = twisting};
    helix_knots(&s, 40, 6, 9, 0.7);
    SweepModel *m = sweep_model_of(&s, 1);
    SweepField *f = make(m);
    uint64_t seed = 4;
    for (int trial = 0; trial < 500; trial++) {
        double start = random_in(&seed, -1.5, f->curve[0]->length + 1.5);
        Vec3 x = vec3_add_scaled(sweep_curve_at(f->curve[0], start).s, random_in(&seed, 0.1, 1.2), random_unit_vector(&seed));
        SweepPart p;
        sweep_field_branch(f, 0, x, start, &p);
        SweepBasis b = sweep_field_basis(f, 0, p.t);
        double term[SWEEP_TERMS], sum = 0;
        sweep_part_terms(&p, term);
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < SWEEP_TERMS; k++)
                sum += b.weight[j] * term[k] * m->row[(b.first + j) * SWEEP_TERMS + k];
        assert_near(sum - p.rho, p.f, 1e-12);
    }
    sweep_field_free(f);
    sweep_model_free(m);
}

// --- derivatives ---

typedef struct Worst {
    double gradient, hessian;
    int places;
} Worst;

static void compare_derivatives(const SweepField *f, SweepPlace place, Vec3 x, Worst *worst)
{
    SweepBlend at, low, high;
    double h = 2e-5;
    sweep_field_blend(f, place, x, &at);
    Vec3 slope = {0}, e[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double bend = 0, size = sqrt(sym3_norm2(&at.hessian));
    for (int k = 0; k < 3; k++) {
        sweep_field_blend(f, place, vec3_add_scaled(x, -h, e[k]), &low);
        sweep_field_blend(f, place, vec3_add_scaled(x, h, e[k]), &high);
        slope = vec3_add_scaled(slope, (high.f - low.f) / (2 * h), e[k]);
        Vec3 turn = vec3_scale(vec3_sub(high.gradient, low.gradient), 1 / (2 * h));
        bend = fmax(bend, vec3_distance(turn, sym3_mul_vec(&at.hessian, e[k])));
    }
    // the differences have errors of order h^2 times the third and fourth derivatives, about size^2, and of rounding
    worst->gradient = fmax(worst->gradient, vec3_distance(slope, at.gradient) / (1 + h * h * size * size * 1e6));
    worst->hessian = fmax(worst->hessian, bend / (1 + size));
    worst->places++;
}

// The third derivative of the curve steps at knots, hence differences across a knot are wrong there.
static bool is_off_knots(const SweepField *f, const SweepBlend *at)
{
    for (int i = 0; i < at->count; i++) {
        const SweepPart *p = &at->part[i];
        if (p->branch < 0)
            continue;
        const SweepSegment *s = &f->segment[sweep_field_segment(f, p->branch, p->t)];
        if (p->t - s->from < 2e-4 || s->to - p->t < 2e-4 || p->rho < 0.2)
            return false;
    }
    return true;
}

static void derivatives_of_a_branch(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 1.3, .parent = -1, .radius = 1, .section = twisting};
    helix_knots(&s, 40, 3, 5, 1.2);
    for (int open = 0; open < 2; open++) {
        s.open_start = open;
        SweepModel *m = sweep_model_of(&s, 1);
        SweepField *f = make(m);
        uint64_t seed = 5;
        Worst worst = {0};
        for (int trial = 0; trial < 3000; trial++) {
            double t = random_in(&seed, -1.5, f->curve[0]->length + 1.5);
            Vec3 x = vec3_add_scaled(sweep_curve_at(f->curve[0], t).s, random_in(&seed, 0.3, 1.3), random_unit_vector(&seed));
            SweepBlend at;
            SweepPlace place = {.branch = 0, .t = t};
            sweep_field_blend(f, place, x, &at);
            if (is_off_knots(f, &at))
                compare_derivatives(f, place, x, &worst);
        }
        print_message("%s start, %d places: gradient %.1e, Hessian %.1e\n", open ? "open" : "closed", worst.places, worst.gradient, worst.hessian);
        assert_true(worst.places > 2000 && worst.gradient < 1e-6 && worst.hessian < 1e-5);
        sweep_field_free(f);
        sweep_model_free(m);
    }
}

static void fork_of_two(SweepShape *s, double degrees)
{
    static const double narrow[] = {0.8, 0.6};
    s[0] = (SweepShape){.pitch = 1.1, .parent = -1, .radius = 1, .open_start = true, .section = twisting};
    sweep_shape_line(&s[0], vec3(-8, 0, 0), vec3(10, 0, 0), 30);
    for (int i = 0; i < s[0].knots; i++)
        s[0].knot[i].z = 0.4 * sin(0.3 * s[0].knot[i].x);
    double a = degrees * PI / 180;
    s[1] = (SweepShape){.pitch = 0.9, .parent = 0, .radius = 0.7, .circle = narrow};
    sweep_shape_line(&s[1], s[0].knot[14], vec3_add(s[0].knot[14], vec3(12 * cos(a), 12 * sin(a), 0)), 24);
    double t = 0;
    for (int k = 1; k <= 14; k++)
        t += vec3_distance(s[0].knot[k], s[0].knot[k - 1]);
    s[1].parent_t = t;
}

static void derivatives_at_a_fork(void **state)
{
    (void)state;
    static const double degrees[] = {60, 30, 15};
    for (int k = 0; k < 3; k++) {
        SweepShape s[2];
        fork_of_two(s, degrees[k]);
        SweepModel *m = sweep_model_of(s, 2);
        SweepField *f = make(m);
        uint64_t seed = 6;
        Worst worst = {0};
        int blended = 0;
        for (int trial = 0; trial < 4000; trial++) {
            int branch = trial % 2;
            double t = branch ? random_in(&seed, 0, 6) : s[1].parent_t + random_in(&seed, -4, 5);
            SweepPlace place = {.branch = branch, .t = t};
            Vec3 x = vec3_add_scaled(sweep_curve_at(f->curve[branch], t).s, random_in(&seed, 0.3, 1.3), random_unit_vector(&seed));
            SweepBlend at;
            sweep_field_blend(f, place, x, &at);
            double shares = 0;
            for (int i = 0; i < at.count; i++)
                shares += at.part[i].share;
            assert_near(shares, 1, 1e-12);
            if (!is_off_knots(f, &at))
                continue;
            blended += at.count > 1 && at.part[at.largest].share < 0.999;
            compare_derivatives(f, place, x, &worst);
        }
        print_message("fork of %.0f degrees: %d places, %d blended: gradient %.1e, Hessian %.1e\n", degrees[k], worst.places, blended, worst.gradient,
                      worst.hessian);
        assert_true(blended > 300 && worst.gradient < 1e-6 && worst.hessian < 1e-5);
        sweep_field_free(f);
        sweep_model_free(m);
    }
}

// A sac is seen where its wall is near the tube's, not as far as its blobs reach; elsewhere the field is the tube's own to the bit.
static void a_sac_is_seen_near_its_wall(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 0.2, .parent = -1, .radius = 1, .open_start = true};
    sweep_shape_line(&s, vec3(-6, 0, 0), vec3(6, 0, 0), 61);
    SweepModel *m = sweep_model_of(&s, 1);
    Vec3 center = vec3(0.2, 1.7, 0.3);
    sweep_add_sac(m, 31, center, 1.4);
    SweepField *f = sweep_field_create(m);
    int seen = 0, least = 0;
    assert_true(2 * f->sac[1].delta < f->sac[1].scale);
    for (int i = 0; i < f->first_segment[1]; i++) {
        if (!isfinite(f->segment[i].from) || !isfinite(f->segment[i].to))
            continue;
        double t = 0.5 * (f->segment[i].from + f->segment[i].to), far = same_hypot(t - 6.2, same_hypot(1.7, 0.3) - 1);
        seen += f->view[i].sac >= 0;
        least += far < 1.4;
        assert_true(f->view[i].sac < 0 || far < 3.3);
        assert_true(far > 1.4 || f->view[i].sac >= 0);
        SweepBlend blend;
        sweep_field_blend(f, (SweepPlace){.branch = 0, .t = t, .sac = -1}, vec3(t - 6, 0.7, 0.6), &blend);
        assert_true(far < 3.3 || blend.f == blend.part[0].f);
    }
    print_message("sac: seen from %d segments, its wall reaches %d\n", seen, least);
    assert_true(seen >= least && least > 5);
    sweep_field_free(f);
    sweep_model_free(m);
}

static void derivatives_at_a_sac(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 1.3, .parent = -1, .radius = 1, .section = twisting};
    sweep_shape_line(&s, vec3(-6, 0, 0), vec3(6, 0, 0.5), 25);
    SweepModel *m = sweep_model_of(&s, 1);
    sweep_add_sac(m, 12, vec3(0.2, 1.6, 0.3), 1.4);
    SweepField *f = make(m);
    uint64_t seed = 7;
    Worst worst = {0};
    int blended = 0, from_sac = 0;
    for (int trial = 0; trial < 3000; trial++) {
        double t = 6 + random_in(&seed, -2.5, 2.5);
        Vec3 x = trial % 2 ? vec3_add_scaled(sweep_curve_at(f->curve[0], t).s, random_in(&seed, 0.3, 1.3), random_unit_vector(&seed))
                           : vec3_add_scaled(m->sac->center[1], random_in(&seed, 0.5, 1.7), random_unit_vector(&seed));
        SweepPlace branch = {.branch = 0, .t = t}, sac = {.branch = -1, .sac = 1};
        SweepBlend a, b;
        sweep_field_blend(f, branch, x, &a);
        sweep_field_blend(f, sac, x, &b);
        assert_int_equal(a.count, 2);
        assert_near(a.f, b.f, 1e-12);    // the wall is the same from both sides
        if (!is_off_knots(f, &a))
            continue;
        blended += a.part[a.largest].share < 0.999;
        from_sac += a.part[a.largest].branch < 0;
        compare_derivatives(f, trial % 3 ? branch : sac, x, &worst);
    }
    print_message("sac: %d places, %d blended, %d on the sac: gradient %.1e, Hessian %.1e\n", worst.places, blended, from_sac, worst.gradient, worst.hessian);
    assert_true(blended > 200 && from_sac > 500 && worst.gradient < 1e-6 && worst.hessian < 1e-5);
    sweep_field_free(f);
    sweep_model_free(m);
}

// Where three branches overlap, the wall is the same as seen from each of them.
static void same_wall_from_every_branch(void **state)
{
    (void)state;
    static const double turn[] = {0, 40, 100, 180};  // between the planes of the two children
    for (int scene = 0; scene < 4; scene++) {
        SweepShape s[3];
        fork_of_two(s, 50);
        s[2] = s[1];
        double a = turn[scene] * PI / 180;
        for (int k = 0; k < s[2].knots; k++) {
            Vec3 out = vec3_sub(s[1].knot[k], s[1].knot[0]);
            s[2].knot[k] = vec3_add(s[0].knot[16], vec3(out.x, out.y * cos(a), out.y * sin(a)));
        }
        for (int k = 15; k <= 16; k++)
            s[2].parent_t += vec3_distance(s[0].knot[k], s[0].knot[k - 1]);
        SweepModel *m = sweep_model_of(s, 3);
        SweepField *f = make(m);
        assert_int_equal(f->crowded, 0);
        uint64_t seed = 9;
        double worst = 0;
        int compared = 0;
        for (int trial = 0; trial < 6000; trial++) {
            int branch = trial % 3;
            double t = branch ? random_in(&seed, 0, 8) : s[1].parent_t + random_in(&seed, -3, 6);
            Vec3 x = vec3_add_scaled(sweep_curve_at(f->curve[branch], t).s, random_in(&seed, 0.5, 1.1), random_unit_vector(&seed));
            SweepBlend at, other;
            sweep_field_blend(f, (SweepPlace){.branch = branch, .t = t}, x, &at);
            if (fabs(at.f) > 0.15 || at.part[at.largest].branch != branch)
                continue;
            for (int i = 0; i < at.count; i++) {
                if (at.part[i].share < 1e-6 || i == at.largest)
                    continue;
                sweep_field_blend(f, (SweepPlace){.branch = at.part[i].branch, .t = at.part[i].t}, x, &other);
                worst = fmax(worst, fabs(other.f - at.f));
                compared++;
            }
        }
        print_message("children %.0f degrees apart: %d places blended, seen from two branches, differ by %.1e\n", turn[scene], compared, worst);
        assert_true(compared > 300 && worst < 1e-12);
        sweep_field_free(f);
        sweep_model_free(m);
    }
}

// --- bad models ---

static int faults_of(const SweepModel *m)
{
    static Faults faults;
    faults_clear(&faults);
    assert_true(sweep_model_validate(m, "model", &faults) == (faults.count == 0));
    return faults.count;
}

static void faults_are_found(void **state)
{
    (void)state;
    SweepShape s[2];
    fork_of_two(s, 40);
    assert_null(sweep_model_create(0, 2, 2, 4));
    assert_null(sweep_model_create(1, 1 << 30, 2, 4));
    SweepModel *m = sweep_model_of(s, 2), good = *m;
    SweepBranch branch = m->branch[1];
    assert_int_equal(faults_of(m), 0);
#define EXPECT_FAULT(place, value)                                                                                                                             \
    do {                                                                                                                                                       \
        unsigned char kept[sizeof(place)];                                                                                                                     \
        memcpy(kept, &(place), sizeof kept);                                                                                                                   \
        place = value;                                                                                                                                         \
        assert_true(faults_of(m) > 0);                                                                                                                         \
        memcpy(&(place), kept, sizeof kept);                                                                                                                   \
        assert_int_equal(faults_of(m), 0);                                                                                                                     \
    } while (0)
    EXPECT_FAULT(m->knot[3].x, NAN);
    EXPECT_FAULT(m->knot_node[2], -1);
    EXPECT_FAULT(m->break_t[1], 1e5);
    EXPECT_FAULT(m->break_t[0], 0.1);
    EXPECT_FAULT(m->row[5], INFINITY);
    EXPECT_FAULT(m->row[SWEEP_TERMS], -1);
    EXPECT_FAULT(m->blend, -1);
    EXPECT_FAULT(m->branch[1].parent, 1);
    EXPECT_FAULT(m->branch[1].parent, -1);
    EXPECT_FAULT(m->branch[0].parent, 0);
    EXPECT_FAULT(m->branch[1].parent_t, 1e3);
    EXPECT_FAULT(m->branch[0].radius, 0);
    EXPECT_FAULT(m->branch[1].first_knot, 7);
    EXPECT_FAULT(m->branch[1].knot_count, 1 << 28);
    EXPECT_FAULT(m->branch[1].break_count, 1);
    EXPECT_FAULT(m->row_count, 3);
    m->knot[4] = m->knot[3];
    assert_true(faults_of(m) > 0);
    assert_memory_equal(&m->branch[1], &branch, sizeof branch);
    assert_int_equal(m->row_count, good.row_count);
    sweep_model_free(m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spline_and_frame_converge),   cmocka_unit_test(curve_derivatives),           cmocka_unit_test(sections_are_precise),
        cmocka_unit_test(basis_gives_the_field),       cmocka_unit_test(derivatives_of_a_branch),     cmocka_unit_test(derivatives_at_a_fork),
        cmocka_unit_test(derivatives_at_a_sac),        cmocka_unit_test(a_sac_is_seen_near_its_wall), cmocka_unit_test(faults_are_found),
        cmocka_unit_test(same_wall_from_every_branch),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

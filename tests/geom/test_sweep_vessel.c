// Contact with the swept model. A foot is the closest point on the wall. Tests: exact walls; lanes compared with the plain evaluation; derivatives of the gap;
// feet that are followed compared with brute force; forks, domes, kissing tubes, the inlet, a sac; bits on every instruction set; mirrored and permuted models;
// bad points; no heap calls.
#include "geom/sweep_feet.h"
#include "geom/sweep_vessel.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../heap_calls.h"
#include "near.h"
#include "sweep_models.h"

static Vessel *make(const SweepModel *m, int isa)
{
    static Faults faults;
    faults_clear(&faults);
    if (!sweep_model_validate(m, "model", &faults))
        print_error("%s\n", faults.text[0]);
    assert_int_equal(faults.count, 0);
    Vessel *v = sweep_vessel_create_with(m, isa);
    assert_non_null(v);
    return v;
}

static VesselHit ask(const Vessel *v, Vec3 x, VesselMemory *memory)
{
    VesselMemory fresh = {.node = -1};
    VesselHit hit;
    vessel_query(v, 1, &x, 100, memory ? memory : &fresh, &hit);
    return hit;
}

static bool same_hit(const VesselHit *a, const VesselHit *b)
{
    return memcmp(&a->gap, &b->gap, sizeof a->gap) == 0 && memcmp(&a->normal, &b->normal, sizeof a->normal) == 0 &&
           memcmp(&a->hessian, &b->hessian, sizeof a->hessian) == 0 && a->node == b->node && a->flags == b->flags;
}

// --- shapes ---

static void star(double t, double length, double *term)
{
    double angle = 2 * t / length * PI;
    term[0] = 1 - 0.2 * t / length;
    term[3] = 0.15 * cos(angle), term[4] = 0.15 * sin(angle);
    for (int k = 3; k <= 5; k++)
        term[2 * k - 1] = 0.03 / k * cos(k + t), term[2 * k] = 0.03 / k * sin(2 * k + t);
}

static void helix(SweepShape *s)
{
    *s = (SweepShape){.pitch = 1, .parent = -1, .radius = 1, .section = star, .open_start = true, .knots = 60};
    for (int i = 0; i < s->knots; i++)
        s->knot[i] = vec3(6 * cos(0.15 * i), 6 * sin(0.15 * i), 0.18 * i);
}

// A star-shaped parent along x, from which a round child springs.
static void fork_of_two(SweepShape *s, double degrees)
{
    static const double narrow[] = {0.8, 0.6};
    s[0] = (SweepShape){.pitch = 1.1, .parent = -1, .radius = 1, .open_start = true, .section = star};
    sweep_shape_line(&s[0], vec3(-8, 0, 0), vec3(10, 0, 0), 30);
    for (int i = 0; i < s[0].knots; i++)
        s[0].knot[i].z = 0.4 * sin(0.3 * s[0].knot[i].x);
    double a = degrees * PI / 180;
    s[1] = (SweepShape){.pitch = 0.9, .parent = 0, .radius = 0.7, .circle = narrow};
    sweep_shape_line(&s[1], s[0].knot[14], vec3_add(s[0].knot[14], vec3(12 * cos(a), 12 * sin(a), 0)), 24);
    for (int k = 1; k <= 14; k++)
        s[1].parent_t += vec3_distance(s[0].knot[k], s[0].knot[k - 1]);
}

// Moves x by a step of a random walk that stays within 0.3 mm of the inside of a branch.
static void wander(const SweepField *f, uint64_t *seed, int branch, double *t, Vec3 *x, double stride)
{
    Vec3 y = vec3_add_scaled(*x, stride, random_unit_vector(seed));
    SweepPart p;
    sweep_field_branch(f, branch, y, *t, &p);
    if (p.f < -0.3 || p.t < 0.5 || p.t > f->curve[branch]->length - 0.5)
        return;
    *x = y, *t = p.t;
}

// --- exact walls ---

static void cylinder_with_domes(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 2, .parent = -1, .radius = 1.5};
    sweep_shape_line(&s, vec3(0, 0, 0), vec3(0, 0, 20), 12);
    SweepModel *m = sweep_model_of(&s, 1);
    Vessel *v = make(m, 0);
    uint64_t seed = 1;
    for (int trial = 0; trial < 2000; trial++) {
        double angle = random_in(&seed, 0, 6), out = random_in(&seed, 0.2, 1.9), z = random_in(&seed, -1.2, 21.2);
        Vec3 x = {out * cos(angle), out * sin(angle), z}, axis = {0, 0, fmax(0, fmin(20, z))}, away = vec3_sub(x, axis);
        VesselHit hit = ask(v, x, NULL);
        assert_int_equal(hit.flags, 0);
        assert_near(hit.gap, 1.5 - vec3_norm(away), 1e-9);
        assert_true(vec3_distance(hit.normal, vec3_negate(vec3_unit(away))) < 1e-6);
        Vec3 around = vec3_unit(vec3_cross(vec3(0, 0, 1), away));
        assert_near(sym3_quadratic(&hit.hessian, around), -1 / vec3_norm(away), 1e-5 / vec3_norm(away));
    }
    // on the axis and at the centre of a dome's sphere every foot is as near
    assert_near(ask(v, vec3(0, 0, 10), NULL).gap, 1.5, 1e-6);
    assert_near(ask(v, vec3(0, 0, 20), NULL).gap, 1.5, 1e-6);
    v->destroy(v);
    sweep_model_free(m);
}

static void cone(void **state)
{
    (void)state;
    static const double ends[] = {2, 1};
    SweepShape s = {.pitch = 2, .parent = -1, .radius = 1.5, .circle = ends};
    sweep_shape_line(&s, vec3(0, 0, 0), vec3(20, 0, 0), 12);
    SweepModel *m = sweep_model_of(&s, 1);
    Vessel *v = make(m, 0);
    uint64_t seed = 2;
    double slope = 1.0 / 20, cosine = 1 / sqrt(1 + slope * slope);
    for (int trial = 0; trial < 1000; trial++) {
        double angle = random_in(&seed, 0, 6), out = random_in(&seed, 0.3, 2.1), along = random_in(&seed, 3, 17);
        VesselHit hit = ask(v, vec3(along, out * cos(angle), out * sin(angle)), NULL);
        assert_int_equal(hit.flags, 0);
        assert_near(hit.gap, (2 - slope * along - out) * cosine, 1e-9);
    }
    v->destroy(v);
    sweep_model_free(m);
}

// A round tube along a circle: where the knots are twice as dense, the error falls by sixteen.
static void torus_converges(void **state)
{
    (void)state;
    double worst[2] = {0};
    for (int dense = 0; dense < 2; dense++) {
        SweepShape s = {.pitch = 2, .parent = -1, .radius = 1, .knots = dense ? 101 : 51};
        for (int i = 0; i < s.knots; i++) {
            double a = 0.06 * i / (dense ? 2 : 1) * 2;
            s.knot[i] = vec3(4 * cos(a), 4 * sin(a), 0);
        }
        SweepModel *m = sweep_model_of(&s, 1);
        Vessel *v = make(m, 0);
        uint64_t seed = 3;
        for (int trial = 0; trial < 1000; trial++) {
            double a = random_in(&seed, 1.5, 4.5), angle = random_in(&seed, 0, 6.3), out = random_in(&seed, 0.3, 1.2);
            Vec3 x = {(4 + out * cos(angle)) * cos(a), (4 + out * cos(angle)) * sin(a), out * sin(angle)};
            VesselHit hit = ask(v, x, NULL);
            assert_int_equal(hit.flags, 0);
            worst[dense] = fmax(worst[dense], fabs(hit.gap - (1 - out)));
        }
        v->destroy(v);
        sweep_model_free(m);
    }
    print_message("torus: gap off by %.1e and %.1e mm\n", worst[0], worst[1]);
    assert_true(worst[1] < worst[0] / 12 && worst[1] < 2e-6);
}

// --- lanes ---

// The field in lanes is that of the plain evaluation: on bends, domes, at forks, whatever else is in the block.
static void lanes_are_the_plain_field(void **state)
{
    (void)state;
    SweepShape s[2];
    fork_of_two(s, 40);
    SweepModel *m = sweep_model_of(s, 2);
    SweepField *f = sweep_field_create(m);
    uint64_t seed = 4;
    double worst = 0;
    int forks = 0, domes = 0;
    for (int isa = 1; isa <= 3; isa++) {
        SweepFeet feet = {.field = f, .kernels = sweep_kernels(isa), .harmonics = 5};
        for (int trial = 0; trial < 600; trial++) {
            static SweepBlock b;
            SweepPlace place[FOOT_BLOCK];
            Vec3 x[FOOT_BLOCK];
            for (int i = 0; i < FOOT_BLOCK; i++) {
                int branch = i % 2;
                double t = branch ? random_in(&seed, -0.5, 6) : s[1].parent_t + random_in(&seed, -4, 5);
                t = trial % 5 == 0 ? f->curve[branch]->length + random_in(&seed, 0, 0.7) : t;
                place[i] = (SweepPlace){.branch = branch, .t = t};
                x[i] = vec3_add_scaled(sweep_curve_at(f->curve[branch], t).s, random_in(&seed, 0.2, 1.3), random_unit_vector(&seed));
                sweep_block_place(&feet, &b, i, sweep_field_segment(f, branch, t), -1, t);
                b.foot.at.x[i] = x[i].x, b.foot.at.y[i] = x[i].y, b.foot.at.z[i] = x[i].z;
            }
            sweep_block_sample(&feet, &b, FOOT_ALL);
            for (int i = 0; i < FOOT_BLOCK; i++) {
                SweepBlend plain;
                sweep_field_blend(f, place[i], x[i], &plain);
                const FootSample *at = &b.foot.at;
                Vec3 g = {at->gx[i], at->gy[i], at->gz[i]};
                Sym3 h = {at->hxx[i] - plain.hessian.xx, at->hxy[i] - plain.hessian.xy, at->hxz[i] - plain.hessian.xz,
                          at->hyy[i] - plain.hessian.yy, at->hyz[i] - plain.hessian.yz, at->hzz[i] - plain.hessian.zz};
                double size = 1 + sqrt(sym3_norm2(&plain.hessian));
                worst = fmax(worst, fabs(at->f[i] - plain.f));
                worst = fmax(worst, vec3_distance(g, plain.gradient) / size);
                worst = fmax(worst, sqrt(sym3_norm2(&h)) / (size * size));
                forks += plain.part[plain.largest].share < 0.99;
                domes += plain.part[plain.largest].w != 0;
            }
        }
    }
    print_message("%d blended, %d in domes: lanes differ by %.1e\n", forks, domes, worst);
    assert_true(forks > 500 && domes > 500 && worst < 1e-9);
    sweep_field_free(f);
    sweep_model_free(m);
}

// Beyond the focal line of a bend, plain Newton steps of t leap over the foot and back: the lanes shorten them as the plain search does, and end where it does.
static void t_settles_beyond_the_focal_line(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 1, .parent = -1, .radius = 0.8, .knots = 60};
    for (int i = 0; i < s.knots; i++)
        s.knot[i] = vec3(0.4 * i, 2 * sin(0.6 * i), 0.5 * sin(0.17 * i));
    SweepModel *m = sweep_model_of(&s, 1);
    SweepField *f = sweep_field_create(m);
    uint64_t seed = 6;
    double worst = 0;
    int beyond = 0;
    for (int isa = 1; isa <= 3; isa++) {
        SweepFeet feet = {.field = f, .kernels = sweep_kernels(isa), .harmonics = 1};
        for (int trial = 0; trial < 2000; trial++) {
            static SweepBlock b;
            double start[FOOT_BLOCK];
            Vec3 x[FOOT_BLOCK];
            sweep_block_begin(&b);
            for (int i = 0; i < FOOT_BLOCK; i++) {
                double t = random_in(&seed, 0, f->curve[0]->length);
                start[i] = t + random_in(&seed, -1, 1);
                x[i] = vec3_add_scaled(sweep_curve_at(f->curve[0], t).s, random_in(&seed, 0, 3), random_unit_vector(&seed));
                sweep_block_place(&feet, &b, i, sweep_field_segment(f, 0, start[i]), -1, start[i]);
                b.foot.at.x[i] = x[i].x, b.foot.at.y[i] = x[i].y, b.foot.at.z[i] = x[i].z;
            }
            if (trial % 2)
                sweep_block_slope(&feet, &b, FOOT_ALL);
            else
                sweep_block_sample(&feet, &b, FOOT_ALL);
            for (int i = 0; i < FOOT_BLOCK; i++) {
                SweepPart plain;
                sweep_field_branch(f, 0, x[i], start[i], &plain);
                SweepJet j = sweep_curve_at(f->curve[0], start[i]);
                beyond += vec3_norm2(j.s1) < vec3_dot(vec3_sub(x[i], j.s), j.s2);
                worst = fmax(worst, fabs(b.foot.at.f[i] - plain.f));
            }
        }
    }
    print_message("%d of 48,000 starts beyond the focal line: lanes differ by %.1e\n", beyond, worst);
    assert_true(beyond > 1000 && worst < 1e-9);
    sweep_field_free(f);
    sweep_model_free(m);
}

// --- derivatives ---

static void derivatives_of_the_gap(void **state)
{
    (void)state;
    SweepShape s[2];
    fork_of_two(s, 50);
    SweepModel *m = sweep_model_of(s, 2);
    SweepField *f = sweep_field_create(m);
    Vessel *v = make(m, 0);
    uint64_t seed = 5;
    int checked = 0;
    double worst_normal = 0, worst_bend = 0, h = 1e-4;
    for (int trial = 0; trial < 1200; trial++) {
        int branch = trial % 2;
        double t = branch ? random_in(&seed, 0.5, 6) : s[1].parent_t + random_in(&seed, -4, 5);
        Vec3 x = vec3_add_scaled(sweep_curve_at(f->curve[branch], t).s, random_in(&seed, 0.5, 1.2), random_unit_vector(&seed));
        VesselMemory memory = {.node = -1};
        for (int k = 0; k < 2; k++)    // the Hessian is that of the last evaluation; in a second query it is that of the foot
            ask(v, x, &memory);
        VesselHit hit = ask(v, x, &memory);
        double bend = sqrt(sym3_norm2(&hit.hessian));
        if (fabs(hit.gap) > 0.4 || bend > 5 || hit.flags)
            continue;
        Vec3 slope = {0, 0, 0};
        bool same = true;
        double bends = 0;
        for (int k = 0; k < 3 && same; k++) {
            Vec3 e = vec3(k == 0, k == 1, k == 2);
            VesselHit side[2];
            for (int i = 0; i < 2; i++) {
                VesselMemory near = memory;
                Vec3 y = vec3_add_scaled(x, i ? -h : h, e);
                ask(v, y, &near);
                side[i] = ask(v, y, &near);
                same &= vec3_distance(near.foot, memory.foot) < 0.01;
            }
            slope = vec3_add_scaled(slope, (side[0].gap - side[1].gap) / (2 * h), e);
            Vec3 turn = vec3_scale(vec3_sub(side[0].normal, side[1].normal), 1 / (2 * h));
            bends = fmax(bends, vec3_distance(turn, sym3_mul_vec(&hit.hessian, e)) / (1 + bend));
        }
        if (!same)
            continue;
        checked++;
        worst_normal = fmax(worst_normal, vec3_distance(slope, hit.normal));
        worst_bend = fmax(worst_bend, bends);
        assert_true(vec3_norm(sym3_mul_vec(&hit.hessian, hit.normal)) < 1e-9 * (1 + bend));
    }
    print_message("%d places: gradient of the gap is the normal to %.1e, of the normal the Hessian to %.1e\n", checked, worst_normal, worst_bend);
    assert_true(checked > 300 && worst_normal < 1e-6 && worst_bend < 1e-5);
    v->destroy(v);
    sweep_field_free(f);
    sweep_model_free(m);
}

// --- feet ---

enum { CLOUD_MOST = 60000 };
typedef struct Cloud {
    int count;
    Vec3 at[CLOUD_MOST];
} Cloud;

// Points of the wall around a place: on rays from the curves, then down to F = 0.
static void fill_cloud(const SweepField *f, int branch, double from, double to, Cloud *cloud)
{
    enum { AROUND = 96 };
    for (double t = from; t < to; t += 0.08) {
        SweepJet j = sweep_curve_at(f->curve[branch], t);
        for (int k = 0; k < AROUND && cloud->count < CLOUD_MOST; k++) {
            Vec3 way = vec3_add(vec3_scale(j.n, cos(2 * PI * k / AROUND)), vec3_scale(j.b, sin(2 * PI * k / AROUND)));
            SweepPart p;
            Vec3 x = j.s;
            for (int i = 0; i < 8; i++) {
                x = vec3_add_scaled(x, i == 0 ? 0.6 : p.f, way);
                sweep_field_branch(f, branch, x, t, &p);
            }
            SweepBlend blend;
            for (int i = 0; i < 12; i++) {
                sweep_field_blend(f, (SweepPlace){.branch = branch, .t = t}, x, &blend);
                if (fabs(blend.f) < 1e-10) {
                    cloud->at[cloud->count++] = x;
                    break;
                }
                if (i == 0 && blend.f > 0.35)
                    break;   // inside the other branch
                x = vec3_add_scaled(x, -blend.f / vec3_norm2(blend.gradient), blend.gradient);
            }
        }
    }
}

static double nearest_in(const Cloud *cloud, Vec3 x)
{
    double best = HUGE_VAL;
    for (int i = 0; i < cloud->count; i++)
        best = fmin(best, vec3_norm2(vec3_sub(x, cloud->at[i])));
    return sqrt(best);
}

typedef struct Tally {
    int asked, unsure, compared, off, far_off;
    double worst, jump;
} Tally;

// Random walks of points inside the model and up to 0.3 mm outside; a sample of the answers is compared with the cloud, whose points are on the wall: none may
// be nearer than the foot. A gap changes by no more than the point moves.
static void walk(const SweepModel *m, const SweepField *f, const Cloud *cloud, int points, int steps, double from, Tally *tally)
{
    enum { MOST = 64 };
    Vessel *v = make(m, 0);
    Vec3 x[MOST], last_x[MOST];
    double t[MOST], last[MOST];
    VesselMemory memory[MOST];
    VesselHit hit[MOST];
    uint64_t seed = 6;
    for (int i = 0; i < points; i++) {
        int branch = m->branch_count > 1 ? i % 2 : 0;
        t[i] = (branch ? 0.7 : from) + 6.0 * i / points;
        x[i] = vec3_add_scaled(sweep_curve_at(f->curve[branch], t[i]).s, 0.3, random_unit_vector(&seed));
        memory[i] = (VesselMemory){.node = -1};
        last[i] = HUGE_VAL;
    }
    for (int step = 0; step < steps; step++) {
        for (int i = 0; i < points; i++)
            wander(f, &seed, m->branch_count > 1 ? i % 2 : 0, &t[i], &x[i], 0.05);
        vessel_query(v, points, x, 10, memory, hit);
        for (int i = 0; i < points; i++) {
            tally->asked++;
            tally->unsure += (hit[i].flags & VESSEL_UNSURE) != 0;
            if (last[i] < HUGE_VAL)
                tally->jump = fmax(tally->jump, fabs(hit[i].gap - last[i]) - vec3_distance(x[i], last_x[i]));
            last[i] = hit[i].gap, last_x[i] = x[i];
            if ((step + i) % 97 != 0 || fabs(hit[i].gap) > 0.75)
                continue;
            double more = fabs(hit[i].gap) - nearest_in(cloud, x[i]);
            tally->compared++;
            tally->off += more > 1e-6;
            tally->far_off += more > 0.02;
            tally->worst = fmax(tally->worst, more);
        }
    }
    v->destroy(v);
}

static void feet_are_nearest(void **state)
{
    (void)state;
    static const double degrees[] = {0, 60, 30, 15};     // 0: a helix without fork
    static Cloud cloud;
    for (int scene = 0; scene < 4; scene++) {
        SweepShape s[2];
        if (scene == 0)
            helix(&s[0]);
        else
            fork_of_two(s, degrees[scene]);
        SweepModel *m = sweep_model_of(s, scene == 0 ? 1 : 2);
        SweepField *f = sweep_field_create(m);
        double from = scene == 0 ? 10 : s[1].parent_t - 2;
        Tally tally = {0};
        cloud.count = 0;
        fill_cloud(f, 0, from - 3, from + 12, &cloud);
        if (scene > 0)
            fill_cloud(f, 1, -0.5, 11, &cloud);
        walk(m, f, &cloud, 40, 700, from, &tally);
        print_message("%.0f degrees: %d answers, %d unsure; %d compared, %d farther than the cloud, %d by 0.02 mm, %.4f at most; jump %.4f\n", degrees[scene],
                      tally.asked, tally.unsure, tally.compared, tally.off, tally.far_off, tally.worst, tally.jump);
        assert_true(tally.asked > 25000 && tally.unsure == 0 && tally.compared > 100);
        assert_true(tally.far_off == 0 && tally.off <= 2 && tally.jump < 0.02);
        sweep_field_free(f);
        sweep_model_free(m);
    }
}

// A sac at the side of a tube: points walk between both. The wall is where F = 0 from either side.
static void sac_beside_a_tube(void **state)
{
    (void)state;
    enum { POINTS = 24, STEPS = 600 };
    static Cloud cloud;
    SweepShape s = {.pitch = 1.3, .parent = -1, .radius = 1, .section = star, .open_start = true};
    sweep_shape_line(&s, vec3(-6, 0, 0), vec3(6, 0, 0.5), 25);
    SweepModel *m = sweep_model_of(&s, 1);
    sweep_add_sac(m, 12, vec3(0.2, 1.7, 0.3), 1.4);
    SweepField *f = sweep_field_create(m);
    Vessel *v = make(m, 0);
    cloud.count = 0;
    fill_cloud(f, 0, 2, 10, &cloud);
    uint64_t seed = 10;
    for (int k = 0; k < 12000; k++) {
        Vec3 x = vec3_add_scaled(m->sac->center[1], 1.4, random_unit_vector(&seed));
        SweepBlend blend;
        for (int i = 0; i < 12; i++) {
            sweep_field_blend(f, (SweepPlace){.branch = -1, .sac = 1}, x, &blend);
            if (fabs(blend.f) < 1e-10)
                cloud.at[cloud.count++] = x;
            if (fabs(blend.f) < 1e-10 || blend.f > 0.35)
                break;
            x = vec3_add_scaled(x, -blend.f / vec3_norm2(blend.gradient), blend.gradient);
        }
    }
    Vec3 x[POINTS], last_x[POINTS];
    VesselMemory memory[POINTS];
    VesselHit hit[POINTS], last[POINTS];
    int unsure = 0, on_sac = 0, compared = 0, off = 0;
    double worst = 0, jump = 0;
    for (int i = 0; i < POINTS; i++) {
        x[i] = vec3(-2 + 4.0 * i / POINTS, i % 2 ? 1.7 : 0.2, 0.2);
        memory[i] = (VesselMemory){.node = -1};
    }
    for (int step = 0; step < STEPS; step++) {
        for (int i = 0; i < POINTS && step > 0; i++) {
            Vec3 y = vec3_add_scaled(x[i], 0.06, random_unit_vector(&seed));
            SweepBlend blend;
            sweep_field_blend(f, (SweepPlace){.branch = 0, .t = 6 + y.x}, y, &blend);
            last_x[i] = x[i], last[i] = hit[i];
            if (blend.f > -0.2 && fabs(y.x) < 3)
                x[i] = y;
        }
        vessel_query(v, POINTS, x, 10, memory, hit);
        for (int i = 0; i < POINTS; i++) {
            unsure += (hit[i].flags & VESSEL_UNSURE) != 0;
            on_sac += hit[i].node == m->sac_node[1];
            if (step > 0)
                jump = fmax(jump, fabs(hit[i].gap - last[i].gap) - vec3_distance(x[i], last_x[i]));
            if ((step + i) % 41 != 0 || fabs(hit[i].gap) > 0.9)
                continue;
            double more = fabs(hit[i].gap) - nearest_in(&cloud, x[i]);
            compared++;
            off += more > 0.02;
            worst = fmax(worst, more);
        }
    }
    print_message("sac: %d answers, %d on it, %d unsure; %d compared, %d farther than the cloud by 0.02 mm, %.4f at most; jump %.4f\n", POINTS * STEPS, on_sac,
                  unsure, compared, off, worst, jump);
    assert_true(on_sac > 2000 && unsure == 0 && compared > 100 && off == 0 && jump < 0.02);
    assert_int_equal(v->locate(v, m->sac->center[1], 12), m->sac_node[1]);
    assert_int_equal(v->locate(v, m->sac->center[1], -1), m->sac_node[1]);
    assert_int_equal(v->locate(v, vec3(3, 0, 0), m->sac_node[1]), 18);
    v->destroy(v);
    sweep_field_free(f);
    sweep_model_free(m);
}

// Two branches that spring from one parent and touch farther on: there, each is as if the other did not exist.
static void kissing_tubes_keep_apart(void **state)
{
    (void)state;
    SweepShape s[3] = {
        {.pitch = 2, .parent = -1, .radius = 1, .open_start = true}, {.pitch = 1.5, .parent = 0, .radius = 0.8}, {.pitch = 1.5, .parent = 0, .radius = 0.8}};
    sweep_shape_line(&s[0], vec3(-6, 0, 0), vec3(12, 0, 0), 19);
    for (int side = 0; side < 2; side++) {
        SweepShape *c = &s[1 + side];
        double at = side ? 6 : 0;
        c->knots = 40;
        c->parent_t = at + 6;
        // out, towards the other, and beside it with 0.05 mm between the walls
        for (int i = 0; i < 40; i++) {
            double y = 0.4 * i, bend = 0.5 * (1 - cos(PI * fmin(1, y / 9)));
            c->knot[i] = vec3(at + (side ? -1 : 1) * bend * (3 - 0.825), y, 0);
        }
    }
    SweepModel *m = sweep_model_of(s, 3), *alone = sweep_model_of(s, 2);
    Vessel *v = make(m, 0), *w = make(alone, 0);
    double worst = 0, least = HUGE_VAL;
    for (int k = 0; k < 100; k++) {
        Vec3 x = {3 - 0.825 + 0.6, 10 + 0.03 * k, 0.1};
        VesselMemory a = {.node = 19 + 20}, b = {.node = 19 + 20};
        VesselHit both = ask(v, x, &a), one = ask(w, x, &b);
        assert_int_equal(both.flags | one.flags, 0);
        worst = fmax(worst, fabs(both.gap - one.gap));
        least = fmin(least, one.gap);
    }
    print_message("kissing tubes: the wall differs by %.1e mm from one without neighbour\n", worst);
    assert_true(least > 0.1 && worst < 1e-12);
    v->destroy(v), w->destroy(w);
    sweep_model_free(m), sweep_model_free(alone);
}

static void inlet_is_open(void **state)
{
    (void)state;
    SweepShape s;
    helix(&s);
    SweepModel *m = sweep_model_of(&s, 1);
    Vessel *v = make(m, 0);
    SweepCurve *c = sweep_curve_create(s.knots, s.knot);
    Vec3 p, d;
    assert_true(v->inlet(v, &p, &d) && vec3_distance(p, s.knot[0]) < 1e-12);
    SweepJet j = sweep_curve_at(c, 0);
    VesselMemory memory = {.node = 0};
    VesselHit last = {.gap = HUGE_VAL};
    for (double z = 3; z >= -6; z -= 0.01) {
        Vec3 x = vec3_add_scaled(sweep_curve_at(c, z).s, 0.7, z < 0 ? j.n : sweep_curve_at(c, z).n);
        VesselHit hit = ask(v, x, &memory);
        assert_int_equal(hit.flags, vec3_dot(vec3_sub(x, p), d) < 0 ? VESSEL_BEYOND : 0);
        if (last.gap < 1)    // no step at the plane
            assert_true(fabs(hit.gap - last.gap) < 0.01 && vec3_distance(hit.normal, last.normal) < 0.05);
        last = hit;
    }
    // far upstream it is a cylinder
    VesselHit near = ask(v, vec3_add_scaled(vec3_add_scaled(p, -5, d), 0.5, j.b), &memory),
              far = ask(v, vec3_add_scaled(vec3_add_scaled(p, -9, d), 0.5, j.b), NULL);
    assert_near(near.gap, far.gap, 1e-9);
    assert_near(vec3_dot(far.normal, d), 0, 1e-9);
    sweep_curve_free(c);
    v->destroy(v);
    sweep_model_free(m);
}

// --- bits ---

// The same on every instruction set, alone as in company, and repeated.
static void same_bits(void **state)
{
    (void)state;
    enum { POINTS = 45, SETS = 4 };
    SweepShape s[2];
    fork_of_two(s, 35);
    SweepModel *m = sweep_model_of(s, 2);
    SweepField *f = sweep_field_create(m);
    Vessel *v[SETS] = {make(m, 1), make(m, 2), make(m, 3), make(m, 0)};
    static VesselMemory memory[SETS][POINTS];
    VesselHit hit[SETS][POINTS];
    Vec3 x[POINTS];
    double t[POINTS];
    uint64_t seed = 7;
    for (int k = 0; k < POINTS; k++) {
        t[k] = k % 2 ? 0.7 + 0.1 * k : s[1].parent_t - 2 + 0.1 * k;
        x[k] = vec3_add_scaled(sweep_curve_at(f->curve[k % 2], t[k]).s, 0.4, random_unit_vector(&seed));
        for (int i = 0; i < SETS; i++)
            memory[i][k] = (VesselMemory){.node = -1};
    }
    for (int step = 0; step < 150; step++) {
        for (int k = 0; k < POINTS; k++)
            wander(f, &seed, k % 2, &t[k], &x[k], k % 3 == 0 ? 0.3 : 0.05);
        for (int i = 0; i < SETS - 1; i++)
            vessel_query(v[i], POINTS, x, 0.5, memory[i], hit[i]);
        for (int k = POINTS - 1; k >= 0; k--)
            vessel_query(v[SETS - 1], 1, &x[k], 0.5, &memory[SETS - 1][k], &hit[SETS - 1][k]);
        for (int k = 0; k < POINTS; k++)
            for (int i = 1; i < SETS; i++) {
                assert_true(same_hit(&hit[0][k], &hit[i][k]));
                assert_true(memory[0][k].trust == memory[i][k].trust && memory[0][k].sweep.open == memory[i][k].sweep.open);
            }
    }
    for (int i = 0; i < SETS; i++)
        v[i]->destroy(v[i]);
    sweep_field_free(f);
    sweep_model_free(m);
}

// The coordinate axes x -> y -> z -> x: a rotation that all steps commute with. And a mirrored model, whose sines change their sign.
static Vec3 permuted(Vec3 v) { return vec3(v.z, v.x, v.y); }
static Vec3 mirrored(Vec3 v) { return vec3(v.x, v.y, -v.z); }

static void moved_and_mirrored(void **state)
{
    (void)state;
    SweepShape s[2];
    fork_of_two(s, 45);
    SweepModel *m[3] = {sweep_model_of(s, 2), sweep_model_of(s, 2), sweep_model_of(s, 2)};
    for (int k = 0; k < m[0]->knot_count; k++) {
        // tilted: an axis in a coordinate plane has no mirrored frame
        Vec3 p = m[0]->knot[k];
        p.z += 0.21 * p.x;
        m[0]->knot[k] = p, m[1]->knot[k] = permuted(p), m[2]->knot[k] = mirrored(p);
    }
    for (int i = 0; i < 3; i++) {
        for (int b = 0; b < 2; b++) {
            SweepBranch *branch = &m[i]->branch[b];
            double *t = m[i]->break_t + branch->first_break, stretch = sweep_model_length(m[0], b) / t[branch->break_count - 1];
            for (int k = 0; k < branch->break_count; k++)
                t[k] *= stretch;
        }
        m[i]->branch[1].parent_t = 0;
        for (int k = 1; k <= 14; k++)
            m[i]->branch[1].parent_t += vec3_distance(m[i]->knot[k], m[i]->knot[k - 1]);
    }
    for (int k = 0; k < m[2]->row_count; k++)
        for (int j = 2; j < SWEEP_TERMS; j += 2)
            m[2]->row[k * SWEEP_TERMS + j] *= -1;
    Vessel *v[3] = {make(m[0], 0), make(m[1], 0), make(m[2], 0)};
    SweepField *f = sweep_field_create(m[0]);
    VesselMemory memory[3] = {{.node = 10}, {.node = 10}, {.node = 10}};
    uint64_t seed = 8;
    double t = m[0]->branch[1].parent_t - 2, worst = 0;
    Vec3 x = sweep_curve_at(f->curve[0], t).s;
    int compared = 0;
    for (int step = 0; step < 1500; step++) {
        wander(f, &seed, 0, &t, &x, 0.15);
        VesselHit hit[3] = {ask(v[0], x, &memory[0]), ask(v[1], permuted(x), &memory[1]), ask(v[2], mirrored(x), &memory[2])};
        if (fabs(hit[0].gap) > 0.6)
            continue;
        compared++;
        worst = fmax(worst, fmax(fabs(hit[1].gap - hit[0].gap), fabs(hit[2].gap - hit[0].gap)));
        worst = fmax(worst, fmax(vec3_distance(hit[1].normal, permuted(hit[0].normal)), vec3_distance(hit[2].normal, mirrored(hit[0].normal))));
    }
    print_message("%d answers of moved and mirrored models differ by %.1e\n", compared, worst);
    assert_true(compared > 300 && worst < 1e-7);
    for (int i = 0; i < 3; i++) {
        v[i]->destroy(v[i]);
        sweep_model_free(m[i]);
    }
    sweep_field_free(f);
}

// --- bad points, heap ---

static void bad_points_and_no_heap(void **state)
{
    (void)state;
    SweepShape s[2];
    fork_of_two(s, 35);
    SweepModel *m = sweep_model_of(s, 2);
    Vessel *v = make(m, 0);
    const Vec3 bad[] = {{NAN, 0, 0}, {1e200, 0, 0}, {0, -INFINITY, 0}, {1e60, 1e60, 0}, {300, -200, 100}, {0, 0, 0}, {-8, 0, 0}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        for (int from = -1; from < 3; from++) {
            VesselMemory memory = {.node = from < 2 ? from : 1 << 20};
            VesselHit hit = ask(v, bad[i], &memory);
            assert_true(vessel_hit_is_sound(&hit));
            assert_true(v->locate(v, bad[i], from < 2 ? from : 1 << 20) >= 0);
        }
    // the same memory for a point elsewhere
    VesselMemory memory = {.node = -1};
    VesselHit here = ask(v, vec3(0, 0.5, 0), &memory);
    ask(v, vec3(9, 0.3, 0.2), &memory);
    assert_near(ask(v, vec3(0, 0.5, 0), &memory).gap, here.gap, 1e-8);
    heap_watch(true);
    long before = heap_calls();
    uint64_t seed = 9;
    for (int i = 0; i < 300; i++) {
        ask(v, vec3(random_in(&seed, -8, 10), random_in(&seed, -1, 3), random_in(&seed, -1, 1)), i % 2 ? NULL : &memory);
        v->locate(v, vec3(random_in(&seed, -8, 10), 0, 0), i % 40);
    }
    heap_watch(false);
    assert_int_equal(heap_calls(), before);
    v->destroy(v);
    sweep_model_free(m);
}

// --- Far starts of t ---

// F is at most the largest radius less the distance from the curve and its straight continuation, from wherever t is looked for.
static void far_starts_find_no_lumen(void **state)
{
    (void)state;
    static SweepShape shape[1] = {{.pitch = 0.6, .parent = -1, .radius = 1, .knots = 121}};
    for (int i = 0; i < 121; i++)
        shape[0].knot[i] = vec3(1.6 * cos(0.1 * PI * i), 1.6 * sin(0.1 * PI * i), 0.25 * i);
    SweepModel *model = sweep_model_of(shape, 1);
    SweepField *field = sweep_field_create(model);
    SweepFeet feet = {.field = field, .kernels = sweep_kernels(1), .harmonics = sweep_model_harmonics(model)};
    assert_non_null(field);
    const double length = sweep_model_length(model, 0);
    static Vec3 curve[4000];                     // 0.02 mm apart
    for (int k = 0; k < 4000; k++)
        curve[k] = sweep_curve_at(field->curve[0], (length + 20) * k / 3999 - 10).s;
    uint64_t seed = 1;
    for (int n = 0; n < 500; n++) {
        SweepBlock b;
        Vec3 x[FOOT_BLOCK];
        sweep_block_begin(&b);
        for (int i = 0; i < FOOT_BLOCK; i++) {
            double t = random_in(&seed, 0, length);
            x[i] = vec3(random_in(&seed, -6, 6), random_in(&seed, -6, 6), random_in(&seed, -6, 36));
            sweep_block_place(&feet, &b, i, sweep_field_segment(field, 0, t), -1, t);
            b.foot.at.x[i] = x[i].x, b.foot.at.y[i] = x[i].y, b.foot.at.z[i] = x[i].z;
        }
        sweep_block_sample(&feet, &b, FOOT_ALL);
        for (int i = 0; i < FOOT_BLOCK; i++) {
            double near = HUGE_VAL;
            for (int k = 0; k < 4000; k++)
                near = fmin(near, vec3_distance(x[i], curve[k]));
            assert_true(b.foot.at.f[i] < 1.05 - near);       // the field knows its largest radius to 2 %
        }
    }
    sweep_field_free(field);
    sweep_model_free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cylinder_with_domes),
        cmocka_unit_test(cone),
        cmocka_unit_test(torus_converges),
        cmocka_unit_test(lanes_are_the_plain_field),
        cmocka_unit_test(t_settles_beyond_the_focal_line),
        cmocka_unit_test(derivatives_of_the_gap),
        cmocka_unit_test(feet_are_nearest),
        cmocka_unit_test(sac_beside_a_tube),
        cmocka_unit_test(kissing_tubes_keep_apart),
        cmocka_unit_test(inlet_is_open),
        cmocka_unit_test(same_bits),
        cmocka_unit_test(moved_and_mirrored),
        cmocka_unit_test(bad_points_and_no_heap),
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(far_starts_find_no_lumen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

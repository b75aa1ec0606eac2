// A tool does not pass through itself: coils in a sac, measured by this file's own distances; a loop whose end presses on its own base, compared with the
// elastica; the laws of contact; the same result from both contact solvers, mirrored, saved and restored, and with two tools.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "solver/step_internal.h"
#include "tests/short_run.h"
#include "tube_scene.h"

// --- distance of a tool to itself, independent of the solver: the cubics as short lines, all pairs ---

enum { CUTS = 6, POINTS_MAX = 2000 };

static Vec3 cubic(Vec3 x1, Vec3 t1, Vec3 x2, Vec3 t2, double length, double xi)
{
    double w = xi * xi * (3 - 2 * xi);
    Vec3 x = vec3_add(vec3_scale(x1, 1 - w), vec3_scale(x2, w));
    return vec3_add(x, vec3_add(vec3_scale(t1, length * xi * (1 - xi) * (1 - xi)), vec3_scale(t2, length * xi * xi * (xi - 1))));
}

static Vec3 axis_of(const WireState *w, int node) { return quat_rotate(w->orientation[node], vec3(1, 0, 0)); }

static double between_lines(Vec3 p, Vec3 p2, Vec3 q, Vec3 q2)
{
    Vec3 d = vec3_sub(p2, p), e = vec3_sub(q2, q), r = vec3_sub(p, q);
    double a = vec3_norm2(d), f = vec3_norm2(e), b = vec3_dot(d, e), best = HUGE_VAL, det = a * f - b * b;
    // the interior minimum, or one at an end
    if (det > 1e-12 * a * f) {
        double s = (b * vec3_dot(e, r) - f * vec3_dot(d, r)) / det, t = (a * vec3_dot(e, r) - b * vec3_dot(d, r)) / det;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
            best = vec3_norm2(vec3_add(r, vec3_sub(vec3_scale(d, s), vec3_scale(e, t))));
    }
    Vec3 end[4] = {p, p2, q, q2};
    for (int k = 0; k < 4; k++) {
        Vec3 from = k < 2 ? q : p, along = k < 2 ? e : d;
        double t = fmax(0, fmin(1, vec3_dot(vec3_sub(end[k], from), along) / vec3_norm2(along)));
        best = fmin(best, vec3_norm2(vec3_sub(end[k], vec3_add_scaled(from, t, along))));
    }
    return sqrt(best);
}

// [mm] smallest distance of two places of the axis that are at least `arc` apart along it, outside the sheath, which is along +x.
static double least_distance(const WireState *w, double length, double mouth, double arc)
{
    static Vec3 point[POINTS_MAX];
    int count = 0, first = 0;
    while (w->position[first].x < mouth)
        first++;
    for (int i = first; i + 1 < w->node_count; i++)
        for (int k = 0; k < CUTS; k++)
            point[count++] = cubic(w->position[i], axis_of(w, i), w->position[i + 1], axis_of(w, i + 1), length, (double)k / CUTS);
    int apart = (int)ceil(arc / length * CUTS) + 1;
    double least = HUGE_VAL;
    for (int i = 0; i + 1 < count; i++)
        for (int j = i + apart; j + 1 < count; j++)
            if (vec3_distance(point[i], point[j]) < least + 2 * length)
                least = fmin(least, between_lines(point[i], point[i + 1], point[j], point[j + 1]));
    return least;
}

// --- a sac ---

// A nearly spherical vessel; the wire enters beside its axis.
typedef struct Sac {
    Bench bench;
    Vessel *vessel;
    Stepper *stepper;
    double element;
} Sac;

static void sac_start(Sac *sac, double radius, double length, double element, double mirror)
{
    TubePiece piece = {.length = 0.5};
    TubeOptions options = {
        .start = {0, 0, 0}, .direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = radius, .piece_count = 1, .piece = &piece, .closed_ends = true};
    Faults faults = {0};
    sac->vessel = tube_vessel_create(&options, "sac", &faults);
    sac->element = element;
    Bench *b = &sac->bench;
    bench_in_tube(b, sac->vessel, 0.1, length + 2, (int)((length + 2) / element), 1, 1);
    WireOptions *w = &b->options.wire;
    w->start = vec3(0.3 - radius, mirror * 0.4, 0.2);
    w->normal = vec3(0, mirror, 0);
    w->damping_mass = 1e-4, w->damping_stiffness = 0.2;
    b->section[0].young_modulus = 3e3;
}

static void sac_make(Sac *sac, SelfContactMode mode)
{
    sac->bench.options.self_contact = mode;
    sac->stepper = bench_make(&sac->bench);
}

static void sac_end(Sac *sac)
{
    stepper_destroy(sac->stepper);
    sac->vessel->destroy(sac->vessel);
}

static double sac_distance(const Sac *sac)
{
    return least_distance(stepper_state(sac->stepper), sac->element, sac->bench.options.wire.start.x, 4 * PI * sac->bench.section[0].diameter / 2);
}

typedef struct Coil {
    double least, overlap;   // [mm] distance to itself; overlap reported by the solver
    int contacts;            // largest number at a time
    int limited, unconverged;
    double deepest;          // [mm] in the wall
} Coil;

static Coil coil_up(SelfContactMode mode, double radius, double speed, double length, double element)
{
    Sac sac;
    sac_start(&sac, radius, length, element, 1);
    sac_make(&sac, mode);
    Coil coil = {.least = HUGE_VAL};
    for (int k = 0; k < (int)(length / speed); k++) {
        const StepReport *report = step_once(sac.stepper, speed, 0);
        assert_false(report->flags & STEP_DIVERGED);
        coil.limited += (report->flags & STEP_LIMITED) != 0;
        coil.unconverged += (report->flags & STEP_NOT_CONVERGED) != 0;
        coil.contacts = report->self_contacts > coil.contacts ? report->self_contacts : coil.contacts;
        coil.deepest = fmax(coil.deepest, report->penetration);
        coil.overlap = fmax(coil.overlap, report->self_overlap);
        coil.least = fmin(coil.least, sac_distance(&sac));
    }
    sac_end(&sac);
    return coil;
}

// 60 mm at the speed of a hand and at four times that, with elements longer and shorter than the diameter of the tool.
static void a_wire_coils_in_a_sac(void **state)
{
    (void)state;
    const struct {
        double radius, speed, element;
    } scene[] = {{4, 0.05, 1}, {4, 0.05, 1.5}, {4, 0.2, 1}, {3, 0.2, 1.5}, {3, 0.05, 1}, {4, 0.05, 0.5}};
    for (size_t k = WHOLE_OR_SHORT(0, 2); k < WHOLE_OR_SHORT(sizeof scene / sizeof *scene, 3); k++) {
        Coil on = coil_up(SELF_CONTACT_AUTO, scene[k].radius, scene[k].speed, 60, scene[k].element);
        print_message("sac of %g mm, %3.0f mm/s, elements of %.1f mm: least distance %.4f mm (2 r = 0.36), its own word %.4f mm deep, %d contacts; "
                      "limited %d, not converged %d steps; wall %.4f mm deep\n",
                      scene[k].radius, scene[k].speed * 1000, scene[k].element, on.least, on.overlap, on.contacts, on.limited, on.unconverged, on.deepest);
        assert_true(on.least > 0.36 - 0.01 && on.contacts > 2 && on.overlap < 0.01);
        assert_true(on.limited <= 5 && on.deepest < 0.05);
    }
    Coil off = coil_up(SELF_CONTACT_OFF, 4, 0.05, 60, 1);
    print_message("without contact: least distance %.4f mm\n", off.least);
    assert_true(off.least < 0.1 && off.contacts == 0);
}

// --- a loop whose end presses on its own base ---
//
// Clamped along x over 30 mm, then 270 degrees of rest radius R, then straight back down to `dip` mm beyond the axis of the base. Elastica with the base's
// force F, along y, at its end:
//   EI (kappa - kappa_0) = F (x_tip - x),   x' = cos theta, y' = sin theta,   from (0, 0, 0) at the end of the base to y = 2 r at the tip.

enum { STEPS = 4000 };

static double tip_height(double bend, double straight, double force, double stiffness, double x_tip, double *x_end)
{
    double arc = 1.5 * PI * bend, length = arc + straight, x = 0, y = 0, theta = 0;
    for (int k = 0; k < STEPS; k++) {
        // midpoint rule, with steps that end at the border
        double from = k < STEPS / 2 ? arc * 2 / STEPS : (length - arc) * 2 / STEPS, rest = k < STEPS / 2 ? 1 / bend : 0;
        double bent = rest + force * (x_tip - x) / stiffness, half = theta + 0.5 * from * bent, middle = x + 0.5 * from * cos(theta);
        theta += from * (rest + force * (x_tip - middle) / stiffness);
        x += from * cos(half);
        y += from * sin(half);
    }
    *x_end = x;
    return y;
}

static double loop_force(double bend, double straight, double stiffness, double height)
{
    double low = 0, high = 0.5 * stiffness / (bend * bend);
    for (int k = 0; k < 60; k++) {
        double force = 0.5 * (low + high), x_tip = -bend, x_end = 0, y = 0;
        for (int i = 0; i < 50; i++) {
            y = tip_height(bend, straight, force, stiffness, x_tip, &x_end);
            x_tip += 0.7 * (x_end - x_tip);
        }
        *(y < height ? &low : &high) = force;
    }
    return low;
}

static double loop_error(int elements, double bend, double dip)
{
    WireFix fix[100];
    int fixes = 0;
    Bench b;
    bench_start(&b, 30, elements, 1);
    double straight = bend + dip;
    b.section[1] = standard_section(1.5 * PI * bend);
    b.section[1].rest_curvature = 1 / bend;
    b.section[2] = standard_section(straight);
    for (int i = 0; i < 3; i++)
        section_stiffness(&b.section[i], 2);
    WireOptions *w = &b.options.wire;
    w->section_count = 3;
    w->damping_mass = 0.05, w->damping_stiffness = 5;
    for (double s = 0; s < 30.1 && fixes < 100; s += 0.5)
        fix[fixes++] = (WireFix){.s = s, .dof = DOF_ALL};
    w->fix = fix;
    w->fix_count = fixes;
    b.options.self_contact = SELF_CONTACT_ON;
    Stepper *s = bench_make(&b);
    settle(s, 1000, 20000, 1e-7);
    double force = 0, stiffness = 2;
    for (int k = 0; k < s->system.set.pair_count; k++)
        force += fabs(s->system.set.pair[k].force.y);
    double reference = loop_force(bend, straight, stiffness, 0.36);
    Vec3 tip = tip_of(s);
    print_message("loop of radius %g mm, %g mm too long, %d elements: force on its base %.6f N, elastica %.6f N (%+.3f %%), tip %.5f mm above the axis; "
                  "%d contacts\n",
                  bend, dip, elements, force, reference, 100 * (force / reference - 1), tip.y, step_report(s)->self_contacts);
    assert_int_equal(step_report(s)->self_contacts, 1);
    assert_true(fabs(tip.y - 0.36) < 1e-3);
    stepper_destroy(s);
    return force / reference - 1;
}

static void a_loop_presses_on_its_base(void **state)
{
    (void)state;
    assert_true(fabs(loop_error(80, 5, 0.5)) < 0.001);
    assert_true(!WHOLE_RUN || fabs(loop_error(80, 5, 2)) < 0.001);
}

// --- laws ---

// Pushes until there are that many contacts, and then some more steps.
static void until_it_touches(Stepper *s, double speed, int contacts, int more)
{
    for (int k = 0; k < 2000 && step_once(s, speed, 0)->self_contacts < contacts; k++)
        ;
    assert_true(step_report(s)->self_contacts >= contacts);
    for (int k = 0; k < more; k++)
        step_once(s, speed, 0);
}

static Vec3 of(const double *u, int node, int from) { return vec3(u[6 * node + from], u[6 * node + from + 1], u[6 * node + from + 2]); }

// The forces of a pair on all nodes sum to zero, and so do their moments about the origin; the friction of a slipping pair is opposite to the slip.
static void forces_are_equal_and_opposite(void **state)
{
    (void)state;
    Sac sac;
    sac_start(&sac, 4, 60, 1, 1);
    sac_make(&sac, SELF_CONTACT_ON);
    int seen = 0, slipping = 0, sticking = 0;
    until_it_touches(sac.stepper, 0.05, 2, 0);
    for (int step = 0; step < WHOLE_OR_SHORT(600, 300); step++) {
        step_once(sac.stepper, 0.05, 0);
        const Stepper *s = sac.stepper;
        if (step_report(s)->newton > 0 || (step_report(s)->flags & (STEP_NOT_CONVERGED | STEP_LIMITED)))
            continue;
        for (int k = 0; k < s->system.set.pair_count; k++) {
            const ContactPair *p = &s->system.set.pair[k];
            double normal = vec3_dot(p->force, p->normal);
            if (!(normal > 1e-6) || p->end[0].node < s->first_free)
                continue;
            Vec3 force = vec3(0, 0, 0), moment = force, slip = force;
            double size = 0;
            for (int e = 0; e < 2; e++)
                for (int n = 0; n < 2; n++) {
                    double sign = e ? -1 : 1, weight = p->end[e].weight[n];
                    int node = p->end[e].node + n;
                    Vec3 arm = vec3_add_scaled(p->end[e].lever[n], -sign * weight * p->end[e].radius, p->normal), f = vec3_scale(p->force, sign);
                    force = vec3_add_scaled(force, weight, f);
                    moment = vec3_add(moment, vec3_add(vec3_cross(s->start.position[node], vec3_scale(f, weight)), vec3_cross(arm, f)));
                    slip = vec3_add_scaled(slip, sign, vec3_add(vec3_scale(of(s->system.u, node, 0), weight), vec3_cross(of(s->system.u, node, 3), arm)));
                    size += vec3_norm(s->start.position[node]) * vec3_norm(f);
                }
            assert_true(vec3_norm(force) < 1e-12 * vec3_norm(p->force) && vec3_norm(moment) < 1e-12 * size);
            Vec3 drag = vec3_add_scaled(p->force, -normal, p->normal);
            slip = vec3_add_scaled(slip, -vec3_dot(slip, p->normal), p->normal);
            double ratio = vec3_norm(drag) / (0.1 * normal);
            assert_true(ratio < 1 + 1e-4);
            seen++;
            if (vec3_norm(slip) > 1e-3) {
                slipping++;
                assert_true(ratio > 0.99 && vec3_dot(slip, drag) < -0.99 * vec3_norm(slip) * vec3_norm(drag));
            } else if (ratio < 0.9) {
                sticking++;
                assert_true(vec3_norm(slip) < 1e-5);
            }
        }
    }
    print_message("%d contacts of a wire with itself: no force or moment in sum; %d slip, %d stick\n", seen, slipping, sticking);
    assert_true(seen > 200 && slipping > 50);
    sac_end(&sac);
}

static void mirrored_and_restored(void **state)
{
    (void)state;
    Sac right, left;
    sac_start(&right, 4, 60, 1, 1);
    sac_start(&left, 4, 60, 1, -1);
    sac_make(&right, SELF_CONTACT_ON);
    sac_make(&left, SELF_CONTACT_ON);
    double worst = 0;
    int steps = 0, touching = 0;
    for (; steps < 700 && touching < 40; steps++) {
        touching += step_once(right.stepper, 0.05, 0)->self_contacts > 0;
        step_once(left.stepper, 0.05, 0);
        const WireState *a = stepper_state(right.stepper), *b = stepper_state(left.stepper);
        for (int i = 0; i < a->node_count; i++)
            worst = fmax(worst, vec3_distance(a->position[i], vec3(b->position[i].x, -b->position[i].y, b->position[i].z)));
    }
    print_message("mirrored: %.1e mm off after %d steps, %d with contact\n", worst, steps, touching);
    assert_true(touching >= 40 && worst < 1e-8);
    sac_end(&left);

    until_it_touches(right.stepper, 0.05, 3, 5);
    Checkpoint *saved = stepper_save(right.stepper, NULL);
    uint64_t there = stepper_hash(right.stepper);
    for (int k = 0; k < 50; k++)
        step_once(right.stepper, 0.05, 0);
    uint64_t first = stepper_hash(right.stepper);
    stepper_restore(right.stepper, saved);
    assert_true(stepper_hash(right.stepper) == there);
    for (int k = 0; k < 50; k++)
        step_once(right.stepper, 0.05, 0);
    assert_true(stepper_hash(right.stepper) == first);

    // both forms of the contact solve, from the same state
    Stepper *s = right.stepper;
    double furthest = 0;
    s->contact = (ContactOptions){.tolerance = 1e-9, .max_iterations = 2000};
    stepper_restore(s, saved);
    step_once(s, 0.05, 0);
    Vec3 place[200];
    memcpy(place, s->state.position, (size_t)s->state.node_count * sizeof *place);
    assert_true(step_report(s)->self_contacts >= 2);
    s->contact = (ContactOptions){.form = CONTACT_POINTWISE, .tolerance = 1e-9, .max_iterations = WHOLE_OR_SHORT(200000, 2000)};
    stepper_restore(s, saved);
    step_once(s, 0.05, 0);
    for (int i = 0; i < s->state.node_count; i++)
        furthest = fmax(furthest, vec3_distance(place[i], s->state.position[i]));
    print_message("block and pointwise form: %.1e mm apart after a step (residual %.1e)\n", furthest, step_report(s)->residual);
    assert_true(!WHOLE_RUN || furthest < 1e-6);
    checkpoint_free(saved);
    sac_end(&right);
}

// A tool that cannot touch itself: bit-identical with and without self-contact.
static void nothing_near_changes_no_bit(void **state)
{
    (void)state;
    Vessel *vessel = bent_tube(10, 8, PI / 2, 40, 1.25);
    uint64_t hash[2];
    for (int k = 0; k < 2; k++) {
        Bench b;
        bench_in_tube(&b, vessel, 0.05, 80, 80, 1, 1);
        b.options.self_contact = k ? SELF_CONTACT_OFF : SELF_CONTACT_AUTO;
        Stepper *s = bench_make(&b);
        feed(s, 50, 1000);
        hash[k] = stepper_hash(s);
        stepper_destroy(s);
    }
    assert_true(hash[0] == hash[1]);
    vessel->destroy(vessel);
}

// A wire in a catheter of twice its width, both into the sac.
static void two_tools_coil(void **state)
{
    (void)state;
    for (int off = 0; off < 2; off++) {
        Sac sac;
        sac_start(&sac, 4, 60, 1, 1);
        Bench *b = &sac.bench;
        WireSection wire = b->section[0];
        b->section[0].diameter = 0.6, b->section[0].inner_diameter = 0.4;
        b->section[0].young_modulus = 500;
        WireOptions inner = b->options.wire;
        inner.section = &wire;
        b->options.inner_count = 1;
        b->options.inner = &inner;
        b->options.inner_friction[0] = 0.05;
        sac_make(&sac, off ? SELF_CONTACT_OFF : SELF_CONTACT_ON);
        Coil coil = {.least = HUGE_VAL};
        for (int k = 0; k < 1100; k++) {
            // the wire first, the catheter after it
            StepCommand command[STEP_TOOLS_MAX] = {{.advance = k > 300 ? 0.04 : 0}, {.advance = 0.05}};
            step_feed_tools(sac.stepper, command, 0);
            step_solve(sac.stepper);
            const StepReport *report = step_report(sac.stepper);
            assert_false(report->flags & STEP_DIVERGED);
            coil.contacts = report->self_contacts > coil.contacts ? report->self_contacts : coil.contacts;
            coil.overlap = fmax(coil.overlap, report->self_overlap);
            coil.limited += (report->flags & STEP_LIMITED) != 0;
            if (k > 400)
                coil.least = fmin(coil.least, sac_distance(&sac));
        }
        print_message("two tools%s: least distance %.4f mm (wire 0.36, catheter 0.6), %.4f mm deep, %d contacts, limited %d\n", off ? ", no contact" : "",
                      coil.least, coil.overlap, coil.contacts, coil.limited);
        if (off)
            assert_true(coil.least < 0.1);
        else
            assert_true(coil.contacts > 0 && coil.overlap < 0.015 && coil.least > 0.35);
        sac_end(&sac);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_near_changes_no_bit),
        cmocka_unit_test(a_loop_presses_on_its_base),
        cmocka_unit_test(forces_are_equal_and_opposite),
        cmocka_unit_test(mirrored_and_restored),
        cmocka_unit_test(two_tools_coil),
        cmocka_unit_test(a_wire_coils_in_a_sac),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

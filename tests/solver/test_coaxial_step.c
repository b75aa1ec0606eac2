// Coaxial tools in the stepper: exact references reached by moving hands, nodes added and removed at tips, tools in a tube, save and restore.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "tube_scene.h"
#include "tests/short_run.h"

// A tube or rod with this bending stiffness [N mm2].
static WireSection tube_section(double length, double bending, double curvature, double outer, double inner)
{
    double second = PI / 64 * (outer * outer * outer * outer - inner * inner * inner * inner);
    return (WireSection){.length = length,
                         .diameter = outer,
                         .inner_diameter = inner,
                         .young_modulus = bending / second,
                         .poisson_ratio = 0.3,
                         .density = 2e-3,
                         .rest_curvature = curvature,
                         .friction = -1};
}

typedef struct Coaxial {
    WireSection section[3][3];
    WireFix fix;
    WireOptions inner[2];
    StepperOptions options;
    Stepper *stepper;
} Coaxial;

static WireOptions tool_options(const WireSection *section, int sections, int elements, double inserted)
{
    WireOptions o = wire_default_options();
    o.section = section;
    o.section_count = sections;
    o.elements = elements;
    o.inserted = inserted;
    o.damping_mass = 0.5;
    o.damping_stiffness = 5;
    o.normal = vec3(0, 1, 0);
    return o;
}

static void start(Coaxial *c, int inner_count, bool sheath)
{
    char why[256] = "";
    c->fix = (WireFix){.s = 0, .dof = DOF_ALL};
    WireOptions *w = &c->options.wire;
    w->has_sheath = sheath;
    if (!sheath) {
        w->fix = &c->fix;
        w->fix_count = 1;
    }
    c->options.inner_count = inner_count;
    c->options.inner = c->inner;
    c->stepper = stepper_create(&c->options, why, sizeof why);
    if (!c->stepper)
        print_message("%s\n", why);
    assert_non_null(c->stepper);
}

static const StepReport *step_released(Stepper *s, const StepCommand *command, unsigned released)
{
    step_feed_tools(s, command, released);
    step_solve(s);
    return step_report(s);
}

static const StepReport *step_tools(Stepper *s, const StepCommand *command) { return step_released(s, command, 0); }

// Tool k moves by a distance and an angle in a number of steps, then all tools rest.
static const StepReport *move_tool(Stepper *s, int k, double distance, double turn, int steps, int rest)
{
    StepCommand command[STEP_TOOLS_MAX] = {{0}}, none[STEP_TOOLS_MAX] = {{0}};
    command[k] = (StepCommand){distance / steps, turn / steps};
    for (int i = 0; i < steps; i++)
        assert_true(!(step_tools(s, command)->flags & ~(unsigned)STEP_HAND_SLIPS));
    const StepReport *r = step_report(s);
    for (int i = 0; i < rest; i++)
        r = step_tools(s, none);
    return r;
}

// Reference 1 of issue 14: a straight wire of EI 40 in a clamped tube of EI 60 and curvature 0.05: the curvature is 0.03 where both are.
static void a_straight_wire_in_a_curved_tube(void **state)
{
    (void)state;
    double error[2];
    for (int fine = 0; fine < WHOLE_OR_SHORT(2, 1); fine++) {
        int n = fine ? 60 : 20;
        Coaxial c = {0};
        c.section[0][0] = tube_section(60, 60, 0.05, 1, 0.8);
        c.section[1][0] = tube_section(200, 40, 0, 0.5, 0);
        c.options.wire = tool_options(c.section[0], 1, n, 0);
        c.inner[0] = tool_options(c.section[1], 1, 3 * n, 0.5);
        start(&c, 1, false);
        const StepReport *r = move_tool(c.stepper, 1, 0, 0, 1, 400);
        double least = HUGE_VAL, most = 0;
        const double stride = WHOLE_OR_SHORT(0.95, 2.85);
        for (double d = 1.5; d < 30; d += stride) {
            r = move_tool(c.stepper, 1, stride, 0, WHOLE_OR_SHORT(20, 60), 200);
            least = fmin(least, r->push[1]);
            most = fmax(most, r->push[1]);
        }
        r = move_tool(c.stepper, 1, 30 - stepper_tool_inserted(c.stepper, 1), 0, 10, 600);
        Vec3 tip = stepper_state(c.stepper)->position[n];
        error[fine] = vec3_distance(tip, vec3(23.953622, 39.793075, 0));
        print_message("%d elements: push %.7f to %.7f N (0.03), tip %.2e mm off\n", n, least, most, error[fine]);
        assert_true(least > 0.03 * (1 - 1e-4) && most < 0.03 * (1 + 1e-4));
        stepper_destroy(c.stepper);
    }
    // the remaining error is the stretch of the tools
    assert_true(error[WHOLE_OR_SHORT(1, 0)] < 2e-3);
}

// Reference 2: phi'' = c sin phi, phi'(L) = 0. At a base of 197.7856 degrees, L sqrt(c) = 2, the fold; below it, the tip rotates with the base.
static void turned_tubes_follow_up_to_the_fold(void **state)
{
    (void)state;
    const double b1 = 60, b2 = 40, k = 0.05, nu = 0.3, L = 60;
    double c0 = b1 * b2 / (b1 + b2) * k * k * ((1 + nu) / b1 + (1 + nu) / b2);
    Coaxial c = {0};
    c.section[0][0] = tube_section(L, b1, k, 1, 0.8);
    c.section[1][0] = tube_section(L + 0.01, b2, k, 0.5, 0);
    c.options.wire = tool_options(c.section[0], 1, 60, 0);
    c.inner[0] = tool_options(c.section[1], 1, 60, L);
    start(&c, 1, false);
    move_tool(c.stepper, 1, 0, 0, 1, 800);
    for (int turn = 60; turn <= WHOLE_OR_SHORT(240, 60); turn += 60) {
        move_tool(c.stepper, 1, 0, PI / 3, WHOLE_OR_SHORT(1500, 500), WHOLE_OR_SHORT(1500, 800));
        const WireState *w = stepper_state(c.stepper);
        double tip = w->angle[60], phi = tip, slope = 0, h = L / 20000;
        for (int i = 0; i < 20000; i++) {        // from the tip back
            double mid = phi - 0.5 * h * slope, mid_slope = slope - 0.5 * h * c0 * sin(phi);
            phi -= h * mid_slope;
            slope -= h * c0 * sin(mid);
        }
        print_message("base %.3f degrees, tip %.4f: by the equation %.3f\n", w->angle[0] * 180 / PI, tip * 180 / PI, phi * 180 / PI);
        assert_true(fabs(w->angle[0] - turn * PI / 180) < 1e-9);
        assert_true(fabs(phi / w->angle[0] - 1) < 2e-3);
    }
    stepper_destroy(c.stepper);
}

// Reference 3: a J of EI 20 leaves a straight catheter of EI 60: 0, then -15 * 0.01 / 2 while the bend crosses the tip, then 0; there and back.
static void a_bend_leaves_the_catheter(void **state)
{
    (void)state;
    Coaxial c = {0};
    c.section[0][0] = tube_section(60, 60, 0, 1, 0.8);
    c.section[1][0] = tube_section(105, 20, 0, 0.5, 0);
    c.section[1][1] = tube_section(15, 20, 0.1, 0.5, 0);
    c.options.wire = tool_options(c.section[0], 1, 29, 0);
    c.inner[0] = tool_options(c.section[1], 2, 61, 40);
    start(&c, 1, false);
    move_tool(c.stepper, 1, 0, 0, 1, 400);
    Vec3 first = {0};
    for (int round = 0; round < WHOLE_OR_SHORT(3, 1); round++) {
        static const struct {
            double at, push;
        } stop[] = {{45, 0}, {52.41, 0}, {59, 0}, {61, -0.075}, {66.3, -0.075}, {74, -0.075}, {77, 0}, {79, 0}};
        for (int i = 0; i < 16; i++) {
            int k = i < 8 ? i : 15 - i;
            double distance = stop[k].at - stepper_tool_inserted(c.stepper, 1);
            const StepReport *r = move_tool(c.stepper, 1, distance, 0, 1 + (int)(fabs(distance) / WHOLE_OR_SHORT(0.02, 0.05)), WHOLE_OR_SHORT(400, 250));
            assert_true(fabs(r->push[1] - stop[k].push) < 2e-5);
            assert_true(fabs(r->push[0] + stop[k].push) < 2e-5);
            if (k != 7 || i > 7)
                continue;
            Vec3 tip = stepper_state(c.stepper)->position[stepper_state(c.stepper)->node_count - 1];
            // 4 mm straight, then an arc of 1.5 rad
            double off = vec3_distance(tip, vec3(64 + 10 * sin(1.5), 10 * (1 - cos(1.5)), 0));
            print_message("round %d: tip %.2e mm off, %.1e from the first round's\n", round, off, round ? vec3_distance(tip, first) : 0);
            assert_true(off < 2e-3 && (round == 0 || vec3_distance(tip, first) < 1e-6));
            first = tip;
        }
    }
    stepper_destroy(c.stepper);
}

// Two tools with flush tips and the same J-shape lie in each other without a force, and motion in either direction needs energy: they rest and gain no energy.
static void equal_bends_with_flush_tips_rest(void **state)
{
    (void)state;
    Coaxial c = {0};
    c.section[0][0] = tube_section(60, 6.6, 0, 0.7, 0.57);
    c.section[0][1] = tube_section(15, 1.2, 0.08, 0.6, 0.57);
    c.section[1][0] = tube_section(85, 0.8, 0, 0.36, 0);
    c.section[1][1] = tube_section(15, 0.8, 0.08, 0.36, 0);
    c.options.wire = tool_options(c.section[0], 2, 25, 0);
    c.inner[0] = tool_options(c.section[1], 2, 33, 74.9995);
    c.options.wire.damping_mass = 0.05;
    c.options.wire.damping_stiffness = 0.2;
    start(&c, 1, false);
    const int tip = 25;
    double gained = 0, moved = 0, push = fabs(move_tool(c.stepper, 1, 0, 0, 1, 2000)->push[1]), at = stepper_state(c.stepper)->slide[tip];
    StepEnergy before = stepper_energy(c.stepper);
    for (int i = 0; i < 500; i++) {
        move_tool(c.stepper, 1, 0, 0, 1, 0);
        StepEnergy e = stepper_energy(c.stepper);
        gained += fmax(0, e.elastic + e.kinetic - before.elastic - before.kinetic - e.hand + e.damping);
        moved = fmax(moved, fabs(stepper_state(c.stepper)->slide[tip] - at));
        before = e;
    }
    // beyond a fiftieth of an element: half the EI of the two in series, times the curvature squared
    double beyond = 0.5 * 0.8 * 1.2 / (0.8 + 1.2) * 0.08 * 0.08;
    print_message("gained %.1e of %.1e mJ, moved by %.1e mm, push %.1e N (%.1e beyond)\n", gained, before.elastic, moved, push, beyond);
    assert_true(gained < 1e-9 && moved < 1e-6 && push < beyond);
    stepper_destroy(c.stepper);
}

// The bend leaves the sheath: 0.1 N if it leaves straight into free space, 0.1 - 0.075 N if it enters the catheter; energy is conserved.
static void tools_leave_the_sheath(void **state)
{
    (void)state;
    Coaxial c = {0};
    c.section[0][0] = tube_section(120, 60, 0, 1, 0.8);
    c.section[1][0] = tube_section(165, 20, 0, 0.5, 0);
    c.section[1][1] = tube_section(15, 20, 0.1, 0.5, 0);
    c.options.wire = tool_options(c.section[0], 1, 57, 1);
    c.inner[0] = tool_options(c.section[1], 2, 121, 1);
    start(&c, 1, true);
    const StepReport *r = move_tool(c.stepper, 1, 0, 0, 1, 600);
    assert_true(fabs(r->push[0] - 0.075) < 1e-5 && fabs(r->push[1] + 0.1) < 1e-5);      // tips flush
    StepEnergy before = stepper_energy(c.stepper);
    double gained = 0, work = 0;
    const int fast = WHOLE_OR_SHORT(1, 4);
    for (int i = 0; i < 5000; i += fast) {
        StepCommand command[2] = {{0}};
        if (i < 2000)
            command[0].advance = command[1].advance = 0.01 * fast;
        else if (i < 3500)
            command[1] = (StepCommand){0.01 * fast, 0.001 * fast};
        else
            command[1].advance = -0.01 * fast;
        r = step_tools(c.stepper, command);
        assert_int_equal(r->flags, 0);
        StepEnergy e = stepper_energy(c.stepper);
        gained += fmax(0, e.elastic + e.kinetic - before.elastic - before.kinetic - e.hand + e.damping);
        work += fabs(e.hand);
        before = e;
    }
    print_message("work %.4f mJ, gained %.2e\n", work, gained);
    assert_true(work > 0.1 && gained < 0.05 * work);
    stepper_destroy(c.stepper);
}

// Two bends rotated against each other cause a torque T along the sheath, in which the inner tool becomes softer at one place. Pulling that place back by d
// lengthens the soft part under torque: the work T2 / 2 (1 / GJ' - 1 / GJ) d goes to the hand. Without this term the energy was lost on the way back and was
// created on the way in.
static void a_softer_part_turned_in_the_sheath_does_work(void **state)
{
    (void)state;
    Coaxial c = {0};
    c.section[0][0] = tube_section(95, 60, 0, 1, 0.8);
    c.section[0][1] = tube_section(25, 20, 0.1, 1, 0.8);
    c.section[1][0] = tube_section(100, 60, 0, 0.5, 0);
    c.section[1][1] = tube_section(35, 6, 0, 0.5, 0);
    c.section[1][2] = tube_section(25, 6, 0.1, 0.5, 0);
    c.options.wire = tool_options(c.section[0], 2, 24, 30);
    c.inner[0] = tool_options(c.section[1], 3, 32, 30);
    c.options.wire.damping_mass = 0.05;
    c.options.wire.damping_stiffness = 0.2;
    start(&c, 1, true);
    for (int i = 0; i < 1500; i++)
        step_tools(c.stepper, (StepCommand[2]){{0}, {.twist = i < 1000 ? 5e-3 : 0}});
    double torque = step_report(c.stepper)->torque[1], soft = 6 / 1.3, stiff = 60 / 1.3, advance = 0.01, from_nowhere = 0, expected = 0;
    StepEnergy before = stepper_energy(c.stepper);
    for (int i = 0; i < 500; i++) {
        const StepReport *r = step_tools(c.stepper, (StepCommand[2]){{0}, {.advance = -advance}});
        assert_int_equal(r->flags, 0);
        StepEnergy e = stepper_energy(c.stepper);
        from_nowhere += e.elastic + e.kinetic - before.elastic - before.kinetic - e.hand + e.damping;
        expected += 0.5 * r->torque[1] * r->torque[1] * (1 / soft - 1 / stiff) * advance;
        before = e;
    }
    print_message("torque %.4f N mm: %.4f mJ to be done, %.1e mJ from nowhere\n", torque, expected, from_nowhere);
    assert_true(fabs(torque) > 0.3 && fabs(from_nowhere) < 0.05 * expected);
    stepper_destroy(c.stepper);
}

// Reference 5: a wire of EI 65.96 pulled through line, quarter circle and line, mu 0.1; the values are from two rods in contact with a clearance. Here the
// tools share their line, and the clearance only spreads the contact pressure (step_coaxial.c).
static void friction_in_a_bend(void **state)
{
    (void)state;
    static const struct {
        double radius, clearance, force;
    } reference[] = {{20, 0.02, 0.308}, {20, 0.05, 0.191}, {20, 0.1, 0.130}, {10, 0.05, 0.525}, {40, 0.05, 0.068}};
    for (int i = 0; i < WHOLE_OR_SHORT(5, 1); i++) {
        double pull[2];
        for (int fine = 0; fine < 2; fine++) {
            double arc = reference[i].radius * PI / 2, lumen = 0.36 + 2 * reference[i].clearance;
            WireSection tube[3] = {tube_section(30, 1e5, 0, 1.5, lumen), tube_section(arc, 1e5, 1 / reference[i].radius, 1.5, lumen),
                                   tube_section(30, 1e5, 0, 1.5, lumen)};
            Coaxial c = {0};
            c.section[1][0] = tube_section(200, 65.96, 0, 0.36, 0);
            c.options.wire = tool_options(tube, 3, fine ? 120 : 60, 0);
            c.inner[0] = tool_options(c.section[1], 1, fine ? 240 : 120, 50 + arc);
            c.options.inner_friction[0] = 0.1;
            start(&c, 1, false);
            StepCommand rest[2] = {{0}};
            for (int k = 0; k < 600; k++)
                step_tools(c.stepper, rest);
            pull[fine] = -move_tool(c.stepper, 1, -2, 0, 400, 0)->push[1];
            stepper_destroy(c.stepper);
        }
        print_message("R %2.0f, clearance %.2f: %.4f and %.4f N, reference %.3f: %+.1f %%\n", reference[i].radius, reference[i].clearance, pull[0], pull[1],
                      reference[i].force, 100 * (pull[1] / reference[i].force - 1));
        assert_true(fabs(pull[1] / reference[i].force - 1) < 0.1 && fabs(pull[1] / pull[0] - 1) < 0.02);
    }
}

// Three tools: if the wire is pulled alone, it slides in the middle tool, which the friction of the outer tube holds; if wire and middle tool are pulled
// together, they slide in the outer one. In both cases the result is reference 5, R 20 and clearance 0.05, with the stiffness of the tools that slide. Energy
// is balanced. Reference 4: a thread over a bend of 90 degrees with mu 0.1 and a weight at its end: 1.1701 = exp(0.1 pi / 2) times the weight to pull it up,
// 1/1.1701 to lower it.
static void a_thread_over_a_bend(void **state)
{
    (void)state;
    for (int fine = 0; fine < WHOLE_OR_SHORT(2, 1); fine++) {
        double arc = 20 * PI / 2, g = 0.0981;   // heavy, so that its stiffness is negligible
        WireSection tube[3] = {tube_section(20, 1e5, 0, 1.5, 0.14), tube_section(arc, 1e5, 0.05, 1.5, 0.14), tube_section(20, 1e5, 0, 1.5, 0.14)};
        Coaxial c = {0};
        c.section[1][0] = tube_section(180, 0.0032, 0, 0.1, 0);
        c.section[1][1] = tube_section(20, 0.0032, 0, 0.1, 0);
        c.section[1][0].density = 1e-4;
        tube[0].density = tube[1].density = tube[2].density = 1e-6;
        c.section[1][1].density = 1;
        double weight = PI / 4 * 0.1 * 0.1 * 20 * g;
        c.options.wire = tool_options(tube, 3, fine ? 80 : 40, 0);
        c.options.wire.gravity = vec3(0, g, 0);          // the bend leads down
        c.inner[0] = tool_options(c.section[1], 2, fine ? 240 : 120, 40 + arc - 3);
        c.options.inner_friction[0] = 0.1;
        c.options.wire.damping_mass = 0.05;
        start(&c, 1, false);
        StepCommand rest[2] = {{0}};
        for (int k = 0; k < 800; k++)
            step_tools(c.stepper, rest);
        move_tool(c.stepper, 1, 33, 0, WHOLE_OR_SHORT(3300, 1100), 200);
        double up = -move_tool(c.stepper, 1, -2, 0, WHOLE_OR_SHORT(2000, 1000), 0)->push[1] / weight;
        double down = -move_tool(c.stepper, 1, 2, 0, WHOLE_OR_SHORT(2000, 1000), 0)->push[1] / weight, exact = exp(0.1 * PI / 2);
        print_message("%d elements: %.5f of the weight up (%.5f), %.5f down (%.5f)\n", fine ? 80 : 40, up, exact, down, 1 / exact);
        assert_true(fabs(up / exact - 1) < 0.005 && fabs(down * exact - 1) < 0.005);
        stepper_destroy(c.stepper);
    }
}

static void friction_acts_between_neighbours(void **state)
{
    (void)state;
    double push[2][3];
    for (int moved = 0; moved < 2; moved++) {
        WireSection tube[3] = {tube_section(30, 1e4, 0, 1.6, 1.0), tube_section(20 * PI / 2, 1e4, 1.0 / 20, 1.6, 1.0), tube_section(30, 1e4, 0, 1.6, 1.0)};
        Coaxial c = {0};
        c.section[1][0] = tube_section(150, 30, 0, 0.9, 0.46);
        c.section[2][0] = tube_section(200, 20, 0, 0.36, 0);
        c.options.wire = tool_options(tube, 3, 60, 0);
        c.inner[0] = tool_options(c.section[1], 1, 90, 75);
        c.inner[1] = tool_options(c.section[2], 1, 120, 85);
        c.options.inner_friction[0] = c.options.inner_friction[1] = 0.1;
        start(&c, 2, false);
        StepCommand rest[3] = {{0}};
        for (int k = 0; k < 600; k++)
            step_tools(c.stepper, rest);
        // the wire alone, or wire and middle tool together, without slip between these two
        StepCommand pull[3] = {{0}, {moved ? -0.005 : 0, 0}, {-0.005, 0}};
        const StepReport *r = NULL;
        for (int k = 0; k < 400; k++)
            r = step_tools(c.stepper, pull);
        for (int k = 0; k < 3; k++)
            push[moved][k] = r->push[k];
        StepEnergy e = stepper_energy(c.stepper);
        print_message("%s: push %.4f %.4f %.4f N, friction takes %.2e of the hands' %.2e mJ a step\n", moved ? "both" : "wire alone", r->push[0], r->push[1],
                      r->push[2], e.friction, e.hand);
        assert_true(e.friction > 0 && fabs(e.friction / e.hand - 1) < 0.1);
        stepper_destroy(c.stepper);
    }
    assert_true(fabs(push[0][2] / (-0.191 * 20 / 65.96) - 1) < 0.1 && fabs(push[0][1]) < 0.1 * fabs(push[0][2]));
    assert_true(fabs((push[1][1] + push[1][2]) / (-0.191 * 50 / 65.96) - 1) < 0.1);
}

// The scene rotated by `turn`, or mirrored at the plane of its first bend.
static Vessel *winding_tube_as(Quat turn, bool mirrored)
{
    TubePiece piece[] = {line_piece(20), arc_piece(15, 90, 0), line_piece(10), arc_piece(10, 90, mirrored ? -90 : 90), line_piece(30)};
    TubeOptions options = {
        .direction = quat_rotate(turn, vec3(1, 0, 0)), .normal = quat_rotate(turn, vec3(0, 1, 0)), .radius = 2, .piece_count = 5, .piece = piece};
    Faults faults = {0};
    Vessel *vessel = tube_vessel_create(&options, "test", &faults);
    assert_non_null(vessel);
    return vessel;
}

static Vessel *winding_tube(void) { return winding_tube_as((Quat){1, 0, 0, 0}, false); }

static void three_in_a_tube_as(Coaxial *c, const Vessel *vessel, Quat turn)
{
    *c = (Coaxial){0};
    c->section[0][0] = tube_section(150, 60, 0, 1.2, 1.0);
    c->section[0][1] = tube_section(10, 20, 0.1, 1.2, 1.0);
    c->section[1][0] = tube_section(200, 30, 0, 0.7, 0.5);
    c->section[1][1] = tube_section(20, 5, 0.02, 0.7, 0.5);
    c->section[2][0] = tube_section(220, 20, 0, 0.36, 0);
    c->section[2][1] = tube_section(30, 1, 0.1, 0.36, 0);
    c->options = (StepperOptions){.contact = contact_default_options(), .vessel = vessel, .wall_friction = 0.05, .inner_friction = {0.05, 0.05}};
    c->options.wire = tool_options(c->section[0], 2, 80, 1);
    c->options.wire.damping_stiffness = 0.2;
    c->options.wire.damping_mass = 1e-3;
    c->options.wire.direction = quat_rotate(turn, vec3(1, 0, 0));
    c->options.wire.normal = quat_rotate(turn, vec3(0, 1, 0));
    c->inner[0] = tool_options(c->section[1], 2, 100, 2);
    c->inner[1] = tool_options(c->section[2], 2, 120, 3);
    start(c, 2, true);
}

static void three_in_a_tube(Coaxial *c, const Vessel *vessel) { three_in_a_tube_as(c, vessel, (Quat){1, 0, 0, 0}); }

static void wire_first(int i, StepCommand *command)
{
    int phase = i / 500 % 4;
    for (int k = 0; k < 3; k++)
        command[k] = (StepCommand){0};
    if (phase < 3)
        command[2 - phase] = (StepCommand){0.03, phase == 0 ? 0.003 : 0};
    else
        for (int k = 0; k < 3; k++)
            command[k].advance = -0.01;
}

static void three_tools_stay_in_the_tube(void **state)
{
    (void)state;
    Vessel *vessel = winding_tube();
    Coaxial c;
    three_in_a_tube(&c, vessel);
    double deepest = 0;
    int nodes = 0, stuck = 0;
    for (int i = 0; i < WHOLE_OR_SHORT(6000, 2000); i++) {
        StepCommand command[3];
        wire_first(i, command);
        const StepReport *r = step_tools(c.stepper, command);
        assert_false(r->flags & (STEP_DIVERGED | STEP_DEEP));
        stuck += (r->flags & STEP_NOT_CONVERGED) != 0;
        deepest = fmax(deepest, r->penetration);
        nodes = stepper_state(c.stepper)->node_count > nodes ? stepper_state(c.stepper)->node_count : nodes;
        assert_true(fabs(r->push[0]) < 2 && fabs(r->push[1]) < 2 && fabs(r->push[2]) < 2);
    }
    print_message("deepest %.4f mm, at most %d nodes of %d, %d steps stopped at the contact solve's cap\n", deepest, nodes, stepper_node_capacity(c.stepper),
                  stuck);
    assert_true(deepest < 0.05 && nodes > 85 && stuck < 60);
    // the nodes of all tools lie on one line, in order, at the distances that they have along the tool
    for (int k = 0; k < 3; k++) {
        ToolNode node[122];
        int count = stepper_tool_nodes(c.stepper, k, NULL);
        assert_true(count <= 122);
        stepper_tool_nodes(c.stepper, k, node);
        for (int j = 1; j < count; j++) {
            double apart = node[j].s - node[j - 1].s, distance = vec3_distance(node[j].position, node[j - 1].position);
            assert_true(distance < 1.001 * apart && distance > 0.93 * apart);
        }
    }
    stepper_destroy(c.stepper);
    vessel->destroy(vessel);
}

// Law 6: a scene that is rotated, or mirrored with opposite twists, gives the same motion.
static void turned_and_mirrored_scenes_go_the_same_way(void **state)
{
    (void)state;
    enum { STEPS = WHOLE_OR_SHORT(2500, 600) };
    Quat turn[3] = {{1, 0, 0, 0}, quat_from_rotation_vector(vec3(0.7, -1.9, 0.4)), {1, 0, 0, 0}};
    double push[3][3];
    Vec3 tip[3];
    for (int i = 0; i < 3; i++) {
        bool mirrored = i == 2;
        Coaxial c;
        Vessel *vessel = winding_tube_as(turn[i], mirrored);
        three_in_a_tube_as(&c, vessel, turn[i]);
        for (int k = 0; k < STEPS; k++) {
            StepCommand command[3];
            wire_first(k, command);
            for (int tool = 0; tool < 3; tool++)
                command[tool].twist *= mirrored ? -1 : 1;
            const StepReport *r = step_tools(c.stepper, command);
            for (int tool = 0; tool < 3; tool++)
                push[i][tool] = r->push[tool];
        }
        const WireState *w = stepper_state(c.stepper);
        tip[i] = quat_rotate(quat_conjugate(turn[i]), w->position[w->node_count - 1]);
        tip[i].z *= mirrored ? -1 : 1;
        print_message("%s: tip %.7f %.7f %.7f, pushes %.7f %.7f %.7f\n",
                      i == 0   ? "as it is"
                      : i == 1 ? "turned"
                               : "mirrored",
                      tip[i].x, tip[i].y, tip[i].z, push[i][0], push[i][1], push[i][2]);
        stepper_destroy(c.stepper);
        vessel->destroy(vessel);
    }
    for (int i = 1; i < 3; i++) {
        assert_true(vec3_distance(tip[i], tip[0]) < 1e-4);
        for (int tool = 0; tool < 3; tool++)
            assert_true(fabs(push[i][tool] - push[0][tool]) < 1e-4);
    }
}

static void a_restored_run_repeats(void **state)
{
    (void)state;
    Vessel *vessel = winding_tube();
    Coaxial c;
    StepCommand command[3];
    three_in_a_tube(&c, vessel);
    const int before = WHOLE_OR_SHORT(1200, 600);
    for (int i = 0; i < before; i++) {
        wire_first(i, command);
        step_tools(c.stepper, command);
    }
    Checkpoint *kept = stepper_save(c.stepper, NULL);
    uint64_t hash[2];
    for (int again = 0; again < 2; again++) {
        for (int i = before; i < 2 * before; i++) {
            wire_first(i, command);
            step_tools(c.stepper, command);
        }
        hash[again] = stepper_hash(c.stepper);
        stepper_restore(c.stepper, kept);
    }
    assert_true(hash[0] == hash[1]);
    checkpoint_free(kept);
    stepper_destroy(c.stepper);
    vessel->destroy(vessel);
}

static void hands_stop_and_slip(void **state)
{
    (void)state;
    Coaxial c = {0};
    c.section[0][0] = tube_section(30, 60, 0, 1, 0.8);
    c.section[1][0] = tube_section(60, 20, 0, 0.5, 0);
    c.options.wire = tool_options(c.section[0], 1, 15, 0);
    c.inner[0] = tool_options(c.section[1], 1, 30, 10);
    start(&c, 1, false);
    // pulled out of the hub it stops with its tip at the hub, pushed in with its end at the hub
    StepCommand pull[2] = {{0}, {-0.5, 0}}, push[2] = {{0}, {0.5, 0}};
    unsigned flags = 0;
    for (int i = 0; i < 40; i++)
        flags |= step_tools(c.stepper, pull)->flags;
    assert_true(flags == STEP_FULLY_WITHDRAWN && fabs(stepper_tool_inserted(c.stepper, 1)) < 1e-9);
    flags = 0;
    for (int i = 0; i < 200; i++)
        flags |= step_tools(c.stepper, push)->flags;
    assert_true(flags == STEP_FULLY_INSERTED && fabs(stepper_tool_inserted(c.stepper, 1) - 60) < 1e-9);
    stepper_destroy(c.stepper);
    // a tool whose end would lie inside the hub
    char why[256];
    c.inner[0].inserted = 10;
    c.section[1][0].length = 35;
    c.options.wire.has_sheath = true;
    c.options.wire.inserted = 0;
    c.options.wire.fix_count = 0;
    assert_null(stepper_create(&c.options, why, sizeof why));
    assert_non_null(strstr(why, "too short"));
}

// Nodes and unknowns are added and removed as borders, bends and tips pass the mouth, the tip and nodes: the energy of the same pose must be equal before and
// after. It may change by the strain of the last length up to a node, by the error of a line of eight parts, and because a border is spread only after its node
// has left the mouth.
static void events_leave_the_energy(void **state)
{
    (void)state;
    Coaxial c = {0};
    c.section[0][0] = tube_section(105, 60, 0, 1, 0.8);
    c.section[0][1] = tube_section(15, 60, 0.06, 1, 0.8);
    c.section[1][0] = tube_section(165, 20, 0, 0.5, 0);
    c.section[1][1] = tube_section(9, 20, 0.1, 0.5, 0);
    c.section[1][2] = tube_section(6, 20, 0.05, 0.5, 0);
    c.options.wire = tool_options(c.section[0], 2, 57, 1);
    c.inner[0] = tool_options(c.section[1], 3, 121, 1);
    start(&c, 1, true);
    double most[2] = {0}, highest = 0;
    int events = 0;
    const int fast = WHOLE_OR_SHORT(1, 2);
    for (int i = 0; i < 7150; i += i < 6000 ? fast : 1) {
        StepCommand command[2] = {{0}};
        if (i < 2000)
            command[0].advance = command[1].advance = 0.01 * fast;
        else if (i < 4000)
            command[1] = (StepCommand){0.01 * fast, 0.001 * fast};
        else if (i < 6000)
            command[1].advance = -0.02 * fast;
        else         // the catheter is pulled back to the mouth and pushed out again around a wire that is rotated in it
            command[0].advance = i < 7050 ? -0.02 : 0.02;
        double before = stepper_elastic_energy(c.stepper);
        step_feed_tools(c.stepper, command, 0);
        double after = stepper_elastic_energy(c.stepper);
        events += after != before;
        most[i >= 6000] = fmax(most[i >= 6000], fabs(after - before));
        highest = fmax(highest, after);
        step_solve(c.stepper);
        assert_int_equal(step_report(c.stepper)->flags, 0);
    }
    // the tip is held until it is a fiftieth of an element past the mouth, by the force that straightens this length of both
    double at_mouth = (0.5 * 60 * 0.06 * 0.06 + 0.5 * 20 * 0.1 * 0.1) * 0.02 * 120 / 57;
    print_message("%d events, at most %.1e of %.3f mJ, at the mouth %.1e (%.1e)\n", events, most[0], highest, most[1], at_mouth);
    assert_true(events >= 40 && most[0] < 1e-4 * highest && most[1] < at_mouth);
    stepper_destroy(c.stepper);
}

// The end of a tool stops at the hub of the tool around it, which is behind the outermost hub.
static void end_stops_at_the_hub_around_it(void **state)
{
    (void)state;
    Coaxial c = {0};
    c.section[0][0] = tube_section(30, 60, 0, 1.4, 1.2);
    c.section[1][0] = tube_section(60, 40, 0, 1, 0.8);
    c.section[2][0] = tube_section(80, 20, 0, 0.5, 0);
    c.options.wire = tool_options(c.section[0], 1, 15, 0);
    c.inner[0] = tool_options(c.section[1], 1, 30, 35);
    c.inner[1] = tool_options(c.section[2], 1, 40, 45);
    start(&c, 2, false);
    const StepCommand push[3] = {[2] = {0.5, 0}}, pull[3] = {[1] = {-0.5, 0}};
    unsigned flags = 0;
    for (int i = 0; i < 40; i++)
        flags |= step_tools(c.stepper, push)->flags;
    assert_int_equal(flags, STEP_FULLY_INSERTED);
    assert_true(fabs(stepper_tool_inserted(c.stepper, 2) - 55) < 1e-9);
    // and moves back with that hub
    for (int i = 0; i < 10; i++)
        step_tools(c.stepper, pull);
    assert_true(fabs(stepper_tool_inserted(c.stepper, 1) - 30) < 1e-9 && fabs(stepper_tool_inserted(c.stepper, 2) - 50) < 1e-9);
    stepper_destroy(c.stepper);
}

static double furthest_moved(const Vec3 *before, const WireState *w, int shift, int count)
{
    double most = 0;
    for (int i = 0; i < count; i++)
        most = fmax(most, vec3_distance(before[i], w->position[w->node_count - 1 - shift - i]));
    return most;
}

// A catheter is pulled back over its wire and exchanged for a longer one; then the wire is exchanged for a stiff one. The tools that stay inside do not move.
static void tools_are_exchanged_at_the_hub(void **state)
{
    (void)state;
    Vessel *vessel = winding_tube();
    Coaxial c = {0};
    WireSection longer[2] = {tube_section(170, 200, 0, 1.4, 1.0), tube_section(12, 60, 0.03, 1.4, 1.0)},
                stiff[2] = {tube_section(360, 150, 0, 0.6, 0), tube_section(30, 2, 0.1, 0.6, 0)}, wide = tube_section(100, 50, 0, 1.2, 1.0);
    c.section[0][0] = tube_section(150, 60, 0, 1.2, 1.0);
    c.section[0][1] = tube_section(10, 20, 0.1, 1.2, 1.0);
    c.section[1][0] = tube_section(350, 20, 0, 0.36, 0);
    c.section[1][1] = tube_section(30, 1, 0.1, 0.36, 0);
    c.options = (StepperOptions){.contact = contact_default_options(),
                                 .vessel = vessel,
                                 .wall_friction = 0.05,
                                 .inner_friction = {0}}; // friction would hold a twist that the old tool took with it
    c.options.wire = tool_options(c.section[0], 2, 80, 1);
    c.options.wire.damping_stiffness = 0.2;
    c.options.wire.damping_mass = 1e-3;
    c.inner[0] = tool_options(c.section[1], 2, 120, 3);
    StepperSpare spare[3] = {{.tool = 0, .wire = tool_options(longer, 2, 100, 0), .friction_inside = 0.03},
                             {.tool = 1, .wire = tool_options(stiff, 2, 140, 0)},
                             {.tool = 0, .wire = tool_options(&wide, 1, 40, 0), .friction_inside = 0.05}};
    c.options.spare = spare;
    c.options.spare_count = 3;
    start(&c, 1, true);
    Stepper *s = c.stepper;
    assert_true(stepper_exchange(s, 0, 4) == EXCHANGE_NO_SUCH_TOOL && stepper_exchange(s, 2, 0) == EXCHANGE_NO_SUCH_TOOL);
    move_tool(s, 1, 50, 1, WHOLE_OR_SHORT(2000, 700), 50);
    move_tool(s, 0, 30, 0, WHOLE_OR_SHORT(1500, 500), 50);
    assert_true(stepper_exchange(s, 0, 1) == EXCHANGE_INSERTED && stepper_exchange(s, 1, 1) == EXCHANGE_INSERTED);
    move_tool(s, 0, -30.99, 0, WHOLE_OR_SHORT(2000, 700), 200);
    const WireState *w = stepper_state(s);
    Vec3 before[60];
    double push = step_report(s)->push[1], elastic = stepper_elastic_energy(s);
    int outside = w->node_count - 82, nodes = w->node_count;
    assert_true(outside > 10 && outside < 60);
    for (int i = 0; i < outside; i++)
        before[i] = w->position[w->node_count - 1 - i];
    Checkpoint *kept = stepper_save(s, NULL);
    assert_true(stepper_exchange(s, 0, 1) == EXCHANGE_DONE && stepper_fitted(s, 0) == 1 && w->node_count == nodes + 20);
    const StepReport *r = move_tool(s, 1, 0, 0, 1, 0);
    double moved = furthest_moved(before, w, 0, outside), change = r->push[1] - push;
    print_message("catheter: nodes move by %.1e mm, the wire's push changes by %.1e N, stored energy of what is inserted by %.1e mJ\n", moved, change,
                  stepper_elastic_energy(s) - elastic - 0.5 * (60 * 0.03 * 0.03 * 12 - 20 * 0.1 * 0.1 * 10));
    assert_true(moved < 1e-4 && fabs(change) < 1e-3);
    uint64_t hash = stepper_hash(s);
    stepper_restore(s, kept);
    assert_true(stepper_fitted(s, 0) == 0 && w->node_count == nodes);
    assert_true(stepper_exchange(s, 0, 1) == EXCHANGE_DONE);
    move_tool(s, 1, 0, 0, 1, 0);
    assert_true(stepper_hash(s) == hash);
    // the new catheter is inserted over the wire, then the wire is pulled out and a stiff one is inserted
    move_tool(s, 0, 25, 0, WHOLE_OR_SHORT(1500, 500), 50);
    move_tool(s, 1, -(stepper_tool_inserted(s, 1) - stepper_tool_inserted(s, 0) + 182) + 0.2, 0, WHOLE_OR_SHORT(8000, 1500), 200);
    for (int i = 0; i < 40; i++)
        before[i] = w->position[w->node_count - 1 - i];
    assert_true(stepper_exchange(s, 1, 1) == EXCHANGE_DONE);
    r = move_tool(s, 1, 0, 0, 1, 0);
    moved = furthest_moved(before, w, 0, 40);
    print_message("wire: nodes move by %.1e mm, the new one's push %.1e N\n", moved, r->push[1]);
    assert_true(moved < 1e-4 && fabs(r->push[1]) < 1e-3);
    move_tool(s, 1, 200, 0, WHOLE_OR_SHORT(8000, 1500), 50);
    assert_true(stepper_tool_inserted(s, 1) > 30 && !(step_report(s)->flags & STEP_DIVERGED));
    checkpoint_free(kept);
    stepper_destroy(s);
    vessel->destroy(vessel);
}

// A bend that is still 9 mm inside pulls itself out of its catheter with 0.075 N; the 6 mm outside did so with 0.045 N. The tools are in a sheath, so that
// hands can slip.
static const double SOFTER = 0.0774597;      // [1/mm]
static void start_kick(Coaxial *c, double limit, double valve, double inner_density)
{
    c->section[0][0] = tube_section(120, 60, 0, 1, 0.8);
    c->section[0][0].density = 1;    // slow enough for steps of 1 ms
    c->section[1][0] = tube_section(165, 20, 0, 0.5, 0);
    c->section[1][1] = tube_section(9, 20, 0.1, 0.5, 0);
    c->section[1][2] = tube_section(6, 20, SOFTER, 0.5, 0);
    for (int i = 0; i < 3; i++)
        c->section[1][i].density = inner_density;
    c->options.wire = tool_options(c->section[0], 1, 57, 60);
    c->inner[0] = tool_options(c->section[1], 3, 121, 60);
    c->options.wire.damping_mass = 0;
    c->options.wire.damping_stiffness = 0.2;
    c->options.wire.hand_limit = limit;
    c->inner[0].valve_friction = valve;
    start(c, 1, true);
    move_tool(c->stepper, 1, 6.02, 0, 602, 0);
}

// The outermost hand holds the push of its own tool, not the sum of all (0 here), and slips above its limit of 0.05 N while the other hand holds its tool: the
// catheter moves back by 9 mm with 0.025 N, and is then braked by 0.05 N over 4.5 mm. The difference falls with the step size, except for the energy that the J
// takes along.
static void the_outermost_hand_slips_by_its_own_push(void **state)
{
    (void)state;
    double error[2];
    for (int fine = 0; fine < WHOLE_OR_SHORT(2, 1); fine++) {
        Coaxial c = {0};
        c.options.dt = fine ? 0.5 : 1;
        start_kick(&c, 0.05, 0, 2e-4);
        StepCommand none[2] = {{0}};
        double slipping = 0;
        for (double t = 0; t < 1500; t += c.options.dt) {
            const StepReport *r = step_tools(c.stepper, none);
            slipping += r->flags & STEP_HAND_SLIPS ? c.options.dt : 0;
            assert_true(fabs(r->push[0]) < 0.05 * (1 + 1e-6) || !(r->flags & STEP_HAND_SLIPS));
            assert_true(fabs(stepper_tool_inserted(c.stepper, 1) - 66.02) < 1e-6);
        }
        Vec3 after = stepper_state(c.stepper)->position[stepper_state(c.stepper)->node_count - 1];
        double r = 1 / SOFTER, end = 0.9 + 6 * SOFTER;
        Vec3 tip = vec3(51.02 + 10 * sin(0.9) + r * (sin(end) - sin(0.9)), 10 * (1 - cos(0.9)) + r * (cos(0.9) - cos(end)), 0);
        error[fine] = stepper_tool_inserted(c.stepper, 0) - 46.53;
        print_message("steps of %.1f ms: slipped for %.0f ms, back to %.3f mm (46.53); the tip of the other is %.1e mm from where it would be\n", c.options.dt,
                      slipping, 46.53 + error[fine], vec3_distance(after, tip));
        assert_true(slipping > 100 && slipping < 1000 && vec3_distance(after, tip) < 1);
        stepper_destroy(c.stepper);
    }
    const int finest = WHOLE_OR_SHORT(1, 0);
    assert_true(error[finest] > 0 && (!WHOLE_RUN || error[1] < error[0]) && error[finest] < 0.015 * 13.49);
}

// No hand holds the J. A valve of 0.1 N holds it and moves it with the catheter's hub, so that the catheter's hand has no force; a valve of 0.03 N lets it
// slide out.
static void a_valve_holds_what_no_hand_does(void **state)
{
    (void)state;
    for (int weak = 0; weak < 2; weak++) {
        Coaxial c = {0};
        start_kick(&c, 0, weak ? 0.03 : 0.1, weak ? 1 : 2e-4);
        move_tool(c.stepper, 1, 0, 0, 1, 400);
        StepCommand command[2] = {{0}};
        double push = 0;
        int slid_out = -1;
        for (int i = 0; i < 1000; i++) {
            command[0].advance = i < 500 ? 0.005 : 0;
            const StepReport *r = step_released(c.stepper, command, 2);
            assert_true(!(r->flags & (STEP_DIVERGED | STEP_HAND_SLIPS | STEP_LIMITED)));
            assert_true(r->push[1] == 0);
            if (i == 400)
                push = r->push[0];
            if (slid_out < 0 && stepper_tool_inserted(c.stepper, 1) - stepper_tool_inserted(c.stepper, 0) > 15)
                slid_out = i;
        }
        double apart = stepper_tool_inserted(c.stepper, 1) - stepper_tool_inserted(c.stepper, 0);
        print_message("valve of %.2f N: hand feels %.4f N, tips %.3f mm apart (at first 6), bend out after %d steps\n", weak ? 0.03 : 0.1, push, apart,
                      slid_out);
        if (weak)
            assert_true(slid_out > 0 && apart > 15);
        else
            assert_true(fabs(apart - 6.02) < 1e-6 && fabs(stepper_tool_inserted(c.stepper, 1) - 68.52) < 1e-6);
        stepper_destroy(c.stepper);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_straight_wire_in_a_curved_tube),
        cmocka_unit_test(turned_tubes_follow_up_to_the_fold),
        cmocka_unit_test(a_bend_leaves_the_catheter),
        cmocka_unit_test(equal_bends_with_flush_tips_rest),
        cmocka_unit_test(tools_leave_the_sheath),
        cmocka_unit_test(a_softer_part_turned_in_the_sheath_does_work),
        cmocka_unit_test(friction_in_a_bend),
        cmocka_unit_test(friction_acts_between_neighbours),
        cmocka_unit_test(three_tools_stay_in_the_tube),
        cmocka_unit_test(a_restored_run_repeats),
        cmocka_unit_test(hands_stop_and_slip),
        cmocka_unit_test(end_stops_at_the_hub_around_it),
        cmocka_unit_test(events_leave_the_energy),
        cmocka_unit_test(a_thread_over_a_bend),
        cmocka_unit_test(tools_are_exchanged_at_the_hub),
        cmocka_unit_test(turned_and_mirrored_scenes_go_the_same_way),
        cmocka_unit_test(the_outermost_hand_slips_by_its_own_push),
        cmocka_unit_test(a_valve_holds_what_no_hand_does),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

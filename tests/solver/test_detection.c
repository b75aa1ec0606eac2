// Which points of the wire query the wall, and which need not: points between nodes, sleepers (points that are not queried for some steps), far points, and how
// smoothly contacts pass from one point to the next.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "recon/fit/lim_fit.h"
#include "recon/phantom/phantom.h"
#include "solver/step_internal.h"
#include "tests/short_run.h"
#include "tube_scene.h"

static Vec3 some(double *seed)
{
    double v[3];
    for (int k = 0; k < 3; k++)
        v[k] = 2 * (*seed = fmod(*seed * 9301 + 0.49297, 1)) - 1;
    return vec3(v[0], v[1], v[2]);
}

static Vec3 turned(Vec3 v, Vec3 by) { return quat_rotate(quat_from_rotation_vector(by), v); }

// Weights and levers are the derivative of the cubic itself, by central differences; the cubic passes its nodes with their tangents.
static void levers_follow_the_cubic(void **state)
{
    (void)state;
    double seed = 0.37, worst = 0, h = 1e-6;
    for (int trial = 0; trial < 200; trial++) {
        double length = 0.7 + 9 * fabs(some(&seed).x), radius = 0.18;
        int count = slot_count_of(length), k = (int)(0.999 * count * fabs(some(&seed).x));
        Slot slot = slot_make(0, length, k, count, radius, -1);
        Vec3 x1 = some(&seed), x2 = vec3_add(x1, vec3_scale(some(&seed), length)), t1 = vec3_unit(some(&seed)), t2 = vec3_unit(some(&seed));
        Vec3 u1 = some(&seed), u2 = some(&seed), r1 = some(&seed), r2 = some(&seed);
        bool mouth = trial % 2 == 1 && slot.xi > 0.2;
        double behind = -0.3 * slot.xi * length;
        SlotPlace at, sides[2];
        for (int side = 0; side < 3; side++) {
            double e = side == 2 ? 0 : side == 1 ? h : -h;
            SlotPlace *p = side == 2 ? &at : &sides[side];
            Vec3 y2 = vec3_add_scaled(x2, e, u2), s2 = turned(t2, vec3_scale(r2, e));
            if (mouth)
                assert_true(slot_place_at_mouth(&slot, length, behind, x1, t1, y2, s2, p));
            else
                *p = slot_place(&slot, length, vec3_add_scaled(x1, e, u1), turned(t1, vec3_scale(r1, e)), y2, s2);
        }
        Vec3 slope = vec3_scale(vec3_sub(sides[1].position, sides[0].position), 1 / (2 * h));
        Vec3 mine = vec3_add(vec3_scale(u2, at.weight), vec3_cross(r2, at.lever[1]));
        if (!mouth)
            mine = vec3_add(mine, vec3_add(vec3_scale(u1, 1 - at.weight), vec3_cross(r1, at.lever[0])));
        worst = fmax(worst, vec3_distance(slope, mine));
    }
    print_message("levers against differences of the cubic: %.1e\n", worst);
    assert_true(worst < 1e-8);
    Slot end = slot_make(0, 3, 0, 1, 0.18, -1);
    end.xi = 1, end.weight = 1, end.near = end.far = 0;
    SlotPlace p = slot_place(&end, 3, vec3(0, 0, 0), vec3(1, 0, 0), vec3(2, 1, 0), vec3(0, 1, 0));
    assert_true(vec3_distance(p.position, vec3(2, 1, 0)) < 1e-15 && vec3_distance(p.tangent, vec3(0, 1, 0)) < 1e-15);
    assert_int_equal(slot_count_of(0.5), 0);
    assert_int_equal(slot_count_of(0.6), 0);
    assert_int_equal(slot_count_of(1), 1);
    assert_int_equal(slot_count_of(100), 15);
}

// [mm] largest distance by which the cubic through the nodes, sampled a hundred times per element, is outside the tube; the element across the mouth counts
// from the mouth on.
static double deepest_of_curve(const Stepper *s, const Vessel *tube, double radius)
{
    const WireState *w = stepper_state(s);
    double deepest = -HUGE_VAL;
    VesselMemory memory = {.node = -1};
    for (int i = s->first_free > 0 ? s->first_free - 1 : 0; i + 1 < w->node_count; i++) {
        Vec3 x1 = w->position[i], x2 = w->position[i + 1], t1 = quat_rotate(w->orientation[i], vec3(1, 0, 0)),
             t2 = quat_rotate(w->orientation[i + 1], vec3(1, 0, 0));
        double length = s->wire.length[i];
        if (i + 1 == s->first_free) {
            length += stepper_sheath_coordinate(s, i);
            x1 = s->entry.mouth, t1 = s->entry.axis[0];
        }
        for (int k = 1; k <= 100; k++) {
            double x = k / 100.0, y = 1 - x;
            Vec3 p = vec3_add(vec3_add_scaled(vec3_scale(x1, y * y * (1 + 2 * x)), x * x * (3 - 2 * x), x2),
                              vec3_scale(vec3_add_scaled(vec3_scale(t1, x * y * y), -x * x * y, t2), length));
            VesselHit hit;
            vessel_query(tube, 1, &p, HUGE_VAL, &memory, &hit);
            if (!(hit.flags & VESSEL_OPEN_END))
                deepest = fmax(deepest, radius - hit.gap);
        }
    }
    return deepest;
}

// Elements from short to much longer than the bend allows: in a quasi-static push no point of the wire is ever outside by more than 0.05 mm, and the push
// converges.
static void coarse_elements_stay_inside(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    static const struct {
        const char *name;
        double bend, radius, lead;
        int arcs;
    } course[] = {{"bend 15", 15, 0.68, 12, 1}, {"S 15", 15, 0.68, 12, 2}, {"bend 8", 8, 0.9, 12, 1}, {"S 6", 6, 1.25, 12, 2}};
    static const double size[] = {10, 5, 2, 1, 0.5};
    for (int c = 0; c < 4; c++) {
        TubePiece piece[4] = {line_piece(course[c].lead), arc_piece(course[c].bend, 90, 0), arc_piece(course[c].bend, 90, 180), line_piece(60)};
        if (course[c].arcs == 1)
            piece[2] = piece[3];
        Vessel *tube = tube_of(piece, 2 + course[c].arcs, course[c].radius);
        double push[5];
        for (int k = 0; k < 5; k++) {
            Bench b;
            double length = 60, in = course[c].lead + 1.2 * course[c].arcs * course[c].bend * PI / 2, deepest = 0, sum = 0, reported = 0;
            bench_in_tube(&b, tube, 0, length, (int)(length / size[k]), 2, QUASI_STATIC);
            Stepper *s = bench_make(&b);
            int steps = (int)((in - 2) / 0.05), count = 0;
            for (int i = 0; i < steps; i++) {
                const StepReport *r = step_once(s, 0.05, 0);
                reported = fmax(reported, r->penetration);
                if (i % 4 == 0)
                    deepest = fmax(deepest, deepest_of_curve(s, tube, 0.18));
                if (i >= steps * 3 / 4)
                    sum += r->proximal_force, count++;
            }
            push[k] = sum / count;
            print_message("%-8s elements of %4.1f mm: curve %+.4f mm outside at worst (points: %.4f), mean push %.5f N\n", course[c].name, size[k], deepest,
                          reported, push[k]);
            stepper_destroy(s);
            assert_true(deepest < 0.02 && reported < 0.02);
        }
        static const double allowed[4] = {0.02, 5e-3, 3e-3, 3e-3};
        for (int k = 0; k < 4; k++)
            assert_true(fabs(push[k] / push[4] - 1) < allowed[k]);
        tube->destroy(tube);
    }
}

// --- a ridge between two nodes ---

// A floor at z = 0 with a ridge across it: a cylinder along y at x = RIDGE_AT that protrudes by 0.2 mm, half as wide as an element.
static const double RIDGE_AT = 2.25, RIDGE_RADIUS = 0.5, RIDGE_DEEP = 0.3;

static void ridge_query(const Vessel *v, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    (void)v, (void)reach;
    for (int i = 0; i < count; i++) {
        double x = point[i].x - RIDGE_AT, z = point[i].z + RIDGE_DEEP, r = sqrt(x * x + z * z);
        Vec3 n = {x / r, 0, z / r};
        memory[i].node = 0;
        hit[i] = (VesselHit){.gap = point[i].z, .normal = {0, 0, 1}};
        if (r - RIDGE_RADIUS < hit[i].gap)
            hit[i] = (VesselHit){.gap = r - RIDGE_RADIUS, .normal = n, .hessian = {n.z * n.z / r, 0, -n.x * n.z / r, 0, 0, n.x * n.x / r}};
    }
}

static int ridge_locate(const Vessel *v, Vec3 point, int from)
{
    (void)v, (void)point, (void)from;
    return 0;
}

// Both nodes of an element see a flat floor, and the wire falls on the ridge between them.
static void a_ridge_between_nodes_holds(void **state)
{
    (void)state;
    Vessel ridge = {.kind = "ridge", .query = ridge_query, .locate = ridge_locate};
    Bench b;
    bench_start(&b, 6, 4, 1);
    b.options.vessel = &ridge;
    b.options.wire.fix_count = 0;
    b.options.wire.start = vec3(0, 0, 0.4);
    b.options.wire.gravity = vec3(0, 0, -9.81e-3);
    Stepper *s = bench_make(&b);
    double least = HUGE_VAL, radius = s->wire.radius[0], reported = 0;
    for (int i = 0; i < 100; i++) {
        reported = fmax(reported, step_once(s, 0, 0)->penetration);
        for (int k = 0; k < s->points.slot_count; k++) {
            const Slot *slot = &s->points.slot[k];
            const WireState *w = stepper_state(s);
            int e = slot->element;
            Vec3 x = slot_place(slot, s->wire.length[e], w->position[e], quat_rotate(w->orientation[e], vec3(1, 0, 0)), w->position[e + 1],
                                quat_rotate(w->orientation[e + 1], vec3(1, 0, 0)))
                         .position;
            VesselMemory memory = {.node = 0};
            VesselHit hit;
            ridge_query(&ridge, 1, &x, 1, &memory, &hit);
            least = fmin(least, hit.gap - radius);
        }
    }
    print_message("a wire of 1.5 mm elements fallen on a ridge between two nodes: %.4f mm deep there (reported %.4f)\n", -least, reported);
    assert_true(least > -0.02);
    stepper_destroy(s);
}

// --- sleepers ---

typedef struct CountingVessel {
    Vessel vessel;
    const Vessel *real;
    long *asked;
} CountingVessel;

static void count_query(const Vessel *v, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    const CountingVessel *c = (const CountingVessel *)v;
    *c->asked += count;
    vessel_query(c->real, count, point, reach, memory, hit);
}

static int count_locate(const Vessel *v, Vec3 point, int from)
{
    const CountingVessel *c = (const CountingVessel *)v;
    return c->real->locate(c->real, point, from);
}

typedef struct Run {
    const char *name;
    double radius, advance, twist;       // [mm], [mm] and [rad] a step
    double size;                         // [mm] of an element
    int in, out;                         // steps
    double share;                        // largest fraction of queries left: at 200 mm/s no point sleeps long, and a point that wakes in a step queries twice
} Run;

// A J-tip in a wide tube with bends, run twice: once with sleepers, once querying every point in every step; sometimes the first run is restored from a
// checkpoint into a separate stepper.
static void sleepers_miss_nothing(void **state)
{
    (void)state;
    static const Run run[] = {
        {"slow, turning", 4, 0.02, 0.006, 1, 1500, 200, 0.4},
        {"200 mm/s in and out", 3, 0.2, 0, 1, 300, 280, 1.2},
        {"two turns a second", 2.5, 0.05, 0.0126, 0.5, 700, 0, 0.6},
        {"long elements", 3, 0.1, 0.01, 5, 600, 500, 0.9},
    };
    for (int k = 0; k < 4; k++) {
        TubePiece piece[4] = {line_piece(10), arc_piece(12, 120, 0), arc_piece(10, 90, 130), line_piece(60)};
        Vessel *tube = tube_of(piece, 4, run[k].radius);
        long asked[2] = {0, 0};
        CountingVessel count[2] = {{*tube, tube, &asked[0]}, {*tube, tube, &asked[1]}};
        Stepper *s[2];
        Bench b[2];
        for (int j = 0; j < 2; j++) {
            count[j].vessel.query = count_query, count[j].vessel.locate = count_locate;
            bench_in_tube(&b[j], &count[j].vessel, 0.1, 80, (int)(80 / run[k].size), 5, 1);
            b[j].section[0].length = 70;
            b[j].section[1] = standard_section(10), b[j].section[1].rest_curvature = 0.2, b[j].section[1].young_modulus = 20e3;
            b[j].options.wire.section_count = 2;
            b[j].options.contact.tolerance = 1e-9;
            b[j].options.wire.damping_stiffness = 0.2, b[j].options.wire.damping_mass = 1e-4;
            s[j] = bench_make(&b[j]);
        }
        double apart = 0, force_apart = 0, force_most = 0, deepest = 0;
        Checkpoint *kept = NULL;
        for (int i = 0; i < run[k].in + run[k].out; i++) {
            double advance = i < run[k].in ? run[k].advance : -run[k].advance;
            if (i % 97 == 50) {
                kept = stepper_save(s[0], kept);
                stepper_destroy(s[0]);
                s[0] = bench_make(&b[0]);
                stepper_restore(s[0], kept);
            }
            memset(s[1]->points.clearance, 0, (size_t)s[1]->points.count * sizeof *s[1]->points.clearance);
            for (int j = 0; j < 2; j++)
                step_once(s[j], advance, run[k].twist);
                    // both start from the same state, so that single steps are compared and not the growth of small differences
            for (int n = 0; n < s[0]->state.node_count; n++)
                apart = fmax(apart, vec3_distance(s[0]->state.position[n], s[1]->state.position[n]));
            for (int p = 0; p < s[0]->points.count; p++) {
                force_apart = fmax(force_apart, vec3_distance(s[0]->points.force[p], s[1]->points.force[p]));
                force_most = fmax(force_most, vec3_norm(s[0]->points.force[p]));
            }
            deepest = fmax(deepest, step_report(s[1])->penetration);
            memcpy(s[1]->memory, s[0]->memory, s[0]->memory_count * sizeof *s[0]->memory);
            s[1]->state.inserted = s[0]->state.inserted;
            s[1]->state.twist = s[0]->state.twist;
        }
        print_message("%-20s motion of a step differs by %.1e mm, forces by %.1e of %.2g N; deepest %.4f mm; %ld points asked, without sleep %ld\n",
                      run[k].name, apart, force_apart, force_most, deepest, asked[0], asked[1]);
        assert_true(apart < 1e-6 && force_apart < 1e-4 * force_most && deepest < 0.1);
        assert_true((double)asked[0] < run[k].share * (double)asked[1]);
        checkpoint_free(kept);
        for (int j = 0; j < 2; j++)
            stepper_destroy(s[j]);
        tube->destroy(tube);
    }
}

// --- the force at the hand ---

typedef struct Smoothness {
    double mean, jump, ripple;           // [N]; of the mean: the largest change in a step, the largest swing within an element's length
} Smoothness;

// 5 mm/s through a bend, measured from where the tip is well inside the bend until it is near its end. The ripple is the deviation from a straight line.
static Smoothness slow_push(double bend, double friction, double size)
{
    enum { MOST = 4000 };
    static double force[MOST];
    double quarter = bend * PI / 2, in = 10 + 0.6 * quarter;
    Vessel *tube = bent_tube(10, bend, PI / 2, 60, 0.38);
    Bench b;
    bench_in_tube(&b, tube, friction, 60, (int)(60 / size + 0.5), 8, 1);
    b.options.wire.damping_stiffness = 0.2, b.options.wire.damping_mass = 1e-4;
    Stepper *s = bench_make(&b);
    feed(s, in - 8, (int)((in - 8) / 0.02));
    feed(s, 0, 300);
    int steps = (int)(0.35 * quarter / 0.005), window = (int)(size / 0.005 + 0.5);
    assert_true(steps < MOST);
    Smoothness r = {0, 0, 0};
    for (int i = 0; i < steps; i++) {
        force[i] = step_once(s, 0.005, 0)->proximal_force;
        r.mean += force[i] / steps;
        r.jump = fmax(r.jump, i > 20 ? fabs(force[i] - force[i - 1]) : 0);
    }
    for (int first = 20; first + window < steps; first += window) {
        double low = 0, high = 0;
        for (int k = 0; k <= window; k++) {
            double d = force[first + k] - force[first] - (force[first + window] - force[first]) * k / window;
            low = fmin(low, d), high = fmax(high, d);
        }
        r.ripple = fmax(r.ripple, high - low);
    }
    r.jump /= r.mean, r.ripple /= r.mean;
    stepper_destroy(s);
    tube->destroy(tube);
    return r;
}

static void push_is_smooth(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    static const double bend[] = {8, 20}, friction[] = {0, 0.1};
    for (int k = 0; k < 2; k++)
        for (int j = 0; j < 2; j++) {
            Smoothness r = slow_push(bend[k], friction[j], 1);
            print_message("bend %g mm, mu %g, elements of 1 mm: mean push %.4f N, largest change in a step %.3f %%, swing within an element %.2f %%\n", bend[k],
                          friction[j], r.mean, 100 * r.jump, 100 * r.ripple);
            // with contacts at nodes only: ripples of 2.4 and 1.8 % in the bend of 8 mm
            assert_true(r.jump < 2e-3 && r.ripple < (friction[j] > 0 ? 0.011 : 0.018));
        }
}

// The phantom scene's wire with its J-tip, 5 mm/s from 40 to 80 mm: out of the sheath, over the borders of local models, through the siphon, and on while the
// tip is stuck and the push grows to many times the mean. No step changes force or torque by 5 % of the larger of mean and present value (8.6 % if a pressed
// point switched to the next local model at once).
static void push_through_local_models_is_smooth(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    enum { FAST = 2000, SETTLE = 50, SLOW = 8000 };
    LimFitOptions fit = lim_fit_default_options();
    Faults faults = {0};
    fit.voxel_mm = shape_options_voxel_mm(0, NULL);
    VesselTree *points = shape_tree("phantom", 0, NULL, "test", &faults), *model = points ? lim_fit(points, &fit, NULL, &faults) : NULL;
    assert_non_null(model);
    Vessel *vessel = lim_vessel_create(model);
    Bench b;
    bench_in_tube(&b, vessel, 0.04, 300, 200, 2, 1);
    b.section[0].length = 270;
    b.section[1] = standard_section(30), b.section[1].young_modulus = 5e3, b.section[1].rest_curvature = 0.1;
    b.options.wire.section_count = 2;
    assert_true(vessel->inlet(vessel, &b.options.wire.start, &b.options.wire.direction));
    b.options.wire.normal = vec3_normal_to(b.options.wire.direction);
    b.options.wire.damping_stiffness = 0.2, b.options.wire.damping_mass = 1e-4;
    Stepper *s = bench_make(&b);
    feed(s, 0.02 * FAST, FAST);
    feed(s, 0.005 * SETTLE, SETTLE);
    static double felt[SLOW][2];
    double mean[2] = {0, 0}, jump[2] = {0, 0}, share[2] = {0, 0};
    int crossings = 0;
    for (int i = 0; i < SLOW; i++) {
        int tip = s->points.place[s->state.node_count - 1].node;
        const StepReport *r = step_once(s, 0.005, 0);
        felt[i][0] = r->proximal_force, felt[i][1] = r->proximal_torque;
        crossings += s->points.place[s->state.node_count - 1].node != tip;
        for (int k = 0; k < 2; k++)
            mean[k] += fabs(felt[i][k]) / SLOW;
    }
    for (int i = 1; i < SLOW; i++)
        for (int k = 0; k < 2; k++) {
            double change = fabs(felt[i][k] - felt[i - 1][k]);
            jump[k] = fmax(jump[k], change);
            share[k] = fmax(share[k], change / fmax(mean[k], fabs(felt[i - 1][k])));
        }
    print_message("phantom, 5 mm/s: mean push %.3f N, largest change in a step %.4f N, %.2f %%; mean torque %.3f N mm, change %.2f %%; the tip met %d models\n",
                  mean[0], jump[0], 100 * share[0], mean[1], 100 * share[1], crossings);
    assert_true(mean[0] > 0.2 && mean[1] > 0.1 && crossings > 10);
    assert_true(share[0] < 0.05 && share[1] < 0.05);
    stepper_destroy(s);
    vessel->destroy(vessel);
    vessel_tree_free(model);
    vessel_tree_free(points);
}

// --- places where no wire should be ---

static bool all_finite(const Stepper *s)
{
    for (size_t k = 0; k < s->memory_count; k++)
        if (!isfinite(s->memory[k]))
            return false;
    return true;
}

// Along a coordinate axis and along an oblique one: a tip that is pushed against the closed end of a tube buckles to the wall.
static void buckles_on_the_axis(void **state)
{
    (void)state;
    static const Vec3 way[] = {{1, 0, 0}, {0, 0, -1}, {0.6, 0.64, 0.48}};
    double push[3], off[3];
    for (int k = 0; k < 3; k++) {
        TubePiece piece = line_piece(40);
        TubeOptions o = {.direction = way[k], .normal = vec3_normal_to(way[k]), .radius = 2, .piece_count = 1, .piece = &piece, .closed_ends = true};
        Faults faults = {0};
        Vessel *tube = tube_vessel_create(&o, "test", &faults);
        Bench b;
        bench_in_tube(&b, tube, 0.1, 80, 80, 39, 1);
        b.options.wire.direction = way[k], b.options.wire.normal = o.normal;
        b.options.wire.damping_stiffness = 0.2, b.options.wire.damping_mass = 1e-4;
        Stepper *s = bench_make(&b);
        off[k] = 0;
        for (int i = 0; i < 800; i++) {
            push[k] = step_once(s, i < 400 ? 0.01 : 0, 0)->proximal_force;
            for (int n = 0; n < s->state.node_count; n++)
                off[k] = fmax(off[k], vec3_norm(vec3_cross(s->state.position[n], way[k])));
        }
        print_message("pushed on the axis along (%g, %g, %g): %.4f mm off it, push %.3f N\n", way[k].x, way[k].y, way[k].z, off[k], push[k]);
        assert_true(all_finite(s) && off[k] > 1.8 && off[k] < 1.83);
        assert_true(push[k] < 15);      // held straight the wire would push back with 120 N; the shape of its coil is not determined
        stepper_destroy(s);
        tube->destroy(tube);
    }
}

// A wire moved several radii outside, or far away: all values stay finite, and it returns inside.
static void comes_back_from_outside(void **state)
{
    (void)state;
    LimFitOptions fit = lim_fit_default_options();
    Faults faults = {0};
    fit.voxel_mm = shape_options_voxel_mm(0, NULL);
    VesselTree *points = shape_tree("bifurcation", 0, NULL, "test", &faults), *model = points ? lim_fit(points, &fit, NULL, &faults) : NULL;
    assert_non_null(model);
    TubePiece piece[2] = {line_piece(10), arc_piece(6, 90, 0)};
    Vessel *vessel[2] = {lim_vessel_create(model), tube_of(piece, 2, 1)};
    static const double throw[] = {2.5, 6};
    for (int k = 0; k < 4; k++) {
        const Vessel *v = vessel[k % 2];
        Bench b;
        bench_in_tube(&b, v, 0.1, 40, 40, 1, 1);
        assert_true(v->inlet(v, &b.options.wire.start, &b.options.wire.direction));
        b.options.wire.normal = vec3_normal_to(b.options.wire.direction);
        b.section[0].young_modulus = 5e3;
        b.options.wire.damping_stiffness = 0.2, b.options.wire.damping_mass = 1e-4;
        Stepper *s = bench_make(&b);
        feed(s, 8, 400);
        // the distal half of the part outside the sheath is moved sideways
        Vec3 side = b.options.wire.normal;
        for (int i = 0; i < s->state.node_count; i++) {
            double part = fmin(1, fmax(0, (i - s->first_free - 3) / 3.0));
            s->state.position[i] = vec3_add_scaled(s->state.position[i], part * throw [k / 2], side);
            s->points.clearance[i] = 0;
        }
        double outside = 0;   // relative to the wall nearest to the node, even if that is in another branch
        for (int i = s->first_free; i < s->state.node_count; i++) {
            VesselMemory memory = {.node = -1};
            VesselHit hit;
            vessel_query(v, 1, &s->state.position[i], HUGE_VAL, &memory, &hit);
            outside = fmax(outside, 0.1 - hit.gap);
        }
        double last = step_once(s, 0, 0)->penetration;
        bool finite = true;
        for (int i = 0; i < 1500; i++) {
            last = step_once(s, 0, 0)->penetration;
            finite &= all_finite(s);
        }
        print_message("%s: thrown %g mm aside, %.3f mm outside; in the end %.4f mm\n", v->kind, throw [k / 2], outside, last);
        assert_true(finite && outside > 0.5 && last < 0.02);   // five radii of the wire
        stepper_destroy(s);
    }
    for (int k = 0; k < 2; k++)
        vessel[k]->destroy(vessel[k]);
    vessel_tree_free(model);
    vessel_tree_free(points);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levers_follow_the_cubic),
        cmocka_unit_test(coarse_elements_stay_inside),
        cmocka_unit_test(a_ridge_between_nodes_holds),
        cmocka_unit_test(sleepers_miss_nothing),
        cmocka_unit_test(push_is_smooth),
        cmocka_unit_test(push_through_local_models_is_smooth),
        cmocka_unit_test(buckles_on_the_axis),
        cmocka_unit_test(comes_back_from_outside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

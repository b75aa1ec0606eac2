// Contrast agent in vessel trees: mass, speed, the split at forks, reflux, sacs, invariances, degenerate trees, CPU time.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/contrast.h"
#include "tests/heap_calls.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

// --- trees ---

static VesselTree *new_tree(int count)
{
    VesselTree *tree = vessel_tree_create(count, 0, 0);
    assert_non_null(tree);
    for (int i = 0; i < count; i++)
        tree->direction[i] = vec3(1, 0, 0);
    tree->parent[0] = -1;
    return tree;
}

static void set_node(VesselTree *tree, int node, int parent, Vec3 center, double radius)
{
    tree->parent[node] = parent;
    tree->center[node] = center;
    tree->radius[node] = radius;
}

// `links` of equal length along x.
static VesselTree *tube(int links, double length, double radius)
{
    VesselTree *tree = new_tree(links + 1);
    for (int i = 0; i <= links; i++)
        set_node(tree, i, i - 1, vec3(length * i / links, 0, 0), radius);
    return tree;
}

// A trunk along x and two branches at angles +-0.6 in the plane, `links` each, 30 mm long.
static VesselTree *fork_tree(int links, double trunk, double left, double right)
{
    VesselTree *tree = new_tree(3 * links + 1);
    for (int i = 0; i <= links; i++)
        set_node(tree, i, i - 1, vec3(30.0 * i / links, 0, 0), trunk);
    for (int side = 0; side < 2; side++)
        for (int i = 1; i <= links; i++) {
            int node = links * (1 + side) + i;
            double s = 30.0 * i / links, radius = side ? right : left;
            set_node(tree, node, i == 1 ? links : node - 1, vec3(30 + s * cos(0.6), (side ? -1 : 1) * s * sin(0.6), 0), radius);
        }
    return tree;
}

static unsigned noise(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

// Any parents, links of any length (some zero), radii from 0.2 to 3 mm, some sacs.
static VesselTree *random_tree(int count, unsigned seed)
{
    VesselTree *tree = new_tree(count);
    for (int i = 0; i < count; i++) {
        int back = 1 + (noise(&seed) % 4 ? 0 : (int)(noise(&seed) % 20)), parent = i - back < 0 ? i - 1 : i - back;
        double length = noise(&seed) % 5 ? (noise(&seed) % 1000) / 500.0 : 0;
        Vec3 way = vec3((noise(&seed) % 100) / 50.0 - 1, (noise(&seed) % 100) / 50.0 - 1, 1);
        Vec3 center = parent < 0 ? vec3(0, 0, 0) : vec3_add_scaled(tree->center[parent], length, way);
        set_node(tree, i, parent, center, 0.2 + (noise(&seed) % 1000) * (i < count / 4 ? 0.0028 : 0.0008));
        tree->kind[i] = noise(&seed) % 30 == 0 ? NODE_ANEURYSM : NODE_VESSEL;
    }
    return tree;
}

static Contrast *make(const VesselTree *tree, const ContrastOptions *options)
{
    Contrast *contrast = contrast_create(tree, options);
    assert_non_null(contrast);
    return contrast;
}

static ContrastOptions steady(double flow_ml_s)
{
    ContrastOptions options = contrast_default_options();
    options.inlet_node = 0;
    options.pulsation = 0;
    options.inlet_flow_ml_s = flow_ml_s;
    return options;
}

static void check_balance(const Contrast *contrast)
{
    double injected = contrast_injected_ml(contrast), sum = contrast_within_ml(contrast) + contrast_gone_ml(contrast);
    assert_true(fabs(sum - injected) <= 1e-12 * fmax(injected, 1));
    assert_true(contrast_gone_ml(contrast) >= 0 && contrast_within_ml(contrast) >= -1e-15);
}

static void check_range(const Contrast *contrast)
{
    const float *c = contrast_concentration(contrast);
    for (int i = 0; i < contrast_node_count(contrast); i++)
        assert_true(c[i] >= 0 && c[i] <= 1);
}

// --- laws ---

static void nothing_is_lost_and_nothing_exceeds_one(void **state)
{
    (void)state;
    for (unsigned seed = 1; seed <= 12; seed++) {
        VesselTree *tree = random_tree(40 + (int)seed * 30, seed);
        Contrast *contrast = make(tree, NULL);
        unsigned draws = seed;
        double injected = 0;
        for (int i = 0; i < 600; i++) {
            // from a drop to far more than the flow, at any node, steps of 0.3 to 30 ms
            double rate = i % 200 < 120 ? (noise(&draws) % 100) * 0.12 : 0, dt = 0.0003 * (1 + noise(&draws) % 100);
            contrast_advance(contrast, dt, (int)(noise(&draws) % (unsigned)tree->node_count) - 1, rate);
            injected += rate * dt;
            check_balance(contrast);
            check_range(contrast);
        }
        assert_true(fabs(contrast_injected_ml(contrast) - injected) < 1e-12 * injected);
        contrast_free(contrast);
        vessel_tree_free(tree);
    }
}

// The time at which the concentration at a node reaches half of the injected one.
static double arrival_s(Contrast *contrast, int node, double rate, double dt)
{
    double last = 0, time = 0;
    for (int i = 0; i < 200000; i++, time += dt) {
        contrast_advance(contrast, dt, 0, rate);
        double now = contrast_concentration(contrast)[node];
        if (now >= 0.5 * rate)
            return time + dt * (0.5 * rate - last) / (now - last);
        last = now;
    }
    fail_msg("nothing arrived");
    return 0;
}

// A flow of 1 ml/s in a tube of 1 mm: 318.3 mm/s. The inlet's contents first fill the cell there, so the error is of first order in the step.
static void a_front_travels_at_the_speed_of_the_blood(void **state)
{
    (void)state;
    VesselTree *tree = tube(50, 200, 1);
    double exact = 150 * PI / 1000, error[4];
    for (int k = 0; k < 4; k++) {
        ContrastOptions options = steady(1);
        options.step_s = 0.02 / (1 << k);
        Contrast *contrast = make(tree, &options);
        assert_true(fabs(contrast_transit_s(contrast, 38) - 152 * PI / 1000) < 1e-12);
        assert_true(fabs(contrast_flow_ml_s(contrast, 38) - 1) < 1e-12);
        double at_37 = arrival_s(contrast, 37, 1, options.step_s);
        contrast_free(contrast);
        contrast = make(tree, &options);
        error[k] = fabs((at_37 + arrival_s(contrast, 38, 1, options.step_s)) / 2 - exact);
        contrast_free(contrast);
    }
    print_message("arrival at 150 mm: errors %.2f %.2f %.2f %.2f ms for steps of 20, 10, 5, 2.5 ms\n", 1e3 * error[0], 1e3 * error[1], 1e3 * error[2],
                  1e3 * error[3]);
    for (int k = 0; k < 4; k++)
        assert_true(error[k] <= 0.02 / (1 << k));
    assert_true(error[3] < error[0] / 4);
    vessel_tree_free(tree);
}

// If the branch is a whole number of steps long, a bolus moves without numerical diffusion.
static void a_bolus_keeps_its_shape(void **state)
{
    (void)state;
    VesselTree *tree = tube(100, 100, 1);
    ContrastOptions options = steady(0.1 * PI);   // 1 s for 100 mm
    options.step_s = 0.01;
    Contrast *contrast = make(tree, &options);
    for (int i = 0; i < 60; i++)
        contrast_advance(contrast, 0.01, 0, i < 10 ? 0.05 * PI : 0);
    const float *c = contrast_concentration(contrast);
    for (int i = 0; i <= 100; i++) {   // a node lies between two cells
        double inside = i > 50 && i < 60 ? 0.5 : i == 50 || i == 60 ? 0.25 : 0;
        assert_true(fabs(c[i] - inside) < 1e-6);
    }
    assert_true(fabs(contrast_within_ml(contrast) - 0.1 * 0.05 * PI) < 1e-12);
    contrast_free(contrast);
    vessel_tree_free(tree);
}

static void flow_splits_by_the_cube_of_the_radius(void **state)
{
    (void)state;
    VesselTree *even = fork_tree(30, 2, 1.4, 1.4), *uneven = fork_tree(30, 2, 1.5, 1);
    ContrastOptions options = steady(3);
    Contrast *a = make(even, &options), *b = make(uneven, &options);
    assert_true(contrast_flow_ml_s(a, 60) == contrast_flow_ml_s(a, 90));
    assert_true(fabs(contrast_flow_ml_s(a, 60) - 1.5) < 1e-12);
    assert_true(fabs(contrast_flow_ml_s(b, 60) / contrast_flow_ml_s(b, 90) - 1.5 * 1.5 * 1.5) < 1e-9);
    assert_true(fabs(contrast_flow_ml_s(b, 60) + contrast_flow_ml_s(b, 90) - contrast_flow_ml_s(b, 10)) < 1e-12);
    // speed = Q / (pi r^2): 25 mm further down a branch
    assert_true(fabs(contrast_transit_s(b, 60) - contrast_transit_s(b, 35) - 25 * PI * 2.25 / (1000 * contrast_flow_ml_s(b, 60))) < 1e-12);
    const float *c = contrast_concentration(a);
    for (int i = 0; i < 300; i++) {
        contrast_advance(a, 0.004, 3, i < 100 ? 2 : 0);
        assert_memory_equal(c + 31, c + 61, 30 * sizeof *c);
    }
    contrast_free(a);
    contrast_free(b);
    vessel_tree_free(even);
    vessel_tree_free(uneven);
}

// Below the tip there is a mixture of injected agent and blood; above it and in other branches there is blood.
static void below_the_tip_only(void **state)
{
    (void)state;
    VesselTree *tree = fork_tree(30, 2, 1.5, 1.2);
    ContrastOptions options = steady(3);
    Contrast *contrast = make(tree, &options);
    double flow = contrast_flow_ml_s(contrast, 45);
    for (int i = 0; i < 400; i++)
        contrast_advance(contrast, 0.005, 45, 0.6 * flow);
    const float *c = contrast_concentration(contrast);
    for (int i = 0; i <= 90; i++) {
        if (i >= 46 && i <= 60)
            assert_true(fabs(c[i] - 0.6) < 1e-6);
        else if (i < 44 || i > 60)
            assert_true(c[i] == 0);
    }
    contrast_free(contrast);
    vessel_tree_free(tree);
}

// Injection of twice the flow: the branch is full up to the fork, the rest flows into the other branch, where it mixes with the blood of the trunk.
static void what_does_not_continue_goes_back(void **state)
{
    (void)state;
    VesselTree *tree = fork_tree(30, 2, 1.5, 1.2);
    ContrastOptions options = steady(3);
    Contrast *contrast = make(tree, &options);
    double flow = contrast_flow_ml_s(contrast, 45), other = contrast_flow_ml_s(contrast, 75), back = 0.5 * other;
    for (int i = 0; i < 400; i++)
        contrast_advance(contrast, 0.005, 45, flow + back);
    const float *c = contrast_concentration(contrast);
    for (int i = 31; i <= 60; i++)
        assert_true(fabs(c[i] - 1) < 1e-6);
    for (int i = 61; i <= 90; i++)
        assert_true(fabs(c[i] - 0.5) < 1e-6);
    for (int i = 0; i < 30; i++)
        assert_true(c[i] == 0);
    // more than the total flow: also out of the inlet
    for (int i = 0; i < 400; i++)
        contrast_advance(contrast, 0.005, 45, 3.5);
    for (int i = 0; i <= 90; i++)
        assert_true(fabs(c[i] - 1) < 1e-6);
    check_balance(contrast);
    // then blood washes it out
    for (int i = 0; i < 4000; i++)
        contrast_advance(contrast, 0.005, 45, 0);
    assert_true(contrast_is_clear(contrast));
    assert_true(contrast_within_ml(contrast) == 0);
    check_balance(contrast);
    contrast_free(contrast);
    vessel_tree_free(tree);
}

static void a_sac_washes_out_exponentially(void **state)
{
    (void)state;
    VesselTree *tree = new_tree(42);
    for (int i = 0; i <= 40; i++)
        set_node(tree, i, i - 1, vec3(i, 0, 0), 2);
    set_node(tree, 41, 20, vec3(20, 5, 0), 3);
    tree->kind[41] = NODE_ANEURYSM;
    ContrastOptions options = steady(80);   // carries away the agent that leaves the sac
    options.sac_residence_s = 1.2;
    Contrast *contrast = make(tree, &options);
    assert_true(contrast_flow_ml_s(contrast, 41) == 0);
    for (int i = 0; i < 200; i++)
        contrast_advance(contrast, 0.005, 5, 80);
    const float *c = contrast_concentration(contrast);
    assert_true(fabs(c[41] - (1 - exp(-1 / 1.2))) < 0.01);   // 8 ms from the tip to the neck
    contrast_advance(contrast, 0.1, 5, 0);
    double start = c[41], volume = contrast_within_ml(contrast);
    assert_true(fabs(volume - start * 4 * PI / 3 * 27 / 1000) < 0.01 * volume);
    contrast_advance(contrast, 1.2, 5, 0);
    // the concentration in the vessel due to the outflow is exchange / flow = 0.0012
    assert_true(fabs(c[41] / start - exp(-1)) < 0.002 * exp(-1));
    // agent injected in the sac stays inside, with a concentration of at most 1
    contrast_free(contrast);
    contrast = make(tree, &options);
    c = contrast_concentration(contrast);
    contrast_advance(contrast, 0.1, 41, 5);
    assert_true(c[41] > 0.9 && c[41] <= 1);
    check_balance(contrast);
    contrast_free(contrast);
    vessel_tree_free(tree);
}

// Two equal sacs at one place of a tube have equal contents at all times, whether the blood flows on or, with more injected than flows, back.
static void sacs_at_one_neck_fill_alike(void **state)
{
    (void)state;
    VesselTree *tree = new_tree(43);
    for (int i = 0; i <= 40; i++)
        set_node(tree, i, i - 1, vec3(i, 0, 0), 2);
    set_node(tree, 41, 20, vec3(20, 4, 0), 1);
    set_node(tree, 42, 20, vec3(20, -4, 0), 1);
    tree->kind[41] = tree->kind[42] = NODE_ANEURYSM;
    ContrastOptions options = steady(2);
    for (int tip = 5; tip <= 35; tip += 30) {
        Contrast *contrast = make(tree, &options);
        const float *c = contrast_concentration(contrast);
        for (int i = 0; i < 200; i++)
            contrast_advance(contrast, 0.005, tip, 8);
        assert_true(c[41] > 0.3 && fabs(c[41] - c[42]) < 1e-6);
        check_balance(contrast);
        contrast_free(contrast);
    }
    vessel_tree_free(tree);
}

// Each node below the tip receives the injected agent, diluted by the flow at the tip and delayed by the transit time: the areas under the curves are equal,
// and the mean times differ by the transit time. Other nodes receive nothing.
static void every_node_sees_the_bolus_in_its_time(void **state)
{
    (void)state;
    int seen = 0;
    for (unsigned seed = 20; seed < 24; seed++) {
        VesselTree *tree = random_tree(120, seed);
        for (int i = 0; i < 120; i++)
            tree->kind[i] = NODE_VESSEL;
        ContrastOptions options = steady(2);
        Contrast *contrast = make(tree, &options);
        int tip = 25;
        bool below[120];
        double area[120] = {0}, moment[120] = {0}, flow = contrast_flow_ml_s(contrast, tip);
        for (int i = 0; i < 120; i++)
            below[i] = i == tip || (i > tip && below[tree->parent[i]]);
        for (int k = 0; k < 8000; k++) {
            contrast_advance(contrast, 0.005, tip, k < 40 ? 0.7 * flow : 0);
            for (int i = 0; i < 120; i++) {
                area[i] += 0.005 * (double)contrast_concentration(contrast)[i];
                moment[i] += 0.005 * (k + 0.5) * 0.005 * (double)contrast_concentration(contrast)[i];
            }
        }
        for (int i = 0; i < 120; i++) {
            double later = contrast_transit_s(contrast, i) - contrast_transit_s(contrast, tip);
            if (!below[i] && later < 0 && contrast_transit_s(contrast, tip) - contrast_transit_s(contrast, i) > 0.011) {
                assert_true(area[i] == 0);
            } else if (below[i] && later > 0.01 && later < 20) {
                assert_true(fabs(area[i] - 0.7 * 0.2) < 1e-3 * area[i]);
                assert_true(fabs(moment[i] / area[i] - 0.1 - later) < 0.011 + 0.02 * later);
                seen++;
            }
        }
        contrast_free(contrast);
        vessel_tree_free(tree);
    }
    print_message("%d nodes below the tip\n", seen);
    assert_true(seen > 50);
}

// The number of nodes reached by a front from the root.
static int reached(Contrast *contrast, double seconds)
{
    int count = 0;
    for (int i = 0; i < (int)lround(seconds * 2000); i++)
        contrast_advance(contrast, 0.0005, 0, 5);
    for (int i = 0; i < contrast_node_count(contrast); i++)
        count += contrast_concentration(contrast)[i] > 0.5f;
    return count;
}

// The pulse moves blood by the integral of its speed, 1 + 0.4 (cos a + cos 2a / 2), with a the phase of the heart: a front is at the place that steady flow
// reaches after the time given by the integral.
static void the_pulse_moves_by_its_integral(void **state)
{
    (void)state;
    VesselTree *tree = tube(1000, 100, 1.5);
    ContrastOptions even = steady(0.3), beating;
    even.step_s = 0.001;
    beating = even;
    beating.pulsation = 1;
    beating.heart_rate_min = 60;
    for (int i = 1; i < 24; i++) {
        const double until_s = 0.05 * i, angle = 2 * PI * until_s, moved_s = until_s + 0.4 / (2 * PI) * (sin(angle) + 0.25 * sin(2 * angle));
        Contrast *a = make(tree, &beating), *b = make(tree, &even);
        int pulsed = reached(a, until_s), steadily = reached(b, moved_s);
        assert_true(steadily > 10 && abs(pulsed - steadily) <= 2);     // of 0.1 mm; half a millisecond is 0.2
        contrast_free(a);
        contrast_free(b);
    }
    vessel_tree_free(tree);
}

// --- invariances ---

static void run_bolus(Contrast *contrast, int tip, double until_s)
{
    for (int i = 0; i < (int)(until_s * 100 + 0.5); i++)
        contrast_advance(contrast, 0.01, tip, i < 40 ? 3.5 : 0);
}

static void a_mirrored_tree_fills_alike(void **state)
{
    (void)state;
    VesselTree *tree = random_tree(300, 5), *mirrored = random_tree(300, 5);
    for (int i = 0; i < 300; i++)
        mirrored->center[i].y = -mirrored->center[i].y;
    Contrast *a = make(tree, NULL), *b = make(mirrored, NULL);
    run_bolus(a, 100, 0.7);
    run_bolus(b, 100, 0.7);
    assert_memory_equal(contrast_concentration(a), contrast_concentration(b), 300 * sizeof(float));
    contrast_free(a);
    contrast_free(b);
    vessel_tree_free(tree);
    vessel_tree_free(mirrored);
}

static void a_finer_tree_fills_alike(void **state)
{
    (void)state;
    for (int tapered = 0; tapered < 2; tapered++) {
        VesselTree *coarse = fork_tree(15, 2, 1.6, 1.1), *fine = fork_tree(30, 2, 1.6, 1.1);
        for (int i = 0; tapered && i <= 45; i++)
            coarse->radius[i] *= 1 - coarse->center[i].x / 200;
        for (int i = 0; tapered && i <= 90; i++)
            fine->radius[i] *= 1 - fine->center[i].x / 200;
        // halfway between the fork's node and the branch's first, as if nodes were inserted halfway
        fine->radius[31] = (fine->radius[30] + fine->radius[32]) / 2;
        fine->radius[61] = (fine->radius[30] + fine->radius[62]) / 2;
        Contrast *a = make(coarse, NULL), *b = make(fine, NULL);
        for (int i = 0; i <= 45; i++) {
            int same = i <= 15 ? 2 * i : i <= 30 ? 30 + 2 * (i - 15) : 60 + 2 * (i - 30);
            assert_true(fabs(contrast_transit_s(a, i) - contrast_transit_s(b, same)) < 1e-9);
            assert_true(fabs(contrast_flow_ml_s(a, i) - contrast_flow_ml_s(b, same)) < 1e-9);
        }
        run_bolus(a, 5, 0.5);
        run_bolus(b, 10, 0.5);
        for (int i = 0; i <= 45; i++) {
            int same = i <= 15 ? 2 * i : i <= 30 ? 30 + 2 * (i - 15) : 60 + 2 * (i - 30);
            assert_true(fabsf(contrast_concentration(a)[i] - contrast_concentration(b)[same]) < 1e-4f);
        }
        contrast_free(a);
        contrast_free(b);
        vessel_tree_free(coarse);
        vessel_tree_free(fine);
    }
}

static void the_same_calls_give_the_same_bits(void **state)
{
    (void)state;
    VesselTree *tree = random_tree(500, 3);
    Contrast *a = make(tree, NULL), *b = make(tree, NULL), *c = make(tree, NULL);
    run_bolus(a, 50, 0.3);
    contrast_copy(c, a);
    run_bolus(b, 50, 0.3);
    run_bolus(a, 50, 0.2);
    run_bolus(c, 50, 0.2);
    assert_memory_equal(contrast_concentration(a), contrast_concentration(c), 500 * sizeof(float));
    assert_true(contrast_within_ml(a) == contrast_within_ml(c) && contrast_gone_ml(a) == contrast_gone_ml(c));
    run_bolus(b, 50, 0.2);
    assert_memory_equal(contrast_concentration(a), contrast_concentration(b), 500 * sizeof(float));
    contrast_free(a);
    contrast_free(b);
    contrast_free(c);
    vessel_tree_free(tree);
}

// Ten calls of 1 ms are equal to one call of 10 ms at any phase of the heart.
static void the_length_of_a_call_does_not_matter(void **state)
{
    (void)state;
    VesselTree *tree = fork_tree(30, 2, 1.5, 1.2);
    Contrast *a = make(tree, NULL), *b = make(tree, NULL);
    for (int i = 0; i < 50; i++) {
        contrast_advance(a, 0.01, 5, 2);
        for (int k = 0; k < 10; k++)
            contrast_advance(b, 0.001, 5, 2);
    }
    assert_true(fabs(contrast_within_ml(a) - contrast_within_ml(b)) < 1e-3 * contrast_within_ml(a));
    for (int i = 0; i <= 90; i++)
        assert_true(fabsf(contrast_concentration(a)[i] - contrast_concentration(b)[i]) < 0.02f);
    contrast_free(a);
    contrast_free(b);
    vessel_tree_free(tree);
}

// --- the inlet ---

static void blood_comes_in_at_the_widest_end(void **state)
{
    (void)state;
    assert_int_equal(contrast_find_inlet(NULL), -1);
    VesselTree *carotid = fork_tree(30, 2, 1.5, 1.2), *leg = fork_tree(30, 4, 4.2, 13);
    assert_int_equal(contrast_find_inlet(carotid), 0);
    assert_int_equal(contrast_find_inlet(leg), 90);
    Contrast *contrast = make(leg, NULL);
    // at most the flow of the heart, which is divided over the root and the other end
    assert_true(fabs(contrast_flow_ml_s(contrast, 90) - 5000.0 / 60) < 1e-9);
    assert_true(fabs(contrast_flow_ml_s(contrast, 0) + contrast_flow_ml_s(contrast, 60) - 5000.0 / 60) < 1e-9);
    assert_true(contrast_transit_s(contrast, 90) == 0 && contrast_transit_s(contrast, 0) > contrast_transit_s(contrast, 29));
    // agent injected in the trunk flows to the root
    for (int i = 0; i < 20; i++)
        contrast_advance(contrast, 0.005, 15, 5);
    assert_true(contrast_concentration(contrast)[10] > 0 && contrast_concentration(contrast)[20] == 0);
    contrast_free(contrast);
    // a sac is not an end, even if it is wide, and neither is a stub of the trunk
    VesselTree *sac = fork_tree(30, 2, 1.5, 6), *stub = new_tree(33);
    for (int i = 61; i <= 90; i++)
        sac->kind[i] = NODE_ANEURYSM;
    assert_int_equal(contrast_find_inlet(sac), 0);
    for (int i = 0; i <= 31; i++)
        set_node(stub, i, i - 1, vec3(i, 0, 0), 2 - i * 0.04);
    set_node(stub, 32, 10, vec3(10, 1.5, 0), 3);
    assert_int_equal(contrast_find_inlet(stub), 0);
    vessel_tree_free(carotid);
    vessel_tree_free(leg);
    vessel_tree_free(sac);
    vessel_tree_free(stub);
}

// --- degenerate trees, bad values ---

static void odd_trees_work(void **state)
{
    (void)state;
    Contrast *none = make(NULL, NULL);
    contrast_advance(none, 1, 0, 2);
    assert_true(contrast_node_count(none) == 0 && contrast_gone_ml(none) == 2);
    contrast_copy(none, none);
    contrast_free(none);
    for (int kind = 0; kind < 2; kind++) {
        VesselTree *one = new_tree(1);
        set_node(one, 0, -1, vec3(0, 0, 0), 1.5);
        one->kind[0] = (uint8_t)kind;
        Contrast *contrast = make(one, NULL);
        for (int i = 0; i < 100; i++)
            contrast_advance(contrast, 0.01, 0, 3);
        assert_true(contrast_concentration(contrast)[0] > 0.5f);
        check_balance(contrast);
        check_range(contrast);
        contrast_free(contrast);
        vessel_tree_free(one);
    }
    for (int variant = 0; variant < 3; variant++) {
        // all nodes at one place; all nodes a sac; radii over eighteen decades
        VesselTree *tree = random_tree(200, 9);
        for (int i = 0; i < 200; i++) {
            if (variant == 0)
                tree->center[i] = vec3(3, 3, 3);
            if (variant == 1)
                tree->kind[i] = NODE_ANEURYSM;
            if (variant == 2)
                tree->radius[i] = pow(10, i % 19 - 9);
        }
        Contrast *contrast = make(tree, NULL);
        for (int i = 0; i < 300; i++) {
            contrast_advance(contrast, 0.01, i % 200, i < 150 ? 4 : 0);
            check_balance(contrast);
            check_range(contrast);
        }
        contrast_free(contrast);
        vessel_tree_free(tree);
    }
}

static void bad_values_do_no_harm(void **state)
{
    (void)state;
    VesselTree *tree = tube(20, 50, 1);
    ContrastOptions options = {NAN, NAN, 4000, NAN, NAN, NAN};
    Contrast *contrast = make(tree, &options);
    const double bad[] = {NAN, -1, HUGE_VAL, -HUGE_VAL, 1e300};
    for (int i = 0; i < 5; i++) {
        contrast_advance(contrast, bad[i] < 1e200 ? bad[i] : NAN, 3, 1);
        assert_true(contrast_injected_ml(contrast) == 0);
    }
    contrast_advance(contrast, 0.01, 3, NAN);
    contrast_advance(contrast, 0.01, 3, -4);
    assert_true(contrast_injected_ml(contrast) == 0);
    contrast_advance(contrast, 0.01, 1 << 30, 1e300);
    assert_true(fabs(contrast_injected_ml(contrast) - 1) < 1e-12);
    contrast_advance(contrast, 3e6, -5, 0);   // a month
    check_balance(contrast);
    assert_true(contrast_is_clear(contrast));
    contrast_free(contrast);
    vessel_tree_free(tree);
}

static void advancing_allocates_nothing(void **state)
{
    (void)state;
    need_counting();
    VesselTree *tree = random_tree(1000, 2);
    Contrast *contrast = make(tree, NULL), *copy = make(tree, NULL);
    long before = heap_calls();
    heap_watch(true);
    run_bolus(contrast, 300, 1);
    contrast_copy(copy, contrast);
    heap_watch(false);
    assert_int_equal(heap_calls() - before, 0);
    contrast_free(contrast);
    contrast_free(copy);
    vessel_tree_free(tree);
}

static double cpu_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// 10,000 nodes: 20 us of CPU per ms of simulated time are the budget; printed here, and checked with a margin for slow or instrumented builds.
static void the_cost_is_reported(void **state)
{
    (void)state;
    VesselTree *tree = random_tree(10000, 4);
    double best = HUGE_VAL;
    for (int run = 0; run < 5; run++) {
        Contrast *contrast = make(tree, NULL);
        double start = cpu_s();
        run_bolus(contrast, 100, 0.5);
        best = fmin(best, (cpu_s() - start) / 500);
        contrast_free(contrast);
    }
    print_message("10,000 nodes: %.2f us per ms of simulated time\n", 1e6 * best);
    assert_true(best < 1e-3);
    vessel_tree_free(tree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(nothing_is_lost_and_nothing_exceeds_one),
        cmocka_unit_test(a_front_travels_at_the_speed_of_the_blood),
        cmocka_unit_test(a_bolus_keeps_its_shape),
        cmocka_unit_test(flow_splits_by_the_cube_of_the_radius),
        cmocka_unit_test(below_the_tip_only),
        cmocka_unit_test(what_does_not_continue_goes_back),
        cmocka_unit_test(a_sac_washes_out_exponentially),
        cmocka_unit_test(sacs_at_one_neck_fill_alike),
        cmocka_unit_test(every_node_sees_the_bolus_in_its_time),
        cmocka_unit_test(the_pulse_moves_by_its_integral),
        cmocka_unit_test(a_mirrored_tree_fills_alike),
        cmocka_unit_test(a_finer_tree_fills_alike),
        cmocka_unit_test(the_same_calls_give_the_same_bits),
        cmocka_unit_test(the_length_of_a_call_does_not_matter),
        cmocka_unit_test(blood_comes_in_at_the_widest_end),
        cmocka_unit_test(odd_trees_work),
        cmocka_unit_test(bad_values_do_no_harm),
        cmocka_unit_test(advancing_allocates_nothing),
        cmocka_unit_test(the_cost_is_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// Contrast agent through the lumens of tools: flow compared with Poiseuille's law and the annulus, the front of the column, the place where it leaves, the
// dose.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/contrast_injection.h"
#include "tests/heap_calls.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Faults faults;

enum { NODES = 401 };
static double node_s[TOOLS_MOST][NODES];

#define HEAD "seldinger: 1\nsheath: {entry_mm: [0,0,0], direction: [1,0,0], inserted_mm: 100}\n"
#define SECTION(length, outer, inner) "{length_mm: " length ", diameter_mm: " outer ", inner_diameter_mm: " inner ", young_modulus_gpa: 1}"
#define GUIDE "  - {name: guide, kind: guide_catheter, sections: [" SECTION("400", "2", "1.8") "]}\n"
#define MICRO "  - {name: micro, kind: microcatheter, sections: [" SECTION("300", "0.8", "0.6") ", " SECTION("300", "0.7", "0.5") "]}\n"
#define WIRE "  - {name: wire, kind: wire, sections: [{length_mm: 800, diameter_mm: 0.36, young_modulus_gpa: 1}]}\n"
#define THREE HEAD "tools:\n" GUIDE MICRO WIRE

static Scene *scene_of(const char *text)
{
    faults_clear(&faults);
    Scene *scene = scene_parse(text, strlen(text), "scene.yaml", &faults);
    if (!scene)
        print_error("%s\n", faults.text[0]);
    assert_non_null(scene);
    return scene;
}

// Nodes at even distances.
static void lay_nodes(const Scene *scene, int *count, const double **s)
{
    for (int k = 0; k < scene->tool_count; k++) {
        WireOptions wire = scene_tool_wire(scene, k);
        for (int j = 0; j < NODES; j++)
            node_s[k][j] = wire_length(&wire) * j / (NODES - 1);
        count[k] = NODES;
        s[k] = node_s[k];
    }
}

static ContrastLumens *lumens_of(const Scene *scene, const LumenOptions *options)
{
    int count[TOOLS_MOST];
    const double *s[TOOLS_MOST];
    lay_nodes(scene, count, s);
    ContrastLumens *lumens = contrast_lumens_create(scene, count, s, options);
    assert_non_null(lumens);
    return lumens;
}

static ContrastInjection *injection_of(const Scene *scene, const VesselTree *tree)
{
    int count[TOOLS_MOST];
    const double *s[TOOLS_MOST];
    lay_nodes(scene, count, s);
    ContrastInjection *injection = contrast_injection_create(tree, scene, count, s);
    assert_non_null(injection);
    return injection;
}

static double tube_resistance(double length, double radius) { return 8 * lumen_default_options().viscosity_mpa_s * length / (PI * pow(radius, 4)); }

static void assert_close(double value, double expected, double part)
{
    if (!(fabs(value - expected) <= part * fabs(expected)))
        fail_msg("%.12g, expected %.12g", value, expected);
}

// --- the annulus ---

// Flow between radii k and 1 from the equation of motion, (r u')' = -r, u = 0 at both: finite volumes, relative to that of the open tube (pi / 8).
static double flow_by_finite_volumes(double k)
{
    enum { CELLS = 4000 };
    static double diagonal[CELLS], right[CELLS];
    double h = (1 - k) / CELLS, flow = 0;
    for (int i = 0; i < CELLS; i++) {        // Thomas; lower = upper = faces
        double r = k + (i + 0.5) * h, left = (r - h / 2) / h, beyond = (r + h / 2) / h;
        double own = (i == 0 ? 2 * left : left) + (i == CELLS - 1 ? 2 * beyond : beyond), factor = i ? left / diagonal[i - 1] : 0;
        diagonal[i] = own - (i ? factor * left : 0);
        right[i] = r * h + (i ? factor * right[i - 1] : 0);
    }
    double u = 0;
    for (int i = CELLS - 1; i >= 0; i--) {
        double r = k + (i + 0.5) * h, beyond = i == CELLS - 1 ? 0 : (r + h / 2) / h;
        u = (right[i] + beyond * u) / diagonal[i];
        flow += 2 * PI * r * h * u;
    }
    return flow / (PI / 8);
}

static void the_annulus_is_the_equation_of_motion_s(void **state)
{
    (void)state;
    const double ratio[] = {0.02, 0.1, 0.2, 0.36 / 0.6, 0.8 / 1.8, 0.9, 0.99};
    for (size_t i = 0; i < sizeof ratio / sizeof *ratio; i++) {
        double share = lumen_annulus_share(ratio[i]), numerical = flow_by_finite_volumes(ratio[i]);
        assert_close(share, numerical, 1e-5);    // of order 2 in cells of a 4000th of the gap, the logarithm at the smallest ratio worst
        print_message("k = %.4f: share %.8f, finite volumes %.8f\n", ratio[i], share, numerical);
    }
    assert_true(lumen_annulus_share(0) == 1 && lumen_annulus_share(1) == 0 && lumen_annulus_share(1.2) == 0);
    // the transition to the formula of two flat walls has no jump
    assert_close(lumen_annulus_share(1 - 0.999e-3), lumen_annulus_share(1 - 1.001e-3) * pow(0.999 / 1.001, 3), 1e-5);
}

static void flow_is_poiseuille_s_in_series_and_falls_beside_a_tool(void **state)
{
    (void)state;
    Scene *scene = scene_of(THREE);
    ContrastLumens *lumens = lumens_of(scene, NULL);
    const double out_of_all[] = {400, -300, -900}, beside[] = {200, 250, 300};
    double pressure = lumen_default_options().pressure_mpa, guide = tube_resistance(400, 0.9), micro = tube_resistance(300, 0.3) + tube_resistance(300, 0.25);
    assert_close(contrast_lumens_passes(lumens, 0, out_of_all), pressure / guide / 1000, 1e-12);
    assert_close(contrast_lumens_passes(lumens, 1, out_of_all), pressure / micro / 1000, 1e-12);
    // the microcatheter's tip 50 mm before the guide's: the guide's hub at -200 mm, the microcatheter's first section ends at -50 mm
    double annulus = tube_resistance(150, 0.9) / lumen_annulus_share(0.4 / 0.9) + tube_resistance(250, 0.9) / lumen_annulus_share(0.35 / 0.9);
    assert_close(contrast_lumens_passes(lumens, 0, beside), pressure / annulus / 1000, 1e-12);
    // pulled back by 120 mm together with the wire
    const double within[] = {200, 130, 130};
    annulus =
        tube_resistance(30, 0.9) / lumen_annulus_share(0.4 / 0.9) + tube_resistance(300, 0.9) / lumen_annulus_share(0.35 / 0.9) + tube_resistance(70, 0.9);
    assert_close(contrast_lumens_passes(lumens, 0, within), pressure / annulus / 1000, 1e-12);
    // only the wire beyond it
    const double wire_beyond[] = {200, 130, 250};
    annulus += tube_resistance(70, 0.9) * (1 / lumen_annulus_share(0.18 / 0.9) - 1);
    assert_close(contrast_lumens_passes(lumens, 0, wire_beyond), pressure / annulus / 1000, 1e-12);
    contrast_lumens_free(lumens);
    scene_free(scene);
}

static void a_wire_without_clearance_lets_next_to_nothing_through(void **state)
{
    (void)state;
    const double gap[] = {0.05, 0.01, 0.001};
    for (int i = 0; i < 3; i++) {
        char text[1000];
        snprintf(text, sizeof text,
                 HEAD "tools:\n  - {name: micro, kind: microcatheter, sections: [" SECTION(
                     "600", "0.8", "0.5") "]}\n"
                                          "  - {name: wire, kind: wire, sections: [{length_mm: 800, diameter_mm: %g, young_modulus_gpa: 1}]}\n",
                 0.5 * (1 - gap[i]));
        Scene *scene = scene_of(text);
        ContrastLumens *lumens = lumens_of(scene, NULL);
        const double in[] = {100, 200}, out[] = {100, -600};
        double share = contrast_lumens_passes(lumens, 0, in) / contrast_lumens_passes(lumens, 0, out);
        assert_close(share, 4.0 / 3 * pow(gap[i], 3), gap[i]);   // two flat walls, to first order in the gap
        contrast_lumens_free(lumens);
        scene_free(scene);
    }
}

// --- the column ---

static double annulus_volume(double length, double outer, double inner) { return PI * (outer * outer - inner * inner) * length; }

static void the_front_goes_as_flow_over_area(void **state)
{
    (void)state;
    Scene *scene = scene_of(THREE);
    ContrastLumens *lumens = lumens_of(scene, NULL);
    const double inserted[] = {200, 130, 130};   // from the hub 30 mm beside the thick section, 300 beside the thin one, 70 open
    double out[TOOLS_MOST] = {0}, rate = 100, t = 0;     // [mm3/s]
    double thick = annulus_volume(30, 0.9, 0.4), thin = annulus_volume(300, 0.9, 0.35), open = annulus_volume(70, 0.9, 0);
    for (int i = 0; i < 900; i++) {
        contrast_lumens_advance(lumens, 0.01, inserted, 0, rate * 0.01, out);
        t += 0.01;
        double v = rate * t;
        double front = v < thick ? v / (thick / 30) : v < thick + thin ? 30 + (v - thick) / (thin / 300) : 330 + (v - thick - thin) / (open / 70);
        if (v < thick + thin + open) {
            assert_close(contrast_lumens_front(lumens, 0, inserted), front, 1e-9);
            assert_true(out[0] <= 1e-9);
        } else {
            assert_close(out[0], v - thick - thin - open, 1e-6);
        }
    }
    assert_true(out[0] > 10 && out[1] <= 0 && out[2] <= 0);
    // the saline drip washes it out: a sharp rear front, and all agent leaves at the tip
    double injected = rate * t, drip = 1000 * lumen_default_options().flush_ml_s;
    for (int i = 0; i < (int)((thick + thin + open) / drip / 0.01) + 2; i++)
        contrast_lumens_advance(lumens, 0.01, inserted, -1, 0, out);
    assert_close(out[0], injected, 1e-9);
    assert_true(contrast_lumens_within(lumens, 0) <= 0);
    contrast_lumens_free(lumens);
    scene_free(scene);
}

static void without_a_drip_the_column_stays(void **state)
{
    (void)state;
    Scene *scene = scene_of(THREE);
    LumenOptions options = lumen_default_options();
    options.flush_ml_s = 0;
    ContrastLumens *lumens = lumens_of(scene, &options);
    const double inserted[] = {200, 130, 80}, pushed[] = {200, 180, 80};
    double out[TOOLS_MOST] = {0};
    contrast_lumens_advance(lumens, 0.1, inserted, 0, 100, out);
    for (int i = 0; i < 1000; i++)
        contrast_lumens_advance(lumens, 0.1, inserted, -1, 0, out);
    assert_close(contrast_lumens_within(lumens, 0), 100, 1e-12);
    assert_true(out[0] <= 0);
    // a tool that is pushed in displaces its volume, after the column has reached the tip
    contrast_lumens_advance(lumens, 0.1, inserted, 0, 1000, out);
    double before = out[0];
    contrast_lumens_advance(lumens, 0.1, pushed, -1, 0, out);
    double moved = PI * 50 * 0.4 * 0.4;      // 50 mm more of the thick section, the thin one as long as before
    assert_close(out[0] - before, moved, 1e-9);
    contrast_lumens_free(lumens);
    scene_free(scene);
}

static unsigned noise(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

static double random_between(unsigned *seed, double least, double most) { return least + (most - least) * (noise(seed) % 10000) / 1e4; }

// --- into the vessel ---

static VesselTree *tube(int links, double length, double radius)
{
    VesselTree *tree = vessel_tree_create(links + 1, 0, 0);
    assert_non_null(tree);
    for (int i = 0; i <= links; i++) {
        tree->direction[i] = vec3(1, 0, 0);
        tree->parent[i] = i - 1;
        tree->center[i] = vec3(length * i / links, 0, 0);
        tree->radius[i] = radius;
    }
    return tree;
}

static void the_dose_is_kept_whatever_hands_and_injector_do(void **state)
{
    (void)state;
    Scene *scene = scene_of(THREE);
    VesselTree *tree = tube(200, 400, 1.5);
    for (unsigned seed = 1; seed <= 8; seed++) {
        ContrastInjection *injection = injection_of(scene, tree);
        float *seen = calloc((size_t)contrast_injection_node_count(injection), sizeof *seen);
        TipPlaces places = {.inserted = {200, 250, 300}};
        unsigned draws = seed;
        double injected = 0;
        XrayControl xray = xray_default_control();
        for (int i = 0; i < 3000; i++) {
            if (i % 40 == 0) {
                xray.contrast_tool = (float)(noise(&draws) % 4);
                xray.contrast_ml_s = noise(&draws) % 2 ? (float)random_between(&draws, 0, 4) : 0;
            }
            for (int k = 0; k < 3; k++) {
                places.inserted[k] = fmax(100, fmin(350, places.inserted[k] + random_between(&draws, -2, 2)));
                places.node[k] = (int)(places.inserted[k] / 2);
            }
            places.foremost_node = places.node[2];
            double volume = contrast_injection_flow(injection, &xray, places.inserted) * 0.01;
            contrast_injection_advance(injection, 0.01, &xray, volume, &places);
            injected += volume;
            double sum = contrast_injection_within_ml(injection) + contrast_injection_gone_ml(injection);
            assert_true(fabs(contrast_injection_injected_ml(injection) - injected) <= 1e-9 && fabs(sum - injected) <= 1e-9 * fmax(injected, 1));
            if (i % 100 == 0) {
                contrast_injection_read(injection, seen);
                for (int j = 0; j < contrast_injection_node_count(injection); j++)
                    assert_true(seen[j] >= 0 && seen[j] <= 1);
            }
        }
        assert_true(injected > 5 && contrast_injection_gone_ml(injection) > 1);
        free(seen);
        contrast_injection_free(injection);
    }
    vessel_tree_free(tree);
    scene_free(scene);
}

static void what_is_seen_in_a_lumen_is_what_is_in_it(void **state)
{
    (void)state;
    Scene *scene = scene_of(THREE);
    ContrastLumens *lumens = lumens_of(scene, NULL);
    const double inserted[] = {200, 250, 300};
    double out[TOOLS_MOST] = {0};
    float *filling = calloc(3 * NODES, sizeof *filling);
    for (int i = 0; i < 40; i++) {
        contrast_lumens_advance(lumens, 0.1, inserted, 0, 20, out);
        contrast_lumens_read(lumens, inserted, filling);
        double sum = 0, most = 0;
        for (int j = 0; j < NODES; j++) {
            sum += (double)filling[j] * PI * 0.81 * 400 / (NODES - 1) * (j == 0 || j == NODES - 1 ? 0.5 : 1);
            most = fmax(most, (double)filling[j]);
        }
        assert_close(sum, contrast_lumens_within(lumens, 0), 1e-5);  // floats
        assert_true(most <= 1 - 0.35 * 0.35 / 0.81 + 1e-6);          // the inner tool displaces agent
        for (int j = NODES; j < 3 * NODES; j++)
            assert_true(filling[j] <= 0);
    }
    free(filling);
    contrast_lumens_free(lumens);
    scene_free(scene);
}

static int most_opaque(ContrastInjection *injection, float *seen)
{
    int best = 0;
    contrast_injection_read(injection, seen);
    for (int i = 1; i < contrast_injection_tree_nodes(injection); i++)
        best = seen[i] > seen[best] ? i : best;
    return seen[best] > 0 ? best : -1;
}

// The agent leaves at the current place of the guide's tip, at 40 mm and later at 120 mm, although the wire is further in.
static void it_comes_out_at_the_chosen_tool_s_tip(void **state)
{
    (void)state;
    Scene *scene = scene_of(THREE);
    VesselTree *tree = tube(200, 400, 1.5);
    ContrastInjection *injection = injection_of(scene, tree);
    float *seen = calloc((size_t)contrast_injection_node_count(injection), sizeof *seen);
    XrayControl xray = xray_default_control();
    xray.contrast_ml_s = 3;
    xray.contrast_tool = 1;
    double delay = 0, lumen = (annulus_volume(260, 0.9, 0.4) + annulus_volume(140, 0.9, 0.35)) / 3000;   // [s]
    TipPlaces places = {.inserted = {40, 200, 300}, .node = {20, 100, 150}, .foremost_node = 150};
    while (most_opaque(injection, seen) < 0 && delay < 2) {
        contrast_injection_advance(injection, 0.01, &xray, 0.03, &places);
        delay += 0.01;
    }
    // the first stride in which agent has left, and at most a sweep of the vessel after it
    assert_true(delay > lumen && delay < lumen + 0.03);
    assert_int_equal(most_opaque(injection, seen), 20);
    for (int i = 0; i < 20; i++)
        assert_true(seen[i] <= 0.5F * seen[20]);
    places.inserted[0] = 120;
    places.node[0] = 60;
    for (int i = 0; i < 20; i++)
        contrast_injection_advance(injection, 0.01, &xray, 0.03, &places);
    contrast_injection_read(injection, seen);
    assert_true(seen[60] > 0.9F && seen[20] < 0.5F);
    free(seen);
    contrast_injection_free(injection);
    vessel_tree_free(tree);
    scene_free(scene);
}

static void the_lumen_is_the_chosen_tool_s_or_the_next_around_it(void **state)
{
    (void)state;
    Scene *three = scene_of(THREE), *wire = scene_of(HEAD "tools:\n" WIRE);
    ContrastInjection *of_three = injection_of(three, NULL), *of_wire = injection_of(wire, NULL);
    XrayControl xray = xray_default_control();
    const int expected[] = {-1, 0, 1, 1, 1};
    for (int chosen = 0; chosen < 5; chosen++) {
        xray.contrast_tool = (float)chosen;
        assert_int_equal(contrast_injection_tool(of_three, &xray), expected[chosen]);
        assert_int_equal(contrast_injection_tool(of_wire, &xray), -1);
    }
    // only a wire: all agent flows, as through a catheter that does not exist
    const double inserted[TOOLS_MOST] = {100};
    xray.contrast_ml_s = 3;
    assert_close(contrast_injection_flow(of_wire, &xray, inserted), 3, 1e-12);
    contrast_injection_free(of_three);
    contrast_injection_free(of_wire);
    scene_free(three);
    scene_free(wire);
}

static void a_copy_continues_the_same_and_no_advance_allocates(void **state)
{
    (void)state;
    Scene *scene = scene_of(THREE);
    VesselTree *tree = tube(100, 400, 1.5);
    ContrastInjection *injection[2] = {injection_of(scene, tree), injection_of(scene, tree)};
    size_t nodes = (size_t)contrast_injection_node_count(injection[0]);
    float *seen[2] = {calloc(nodes, sizeof(float)), calloc(nodes, sizeof(float))};
    XrayControl xray = xray_default_control();
    xray.contrast_tool = 3;
    TipPlaces places = {.inserted = {40, 200, 300}, .node = {10, 50, 75}, .foremost_node = 75};
    heap_watch(true);
    long before = heap_calls();
    for (int i = 0; i < 1000; i++) {
        xray.contrast_ml_s = i % 300 < 200 ? 2 : 0;
        double volume = contrast_injection_flow(injection[0], &xray, places.inserted) * 0.01;
        if (i == 500)
            contrast_injection_copy(injection[1], injection[0]);
        for (int k = 0; k < (i < 500 ? 1 : 2); k++)
            contrast_injection_advance(injection[k], 0.01, &xray, volume, &places);
    }
    for (int k = 0; k < 2; k++)
        contrast_injection_read(injection[k], seen[k]);
    assert_true(heap_calls() == before);
    heap_watch(false);
    assert_memory_equal(seen[0], seen[1], nodes * sizeof(float));
    assert_true(contrast_injection_gone_ml(injection[0]) > 0);
    for (int k = 0; k < 2; k++) {
        free(seen[k]);
        contrast_injection_free(injection[k]);
    }
    vessel_tree_free(tree);
    scene_free(scene);
}

// A narrower catheter with more nodes replaces one that contains agent: the agent leaves with the old one, and the flow through the new one is smaller.
static void another_device_brings_saline(void **state)
{
    (void)state;
    Scene *scene =
        scene_of("seldinger: 1\ntools:\n"
                 "  - {name: catheter, kind: catheter, sections: [{length_mm: 100, diameter_mm: 1.6, inner_diameter_mm: 1.2, young_modulus_gpa: 1}],\n"
                 "     exchange: [{elements: 500, sections: [{length_mm: 80, diameter_mm: 1.2, inner_diameter_mm: 0.8, young_modulus_gpa: 1}]}]}\n"
                 "  - {name: wire, kind: wire, inserted_mm: 20, sections: [{length_mm: 200, diameter_mm: 0.1, young_modulus_gpa: 20}]}\n"
                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 10}\n");
    ContrastLumens *lumens = lumens_of(scene, NULL), *copy = lumens_of(scene, NULL);
    const double withdrawn[TOOLS_MOST] = {10, -1000};
    double out[TOOLS_MOST] = {0};
    assert_int_equal(contrast_lumens_node_count(lumens), 501 + NODES);
    double wide = contrast_lumens_passes(lumens, 0, withdrawn);
    contrast_lumens_advance(lumens, 0.01, withdrawn, 0, 20, out);
    assert_close(contrast_lumens_within(lumens, 0), 20, 1e-12);
    assert_true(contrast_lumens_fit(lumens, 0, 0) == 0 && contrast_lumens_fit(lumens, 0, 2) == 0);      // this device is in already; that device does not exist
    assert_close(contrast_lumens_fit(lumens, 0, 1), 20, 1e-12);
    assert_true(contrast_lumens_within(lumens, 0) == 0);
    assert_close(wide / contrast_lumens_passes(lumens, 0, withdrawn), tube_resistance(80, 0.4) / tube_resistance(100, 0.6), 1e-9);
    contrast_lumens_advance(lumens, 0.01, withdrawn, 0, 10, out);
    contrast_lumens_copy(copy, lumens);
    float filling[501 + NODES], again[501 + NODES];
    contrast_lumens_read(lumens, withdrawn, filling);
    contrast_lumens_read(copy, withdrawn, again);
    assert_memory_equal(filling, again, sizeof filling);
    assert_true(filling[0] > 0.99F && filling[500] <= 0);     // 20 of its 80 mm
    contrast_lumens_free(lumens);
    contrast_lumens_free(copy);
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(the_annulus_is_the_equation_of_motion_s),
        cmocka_unit_test(another_device_brings_saline),
        cmocka_unit_test(flow_is_poiseuille_s_in_series_and_falls_beside_a_tool),
        cmocka_unit_test(a_wire_without_clearance_lets_next_to_nothing_through),
        cmocka_unit_test(the_front_goes_as_flow_over_area),
        cmocka_unit_test(without_a_drip_the_column_stays),
        cmocka_unit_test(the_dose_is_kept_whatever_hands_and_injector_do),
        cmocka_unit_test(what_is_seen_in_a_lumen_is_what_is_in_it),
        cmocka_unit_test(it_comes_out_at_the_chosen_tool_s_tip),
        cmocka_unit_test(the_lumen_is_the_chosen_tool_s_or_the_next_around_it),
        cmocka_unit_test(a_copy_continues_the_same_and_no_advance_allocates),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

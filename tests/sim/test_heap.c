// A step allocates nothing: the test counts heap calls between the start and the end of a step, only in the simulation thread; the writer of a recording may
// allocate.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "recon/fit/lim_fit.h"
#include "recon/phantom/phantom.h"
#include "sim/recording.h"

#include "../heap_calls.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static Faults faults;

// As in the program: a step, then a row of the recording.
static unsigned run_watched(const char *name, const char *text, const Vessel *vessel, int steps, bool recorded)
{
    Scene *scene = scene_parse(text, strlen(text), "test", &faults);
    assert_non_null(scene);
    if (scene->inlet_is_root)
        assert_true(vessel->inlet(vessel, &scene->wire.start, &scene->wire.direction));
    Vessel *tube = scene->source == SOURCE_TUBE ? tube_vessel_create(&scene->tube, "test", &faults) : NULL;
    Simulator *simulator = simulator_create(scene, tube ? tube : vessel, &faults);
    assert_non_null(simulator);
    RecordingOptions options = recording_default_options();
    char path[] = "/tmp/seldinger-heap-XXXXXX";
    int file = recorded ? mkstemp(path) : -1;
    Recording *recording = recorded ? recording_create(path, simulator, &options, &faults) : NULL;
    long before = heap_calls();
    int cursor = 0;
    for (int i = 0; i < steps; i++) {
        Command command = scene->script ? script_at(scene->script, i * scene->dt / 1000, &cursor) : (Command){0, 0};
        heap_watch(true);
        simulator_step_one_tool(simulator, command);
        if (recording)
            assert_true(recording_step(recording, simulator, &(ToolCommands){.tool = {command}}, NULL));
        heap_watch(false);
    }
    long used = heap_calls() - before;
    const RunTotals *totals = simulator_totals(simulator);
    unsigned flags = totals->flags;
    print_message("%-34s %5d steps: %ld heap calls; %lld not converged, %lld linearised again, %lld limited, deepest %.3f mm, at most %d contacts\n", name,
                  steps, used, (long long)totals->not_converged_steps, (long long)totals->further_linearisations, (long long)totals->limited_steps,
                  totals->penetration_max, totals->contacts_max);
    assert_int_equal(used, 0);
    if (recording)
        assert_true(recording_close(recording, simulator, &faults));
    if (file >= 0) {
        close(file);
        unlink(path);
    }
    simulator_destroy(simulator);
    if (tube)
        tube->destroy(tube);
    scene_free(scene);
    return flags;
}

#define STIFF "sections: [{length_mm: 40, diameter_mm: 0.2, young_modulus_gpa: 100, poisson_ratio: 0.48}]"
#define IN_AND_OUT                                                                                                                                             \
    "script: [{t_s: 0, push_mm_s: 50, twist_deg_s: 180}, {t_s: 0.6, push_mm_s: -50, twist_deg_s: 180}, {t_s: 1.1, push_mm_s: 0, twist_deg_s: 0}]\n"
#define BENT "vessel: {friction: 0.3, tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], radius_mm: 0.5, ends: closed, path: [{line_mm: 5}, "
#define BENDS "{arc: {radius_mm: 6, angle_deg: 170}}, {arc: {radius_mm: 5, angle_deg: 170, plane_deg: 180}}]}}\n"

static void steps_in_a_tube(void **state)
{
    (void)state;
    need_counting();
    const char *text = "seldinger: 1\n" BENT BENDS "wire: {elements: 200, " STIFF "}\n"
                       "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n" IN_AND_OUT;
    run_watched("tube", text, NULL, 1200, false);
    run_watched("tube, recorded", text, NULL, 1200, true);
    unsigned flags = run_watched("tube, pointwise form, capped",
                                 "seldinger: 1\n" BENT BENDS "wire: {elements: 100, " STIFF "}\n"
                                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n"
                                 "simulation: {contact_form: pointwise, contact_iterations: 20}\n" IN_AND_OUT,
                                 NULL, 250, false);
    assert_true(flags & STEP_NOT_CONVERGED);
    flags = run_watched("tube, block form, capped",
                        "seldinger: 1\n" BENT BENDS "wire: {elements: 200, " STIFF "}\n"
                        "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n"
                        "simulation: {contact_iterations: 2}\n" IN_AND_OUT,
                        NULL, 250, false);
    assert_true(flags & STEP_NOT_CONVERGED);
    // the mouth 0.3 mm beside the lumen's wall
    flags = run_watched("entry outside the wall",
                        "seldinger: 1\n" BENT BENDS "wire: {elements: 200, " STIFF "}\n"
                        "sheath: {entry_mm: [1, 0.8, 0], direction: [1, 0, 0], inserted_mm: 3}\n" IN_AND_OUT,
                        NULL, 250, false);
    assert_true(flags & STEP_DEEP);
}

static void a_wire_that_snaps(void **state)
{
    (void)state;
    need_counting();
    // released with 12 rad of bend: more than the rotation of a step
    unsigned flags = run_watched("a coil let go in a tube",
                                 "seldinger: 1\n" BENT "{line_mm: 60}]}}\n"
                                 "wire: {elements: 100, sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80, rest_curvature_1_mm: 0.3}]}\n"
                                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 38}\n"
                                 "script: [{t_s: 0, push_mm_s: 0, twist_deg_s: 720}, {t_s: 1, push_mm_s: 0, twist_deg_s: 0}]\n",
                                 NULL, 600, false);
    flags |= run_watched("a coil let go in the open",
                         "seldinger: 1\n"
                         "wire: {elements: 100, sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80, rest_curvature_1_mm: 0.3}]}\n"
                         "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 38}\n",
                         NULL, 600, false);
    assert_true(flags & STEP_LIMITED);
}

static void steps_in_a_fitted_vessel(void **state)
{
    (void)state;
    need_counting();
    static const char option[1][2][64] = {{"rise_mm", "5"}};
    LimFitOptions options = lim_fit_default_options();
    options.voxel_mm = shape_options_voxel_mm(0, NULL);
    VesselTree *tree = shape_tree("spiral", 1, option, "test", &faults), *model = tree ? lim_fit(tree, &options, NULL, &faults) : NULL;
    Vessel *vessel = model ? lim_vessel_create(model) : NULL;
    assert_non_null(vessel);
    run_watched(
        "fitted spiral, recorded",
        "seldinger: 1\nvessel: {friction: 0.2, shape: {name: spiral}}\nwire: {elements: 200, " STIFF "}\n"
        "sheath: {inlet: root, inserted_mm: 1}\n"
        "script: [{t_s: 0, push_mm_s: 50, twist_deg_s: 180}, {t_s: 0.38, push_mm_s: -50, twist_deg_s: 180}, {t_s: 0.76, push_mm_s: 0, twist_deg_s: 0}]\n",
        vessel, 1000, true);
    vessel->destroy(vessel);
    vessel_tree_free(model);
    vessel_tree_free(tree);
}

int main(void)
{
    recording_prepare_process();
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_counter_counts), cmocka_unit_test(steps_in_a_tube), cmocka_unit_test(a_wire_that_snaps),
                                       cmocka_unit_test(steps_in_a_fitted_vessel)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

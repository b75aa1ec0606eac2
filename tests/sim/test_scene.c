// Scenes: units, defaults, and the faults of invalid scenes: each with line and column, all faults of a file in one pass.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/patient_landmarks.h"
#include "sim/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// cmocka's own function compares in single precision
#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

#define VERSION "seldinger: 1\n"
#define WIRE "wire: {sections: [{length_mm: 100, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
#define SHEATH "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n"
#define WHOLE VERSION WIRE SHEATH       // three lines; a case adds lines from line 4 on

#define REST(list) VERSION SHEATH "wire:\n  sections: [{length_mm: 100, diameter_mm: 0.36, young_modulus_gpa: 80}]\n  rest: " list "\n"
#define CASE "{name: a, quantity: push_force_n, reference: 1, tolerance: 1"
#define ARCH(landmarks) WHOLE "anatomy: {segment: aortic_arch, landmarks: [" landmarks "]}\n"
#define VERIFY(inner) WHOLE "verify: {cases: [{name: a, " inner "}]}\n"

static Faults faults;

static Scene *parse(const char *text)
{
    faults_clear(&faults);
    return scene_parse(text, strlen(text), "x.yaml", &faults);
}

static Scene *good(const char *text)
{
    Scene *scene = parse(text);
    if (!scene)
        fail_msg("refused: %s", faults.text[0]);
    return scene;
}

static void units_are_converted_once(void **state)
{
    (void)state;
    char path[] = SOURCE_DIR "/tests/fuzz/corpus/scene/full.yaml";
    faults_clear(&faults);
    Scene *scene = scene_load(path, &faults);
    assert_non_null(scene);
    const WireSection *shaft = &scene->wire.section[0], *tip = &scene->wire.section[1];
    assert_near(shaft->young_modulus, 80000, 1e-9);
    assert_near(shaft->density, 6.45e-3, 1e-15);
    assert_near(shaft->friction, -1, 0);
    assert_near(tip->rest_curvature, 0.1, 0);
    assert_near(tip->friction, 0.02, 0);
    assert_near(scene->wire.damping_mass, 0.1e-3, 1e-18);
    assert_near(scene->wire.damping_stiffness, 0.2, 1e-15);
    assert_near(scene->wire.load[0].ramp, 500, 0);
    assert_near(scene->wire.load[0].s, 300, 0);
    assert_int_equal(scene->wire.fix[0].dof, DOF_ALL);
    assert_int_equal(scene->wire.fix[1].dof, DOF_X | DOF_RY);
    assert_near(scene->tube.piece[1].angle, PI / 2, 1e-15);
    assert_near(scene->script->row[0].command.push_mm_s, 20, 0);
    assert_int_equal(scene->source, SOURCE_TUBE);
    assert_int_equal(scene->contact, CONTACT_TUBE);
    assert_near(scene->friction, 0.04, 0);
    assert_true(scene->wire.has_sheath);
    assert_string_equal(scene->target[0].name, "aneurysm");
    scene_free(scene);
    // gravity: 9.81 m/s2 is 0.00981 mm/ms2; falling 0.1 s from rest by g t^2 / 2 is 49.05 mm
    scene = good(VERSION WIRE "rig: {gravity_m_s2: [0, 0, -9.81]}\n");
    assert_near(0.5 * scene->wire.gravity.z * 100 * 100, -49.05, 1e-9);
    scene_free(scene);
}

static void landmarks_place_the_vessel_in_the_patient(void **state)
{
    (void)state;
    Scene *scene = good(WHOLE "anatomy: aortic_arch\n");
    assert_string_equal(patient_segment_name[scene->anatomy_segment - 1], "aortic_arch");
    assert_false(scene->has_anatomy_fit);
    const int segment = scene->anatomy_segment - 1;
    scene_free(scene);
    // landmarks landmarks of a patient who lies along -x, looks up z and has 1.1 times the usual size
    const Similarity place = {.turn = mat3_from_columns(vec3(0, 1, 0), vec3(0, 0, 1), vec3(1, 0, 0)), .scale = 1.1, .shift = {100, -20, 7}};
    char text[2000] = WHOLE "anatomy: {segment: aortic_arch, landmarks: [";
    static const char *const name[] = {"arch_top", "aortic_fork", "left_carotid_fork", "aortic_valve"};
    for (int i = 0; i < 4; i++) {
        Vec3 at;
        assert_true(patient_landmark_at(name[i], segment, &at));
        at = similarity_of(&place, at);
        sprintf(text + strlen(text), "{name: %s, point_mm: [%.17g, %.17g, %.17g]}, ", name[i], at.x, at.y, at.z);
    }
    strcat(text, "]}\n");
    scene = good(text);
    assert_true(scene->has_anatomy_fit);
    assert_near(scene->anatomy_fit.scale, 1.1, 1e-12);
    assert_near(vec3_distance(similarity_of(&scene->anatomy_fit, vec3(10, 20, -300)), similarity_of(&place, vec3(10, 20, -300))), 0, 1e-9);
    assert_near(vec3_distance(scene->patient_superior, vec3(1, 0, 0)), 0, 1e-12);
    assert_near(vec3_distance(scene->patient_anterior, vec3(0, 0, 1)), 0, 1e-12);
    scene_free(scene);
}

// A point of the vessel in the body's frame.
static Vec3 in_body(const Similarity *place, Vec3 x)
{
    Mat3 back = mat3_transpose(&place->turn);
    return vec3_scale(mat3_mul_vec(&back, vec3_sub(x, place->shift)), 1 / place->scale);
}

// The clinical carotid's siphon lies beside the sella, the arch before the spine.
static void the_scenes_vessels_lie_where_they_belong(void **state)
{
    (void)state;
    faults_clear(&faults);
    Scene *carotid = scene_load(SOURCE_DIR "/scenes/aneurism/mca.yaml", &faults), *arch = scene_load(SOURCE_DIR "/scenes/arch/lcca.yaml", &faults);
    if (!carotid || !arch)
        fail_msg("refused: %s", faults.text[0]);
    assert_true(carotid->has_anatomy_fit && arch->has_anatomy_fit);
    Vec3 siphon = in_body(&carotid->anatomy_fit, vec3(50.3, 35.2, 70.4)), inlet = in_body(&carotid->anatomy_fit, vec3(74.7, 12.7, 61.2));
    Vec3 top = in_body(&arch->anatomy_fit, vec3(-392, 38, -25));
    print_message("siphon %.1f %.1f %.1f, inlet %.1f %.1f %.1f, patient's size %.2f; top of the arch %.1f %.1f %.1f, size %.2f\n", siphon.x, siphon.y, siphon.z,
                  inlet.x, inlet.y, inlet.z, carotid->anatomy_fit.scale, top.x, top.y, top.z, arch->anatomy_fit.scale);
    assert_true(siphon.x < -4 && siphon.x > -20 && fabs(siphon.y) < 15 && fabs(siphon.z) < 12);
    assert_true(inlet.z < -15 && inlet.y < siphon.y && inlet.x < siphon.x);          // from below and behind, not through the forehead
    // the arch rises before the spine's right half and bends over it to the left
    Vec3 rise = in_body(&arch->anatomy_fit, vec3(-368, 4, -10));
    assert_true(rise.x > 0 && rise.x < 25 && top.x < 0 && top.x > -30 && top.y > -60 && top.y < -10 && fabs(top.z + 236) < 25);
    scene_free(carotid);
    scene_free(arch);
}

static void what_is_not_said_has_its_default(void **state)
{
    (void)state;
    Scene *scene = good(WHOLE);
    assert_int_equal(scene->wire.elements, 200);
    assert_int_equal(scene->source, SOURCE_NONE);
    assert_near(scene->wire.section[0].poisson_ratio, 0.3, 0);
    assert_near(scene->wire.section[0].density, 6.45e-3, 1e-18);
    assert_near(scene->wire.damping_stiffness, 0, 0);
    assert_near(scene->friction, 0, 0);
    assert_near(scene->dt, 1, 0);
    assert_int_equal(scene->contact_options.max_iterations, 200);
    assert_near(scene->contact_options.tolerance, 1e-6, 0);
    assert_null(scene->script);
    scene_free(scene);
    scene = good(VERSION WIRE "sheath: {inlet: root}\nvessel: {model: m/a.h5}\n");
    assert_true(scene->inlet_is_root);
    assert_string_equal(scene->model_path, "m/a.h5");
    assert_int_equal(scene->contact, CONTACT_LIM);
    scene_free(scene);
    scene = good(VERSION WIRE "rig: {start_mm: [1, 2, 3], direction: [0, 0, 5], normal: [1, 0, 0]}\n");
    assert_false(scene->wire.has_sheath);
    assert_near(scene->wire.direction.z, 1, 0);
    assert_near(scene->wire.normal.x, 1, 0);
    scene_free(scene);
    scene = good(WHOLE "vessel: {shape: {name: spiral, points: 300, seed: 2}}\n");
    assert_string_equal(scene->shape_name, "spiral");
    assert_int_equal(scene->shape_option_count, 2);
    assert_string_equal(scene->shape_option[0][0], "points");
    assert_string_equal(scene->shape_option[0][1], "300");
    scene_free(scene);
}

static void a_rest_shape_becomes_sections(void **state)
{
    (void)state;
    // the pieces end at the tip; a section's border 0.004 mm beside a piece's moves there, another one cuts its piece
    Scene *scene =
        good(VERSION SHEATH
             "wire:\n  sections:\n    - {length_mm: 60, diameter_mm: 0.5, young_modulus_gpa: 80}\n"
             "    - {length_mm: 30.004, diameter_mm: 0.4, young_modulus_gpa: 20}\n    - {length_mm: 9.996, diameter_mm: 0.3, young_modulus_gpa: 5}\n"
             "  rest: [{arc: {radius_mm: 50, angle_deg: 45.8366236105, plane_deg: 90}}, {arc: {radius_mm: 10, angle_deg: 57.2957795131, plane_deg: -30}}]\n");
    static const double length[] = {50, 10, 30, 10}, curvature[] = {0, 0.02, 0.02, 0.1}, plane_deg[] = {0, 90, 90, 60}, diameter[] = {0.5, 0.5, 0.4, 0.3};
    assert_int_equal(scene->wire.section_count, 4);
    for (int i = 0; i < 4; i++) {
        const WireSection *s = &scene->wire.section[i];
        assert_near(s->length, length[i], 1e-8);
        assert_near(s->rest_curvature, curvature[i], 1e-12);
        assert_near(s->rest_plane * 180 / PI, plane_deg[i], 1e-9);
        assert_near(s->diameter, diameter[i], 0);
    }
    scene_free(scene);
}

static void a_verify_plan_is_read(void **state)
{
    (void)state;
    Scene *scene = good(
        WHOLE
        "script: [[0, 1, 0], [2, 0, 0]]\nverify:\n  elements: [10, 20]\n  cases:\n    - {name: a, quantity: wall_force_n, take: mean, s_mm: 50, from_s_mm: 20,"
        " axis: [0, 0, -2], from_t_s: 1, t_s: 2, scale: 10, reference: -4, tolerance_percent: [5, 1], order: 1.5, floor: 0.001}\n"
        "    - {name: b, quantity: penetration_mm, reference: 0, tolerance: 0.005}\n");
    const VerifyPlan *plan = &scene->verify;
    const VerifyCase *a = &plan->cases[0], *b = &plan->cases[1];
    assert_int_equal(plan->case_count, 2);
    assert_int_equal(plan->element[1], 20);
    assert_near(plan->rest_s, 0, 0);                 // the moment is the end of the script
    assert_true(a->quantity == VERIFY_WALL_FORCE && a->take == TAKE_MEAN && a->has_axis && a->axis.z == -1);
    assert_true(a->s_mm == 50 && a->from_s_mm == 20 && a->from_t_s == 1 && a->t_s == 2 && a->scale == 10 && a->order == 1.5);
    assert_near(a->tolerance[0], 0.2, 1e-15);
    assert_near(a->tolerance[1], 0.04, 1e-15);
    assert_true(b->s_mm == 100 && b->from_s_mm == 0 && b->tolerance_count == 1 && b->tolerance[0] == 0.005 && b->t_s == HUGE_VAL);
    scene_free(scene);
    scene = good(WHOLE "verify: {cases: [" CASE "}]}\n");
    assert_near(scene->verify.rest_s, 20, 0);
    scene_free(scene);
}

static void the_contracts_example_with_sheath_and_rig_is_good(void **state)
{
    (void)state;
    Scene *scene = good(VERSION WIRE SHEATH "rig:\n  start_mm: [9, 9, 9]\n  direction: [0, 1, 0]\n  fix: [{s_mm: 0, dof: all}]\n");
    // the sheath gives the start of the wire; the fixed nodes of the rig remain
    assert_near(scene->wire.start.x, 0, 0);
    assert_near(scene->wire.direction.x, 1, 0);
    assert_int_equal(scene->wire.fix_count, 1);
    scene_free(scene);
}

typedef struct Broken {
    const char *text, *place, *words;
} Broken;

#define SECTION(extra) VERSION SHEATH "wire:\n  sections:\n    - {length_mm: 100, diameter_mm: 0.36, young_modulus_gpa: 80, " extra "}\n"
#define TUBE(inner) WHOLE "vessel:\n  tube: {" inner "}\n"
#define RIG(inner) VERSION WIRE "rig: {" inner "}\n"

static const Broken broken[] = {
    // YAML itself
    {"", "1:1", "expected YAML keys and values"},
    {"seldinger: [1\n", "2:1", "not YAML"},
    {"seldinger: 1\n\tx: 1\n", "2:1", "not YAML"},
    {"\xff\xfe\xfd", "1:1", "not YAML"},
    {WHOLE "---\na: 1\n", "4:1", "second YAML document"},
    {"- 1\n- 2\n", "1:1", "not a map"},
    {"hello\n", "1:1", "not a map"},
    // keys
    {WIRE SHEATH, "1:1", "has no key 'seldinger'"},
    {"seldinger: 2\n" WIRE SHEATH, "1:12", "whole number from 1 to 1"},
    {WHOLE "vesel: {}\n", "4:1", "did you mean 'vessel'"},
    {WHOLE "banana: 3\n", "4:1", "expected seldinger, vessel, wire"},
    {WHOLE "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n", "4:1", "duplicate"},
    {VERSION SHEATH, "1:1", "neither 'wire'"},
    {VERSION WIRE, "1:1", "neither 'sheath' nor 'rig'"},
    {VERSION SHEATH "wire: {elements: 10}\n", "3:7", "has no key 'sections'"},
    // wrong units
    {VERSION SHEATH "wire:\n  sections:\n    - {length_m: 0.1, length_mm: 100, diameter_mm: 0.36, young_modulus_gpa: 80}\n", "5:8", "expected 'length_mm'"},
    {SECTION("inner_diameter_cm: 0"), "5:66", "expected 'inner_diameter_mm'"},
    {SECTION("density_kg_m3: 6450"), "5:66", "expected 'density_g_cm3'"},
    {SECTION("density: 6.45"), "5:66", "has no unit; expected 'density_g_cm3'"},
    {SECTION("rest_curvature_1_m: 100"), "5:66", "expected 'rest_curvature_1_mm'"},
    {SECTION("poisson_ratio_percent: 30"), "5:66", "has a unit"},
    {WHOLE "simulation: {step_s: 0.001}\n", "4:14", "expected 'step_ms'"},
    {RIG("gravity_mm_s2: [0, 0, -9810]"), "3:7", "expected 'gravity_m_s2'"},
    // wrong type
    {SECTION("friction: high"), "5:76", "not a number"},
    {SECTION("friction: 5 mm"), "5:76", "not a number"},
    {SECTION("friction: [1]"), "5:76", "is a list"},
    {SECTION("friction: .inf"), "5:76", "not a number"},
    {VERSION SHEATH "wire: {elements: 12.5, sections: [{length_mm: 1, diameter_mm: 1, young_modulus_gpa: 1}]}\n", "3:18", "whole number"},
    {VERSION SHEATH "wire: {sections: 5}\n", "3:18", "not a list"},
    {VERSION SHEATH "wire: {sections: []}\n", "3:18", "0 entries"},
    {VERSION WIRE "sheath: {entry_mm: [0, 0], direction: [1, 0, 0]}\n", "3:20", "2 entries; expected 3 to 3"},
    {VERSION WIRE "sheath: {entry_mm: 0, direction: [1, 0, 0]}\n", "3:20", "[x, y, z]"},
    {WHOLE "vessel: 7\n", "4:9", "not a map"},
    {RIG("loads: [{s_mm: 0, force_n: [0, 0, 1], follower: maybe}]"), "3:55", "one of: false, true"},
    // out of range
    {VERSION SHEATH "wire: {elements: 0, sections: [{length_mm: 1, diameter_mm: 1, young_modulus_gpa: 1}]}\n", "3:18", "from 1 to 10000"},
    {VERSION SHEATH "wire: {elements: 100000, sections: [{length_mm: 1, diameter_mm: 1, young_modulus_gpa: 1}]}\n", "3:18", "from 1 to 10000"},
    {VERSION SHEATH "wire: {sections: [{length_mm: 0, diameter_mm: 1, young_modulus_gpa: 1}]}\n", "3:31", "above 0"},
    {VERSION SHEATH "wire: {sections: [{length_mm: 1, diameter_mm: -1, young_modulus_gpa: 1}]}\n", "3:47", "above 0"},
    {SECTION("poisson_ratio: 0.6"), "5:81", "out of range"},
    {SECTION("inner_diameter_mm: 0.36"), "5:85", "not below 'diameter_mm'"},
    {SECTION("friction: -0.1"), "5:76", "out of range"},
    {VERSION WIRE "sheath: {entry_mm: [0, 0, 0], direction: [0, 0, 0]}\n", "3:42", "no length"},
    {VERSION WIRE "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], normal: [2, 0, 0]}\n", "3:61", "is parallel to"},
    {VERSION WIRE "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 101}\n", "3:66", "at most 100"},
    {WHOLE "simulation: {step_ms: 0}\n", "4:23", "out of range"},
    {WHOLE "simulation: {contact_iterations: 0}\n", "4:34", "whole number"},
    {WHOLE "simulation: {contact_tolerance: -1}\n", "4:33", "out of range"},
    {WHOLE "simulation: {self_contact: maybe}\n", "4:28", "auto, on, off"},
    {WHOLE "targets: [{name: a, point_mm: [0, 0, 0], radius_mm: 0}]\n", "4:53", "above 0"},
    {RIG("fix: [{s_mm: 200, dof: all}]"), "3:20", "at most 100"},
    {RIG("fix: [{s_mm: 0, dof: [x, w]}]"), "3:32", "one of: x, y, z"},
    {RIG("loads: [{s_mm: end}]"), "3:15", "neither 'force_n'"},
    // rest shape
    {REST("[]"), "5:9", "0 entries"},
    {REST("[{line_mm: 200}]"), "5:9", "200 mm long, the wire 100 mm"},
    {REST("[{arc: {radius_mm: 0.3, angle_deg: 10}}]"), "5:10", "smaller than the tool's diameter"},
    {REST("[{arc: {radius_mm: 3}}]"), "5:16", "has no key 'angle_deg'"},
    {REST("[{line_mm: 1, arc: {radius_mm: 3, angle_deg: 10}}]"), "5:10", "is one piece"},
    {VERSION SHEATH "wire:\n  sections: [{length_mm: 100, diameter_mm: 0.36, young_modulus_gpa: 80, rest_curvature_1_mm: 0.1}]\n  rest: [{line_mm: 1}]\n",
     "5:9", "both give a shape"},
    // anatomy
    {WHOLE "anatomy: carotid\n", "4:10", "left_internal_carotid, right_common_carotid"},
    {WHOLE "anatomy: {landmarks: []}\n", "4:10", "has no key 'segment'"},
    {ARCH("{name: siphon, point_mm: [0, 0, 0]}"), "4:52", "expected left_ or right_ and one of: carotid_fork, skull_base"},
    {ARCH("{name: left_arch_top, point_mm: [0, 0, 0]}"), "4:52", "no landmark 'left_arch_top'"},
    {ARCH("{name: arch_top}"), "4:45", "has no key 'point_mm'"},
    {ARCH("{name: arch_top, point_mm: [0, 0, 0]}, {name: aortic_fork, point_mm: [0, 0, 300]}"), "4:44", "three that are not on a line"},
    {ARCH("{name: arch_top, point_mm: [0, 0, 0]}, {name: aortic_fork, point_mm: [0, 0, 300]}") "fluoroscopy: {anterior: [0, -1, 0], superior: [0, 0, 1]}\n",
     "4:44", "the other way round"},
    {ARCH("{name: arch_top, point_mm: [0, 0, 0]}, {name: aortic_fork, point_mm: [0, 0, -100]}") "fluoroscopy: {anterior: [0, -1, 0], superior: [0, 0, 1]}\n",
     "4:44", "times the usual size; expected 0.6 to 1.6"},
    // verify
    {WHOLE "verify: 1\n", "4:9", "not a map"},
    {WHOLE "verify: {cases: []}\n", "4:17", "0 entries"},
    {WHOLE "verify: {elements: [20, 10], cases: [" CASE "}]}\n", "4:25", "expected rising numbers"},
    {VERIFY("quantity: speed, reference: 1, tolerance: 1"), "4:38", "one of: position_mm"},
    {VERIFY("quantity: position_mm, reference: 1, tolerance: 1"), "4:18", "has no key 's_mm'"},
    {VERIFY("quantity: position_mm, s_mm: 101, reference: 1, tolerance: 1"), "4:57", "at most 100"},
    {VERIFY("quantity: wall_force_n, s_mm: 10, from_s_mm: 20, reference: 1, tolerance: 1"), "4:73", "lies beyond 's_mm' 10"},
    {VERIFY("quantity: tangent_deg, s_mm: end, reference: 1, tolerance: 1"), "4:18", "has no key 'axis'"},
    {VERIFY("quantity: push_force_n, s_mm: 1, reference: 1, tolerance: 1"), "4:58", "has no effect here"},
    {VERIFY("quantity: push_force_n, tolerance: 1"), "4:18", "has no key 'reference'"},
    {VERIFY("quantity: push_force_n, reference: 1"), "4:18", "has no key 'tolerance'"},
    {VERIFY("quantity: push_force_n, reference: 0, tolerance_percent: 1"), "4:85", "is absolute"},
    {VERIFY("quantity: push_force_n, reference: 1, tolerance: [1, 2]"), "4:77", "1 to 1"},
    {VERIFY("quantity: push_force_n, reference: 1, tolerance: 1, order: 2"), "4:87", "at least two numbers"},
    {VERIFY("quantity: push_force_n, reference: 1, tolerance: 1, scale: 0"), "4:87", "divided by it"},
    {VERIFY("quantity: push_force_n, reference: 1, tolerance: 1, from_t_s: 1"), "4:90", "has no effect here"},
    {VERIFY("quantity: push_force_n, take: mean, t_s: 1, from_t_s: 2, reference: 1, tolerance: 1"), "4:18", "not before"},
    // vessel
    {WHOLE "vessel: {friction: 0.1}\n", "4:9", "exactly one of model, shape, tube, plane"},
    {WHOLE "vessel: {model: a.h5, plane: {normal: [0, 0, 1]}}\n", "4:30", "second source"},
    {WHOLE "vessel: {model: a.h5, friction: -1}\n", "4:33", "out of range"},
    {WHOLE "vessel: {model: a.h5, contact: wall}\n", "4:32", "one of: lim, mesh, tube"},
    {WHOLE "vessel: {model: a.h5, contact: tube}\n", "4:32", "needs the source 'tube'"},
    {WHOLE "vessel: {shape: {points: 3}}\n", "4:17", "has no key 'name'"},
    {WHOLE "vessel: {plane: {point_mm: [0, 0, 0]}}\n", "4:17", "has no key 'normal'"},
    {TUBE("radius_mm: 0, path: [{line_mm: 10}]"), "5:21", "above 0"},
    {TUBE("path: [{line_mm: 10}]"), "5:9", "has no key 'radius_mm'"},
    {TUBE("radius_mm: 1"), "5:9", "one of 'path'"},
    {TUBE("radius_mm: 1, path: [{line_mm: 10, arc: {radius_mm: 5, angle_deg: 90}}]"), "5:31", "either {line_mm"},
    {TUBE("radius_mm: 1, path: [{arc: {radius_mm: 0.5, angle_deg: 90}}]"), "5:31", "tighter than the lumen"},
    {TUBE("radius_mm: 1, path: [{line_mm: -10}]"), "5:41", "above 0"},
    {TUBE("radius_mm: 1, path: [{line_mm: 10}], ends: ajar"), "5:53", "one of: open, closed"},
    {VERSION WIRE "sheath: {inserted_mm: 0}\n", "3:9", "inlet: root"},
    {VERSION WIRE "sheath: {inlet: root}\n", "3:17", "needs a vessel"},
    {VERSION WIRE "sheath: {entry_mm: [0, 0, 0]}\n", "3:9", "has no key 'direction'"},
    // script
    {WHOLE "script: [{t_s: 0, push_mm_s: 5}, {t_s: 0}]\n", "4:34", "does not follow"},
    {WHOLE "script: [{push_mm_s: 5}]\n", "4:10", "has no key 't_s'"},
    {WHOLE "script: [{t_s: 0, push_cm_s: 5}]\n", "4:19", "expected 'push_mm_s'"},
    {WHOLE "script: [{t_s: 0, push_mm_s: 5}]\n", "4:10", "expected another row with a later time"},
    {WHOLE "script: [[0, 5]]\n", "4:10", "2 entries"},
    // aliases
    {VERSION "wire: &w {sections: [*w]}\n" SHEATH, "2:7", ""},
};

static void each_fault_has_its_line_and_column(void **state)
{
    (void)state;
    int wrong = 0;
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++) {
        const Broken *one = &broken[i];
        Scene *scene = parse(one->text);
        char start[64];
        bool found = false;
        snprintf(start, sizeof start, "x.yaml:%s: ", one->place);
        for (int j = 0; j < faults.count && j < FAULTS_CAPACITY; j++)
            found |= !strncmp(faults.text[j], start, strlen(start)) && strstr(faults.text[j], one->words);
        if (scene || !found)
            wrong++, print_error("case %zu:\n%s-- expected %s … %s\n-- %d faults, the first: %s\n", i, one->text, one->place, one->words, faults.count,
                                 faults.count ? faults.text[0] : "");
    }
    assert_int_equal(wrong, 0);
}

static void a_polyline_has_two_points_at_least(void **state)
{
    (void)state;
    char path[] = "/tmp/seldinger-points-XXXXXX", text[500];
    static const char *const points = "x_mm,y_mm,z_mm\n0,0,0\n10,0,0\n";
    FILE *file = fdopen(mkstemp(path), "w");
    assert_non_null(file);
    fputs(points, file);
    assert_int_equal(fclose(file), 0);
    snprintf(text, sizeof text, "%svessel: {tube: {radius_mm: 1, points: %s}}\n", WHOLE, path);
    Scene *scene = good(text);
    assert_int_equal(scene->tube.point_count, 2);
    assert_true(scene->tube.point[1].x == 10);
    scene_free(scene);
    assert_int_equal(truncate(path, (off_t)(strlen(points) - strlen("10,0,0\n"))), 0);
    assert_null(parse(text));
    assert_int_equal(faults.count, 1);
    assert_non_null(strstr(faults.text[0], "has 1 points; expected at least 2"));
    remove(path);
}

static void all_faults_come_in_one_pass(void **state)
{
    (void)state;
    assert_null(parse("seldinger: 3\n"
                      "vessel: {tube: {radius_mm: -1, path: [{line_cm: 4}]}, friction: x, contac: lim}\n"
                      "wire:\n"
                      "  elements: 100000\n"
                      "  sections: [{length_mm: 1, diameter_cm: 2, young_modulus_gpa: 0}]\n"
                      "sheath: {entry_mm: [0, 0, 0], direction: [0, 0, 0]}\n"
                      "sheath: 4\n"
                      "simulation: {step_ms: -1}\n"
                      "targets: [{name: a}]\n"));
    // version; radius; line_cm, and no path piece; friction; contac; elements; diameter_cm, and no diameter_mm; modulus; direction; second sheath; step; target
    // without point and radius
    const char *words[] = {"seldinger",
                           "radius_mm",
                           "line_mm",
                           "friction",
                           "'contact'",
                           "elements",
                           "expected 'diameter_mm'",
                           "has no key 'diameter_mm'",
                           "young_modulus_gpa",
                           "no length",
                           "duplicate",
                           "step_ms",
                           "has no key 'point_mm'",
                           "has no key 'radius_mm'"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        bool found = false;
        for (int j = 0; j < faults.count && j < FAULTS_CAPACITY; j++)
            found |= strstr(faults.text[j], words[i]) != NULL;
        if (!found)
            fail_msg("no fault says '%s'", words[i]);
    }
}

static void a_missing_script_and_a_wrong_one_are_the_scenes_faults(void **state)
{
    (void)state;
    assert_null(parse(WHOLE "script: nowhere.csv\nbanana: 1\n"));
    assert_int_equal(faults.count, 2);
    assert_null(parse(WHOLE "script: /dev/zero\n"));
    assert_int_equal(faults.count, 1);
}

// Another script takes the place of the scene's; one that cannot be read leaves it.
static void another_script_takes_its_place(void **state)
{
    (void)state;
    Scene *scene = good(WHOLE);
    assert_null(scene->script);
    assert_true(scene_use_script(scene, SOURCE_DIR "/scenes/phantom/push.csv", &faults));
    assert_string_equal(scene->script_path, SOURCE_DIR "/scenes/phantom/push.csv");
    const Script *script = scene->script;
    assert_non_null(script);
    assert_false(scene_use_script(scene, SOURCE_DIR "/no/such.csv", &faults));
    assert_ptr_equal(scene->script, script);
    assert_int_equal(faults.count, 1);
    scene_free(scene);
}

static void many_aliases_end(void **state)
{
    (void)state;
    // ten levels of ten aliases each: 10^10 values if they were followed blindly
    char text[4000];
    size_t used = (size_t)sprintf(text, WHOLE "a0: &a0 {line_mm: 1}\n");
    for (int i = 1; i <= 10; i++)
        used += (size_t)sprintf(text + used, "a%d: &a%d [*a%d, *a%d, *a%d, *a%d, *a%d, *a%d, *a%d, *a%d, *a%d, *a%d]\n", i, i, i - 1, i - 1, i - 1, i - 1,
                                i - 1, i - 1, i - 1, i - 1, i - 1, i - 1);
    sprintf(text + used, "vessel: {tube: {radius_mm: 1, path: *a10}}\n");
    assert_null(parse(text));
    assert_true(faults.count >= 11);
    // a list of a map that holds the list
    assert_null(parse(VERSION "rig: &r {fix: [*r], loads: &l [*l, {s_mm: *l}]}\n" WIRE));
    // a valid alias
    Scene *scene = good(VERSION SHEATH "wire: {sections: [&s {length_mm: 10, diameter_mm: 0.36, young_modulus_gpa: 80}, *s]}\n");
    assert_int_equal(scene->wire.section_count, 2);
    scene_free(scene);
}

static void deep_nesting_is_a_fault(void **state)
{
    (void)state;
    enum { DEPTH = 100000 };
    char *text = malloc(2 * DEPTH + 100);
    assert_non_null(text);
    memset(text, '[', DEPTH);
    text[DEPTH] = 0;
    assert_null(parse(text));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(units_are_converted_once),
        cmocka_unit_test(landmarks_place_the_vessel_in_the_patient),
        cmocka_unit_test(the_scenes_vessels_lie_where_they_belong),
        cmocka_unit_test(what_is_not_said_has_its_default),
        cmocka_unit_test(a_rest_shape_becomes_sections),
        cmocka_unit_test(a_verify_plan_is_read),
        cmocka_unit_test(the_contracts_example_with_sheath_and_rig_is_good),
        cmocka_unit_test(each_fault_has_its_line_and_column),
        cmocka_unit_test(a_polyline_has_two_points_at_least),
        cmocka_unit_test(all_faults_come_in_one_pass),
        cmocka_unit_test(a_missing_script_and_a_wrong_one_are_the_scenes_faults),
        cmocka_unit_test(another_script_takes_its_place),
        cmocka_unit_test(many_aliases_end),
        cmocka_unit_test(deep_nesting_is_a_fault),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

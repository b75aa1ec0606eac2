// The tray's devices: those of the scene and those of the library that fit, their pictures, the reasons against an exchange; and the text written into the
// scene.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/trainer_tray.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LIBRARY SOURCE_DIR "/scenes/tools"

static const char scene_text[] =
    "seldinger: 1\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 10}\n"
    "tools:\n"
    "  - name: tube   # comments stay\n"
    "    kind: microcatheter\n"
    "    elements: 40\n"
    "    sections: [{length_mm: 300, diameter_mm: 0.8, inner_diameter_mm: 0.5, young_modulus_gpa: 1}]\n"
    "    exchange:\n"
    "      - {title: a longer one, elements: 40, sections: [{length_mm: 380, diameter_mm: 0.8, inner_diameter_mm: 0.5, young_modulus_gpa: 1}]}\n"
    "  - name: thread\n"
    "    kind: wire\n"
    "    elements: 50\n"
    "    sections: [{length_mm: 380, diameter_mm: 0.36, young_modulus_gpa: 20, friction: 0.02}, {length_mm: 20, diameter_mm: 0.36, young_modulus_gpa: 0.64}]\n"
    "    damping: {mass_1_s: 0.5, stiffness_s: 0.0002}\n";

static Faults faults;

static bool near(double a, double b) { return fabs(a - b) <= 1e-12 * fmax(1, fabs(b)); }
static TrainerTray tray;

static Scene *parse(void)
{
    faults_clear(&faults);
    Scene *scene = scene_parse(scene_text, strlen(scene_text), "x.yaml", &faults);
    if (!scene)
        fail_msg("%s", faults.text[0]);
    return scene;
}

// The tools with the given lengths beyond the sheath's mouth.
static Pose *pose_with(const Scene *scene, double tube_mm, double thread_mm)
{
    Simulator *simulator = simulator_create(scene, NULL, &faults);
    Pose *pose = pose_create_for(simulator);
    const XrayControl xray = xray_default_control();
    pose_take(pose, simulator, &(ToolCommands){0}, &xray);
    simulator_destroy(simulator);
    pose->tool[0].inserted_mm = tube_mm;
    pose->tool[1].inserted_mm = thread_mm;
    return pose;
}

static int find(const char *title)
{
    for (int i = 0; i < tray.devices.count; i++)
        if (!strcmp(tray.devices.device[i].title, title))
            return i;
    return -1;
}

static void the_scenes_devices_and_those_that_fit_are_there(void **state)
{
    (void)state;
    Scene *scene = parse();
    Pose *pose = pose_with(scene, 10, 10);
    int in;
    assert_true(trainer_tray_open(&tray, scene, 1, LIBRARY, pose, &in));
    assert_int_equal(in, 0);
    assert_string_equal(tray.devices.device[0].title, "thread, as the scene has it");
    int steel = find("0.014 inch wire, steel core");
    assert_true(steel > 0 && find("0.014 inch wire, nitinol core") > 0);
    assert_int_equal(find("0.035 inch wire with a J"), -1);              // thicker than the lumen around it
    assert_int_equal(find("microcatheter, angled"), -1);                 // no wire
    for (int i = 0; i < tray.devices.count; i++) {
        assert_true(near(wire_length(&tray.devices.device[i].tool.wire), 400));
        assert_int_equal(tray.devices.device[i].tool.wire.elements, 50);
        assert_int_equal(tray.devices.device[i].tool.kind, TOOL_WIRE);
        assert_true(near(tray.device[i].end_mm[tray.device[i].step_count - 1], 400));
    }
    assert_true(tray.device[steel].can_be_shaped && !tray.device[find("0.014 inch wire, nitinol core")].can_be_shaped);
    // the library folder is not read if the scene lists its devices, and may be missing
    assert_true(trainer_tray_open(&tray, scene, 0, NULL, pose, &in));
    assert_int_equal(tray.devices.count, 2);
    assert_string_equal(tray.devices.device[1].title, "a longer one");
    assert_true(trainer_tray_open(&tray, scene, 0, "/nowhere/at/all", pose, &in));
    assert_int_equal(tray.devices.count, 2);
    trainer_tray_close(&tray);
    pose_free(pose);
    scene_free(scene);
}

// A quarter of a circle of 6 mm radius at an end, drawn from the device's points.
static void the_picture_is_the_rest_shape(void **state)
{
    (void)state;
    Scene *scene = parse();
    Pose *pose = pose_with(scene, 10, 10);
    int in;
    assert_true(trainer_tray_open(&tray, scene, 1, LIBRARY, pose, &in));
    const PanelTrayDevice *angled = &tray.device[find("0.014 inch wire, nitinol core")];         // 45 degrees of 6 mm, then 4 mm
    const double *tip = angled->point[angled->point_count - 1], *first = angled->point[0];
    double length = 20, straight = length - 6 * PI / 4 - 4, bend = PI / 4;
    double x = straight + 6 * sin(bend) + 4 * cos(bend), y = 6 * (1 - cos(bend)) + 4 * sin(bend);
    assert_true(fabs(tip[0] - first[0] - x) < 0.02 && fabs(tip[1] - first[1] - y) < 0.02);
    double way = 0;
    for (int i = 1; i < angled->point_count; i++)
        way += hypot(angled->point[i][0] - angled->point[i - 1][0], angled->point[i][1] - angled->point[i - 1][1]);
    assert_true(fabs(way - length) < 0.01);
    trainer_tray_close(&tray);
    pose_free(pose);
    scene_free(scene);
}

static const char *obstacle(const Scene *scene, const Pose *pose, int tool, int device)
{
    int in;
    assert_true(trainer_tray_open(&tray, scene, tool, NULL, pose, &in));
    trainer_tray_show(&tray, scene, pose, &(PanelTrayChoice){.is_open = true, .device = device});
    return trainer_tray_obstacle(&tray);
}

static void what_stands_in_the_way_is_reported(void **state)
{
    (void)state;
    Scene *scene = parse();
    Pose *pose = pose_with(scene, 60, 100);
    assert_non_null(strstr(obstacle(scene, pose, 1, 0), "this device is already inserted"));
    // 100 mm beyond the mouth, the tube's hub 240 mm before it
    const char *text = obstacle(scene, pose, 0, 1);
    assert_non_null(strstr(text, "too short for it: 300 mm of that are outside, and this device is 380 mm long"));
    pose->tool[1].inserted_mm = 15;      // 385 outside
    text = obstacle(scene, pose, 0, 1);
    assert_non_null(strstr(text, "'tube' is still inserted: pull it back 60 mm, to the sheath's mouth"));
    pose->tool[0].inserted_mm = 0;
    assert_null(obstacle(scene, pose, 0, 1));
    // the inner one back at the hub
    int in;
    assert_true(trainer_tray_open(&tray, scene, 1, LIBRARY, pose, &in));
    const PanelTrayChoice choice = {.is_open = true, .device = find("0.014 inch wire, steel core")};
    trainer_tray_show(&tray, scene, pose, &choice);
    assert_non_null(strstr(trainer_tray_obstacle(&tray), "'thread' is still inserted: pull it back 314 mm, to the hub"));
    pose->tool[1].inserted_mm = -299.5;
    trainer_tray_show(&tray, scene, pose, &choice);
    assert_null(trainer_tray_obstacle(&tray));
    trainer_tray_close(&tray);
    pose_free(pose);
    scene_free(scene);
}

static void a_tip_is_shaped_where_its_core_keeps_it(void **state)
{
    (void)state;
    Scene *scene = parse();
    Pose *pose = pose_with(scene, 10, -289.5);
    int in;
    assert_true(trainer_tray_open(&tray, scene, 1, NULL, pose, &in));
    PanelTrayChoice choice = {.is_open = true, .is_shaped = true, .length_mm = 8, .angle_deg = 60, .mandrel_mm = 30};
    trainer_tray_show(&tray, scene, pose, &choice);
    assert_non_null(strstr(trainer_tray_obstacle(&tray), "does not make the core yield"));
    assert_non_null(tray.shown.shaped);
    choice.mandrel_mm = 1;
    trainer_tray_show(&tray, scene, pose, &choice);
    assert_null(trainer_tray_obstacle(&tray));       // although it is the inserted tool: shaped, it is another device
    assert_non_null(strstr(tray.shown.shaped->remark, "springs back to 60"));
    const PanelTrayDevice *shown = tray.shown.shaped;
    const double *tip = shown->point[shown->point_count - 1], *before = shown->point[shown->point_count - 2];
    assert_true(fabs(atan2(tip[1] - before[1], tip[0] - before[0]) - PI / 3) < 0.01);
    // a nitinol core does not
    assert_true(trainer_tray_open(&tray, scene, 1, LIBRARY, pose, &in));
    choice.device = find("0.014 inch wire, nitinol core");
    trainer_tray_show(&tray, scene, pose, &choice);
    assert_non_null(strstr(trainer_tray_obstacle(&tray), "only a wire with a steel core"));
    trainer_tray_close(&tray);
    pose_free(pose);
    scene_free(scene);
}

// The written scene is read again: the same device, and the rest of the scene's text unchanged.
static void a_device_is_written_into_the_scene(void **state)
{
    (void)state;
    Scene *scene = parse();
    Pose *pose = pose_with(scene, 10, 10);
    const TipShaping none = {0}, tip = {.length = 9, .angle = 1, .mandrel = 0.8};
    int in;
    assert_true(trainer_tray_open(&tray, scene, 1, LIBRARY, pose, &in));
    const TrayDevice *steel = &tray.devices.device[find("0.014 inch wire, steel core")];
    Scene *one = tray_scene_with(scene, 1, steel, &none, &faults);
    assert_non_null(one);
    Scene *two = tray_scene_with(one, 1, &tray.devices.device[0], &tip, &faults);
    assert_non_null(two);
    assert_int_equal(scene_device_count(two, 1), 3);
    assert_int_equal(scene_device_count(two, 0), 2);
    assert_non_null(strstr(two->text, "name: tube   # comments stay"));
    const SceneTool *added = scene_device(two, 1, 1), *shaped = scene_device(two, 1, 2);
    assert_string_equal(added->title, "0.014 inch wire, steel core");
    assert_int_equal(added->wire.section_count, steel->tool.wire.section_count);
    for (int i = 0; i < added->wire.section_count; i++) {
        const WireSection *a = &added->wire.section[i], *b = &steel->tool.wire.section[i];
        assert_true(near(a->length, b->length) && near(a->diameter, b->diameter) && near(a->young_modulus, b->young_modulus) && near(a->density, b->density));
        assert_true(near(a->attenuation, b->attenuation) && near(a->friction, b->friction) && near(a->poisson_ratio, b->poisson_ratio));
    }
    assert_true(near(added->wire.damping_mass, steel->tool.wire.damping_mass) && near(added->wire.damping_stiffness, steel->tool.wire.damping_stiffness));
    assert_true(near(added->marker_length, 30) && near(added->marker_attenuation, 3) && near(added->wire.hand_limit, 20));
    assert_string_equal(shaped->title, "thread, as the scene has it, tip shaped to 57\u00b0");
    assert_true(near(shaped->tip.length, 9) && near(shaped->tip.angle, 1) && near(shaped->tip.mandrel, 0.8));
    assert_true(shaped->wire.section[0].friction == 0.02);
    // the tool of the scene is unchanged
    assert_true(scene_tool_wire(two, 1).section_count == 2);
    trainer_tray_close(&tray);
    pose_free(pose);
    scene_free(two);
    scene_free(one);
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_scenes_devices_and_those_that_fit_are_there), cmocka_unit_test(the_picture_is_the_rest_shape),
                                       cmocka_unit_test(what_stands_in_the_way_is_reported), cmocka_unit_test(a_tip_is_shaped_where_its_core_keeps_it),
                                       cmocka_unit_test(a_device_is_written_into_the_scene)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

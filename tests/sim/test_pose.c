// Poses of one tool and of several: which nodes are free, where each tool ends on the shared line, which reaches furthest.
#include "sim/pose.h"
#include "sim/simulator.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../geom/near.h"

static const char one_tool[] = "seldinger: 1\n"
                               "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 3, path: [{line_mm: 200}]}}\n"
                               "wire: {elements: 60, sections: [{length_mm: 120, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
                               "sheath: {entry_mm: [1, 0, 0], direction: [1, 0, 0], inserted_mm: 15.5}\n";

static const char two_tools[] =
    "seldinger: 1\n"
    "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 3, path: [{line_mm: 200}]}}\n"
    "tools:\n"
    "  - {name: catheter, kind: catheter, elements: 50, inserted_mm: 12,\n"
    "     sections: [{length_mm: 100, diameter_mm: 1, inner_diameter_mm: 0.6, young_modulus_gpa: 1}]}\n"
    "  - {name: wire, kind: wire, elements: 90, inserted_mm: 12, sections: [{length_mm: 180, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
    "sheath: {entry_mm: [1, 0, 0], direction: [1, 0, 0]}\n";

static Simulator *start(const char *text, Scene **scene, Vessel **vessel)
{
    Faults faults;
    faults_clear(&faults);
    *scene = scene_parse(text, strlen(text), "test.yaml", &faults);
    if (!*scene || faults.count)
        fail_msg("%s", faults.count ? faults.text[0] : "no scene");
    *vessel = tube_vessel_create(&(*scene)->tube, "test.yaml", &faults);
    Simulator *simulator = *vessel ? simulator_create(*scene, *vessel, &faults) : NULL;
    if (!simulator)
        fail_msg("%s", faults.count ? faults.text[0] : "no simulator");
    return simulator;
}

static void stop(Simulator *simulator, Scene *scene, Vessel *vessel)
{
    simulator_destroy(simulator);
    vessel->destroy(vessel);
    scene_free(scene);
}

static void one_tool_is_the_shared_line(void **state)
{
    (void)state;
    Scene *scene;
    Vessel *vessel;
    Simulator *simulator = start(one_tool, &scene, &vessel);
    Pose *pose = pose_create_for(simulator), *filled = pose_create_for(simulator);
    const XrayControl xray = xray_default_control();
    for (int i = 0; i < 40; i++)
        simulator_step_one_tool(simulator, (Command){30, 10});
    pose_take(pose, simulator, &(ToolCommands){.tool = {{30, 10}}}, &xray);
    pose_copy(filled, pose);
    memset(filled->tool[0].node, 0, (size_t)filled->tool[0].node_count * sizeof(ToolNode));
    pose_fill_single_tool(filled);
    assert_int_equal(pose->node_count, pose->tool[0].node_count);
    assert_near(filled->tool[0].inserted_mm, pose->tool[0].inserted_mm, 0);
    assert_near(filled->tool[0].push_n, pose->tool[0].push_n, 0);
    for (int j = 0; j < pose->node_count; j++) {
        const ToolNode *a = &filled->tool[0].node[j], *b = &pose->tool[0].node[j];
        assert_near(a->s, b->s, 0);
        assert_near(vec3_distance(a->position, b->position), 0, 0);
        assert_near(a->radius, b->radius, 0);
    }
    // the first node beyond the mouth
    assert_true(pose->position[pose->first_free_node].x >= 1 - 0.02 && pose->position[pose->first_free_node - 1].x < 1);
    assert_near(pose_tool_end(pose, 0), pose->node_count - 1, 0);
    assert_near(pose_tool_passes(pose, 0, 0), 120, 1e-9);
    assert_int_equal(pose_most_distal(pose), 0);
    pose_free(pose);
    pose_free(filled);
    stop(simulator, scene, vessel);
}

// The wire advances by 15 mm, then the catheter over it and 10 mm further.
static void tools_end_where_their_tips_are(void **state)
{
    (void)state;
    Scene *scene;
    Vessel *vessel;
    Simulator *simulator = start(two_tools, &scene, &vessel);
    Pose *pose = pose_create_for(simulator);
    const XrayControl xray = xray_default_control();
    for (int i = 0; i < 1750; i++) {
        ToolCommands commands = {.tool = {{i < 500 ? 0 : 20, 0}, {i < 500 ? 30 : 0, 0}}, .released = i == 1749 ? 2 : 0};
        simulator_step(simulator, &commands);
        if (i % 125 != 124 && i != 1749)
            continue;
        pose_take(pose, simulator, &commands, &xray);
        double ahead = pose->tool[1].inserted_mm - pose->tool[0].inserted_mm;
        for (int k = 0; k < 2; k++) {
            const PoseTool *tool = &pose->tool[k];
            double end = pose_tool_end(pose, k), part = end - floor(end);
            int at = (int)end, next = at + 1 < pose->node_count ? at + 1 : at;
            Vec3 there = vec3_mix(pose->position[at], pose->position[next], part), tip = tool->node[tool->node_count - 1].position;
            assert_true(vec3_distance(there, tip) < 1e-3);
        }
        assert_near(fmax(pose_tool_end(pose, 0), pose_tool_end(pose, 1)), pose->node_count - 1, 1e-9);
        assert_int_equal(pose_most_distal(pose), ahead > -1e-6);
        // where the wire leaves the catheter, and vice versa
        assert_near(pose_tool_passes(pose, 1, 0), 180 - fmax(ahead, 0), 0.01);
        assert_near(pose_tool_passes(pose, 0, 1), 100 - fmax(-ahead, 0), 0.01);
        // only the catheter passes the mouth, whatever the length of the wire
        double mouth = pose->position[pose->first_free_node].x;
        assert_true(mouth > 1 - 0.02 && pose->position[pose->first_free_node - 1].x < 1);
        assert_true(pose->tool[1].is_released == (i == 1749) && !pose->tool[0].is_released);
    }
    pose_free(pose);
    stop(simulator, scene, vessel);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(one_tool_is_the_shared_line), cmocka_unit_test(tools_end_where_their_tips_are)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

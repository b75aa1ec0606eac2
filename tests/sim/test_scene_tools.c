// Scenes with several tools, the scripts that move them, and the library of devices in scenes/tools.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/text_file.h"
#include "base/yaml_reader.h"
#include "sim/scene.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// cmocka's own function compares in single precision
#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

#define VERSION "seldinger: 1\n"
#define SHEATH "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 50}\n"
#define SECTION(length, outer, inner) "sections: [{length_mm: " length ", diameter_mm: " outer ", inner_diameter_mm: " inner ", young_modulus_gpa: 1}]"
#define GUIDE "  - {name: guide, kind: guide_catheter, " SECTION("300", "2", "1.8") "}\n"
#define MICRO "  - {name: micro, kind: microcatheter, " SECTION("500", "0.8", "0.5") "}\n"
#define WIRE "  - {name: wire, kind: wire, " SECTION("700", "0.36", "0") "}\n"
// The sheath on line 2, the tools from line 4
#define TOOLS(list) VERSION SHEATH "tools:\n" list
#define THREE TOOLS(GUIDE MICRO WIRE)   // six lines

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

static void a_wire_is_the_one_tool(void **state)
{
    (void)state;
    Scene *scene = good(VERSION SHEATH "wire: {" SECTION("300", "0.36", "0") ", tip_marker: {length_mm: 7, attenuation_1_mm: 2}}\n");
    assert_int_equal(scene->tool_count, 1);
    assert_string_equal(scene->tool[0].name, "wire");
    assert_int_equal(scene->tool[0].kind, TOOL_WIRE);
    assert_ptr_equal(scene->tool[0].wire.section, scene->wire.section);
    assert_near(scene->tool[0].wire.inserted, 50, 0);
    assert_near(scene->marker_length, 7, 0);
    assert_near(scene->tool[0].marker_length, 7, 0);
    scene_free(scene);
}

static void the_first_tool_is_the_scenes_wire(void **state)
{
    (void)state;
    Scene *scene = good(THREE);
    static const char *const name[] = {"guide", "micro", "wire"};
    static const ToolKind kind[] = {TOOL_GUIDE_CATHETER, TOOL_MICROCATHETER, TOOL_WIRE};
    static const double length[] = {300, 500, 700};
    assert_int_equal(scene->tool_count, 3);
    for (int k = 0; k < 3; k++) {
        WireOptions wire = scene_tool_wire(scene, k);
        assert_string_equal(scene->tool[k].name, name[k]);
        assert_int_equal(scene->tool[k].kind, kind[k]);
        assert_near(wire_length(&wire), length[k], 0);
        assert_near(wire.inserted, 50, 0);           // that of the tool around it
        assert_near(wire.hand_limit, 20, 0);
        assert_near(scene->tool[k].friction_inside, 0.05, 0);
        assert_true(wire.has_sheath && wire.direction.x == 1 && wire.elements == 200);
    }
    assert_ptr_equal(scene->wire.section, scene->tool[0].wire.section);
    // an inlet that is found later moves all tools
    scene->wire.start = vec3(1, 2, 3);
    assert_near(scene_tool_wire(scene, 2).start.z, 3, 0);
    scene_free(scene);
}

static void each_tool_has_its_own_keys(void **state)
{
    (void)state;
    Scene *scene = good(TOOLS("  - {name: a, kind: catheter, " SECTION(
        "300", "2", "1.8") ", inserted_mm: 20, friction_inside: 0.2, tip_marker: {length_mm: 2, attenuation_1_mm: 4}}\n"
                           "  - {name: b, kind: wire, " SECTION("400", "1", "0") ", inserted_mm: 0, hand_limit_n: 5, elements: 30, damping: {mass_1_s: 1},"
                                                                                 " tip_marker: {length_mm: 5, attenuation_1_mm: 6}, length_mm: 350}\n"));
    const SceneTool *a = &scene->tool[0], *b = &scene->tool[1];
    assert_near(scene->wire.inserted, 20, 0);        // its own value, not the sheath's 50
    assert_near(a->wire.inserted, 20, 0);
    assert_near(b->wire.inserted, 0, 0);
    assert_near(a->friction_inside, 0.2, 0);
    assert_near(b->wire.hand_limit, 5, 0);
    assert_int_equal(b->wire.elements, 30);
    assert_near(b->wire.damping_mass, 1e-3, 1e-18);
    assert_near(a->wire.damping_mass, 0, 0);
    assert_near(b->wire.section[0].length, 350, 0);
    assert_near(scene_tool_attenuation(scene, 0, 299), 4, 0);
    assert_near(scene_tool_attenuation(scene, 0, 299), 4, 0);
    assert_near(scene_tool_attenuation(scene, 1, 346), 6, 0);
    assert_near(scene_tool_attenuation(scene, 1, 344), 0.55, 0);
    scene_free(scene);
}

// In a rig the whole first tool is beyond the start; the others are inserted by their own lengths, at most to their end.
static void a_rig_begins_with_the_whole_first_tool(void **state)
{
    (void)state;
    Scene *scene = good(VERSION "rig: {fix: [{s_mm: 0, dof: all}], gravity_m_s2: [0, 0, -10]}\ntools:\n  - {name: a, kind: catheter, " SECTION(
        "60", "2", "1.8") "}\n"
                          "  - {name: b, kind: catheter, " SECTION("90", "1", "0.5") ", inserted_mm: 30}\n  - {name: c, kind: wire, " SECTION("90", "0.4",
                                                                                                                                              "0") "}\n");
    assert_int_equal(scene->wire.fix_count, 1);
    assert_near(scene->wire.inserted, 0, 0);         // as without `tools:`
    assert_near(scene_tool_wire(scene, 1).inserted, 30, 0);
    assert_near(scene_tool_wire(scene, 2).inserted, 30, 0);
    assert_near(scene_tool_wire(scene, 2).gravity.z, -0.01, 1e-15);
    assert_int_equal(scene_tool_wire(scene, 1).fix_count, 0);
    scene_free(scene);
}

// --- scripts ---

static Command command_of(const Scene *scene, double t_s, int tool)
{
    int cursor = 0;
    return script_tools_at(scene->script, t_s, &cursor).tool[tool];
}

static void a_script_moves_the_tools_it_names(void **state)
{
    (void)state;
    char path[] = "/tmp/seldinger-script-XXXXXX", text[1000];
    int file = mkstemp(path);
    assert_true(file >= 0);
    const char csv[] = "t_s,wire.push_mm_s,wire.twist_deg_s,guide.twist_deg_s,guide.push_mm_s\n0,20,1,2,3\n1,-4,0,0,0\n2,0,0,0,0\n";
    assert_int_equal(write(file, csv, strlen(csv)), strlen(csv));
    close(file);
    snprintf(text, sizeof text, THREE "script: %s\n", path);
    Scene *scene = good(text);
    unlink(path);
    const double want[3][2] = {{3, 2}, {0, 0}, {20, 1}};     // micro is held
    for (int k = 0; k < 3; k++) {
        assert_near(command_of(scene, 0.5, k).push_mm_s, want[k][0], 0);
        assert_near(command_of(scene, 0.5, k).twist_deg_s, want[k][1], 0);
        assert_near(command_of(scene, 2.5, k).push_mm_s, 0, 0);
    }
    assert_near(command_of(scene, 1.5, 2).push_mm_s, -4, 0);
    int cursor = 0;
    assert_near(script_at(scene->script, 0.5, &cursor).push_mm_s, 3, 0);
    scene_free(scene);
}

static void bare_columns_move_the_first_tool(void **state)
{
    (void)state;
    const char *const forms[] = {"[{t_s: 0, push_mm_s: 7, twist_deg_s: 8}, {t_s: 1}]", "[[0, 7, 8], [1, 0, 0]]",
                                 "[{t_s: 0, guide.push_mm_s: 7, guide.twist_deg_s: 8}, {t_s: 1}]"};
    for (int i = 0; i < 3; i++) {
        char text[2000];
        snprintf(text, sizeof text, THREE "script: %s\n", forms[i]);
        Scene *scene = good(text);
        assert_near(command_of(scene, 0.5, 0).push_mm_s, 7, 0);
        assert_near(command_of(scene, 0.5, 0).twist_deg_s, 8, 0);
        assert_near(command_of(scene, 0.5, 1).push_mm_s, 0, 0);
        assert_near(command_of(scene, 0.5, 2).push_mm_s, 0, 0);
        scene_free(scene);
    }
    // rows in the scene: one row moves one tool and the next another
    Scene *scene = good(THREE "script: [{t_s: 0, micro.push_mm_s: 7, micro.twist_deg_s: 0}, {t_s: 1, wire.push_mm_s: 9, wire.twist_deg_s: 0}, {t_s: 2}]\n");
    assert_near(command_of(scene, 0.5, 1).push_mm_s, 7, 0);
    assert_near(command_of(scene, 0.5, 2).push_mm_s, 0, 0);
    assert_near(command_of(scene, 1.5, 1).push_mm_s, 0, 0);
    assert_near(command_of(scene, 1.5, 2).push_mm_s, 9, 0);
    scene_free(scene);
}

static void a_row_in_place_lets_a_tool_go(void **state)
{
    (void)state;
    int cursor = 0;
    Scene *scene = good(
        THREE "script: [{t_s: 0, wire.released: 1, guide.push_mm_s: 7, guide.twist_deg_s: 0}, {t_s: 1, released: 1}, {t_s: 2, wire.released: 0}, {t_s: 3}]\n");
    assert_int_equal(script_tools_at(scene->script, 0.5, &cursor).released, 4);
    assert_int_equal(script_tools_at(scene->script, 1.5, &cursor).released, 1);
    assert_int_equal(script_tools_at(scene->script, 2.5, &cursor).released, 0);
    scene_free(scene);
}

static const struct {
    const char *text, *place, *words;
} broken_script[] = {
    {"t_s,wir.push_mm_s,wir.twist_deg_s\n0,1,0\n", "1:5", "did you mean 'wire'"},
    {"t_s,balloon.push_mm_s,balloon.twist_deg_s\n0,1,0\n", "1:5", "it has: guide, micro, wire"},
    {"t_s,wire.push_mm_s\n0,1\n", "1:5", "'wire.push_mm_s' needs the column 'wire.twist_deg_s' too"},
    {"t_s,micro.push_mm_s,micro.twist_deg_s,wire.twist_deg_s\n0,1,0,0\n", "1:39", "'wire.twist_deg_s' needs the column 'wire.push_mm_s' too"},
    {"t_s,wire.push_mm_s,wire.push_mm_s,wire.twist_deg_s\n0,1,0,0\n", "1:20", "duplicate"},
    {"t_s,wire.push_cm_s,wire.twist_deg_s\n0,1,0\n", "1:5", "such as 'wire.push_mm_s'"},
    {"t_s,push_mm_s,twist_deg_s,wire.push_mm_s,wire.twist_deg_s\n0,1,0,1,0\n", "1:5", "with named tools"},
    {"t,wire.push_mm_s,wire.twist_deg_s\n0,1,0\n", "1:1", "expected 't_s'"},
    {"t_s,wire.push_mm_s,wire.twist_deg_s\n0,1\n", "2:1", "2 fields"},
    {"t_s,wire.released\n0,2\n", "2:1", "released is 2; expected 0 (the tool is held)"},
    {"t_s,wire.released,wire.released\n0,1,1\n", "1:19", "duplicate"},
    {"t_s,wire.push_mm_s,wire.twist_deg_s\n0,1,0\n1,2000,0\n", "3:1", "wire.push_mm_s 2000 is out of range"},
    {"t_s,wire.push_mm_s,wire.twist_deg_s\n", "1:1", "no row"},
};

static bool says(const char *place, const char *words)
{
    for (int j = 0; j < faults.count && j < FAULTS_CAPACITY; j++)
        if (!strncmp(faults.text[j], place, strlen(place)) && strstr(faults.text[j], words))
            return true;
    return false;
}

static void each_fault_of_a_script_has_its_place(void **state)
{
    (void)state;
    const ToolNames tools = {.count = 3, .name = {"guide", "micro", "wire"}};
    int wrong = 0;
    for (size_t i = 0; i < sizeof broken_script / sizeof *broken_script; i++) {
        char place[64];
        faults_clear(&faults);
        snprintf(place, sizeof place, "s.csv:%s: ", broken_script[i].place);
        Script *script = script_parse(broken_script[i].text, strlen(broken_script[i].text), "s.csv", &tools, &faults);
        if (script || !says(place, broken_script[i].words))
            wrong++,
                print_error("%s-- expected %s%s, got: %s\n", broken_script[i].text, place, broken_script[i].words, faults.count ? faults.text[0] : "nothing");
        script_free(script);
    }
    assert_int_equal(wrong, 0);
    // several at once
    const char two[] = "t_s,wir.push_mm_s,guide.push_mm_s,micro.spin\n0,1,0,0\n";
    faults_clear(&faults);
    assert_null(script_parse(two, strlen(two), "s.csv", &tools, &faults));
    assert_int_equal(faults.count, 3);
}

// --- faults ---

typedef struct Broken {
    const char *text, *place, *words;
} Broken;

#define WITH(tool) TOOLS(GUIDE "  - {" tool "}\n")
#define NAMED(name) WITH("name: " name ", kind: wire, " SECTION("700", "0.36", "0"))

static const Broken broken[] = {
    {VERSION SHEATH "tools:\n" GUIDE "wire: {" SECTION("300", "0.36", "0") "}\n", "4:3", "expected either 'wire'"},
    {VERSION SHEATH, "1:1", "neither 'wire' (one tool) nor 'tools'"},
    {VERSION SHEATH "tools: []\n", "3:8", "0 entries"},
    {VERSION SHEATH "tools: {name: a}\n", "3:8", "not a list"},
    {TOOLS(GUIDE GUIDE GUIDE GUIDE WIRE), "8:5", "5 tools; expected at most 4"},
    // keys
    {WITH("kind: wire, " SECTION("700", "0.36", "0")), "5:5", "has no key 'name'"},
    {WITH("name: a, " SECTION("700", "0.36", "0")), "5:5", "has no key 'kind'"},
    {WITH("name: a, kind: wire"), "5:5", "has no key 'sections'"},
    {WITH("name: a, kind: balloon, " SECTION("700", "0.36", "0")), "5:21", "one of: guide_catheter, catheter, microcatheter, wire"},
    {WITH("name: a, kind: wire, insert_mm: 3, " SECTION("700", "0.36", "0")), "5:27", "did you mean 'inserted_mm'"},
    {WITH("name: a, kind: wire, friction_inside: -1, " SECTION("700", "0.36", "0")), "5:44", "out of range"},
    // names
    {NAMED("\"\""), "5:12", "not a string"},
    {NAMED("a.b"), "5:12", "a dot, a comma or a space"},
    {NAMED("\"a,b\""), "5:12", "a dot, a comma or a space"},
    {NAMED("a b"), "5:12", "a dot, a comma or a space"},
    {NAMED("\"a\\tb\""), "5:12", "a dot, a comma or a space"},
    {NAMED("guide"), "5:12", "already used on line 4"},
    {NAMED("abcdefghijklmnopqrstuvwxyzabcdef"), "5:12", "at most 31 letters"},
    // lumen
    {WITH("name: a, kind: wire, " SECTION("700", "1.8", "0")), "5:5", "only 1.8 mm wide"},
    {WITH("name: a, kind: wire, sections: [{length_mm: 650, diameter_mm: 1, young_modulus_gpa: 1}, {length_mm: 50, diameter_mm: 1.9, young_modulus_gpa: 1}]"),
     "5:5", "'a' is up to 1.9 mm thick"},
    {TOOLS("  - {name: a, kind: catheter, " SECTION("300", "2", "0") "}\n" WIRE), "5:5", "which is solid"},
    {TOOLS("  - {name: a, kind: catheter, sections: [{length_mm: 250, diameter_mm: 2, inner_diameter_mm: 1.8, young_modulus_gpa: 1},"
           " {length_mm: 50, diameter_mm: 2, inner_diameter_mm: 0.3, young_modulus_gpa: 1}]}\n" WIRE),
     "5:5", "only 0.3 mm wide"},
    // lengths
    {WITH("name: a, kind: wire, " SECTION("249", "0.36", "0")), "5:5", "make it at least 300 mm long"},
    {WITH("name: a, kind: wire, " SECTION("310", "0.36", "0") ", inserted_mm: 61"), "5:133", "make it at least 311 mm long or insert at most 60 mm"},
    {WITH("name: a, kind: wire, " SECTION("400", "0.36", "0") ", inserted_mm: 401"), "5:133", "at most 400"},
    {WITH("name: a, kind: wire, " SECTION("400", "0.36", "0") ", inserted_mm: -1"), "5:133", "out of range"},
    {WITH("name: a, kind: wire, length_mm: 0, " SECTION("400", "0.36", "0")), "5:38", "out of range"},
    {TOOLS("  - {name: a, kind: wire, length_mm: 50, sections: [{length_mm: 100, diameter_mm: 1, young_modulus_gpa: 1}, {length_mm: 50, diameter_mm: 1, "
           "young_modulus_gpa: 1}]}\n"),
     "4:38", "sections beyond the first are 50 mm long"},
    {VERSION "rig: {start_mm: [0, 0, 0]}\ntools: [{name: a, kind: wire, " SECTION("60", "1", "0") ", inserted_mm: 3}]\n", "3:133", "needs a sheath"},
    {VERSION "rig: {start_mm: [0, 0, 0]}\ntools:\n" GUIDE "  - {name: a, kind: wire, " SECTION("90", "0.36", "0") ", inserted_mm: 91}\n", "5:132",
     "at most 90"},
    {VERSION "rig: {start_mm: [0, 0, 0]}\ntools:\n" GUIDE "  - {name: a, kind: wire, " SECTION("299", "0.36", "0") "}\n", "5:5", "insert at most 299 mm"},
    // rest shapes
    {WITH("name: a, kind: wire, sections: [{length_mm: 700, diameter_mm: 1, young_modulus_gpa: 1, rest_curvature_1_mm: -2}]"), "5:114",
     "tighter than the tool's own radius 0.5 mm"},
    {WITH("name: a, kind: wire, " SECTION("400", "0.36", "0") ", rest: [{arc: {radius_mm: 0.3, angle_deg: 10}}]"), "5:127", "smaller than the tool's diameter"},
    {WITH("name: a, kind: catheter, " SECTION("400", "0.36", "0") ", rest: [{line_mm: 401}]"), "5:130", "the tool 400 mm"},
    // a device that does not exist
    {WITH("name: a, device: nowhere.yaml"), "", "nowhere.yaml"},
    // scripts in place
    {THREE "script: [{t_s: 0, wir.push_mm_s: 1, wire.twist_deg_s: 0}]\n", "7:19", "did you mean 'wire.push_mm_s'"},
    {THREE "script: [{t_s: 0, wire.push_mm_s: 1}]\n", "7:10", "needs 'wire.twist_deg_s' too"},
    {THREE "script: [{t_s: 0, push_mm_s: 1, wire.push_mm_s: 1, wire.twist_deg_s: 0}]\n", "7:10", "not both"},
    {THREE "script: [{t_s: 0, wire.push_mm_s: 1001, wire.twist_deg_s: 0}]\n", "7:10", "wire.push_mm_s 1001 is out of range"},
    {TOOLS(GUIDE "  - {name: wire, kind: wire, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], shaped_tip: {length_mm: 5, angle_deg: "
                 "45, mandrel_mm: 50}}\n"),
     "5:113", "does not make the core yield"},
    {TOOLS(GUIDE "  - {name: wire, kind: wire, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], shaped_tip: {length_mm: 1, angle_deg: "
                 "300, mandrel_mm: 1}}\n"),
     "5:113", "a longer tip, a smaller angle or a thinner mandrel"},
    {TOOLS(GUIDE "  - {name: wire, kind: wire, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], shaped_tip: {length_mm: 5, angle_deg: "
                 "400, mandrel_mm: 1}}\n"),
     "", "angle_deg"},
    {TOOLS(GUIDE
           "  - {name: wire, kind: wire, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], shaped_tip: {length_mm: 5, mandrel_mm: 1}}\n"),
     "", "'angle_deg'"},
    {TOOLS(GUIDE "  - {name: wire, kind: wire, core: nitinol, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], shaped_tip: {length_mm: "
                 "5, angle_deg: 45, mandrel_mm: 1}}\n"),
     "", "springs back from any such bend"},
    {TOOLS(GUIDE "  - {name: wire, kind: wire, core: gold, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], shaped_tip: {length_mm: 5, "
                 "angle_deg: 45, mandrel_mm: 1}}\n"),
     "", "steel, nitinol"},
    {TOOLS("  - {name: guide, kind: guide_catheter, shaped_tip: {length_mm: 5, angle_deg: 45, mandrel_mm: 1}, " SECTION("300", "2", "1.8") "}\n" WIRE), "",
     "only a wire's tip can be shaped by hand"},
};

static void a_tip_is_shaped_by_hand(void **state)
{
    (void)state;
    Scene *scene = good(TOOLS(GUIDE "  - {name: wire, kind: wire, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], "
                                    "exchange: [{title: shaped, sections: [{length_mm: 700, diameter_mm: 0.36, young_modulus_gpa: 1}], "
                                    "shaped_tip: {length_mm: 5, angle_deg: 45, mandrel_mm: 1}}]}\n"));
    const SceneTool *straight = &scene->tool[1], *shaped = &scene->exchange[0].device;
    assert_near(straight->tip.length, 0, 0);
    assert_string_equal(straight->title, "");
    assert_string_equal(shaped->title, "shaped");
    assert_int_equal(shaped->kind, TOOL_WIRE);
    assert_near(shaped->tip.angle, PI / 4, 1e-15);
    assert_near(shaped->tip.mandrel, 1, 0);
    assert_near(wire_length(&shaped->wire), 700, 1e-9);
    assert_int_equal(shaped->wire.section_count, 3);
    assert_near(shaped->wire.section[0].length, 695, 1e-9);
    assert_near(shaped->wire.section[1].length * shaped->wire.section[1].rest_curvature, PI / 4, 1e-12);
    assert_near(shaped->wire.section[1].length, shaped->tip_shaped.arc, 1e-12);
    scene_free(scene);
}

// A wall of filled polymer attenuates X-rays less than the metal of a wire, so that a catheter appears as two lines.
static void a_catheter_is_seen_as_polymer(void **state)
{
    (void)state;
    Scene *scene = good(THREE);
    assert_near(scene_tool_attenuation(scene, 0, 10), 0.15, 0);
    assert_near(scene_tool_attenuation(scene, 1, 10), 0.15, 0);
    assert_near(scene_tool_attenuation(scene, 2, 10), 0.55, 0);
    scene_free(scene);
}

static void each_fault_has_its_line_and_column(void **state)
{
    (void)state;
    int wrong = 0;
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++) {
        char place[64] = "";
        Scene *scene = parse(broken[i].text);
        if (broken[i].place[0])
            snprintf(place, sizeof place, "x.yaml:%s: ", broken[i].place);
        if (scene || !says(place, broken[i].words))
            wrong++, print_error("case %zu:\n%s-- expected %s … %s\n-- %d faults, the first: %s\n", i, broken[i].text, place, broken[i].words, faults.count,
                                 faults.count ? faults.text[0] : "");
        scene_free(scene);
    }
    assert_int_equal(wrong, 0);
}

static void all_faults_come_in_one_pass(void **state)
{
    (void)state;
    assert_null(parse(TOOLS("  - {name: a b, kind: balloon, " SECTION(
        "300", "2", "0.5") ", inserted_mm: 301}\n"
                           "  - {name: c, kind: wire, " SECTION(
                               "100", "0.8", "0") "}\n"
                                                  "  - {name: c, kind: wire, sections: [{length_mm: 100}]}\n") "script: [{t_s: 0, d.push_mm_s: 1}]\n"));
    const char *const words[] = {"'a b'",          "'balloon'",     "0.5 mm wide",         "at most 300", "has 250 mm outside",
                                 "used on line 5", "'diameter_mm'", "'young_modulus_gpa'", "d.push_mm_s"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (!says("", words[i]))
            fail_msg("no fault says '%s'", words[i]);
}

// A rule relating two tools applies only if both are valid.
static void a_fault_hides_no_other_and_makes_none(void **state)
{
    (void)state;
    assert_null(parse(TOOLS(GUIDE "  - {name: a, kind: wire, length_mm: -5, sections: [{length_mm: 400, diameter_mm: 3}]}\n")));
    assert_true(says("", "a number above 0") && says("", "has no key 'young_modulus_gpa'") && says("", "1.8 mm wide"));
    assert_int_equal(faults.count, 3);
    assert_null(parse(TOOLS("  - {name: a, kind: catheter, " SECTION("300", "2", "wide") "}\n" WIRE)));
    assert_int_equal(faults.count, 1);
    assert_null(parse(TOOLS("  - {name: a, kind: catheter, " SECTION("long", "2", "1") "}\n  - {name: b, kind: wire, " SECTION("10", "0.36", "0") "}\n")));
    assert_int_equal(faults.count, 1);
    assert_null(parse(TOOLS(GUIDE "  - {name: a, kind: wire, " SECTION("250", "0.36", "0") ", inserted_mm: -1}\n")));
    assert_int_equal(faults.count, 1);
}

// --- devices ---

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

#define DEVICE                                                                                                                                                 \
    VERSION "kind: catheter\nsource: this test\nsections: [{length_mm: 400, diameter_mm: 1, inner_diameter_mm: 0.5, young_modulus_gpa: 2}, {length_mm: 20, "   \
            "diameter_mm: 1, inner_diameter_mm: 0.5, young_modulus_gpa: 1}]\n"
#define EXTRA "rest: [{arc: {radius_mm: 5, angle_deg: 90}}]\ntip_marker: {length_mm: 1, attenuation_1_mm: 8}\nfriction_inside: 0.1\n"

static void a_device_file_gives_what_the_scene_does_not(void **state)
{
    (void)state;
    char folder[] = "/tmp/seldinger-tools-XXXXXX", scene_path[64], device_path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(scene_path, sizeof scene_path, "%s/scene.yaml", folder);
    snprintf(device_path, sizeof device_path, "%s/device.yaml", folder);
    write_text(device_path, DEVICE EXTRA);
    write_text(scene_path,
               VERSION SHEATH "tools:\n  - {name: as_it_is, device: device.yaml}\n"
                              "  - {name: changed, device: device.yaml, kind: wire, length_mm: 450, tip_marker: {length_mm: 9}, friction_inside: 0.3,"
                              " sections: [{length_mm: 500, diameter_mm: 0.4, young_modulus_gpa: 3}]}\n");
    faults_clear(&faults);
    Scene *scene = scene_load(scene_path, &faults);
    if (!scene)
        fail_msg("refused: %s", faults.text[0]);
    const SceneTool *a = &scene->tool[0], *b = &scene->tool[1];
    assert_int_equal(a->kind, TOOL_CATHETER);
    assert_int_equal(a->wire.section_count, 3);      // the arc's border cuts the second
    assert_near(a->wire.section[2].rest_curvature, 0.2, 1e-15);
    assert_near(a->marker_attenuation, 8, 0);
    assert_near(a->friction_inside, 0.1, 0);
    assert_string_equal(a->device_path, device_path);
    assert_int_equal(b->kind, TOOL_WIRE);
    assert_near(wire_length(&b->wire), 450, 1e-9);
    assert_near(b->wire.section[0].young_modulus, 3000, 0);
    assert_near(b->wire.section[1].rest_curvature, 0.2, 1e-15);   // the device's shape on the scene's sections
    assert_near(b->marker_length, 9, 0);
    assert_near(b->friction_inside, 0.3, 0);
    scene_free(scene);

    // faults in the device have their position in the device file, those of the scene in the scene; a given stiffness is checked
    write_text(scene_path, VERSION SHEATH "tools: [{name: a, device: device.yaml, inserted_mm: x}]\n");
    write_text(device_path, DEVICE "kinds: wire\nbending_n_mm2: 100\n");
    faults_clear(&faults);
    assert_null(scene_load(scene_path, &faults));
    char place[80];
    snprintf(place, sizeof place, "%s:5:1: ", device_path);
    assert_true(says(place, "did you mean 'kind'"));
    snprintf(place, sizeof place, "%s:6:16: ", device_path);
    assert_true(says(place, "the first section give 92.04"));     // 2000 pi / 64 (1 - 0.5^4)
    snprintf(place, sizeof place, "%s:3:", scene_path);
    assert_true(says(place, "'x', not a number"));
    assert_int_equal(faults.count, 3);
    write_text(device_path, DEVICE "bending_n_mm2: 92.04\n");
    write_text(scene_path, VERSION SHEATH "tools: [{name: a, device: device.yaml}]\n");
    faults_clear(&faults);
    scene_free(scene = scene_load(scene_path, &faults));
    assert_non_null(scene);
    unlink(scene_path);
    unlink(device_path);
    rmdir(folder);
}

// --- the library ---

#define LIBRARY SOURCE_DIR "/scenes/tools/"
enum { MOST_DEVICES = 100, DEVICE_NAME = 64 };

static int list_devices(char name[MOST_DEVICES][DEVICE_NAME])
{
    DIR *folder = opendir(LIBRARY);
    int count = 0;
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder)) && count < MOST_DEVICES;) {
        size_t length = strlen(entry->d_name);
        if (length > 5 && length < DEVICE_NAME && !strcmp(entry->d_name + length - 5, ".yaml"))
            strcpy(name[count++], entry->d_name);
    }
    closedir(folder);
    return count;
}

// A scene beside the library with these devices, outermost first; NULL with faults.
static Scene *scene_of(int count, const char *const *device)
{
    char text[2000];
    int used = snprintf(text, sizeof text, VERSION SHEATH "tools:\n");
    for (int k = 0; k < count; k++)
        used += snprintf(text + used, sizeof text - (size_t)used, "  - {name: tool%d, device: %s}\n", k, device[k]);
    faults_clear(&faults);
    return scene_parse(text, (size_t)used, LIBRARY "scene.yaml", &faults);
}

// The text at a key of a device file; empty if there is none.
static void device_text(const char *device, const char *key, char *out, size_t capacity)
{
    char path[200];
    const char *value;
    size_t length;
    out[0] = 0;
    snprintf(path, sizeof path, LIBRARY "%s", device);
    faults_clear(&faults);
    char *text = text_file_read(path, &length, &faults);
    YamlReader *reader = text ? yaml_reader_open(text, length, path, &faults) : NULL;
    assert_non_null(reader);
    YamlMap map = yaml_map(yaml_root(reader), NULL);
    if (yaml_text(yaml_get(&map, key, false), &value))
        snprintf(out, capacity, "%s", value);
    yaml_reader_close(reader);
    free(text);
}

static void every_device_is_a_tool_with_its_source(void **state)
{
    (void)state;
    char name[MOST_DEVICES][DEVICE_NAME];
    int count = list_devices(name);
    assert_true(count >= 20);
    for (int i = 0; i < count; i++) {
        static const char *const keys[] = {"title", "source", "uncertainty"};
        Scene *scene = scene_of(1, (const char *const[]){name[i]});
        if (!scene)
            fail_msg("%s: %s", name[i], faults.text[0]);
        WireOptions wire = scene_tool_wire(scene, 0);
        char why[256], text[FAULT_LENGTH];
        Wire chain;
        if (!wire_create(&chain, &wire, why, sizeof why))
            fail_msg("%s makes no wire: %s", name[i], why);
        wire_destroy(&chain);
        bool hollow = wire.section[0].inner_diameter > 0;
        if (hollow != (scene->tool[0].kind != TOOL_WIRE))
            fail_msg("%s: a wire is solid and nothing else is", name[i]);
        scene_free(scene);
        for (int k = 0; k < 3; k++) {
            device_text(name[i], keys[k], text, sizeof text);
            if (strlen(text) < 10)
                fail_msg("%s does not say its '%s'", name[i], keys[k]);
        }
    }
}

// E pi / 64 (D^4 - d^4) of the shaft. The stiffnesses have two to four digits; the moduli computed from them reproduce the last digit.
static void a_quoted_stiffness_is_that_of_the_shaft(void **state)
{
    (void)state;
    static const struct {
        const char *device;
        double bending;
    } quoted[] = {{"wire-035-amplatz.yaml", 291},
                  {"wire-035-j.yaml", 291},
                  {"wire-035-amplatz-ultra-stiff.yaml", 2005},
                  {"wire-035-meier.yaml", 4280},
                  {"wire-035-lunderquist.yaml", 4857},
                  {"wire-014-steel.yaml", 158},
                  {"wire-014-nitinol.yaml", 47}};
    for (size_t i = 0; i < sizeof quoted / sizeof *quoted; i++) {
        Scene *scene = scene_of(1, &quoted[i].device);
        assert_non_null(scene);
        const WireSection *shaft = &scene->wire.section[0];
        double bending = shaft->young_modulus * PI / 64 * (pow(shaft->diameter, 4) - pow(shaft->inner_diameter, 4));
        if (fabs(bending - quoted[i].bending) > 0.001 * quoted[i].bending)
            fail_msg("%s: %g N mm2, quoted %g", quoted[i].device, bending, quoted[i].bending);
        scene_free(scene);
    }
}

static void each_device_goes_through_the_one_it_names(void **state)
{
    (void)state;
    char name[MOST_DEVICES][DEVICE_NAME], outer[DEVICE_NAME];
    int count = list_devices(name), pairs = 0;
    for (int i = 0; i < count; i++) {
        device_text(name[i], "goes_through", outer, sizeof outer);
        if (!outer[0])
            continue;
        pairs++;
        Scene *scene = scene_of(2, (const char *const[]){outer, name[i]});
        if (!scene)
            fail_msg("%s in %s: %s", name[i], outer, faults.text[0]);
        scene_free(scene);
        if ((scene = scene_of(2, (const char *const[]){name[i], outer})))
            fail_msg("%s in %s was not refused", outer, name[i]);
    }
    assert_true(pairs >= 15);
    // stEVE's wire is shorter than its catheter: a scene lengthens it
    const char steve[] = VERSION SHEATH "tools: [{name: a, device: steve-simmons.yaml}, {name: b, device: steve-guidewire.yaml, length_mm: 700}]\n";
    faults_clear(&faults);
    Scene *drawn_out = scene_parse(steve, strlen(steve), LIBRARY "scene.yaml", &faults);
    assert_non_null(drawn_out);
    assert_near(wire_length(&drawn_out->tool[1].wire), 700, 1e-9);
    scene_free(drawn_out);
    // all four, one in another
    Scene *scene =
        scene_of(4, (const char *const[]){"guide-6f-straight.yaml", "catheter-5f-vertebral.yaml", "microcatheter-two-markers.yaml", "wire-014-nitinol.yaml"});
    assert_non_null(scene);
    assert_int_equal(scene->tool_count, 4);
    assert_near(scene_tool_attenuation(scene, 2, 1500 - 30.5), 8, 0);    // the second band of a microcatheter
    assert_near(scene_tool_attenuation(scene, 2, 1500 - 0.5), 8, 0);
    assert_near(scene_tool_attenuation(scene, 2, 1500 - 15), 0.3, 0);
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_wire_is_the_one_tool),
        cmocka_unit_test(the_first_tool_is_the_scenes_wire),
        cmocka_unit_test(each_tool_has_its_own_keys),
        cmocka_unit_test(a_rig_begins_with_the_whole_first_tool),
        cmocka_unit_test(a_script_moves_the_tools_it_names),
        cmocka_unit_test(bare_columns_move_the_first_tool),
        cmocka_unit_test(a_row_in_place_lets_a_tool_go),
        cmocka_unit_test(each_fault_of_a_script_has_its_place),
        cmocka_unit_test(a_tip_is_shaped_by_hand),
        cmocka_unit_test(a_catheter_is_seen_as_polymer),
        cmocka_unit_test(each_fault_has_its_line_and_column),
        cmocka_unit_test(all_faults_come_in_one_pass),
        cmocka_unit_test(a_fault_hides_no_other_and_makes_none),
        cmocka_unit_test(a_device_file_gives_what_the_scene_does_not),
        cmocka_unit_test(every_device_is_a_tool_with_its_source),
        cmocka_unit_test(a_quoted_stiffness_is_that_of_the_shaft),
        cmocka_unit_test(each_device_goes_through_the_one_it_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// `run` with several tools: an exact reference from a scene file, the summary and the final state of each tool, and which tool a device moves.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-tools-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/json_file.h"
#include "tests/short_run.h"

static int run(const char *arguments)
{
    char command[1200];
    snprintf(command, sizeof command, "cd '%s' && %s %s > '%s' 2>&1", SOURCE_DIR, SELDINGER_PROGRAM, arguments, in_folder("output.txt"));
    int status = system(command);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static cJSON *summary(const char *scene, const char *more)
{
    char arguments[800];
    snprintf(arguments, sizeof arguments, "run scenes/coaxial/%s --summary '%s' --final '%s' %s", scene, in_folder("summary.json"), in_folder("final.csv"),
             more);
    assert_int_equal(run(arguments), 0);
    return json_of("summary.json");
}

static double value(const cJSON *tool, const char *part, const char *name)
{
    const cJSON *object = part ? cJSON_GetObjectItem(tool, part) : tool;
    return cJSON_GetObjectItem(object, name)->valuedouble;
}

// Reference 1 of the coaxial tools: 0.03 N, tip (23.953622, 39.793075) mm; the tools stretch by 1.6e-3 mm.
static void a_reference_from_a_scene(void **state)
{
    (void)state;
    cJSON *root = summary("insert.yaml", ""), *tools = cJSON_GetObjectItem(root, "tools");
    assert_int_equal(cJSON_GetArraySize(tools), 2);
    const cJSON *tube = cJSON_GetArrayItem(tools, 0), *wire = cJSON_GetArrayItem(tools, 1), *tip = cJSON_GetObjectItem(tube, "tip_mm");
    double push = value(wire, "proximal", "force_n");
    double off = hypot(cJSON_GetArrayItem(tip, 0)->valuedouble - 23.953622, cJSON_GetArrayItem(tip, 1)->valuedouble - 39.793075);
    print_message("push %.7f N, tip %.2e mm off\n", push, off);
    assert_string_equal(cJSON_GetObjectItem(wire, "name")->valuestring, "wire");
    assert_true(fabs(push - 0.03) < 1e-5 && off < 2e-3);
    assert_true(fabs(value(wire, NULL, "inserted_mm") - 30) < 1e-9);
    cJSON_Delete(root);
    // one row per node of each tool, and a header
    char *text = text_of(in_folder("final.csv"));
    int lines = 0;
    for (const char *c = text; *c; c++)
        lines += *c == '\n';
    assert_int_equal(lines, 1 + 31 + 61);
    assert_true(!strncmp(text, "tool,node,s_mm,x_mm", 19));
    assert_non_null(strstr(text, "\nwire,60,"));
    free(text);
}

static void two_tools_in_a_model_repeat(void **state)
{
    (void)state;
    char *hash[2];
    for (int i = 0; i < 2; i++) {
        char more[60];
        snprintf(more, sizeof more, "--duration-s %g%s", WHOLE_OR_SHORT(1.8, 0.2), i ? " --threads 2" : "");
        cJSON *root = summary("phantom.yaml", more);
        hash[i] = strdup(cJSON_GetObjectItem(root, "state_hash")->valuestring);
        assert_true(value(root, "penetration_mm", "max") < 0.05);
        cJSON_Delete(root);
    }
    assert_string_equal(hash[0], hash[1]);
    free(hash[0]);
    free(hash[1]);
}

// Runs with $D in `arguments` replaced by the folder; the output must contain the words.
static void ends(int code, const char *words, const char *arguments)
{
    char line[1000] = "";
    size_t used = 0;
    for (const char *c = arguments; *c && used + sizeof folder < sizeof line; c++)
        used += !strncmp(c, "$D", 2) ? (c++, (size_t)sprintf(line + used, "%s", folder)) : (size_t)sprintf(line + used, "%c", *c);
    int ended = run(line);
    char *text = text_of(in_folder("output.txt"));
    if (ended != code || !strstr(text, words))
        fail_msg("`%s` ended with %d and printed: %s(expected %d and '%s')", line, ended, text, code, words);
    free(text);
}

// Three tools that move in and out of each other in a bend: nodes are added and removed.
static const char three_tools[] =
    "seldinger: 1\n"
    "vessel: {tube: {radius_mm: 2, normal: [0, 1, 0], path: [{line_mm: 15}, {arc: {radius_mm: 20, angle_deg: 60}}, {line_mm: 20}]}, contact: tube, friction: "
    "0.05}\n"
    "tools:\n"
    "  - {name: guide, kind: guide_catheter, elements: 20, inserted_mm: 5, sections: [{length_mm: 60, diameter_mm: 2, inner_diameter_mm: 1.8, "
    "young_modulus_gpa: 0.1}]}\n"
    "  - {name: micro, kind: microcatheter, elements: 25, inserted_mm: 4, sections: [{length_mm: 75, diameter_mm: 0.8, inner_diameter_mm: 0.5, "
    "young_modulus_gpa: 0.5}]}\n"
    "  - {name: wire, kind: wire, elements: 30, inserted_mm: 6, sections: [{length_mm: 95, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n"
    "script:\n"
    "  - {t_s: 0, wire.push_mm_s: 50, wire.twist_deg_s: 0}\n"
    "  - {t_s: 0.3, micro.push_mm_s: 60, micro.twist_deg_s: 90, guide.push_mm_s: 20, guide.twist_deg_s: 0}\n"
    "  - {t_s: 0.6, wire.push_mm_s: -40, wire.twist_deg_s: 45, micro.push_mm_s: -10, micro.twist_deg_s: 0}\n"
    "  - {t_s: 0.9}\n";

static void change_command(const char *recording, const char *dataset, hsize_t step)
{
    hid_t file = H5Fopen(recording, H5F_ACC_RDWR, H5P_DEFAULT), set = H5Dopen2(file, dataset, H5P_DEFAULT), space = H5Dget_space(set);
    hid_t memory = H5Screate(H5S_SCALAR);
    assert_true(H5Sselect_hyperslab(space, H5S_SELECT_SET, (const hsize_t[]){step, 0}, NULL, (const hsize_t[]){1, 1}, NULL) >= 0);
    assert_true(H5Dwrite(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, &(double){51}) >= 0);
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
    assert_true(H5Fclose(file) >= 0);
}

static void a_run_of_three_tools_is_recorded_and_simulated_again(void **state)
{
    (void)state;
    put("three.yaml", three_tools);
    ends(0, "", "run $D/three.yaml --record $D/three.h5 --quiet");
    ends(0, "900 steps (0.900 s) simulated again, the same state at each", "replay $D/three.h5 --verify");
    ends(0, "name micro, kind microcatheter, length_mm 75, inserted_mm 19,", "info $D/three.h5");
    // the hand of an inner tool counts
    char other[200];
    snprintf(other, sizeof other, "%s", in_folder("other.h5"));
    ends(0, "", "run $D/three.yaml --record $D/other.h5 --quiet");
    change_command(other, "/tools/2/command", 200);
    ends(1, "differs from step 200", "replay $D/other.h5 --verify");
    // also as a scene with a golden path of each tool
    ends(0, "three-again: scene.yaml, hand.csv, scene.golden.csv", "replay $D/three.h5 --scene $D/three-again");
    ends(0, "name guide, push_mm 6, twist_deg 0, name micro, push_mm 15, twist_deg 27, name wire, push_mm 3, twist_deg 13.5", "info $D/three-again/hand.csv");
    ends(0, "same", "check $D/three-again");
    put("three-again/scene.yaml", three_tools);
    ends(0, "same", "check $D/three-again");
    char *text = strdup(three_tools), *at = strstr(text, "wire.push_mm_s: -40");
    memcpy(at, "wire.push_mm_s: -41", 19);
    put("three-again/scene.yaml", text);
    ends(1, "of wire", "check $D/three-again");
    free(text);
}

static int lines_of(const char *text, const char *words)
{
    int lines = 0;
    for (const char *at = text; (at = strstr(at, words)); at++)
        lines++;
    return lines;
}

static void a_tool_that_is_let_go_stays_so_in_a_replay(void **state)
{
    (void)state;
    put("let-go.csv", "t_s,guide.push_mm_s,guide.twist_deg_s,micro.released\n0,20,0,0\n0.1,20,0,1\n0.4,0,0,0\n");
    ends(0, "", "run $D/three.yaml --script $D/let-go.csv --record $D/let-go.h5 --quiet");
    ends(0, "400 steps (0.400 s) simulated again, the same state at each", "replay $D/let-go.h5 --verify");
    // the guide carried it along
    ends(0, "name micro, kind microcatheter, length_mm 75, inserted_mm 10,", "info $D/let-go.h5");
    ends(0, "let-go: scene.yaml", "replay $D/let-go.h5 --scene $D/let-go");
    ends(0, "same", "check $D/let-go");
    ends(0, "name guide, push_mm 8, twist_deg 0, name micro, push_mm 0, twist_deg 0, released_s 0.3, name wire, push_mm 0, twist_deg 0",
         "info $D/let-go/hand.csv");
    // also of a single tool
    put("one.yaml", "seldinger: 1\nwire: {elements: 20, sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80, rest_curvature_1_mm: 0.1}]}\n"
                    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n");
    put("one.csv", "t_s,push_mm_s,twist_deg_s,released\n0,50,0,0\n0.2,0,0,1\n0.4,0,0,0\n");
    ends(0, "", "run $D/one.yaml --script $D/one.csv --record $D/one.h5 --quiet");
    ends(0, "400 steps (0.400 s) simulated again, the same state at each", "replay $D/one.h5 --verify");
    ends(0, "released_s       0.2", "info $D/one.csv");
}

static void each_format_has_all_tools(void **state)
{
    (void)state;
    ends(0, "", "export $D/three.h5 -o $D/three.csv");
    char *text = text_of(in_folder("three.csv"));
    assert_true(!strncmp(text, "t_s,step,tool,node,x_mm,y_mm,z_mm,qw,qx,qy,qz,carrier\n", 54));
    // the first frame, every tenth step
    assert_int_equal(lines_of(text, ",guide,"), 91 * 21);
    assert_int_equal(lines_of(text, ",micro,"), 91 * 26);
    assert_int_equal(lines_of(text, "\n0.9,899,wire,"), 31);
    assert_true(lines_of(text, ",wire\n") > 0);
    free(text);
    ends(0, "", "export $D/three.h5 -o $D/three.pvd");
    text = text_of(in_folder("three_00090.vtp"));
    assert_non_null(strstr(text, "NumberOfPoints=\"78\" NumberOfVerts=\"0\" NumberOfLines=\"3\""));
    assert_non_null(strstr(text, "Name=\"offsets\" NumberOfComponents=\"1\" format=\"ascii\">\n21\n47\n78\n"));
    assert_non_null(strstr(text, "Name=\"carrier\""));
    free(text);
}

// Zoarski 1998: 9 to 14 g for four microcatheters with their wire through a tortuous path.
static void a_bench_experiment_is_met(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON *root = summary("zoarski.yaml", "");
    double push = value(root, "proximal", "force_most_n");
    print_message("largest push %.4f N\n", push);
    assert_true(push > 0.088 && push < 0.137);
    // the valve holds the wire at its place in the microcatheter
    const cJSON *tools = cJSON_GetObjectItem(root, "tools");
    assert_true(fabs(value(cJSON_GetArrayItem(tools, 0), NULL, "inserted_mm") - 190) < 1e-6);
    assert_true(fabs(value(cJSON_GetArrayItem(tools, 1), NULL, "inserted_mm") - 200) < 0.1);
    cJSON_Delete(root);
}

// scenes/coaxial/exchange.yaml, and exchanges that are refused: the tool is not pulled back, or the new one does not fit.
static void a_script_exchanges_tools(void **state)
{
    (void)state;
    char more[200] = "";
    if (!WHOLE_RUN) {       // the scene's script, four times as fast
        put("fast.csv", "t_s,microcatheter.push_mm_s,microcatheter.twist_deg_s,microcatheter.exchange,wire.push_mm_s,wire.twist_deg_s,wire.exchange\n"
                        "0,160,0,0,160,0,0\n0.125,0,0,0,-160,0,0\n1.005,0,0,0,0,0,1\n1.03,0,0,0,160,0,1\n2,-160,0,0,0,0,1\n2.21,0,0,1,0,0,1\n"
                        "2.23,120,0,1,0,0,1\n2.48,0,0,1,0,0,1\n2.5,0,0,1,0,0,1\n");
        snprintf(more, sizeof more, "--script '%s'", in_folder("fast.csv"));
    }
    cJSON *root = summary("exchange.yaml", more);
    assert_true(value(root, "exchanges", "done") == 2 && value(root, "exchanges", "refused") == 0);
    assert_true(value(root, "solver", "limited_steps") == 0 && value(root, "solver", "not_converged_steps") == 0);
    cJSON_Delete(root);
    put("early.csv", "t_s,microcatheter.exchange,wire.exchange\n0,0,0\n0.1,1,0\n0.2,1,1\n0.3,1,3\n0.4,1,3\n");
    ends(0, "3 exchanges were refused, the last because the scene has no such tool", "run scenes/coaxial/exchange.yaml --script $D/early.csv");
    put("wrong.csv", "t_s,wire.exchange\n0,0.5\n1,0\n");
    ends(2, "wrong.csv:2:1: exchange is 0.5; expected 0 (the scene's tool) or 1 to 4 (those under its 'exchange:')",
         "run scenes/coaxial/exchange.yaml --script $D/wrong.csv");
    put("wide.yaml",
        "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}}\ntools:\n"
        "  - {name: tube, kind: catheter, sections: [{length_mm: 60, diameter_mm: 1, inner_diameter_mm: 0.5, young_modulus_gpa: 1}]}\n"
        "  - {name: wire, kind: wire, sections: [{length_mm: 160, diameter_mm: 0.36, young_modulus_gpa: 20}],\n"
        "     exchange: [{sections: [{length_mm: 160, diameter_mm: 0.6, young_modulus_gpa: 20}]}]}\n"
        "sheath: {entry_mm: [1, 0, 0], direction: [1, 0, 0]}\n");
    ends(2, "wide.yaml:6:17: 'wire' is up to 0.6 mm thick, but the lumen of 'tube' around it is only 0.5 mm wide", "run $D/wide.yaml --duration-s 0.1");
    put("single.yaml",
        "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}}\ntools:\n"
        "  - {name: wire, kind: wire, sections: [{length_mm: 160, diameter_mm: 0.36, young_modulus_gpa: 20}],\n"
        "     exchange: [{sections: [{length_mm: 160, diameter_mm: 0.3, young_modulus_gpa: 20}]}]}\n"
        "sheath: {entry_mm: [1, 0, 0], direction: [1, 0, 0]}\n");
    ends(2, "single.yaml:5:17: the scene has one tool", "run $D/single.yaml --duration-s 0.1");
}

// Recording, bit-identical replay, figures, files and a regression scene made of it in another folder than the devices'; the exchanged tool stays while the run
// settles.
static void the_chain_follows_exchanges(void **state)
{
    (void)state;
    put("device.yaml", "seldinger: 1\nkind: wire\nelements: 12\nsections: [{length_mm: 90, diameter_mm: 0.4, young_modulus_gpa: 100}]\n");
    put("swap.yaml",
        "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}}\ntools:\n"
        "  - {name: tube, kind: catheter, elements: 10, sections: [{length_mm: 30, diameter_mm: 1, inner_diameter_mm: 0.5, young_modulus_gpa: 1}]}\n"
        "  - name: wire\n    kind: wire\n    elements: 20\n    sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}]\n    exchange:\n"
        "      - device: device.yaml\n"
        "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 8}\nscript: swap.csv\n");
    put("swap.csv", "t_s,wire.push_mm_s,wire.twist_deg_s,wire.exchange\n0,-100,0,0\n0.4,0,0,1\n0.41,100,0,1\n0.7,0,0,1\n");
    ends(0, "1 tools were exchanged", "run $D/swap.yaml --record $D/swap.h5 --summary $D/swap.json --score $D/score.json --final $D/final.csv --settle-s 0.3");
    char *text = text_of(in_folder("swap.json"));
    cJSON *root = cJSON_Parse(text);
    free(text);
    assert_true(value(root, "exchanges", "done") == 1 && value(root, "exchanges", "refused") == 0);
    assert_true(value(cJSON_GetArrayItem(cJSON_GetObjectItem(root, "tools"), 1), NULL, "exchange") == 1);
    cJSON_Delete(root);
    text = text_of(in_folder("final.csv"));
    assert_true(strstr(text, "\nwire,12,") && !strstr(text, "\nwire,13,"));
    free(text);
    ends(0, "the same state at each", "replay $D/swap.h5 --verify");
    ends(0, "length_mm 90", "info $D/swap.h5");
    ends(0, "exchanges time_s 0.4, device 1", "info $D/swap.h5");
    ends(0, "exchange length_mm 90", "info $D/swap.yaml");
    ends(0, "exchanges 1", "info $D/swap.csv");
    put("only.csv", "t_s,wire.exchange\n0,0\n1,1\n");
    ends(0, "what             script", "info $D/only.csv");
    // the first frame has the scene's wire, the last frame the other
    ends(0, "", "export $D/swap.h5 -o $D/rows.csv");
    text = text_of(in_folder("rows.csv"));
    static const char head[] = "t_s,step,tool,node,x_mm,y_mm,z_mm,qw,qx,qy,qz,carrier,exchange\n";
    assert_int_equal(strncmp(text, head, strlen(head)), 0);
    const char *first = strstr(text, ",wire,20,"), *last = strstr(text, ",wire,12,");
    for (const char *at = first; at; at = strstr(at + 1, ",wire,20,"))
        first = at;
    assert_non_null(first);
    while (last && last < first)
        last = strstr(last + 1, ",wire,12,");
    assert_true(last && strstr(last, ",1\n"));
    free(text);
    ends(0, "", "export $D/swap.h5 -o $D/swap.vtp");
#ifdef SELDINGER_RENDER
    ends(0, "", "run $D/swap.yaml --quiet --picture $D/swap.png --picture-at 0.2 --picture-at 0.65");
    assert_int_equal(access(in_folder("swap.png"), R_OK), 0);
#endif
    // a scene made of it refers to the device relative to its folder, and its golden path is met; that of another script is not
    ends(0, "", "replay $D/swap.h5 --scene $D/again");
    text = text_of(in_folder("again/scene.yaml"));
    assert_non_null(strstr(text, "- device: \"../device.yaml\""));
    free(text);
    ends(0, "same", "check $D/again");
    ends(0, "written", "check --update $D/swap.yaml");
    ends(0, "same", "check $D/swap.yaml");
    put("swap.csv", "t_s,wire.push_mm_s,wire.twist_deg_s,wire.exchange\n0,-100,0,0\n0.4,0,0,0\n0.41,100,0,0\n0.7,0,0,0\n");
    ends(1, "0.450     0   29.9900000  of wire", "check $D/swap.yaml");
}

// The two devices of DualDeviceNav: both tips end within the benchmark's 5 mm of the target. `model`: file that the scene needs.
static void two_devices_reach(const char *scene, const char *model, const double target[3])
{
    NEED_WHOLE_RUNS();
    if (access(model, R_OK) != 0) {
        print_message("skipped: %s is not made\n", model);
        skip();
    }
    cJSON *root = summary(scene, "");
    const cJSON *tools = cJSON_GetObjectItem(root, "tools");
    for (int k = 0; k < 2; k++) {
        const cJSON *tip = cJSON_GetObjectItem(cJSON_GetArrayItem(tools, k), "tip_mm");
        double off = 0;
        for (int c = 0; c < 3; c++)
            off += pow(cJSON_GetArrayItem(tip, c)->valuedouble - target[c], 2);
        print_message("tool %d: %.2f mm from the target\n", k, sqrt(off));
        assert_true(sqrt(off) < 5);
    }
    assert_true(value(root, "penetration_mm", "max") < 0.1);
    cJSON_Delete(root);
}

// From the iliac artery into the left vertebral artery, in the benchmark's vessel and in ours.
static void two_devices_reach_a_vertebral_artery(void **state)
{
    (void)state;
    two_devices_reach("dual-device.yaml", SOURCE_DIR "/scenes/arch/arch.h5", (const double[]){-490.9, 35.1, -31.5});
}

static void two_devices_reach_it_in_a_vessel_of_our_own(void **state)
{
    (void)state;
    two_devices_reach("dual-device-own.yaml", SOURCE_DIR "/scenes/coaxial/aorta.h5", (const double[]){25, -23, 450});
}

static void golden_paths_of_the_scenes_hold(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    ends(0, "same", "check scenes/coaxial");
}

// A device moves one of the scene's tools; for an unknown tool the message lists them.
static void a_map_names_a_tool_of_the_scene(void **state)
{
    (void)state;
    FILE *map = fopen(in_folder("map.yaml"), "w");
    fputs("seldinger_device: 1\ndevice: {usage: joystick}\ntool: guide\npush: {source: Y, mm_s: 10}\n", map);
    fclose(map);
    ends(2, "map.yaml:3:7: 'tool' is 'guide', but the scene has no such tool; write microcatheter, wire, outermost, innermost",
         "run scenes/coaxial/exchange.yaml --device $D/map.yaml --duration-s 1");
}

static void a_score_has_each_tool(void **state)
{
    (void)state;
    ends(0, "", "run $D/three.yaml --quiet --score $D/score.json");
    char *text = text_of(in_folder("score.json"));
    cJSON *root = cJSON_Parse(text);
    free(text);
    const cJSON *tools = cJSON_GetObjectItem(root, "tools");
    assert_int_equal(cJSON_GetArraySize(tools), 3);
    assert_string_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(tools, 1), "name")->valuestring, "micro");
    assert_true(fabs(value(cJSON_GetArrayItem(tools, 0), NULL, "inserted_mm") - 6) < 1e-6);
    assert_true(fabs(value(cJSON_GetArrayItem(tools, 1), NULL, "withdrawn_mm") - 3) < 1e-6);
    // the wire is pulled back to 9 mm, the microcatheter is at 19
    assert_true(fabs(value(cJSON_GetArrayItem(tools, 2), NULL, "behind_mm") - 10) < 1e-6);
    cJSON_Delete(root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_reference_from_a_scene),
        cmocka_unit_test(two_tools_in_a_model_repeat),
        cmocka_unit_test(a_run_of_three_tools_is_recorded_and_simulated_again),
        cmocka_unit_test(each_format_has_all_tools),
        cmocka_unit_test(a_tool_that_is_let_go_stays_so_in_a_replay),
        cmocka_unit_test(a_bench_experiment_is_met),
        cmocka_unit_test(two_devices_reach_a_vertebral_artery),
        cmocka_unit_test(a_script_exchanges_tools),
        cmocka_unit_test(the_chain_follows_exchanges),
        cmocka_unit_test(golden_paths_of_the_scenes_hold),
        cmocka_unit_test(a_map_names_a_tool_of_the_scene),
        cmocka_unit_test(two_devices_reach_it_in_a_vessel_of_our_own),
        cmocka_unit_test(a_score_has_each_tool),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

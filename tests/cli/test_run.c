// `run` as a user runs it: exit codes and messages of bad input, output files, determinism, golden paths, signals, a full disk.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-run-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/json_file.h"
#include "tests/cli/program.h"

// A bent tube and a wire that is pushed through it: contact, friction, a script. 0.4 s.
#define SCENE(modulus, radius, elements, vessel_more, script) SCENE_MU("0.1", modulus, radius, elements, vessel_more, script)
#define SCENE_MU(friction, modulus, radius, elements, vessel_more, script)                                                                                     \
    "seldinger: 1\n"                                                                                                                                           \
    "vessel:\n"                                                                                                                                                \
    "  tube: {radius_mm: " radius ", normal: [0, 1, 0], path: [{line_mm: 5}, {arc: {radius_mm: 15, angle_deg: 90}}, {line_mm: 30}]}\n"                         \
    "  friction: " friction "\n" vessel_more "wire:\n"                                                                                                         \
    "  elements: " elements "\n"                                                                                                                               \
    "  sections:\n"                                                                                                                                            \
    "    - {length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: " modulus "}\n"                                                                               \
    "    - {length_mm: 10, diameter_mm: 0.36, young_modulus_gpa: 5, rest_curvature_1_mm: 0.1}\n"                                                               \
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n"                                                                                    \
    "script: " script "\n"                                                                                                                                     \
    "targets: [{name: start, point_mm: [2, 0, 0], radius_mm: 3}]\n"
#define SCRIPT "[[0, 60, 30], [0.4, 0, 0]]"
#define GOOD SCENE("80", "0.68", "40", "", SCRIPT)

typedef struct Tip {
    double x[3];
} Tip;

static int run(const char *arguments) { return run_in("", arguments); }

static bool exists(const char *name) { return access(in_folder(name), F_OK) == 0; }

static double figure(const cJSON *json, const char *group, const char *name)
{
    const cJSON *value = cJSON_GetObjectItemCaseSensitive(group ? cJSON_GetObjectItemCaseSensitive(json, group) : json, name);
    if (!cJSON_IsNumber(value))
        fail_msg("the summary has no number %s %s", group ? group : "", name);
    return value->valuedouble;
}

// --- bad input ---

static void expect_bad(const char *scene, const char *arguments, const char *words)
{
    if (scene)
        put("bad.yaml", scene);
    char all[600];
    snprintf(all, sizeof all, "%s --summary left.json --final left.csv --record left.h5", arguments);
    int code = run(all);
    if (code != 2 || !strstr(output, words))
        fail_msg("`%s` ended with %d and printed: %s(expected 2 and '%s')", arguments, code, output, words);
    assert_false(exists("left.json") || exists("left.csv") || exists("left.h5"));
}

static void bad_input_ends_with_2_and_says_where(void **state)
{
    (void)state;
    put("back.csv", "t_s,push_mm_s,twist_deg_s\n0,10,0\n2,10,0\n1,0,0\n");
    put("short.csv", "t_s,push_mm_s\n0,10\n");
    put("model.h5", "this is no model");
    put("cut.h5", "\x89HDF\r\n\x1a\n");
    expect_bad(SCENE("80", "0.68", "40", "  contakt: tube\n", SCRIPT), "run bad.yaml", "bad.yaml:5:3: unknown key 'contakt'; did you mean 'contact'?");
    expect_bad("seldinger: 1\nwire: {sections: [{length_cm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\nrig: {}\n", "run bad.yaml --duration-s 1",
               "bad.yaml:2:20: key 'length_cm' has the wrong unit; expected 'length_mm'");
    expect_bad(SCENE("80", "0", "40", "", SCRIPT), "run bad.yaml", "radius_mm");
    expect_bad(SCENE("80", "-1", "40", "", SCRIPT), "run bad.yaml", "radius_mm");
    expect_bad(SCENE("80", "0.68", "0", "", SCRIPT), "run bad.yaml", "bad.yaml:6:13: 'wire.elements' is 0; expected a whole number from 1 to 10000");
    expect_bad(SCENE("80", "0.68", "100000", "", SCRIPT), "run bad.yaml", "bad.yaml:6:13: 'wire.elements' is 100000");
    expect_bad(SCENE("80", "0.68", "40", "", "back.csv"), "run bad.yaml", "back.csv:4:1: t_s 1 does not follow 2");
    expect_bad(GOOD, "run bad.yaml --script back.csv", "back.csv:4:1: t_s 1 does not follow 2");
    expect_bad(GOOD, "run bad.yaml --script short.csv", "short.csv:1:14");
    expect_bad(GOOD, "run bad.yaml --script nowhere.csv", "nowhere.csv: cannot be opened");
    expect_bad(GOOD, "run bad.yaml --contact wall", "valid: lim, lim_blend, lim_switch, sweep, raster, rbf, pas, mesh, smooth_mesh, flat_mesh, grid, tube");
    expect_bad(GOOD, "run bad.yaml --duration-s -1", "--duration-s: '-1' is not valid");
    expect_bad(GOOD, "run bad.yaml --settle-s soon", "--settle-s: 'soon' is not valid");
    expect_bad(GOOD, "run bad.yaml --banana", "see `seldinger run --help`");
    expect_bad(GOOD, "run bad.yaml other.yaml", "one scene at a time");
    expect_bad(NULL, "run", "missing the scene");
    expect_bad(NULL, "run nowhere.yaml", "nowhere.yaml: cannot be opened");
    expect_bad(NULL, "run .", "is a folder without scene.yaml");
    expect_bad("", "run bad.yaml", "bad.yaml:1:1: is empty");
    expect_bad("seldinger: 1\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\nrig: {}\n", "run bad.yaml", "has no script");
    const char *models[] = {"model.h5", "cut.h5", "nowhere.h5"};
    for (int i = 0; i < 3; i++) {
        char scene[400];
        snprintf(scene, sizeof scene,
                 "seldinger: 1\nvessel: {model: %s}\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\nsheath: {inlet: root}\n",
                 models[i]);
        expect_bad(scene, "run bad.yaml --duration-s 1", models[i]);
    }
    // a model that is not part of the project: the message gives the script that makes it
    put("prepare", "#!/bin/sh\n");
    assert_int_equal(chmod(in_folder("prepare"), 0755), 0);
    expect_bad("seldinger: 1\nvessel: {model: nowhere.h5}\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
               "sheath: {inlet: root}\n",
               "run bad.yaml --duration-s 1", "nowhere.h5: does not exist; make it with `./prepare`");
    assert_int_equal(unlink(in_folder("prepare")), 0);
    expect_bad(
        "seldinger: 1\nvessel: {shape: {name: banana}}\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\nsheath: {inlet: root}\n",
        "run bad.yaml --duration-s 1", "banana");
}

static void outputs_that_cannot_be_written_are_found_before_the_run(void **state)
{
    (void)state;
    put("good.yaml", GOOD);
    const char *option[] = {"--summary", "--final", "--record"};
    for (int i = 0; i < 3; i++) {
        char arguments[200];
        snprintf(arguments, sizeof arguments, "run good.yaml %s nowhere/x.h5", option[i]);
        assert_int_equal(run(arguments), 2);
        assert_non_null(strstr(output, "nowhere/x.h5: cannot be written"));
        assert_null(strstr(output, "simulated"));
        snprintf(arguments, sizeof arguments, "run good.yaml %s .", option[i]);
        assert_int_equal(run(arguments), 2);
    }
    assert_int_equal(run("run good.yaml --record /dev/null"), 2);
}

// --- runs ---

// The sheath straightens a curved tip; with the wall far away it presses the tip out with the bending energy per length, EI k^2 / 2, and the hand holds that
// much back. Curves of both signs, without friction; the step of the elements is small beside the curved section.
static void a_curved_tip_presses_out_of_its_sheath(void **state)
{
    (void)state;
    static const double curvature[] = {0, 0.015, 0.03, -0.03};
    const double pi = acos(-1), diameter = 0.89, modulus = 2000, stiffness = modulus * pi * pow(diameter, 4) / 64;
    for (int i = 0; i < 4; i++) {
        char scene[700];
        snprintf(scene, sizeof scene,
                 "seldinger: 1\n"
                 "vessel: {tube: {start_mm: [-20, 0, 0], radius_mm: 60, normal: [0, 1, 0], path: [{line_mm: 150}]}, contact: tube, friction: 0}\n"
                 "wire: {elements: 120, sections: [{length_mm: 30, diameter_mm: 0.89, young_modulus_gpa: 2}, "
                 "{length_mm: 30, diameter_mm: 0.89, young_modulus_gpa: 2, rest_curvature_1_mm: %g}], damping: {mass_1_s: 5, stiffness_s: 0.002}}\n"
                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 10}\n"
                 "script: [[0, 0, 0], [0.1, 0, 0]]\n",
                 curvature[i]);
        put("curved.yaml", scene);
        assert_int_equal(run("run curved.yaml --settle-s 5 --summary curved.json --quiet"), 0);
        cJSON *json = json_of("curved.json");
        double push = figure(json, "proximal", "force_n"), expected = -stiffness * curvature[i] * curvature[i] / 2;
        print_message("curvature %g / mm: push %.5f N, expected %.5f N\n", curvature[i], push, expected);
        assert_true(fabs(push - expected) <= 0.01 * fabs(expected) + 1e-5);
        cJSON_Delete(json);
    }
}

static void a_tool_that_touches_itself_is_reported(void **state)
{
    (void)state;
    assert_int_equal(run("run " SOURCE_DIR "/scenes/coil/sac.yaml --duration-s 0.8 --summary coil.json"), 0);
    assert_non_null(strstr(output, "the tool touches itself at"));
    cJSON *coil = json_of("coil.json");
    assert_true(figure(coil, "self_contacts", "max") > 0 && figure(coil, "self_contacts", "overlap_max_mm") < 0.01);
    cJSON_Delete(coil);
}

static void a_run_leaves_its_files_and_repeats_bit_for_bit(void **state)
{
    (void)state;
    static const char *const numbers[][2] = {{NULL, "steps"},
                                             {NULL, "simulated_s"},
                                             {NULL, "wall_s"},
                                             {NULL, "real_time_factor"},
                                             {"step_us", "median"},
                                             {"step_us", "p99"},
                                             {"step_us", "p999"},
                                             {"step_us", "max"},
                                             {"stage_us", "assemble"},
                                             {"stage_us", "factor"},
                                             {"stage_us", "detect"},
                                             {"stage_us", "contact"},
                                             {"stage_us", "correct"},
                                             {NULL, "deadline_misses"},
                                             {"contacts", "max"},
                                             {"contacts", "final"},
                                             {"self_contacts", "max"},
                                             {"self_contacts", "final"},
                                             {"penetration_mm", "max"},
                                             {"penetration_mm", "final"},
                                             {"solver", "iterations_median"},
                                             {"solver", "iterations_max"},
                                             {"solver", "not_converged_steps"},
                                             {"solver", "residual_max"},
                                             {"proximal", "force_n"},
                                             {"proximal", "torque_n_mm"},
                                             {"wall_force_n", "max"},
                                             {"wall_force_n", "sum_final"},
                                             {NULL, "inserted_mm"},
                                             {NULL, "elastic_energy_mj"}};
    put("good.yaml", GOOD);
    assert_int_equal(run("run good.yaml --summary a.json --final a.csv --record a.h5"), 0);
    assert_int_equal(run("run good.yaml --json b.json --final b.csv --quiet --threads 2"), 0);
    assert_string_equal(output, "");
    cJSON *a = json_of("a.json"), *b = json_of("b.json");
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        figure(a, numbers[i][0], numbers[i][1]);
    assert_true(cJSON_IsBool(cJSON_GetObjectItem(a, "settled")) && cJSON_IsArray(cJSON_GetObjectItem(a, "flags")));
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(a, "tip_mm")), 3);
    assert_true(figure(a, NULL, "steps") == 400 && figure(a, NULL, "simulated_s") == 0.4);
    assert_true(fabs(figure(a, NULL, "inserted_mm") - 26) < 1e-9);
    assert_true(figure(a, "contacts", "max") > 0);
    const char *hash = cJSON_GetStringValue(cJSON_GetObjectItem(a, "state_hash"));
    assert_int_equal(strlen(hash), 16);
    assert_string_equal(hash, cJSON_GetStringValue(cJSON_GetObjectItem(b, "state_hash")));
    const cJSON *target = cJSON_GetArrayItem(cJSON_GetObjectItem(a, "targets"), 0);
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(target, "reached")));

    char *first = text_of(in_folder("a.csv")), *second = text_of(in_folder("b.csv")), *line = first;
    assert_string_equal(first, second);
    assert_int_equal(strncmp(first, "node,s_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz,force_x_n,force_y_n,force_z_n,gap_mm,vessel_node\n", 86), 0);
    int rows = 0;
    for (; (line = strchr(line, '\n')) && line[1]; line++)
        rows++;
    assert_int_equal(rows, 41);
    free(first);
    free(second);
    cJSON_Delete(a);
    cJSON_Delete(b);
    assert_int_equal(run("info a.h5 --json"), 0);
    assert_non_null(strstr(output, "\"steps\":\t400"));
    assert_int_equal(run("export a.h5 -o a-path.csv"), 0);
    assert_int_equal(run("export a.h5 -o series.pvd"), 0);
    assert_true(exists("series.pvd") && exists("series_00000.vtp") && exists("series_00040.vtp"));
}

static void a_script_on_the_command_line_and_a_duration_win(void **state)
{
    (void)state;
    put("good.yaml", GOOD);
    put("pull.csv", "t_s,push_mm_s,twist_deg_s\n0,-5,0\n0.2,0,0\n");
    assert_int_equal(run("run good.yaml --script pull.csv --summary s.json"), 0);
    cJSON *json = json_of("s.json");
    assert_true(fabs(figure(json, NULL, "inserted_mm") - 1) < 1e-9 && figure(json, NULL, "steps") == 200);
    cJSON_Delete(json);
    assert_int_equal(run("run good.yaml --duration-s 0.1 --summary s.json"), 0);
    json = json_of("s.json");
    assert_true(fabs(figure(json, NULL, "inserted_mm") - 8) < 1e-9 && figure(json, NULL, "steps") == 100);
    cJSON_Delete(json);
    assert_int_equal(run("run good.yaml --duration-s 0.1 --settle-s 5 --summary s.json"), 0);
    json = json_of("s.json");
    assert_true(figure(json, NULL, "steps") < 5100 && cJSON_IsTrue(cJSON_GetObjectItem(json, "settled")));
    cJSON_Delete(json);
    assert_int_equal(run("run good.yaml --paced --duration-s 0.3 --summary s.json"), 0);
    json = json_of("s.json");
    assert_true(figure(json, NULL, "wall_s") >= 0.299 && figure(json, NULL, "steps") == 300);
    cJSON_Delete(json);
}

static void a_fitted_tube_answers_like_the_exact_one(void **state)
{
    (void)state;
    put("good.yaml", GOOD);
    Tip tip[2];
    for (int i = 0; i < 2; i++) {
        assert_int_equal(run(i ? "run good.yaml --contact lim --summary s.json" : "run good.yaml --contact tube --summary s.json"), 0);
        cJSON *json = json_of("s.json");
        const cJSON *mm = cJSON_GetObjectItem(json, "tip_mm");
        for (int j = 0; j < 3; j++)
            tip[i].x[j] = cJSON_GetArrayItem(mm, j)->valuedouble;
        cJSON_Delete(json);
    }
    double distance = 0;
    for (int j = 0; j < 3; j++)
        distance += (tip[1].x[j] - tip[0].x[j]) * (tip[1].x[j] - tip[0].x[j]);
    // the fit's walls differ by a few hundredths of a millimetre; identical bits would mean that no fit was made
    assert_true(distance > 0 && sqrt(distance) < 0.15);
}

static void no_step_is_a_run_too(void **state)
{
    (void)state;
    put("good.yaml", GOOD);
    assert_int_equal(run("run good.yaml --duration-s 0 --summary s.json --final f.csv --record r.h5"), 0);
    cJSON *json = json_of("s.json");
    assert_true(figure(json, NULL, "steps") == 0 && figure(json, NULL, "inserted_mm") == 2);
    assert_true(cJSON_IsNumber(cJSON_GetObjectItem(cJSON_GetArrayItem(cJSON_GetObjectItem(json, "targets"), 0), "distance_mm")));
    cJSON_Delete(json);
    assert_true(exists("f.csv") && exists("r.h5"));
}

static void a_signal_stops_cleanly(void **state)
{
    (void)state;
    put("good.yaml", GOOD);
    for (int trial = 0; trial < 2; trial++) {
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            if (chdir(folder) == 0)
                execl(SELDINGER_PROGRAM, "seldinger", "run", "good.yaml", "--paced", "--duration-s", "60", "--summary", "stop.json", "--record", "stop.h5",
                      "--final", "stop.csv", "--quiet", (char *)NULL);
            _exit(127);
        }
        for (int i = 0; i < 500 && !exists("stop.h5"); i++)
            nanosleep(&(struct timespec){.tv_nsec = 10000000}, NULL);
        kill(child, trial ? SIGTERM : SIGINT);
        int status;
        waitpid(child, &status, 0);
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
        cJSON *json = json_of("stop.json");
        double steps = figure(json, NULL, "steps");
        assert_true(steps > 0 && steps < 60000);
        assert_string_equal(cJSON_GetStringValue(cJSON_GetArrayItem(cJSON_GetObjectItem(json, "flags"), 0)), "stopped");
        cJSON_Delete(json);
        assert_int_equal(run("info stop.h5 --json"), 0);
        char words[64];
        snprintf(words, sizeof words, "\"steps\":\t%.0f,", steps);
        assert_non_null(strstr(output, words));
        char clean[400];
        snprintf(clean, sizeof clean, "rm '%s'/stop.*", folder);
        assert_int_equal(system(clean), 0);
    }
}

static void a_full_disk_ends_with_3(void **state)
{
    (void)state;
    put("good.yaml", GOOD);
    char command[1000];
    // file size limit of 64 kB: even the first rows do not fit, so no file remains
    snprintf(command, sizeof command, "cd '%s' && ulimit -f 64 && %s run good.yaml --record full.h5 > full.txt 2>&1", folder, SELDINGER_PROGRAM);
    int status = system(command);
    assert_true(WIFEXITED(status));
    assert_true(WEXITSTATUS(status) == 3 || WEXITSTATUS(status) == 2);
    char *message_text = text_of(in_folder("full.txt"));
    assert_non_null(strstr(message_text, "full.h5"));
    free(message_text);
    assert_false(exists("full.h5"));
    assert_int_equal(run("run good.yaml --summary /dev/full"), 3);
    assert_non_null(strstr(output, "/dev/full: cannot be written: No space left"));
}

// --- golden paths ---

static void check_passes_on_identity_and_fails_on_one_per_cent(void **state)
{
    (void)state;
    put("gold.yaml", GOOD);
    assert_int_equal(run("check gold.yaml"), 2);
    assert_non_null(strstr(output, "--update"));
    assert_int_equal(run("check --update gold.yaml"), 0);
    assert_true(exists("gold.golden.csv"));
    assert_int_equal(run("check gold.yaml"), 0);
    assert_int_equal(run("check ."), 0);
    // 1 % of stiffness, of friction, or of the lumen's radius: each changes the path by more than the default tolerance
    put("gold.yaml", SCENE("80.8", "0.68", "40", "", SCRIPT));
    assert_int_equal(run("check gold.yaml"), 1);
    assert_non_null(strstr(output, "DIFFERS"));
    put("gold.yaml", SCENE_MU("0.101", "80", "0.68", "40", "", SCRIPT));
    assert_int_equal(run("check gold.yaml"), 1);
    put("gold.yaml", SCENE("80", "0.6868", "40", "", SCRIPT));
    assert_int_equal(run("check gold.yaml"), 1);
    double worst = 0, first_t = 0, first = 0;
    int node = -1;
    assert_int_equal(sscanf(strstr(output, "DIFFERS"), "DIFFERS %lf %lf %d %lf", &worst, &first_t, &node, &first), 4);
    assert_true(worst > 0.00001 && first > 0.00001 && first <= worst && node > 0 && node <= 40 && first_t > 0 && first_t <= 0.4);
    assert_int_equal(run("check gold.yaml --tolerance-mm 10"), 0);
    // another number of nodes, a shorter run
    put("gold.yaml", SCENE("80", "0.68", "44", "", SCRIPT));
    assert_int_equal(run("check gold.yaml"), 1);
    assert_non_null(strstr(output, "45 nodes, the golden has 41"));
    put("gold.yaml", SCENE("80", "zero", "40", "", SCRIPT));
    assert_int_equal(run("check gold.yaml"), 2);
    // a scene whose model does not exist is skipped by name
    put("gold.yaml", GOOD);
    put("away.yaml", "seldinger: 1\nvessel: {model: nowhere.h5}\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                     "sheath: {inlet: root}\nscript: [[0, 10, 0], [1, 0, 0]]\n");
    put("away.golden.csv", "# nodes: 201\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n0.05,0,0,0,0\n");
    assert_int_equal(run("check ."), 0);
    assert_non_null(strstr(output, "skipped"));
    assert_non_null(strstr(output, "nowhere.h5"));
    put("away.yaml", "seldinger: 1\n");
    assert_int_equal(run("check ."), 2);
    char clean[400];
    snprintf(clean, sizeof clean, "rm '%s'/away.*", folder);
    assert_int_equal(system(clean), 0);
    assert_int_equal(run("check nowhere"), 2);
    assert_int_equal(run("check"), 2);
}

static void help_names_every_option(void **state)
{
    (void)state;
    const char *verbs[] = {"run", "check", "segment", "import", "fit", "synth", "query", "export", "info", "replay", "report", "devices"};
    for (size_t i = 0; i < sizeof verbs / sizeof *verbs; i++) {
        char arguments[80], head[80];
        snprintf(arguments, sizeof arguments, "%s --help", verbs[i]);
        assert_int_equal(run(arguments), 0);
        snprintf(head, sizeof head, "Usage: seldinger %s ", verbs[i]);
        assert_non_null(strstr(output, head));
        snprintf(arguments, sizeof arguments, "%s --banana x", verbs[i]);
        assert_int_equal(run(arguments), 2);
        assert_non_null(strstr(output, "unknown option '--banana'"));
        snprintf(arguments, sizeof arguments, "%s --quite", verbs[i]);
        assert_int_equal(run(arguments), 2);
        assert_non_null(strstr(output, "did you mean '--quiet'?"));
        snprintf(arguments, sizeof arguments, "--manual %s", verbs[i]);
        assert_int_equal(run(arguments), 0);
        assert_non_null(strstr(output, ".SH EXIT STATUS"));
        assert_non_null(strstr(output, "\\fB\\-\\-quiet\\fR"));
    }
    assert_int_equal(run("--manual"), 0);
    assert_int_equal(run("--manual banana"), 2);
    assert_int_equal(run("--completion | bash -n"), 0);
}

// fit --model sweep, beside blobs and without them, and the scenes that use it.
static void a_swept_model_is_fitted_kept_and_used(void **state)
{
    (void)state;
#define SWEPT_SCENE(vessel)                                                                                                                                    \
    "seldinger: 1\nvessel: {" vessel ", contact: sweep}\nwire: {elements: 20, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"        \
    "sheath: {inlet: root, inserted_mm: 1}\nscript: [[0, 30, 0], [0.2, 0, 0]]\n"
    put("file.yaml", SWEPT_SCENE("model: both.h5"));
    put("rbf.yaml",
        "seldinger: 1\nvessel: {model: all.h5, contact: rbf}\nwire: {elements: 20, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: "
        "80}]}\nsheath: {inlet: root, inserted_mm: 1}\nscript: [[0, 30, 0], [0.2, 0, 0]]\n");
    put("none.yaml", SWEPT_SCENE("model: lim.h5"));
    put("shape.yaml", SWEPT_SCENE("shape: {name: open-capsule, length_mm: 20}"));
    put("tube.yaml", SCENE("80", "0.68", "40", "  contact: sweep\n", SCRIPT));
    assert_int_equal(run("synth open-capsule --length-mm 20 -o tree.h5 --quiet"), 0);
    assert_int_equal(run("fit tree.h5 -o lim.h5 --quiet"), 0);
    assert_int_equal(run("fit lim.h5 -o both.h5 --model sweep"), 0);
    assert_non_null(strstr(output, "sections of kind polar: 1 branches"));
    assert_int_equal(run("fit both.h5 -o again.h5 --model lim --quiet"), 0);
    assert_int_equal(run("fit again.h5 -o rbf.h5 --model rbf --quiet"), 0);
    assert_int_equal(run("fit rbf.h5 -o all.h5 --model pas --preset paper --quiet"), 0);
    assert_int_equal(run("info all.h5"), 0);       // blobs and swept model are both there: the file opens as either
    assert_non_null(strstr(output, "model"));
    for (int i = 0; i < 4; i++) {
        static const char *const scene[] = {"run rbf.yaml --summary s.json --quiet", "run file.yaml --summary s.json --quiet",
                                            "run shape.yaml --summary s.json --quiet", "run tube.yaml --summary s.json --quiet"};
        int code = run(scene[i]);
        if (code != 0)
            fail_msg("`%s` ended with %d: %s", scene[i], code, output);
    }
    expect_bad(NULL, "run none.yaml", "seldinger fit");
    expect_bad(NULL, "run none.yaml", "--model sweep -o");
    assert_int_equal(run("fit tree.h5 -o x.h5 --model sweep --preset local"), 2);
    assert_non_null(strstr(output, "--preset local needs --model lim"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_input_ends_with_2_and_says_where),
        cmocka_unit_test(outputs_that_cannot_be_written_are_found_before_the_run),
        cmocka_unit_test(a_curved_tip_presses_out_of_its_sheath),
        cmocka_unit_test(a_tool_that_touches_itself_is_reported),
        cmocka_unit_test(a_run_leaves_its_files_and_repeats_bit_for_bit),
        cmocka_unit_test(a_script_on_the_command_line_and_a_duration_win),
        cmocka_unit_test(a_fitted_tube_answers_like_the_exact_one),
        cmocka_unit_test(no_step_is_a_run_too),
        cmocka_unit_test(a_signal_stops_cleanly),
        cmocka_unit_test(a_full_disk_ends_with_3),
        cmocka_unit_test(check_passes_on_identity_and_fails_on_one_per_cent),
        cmocka_unit_test(help_names_every_option),
        cmocka_unit_test(a_swept_model_is_fitted_kept_and_used),
    };
    return cmocka_run_group_tests(tests, make_folder_with_cache, remove_folder);
}

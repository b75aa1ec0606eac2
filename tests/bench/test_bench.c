// The timing tables hold what they promise: all figures, the same state hash on every SIMD level and in a repetition, budgets with verdicts, and
// the peer's scenes contained from the first push. `run --chart` draws. Times themselves are not judged here: other work shares the machine.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <cJSON.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/short_run.h"

static int run(const char *arguments)
{
    char line[1024];
    snprintf(line, sizeof line, "%s %s", SELDINGER_PROGRAM, arguments);
    int status = system(line);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static cJSON *load(const char *path)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char *text = calloc(1, 1 << 20);
    size_t length = fread(text, 1, (1 << 20) - 1, file);
    fclose(file);
    unlink(path);
    assert_true(length > 0);
    cJSON *root = cJSON_Parse(text);
    free(text);
    assert_non_null(root);
    return root;
}

static double number(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItem(object, name);
    assert_true(cJSON_IsNumber(item));
    return item->valuedouble;
}

static void assert_near_number(double value, double wanted) { assert_true(fabs(value - wanted) < 1e-9 * fmax(1, fabs(wanted))); }

static void tools_table(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    assert_int_equal(run("bench step --tools --quick --json /tmp/seldinger-bench-tools.json > /tmp/seldinger-bench-tools.txt"), 0);
    cJSON *root = load("/tmp/seldinger-bench-tools.json"), *at;
    unlink("/tmp/seldinger-bench-tools.txt");
    cJSON *rows = cJSON_GetObjectItem(root, "tools");
    int count = 0;
    assert_true(cJSON_GetArraySize(rows) >= 16 && cJSON_GetArraySize(rows) % 16 == 0);       // arch and angiogram are there or not
    cJSON_ArrayForEach(at, rows)
    {
        const cJSON *step = cJSON_GetObjectItem(at, "step_us");
        assert_true(number(at, "tools") == 1 + count / 4 % 4 && number(at, "steps") == 200);
        assert_true(number(step, "median") > 0 && number(step, "median") <= number(step, "p999"));
        assert_true(number(at, "not_converged_steps") == 0 && number(at, "limited_steps") == 0);
        count++;
    }
    cJSON_Delete(root);
}

static void step_tables(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    assert_int_equal(run("bench step --quick --json /tmp/seldinger-bench-step.json > /tmp/seldinger-bench-step.txt"), 0);
    cJSON *root = load("/tmp/seldinger-bench-step.json"), *at;
    unlink("/tmp/seldinger-bench-step.txt");
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(root, "same_hash")));
    cJSON *scenes = cJSON_GetObjectItem(root, "scenes");
    assert_true(cJSON_GetArraySize(scenes) >= 2);   // the aneurism is there or not
    double samples = 0;
    cJSON_ArrayForEach(at, scenes)
    {
        const cJSON *step = cJSON_GetObjectItem(at, "step_us"), *error = cJSON_GetObjectItem(at, "force_error");
        assert_true(number(step, "median") > 0 && number(step, "median") <= number(step, "p99"));
        assert_true(number(step, "p99") <= number(step, "p999") && number(step, "p999") <= number(step, "max"));
        samples += number(error, "samples");
        assert_true(number(error, "median") <= 1e-6 && number(error, "max") <= 1e-3);   // the bounds of bench/step.c
    }
    assert_true(samples > 10);
    cJSON *growth = cJSON_GetObjectItem(root, "growth");
    assert_int_equal(cJSON_GetArraySize(growth), 5);
    double elements = 25;
    cJSON_ArrayForEach(at, growth)
    {
        assert_true(number(at, "elements") == 2 * elements);
        assert_true(number(at, "steps") == 200 && number(cJSON_GetObjectItem(at, "contacts"), "max") > 0);
        elements *= 2;
    }
    assert_true(cJSON_GetArraySize(cJSON_GetObjectItem(root, "levels")) >= 1);
    assert_true(cJSON_GetArraySize(cJSON_GetObjectItem(root, "budgets")) > 15);
    cJSON_Delete(root);
}

static void peer_scenes_stay_inside(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    bool tubes = access("../shared/data/peer-tubes/tube-b-centreline.csv", R_OK) == 0 && system("scenes/peer/prepare") == 0;
    int code = run("bench peer --quick --json /tmp/seldinger-bench-peer.json > /tmp/seldinger-bench-peer.txt");
    cJSON *root = load("/tmp/seldinger-bench-peer.json"), *rows = cJSON_GetObjectItem(root, "rows"), *at;
    unlink("/tmp/seldinger-bench-peer.txt");
    int surfaces = 2;    // the exact tube, local models, and with Embree a mesh
    cJSON_ArrayForEach(at, rows) surfaces = strcmp(cJSON_GetObjectItem(at, "contact")->valuestring, "mesh") == 0 ? 3 : surfaces;
    assert_int_equal(cJSON_GetArraySize(rows), (tubes ? 6 : 2) * surfaces);
    cJSON_ArrayForEach(at, rows)
    {
        print_message("%s on %s: %g steps, deepest %.1f um, %g contacts at most\n", cJSON_GetObjectItem(at, "scene")->valuestring,
                      cJSON_GetObjectItem(at, "contact")->valuestring, number(at, "steps"), number(at, "deepest_um"), number(at, "contacts_max"));
        assert_true(cJSON_IsTrue(cJSON_GetObjectItem(at, "contained")));
        assert_true(number(at, "deepest_um") <= 50);
    }
    assert_int_equal(code, 0);
    cJSON_Delete(root);
    if (!tubes) {
        print_message("skipped: tube-b and tube-c, ../shared/data/peer-tubes is not here\n");
        skip();
    }
}

static bool is_called(const cJSON *row, const char *representation) { return !strcmp(cJSON_GetObjectItem(row, "representation")->valuestring, representation); }

static void a_row_is_whole(const cJSON *row, double steps)
{
    const cJSON *motion = cJSON_GetObjectItem(row, "motion"), *gap = cJSON_GetObjectItem(motion, "gap_error_um");
    assert_true(number(row, "bytes") > 0 && number(row, "primitives") > 0 && number(row, "bytes_per_mm") > 0);
    assert_true(number(motion, "steps") == steps && number(motion, "points_per_step") > 1);
    assert_true(number(motion, "us_per_step") > 0 && number(motion, "us_per_80_points") > 0 && number(motion, "near_points") > 100);
    assert_true(number(gap, "rms") <= number(gap, "max"));
    assert_true(number(cJSON_GetObjectItem(motion, "normal_error_deg"), "rms") < 90);
    const cJSON *loop = cJSON_GetObjectItem(row, "loop"), *smooth = cJSON_GetObjectItem(row, "frictionless");
    if (!loop)
        return;
    assert_true(number(loop, "detect_us") > 0 && number(loop, "contact_us") > 0 && number(loop, "candidates_max") >= number(loop, "contacts_max"));
    static const char *const all[] = {"push_force_n", "jitter_rms", "jitter_p99", "work_lost_n", "artificial_mu", "penetration_um"};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        number(smooth, all[i]);
}

// A bent tube, in which the wire presses on the wall: every representation has its row, and local models do what the exact tube does.
static void collision_of_a_scene(void **state)
{
    (void)state;
    const char *scene = "/tmp/seldinger-bench-bend.yaml";
    FILE *file = fopen(scene, "w");
    assert_non_null(file);
    fprintf(file, "seldinger: 1\nvessel:\n  tube: {radius_mm: 1, path: [{line_mm: 4}, {arc: {radius_mm: 8, angle_deg: 70}}, {line_mm: 4}]}\n  friction: 0.1\n"
                  "wire:\n  elements: 40\n  sections:\n"
                  "    - {length_mm: 20, diameter_mm: 0.3, young_modulus_gpa: 50, poisson_ratio: 0.3, density_g_cm3: 6.45}\n"
                  "sheath: {inlet: root, inserted_mm: 6}\nscript: [{t_s: 0, push_mm_s: 50, twist_deg_s: 0}, {t_s: 0.2, push_mm_s: 0, twist_deg_s: 0}]\n");
    fclose(file);
    int code = run("bench collision /tmp/seldinger-bench-bend.yaml --quick --json /tmp/seldinger-bench-bend.json --chart /tmp/seldinger-bench-bend.svg "
                   "> /tmp/seldinger-bench-bend.txt");
    unlink(scene);
    unlink("/tmp/seldinger-bench-bend.txt");
    assert_int_equal(code, 0);
    assert_int_equal(access("/tmp/seldinger-bench-bend.svg", R_OK), 0);
    unlink("/tmp/seldinger-bench-bend.svg");
    cJSON *root = load("/tmp/seldinger-bench-bend.json"), *rows = cJSON_GetObjectItem(root, "rows"), *row;
    bool embree = cJSON_IsTrue(cJSON_GetObjectItem(root, "embree"));
    assert_int_equal(cJSON_GetArraySize(rows), embree ? 11 : 6);
    double exact_push = 0;
    cJSON_ArrayForEach(row, rows)
    {
        a_row_is_whole(row, 200);
        const cJSON *loop = cJSON_GetObjectItem(row, "loop"), *gap = cJSON_GetObjectItem(cJSON_GetObjectItem(row, "motion"), "gap_error_um");
        const cJSON *smooth = cJSON_GetObjectItem(row, "frictionless");
        if (is_called(row, "exact")) {
            assert_true(number(gap, "max") == 0);
            exact_push = number(smooth, "push_force_n");
            assert_true(exact_push > 0 && fabs(number(smooth, "artificial_mu")) < 0.002);    // forces along the wall's own normals do no work along it
        }
        if (is_called(row, "exact") || !strncmp(cJSON_GetObjectItem(row, "representation")->valuestring, "lim", 3)) {
            assert_true(cJSON_IsTrue(cJSON_GetObjectItem(loop, "survived")) && number(loop, "steps") == 200);
            assert_true(number(loop, "contacts_max") > 0);
            number(smooth, "artificial_friction_n");
            assert_true(number(gap, "max") < 50);        // samples of a tube stand for voxels of 0.05 mm
        }
        if (is_called(row, "lim fine"))
            assert_true(fabs(number(smooth, "push_force_n") / exact_push - 1) < 0.1);
        if (is_called(row, "mesh warm"))
            assert_true(number(row, "triangles") > 8000 && number(row, "triangles") < 16000);
        assert_true(number(gap, "rms") > 0 || is_called(row, "exact"));
    }
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(root, "clamps")), embree ? 16 : 8);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(root, "verdicts")), 0);      // there is no mesh of 100,000 triangles
    cJSON_Delete(root);
}

static void tables_that_are_not_there(void **state)
{
    (void)state;
    static const char *const bad[] = {"bench",
                                      "bench collision --fast",
                                      "bench collision nowhere.yaml",
                                      "bench collision scenes/verify/cantilever.yaml",
                                      "bench fit",
                                      "bench track --fast",
                                      "bench nothing",
                                      "bench step --fast",
                                      "bench step extra",
                                      "bench peer --threads many",
                                      "bench step --json /nowhere/f.json"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char line[128];
        snprintf(line, sizeof line, "%s 2> /dev/null > /dev/null", bad[i]);
        assert_int_equal(run(line), 2);
    }
    assert_int_equal(run("bench --help > /dev/null"), 0);
    assert_int_equal(run("bench step --help > /dev/null"), 0);
}

// The program alone, as it is installed without its benchmarks.
static void without_the_benchmarks(void **state)
{
    (void)state;
    char folder[] = "/tmp/seldinger-alone-XXXXXX", command[1024];
    assert_non_null(mkdtemp(folder));
    snprintf(command, sizeof command,
             "cp %s %s/seldinger && { %s/seldinger bench step; test $? = 2; } 2>&1 | grep -q 'not installed: %s/seldinger-bench does not exist'",
             SELDINGER_PROGRAM, folder, folder, folder);
    assert_int_equal(system(command), 0);
    snprintf(command, sizeof command, "rm -rf %s", folder);
    assert_int_equal(system(command), 0);
}

static void a_chart_is_a_picture(void **state)
{
    (void)state;
    const char *path = "/tmp/seldinger-chart.png";
    unlink(path);
    int code = run("run scenes/verify/push-through-bend.yaml --duration-s 0.2 --quiet --chart /tmp/seldinger-chart.png 2> /tmp/seldinger-chart.txt");
    unlink("/tmp/seldinger-chart.txt");
    if (access(path, R_OK) != 0) {
        print_message("skipped: no pictures in this build or on this machine\n");
        skip();
    }
    assert_int_equal(code, 0);
    unsigned char head[8] = {0};
    FILE *file = fopen(path, "rb");
    assert_int_equal(fread(head, 1, 8, file), 8);
    fclose(file);
    unlink(path);
    assert_memory_equal(head, "\x89PNG\r\n\x1a\n", 8);
}

static const cJSON *wall_line(const cJSON *lines, const char *row, const char *what)
{
    const cJSON *at;
    cJSON_ArrayForEach(at, lines)
    {
        if (!strcmp(cJSON_GetObjectItem(at, "row")->valuestring, row) && !strcmp(cJSON_GetObjectItem(at, "what")->valuestring, what))
            return at;
    }
    fail_msg("no line '%s' of '%s'", what, row);
    return NULL;
}

// A fork with truth: its wall is one, its junction open, a tool gets everywhere; a tree is fitted first, a model taken as it is.
static void wall_table(void **state)
{
    (void)state;
    assert_int_equal(run("synth y --quiet -o /tmp/seldinger-wall-y.h5"), 0);
    int code = run("bench wall --rows jumps,points,blobs,fit,junctions,flood --quick --json /tmp/seldinger-wall.json /tmp/seldinger-wall-y.h5 > "
                   "/tmp/seldinger-wall.txt 2>&1");
    assert_true(code == 0 || code == 1);
    cJSON *root = load("/tmp/seldinger-wall.json");
    const cJSON *lines = cJSON_GetObjectItem(root, "lines");
    assert_true(number(wall_line(lines, "jumps", "raw jump of gap, max"), "value") < 0.01);
    assert_true(number(wall_line(lines, "points", "points to wall, mean"), "value") < 0.05);
    assert_true(number(wall_line(lines, "blobs", "blobs a mm"), "value") > 0);
    assert_true(number(wall_line(lines, "fit", "fit, CPU of all threads over 2"), "value") > 0);
    assert_near_number(number(wall_line(lines, "junctions", "junctions capped"), "value"), 0);
    assert_near_number(number(wall_line(lines, "flood", "reached by a point"), "value"), 100);
    assert_near_number(number(wall_line(lines, "flood", "by it up to 0.5 r aside"), "value"), 100);
    assert_string_equal(cJSON_GetObjectItem(wall_line(lines, "flood", "reached by a point"), "verdict")->valuestring, "aim");
    cJSON_Delete(root);
    assert_int_equal(run("bench wall --rows flood,nothing > /tmp/seldinger-wall.txt 2>&1"), 2);
    assert_int_equal(run("bench wall --seeds 1 > /tmp/seldinger-wall.txt 2>&1"), 2);
    assert_int_equal(run("bench wall --rows flood /tmp/seldinger-no-such.h5 > /tmp/seldinger-wall.txt 2>&1"), 2);
    assert_int_equal(run("bench wall --work /tmp/seldinger-no-such --rows flood > /tmp/seldinger-wall.txt 2>&1"), 2);
    unlink("/tmp/seldinger-wall.txt");
    unlink("/tmp/seldinger-wall-y.h5");
}

// What `fit` and `info` end with.
static void reach_reports(void **state)
{
    (void)state;
    assert_int_equal(run("synth y --quiet -o /tmp/seldinger-reach-tree.h5"), 0);
    assert_int_equal(run("fit /tmp/seldinger-reach-tree.h5 -o /tmp/seldinger-reach.h5 --json /tmp/seldinger-reach.json > /dev/null"), 0);
    cJSON *root = load("/tmp/seldinger-reach.json");
    const cJSON *reach = cJSON_GetObjectItem(root, "reach");
    assert_near_number(number(reach, "tool_radius_mm"), 0.18);
    assert_near_number(number(reach, "point_percent"), 100);
    assert_true(number(reach, "junction_count") >= 1);
    cJSON_Delete(root);
    // a tool wider than the vessel gets nowhere, and that is no fault
    assert_int_equal(run("info /tmp/seldinger-reach.h5 --json --tool-radius-mm 50 > /tmp/seldinger-reach.json"), 0);
    root = load("/tmp/seldinger-reach.json");
    reach = cJSON_GetObjectItem(root, "reach");
    assert_near_number(number(reach, "tool_aside_percent"), 0);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(reach, "shut")), 1);
    cJSON_Delete(root);
    // a tree has no field to ask
    assert_int_equal(run("info /tmp/seldinger-reach-tree.h5 --json > /tmp/seldinger-reach.json"), 0);
    root = load("/tmp/seldinger-reach.json");
    assert_null(cJSON_GetObjectItem(root, "reach"));
    cJSON_Delete(root);
    assert_int_equal(run("info /tmp/seldinger-reach.h5 --tool-radius-mm 0 > /dev/null 2>&1"), 2);
    assert_int_equal(run("info /tmp/seldinger-reach.h5 --volume /tmp/seldinger-reach.h5 > /dev/null 2>&1"), 2);
    assert_int_equal(run("info /tmp/seldinger-reach.h5 --junctions /tmp/seldinger-reach.png --before /tmp/seldinger-reach-tree.h5 > /dev/null 2>&1"), 2);
    unlink("/tmp/seldinger-reach.h5");
    unlink("/tmp/seldinger-reach-tree.h5");
}

// Random runs: inside the true wall, nothing unreported, numbers all of them. Some gain more than 1e-3 of the work (exit code 1); their scenes are kept.
static void random_runs_stay_inside(void **state)
{
    (void)state;
    char folder[] = "/tmp/seldinger-torture-XXXXXX", command[300];
    assert_non_null(mkdtemp(folder));
    snprintf(command, sizeof command, "bench torture --runs %d --steps 200 --finer 4 --keep %s --json %s/t.json >/dev/null 2>&1", WHOLE_OR_SHORT(12, 1), folder,
             folder);
    int code = run(command);
    snprintf(command, sizeof command, "%s/t.json", folder);
    cJSON *root = load(command), *rows = cJSON_GetObjectItem(root, "rows"), *all = cJSON_GetArrayItem(rows, cJSON_GetArraySize(rows) - 1);
    static const char *const never[] = {"outside the wall", "outside and not reported", "diverged or not a number", "refused"};
    assert_true(code == 0 || code == 1);
    assert_int_equal(cJSON_GetObjectItem(all, "runs")->valueint, WHOLE_OR_SHORT(12, 1));
    assert_int_equal(cJSON_GetObjectItem(all, "steps")->valueint, 200 * WHOLE_OR_SHORT(12, 1));
    for (size_t i = 0; i < sizeof never / sizeof never[0]; i++)
        assert_int_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(all, "failed"), never[i])->valueint, 0);
    cJSON_Delete(root);
    snprintf(command, sizeof command, "rm -rf %s", folder);
    assert_int_equal(system(command), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(step_tables),
                                       cmocka_unit_test(tools_table),
                                       cmocka_unit_test(peer_scenes_stay_inside),
                                       cmocka_unit_test(collision_of_a_scene),
                                       cmocka_unit_test(tables_that_are_not_there),
                                       cmocka_unit_test(without_the_benchmarks),
                                       cmocka_unit_test(a_chart_is_a_picture),
                                       cmocka_unit_test(wall_table),
                                       cmocka_unit_test(reach_reports),
                                       cmocka_unit_test(random_runs_stay_inside)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

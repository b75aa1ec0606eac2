// The timing tables hold what they promise: all figures, the same state hash on every SIMD level and in a repetition, budgets with verdicts, and
// the peer's scenes contained from the first push. `run --chart` draws. Times themselves are not judged here: other work shares the machine.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <cJSON.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

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

static void step_tables(void **state)
{
    (void)state;
    assert_int_equal(run("bench step --quick --json /tmp/seldinger-bench-step.json > /tmp/seldinger-bench-step.txt"), 0);
    cJSON *root = load("/tmp/seldinger-bench-step.json"), *at;
    unlink("/tmp/seldinger-bench-step.txt");
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(root, "same_hash")));
    cJSON *scenes = cJSON_GetObjectItem(root, "scenes");
    assert_true(cJSON_GetArraySize(scenes) >= 2);   // the aneurism is there or not
    double samples = 0;
    cJSON_ArrayForEach(at, scenes) {
        const cJSON *step = cJSON_GetObjectItem(at, "step_us"), *error = cJSON_GetObjectItem(at, "force_error");
        assert_true(number(step, "median") > 0 && number(step, "median") <= number(step, "p99"));
        assert_true(number(step, "p99") <= number(step, "p999") && number(step, "p999") <= number(step, "max"));
        samples += number(error, "samples");
        assert_true(number(error, "median") <= 1e-6 && number(error, "max") <= 1e-3);   // DESIGN section 7
    }
    assert_true(samples > 10);
    cJSON *growth = cJSON_GetObjectItem(root, "growth");
    assert_int_equal(cJSON_GetArraySize(growth), 5);
    double elements = 25;
    cJSON_ArrayForEach(at, growth) {
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
    bool tubes = access("../shared/data/peer-tubes/tube-b-centreline.csv", R_OK) == 0 && system("scenes/peer/prepare") == 0;
    int code = run("bench peer --quick --json /tmp/seldinger-bench-peer.json > /tmp/seldinger-bench-peer.txt");
    cJSON *root = load("/tmp/seldinger-bench-peer.json"), *rows = cJSON_GetObjectItem(root, "rows"), *at;
    unlink("/tmp/seldinger-bench-peer.txt");
    assert_int_equal(cJSON_GetArraySize(rows), tubes ? 12 : 4);
    cJSON_ArrayForEach(at, rows) {
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

static void tables_that_are_not_there(void **state)
{
    (void)state;
    static const char *const bad[] = {"bench", "bench collision --fast", "bench collision nowhere.yaml", "bench collision scenes/verify/cantilever.yaml", "bench fit", "bench track --fast", "bench nothing", "bench step --fast", "bench step extra",
                                      "bench peer --threads many", "bench step --json /nowhere/f.json"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char line[128];
        snprintf(line, sizeof line, "%s 2> /dev/null > /dev/null", bad[i]);
        assert_int_equal(run(line), 2);
    }
    assert_int_equal(run("bench --help > /dev/null"), 0);
    assert_int_equal(run("bench step --help > /dev/null"), 0);
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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(step_tables), cmocka_unit_test(peer_scenes_stay_inside), cmocka_unit_test(tables_that_are_not_there),
                                       cmocka_unit_test(a_chart_is_a_picture)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

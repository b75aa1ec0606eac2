// `check` as the regression tool of a laboratory: figures and their tolerances, cases as JSON and JUnit XML, baselines of versions, the page, and that neither
// results nor output depend on the number of threads.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <expat.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-check-XXXXXX";
#include "tests/folder.h"

#include "tests/cli/json_file.h"
#include "tests/cli/program.h"

static int run(const char *arguments) { return run_in("", arguments); }
static bool exists(const char *name) { return access(in_folder(name), F_OK) == 0; }

// A wire pushed around a bend. `modulus` in GPa; `more`: further keys.
static void put_scene(const char *name, const char *modulus, const char *more)
{
    char text[1000];
    snprintf(text, sizeof text,
             "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 0.7, path: [{line_mm: 5}, {arc: "
             "{radius_mm: 15, "
             "angle_deg: 90}}, {line_mm: 20}]}, contact: tube, friction: 0.1}\nwire: {elements: 40, sections: [{length_mm: 60, diameter_mm: 0.36, "
             "young_modulus_gpa: %s}]}\n"
             "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 3}\nscript: [[0, 50, 0], [0.3, 0, 0]]\n"
             "targets: [{name: bend, point_mm: [10, 1, 0], radius_mm: 2}]\n%s",
             modulus, more);
    put(name, text);
}

// --- XML ---

enum { DEPTH = 8 };
typedef struct Xml {
    int depth, suites, cases, failures, errors, skipped, wrong;
    int said[4];             // tests, failures, errors, skipped of the present suite
    int found[4];
    char parent[DEPTH][40];
} Xml;

static const char *attribute(const char **list, const char *name)
{
    for (; *list; list += 2)
        if (!strcmp(*list, name))
            return list[1];
    return NULL;
}

static bool has_only(const char **list, const char *const *valid)
{
    for (; *list; list += 2) {
        const char *const *v = valid;
        while (*v && strcmp(*v, *list))
            v++;
        if (!*v)
            return false;
    }
    return true;
}

// The rules of jenkins-junit.xsd (xUnit plug-in) for the elements that are written: their places, required attributes and no unknown ones.
static void begin_element(void *context, const char *name, const char **list)
{
    static const char *const suites[] = {"name", "time", "tests", "failures", "disabled", "errors", NULL};
    static const char *const suite[] = {"name", "tests", "failures", "errors", "time", "disabled", "skipped", "timestamp", "hostname", "id", "package", NULL};
    static const char *const one[] = {"name", "assertions", "time", "classname", "status", "class", "file", "line", NULL};
    static const char *const why[] = {"message", "type", NULL};
    Xml *xml = context;
    const char *parent = xml->depth > 0 ? xml->parent[xml->depth - 1] : "", *time = attribute(list, "time");
    bool good = true;
    if (!strcmp(name, "testsuites")) {
        good = !*parent && has_only(list, suites);
    } else if (!strcmp(name, "testsuite")) {
        static const char *const counts[] = {"tests", "failures", "errors", "skipped"};
        good = !strcmp(parent, "testsuites") && attribute(list, "name") && attribute(list, "tests") && has_only(list, suite);
        for (int k = 0; k < 4 && good; k++) {
            xml->said[k] = atoi(attribute(list, counts[k]));
            xml->found[k] = 0;
        }
        xml->suites++;
    } else if (!strcmp(name, "testcase")) {
        good = !strcmp(parent, "testsuite") && attribute(list, "name") && attribute(list, "classname") && time && has_only(list, one);
        xml->cases++;
        xml->found[0]++;
    } else {
        int k = !strcmp(name, "failure") ? 1 : !strcmp(name, "error") ? 2 : !strcmp(name, "skipped") ? 3 : 0;
        good = k > 0 && !strcmp(parent, "testcase") && attribute(list, "message") && has_only(list, why);
        xml->failures += k == 1;
        xml->errors += k == 2;
        xml->skipped += k == 3;
        xml->found[k]++;
    }
    char *end = NULL;
    good = good && (!time || (strtod(time, &end) >= 0 && end && !*end));
    xml->wrong += !good;
    snprintf(xml->parent[xml->depth++ % DEPTH], sizeof xml->parent[0], "%.39s", name);
}

static void end_element(void *context, const char *name)
{
    Xml *xml = context;
    xml->depth--;
    if (!strcmp(name, "testsuite"))
        xml->wrong += memcmp(xml->said, xml->found, sizeof xml->said) != 0;
}

static Xml read_junit(const char *name)
{
    Xml xml = {0};
    char *text = text_of(in_folder(name));
    XML_Parser parser = XML_ParserCreate("UTF-8");
    XML_SetUserData(parser, &xml);
    XML_SetElementHandler(parser, begin_element, end_element);
    if (XML_Parse(parser, text, (int)strlen(text), 1) == XML_STATUS_ERROR)
        fail_msg("%s:%lu: %s", name, XML_GetCurrentLineNumber(parser), XML_ErrorString(XML_GetErrorCode(parser)));
    XML_ParserFree(parser);
    free(text);
    assert_int_equal(xml.wrong, 0);
    return xml;
}

// --- tests ---

static void figures_have_their_tolerances(void **state)
{
    (void)state;
    put_scene("a.yaml", "80", "");
    assert_int_equal(run("check --update a.yaml"), 0);
    assert_true(exists("a.golden-figures.csv"));
    assert_int_equal(run("check a.yaml"), 0);
    // A bend without play has one path for any stiffness: only the forces tell.
    put_scene("a.yaml", "80.8", "");
    assert_int_equal(run("check a.yaml"), 1);
    assert_non_null(strstr(output, "push_n differs by"));
    put("loose.yaml", "push_n: 10\nwall_force_n: 10\npenetration_mm: 1\ntorque_n_mm: 10\ncontacts: 100\ntarget_time_s: 1\nposition_mm: 1\n");
    assert_int_equal(run("check a.yaml --tolerances loose.yaml"), 0);
    // what the scene says comes first
    put_scene("a.yaml", "80.8", "check: {push_n: 1e-6}\n");
    assert_int_equal(run("check a.yaml --tolerances loose.yaml"), 1);
    assert_non_null(strstr(output, "tolerance 1e-06"));
    assert_null(strstr(output, "wall_force_n"));
    // without golden figures the path alone counts
    assert_int_equal(unlink(in_folder("a.golden-figures.csv")), 0);
    assert_int_equal(run("check a.yaml --tolerance-mm 1"), 0);
    // a target that only one of the runs reaches
    put_scene("a.yaml", "80", "");
    assert_int_equal(run("check --update a.yaml"), 0);
    char *figures = text_of(in_folder("a.golden-figures.csv")), *reached = strstr(figures, "reached_s: ");
    assert_non_null(reached);
    memcpy(reached, "reached_s: -1 ", 13);
    for (char *c = reached + 13; *c != '\n'; c++)
        *c = ' ';
    put("a.golden-figures.csv", figures);
    free(figures);
    assert_int_equal(run("check a.yaml"), 1);
    assert_non_null(strstr(output, "target_time_s differs by inf"));
    assert_int_equal(unlink(in_folder("a.yaml")), 0);
}

static void bad_tolerances_are_refused_by_line(void **state)
{
    (void)state;
    put_scene("b.yaml", "80", "");
    put("t.yaml", "push_n: 1\nforce_n: 2\ncontacts: -1\n");
    assert_int_equal(run("check --update b.yaml"), 0);
    assert_int_equal(run("check b.yaml --tolerances t.yaml"), 2);
    assert_non_null(strstr(output, "t.yaml:2:"));
    assert_non_null(strstr(output, "t.yaml:3:"));
    put_scene("b.yaml", "80", "check: {push: 1}\n");
    assert_int_equal(run("check b.yaml"), 2);
    assert_non_null(strstr(output, "push_n"));
    put_scene("b.yaml", "80", "");
    put("b.golden-figures.csv", "t_s,inserted_mm,push_n,torque_n_mm,contacts,wall_force_n,penetration_mm\n0.1,1,1,1,1,1,1\n0.1,1,1,1,1,1,1\n");
    assert_int_equal(run("check b.yaml"), 2);
    assert_non_null(strstr(output, "b.golden-figures.csv:3:1: t_s is 0.1"));
    assert_int_equal(run("check b.yaml --update --store x"), 2);
    assert_int_equal(run("check b.yaml --as x"), 2);
    assert_int_equal(unlink(in_folder("b.yaml")), 0);
}

// A folder with a scene that passes, one that differs, one that cannot be read, one that lacks its model; beside them a path that does not exist.
static void put_mixed(void)
{
    char command[600];
    snprintf(command, sizeof command, "mkdir -p '%s/lab'", folder);
    assert_int_equal(system(command), 0);
    put_scene("lab/good.yaml", "80", "");
    put_scene("lab/other <&\">.yaml", "80", "");
    put_scene("lab/broken.yaml", "80", "");
    put_scene("lab/away.yaml", "80", "");
    assert_int_equal(run("check --update lab/*.yaml"), 0);
    put_scene("lab/other <&\">.yaml", "80, rest_curvature_1_mm: 0.02", "");
    put("lab/broken.yaml", "seldinger: 1\n");
    put("lab/away.yaml", "seldinger: 1\nvessel: {model: nowhere.h5}\nwire: {sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                         "sheath: {inlet: root}\nscript: [[0, 10, 0], [1, 0, 0]]\n");
}

static void every_case_is_reported(void **state)
{
    (void)state;
    put_mixed();
    assert_int_equal(run("check lab gone.yaml --json r.json --junit r.xml --page r.html"), 2);
    Xml xml = read_junit("r.xml");
    assert_int_equal(xml.cases, 5);
    assert_int_equal(xml.failures, 1);
    assert_int_equal(xml.errors, 2);
    assert_int_equal(xml.skipped, 1);
    cJSON *json = json_of("r.json"), *counts = cJSON_GetObjectItem(json, "counts"), *one;
    assert_int_equal(cJSON_GetObjectItem(counts, "passed")->valueint, 1);
    assert_int_equal(cJSON_GetObjectItem(counts, "failed")->valueint, 1);
    assert_int_equal(cJSON_GetObjectItem(counts, "error")->valueint, 2);
    assert_int_equal(cJSON_GetObjectItem(counts, "skipped")->valueint, 1);
    cJSON_ArrayForEach(one, cJSON_GetObjectItem(json, "cases")) if (!strcmp(cJSON_GetObjectItem(one, "status")->valuestring, "failed"))
    {
        cJSON *position = cJSON_GetObjectItem(cJSON_GetObjectItem(one, "quantities"), "position_mm");
        assert_true(cJSON_GetObjectItem(position, "worst")->valuedouble > 1e-5);
        assert_true(cJSON_GetObjectItem(position, "first_t_s")->valuedouble > 0);
    }
    cJSON_Delete(json);
    char *page = text_of(in_folder("r.html"));
    assert_non_null(strstr(page, "other &lt;&amp;&quot;&gt;.yaml"));
    assert_non_null(strstr(page, "id=\"deviation-inserted-"));
    assert_non_null(strstr(page, "First moment above a tolerance"));
    assert_null(strstr(page, "http://"));
    assert_null(strstr(page, "https://"));
    free(page);
}

// Everything but times: the rows, and the JSON without its times.
static void threads_change_nothing(void **state)
{
    (void)state;
    static char one[sizeof output];
    char *text[2];
    put_mixed();
    assert_int_equal(run("check lab --threads 1 --json 1.json"), 2);
    snprintf(one, sizeof one, "%s", output);
    assert_int_equal(run("check lab --threads 3 --json 3.json"), 2);
    assert_string_equal(one, output);
    for (int k = 0; k < 2; k++) {
        cJSON *json = json_of(k ? "3.json" : "1.json"), *item;
        cJSON_ArrayForEach(item, cJSON_GetObjectItem(json, "cases")) cJSON_DeleteItemFromObject(item, "time_s");
        text[k] = cJSON_Print(json);
        cJSON_Delete(json);
    }
    assert_string_equal(text[0], text[1]);
    free(text[0]);
    free(text[1]);
}

static void baselines_compare_versions(void **state)
{
    (void)state;
    char command[600];
    snprintf(command, sizeof command, "mkdir -p '%s/set'", folder);
    assert_int_equal(system(command), 0);
    put_scene("set/a.yaml", "80", "");
    put_scene("set/b.yaml", "60", "");
    put("set/no-scene.yaml", "push_n: 1\n");
    assert_int_equal(run("check set --store base --as 1.0"), 0);
    assert_true(exists("base/1.0/set/a.golden.csv") && exists("base/1.0/set/b.golden-figures.csv"));
    assert_false(exists("set/a.golden.csv"));
    assert_int_equal(run("check set --store base --as 1.0"), 2);
    assert_non_null(strstr(output, "already holds a baseline"));
    assert_int_equal(run("check set --store base --as ../x"), 2);
    assert_int_equal(run("check set --against base/1.0"), 0);
    assert_int_equal(run("check set --against base/2.0"), 2);
    assert_non_null(strstr(output, "beside it are: 1.0"));
    // one changed, one gone, one new
    put_scene("set/a.yaml", "81", "");
    put_scene("set/c.yaml", "80", "");
    assert_int_equal(unlink(in_folder("set/b.yaml")), 0);
    assert_int_equal(run("check set --against base/1.0 --junit v.xml"), 2);
    Xml xml = read_junit("v.xml");
    assert_true(xml.cases == 3 && xml.failures == 1 && xml.errors == 1 && xml.skipped == 1);
    assert_non_null(strstr(output, "no longer exists"));
    assert_non_null(strstr(output, "is not in the baseline"));
}

static int times(const char *words)
{
    int count = 0;
    for (const char *at = output; (at = strstr(at, words)); at++)
        count++;
    return count;
}

// A scene with a golden run and `verify:` is read by both; a run that diverges has no path to compare, and no cases.
static void a_failure_has_one_message(void **state)
{
    (void)state;
#define VERIFY "verify: {elements: [10, 20, 40], cases: [{name: tip, quantity: position_mm, s_mm: end, axis: [1, 0, 0], reference: 1, tolerance: 1}]}\n"
    put_scene("once.yaml", "80", "");
    assert_int_equal(run("check --update once.yaml"), 0);
    put_scene("once.yaml", "-80", VERIFY);
    assert_int_equal(run("check once.yaml"), 2);
    assert_int_equal(times("'wire.sections[0].young_modulus_gpa' is -80"), 1);

    // a free wire, pulled so that a position cannot say where it is after a step
    put("gone.yaml",
        "seldinger: 1\nvessel: {tube: {radius_mm: 1.5, path: [{line_mm: 60}]}}\nwire: {elements: 20, sections: [{length_mm: 40, diameter_mm: 0.36, "
        "young_modulus_gpa: 80}]}\nrig: {start_mm: [1, 0, 0], direction: [1, 0, 0], loads: [{s_mm: 10, force_n: [1e6, 0, 0]}]}\n"
        "script: [[0, 0, 0], [0.05, 0, 0]]\n" VERIFY);
    char *golden = text_of(in_folder("once.golden.csv"));
    put("gone.golden.csv", golden);
    free(golden);
    assert_int_equal(run("check gone.yaml --json gone.json"), 3);
    assert_int_equal(times("gone.yaml: the run diverged at "), 1);
    assert_int_equal(times("gone.yaml: the run diverged with 10, 20, 40 elements"), 1);
    assert_int_equal(times("diverged"), 2);
    assert_int_equal(times("DIFFERS") + times("MISSED") + times("NOT MEASURED"), 0);
#undef VERIFY
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(figures_have_their_tolerances), cmocka_unit_test(bad_tolerances_are_refused_by_line),
        cmocka_unit_test(every_case_is_reported),        cmocka_unit_test(a_failure_has_one_message),
        cmocka_unit_test(threads_change_nothing),        cmocka_unit_test(baselines_compare_versions),
    };
    return cmocka_run_group_tests(tests, make_folder_with_cache, remove_folder);
}

// The verification table: every scene of scenes/verify passes, and the table can fail.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-verify-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"
#include "tests/short_run.h"

// The exit code of `check OPTIONS`; its output goes to `output`.
static int check(const char *options)
{
    char arguments[600];
    snprintf(arguments, sizeof arguments, "check %s", options);
    return run_in("", arguments);
}

static void write_scene(const char *name, const char *plan)
{
    FILE *file = fopen(in_folder(name), "w");
    assert_non_null(file);
    fprintf(file,
            "seldinger: 1\nwire:\n  sections: [{length_mm: 100, diameter_mm: 0.36, young_modulus_gpa: 80}]\n  damping: {mass_1_s: 50}\n"
            "rig: {fix: [{s_mm: 0, dof: all}], loads: [{s_mm: end, force_n: [0, 0, 0.03297918], ramp_s: 0.2}]}\n%s",
            plan);
    fclose(file);
}

static void every_case_passes(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    // without the golden paths, which another test checks
    char command[600];
    snprintf(command, sizeof command, "cp -r '" SOURCE_DIR "/scenes/verify' '%s' && rm -f '%s'/verify/*.golden.csv", folder, folder);
    assert_int_equal(system(command), 0);
    int code = check("verify");
    puts(output);
    assert_int_equal(code, 0);
}

#define DEFLECTION "{name: w/L, quantity: position_mm, s_mm: end, axis: [0, 0, 1], scale: 100, "

static void a_missed_tolerance_fails(void **state)
{
    (void)state;
    write_scene("a.yaml", "verify: {elements: [5, 10], cases: [" DEFLECTION "reference: 0.71379152, tolerance_percent: 0.14, order: 3, floor: 1.0e-6}]}\n");
    assert_int_equal(check("a.yaml"), 0);
    write_scene("a.yaml", "verify: {elements: [5, 10], cases: [" DEFLECTION "reference: 0.7148, tolerance_percent: 0.14}]}\n");
    assert_int_equal(check("--quiet a.yaml"), 1);
    assert_non_null(strstr(output, "MISSED"));
}

static void a_missed_order_fails(void **state)
{
    (void)state;
    // with a reference that is 0.0005 off, the error does not fall, although all tolerances are met
    write_scene("a.yaml", "verify: {elements: [5, 10], cases: [" DEFLECTION "reference: 0.71429, tolerance_percent: 0.14, order: 1.8}]}\n");
    assert_int_equal(check("a.yaml"), 1);
    assert_non_null(strstr(output, "ORDER"));
    assert_null(strstr(output, "MISSED"));
}

static void what_was_not_measured_fails(void **state)
{
    (void)state;
    write_scene("a.yaml", "verify: {elements: [5], duration_s: 0.1, cases: [" DEFLECTION "t_s: 0.2, reference: 0, tolerance: 1}]}\n");
    assert_int_equal(check("a.yaml"), 1);
    assert_non_null(strstr(output, "NOT MEASURED"));
    write_scene("a.yaml", "verify: {elements: [5], rest_s: 0.25, cases: [" DEFLECTION "reference: 0, tolerance: 1}]}\n");
    assert_int_equal(check("a.yaml"), 1);
    assert_non_null(strstr(output, "not at rest"));
}

static void bad_input_is_reported(void **state)
{
    (void)state;
    write_scene("a.yaml", "verify: {elements: [5], cases: [" DEFLECTION "tolerance: 1}]}\n");
    assert_int_equal(check("a.yaml"), 2);
    assert_non_null(strstr(output, "a.yaml:6:33: 'verify.cases[0]' has no key 'reference'"));
    write_scene("a.yaml", "");
    assert_int_equal(check("a.yaml"), 2);
    assert_non_null(strstr(output, "no key `verify:`"));
}

static void write_two_tools(const char *cases)
{
    char path[200];
    snprintf(path, sizeof path, "%s/two.yaml", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file,
            "seldinger: 1\ntools:\n"
            "  - {name: tube, kind: catheter, elements: 10, sections: [{length_mm: 60, diameter_mm: 1, inner_diameter_mm: 0.8, young_modulus_gpa: 2}]}\n"
            "  - {name: core, kind: wire, elements: 20, inserted_mm: 5, sections: [{length_mm: 120, diameter_mm: 0.5, young_modulus_gpa: 13}]}\n"
            "rig: {fix: [{s_mm: 0, dof: all}]}\nverify: {duration_s: 0.01, cases: [%s]}\n",
            cases);
    fclose(file);
}

static void a_case_names_its_tool(void **state)
{
    (void)state;
    // 5 mm of the core and all of the tube lie beyond the clamp
    write_two_tools("{name: core, tool: core, quantity: position_mm, s_mm: end, reference: 5, tolerance: 1.0e-6}, "
                    "{name: tube, tool: tube, quantity: position_mm, s_mm: end, reference: 60, tolerance: 1.0e-6}, "
                    "{name: first, quantity: position_mm, s_mm: 60, reference: 60, tolerance: 1.0e-6}, "
                    "{name: behind, tool: core, quantity: position_mm, s_mm: 100, axis: [1, 0, 0], reference: -15, tolerance: 1.0e-6}");
    assert_int_equal(check("two.yaml"), 0);
    write_two_tools("{name: x, tool: cor, quantity: position_mm, s_mm: end, reference: 5, tolerance: 1}");
    assert_int_equal(check("two.yaml"), 2);
    assert_non_null(strstr(output, "two.yaml:6:52: 'verify.cases[0].tool' is 'cor'; expected one of: tube, core"));
    write_two_tools("{name: x, tool: tube, quantity: position_mm, s_mm: 61, reference: 5, tolerance: 1}");
    assert_int_equal(check("two.yaml"), 2);
    assert_non_null(strstr(output, "at most 60"));
    write_two_tools(
        "{name: x, quantity: wall_force_n, s_mm: 3, reference: 5, tolerance: 1}, {name: y, tool: core, quantity: wall_force_n, reference: 5, tolerance: 1}");
    assert_int_equal(check("two.yaml"), 2);
    assert_non_null(strstr(output, "'wall_force_n' of several tools covers all of them"));
    assert_non_null(strstr(output, "'tool' has no effect here"));
}

static void threads_change_nothing(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    static char one[sizeof output];
    write_scene("a.yaml", "verify: {elements: [5, 10, 15, 20], cases: [" DEFLECTION "reference: 0.71379152, tolerance: 0.01}]}\n");
    assert_int_equal(check("--threads 1 a.yaml"), 0);
    strcpy(one, output);
    assert_int_equal(check("--threads 4 a.yaml"), 0);
    assert_string_equal(one, output);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_case_passes),           cmocka_unit_test(a_missed_tolerance_fails), cmocka_unit_test(a_missed_order_fails),
        cmocka_unit_test(what_was_not_measured_fails), cmocka_unit_test(bad_input_is_reported),    cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(a_case_names_its_tool),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

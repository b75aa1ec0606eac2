// Scripts: parsing, sampling, and the faults of broken ones with their positions.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/number_table.h"
#include "input/script.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// cmocka's own function compares in single precision
#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

static Faults faults;

static Script *parse(const char *text)
{
    faults_clear(&faults);
    return script_parse(text, strlen(text), "s.csv", NULL, &faults);
}

static void rows_hold_until_the_next(void **state)
{
    (void)state;
    Script *script = parse("# push, rest, turn\n\nt_s, push_mm_s ,twist_deg_s\n0.5,20,0\r\n1,0,0 \n1.5,-10,90\n2,7,7");
    assert_non_null(script);
    assert_int_equal(script->count, 4);
    assert_near(script_duration_s(script), 2, 0);
    int cursor = 0;
    const double time[] = {0, 0.499, 0.5, 0.999, 1, 1.499, 1.5, 1.999, 2, 100, 0.7};
    const double push[] = {0, 0, 20, 20, 0, 0, -10, -10, 0, 0, 20};
    for (size_t i = 0; i < sizeof time / sizeof *time; i++)
        assert_near(script_at(script, time[i], &cursor).push_mm_s, push[i], 0);
    assert_near(script_at(script, 1.7, &cursor).twist_deg_s, 90, 0);
    script_free(script);
}

static void every_millisecond_finds_its_row(void **state)
{
    (void)state;
    // a row at each millisecond: sampling at the times of steps, n/1000, must find each of them exactly
    static char text[200000];
    size_t used = (size_t)sprintf(text, "t_s,push_mm_s,twist_deg_s\n");
    for (int i = 0; i <= 5000; i++)
        used += (size_t)sprintf(text + used, "%d.%03d,%d,0\n", i / 1000, i % 1000, i % 900);
    Script *script = parse(text);
    assert_non_null(script);
    int cursor = 0;
    for (int i = 0; i < 5000; i++)
        assert_near(script_at(script, (double)i * 1.0 / 1000, &cursor).push_mm_s, i % 900, 0);
    script_free(script);
}

static void expect_fault(const char *text, const char *place, const char *words)
{
    Script *script = parse(text);
    char start[64];
    snprintf(start, sizeof start, "s.csv:%s: ", place);
    if (script || faults.count != 1 || strncmp(faults.text[0], start, strlen(start)) || !strstr(faults.text[0], words))
        fail_msg("<<%s>> gave %d faults, the first '%s'; expected %s … %s", text, faults.count, faults.count ? faults.text[0] : "", place, words);
}

#define HEADER "t_s,push_mm_s,twist_deg_s\n"
static void each_fault_has_its_place(void **state)
{
    (void)state;
    expect_fault("", "1:1", "empty");
    expect_fault("# nothing\n\n", "2:1", "empty");
    expect_fault(HEADER, "1:1", "no row");
    expect_fault("t_ms,push_mm_s,twist_deg_s\n0,1,1\n", "1:1", "t_s,push_mm_s,twist_deg_s");
    expect_fault("t_s,push_cm_s,twist_deg_s\n0,1,1\n", "1:5", "push_mm_s");
    expect_fault("t_s,push_mm_s\n0,1\n", "1:14", "twist_deg_s");
    expect_fault("t_s,push_mm_s,twist_deg_s,x\n0,1,1,1\n", "1:27", "twist_deg_s");
    expect_fault(HEADER "0,1\n1,0,0\n", "2:1", "2 fields");
    expect_fault(HEADER "0,1,0\n1,fast,0\n", "3:3", "'fast'");
    expect_fault(HEADER "0,1,nan\n1,0,0\n", "2:5", "'nan'");
    expect_fault(HEADER "0,1,0x10\n1,0,0\n", "2:5", "0x10");
    expect_fault(HEADER "0,1,1e999\n1,0,0\n", "2:5", "1e999");
    expect_fault(HEADER "0,1,0\n2,1,0\n1,0,0\n", "4:1", "does not follow 2");
    expect_fault(HEADER "0,1,0\n0,1,0\n", "3:1", "rising");
    expect_fault(HEADER "-1,1,0\n0,1,0\n", "2:1", "negative");
    expect_fault(HEADER "0,1001,0\n1,0,0\n", "2:1", "push_mm_s");
    expect_fault(HEADER "0,1,-36001\n1,0,0\n", "2:1", "twist_deg_s");
    expect_fault(HEADER "0,1,0\n1e6,0,0\n", "3:1", "too late");
    expect_fault(HEADER "0,1,0\n", "2:1", "expected another row with a later time");
}

static void all_faults_come_in_one_pass(void **state)
{
    (void)state;
    assert_null(parse(HEADER "0,x,y\n1\n2,3,z\n"));
    assert_int_equal(faults.count, 4);
    assert_null(parse(HEADER "5,2000,0\n4,0,40000\n3,0,0\n"));
    assert_int_equal(faults.count, 4);
}

static void a_file_that_is_none_is_reported(void **state)
{
    (void)state;
    faults_clear(&faults);
    assert_null(script_load("/nowhere/s.csv", NULL, &faults));
    assert_null(script_load("/dev/zero", NULL, &faults));
    assert_null(script_load("/", NULL, &faults));
    assert_int_equal(faults.count, 3);
    assert_non_null(strstr(faults.text[0], "/nowhere/s.csv"));
}

static void numbers_are_decimal_and_finite(void **state)
{
    (void)state;
    double value;
    const char *good[] = {"1", "-1.5", "+2", ".5", "5.", "1e3", "1E-3"}, *bad[] = {"", " 1", "1 ", "1.2.3", "e5", "-", "0x1", "inf", "1e400", "1,5", "--1"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        assert_true(number_of_text(good[i], strlen(good[i]), &value));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_false(number_of_text(bad[i], strlen(bad[i]), &value));
}

static void a_hand_lets_go(void **state)
{
    (void)state;
    Script *script = parse("t_s,push_mm_s,twist_deg_s,released\n0,20,0,0\n1,0,0,1\n2,5,0,0\n3,0,0,1\n");
    assert_non_null(script);
    int cursor = 0;
    assert_int_equal(script_tools_at(script, 0.5, &cursor).released, 0);
    assert_int_equal(script_tools_at(script, 1.5, &cursor).released, 1);
    assert_int_equal(script_tools_at(script, 2.5, &cursor).released, 0);
    assert_int_equal(script_tools_at(script, 3.5, &cursor).released, 0);   // the last row ends the script
    script_free(script);
    const ToolNames tools = {.count = 3, .name = {"guide", "micro", "wire"}};
    static const char named[] = "t_s,wire.released,guide.push_mm_s,guide.twist_deg_s,guide.released\n0,1,2,3,0\n1,0,0,0,1\n2,0,0,0,0\n";
    script = script_parse(named, strlen(named), "s.csv", &tools, &faults);
    assert_non_null(script);
    ToolCommands commands = script_tools_at(script, 0.5, &cursor);
    assert_true(commands.released == 4 && commands.tool[0].push_mm_s == 2 && commands.tool[2].push_mm_s == 0);
    assert_int_equal(script_tools_at(script, 1.5, &cursor).released, 1);
    script_free(script);
    // an exchanged device stays in after the script's end
    static const char exchange[] = "t_s,wire.push_mm_s,wire.twist_deg_s,wire.exchange\n0.5,5,0,0\n1,5,0,2\n2,5,0,1\n";
    script = script_parse(exchange, strlen(exchange), "s.csv", &tools, &faults);
    assert_non_null(script);
    assert_int_equal(script_tools_at(script, 0.2, &cursor).fitted[2], 0);
    assert_int_equal(script_tools_at(script, 1.5, &cursor).fitted[2], 2);
    commands = script_tools_at(script, 3, &cursor);
    assert_true(commands.fitted[2] == 1 && commands.fitted[0] == 0 && commands.tool[2].push_mm_s == 0);
    script_free(script);
    expect_fault("t_s,push_mm_s,twist_deg_s,released\n0,1,0,0.5\n1,0,0,0\n", "2:1", "released is 0.5; expected 0 (the tool is held)");
    expect_fault("t_s,push_mm_s,twist_deg_s,released\n0,1,0,-1\n1,0,0,0\n", "2:1", "released is -1");
    expect_fault("t_s,push_mm_s,released,twist_deg_s\n0,1,0,0\n1,0,0,0\n", "1:15", "twist_deg_s");
}

static void one_injector_goes_through_one_tool(void **state)
{
    (void)state;
    const ToolNames tools = {.count = 3, .name = {"guide", "micro", "wire"}};
    static const char named[] = "t_s,guide.contrast_ml_s,micro.contrast_ml_s\n0,3,0\n1,0,0.5\n2,0,0\n3,1,0\n",
                      both[] = "t_s,guide.contrast_ml_s,micro.contrast_ml_s\n0,3,1\n1,51,0\n2,-1,0\n";
    int cursor = 0;
    Script *script = script_parse(named, strlen(named), "s.csv", &tools, &faults);
    assert_non_null(script);
    const double at[] = {0.5, 1.5, 2.5, 3.5}, rate[] = {3, 0.5, 0, 0};
    const int tool[] = {1, 2, 0, 0};
    for (int i = 0; i < 4; i++) {
        ToolCommands commands = script_tools_at(script, at[i], &cursor);
        assert_true(!(commands.contrast_ml_s < rate[i]) && !(commands.contrast_ml_s > rate[i]) && commands.contrast_tool == tool[i]);
    }
    script_free(script);
    faults_clear(&faults);
    assert_null(script_parse(both, strlen(both), "s.csv", &tools, &faults));
    assert_int_equal(faults.count, 3);
    assert_non_null(strstr(faults.text[0], "2 tools at once"));
    assert_non_null(strstr(faults.text[1], "contrast_ml_s 51 is out of range; expected 0 to 50"));
    assert_non_null(strstr(faults.text[2], "contrast_ml_s -1 is out of range"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_hold_until_the_next),
        cmocka_unit_test(every_millisecond_finds_its_row),
        cmocka_unit_test(each_fault_has_its_place),
        cmocka_unit_test(all_faults_come_in_one_pass),
        cmocka_unit_test(a_file_that_is_none_is_reported),
        cmocka_unit_test(numbers_are_decimal_and_finite),
        cmocka_unit_test(a_hand_lets_go),
        cmocka_unit_test(one_injector_goes_through_one_tool),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

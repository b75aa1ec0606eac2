// The marks of a recording made by hand: each at its time, in order, and found from any moment; and the beginning of the score's clock.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/sim.h"

#include <math.h>
#include <string.h>

enum { STEPS = 1000 };
static double time_s[STEPS], command[2 * STEPS];
static XrayControl xray[STEPS];
static RecordedRun run = {.step_count = STEPS, .time_s = time_s, .xray = xray, .tool_count = 2, .step_ms = 2};

// 2 ms a step: the pedal is down in steps 100 to 199 and to the end from 900; contrast agent flows in 150 to 249; bookmarks at steps 300 and 700.
static int fill(void **state)
{
    (void)state;
    for (int i = 0; i < STEPS; i++) {
        time_s[i] = 0.002 * (i + 1);
        xray[i].pedal = (i >= 100 && i < 200) || i >= 900;
        xray[i].contrast_ml_s = i >= 150 && i < 250 ? 3 : 0;
        xray[i].bookmark = (float)((i >= 300) + (i >= 700));
    }
    command[2 * 60 + 1] = -5;
    run.tool[0] = (RecordedTool){.name = "catheter", .command = command};
    run.tool[1] = (RecordedTool){.name = "wire", .command = command};
    return 0;
}

static const ScoreEvent event[] = {{ERROR_KICK, 1, 1.5}, {ERROR_BLIND, -1, 0.4}};

static void marks_are_at_their_times(void **state)
{
    (void)state;
    static const struct {
        RunMarkKind kind;
        double time_s;
        const char *text;
    } expected[] = {{RUN_MARK_INJECTION, 0.302, "0.30 s: injection 1, 0.6 ml requested in 0.2 s"},
                    {RUN_MARK_ERROR, 0.4, "0.40 s: tool moved without X-rays"},
                    {RUN_MARK_BOOKMARK, 0.602, "0.60 s: bookmark 1"},
                    {RUN_MARK_BOOKMARK, 1.402, "1.40 s: bookmark 2"},
                    {RUN_MARK_ERROR, 1.5, "1.50 s: tip jumped while its hand rested (wire)"},
                    {RUN_MARK_TARGET, 1.9, "1.90 s: target held"}};
    enum { COUNT = sizeof expected / sizeof expected[0] };
    RunMarks marks;
    char text[200];
    assert_true(run_marks_make(&marks, &run, event, 2, 1.9));
    assert_int_equal(marks.count, COUNT);
    for (int i = 0; i < COUNT; i++) {
        assert_int_equal(marks.mark[i].kind, expected[i].kind);
        assert_true(fabs(marks.mark[i].time_s - expected[i].time_s) < 1e-9);
        run_mark_text(&marks, i, words_english, text, sizeof text);
        assert_string_equal(text, expected[i].text);
    }
    assert_int_equal(marks.xray_count, 2);
    assert_true(fabs(marks.xray[0].from_s - 0.2) < 1e-9 && fabs(marks.xray[0].to_s - 0.4) < 1e-9);
    assert_true(fabs(marks.xray[1].from_s - 1.8) < 1e-9 && fabs(marks.xray[1].to_s - 2) < 1e-9);
    // walked forwards and backwards, each is visited once
    int visited = 0;
    double at = 0;
    for (int i; (i = run_marks_after(&marks, at)) >= 0; at = marks.mark[i].time_s)
        assert_int_equal(i, visited++);
    assert_int_equal(visited, COUNT);
    for (int i; (i = run_marks_before(&marks, at)) >= 0; at = marks.mark[i].time_s)
        assert_int_equal(i, --visited - 1);
    assert_int_equal(visited, 1);                // it began on the last one
    assert_int_equal(run_marks_at(&marks, 1.5), 4);
    assert_int_equal(run_marks_at(&marks, 1.501), -1);
    run_marks_free(&marks);
}

static void a_run_without_a_viewer_has_only_its_errors(void **state)
{
    (void)state;
    RecordedRun plain = run;
    RunMarks marks;
    plain.xray = NULL;
    assert_true(run_marks_make(&marks, &plain, event, 2, 0));
    assert_int_equal(marks.count, 2);
    assert_int_equal(marks.xray_count, 0);
    assert_int_equal(marks.mark[0].error, ERROR_BLIND);
    run_marks_free(&marks);
}

static void the_clock_begins_with_the_first_action(void **state)
{
    (void)state;
    assert_true(fabs(run_first_action_s(&run) - 0.12) < 1e-9);       // the twist, before the pedal
    command[2 * 60 + 1] = 0;
    assert_true(fabs(run_first_action_s(&run) - 0.2) < 1e-9);
    RecordedRun plain = run;
    plain.xray = NULL;
    assert_true(run_first_action_s(&plain) == time_s[STEPS - 1]);    // nothing happens
    command[2 * 60 + 1] = -5;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(marks_are_at_their_times), cmocka_unit_test(a_run_without_a_viewer_has_only_its_errors),
                                       cmocka_unit_test(the_clock_begins_with_the_first_action)};
    return cmocka_run_group_tests(tests, fill, NULL);
}

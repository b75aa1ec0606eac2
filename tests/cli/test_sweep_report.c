// `sweep --report` on a folder of results: the page, and what is said of folders that hold no finished sweep.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-sweep-report-XXXXXX";
#include "tests/folder.h"

#include "tests/cli/program.h"

static int run(const char *arguments) { return run_in("", arguments); }

static void a_finished_sweep_is_reported(void **state)
{
    (void)state;
    char command[800];
    snprintf(command, sizeof command, "mkdir '%s/res' && cp '" SOURCE_DIR "/tests/fuzz/corpus/sweep_results/table.csv' '%s/res'", folder, folder);
    assert_int_equal(system(command), 0);
    put("res/spec.yaml", "sweep: 1\nscene: a.yaml # <kept>\n");
    assert_int_equal(run("sweep my/spec.yaml --report res"), 0);
    assert_non_null(strstr(output, "res/report.html"));
    char *page = text_of(in_folder("res/report.html"));
    assert_non_null(strstr(page, "16: 13 done, 1 diverged, 1 left, 1 failed"));
    assert_non_null(strstr(page, "seldinger sweep my/spec.yaml --run 7 -o run-7"));
    assert_non_null(strstr(page, "scene: a.yaml # &lt;kept&gt;"));
    free(page);
    assert_int_equal(run("sweep --report res --quiet"), 0);
    assert_string_equal(output, "");
}

static void unfinished_and_broken_ones_are_refused(void **state)
{
    (void)state;
    assert_int_equal(run("sweep --report nowhere"), 2);
    assert_non_null(strstr(output, "nowhere: has no table"));
    assert_int_equal(run("sweep --report res --dry-run"), 2);
    assert_int_equal(run("sweep"), 2);
    put("res/table.csv", "run,k,status,message\n0,1,fine,\n");
    assert_int_equal(unlink(in_folder("res/report.html")), 0);
    assert_int_equal(run("sweep --report res"), 2);
    assert_non_null(strstr(output, "res/table.csv:2: status is 'fine'"));
    assert_int_equal(access(in_folder("res/report.html"), F_OK), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_finished_sweep_is_reported), cmocka_unit_test(unfinished_and_broken_ones_are_refused)};
    return cmocka_run_group_tests(tests, make_folder_with_cache, remove_folder);
}

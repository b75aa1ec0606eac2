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
    assert_non_null(strstr(page, "<p class=\"notice\">Few runs. 13 runs are done"));
    assert_non_null(strstr(page, "scene: a.yaml # &lt;kept&gt;"));
    free(page);
    assert_int_equal(run("sweep --report res --quiet"), 0);
    assert_string_equal(output, "");
}

static int pictures_of(const char *name)
{
    char *page = text_of(in_folder(name));
    int pictures = 0;
    for (const char *at = strstr(page, "<article"); at; at = strstr(at + 1, "<article"))
        pictures += strstr(at, "<svg") != NULL && strstr(at, "<svg") < strstr(at, "</article>");
    free(page);
    return pictures;
}

// The command beside a worst run, as it stands on the page, repeats it. Runs that were not recorded are, for their pictures, unless they end in another state.
static void the_commands_of_a_page_repeat(void **state)
{
    (void)state;
    char *scene = text_of(SOURCE_DIR "/scenes/sweep/tube-scene.yaml"), command[200] = "";
    put("tube-scene.yaml", scene);
    put("tube.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary: {vessel.friction: {uniform: [0, 0.1]}}\nduration_s: 0.1\n"
                     "sampling: {kind: sobol, runs: 12}\n");
    free(scene);
    assert_int_equal(run("sweep tube.yaml -o tube --quiet"), 0);
    assert_int_equal(run("sweep --report tube"), 0);
    assert_int_equal(pictures_of("tube/report.html"), 0);
    put("other.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary: {vessel.friction: {uniform: [0, 0.2]}}\nduration_s: 0.1\n"
                      "sampling: {kind: sobol, runs: 12}\n");
    assert_int_equal(run("sweep other.yaml --report tube"), 0);
    assert_non_null(strstr(output, "now ends in another state than in the table"));
    assert_int_equal(pictures_of("tube/report.html"), 0);
    assert_int_equal(run("sweep tube.yaml --report tube"), 0);
    assert_int_equal(pictures_of("tube/report.html"), 10);
    char *page = text_of(in_folder("tube/report.html"));
    assert_int_equal(sscanf(strstr(page, "seldinger sweep tube.yaml --run "), "seldinger %199[^<\n]", command), 1);
    assert_int_equal(run(command), 0);
    int number = atoi(strstr(command, "--run ") + 6);
    char row[40];
    snprintf(row, sizeof row, "{\"run\":%d,", number);
    char *journal = text_of(in_folder("tube/journal.txt")), *kept = strstr(journal, row), hash[64] = "";
    assert_int_equal(sscanf(strstr(kept, "\"state_hash\""), "\"state_hash\":\"%60[0-9a-f]", hash), 1);
    assert_non_null(strstr(output, hash));
    free(journal);
    free(page);
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_finished_sweep_is_reported), cmocka_unit_test(the_commands_of_a_page_repeat),
                                       cmocka_unit_test(unfinished_and_broken_ones_are_refused)};
    return cmocka_run_group_tests(tests, make_folder_with_cache, remove_folder);
}

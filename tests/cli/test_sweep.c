// `seldinger sweep`: the same table with any number of threads, under mpirun, and after five kills; what goes wrong is said and nothing is lost.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-sweep-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"
#include "tests/cli/sweep_files.h"

// 24 runs of 0.3 s of simulated time.
static const char spec[] =
    "sweep: 1\nscene: tube-scene.yaml\nvary:\n  wire.sections[0].young_modulus_gpa: {loguniform: [5, 200]}\n  vessel.friction: {uniform: [0, 0.15]}\n"
    "  wire.elements: {values: [20, 40]}\nhands: {seed: 5, duration_s: 0.3}\nsampling: {kind: sobol, runs: 24}\nkeep: {score: true, recordings: failures}\n";

static int make_files(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    put_scene_of_tube();
    put("spec.yaml", spec);
    return run_in("", "sweep spec.yaml -o one --threads 1 --quiet");
}

static void same_bytes(const char *other)
{
    char command[400];
    same_file("one/table.csv", other);
    snprintf(command, sizeof command, "cd '%s' && cmp one/table.h5 $(dirname %s)/table.h5", folder, other);
    assert_int_equal(system(command), 0);
}

static void threads_give_the_same_table(void **state)
{
    (void)state;
    assert_int_equal(lines_of("one/table.csv"), 25);
    assert_int_equal(run_in("", "sweep spec.yaml -o three --threads 3"), 0);
    assert_non_null(strstr(output, "24 of 24 runs: 24 done"));
    same_bytes("three/table.csv");
    same_file("one/spec.yaml", "spec.yaml");
}

static void ranks_give_the_same_table(void **state)
{
    (void)state;
    skip_without_mpirun();
    for (int ranks = 2; ranks <= 4; ranks += 2) {
        char before[300], arguments[80], table[40];
        snprintf(before, sizeof before, "%s -n %d", mpirun, ranks);
        snprintf(arguments, sizeof arguments, "sweep spec.yaml -o ranks%d", ranks);
        snprintf(table, sizeof table, "ranks%d/table.csv", ranks);
        if (run_in(before, arguments) != 0)
            fail_msg("%s", output);
        same_bytes(table);
    }
    // every rank ends, with one message
    char before[300];
    snprintf(before, sizeof before, "%s -n 2", mpirun);
    assert_int_equal(run_in(before, "sweep missing.yaml -o ranks"), 2);
    assert_non_null(strstr(output, "missing.yaml: cannot be opened"));
    assert_null(strstr(strstr(output, "missing.yaml: cannot be opened") + 1, "missing.yaml: cannot be opened"));
}

// Starts the sweep and kills it once it has written `results` more lines.
static void kill_after(const char *name, int results)
{
    char path[120], journal[60];
    snprintf(path, sizeof path, "%s", in_folder(name));
    snprintf(journal, sizeof journal, "%s/journal.txt", name);
    int before = lines_of(journal);
    pid_t child = fork();
    if (child == 0) {
        if (chdir(folder) == 0)
            execl(SELDINGER_PROGRAM, "seldinger", "sweep", "spec.yaml", "-o", path, "--threads", "2", "--quiet", (char *)NULL);
        _exit(127);
    }
    for (int i = 0; i < 6000 && waitpid(child, NULL, WNOHANG) == 0; i++, pause_ms(5))
        if (lines_of(journal) >= before + results)
            kill(child, SIGKILL);
    assert_true(lines_of(journal) >= before + results);
}

static void five_kills_lose_only_runs_in_flight(void **state)
{
    (void)state;
    for (int i = 0; i < 5; i++)
        kill_after("killed", 3);
    int kept = lines_of("killed/journal.txt") - 1;
    assert_true(kept >= 14 && kept < 24);
    assert_true(access(in_folder("killed/table.csv"), F_OK) != 0);
    char words[80];
    snprintf(words, sizeof words, "%d of them from before", kept);
    assert_int_equal(run_in("", "sweep spec.yaml -o killed"), 0);
    assert_non_null(strstr(output, words));
    same_bytes("killed/table.csv");
}

// The row of a run and the summary of its repetition have the same last state, and `run` makes it from the written files.
static void a_run_is_repeated(void **state)
{
    (void)state;
    assert_int_equal(run_in("", "sweep spec.yaml --run 7 -o seventh --quiet"), 0);
    char *summary = text_of(in_folder("seventh/summary.json")), *table = text_of(in_folder("one/table.csv")), hash[17] = "";
    const char *at = strstr(summary, "\"state_hash\":");
    assert_non_null(at);
    sscanf(at, "\"state_hash\": \"%16[0-9a-f]\"", hash);
    assert_int_equal(strlen(hash), 16);
    const char *row = strstr(table, "\n7,");
    assert_non_null(row);
    const char *found = strstr(row, hash);
    assert_true(found && found < strchr(row + 1, '\n'));
    assert_int_equal(run_in("", "run seventh/scene.yaml --quiet --summary -"), 0);
    assert_non_null(strstr(output, hash));
    assert_int_equal(run_in("", "replay seventh/recording.h5 --verify"), 0);
    free(summary);
    free(table);
    refused("sweep spec.yaml --run 24 -o seventh", "has 24 runs; expected --run 0 to 23");
}

// A tool that begins outside the tube has left it: the sweep goes on. An insertion that is too long only together with two short sections is refused.
static void bad_runs_are_rows(void **state)
{
    (void)state;
    put("left.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary: {sheath.entry_mm: {values: [[0, 0, 0], [0, 4, 0]]}}\nduration_s: 0.02\nsampling: grid\n"
                     "keep: {figures: [steps, flags], recordings: failures}\n");
    put("short.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary:\n  sheath.inserted_mm: {values: [5, 15]}\n  wire.sections[0].length_mm: {values: [60, 8]}\n"
                      "  wire.sections[1].length_mm: {values: [20, 4]}\nduration_s: 0.02\nsampling: grid\nkeep: {figures: [steps, flags]}\n");
    if (run_in("", "sweep left.yaml -o left") != 0)
        fail_msg("%s", output);
    assert_non_null(strstr(output, "2 of 2 runs: 1 done, 0 diverged, 1 left the vessel, 0 failed"));
    refused("sweep short.yaml -o short",
            "short.yaml:4:23: with sheath.inserted_mm: 15 and wire.sections[0].length_mm: 8 and wire.sections[1].length_mm: 4 the scene "
            "is wrong: tube-scene.yaml:14:66: 'sheath.inserted_mm' is 15, out of range;");
    char *table = text_of(in_folder("left/table.csv"));
    assert_non_null(strstr(table, "\n1,\"[0, 4, 0]\",left,\"the tool left the vessel, 2.680 mm outside the wall\","));
    free(table);
    assert_int_equal(access(in_folder("left/recordings/1.h5"), R_OK), 0);
    assert_int_not_equal(access(in_folder("left/recordings/0.h5"), R_OK), 0);
    assert_int_equal(run_in("", "replay left/recordings/1.h5 --verify"), 0);
}

static void bad_input_is_refused(void **state)
{
    (void)state;
    put("key.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary:\n  wire.sections[0].young: {values: [1]}\n  wire.sections[7].friction: {values: [1]}\n"
                    "  vessel.friction: {uniform: [0, 11]}\nsampling: {kind: random, runs: 3}\n");
    refused("sweep key.yaml -o r", "key.yaml:4:27: with wire.sections[0].young: 1 the scene is wrong: tube-scene.yaml:");
    assert_non_null(strstr(output, "key.yaml:5:30: the scene has no place 'wire.sections[7].friction'"));
    assert_non_null(strstr(output, "key.yaml:6:20: with vessel.friction: 11 the scene"));
    put("many.yaml",
        "sweep: 1\nscene: tube-scene.yaml\nvary: {vessel.friction: {uniform: [0, 1]}}\nduration_s: 0.01\nsampling: {kind: random, runs: 1000000000}\n");
    refused("sweep many.yaml -o r", "has 1000000000 runs; expected at most 10000000");
    assert_int_equal(run_in("", "sweep many.yaml --dry-run"), 0);
    assert_non_null(strstr(output, "many.yaml: 1000000000 runs of 1 scene"));
    assert_non_null(strstr(output, "days on"));
    refused("sweep spec.yaml", "-o RESULTS");
    refused("sweep spec.yaml -o tube-scene.yaml/r", "cannot be created");
    put("changed.yaml", "sweep: 1\nscene: tube-scene.yaml\nhands: {seed: 6, duration_s: 0.3}\nsampling: {kind: sobol, runs: 24}\n");
    refused("sweep changed.yaml -o one", "the specification was");
    assert_int_equal(access(in_folder("r"), F_OK), -1);
}

static void two_sweeps_into_one_folder(void **state)
{
    (void)state;
    char command[1000];
    snprintf(command, sizeof command,
             "cd '%s' && { %s sweep spec.yaml -o both --threads 1 --quiet & sleep 0.05; while [ ! -s both/journal.txt ]; do sleep 0.01; done; "
             "%s sweep spec.yaml -o both --quiet 2>both.txt; code=$?; wait; exit $code; }",
             folder, SELDINGER_PROGRAM, SELDINGER_PROGRAM);
    int status = system(command);
    assert_int_equal(WEXITSTATUS(status), 2);
    char *text = text_of(in_folder("both.txt"));
    assert_non_null(strstr(text, "both: another sweep is writing to it (process "));
    free(text);
    same_bytes("both/table.csv");
}

// On a file system of 32 kB the journal does not fit: what is on it stays sound, and with more room the same command goes on.
static void a_full_disk_loses_nothing(void **state)
{
    (void)state;
    assert_int_equal(mkdir(in_folder("small"), 0755), 0);
    if (mount("none", in_folder("small"), "tmpfs", 0, "size=32k") != 0) {
        print_message("skipped: a small file system cannot be mounted here\n");
        skip();
    }
    int code = run_in("", "sweep spec.yaml -o small/r --quiet");
    bool is_said = strstr(output, "small/r/journal.txt: cannot be written: No space left on device") && strstr(output, "the same command goes on");
    int kept = lines_of("small/r/journal.txt") - 1;
    bool grows = mount("none", in_folder("small"), "tmpfs", MS_REMOUNT, "size=4m") == 0;
    int again = run_in("", "sweep spec.yaml -o small/r");
    char words[80];
    snprintf(words, sizeof words, "%d of them from before", kept);
    bool goes_on = strstr(output, words);
    if (again == 0)
        same_bytes("small/r/table.csv");
    umount(in_folder("small"));
    assert_int_equal(code, 2);
    assert_true(is_said && kept > 2 && kept < 24 && grows && goes_on);
    assert_int_equal(again, 0);
}

static void growth_is_forecast(void **state)
{
    (void)state;
    assert_int_equal(run_in("", "sweep spec.yaml -o one --simulate-ranks 1000"), 0);
    assert_non_null(strstr(output, "SIMULATED: 100000 runs with the measured times of 24 in turn"));
    assert_non_null(strstr(output, "\n   1000 "));
    assert_int_equal(run_in("", "sweep spec.yaml -o nothing --simulate-ranks 8"), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_give_the_same_table), cmocka_unit_test(ranks_give_the_same_table), cmocka_unit_test(five_kills_lose_only_runs_in_flight),
        cmocka_unit_test(a_run_is_repeated),           cmocka_unit_test(bad_runs_are_rows),         cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(two_sweeps_into_one_folder),  cmocka_unit_test(a_full_disk_loses_nothing), cmocka_unit_test(growth_is_forecast),
    };
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}

// What a killed rank loses: the runs in flight, at most one for each rank. The same command goes on to the same bytes.
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
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-sweep-ranks-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"
#include "tests/cli/sweep_files.h"

enum { RANKS = 4, RUNS = 64, BEFORE = 12 };
static const char spec[] = "sweep: 1\nscene: tube-scene.yaml\nvary: {vessel.friction: {uniform: [0, 0.15]}}\nhands: {seed: 5, duration_s: 0.3}\n"
                           "sampling: {kind: sobol, runs: 64}\n";

static int make_files(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    put_scene_of_tube();
    put("spec.yaml", spec);
    return run_in("", "sweep spec.yaml -o one --quiet");
}

// Of each run whether the journal has its result. Returns their number.
static int results_in(const char *journal, bool has[RUNS])
{
    char *text = text_of(in_folder(journal));
    int count = 0;
    memset(has, 0, RUNS);
    for (const char *at = text; (at = strstr(at, "\n{\"run\":")); at++) {
        int run = atoi(at + 8);
        assert_true(run >= 0 && run < RUNS && !has[run]);
        has[run] = true;
        count++;
    }
    free(text);
    return count;
}

static pid_t pid_of_rank(int rank)
{
    char name[20];
    snprintf(name, sizeof name, "rank%d", rank);
    char *text = text_of(in_folder(name));
    pid_t pid = (pid_t)atol(text);
    free(text);
    assert_true(pid > 1);
    return pid;
}

// Kills a rank of a sweep into `name` with SIGKILL once the journal has BEFORE results, and waits until mpirun has ended the others.
static void kill_rank(const char *name, int rank)
{
    char command[1200], journal[60];
    snprintf(command, sizeof command,
             "cd '%s' && exec env %s -n %d sh -c 'echo $$ >rank$OMPI_COMM_WORLD_RANK; exec %s sweep spec.yaml -o %s --quiet' >%s.txt 2>&1", folder, mpirun,
             RANKS, SELDINGER_PROGRAM, name, name);
    snprintf(journal, sizeof journal, "%s/journal.txt", name);
    pid_t child = fork();
    if (child == 0) {
        execl("/bin/sh", "sh", "-c", command, (char *)NULL);
        _exit(127);
    }
    bool has_ended = false;
    for (int i = 0; i < 12000 && !has_ended && lines_of(journal) <= BEFORE; i++, pause_ms(5))
        has_ended = waitpid(child, NULL, WNOHANG) != 0;
    assert_false(has_ended);
    int status, before = lines_of(journal) - 1;
    assert_int_equal(kill(pid_of_rank(rank), SIGKILL), 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) != 0);
    for (int r = 0; r < RANKS; r++) {        // mpirun tells the others to end, and does not wait for it
        int waits = 0;
        while (kill(pid_of_rank(r), 0) == 0 && waits++ < 4000)
            pause_ms(5);
        assert_true(waits < 4000);
    }

    // the runs are given out in order: those before the last finished one that have no result were in flight
    bool has[RUNS];
    int kept = results_in(journal, has), last = 0, missing = 0;
    for (int run = 0; run < RUNS; run++)
        last = has[run] ? run : last;
    for (int run = 0; run < last; run++)
        missing += !has[run];
    print_message("rank %d of %d killed: %d results before, %d after; %d runs below the last finished one (%d) without a result, at most %d in flight\n", rank,
                  RANKS, before, kept, missing, last, RANKS);
    assert_true(kept >= before && missing < RANKS);
}

static void goes_on(const char *name, bool under_mpirun)
{
    char arguments[80], table[60], words[80], journal[60], before[300];
    bool has[RUNS];
    snprintf(journal, sizeof journal, "%s/journal.txt", name);
    snprintf(words, sizeof words, "%d of them from before", results_in(journal, has));
    snprintf(arguments, sizeof arguments, "sweep spec.yaml -o %s", name);
    snprintf(before, sizeof before, "%s -n 2", mpirun);
    if (run_in(under_mpirun ? before : "", arguments) != 0 || !strstr(output, words) || strstr(output, "damaged"))
        fail_msg("%s (expected: %s)", output, words);
    snprintf(table, sizeof table, "%s/table.csv", name);
    same_file("one/table.csv", table);
    char command[400];
    snprintf(command, sizeof command, "cd '%s' && cmp one/table.h5 %s/table.h5", folder, name);
    assert_int_equal(system(command), 0);
}

static void a_worker_is_killed(void **state)
{
    (void)state;
    skip_without_mpirun();
    kill_rank("worker", 2);
    goes_on("worker", true);
}

static void the_manager_is_killed(void **state)
{
    (void)state;
    skip_without_mpirun();
    kill_rank("manager", 0);
    goes_on("manager", false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_worker_is_killed), cmocka_unit_test(the_manager_is_killed)};
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}

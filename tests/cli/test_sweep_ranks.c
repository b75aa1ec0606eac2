// What a killed rank or a killed mpirun loses: the runs in flight, at most one for each rank. The same command goes on to the same bytes.
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

// Starts a sweep into `name` under mpirun and waits until the journal has BEFORE results. Returns mpirun's process and the number of results.
static pid_t begin_sweep(const char *name, int *before)
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
    *before = lines_of(journal) - 1;
    return child;
}

// Waits until no rank is left; mpirun does not. Returns the time [ms].
static int wait_for_ranks(void)
{
    int waits = 0;
    for (int r = 0; r < RANKS; r++)
        while (kill(pid_of_rank(r), 0) == 0 && waits < 4000) {
            pause_ms(5);
            waits++;
        }
    if (waits == 4000)
        fail_msg("a rank is still there after 20 s");
    return waits * 5;
}

static void report_loss(const char *name, const char *killed, int before)
{
    char journal[60];
    snprintf(journal, sizeof journal, "%s/journal.txt", name);

    // the runs are given out in order: those before the last finished one that have no result were in flight
    bool has[RUNS];
    int kept = results_in(journal, has), last = 0, missing = 0;
    for (int run = 0; run < RUNS; run++)
        last = has[run] ? run : last;
    for (int run = 0; run < last; run++)
        missing += !has[run];
    print_message("%s of %d killed: %d results before, %d after; %d runs below the last finished one (%d) without a result, at most %d in flight\n", killed,
                  RANKS, before, kept, missing, last, RANKS);
    assert_true(kept >= before && missing < RANKS);
}

// Kills a rank with SIGKILL; mpirun ends the others.
static void kill_rank(const char *name, int rank)
{
    char killed[20];
    int status, before;
    pid_t child = begin_sweep(name, &before);
    assert_int_equal(kill(pid_of_rank(rank), SIGKILL), 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) != 0);
    wait_for_ranks();
    snprintf(killed, sizeof killed, "rank %d", rank);
    report_loss(name, killed, before);
}

// Ends mpirun itself by a signal.
static void kill_mpirun(const char *name, int signal, const char *killed)
{
    int status, before;
    pid_t child = begin_sweep(name, &before);
    assert_int_equal(kill(child, signal), 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) || WEXITSTATUS(status) != 0);
    print_message("no rank is left %d ms after %s\n", wait_for_ranks(), killed);
    report_loss(name, killed, before);
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

static void mpirun_is_ended(void **state)
{
    (void)state;
    skip_without_mpirun();
    kill_mpirun("terminated", SIGTERM, "mpirun (SIGTERM)");
    goes_on("terminated", true);
}

// mpirun cannot end the ranks then: each notices that it is gone.
static void mpirun_is_killed(void **state)
{
    (void)state;
    skip_without_mpirun();
    kill_mpirun("killed", SIGKILL, "mpirun (SIGKILL)");
    goes_on("killed", true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_worker_is_killed), cmocka_unit_test(the_manager_is_killed), cmocka_unit_test(mpirun_is_ended),
                                       cmocka_unit_test(mpirun_is_killed)};
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}

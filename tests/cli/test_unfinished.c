// A verb that fails or is stopped leaves no temporary file, and an overwritten file keeps its permissions.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <glob.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-left-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"

static const char tube[] = "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}}\n"
                           "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n"
                           "wire: {elements: 10, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n";

static int make_files(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    put("tube.yaml", tube);
    put("absent.yaml", "seldinger_device: 1\ndevice: {usage: joystick, vendor_id: 0xdead, product_id: 0xbeef}\npush: {source: Y, mm_s: 40}\n");
    return run_in("", "synth arc --points 200 -o tree.h5 --quiet") || run_in("", "fit tree.h5 -o model.h5 --preset local --quiet");
}

static bool is_there(const char *pattern)
{
    char path[300];
    glob_t found;
    snprintf(path, sizeof path, "%s/%s", folder, pattern);
    bool there = glob(path, 0, NULL, &found) == 0;
    if (there)
        globfree(&found);
    return there;
}

static void nap_ms(long ms) { nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL); }

static bool comes(const char *pattern)
{
    for (int i = 0; i < 2000 && !is_there(pattern); i++)
        nap_ms(5);
    return is_there(pattern);
}

// True for a temporary file that is not empty: before the work, a verb creates an empty one to check that it can write.
static bool is_written(const char *pattern)
{
    char path[300];
    glob_t found;
    struct stat status;
    snprintf(path, sizeof path, "%s/%s", folder, pattern);
    if (glob(path, 0, NULL, &found) != 0)
        return false;
    bool is_some = stat(found.gl_pathv[0], &status) == 0 && status.st_size > 0;
    globfree(&found);
    return is_some;
}

static pid_t start(const char *const *argument)
{
    pid_t child = fork();
    if (child == 0) {
        if (chdir(folder) == 0 && freopen("stop.txt", "w", stderr) && freopen("said.txt", "w", stdout))
            execv(SELDINGER_PROGRAM, (char *const *)(uintptr_t)argument);
        _exit(127);
    }
    return child;
}

// The signal that ended it, or 1000 and its exit code.
static int end_of(pid_t child)
{
    int status;
    waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 1000 + WEXITSTATUS(status);
}

static off_t size_of(const char *name)
{
    struct stat about;
    assert_int_equal(stat(in_folder(name), &about), 0);
    return about.st_size;
}

static void a_run_without_its_device_leaves_no_recording(void **state)
{
    (void)state;
    int code = run_in("timeout 100",
                      "run tube.yaml --device absent.yaml --duration-s 1 --record run.h5 --summary run.json --score run-score.json --final run.csv --quiet");
    if (code != 2 || !strstr(output, "no matching device was connected"))
        fail_msg("ended with %d: %s", code, output);
    assert_false(is_there("run.*") || is_there("run-*") || is_there("*.part*"));
}

static void a_stopped_run_leaves_a_recording_and_no_part(void **state)
{
    (void)state;
    static const char *const argument[] = {"seldinger", "run", "tube.yaml", "--duration-s", "1000", "--paced", "--record", "long.h5", "--quiet", NULL};
    // ends in order: complete file, exit code
    pid_t child = start(argument);
    assert_true(comes("long.h5"));
    kill(child, SIGTERM);
    assert_int_equal(end_of(child), 1000);
    assert_int_equal(run_in("", "info long.h5"), 0);
    assert_false(is_there("*.part*"));
    // ends without cleaning up
    child = start(argument);
    assert_true(comes("long.h5"));
    kill(child, SIGHUP);
    assert_int_equal(end_of(child), SIGHUP);
    assert_int_equal(run_in("", "info long.h5"), 0);
    assert_false(is_there("*.part*"));
}

static void each_stop_removes_the_part(void **state)
{
    (void)state;
    static const char *const argument[] = {"seldinger", "export", "model.h5", "-o", "out.stl", "--cell-mm", "0.06", "--quiet", NULL};
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    int ended_by_it = 0;
    assert_int_equal(end_of(start(argument)), 1000);
    off_t whole = size_of("out.stl");
    unlink(in_folder("out.stl"));
    for (int i = 0; i < 9; i++) {
        pid_t child = start(argument);
        while (!is_written("out.stl.part*") && !is_there("out.stl"))
            nap_ms(1);
        kill(child, signals[i % 3]);
        int end = end_of(child);
        assert_true(end == 1000 || end == signals[i % 3]);
        ended_by_it += end == signals[i % 3];
        assert_false(is_there("*.part*"));
        // a signal may come after the file got its name
        assert_true(!is_there("out.stl") || size_of("out.stl") == whole);
        unlink(in_folder("out.stl"));
    }
    // on a busy machine one of them may be complete before the signal, but not all
    assert_true(ended_by_it > 0);
}

static void rights_of_outputs_stay(void **state)
{
    (void)state;
    static const char *const made[][2] = {
        {"run tube.yaml --duration-s 0.01 --summary kept --quiet", "kept"}, {"run tube.yaml --duration-s 0.01 --final kept --quiet", "kept"},
        {"run tube.yaml --duration-s 0.01 --record kept --quiet", "kept"},  {"fit tree.h5 -o kept --preset local --quiet", "kept"},
        {"synth arc --voxel-mm 0.5 -o kept.nrrd --quiet", "kept.nrrd"},     {"synth capsule -o kept.stl --quiet", "kept.stl"},
#ifdef SELDINGER_RENDER
        {"run tube.yaml --duration-s 0.01 --picture kept --quiet", "kept"}, {"run tube.yaml --duration-s 0.01 --chart kept --quiet", "kept"},
#endif
    };
    for (size_t i = 0; i < sizeof made / sizeof *made; i++) {
        struct stat status;
        put(made[i][1], "former");
        chmod(in_folder(made[i][1]), 0640);
        if (run_in("", made[i][0]) != 0)
            fail_msg("`%s`: %s", made[i][0], output);
        assert_int_equal(stat(in_folder(made[i][1]), &status), 0);
        if ((status.st_mode & 07777) != 0640 || status.st_size == 6)
            fail_msg("`%s` left mode %o and %ld bytes", made[i][0], status.st_mode & 07777, (long)status.st_size);
        unlink(in_folder(made[i][1]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_run_without_its_device_leaves_no_recording),
        cmocka_unit_test(a_stopped_run_leaves_a_recording_and_no_part),
        cmocka_unit_test(each_stop_removes_the_part),
        cmocka_unit_test(rights_of_outputs_stay),
    };
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}

// A full disk: a file that could not be written is reported by the exit code and a message.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-full-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"

static bool is_mounted;

static int make_files(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    put("tube.yaml", "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}}\n"
                     "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n"
                     "wire: {elements: 10, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n");
    put("points.csv", "x_mm,y_mm,z_mm\n0,0,0\n");
    if (run_in("", "synth arc --points 200 -o tree.h5 --quiet") || run_in("", "fit tree.h5 -o model.h5 --preset local --quiet") ||
        mkdir(in_folder("small"), 0755))
        return -1;
    is_mounted = mount("none", in_folder("small"), "tmpfs", 0, "size=4k") == 0;
    return 0;
}

static int clean_up(void **state)
{
    if (is_mounted)
        umount(in_folder("small"));
    return remove_folder(state);
}

static void failed(const char *arguments, int expected, const char *words)
{
    int code = run_in("", arguments);
    if (code != expected || !strstr(output, words))
        fail_msg("`%s` ended with %d and printed: %s(expected %d and '%s')", arguments, code, output, expected, words);
}

// Collects standard error; standard output is full.
static int run_full(const char *arguments)
{
    char command[1000];
    snprintf(command, sizeof command, "cd '%s' && %s %s 2>&1 >/dev/full", folder, SELDINGER_PROGRAM, arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    output[fread(output, 1, sizeof output - 1, pipe)] = 0;
    int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

static void standard_output_that_is_full(void **state)
{
    (void)state;
    static const char *const arguments[] = {"--help",
                                            "-h",
                                            "help",
                                            "--version",
                                            "run --help",
                                            "fit --help",
                                            "segment --help",
                                            "check --help",
                                            "info model.h5",
                                            "info model.h5 --json",
                                            "run tube.yaml --duration-s 0.01",
                                            "run tube.yaml --duration-s 0.01 --summary - --quiet",
                                            "query model.h5 --points points.csv -o -"};
    for (size_t i = 0; i < sizeof arguments / sizeof *arguments; i++) {
        int code = run_full(arguments[i]);
        if (code == 0 || (!strstr(output, "cannot be written") && !strstr(output, "cannot write to standard output")))
            fail_msg("`%s` to a full device ended with %d and printed: %s", arguments[i], code, output);
    }
    // closed standard output: allowed if nothing is printed; printed text must not go into another file
    char command[1000];
    snprintf(command, sizeof command, "cd '%s' && %s run tube.yaml --duration-s 0.01 --record closed.h5 --quiet >&- 2>/dev/null", folder, SELDINGER_PROGRAM);
    assert_int_equal(system(command), 0);
    snprintf(command, sizeof command, "cd '%s' && %s run tube.yaml --duration-s 0.01 --record closed.h5 >&- 2>/dev/null", folder, SELDINGER_PROGRAM);
    assert_int_not_equal(system(command), 0);
    assert_int_equal(run_in("", "info closed.h5"), 0);
}

static void files_on_a_full_disk(void **state)
{
    (void)state;
    if (!is_mounted) {
        print_message("skipped: a small file system cannot be mounted here\n");
        skip();
    }
    static char fill[8192];
    memset(fill, 'x', sizeof fill);
    FILE *file = fopen(in_folder("small/fill"), "wb");
    assert_non_null(file);
    setvbuf(file, NULL, _IONBF, 0);
    fwrite(fill, 1, sizeof fill, file);
    fclose(file);
    failed("run tube.yaml --duration-s 0.01 --quiet --summary small/o.json", 3, "small/o.json: cannot be written");
    failed("run tube.yaml --duration-s 0.01 --quiet --final small/o.csv", 3, "small/o.csv: cannot be written");
    failed("run tube.yaml --duration-s 0.01 --quiet --score small/o.json", 3, "small/o.json: cannot be written");
    failed("fit tree.h5 -o small/o.h5 --preset local --quiet", 2, "small/o.h5: cannot be written");
    failed("synth arc --voxel-mm 0.5 -o small/o.nrrd --quiet", 2, "small/o.nrrd: cannot be written");
    failed("export model.h5 -o small/o.stl --quiet", 2, "small/o.stl: cannot be written");
    failed("query model.h5 --points points.csv -o small/o.csv --quiet", 2, "small/o.csv: cannot be written");
#ifdef SELDINGER_RENDER
    failed("run tube.yaml --duration-s 0.01 --quiet --picture small/o.png", 3, "small/o.png: no picture");
    failed("run tube.yaml --duration-s 0.01 --quiet --chart small/o.png", 3, "small/o.png: no chart");
    failed("fit tree.h5 -o out.h5 --preset local --quiet --picture small/o.png", 2, "small/o.png: no picture");
    failed("info model.h5 --picture small/o.png", 2, "small/o.png: no picture");
    failed("info model.h5 --report out.html --junctions small/o.png", 2, "small/o.png: no picture");
#endif
    assert_int_equal(run_in("test \"$(ls small)\" = fill &&", "--version"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(standard_output_that_is_full),
        cmocka_unit_test(files_on_a_full_disk),
    };
    return cmocka_run_group_tests(tests, make_files, clean_up);
}

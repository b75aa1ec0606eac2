// seldinger bench: the benchmarks are a program of their own, which lies beside this one.
#include "cli/cli.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <unistd.h>

static const OptionTable table = {
    .program = "seldinger bench",
    .does = "step, fit, track, peer, collision, drawing, wall: timed, each row in the same run; torture: random runs",
    .usage = "TABLE [options]",
    .intro = "Timing tables and campaigns, by the program seldinger-bench beside this one. `seldinger bench --help` names them, `seldinger bench TABLE --help` "
             "explains "
             "their options.",
    .exits = "0 done; 1 a comparison failed; 2 wrong usage or bad input",
};

static int forward(int argc, char **argv)
{
    char program[PATH_MAX] = "";
    (void)argc;
    if (process_beside("seldinger-bench", program, sizeof program)) {
        argv[0] = program;
        execv(program, argv);
    }
    if (errno == ENOENT)
        fprintf(stderr, "seldinger bench: the benchmarks are not installed: there is no %s; build the target seldinger-bench\n", program);
    else
        fprintf(stderr, "seldinger bench: seldinger-bench, beside this program, cannot be started: %s\n", strerror(errno));
    return EXIT_BAD_INPUT;
}

const Verb bench_verb = {.options = &table, .forward = forward};

// seldinger bench: the benchmarks are a separate program in the same folder.
#include "cli/cli.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <unistd.h>

static const OptionTable table = {
    .program = "seldinger bench",
    .does = "timings of step, fit, track, peer, collision, drawing and wall, all in one run; models and papers: vessel models; torture: random runs",
    .usage = "TABLE [options]",
    .intro = "Timing tables and random tests by the program seldinger-bench in the same folder. `seldinger bench --help` lists them; "
             "`seldinger bench TABLE --help` lists their options.",
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
        fprintf(stderr, "seldinger bench: the benchmarks are not installed: %s does not exist; build the target seldinger-bench\n", program);
    else
        fprintf(stderr, "seldinger bench: cannot start seldinger-bench in the folder of this program: %s\n", strerror(errno));
    return EXIT_BAD_INPUT;
}

const Verb bench_verb = {.options = &table, .forward = forward};

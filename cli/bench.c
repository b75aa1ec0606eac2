// seldinger bench: the benchmarks are a program of their own, which lies beside this one.
#include "cli/cli.h"

#include "base/process.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <unistd.h>

int verb_bench(int argc, char **argv)
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

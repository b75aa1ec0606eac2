// seldinger-bench: the list of benchmarks. `seldinger bench` starts this program.
#include "bench/bench.h"

#include "base/process.h"

#include <string.h>

static const Verb *const tables[] = {&bench_collision,
                                     &bench_step,
                                     &bench_fit,
                                     &bench_track,
                                     &bench_wall,
                                     &bench_models,
                                     &bench_papers,
                                     &bench_torture,
                                     &bench_peer,
#ifdef SELDINGER_RENDER
                                     &bench_drawing,
#endif
                                     NULL};

static int call_bench(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    const Verb *verb = cli_find_verb(tables, name);
    if (verb)
        return cli_call(verb, argc - 1, argv + 1);
    if (strcmp(name, "--help") != 0 && strcmp(name, "-h") != 0)
        return cli_refuse_verb("seldinger bench", "table", name, tables);
    printf("Usage: seldinger bench TABLE [options]\n\nTiming tables, each row measured in the same run.\n\n");
    cli_list_verbs(stdout, tables, 0);
    printf("\n`seldinger bench TABLE --help` explains the options.\nExit codes: 0 done; 1 a comparison failed; 2 wrong usage or bad input.\n");
    return EXIT_DONE;
}

int main(int argc, char **argv) { return process_run(argc, argv, call_bench); }

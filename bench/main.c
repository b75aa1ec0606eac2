// seldinger-bench: the table of benchmarks. `seldinger bench` calls it.
#include "bench/bench.h"

#include "base/process.h"

#include <string.h>

static const char help[] =
    "Usage: seldinger bench collision|step|fit|track|wall|torture|peer|drawing [options]\n\n"
    "Timing tables, each row measured in the same run.\n\n"
    "  collision  local models against meshes searched by Embree, the exact wall and a sampled distance: cost, error, spurious friction\n"
    "  step       a simulation step: spiral at 100 GPa, phantom, aneurism; growth with the elements; SIMD levels; budgets; --tools: coaxial tools\n"
    "  fit        local models: the paper's tables 3, 4 and 5 beside its figures\n"
    "  track      trackers on synthetic angiograms with truth: the labels of the paper's Table 2, errors, times\n"
    "  wall       one table of what the wall of fitted trees is worth: agreement, accuracy, ostia, reach, tools in it\n"
    "  torture    random hands, tools and vessels, judged by the true wall\n"
    "  peer       the scenes on which SOFA with BeamAdapter was measured, beside its figures\n"
    "  drawing    the trainer's pictures: CPU time, and the 1 kHz thread with and without them\n\n"
    "`seldinger bench NAME --help` explains the options.\n"
    "Exit codes: 0 done; 1 a comparison failed; 2 wrong usage or bad input.\n";

static int call_bench(int argc, char **argv)
{
    static const struct {
        const char *name;
        VerbFunction *call;
    } table[] = {{"step", bench_step}, {"peer", bench_peer}, {"collision", bench_collision}, {"fit", bench_fit}, {"track", bench_track}, {"wall", bench_wall}, {"torture", bench_torture},
#ifdef SELDINGER_RENDER
                 {"drawing", bench_drawing},
#endif
    };
    const char *name = argc > 1 ? argv[1] : "";
    if (!strcmp(name, "--help") || !strcmp(name, "-h")) {
        fputs(help, stdout);
        return EXIT_DONE;
    }
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (!strcmp(name, table[i].name))
            return table[i].call(argc - 1, argv + 1);
    }
    fprintf(stderr, "seldinger bench: %s%s%s; expected collision, step, fit, track, wall, torture, peer, drawing\n", *name ? "unknown table '" : "the name of a table is missing", name, *name ? "'" : "");
    return EXIT_BAD_INPUT;
}

int main(int argc, char **argv) { return process_run(argc, argv, call_bench); }

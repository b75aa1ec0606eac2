#include "cli/sweep_options.h"

#include "cli/cli.h"
#include "study/study.h"

#define AT(member) OPTION_AT(SweepOptions, member)

static const Option options[] = {
    {"output", "RESULTS", OPTION_FOLDER, AT(output), "folder of the results, which is created", .letter = 'o', .otherwise = ""},
    {"dry-run", NULL, OPTION_FLAG, AT(dry_run), "checks the specification, makes up to three of the runs, and says how many there are and how long they take"},
    {"report", "RESULTS", OPTION_FOLDER, AT(report),
     "writes RESULTS/report.html of a finished sweep: distributions, pairs, sensitivity, the worst runs. With SPEC.yaml, those of them that the sweep did not "
     "record are simulated again for their pictures",
     .otherwise = ""},
    {"run", "K", OPTION_WHOLE, AT(run), "repeats run K alone and writes its scene, script, recording and summary into the folder of --output",
     .most = 4294967295.0, .otherwise = "all runs"},
    {"simulate-ranks", "N", OPTION_INT, AT(simulate_ranks),
     "prints how the finished sweep of --output would have grown on 1 to N ranks: a simulated queue with the measured times of its runs", .least = 1,
     .most = 100000, .otherwise = "not"},
    CLI_THREADS(SweepOptions, threads),
    CLI_QUIET(SweepOptions, quiet, "no progress, no summary"),
};

static void set_defaults(void *structure) { *(SweepOptions *)structure = (SweepOptions){.run = -1}; }

static const char *check(void *structure)
{
    const SweepOptions *sweep = structure;
    if (sweep->report)
        return sweep->output || sweep->dry_run || sweep->run >= 0 || sweep->simulate_ranks > 0 ? "--report goes only with --quiet" : NULL;
    if (!sweep->spec)
        return "missing the specification";
    return !sweep->output && !sweep->dry_run                                        ? "missing the folder of the results: -o RESULTS"
           : (sweep->dry_run + (sweep->run >= 0) + (sweep->simulate_ranks > 0)) > 1 ? "give one of --dry-run, --run and --simulate-ranks"
                                                                                    : NULL;
}

const OptionTable sweep_options = {
    .program = "seldinger sweep",
    .does = "runs a scene many times with other values, on threads or under mpirun",
    .usage = "SPEC.yaml -o RESULTS [options]\nSPEC.yaml --dry-run\nSPEC.yaml --run K -o FOLDER\n[SPEC.yaml] --report RESULTS",
    .intro =
        "Runs scenes with the values, distributions and random hands of a specification (docs/sweeps.md) and writes a table of their figures. Each result goes "
        "into a journal as it comes: after a kill, a lost node or a full disk the same command goes on. The table does not depend on threads, ranks or order.\n"
        "Under mpirun (`mpirun -n 64 seldinger sweep …`, package seldinger-mpi) the runs are shared by the ranks; share/doc/seldinger/sweep.slurm is a batch "
        "file.",
    .notes = "A run that diverges, leaves the vessel or cannot be opened is a row of the table with that status; the sweep goes on.",
    .exits = "0 all runs have a result; 1 stopped by SIGINT or SIGTERM: the same command goes on; 2 wrong usage, bad input, or results that cannot be written",
    CLI_OPTIONS(options, SweepOptions),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .may_be_missing = true,
    .argument = offsetof(SweepOptions, spec),
    .missing = "missing the specification",
    .too_many = "one specification at a time, not also ",
};

// seldinger: the table of verbs.
#include "cli/cli.h"

#include "base/process.h"

#include <string.h>

static const struct Verb {
    const char *name;
    VerbFunction *call;
    const char *arguments, *does;
} verbs[] = {
    {"run", verb_run, "SCENE", "runs a scene headless: summary, final state, recording, picture"},
#ifdef SELDINGER_RENDER
    {"nav", verb_nav, "SCENE", "the trainer: a window, keys and devices steer the tool, sessions are recorded and scored"},
#endif
    {"check", verb_check, "PATH...", "runs every scene that has a golden tool path and compares"},
    {"segment", verb_segment, "VOLUME --start X,Y,Z -o TREE.h5", "RBT: an angiogram, from one click or --trace F.yaml, to a tree of nodes with local points"},
    {"import", verb_import, "--surface F -o TREE.h5", "the same tree from a surface, with centrelines or alone"},
    {"fit", verb_fit, "TREE.h5 -o MODEL.h5", "LIM: a local blobby model for each node"},
    {"synth", verb_synth, "SHAPE -o F", "synthetic shapes with known truth"},
    {"query", verb_query, "MODEL.h5 --points F.csv -o F.csv", "field, gradient and distance of a model at points"},
    {"export", verb_export, "FILE -o OUT", "surface, centreline or recording for other programs"},
    {"info", verb_info, "FILE", "what a file is and its figures"},
    {"replay", verb_replay, "REC.h5 [--verify]", "a recording shown, simulated again and compared, or made into a scene"},
    {"report", verb_report, "SESSION.json|REC.h5", "a page about a trainee's session: points, errors, plots, path, earlier sessions; HTML or PDF"},
    {"devices", verb_devices, "", "what is plugged in, what of it drives the tool, and why the rest does not"},
    {"bench", verb_bench, "TABLE", "step, fit, track, peer, collision, drawing, wall: timed, each row in the same run; torture: random runs"},
};
enum { VERB_COUNT = sizeof verbs / sizeof verbs[0] };

static void print_help(FILE *out)
{
    fprintf(out, "Usage: seldinger VERB ARGUMENTS\n\nSeldinger %s, a catheter navigation simulator for training and research, not a medical device.\n\n",
            SELDINGER_VERSION);
    for (int i = 0; i < VERB_COUNT; i++)
        fprintf(out, "  %-8s %-34s %s\n", verbs[i].name, verbs[i].arguments, verbs[i].does);
    fprintf(out, "\n`seldinger VERB --help` explains every option with its unit and default.\n"
                 "Exit codes: 0 done; 1 a comparison failed; 2 wrong usage or bad input; 3 the simulation could not be trusted.\n"
                 "Stopped by the user (SIGINT, SIGTERM, SIGHUP) a verb leaves no unfinished file and ends by that signal (130, 143 or 129); `run` ends in order.\n");
}

static int call_verb(int argc, char **argv)
{
    if (argc < 2) {
        print_help(stderr);
        return EXIT_BAD_INPUT;
    }
    if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) {
        print_help(stdout);
        return EXIT_DONE;
    }
    if (!strcmp(argv[1], "--version")) {
        printf("seldinger %s\n", SELDINGER_VERSION);
        return EXIT_DONE;
    }
    for (int i = 0; i < VERB_COUNT; i++) {
        if (strcmp(argv[1], verbs[i].name))
            continue;
        char name[64];
        snprintf(name, sizeof name, "seldinger %s", verbs[i].name);
        argv[1] = name;
        return verbs[i].call(argc - 1, argv + 1);
    }
    fprintf(stderr, "seldinger: no verb '%s'; valid:", argv[1]);
    for (int i = 0; i < VERB_COUNT; i++)
        fprintf(stderr, " %s", verbs[i].name);
    fprintf(stderr, "\n");
    return EXIT_BAD_INPUT;
}

int main(int argc, char **argv) { return process_run(argc, argv, call_verb); }

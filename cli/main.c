// seldinger: the table of verbs.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/start.h"

#include <string.h>

static const Verb *const verbs[] = {
    &run_verb,
#ifdef SELDINGER_RENDER
    &nav_verb,
#endif
    &case_verb,  &check_verb,  &sweep_verb, &segment_verb, &import_verb, &fit_verb,     &edit_verb,  &synth_verb,
    &query_verb, &export_verb, &info_verb,  &replay_verb,  &report_verb, &devices_verb, &bench_verb, NULL,
};
enum { VERB_COUNT = sizeof verbs / sizeof verbs[0] - 1 };

static const OptionTable program = {
    .program = "seldinger",
    .does = "catheter navigation simulator for training and research",
    .usage = "VERB ARGUMENTS\nVERB --help\n--version",
    .intro =
        "Simulates guide wires and catheters in blood vessels in real time, makes vessel models from angiograms or surfaces, and trains their navigation under "
        "simulated fluoroscopy. Not a medical device.",
    .notes = "When stopped (SIGINT, SIGTERM, SIGHUP), a verb leaves no unfinished file and ends by that signal (130, 143 or 129); `run` ends normally.",
    .exits = "0 done; 1 a comparison failed; 2 wrong usage or bad input; 3 the simulation cannot be trusted",
};

static void print_help(FILE *out)
{
    fprintf(out,
            "Usage: seldinger VERB ARGUMENTS\n       seldinger\n\nSeldinger %s, a catheter navigation simulator for training and research, not a medical "
            "device.\n\n",
            SELDINGER_VERSION);
    cli_list_verbs(out, verbs, 34);
    fprintf(out, "\nWithout arguments, on a display, a window offers exercises, sessions and files. `seldinger VERB --help` explains every option with its "
                 "unit and default; `seldinger --manual VERB` prints the same as a manual page, and\n"
                 "`seldinger --completion` a bash script that completes verbs and options.\n"
                 "Exit codes: 0 done; 1 a comparison failed; 2 wrong usage or bad input; 3 the simulation cannot be trusted.\n"
                 "When stopped (SIGINT, SIGTERM, SIGHUP), a verb leaves no unfinished file and ends by that signal (130, 143 or 129); `run` ends normally.\n");
}

static int refuse_name(const char *name) { return cli_refuse_verb("seldinger", "verb", name, verbs); }

static const OptionTable *const *tables_of_verbs(const OptionTable *table[VERB_COUNT + 1])
{
    for (int i = 0; i < VERB_COUNT; i++)
        table[i] = verbs[i]->options;
    return table;
}

// `name`: name of a verb; NULL: the page of the program.
static int print_manual(const char *name)
{
    const OptionTable *table[VERB_COUNT + 1] = {0};
    const Verb *verb = name ? cli_find_verb(verbs, name) : NULL;
    if (name && !verb)
        return refuse_name(name);
    if (verb)
        options_manual(verb->options, SELDINGER_VERSION, stdout);
    else
        options_overview(&program, tables_of_verbs(table), SELDINGER_VERSION, stdout);
    return EXIT_DONE;
}

static int print_completion(void)
{
    const OptionTable *table[VERB_COUNT + 1] = {0};
    options_completion("seldinger", tables_of_verbs(table), stdout);
    return EXIT_DONE;
}

static int call_verb(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
#ifdef SELDINGER_RENDER
    if (argc < 2 && start_is_possible())
        return start_run();
#endif
    if (argc < 2) {
        print_help(stderr);
        return EXIT_BAD_INPUT;
    }
    if (!strcmp(name, "--help") || !strcmp(name, "-h") || !strcmp(name, "help")) {
        print_help(stdout);
        return EXIT_DONE;
    }
    if (!strcmp(name, "--version")) {
        printf("seldinger %s\n", SELDINGER_VERSION);
        return EXIT_DONE;
    }
    if (!strcmp(name, "--manual"))
        return print_manual(argc > 2 ? argv[2] : NULL);
    if (!strcmp(name, "--completion"))
        return print_completion();
    const Verb *verb = cli_find_verb(verbs, name);
    return verb ? cli_call(verb, argc - 1, argv + 1) : refuse_name(name);
}

int main(int argc, char **argv) { return process_run(argc, argv, call_verb); }

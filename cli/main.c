// seldinger: the table of verbs.
#include "cli/cli.h"

#include "base/options_manual.h"
#include "base/process.h"

#include <string.h>

typedef struct Entry {
    const Verb *verb;        // NULL: `call` reads its own options
    const char *name;
    VerbFunction *call;
    const char *arguments, *does;
} Entry;

static const Entry verbs[] = {
    {.verb = &run_verb},
#ifdef SELDINGER_RENDER
    {.verb = &nav_verb},
#endif
    {.verb = &check_verb},
    {.verb = &segment_verb},
    {.verb = &import_verb},
    {.verb = &fit_verb},
    {.verb = &synth_verb},
    {.verb = &query_verb},
    {.verb = &export_verb},
    {.verb = &info_verb},
    {.verb = &replay_verb},
    {.verb = &report_verb},
    {.verb = &devices_verb},
    {NULL, "bench", verb_bench, "TABLE", "step, fit, track, peer, collision, drawing, wall: timed, each row in the same run; torture: random runs"},
};
enum { VERB_COUNT = sizeof verbs / sizeof verbs[0] };

static const char *name_of(const Entry *entry) { return entry->verb ? strrchr(entry->verb->options->program, ' ') + 1 : entry->name; }

static void print_help(FILE *out)
{
    fprintf(out, "Usage: seldinger VERB ARGUMENTS\n\nSeldinger %s, a catheter navigation simulator for training and research, not a medical device.\n\n",
            SELDINGER_VERSION);
    for (int i = 0; i < VERB_COUNT; i++) {
        const OptionTable *options = verbs[i].verb ? verbs[i].verb->options : NULL;
        const char *form = options ? options->usage : verbs[i].arguments;
        fprintf(out, "  %-8s %-34.*s %s\n", name_of(&verbs[i]), (int)strcspn(form, "\n"), form, options ? options->does : verbs[i].does);
    }
    fprintf(out, "\n`seldinger VERB --help` explains every option with its unit and default; `seldinger --manual VERB` prints the same as a manual page, and\n"
                 "`seldinger --completion` a script by which bash completes verbs and options.\n"
                 "Exit codes: 0 done; 1 a comparison failed; 2 wrong usage or bad input; 3 the simulation could not be trusted.\n"
                 "Stopped by the user (SIGINT, SIGTERM, SIGHUP) a verb leaves no unfinished file and ends by that signal (130, 143 or 129); `run` ends in order.\n");
}

static int refuse_name(const char *what, const char *name)
{
    fprintf(stderr, "seldinger: no %s '%s'; valid:", what, name);
    for (int i = 0; i < VERB_COUNT; i++)
        fprintf(stderr, " %s", name_of(&verbs[i]));
    fprintf(stderr, "\n");
    return EXIT_BAD_INPUT;
}

static const Entry *find_verb(const char *name)
{
    for (int i = 0; i < VERB_COUNT; i++)
        if (!strcmp(name, name_of(&verbs[i])))
            return &verbs[i];
    return NULL;
}

static int print_manual(const char *name)
{
    const Entry *entry = find_verb(name);
    if (!entry || !entry->verb)
        return refuse_name("manual page of a verb", name);
    options_manual(entry->verb->options, SELDINGER_VERSION, stdout);
    return EXIT_DONE;
}

static int print_completion(void)
{
    const OptionTable *table[VERB_COUNT + 1] = {0};
    int count = 0;
    for (int i = 0; i < VERB_COUNT; i++)
        if (verbs[i].verb)
            table[count++] = verbs[i].verb->options;
    options_completion("seldinger", table, stdout);
    return EXIT_DONE;
}

static int call_verb(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
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
        return print_manual(argc > 2 ? argv[2] : "");
    if (!strcmp(name, "--completion"))
        return print_completion();
    const Entry *entry = find_verb(name);
    if (!entry)
        return refuse_name("verb", name);
    if (entry->verb)
        return cli_call(entry->verb, argc - 1, argv + 1);
    char program[64];
    snprintf(program, sizeof program, "seldinger %s", name);
    argv[1] = program;
    return entry->call(argc - 1, argv + 1);
}

int main(int argc, char **argv) { return process_run(argc, argv, call_verb); }

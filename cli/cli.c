// Functions that the verbs share: printing of faults, notes and progress.
#include "cli/cli.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

void cli_notes(FILE *out, const char *path, const char *text)
{
    while (*text) {
        size_t n = strcspn(text, "\n");
        fprintf(out, "%s: %.*s\n", path, (int)n, text);
        text += n + (text[n] == '\n');
    }
}

// Prints all faults to standard error; returns EXIT_BAD_INPUT.
static int cli_bad_input(const Faults *faults)
{
    static char text[(FAULTS_CAPACITY + 1) * FAULT_LENGTH];
    faults_print(faults, text, sizeof text);
    fputs(text, stderr);
    return EXIT_BAD_INPUT;
}

int cli_call(const Verb *verb, int argc, char **argv)
{
    static Faults faults;
    if (verb->forward)
        return verb->forward(argc, argv);
    void *options = HEAP_ZEROED(1, verb->options->size);
    int code = options_parse(verb->options, argc, argv, options);
    if (code < 0)
        code = verb->call(options, &faults);
    if (faults.count > 0) {
        int bad = cli_bad_input(&faults);
        code = code < bad ? bad : code;
    }
    free(options);
    return code;
}

// The last word of the program name of its options.
static const char *cli_verb_name(const Verb *verb) { return strrchr(verb->options->program, ' ') + 1; }

const Verb *cli_find_verb(const Verb *const *list, const char *name)
{
    while (*list && strcmp(name, cli_verb_name(*list)) != 0)
        list++;
    return *list;
}

void cli_list_verbs(FILE *out, const Verb *const *list, int usage_width)
{
    for (; *list; list++) {
        const OptionTable *table = (*list)->options;
        int form = usage_width > 0 ? (int)strcspn(table->usage, "\n") : 0;
        fprintf(out, "  %-9s%-*.*s %s\n", cli_verb_name(*list), usage_width, form, table->usage, table->does);
    }
}

int cli_refuse_verb(const char *program, const char *kind, const char *name, const Verb *const *list)
{
    fprintf(stderr, *name ? "%s: no %s '%s'; valid:" : "%s: the name of a %s is missing%s; valid:", program, kind, name);
    for (; *list; list++)
        fprintf(stderr, " %s", cli_verb_name(*list));
    fprintf(stderr, "\n");
    return EXIT_BAD_INPUT;
}

void cli_note(const char *path, const char *text) { cli_notes(stderr, path, text); }

bool cli_open_vessel(const Scene *scene, int threads, bool quiet, OpenVessel *out, Faults *faults)
{
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "fit", quiet);
    return open_vessel(scene, &(OpenVesselOptions){.threads = threads, .progress = &progress, .note = cli_note}, out, faults);
}

bool cli_open_scene(Scene *scene, int threads, bool quiet, OpenVessel *out, Faults *faults)
{
    return cli_open_vessel(scene, threads, quiet, out, faults) && open_vessel_inlet(scene, out, faults);
}

bool cli_write_json(const char *path, const cJSON *root, Faults *faults)
{
    char *text = cJSON_Print(root);
    if (!text)
        faults_add(faults, path, 0, 0, "out of memory");
    bool good = text && output_write(path, text, strlen(text), faults);
    cJSON_free(text);
    return good;
}

bool cli_is_standard_output(const char *path) { return path && !strcmp(path, "-"); }

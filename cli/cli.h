// cli: one file per verb. Shared by the verbs: exit codes, the table of verbs, printing of faults, progress, opening the vessel of a scene.
#ifndef SELDINGER_CLI_CLI_H
#define SELDINGER_CLI_CLI_H

#include "base/base.h"
#include "geom/geom.h"
#include "sim/sim.h"

#include <cJSON.h>
#include <stdio.h>

typedef int VerbFunction(int argc, char **argv);   // argv[0] is the program name used in messages

// A verb: its options and its function. `call` returns an exit code; faults that it adds are printed afterwards and raise the exit code to at least
// EXIT_BAD_INPUT.
typedef struct Verb {
    const OptionTable *options;
    int (*call)(void *options, Faults *faults);
    VerbFunction *forward;   // instead of options and call: another program parses the options
} Verb;
extern const Verb run_verb, nav_verb, case_verb, check_verb, segment_verb, import_verb, fit_verb, synth_verb, query_verb, edit_verb, export_verb, info_verb,
    replay_verb, report_verb, devices_verb, bench_verb, sweep_verb;
int cli_call(const Verb *verb, int argc, char **argv);
const Verb *cli_find_verb(const Verb *const *list, const char *name);    // NULL: no verb has this name
// Prints one line per verb: its name, the first form of its usage in a column of `usage_width` characters (0: without it), what it does.
void cli_list_verbs(FILE *out, const Verb *const *list, int usage_width);
// Prints the valid names instead of `name`. Returns EXIT_BAD_INPUT.
int cli_refuse_verb(const char *program, const char *kind, const char *name, const Verb *const *list);
// Option rows that several verbs have.
#define CLI_THREADS(structure, member)                                                                                                                         \
    {                                                                                                                                                          \
        "threads", "N", OPTION_INT, OPTION_AT(structure, member), "threads; the result does not depend on them", .most = 256, .otherwise = "0: all cores"      \
    }
#define CLI_QUIET(structure, member, text)                                                                                                                     \
    {                                                                                                                                                          \
        "quiet", NULL, OPTION_FLAG, OPTION_AT(structure, member), text                                                                                         \
    }
// Which model of the file (recon/model_file.h).
#define CLI_MODEL(structure, member, text)                                                                                                                     \
    {                                                                                                                                                          \
        "model", "KIND", OPTION_CHOICE, OPTION_AT(structure, member), text ": lim (blobs) or a swept one: sweep, raster, rbf, pas",                            \
            .choices = model_names, .otherwise = "the first of these that the file has"                                                                        \
    }
#define CLI_OPTIONS(rows, structure) .option = rows, .option_count = sizeof rows / sizeof *rows, .size = sizeof(structure)
#define CLI_BAD_INPUT_EXITS "0 done; 2 wrong usage or bad input"

void cli_notes(FILE *out, const char *path, const char *text);   // each line of `text` after "PATH: "
// Names of the views in the order of PanelView.
extern const char *const cli_view_name[];
#define CLI_VIEW(structure, member, text)                                                                                                                      \
    {                                                                                                                                                          \
        "view", "V", OPTION_CHOICE, OPTION_AT(structure, member), text ": fluoroscopy, 3d, angioscopy or all", .choices = cli_view_name                        \
    }
// Parses WIDTHxHEIGHT, 320x240 to 8192x8192, into two consecutive int.
OptionTaker cli_take_size;
#define CLI_SIZE(structure, width, text)                                                                                                                       \
    {                                                                                                                                                          \
        "size", "WxH", OPTION_TEXT, OPTION_AT(structure, width), text " [pixel]", .take = cli_take_size, .otherwise = "1280x720"                               \
    }

bool cli_write_json(const char *path, const cJSON *root, Faults *faults);
bool cli_is_standard_output(const char *path);   // "-"; false for NULL
// open_vessel() with a progress bar and notes on standard error.
bool cli_open_vessel(const Scene *scene, int threads, bool quiet, OpenVessel *out, Faults *faults);
// As cli_open_vessel(), and also finds where the tool enters.
bool cli_open_scene(Scene *scene, int threads, bool quiet, OpenVessel *out, Faults *faults);
void cli_note(const char *path, const char *text);   // cli_notes() to standard error

#endif

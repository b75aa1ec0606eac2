// What goes wrong in a sweep: runs that diverge, leave the vessel or cannot be opened are rows of the table; their recordings are kept, and --run repeats them.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-sweep-faults-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"
#include "tests/cli/sweep_files.h"

static int make_files(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    put_scene_of_tube();
    return 0;
}

// The text of a key in the journal's line of a run.
static void result_text(const char *journal, int run, const char *key, char out[200])
{
    char head[20], pattern[40];
    snprintf(head, sizeof head, "\n{\"run\":%d,", run);
    snprintf(pattern, sizeof pattern, "\"%s\":\"", key);
    const char *line = strstr(journal, head), *at = line ? strstr(line, pattern) : NULL;
    if (!at || at > strchr(line + 1, '\n'))
        fail_msg("the journal has no '%s' of run %d", key, run);
    at += strlen(pattern);
    snprintf(out, 200, "%.*s", (int)strcspn(at, "\""), at);
}

// The recording and a repetition end in the same state. `code` is that of a replay: 3 if the run cannot be trusted.
static void is_repeated(int run, const char *hash, int code)
{
    char arguments[80], name[40];
    snprintf(arguments, sizeof arguments, "sweep ends.yaml --run %d -o again%d --quiet", run, run);
    assert_int_equal(run_in("", arguments), 0);
    snprintf(name, sizeof name, "again%d/summary.json", run);
    char *summary = text_of(in_folder(name));
    if (!strstr(summary, hash))
        fail_msg("run %d ended in the state %s, and its repetition in: %s", run, hash, summary);
    free(summary);
    snprintf(arguments, sizeof arguments, "replay ends/recordings/%d.h5 --verify", run);
    if (run_in("", arguments) != code || !strstr(output, "the same state at each") || !strstr(output, hash))
        fail_msg("`%s` did not end with %d in the state %s: %s", arguments, code, hash, output);
}

// A free wire in an open tube: pulled by 1e6 N it is further away after a step than a position can say (diverged); it may begin outside the tube (left); and a
// model that is no HDF5 file is noticed when it is opened (failed).
static void every_kind_of_end_is_a_row(void **state)
{
    (void)state;
    put("pulled.yaml", "seldinger: 1\nvessel: {tube: {radius_mm: 1.5, path: [{line_mm: 60}]}}\nwire:\n  elements: 20\n  sections:\n"
                       "    - {length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80, poisson_ratio: 0.3, density_g_cm3: 6.45}\n"
                       "rig: {start_mm: [1, 0, 0], direction: [1, 0, 0], loads: [{s_mm: 10, force_n: [0.001, 0, 0]}]}\n");
    put("broken.h5", "no model");
    put("ends.yaml", "sweep: 1\nscene: pulled.yaml\nvary:\n  rig.loads[0].force_n: {values: [[0.00001, 0, 0], [1e6, 0, 0]]}\n"
                     "  rig.start_mm: {values: [[1, 0, 0], [1, 4, 0]]}\n  wire.sections[0].length_mm: {values: [40, 20]}\n"
                     "  vessel: {values: [{tube: {radius_mm: 1.5, path: [{line_mm: 60}]}}, {model: broken.h5}]}\nduration_s: 0.05\nsampling: grid\n"
                     "keep: {recordings: failures}\n");
    if (run_in("", "sweep ends.yaml -o ends --threads 2") != 0)
        fail_msg("%s", output);
    assert_non_null(strstr(output, "16 of 16 runs: 2 done, 4 diverged, 2 left the vessel, 8 failed (the column 'message' says why)"));
    assert_int_equal(lines_of("ends/table.csv"), 17);
    char *journal = text_of(in_folder("ends/journal.txt"));
    int ends[4] = {0};
    for (int run = 0; run < 16; run++) {
        static const char *const status_name[] = {"done", "diverged", "left", "failed"};
        char status[200], message[200], hash[200], recording[60];
        result_text(journal, run, "status", status);
        result_text(journal, run, "message", message);
        result_text(journal, run, "state_hash", hash);
        snprintf(recording, sizeof recording, "ends/recordings/%d.h5", run);
        int kind = 0;
        while (strcmp(status, status_name[kind]) != 0)
            kind++;
        ends[kind]++;
        bool is_recorded = kind == 1 || kind == 2;
        assert_int_equal(access(in_folder(recording), R_OK) == 0, is_recorded);
        if (is_recorded)
            is_repeated(run, hash, kind == 1 ? 3 : 0);
        assert_int_equal(*message == 0, kind == 0);
        assert_int_equal(*hash == 0, kind == 3);
        if (kind == 3) {
            char arguments[60];
            snprintf(arguments, sizeof arguments, "sweep ends.yaml --run %d -o failed%d", run, run);
            refused(arguments, message);
        }
    }
    free(journal);
    assert_true(ends[0] == 2 && ends[1] == 4 && ends[2] == 2 && ends[3] == 8);
    assert_int_equal(run_in("", "sweep ends.yaml --dry-run"), 0);
    assert_non_null(strstr(output, "s; failed: broken.h5:"));
}

static void what_cannot_be_meant_is_refused(void **state)
{
    (void)state;
    put("a.csv", "t_s,push_mm_s,twist_deg_s\n0,10,0\n0.01,0,0\n");
    put("script.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary: {script: {values: [a.csv]}}\nhands: {seed: 1}\nsampling: {kind: random, runs: 3}\n");
    refused("sweep script.yaml -o r", "script.yaml:3:16: 'script' is varied, but random 'hands' replace the script; expected one of them");
    put("order.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary:\n  vessel.friction: {uniform: [0, 1]}\n  vessel: {values: [{plane: {normal: [0, 0, 1]}}]}\n"
                      "sampling: {kind: random, runs: 3}\n");
    refused("sweep order.yaml -o r", "order.yaml:5:11: 'vessel' replaces 'vessel.friction', which is set before it");
    put("many.yaml", "sweep: 1\nscene: tube-scene.yaml\nhands: {}\nsampling: {kind: random, runs: 1e9}\n");
    refused("sweep many.yaml -o r", "many.yaml:4:32: has 1000000000 runs; expected at most 10000000");
    put("lost.yaml", "sweep: 1\nscene: [tube-scene.yaml, lost/scene.yaml]\nhands: {}\nsampling: {kind: random, runs: 3}\n");
    refused("sweep lost.yaml -o r",
            "lost.yaml:2:8: the scene lost/scene.yaml cannot be read: No such file or directory; expected a path relative to this file");
    put("value.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary: {\"targets[0].name\": {values: [\"\\0\"]}}\nsampling: {kind: random, runs: 3}\n");
    refused("sweep value.yaml -o r", "value.yaml:3:27: with targets[0].name:");
    put("levels.yaml", "sweep: 1\nscene: tube-scene.yaml\nvary: {vessel.friction: {uniform: [0, .inf], levels: 0}}\nsampling: grid\n");
    refused("sweep levels.yaml -o r", "levels.yaml:3:39: 'sweep.vary.vessel.friction.uniform[1]' is '.inf', not a number");
    assert_non_null(strstr(output, "levels.yaml:3:54: 'sweep.vary.vessel.friction.levels' is 0"));
    assert_int_equal(access(in_folder("r"), F_OK), -1);
}

static void are_refused(const char *vary, const char *sampling, const char *words)
{
    char text[800];
    snprintf(text, sizeof text, "sweep: 1\nscene: tube-scene.yaml\nduration_s: 0.05\nsampling: %s\nvary:\n%s", sampling, vary);
    put("values.yaml", text);
    refused("sweep values.yaml --dry-run", words);
    refused("sweep values.yaml -o values", words);
}

// What cannot be simulated is refused before the first run, with the keys that matter and no others.
static void values_that_cannot_be_simulated_are_refused(void **state)
{
    (void)state;
    static const char random[] = "{kind: random, runs: 3}";
#define SECTION "  wire.sections[0]."
    are_refused("  vessel.friction: {uniform: [0, 0.1]}\n" SECTION "young_modulus_gpa: {uniform: [-5, 5]}\n", random,
                "values.yaml:7:39: with wire.sections[0].young_modulus_gpa: -5 the scene is wrong: tube-scene.yaml:");
    assert_non_null(strstr(output, "'wire.sections[0].young_modulus_gpa' is -5, out of range; expected a number above 0"));
    assert_null(strstr(output, "friction"));
    are_refused(SECTION "young_modulus_gpa: {values: [-1, 5, 0]}\n", random, "with wire.sections[0].young_modulus_gpa: -1 the scene");
    assert_non_null(strstr(output, "with wire.sections[0].young_modulus_gpa: 0 the scene"));
    are_refused("  vessel.friction: {uniform: [-0.1, 0.1]}\n", random, "values.yaml:6:20: with vessel.friction: -0.1 the scene is wrong");
    are_refused("  vessel.friction: {normal: [0.05, 0.01]}\n", random, "values.yaml:6:20: with vessel.friction: -0.01");
    are_refused("  wire.elements: {integer: [0, 10]}\n", random,
                "with wire.elements: 0 the scene is wrong: tube-scene.yaml:9:13: 'wire.elements' is 0; expected");
    are_refused("  vessel.contact: {values: [tube, lim]}\n  vessel.tube: {values: [{radius_mm: 1.5, path: [{line_mm: 60}]}]}\n"
                "  vessel.model: {values: [a.h5]}\n",
                random, "values.yaml:6:19: with ");
    are_refused("  vessel: {values: [{plane: {normal: [0, 0, 1]}, contact: mesh}]}\n", random, "contact 'mesh' needs a bounded wall");
    are_refused("  vessel: {values: [{model: lost.h5}]}\n", random,
                "values.yaml:6:11: with vessel: {model: lost.h5} the scene is wrong: lost.h5: cannot be read");

    // each value alone is valid in the scene, not both ends together; three more keys do not matter
    static const char together[] = "  vessel.friction: {uniform: [0, 0.1]}\n" SECTION "inner_diameter_mm: {uniform: [0, 0.35]}\n"
                                   "  wire.elements: {integer: [30, 40]}\n" SECTION "diameter_mm: {uniform: [0.3, 0.5]}\n"
                                   "  sheath.inserted_mm: {values: [2, 5]}\n";
    are_refused(together, random, "values.yaml:7:39: with wire.sections[0].inner_diameter_mm: 0.35 and wire.sections[0].diameter_mm: 0.3 the scene is wrong");
    assert_non_null(strstr(output, "expected ranges that are valid together"));
    assert_null(strchr(strchr(output, '\n') + 1, '\n'));    // one message

    // and with so many keys that not all combinations are tried
    char many[700];
    snprintf(many, sizeof many,
             "%s  targets[0].radius_mm: {uniform: [1, 2]}\n  wire.damping.mass_1_s: {uniform: [0, 1]}\n" SECTION
             "poisson_ratio: {uniform: [0.2, 0.4]}\n" SECTION "density_g_cm3: {uniform: [5, 7]}\n  vessel.tube.radius_mm: {uniform: [1, 1.5]}\n"
             "  wire.damping.stiffness_s: {uniform: [0, 0.0002]}\n",
             together);
    are_refused(many, random, "with wire.sections[0].inner_diameter_mm: 0.35 and wire.sections[0].diameter_mm: 0.3 the scene is wrong");
    assert_null(strchr(strchr(output, '\n') + 1, '\n'));
    assert_int_equal(access(in_folder("values"), F_OK), -1);

    // valid together, although not each with the value that the scene has
    put("values.yaml", "sweep: 1\nscene: tube-scene.yaml\nduration_s: 0.01\nsampling: {kind: random, runs: 2}\nvary:\n" SECTION
                       "inner_diameter_mm: {uniform: [0.4, 0.45]}\n" SECTION "diameter_mm: {uniform: [0.5, 0.6]}\n");
    assert_int_equal(run_in("", "sweep values.yaml -o values"), 0);
    assert_non_null(strstr(output, "2 of 2 runs: 2 done"));
#undef SECTION
}

static const char small[] = "sweep: 1\nscene: tube-scene.yaml\nvary: {vessel.friction: {uniform: [0, 0.1]}}\nduration_s: 0.05\n"
                            "sampling: {kind: random, runs: 6}\nkeep: {recordings: all, figures: [steps, tip_m, flags]}\n";

// A figure that no run has is probably misspelt: the table is written, with a warning.
static void a_misspelt_figure_is_named(void **state)
{
    (void)state;
    put("small.yaml", small);
    assert_int_equal(run_in("", "sweep small.yaml -o small --quiet"), 0);
    assert_non_null(strstr(output, "small.yaml: warning: no run has a figure 'tip_m' of keep.figures"));
    assert_null(strstr(output, "'steps'"));
}

static void unwritable_folders_are_refused(void **state)
{
    (void)state;
    put("file", "");
    refused("sweep small.yaml -o file", "file: cannot be created: ");
    assert_non_null(strstr(output, "expected a folder for the results"));
    refused("sweep small.yaml -o /proc/results", "/proc/results: cannot be created: No such file or directory; expected a folder for the results");
}

// Files of at most 16 kB, as on a full disk: no recording fits. Without the limit the same command goes on to the same bytes.
static void recordings_that_do_not_fit_stop_the_sweep(void **state)
{
    (void)state;
    // HDF5 1.10 does not free the names in a file that it cannot write
    int code = run_in("ulimit -f 16; ASAN_OPTIONS=$ASAN_OPTIONS:detect_leaks=0", "sweep small.yaml -o full --threads 1 --quiet");
    if (code != 2 || !strstr(output, "full/recordings/0.h5: ") || !strstr(output, "the same command goes on"))
        fail_msg("%d: %s", code, output);
    assert_int_not_equal(access(in_folder("full/recordings/0.h5"), F_OK), 0);
    assert_int_not_equal(access(in_folder("full/table.csv"), F_OK), 0);
    assert_int_equal(run_in("", "sweep small.yaml -o full --quiet"), 0);
    same_file("small/table.csv", "full/table.csv");
    assert_int_equal(access(in_folder("full/recordings/5.h5"), R_OK), 0);
}

// The heading of a journal with another `key`, and its right checksum: as another version of the program or another machine's files would have written it.
static void change_heading(const char *pattern)
{
    char command[1000];
    snprintf(command, sizeof command,
             "cd '%s' && mkdir -p old && line=$(head -1 small/journal.txt | cut -f1 | sed '%s') && { printf '%%s\\t%%s\\n' \"$line\" "
             "\"$(printf %%s \"$line\" | sha256sum | cut -c1-16)\"; tail -n +2 small/journal.txt; } >old/journal.txt && cp old/journal.txt old/kept",
             folder, pattern);
    assert_int_equal(system(command), 0);
}

static void a_changed_program_is_refused(void **state)
{
    (void)state;
    change_heading("");
    assert_int_equal(run_in("", "sweep small.yaml -o old --quiet"), 0);     // the test's own heading is a valid one
    change_heading("s/\"version\":\"[^\"]*/\"version\":\"0.0.7/");
    refused("sweep small.yaml -o old", "old/journal.txt: the version was 0.0.7 when the sweep began and is ");
    assert_non_null(strstr(output, "take a new folder"));
    change_heading("s/\"program\":\"[^\"]*/\"program\":\"beef/");
    refused("sweep small.yaml -o old", "old/journal.txt: the program was beef when the sweep began and is ");
    refused("sweep small.yaml -o old --simulate-ranks 4", "the program was beef");
    change_heading("s/tube-scene.yaml\":\"[^\"]*/tube-scene.yaml\":\"beef/");
    refused("sweep small.yaml -o old", "old/journal.txt: the file tube-scene.yaml has changed since the sweep began");
    same_file("old/journal.txt", "old/kept");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_end_is_a_row),
        cmocka_unit_test(what_cannot_be_meant_is_refused),
        cmocka_unit_test(values_that_cannot_be_simulated_are_refused),
        cmocka_unit_test(a_misspelt_figure_is_named),
        cmocka_unit_test(unwritable_folders_are_refused),
        cmocka_unit_test(recordings_that_do_not_fit_stop_the_sweep),
        cmocka_unit_test(a_changed_program_is_refused),
    };
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}

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
// load beyond its end cannot be applied (failed), although each value alone is valid.
static void every_kind_of_end_is_a_row(void **state)
{
    (void)state;
    put("pulled.yaml", "seldinger: 1\nvessel: {tube: {radius_mm: 1.5, path: [{line_mm: 60}]}}\nwire:\n  elements: 20\n  sections:\n"
                       "    - {length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80, poisson_ratio: 0.3, density_g_cm3: 6.45}\n"
                       "rig: {start_mm: [1, 0, 0], direction: [1, 0, 0], loads: [{s_mm: 10, force_n: [0.001, 0, 0]}]}\n");
    put("ends.yaml", "sweep: 1\nscene: pulled.yaml\nvary:\n  rig.loads[0].force_n: {values: [[0.00001, 0, 0], [1e6, 0, 0]]}\n"
                     "  rig.start_mm: {values: [[1, 0, 0], [1, 4, 0]]}\n  wire.sections[0].length_mm: {values: [40, 20]}\n"
                     "  rig.loads[0].s_mm: {values: [10, 40]}\nduration_s: 0.05\nsampling: grid\nkeep: {recordings: failures}\n");
    if (run_in("", "sweep ends.yaml -o ends --threads 2") != 0)
        fail_msg("%s", output);
    assert_non_null(strstr(output, "16 of 16 runs: 3 done, 6 diverged, 3 left the vessel, 4 failed"));
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
    assert_true(ends[0] == 3 && ends[1] == 6 && ends[2] == 3 && ends[3] == 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_kind_of_end_is_a_row)};
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}

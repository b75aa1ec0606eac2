// An injection by a script or a session: a replay shows what the run had, a session becomes a script that injects the same, and older recordings are read.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/playback.h"
#include "sim/replay.h"
#include "sim/session.h"
#include "sim/session_tracker.h"

#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-injection-XXXXXX";
#include "tests/folder.h"

static const char scene_text[] =
    "seldinger: 1\n"
    "tools:\n"
    "  - {name: guide, kind: guide_catheter, elements: 20, sections: [{length_mm: 100, diameter_mm: 2, inner_diameter_mm: 1.8, young_modulus_gpa: 1}]}\n"
    "  - {name: wire, kind: wire, elements: 30, sections: [{length_mm: 160, diameter_mm: 0.9, young_modulus_gpa: 5}]}\n"
    "sheath: {entry_mm: [0,0,0], direction: [1,0,0], inserted_mm: 10}\n"
    "script: [{t_s: 0, wire.push_mm_s: 40, wire.twist_deg_s: 0, wire.contrast_ml_s: 1.5}, {t_s: 0.2, guide.push_mm_s: 20, guide.twist_deg_s: 0}, {t_s: 1, "
    "guide.contrast_ml_s: 0.5}, {t_s: 1.2}]\n";

enum { STEPS = 1200, EACH = 100 };
static Faults faults;
static Scene *scene;
static float live[STEPS / EACH + 1][64];
static double live_injected_ml[STEPS / EACH + 1];
static int nodes;

// A run as `run` makes it (`is_watched` false: nobody watches, the script injects) or a session with the same controls.
static RecordedRun *record(const char *name, bool is_watched)
{
    Simulator *simulator = simulator_create(scene, NULL, &faults);
    assert_non_null(simulator);
    SessionTracker *tracker = session_tracker_create(simulator, NULL);
    RecordingOptions options = recording_default_options();
    Recording *recording = recording_create(in_folder(name), simulator, &options, &faults);
    assert_true(tracker && recording);
    TrackerView *view = malloc(session_tracker_view_bytes(tracker));
    int cursor = 0;
    for (int i = 0; i < STEPS; i++) {
        ToolCommands commands = script_tools_at(scene->script, i * 0.001, &cursor);
        XrayControl xray = {.contrast_ml_s = (float)commands.contrast_ml_s, .contrast_tool = (float)commands.contrast_tool};
        simulator_step(simulator, &commands);
        session_tracker_step(tracker, simulator, &commands, &xray);
        xray.field_mm = 100;
        assert_true(recording_step(recording, simulator, &commands, is_watched ? &xray : NULL));
        if ((i + 1) % EACH == 0) {
            session_tracker_publish(tracker, view);
            nodes = view->filling_count;
            assert_true(view->node_count == 0 && nodes == 52 && nodes <= 64);
            for (int j = 0; j < nodes; j++)
                live[(i + 1) / EACH][j] = view->concentration[j];
            live_injected_ml[(i + 1) / EACH] = view->injected_ml;
        }
    }
    free(view);
    assert_true(recording_close(recording, simulator, &faults));
    session_tracker_free(tracker);
    simulator_destroy(simulator);
    RecordedRun *run = recorded_run_load(in_folder(name), &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    return run;
}

static int set_up(void **state)
{
    (void)state;
    assert_non_null(mkdtemp(folder));
    scene = scene_parse(scene_text, sizeof scene_text - 1, "injection.yaml", &faults);
    if (!scene)
        fail_msg("%s", faults.text[0]);
    return 0;
}

static int tear_down(void **state)
{
    scene_free(scene);
    return remove_folder(state);
}

static void a_replay_shows_the_lumens_as_they_were(void **state)
{
    (void)state;
    const XrayControl unseen = xray_default_control();
    for (int watched = 0; watched < 2; watched++) {
        RecordedRun *run = record(watched ? "seen.h5" : "unseen.h5", watched);
        Playback *playback = playback_open(run, scene, NULL, &unseen);
        assert_non_null(playback);
        for (int i = STEPS / EACH; i > 0; i--) {     // backwards, from stored moments
            playback_seek(playback, i * EACH * 0.001);
            assert_memory_equal(playback_filling(playback), live[i], (size_t)nodes * sizeof(float));
            assert_true(fabs(playback_injected_ml(playback) - live_injected_ml[i]) < 1e-12);
        }
        playback_seek(playback, 0.1);
        assert_int_equal(playback_contrast_tool(playback), 0);       // the wire lies in it
        assert_true(fabs(playback_flow_ml_s(playback) - 1.5) < 1e-6);
        // 0.3 ml at first and 0.1 ml at the end
        assert_true(fabs(live_injected_ml[STEPS / EACH] - 0.4) < 1e-6);
        assert_true(live[1][10] > 0.5F && live[1][10] <= 0.75F && live[1][30] <= 0);      // the wire takes up a quarter of the lumen
        playback_close(playback);
        recorded_run_free(run);
    }
}

static void a_session_becomes_a_script_that_injects_the_same(void **state)
{
    (void)state;
    RecordedRun *run = record("session.h5", true);
    size_t length;
    char *text = replay_script(run, &length);
    assert_non_null(text);
    const ToolNames tools = scene_tool_names(scene);
    Script *script = script_parse(text, length, "hand.csv", &tools, &faults);
    if (!script)
        fail_msg("%s", faults.text[0]);
    int cursor[2] = {0};
    for (int i = 0; i < STEPS; i++) {
        ToolCommands was = script_tools_at(scene->script, (i + 0.5) * 0.001, &cursor[0]), is = script_tools_at(script, (i + 0.5) * 0.001, &cursor[1]);
        assert_true(fabs(was.contrast_ml_s - is.contrast_ml_s) < 1e-7 && was.contrast_tool == is.contrast_tool);
    }
    script_free(script);
    free(text);
    recorded_run_free(run);
}

// Rewrites /xray with its first `values` columns, as older versions wrote it.
static void cut_xray(const char *path, const RecordedRun *run, int values)
{
    float *rows = malloc((size_t)run->step_count * (size_t)values * sizeof *rows);
    for (int64_t i = 0; i < run->step_count; i++)
        memcpy(rows + i * values, &run->xray[i], (size_t)values * sizeof *rows);
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    hsize_t shape[2] = {(hsize_t)run->step_count, (hsize_t)values};
    hid_t space = H5Screate_simple(2, shape, NULL);
    assert_true(file >= 0 && H5Ldelete(file, "/xray", H5P_DEFAULT) >= 0);
    hid_t set = H5Dcreate2(file, "/xray", H5T_NATIVE_FLOAT, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(set >= 0 && H5Dwrite(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows) >= 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Fclose(file);
    free(rows);
}

// Without the tool of the contrast agent, or without what the trainee saw. The checksum of a session includes a column only if it was used.
static void a_recording_from_before_is_read_and_is_its_session_s(void **state)
{
    (void)state;
    static const int values[] = {XRAY_VALUES_BEFORE_TOOLS, XRAY_VALUES_BEFORE_SEEN};
    for (int k = 0; k < 2; k++) {
        const bool has_tool = values[k] > XRAY_VALUES_BEFORE_TOOLS;
        RecordedRun *run = record("older.h5", true);
        cut_xray(in_folder("older.h5"), run, values[k]);
        RecordedRun *older = recorded_run_load(in_folder("older.h5"), &faults);
        if (!older)
            fail_msg("%s", faults.text[0]);
        for (int i = 0; i < STEPS; i++) {
            assert_memory_equal(&older->xray[i], &run->xray[i], (size_t)values[k] * sizeof(float));
            assert_true(older->xray[i].seen <= 0 && (has_tool || older->xray[i].contrast_tool <= 0));
        }
        Session now, before;
        session_set_run(&now, run, "older.h5");
        session_set_run(&before, older, "older.h5");
        assert_true(session_is_of(&now, run) && session_is_of(&before, older) && session_is_of(&now, older) == has_tool);
        run->xray[STEPS / 2].seen = SEEN_KNOWN | SEEN_EXAMINATION;
        assert_false(session_is_of(&now, run) || now.is_examination);
        for (int i = 0; i < STEPS; i++)
            run->xray[i].seen = SEEN_KNOWN | SEEN_EXAMINATION;
        session_set_run(&now, run, "older.h5");
        assert_true(now.is_examination);
        assert_int_equal(recorded_run_commands(older, 50).contrast_tool, has_tool ? recorded_run_commands(run, 50).contrast_tool : 0);
        recorded_run_free(run);
        recorded_run_free(older);
    }
}

int main(void)
{
    recording_prepare_process();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_replay_shows_the_lumens_as_they_were),
        cmocka_unit_test(a_session_becomes_a_script_that_injects_the_same),
        cmocka_unit_test(a_recording_from_before_is_read_and_is_its_session_s),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

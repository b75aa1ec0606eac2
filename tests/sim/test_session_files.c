// The files of a session: the folder, unique names, the session file beside its recording.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/session_files.h"
#include "tests/sim/trainer_scene.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-files-XXXXXX";
#include "tests/folder.h"

static bool is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

static void the_folder_is_made_where_it_is_wanted(void **state)
{
    (void)state;
    char out[4096], home[200];
    faults_clear(&faults);
    for (int again = 0; again < 2; again++) {   // whether it exists or not
        assert_true(session_folder(in_folder("a/b c/d"), out, sizeof out, &faults));
        assert_string_equal(out, in_folder("a/b c/d"));
        assert_true(is_folder(out));
    }
    assert_true(session_folder(in_folder("e/"), out, sizeof out, &faults) && is_folder(in_folder("e")));
    // by default: as the rules of the desktop say
    snprintf(home, sizeof home, "%s", in_folder("home"));
    setenv("HOME", home, 1);
    setenv("XDG_DATA_HOME", in_folder("data"), 1);
    assert_true(session_folder(NULL, out, sizeof out, &faults));
    assert_string_equal(out, in_folder("data/seldinger/sessions"));
    setenv("XDG_DATA_HOME", "", 1);
    assert_true(session_folder(NULL, out, sizeof out, &faults));
    assert_string_equal(out, in_folder("home/.local/share/seldinger/sessions"));
    assert_true(is_folder(out));
    assert_int_equal(faults.count, 0);
}

static void what_is_no_folder_is_refused(void **state)
{
    (void)state;
    char out[4096], far_too_long[4096];
    memset(far_too_long, 'x', sizeof far_too_long - 1);
    far_too_long[sizeof far_too_long - 1] = 0;
    put("file", "");
    static const char *const wrong[] = {"file", "file/inside", "e/../file"};
    for (int i = 0; i < 3; i++) {
        faults_clear(&faults);
        assert_false(session_folder(in_folder(wrong[i]), out, sizeof out, &faults));
        assert_int_equal(faults.count, 1);
        assert_non_null(strstr(faults.text[0], "cannot store sessions: Not a directory"));
    }
    faults_clear(&faults);
    assert_false(session_folder(far_too_long, out, sizeof out, &faults));
    assert_non_null(strstr(faults.text[0], "too long"));
    faults_clear(&faults);
    assert_false(session_folder("/proc/seldinger", out, sizeof out, &faults));
    assert_int_equal(faults.count, 1);
}

static void no_name_is_taken_twice(void **state)
{
    (void)state;
    char name[20][4096];
    for (int i = 0; i < 20; i++) {
        session_file_name(folder, "/some/where/arch.v2.yaml", ".h5", name[i], sizeof name[i]);
        assert_memory_equal(name[i], folder, strlen(folder));
        assert_memory_equal(name[i] + strlen(folder), "/arch-20", 8);
        assert_string_equal(name[i] + strlen(name[i]) - 3, ".h5");
        assert_int_equal(access(name[i], F_OK), -1);
        put(name[i] + strlen(folder) + 1, "");
    }
    session_file_name(folder, "/cases/arch/scene.yaml", ".h5", name[0], sizeof name[0]);
    assert_memory_equal(name[0] + strlen(folder), "/arch-20", 8);
    session_file_name(folder, "scene.yaml", ".h5", name[0], sizeof name[0]);
    assert_memory_equal(name[0] + strlen(folder), "/scene-20", 9);
    char beside[4096];
    session_file_beside("/a.b/c.d.h5", ".json", beside, sizeof beside);
    assert_string_equal(beside, "/a.b/c.d.json");
    session_file_beside("/a.b/c", ".json", beside, sizeof beside);
    assert_string_equal(beside, "/a.b/c.json");
    session_file_beside("c", ".json", beside, sizeof beside);
    assert_string_equal(beside, "c.json");
}

static void expect_cut_off(int count)
{
    CutOff found = session_find_cut_off(folder);
    assert_int_equal(found.count, count);
    for (int i = 0; i < count; i++)
        assert_string_equal(found.path[i], in_folder("bend.h5"));
    session_free_cut_off(&found);
}

static void the_session_file_is_of_its_recording(void **state)
{
    (void)state;
    char path[200], report[5000];
    snprintf(path, sizeof path, "%s", in_folder("bend.h5"));
    TrainerScene it = trainer_scene_open(false);
    Simulator *simulator = simulator_create(it.scene, it.open.vessel, &faults);
    Score *score = score_create(simulator, NULL);
    RecordingOptions options = recording_default_options();
    options.trainee = "Ada \"the hand\"";
    options.date = "2023-11-14T22:13:20Z";
    Recording *recording = recording_create(path, simulator, &options, &faults);
    assert_true(score && recording);
    XrayControl xray = xray_default_control();
    xray.pedal = 1;
    for (int i = 0; i < 200; i++) {
        Command command = {25, 40};
        simulator_step_one_tool(simulator, command);
        score_step(score, simulator, &(ToolCommands){.tool = {command}}, &xray);
        assert_true(recording_step(recording, simulator, &(ToolCommands){.tool = {command}}, &xray));
    }
    expect_cut_off(0);           // it is still being written
    assert_true(recording_close(recording, simulator, &faults));
    assert_true(session_files_save(it.scene, "Ada \"the hand\"", "keyboard", "2023-11-14T22:13:20Z", score, path, &faults));
    static Session session;
    assert_true(session_load(in_folder("bend.json"), &session, &faults));
    assert_string_equal(session.trainee, "Ada \"the hand\"");
    assert_string_equal(session.title, "To the bend");
    assert_true(session.state_hash == simulator_hash(simulator));
    ScoreFigures figures = score_figures(score);
    assert_true(session.figures.fluoroscopy_s == figures.fluoroscopy_s && session.figures.path_mm == figures.path_mm && figures.path_mm > 1);
    RecordedRun *run = recorded_run_load_series(path, &faults);
    assert_true(session_is_of(&session, run));
    run->command[10] += 1;
    assert_false(session_is_of(&session, run));
    recorded_run_free(run);
    // a program that was killed leaves no session file
    Session saved = session;
    remove(in_folder("bend.json"));
    expect_cut_off(1);
    snprintf(report, sizeof report, "%s report --quiet '%s'", SELDINGER_PROGRAM, path);
    assert_int_equal(system(report), 0);
    expect_cut_off(0);
    assert_true(session_load(in_folder("bend.json"), &session, &faults));
    assert_string_equal(session.device, "not known: the session was interrupted");
    memcpy(session.device, saved.device, sizeof saved.device);
    assert_true(strstr(session.scene_path, saved.scene_path) > session.scene_path);      // an absolute path
    memcpy(session.scene_path, saved.scene_path, sizeof saved.scene_path);
    assert_memory_equal(&session, &saved, sizeof session);
    // a run without a session was not interrupted
    snprintf(report, sizeof report,
             "cd '%s' && printf 't_s,push_mm_s,twist_deg_s\\n0,10,0\\n0.1,0,0\\n' > push.csv && %s run %s/scenes/phantom/scene.yaml --script push.csv "
             "--duration-s 0.1 --record scripted.h5 --quiet && %s report --quiet scripted.h5",
             folder, SELDINGER_PROGRAM, SOURCE_DIR, SELDINGER_PROGRAM);
    assert_int_equal(system(report), 0);
    assert_true(session_load(in_folder("scripted.json"), &session, &faults));
    assert_string_equal(session.device, "none: a scripted run");
    remove(in_folder("scripted.json"));
    remove(in_folder("scripted.h5"));
    // a recording that does not exist
    faults_clear(&faults);
    assert_false(session_files_save(it.scene, "Ada", "keyboard", "2023-11-14T22:13:20Z", score, in_folder("nowhere.h5"), &faults));
    assert_true(faults.count > 0);
    assert_int_equal(access(in_folder("nowhere.json"), F_OK), -1);
    score_free(score);
    simulator_destroy(simulator);
    trainer_scene_close(&it);
}

// A recording with a date that is none, as another program could write: the recovered session gets the time at which the file was last written.
static void a_wrong_date_is_replaced(void **state)
{
    (void)state;
    static Session session;
    struct stat status;
    char path[200], report[500], written[SESSION_DATE];
    snprintf(path, sizeof path, "%s", in_folder("undated.h5"));
    faults_clear(&faults);
    TrainerScene it = trainer_scene_open(false);
    Simulator *simulator = simulator_create(it.scene, it.open.vessel, &faults);
    RecordingOptions options = recording_default_options();
    options.trainee = "Ada";
    options.date = "2023-11-14 22:13";
    Recording *recording = recording_create(path, simulator, &options, &faults);
    assert_non_null(recording);
    Command command = {25, 40};
    XrayControl xray = xray_default_control();
    for (int i = 0; i < 20; i++) {
        simulator_step_one_tool(simulator, command);
        assert_true(recording_step(recording, simulator, &(ToolCommands){.tool = {command}}, &xray));
    }
    assert_true(recording_close(recording, simulator, &faults));
    assert_int_equal(stat(path, &status), 0);
    session_date(status.st_mtime, written);
    snprintf(report, sizeof report, "%s report --quiet '%s'", SELDINGER_PROGRAM, path);
    assert_int_equal(system(report), 0);
    assert_true(session_load(in_folder("undated.json"), &session, &faults));
    assert_string_equal(session.date, written);
    simulator_destroy(simulator);
    trainer_scene_close(&it);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_folder_is_made_where_it_is_wanted), cmocka_unit_test(what_is_no_folder_is_refused),
                                       cmocka_unit_test(no_name_is_taken_twice), cmocka_unit_test(the_session_file_is_of_its_recording),
                                       cmocka_unit_test(a_wrong_date_is_replaced)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

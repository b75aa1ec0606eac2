// Recordings: what is read back is what was simulated; a kill at any time leaves a file that opens, whole up to its last flush; so does a full disk.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/drive.h"
#include "sim/recording.h"

#include <hdf5.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static Faults faults;
static char folder[] = "/tmp/seldinger-recording-XXXXXX";

static const char scene_text[] = "seldinger: 1\n"
                                 "wire: {elements: 20, sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 20}\n"
                                 "rig: {gravity_m_s2: [0, 0, -9.81]}\n"
                                 "script: [[0, 10, 90], [0.2, -5, 0], [0.4, 0, 0]]\n";

static Simulator *make_simulator(Scene **scene)
{
    faults_clear(&faults);
    *scene = scene_parse(scene_text, strlen(scene_text), "r.yaml", &faults);
    Simulator *simulator = *scene ? simulator_create(*scene, NULL, &faults) : NULL;
    if (!simulator)
        fail_msg("%s", faults.text[0]);
    return simulator;
}

enum { MOST_STEPS = 500 };
typedef struct Seen {
    Recording *recording;
    int steps;
    uint64_t hash[MOST_STEPS];
    Vec3 tip[MOST_STEPS];
    double inserted[MOST_STEPS];
    Command command[MOST_STEPS];
} Seen;

static bool see(void *context, Simulator *simulator, Command command)
{
    Seen *seen = context;
    const WireState *state = simulator_state(simulator);
    seen->hash[seen->steps] = simulator_hash(simulator);
    seen->tip[seen->steps] = state->position[state->node_count - 1];
    seen->inserted[seen->steps] = state->inserted;
    seen->command[seen->steps++] = command;
    return !seen->recording || recording_step(seen->recording, simulator, command);
}

static Seen run_once(const char *record)
{
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    options.expected_steps = 100;   // less than the run has: further chunks are made
    Seen seen = {.recording = record ? recording_create(record, simulator, &options, &faults) : NULL};
    if (record && !seen.recording)
        fail_msg("%s", faults.text[0]);
    DriveOptions drive = drive_default_options();
    drive.script = scene->script;
    drive.duration_s = 0.405;
    drive.after_step = see;
    drive.context = &seen;
    assert_int_equal(simulator_drive(simulator, &drive).end, DRIVE_DONE);
    if (record)
        assert_true(recording_close(seen.recording, simulator, &faults));
    simulator_destroy(simulator);
    scene_free(scene);
    return seen;
}

static void what_is_read_is_what_was_simulated(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/a.h5", folder);
    static Seen recorded, plain;
    recorded = run_once(path);
    plain = run_once(NULL);
    assert_int_equal(recorded.steps, 405);
    // the same run twice, with and without a recording, is the same bits
    assert_memory_equal(recorded.hash, plain.hash, sizeof *plain.hash * 405);

    RecordedRun *run = recorded_run_load(path, &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    assert_int_equal(run->step_count, 405);
    assert_int_equal(run->node_count, 21);
    assert_string_equal(run->scene_text, scene_text);
    // the first step, every tenth, and the last
    assert_int_equal(run->frame_count, 1 + 40 + 1);
    for (int i = 0; i < 405; i++) {
        assert_true(fabs(run->time_s[i] - 0.001 * (i + 1)) < 1e-12);
        assert_true(run->state_hash[i] == plain.hash[i]);
        assert_true(run->command[2 * i] == plain.command[i].push_mm_s && run->command[2 * i + 1] == plain.command[i].twist_deg_s);
    }
    for (int64_t k = 0; k < run->frame_count; k++) {
        int64_t step = run->frame_step[k];
        assert_int_equal(step, k == 0 ? 0 : k == 41 ? 404 : 10 * k - 1);
        assert_true(vec3_distance(run->position[k * 21 + 20], plain.tip[step]) == 0);
    }
    recorded_run_free(run);
}

// --- a child that records until it is ended ---

static void record_for_ever(const char *path)
{
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    options.flush_s = 0.02;   // ten times as often as in earnest: ten times the chance to be caught in a flush
    options.expected_steps = 2000;
    Recording *recording = recording_create(path, simulator, &options, &faults);
    int cursor = 0;
    for (int64_t i = 0; recording; i++) {
        Command command = script_at(scene->script, (double)(i % 400) / 1000, &cursor);
        simulator_step(simulator, command);
        if (!recording_step(recording, simulator, command))
            break;
    }
    _exit(9);
}

static void nap_ms(long ms) { nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL); }

// All rows that the file claims must have been written: an unwritten row is zero.
static int64_t check_rows(const char *path)
{
    faults_clear(&faults);
    RecordedRun *run = recorded_run_load(path, &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    for (int64_t i = 0; i < run->step_count; i++)
        if (fabs(run->time_s[i] - 0.001 * (double)(i + 1)) > 1e-9 * (double)(i + 1))
            fail_msg("row %lld of %lld holds the time %g", (long long)i, (long long)run->step_count, run->time_s[i]);
    for (int64_t i = 0; i < run->frame_count * run->node_count; i++) {
        Quat q = run->quaternion[i];
        if (fabs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) > 1e-9)
            fail_msg("frame %lld of %lld was not written", (long long)(i / run->node_count), (long long)run->frame_count);
    }
    int64_t steps = run->step_count;
    recorded_run_free(run);
    return steps;
}

static void a_kill_leaves_a_file_that_opens(void **state)
{
    (void)state;
    unsigned seed = 7;
    for (int trial = 0; trial < 20; trial++) {
        char path[256];
        snprintf(path, sizeof path, "%s/kill-%d.h5", folder, trial);
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0)
            record_for_ever(path);
        // the name appears with the first flush
        for (int waited = 0; access(path, F_OK) != 0 && waited < 10000; waited++)
            nap_ms(1);
        seed = seed * 1103515245 + 12345;
        nap_ms(seed / 65536 % 150);
        if (trial % 4 == 0)
            assert_true(check_rows(path) > 0);   // readable while it is written
        kill(child, SIGKILL);
        int status;
        waitpid(child, &status, 0);
        assert_true(WIFSIGNALED(status));
        // a reader that knows nothing of us: default access, locking on
        hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
        assert_true(file >= 0);
        H5Fclose(file);
        assert_true(check_rows(path) > 0);
        unlink(path);
        snprintf(path, sizeof path, "%s/kill-%d.h5.part-%ld", folder, trial, (long)child);
        assert_true(access(path, F_OK) != 0);
    }
}

static void a_full_disk_leaves_what_was_flushed(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/full.h5", folder);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        // no file may grow beyond 4 MB: writing fails as on a full disk
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &(struct rlimit){4 << 20, 4 << 20});
        Scene *scene;
        Simulator *simulator = make_simulator(&scene);
        RecordingOptions options = recording_default_options();
        options.flush_s = 0.02;
        options.expected_steps = 2000;
        Recording *recording = recording_create(path, simulator, &options, &faults);
        if (!recording)
            _exit(1);
        int64_t steps = 0;
        for (; steps < 1000000; steps++) {
            simulator_step(simulator, (Command){0, 0});
            if (!recording_step(recording, simulator, (Command){0, 0}))
                break;
        }
        bool closed = recording_close(recording, simulator, &faults);
        _exit(steps < 1000000 && !closed && faults.count == 1 && strstr(faults.text[0], "full.h5: recording stopped") ? 0 : 2);
    }
    int status;
    waitpid(child, &status, 0);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    assert_true(check_rows(path) > 2000);
}

static void what_is_no_recording_is_said(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/none.h5", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("nothing", file);
    fclose(file);
    faults_clear(&faults);
    assert_null(recorded_run_load(path, &faults));
    assert_null(recorded_run_load("/nowhere/x.h5", &faults));
    hid_t empty = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(empty);
    assert_null(recorded_run_load(path, &faults));
    assert_true(faults.count >= 3);
    faults_clear(&faults);
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    assert_null(recording_create("/nowhere/x.h5", simulator, &options, &faults));
    assert_int_equal(faults.count, 1);
    simulator_destroy(simulator);
    scene_free(scene);
}

static int make_folder(void **state)
{
    (void)state;
    recording_prepare_process();
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    char command[300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_read_is_what_was_simulated),
        cmocka_unit_test(a_kill_leaves_a_file_that_opens),
        cmocka_unit_test(a_full_disk_leaves_what_was_flushed),
        cmocka_unit_test(what_is_no_recording_is_said),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

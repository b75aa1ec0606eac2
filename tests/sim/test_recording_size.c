// The largest size of a recorded hour: hands that never rest move a tool of 120 elements deep in a vessel, recorded as in the trainer.
// test_recording_size SCENE.yaml S: the same in a scene, whose tools are pushed in for 10 s and moved for S seconds; prints the size of each dataset.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/open_vessel.h"
#include "sim/replay.h"

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

static Faults faults;
static char folder[] = "/tmp/seldinger-size-XXXXXX";
#include "tests/folder.h"
#include "tests/short_run.h"

static const char tube_text[] =
    "seldinger: 1\n"
    "wire: {elements: 120, sections: [{length_mm: 200, diameter_mm: 0.36, young_modulus_gpa: 60}, {length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 5, "
    "rest_curvature_1_mm: 0.1}]}\n"
    "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 1.5, path: [{line_mm: 20}, {arc: {radius_mm: 15, angle_deg: "
    "90}}, "
    "{line_mm: 10}, {arc: {radius_mm: 12, angle_deg: 120, plane_deg: 90}}, {line_mm: 15}, {arc: {radius_mm: 20, angle_deg: 90}}, {line_mm: 80}]}, "
    "contact: tube, friction: 0.04}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n";

// --- hands ---
static uint64_t state = 1;
static double uniform(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

// A joystick read at 125 Hz with 127 steps in each direction, up to 20 mm/s and 180 deg/s, that moves randomly with a correlation time of 0.3 s.
static ToolCommands hands_at(int64_t step, int tools, int64_t pushing)
{
    static ToolCommands held;
    static double stick[2 * TOOLS_MOST];
    for (int k = 0; step < pushing && k < tools; k++)
        held.tool[k] = (Command){12 + 12 * k, 0};
    for (int i = 0; step >= pushing && step % 8 == 0 && i < 2 * tools; i++) {
        double kick = 0, keep = exp(-0.008 / 0.3);
        for (int k = 0; k < 12; k++)
            kick += uniform() - 0.5;
        stick[i] = keep * stick[i] + sqrt(1 - keep * keep) * kick;
        double read = fmax(-127, fmin(127, rint(63 * stick[i]))) / 127;
        *(i % 2 ? &held.tool[i / 2].twist_deg_s : &held.tool[i / 2].push_mm_s) = read * (i % 2 ? 180 : 20);
    }
    return held;
}

// --- recording ---
static void nap_ms(long ms) { nanosleep(&(struct timespec){.tv_nsec = ms * 1000000}, NULL); }

static double length_of(const char *path)
{
    struct stat status;
    nap_ms(300);      // wait for reports in transit
    return stat(path, &status) == 0 ? (double)status.st_size : 0;
}

static herr_t print_size(hid_t file, const char *name, const H5O_info_t *info, void *context)
{
    if (info->type != H5O_TYPE_DATASET)
        return 0;
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    double bytes = (double)H5Dget_storage_size(set), hours = *(const double *)context / 3600;
    if (bytes / hours > 1e5)
        printf("  %-32s %8.1f MB an hour\n", name, bytes / hours / 1e6);
    H5Dclose(set);
    return 0;
}

// MB per hour, after the tools were pushed in.
static double record(const char *path, Scene *scene, const Vessel *vessel, double pushing_s, double moving_s)
{
    Simulator *simulator = simulator_create(scene, vessel, &faults);
    RecordingOptions options = recording_session_options();
    Recording *recording = simulator ? recording_create(path, simulator, &options, &faults) : NULL;
    if (!recording)
        fail_msg("%s", faults.text[0]);
    int64_t pushing = (int64_t)(pushing_s * 1000), steps = pushing + (int64_t)(moving_s * 1000);
    XrayControl xray = xray_default_control();
    double before = 0;
    for (int64_t i = 0; i < steps; i++) {
        ToolCommands commands = hands_at(i, scene->tool_count, pushing);
        if (i == pushing)
            before = length_of(path);
        simulator_step(simulator, &commands);
        assert_true(recording_step(recording, simulator, &commands, &xray));
    }
    double after = length_of(path);
    assert_true(recording_close(recording, simulator, &faults));
    simulator_destroy(simulator);
    return (after - before) / moving_s * 3600 / 1e6;
}

static const char *scene_path;
static double pushing_s = WHOLE_OR_SHORT(10, 2), seconds = WHOLE_OR_SHORT(20, 2);

static Scene *open_scene(void)
{
    faults_clear(&faults);
    Scene *scene = scene_path ? scene_load(scene_path, &faults) : scene_parse(tube_text, strlen(tube_text), "tube.yaml", &faults);
    if (!scene)
        fail_msg("%s", faults.text[0]);
    return scene;
}

static void an_hour_takes_at_most_200_mb(void **unused)
{
    (void)unused;
    OpenVessel open = {0};
    Scene *scene = open_scene();
    assert_true(open_vessel(scene, &(OpenVesselOptions){0}, &open, &faults) && open_vessel_inlet(scene, &open, &faults));
    clock_t from = clock();
    double mb = record(in_folder("size.h5"), scene, open.vessel, pushing_s, seconds);
    print_message("%.1f MB an hour (%.0f s, %.1f s of CPU time)\n", mb, pushing_s + seconds, (double)(clock() - from) / CLOCKS_PER_SEC);
    if (scene_path) {
        hid_t file = H5Fopen(in_folder("size.h5"), H5F_ACC_RDONLY, H5P_DEFAULT);
        H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, print_size, &(double){pushing_s + seconds});
        H5Fclose(file);
    } else {
        assert_true(mb < 200 && (!WHOLE_RUN || mb > 20));      // the hashes alone take 29
    }
    // and the session is simulated again from the recording
    RecordedRun *run = recorded_run_load(in_folder("size.h5"), &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    assert_int_equal(run->step_count, (int64_t)(1000 * (pushing_s + seconds)));
    assert_int_equal(run->frame_count, run->step_count / 10 + 1);
    Simulator *simulator = simulator_create(scene, open.vessel, &faults);
    int64_t some = scene_path ? -1 : WHOLE_OR_SHORT(8000, 2000);
    assert_int_equal(replay_verify(simulator, run, some, false, NULL, NULL).first_different, -1);
    simulator_destroy(simulator);
    recorded_run_free(run);
    open_vessel_close(&open);
    scene_free(scene);
}

int main(int count, char **argument)
{
    recording_prepare_process();
    if (count == 3) {
        scene_path = argument[1];
        seconds = atof(argument[2]);
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(an_hour_takes_at_most_200_mb)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
